"""A tool's declaration rendered: values from text and JSON, option, help line, and description in JSON.

Text from a flag and values from a file go through the same checks (``Tool.check``), so a wrong number reads the same
wherever it stood.
"""

from __future__ import annotations

import dataclasses
import difflib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from deadwood_algorithms.tool import VERSION, Parameter, Tool, UserError

LARGEST_INTEGER = 2**63 - 1


def value_from_text(parameter: Parameter, text: str) -> Any:
    """The value that a flag's text stands for; a number that is none is the user's error."""
    return parameter.of_kind.from_text(parameter, text)


def value_from_json(parameter: Parameter, value: Any) -> Any:
    """The value that stands in a file of parameters, in the form in which the flag would give it."""
    kind = parameter.of_kind
    if kind.json_as_it_is:
        return value  # Tool.check refuses what does not fit
    if kind.number_as_text and isinstance(value, (int, float)) and not isinstance(value, bool):
        return str(value)
    if not isinstance(value, str) or not value.strip():
        raise UserError(f"'{parameter.name}' is {json.dumps(value)}, but must be text ({parameter.label})")
    return value


def read_config(path: str, tool: Tool) -> dict[str, Any]:
    """The parameters in a JSON file: a plain object of names and values, or the manifest of an earlier run.

    Relative paths in it are taken from the folder in which the command runs, as those of flags are.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"--config {path} cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        raise UserError(f"--config {path} is not JSON: {error}") from None
    if isinstance(content, dict) and isinstance(content.get("parameters"), dict):
        made_by = content.get("tool", tool.name)
        if made_by != tool.name:
            raise UserError(f"--config {path} belongs to the tool '{made_by}', not to '{tool.name}'")
        content = content["parameters"]
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
    return values


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
    if parameter.default is not None and not parameter.is_switch:
        last = f"default {default_text(parameter)}"
    elif parameter.is_switch or parameter.optional:
        last = ""
    else:
        last = "required"
    geometry = " or ".join(parameter.geometry)
    return ", ".join(part for part in (geometry, parameter.unit, bounds(parameter), last) if part)


def help_line(parameter: Parameter) -> tuple[str, str]:
    """The two columns of the help: how the flag is written, and what it means."""
    off = f" / --no-{parameter.flag[2:]}"
    left = parameter.flag + (off if parameter.is_switch else f" {parameter.metavar}")
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
        "widget": parameter.widget,
    }
