"""Columns of a layer as arrays; errors name file, layer, field and row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms import schemas
from deadwood_algorithms.files.quantities import is_date, is_gap
from deadwood_algorithms.params.counts import rows_named
from deadwood_algorithms.params.tool import Feedback, UserError

if TYPE_CHECKING:
    import pandas

# The usual unit of a median that is too large, by the expected unit.
WRONG_UNITS = {
    "cm": "if these are millimetres, divide by 10",
    "m": "if these are centimetres, divide by 100; if feet, multiply by 0.3048",
}


def where_of(frame: pandas.DataFrame) -> str:
    """How messages name the file and layer of a frame that `vectors` read."""
    return str(frame.attrs.get("where", "layer"))


def note_unnamed(frame: pandas.DataFrame, fields: Sequence[str], things: str, fix: str, feedback: Feedback) -> None:
    """Report that results name things by their rows, for lack of these fields, where another may hold their names.

    fix : what to do with that field, whose name follows
    """
    words = [str(each) for each in frame.select_dtypes(include=["object", "string"]).columns]
    if words and not {str(each).lower() for each in frame.columns} & set(fields):
        feedback.note(
            f"{where_of(frame)}: without a field {' or '.join(fields)} the {things} are named by their rows, 1 to "
            f"{len(frame)}; {fix} '{words[0]}' if it holds their names",
            code="ids-by-row",
            rows=len(frame),
        )


def number_column(
    frame: pandas.DataFrame,
    name: str,
    *,
    where: str | None = None,
    default: float | None = None,
    minimum: float | None = None,
    exclusive: bool = False,
    maximum: float | None = None,
    gaps: bool = False,
    missing_value: float | Sequence[float] | None = None,
) -> np.ndarray:
    """A column as float64, every value finite and within bounds; a missing column takes ``default`` if there is one.

    An empty cell in an existing column is rejected, because a gap in the data is not a request for the default;
    with ``gaps`` it is NaN, and so is a cell that holds (one of) ``missing_value``.
    """
    import pandas

    where = where or where_of(frame)
    if name not in frame:
        if default is not None:
            return np.full(len(frame), float(default))
        raise UserError(f"{where}: the field '{name}' is missing; it has {field_names(frame)}")
    column = frame[name]
    numbers = np.array(pandas.Series(pandas.to_numeric(column, errors="coerce")).astype("float64"))
    bad = ~np.isfinite(numbers)
    if gaps:
        missing = (
            np.asarray(column.isna())
            | np.isin(numbers, () if missing_value is None else missing_value)
            | _gap_words(column)
        )
        numbers[missing] = np.nan
        bad &= ~missing
    if minimum is not None:
        bad |= (numbers <= minimum) if exclusive else (numbers < minimum)
    if maximum is not None:
        bad |= numbers > maximum
    if bad.any():
        row = int(np.argmax(bad))
        complaint = _complaint(column.iloc[row], minimum, exclusive, maximum)
        raise UserError(f"{where}, field '{name}', row {int(frame.index[row]) + 1}: {complaint}")
    return numbers


def _gap_words(column: Any) -> np.ndarray:
    """Which cells contain a word for a gap (k.A., n/d, #NV) instead of a number."""
    import pandas

    if pandas.api.types.is_numeric_dtype(column):
        return np.zeros(len(column), bool)
    return np.array([isinstance(cell, str) and is_gap(cell) for cell in column], bool)


def schema_column(frame: pandas.DataFrame, column: schemas.Column, default: Any = None) -> np.ndarray:
    """A column within the bounds of its schema; the option that replaces it must be within them, too."""
    values = number_column(
        frame,
        column.name,
        default=default,
        minimum=column.minimum,
        exclusive=column.exclusive,
        maximum=column.maximum,
    )
    if column.least is not None and (values < column.least).any():
        row = int(np.argmax(values < column.least))
        place = f"field '{column.name}', row {int(frame.index[row]) + 1}" if column.name in frame else column.name
        raise UserError(
            f"{where_of(frame)}, {place}: {values[row]:g} {column.unit} is smaller than any possible log or tree "
            f"({column.least:g} {column.unit}); check the unit"
        )
    return values


def filled_column(
    frame: pandas.DataFrame,
    name: str,
    option: float | None,
    *,
    minimum: float | None = None,
    exclusive: bool = False,
    maximum: float | None = None,
) -> np.ndarray:
    """An optional column as float64; its gaps take the value of the option, or NaN without one."""
    values = np.full(len(frame), np.nan)
    if name in frame:
        values = number_column(frame, name, minimum=minimum, exclusive=exclusive, maximum=maximum, gaps=True)
    return np.where(np.isnan(values), np.nan if option is None else option, values)


ROW = "row_in_source"  # column of a layer that was extracted from another one, by QGIS: the row of each there, from 1


def row_numbers(frame: pandas.DataFrame) -> np.ndarray:
    """From 1; of a part of a layer those in the whole, so that a selection keeps the numbers of its features."""
    return id_column(frame, ROW) if ROW in frame else np.arange(1, len(frame) + 1)


def id_column(frame: pandas.DataFrame, name: str) -> np.ndarray:
    """Ids as int64 if all are whole numbers, otherwise as text; 64-bit numbers stored as floats become integers
    again.
    """
    column = frame[name]
    gap = np.asarray(column.isna())
    if gap.any():
        row = int(frame.index[int(np.argmax(gap))]) + 1
        raise UserError(f"{where_of(frame)}, field '{name}', row {row}: the id is empty; fill it, or drop the field")
    values = column.tolist()
    if all(isinstance(each, (int, np.integer)) or (isinstance(each, float) and each.is_integer()) for each in values):
        whole = [int(each) for each in values]
        if all(-(2**63) <= each < 2**63 for each in whole):
            return np.array(whole, np.int64)
        return np.array([str(each) for each in whole], object)
    return np.array([str(each).strip() for each in values], object)


def warn_implausible(
    values: np.ndarray, column: schemas.Column, where: str, feedback: Feedback, *, fix: str | None = None
) -> None:
    """Warn if most values, or single ones, are implausible for a tree or log: usually a wrong unit."""
    rows, values = np.flatnonzero(np.isfinite(values)), values[np.isfinite(values)]
    if column.usual is None or not values.size:
        return
    low, high = column.usual
    middle = float(np.median(values))
    if middle < low:
        fix = fix or ("if these are metres, multiply by 100" if column.unit == "cm" else "check the unit")
        feedback.warn(
            f"{where}: the median {column.name} is {middle:g} {column.unit}, which is too small; {fix}",
            code="implausible-size",
            median=float(middle),
        )
    elif middle > high:
        fix = fix or WRONG_UNITS.get(column.unit, "check the unit")
        feedback.warn(
            f"{where}: the median {column.name} is {middle:g} {column.unit}, which is too large; {fix}",
            code="implausible-size",
            median=float(middle),
        )
    elif float(values.max()) > high:
        feedback.warn(
            f"{where}: {column.name} exceeds {high:g} {column.unit} in {rows_named(rows[values > high])}, up to "
            f"{values.max():g}; check these, and their unit",
            code="implausible-size",
            largest=float(values.max()),
        )


def field_names(frame: pandas.DataFrame) -> str:
    names = [str(name) for name in frame.columns if name != "geometry"]
    return "the fields " + ", ".join(names) if names else "no field"


def _complaint(value: Any, minimum: float | None, exclusive: bool, maximum: float | None) -> str:
    below = isinstance(value, (int, float)) and minimum is not None and value <= minimum
    maximum = None if below else maximum  # only the violated bound is reported
    bounds = [f"greater than {minimum:g}" if exclusive else f"at least {minimum:g}"] if minimum is not None else []
    bounds += [f"at most {maximum:g}"] if maximum is not None else []
    wanted = "a number " + " and ".join(bounds) if bounds else "a finite number"
    if value is None or value != value or str(value) in ("<NA>", ""):
        return f"the value is empty; fill in {wanted}"
    shown = f"{float(value):g}" if isinstance(value, (int, float, np.number)) else f"'{value}'"
    if is_date(value):
        return (
            f"{shown} is a date, not {wanted}: a spreadsheet makes one of 12.5 or 3-4; format the column there as "
            "numbers (or text), type the value again, and export again"
        )
    fix = "check the field" if isinstance(value, float) and math.isinf(value) else "correct it or delete the row"
    return f"{shown} is not {wanted}; {fix}"
