"""Whole runs on inputs as people have them: the messages about them, and how many logs then reach the road.

A slope of 35 degrees, 160 x 240 m, with a road at its foot: on the true terrain model all 40 logs reach it. What is
wrong with an input is either corrected, and the 40 reach it again, or reported beside the number.
"""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from scipy import ndimage

from deadwood_algorithms.tools import import_trees, sample_releases, slide_logs

EAST, NORTH = 2_700_000.0, 1_200_000.0
COLUMNS, ROWS, LOGS = 160, 240, 40
NODATA = -9999.0
FEET = 0.3048


def heights() -> np.ndarray:
    v, u = np.arange(ROWS)[::-1, None] + 0.5, np.arange(COLUMNS) + 0.5
    slope = np.where(v > 60.0, (v - 60.0) * np.tan(np.radians(35.0)), 0.0)
    return (800.0 + slope + 0.3 * np.sin(u / 6.0) * np.cos(v / 7.0)).astype("float32")


def write_dem(path: Path, values: np.ndarray, nodata: float = NODATA) -> str:
    facts = {"driver": "GTiff", "count": 1, "dtype": values.dtype.name, "crs": "EPSG:2056", "nodata": nodata}
    place = from_origin(EAST, NORTH + ROWS, 1.0, 1.0)
    with rasterio.open(path, "w", height=ROWS, width=COLUMNS, transform=place, **facts) as made:
        made.write(values, 1)
    return str(path)


def at(shape: Any) -> Any:
    return shapely.transform(shape, lambda xy: np.add(xy, (EAST, NORTH)))


AREA = at(shapely.box(60.0, 190.0, 100.0, 220.0))
ROAD = at(shapely.LineString([(2.0, 40.0), (158.0, 42.0)]))


class Scene:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.dem = write_dem(folder / "dem.tif", heights())
        self.road = self.write("road.gpkg", [ROAD], name=["road"])
        self.releases = self.released(self.write("area.gpkg", [AREA], release_id=[1]))
        self.number = 0

    def write(self, name: str, shapes: list[Any], /, crs: str = "EPSG:2056", **columns: Any) -> str:
        frame = gpd.GeoDataFrame(columns, geometry=shapes, crs="EPSG:2056").to_crs(crs)
        frame.to_file(self.folder / name)
        return str(self.folder / name)

    def released(self, areas: str, said: Any = None) -> str:
        output = Path(areas).with_suffix(".releases.gpkg")
        sample_releases.TOOL(areas=areas, dem=self.dem, count=LOGS, output=str(output), feedback=said)
        return str(output)

    def slide(self, said: Any, **changes: Any) -> dict[str, Any]:
        """The summary of a run with some other inputs."""
        self.number += 1
        run = self.folder / f"run{self.number}"
        values = {"dem": self.dem, "releases": self.releases, "lines": self.road} | changes
        slide_logs.TOOL(**values, friction="0.3", fidelity="draft", trajectories="none", output=str(run), feedback=said)
        return json.loads((run / "summary.json").read_text(encoding="utf-8"))

    def reach(self, said: Any, **changes: Any) -> dict[str, dict[str, Any]]:
        return {str(each["line_id"]): each for each in self.slide(said, **changes)["reach"]}


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> Scene:
    return Scene(tmp_path_factory.mktemp("scene"))


def words(said: Any) -> str:
    return " / ".join([*said.warnings, *said.notes])


def test_the_true_slope(scene, said):
    assert scene.reach(said)["road"]["n_reach"] == LOGS
    assert "impossible" not in words(said)
    assert "rounded" not in words(said)


def test_nodata_mixed_into_edges_and_a_hole(scene, said, tmp_path):
    """The hole lies in the logs' way: what they would do beyond it is within the bounds, which include 40 of 40."""
    blended = heights()
    hole, rim = (slice(100, 108), slice(72, 88)), slice(0, 1)
    blended[hole] = blended[rim] = NODATA
    mixed = 0.5 * (ndimage.uniform_filter(blended, 3) + blended)
    near = ndimage.binary_dilation(blended == NODATA, iterations=1) & (blended != NODATA)
    blended[near] = mixed[near]
    road = scene.reach(said, dem=write_dem(tmp_path / "dem.tif", blended))["road"]
    assert "hold impossible heights" in words(said)
    assert "a part without heights inside the DEM" in words(said)
    assert road["n_lost"] > 0
    assert road["n_reach"] + road["n_lost"] == LOGS
    assert road["p_high_if_lost"] == 1.0


