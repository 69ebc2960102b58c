"""Checks of parameters given from Python, where a number can be of any size and type."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import numpy as np
import pytest

from deadwood_algorithms.files.configs import value_from_json
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.kinds import KINDS
from deadwood_algorithms.params.tool import Parameter, UserError, check_value


@pytest.mark.parametrize("kind", ["number", "integer", "number_or_layer"])
@pytest.mark.parametrize("value", [10**400, -(10**400)])
def test_a_whole_number_beyond_all_floats_is_refused_in_one_line(kind, value):
    with pytest.raises(UserError) as error:
        check_value(Parameter(kind=kind, label="Length", name="length_m", minimum=0.0), value)
    assert str(error.value).startswith("--length-m is ")
    assert "must be finite" in str(error.value)
    assert len(str(error.value)) < 100


@pytest.mark.parametrize("value", [float("inf"), float("nan"), True, "3", None, [1.0], 1j])
def test_what_is_no_finite_number_is_refused(value):
    with pytest.raises(UserError, match="^--length-m is "):
        check_value(Parameter(kind="number", label="Length", name="length_m"), value)


def test_numbers_that_are_the_size_of_nothing_are_refused():
    """But integers, which are counts or seeds, may have any size."""
    parameter = Parameter(kind="number", label="Length", name="length_m")
    for value in (10**300, -(10**300), 1e-320, 1.7e308):
        with pytest.raises(UserError, match="--length-m is .*, which is not a possible size"):
            check_value(parameter, value)
    for value in (0, 1e-9, -1e12):
        check_value(parameter, value)
    check_value(dataclasses.replace(parameter, kind="integer"), 2**200)


def several(**facts: Any) -> Parameter:
    return Parameter(kind="numbers", label="Heights", name="heights_m", unit="m", **facts)


def test_numbers_are_given_with_commas_or_as_a_range():
    from_text = KINDS["numbers"].from_text
    assert from_text(several(), "3") == (3.0,)
    assert from_text(several(), "0.4, 0.2,0.3,") == (0.4, 0.2, 0.3)
    assert from_text(several(), "0.1:0.3:0.05") == (0.1, 0.15, 0.2, 0.25, 0.3)
    assert from_text(several(), "0.1:0.3:0.15") == (0.1, 0.25)
    assert from_text(several(), "-1:1:1") == (-1.0, 0.0, 1.0)
    for text, words in (
        ("0.3:0.1:0.1", "from:to:step must rise"), ("0:1:0", "from:to:step must rise"), ("0:1:-1", "must rise"),
        ("0:1e9:1", "in at most 100 numbers"), ("0:inf:1", "must rise"), ("0:1", "'0:1', but must be numbers"),
        ("1,x", "'1,x', but must be numbers separated by commas, or from:to:step"),
    ):  # fmt: skip
        with pytest.raises(UserError, match=re.escape(words)):
            from_text(several(), text)


def test_numbers_from_json_and_python_are_those_of_the_flag():
    given = KINDS["numbers"].from_value
    for value in ("1,2.5", [1, 2.5], (1.0, 2.5), np.array([1.0, 2.5])):
        assert given(several(), value) == (1.0, 2.5)
    assert given(several(), 3) == (3,)


@pytest.mark.parametrize(
    ("facts", "value", "words"),
    [
        ({}, (), "--heights-m is '', but must be 1 to 100 numbers"),
        ({}, (1.0, 2.0, 1.0), "--heights-m is '1,2,1', but must be different numbers"),
        ({"ascending": True}, (2.0, 1.0), "each number must be larger than the one before"),
        ({"ascending": True}, (1.0, 1.0), "each number must be larger than the one before"),
        ({"most_count": 2}, (1.0, 2.0, 3.0), "must be 1 to 2 numbers"),
        ({"least_count": 2}, (1.0,), "must be 2 to 100 numbers"),
        ({"minimum": 0.0, "exclusive": True}, (1.0, 0.0), "is 0 m, but must be greater than 0 m"),
        ({"maximum": 5.0, "exclusive_maximum": True}, (5.0, 1.0), "is 5 m, but must be less than 5 m"),
        ({}, (1.0, float("nan")), "must be finite"),
        ({}, ("1",), "is '1', but must be a number"),
        ({}, (None,), "is 'None', but must be a number"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(facts, value, words):
    with pytest.raises(UserError, match=re.escape(words)):
        check_value(several(**facts), value)


def test_numbers_that_fit_are_taken():
    check_value(several(), (2.0, 1.0))
    check_value(several(maximum=5.0, minimum=0.0, ascending=True, most_count=2), (0.0, 5.0))


def test_the_seed_is_bounded_by_what_philox_takes():
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Ask:
        seed: int = tool.seed()

    parameter = dataclasses.fields(Ask)[0].metadata["parameter"]
    with pytest.raises(UserError, match="must be at most"):
        check_value(dataclasses.replace(parameter, name="seed"), 2**63)


def test_a_number_in_place_of_a_layer_is_a_number_from_flag_file_and_python():
    """As text it would have to be read again, and could have lost digits."""

    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Ask:
        friction: str | float = tool.number_or_layer("Friction", minimum=0.0)

    toy = tool.Tool("toy", "Prepare", "Toy", Ask, lambda ask, feedback: None)  # type: ignore[arg-type, return-value]
    parameter = next(iter(toy.parameters()))
    exact = 0.1 + 0.2  # seventeen digits
    for value in (repr(exact), exact):
        assert toy.ask_from({"friction": value}).friction == exact
        assert value_from_json(parameter, value) == exact
    assert parameter.of_kind.from_text(parameter, repr(exact)) == exact
    assert isinstance(toy.ask_from({"friction": "1"}).friction, float)
    for path in ("mu.tif", "mu.gpkg|layername=0.3", "0,3"):
        assert toy.ask_from({"friction": path}).friction == value_from_json(parameter, path) == path
