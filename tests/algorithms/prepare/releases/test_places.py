"""Places by weights: in proportion to them, inside the areas, independent of other logs; number of logs per area."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from shapely import MultiPolygon, Point, box

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.releases.weights import cells_between

EAST, NORTH = 2_783_000.0, 1_190_000.0
MIDDLE = Point(EAST + 100, NORTH + 80)


def local(x0: float, y0: float, x1: float, y1: float) -> shapely.Polygon:
    return box(EAST + x0, NORTH + y0, EAST + x1, NORTH + y1)


def areas(tmp_path: Path, *shapes, **columns) -> str:
    gpd.GeoDataFrame(columns, geometry=list(shapes), crs=2056).to_file(tmp_path / "areas.gpkg")
    return str(tmp_path / "areas.gpkg")


@pytest.fixture
def raster(tmp_path):
    """Writes weights of 80 x 100 cells of 2 m on the DEM's grid (row 0 in the north), or on another."""

    def write(values: np.ndarray, cell: float = 2.0, crs: str = "EPSG:2056", nodata: float | None = None) -> str:
        profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "nodata": nodata, "crs": crs}
        profile |= {"height": values.shape[0], "width": values.shape[1]}
        profile["transform"] = from_origin(EAST, NORTH + values.shape[0] * cell, cell, cell)
        with rasterio.open(tmp_path / "weights.tif", "w", **profile) as made:
            made.write(values.astype("float32"), 1)
        return str(tmp_path / "weights.tif")

    return write


def counts_in(frame: gpd.GeoDataFrame, width: float, height: float) -> np.ndarray:
    """Logs in blocks of this size, row 0 south."""
    edges = np.arange(0, 160 + height, height), np.arange(0, 200 + width, width)
    return np.histogram2d(frame.geometry.y - NORTH, frame.geometry.x - EAST, bins=edges)[0]


def test_places_are_as_dense_as_the_weights(sample, raster, chi_square_excess):
    rng = np.random.default_rng(5)
    blocks = rng.integers(0, 5, (8, 10)).astype(float)  # of 20 x 20 m; some are 0
    frame = sample(None, weights=raster(np.kron(blocks, np.ones((10, 10)))), count=20_000)
    counts = counts_in(frame, 20.0, 20.0)
    # The surface ends half a cell inside the outermost cells: their blocks are 1 m narrower on that side.
    size = np.full((8, 10), 400.0)
    size[[0, -1]] -= 20.0
    size[:, [0, -1]] -= np.array([20.0, *[20.0] * 6, 20.0])[:, None] - np.array([1.0, *[0.0] * 6, 1.0])[:, None]
    shares = blocks[::-1] * size
    assert counts[shares == 0].sum() == 0
    seen = shares > 0
    assert chi_square_excess(counts[seen], shares[seen] / shares.sum()) < 1
    # The test can fail: areas without the weights fail it by far.
    even = np.where(seen, size, 0)
    assert chi_square_excess(counts[seen], even[seen] / even.sum()) > 10
    assert frame["release_id"].unique().tolist() == [1]


def test_within_a_cell_places_are_uniform(sample, raster, chi_square_excess):
    weights = np.zeros((80, 100))
    weights[40, 50] = 1.0
    frame = sample(None, weights=raster(weights), count=20_000)
    x, y = frame.geometry.x - EAST - 100, frame.geometry.y - NORTH - 78
    assert ((x >= 0) & (x <= 2) & (y >= 0) & (y <= 2)).all()
    counts = np.histogram2d(x, y, bins=5, range=[[0, 2], [0, 2]])[0].ravel()
    assert chi_square_excess(counts, np.full(25, 1 / 25)) < 1


def test_in_a_multipolygon_with_a_hole_places_are_by_weight_and_inside(tmp_path, sample, raster, chi_square_excess):
    west, east = local(21, 21, 81, 101), local(121, 41, 161, 61)
    area = MultiPolygon([west - local(41, 41, 61, 61), east])
    weights = np.ones((80, 100))
    weights[:, 50:] = 3.0  # the eastern part counts three times
    frame = sample(areas(tmp_path, area), weights=raster(weights), count=20_000)
    assert shapely.contains_xy(area, frame.geometry.x, frame.geometry.y).all()
    strips = [area & local(x, y, x + 20, y + 20) for x in range(21, 161, 20) for y in range(21, 101, 20)]
    strips = [each for each in strips if each.area > 0]
    counts = np.array([frame.within(each).sum() for each in strips], float)
    shares = np.array([each.area * (3 if each.centroid.x > EAST + 100 else 1) for each in strips])
    assert chi_square_excess(counts, shares / shares.sum()) < 1


def test_equal_weights_fill_a_circle_uniformly(tmp_path, sample, raster, chi_square_excess):
    frame = sample(areas(tmp_path, MIDDLE), weights=raster(np.full((80, 100), 0.3)), count=20_000)
    r = np.hypot(frame.geometry.x - MIDDLE.x, frame.geometry.y - MIDDLE.y)
    assert r.max() <= 10
    rings = np.bincount(np.minimum((r**2 / 100 * 20).astype(int), 19), minlength=20)
    assert chi_square_excess(rings, np.full(20, 0.05)) < 1


