"""Before a run, a few logs show whether the terrain model is too small, on which side and by how much."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pyproj
import pytest
import rasterio
from slope_case import Case, cut_above_the_road

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.simulate import look
from deadwood_algorithms.tools import vary


@pytest.fixture
def small(tmp_path, monkeypatch) -> Case:
    """A case whose terrain model ends above the road; its 24 logs are enough for a check with 12."""
    monkeypatch.setattr(look, "LOGS", 12)
    return cut_above_the_road(Case(tmp_path / "case"))


def told(said: Any) -> list[str]:
    return [each for each in said.warnings if each.startswith("a pilot before the run")]


def test_what_leaves_is_reported_with_its_side_before_the_run(small, tmp_path, said):
    small.run(lines=small.lines, output=str(tmp_path / "run"), feedback=said)
    (one,) = told(said)
    assert said.warnings.index(one) < said.warnings.index(next(w for w in said.warnings if "their deposits" in w))
    assert re.search(r"\d+ of 12 logs \(draft, friction 0.\d+\) leave the terrain model to the south", one)


def test_the_look_changes_no_bit(small, tmp_path, monkeypatch, said):
    small.run(output=str(tmp_path / "with"), feedback=said)
    monkeypatch.setattr(look, "LOGS", 1000)
    small.run(output=str(tmp_path / "without"), feedback=said)
    assert len(told(said)) == 1
    for name in ("poses.parquet", "hit_count.tif"):
        both = [(tmp_path / folder / name) for folder in ("with", "without")]
        if all(each.is_file() for each in both):
            values = [_values(each) for each in both]
            assert values[0] == values[1]


def _values(path: Any) -> Any:
    if path.suffix == ".tif":
        with rasterio.open(path) as source:
            return source.read().tobytes()
    import pandas

    return pandas.read_parquet(path).to_csv()


def test_nothing_is_reported_where_the_terrain_holds_the_logs(tmp_path, monkeypatch, said):
    monkeypatch.setattr(look, "LOGS", 12)
    case = Case(tmp_path / "case")
    case.run(friction=0.9, output=str(tmp_path / "run"), feedback=said)
    assert told(said) == []


def test_tools_that_slide_the_same_logs_often_look_once(small, tmp_path, said):
    vary.TOOL(
        vary="friction=0.2:0.4",
        dem=small.dem,
        releases=small.releases,
        lines=small.lines,
        friction=0.3,
        logs=24,
        output=str(tmp_path / "v"),
        feedback=said,
    )
    assert len(told(said)) == 1


def test_the_distance_is_that_of_the_energy_line_on_a_plane():
    """A log at 10 m/s on a slope of 0.1 whose energy line falls by 0.3: v^2 / 2 g / 0.2 = 25.5 m; none at 0.4."""

    class Scene:
        steep = 0.1

        def terrain_height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
            return self.steep * np.asarray(y)

    class Found:
        last_state = np.zeros((1, 16))
        end_position = np.array([[0.0, 0.0, 0.0]])

    class Layers:
        scene = Scene()

    Found.last_state[0, look.VY] = -10.0
    found = look.further(Layers(), Found(), np.array([0]), 0.3)  # pyright: ignore[reportArgumentType]
    assert found == pytest.approx(100.0 / (2 * look.GRAVITY) / 0.2)
    assert "some 30 m more" in look.warning(3, 12, ["south"], found, 0.3)
    Scene.steep = 0.4
    steep = look.further(Layers(), Found(), np.array([0]), 0.3)  # pyright: ignore[reportArgumentType]
    assert np.isinf(steep).all()
    assert "cannot be estimated" in look.warning(3, 12, ["south"], steep, None)


def test_the_side_is_the_one_that_was_crossed_and_within_the_dem_that_of_the_motion():
    """Logs that turn in a valley leave to the north while moving east; a hole is entered in the direction of motion."""
    dem = Grid(np.zeros((100, 200)), 1.0, 1000.5, 2000.5, pyproj.CRS("EPSG:2056"))

    class Found:
        last_state = np.zeros((4, 16))
        end_position = np.array([[1100, 2099.6, 0.0], [1150, 2099.3, 0.0], [1000.4, 2099.6, 0.0], [1100, 2050, 0.0]])

    Found.last_state[:, look.VX] = 5.0
    sides = [look.sides_of(Found(), row, dem) for row in np.eye(4, dtype=bool)]  # pyright: ignore[reportArgumentType]
    assert sides == [["north"], ["north"], ["north-west"], ["east"]]
    every = look.sides_of(Found(), np.ones(4, bool), dem)  # pyright: ignore[reportArgumentType]
    assert every == ["north", "east", "north-west"]
