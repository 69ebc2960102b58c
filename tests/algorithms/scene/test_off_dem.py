"""Rows of a layer that lie off the DEM, of every kind alike: left out and reported; refused only if all rows are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from slope_case import Case, points, write_layer

from deadwood_algorithms.evaluate.protection.candidate_barriers import read_given
from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.scene.blocks import read_blocks
from deadwood_algorithms.scene.layers import read_barriers, read_lines, read_scene, read_trees
from deadwood_algorithms.scene.lying_logs import read_lying_logs


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def grid(case) -> Grid:
    return read_dem(case.dem, crs=None, feedback=Quiet())


def line(x: float, y: float, width: float = 20.0) -> shapely.LineString:
    return shapely.LineString([(x, y), (x + width, y)])


def candidates(path: str, grid: Grid, said: Any) -> list[str]:
    layers = read_scene("", 0.3, None, None, None, crs=None, feedback=Quiet(), grid=grid)
    return [each.id for each in read_given(path, [2.0, 3.0], layers, said)]


def lying_logs(path: str, grid: Grid, said: Any) -> list[str]:
    return read_lying_logs(path, grid, 40.0, said)[1].ids


# kind: (columns, where it lies: on, partly on, off, off; how it is read into ids)
LINES = [line(10.0, 40.0), line(50.0, 45.0), line(10.0, -40.0), line(900.0, 50.0)]
POINTS = points((10.0, 40.0), (20.0, 45.0), (10.0, -40.0), (900.0, 50.0))
KINDS: dict[str, tuple[str, list[Any], dict[str, list[float]], Callable[..., list[Any]]]] = {
    "trees": ("tree_id", POINTS, {"dbh_cm": [30.0] * 4, "height_m": [20.0] * 4}, lambda *a: read_trees(*a).ids),
    "blocks": ("block_id", POINTS, {"diameter_m": [1.0] * 4}, lambda *a: read_blocks(*a).ids),
    "barriers": ("barrier_id", LINES, {"height_m": [1.0, 2.0, 3.0, 4.0]}, lambda *a: read_barriers(*a)[1].ids),
    "lines": ("line_id", LINES, {}, lambda *a: read_lines(*a)[1].ids),
    "lying logs": ("lying_id", LINES, {"diameter_cm": [30.0] * 4}, lying_logs),
    "candidates": ("barrier_id", LINES, {"height_m": [1.0, 2.0, 3.0, 4.0]}, candidates),
}


def of(kind: str, folder: Path, rows: list[int]) -> tuple[str, Callable[..., list[Any]]]:
    name, shapes, columns, read = KINDS[kind]
    taken = {field: [values[k] for k in rows] for field, values in columns.items()}
    path = write_layer(folder / "layer.gpkg", [shapes[k] for k in rows], **{name: ["abcd"[k] for k in rows]}, **taken)
    return path, read


@pytest.mark.parametrize("kind", KINDS)
def test_what_lies_off_the_dem_is_left_out_and_reported_once(kind, tmp_path, grid, said):
    path, read = of(kind, tmp_path, [2, 0, 3, 1])
    assert read(path, grid, said) == ["a", "b"]
    about = [each for each in (said.notes if kind in ("trees", "blocks") else said.warnings) if "left out" in each]
    assert len(about) == 1
    assert about[0].endswith(f"layer 'layer', rows 1, 3: 2 of 4 {kind} lie off the DEM and are left out")


@pytest.mark.parametrize("kind", KINDS)
def test_a_layer_that_lies_wholly_off_the_dem_is_refused(kind, tmp_path, grid, said):
    path, read = of(kind, tmp_path, [2, 3])
    with pytest.raises(UserError, match=f"none of the 2 {kind} .* the DEM .*; check the CRS of both"):
        read(path, grid, said)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_reported_where_all_lie_on_the_dem(kind, tmp_path, grid, said):
    path, read = of(kind, tmp_path, [0, 1])
    assert read(path, grid, said) == ["a", "b"]
    assert not [each for each in [*said.warnings, *said.notes] if "left out" in each]


def test_a_candidate_on_nodata_is_named(tmp_path, grid, said):
    values = grid.values.copy()
    values[40:50, 45:] = np.nan
    path, read = of("candidates", tmp_path, [0, 1])
    read(path, replace(grid, values=values), said)
    assert [each for each in said.warnings if "no height under b: no log reaches it" in each]


def test_columns_stay_with_their_rows(tmp_path, grid, said):
    """Heights of barriers, and parts of a row, that follow one off the DEM."""
    path, _ = of("barriers", tmp_path, [3, 1, 2, 0])
    barriers, items = read_barriers(path, grid, said)
    assert dict(zip(items.ids, barriers.height.tolist(), strict=True)) == {"b": 2.0, "a": 1.0}
    assert [shapely.get_x(shapely.get_point(shape, 0)) for shape in items.geometry] == [
        pytest.approx(barriers.vertices[start, 0]) for start in barriers.starts[:-1]
    ]
    assert (items.row.tolist(), items.row_count) == ([1, 3], 4)


def test_rows_of_one_name_are_called_by_their_rows_in_the_layer(tmp_path, grid, said):
    shapes = [LINES[2], LINES[0], LINES[1], LINES[3]]
    path = write_layer(tmp_path / "layer.gpkg", shapes, line_id=["road", "road", "road", "other"])
    _, items = read_lines(path, grid, said)
    assert items.ids == ["road"]
    assert np.unique(items.item).tolist() == [0]
    assert any("rows 2, 3 are called 'road' and count as one" in each for each in said.notes)
