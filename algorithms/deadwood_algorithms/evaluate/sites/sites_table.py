"""The sites and the parameters of each: from rows of a table, files of parameters, or groups of releases."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.files.configs import closest, read_config
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.kinds import check_value
from deadwood_algorithms.params.manifest import is_path
from deadwood_algorithms.params.tool import Feedback, Parameter, Tool, UserError

if TYPE_CHECKING:
    import pandas

NAME = "site"
OURS = (
    "output",
    "overwrite",
    "resume",
    "restart",
    "plan",
    "plan_logs",
    "plan_workers",
    "scheduler",
    "workers",
)  # of slide-logs, that run-sites sets itself
YES, NO = ("true", "yes", "y", "1"), ("false", "no", "n", "0")
UNFIT = re.compile(r'[\x00-\x1f/\\:*?"<>|;]')  # characters that some system or library does not allow in a name
LONGEST_NAME = 80


@dataclass(frozen=True)
class SiteOptions:
    """One site: its own parameters of slide-logs, or the error in them."""

    name: str
    values: Mapping[str, Any]
    fault: str = ""


def refuse_unclear(
    sites: str | None, configs: str | None, by: str | None, dem: str | None, releases: str | None
) -> None:
    """Require exactly one source of sites, and for scattered releases their inputs."""
    given = [flag for flag, value in (("--sites", sites), ("--configs", configs), ("--by", by)) if value]
    if len(given) != 1:
        found = f"{' and '.join(given)} are given" if given else "none is given"
        raise UserError(
            f"run-sites takes one of --sites TABLE, --configs FOLDER, and --by FIELD with --releases; {found}"
        )
    if by is not None:
        for flag, value in (("--dem", dem), ("--releases", releases)):
            if value is None:
                raise UserError(f"--by {by} needs {flag}: one layer of releases on one terrain model")


def sites_of_table(path: str, slides: Tool, feedback: Feedback) -> list[SiteOptions]:
    """One site for each row; columns are parameters of ``slides`` by the names of their flags, empty cells are not set.

    Relative paths are relative to the table's folder.
    """
    rows = read_table(path, what="sites")
    where = where_of(rows)
    known = {each.name: each for each in slides.parameters()}
    columns = columns_by_key(rows, known, where, feedback)
    if NAME not in columns:
        raise UserError(f"{where}: the sites table has no column '{NAME}' with the name of each site")
    names = [_text(each) for each in rows[columns[NAME]]]
    refuse_bad_names(names, where)
    base = Path(path.partition("|")[0]).parent
    sites = []
    for row, name in enumerate(names):
        values, fault = {}, ""
        for key, column in columns.items():
            cell = rows[column].iloc[row]
            if key == NAME or _text(cell) == "":
                continue
            try:
                values[key] = path_seen_from(known[key], value_of_cell(known[key], cell), base)
            except UserError as error:
                fault = fault or f"{where}, row {row + 1}: {error}"
        sites.append(SiteOptions(name, values, fault))
    return sites


def columns_by_key(
    rows: pandas.DataFrame, known: Mapping[str, Parameter], where: str, feedback: Feedback
) -> dict[str, str]:
    """Columns that name the site or a parameter, by its name; a word similar to a known one is an error, not a foreign
    column.
    """
    columns: dict[str, str] = {}
    foreign = []
    now = {old: name for name, each in known.items() for old in each.old_names}
    for column in rows.columns:
        key = str(column).strip().lower().lstrip("-").replace("-", "_").replace(" ", "_")
        key = now.get(key, key)
        if key in OURS:
            raise UserError(f"{where}: the column '{column}' is set by run-sites itself; remove it")
        if key in columns:
            raise UserError(f"{where}: the columns '{columns[key]}' and '{column}' mean the same; remove one")
        if key == NAME or key in known:
            columns[key] = column
        elif key != "geometry":
            foreign.append(str(column))
    for column in foreign if NAME in columns else ():
        if hint := closest(column, known):
            raise UserError(f"{where}: no parameter of slide-logs is called '{column}'{hint} (rename the column)")
    if foreign:
        feedback.note(
            f"{where}: no parameters of slide-logs, ignored: {', '.join(foreign)}",
            code="parameters-ignored",
            parameters=len(foreign),
        )
    return columns


def value_of_cell(parameter: Parameter, cell: Any) -> Any:
    """The checked value of a cell, as the flag would give it."""
    text = _text(cell)
    if parameter.is_switch:
        if text.lower() not in (*YES, *NO):
            raise UserError(f"{parameter.flag} is '{text}', but must be true or false")
        return text.lower() in YES
    value = parameter.of_kind.from_text(parameter, text)
    check_value(parameter, value)
    return value


def _text(cell: Any) -> str:
    """The text of a cell as a user would type it; empty for an empty cell."""
    if cell is None or cell != cell or str(cell) == "<NA>":
        return ""
    if hasattr(cell, "item"):
        cell = cell.item()
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 2.0**53:
        return str(int(cell))
    return str(cell).strip()


def path_seen_from(parameter: Parameter, value: Any, base: Path) -> Any:
    """A relative path relative to a folder; other values unchanged."""
    if not is_path(parameter, value):
        return value
    file, bar, layer = str(value).partition("|")
    return os.path.abspath(base / file) + bar + layer


def sites_of_folder(path: str, slides: Tool, feedback: Feedback) -> list[SiteOptions]:
    """One site per JSON file, or per folder with a manifest, in a folder; the format of ``slide-logs --config``.

    Relative paths refer to the current folder, as there, or, if nothing is found, to the folder of the file.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise UserError(f"--configs {path}: this is not a folder; it must hold a JSON file of parameters for each site")
    files = {each.stem: each for each in sorted(folder.glob("*.json"))}
    files |= {each.parent.name: each for each in sorted(folder.glob("*/manifest.json"))}
    if not files:
        raise UserError(f"--configs {path}: the folder holds no JSON file of parameters (NAME.json for each site)")
    refuse_bad_names(list(files), path)
    known = {each.name: each for each in slides.parameters()}
    sites = []
    for name, file in files.items():
        try:
            values = read_config(str(file), slides, feedback.note, changed=feedback.warn)
        except UserError as error:
            sites.append(SiteOptions(name, {}, str(error).removeprefix("--config ")))
            continue
        for key, value in values.items():
            if is_path(known[key], value) and not os.path.exists(str(value).partition("|")[0]):
                beside = path_seen_from(known[key], value, file.parent)
                values[key] = beside if os.path.exists(beside.partition("|")[0]) else value
        sites.append(SiteOptions(name, {key: value for key, value in values.items() if key not in OURS}))
    return sites


def refuse_bad_names(names: Sequence[str], where: str) -> None:
    """Names become folders, also on systems that do not distinguish upper and lower case."""
    seen: dict[str, int] = {}
    for row, name in enumerate(names, start=1):
        if not name or name != folder_name(name):
            shown = f"'{name}' is not a name of a folder" if name else "the site has no name"
            raise UserError(f"{where}, field '{NAME}', row {row}: {shown}; name it with letters, digits, - and _")
        if name.lower() in seen:
            raise UserError(f"{where}, field '{NAME}': '{name}' occurs in rows {seen[name.lower()]} and {row}")
        seen[name.lower()] = row


def folder_name(text: str) -> str:
    """A text turned into a folder name that is valid on any system."""
    return UNFIT.sub("_", text).strip(" .")[:LONGEST_NAME] or "_"
