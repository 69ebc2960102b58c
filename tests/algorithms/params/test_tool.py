"""Checks of parameters given from Python, where a number can be of any size and type."""

from __future__ import annotations

import dataclasses

import pytest

from deadwood_algorithms.files.configs import value_from_json
from deadwood_algorithms.params import tool
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


def test_numbers_of_any_size_that_floats_hold_are_taken():
    parameter = Parameter(kind="number", label="Length", name="length_m")
    for value in (10**300, -(10**300), 0, 1e-320, 1.7e308):
        check_value(parameter, value)
    check_value(dataclasses.replace(parameter, kind="integer"), 2**200)


def test_the_seed_is_bounded_by_what_philox_takes():
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Ask:
        seed: int = tool.seed()

    parameter = dataclasses.fields(Ask)[0].metadata["parameter"]
    with pytest.raises(UserError, match="must be at most"):
        check_value(dataclasses.replace(parameter, name="seed"), 2**63)


def test_a_number_in_place_of_a_layer_is_a_number_from_flag_file_and_python():
    """Its text would have to be read again, and could have lost digits on the way."""

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
