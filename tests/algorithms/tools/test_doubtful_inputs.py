"""Inputs with which a run would look right but be wrong: each is refused, or reported with the fix."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from shapely import LineString, box
from slope_case import EAST, NORTH, Case, layer, points, summary, write_dem, write_layer

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene import memory
from deadwood_algorithms.scene.ground import warn_of_ground
from deadwood_algorithms.scene.layers import read_barriers, read_lines, read_trees
from deadwood_algorithms.scene.shape import read_shape
from deadwood_algorithms.tools import generate_forest, sample_releases
from deadwood_toolbox import cli


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture
def grid(tmp_path):
    return read_dem(write_dem(tmp_path / "dem.tif"))


ACROSS = [LineString([(5, 40), (25, 40)]), LineString([(30, 45), (55, 45)]), LineString([(5, 50), (55, 50)])]


def test_lines_of_one_name_count_as_one_and_that_is_reported(grid, tmp_path, said):
    path = write_layer(tmp_path / "l.gpkg", ACROSS, name=["Steg", "Steg", "Strasse"])
    marks, items = read_lines(path, grid, said)
    assert (items.ids, items.item.tolist()) == (["Steg", "Strasse"], [0, 0, 1])
    assert len(marks.starts) == 4
    assert "field 'name': rows 1, 2 are called 'Steg' and count as one; to count them separately" in said.warnings[0]
    assert "give each its own line_id" in said.warnings[0]


def test_rows_of_one_id_are_noted(grid, tmp_path, said):
    path = write_layer(tmp_path / "b.gpkg", ACROSS, barrier_id=[7, 7, 7], name=["a", "b", "c"], height_m=[2.0] * 3)
    _, items = read_barriers(path, grid, said)
    assert items.ids == [7]
    assert not said.warnings
    assert any("'barrier_id': rows 1, 2, 3 are called '7' and count as one" in note for note in said.notes)


def test_barriers_of_one_name_are_reported_and_those_without_are_numbered_as_rows(grid, tmp_path, said):
    path = write_layer(tmp_path / "b.gpkg", ACROSS, name=["Netz", "Netz", "Netz"], height_m=[2.0, 3.0, 4.0])
    assert read_barriers(path, grid, said)[1].ids == ["Netz"]
    assert "give each its own barrier_id" in said.warnings[0]
    path = write_layer(tmp_path / "c.gpkg", ACROSS, height_m=[2.0, 3.0, 4.0])
    assert read_barriers(path, grid, said)[1].ids == [1, 2, 3]
    trees = write_layer(tmp_path / "t.gpkg", points((5, 50), (9, 50)), dbh_cm=[30.0, 30.0], height_m=[20.0, 20.0])
    assert read_trees(trees, grid, said)[1] == ["1", "2"]


@pytest.mark.parametrize("field", ["Höhe", "hauteur", "Altezza", "Nutzhöhe", "Werkshoehe", "hauteur_utile"])
def test_the_height_of_a_barrier_by_its_usual_names(grid, tmp_path, said, field):
    path = write_layer(tmp_path / "b.gpkg", ACROSS[:1], **{field: [3.5]})
    assert read_barriers(path, grid, said)[0].height.tolist() == [3.5]


def test_the_field_of_a_barrier_s_height_can_be_named(grid, tmp_path, said):
    """The option that the message prints finds it, also beside a field of a usual name that holds another height."""
    path = write_layer(tmp_path / "b.gpkg", ACROSS[:1], H_Netz=[3.5])
    with pytest.raises(UserError, match="--height-field names the one"):
        read_barriers(path, grid, said)
    assert read_barriers(path, grid, said, "H_Netz")[0].height.tolist() == [3.5]
    with pytest.raises(UserError, match=r"there is no field 'H' \(--height-field\)"):
        read_barriers(path, grid, said, "H")
    both = write_layer(tmp_path / "c.gpkg", ACROSS[:1], H_Netz=[3.5], Höhe=[850.0])
    assert read_barriers(both, grid, said, "H_Netz")[0].height.tolist() == [3.5]
    usual = write_layer(tmp_path / "d.gpkg", ACROSS[:1], Höhe=[3.0])
    assert read_barriers(usual, grid, said, "Höhe")[0].height.tolist() == [3.0]


def test_trees_of_one_id_are_reported(grid, tmp_path, said):
    facts = {"tree_id": [4, 4, 5], "dbh_cm": [30.0] * 3, "height_m": [20.0] * 3}
    read_trees(write_layer(tmp_path / "t.gpkg", points((5, 50), (9, 50), (12, 50)), **facts), grid, said)
    assert "field 'tree_id': rows 1, 2 are called '4'" in said.warnings[0]
    assert "deadwood-tool import-trees numbers them again" in said.warnings[0]


@pytest.mark.parametrize(
    ("height", "words"),
    [(300.0, "the median height_m is 300 m, which is too large; if these are centimetres, divide by 100")],
)
def test_a_barrier_of_300_m_is_reported(grid, tmp_path, said, height, words):
    read_barriers(write_layer(tmp_path / "b.gpkg", ACROSS[:1], height_m=[height]), grid, said)
    assert words in said.warnings[0]


IMPOSSIBLE: dict[str, tuple[dict[str, Any], str]] = {
    "a log of 1 km": (
        {"dbh_cm": [1e5]},
        "field 'dbh_cm', row 1: 100000 is not a number greater than 0 and at most 1500",
    ),
    "a thread": ({"dbh_cm": [1e-30]}, "field 'dbh_cm', row 1: 1e-30 cm is smaller than any possible"),
    "a log of 200 m": ({"length_m": [200.0]}, "at most 150"),
    "heavier than matter": ({"density_kg_m3": [1e5]}, "at most 25000"),
    "faster than falling": ({"speed_ms": [1e4]}, "at most 300"),
    "from the sky": ({"drop_m": [5e4]}, "at most 1000"),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_impossible_logs_are_refused(case, tmp_path, name):
    columns, words = IMPOSSIBLE[name]
    path = write_layer(tmp_path / "r.gpkg", points((30, 80)), **columns)
    with pytest.raises(UserError) as refused:
        case.run(releases=path, output=str(tmp_path / "run"))
    assert words in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"dbh_cm": 1e5}, "--dbh-cm is 100000 cm, but must be at most 1500 cm"),
        ({"length_m": 1e5}, "--length-m is 100000 m, but must be at most 150 m"),
        ({"length_m": 1e-9}, "--length-m: 1e-09 is not 0.01 to 150; check the unit"),
    ],
)
def test_impossible_options_are_refused(case, tmp_path, values, words):
    with pytest.raises(UserError) as refused:
        case.run(**({"output": str(tmp_path / "run")} | values))
    assert words in str(refused.value)


def test_impossible_trees_are_refused(grid, tmp_path, said):
    for column, value in (("dbh_cm", 1e5), ("height_m", 2000.0), ("height_m", 1e-12)):
        facts = {"dbh_cm": [30.0], "height_m": [20.0]} | {column: [value]}
        with pytest.raises(UserError, match=f"field '{column}', row 1"):
            read_trees(write_layer(tmp_path / "t.gpkg", points((5, 50)), **facts), grid, said)


@pytest.mark.parametrize(
    ("friction", "words"),
    [
        ("0,25", "--friction is '0,25'; write the number with a point, 0.25"),
        ("0.4,0.6", "--friction is '0.4,0.6', several numbers; give one, a raster or polygons"),
        ("0.2:.3", "use the tool vary with --vary friction=0.2:.3"),
        ("0.2, 0.25; 0.3", "use the tool vary with --vary friction=0.2:0.3"),
        ("25%", "--friction is '25%'; give the coefficient, the tangent of the angle: 0.25"),
        ("14°", "give the coefficient, the tangent of the angle: 0.249"),
    ],
)
def test_a_friction_in_other_words_is_refused_with_the_number(case, tmp_path, friction, words):
    with pytest.raises(UserError) as refused:
        case.run(friction=friction, output=str(tmp_path / "run"))
    assert words in str(refused.value)


def test_numbers_with_a_comma_are_refused_with_the_fix(capsys):
    assert cli.run(["make-log", "--dbh-cm", "37,5", "--output", "x"]) == 2
    assert "--dbh-cm is '37,5', but must be a number; write it with a point, 37.5" in capsys.readouterr().err


def test_what_is_doubtful_of_a_run_is_reported(case, tmp_path, said):
    """A friction of 25, cells of 5 m, heights in feet: the run is made, and each is reported with the fix."""
    steep = write_dem(tmp_path / "feet.tif", cell=5.0)
    with rasterio.open(steep, "r+") as made:
        made.write(made.read(1) / 0.3048, 1)
    case.run(said, dem=steep, friction="25", output=str(tmp_path / "run"), time_limit_s=0.1)
    told = "\n".join(said.warnings)
    assert (
        "--friction: the friction coefficient is 25; is it in percent or degrees? Then 0.25 or 0.466 is meant" in told
    )
    assert "cells of 5 m do not resolve the relief that holds logs" in told
    assert "use a terrain model with cells of 0.5 to 2 m" in told
    assert "the median slope over its cells is 66 degrees" in told
    assert "where the logs start" not in told


def test_nothing_is_reported_of_a_steep_hillside_as_it_should_be(grid, said):
    warn_of_ground(grid, np.array([2_786_030.0]), np.array([1_196_080.0]), said)
    assert not said.warnings


def test_feet_show_where_the_logs_start(tmp_path, said):
    """With a DEM that is mostly flat."""
    path = write_dem(tmp_path / "d.tif")
    with rasterio.open(path, "r+") as made:
        heights = 1000.0 + 3.28 * np.tan(np.radians(35.0)) * np.maximum(99.5 - np.arange(100.0) - 70.0, 0.0)
        made.write(np.repeat(heights[:, None], 60, axis=1).astype("float32"), 1)
    warn_of_ground(read_dem(path), np.array([2_786_030.0]), np.array([1_196_085.0]), said)
    assert "the median slope where the logs start is 66 degrees" in said.warnings[0]


def test_more_logs_than_memory_are_refused_before_they_are_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "free_bytes", lambda: int(16e9))
    areas = write_layer(tmp_path / "a.gpkg", [box(10, 60, 50, 90)])
    ask = {"dem": write_dem(tmp_path / "dem.tif"), "areas": areas, "output": str(tmp_path / "r.gpkg")}
    with pytest.raises(UserError, match=r"r.gpkg: 1000000000 logs need 605.4 GB of memory, 14.9 GB are free; lower"):
        sample_releases.TOOL(count=10**9, **ask)
    monkeypatch.setattr(memory, "free_bytes", lambda: 1000)
    with pytest.raises(UserError, match=r"trees need .* of memory, .* lower --stems-per-ha"):
        generate_forest.TOOL(
            dem=ask["dem"], stems_per_ha=300.0, dbh_mean_cm=30.0, dbh_sd_cm=5.0, output=str(tmp_path / "t.gpkg")
        )


def test_more_logs_than_memory_are_refused_before_they_slide(case, tmp_path, monkeypatch):
    monkeypatch.setattr("deadwood_algorithms.simulate.windows.refuse_too_many", refuse_all := _Refusing())
    with pytest.raises(UserError, match="asked of 24 logs"):
        case.run(output=str(tmp_path / "run"))
    assert refuse_all.each > 500


class _Refusing:
    each = 0

    def __call__(self, count: int, things: str, what: str, *, each: int, fix: str) -> None:
        self.each = each
        raise UserError(f"asked of {count} {things}")


def pts(path: Path, scale: float, shift: float = 0.0) -> str:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * scale + shift
    np.savetxt(path, corners)
    return str(path)


@pytest.mark.parametrize(
    ("scale", "shift", "words"),
    [
        (1e-30, 0.0, "the body is 1e-30 m long, but must be 0.01 to 150 m; give the points in metres"),
        (1000.0, 0.0, "the body is 1000 m long"),
        (1.0, 1e12, "a point lies 1e+12 m from the origin"),
        (0.0, 0.0, "the body is 0 m long"),
    ],
)
def test_bodies_of_no_size(tmp_path, said, scale, shift, words):
    with pytest.raises(UserError) as refused:
        read_shape(pts(tmp_path / "b.pts", scale, shift), 1.0, said)
    assert words in str(refused.value)


def test_ids_count_from_one_everywhere(case, tmp_path):
    """Row numbers and numbers that a tool gives: the first is 1, as row 1 is in every message."""
    areas = write_layer(tmp_path / "a.gpkg", [box(15, 70, 45, 85)])
    made = {"dem": case.dem, "areas": areas, "output": str(tmp_path / "r.gpkg"), "count": 3, "dbh_cm": 40.0}
    sample_releases.TOOL(length_m=10.0, **made)
    drawn = gpd.read_file(tmp_path / "r.gpkg", layer="releases")
    assert drawn["log_id"].tolist() == [1, 2, 3]
    assert drawn["release_id"].tolist() == [1, 1, 1]
    bare = write_layer(tmp_path / "bare.gpkg", points((30, 80), (35, 80)))
    fences = write_layer(tmp_path / "b.gpkg", ACROSS[:1], height_m=[3.0])
    run = case.run(
        releases=bare, lines=write_layer(tmp_path / "l.gpkg", ACROSS), barriers=fences, output=str(tmp_path / "run")
    )
    assert layer(run, "deposits")["log_id"].tolist() == [1, 2]
    assert set(layer(run, "deposits")["release_id"]) == {1}
    assert [row["line_id"] for row in summary(run)["reach"]] == [1, 2, 3]
    assert [row["barrier_id"] for row in summary(run)["barriers"]] == [1]


def test_nothing_in_an_id_is_obeyed_by_the_terminal(case, tmp_path, capsys):
    """Escapes that clear the screen, change title or text direction are shown as text, in errors and results."""
    evil = "A\x1b[2J\x1b]0;own\x07\x9b\u202e"
    one = write_layer(tmp_path / "d.gpkg", points((30, 80)), release_id=[evil], **_deposit(30, 90))
    assert cli.run(["lateral-spread", "--deposits", one, "--output", str(tmp_path / "s.gpkg")]) == 0
    two = write_layer(tmp_path / "r.gpkg", points((30, 80)), orientation=[evil])
    flags = ["--dem", case.dem, "--releases", two, "--friction", "0.3", "--output", str(tmp_path / "run")]
    assert cli.run(["slide-logs", *flags]) == 2
    said = capsys.readouterr()
    for text in (said.out, said.err):
        assert not set(text) & set("\x1b\x07\x9b\u202e")
        assert "\\x1b[2j" in text.lower()


def _deposit(x: float, y: float) -> dict[str, list[Any]]:
    return {"release_x": [EAST + x], "release_y": [NORTH + y], "length_m": [5.0], "log_id": [1]}


def test_lateral_spread_says_no_nan(case, tmp_path, capsys):
    near = write_layer(tmp_path / "d.gpkg", points((30, 89)), **_deposit(30, 90))
    assert cli.run(["lateral-spread", "--deposits", near, "--output", str(tmp_path / "s.gpkg")]) == 0
    said = capsys.readouterr().out
    assert "nan" not in said.lower()
    assert "release 1: no spread, none of 1 deposits lies beyond --min-runout-m from the release" in said
