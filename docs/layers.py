"""The section about a layer, a raster, a table or a JSON file, rendered from the schemas."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from deadwood_algorithms.schemas.brought import BROUGHT
from deadwood_algorithms.schemas.looks import LOOKS
from deadwood_algorithms.schemas.words import Band, Column, JsonFile, Layer, RasterFile, TableFile
from deadwood_algorithms.schemas.written import WRITTEN

INTRODUCTION = """\
Every layer that the tools read by the names of its columns, and everything that they write. Units stand in the names:
`_cm`, `_m`, `_ms` (m/s), `_kj`, `_kns` (kN s), `_deg`. A word in capitals stands for any text: `reach_LINE` is a column
for each line. A place that begins with `--` is the file that this flag names. Every raster has its style for QGIS
beside it in a `.qml` file, every GeoPackage has its styles within."""


def title_of(what: Any) -> str:
    """Its name, with the tools that write it if others have the same name."""
    same = {id(each.what) for each in WRITTEN if each.what.name == what.name}
    if len(same) < 2 or what in BROUGHT:
        return what.name
    return f"{what.name} ({', '.join(dict.fromkeys(each.tool for each in WRITTEN if each.what is what))})"


def section(what: Any) -> str:
    """The section about one layer, raster, table or JSON file."""
    title = f"### {title_of(what)}"
    if isinstance(what, Layer):
        kept = " Beside these, all columns of the layer that it was made from." if what.keeps_source else ""
        shape = f" *{' or '.join(what.geometry)}.*" if what.geometry else ""
        return f"{title}\n\n{what.meaning}.{kept}{shape}\n\n{_columns(what.columns)}"
    if isinstance(what, TableFile):
        return f"{title}\n\n{what.meaning}.\n\n{_columns(what.columns)}"
    if isinstance(what, RasterFile):
        bands = table(("band", "meaning", "unit", "numbers"), map(_band, what.bands))
        return f"{title}\n\n{what.meaning}.{_scale(what)}\n\n{bands}"
    if isinstance(what, JsonFile):
        rows = ((f"`{key.name}`", key.meaning) for key in what.keys)
        return f"{title}\n\n{what.meaning}.\n\n{table(('key', 'meaning'), rows)}"
    return ""


def _scale(what: RasterFile) -> str:
    """The scale on which the first band is shown everywhere."""
    if what.look not in LOOKS:
        return ""
    look = LOOKS[what.look]
    return f" Shown from {look.label(look.stops[0])} to {look.label(look.stops[-1])}."


def _band(band: Band) -> tuple[str, ...]:
    return band.name, band.meaning, band.unit, "as the source's" if band.number.isupper() else band.number


def _columns(columns: Iterable[Column]) -> str:
    rows = ((f"`{each.name}`", each.meaning, each.unit, _range(each), _default(each)) for each in columns)
    return table(("column", "meaning", "unit", "range", "missing"), rows)


def _range(column: Column) -> str:
    low, high = column.minimum, column.maximum
    if column.choices:
        return ", ".join(column.choices)
    if low is not None and high is not None:
        return f"{low:g} {'<' if column.exclusive else '<='} x <= {high:g}"
    return "" if low is None else f"{'>' if column.exclusive else '>='} {low:g}"


def _default(column: Column) -> str:
    if column.required:
        return "refused"
    if column.default is None:
        return ""
    return f"{column.default:g}" if isinstance(column.default, float) else str(column.default)


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table, without the columns in which no row has anything."""
    found = [head, *rows]
    kept = [k for k in range(len(head)) if any(row[k] for row in found[1:])]
    return "\n".join(_lines([tuple(row[k] for k in kept) for row in found]))


def _lines(rows: list[tuple[str, ...]]) -> Iterator[str]:
    for number, row in enumerate(rows):
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
        if number == 0:
            yield "|" + "---|" * len(row)
