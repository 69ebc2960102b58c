"""assess-mobilisation, through its files: planes, steps and gullies with known answers, and the corresponding areas."""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
import tracemalloc
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import Affine, from_origin
from rasterio.vrt import WarpedVRT
from shapely import Point, box

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.mobilisation import decay
from deadwood_algorithms.prepare.mobilisation import rasters as mobilisation_rasters
from deadwood_algorithms.tools import assess_mobilisation, sample_releases

ROOT = Path(__file__).parents[3]
EAST, NORTH, CELL, NX, NY = 2_783_000.0, 1_190_000.0, 0.5, 120, 100
SOUTH_UP = Affine(CELL, 0.0, EAST, 0.0, CELL, NORTH)


def write_raster(path: Path, values, cell: float = CELL, **profile) -> str:
    """Values with row 0 south, in a float64 GeoTIFF."""
    values = np.asarray(values, float)
    ny, nx = values.shape
    facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "nodata": -9999, "crs": "EPSG:2056"}
    facts |= {"transform": from_origin(EAST, NORTH + ny * cell, cell, cell), "height": ny, "width": nx}
    south_up = profile.get("transform") == SOUTH_UP
    with rasterio.open(path, "w", **(facts | profile)) as made:
        made.write(values if south_up else values[::-1], 1)
    return str(path)


def grid(cell: float = CELL, nx: int = NX, ny: int = NY) -> tuple[np.ndarray, np.ndarray]:
    return (np.arange(nx) + 0.5) * cell, (np.arange(ny)[:, None] + 0.5) * cell


def plane(degrees: float, azimuth: float = 0.0) -> np.ndarray:
    """Rising at an angle towards an azimuth."""
    x, y = grid()
    a = math.radians(azimuth)
    return 1000.0 + math.tan(math.radians(degrees)) * (x * math.sin(a) + y * math.cos(a))


def write_layer(path: Path, shapes, crs: str | None = "EPSG:2056", **columns) -> str:
    moved = [shapely.transform(shape, lambda p: np.add(p, (EAST, NORTH))) for shape in shapes]
    gpd.GeoDataFrame(columns, geometry=moved, crs=crs).to_file(path, layer=path.stem, driver="GPKG")
    return str(path)


