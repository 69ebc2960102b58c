"""Text tables as people have them: any separator, decimal commas, BOM, UTF-8, UTF-16 or latin-1, header or none.

Part of `layers`, which is the name to import from.
"""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pandas as pd

from deadwood_algorithms.inputs import refuse_missing
from deadwood_algorithms.tool import UserError

TEXT_SUFFIXES = (".csv", ".txt", ".tsv", ".tab", ".dat", ".xyd", ".xyz")
MISSING_WORDS = ("", "na", "n/a", "nan", "null", "none", "-", "#n/a")
SAMPLE_LINES = 50
NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
GROUPED = r"(?<=\d)['’](?=\d{3}(\D|$))"  # 2'600'000, as Swiss spreadsheets write it


def is_text_table(path: str | Path) -> bool:
    return Path(path).suffix.lower() in TEXT_SUFFIXES


def read_text_table(path: str | Path, what: str) -> pd.DataFrame:
    """Read a delimited text file; columns of numbers become numbers, everything else stays text (missing: NaN).

    A file without header gets the columns ``column_1``, ``column_2``, ... Row i of the frame is data row i + 1.
    """
    refuse_missing(path, what)
    lines = [line for line in _decoded(Path(path), what).split("\n") if line.strip(" \t;,\r")]
    if not lines:
        raise UserError(f"{path}: the {what} table holds no row")
    separator = _separator(lines[:SAMPLE_LINES])
    if separator == " ":
        lines = [re.sub(r"[ \t]+", " ", line.strip()) for line in lines]
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
    return pd.DataFrame({name: _numbers(cells) for name, cells in _columns(lines, separator, names, path).items()})


def _decoded(path: Path, what: str) -> str:
    raw = path.read_bytes()
    encodings = ["utf-8-sig", "cp1252", "latin-1"]
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encodings = ["utf-16"]
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        raise UserError(f"{path}: the {what} table is not readable text; save it as UTF-8")
    if "\0" in text:
        raise UserError(f"{path}: the {what} table is no text file")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _separator(lines: list[str]) -> str:
    """The separator that cuts the sample into the same number of cells everywhere; a comma last, it may be decimal."""
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
    reader = csv.reader(io.StringIO("\n".join(lines)), delimiter=separator, skipinitialspace=True)
    for row_number, row in enumerate(reader, start=1):
        if len(row) > len(names) and not any(cell.strip() for cell in row[len(names) :]):
            row = row[: len(names)]
        if len(row) != len(names):
            raise UserError(
                f"{path}: row {row_number} has {len(row)} cells, the first line has {len(names)} (separator "
                f"'{separator}'); mend that row, or quote cells that hold the separator"
            )
        for cells, cell in zip(columns, row, strict=True):
            cells.append(cell.strip())
    return {name: pd.Series(cells, dtype=object) for name, cells in zip(names, columns, strict=True)}


def _numbers(cells: pd.Series) -> pd.Series:
    """A column as numbers when each cell that is not missing is one, else as text."""
    text = cells.where(~cells.str.lower().isin(MISSING_WORDS), None)
    plain = text.str.replace(GROUPED, "", regex=True)
    for candidate in (plain, plain.str.replace(",", ".", regex=False)):
        numbers = pd.Series(pd.to_numeric(candidate, errors="coerce"))
        if numbers.notna().sum() == text.notna().sum():
            return numbers
    return text


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(re.sub(GROUPED, "", cell.strip())) is not None
