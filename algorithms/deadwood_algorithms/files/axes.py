"""Which columns of a table hold the coordinates, by their names: x and y, E-Koordinate, Coord. N, Längengrad, Est."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from deadwood_algorithms.files.units import factor, named

# Pairs of whole names, in the order in which they are looked for.
XY_NAMES = (
    ("x", "y"),
    ("easting", "northing"),
    ("east", "north"),
    ("e", "n"),
    ("east_m", "north_m"),
    ("x_m", "y_m"),
    ("rechtswert", "hochwert"),
    ("est", "nord"),
    ("lon", "lat"),
    ("tree_x", "tree_y"),
)
# Otherwise what remains of a name without the words of `BESIDE`: for the easting, and for the northing.
AXES = (
    (("x",), ("y",)),
    (("e", "east", "easting", "ost", "est", "este"), ("n", "north", "northing", "nord", "norte")),
    (("rechts", "rechtswert"), ("hoch", "hochwert")),
    (
        ("lon", "long", "lng", "longitude", "longitudine", "longitud", "längengrad", "laengengrad", "geogr. länge"),
        ("lat", "latitude", "latitudine", "latitud", "breitengrad", "geogr. breite"),
    ),
)
DEGREES = AXES[-1]
BESIDE = re.compile(
    r"koord(inaten?)?|coord(inates?|inata|inate|onn[ée]es?)?|ko|wert|pos|point|tree|baum|arbre|albero"
    r"|l[vn]?9[35]|lv03|mn03|l2|ch1903|utm(\d\d[a-z]?)?|gk\d*|wgs84|etrs89|epsg\d*|\d{4,5}|dd|in|m|km|cm|mm|°|deg|gps"
)


class Axes(NamedTuple):
    """The columns of the easting and the northing, the factor that makes them metres, and whether they are degrees."""

    x: object
    y: object
    factors: tuple[float, float]
    degrees: bool


def axes_of(columns: Iterable[object]) -> Axes | None:
    """The columns of the coordinates; None if there is no such pair of names, or more than one."""
    names = {str(column).strip().lower(): column for column in columns}
    plain = dict(names)
    for each in names:  # X [m], Y (LV95)
        plain.setdefault(re.sub(r"\s*[\[(].*[\])]$", "", each), names[each])
    for x, y in XY_NAMES:
        if x in plain and y in plain:
            return _axes(plain[x], plain[y], (x, y) == ("lon", "lat"))
    for x_words, y_words in AXES:
        x, y = _only(names, x_words), _only(names, y_words)
        if x is not None and y is not None:
            return _axes(names[x], names[y], x_words is DEGREES[0])
    return None


def _axes(x: object, y: object, degrees: bool) -> Axes:
    times = [1.0 if degrees else factor(named(each).unit, "m") or 1.0 for each in (x, y)]
    return Axes(x, y, (times[0], times[1]), degrees)


def _only(names: Iterable[str], words: tuple[str, ...]) -> str | None:
    """The only name of such an axis; one with the word coordinate takes precedence over ambiguous ones (N.)."""
    found = {name: said for name in names if (said := _axis(name, words)) is not None}
    if len(found) > 1:
        found = {name: said for name, said in found.items() if said} or {
            name: said for name, said in found.items() if len(re.sub(r"\W", "", name)) > 1
        }
    return next(iter(found)) if len(found) == 1 else None


def _axis(name: str, words: tuple[str, ...]) -> bool | None:
    """None if the name is no such axis, otherwise whether other words in it confirm that it is."""
    if name in words:
        return False
    parts = [part for part in re.split(r"[\W_]+", re.sub(r"(?<=[a-z])(?=koord|coord)", " ", name)) if part]
    left = [part for part in parts if not BESIDE.fullmatch(part)]
    return len(parts) > 1 if len(left) == 1 and left[0] in words else None