class Assessed:
    """What a run of the tool made; rasters with row 0 south."""

    def __init__(self, folder: Path, said=None, **values) -> None:
        self.folder = folder
        places = {"output": "s.tif", "factors": "f.tif", "release_areas": "areas.gpkg"}
        places |= {"assessed": "deadwood.gpkg"} if values.get("deadwood") else {}
        values = {name: str(folder / place) for name, place in places.items()} | {"overwrite": True} | values
        tool = assess_mobilisation.TOOL
        self.outcome = tool(tool.ask_from({k: v for k, v in values.items() if v is not None}), said)
        with rasterio.open(values["output"]) as source:
            self.profile = source.profile
            self.value = source.read(1)[::-1]
        with rasterio.open(values["factors"]) as source:
            self.slope, self.roughness, self.hollow = source.read()[:, ::-1]

    @property
    def areas(self) -> gpd.GeoDataFrame:
        return gpd.read_file(self.folder / "areas.gpkg", layer="release_areas")

    def logs(self, layer: str) -> gpd.GeoDataFrame:
        return gpd.read_file(self.folder / "deadwood.gpkg", layer=layer)

    def middle(self, values: np.ndarray) -> float:
        return float(values[NY // 2, NX // 2])


RIM = 10  # cells of a window of 10 m beside its middle
INNER = np.s_[RIM:-RIM, RIM:-RIM]


@pytest.mark.parametrize("degrees", [0.0, 12.0, 30.0, 32.0, 35.0, 50.0])
@pytest.mark.parametrize("azimuth", [0.0, 63.0, 200.0])
def test_on_a_plane_everything_is_known(tmp_path, degrees, azimuth):
    dem = write_raster(tmp_path / "dem.tif", plane(degrees, azimuth))
    found = Assessed(tmp_path, dem=dem, friction="0.25")
    drive = max(0.0, 1.0 - 0.25 / math.tan(math.radians(degrees))) if degrees else 0.0
    expected = drive * min(max((degrees - 30.0) / 5.0, 0.0), 1.0)
    # float32 in the file: 1e-7 of 50; the roughness is the root of rounding of squares of some 30 m
    assert found.slope[INNER] == pytest.approx(degrees, abs=5e-6)
    assert found.roughness[INNER] == pytest.approx(0.0, abs=1e-5)
    assert found.hollow[20:-20, 20:-20] == pytest.approx(0.0, abs=1e-6)
    assert found.value[INNER] == pytest.approx(expected, abs=3e-5)
    outside = np.ones((NY, NX), bool)
    outside[INNER] = False
    assert np.isnan(found.value[outside]).all()
    assert (found.profile["dtype"], found.profile["crs"].to_epsg()) == ("float32", 2056)


def test_below_the_angle_of_friction_nothing_slides(tmp_path):
    """Only the paper's condition mu < tan(slope): at mu = 0.3 logs could slide above 16.7 degrees."""
    limit = math.degrees(math.atan(0.3))
    for degrees, expected in ((limit - 0.2, 0.0), (limit + 0.2, 1 - 0.3 / math.tan(math.radians(limit + 0.2)))):
        dem = write_raster(tmp_path / "dem.tif", plane(degrees), overwrite=True)
        found = Assessed(tmp_path, dem=dem, friction="0.3", slope_none_deg=0.0, slope_full_deg=0.0)
        assert found.middle(found.value) == pytest.approx(expected, abs=1e-5)
    assert expected > 0.01


@pytest.mark.parametrize(("window", "cell"), [(10.0, 0.5), (3.0, 1.0), (7.0, 2.0)])
def test_on_any_ground_it_is_the_fit_of_least_squares(tmp_path, window, cell):
    """An independent fit of the six terms by numpy's lstsq in windows here and there."""
    rng = np.random.default_rng(5)
    x, y = grid(cell, 60, 50)
    heights = 1500.0 + 0.6 * y + 0.2 * x + np.sin(x / 7.0) * 2.0 + rng.normal(0.0, 0.4, (50, 60))
    dem = write_raster(tmp_path / "dem.tif", heights, cell)
    found = Assessed(tmp_path, dem=dem, window_m=window, gully_window_m=window)
    r = max(1, round((window / cell - 1) / 2))
    u, v = (each.ravel() for each in np.meshgrid(*[np.arange(-r, r + 1) * cell] * 2))
    terms = np.column_stack([np.ones_like(u), u, v, u**2, u * v, v**2])
    for row, column in rng.integers(r, 50 - r, (20, 2)):
        z = heights[row - r : row + r + 1, column - r : column + r + 1].ravel()
        (_, b, c, d, e, f), residual, *_ = np.linalg.lstsq(terms, z, rcond=None)
        hessian, contour = np.array([[2 * d, e], [e, 2 * f]]), np.array([-c, b]) / math.hypot(b, c)
        bend = contour @ hessian @ contour
        assert found.slope[row, column] == pytest.approx(math.degrees(math.atan(math.hypot(b, c))), abs=1e-4)
        assert found.roughness[row, column] == pytest.approx(math.sqrt(residual[0] / z.size), abs=1e-5)
        assert found.hollow[row, column] == pytest.approx(0.5 * bend * ((2 * r + 1) * cell / 2) ** 2, abs=1e-5)


def test_a_step_is_rough_and_a_wall_holds(tmp_path):
    """Of a step of height H across a window of w, the fitted surface rises 3 H / (2 w), and H/4 remains as roughness.

    This holds for infinitely small cells; for 21, the middle one being the first above the step, numpy fits a parabola.
    """
    x, y = grid()
    dem = write_raster(tmp_path / "dem.tif", 1000.0 + 2.0 * (y > 25.0) + 0.0 * x)
    found = Assessed(tmp_path, dem=dem)
    k = np.arange(-10, 11) * CELL
    (_, rise, _), residual, *_ = np.polyfit(k, 2.0 * (k >= 0), 2, full=True)
    assert found.slope[50, 60] == pytest.approx(math.degrees(math.atan(rise)), abs=1e-4)
    assert found.roughness[50, 60] == pytest.approx(math.sqrt(residual[0] / 21), abs=1e-5)
    assert (rise, math.sqrt(residual[0] / 21)) == pytest.approx((3 * 2.0 / (2 * 10.5), 2.0 / 4), rel=1 / 21)
    wall = write_raster(tmp_path / "wall.tif", plane(40.0) + 6.0 * (y > 25.0))
    found = Assessed(tmp_path, dem=wall)
    assert found.value[49:51, 60] == pytest.approx(0.0)  # 6 / 4 m of roughness, above the limit of 1 m
    assert found.value[15, 60] == pytest.approx(1 - 0.25 / math.tan(math.radians(40)), abs=1e-4)


def test_noise_is_roughness(tmp_path):
    """White noise of s: the fit removes six of n^2 degrees of freedom, s sqrt(1 - 6 / 441) remains."""
    rough = np.random.default_rng(8).normal(0.0, 0.3, (NY, NX))
    dem = write_raster(tmp_path / "dem.tif", plane(40.0) + rough)
    found = Assessed(tmp_path, dem=dem, roughness_limit_m=0.6)
    level = math.sqrt(float(np.mean(found.roughness[INNER].astype(float) ** 2)))
    # about 18 windows that do not overlap, each with 435 degrees of freedom: a standard error of 0.8 %
    assert level == pytest.approx(0.3 * math.sqrt(1 - 6 / 441), rel=0.03)
    free = Assessed(tmp_path, dem=dem, roughness_limit_m=1e6)
    ratio = found.value[INNER] / free.value[INNER]
    assert ratio == pytest.approx(1 - found.roughness[INNER] / 0.6, abs=1e-5)


def test_a_gully_is_detected_by_its_depth_and_changes_no_susceptibility(tmp_path):
    """A parabola across the slope is fitted exactly: depth a (w/2)^2, no roughness; a ridge has the other sign."""
    x, y = grid()
    a, slope = 0.02, math.tan(math.radians(40.0))
    for sign in (1.0, -1.0):
        dem = write_raster(tmp_path / "dem.tif", 1000.0 + slope * y + sign * a * (x - 30.25) ** 2)
        found = Assessed(tmp_path, dem=dem, gully_window_m=20.0)
        side = (2 * round((20.0 / CELL - 1) / 2) + 1) * CELL
        assert found.hollow[50, 60] == pytest.approx(sign * a * (side / 2) ** 2, rel=1e-5)
        assert found.roughness[50, 60] == pytest.approx(0.0, abs=1e-4)
        assert found.value[50, 60] == pytest.approx(1 - 0.25 / slope, abs=2e-4)
        share = found.areas["gully_share"]
        assert (share > 0.3).any() if sign > 0 else (share == 0).all()


def test_friction_of_polygons_and_rasters_cuts_areas_to_the_cell(tmp_path):
    dem = write_raster(tmp_path / "dem.tif", plane(40.0))
    west, east = box(10.0, 10.0, 25.0, 30.0) - box(14.0, 14.0, 18.0, 20.0), box(40.0, 20.0, 45.0, 24.0)
    diagonal = box(45.0, 24.0, 49.0, 30.0)  # touches the east one only at a corner
    small = box(30.0, 40.0, 34.0, 42.0)
    rest = box(-1.0, -1.0, 61.0, 51.0)
    polygons = write_layer(
        tmp_path / "mu.gpkg", [rest, west, east, diagonal, small], friction=[2.0, 0.25, 0.3, 0.3, 0.3]
    )
    found = Assessed(tmp_path, dem=dem, friction=polygons, min_area_m2=10.0)
    rows = found.areas
    assert rows["release_id"].tolist() == [1, 2, 3]
    assert rows["area_m2"].tolist() == [15 * 20 - 4 * 6, 4 * 6, 5 * 4]
    expected = [shapely.transform(each, lambda p: np.add(p, (EAST, NORTH))) for each in (west, diagonal, east)]
    for shape, known in zip(rows.geometry, expected, strict=True):
        assert shape.symmetric_difference(known).area == pytest.approx(0.0, abs=1e-6)
    drive = [1 - mu / math.tan(math.radians(40)) for mu in (0.25, 0.3, 0.3)]
    assert rows["susceptibility_mean"].to_numpy() == pytest.approx(drive, abs=3e-5)
    assert rows["susceptibility_max"].to_numpy() == pytest.approx(drive, abs=3e-5)
    assert rows["slope_mean_deg"].to_numpy() == pytest.approx(40.0, abs=1e-5)

    values = np.full((NY, NX), 2.0)
    values[20:60, 20:50] = 0.25
    values[28:40, 28:36] = 2.0
    raster = write_raster(tmp_path / "mu.tif", values)
    other = Assessed(tmp_path, dem=dem, friction=raster, min_area_m2=10.0)
    assert other.areas.geometry[0].equals(rows.geometry[0])
    # Coarser cells in another place and CRS: resampled to the DEM's cells, nearest value.
    with rasterio.open(raster) as source, WarpedVRT(source, crs="EPSG:4326") as warped:
        profile = warped.profile | {"driver": "GTiff"}
        with rasterio.open(tmp_path / "degrees.tif", "w", **profile) as made:
            made.write(warped.read())
    clipped = write_raster(
        tmp_path / "clip.tif", plane(40.0)[5:95, 5:115], transform=from_origin(EAST + 2.5, NORTH + 47.5, CELL, CELL)
    )
    moved = Assessed(tmp_path, dem=clipped, friction=str(tmp_path / "degrees.tif"), min_area_m2=10.0)
    shared = moved.areas.geometry[0].intersection(rows.geometry[0]).area / rows.geometry[0].area
    assert shared > 0.93  # half a cell of shift along 88 m of edges, of 276 m2


@pytest.mark.parametrize("transform", [None, SOUTH_UP])
def test_windows_make_no_difference(tmp_path, monkeypatch, transform):
    x, y = grid()
    rough = plane(36.0, 20.0) + np.sin(x / 3.0) + np.cos(y / 2.0) * 0.3
    dem = write_raster(tmp_path / "dem.tif", rough, **({"transform": transform} if transform else {}))
    whole = Assessed(tmp_path, dem=dem)
    monkeypatch.setattr(mobilisation_rasters, "BLOCK", 32)
    parts = Assessed(tmp_path, dem=dem)
    # The heights are relative to the window's mean, so rounding may differ in the last digits of a float32.
    for name, tolerance in (("value", 1e-5), ("slope", 1e-4), ("roughness", 1e-5), ("hollow", 1e-5)):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), abs=tolerance, nan_ok=True)
    assert np.isfinite(whole.value).sum() == (NY - 20) * (NX - 20)
    assert parts.profile["transform"] == from_origin(EAST, NORTH + NY * CELL, CELL, CELL)


