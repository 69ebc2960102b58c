"""Text tables in the formats that occur in practice: any separator, decimal commas, BOM, UTF-8, UTF-16 or latin-1, with
or without header.

Numbers may be grouped (2'600'000, 2.600.000,5 or 2,600,000.5). If a column alone cannot decide (1.234), a point or a
comma is decimal.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deadwood_algorithms.files.free_memory import GIB, SHARE, free_bytes
from deadwood_algorithms.files.inputs import refuse_missing
from deadwood_algorithms.files.quantities import MISSING_WORDS, is_gap
from deadwood_algorithms.files.units import KINDS, WORDS, named
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import UserError

TEXT_SUFFIXES = (".csv", ".txt", ".tsv", ".tab", ".dat", ".xyd", ".xyz")
SUM_WORDS = r"(summe|total|totale|somme|suma|sum|mittel|mittelwert|mean|average|moyenne|media|anzahl|nombre|count)\W*"
UNITS = frozenset(unit for kind in KINDS.values() for unit in kind)
NO_UNIT = ("", "-", "–", "%", "nr", "nr.", "no", "no.", "id", "text", "txt")  # entries without a unit in a row of units
SAMPLE_LINES = 50
MOST_TITLE_LINES = 12
MEMORY_TIMES = 20  # memory while a file is split into cells, as a multiple of its size; 16 measured on 600 000 rows
NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
GROUPED = r"(?<=\d)['’ \u00a0\u202f](?=\d{3}(\D|$))"  # 2'600'000, as Swiss spreadsheets write it; 2 600 000
# 2.600.000,5 (and 2,600,000.5 with point and comma exchanged): one unambiguous cell decides for the whole column
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # characters with which a formula in a spreadsheet begins
OPTION = re.compile(r"--[a-z][a-z0-9-]*")  # an option of a tool is not a formula
GROUPED_POINTS = r"[-+]?\d{1,3}(\.\d{3})+(,\d*)?"
SURELY_GROUPED_POINTS = r"[-+]?\d{1,3}((\.\d{3})+,\d*|(\.\d{3}){2,})"
PLAIN_COMMA = r"[-+]?\d+(,\d*)?"
EXCHANGED = str.maketrans(".,", ",.")
csv.field_size_limit(2**30)  # a polygon as text is longer than the 131 072 characters that the module allows


def is_text_table(path: str | Path) -> bool:
    """Whether the name is that of a text table; a .tab may also be the header of a MapInfo layer."""
    place = Path(path)
    if place.suffix.lower() == ".tab" and place.is_file():
        with place.open("rb") as source:
            return not source.read(20).lstrip().lower().startswith(b"!table")
    return place.suffix.lower() in TEXT_SUFFIXES


def read_text_table(path: str | Path, what: str) -> pd.DataFrame:
    """Read a delimited text file; columns of numbers become numbers, everything else stays text (missing: NaN).

    A file without header gets the columns ``column_1``, ``column_2``, ... Row i of the frame is data row i + 1.
    """
    refuse_missing(path, what)
    lines = [line for line in _decoded(Path(path), what).split("\n") if line.strip(" \t;,\r")]
    said = re.fullmatch(r'"?sep=(.)"?', lines[0].strip(), re.IGNORECASE) if lines else None  # for spreadsheets
    lines = lines[1:] if said else lines
    while lines and lines[0].lstrip().startswith("#"):
        lines = lines[1:]
    if not lines:
        raise UserError(f"{path}: the {what} table holds no row")
    separator = said.group(1) if said else _separator(lines[:SAMPLE_LINES])
    if separator == " ":
        lines = [re.sub(r"[ \t]+", " ", line.strip()) for line in lines]
    lines = _below_title(lines, separator)
    first = next(csv.reader([lines[0]], delimiter=separator, skipinitialspace=True))
    while len(first) > 1 and not first[-1].strip():
        first = first[:-1]
    has_header = not any(_is_number(cell) or cell.strip().lower() == "nan" for cell in first)
    if has_header:
        names = [cell.strip() or f"column_{i + 1}" for i, cell in enumerate(first)]
        double = next((name for i, name in enumerate(names) if name in names[:i]), None)
        if double:
            raise UserError(f"{path}: two columns of the {what} table are called '{double}'; rename one")
        lines = lines[1:]
    else:
        names = [f"column_{i + 1}" for i in range(len(first))]
    if not lines:
        raise UserError(f"{path}: the {what} table holds a header but no row")
    return _typed(_rows_of_things(pd.DataFrame(_columns(lines, separator, names, path))))


def sheet_table(frame: pd.DataFrame) -> pd.DataFrame:
    """A spreadsheet's cells as a table: named by its header, also below a title, and without sums at the end."""
    cells = frame.astype(object).where(frame.notna(), "").map(lambda cell: str(cell).strip())
    if all(re.fullmatch(r"Field\d+", str(name)) for name in frame.columns):  # GDAL's, where it sees no header
        cells = cells.loc[:, (cells != "").any()]  # drop empty margins
        rows = cells.to_numpy().tolist()
        at = header_row(rows[:SAMPLE_LINES])
        if any(_is_number(cell) for cell in rows[at]) or len(rows) <= at + 1:
            return frame
        names = [name or f"column_{i + 1}" for i, name in enumerate(rows[at])]
        if len(set(names)) < len(names):
            return frame
        cells = pd.DataFrame(rows[at + 1 :], columns=pd.Index(names), dtype=object)
    return _typed(_rows_of_things(cells))


