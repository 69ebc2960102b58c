"""A file of parameters: names and values, or the manifest of an earlier run. Standard library only."""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from deadwood_algorithms.params.tool import Parameter, Quiet, Tool, UserError, is_path, moved_paths

LARGEST_CONFIG = 64 * 2**20  # bytes
UNHEARD = Quiet().note


def value_from_json(parameter: Parameter, value: Any) -> Any:
    """The value that stands in a file of parameters, in the form in which the flag would give it."""
    kind = parameter.of_kind
    if kind.json_as_it_is:
        return value  # Tool.check refuses what does not fit
    if (kind.number_as_text or kind.number_or_text) and isinstance(value, (int, float)) and not isinstance(value, bool):
        return str(value) if kind.number_as_text else value
    if not isinstance(value, str) or not value.strip():
        raise UserError(f"'{parameter.name}' is {json.dumps(value)}, but must be text ({parameter.label})")
    return kind.from_text(parameter, value) if kind.number_or_text else value


def read_config(path: str, tool: Tool, note: Callable[[str], None] = UNHEARD) -> dict[str, Any]:
    """The parameters in a JSON file: a plain object of names and values, or the manifest of an earlier run.

    Relative paths in it are taken from the folder in which the command runs, as those of flags are. An input of a
    manifest that is not there is looked for where it lies if all was moved together; ``note`` is told of it.
    """
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise UserError(f"--config {path} is no file (a folder, a pipe or a device); write it to a file first")
        if Path(path).stat().st_size > LARGEST_CONFIG:
            raise UserError(f"--config {path} is larger than {LARGEST_CONFIG // 2**20} MB; it is no file of parameters")
        content = json.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UserError(f"--config {path} cannot be read: {error.strerror or error}") from None
    except RecursionError:
        raise UserError(f"--config {path} is nested too deep; it must hold a JSON object of parameters") from None
    except ValueError as error:
        raise UserError(f"--config {path} is not JSON: {error}") from None
    then = None
    if isinstance(content, dict) and isinstance(content.get("parameters"), dict):
        made_by = content.get("tool", tool.name)
        if made_by != tool.name:
            raise UserError(f"--config {path} belongs to the tool '{made_by}', not to '{tool.name}'")
        then, content = content.get("folder"), content["parameters"]
    if not isinstance(content, dict):
        raise UserError(f'--config {path} must hold a JSON object of parameters, such as {{"seed": 0}}')
    known = {parameter.name: parameter for parameter in tool.parameters()}
    values = {}
    for name, value in content.items():
        if name not in known:
            raise UserError(f"--config {path}: {tool.name} has no parameter '{name}'{closest(name, known)}")
        if value is not None:  # null means: as if it were not there
            try:
                values[name] = value_from_json(known[name], value)
            except UserError as error:
                raise UserError(f"--config {path}: {error}") from None
            if is_path(known[name], values[name]) and not known[name].is_output:
                parts = values[name].split(",") if known[name].path_like else [values[name]]
                now = Path(path).absolute().parent
                values[name] = ",".join(_found(part, now, then, note) for part in parts)
    return values


def _found(named: str, now: Path, then: Any, note: Callable[[str], None]) -> str:
    """An input's path as a manifest names it, or, where nothing is there, where it has been moved to.

    ``now`` and ``then`` are the manifest's folder and the one that it names.
    """
    file, bar, layer = named.partition("|")
    if not os.path.exists(file):
        for other in moved_paths(file, now, then if isinstance(then, str) else None):
            if other.exists():
                note(f"{file} is not there; {other}, which lies as it did to the manifest, is read in its place")
                return f"{other}{bar}{layer}"
    return named


def closest(word: str, known: Mapping[str, Any]) -> str:
    """A question that names the known word nearest to a misspelt one, or nothing."""
    near = difflib.get_close_matches(word, known, n=1)
    return f"; did you mean '{near[0]}'?" if near else ""
