"""QGIS's language: texts from the catalogues in ``locale``; missing ones stay English.

The catalogues hold the plugin's own texts and those of the tools' declarations. Names that are typed (tools, flags,
choices, files, columns) are never translated.
"""

from __future__ import annotations

import gettext
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication

from .help_text import pieces, title

START = "Start"  # the group of the first steps
LOCALE = Path(__file__).parent / "locale"


@lru_cache(maxsize=1)
def catalogue() -> gettext.NullTranslations:
    """The catalogue of QGIS's language, such as ``de`` or ``de_CH``."""
    return gettext.translation("plugin", LOCALE, [QgsApplication.locale()], fallback=True)


def _(english: str) -> str:
    """A text in QGIS's language; placeholders such as ``{name}`` are filled in afterwards."""
    return catalogue().gettext(english) if english else ""


def is_english() -> bool:
    """Whether there is no catalogue of QGIS's language."""
    return type(catalogue()) is gettext.NullTranslations


def signs(number: str) -> str:
    """A number as Python writes it, with the decimal sign of the texts around it; not for what is typed."""
    return number if is_english() else number.replace(".", ",")


def title_of(part: str) -> str:
    """The name of a layer or file of a result in the map and in models."""
    return _(title(part))


def group_label(name: str) -> str:
    """A group of the toolbox; QGIS sorts them by name, so that the number keeps them in the order of the work."""
    shown = {START: _("Start here"), "Prepare": _("Prepare"), "Simulate": _("Simulate"), "Evaluate": _("Evaluate")}
    return f"{list(shown).index(name) + 1} · {shown[name]}"


def translated(tool: dict[str, Any], tools: Iterable[dict[str, Any]] = ()) -> dict[str, Any]:
    """A tool's declaration with all visible texts in QGIS's language, and the names of the tools in the toolbox."""
    others = {each["name"]: each["label"] for each in tools if each["qgis_id"]}
    parameters = [
        {**each, **{name: _(each[name]) for name in ("label", "help", "unit")}} for each in tool["parameters"]
    ]
    return {
        **tool,
        **{name: _(tool[name]) for name in ("label", "summary")},
        "group": group_label(tool["group"]),
        "group_id": tool["group"].lower(),
        "description": "\n\n".join(_(each) for each in pieces(tool["description"])),
        "parameters": parameters,
        "others": {name: _(label) for name, label in others.items()},
    }