def _typed(cells: pd.DataFrame) -> pd.DataFrame:
    """Convert cells of text to columns of numbers if all are numbers; what was left out is recorded in ``attrs``."""
    typed = pd.DataFrame({name: _numbers(pd.Series(column)) for name, column in cells.items()})
    typed.attrs.update(cells.attrs)
    return typed


def _rows_of_things(cells: pd.DataFrame) -> pd.DataFrame:
    """The rows of data: without a row of units, headers repeated on each page, sums and remarks."""
    notes: list[str] = []
    unnamed = [name for name in cells.columns if re.fullmatch(r"column_\d+", str(name))]
    if len(unnamed) < cells.shape[1]:
        cells = cells.drop(columns=[name for name in unnamed if all(cell == "" for cell in cells[name])])
    if len(cells) > 1 and (units := _units_of(cells.iloc[0])):
        cells = cells.iloc[1:].rename(columns=units)
        notes.append("the row below the header holds units")
    again = (cells == [str(name) for name in cells.columns]).all(axis=1)
    if again.any() and not again.all():
        cells = cells.loc[~again]
        notes.append(
            f"{counted(int(again.sum()), 'row')} left out that {'is' if again.sum() == 1 else 'are'} the header"
        )
    last = _last_row(cells)
    if last < len(cells):
        notes.append(f"{counted(len(cells) - last, 'row')} below the table (sums, means, remarks or blank) left out")
    cells = cells.iloc[:last].reset_index(drop=True)
    cells.attrs["notes"] = tuple(notes)
    return cells


def _units_of(row: pd.Series) -> dict[Any, str]:
    """The columns with units added to their names from a row that contains only units (m, [cm]); otherwise empty."""
    units = {name: re.sub(r"[\[\]()\s]", "", str(cell).lower()) for name, cell in row.items()}
    known = {name: unit for name, unit in units.items() if WORDS.get(unit, unit) in UNITS}
    if not known or any(unit not in NO_UNIT for name, unit in units.items() if name not in known):
        return {}
    return {name: f"{name} [{unit}]" if not named(name).unit else str(name) for name, unit in known.items()}


