"""Units as people write them in the names of fields: Höhe (m), BHD [cm], height_ft, Länge / m, Dichte [g/cm³].

A field is recognised if its name without the unit is one of a column's names, and its unit is of the right kind.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import Feedback

if TYPE_CHECKING:
    import pandas

# Factors of other units, by the unit that counts as 1.
KINDS: dict[str, dict[str, float]] = {
    "m": {"mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0, "km": 1000.0, "in": 0.0254, "ft": 0.3048},
    "kg/m³": {
        "kg/m³": 1.0,
        "kg/m3": 1.0,
        "kg m-3": 1.0,
        "g/cm³": 1000.0,
        "g/cm3": 1000.0,
        "t/m³": 1000.0,
        "t/m3": 1000,
    },
    "m/s": {"m/s": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6},
    "°": {"°": 1.0, "deg": 1.0, "gon": 0.9, "rad": 57.29577951308232},
}
WORDS = {"meter": "m", "metre": "m", "meters": "m", "metres": "m", "mètre": "m", "mètres": "m", "metri": "m"}
WORDS |= {"centimeter": "cm", "centimetre": "cm", "zentimeter": "cm", "centimeters": "cm", "centimetres": "cm"}
WORDS |= {"millimeter": "mm", "millimetre": "mm", "millimeters": "mm", "millimetres": "mm"}
WORDS |= {"inch": "in", "inches": "in", "zoll": "in", '"': "in", "feet": "ft", "foot": "ft", "fuss": "ft", "fuß": "ft"}
WORDS |= {"'": "ft", "us-ft": "ft", "ftus": "ft", "degree": "°", "degrees": "°", "grad": "°"}
# Usable height of a net.
USEFUL_HEIGHT = ("nutzhöhe", "nutzhoehe", "werkshöhe", "werkshoehe", "hauteur_utile", "altezza_utile")
# Alternative names of columns, without the unit.
ALSO = {
    "dbh": ("bhd", "dhp", "brusthöhendurchmesser"),
    "diameter": ("dbh", "bhd", "dhp", "durchmesser", "diamètre", "diametro"),
}
ALSO |= {
    "height": ("höhe", "hoehe", "hauteur", "altezza", *USEFUL_HEIGHT),
    "length": ("länge", "laenge", "longueur", "lunghezza"),
}
ALSO |= {"density": ("dichte", "rohdichte", "densité", "densità"), "speed": ("geschwindigkeit", "vitesse", "velocità")}
ALSO |= {"azimuth": ("azimut",), "tilt": ("neigung",)}
IN_METRES = ("barriers",)  # layers whose lengths are in metres if the name of the field has no unit
BRACKETED = re.compile(r"(.*?)[\s_]*[\[({]\s*([^\])}]*?)\s*[\])}]")
APART = re.compile(r"(.*?)(?:\s*[,/]\s*|\s+)(?:in\s+)?(mm|cm|dm|m|in|ft|°|kg/m[3³]|m/s|km/h)")
JOINED = re.compile(r"(.*?)_(mm|cm|dm|m|in|ft)")


class Named(NamedTuple):
    """A field's name without its unit, in lower case; the unit, empty if unknown; the text in brackets."""

    plain: str
    unit: str = ""
    word: str = ""


def named(field: object, *, joined: bool = True) -> Named:
    """Split the name of a field; with ``joined`` also ``height_ft``, whose unit is joined to the name."""
    text = str(field).strip().lower()
    for pattern in (BRACKETED, APART, JOINED) if joined else (BRACKETED, APART):
        match = pattern.fullmatch(text)
        if match and match[1]:
            word = re.sub(r"^in\s+", "", match[2])
            word = WORDS.get(word, word)
            return Named(match[1].strip(), word if any(word in kind for kind in KINDS.values()) else "", word)
    return Named(text)


def factor(unit: str, target: str) -> float | None:
    """Factor from a unit to the target unit; None if they are not of the same kind."""
    kind = next((each for each in KINDS.values() if unit in each and target in each), None)
    return kind[unit] / kind[target] if kind else None


def scaled(column: pandas.Series, times: float) -> pandas.Series:
    """A column multiplied by a factor; cells that are not numbers are kept, so that a message can name them."""
    import pandas

    if times == 1.0:
        return column
    numbers = pandas.Series(pandas.to_numeric(column, errors="coerce"), index=column.index).astype("float64")
    changed = (numbers * times).round(12)
    lost = numbers.isna() & column.notna()
    return changed.astype(object).where(~lost, column) if lost.any() else changed


def with_schema_names(frame: Any, what: str, where: str, feedback: Feedback) -> Any:
    """Restore the names and units of the schema's columns, and warn of fields that only resemble one."""
    renamed: dict[Any, str] = {}
    for column in schemas.columns_of(what):
        found = [(name, times) for name in frame.columns if (times := _times(name, column)) and name not in renamed]
        if column.name in frame or len(found) > 1:
            taken = column.name if column.name in frame else found[0][0]
            for name in (each for each, _ in found if each != taken):
                feedback.warn(
                    f"{where}: the field '{name}' is not used beside '{taken}'; delete the one that is wrong",
                    code="fields-unused",
                )
        if column.name in frame:
            continue
        if found:
            name, times = found[0]
            renamed[name] = column.name
            factor_words = f", times {times:g}" if times != 1.0 else ""
            feedback.note(f"{where}: the field '{name}' is read as {column.name}{factor_words}", code="field-renamed")
            frame = frame.assign(**{str(name): scaled(frame[name], times)}) if times != 1.0 else frame
            continue
        alike = list(_alike(frame, column))
        if what in IN_METRES and column.unit == "m" and alike:  # the height of a net is always given in metres
            renamed[alike[0]] = column.name
            feedback.note(f"{where}: the field '{alike[0]}' is read as {column.name}, in metres", code="field-renamed")
            continue
        for name in alike:
            feedback.warn(
                f"{where}: the field '{name}' is not used; rename it to {column.name} if that is what it holds",
                code="fields-unused",
            )
    return frame.rename(columns=renamed)


def _times(name: object, column: schemas.Column) -> float | None:
    """Factor from the values of a field to those of the column; None if it is another field."""
    text = str(name).strip().lower()
    if text == column.name or (len(column.name) > 10 and text == column.name[:10]):
        return 1.0
    parsed = named(name)
    if not parsed.unit or parsed.plain not in _stems(column):
        return None
    return factor(parsed.unit, column.unit)


def _stems(column: schemas.Column) -> tuple[str, ...]:
    if not column.unit_in_name:
        return ()
    stem = column.name.removesuffix("_" + column.unit_in_name)
    return (stem, *ALSO.get(stem, ()))


def _alike(frame: pandas.DataFrame, column: schemas.Column) -> Iterator[Any]:
    stems = _stems(column)
    return (name for name in frame.columns if name != "geometry" and named(name).plain in stems)


def say_defaults(frame: pandas.DataFrame, what: str, defaults: dict[str, Any], where: str, feedback: Feedback) -> None:
    """Report which values are taken from options while the layer has numeric fields that were not recognised."""
    import pandas

    known = {column.name for column in schemas.columns_of(what)}
    lacking = [name for name in defaults if name not in frame]
    idle = [
        str(name)
        for name in frame.columns
        if name != "geometry" and name not in known and pandas.api.types.is_numeric_dtype(frame[name])
    ]
    if lacking and idle:
        values = ", ".join(f"{name} {defaults[name]:g}" for name in lacking)
        feedback.note(
            f"{where}: the fields {', '.join(idle)} are not used; the options supply what is missing: {values}",
            code="fields-unused",
            fields=len(idle),
        )
