"""A tool's docstring as HTML for the panel beside its dialog: flowing paragraphs, lists, and unchanged commands."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from typing import Any

FLAG = re.compile(r"--[a-z][a-z0-9-]*[a-z0-9]")
# The name of a tool with a hyphen, except in a path and in a full command: `slide-logs --trajectories`.
NAME = re.compile(r"(?<![\w/.-])[a-z]+(?:-[a-z]+)+(?![\w/-]|\.\w| --)")


def pieces(description: str) -> list[str]:
    """The paragraphs of a docstring, each as one text to be translated: one line, or one for each item of a list."""
    return [_flowing(part) for part in description.split("\n\n") if part.strip()]


def _flowing(text: str) -> str:
    return text if text.startswith("    ") else re.sub(r"\s*\n(?!- )\s*", " ", text)


def part_name(part: str) -> str:
    """The name of a part of a result: its layer's, or its file's."""
    return part.partition("|layername=")[2] or part.rpartition("/")[2].partition(".")[0]


def output_names(tool: dict[str, Any]) -> dict[str, str]:
    """The name of each part of a tool's outputs among its results: a layer's, or its file's if several files have such
    a layer; of several alike (a map as raster, picture and facts) the first keeps the name, and the others add what
    kind of file they are.
    """
    parts = [part for declared in tool["parameters"] for part in declared["parts"]]
    found: dict[str, str] = {}
    for part in parts:
        name = short_name(part, parts).upper()
        taken = name in found.values()
        found[part] = f"{name}_{ending_of(part).upper()}" if taken else name
    return found


def output_labels(tool: dict[str, Any], words: Callable[[str], str]) -> dict[str, str]:
    """The label of each part in models, from a title's ``words``; of several alike all but the first say their kind."""
    parts, found = list(output_names(tool)), {}
    for part in parts:
        label = words(short_name(part, parts))
        found[part] = f"{label} ({ending_of(part).upper()})" if label in found.values() else label
    return found


def short_name(part: str, parts: Sequence[str]) -> str:
    layers = [each for each in parts if "|layername=" in each and part_name(each) == part_name(part)]
    return part_name(part.partition("|")[0] if part in layers and len(layers) > 1 else part)


def ending_of(part: str) -> str:
    return part.partition("|")[0].rpartition(".")[2]


def title(part: str) -> str:
    return part_name(part).replace("_", " ").capitalize()


def labelled(message: str, tool: dict[str, Any]) -> str:
    """A line of the tool in the dialog's words: labels instead of flags and tools, except in a proposed command."""
    said, command, rest = message.partition("deadwood-tool ")
    return _in_words(said, {typed: f"'{label}'" for typed, label in _names(tool).items()}) + command + rest


def paragraphs(tool: dict[str, Any]) -> list[str]:
    """One piece of HTML for each paragraph, without commands to type; flags and tools get the names that the dialogs
    have for them.
    """
    names = {typed: f"<i>{html.escape(label, quote=False)}</i>" for typed, label in _names(tool).items()}
    return [_paragraph(part, names) for part in pieces(tool["description"]) if not part.startswith("    ")]


def _paragraph(text: str, names: dict[str, str]) -> str:
    text = html.escape(re.sub(r"``?([^`]+)``?", r"\1", text), quote=False)
    return re.sub(r"\n- ", "<br>- ", _in_words(text, names))


def _in_words(text: str, names: dict[str, str]) -> str:
    for pattern in (FLAG, NAME):
        text = pattern.sub(lambda found: names.get(found[0], found[0]), text)
    return text


def _names(tool: dict[str, Any]) -> dict[str, str]:
    """The labels of the tool's flags, and of the tools of QGIS (``others``, which the provider adds)."""
    return {each["flag"]: each["label"] for each in tool["parameters"]} | tool.get("others", {})