def test_nodata_spreads_by_half_a_window_and_no_further(tmp_path):
    heights = plane(40.0)
    heights[50, 60] = -9999.0
    found = Assessed(tmp_path, dem=write_raster(tmp_path / "dem.tif", heights))
    known = np.isfinite(found.value)
    assert not known[40:61, 50:71].any()
    assert known[39, 50:71].all()
    assert known[61, 50:71].all()


def test_a_large_dem_is_never_held_whole(tmp_path, monkeypatch):
    """2000 x 2000 cells: one copy as float64 is 32 MB, and the tool may hold no more than half of that."""
    monkeypatch.setattr(mobilisation_rasters, "BLOCK", 128)
    monkeypatch.setattr("deadwood_algorithms.prepare.mobilisation.zones.BLOCK", 256)
    monkeypatch.setattr("deadwood_algorithms.files.dem_windows.BLOCK_CELLS", 2**18)
    heights = (np.arange(2000, dtype="float32") * 0.5)[:, None] * np.ones(2000, "float32")
    dem = write_raster(tmp_path / "dem.tif", heights, dtype="float32", tiled=True)
    del heights
    tracemalloc.start()
    assess_mobilisation.TOOL(
        dem=dem, output=str(tmp_path / "s.tif"), release_areas=str(tmp_path / "a.gpkg"), window_m=5.0
    )
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 16e6
    # 45 degrees everywhere: one area, all but the half window of 2 m at the rim
    assert gpd.read_file(tmp_path / "a.gpkg", layer="release_areas")["area_m2"].tolist() == [996.0**2]


