"""The comparison of tree tops, on a small canopy model whose tops are found here by an independent implementation."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from benchmarks import tree_tops
from benchmarks.tree_tops import MARKS, PAGE, ROWS, Canopy, WholeCells, compared, published_tops
from deadwood_algorithms.prepare.trees.tops import Window

CELL, BASE, GROWTH = 0.5, 1.6, 0.14
WEST, SOUTH = 500_000.0, 5_000_000.0


def canopy() -> np.ndarray:
    """Crowns of 150 trees, paraboloids, on 60 x 70 cells; row 0 is in the south. Two neighbours are equal."""
    rng = np.random.default_rng(4)
    v, u = np.mgrid[0:60, 0:70]
    trees = zip(rng.uniform(0, 70, 150), rng.uniform(0, 60, 150), rng.uniform(3, 14, 150), strict=True)
    heights = np.max([h - 0.3 * (np.hypot(u - x, v - y) * CELL) ** 2 for x, y, h in trees], axis=0)
    heights = np.maximum(heights + rng.normal(0, 0.5, heights.shape), 0.0)
    heights[30, 40:42] = 25.0
    return heights


def other_program(heights: np.ndarray, *, rounds: bool) -> list[tuple[int, int]]:
    """As `vwf` of ForestTools: all cells that are the maximum of their window, whose radius it rounds to cells."""
    found = []
    rows, columns = np.mgrid[: heights.shape[0], : heights.shape[1]]
    for j, i in np.argwhere(heights >= 2.0):
        radius = (BASE + GROWTH * heights[j, i]) / 2.0
        radius = max(round(radius / CELL), 1) * CELL if rounds else radius
        away = np.hypot(rows - j, columns - i)
        window = (away * CELL <= radius + 1e-9) | (away < 1.5)
        if heights[window].max() == heights[j, i]:
            found.append((int(j), int(i)))
    return found


def written(folder: Path, heights: np.ndarray, tops: list[tuple[int, int]], radius: float = GROWTH / 2) -> list[str]:
    """The canopy model and the published tops as files, and the arguments of the command."""
    place = from_origin(WEST, SOUTH + len(heights) * CELL, CELL, CELL)
    facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "crs": "EPSG:32632", "transform": place}
    with rasterio.open(folder / "chm.tif", "w", height=heights.shape[0], width=heights.shape[1], **facts) as file:
        file.write(heights[::-1], 1)
    row, column = np.array(tops).T
    points = shapely.points(WEST + (column + 0.5) * CELL, SOUTH + (row + 0.5) * CELL)
    height = heights[row, column]
    columns = {"height": height, "winRadius": BASE / 2 + radius * height}
    geopandas.GeoDataFrame(columns, geometry=points, crs="EPSG:32632").to_file(folder / "tops.gpkg")
    return [str(folder / "chm.tif"), str(folder / "tops.gpkg"), "--window-m", str(BASE), "--window-growth", str(GROWTH)]


def said(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, arguments: list[str]) -> list[str]:
    monkeypatch.setattr(sys, "argv", ["tree_tops", *arguments])
    tree_tops.main()
    return capsys.readouterr().out.splitlines()


def test_the_command_finds_the_tops_of_another_implementation(tmp_path, capsys, monkeypatch):
    heights = canopy()
    tops = other_program(heights, rounds=False)
    assert len(tops) > 40
    lines = said(capsys, monkeypatch, written(tmp_path, heights, tops))
    n = len(tops)
    assert lines[0] == (
        f"radius as given: published {n}, ours {n - 1}, same {n - 1}, near 0, missed 1, equal 1, extra 0"
    )
    assert lines[1] == "  missed: 1 of 25 to 30 m; extra: none"


def test_what_a_rounded_radius_changes_is_told_apart(tmp_path, capsys, monkeypatch):
    heights = canopy()
    tops = other_program(heights, rounds=True)
    lines = said(capsys, monkeypatch, [*written(tmp_path, heights, tops), "--whole-cells"])
    as_given, whole = lines[0], lines[2]
    n = len(tops)
    assert whole == f"radius whole cells: published {n}, ours {n - 1}, same {n - 1}, near 0, missed 1, equal 1, extra 0"
    assert int(as_given.rsplit(" ", 1)[1]) + int(as_given.split("missed ")[1].split(",")[0]) > 5
    assert "equal 1," in as_given


def test_another_window_than_that_of_the_tops_is_refused(tmp_path):
    arguments = written(tmp_path, canopy(), other_program(canopy(), rounds=False), radius=0.06)
    with pytest.raises(SystemExit, match="--window-m 1.6 --window-growth 0.12"):
        published_tops(Path(arguments[1]), Window(BASE, GROWTH))


def test_tops_beside_one_another_are_matched_once():
    heights = np.arange(100.0).reshape(10, 10) / 10.0
    published = np.array([[2, 2], [5, 5], [8, 8]])
    ours = np.array([[2, 2], [5, 6], [5, 4], [0, 9]])
    found = compared(published, ours, Canopy(heights, 0.0, 0.0, 1.0), Window(3.0))
    assert {key: found[key] for key in ("published", "ours", "same", "near", "missed", "extra")} == {
        "published": 3,
        "ours": 4,
        "same": 1,
        "near": 1,
        "missed": 1,
        "extra": 2,
    }
    assert found["missed_m"] == [8.8]
    assert sorted(found["extra_m"]) == [0.9, 5.6]


def test_a_window_of_whole_cells():
    """Kootenay: the radius of 1.25 m, of a tree of 6.43 m, is where 1.0 m becomes 1.5 m."""
    window = WholeCells(1.6, 0.14)
    assert window.reach(np.array([6.42, 6.44, 1.0]), 0.5).tolist() == [4.0, 9.0, 4.0]


def test_the_numbers_of_the_page_add_up():
    page = PAGE.read_text(encoding="utf-8")
    assert MARKS.search(page)
    assert tree_tops.table() in page
    for row in json.loads(ROWS.read_text(encoding="utf-8")).values():
        for found in row["found"].values():
            if "same" in found:
                assert found["same"] + found["near"] + found["missed"] == found["published"]
                assert found["same"] + found["near"] + found["extra"] == found["ours"]


def test_the_command_has_a_help():
    done = subprocess.run([sys.executable, "-m", "benchmarks.tree_tops", "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    assert "--window-growth" in done.stdout
