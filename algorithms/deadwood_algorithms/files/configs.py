"""A file of parameters: names and values, the manifest of an earlier run, or a result that carries its record.

Standard library only, except for the record in a GeoTIFF.
"""

from __future__ import annotations

import difflib
import json
import os
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from deadwood_algorithms.files import identity
from deadwood_algorithms.files.embedded import BESIDE, CARRIERS, is_sealed, record_in
from deadwood_algorithms.params.manifest import is_path, moved_paths
from deadwood_algorithms.params.renamed import with_new_names
from deadwood_algorithms.params.tool import Parameter, Quiet, Tool, UserError

LARGEST_CONFIG = 64 * 2**20  # bytes
UNHEARD = Quiet().note


def value_from_json(parameter: Parameter, value: Any) -> Any:
    """A value from a file of parameters, in the form in which the flag would give it."""
    kind = parameter.of_kind
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if number and kind.number_as_text:
        return str(value)
    as_it_is = kind.json_as_it_is or (number and kind.number_or_text)  # Tool.check rejects what does not fit
    if not as_it_is and (not isinstance(value, str) or not value.strip()):
        raise UserError(f"'{parameter.name}' is {json.dumps(value)}, but must be text ({parameter.label})")
    return kind.from_value(parameter, value)


def read_config(
    path: str,
    tool: Tool,
    note: Callable[[str], None] = UNHEARD,
    *,
    changed: Callable[[str], None] | None = None,
    given: Collection[str] = (),
) -> dict[str, Any]:
    """The parameters in a JSON file, either a plain object of names and values, or those of an earlier run: its
    manifest, or a file of its results that contains the record.

    Relative paths in it are relative to the current folder, as in flags. An input of a manifest that no longer exists
    is searched for where it would be if everything was moved together; ``note`` is called with the place.

    Parameters
    ----------
    changed : callable, optional
        Called for each input that has changed since the manifest was made; without it that is an error.
    given : collection of str
        Parameters that are given in another way, so that their inputs in the file do not matter.
    """
    content = _content(path)
    then, records = None, {}
    if isinstance(content, dict) and isinstance(content.get("parameters"), dict):
        made_by = content.get("tool", tool.name)
        if made_by != tool.name:
            raise UserError(f"--config {path} belongs to the tool '{made_by}', not to '{tool.name}'")
        if not is_sealed(content):
            raise UserError(
                f"--config {path}: this record of a run is not as it was written; restore it, or name a file of your "
                "own parameters; an option given beside --config overrides its value there"
            )
        then, records = content.get("folder"), _records(content)
        content = content["parameters"]
    if not isinstance(content, dict):
        raise UserError(f'--config {path} must hold a JSON object of parameters, such as {{"seed": 0}}')
    known = {parameter.name: parameter for parameter in tool.parameters()}
    content = with_new_names(tool.name, content)
    now, then = Path(path).absolute().parent, then if isinstance(then, str) else None
    values = {}
    for name, value in content.items():
        if name not in known:
            raise UserError(f"--config {path}: {tool.name} has no parameter '{name}'{closest(name, known)}")
        if value is not None:  # null is the same as a missing parameter
            try:
                values[name] = value_from_json(known[name], value)
            except UserError as error:
                raise UserError(f"--config {path}: {error}") from None
            if is_path(known[name], values[name]) and not known[name].is_output and name not in given:
                if name in records:
                    values[name] = _compared(path, values[name], records[name], now, then, note, changed)
                else:
                    parts = values[name].split(",") if known[name].path_like else [values[name]]
                    values[name] = ",".join(_found(part, now, then, note) for part in parts)
    return values


def _content(path: str) -> Any:
    """The content of the file, or the record that it contains."""
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise UserError(f"--config {path} is not a file (a folder, a pipe or a device); write it to a file first")
        if Path(path).stat().st_size > LARGEST_CONFIG:
            raise UserError(
                f"--config {path} is larger than {LARGEST_CONFIG // 2**20} MB; it is not a file of parameters"
            )
        if Path(path).suffix.lower() in CARRIERS or Path(path + BESIDE).is_file():
            record = record_in(Path(path))
            if record is None:
                raise UserError(f"--config {path} carries no record of what made it; name a file of parameters")
            return record
        return json.loads(Path(path).read_text(encoding="utf-8-sig"), object_pairs_hook=partial(_each_once, path))
    except OSError as error:
        raise UserError(f"--config {path} cannot be read: {error.strerror or error}") from None
    except RecursionError:
        raise UserError(f"--config {path} is nested too deep; it must hold a JSON object of parameters") from None
    except ValueError as error:
        raise UserError(f"--config {path} is not JSON: {error}") from None


def _each_once(path: str, members: list[tuple[str, Any]]) -> dict[str, Any]:
    """The members of a JSON object, of which the last of one name would count, without a word about the others."""
    for name, times in Counter(name for name, _ in members).items():
        if times > 1:
            raise UserError(f"--config {path}: '{name}' is given more than once; keep one")
    return dict(members)


def _records(manifest: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """The inputs of a manifest by parameter; invalid records are ignored."""
    listed = manifest.get("inputs")
    rows = [each for each in listed if isinstance(each, dict)] if isinstance(listed, list) else []
    return {str(each.get("parameter")): each for each in rows if isinstance(each.get("path"), str)}


def _compared(
    path: str,
    value: str,
    record: Mapping[str, Any],
    now: Path,
    then: str | None,
    note: Callable[[str], None],
    changed: Callable[[str], None] | None,
) -> str:
    """Where an input of a manifest lies; one that has changed since is refused, or reported."""
    if value != record["path"]:  # the manifest was edited: another input is meant
        return value
    place, stands, file = identity.where_now(record, now, then)
    if stands == identity.CHANGED and changed is None:
        raise UserError(
            f"--config {path}: {file} has changed since, so the result "
            "would not be that of the manifest; restore the file, or use it as it is with --changed-inputs"
        )
    if stands == identity.CHANGED and changed is not None:
        changed(f"{file} has changed since {path} was made; the result is that of the changed file")
    if place != value and stands != identity.GONE:
        note(f"{value} is not there; {place}, at the same place relative to the manifest, is read instead")
    return place


def _found(named: str, now: Path, then: str | None, note: Callable[[str], None]) -> str:
    """An input's path as in the manifest or, if nothing is there, where it was moved to.

    ``now`` and ``then`` are the manifest's folder and the one that it names.
    """
    file, bar, layer = named.partition("|")
    if not os.path.exists(file):
        for other in moved_paths(file, now, then):
            if other.exists():
                note(f"{file} is not there; {other}, at the same place relative to the manifest, is read instead")
                return f"{other}{bar}{layer}"
    return named


def closest(word: str, known: Mapping[str, Any]) -> str:
    """A question that names the known word closest to a misspelt one; empty if none is close."""
    near = difflib.get_close_matches(word, known, n=1)
    return f"; did you mean '{near[0]}'?" if near else ""