def test_ground_without_heights_is_neither_fitted_nor_stored(tmp_path, monkeypatch):
    """Of 81 windows 4 hold the ground: these are fitted, at the scale of a log and at that of a gully."""
    heights = np.full((576, 576), -9999.0)
    heights[70:170, 200:300] = plane(38.0)[:, :100]
    dem = write_raster(tmp_path / "dem.tif", heights)
    whole = Assessed(tmp_path, dem=dem)
    fitted = []
    real = mobilisation_rasters.relief
    monkeypatch.setattr(mobilisation_rasters, "relief", lambda *given: fitted.append(1) or real(*given))
    monkeypatch.setattr(mobilisation_rasters, "BLOCK", 64)
    parts = Assessed(tmp_path, dem=dem)
    assert len(fitted) == 2 * 4
    assert parts.value == pytest.approx(whole.value, abs=1e-5, nan_ok=True)
    with rasterio.open(tmp_path / "s.tif") as made:
        share = float(made.tags(1)["STATISTICS_VALID_PERCENT"])
    assert share == pytest.approx(100.0 * np.isfinite(whole.value).mean(), rel=1e-6)


def test_areas_are_the_same_whether_the_factors_are_kept_or_not(tmp_path):
    x, y = grid()
    dem = write_raster(tmp_path / "dem.tif", plane(38.0) + 1.5 * np.sin(y / 5.0) + 0.0 * x)
    kept = Assessed(tmp_path, dem=dem).areas
    areas = str(tmp_path / "alone.gpkg")
    assess_mobilisation.TOOL(dem=dem, output=str(tmp_path / "alone.tif"), release_areas=areas)
    alone = gpd.read_file(areas, layer="release_areas")
    assert len(alone) > 1
    assert alone.drop(columns="geometry").equals(kept.drop(columns="geometry"))
    assert alone.geometry.geom_equals_exact(kept.geometry, 0.0).all()


