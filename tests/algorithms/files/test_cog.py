"""What the toolbox's GeoTIFFs bring along for a viewer: overviews, statistics, colours, and the layout."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio.enums import ColorInterp

from deadwood_algorithms.files import cog
from deadwood_algorithms.files.dem_windows import WindowWriter
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.rasters import geotiff_profile, write_bands, write_raster

PLACE = (2.0, 2_783_001.0, 1_190_001.0, pyproj.CRS(2056))


def noise(shape: tuple[int, int] = (700, 900)) -> Grid:
    values = np.random.default_rng(1).uniform(5.0, 9.0, shape).astype(np.float32)
    values[:50] = np.nan
    return Grid(values, *PLACE)


def numbers(path: Path, band: int = 1) -> dict[str, float]:
    with rasterio.open(path) as made:
        tags = made.tags(band)
    return {name.removeprefix("STATISTICS_").lower(): float(value) for name, value in tags.items() if "STATI" in name}


def test_a_raster_has_overviews_statistics_and_the_layout(tmp_path):
    grid = noise()
    path = tmp_path / "a.tif"
    write_raster(path, grid.values, grid, nodata=np.nan, dtype="float32", units="m", description="Largest jump")
    with rasterio.open(path) as made:
        assert made.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert made.overviews(1) == [2, 4]
        assert (made.descriptions[0], made.units[0]) == ("Largest jump", "m")
        small = made.read(1, out_shape=(350, 450))
    known = grid.values[np.isfinite(grid.values)].astype(float)
    found = numbers(path)
    assert found == pytest.approx(
        {
            "minimum": known.min(), "maximum": known.max(), "mean": known.mean(), "stddev": known.std(),
            "valid_percent": 100.0 * known.size / grid.values.size,
        },
        rel=1e-3,
    )  # fmt: skip
    assert found["mean"] == pytest.approx(known.mean(), rel=1e-8)
    means = grid.values[::-1].reshape(350, 2, 450, 2).mean(axis=(1, 3))
    assert small == pytest.approx(means, nan_ok=True, abs=1e-5)
    assert [each.name for each in tmp_path.iterdir()] == ["a.tif"]


def test_the_same_values_give_the_same_bytes(tmp_path):
    grid = noise()
    for name in ("one", "two"):
        write_raster(tmp_path / f"{name}.tif", grid.values, grid, nodata=np.nan, dtype="float32")
    assert (tmp_path / "one.tif").read_bytes() == (tmp_path / "two.tif").read_bytes()


def test_a_single_logs_track_is_still_seen_in_the_overviews(tmp_path):
    counts = np.zeros((600, 600), np.uint32)
    counts[:, 301] = 1
    write_raster(tmp_path / "a.tif", counts, Grid(counts, *PLACE), dtype="uint32", units="logs", kind="count")
    with rasterio.open(tmp_path / "a.tif") as made:
        assert (made.read(1, out_shape=(300, 300)).max(axis=1) == 1).all()  # the mean, 0.25, would be 0


@pytest.mark.parametrize("walked", [100_000_000, 1000])
def test_a_window_is_stored_alone_with_the_statistics_of_the_whole(tmp_path, monkeypatch, walked):
    """Of counts what is not stored is 0; of others it is nothing. Too large to be walked over, it has no overviews."""
    monkeypatch.setattr(cog, "WALKED_CELLS", walked)
    whole = Grid.empty((3000, 2000), *PLACE)
    part = Part(301, 1203, 50, 40)
    values = np.random.default_rng(1).uniform(1.0, 9.0, (40, 50)).astype(np.float32)
    for name, nodata in (("counts", None), ("speeds", np.nan)):
        path = tmp_path / f"{name}.tif"
        write_raster(path, values, whole.window(part, values), nodata=nodata, dtype="float32")
        assert path.stat().st_size < 60_000
        with rasterio.open(path) as made:
            assert bool(made.overviews(1)) == (walked > 1000)
    every = np.zeros(whole.shape)
    every[part.slices] = values
    assert numbers(tmp_path / "counts.tif")["mean"] == pytest.approx(every.mean(), rel=1e-6)
    assert numbers(tmp_path / "counts.tif")["stddev"] == pytest.approx(every.std(), rel=1e-6)
    assert numbers(tmp_path / "counts.tif")["minimum"] == 0.0
    assert numbers(tmp_path / "speeds.tif")["mean"] == pytest.approx(values.mean(), rel=1e-6)


def test_bands_keep_their_names_and_a_mask_its_colours(tmp_path):
    grid = noise()
    both = {"speed, 50 %": grid.values, "speed, 95 %": grid.values + 1}
    write_bands(tmp_path / "b.tif", both, grid, nodata=np.nan, dtype="float32", units=["m/s"] * 2, kind="speed")
    with rasterio.open(tmp_path / "b.tif") as made:
        assert made.descriptions == tuple(both)
    assert numbers(tmp_path / "b.tif", 2)["mean"] == pytest.approx(numbers(tmp_path / "b.tif")["mean"] + 1.0)
    mask = (grid.values > 7.0).astype(np.uint8)
    write_raster(tmp_path / "m.tif", mask, grid, dtype="uint8", kind="mask")
    with rasterio.open(tmp_path / "m.tif") as made:
        assert made.colorinterp == (ColorInterp.palette,)
        assert made.colormap(1)[0] == (255, 255, 255, 255)
        assert made.colormap(1)[1] == (213, 94, 0, 255)
        assert np.array_equal(made.read(1), mask[::-1])


def test_written_in_windows_it_is_finished_alike(tmp_path):
    grid = noise()
    profile = geotiff_profile(grid.shape, grid.crs, grid.transform, "float32", np.nan)
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), WindowWriter(tmp_path / "w.tif", "terrain", **profile) as writer:
        for top in range(0, 700, 256):
            rows = grid.values[::-1][top : top + 256]
            window = rasterio.windows.Window(0, top, 900, rows.shape[0])
            writer.write(rows[None], window)
    write_raster(tmp_path / "a.tif", grid.values, grid, nodata=np.nan, dtype="float32", kind="terrain")
    with rasterio.open(tmp_path / "w.tif") as made, rasterio.open(tmp_path / "a.tif") as other:
        assert made.overviews(1) == other.overviews(1) == [2, 4]
        assert np.array_equal(made.read(1), other.read(1), equal_nan=True)
    assert numbers(tmp_path / "w.tif") == pytest.approx(numbers(tmp_path / "a.tif"))


def test_masked_cells_stay_masked_and_out_of_the_statistics(tmp_path):
    values = np.full((1, 300, 300), 7.0, np.float32)
    values[0, :100] = 1e6
    mask = np.full((300, 300), 255, np.uint8)
    mask[:100] = 0
    profile = geotiff_profile((300, 300), pyproj.CRS(2056), noise((300, 300)).transform, "float32", None)
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), WindowWriter(tmp_path / "w.tif", "terrain", **profile) as writer:
        writer.write(values, rasterio.windows.Window(0, 0, 300, 300), mask)
    with rasterio.open(tmp_path / "w.tif") as made:
        assert np.array_equal(made.read_masks(1), mask)
    assert numbers(tmp_path / "w.tif")["maximum"] == 7.0
