"""Markup from text: the one place where text becomes HTML, so that no name of a layer ever becomes markup."""

from __future__ import annotations

import base64
import html
import io
import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

QUALITY = 78
LONG = 45  # letters of a cell, from which on it is a sentence


class Markup(str):
    """Text that is markup already; all else is escaped when it is put into a page."""

    __slots__ = ()


def escaped(text: Any) -> Markup:
    return text if isinstance(text, Markup) else Markup(html.escape(str(text), quote=True))


def element(tag: str, *inside: Any, **attributes: Any) -> Markup:
    """``<tag a="b">...</tag>``; a trailing underscore of a name falls away, others become hyphens (class_, data_x)."""
    shown = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{html.escape(str(value), quote=True)}"'
        for name, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{tag}{shown}>{''.join(escaped(each) for each in inside)}</{tag}>")


def joined(parts: Iterable[Any]) -> Markup:
    return Markup("".join(escaped(each) for each in parts))


def table(head: Sequence[Any], rows: Iterable[Sequence[Any]], caption: str | None = None) -> Markup:
    """A table that scrolls on a narrow screen; the first column is text, the others stand to the right."""
    rows = list(rows)
    # a column with whole sentences stands to the left, its head too
    kinds = ["text" if any(len(str(row[k])) > LONG for row in rows) else None for k in range(len(head))]
    top = element(
        "tr", *(element("th", each, scope="col", class_=kind) for each, kind in zip(head, kinds, strict=True))
    )
    body = [
        element(
            "tr",
            element("th", row[0], scope="row"),
            *(element("td", each, class_=kind) for each, kind in zip(row[1:], kinds[1:], strict=True)),
        )
        for row in rows
    ]
    title = [element("caption", caption)] if caption else []
    return element("div", element("table", *title, element("thead", top), element("tbody", *body)), class_="scroll")


def figure_of(drawing: Any, caption: str = "") -> Markup:
    """A drawing (`figures.Drawing`) with its caption; nothing for None."""
    if drawing is None:
        return Markup("")
    return element("figure", drawing.inline(), element("figcaption", caption) if caption else "")


def embedded_json(content: Any) -> Markup:
    """JSON that may stand in a script element: no ``<`` in it can end that."""
    text = json.dumps(plain_numbers(content), ensure_ascii=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


def picture_address(image: Any) -> str:
    """A Pillow image as a data address: WebP, which is a fifth of a PNG of relief, and which every browser shows."""
    out = io.BytesIO()
    image.save(out, "WEBP", quality=QUALITY, method=4)
    return "data:image/webp;base64," + base64.b64encode(out.getvalue()).decode("ascii")


def plain_numbers(value: Any) -> Any:
    """With null for what is no number, because NaN is no JSON."""
    if isinstance(value, dict):
        return {str(key): plain_numbers(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_numbers(each) for each in value]
    if hasattr(value, "item") and not hasattr(value, "__len__"):
        return plain_numbers(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
