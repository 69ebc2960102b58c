"""Friction as a number, a raster and polygons, through files: the values of cells, and the effect on a log."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from slope_case import EAST, LENGTH, NORTH, WIDTH, Case, layer, points, write_dem, write_layer

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.friction import as_written, read_friction
from deadwood_engine import Scene

ALL = shapely.box(-5, -5, WIDTH + 5, LENGTH + 5)


@pytest.fixture
def grid(tmp_path):
    return read_dem(write_dem(tmp_path / "dem.tif"))


def raster_of(path: Path, values: np.ndarray, cell: float, *, crs: str = "EPSG:2056", origin=None, **profile) -> str:
    """A friction raster as on a map, with the north-west corner of the DEM."""
    west, north = origin or (EAST, NORTH + LENGTH)
    transform = from_origin(west, north, cell, cell)
    facts = {"driver": "GTiff", "count": 1, "dtype": "float32", "crs": crs, "transform": transform}
    facts |= {"height": values.shape[0], "width": values.shape[1]}
    with rasterio.open(path, "w", **(facts | profile)) as made:
        made.write(values.astype(np.float32), 1)
    return str(path)


def refused(grid, said, friction, **options) -> str:
    with pytest.raises(UserError) as error:
        read_friction(friction, grid, said, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_raster_of_larger_cells_gives_each_cell_its_own(grid, tmp_path, said):
    """Cells of 4 m over cells of 1 m: sixteen per coarse cell."""
    values = np.random.default_rng(1).uniform(0.2, 0.6, (25, 15)).astype(np.float32)
    mu = read_friction(raster_of(tmp_path / "f.tif", values, 4.0), grid, said)
    assert np.array_equal(mu, np.kron(as_written(values), np.ones((4, 4)))[::-1])
    assert any("resampled to the DEM's cells (nearest value)" in note for note in said.notes)


def test_a_raster_of_finer_cells_gives_the_one_that_holds_the_centre(grid, tmp_path, said):
    values = np.random.default_rng(1).uniform(0.2, 0.6, (300, 180)).astype(np.float32)
    mu = read_friction(raster_of(tmp_path / "f.tif", values, 1.0 / 3.0), grid, said)
    assert np.array_equal(mu, as_written(values)[1::3, 1::3][::-1])


def test_a_raster_on_the_same_cells_is_taken_without_a_word(grid, tmp_path, said):
    values = np.random.default_rng(1).uniform(0.2, 0.6, (LENGTH, WIDTH)).astype(np.float32)
    mu = read_friction(raster_of(tmp_path / "f.tif", values, 1.0), grid, said)
    assert np.array_equal(mu, as_written(values)[::-1])
    assert said.notes == []


def test_a_raster_in_another_crs_lands_where_it_belongs(grid, tmp_path, said):
    """In the older Swiss CRS, whose numbers here are 2 000 000 and 1 000 000 less, to within a few centimetres."""
    values = np.full((100, 60), 0.3)
    values[:, 30:] = 0.6
    origin = (EAST - 2_000_000.0, NORTH - 1_000_000.0 + LENGTH)
    path = raster_of(tmp_path / "f.tif", values, 1.0, crs="EPSG:21781", origin=origin)
    mu = np.asarray(read_friction(path, grid, said, elsewhere=0.9))
    assert (mu[1:-1, 1:29] == 0.3).all()
    assert (mu[1:-1, 31:-1] == 0.6).all()
    assert any("accurate to about" in note for note in said.notes)


@pytest.mark.parametrize("crs", ["EPSG:2056", "EPSG:21781"])
def test_a_window_of_the_dem_gets_what_the_whole_gets(grid, tmp_path, said, crs):
    origin = (EAST - 13.3, NORTH + 150.1) if crs == "EPSG:2056" else (EAST - 2_000_013.3, NORTH - 999_849.9)
    values = np.random.default_rng(1).uniform(0.2, 0.6, (310, 190)).astype(np.float32)
    path = raster_of(tmp_path / "f.tif", values, 0.7, crs=crs, origin=origin)
    shapes = [ALL, shapely.Point(30, 50).buffer(20), shapely.box(10.5, 20.5, 20.5, 30.5)]
    areas = write_layer(tmp_path / "a.gpkg", shapes, mu=[0.2, 0.4, 0.6])
    part = Part(7, 23, 31, 40)
    for layer_path in (path, areas):
        whole = np.asarray(read_friction(layer_path, grid, said))
        assert np.array_equal(read_friction(layer_path, grid.window(part), said), whole[part.slices])


def test_polygons_with_a_hole_an_overlap_and_a_column_of_choice(grid, tmp_path, said):
    """A ring of 0.5 around a hole of 0.3, the later row over the earlier, exact by cell centres."""
    ring = shapely.box(10, 10, 40, 40) - shapely.box(20, 20, 30, 30)
    later = shapely.box(35, 10, 45, 20)
    frame = gpd.GeoDataFrame({"Rauheit": [0.3, 0.5, 0.7], "mu": [9.0, 9.0, 9.0]}, geometry=[ALL, ring, later], crs=2056)
    path = write_layer(tmp_path / "f.gpkg", list(frame.geometry), Rauheit=frame["Rauheit"].tolist(), mu=[9.0] * 3)
    mu = np.asarray(read_friction(path, grid, said, column="rauheit"))
    expected = np.full((LENGTH, WIDTH), 0.3)
    expected[10:40, 10:40] = 0.5
    expected[20:30, 20:30] = 0.3
    expected[10:20, 35:45] = 0.7
    assert np.array_equal(mu, expected)
    overlapped = (30 * 30 - 10 * 10) + 10 * 5  # the ring, and the part of the last row beside it
    assert any(f"polygons overlap on {overlapped} cells; the later one counts" in note for note in said.notes)


def test_friction_column_before_mu_in_any_letter_case(grid, tmp_path, said):
    both = write_layer(tmp_path / "a.gpkg", [ALL], mu=[0.2], Friction=[0.6])
    assert np.all(read_friction(both, grid, said) == 0.6)
    capital = write_layer(tmp_path / "b.gpkg", [ALL], MU=[0.2])
    assert np.all(read_friction(capital, grid, said) == 0.2)


@pytest.mark.parametrize("kind", ["polygons", "raster"])
def test_a_gap_is_refused_or_filled(grid, tmp_path, said, kind):
    """The west half covered, the east not: 30 of 60 columns."""
    if kind == "polygons":
        path = write_layer(tmp_path / "f.gpkg", [shapely.box(-1, -1, 30, LENGTH + 1)], friction=[0.4])
    else:
        path = raster_of(tmp_path / "f.tif", np.full((100, 30), 0.4), 1.0)
    message = refused(grid, said, path)
    assert "does not cover the DEM, 3000 of its cells have none" in message
    assert f"one at {EAST + 30.5:.1f}, {NORTH + 0.5:.1f}" in message
    assert "--friction-elsewhere" in message
    mu = np.asarray(read_friction(path, grid, said, elsewhere=0.25))
    assert np.allclose(mu[:, :30], 0.4)
    assert np.all(mu[:, 30:] == 0.25)
    assert any("50.0% of the DEM's cells have no friction and get 0.25" in note for note in said.notes)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (["0.3", "rough"], "'rough' is not a number"),
        ([0.3, -0.1], "-0.1 is not a number at least 0"),
        ([0.3, None], "empty"),
    ],
)
def test_what_is_no_friction_names_its_row(grid, tmp_path, said, values, words):
    message = refused(grid, said, write_layer(tmp_path / "f.gpkg", [ALL, ALL], friction=values))
    assert "field 'friction', row 2" in message
    assert words in message


def test_rasters_that_cannot_be(grid, tmp_path, said):
    values = np.full((100, 60), 0.4)
    values[5, 5] = -0.2
    assert "is -0.2 somewhere" in refused(grid, said, raster_of(tmp_path / "a.tif", values, 1.0))
    far = raster_of(tmp_path / "b.tif", values, 1.0, origin=(0.0, 0.0))
    assert "6000 of its cells have none" in refused(grid, said, far)


def test_polygons_elsewhere_or_without_the_column(grid, tmp_path, said):
    far = write_layer(tmp_path / "a.gpkg", [shapely.box(5000, 0, 5010, 10)], friction=[0.3])
    assert "none of the friction polygons lies on the DEM" in refused(grid, said, far, elsewhere=0.3)
    bare = write_layer(tmp_path / "b.gpkg", [ALL], cover=["rock"])
    assert "need a field 'friction' or 'mu'; --friction-column names another; it has the fields cover" in refused(
        grid, said, bare
    )
    assert "need a field 'roughness' (--friction-column)" in refused(grid, said, bare, column="roughness")


def test_options_that_do_not_fit_are_refused(grid, tmp_path, said):
    assert "--friction-column belongs to friction as a layer" in refused(grid, said, "0.3", column="mu")
    assert "--friction-elsewhere belongs to friction as a layer" in refused(grid, said, "0.3", elsewhere=0.2)
    path = raster_of(tmp_path / "f.tif", np.full((100, 60), 0.4), 1.0)
    assert "belongs to polygons" in refused(grid, said, path, column="mu")


def test_percent_or_degrees_are_suspected(grid, tmp_path, said):
    read_friction(write_layer(tmp_path / "f.gpkg", [ALL], friction=[25.0]), grid, said)
    assert "is it in percent or degrees?" in said.warnings[0]


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return Case(tmp_path_factory.mktemp("case"))


def test_a_log_stays_where_friction_is_high_and_slides_where_it_is_low(case, tmp_path):
    """Lying down the slope of 35 degrees (tan = 0.70): 0.8 holds a log, 0.4 does not; for each kind of input."""
    rows = {"orientation": ["lying"] * 2, "azimuth_deg": [180.0] * 2, "log_id": [1, 2]}
    releases = write_layer(tmp_path / "r.gpkg", points((15, 80), (45, 80)), **rows)
    west, east = shapely.box(-5, -5, 30, 105), shapely.box(30, -5, 65, 105)
    values = np.full((10, 6), 0.8)
    values[:, 3:] = 0.4
    both = write_layer(tmp_path / "f.gpkg", [west, east], friction=[0.8, 0.4])
    half = write_layer(tmp_path / "w.gpkg", [west], k=[0.8])
    ways = {
        "polygons": {"friction": both},
        "elsewhere": {"friction": half, "friction_column": "k", "friction_elsewhere": 0.4},
        "raster": {"friction": raster_of(tmp_path / "f.tif", values, 10.0)},
    }
    ends = []
    for name, way in ways.items():
        run = case.run(releases=releases, output=str(tmp_path / name), **way)
        deposits = layer(run, "deposits").set_index("log_id")
        assert deposits.loc[1, "runout_m"] < 0.05
        assert deposits.loc[2, "runout_m"] > 20.0
        ends.append(deposits["runout_m"].tolist())
    assert ends[0] == ends[1] == ends[2]
    number = case.run(releases=releases, output=str(tmp_path / "number"), friction=0.4)
    assert layer(number, "deposits").set_index("log_id").loc[2, "runout_m"] == ends[0][1]


def test_a_coefficient_is_the_same_to_the_last_bit_however_it_is_given(grid, tmp_path, said):
    """As a number, its text, a polygon or a raster over all of the DEM: a cell has 0.3, not 0.30000001."""
    polygon = write_layer(tmp_path / "p.gpkg", [ALL], friction=[0.3])
    raster = raster_of(tmp_path / "f.tif", np.full((25, 15), 0.3), 4.0)
    for given in (0.3, "0.3", polygon, raster):
        mu = read_friction(given, grid, said)
        scene = Scene.prepare(grid.values, grid.cell, 0.0, 0.0, friction=mu)
        assert set(scene.arrays.terrain.friction.ravel().tolist()) == {0.3}


def test_single_precision_is_read_as_the_shortest_decimal_that_it_stands_for():
    rng = np.random.default_rng(2)
    values = np.concatenate([10.0 ** rng.uniform(-4, 1, 20_000), [0.0, 0.1, 0.3, 1.0, 2.5, np.nan]]).astype(np.float32)
    told = as_written(values)
    assert np.array_equal(told, [float(str(each)) for each in values], equal_nan=True)
    assert np.array_equal(told.astype(np.float32), values, equal_nan=True)