def _last_row(cells: pd.DataFrame) -> int:
    """Number of rows up to the last row of data: rows of sums, means and remarks are named so or have one filled
    cell.
    """
    last = len(cells)
    while last > 1:
        row = [str(cell).strip() for cell in cells.iloc[last - 1]]
        named_so = any(re.fullmatch(SUM_WORDS, cell, re.IGNORECASE) for cell in row)
        filled = [cell for cell in row if cell]
        blank = len(row) - len(filled)
        remark = len(filled) == 1 and len(row) > 3 and not _is_number(filled[0])
        if filled and not remark and not (named_so and (2 * blank >= len(row) or blank >= 2)):
            break
        last -= 1
    return last


def _below_title(lines: list[str], separator: str) -> list[str]:
    """The lines from the header on, if a title with fewer cells precedes it."""
    if separator == " ":
        return lines
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines[:SAMPLE_LINES], delimiter=separator)]
    if len(rows) != len(lines[:SAMPLE_LINES]):
        return lines  # cells over several lines: nothing is guessed
    return lines[header_row(rows) :]


def header_row(rows: list[list[str]]) -> int:
    """Which of the first rows is the header: the first one with nearly as many filled cells as the other rows.

    Zero if it is the first row, or if no row looks like a header.
    """
    filled = [sum(bool(cell) for cell in row) for row in rows]
    usual = sorted(filled)[len(filled) // 2]
    if not rows or usual < 3:
        return 0
    if filled[0] > usual / 2:  # names of groups with gaps (merged cells) may still precede those of the columns
        below = rows[1] if len(rows) > 2 else []
        named_below = len(set(below)) == len(below) >= usual and not any(map(_is_number, below))
        return int(filled[0] < usual and named_below and any(map(_is_number, rows[2])))
    for at, row in enumerate(rows[:MOST_TITLE_LINES]):
        names = [cell for cell in row if cell]
        if len(names) >= max(2, 0.8 * usual) and not any(_is_number(cell) for cell in names):
            return at if len(set(names)) == len(names) else 0
    return 0


def _decoded(path: Path, what: str) -> str:
    needed, free = path.stat().st_size * MEMORY_TIMES, free_bytes()
    if free is not None and needed > SHARE * free:
        raise UserError(
            f"{path}: to read the {what} table takes {needed / GIB:.1f} GB of memory, {free / GIB:.1f} GB are "
            "free; take a part of it, or a GeoPackage"
        )
    raw = path.read_bytes()
    encodings = ["utf-8-sig", "cp1252", "latin-1"]
    if raw[:4] in (b"\xff\xfe\0\0", b"\0\0\xfe\xff"):
        encodings = ["utf-32"]
    elif raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encodings = ["utf-16"]
    elif len(raw) > 3:  # UTF-16 without a byte order mark: every second byte of a table of numbers is 0, and no other
        even, odd = raw[::2].count(0) / (len(raw) / 2), raw[1::2].count(0) / (len(raw) / 2)
        if max(even, odd) > 0.8 and min(even, odd) == 0.0:
            encodings = ["utf-16-le" if odd > even else "utf-16-be"]
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        raise UserError(f"{path}: the {what} table is not readable text; save it as UTF-8")
    if "\0" in text:
        raise UserError(f"{path}: the {what} table is not a text file (it holds NUL bytes); save it as text, UTF-8")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _separator(lines: list[str]) -> str:
    """The separator that gives the same number of cells in every line; the comma is tried last, as it may be
    decimal.
    """
    best, best_score = ",", (0.0, 0)
    for separator in (";", "\t", "|", ","):
        counts = [len(row) for row in csv.reader(lines, delimiter=separator)]
        usual = max(set(counts), key=counts.count)
        if usual > 1:
            score = (counts.count(usual) / len(counts), 1)
            if score > best_score:
                best, best_score = separator, score
    if best_score == (0.0, 0) or best_score[0] < 0.5:
        counts = [len(line.split()) for line in lines]
        if min(counts) > 1:
            return " "
    return best


def _columns(lines: list[str], separator: str, names: list[str], path: str | Path) -> dict[str, pd.Series]:
    columns: list[list[str]] = [[] for _ in names]
    for row_number, row in enumerate(_rows(lines, separator, path), start=1):
        if len(row) > len(names) and not any(cell.strip() for cell in row[len(names) :]):
            row = row[: len(names)]
        if len(row) != len(names):
            raise UserError(
                f"{path}: row {row_number} has {counted(len(row), 'cell')}, the first line has {len(names)} (separator "
                f"'{separator}'); correct that row, or quote cells that hold the separator"
            )
        for cells, cell in zip(columns, row, strict=True):
            cells.append(cell.strip())
    return {name: pd.Series(cells, dtype=object) for name, cells in zip(names, columns, strict=True)}


def _rows(lines: list[str], separator: str, path: str | Path) -> Iterator[list[str]]:
    """The cells of each row; an unclosed quote would swallow the following rows, so it is rejected."""
    reader = csv.reader(io.StringIO("\n".join(lines)), delimiter=separator, skipinitialspace=True, strict=True)
    number = 1
    try:
        for row in reader:
            yield row
            number += 1
    except csv.Error as error:
        raise UserError(
            f'{path}: row {number} cannot be split into cells ({error}); look for a stray " in it'
        ) from error


def _numbers(cells: pd.Series) -> pd.Series:
    """A column as numbers if each cell that is not missing is a number, otherwise as text.

    One with leading zeros (007) stays text: it is an id and would lose them; `columns` converts it if necessary.
    """
    text = cells.where(~cells.str.lower().isin(MISSING_WORDS), None)
    if text.str.fullmatch(r"0\d+").any():
        return text
    plain = text.str.replace(GROUPED, "", regex=True).str.replace("\u2212", "-", regex=False)
    gaps = plain.isna() | plain.map(lambda cell: isinstance(cell, str) and is_gap(cell))  # only in a column of numbers
    known = plain[~gaps]
    if _grouped_by_points(known):
        plain = plain.str.replace(".", "", regex=False)
    elif _grouped_by_points(known.str.translate(EXCHANGED)):
        plain = plain.str.replace(",", "", regex=False)
    elif known.str.contains(",", regex=False).any() and known.str.contains(".", regex=False).any():
        return text  # 1.234 beside 35,5 in one column: the meaning of the point is ambiguous
    numbers = pd.Series(pd.to_numeric(plain.str.replace(",", ".", regex=False), errors="coerce"))
    numbers[gaps] = np.nan
    return numbers if numbers.notna().sum() == len(known) and (len(known) or text.isna().all()) else text


def _grouped_by_points(cells: pd.Series) -> bool:
    """Whether points precede every third digit of these cells and a comma the decimals, unambiguously."""
    if not cells.str.fullmatch(SURELY_GROUPED_POINTS).any():
        return False
    return bool((cells.str.fullmatch(GROUPED_POINTS) | cells.str.fullmatch(PLAIN_COMMA)).all())


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(re.sub(GROUPED, "", cell.strip())) is not None


def _harmless(cell: Any) -> Any:
    runs = isinstance(cell, str) and cell.startswith(FORMULA) and not (_is_number(cell) or OPTION.fullmatch(cell))
    return f"'{cell}" if runs else cell


def write_csv(path: Path, frame: pd.DataFrame) -> None:
    """Write a table as text, UTF-8 with byte order mark: without it a spreadsheet shows an ö as two other characters.

    A text that a spreadsheet would evaluate, such as an id =1+1 of a layer, is preceded by an apostrophe.
    """
    texts = {
        name: frame[name].map(_harmless) for name in frame.columns if not pd.api.types.is_numeric_dtype(frame[name])
    }
    frame = frame.assign(**texts)
    frame.to_csv(path, index=False, encoding="utf-8-sig", lineterminator="\n")
