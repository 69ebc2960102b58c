"""The possible content of a file of parameters, as JSON Schema: ``deadwood-tool describe TOOL --json-schema``.

For editors that complete and check a ``--config`` file, and for programs that make forms. Whether a file exists, and
what only a tool itself can check (that two options conflict) is not in the schema.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from deadwood_algorithms.params.kinds import LARGEST
from deadwood_algorithms.params.tool import VERSION, Parameter, Tool
from deadwood_toolbox.feedback import plain

DRAFT = "https://json-schema.org/draft/2020-12/schema"
A_TEXT = {"type": "string", "pattern": r"\S"}
LARGEST_INTEGER = 2**63 - 1


def schema_of(tool: Tool) -> dict[str, Any]:
    """The schema of the parameters of one tool."""
    declared = list(tool.parameters())
    properties = {each.name: _property(each) for each in declared}
    for each in declared:
        for old in each.old_names:
            properties[old] = {**_property(each), "deprecated": True}
    return {
        "$schema": DRAFT,
        "title": tool.name,
        "description": tool.summary,
        "$comment": f"of version {VERSION}",
        "type": "object",
        "properties": properties,
        "required": [each.name for each in declared if each.default is None and not each.optional],
        "additionalProperties": False,
    }


def schemas_of(tools: Sequence[Tool]) -> dict[str, Any]:
    """The schemas of all tools, by name."""
    return {
        "$schema": DRAFT,
        "$comment": f"of version {VERSION}",
        "$defs": {each.name: schema_of(each) for each in tools},
    }


def _property(parameter: Parameter) -> dict[str, Any]:
    facts: dict[str, Any] = {"title": parameter.label}
    if parameter.help:
        facts["description"] = parameter.help
    if parameter.unit:
        facts["unit"] = parameter.unit
    if parameter.default is not None:
        facts["default"] = plain(parameter.default)
    forms = _forms(parameter)
    if parameter.default is not None or parameter.optional:
        forms.append({"type": "null"})  # the same as a missing parameter
    return facts | (forms[0] if len(forms) == 1 else {"anyOf": forms})


def _forms(parameter: Parameter) -> list[dict[str, Any]]:
    """The possible JSON forms of a value."""
    kind = parameter.of_kind
    number = _number(parameter)
    if parameter.choices:
        return [{"enum": list(parameter.choices)}]
    if parameter.is_switch:
        return [{"type": "boolean"}]
    if kind.several:
        limits = {"minItems": parameter.least_count, "maxItems": parameter.most_count, "uniqueItems": True}
        one = [number] if parameter.least_count == 1 else []
        return [{"type": "array", "items": number, **limits}, *one, A_TEXT]
    if kind.json_as_it_is:
        return [number]
    if kind.number_or_text:
        return [number, A_TEXT]
    return [A_TEXT, {"type": "number"}] if kind.number_as_text else [A_TEXT]


def _number(parameter: Parameter) -> dict[str, Any]:
    whole = parameter.of_kind.whole
    most = LARGEST_INTEGER if whole else LARGEST
    low, high = parameter.minimum, parameter.maximum
    found: dict[str, Any] = {"type": "integer" if whole else "number"}
    found["exclusiveMinimum" if low is not None and parameter.exclusive else "minimum"] = -most if low is None else low
    found["exclusiveMaximum" if high is not None and parameter.exclusive_maximum else "maximum"] = (
        most if high is None else high
    )
    return found