@pytest.mark.parametrize("resampled", ["whole metres", "nearest"])
def test_steps_hold_logs_and_that_is_said(scene, said, tmp_path, resampled):
    stepped = np.rint(heights()).astype("int16")
    if resampled == "nearest":
        stepped = np.repeat(np.repeat(heights()[2::5, 2::5], 5, axis=0), 5, axis=1)
    road = scene.reach(said, dem=write_dem(tmp_path / "dem.tif", stepped, -32768))["road"]
    assert "Such steps, which real ground does not have" in words(said)
    assert road["n_reach"] < LOGS


def test_feet_are_asked_about_and_the_printed_command_mends_them(scene, said, tmp_path):
    feet = write_dem(tmp_path / "feet.tif", np.rint(heights() / FEET).astype("int16"), -32768)
    assert scene.reach(said, dem=feet)["road"]["n_reach"] < LOGS
    (command,) = re.findall(r"Fix: (\S*rio .*)$", "\n".join(said.warnings), re.MULTILINE)
    subprocess.run(command, shell=True, check=True, cwd=tmp_path)
    assert scene.reach(said, dem=str(tmp_path / "feet_fixed.tif"))["road"]["n_reach"] == LOGS


def test_roads_of_openstreetmap(scene, said):
    """Degrees, polygons and lines, ways without a name."""
    square = at(shapely.box(100.0, 55.0, 120.0, 65.0))
    shapes = [ROAD, square, at(shapely.LineString([(2.0, 30.0), (158.0, 30.0)]))]
    roads = scene.write("export.geojson", shapes, "EPSG:4326", name=["Dorfstrasse", None, None])
    reach = scene.reach(said, lines=roads)
    assert list(reach) == ["Dorfstrasse", "row 2", "row 3"]
    assert reach["Dorfstrasse"]["n_reach"] == reach["row 3"]["n_reach"] == LOGS


def test_a_track_of_a_receiver(scene, said):
    """A GPX file always has five layers, of which one is not empty."""
    place = scene.folder / "road.gpx"
    track = gpd.GeoDataFrame({"name": ["road"]}, geometry=[ROAD], crs="EPSG:2056").to_crs("EPSG:4326")
    pyogrio.write_dataframe(track, place, driver="GPX", layer="routes")
    assert scene.reach(said, lines=str(place))["road"]["n_reach"] == LOGS


def test_barriers_with_a_height_in_german(scene, said):
    lines = [at(shapely.LineString([(x, 100.0), (x + 80.0, 100.0)])) for x in (40.0,)]
    barriers = scene.write("netz.shp", lines, Höhe=[3.0], Typ=["Netz"])
    told = scene.slide(said, barriers=barriers)
    assert "'Höhe' is read as height_m" in words(said)
    assert told["barriers"][0]["n_stopped"] + told["reach"][0]["n_reach"] == LOGS
    assert told["barriers"][0]["n_stopped"] > 0


def close_no_ring(place: Path) -> None:
    """The last point of a shapefile's one polygon moves, so that its ring does not close."""
    content = bytearray(place.read_bytes())
    content[-16:] = np.array([EAST + 60.0, NORTH + 189.0], "<f8").tobytes()
    place.write_bytes(content)


def test_a_release_area_whose_ring_does_not_close(scene, said):
    area = scene.write("open.shp", [AREA], id=[1])
    close_no_ring(Path(area))
    releases = scene.released(area, said)
    assert "rings that do not close were closed" in words(said)
    assert scene.reach(said, releases=releases)["road"]["n_reach"] == LOGS


def test_a_sliver_among_the_release_areas_is_said(scene, said):
    sliver = at(shapely.Polygon([(80.0, 190.0), (80.0, 220.0), (80.0 + 1e-7, 205.0)]))
    releases = scene.released(scene.write("sliver.gpkg", [AREA, sliver], release_id=[1, 2]), said)
    assert "is too small for a tree" in words(said)
    assert scene.reach(said, releases=releases)["road"]["n_total"] == 2 * LOGS


def test_what_import_trees_writes_slide_logs_takes(scene, said):
    """Heights of stumps and seedlings, and a gap written as 0."""
    stems = [at(shapely.Point(20.0 + 10.0 * k, 100.0)) for k in range(5)]
    table = scene.write("tiges.geojson", stems, H=[22.3, 20.1, 0.084, 0.0, 0.0002], ID=[1, 2, 3, 4, 5])
    trees = str(scene.folder / "trees.gpkg")
    outcome = import_trees.TOOL(trees=table, dem=scene.dem, output=trees, feedback=said)
    assert (outcome.facts["trees"], outcome.facts["dropped"]) == (2, 3)
    told = scene.slide(said, trees=trees)
    assert told["counted"]["trees"] == {"read": 2, "used": 2, "left_out": []}
    assert told["reach"][0]["n_reach"] == LOGS
