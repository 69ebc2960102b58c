"""A DEM read in windows holds the same heights at the same places as one that is read whole."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio.transform import Affine, from_origin
from rasterio.windows import Window

from deadwood_algorithms.files import dem_windows, geotiff
from deadwood_algorithms.files.dem_windows import WindowWriter, open_windows, read_dem, read_part
from deadwood_algorithms.files.geotiff import geotiff_profile
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError

NX, NY, CELL = 70, 50, 2.0
NORTH_UP = from_origin(2_783_000.0, 1_190_000.0 + NY * CELL, CELL, CELL)
SOUTH_UP = Affine(CELL, 0.0, 2_783_000.0, 0.0, CELL, 1_190_000.0)


def write(path: Path, values: np.ndarray, transform: Affine = NORTH_UP, **profile) -> str:
    facts = {"driver": "GTiff", "count": 1, "dtype": values.dtype.name, "crs": "EPSG:2056", "nodata": -9999}
    with rasterio.open(
        path, "w", height=values.shape[0], width=values.shape[1], transform=transform, **(facts | profile)
    ) as made:
        made.write(values, 1)
    return str(path)


@pytest.fixture
def rough() -> np.ndarray:
    values = np.random.default_rng(3).normal(1000.0, 5.0, (NY, NX)).astype("float32")
    values[10:14, 20:30] = -9999.0
    return values


@pytest.mark.parametrize("transform", [NORTH_UP, SOUTH_UP])
def test_windows_put_together_are_the_whole(tmp_path, said, rough, transform, monkeypatch):
    monkeypatch.setattr(dem_windows, "BLOCK_CELLS", 1)
    monkeypatch.setattr(dem_windows, "TILE_CELLS", 16)
    path = write(tmp_path / "dem.tif", rough, transform)
    whole = read_dem(path)
    with open_windows(path, crs=None, feedback=said) as dem:
        assert (dem.shape, dem.cell, dem.x0, dem.y0) == (whole.shape, whole.cell, whole.x0, whole.y0)
        assert dem.bounds == whole.bounds
        strips = dem.strips()
        assert len(strips) == 4
        put = np.full(whole.shape, -1.0)
        for rows in strips:
            put[rows] = dem.grid(rows, slice(0, NX)).values
        assert np.array_equal(put, whole.values, equal_nan=True)
        beyond = dem.grid(slice(-5, 10), slice(60, 80))
    assert np.array_equal(beyond.values[5:, :10], whole.values[:10, 60:], equal_nan=True)
    assert np.isnan(beyond.values[:5]).all()
    assert np.isnan(beyond.values[:, 10:]).all()
    assert beyond.height(whole.x0 + 123.0, whole.y0 + 7.0) == pytest.approx(
        float(whole.height(2_783_124.0, 1_190_008.0))
    )


def test_heights_along_a_line_are_those_of_the_whole(tmp_path, said, rough, monkeypatch):
    monkeypatch.setattr(dem_windows, "POINT_REACH_CELLS", 5)
    path = write(tmp_path / "dem.tif", rough)
    x, y = np.linspace(2_782_990.0, 2_783_150.0, 400), np.linspace(1_190_110.0, 1_189_995.0, 400)
    with open_windows(path, crs=None, feedback=said) as dem:
        assert np.array_equal(dem.height(x, y), read_dem(path).height(x, y), equal_nan=True)
        assert dem.height(x[:0], y[:0]).size == 0


def test_looking_through_a_dem_is_one_stage_of_progress(tmp_path, rough, monkeypatch):
    """If two stages alternated, each would start again with every strip, and none would last long enough to show."""

    class Stages(Quiet):
        names: ClassVar[list[str]] = []

        def progress(self, done: float, total: float, what: str) -> None:
            self.names.append(what)

    monkeypatch.setattr(dem_windows, "BLOCK_CELLS", 10 * NX)
    monkeypatch.setattr(dem_windows, "TILE_CELLS", 10)
    with open_windows(write(tmp_path / "dem.tif", rough), crs=None, feedback=Stages()):
        pass
    assert len(Stages.names) > 3
    assert set(Stages.names) == {"scanning the DEM"}


def test_undeclared_nodata_is_outside_as_in_a_whole_dem(tmp_path, said):
    values = np.full((NY, NX), 900.0, "float32")
    values[:3], values[5, 5] = 0.0, 32767.0
    path = write(tmp_path / "dem.tif", values, nodata=None)
    with open_windows(path, crs=None, feedback=said) as dem:
        found = dem.grid(slice(0, NY), slice(0, NX)).values
    assert np.array_equal(found, read_dem(path).values, equal_nan=True)
    assert np.isnan(found).sum() == 3 * NX + 1
    assert [each.split(": ")[1][:9] for each in said.warnings] == ["1 cell ho", f"{3 * NX} cells"]


@pytest.mark.parametrize("transform", [NORTH_UP, SOUTH_UP])
@pytest.mark.parametrize(
    ("name", "low"),
    [("mountain", 900.0), ("coast", 30.0), ("polder", -4.0)],
)
def test_a_part_is_the_cut_of_the_whole_whatever_its_zeros_mean(tmp_path, said, rough, transform, name, low):
    """Zeros within a window all above 100 m: a collar on a mountain, the sea if there is lower ground elsewhere."""
    values = rough.copy()
    values[20:24], values[30, 7] = 0.0, 32767.0
    values[45, 60] = low  # outside the window
    path = write(tmp_path / "dem.tif", values, transform)
    whole, part = read_dem(path), Part(5, 11, 40, 25)
    with open_windows(path, crs=None, feedback=said, look_through=False) as dem:
        cut = read_part(dem, part, said)
    assert np.array_equal(cut.values, whole.values[part.slices], equal_nan=True)
    assert cut.values.dtype == np.float32
    assert (cut.x0, cut.y0) == (whole.x0 + 5 * CELL, whole.y0 + 11 * CELL)
    assert (cut.frame.shape, cut.part) == (whole.shape, part)
    assert (cut.values == 0.0).any() == (name != "mountain")
    assert any("not a height on Earth" in warning for warning in said.warnings)
    assert any("taken as outside (an undecl" in warning for warning in said.warnings) == (name == "mountain")


def test_a_window_is_written_into_its_whole(tmp_path):
    """Beyond it tiles are not stored, and read as 0, or as nodata where there is one."""
    whole = Grid.empty((3000, 2000), CELL, 2_783_001.0, 1_190_001.0, pyproj.CRS(2056))
    part = Part(301, 1203, 50, 40)
    values = np.random.default_rng(1).uniform(1.0, 9.0, (40, 50)).astype(np.float32)
    for name, nodata, beyond in (("counts", None, 0.0), ("speeds", np.nan, np.nan)):
        path = tmp_path / f"{name}.tif"
        write_raster(path, values, whole.window(part, values), nodata=nodata, dtype="float32")
        with rasterio.open(path) as made:
            found = made.read(1)[::-1]
            assert made.transform == whole.transform
        assert np.array_equal(found[part.slices], values)
        found[part.slices] = beyond
        assert np.array_equal(found, np.full(whole.shape, beyond), equal_nan=True)
        assert path.stat().st_size < 60_000  # of 24 MB


@pytest.mark.parametrize("of_region", [False, True])
def test_a_window_of_a_large_dem_is_cloud_optimised_and_stays_small(tmp_path, monkeypatch, of_region):
    """Overviews contain values of the raster; beyond a size, only parts that are written at once have them."""
    monkeypatch.setattr(geotiff, "SPARSE_UP_TO_CELLS", 0 if of_region else 2000 * 3000)
    values = np.random.default_rng(1).integers(1, 9, (1, 300, 300)).astype("uint32")
    transform = from_origin(2_783_000.0, 1_190_000.0, CELL, CELL)
    for name, region in (("laid_out", of_region), ("beyond", False)):
        profile = geotiff_profile((3000, 2000), pyproj.CRS(2056), transform, "uint32", None)
        with WindowWriter(tmp_path / f"{name}.tif", Quiet(), of_region=region, SPARSE_OK=True, **profile) as writer:
            writer.write(values, Window(512, 1024, 300, 300))  # type: ignore[call-arg]
        monkeypatch.setattr(geotiff, "SPARSE_UP_TO_CELLS", 0)
    assert (tmp_path / "laid_out.tif").stat().st_size < 200_000  # of 24 MB
    with rasterio.open(tmp_path / "laid_out.tif") as made, rasterio.open(tmp_path / "beyond.tif") as plain:
        assert made.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert "LAYOUT" not in plain.tags(ns="IMAGE_STRUCTURE")
        assert np.array_equal(made.read(), plain.read())
        assert made.tags(1) == plain.tags(1)
        assert made.overviews(1)
    with rasterio.open(tmp_path / "laid_out.tif", overview_level=0) as coarse:
        assert set(np.unique(coarse.read())) <= set(range(9))


def test_what_is_no_dem_is_refused(tmp_path, said):
    empty = write(tmp_path / "empty.tif", np.full((NY, NX), -9999.0, "float32"))
    row = write(tmp_path / "row.tif", np.full((1, NX), 9.0, "float32"))
    degrees = write(tmp_path / "degrees.tif", np.full((NY, NX), 9.0, "float32"), crs="EPSG:4326")
    for path, said_of_it in ((empty, "no height at all"), (row, "70 x 1 cells"), (degrees, "geographic")):
        with pytest.raises(UserError, match=said_of_it), open_windows(path, crs=None, feedback=said):
            pass


def test_a_file_that_does_not_read_back_is_found(tmp_path, said, rough):
    path = write(tmp_path / "dem.tif", rough)
    with open_windows(path, crs=None, feedback=said) as dem:
        profile = geotiff_profile(dem.shape, dem.crs, NORTH_UP, "float32", -9999.0)
        window = dem.file_window(slice(0, NY), slice(0, NX))
        with WindowWriter(tmp_path / "good.tif", Quiet(), **profile) as good:
            good.write(rough[None], window)
        bad = WindowWriter(tmp_path / "bad.tif", Quiet(), **profile)
        bad.write(rough[None], window)
        bad.target.write(rough[None] + 1, window=window)
        with pytest.raises(OSError, match="cannot be read back"), bad:
            pass


def test_what_follows_the_last_window_shows_progress_and_can_be_cancelled(tmp_path, rough, monkeypatch):
    """Building overviews and reading back 1.6 Gcells take some 20 minutes after the last window is written."""
    monkeypatch.setattr(geotiff, "COG_FROM_CELLS", 0)
    shown, cancelled_at = [], 0

    class Seen(Quiet):
        def progress(self, done: float, total: float, what: str) -> None:
            shown.append((done, total, what))

        def cancelled(self) -> bool:
            return len(shown) == cancelled_at

    def write_by_rows(name: str) -> None:
        profile = geotiff_profile((NY, NX), pyproj.CRS(2056), NORTH_UP, "float32", -9999.0)
        with WindowWriter(tmp_path / name, Seen(), **profile) as writer:
            for row in range(0, NY, 10):
                writer.write(rough[None, row : row + 10], Window(0, row, NX, 10))  # type: ignore[call-arg]

    write_by_rows("shown.tif")
    back = [(done, 5, "reading the file back") for done in range(1, 6)]
    assert shown == [(0, 1, "building overviews"), *back]
    shown.clear()
    cancelled_at = 3
    with pytest.raises(Cancelled):
        write_by_rows("cancelled.tif")
    assert shown[-1] == back[1]
