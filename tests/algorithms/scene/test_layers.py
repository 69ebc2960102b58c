"""From layers to arrays: units, ids, parts and rings, friction from rasters and polygons, and omitted rows."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from slope_case import EAST, NORTH, points, write_dem, write_layer

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.scene.counts import counts_of_scene
from deadwood_algorithms.scene.items import digest_of
from deadwood_algorithms.scene.layers import read_barriers, read_friction, read_lines, read_scene, read_trees
from deadwood_algorithms.scene.releases import read_releases

DEFAULTS = {
    "dbh_cm": 75.0,
    "length_m": 30.0,
    "density_kg_m3": 300.0,
    "orientation": "upright",
    "tilt_deg": 0.0,
    "azimuth_deg": 0.0,
    "speed_ms": 0.0,
    "drop_m": 0.0,
}


@pytest.fixture
def grid(tmp_path):
    return read_dem(write_dem(tmp_path / "dem.tif"))


def test_releases_change_units_and_find_their_defaults(grid, tmp_path, said):
    path = write_layer(
        tmp_path / "r.gpkg",
        points((30, 80), (31, 80), (32, 80)),
        log_id=[9, 2, 5],
        dbh_cm=[40, 50, 60],
        orientation=["lying", " Upright", "TILTED"],
        azimuth_deg=[-90.0, 360.0, 725.0],
    )
    releases = read_releases(path, grid, DEFAULTS, feedback=said)
    logs = releases.logs
    assert logs.log_id.tolist() == [9, 2, 5]
    assert logs.diameter.tolist() == [0.4, 0.5, 0.6]
    assert logs.length.tolist() == [30.0] * 3
    assert logs.orientation.tolist() == [1, 0, 2]
    assert np.degrees(logs.azimuth).tolist() == pytest.approx([270.0, 0.0, 5.0])
    assert logs.x.tolist() == pytest.approx([EAST + 30, EAST + 31, EAST + 32])
    assert releases.release_id.tolist() == [1, 1, 1]
    assert said.warnings == []


def test_options_overridden_by_columns_are_reported(grid, tmp_path, said):
    """Releases drawn upright stay so regardless of --orientation: before, only the last line mentioned this."""
    path = write_layer(
        tmp_path / "r.gpkg", points((30, 80), (31, 80)), orientation=["upright"] * 2, dbh_cm=[40.0, 40.0]
    )
    asked = {**DEFAULTS, "orientation": "lying", "dbh_cm": 40.0, "length_m": 12.0, "azimuth_deg": 90.0}
    logs = read_releases(path, grid, asked, feedback=said).logs
    assert logs.orientation.tolist() == [0, 0]
    assert logs.length.tolist() == [12.0, 12.0]
    (warning,) = said.warnings
    assert "--orientation lying: without effect, because the layer has a column of that name" in warning
    assert "--dbh-cm" not in warning  # it states the content of the column


def test_without_log_id_the_row_number_is_taken(grid, tmp_path, said):
    path = write_layer(tmp_path / "r.gpkg", points((30, 80), (31, 80)), release_id=["north", "south"])
    releases = read_releases(path, grid, DEFAULTS, feedback=said)
    assert releases.logs.log_id.tolist() == [1, 2]
    assert releases.release_id.tolist() == ["north", "south"]


def test_trees_off_the_terrain_are_left_out_and_keep_their_ids(grid, tmp_path, said):
    path = write_layer(
        tmp_path / "t.gpkg",
        points((-5, 50), (10, 50), (70, 50), (20, 50)),
        tree_id=[11, 12, 13, 14],
        dbh_cm=[30.0, 40.0, 50.0, 60.0],
        height_m=[15.0, 20.0, 25.0, 30.0],
    )
    trees, ids, left_out, dbh_cm, _ = read_trees(path, grid, said)
    assert ids == ["12", "14"]
    assert left_out == {"off_dem": 2, "no_terrain": 0}
    assert trees.diameter.tolist() == [0.4, 0.6]
    assert dbh_cm.tolist() == [40.0, 60.0]
    assert trees.height.tolist() == [20.0, 30.0]
    assert any("2 of 4 trees" in note for note in said.notes)


def test_stumps_are_counted_apart_from_trees(tmp_path, said):
    """Four trees and three stumps, of which two trees and one stump are off the terrain model."""
    path = write_layer(
        tmp_path / "t.gpkg",
        points((-5, 50), (10, 50), (70, 50), (20, 50), (21, 50), (22, 50), (-9, 50)),
        dbh_cm=[30.0, 40.0, 50.0, 60.0, 35.0, 45.0, 55.0],
        height_m=[15.0, 20.0, 25.0, 2.0, 0.5, 1.99, 0.5],
    )
    layers = read_scene(write_dem(tmp_path / "d.tif"), 0.3, path, None, None, crs=None, feedback=said)
    counts = counts_of_scene(layers)
    assert {name: (each["read"], each["used"]) for name, each in counts.items()} == {"trees": (4, 2), "stumps": (3, 2)}
    for each in counts.values():
        assert each["read"] == each["used"] + sum(why["n"] for why in each["left_out"])


def test_parts_and_rings_belong_to_their_item(grid, tmp_path, said):
    ring = shapely.Polygon(shapely.box(10, 10, 20, 20).exterior, [shapely.box(13, 13, 16, 16).exterior])
    shapes = [
        shapely.LineString([(1, 5), (20, 5), (30, 6)]),
        ring,
        shapely.MultiPolygon([shapely.box(30, 10, 35, 15), shapely.box(40, 10, 45, 15)]),
        shapely.LineString([(30, 6), (50, 6)]),
    ]
    path = write_layer(tmp_path / "l.gpkg", shapes, line_id=["road", "house", "huts", "road"])
    lines, items = read_lines(path, grid, said)
    assert items.ids == ["road", "house", "huts"]
    assert items.item.tolist() == [0, 1, 1, 2, 2, 0]
    assert np.diff(lines.starts).tolist() == [3, 5, 5, 5, 5, 2]
    assert items.geometry[0].geom_type == "MultiLineString"
    for first, last in zip(lines.starts[1:5], lines.starts[2:6] - 1, strict=True):
        assert lines.vertices[first].tolist() == lines.vertices[last].tolist()
    by_row = np.zeros((2, 6), bool)
    by_row[0, 5] = by_row[1, 3] = True
    assert items.any_row(by_row).tolist() == [[True, False, False], [False, False, True]]
    times = np.full((1, 6), np.nan)
    times[0, [0, 5]] = 8.0, 3.0
    assert items.first_time(times)[0, 0] == 3.0
    assert np.isnan(items.first_time(times)[0, 1:]).all()


def test_names_stand_in_for_missing_ids(grid, tmp_path, said):
    line = shapely.LineString([(1, 5), (20, 5)])
    assert read_lines(write_layer(tmp_path / "a.gpkg", [line], name=["A13"]), grid, said)[1].ids == ["A13"]
    assert read_lines(write_layer(tmp_path / "b.gpkg", [line, line]), grid, said)[1].ids == [1, 2]
    assert not said.notes
    path = write_layer(tmp_path / "c.gpkg", [line, line], width_m=[4.0, 3.0], nome=["Strada", "Malga"])
    assert read_lines(path, grid, said)[1].ids == [1, 2]
    assert "the lines are named by their rows, 1 to 2; rename 'nome' if it holds their names" in said.notes[0]
    path = write_layer(tmp_path / "d.gpkg", [line, line], height_m=[2.0, 3.0], Bezeichnung=["Werk 1", "Werk 2"])
    assert read_barriers(path, grid, said)[1].ids == [1, 2]
    assert "the barriers are named by their rows, 1 to 2; rename 'Bezeichnung' if it holds" in said.notes[1]


def test_barriers_keep_the_height_of_their_row(grid, tmp_path, said):
    shapes = [
        shapely.MultiLineString([[(1, 40), (9, 40)], [(11, 40), (19, 40)]]),
        shapely.LineString([(20, 40), (29, 41)]),
    ]
    path = write_layer(tmp_path / "b.gpkg", shapes, barrier_id=["w", "w"], height_m=[2.0, 3.5])
    barriers, items = read_barriers(path, grid, said)
    assert barriers.height.tolist() == [2.0, 2.0, 3.5]
    assert items.ids == ["w"]
    assert items.item.tolist() == [0, 0, 0]


def test_friction_as_a_number(grid, said):
    assert read_friction("0.25", grid, said) == 0.25
    assert read_friction(0.25, grid, said) == 0.25


def test_friction_of_polygons_and_the_later_row_counts(grid, tmp_path, said):
    shapes = [shapely.box(-1, -1, 61, 101), shapely.box(20, -1, 61, 101)]
    path = write_layer(tmp_path / "f.gpkg", shapes, mu=[0.2, 0.6])
    mu = read_friction(path, grid, said)
    assert isinstance(mu, np.ndarray)
    assert mu.shape == (100, 60)
    assert np.allclose(mu[:, :20], 0.2)
    assert np.allclose(mu[:, 20:], 0.6)


def test_friction_of_a_raster_stands_right_way_up(grid, tmp_path, said):
    values = np.broadcast_to(np.linspace(0.9, 0.1, 50, dtype="float32")[:, None], (50, 30))
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 50, "width": 30, "crs": "EPSG:2056"}
    with rasterio.open(tmp_path / "f.tif", "w", transform=from_origin(EAST, NORTH + 100, 2.0, 2.0), **facts) as made:
        made.write(values, 1)
    mu = read_friction(str(tmp_path / "f.tif"), grid, said)
    assert isinstance(mu, np.ndarray)
    assert mu[0, 0] == pytest.approx(0.1)  # south
    assert mu[-1, 0] == pytest.approx(0.9)  # north


def test_friction_may_be_missing_where_the_terrain_is(tmp_path, said):
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 100, "width": 60, "crs": "EPSG:2056"}
    values = np.full((100, 60), 0.3, "float32")
    values[:10] = -1.0
    heights = np.full((100, 60), 500.0, "float32")
    heights[:10] = -1.0
    for name, array in (("f.tif", values), ("d.tif", heights)):
        with rasterio.open(
            tmp_path / name, "w", nodata=-1.0, transform=from_origin(EAST, NORTH + 100, 1.0, 1.0), **facts
        ) as made:
            made.write(array, 1)
    mu = read_friction(str(tmp_path / "f.tif"), read_dem(tmp_path / "d.tif"), said)
    assert isinstance(mu, np.ndarray)
    assert np.isfinite(mu).all()


def test_the_digest_sees_every_input(tmp_path, said):
    dem = write_dem(tmp_path / "dem.tif")
    trees = write_layer(tmp_path / "t.gpkg", points((10, 50)), dbh_cm=[40.0], height_m=[20.0])
    other = write_layer(tmp_path / "o.gpkg", points((10, 50)), dbh_cm=[40.0], height_m=[20.5])
    line = write_layer(tmp_path / "l.gpkg", [shapely.LineString([(1, 5), (20, 5)])])
    scenes = [(dem, "0.25", trees, None, None), (dem, "0.3", trees, None, None), (dem, "0.25", other, None, None)]
    scenes += [(dem, "0.25", None, None, None), (dem, "0.25", trees, None, line)]
    digests = [read_scene(*scene, crs=None, feedback=said).digest for scene in scenes]
    assert len(set(digests)) == len(digests)
    assert read_scene(*scenes[0], crs=None, feedback=said).digest == digests[0]


def test_a_digest_is_of_values_not_of_objects():
    assert digest_of(np.arange(3.0), "a") == digest_of(np.arange(3.0), "a")
    assert digest_of(np.arange(3.0)) != digest_of(np.arange(3))
    assert digest_of(np.arange(4.0)) != digest_of(np.arange(4.0).reshape(2, 2))
    assert digest_of(np.array(["x", "y"], object)) == digest_of(np.array(["x", "y"], object))


def test_a_layer_without_crs_is_the_dems(grid, tmp_path, said):
    path = write_layer(tmp_path / "r.gpkg", points((30, 80)), crs=None)
    assert gpd.read_file(path).crs is None
    releases = read_releases(path, grid, DEFAULTS, feedback=said)
    assert releases.x.tolist() == pytest.approx([EAST + 30])
    assert any("no CRS" in note for note in said.notes)
