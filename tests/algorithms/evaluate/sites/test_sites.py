"""Sites on arrays: rasters of several runs added up cell by cell, tiles, names, and reach over all."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import shapely

from deadwood_algorithms.evaluate.sites import mosaic
from deadwood_algorithms.evaluate.sites.groups import _unlike
from deadwood_algorithms.evaluate.sites.mosaic import MergedRun, merged_values, scenarios_in, shared_part, touched_tiles
from deadwood_algorithms.evaluate.sites.overview import (
    DONE,
    FAILED,
    SiteFound,
    SiteRow,
    area_around,
    reach_of_all,
    words_of_sites,
)
from deadwood_algorithms.evaluate.sites.sites_table import folder_name
from deadwood_algorithms.files.geotiff import TILE_CELLS
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.stats.statistics import bounds_if_lost, reach_record, wilson_interval


def cells(part: Part) -> set[tuple[int, int]]:
    return {(part.row + j, part.column + i) for j in range(part.rows) for i in range(part.columns)}


def random_part(rng: np.random.Generator, most: int = 9) -> Part:
    return Part(*(int(each) for each in rng.integers(0, most, 2)), *(int(each) for each in rng.integers(1, most, 2)))


@pytest.mark.parametrize("seed", range(20))
def test_what_two_windows_share_are_the_cells_of_both(seed):
    rng = np.random.default_rng(seed)
    one, other = random_part(rng), random_part(rng)
    shared = shared_part(one, other)
    assert (cells(shared) if shared else set()) == cells(one) & cells(other)


def test_windows_side_by_side_share_nothing():
    assert shared_part(Part(0, 0, 3, 3), Part(3, 0, 3, 3)) is None
    assert shared_part(Part(0, 0, 3, 3), Part(0, 3, 3, 3)) is None


@pytest.mark.parametrize("seed", range(4))
def test_merged_rasters_are_those_of_all_cells_one_by_one(monkeypatch, seed):
    """Three runs that store windows of one grid: counts add up, maxima are the largest, nodata stays nodata."""
    rng = np.random.default_rng(seed)
    shape = (12, 14)
    pieces, parts, layers = [], [], {}
    for number in range(3):
        part = random_part(rng, 7)
        stored = np.zeros(shape, bool)
        stored[part.slices] = True
        values: dict[tuple[str, int], np.ndarray] = {}
        for name in mosaic.COUNTS:
            values[f"{name}.tif", 1] = np.where(stored, rng.integers(0, 9, shape), 0).astype(np.uint32)
        for file, band in mosaic.MAXIMA.values():
            drawn = np.where(rng.random(shape) < 0.3, np.nan, rng.random(shape)).astype(np.float32)
            values[f"{file}.tif", band] = np.where(stored, drawn, np.float32(np.nan))
        values["reach_probability.tif", 1] = np.where(rng.random(shape) < 0.1, np.nan, 0.0)
        for band in (1, 2):
            values[mosaic.DANGER_COUNT, band] = rng.integers(0, 5, shape).astype(np.uint32)
        pieces.append(cast("Any", SimpleNamespace(number=number)))
        parts.append(part)
        layers[number] = values
    monkeypatch.setattr(
        mosaic, "band_of", lambda piece, name, part, band=1: layers[piece.number][name, band][part.slices]
    )
    window = Part(1, 2, 11, 9)
    total, outside = merged_values(pieces, parts, window, ["road"])
    for j, i in np.ndindex(window.rows, window.columns):
        place = window.row + j, window.column + i
        mine = [k for k in range(3) if place in cells(parts[k])]
        for name in mosaic.COUNTS:
            assert total[name][j, i] == sum(int(layers[k][f"{name}.tif", 1][place]) for k in mine)
        for name, (file, band) in mosaic.MAXIMA.items():
            known = [v for k in mine if np.isfinite(v := layers[k][f"{file}.tif", band][place])]
            assert np.array_equal(total[name][j, i], max(known, default=np.float32(np.nan)), equal_nan=True)
        for band in (1, 2):
            assert total["danger"][band - 1, j, i] == sum(
                int(layers[k][mosaic.DANGER_COUNT, band][place]) for k in mine
            )
        assert outside[j, i] == any(np.isnan(layers[k]["reach_probability.tif", 1][place]) for k in mine)


@pytest.mark.parametrize("shape", [(TILE_CELLS, TILE_CELLS), (3 * TILE_CELLS + 7, 2 * TILE_CELLS + 1)])
def test_touched_tiles_are_those_of_the_file_that_hold_a_cell(shape):
    """Tiles count from the file's top left corner, windows from the south."""
    rng = np.random.default_rng(1)
    parts = []
    for _ in range(3):
        row, column = int(rng.integers(0, shape[0] - 1)), int(rng.integers(0, shape[1] - 1))
        rows, columns = (int(rng.integers(1, min(300, n - at) + 1)) for n, at in zip(shape, (row, column), strict=True))
        parts.append(Part(column, row, columns, rows))
    expected = {
        ((shape[0] - 1 - row) // TILE_CELLS, column // TILE_CELLS)
        for part in parts for row in (part.row, part.row + part.rows - 1, *range(part.row, part.row + part.rows, 64))
        for column in (part.column, part.column + part.columns - 1, *range(part.column, part.column + part.columns, 64))
    }  # fmt: skip
    found = touched_tiles(parts, shape)
    tiles = [((shape[0] - part.row - 1) // TILE_CELLS, part.column // TILE_CELLS) for part in found]
    assert set(tiles) == expected
    assert tiles == sorted(tiles)
    for part, (row, column) in zip(found, tiles, strict=True):
        assert (part.row + part.rows, part.column) == (shape[0] - row * TILE_CELLS, column * TILE_CELLS)
        assert part.row >= 0
        assert part.column + part.columns <= shape[1]
        assert part.rows == TILE_CELLS or part.row == 0
        assert part.columns == TILE_CELLS or part.column + part.columns == shape[1]


def test_runs_of_the_same_logs_are_scenarios():
    pieces = [
        MergedRun(cast("Any", SimpleNamespace(name=name)), 1, cast("Any", None), "", digest)
        for name, digest in (("a", "x"), ("b", "y"), ("c", "x"), ("d", "x"))
    ]
    assert scenarios_in(pieces) == ["c", "d"]


def site(name: str, *lines: tuple[str, int, int], status: str = DONE) -> SiteFound:
    rows = [SiteRow(name, status, line_id=line, released=n, n_reach=hit) for line, hit, n in lines]
    return SiteFound(name, rows or [SiteRow(name, status, "no such file")], logs=sum(n for *_, n in lines[:1]))


def test_the_reach_of_all_is_over_the_logs_of_the_sites_that_watched_the_line():
    found = [site("a", ("road", 3, 40), ("rail", 0, 40)), site("b", ("road", 5, 10)), site("c", status=FAILED)]
    told = {each["line_id"]: each for each in reach_of_all(found)}
    assert told["road"] == {"line_id": "road", "sites": 2, **reach_record(8, 50), **bounds_if_lost(8, 50, 0)}
    assert (told["rail"]["sites"], told["rail"]["n_total"]) == (1, 40)
    assert (told["road"]["ci_low"], told["road"]["ci_high"]) == wilson_interval(8, 50)
    words = words_of_sites(found)
    assert words[0].startswith("a  40 logs; road: 7.5 %")
    assert words[2] == "c  failed: no such file"
    assert [each.failed for each in found] == [False, False, True]


def test_names_of_folders_are_apart_on_every_system():
    assert _unlike("Nord", {"sued"}) == "Nord"
    assert _unlike("Nord", {"nord", "nord_2"}) == "Nord_3"
    assert folder_name(' a/b:c?".') == "a_b_c__"
    assert folder_name("a;b|c") == "a_b_c"
    assert folder_name(" . ") == "_"
    assert len(folder_name("x" * 200)) == 80


def test_a_site_of_one_log_has_an_area():
    assert area_around(np.array([[3.0, 4.0]])).area == pytest.approx(np.pi * 25.0, rel=0.01)
    many = area_around(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]))
    assert many.area == pytest.approx(50.0 + 5.0 * (20.0 + np.sqrt(200.0)) + np.pi * 25.0, rel=0.01)
    assert many.contains(shapely.Point(9.0, 1.0))
