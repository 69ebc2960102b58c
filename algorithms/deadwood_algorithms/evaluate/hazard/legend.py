"""Names and colours of the classes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

Rows = list[tuple[int, str, str]]  # value, colour, label
WARM = ("#fee0b6", "#fdb863", "#e66101", "#b2182b", "#67001f")
COLD = ("#d0d1e6", "#67a9cf", "#02818a", "#01382e")
# Corners of the matrix: weak and rare, weak and frequent, strong and rare, strong and frequent (Stevens 2015). They are
# not those of a hazard map, because which degree of hazard a field stands for is not for the tool to decide.
CORNERS = (("#e8e8e8", "#64acbe"), ("#c85a5a", "#574249"))


def ranges_of(bounds: Sequence[float]) -> list[tuple[float | None, float | None]]:
    """Both ends of each class between the given bounds; None for an open end."""
    return list(pairwise([None, *bounds, None]))


def rising_labels(bounds: Sequence[float], unit: str) -> list[str]:
    """``below 30 kJ``, ``30 to 300 kJ``, ``300 kJ and more``."""
    between = [f"{low:g} to {high:g} {unit}" for low, high in pairwise(bounds)]
    return [f"below {bounds[0]:g} {unit}", *between, f"{bounds[-1]:g} {unit} and more"]


def period_labels(bounds: Sequence[float]) -> list[str]:
    """``up to 30 years``, ``30 to 100 years``, ``over 300 years``."""
    between = [f"{low:g} to {high:g} years" for low, high in pairwise(bounds)]
    return [f"up to {bounds[0]:g} years", *between, f"over {bounds[-1]:g} years"]


def class_rows(labels: Sequence[str], ramp: tuple[str, ...]) -> Rows:
    """A class each, in colours at even steps along the ramp."""
    places = np.linspace(0.0, len(ramp) - 1.0, len(labels))
    parts = [np.interp(places, range(len(ramp)), part) for part in zip(*map(_rgb, ramp), strict=True)]
    colours = [_hex(each) for each in zip(*parts, strict=True)]
    return [(k, colour, label) for k, (colour, label) in enumerate(zip(colours, labels, strict=True), 1)]


def matrix_rows(strong: Sequence[str], often: Sequence[str], *, rarest_first: bool) -> Rows:
    """One row for each field; its value is 10 times the class of intensity plus the other class."""
    rows = []
    for i, intensity in enumerate(strong):
        for j, other in enumerate(often):
            s, t = i / max(len(strong) - 1, 1), j / max(len(often) - 1, 1)
            colour = mixed(s, t if rarest_first else 1.0 - t)
            rows.append((10 * (i + 1) + j + 1, colour, f"{intensity}, {other}"))
    return rows


def mixed(strong: float, often: float) -> str:
    """The colour of a field, interpolated between those of the corners."""
    corners = np.array([[_rgb(each) for each in row] for row in CORNERS], float)
    a, b = (corners[k, 0] + often * (corners[k, 1] - corners[k, 0]) for k in (0, 1))
    return _hex(a + strong * (b - a))


def _hex(parts: Iterable[float]) -> str:
    return "#" + "".join(f"{round(each):02x}" for each in parts)


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[k : k + 2], 16) for k in (1, 3, 5))