def test_areas_and_weights_feed_sample_releases(tmp_path):
    x, y = grid()
    dem = write_raster(tmp_path / "dem.tif", plane(38.0) + 1.5 * np.sin(y / 5.0) + 0.0 * x)
    found = Assessed(tmp_path, dem=dem)
    releases = tmp_path / "releases.gpkg"
    sample_releases.TOOL(
        areas=str(tmp_path / "areas.gpkg"), weights=str(tmp_path / "s.tif"), dem=dem, count=50, output=str(releases)
    )
    logs = gpd.read_file(releases, layer="releases")
    assert set(logs["release_id"]) == set(found.areas["release_id"])
    assert len(found.areas) > 1
    shapes = dict(zip(found.areas["release_id"], found.areas.geometry, strict=True))
    assert all(
        shapes[name].buffer(1e-6).covers(place) for name, place in zip(logs["release_id"], logs.geometry, strict=True)
    )


def test_what_is_assumed_is_said(tmp_path):
    dem = write_raster(tmp_path / "dem.tif", plane(38.0))
    done = assess_mobilisation.TOOL(dem=dem, friction=0.3, window_m=8.0, output=str(tmp_path / "s.tif"))
    assert done.lines[-1] == (
        "assumed: friction 0.3; steepness from 30 to 35 degrees; no start at a roughness of 1 m; both in a window of "
        "8 m; the numbers rank the ground and are not a probability"
    )


