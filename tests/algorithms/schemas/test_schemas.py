"""The schemas agree with the contract, and check values accordingly."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from deadwood_algorithms import schemas
from deadwood_algorithms.schemas.written import WRITTEN
from docs import generated, layers

CONTRACT = Path(__file__).parents[4] / "shared" / "CONTRACT.md"
COLUMNS = {
    "releases": "log_id release_id dbh_cm length_m density_kg_m3 orientation tilt_deg azimuth_deg speed_ms drop_m",
    "trees": "tree_id dbh_cm height_m species crown_diameter_m",
    "barriers": "barrier_id height_m",
    "lines": "line_id name",
    "deposits": "log_id release_id release_x release_y release_z stop_reason stop_id duration_s path_m runout_m fall_m "
    "bearing_deg heading_deg tilt_deg speed_max_ms speed_mean_ms energy_max_kj jump_max_m height_max_m tree_hits "
    "barrier_hits energy_error_rel penetration_max_m",
    "trajectories": "log_id release_id duration_s speed_max_ms",
    "poses": "log_id t_s x y z xb yb zb xt yt zt speed_ms spin_rad_s clearance_m height_m",
}


@pytest.mark.parametrize("name", COLUMNS)
def test_every_column_of_the_contract_is_there_in_its_order(name):
    names = [column.name for column in schemas.LAYERS[name].columns]
    promised = COLUMNS[name].split()
    assert [each for each in names if each in promised] == promised


@pytest.mark.skipif(not CONTRACT.exists(), reason="the contract is not part of the repository")
def test_every_name_that_the_contract_quotes_for_a_layer_is_in_a_schema():
    text = CONTRACT.read_text()
    section = text[text.index("## 3.") : text.index("## 4.")]
    quoted = {each for each in re.findall(r"`([a-z_0-9]+)`", section) if "_" in each}
    known = {column.name for layer in schemas.LAYERS.values() for column in layer.columns}
    known |= set(schemas.ORIENTATIONS) | set(schemas.STOP_REASONS)
    assert quoted - known == set()


def test_the_unit_stands_in_the_name():
    for layer in schemas.LAYERS.values():
        for column in layer.columns:
            if column.unit and not re.fullmatch(r"((release|touch)_)?[xyz][bt]?", column.name):
                assert column.name.endswith("_" + column.unit_in_name)
                assert schemas.UNITS[column.unit_in_name] == column.unit
    assert schemas.RELEASES.column("density_kg_m3").unit == "kg/m³"
    assert schemas.POSES.column("spin_rad_s").unit == "rad/s"
    assert schemas.POSES.column("t_s").unit == "s"


def test_defaults_are_those_of_the_contract_and_lie_within_their_bounds():
    defaults = {column.name: column.default for column in schemas.RELEASES.columns if column.default is not None}
    assert defaults == {
        "dbh_cm": 75,
        "length_m": 30,
        "density_kg_m3": 300,
        "orientation": "upright",
        "tilt_deg": 0,
        "azimuth_deg": 0,
        "speed_ms": 0,
        "drop_m": 0,
    }
    for name, value in defaults.items():
        assert schemas.value_fault(schemas.RELEASES.column(name), value) is None


@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("dbh_cm", 0.0, "greater than 0"),
        ("dbh_cm", float("nan"), "finite"),
        ("dbh_cm", "thick", "finite"),
        ("tilt_deg", 181, "at most 180"),
        ("drop_m", -1, "at least 0"),
        ("orientation", "sideways", "upright, lying, tilted"),
        ("log_id", 1.5, "whole"),
        ("log_id", -1, "at least 0"),
        ("dbh_cm", 75.0, None),
        ("drop_m", 0, None),
        ("orientation", "lying", None),
        ("log_id", 3, None),
        ("release_id", "anything", None),
    ],
)
def test_values_are_judged(name, value, fault):
    found = schemas.value_fault(schemas.RELEASES.column(name), value)
    assert (found is None) if fault is None else (found is not None and fault in found)


def test_what_a_layer_needs():
    assert schemas.TREES.required == ("dbh_cm", "height_m")
    assert schemas.RELEASES.required == ()
    assert schemas.columns_of("no layer of ours") == ()


def test_the_pages_name_every_column_that_is_written():
    pages = generated.pages()
    for output in WRITTEN:
        assert f"`{output.place}`".replace("|", "\\|") in pages[f"reference/tools/{output.tool}.md"]
        page = pages.get(f"reference/layers/{generated.slug(layers.title_of(output.what))}.md", "")
        for each in getattr(output.what, "columns", ()):
            assert f"| `{each.name}` |" in page
