"""Which layer of the map a dialog proposes for an input that it requires: one that is named like it, or none.

QGIS proposes the first layer of the right geometry, so that barriers would stand where roads are asked for.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .help_text import part_name

STEM = 4  # letters in which two words agree that mean the same: Road, Roads; Strasse, Strassen
LAYERS = ("raster", "vector", "table")
# Words of names and labels that say nothing about the content of a layer.
EMPTY = frozenset({"from", "with", "without", "their", "both", "layer", "folder", "points", "single", "model", "lines"})


def kinds(tools: Iterable[Mapping[str, Any]]) -> dict[str, list[str]]:
    """The names of all inputs and of all layers in results, each with its labels."""
    found: dict[str, list[str]] = {}
    for tool in tools:
        for declared in tool["parameters"]:
            if declared["widget"] in LAYERS:
                found.setdefault(declared["name"], []).append(declared["label"])
            for part in declared["parts"]:
                found.setdefault(part_name(part), [])
    return found


def likeness(name: str, labels: Sequence[str], title: str, source: str) -> int:
    """How much a layer, by its title in the map and its source, is named like an input; 0: not at all."""
    inner = re.search(r"\|layername=([^|]+)", source)
    file = re.split(r"[\\/]", source.partition("|")[0])[-1].partition(".")[0]
    own = (inner[1] if inner else file).lower()
    if own == name:
        return 3
    if _stems(title) & _stems(name) or name == title.lower():
        return 2
    return int(bool((_stems(title) | _stems(own)) & {stem for each in labels for stem in _stems(each)}))


def proposed(name: str, known: Mapping[str, Sequence[str]], layers: Sequence[tuple[str, str]]) -> int | None:
    """The number of the layer (title, source) to propose for an input; None if it is for the user to say."""
    best: tuple[int, int | None] = (0, None)
    unclaimed = []
    for number, (title, source) in enumerate(layers):
        own = likeness(name, known.get(name, ()), title, source)
        others = (likeness(each, labels, title, source) for each, labels in known.items() if each != name)
        if max(others, default=0) > own:
            continue
        unclaimed.append(number)
        if own > best[0]:
            best = own, number
    if best[1] is None and len(unclaimed) == 1:
        return unclaimed[0]
    return best[1]


def _stems(text: str) -> set[str]:
    words = re.findall(r"[^\W\d_]{3,}", text.lower())
    return {word[:STEM] for word in words if word not in EMPTY}