def test_ground_that_is_not_susceptible_gives_an_empty_layer(tmp_path):
    found = Assessed(tmp_path, dem=write_raster(tmp_path / "dem.tif", plane(20.0)))
    assert found.areas.empty
    assert "susceptibility_mean" in found.areas.columns
    assert found.outcome.facts["areas"] == 0


def test_only_requested_outputs_stay(tmp_path):
    dem = write_raster(tmp_path / "dem.tif", plane(40.0))
    assess_mobilisation.TOOL(dem=dem, output=str(tmp_path / "s.tif"))
    assert sorted(each.name for each in tmp_path.iterdir()) == ["dem.tif", "s.qml", "s.tif"]
    assert 'value="0.8"' in (tmp_path / "s.qml").read_text(encoding="utf-8")


# --- mapped deadwood


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("II", "possible"), ("3", "possible"), ("stage iii", "possible"), ("late II", "critical"),
        ("early 3", "critical"), ("Early  III", "critical"), ("early II", "outside"), ("late III", "outside"),
        ("I", "outside"), ("late I", "outside"), ("IV", "outside"), ("5", "outside"), ("2.5", "critical"),
        ("3,4", "critical"), ("3.5", "outside"), ("2.4", "outside"), ("VI", None), ("0", None), ("late 2.5", None),
        ("rotten", None), ("", None),
    ],
)  # fmt: skip
def test_stages_of_decay(word, expected):
    assert decay.of_stage(word) == expected


@pytest.mark.parametrize(
    ("species", "years", "expected"),
    [
        ("Picea abies", 2.0, "critical"), ("Fichte", 5.0, "critical"), ("spruce", 5.1, "outside"),
        ("spruce", 1.9, "outside"), ("", 3.0, "critical"), ("Abies alba", 3.0, "critical"),
        # 2 to 5 years times 0.033 / 0.054: 1.22 to 3.06
        ("Fagus sylvatica", 1.3, "critical"), ("Buche", 1.2, "outside"), ("beech", 3.0, "critical"),
        ("Hêtre", 3.1, "outside"),
        # times 0.033 / 0.032: 2.06 to 5.16
        ("Pinus sylvestris", 5.1, "critical"), ("Waldföhre", 2.05, "outside"), ("pin", 2.1, "critical"),
    ],
)  # fmt: skip
def test_years_since_death(species, years, expected):
    assert decay.of_years(years, species, (2.0, 5.0)) == expected