def test_a_log_keeps_its_place_when_the_number_grows(tmp_path, sample, raster):
    weights = raster(np.arange(8000.0).reshape(80, 100))
    layer = areas(tmp_path, MIDDLE, local(20, 20, 60, 60))
    few, many = sample(layer, weights=weights, count=20), sample(layer, weights=weights, count=50)
    assert many.iloc[:40].equals(few)


def test_weights_of_another_grid_and_crs_and_with_nodata(sample, raster, said, slope):
    weights = np.zeros((16, 20))
    weights[:, :10] = 5.0
    weights[0] = -9999.0
    frame = sample(None, weights=raster(weights, cell=10.0, nodata=-9999.0), count=500)
    assert frame.geometry.x.max() < EAST + 100
    assert frame.geometry.y.max() < NORTH + 150
    assert any("resampled to the DEM's cells" in note for note in said.notes)
    holed = sample(None, weights=raster(np.ones((80, 100))), dem=slope("holed.tif", nodata_rows=30), count=500)
    assert holed.geometry.y.max() <= NORTH + 99


def test_faulty_weights(tmp_path, sample, raster):
    with pytest.raises(UserError, match=r"weights.tif: a weight is -1, but must not be negative"):
        sample(None, weights=raster(np.full((80, 100), -1.0)))
    with pytest.raises(UserError, match="no cell on the DEM has a weight above 0"):
        sample(None, weights=raster(np.zeros((80, 100))))
    west = np.zeros((80, 100))
    west[:, 0] = 1.0
    with pytest.raises(UserError, match=r"row 1: no cell of .*weights.tif in this area has a weight above 0"):
        sample(areas(tmp_path, MIDDLE), weights=raster(west))
    with pytest.raises(UserError, match="--areas is missing"):
        sample(None)
    with pytest.raises(
        UserError, match="--release-id-field names a field, but --areas, whose field it is, is not given"
    ):
        sample(None, weights=raster(np.ones((80, 100))), release_id_field="name")


def test_weights_that_hardly_touch_an_area(tmp_path, sample, raster, monkeypatch):
    monkeypatch.setattr("deadwood_algorithms.prepare.releases.places.TURNS", 50)
    weights = np.zeros((80, 100))
    weights[40, 45] = 1.0  # 90 to 92 m east, 78 to 80 m north: in the corner of the circle's extent, outside the circle
    with pytest.raises(UserError, match="hardly touch this area; draw it wider"):
        sample(areas(tmp_path, Point(EAST + 98.5, NORTH + 86.5)), weights=raster(weights), count=5, radius_m=7.0)


def test_logs_per_hectare(tmp_path, sample, outcome):
    big, small, circle = local(20, 20, 120, 120), local(130, 20, 150, 40), Point(EAST + 160, NORTH + 100)
    frame = sample(areas(tmp_path, big, small, circle), logs_per_ha=200.0)
    assert frame["release_id"].value_counts().to_dict() == {1: 200, 2: 8, 3: round(200 * np.pi * 100 / 1e4)}
    assert outcome["last"].lines[0] == "214 logs in 3 release areas, 6 to 200 each (200 a hectare)"
    # The ids are those given by --count, so that the same logs are at the same places.
    assert ((frame["log_id"] - 1) % 3 + 1 == frame["release_id"]).all()
    assert frame["log_id"].is_monotonic_increasing
    by_count = sample(areas(tmp_path, big, small, circle), count=6)
    shared = frame.set_index("log_id").loc[by_count["log_id"]]
    assert (shared.geometry.to_numpy() == by_count.geometry.to_numpy()).all()


def test_logs_per_hectare_of_weighted_cells_and_of_too_little(tmp_path, sample, raster, outcome):
    weights = np.zeros((80, 100))
    weights[20:45, 10:60] = 2.0  # 25 x 50 cells of 4 m2: half a hectare
    assert len(sample(None, weights=raster(weights), logs_per_ha=100.0)) == 50
    frame = sample(areas(tmp_path, local(20, 20, 120, 120), local(130, 20, 131, 21)), logs_per_ha=10.0)
    assert len(frame) == 10
    assert "1 area is too small for a log at 10 a hectare" in outcome["last"].lines
    with pytest.raises(UserError, match=r"--logs-per-ha 1 on 0.01 ha gives no log"):
        sample(areas(tmp_path, local(20, 20, 30, 30)), logs_per_ha=1.0)


@pytest.mark.parametrize("seed", range(20))
def test_the_cells_of_a_span_are_all_that_reach_into_it(seed):
    """Each cell is checked separately; also for spans that lie partly or completely outside the raster."""
    rng = np.random.default_rng(seed)
    origin, cell, count = 100.0, 2.5, 12
    low, high = np.sort(rng.uniform(80.0, 150.0, 2)).tolist()
    first, last = cells_between(low, high, origin, cell, count)
    centre = origin + cell * np.arange(count)
    reaches = (centre - 0.5 * cell < high) & (centre + 0.5 * cell > low)
    assert np.flatnonzero(reaches).tolist() == list(range(first, last))
