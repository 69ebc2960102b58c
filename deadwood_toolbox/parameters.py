"""A tool's declaration rendered: values from text and JSON, option, help line, and description in JSON.

Text from a flag and values from a file go through the same checks (``Tool.check``), so an invalid number gives the same
message wherever it came from.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from deadwood_algorithms.files.configs import closest, read_config
from deadwood_algorithms.params.tool import VERSION, Parameter, Tool, UserError
from deadwood_algorithms.schemas.written import parts_of

__all__ = ["closest", "read_config"]  # re-exported from the algorithms; everything else is defined here
LARGEST_INTEGER = 2**63 - 1
LONGEST_LEFT = 76  # columns of the help: a flag with more choices has them on the right


def value_from_text(parameter: Parameter, text: str) -> Any:
    """The value of a flag's text; an invalid number is the user's error."""
    return parameter.of_kind.from_text(parameter, text)


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
    """The heading of a parameter in the help."""
    if parameter.is_output or parameter.name in ("overwrite", "resume", "restart", "plan"):
        return "Outputs"
    if parameter.group:
        return parameter.group
    if parameter.advanced:
        return "Advanced"
    return "Inputs" if parameter.is_input else "Parameters"


def by_section(tool: Tool) -> dict[str, list[Parameter]]:
    """The parameters of a tool by heading, in the order of the help."""
    declared = list(tool.parameters())
    groups = dict.fromkeys(each.group for each in declared if each.group)
    titles = ("Inputs", "Parameters", *groups, "Advanced", "Outputs")
    found = {title: [each for each in declared if section(each) == title] for title in titles}
    return {title: rows for title, rows in found.items() if rows}


def off(flag: str) -> str:
    """The flag that switches a switch off: ``--no-report``; for ``--no-browser``, ``--browser``."""
    return f"--{flag[5:]}" if flag.startswith("--no-") else f"--no-{flag[2:]}"


def bounds(parameter: Parameter) -> str:
    """The range of a number for a reader: ``0 < x <= 5``."""
    low, high = parameter.minimum, parameter.maximum
    if high is not None and high >= LARGEST_INTEGER:
        high = None
    below = "<" if parameter.exclusive_maximum else "<="
    if low is not None and high is not None:
        return f"{low:.10g} {'<' if parameter.exclusive else '<='} x {below} {high:.10g}"
    if low is not None:
        return f"{'>' if parameter.exclusive else '>='} {low:.10g}"
    return f"{below} {high:.10g}" if high is not None else ""


def default_text(parameter: Parameter) -> str:
    """The default as it would be typed."""
    values = parameter.default if isinstance(parameter.default, tuple) else (parameter.default,)
    return ",".join(f"{each:.10g}" if isinstance(each, float) else str(each) for each in values)


def facts(parameter: Parameter) -> str:
    """Facts in addition to the label: unit, range, geometry, and the default or that it is required."""
    if parameter.default is not None and not parameter.is_switch:
        last = f"default {default_text(parameter)}"
    elif parameter.is_switch or parameter.optional:
        last = ""
    else:
        last = "required"
    geometry = " or ".join(parameter.geometry)
    return ", ".join(part for part in (geometry, parameter.unit, bounds(parameter), last) if part)


def help_line(parameter: Parameter) -> tuple[str, str]:
    """The two columns of the help: the flag and its meaning."""
    metavar = parameter.metavar if len(parameter.metavar) <= LONG_CHOICES else "NAME"
    left = parameter.flag + (f" / {off(parameter.flag)}" if parameter.is_switch else f" {metavar}")
    known = facts(parameter)
    if len(left) > LONGEST_LEFT:
        left, known = f"{parameter.flag} NAME", ", ".join(part for part in (*parameter.choices, known) if part)
    right = parameter.label + (f" [{known}]" if known else "")
    right += f". {parameter.help}" if parameter.help else ""
    return (
        left,
        right if metavar == parameter.metavar else f"{right.rstrip('.')}. One of: {', '.join(parameter.choices)}.",
    )


LONG_CHOICES = 40  # characters: longer choices would push the meaning off the screen


def describe(tool: Tool) -> dict[str, Any]:
    """The complete declaration of a tool as plain JSON values, for the QGIS plugin and other programs."""
    parts = parts_of(tool.name)
    return {
        "name": tool.name,
        "label": tool.label,
        "group": tool.group,
        "qgis_id": tool.qgis_id,
        "summary": tool.summary,
        "description": tool.description,
        "version": VERSION,
        "parameters": [_describe_parameter(parameter, parts) for parameter in tool.parameters()],
    }


def _describe_parameter(parameter: Parameter, parts: Mapping[str, Sequence[str]]) -> dict[str, Any]:
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
        "ending": parameter.ending,
        "parts": list(parts.get(parameter.flag, ())),
    }