def test_mapped_deadwood_is_split_by_decay_and_ground(tmp_path, said):
    x, y = grid()
    steep = np.where(y < 25.0, 20.0, 40.0) + 0.0 * x
    heights = 1000.0 + np.cumsum(np.tan(np.radians(steep)) * CELL, axis=0)
    dem = write_raster(tmp_path / "dem.tif", heights)
    shapes = [Point(30.0, 40.0)] * 6 + [Point(30.0, 10.0)] * 2 + [Point(1.0, 1.0), Point(90.0, 40.0)]
    logs = write_layer(
        tmp_path / "logs.gpkg", shapes, tree_id=list("abcdefghij"), dbh_cm=[40.0] * 10,
        decay_stage=["late II", "2", "I", None, None, None, "early III", "IV", "2", "2"],
        years_dead=[9.0, None, 3.0, 3.0, 9.0, None, None, None, None, None],
        species=["spruce"] * 4 + ["larch", None, None, None, None, None],
    )  # fmt: skip
    found = Assessed(tmp_path, said, dem=dem, deadwood=logs)
    good, others = found.logs("candidates"), found.logs("others")
    assert dict(zip(good["tree_id"], good["decay"], strict=True)) == {
        "a": "critical", "b": "possible", "d": "critical", "f": "unknown",
    }  # fmt: skip
    assert dict(zip(others["tree_id"], others["reason"], strict=True)) == {
        "c": "decay", "e": "decay", "g": "ground", "h": "decay and ground", "i": "off_dem", "j": "off_dem",
    }  # fmt: skip
    expected = 1 - 0.25 / math.tan(math.radians(40.0))
    assert good["susceptibility"].to_numpy() == pytest.approx(expected, abs=1e-4)
    assert good["slope_deg"].to_numpy() == pytest.approx(40.0, abs=1e-3)
    assert good["gully"].tolist() == [0, 0, 0, 0]
    assert good["dbh_cm"].tolist() == [40.0] * 4
    assert found.areas["n_candidates"].tolist() == [4]
    assert any("larch" in note and "that of spruce is used" in note for note in said.notes)
    assert any("the decay of 1 of 10 points is unknown" in note for note in said.notes)
    releases = str(tmp_path / "releases.gpkg")
    areas = f"{tmp_path / 'deadwood.gpkg'}|layername=candidates"
    sample_releases.TOOL(areas=areas, dem=dem, count=5, radius_m=4.0, output=releases)
    drawn = gpd.read_file(releases, layer="releases")
    assert len(drawn) == 20
    assert drawn["dbh_cm"].unique().tolist() == [40.0]


def test_what_is_not_known_of_a_species_is_reported(tmp_path, said):
    """The decay of beech snags is unknown: they are candidates; unknown species and those without rate are reported."""
    dem = write_raster(tmp_path / "dem.tif", plane(40.0))
    logs = write_layer(
        tmp_path / "logs.gpkg", [Point(30.0, 25.0)] * 5, years_dead=[9.0] * 5,
        species=["Buche", "Buche", "Buche", "sapin", "Mammutbaum"], standing=[1, 0, None, 1, 1],
    )  # fmt: skip
    found = Assessed(tmp_path, said, dem=dem, deadwood=logs)
    assert found.logs("candidates")["decay"].tolist() == ["unknown"]
    assert len(found.logs("others")) == 4
    told = " ".join(said.notes)
    assert "Mammutbaum: unknown species; the years of spruce are used" in told
    assert "no rate of decay is known for sapin; that of spruce is used" in told
    assert "1 snag is not of spruce" in told
    assert "1 point not of spruce is rated by rates of decay of downed wood" in told


def test_fields_of_other_names_and_numbers_as_stages(tmp_path):
    dem = write_raster(tmp_path / "dem.tif", plane(40.0))
    logs = write_layer(
        tmp_path / "logs.gpkg",
        [Point(30.0, 25.0)] * 3,
        class_=[3.0, 2.75, 1.0],
        dead=[9.0, 9.0, 3.0],
        art=["Buche"] * 3,
    )
    found = Assessed(tmp_path, dem=dem, deadwood=logs, stage_field="class_")
    assert found.logs("candidates")["decay"].tolist() == ["possible", "critical"]
    values = {"years_field": "dead", "species_field": "art", "years_from": 4.0, "years_to": 5.0}
    found = Assessed(tmp_path, dem=dem, deadwood=logs, **values)
    # beech: 2.4 to 3.1 years
    assert found.logs("candidates")["dead"].tolist() == [3.0]


# --- errors


def points(folder: Path, **columns) -> str:
    return write_layer(folder / "logs.gpkg", [Point(30.0, 25.0)], **columns)


