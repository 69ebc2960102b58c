"""``describe --json-schema``: a valid schema, which accepts and refuses the same as ``--config``."""

from __future__ import annotations

import itertools
import json
from typing import Any

import jsonschema
import pytest
from jsonschema import Draft202012Validator

from deadwood_algorithms.files.configs import value_from_json
from deadwood_algorithms.params.tool import Parameter, UserError, check_value
from deadwood_toolbox import cli
from deadwood_toolbox.json_schema import schema_of
from deadwood_toolbox.shelf import TOOLS, find

VALUES = (
    None, True, False, 0, 1, -1, 3, 0.5, -0.5, 1e13, -1e13, 1e-3, 50, 99.5, 100, 101, "", " ", "0.25", "text", "a.gpkg",
    [], [1], [0.1, 0.2], [1, 1], [30, 300], [0.1, "x"], [None], {}, {"a": 1},
)  # fmt: skip


def is_taken(parameter: Parameter, value: Any) -> bool:
    """By ``--config``: null counts as absent, so a required parameter is then missing."""
    if value is None:
        return parameter.default is not None or parameter.optional
    try:
        check_value(parameter, value_from_json(parameter, value))
    except (UserError, TypeError):
        return False
    return True


def is_a_matter_of_text(parameter: Parameter, value: Any) -> bool:
    """What a schema cannot express: numbers written as text or with a point, the order of numbers, invalid names of
    outputs."""
    if parameter.kind == "integer":
        return isinstance(value, float) and value.is_integer()  # 3.0, which JSON Schema calls an integer
    if parameter.kind == "numbers":
        return isinstance(value, str) or (parameter.ascending and isinstance(value, list))
    return (isinstance(value, str) and parameter.kind == "number_or_layer") or parameter.is_output


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_a_schema_takes_what_a_file_of_parameters_may_hold(tool):
    schema = schema_of(tool)
    Draft202012Validator.check_schema(schema)
    json.dumps(schema, allow_nan=False)
    differing = [
        (parameter.name, value)
        for parameter, value in itertools.product(tool.parameters(), VALUES)
        if not is_a_matter_of_text(parameter, value)
        and is_taken(parameter, value) != Draft202012Validator(schema["properties"][parameter.name]).is_valid(value)
    ]
    assert differing == []


def test_the_whole_file():
    tool = find("slide-logs")
    assert tool is not None
    schema = schema_of(tool)
    jsonschema.validate({"dem": "dem.tif", "releases": "r.gpkg", "friction": 0.25, "output": "run"}, schema)
    for wrong in ({"dem": "dem.tif"}, {"dem": "a", "releases": "b", "output": "c", "demm": "d"}, []):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema)
    assert schema["properties"]["time_limit"]["deprecated"]
    assert schema["properties"]["time_limit_s"]["unit"] == "s"


def test_the_command_prints_one_or_all(capsys):
    assert cli.run(["describe", "vary", "--json-schema"]) == 0
    one = json.loads(capsys.readouterr().out)
    assert cli.run(["describe", "--json-schema"]) == 0
    everything = json.loads(capsys.readouterr().out)
    Draft202012Validator.check_schema(everything)
    assert everything["$defs"]["vary"] == one
    assert list(everything["$defs"]) == [tool.name for tool in TOOLS]
