"""Descriptions of layers, rasters, tables and JSON files, and the check of a single value."""

from __future__ import annotations

import math
from dataclasses import dataclass

FULL_CIRCLE = 360.0


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column; ``kind`` is int, number, text, or id (a whole number or text)."""

    name: str
    kind: str
    meaning: str
    unit: str = ""
    unit_in_name: str = ""
    minimum: float | None = None
    maximum: float | None = None
    exclusive: bool = False  # the minimum itself is not allowed
    least: float | None = None  # values between the minimum and this are not sizes of the object
    required: bool = False
    choices: tuple[str, ...] = ()
    usual: tuple[float, float] | None = None  # a median below, or a value above, is more likely a wrong unit
    default: float | str | None = None  # the value of a missing column, from the tool's option of that name


@dataclass(frozen=True, kw_only=True)
class Layer:
    """One layer; ``geometry`` lists the possible kinds, as named by the file format."""

    name: str
    geometry: tuple[str, ...]
    meaning: str
    columns: tuple[Column, ...]
    keeps_source: bool = False  # it also has all columns of the layer from which it was made

    def column(self, name: str) -> Column:
        return next(each for each in self.columns if each.name == name)

    @property
    def required(self) -> tuple[str, ...]:
        return tuple(each.name for each in self.columns if each.required)


@dataclass(frozen=True, kw_only=True)
class Band:
    """One band of a raster; ``name`` is its description in the file, empty if the file has none."""

    name: str
    meaning: str
    unit: str = ""
    number: str = "float32"  # the type of its numbers


@dataclass(frozen=True, kw_only=True)
class RasterFile:
    """A GeoTIFF; ``look`` is that of its first band, a name of `looks`, empty if it has a legend of classes."""

    name: str
    meaning: str
    bands: tuple[Band, ...]
    look: str = ""


@dataclass(frozen=True, kw_only=True)
class TableFile:
    """A CSV file."""

    name: str
    meaning: str
    columns: tuple[Column, ...]


@dataclass(frozen=True, kw_only=True)
class Key:
    """A value in a JSON file, by its dotted name; ``[]`` is any element of a list. ``whole``: with everything below
    it.
    """

    name: str
    meaning: str
    whole: bool = False


@dataclass(frozen=True, kw_only=True)
class JsonFile:
    """A JSON file."""

    name: str
    meaning: str
    keys: tuple[Key, ...]


@dataclass(frozen=True, kw_only=True)
class OtherFile:
    """A file without columns, bands or keys of the toolbox: a picture, a solid, a project."""

    name: str
    meaning: str


@dataclass(frozen=True, kw_only=True)
class Output:
    """One thing that a tool writes, and where.

    ``place`` is a name in the tool's folder, or the flag that names the file; ``|layername=`` names a layer in it.
    A word in capitals stands for any text, here and in the names of columns, bands and keys: ``reach_LINE``.
    """

    tool: str
    place: str
    what: Layer | RasterFile | TableFile | JsonFile | OtherFile


# Unit after the last underscore of a name -> unit as shown. The rule is that units are in the name.
UNITS = {
    "cm": "cm",
    "m": "m",
    "kg_m3": "kg/m³",
    "m2": "m²",
    "m3": "m³",
    "deg": "°",
    "ms": "m/s",
    "s": "s",
    "kj": "kJ",
    "kns": "kN s",
    "rel": "1",
    "rad_s": "rad/s",
    "years": "a",
}


def a_number(name: str, meaning: str, low: float | None = None, high: float | None = None, **facts: object) -> Column:
    ending = next((each for each in sorted(UNITS, key=len, reverse=True) if name.endswith("_" + each)), "")
    unit = facts.pop("unit", UNITS.get(ending, ""))
    return Column(
        name=name,
        kind="number",
        meaning=meaning,
        unit=str(unit),
        unit_in_name=ending,
        minimum=low,
        maximum=high,
        **facts,  # type: ignore[arg-type]
    )


def a_count(name: str, meaning: str, low: float | None = 0, **facts: object) -> Column:
    return Column(name=name, kind="int", meaning=meaning, minimum=low, **facts)  # type: ignore[arg-type]


def an_id(name: str, meaning: str, **facts: object) -> Column:
    return Column(name=name, kind="id", meaning=meaning, **facts)  # type: ignore[arg-type]


def a_text(name: str, meaning: str, **facts: object) -> Column:
    return Column(name=name, kind="text", meaning=meaning, **facts)  # type: ignore[arg-type]


def value_fault(column: Column, value: object) -> str | None:
    """What is wrong with one value, or None; a number is checked against its bounds, a text against its choices."""
    if column.choices and value not in column.choices:
        return f"'{value}' is not one of {', '.join(column.choices)}"
    if column.kind not in ("number", "int"):
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return f"'{value}' is not a finite number"
    if column.kind == "int" and value != int(value):
        return f"{value:g} is not a whole number"
    if column.minimum is not None and (value < column.minimum or (column.exclusive and value == column.minimum)):
        return f"{value:g} is not {'greater than' if column.exclusive else 'at least'} {column.minimum:g}"
    if column.maximum is not None and value > column.maximum:
        return f"{value:g} is not at most {column.maximum:g}"
    return None