BAD = {
    "slopes": (lambda _: {"slope_none_deg": 40.0}, "--slope-none-deg 40 is above --slope-full-deg 35"),
    "years": (lambda _: {"years_to": 1.0}, "--years-from 2 is above --years-to 1"),
    "nothing to judge": (lambda f: {"assessed": str(f / "x.gpkg")}, "--assessed needs --deadwood"),
    "no judgement": (lambda f: {"deadwood": points(f)}, "--deadwood needs --assessed"),
    "a stage": (
        lambda f: {"deadwood": points(f, decay_stage=["rotten"]), "assessed": str(f / "x.gpkg")},
        "logs.gpkg, layer 'logs', field 'decay_stage', row 1: 'rotten' is not a stage of decay",
    ),
    "years of text": (
        lambda f: {"deadwood": points(f, years_dead=[-1.0]), "assessed": str(f / "x.gpkg")},
        "field 'years_dead', row 1: -1 is not a number at least 0",
    ),
    "a field": (
        lambda f: {"deadwood": points(f, a=[1]), "assessed": str(f / "x.gpkg"), "stage_field": "b"},
        "there is no field 'b' (--stage-field); it has the fields a",
    ),
    "another country": (
        lambda f: {"deadwood": write_layer(f / "l.gpkg", [Point(9e5, 0)]), "assessed": str(f / "x.gpkg")},
        "no point lies on the DEM",
    ),
    "friction that ends": (
        lambda f: {"friction": write_layer(f / "mu.gpkg", [box(0, 0, 30, 60)], mu=[0.3])},
        "the friction does not cover the DEM",
    ),
    "negative friction": (
        lambda f: {"friction": write_raster(f / "mu.tif", np.full((NY, NX), -0.1))},
        "mu.tif: the friction coefficient is -0.1 somewhere",
    ),
    "friction without field": (
        lambda f: {"friction": write_layer(f / "mu.gpkg", [box(0, 0, 90, 90)], m=[0.3])},
        "need a field 'friction' or 'mu'; rename the one that holds it",
    ),
    "a window too large": (lambda _: {"window_m": 70.0}, "no cell has a whole window of 70 m around it"),
    "a threshold": (lambda _: {"threshold": 0.0}, "--threshold is 0, but must be greater than 0"),
    "a name": (lambda f: {"release_areas": str(f / "areas.shp")}, "the output must be a .gpkg file"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_reported_in_one_line_and_leaves_nothing(tmp_path, name):
    make, said_of_it = BAD[name]
    dem = write_raster(tmp_path / "dem.tif", plane(40.0))
    values = {"dem": dem, "output": str(tmp_path / "s.tif")} | make(tmp_path)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(UserError) as raised:
        assess_mobilisation.TOOL(**values)
    assert said_of_it in str(raised.value)
    assert "\n" not in str(raised.value)
    assert sorted(tmp_path.iterdir()) == before


def test_a_window_of_less_than_three_cells_is_widened_with_a_warning(tmp_path, said):
    dem = write_raster(tmp_path / "dem.tif", plane(40.0)[::10, ::10], cell=5.0)
    found = Assessed(tmp_path, said, dem=dem, window_m=5.0)
    assert "--window-m 5 is too small for cells of 5 m; 15 m is taken" in said.warnings[0]
    assert np.isfinite(found.value).sum() == 8 * 10


def test_the_worked_example_runs(tmp_path):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    text = assess_mobilisation.TOOL.description.replace("\\\n", " ")
    lines = [shlex.split(line)[1:] for line in text.splitlines() if line.startswith("    deadwood-tool ")]
    assert len(lines) == 3
    for words in lines:
        command = [sys.executable, "-m", "deadwood_toolbox", *words]
        ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stderr
    assert len(gpd.read_file(tmp_path / "releases.gpkg", layer="releases")) > 100
    # Of the twelve mapped ones: in the window of decay, and on the steep slope.
    judged = gpd.read_file(tmp_path / "deadwood.gpkg", layer="candidates")
    assert judged["deadwood_id"].tolist() == [1, 2, 4, 5]
    assert len(gpd.read_file(tmp_path / "releases_mapped.gpkg", layer="releases")) == 200
