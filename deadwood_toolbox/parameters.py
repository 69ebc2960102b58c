"""A tool's declaration rendered: values from text and JSON, option, help line, and description in JSON.

Text from a flag and values from a file go through the same checks (``Tool.check``), so a wrong number reads the same
wherever it stood.
"""

from __future__ import annotations

import dataclasses
import difflib
import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from deadwood_algorithms.tool import VERSION, Parameter, Quiet, Tool, UserError, is_path, moved_paths

METAVARS = {
    "raster": "RASTER",
    "vector": "LAYER",
    "table": "TABLE",
    "folder": "FOLDER",
    "file": "FILE",
    "number": "NUMBER",
    "integer": "WHOLE",
    "number_or_layer": "NUMBER|LAYER",
    "text": "TEXT",
    "field": "FIELD",
    "crs": "CRS",
    "output_raster": "FILE.tif",
    "output_vector": "FILE.gpkg",
    "output_table": "FILE.csv",
    "output_folder": "FOLDER",
    "output_file": "FILE",
}
LARGEST_INTEGER = 2**63 - 1
UNHEARD = Quiet().note


def value_from_text(parameter: Parameter, text: str) -> Any:
    """The value that a flag's text stands for; a number that is none is the user's error."""
    if parameter.kind == "integer":
        if not re.fullmatch(r"[+-]?[0-9]{1,30}", text.strip()):
            raise UserError(f"{parameter.flag} is '{text}', but must be a whole number")
        return int(text)
    if parameter.kind == "number":
        try:
            return float(text)
        except ValueError:
            raise UserError(f"{parameter.flag} is '{text}', but must be a number") from None
    if not text.strip():
        raise UserError(f"{parameter.flag} is empty ({parameter.label})")
    return text


def value_from_json(parameter: Parameter, value: Any) -> Any:
    """The value that stands in a file of parameters, in the form in which the flag would give it."""
    if parameter.kind in ("number", "integer", "flag"):
        return value  # Tool.check refuses what does not fit
    if (
        parameter.kind in ("number_or_layer", "text")
        and isinstance(value, (int, float))
        and not isinstance(value, bool)
    ):
        return str(value)
    if not isinstance(value, str) or not value.strip():
        raise UserError(f"'{parameter.name}' is {json.dumps(value)}, but must be text ({parameter.label})")
    return value


def read_config(path: str, tool: Tool, note: Callable[[str], None] = UNHEARD) -> dict[str, Any]:
    """The parameters in a JSON file: a plain object of names and values, or the manifest of an earlier run.

    Relative paths in it are taken from the folder in which the command runs, as those of flags are. An input of a
    manifest that is not there is looked for where it lies if all was moved together; ``note`` is told of it.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"--config {path} cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
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


def ask_from(tool: Tool, values: Mapping[str, Any]) -> Any:
    """The checked ``Ask`` of a tool; a path is given in the type that the declaration names."""
    annotated = {field.name: str(field.type) for field in dataclasses.fields(tool.Ask)}
    typed = {}
    for name, value in values.items():
        if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
            raise UserError(f"--{name.replace('_', '-')} is {str(value)[:12]}..., but must be below 2^63")
        typed[name] = Path(value) if isinstance(value, str) and "Path" in annotated.get(name, "") else value
    ask = tool.ask_from(typed)
    tool.check(ask)
    return ask


def section(parameter: Parameter) -> str:
    """Under which heading of the help a parameter stands."""
    if parameter.is_output or parameter.name in ("overwrite", "resume"):
        return "Outputs"
    if parameter.advanced:
        return "Advanced"
    return "Inputs" if parameter.is_input else "Parameters"


def bounds(parameter: Parameter) -> str:
    """The range of a number as a reader writes it: ``0 < x <= 5``."""
    low, high = parameter.minimum, parameter.maximum
    if high is not None and high >= LARGEST_INTEGER:
        high = None
    if low is not None and high is not None:
        return f"{low:.10g} {'<' if parameter.exclusive else '<='} x <= {high:.10g}"
    if low is not None:
        return f"{'>' if parameter.exclusive else '>='} {low:.10g}"
    return f"<= {high:.10g}" if high is not None else ""


def default_text(parameter: Parameter) -> str:
    """The default as one types it."""
    return f"{parameter.default:.10g}" if isinstance(parameter.default, float) else str(parameter.default)


def facts(parameter: Parameter) -> str:
    """What is worth knowing beside the label: unit, range, geometry, and default or that it is required."""
    if parameter.default is not None and parameter.kind != "flag":
        last = f"default {default_text(parameter)}"
    elif parameter.kind == "flag" or parameter.optional:
        last = ""
    else:
        last = "required"
    geometry = " or ".join(parameter.geometry)
    return ", ".join(part for part in (geometry, parameter.unit, bounds(parameter), last) if part)


def help_line(parameter: Parameter) -> tuple[str, str]:
    """The two columns of the help: how the flag is written, and what it means."""
    if parameter.kind == "flag":
        left = f"{parameter.flag} / --no-{parameter.flag[2:]}"
    elif parameter.kind == "choice":
        left = f"{parameter.flag} {'|'.join(parameter.choices)}"
    else:
        left = f"{parameter.flag} {METAVARS[parameter.kind]}"
    known = facts(parameter)
    right = parameter.label + (f" [{known}]" if known else "")
    return left, f"{right}. {parameter.help}" if parameter.help else right


def describe(tool: Tool) -> dict[str, Any]:
    """Everything that is declared of a tool, as plain JSON values: what the QGIS plugin and other programs read."""
    return {
        "name": tool.name,
        "label": tool.label,
        "group": tool.group,
        "qgis_id": tool.qgis_id,
        "summary": tool.summary,
        "description": tool.description,
        "version": VERSION,
        "parameters": [_describe_parameter(parameter) for parameter in tool.parameters()],
    }


def _describe_parameter(parameter: Parameter) -> dict[str, Any]:
    known = dataclasses.asdict(parameter)
    direction = "output" if parameter.is_output else "input" if parameter.is_input else "setting"
    required = parameter.default is None and not parameter.optional
    return {
        **known,
        "flag": parameter.flag,
        "direction": direction,
        "required": required,
        "section": section(parameter),
    }
