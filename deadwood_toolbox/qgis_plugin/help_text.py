"""A tool's docstring as HTML for the panel beside its dialog: flowing paragraphs, lists, and unchanged commands."""

from __future__ import annotations

import html
import re
from typing import Any

FLAG = re.compile(r"--[a-z][a-z0-9-]*[a-z0-9]")


def pieces(description: str) -> list[str]:
    """The paragraphs of a docstring, each as one text to be translated: one line, or one for each item of a list."""
    return [_flowing(part) for part in description.split("\n\n") if part.strip()]


def _flowing(text: str) -> str:
    return text if text.startswith("    ") else re.sub(r"\s*\n(?!- )\s*", " ", text)


def part_name(part: str) -> str:
    """The name of a part of a result: its layer's, or its file's."""
    return part.partition("|layername=")[2] or part.rpartition("/")[2].partition(".")[0]


def title(part: str) -> str:
    return part_name(part).replace("_", " ").capitalize()


def labelled(message: str, tool: dict[str, Any]) -> str:
    """A line of the tool in the dialog's words: labels instead of flags, except in a proposed command."""
    said, command, rest = message.partition("deadwood-tool ")
    names = {each["flag"]: f"'{each['label']}'" for each in tool["parameters"]}
    return FLAG.sub(lambda found: names.get(found[0], found[0]), said) + command + rest


def paragraphs(tool: dict[str, Any]) -> list[str]:
    """One piece of HTML for each paragraph; a flag of the command line gets the name that the dialog has for it."""
    return [_paragraph(part, _names(tool)) for part in pieces(tool["description"])]


def _paragraph(text: str, names: dict[str, str]) -> str:
    if text.startswith("    "):
        return f"<pre>{html.escape(text)}</pre>"
    text = html.escape(re.sub(r"``?([^`]+)``?", r"\1", text), quote=False)
    text = FLAG.sub(lambda found: names.get(found[0], found[0]), text)
    return re.sub(r"\n- ", "<br>- ", text)


def _names(tool: dict[str, Any]) -> dict[str, str]:
    return {each["flag"]: f"<i>{html.escape(each['label'], quote=False)}</i>" for each in tool["parameters"]}
