"""Tiles meet without a seam, every level is a mean of the one below, and cells without height are transparent."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pyproj
import pytest
from PIL import Image

from deadwood_algorithms.explore.relief import TILE, Relief, halved
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.pictures import hillshade, lit, span_of, stretched
from deadwood_algorithms.params.tool import UserError

ROWS, COLUMNS = 600, 700


@pytest.fixture(scope="module")
def relief() -> Relief:
    y, x = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
    heights = 900.0 + 0.4 * y + 20.0 * np.sin(x / 31.0) * np.cos(y / 23.0)
    heights[500:, 600:] = np.nan
    return Relief(Grid(heights, 2.0, 0.0, 0.0, pyproj.CRS("EPSG:2056")))


def picture(relief: Relief, level: int, column: int, row: int) -> np.ndarray:
    return np.asarray(Image.open(BytesIO(relief.tile(level, column, row))))


@pytest.mark.parametrize("level", [0, 1, 2])
def test_the_tiles_together_are_the_whole_picture(relief: Relief, level: int):
    heights = relief.at(level)
    light = lit(heights[::-1], 2.0 * 2.0**level)[::-1]
    known = np.isfinite(light)
    shade = np.uint8(255.0 * np.where(known, stretched(np.nan_to_num(light), *relief.span), 0.0))
    rows, columns = (-(-size // TILE) for size in heights.shape)
    together = np.vstack([np.hstack([picture(relief, level, c, r) for c in range(columns)]) for r in range(rows)])
    inner = slice(0, heights.shape[0]), slice(0, heights.shape[1])
    # in the outermost cells a tile has no neighbour either, but gradients of few cells round in another order
    assert np.abs(together[(*inner, 0)].astype(int) - shade).max() <= 1
    assert np.array_equal(together[(*inner, 1)] > 0, known)
    assert not together[heights.shape[0] :].any()
    assert not together[:, heights.shape[1] :].any()


def test_the_last_level_is_one_tile(relief: Relief):
    assert relief.levels == 3
    assert max(relief.at(2).shape) <= TILE < max(relief.at(1).shape)
    for place in ((3, 0, 0), (-1, 0, 0), (2, 1, 0), (0, 0, 3)):
        with pytest.raises(UserError, match="there is no"):
            relief.tile(*place)


def test_half_as_fine_is_the_mean_of_what_has_a_height():
    fine = np.array([[1.0, 3.0, 10.0], [np.nan, 5.0, 20.0], [7.0, np.nan, np.nan]])
    assert np.array_equal(halved(fine), [[3.0, 15.0], [7.0, np.nan]], equal_nan=True)


def test_the_coarse_heights_cover_the_terrain(relief: Relief):
    step, heights = relief.coarse(400)
    assert step == 4.0
    assert heights.shape == (300, 350)
    assert heights.dtype == np.float32


def test_the_light_is_stretched_as_in_every_other_picture():
    rng = np.random.default_rng(2)
    heights = rng.normal(0.0, 3.0, (40, 50))
    light = lit(heights, 1.5)
    assert np.array_equal(hillshade(heights, 1.5), stretched(light, *span_of(light)))


def test_a_plain_and_a_tiny_terrain_have_a_picture():
    for shape in ((3, 3), (2, 400)):
        relief = Relief(Grid(np.zeros(shape), 1.0, 0.0, 0.0, pyproj.CRS("EPSG:2056")))
        assert picture(relief, 0, 0, 0).shape == (TILE, TILE, 2)
        assert picture(relief, relief.levels - 1, 0, 0).shape == (TILE, TILE, 2)
