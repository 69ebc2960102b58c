"""Markup from text: the one place where text becomes HTML, so that no name of a layer ever becomes markup."""

from __future__ import annotations

import base64
import html
import io
import json
import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

QUALITY = 78
LONG = 45  # length of a cell from which it counts as a sentence
NBSP = "\u00a0"
SHORT = 8  # tables up to this number of rows are not split between pages


class Markup(str):
    """Text that is already markup; everything else is escaped when it is inserted into a page."""

    __slots__ = ()


def escaped(text: Any) -> Markup:
    return text if isinstance(text, Markup) else Markup(html.escape(str(text), quote=True))


def element(tag: str, *inside: Any, **attributes: Any) -> Markup:
    """``<tag a="b">...</tag>``; a trailing underscore of a name is dropped, others become hyphens (class_, data_x)."""
    shown = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{html.escape(str(value), quote=True)}"'
        for name, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{tag}{shown}>{''.join(escaped(each) for each in inside)}</{tag}>")


def joined(parts: Iterable[Any]) -> Markup:
    return Markup("".join(escaped(each) for each in parts))


def table(head: Sequence[Any], rows: Iterable[Sequence[Any]], caption: str | None = None) -> Markup:
    """A table that scrolls on a narrow screen; the first column is text, the others are right-aligned."""
    rows = list(rows)
    # a column of sentences is left-aligned, including its header
    kinds = ["text" if any(len(as_read(row[k])) > LONG for row in rows) else None for k in range(len(head))]
    cells = (element("th", whole_unit(each), scope="col", class_=kind) for each, kind in zip(head, kinds, strict=True))
    top = element("tr", *cells)
    body = [
        element(
            "tr",
            element("th", whole_unit(row[0]), scope="row"),
            *(element("td", two_lines(each), class_=kind) for each, kind in zip(row[1:], kinds[1:], strict=True)),
        )
        for row in rows
    ]
    title = [element("caption", caption)] if caption else []
    whole = element("table", *title, element("thead", top), element("tbody", *body))
    return scrolled(whole, caption or str(head[0]), short=len(rows) <= SHORT)


def as_read(cell: Any) -> str:
    """The text of a cell, without its markup."""
    return re.sub("<[^>]*>", "", cell) if isinstance(cell, Markup) else str(cell)


def whole_unit(name: Any) -> Any:
    """A name whose unit, ``[kN s]``, is not torn at the end of a line."""
    if isinstance(name, Markup):
        return name
    return re.sub(r"\[[^]]*\]", lambda unit: unit[0].replace(" ", NBSP), str(name))


def two_lines(cell: Any) -> Any:
    """A number with its interval, ``12.1 (11.0 to 13.3)``, without a line break in either; other text unchanged."""
    value, bracket, rest = str(cell).partition(" (")
    if isinstance(cell, Markup) or not bracket or not rest.endswith(")") or len(str(cell)) > LONG:
        return cell
    return joined([element("span", value), " ", element("span", f"({rest}", class_="ci")])


def remarked(number: str, remark: str) -> Markup:
    """A number with a remark in brackets, which takes as many lines as its column has room for."""
    return joined([element("span", number), " ", element("span", f"({remark})", class_="quiet")])


def scrolled(inside: Any, name: str, *, short: bool = True) -> Markup:
    """A table that scrolls on a narrow screen, also with the keyboard; a short one is not split between pages."""
    return element("div", inside, class_="scroll short" if short else "scroll", tabindex="0", **labelled(name))


def figure_of(drawing: Any, caption: str = "", *, card: bool = False) -> Markup:
    """A drawing (`figures.Drawing`) with its caption; empty for None. A map lies on a ``card``, which stays pale in
    dark mode, like its relief. On a narrow screen the figure scrolls, also with the keyboard."""
    if drawing is None:
        return Markup("")
    frame = element(
        "div", drawing.inline(), class_="card" if card else "frame", tabindex="0", **labelled(drawing.title)
    )
    return element("figure", frame, element("figcaption", caption) if caption else "")


def labelled(name: str) -> dict[str, str]:
    """Attributes that name a scrolling part for screen readers; not as a landmark, because too many landmarks are no
    help.
    """
    return {"role": "group", "aria_label": name}


def embedded_json(content: Any) -> Markup:
    """JSON that is safe in a script element: no ``<`` in it can end the element."""
    text = json.dumps(plain_numbers(content), ensure_ascii=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


def picture_address(image: Any) -> str:
    """A Pillow image as a data address: WebP, which takes a fifth of the size of a PNG of relief, and which every
    browser supports.
    """
    out = io.BytesIO()
    image.save(out, "WEBP", quality=QUALITY, method=4)
    return "data:image/webp;base64," + base64.b64encode(out.getvalue()).decode("ascii")


def plain_numbers(value: Any) -> Any:
    """Replace values that are not numbers by None, because NaN is not JSON."""
    if isinstance(value, dict):
        return {str(key): plain_numbers(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_numbers(each) for each in value]
    if hasattr(value, "item") and not hasattr(value, "__len__"):
        return plain_numbers(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
