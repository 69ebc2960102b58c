"""The columns of single-tree tables, converted to the units of the trees layer.

For `import_trees`; the table's `sources.Layout` defines which column contains what. Missing values are NaN here;
that tool decides what to do about them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms.files.columns import id_column, number_column, where_of
from deadwood_algorithms.files.quantities import is_date, is_gap, read_sizes
from deadwood_algorithms.files.units import named
from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.prepare.trees.sources import ROLES, Layout, names_of, plain_name, plain_names_of

if TYPE_CHECKING:
    import geopandas
    import pandas

# Units of a DBH, in cm; girth-cm is the circumference, as French and Spanish inventories measure it.
GIRTH_UNITS = {"cm": 1.0, "m": 100.0, "mm": 0.1, "in": 2.54}  # in cm
DBH_UNITS = {**GIRTH_UNITS, "girth-cm": 1 / np.pi, "radius-cm": 2.0, "radius-m": 200.0}
SIZE_UNITS = {"girth-cm": "cm", "radius-cm": "cm", "radius-m": "m"}  # units in which a girth or a radius is given
FACTORS = {"girth": 1 / np.pi, "radius": 2.0}  # of what is measured round a stem, or from its middle
# A radius without unit: up to the first in m, from the second on in cm; between them it may be that of a crown in m.
RADIUS_M, RADIUS_CM = 1.0, 4.0
FEW_SHARE = 0.1  # of the values of another column, so that this one is doubted
IN_Z = "the Z of the points"
HEIGHT_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "ft": 0.3048}  # in m
AREA_UNITS = ("m2", "m²", "qm", "sqm")  # names of the unit of a crown's area, which is in m2
CROWN_MEASURES = ("diameter", "radius", "area")
# A Z of points or a column z whose median is above this is the height of the ground above the sea, not of a tree.
TALLEST_M = 80.0
UNREAD_SHOWN = 4


def find(source: pandas.DataFrame, asked: str | None, option: str, names: Iterable[str]) -> str | None:
    """The requested column, otherwise the first of the usual names that exists, ignoring case."""
    return next(iter(candidates(source, asked, option, names)), None)


def candidates(source: pandas.DataFrame, asked: str | None, option: str, names: Iterable[str]) -> list[str]:
    """The requested column, otherwise those of the usual names that exist, the most specific first, empty ones last."""
    there = names_of(source)
    if asked and asked.lower() not in there:
        has = ", ".join(dict.fromkeys(there.values()))
        raise UserError(f"{where_of(source)}: there is no field '{asked}' ({option}); it has {has}")
    if asked:
        return [there[asked.lower()]]
    plain = plain_names_of(source)
    found = (there.get(name) or plain.get(plain_name(name)) for name in names)
    return sorted(dict.fromkeys(name for name in found if name), key=lambda name: is_empty(source, name))


def is_empty(source: pandas.DataFrame, name: str) -> bool:
    """Whether a column has no value at all: only gaps, words for gaps (#NV), and 0."""
    return not any(map(_is_size, source[name]))


def _is_size(cell: object) -> bool:
    return not (cell is None or cell != cell or cell == 0 or (isinstance(cell, str) and is_gap(cell)))


def warn_of_empty(source: pandas.DataFrame, asked: str | None, names: Iterable[str], feedback: Feedback) -> None:
    """Refuse a requested column without any value, and warn of one that was found by its name."""
    why = "wholly empty (formulas whose values were not stored? open and save the table in a spreadsheet program)"
    there = names_of(source).get(asked.lower()) if asked else None
    if there and len(source) and is_empty(source, there):
        raise UserError(f"{where_of(source)}: the field '{there}' is {why}")
    for name in candidates(source, None, "", names):
        if is_empty(source, name) and not asked:
            feedback.warn(f"{where_of(source)}: the field '{name}' is {why}; it is not used", code="empty-field")


def words_of(text: str | None) -> dict[str, float]:
    """The values of words from ``--read-as``: >60=65; Starkholz=55; with nothing after the = a gap."""
    words: dict[str, float] = {}
    for part in filter(str.strip, (text or "").split(";")):
        word, equals, number = part.rpartition("=")
        if word.strip().lower() in words:
            raise UserError(f"--read-as gives '{word.strip()}' more than once; keep one")
        try:
            words[word.strip().lower()] = float(number) if number.strip() else np.nan
        except ValueError:
            equals = ""
        if not equals or not word.strip():
            raise UserError(
                f"--read-as: '{part.strip()}' is not a word, = and a number (with a point); write it as '>60=65', and "
                "several as '>60=65; Starkholz=55'"
            )
    return words


def sizes(
    source: pandas.DataFrame,
    name: str,
    unit: str,
    missing_value: float | Sequence[float] | None,
    feedback: Feedback,
    words: Mapping[str, float] | None = None,
) -> np.ndarray:
    """A column of sizes in ``unit``, NaN for cells that are empty, 0, or hold the missing value.

    Text such as 41,4 cm is read; a class such as 40-45 counts as its middle, a word as defined by ``words``, with a
    note.
    """
    import pandas

    where = where_of(source)
    if not pandas.api.types.is_numeric_dtype(source[name]):
        read = read_sizes(source[name], unit, words)
        refuse_unread(source, name, read.unread)
        source = source.assign(**{name: read.values})
        source.attrs["where"] = where
        if read.classes:
            feedback.warn(
                f"{where}, field '{name}': {counted(read.classes, 'cell holds a class', 'cells hold classes')} such "
                f"as {read.example}; the middle is taken",
                code="classes-read",
                cells=read.classes,
            )
    nothing = np.asarray(source[name] == 0)
    if nothing.any():
        feedback.note(
            f"{where}, field '{name}': {counted(nothing.sum(), 'cell holds', 'cells hold')} 0, which counts as missing",
            code="zero-is-missing",
            cells=int(nothing.sum()),
        )
        source = source.assign(**{name: source[name].where(~nothing)})
        source.attrs["where"] = where
    try:
        return number_column(source, name, minimum=0.0, exclusive=True, gaps=True, missing_value=missing_value)
    except UserError as error:
        raise UserError(f"{error}, or give --missing-value if this number means a missing value") from error


def refuse_unread(source: pandas.DataFrame, name: str, unread: np.ndarray) -> None:
    """Refuse cells that are neither a size nor a gap, with the option that explains each such word."""
    if not unread.any():
        return
    row = int(np.argmax(unread))
    words = list(dict.fromkeys(str(cell).strip() for cell in source[name][unread]))
    rows = f" and {unread.sum() - 1} more" if unread.sum() > 1 else ""
    dated = ""
    if is_date(source[name][unread].iloc[0]):
        dated = " is a date (a spreadsheet makes one of a class such as 10-12, or of 5.10: make the column text there),"
    wanted = quoted("; ".join(f"{word}=NUMBER" for word in words[:UNREAD_SHOWN]))
    more = f", and {len(words) - UNREAD_SHOWN} words more" if len(words) > UNREAD_SHOWN else ""
    raise UserError(
        f"{where_of(source)}, field '{name}', row {int(source.index[row]) + 1}{rows}: '{words[0]}'{dated} is neither "
        f"a size nor a class with two ends; correct it, or define such words with --read-as {wanted}{more} (nothing "
        "instead of NUMBER: a gap)"
    )


def unit_of(name: str, units: dict[str, float], given: str | None, usual: str, where: str, feedback: Feedback) -> str:
    """The given unit, otherwise the one in the field's name, otherwise the usual one, with a note."""
    parsed = named(name)
    if given is None and parsed.word and parsed.unit not in units:
        feedback.warn(
            f"{where}: the unit '{parsed.word}' of the field '{name}' is not known, {usual} is taken",
            code="unit-unknown",
        )
    return given or (parsed.unit if parsed.unit in units else usual)


def dbh_column(
    source: pandas.DataFrame,
    layout: Layout,
    asked: str | None,
    unit: str | None,
    missing_value: float | Sequence[float] | None,
    feedback: Feedback,
    words: Mapping[str, float] | None = None,
) -> np.ndarray:
    """DBH in cm, NaN where missing; without ``unit`` the field's name determines it (``BHD [mm]``, ``dbh_in``), else
    cm.

    If the field that is read is by its name the girth or the radius at breast height, the DBH follows from it, with a
    warning; ``unit`` is then that of the girth or the radius.
    """
    where = where_of(source)
    warn_of_empty(source, asked, layout.dbh, feedback)
    name = find(source, asked, "--dbh-field", layout.dbh)
    if asked is None and (name is None or is_empty(source, name)):
        round_ = (find(source, None, "", names) for names in (layout.girth, layout.radius))
        name = next((each for each in round_ if each), name)
    elif asked is None and name is not None:
        _warn_of_fuller(source, name, (*layout.girth, *layout.radius), feedback)
    if name is None:
        return np.full(len(source), np.nan)
    plain, kind = plain_name(name), ""
    if unit is None or unit in GIRTH_UNITS:
        of_kind = {"girth": layout.girth, "radius": layout.radius}
        kind = next((each for each, names in of_kind.items() if plain in map(plain_name, names)), "")
    if kind:
        return _from_round(source, name, kind, unit, missing_value, feedback, words)
    measured = unit_of(name, DBH_UNITS, unit, "cm", where, feedback)
    return sizes(source, name, SIZE_UNITS.get(measured, measured), missing_value, feedback, words) * DBH_UNITS[measured]


def _warn_of_fuller(source: pandas.DataFrame, name: str, others: Iterable[str], feedback: Feedback) -> None:
    """Warn if the column that is read has few values beside one of another measure that has many."""
    for other in candidates(source, None, "", others):
        few, many = (sum(map(_is_size, source[each])) for each in (name, other))
        if few < FEW_SHARE * many:
            feedback.warn(
                f"{where_of(source)}: the field '{name}' has {counted(few, 'value')}, '{other}' has {many}; "
                f"--dbh-field {quoted(other)} reads that instead",
                code="fuller-field",
                values=few,
                other=many,
            )
            return


def _from_round(
    source: pandas.DataFrame,
    name: str,
    kind: str,
    unit: str | None,
    missing_value: float | Sequence[float] | None,
    feedback: Feedback,
    words: Mapping[str, float] | None,
) -> np.ndarray:
    """DBH in cm from the girth or the radius of the stem; a radius without unit is judged by its median."""
    where = where_of(source)
    usual = "cm"
    if kind == "radius" and unit is None and named(name).unit not in GIRTH_UNITS:
        numbers = sizes(source, name, "cm", missing_value, Quiet(), words)
        middle = float(np.median(numbers[np.isfinite(numbers)])) if np.isfinite(numbers).any() else 0.0
        if RADIUS_M < middle < RADIUS_CM:
            feedback.warn(
                f"{where}: the field '{name}' (median {middle:.3g}) is a radius of the stem in cm, or of the crown in "
                "m; it is not used. --dbh-field names it, --dbh-unit radius-cm or radius-m its unit",
                code="radius-not-read",
                median=middle,
            )
            return np.full(len(source), np.nan)
        usual = "m" if middle <= RADIUS_M else "cm"
    measured = unit_of(name, GIRTH_UNITS, unit, usual, where, feedback)
    said = "2 x the radius" if kind == "radius" else "the girth / pi"
    feedback.warn(f"{where}: the field '{name}' is read as the {kind} in {measured}; the DBH is {said}", code=kind)
    return sizes(source, name, measured, missing_value, feedback, words) * GIRTH_UNITS[measured] * FACTORS[kind]


def height_column(
    source: pandas.DataFrame,
    layout: Layout,
    asked: str | None,
    unit: str | None,
    missing_value: float | Sequence[float] | None,
    feedback: Feedback,
    words: Mapping[str, float] | None = None,
) -> np.ndarray:
    """Height in m, NaN where missing: a column, else the Z of the points if that can be the height of a tree.

    Without ``unit`` the field's name determines it, else it is m. A field that was not requested and whose median is
    above the height of trees is the elevation of the ground: it is ignored, with a message.
    """
    where = where_of(source)
    warn_of_empty(source, asked, layout.height, feedback)
    names = candidates(source, asked, "--height-field", layout.height)
    names = [name for name in names if not is_empty(source, name)]
    if not names and layout.height_in_z and has_z(source):
        source = source.copy()
        source[IN_Z] = shapely.get_z(np.asarray(source.geometry.array))
        source.attrs["where"] = where
        names = [IN_Z]
    for name in names:
        measured = (unit or "m") if name == IN_Z else unit_of(name, HEIGHT_UNITS, unit, "m", where, feedback)
        if asked is None and (name == IN_Z or named(name).plain == "z"):
            middle = float(np.nanmedian(number_column(source, name, gaps=True))) * HEIGHT_UNITS[measured]
            if middle == 0:
                continue  # as some programs write a missing Z
            if not middle <= TALLEST_M:
                feedback.warn(
                    f"{where}: {name} (median {middle:.0f} m) is not a tree height, and is not used",
                    code="fields-unused",
                    median=float(middle),
                )
                continue
            feedback.note(f"{where}: the height is taken from {name}", code="field-renamed")
        heights = sizes(source, name, measured, missing_value, feedback, words) * HEIGHT_UNITS[measured]
        known = heights[np.isfinite(heights)]
        if asked is None and known.size and float(np.median(known)) > TALLEST_M:
            feedback.warn(
                f"{where}: the field '{name}' (median {np.median(known):.0f} m) is not the height of trees, but "
                "perhaps the elevation of the ground; it is not used. Use --height-field to name another field, "
                "--height-unit for its unit",
                code="fields-unused",
                median=float(np.median(known)),
            )
            continue
        return heights
    return np.full(len(source), np.nan)


def not_understood(source: pandas.DataFrame, layout: Layout, asked: Iterable[str | None]) -> list[str]:
    """Fields of sizes from which nothing is read: one of them may contain what is about to be computed."""
    import pandas

    def of_sizes(name: str) -> bool:
        if pandas.api.types.is_numeric_dtype(source[name]):
            return True
        read = read_sizes(source[name], "cm")
        return not read.unread.any() and bool(np.isfinite(read.values).any())

    used = {find(source, None, "", getattr(layout, role)) for role in ROLES}
    used |= {names_of(source).get(name.lower()) for name in asked if name}
    return [str(name) for name in source.columns if name != "geometry" and name not in used and of_sizes(name)]


def has_z(source: pandas.DataFrame) -> bool:
    """Whether the rows are points that all have a Z."""
    shapes = np.asarray(source.geometry.array) if "geometry" in source else np.empty(0, object)
    return bool(shapes.size) and not (shapely.get_type_id(shapes) != 0).any() and bool(shapely.has_z(shapes).all())


def crown_column(
    source: geopandas.GeoDataFrame, layout: Layout, asked: str | None, measure: str | None, outlines: np.ndarray | None
) -> np.ndarray | None:
    """Diameter of the crown [m], NaN where missing: from a column, otherwise that of the circle with the area of the
    outline.

    ``measure`` defines the content of a requested column: diameter or radius [m], or area [m2]; else its usual meaning.
    """
    name = find(source, asked, "--crown-field", layout.crown)
    if name is None:
        if outlines is None:
            return None
        return 2 * np.sqrt(shapely.area(outlines) / np.pi)
    values = number_column(source, name, minimum=0.0, gaps=True)
    parsed = named(name)
    measure = measure or layout.crown.get(name.lower(), layout.crown.get(parsed.plain, "diameter"))
    if measure == "area":
        return 2 * np.sqrt(values / np.pi)
    times = 1.0 if parsed.word in AREA_UNITS else HEIGHT_UNITS.get(parsed.unit, 1.0)
    return values * times * (2.0 if measure == "radius" else 1.0)


def id_columns(
    source: pandas.DataFrame, layout: Layout, kept: np.ndarray, asked: str | None, feedback: Feedback
) -> dict[str, np.ndarray]:
    """The ids unchanged; if two trees share one, or one has none, new ids, and the old ones as ``source_id``."""
    name = find(source, asked, "--id-field", layout.id)
    running = np.arange(1, int(kept.sum()) + 1)
    if name is None:
        return {"tree_id": running}
    empty = int(np.count_nonzero(source[name].isna()))
    ids = source[name].astype(str).to_numpy()[kept] if empty else id_column(source, name)[kept]
    repeated = ids.size - np.unique(ids.astype(str)).size
    if not (repeated or empty):
        return {"tree_id": ids}
    what = (
        counted(empty, "tree has no id", "trees have no id")
        if empty
        else counted(repeated, "tree has an id that another one has", "trees have an id that another one has")
    )
    feedback.warn(
        f"{where_of(source)}, field '{name}': {what}; all are numbered again from 1, the old ids are kept as source_id",
        code="ids-numbered-again",
    )
    return {"tree_id": running, "source_id": ids}


def species_column(source: pandas.DataFrame, layout: Layout, asked: str | None) -> np.ndarray | None:
    """The species as the source names it, None where empty."""
    name = find(source, asked, "--species-field", layout.species)
    if name is None:
        return None
    return np.array([None if word is None or word != word else str(word) for word in source[name]], object)
