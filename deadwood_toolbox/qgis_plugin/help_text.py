"""A tool's docstring as HTML for the panel beside its dialog: flowing paragraphs, lists, and commands as they stand."""

from __future__ import annotations

import html
import re
from typing import Any


def paragraphs(told: dict[str, Any]) -> list[str]:
    """One piece of HTML for each paragraph; a flag of the command line gets the name that the dialog has for it."""
    return [_paragraph(part, _names(told)) for part in told["description"].split("\n\n") if part.strip()]


def _paragraph(text: str, names: dict[str, str]) -> str:
    if text.startswith("    "):
        return f"<pre>{html.escape(text)}</pre>"
    text = html.escape(re.sub(r"``?([^`]+)``?", r"\1", text), quote=False)
    text = re.sub(r"--[a-z][a-z-]*[a-z]", lambda found: names.get(found[0], found[0]), text)
    return re.sub(r"\n- ", "<br>- ", text).replace("\n", " ")


def _names(told: dict[str, Any]) -> dict[str, str]:
    return {each["flag"]: f"<i>{html.escape(each['label'], quote=False)}</i>" for each in told["parameters"]}
