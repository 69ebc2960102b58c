"""What is doubted about terrain models, on made ground of which the truth is known, and on the sample's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio.enums import ColorInterp
from rasterio.transform import from_origin
from remedied import carry_out
from scipy.io import netcdf_file

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.intake import names, terrain
from deadwood_algorithms.params.messages import Hearing
from deadwood_algorithms.params.tool import Quiet, UserError

E, N, NX, NY = 2_700_000.0, 1_200_000.0, 160, 240
SAMPLE = Path(__file__).parents[3] / "sample_data" / "dem.tif"
X, Y = np.meshgrid(np.arange(NX) + 0.5, np.arange(NY)[::-1] + 0.5)
GROUND = 800.0 + np.maximum(Y - 60.0, 0.0) * np.tan(np.radians(35.0)) + 0.3 * np.sin(X / 6) * np.cos(Y / 7)
SLOPE = np.degrees(np.arctan(np.hypot(*np.gradient(GROUND))))
ASPECT = np.degrees(np.arctan2(*np.gradient(GROUND)[::-1])) % 360.0


def write(path: Path, *bands: np.ndarray, kinds: tuple[str, ...] = (), **more: Any) -> str:
    change = more.pop("change", None)
    profile = {"driver": "GTiff", "width": NX, "height": NY, "count": len(bands), "dtype": "float32"} | more
    with rasterio.open(path, "w", crs="EPSG:2056", transform=from_origin(E, N + NY, 1.0, 1.0), **profile) as made:
        for number, values in enumerate(bands, start=1):
            made.write(values.astype(profile["dtype"]), number)
            if kinds:
                made.set_band_description(number, kinds[number - 1])
        if change:
            change(made)
    return str(path)


def doubts(path: str) -> dict[str, dict[str, float | None]]:
    """Codes and numbers of what is said about a terrain model."""
    hearing = Hearing(Quiet())
    read_dem(path, feedback=hearing)
    return {each.code: dict(each.numbers) for each in hearing.messages if each.level == "warning"}


def with_trees(per_ha: float, seed: int = 1) -> np.ndarray:
    """A surface: cones of 12 to 25 m on the ground."""
    draw = np.random.default_rng(seed)
    surface = GROUND.copy()
    for _ in range(round(per_ha * NX * NY / 1e4)):
        x, y, height = draw.uniform(5, 155), draw.uniform(5, 235), draw.uniform(12, 25)
        top = GROUND[int(NY - y), int(x)] + height
        surface = np.maximum(surface, np.where(np.hypot(X - x, Y - y) < 2.5, top - 3 * np.hypot(X - x, Y - y), -1e9))
    return surface


@pytest.mark.parametrize("per_ha", [10, 39, 120, 390])
def test_a_surface_model_is_doubted_by_its_crowns(tmp_path, per_ha):
    found = doubts(write(tmp_path / "dsm.tif", with_trees(per_ha)))
    assert (found["surface-model"]["tops_per_ha"] or 0.0) > 0.3 * min(per_ha, 60)


def test_ground_with_a_cliff_and_boulders_is_not_doubted(tmp_path):
    ground = GROUND + np.where(Y > 150, 8.0, 0.0) + np.where(np.hypot(X - 80, Y - 30) < 2.0, 2.5, 0.0)
    assert doubts(write(tmp_path / "dem.tif", ground)) == {}
    assert doubts(str(SAMPLE)) == {}


def test_rough_ground_is_not_taken_for_crowns():
    """Noise of half a metre, and 40 made slopes up to 60 degrees: no top."""
    draw = np.random.default_rng(5)
    for slope in range(20, 60):
        ground = np.tan(np.radians(slope)) * Y + draw.normal(0.0, 0.5, Y.shape) + 8.0 * (Y > 150)
        assert terrain.crowns(terrain.Terrain([ground], 1.0)) is None


@pytest.mark.parametrize("kind", ["slope", "Hangneigung [°]", "aspect", "hillshade"])
def test_a_band_named_as_something_else_is_refused(tmp_path, kind):
    with pytest.raises(UserError):
        read_dem(write(tmp_path / "a.tif", SLOPE, kinds=(kind,)))


def test_slopes_without_a_name_are_doubted(tmp_path):
    assert "not-heights" in doubts(write(tmp_path / "a.tif", SLOPE))
    with rasterio.open(SAMPLE) as source:
        heights = source.read(1).astype(float) * source.scales[0] + source.offsets[0]
    down, right = np.gradient(heights, 0.5)
    for values in (np.degrees(np.arctan(np.hypot(down, right))), np.degrees(np.arctan2(down, right)) % 360.0):
        assert terrain.no_heights(terrain.Terrain([values], 0.5)) is not None
    assert terrain.no_heights(terrain.Terrain([heights - heights.min()], 0.5)) is None
    assert terrain.no_heights(terrain.Terrain([0.2 * (GROUND - GROUND.min())], 1.0)) is None  # low ground


@pytest.mark.parametrize(("name", "kind"), [("dem_ft.tif", ""), ("DEM10m_Feet.tif", ""), ("a.tif", "elevation [ft]")])
def test_a_name_that_says_feet_is_doubted_where_no_slope_does(tmp_path, name, kind):
    """A slope of 15 degrees is one of 41 in feet, which much ground has; the remedy that is printed undoes it."""
    ground = 800.0 + Y * np.tan(np.radians(15.0))
    path = write(tmp_path / name, ground / 0.3048, kinds=(kind,))
    hearing = Hearing(Quiet())
    read_dem(path, feedback=hearing)
    (doubt,) = [each for each in hearing.messages if each.level == "warning"]
    assert doubt.code == "named-in-feet"
    made = carry_out(doubt.text.split("fix: ")[1], tmp_path)
    assert np.allclose(read_dem(made).values[::-1], ground, atol=1e-3)
    assert doubts(str(made)) == {}
    assert doubts(write(tmp_path / "left_shift.tif", ground)) == {}


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("called", ["elevation", "DTM_1m", "Geländehöhe", "mnt"])
def test_the_band_of_the_heights_is_found_by_its_name(tmp_path, order, called):
    bands, kinds = (SLOPE, ASPECT, GROUND), ("slope", "aspect", called)
    path = write(tmp_path / "a.tif", *(bands[k] for k in order), kinds=tuple(kinds[k] for k in order))
    assert np.allclose(read_dem(path).values[::-1], GROUND, atol=1e-3)


def test_names_are_read_as_words():
    assert names.chosen(["slopeDegrees", "dtm_1m"], "DEM") == 1
    assert names.chosen(["dsm height", "dtm height"], "DEM") == 1
    assert names.chosen(["dsm height", "dtm height"], "surface") == 0
    assert names.chosen(["height", "elevation"], "DEM") == 1  # the more specific one
    assert names.chosen(["height", "z"], "DEM") is None
    assert names.chosen(["a", "b"], "DEM") is None


def test_an_opacity_band_of_floats_is_a_mask(tmp_path):
    alpha = np.where(Y > 200, 0.0, 1.0)

    def of_alpha(made: Any) -> None:
        made.colorinterp = (ColorInterp.gray, ColorInterp.alpha)

    path = write(tmp_path / "a.tif", np.where(Y > 200, 0.0, GROUND), alpha, change=of_alpha)
    heights = read_dem(path).values[::-1]
    assert np.array_equal(np.isnan(heights), Y > 200)
    assert np.nanmin(heights) > 799.0


def test_undeclared_zeros_on_low_ground_are_doubted(tmp_path):
    low = 0.3 * (GROUND - GROUND.min()) + 20.0
    corner = X + Y < 60
    found = doubts(write(tmp_path / "low.tif", np.where(corner, 0.0, low)))
    assert found["undeclared-nodata"]["cells"] == corner.sum()
    assert "undeclared-nodata" not in doubts(write(tmp_path / "sea.tif", np.maximum(low - 25.0, 0.0)))  # a shore


def netcdf(path: Path, **variables: np.ndarray) -> str:
    """A NetCDF of packed whole numbers, one variable each."""
    with netcdf_file(path, "w") as made:
        made.createDimension("y", NY)
        made.createDimension("x", NX)
        for axis, at in (("x", E + np.arange(NX) + 0.5), ("y", N + NY - np.arange(NY) - 0.5)):
            along = made.createVariable(axis, "f8", (axis,))
            along[:], along.standard_name, along.units = at, f"projection_{axis}_coordinate", "m"
        for name, values in variables.items():
            each = made.createVariable(name, "i2", ("y", "x"))
            each.scale_factor, each.add_offset = 0.01, 900.0
            each[:] = np.rint((values - 900.0) / 0.01).astype("i2")
    return str(path)


def test_a_variable_is_written_out_in_metres(tmp_path):
    """Neither variable is named as a height: the command of the message unpacks the one that may be one."""
    path = netcdf(tmp_path / "a.nc", slope=SLOPE + 900.0, band=GROUND)
    with pytest.raises(UserError) as refused:
        read_dem(path, crs="EPSG:2056")
    made = carry_out(str(refused.value).split("out: ")[1], tmp_path)
    assert np.allclose(read_dem(made, crs="EPSG:2056").values[::-1], GROUND, atol=0.01)


def test_the_variable_of_the_heights_is_found_by_its_name(tmp_path):
    path = netcdf(tmp_path / "a.nc", slope=SLOPE + 900.0, elevation=GROUND)
    assert np.allclose(read_dem(path, crs="EPSG:2056").values[::-1], GROUND, atol=0.01)


def with_crowns(cell: float, radius: float, *, flat: bool, per_ha: float = 60.0) -> np.ndarray:
    """A surface with broad crowns: a dome or a disk, with an edge that falls to the ground."""
    draw = np.random.default_rng(3)
    x, y = np.meshgrid((np.arange(round(NX / cell)) + 0.5) * cell, (np.arange(round(NY / cell))[::-1] + 0.5) * cell)
    ground = 800.0 + np.maximum(y - 60.0, 0.0) * np.tan(np.radians(35.0))
    surface = ground.copy()
    for _ in range(round(per_ha * NX * NY / 1e4)):
        at_x, at_y, height = draw.uniform(5, 155), draw.uniform(5, 235), draw.uniform(12, 25)
        top = 800.0 + max(at_y - 60.0, 0.0) * np.tan(np.radians(35.0)) + height
        apart = np.hypot(x - at_x, y - at_y)
        crown = np.full_like(apart, top) if flat else top - 0.5 * apart**2 / radius
        surface = np.maximum(surface, np.where(apart < radius, crown, -1e9))
    return surface


@pytest.mark.parametrize("cell", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("radius", "flat"), [(3.5, False), (5.0, False), (4.0, True)])
def test_broad_crowns_have_no_tops_but_walls(cell, radius, flat):
    """Nothing stands above all of a ring of 4 m around such a crown; before, they were taken for ground."""
    surface = with_crowns(cell, radius, flat=flat)
    assert terrain.crowns(terrain.Terrain([surface], cell)) is not None
    bare = with_crowns(cell, radius, flat=flat, per_ha=0.0)
    assert terrain.crowns(terrain.Terrain([bare + np.where(bare > 850.0, 8.0, 0.0)], cell)) is None


def test_roofs_are_walls_on_all_sides_and_one_wall_a_dam_and_a_gorge_are_not():
    level = np.full((200, 200), 500.0) + 0.1 * np.arange(200.0)
    roofs = level.copy()
    roofs[40:50, 60:72] += 6.0
    roofs[120:131, 90:99] += 5.0
    assert terrain.crowns(terrain.Terrain([roofs], 1.0)) is not None
    wall, dam, gorge = level.copy(), level.copy(), level.copy()
    wall[90:] += 8.0
    dam[90:96, 20:180] += 5.0
    gorge[90:96] -= 15.0
    for ground in (wall, dam, gorge):
        assert terrain.crowns(terrain.Terrain([ground], 1.0)) is None


@pytest.mark.parametrize("slope", [0, 20, 35, 40])
def test_houses_on_a_slope_stand_between_walls_above_its_mean(slope):
    """Uphill the roof stands less than 3 m above the ground at 35 degrees; one wall alone is still none."""
    x, y = np.meshgrid(np.arange(128.0), np.arange(128.0))
    ground = 500.0 + y * np.tan(np.radians(slope)) + 0.05 * x
    roofs = ground.copy()
    for east, north in ((30, 40), (70, 60), (50, 95), (100, 25)):
        over = (np.abs(x - east) < 6) & (np.abs(y - north) < 4)
        roof = 507.4 + 0.05 * east + north * np.tan(np.radians(slope)) - 0.6 * np.abs(y - north)
        roofs = np.where(over, np.maximum(roofs, roof), roofs)
    assert terrain.crowns(terrain.Terrain([roofs], 1.0)) is not None
    for fine in (ground, ground + 8.0 * (y > 60), ground + 5.0 * ((y > 60) & (y < 68)), ground - 9.0 * (x > 70)):
        assert terrain.crowns(terrain.Terrain([fine], 1.0)) is None


@pytest.mark.parametrize("cost", [1.0, 0.37])
@pytest.mark.parametrize("rows", [slice(None), slice(0, 100)])
def test_distances_are_no_heights(cost, rows):
    """Straight ones, and along neighbours of cells as costs are added up, with or without their zeros."""
    x, y = np.meshgrid(np.arange(200.0), np.arange(150.0))
    sources = ((30, 120), (150, 130), (90, 140))
    apart = [(np.abs(x - a), np.abs(y - b)) for a, b in sources]
    straight = np.min([np.hypot(*each) for each in apart], axis=0)
    stepped = np.min([np.maximum(a, b) + (np.sqrt(2.0) - 1.0) * np.minimum(a, b) for a, b in apart], axis=0)
    for distances in (straight, stepped):
        doubt = terrain.no_heights(terrain.Terrain([2.0 * cost * distances[rows]], 2.0))
        assert doubt is not None
        assert doubt.numbers["fall"] == pytest.approx(cost, rel=0.05)


def test_planes_and_valleys_are_no_distances():
    for heights in (Y, Y + 0.4 * X, np.abs(X - 80.0) + 0.3 * Y, np.maximum(Y, 0.8 * X)):
        assert terrain.no_heights(terrain.Terrain([900.0 + heights], 1.0)) is None


TANGENT = np.hypot(*np.gradient(GROUND))
MEASURES = {
    "percent": 100.0 * TANGENT,
    "tangent": TANGENT,
    "radians": np.arctan(TANGENT),
    "aspect": ASPECT,
    "aspect from the south": ASPECT - 180.0,
    "aspect in radians": np.radians(ASPECT),
    "northness": np.cos(np.radians(ASPECT)),
    "curvature": np.gradient(np.gradient(GROUND)[0])[0],
    "hillshade": 180.0 * np.cos(np.arctan(TANGENT)) * (1.0 + 0.5 * np.cos(np.radians(315.0 - ASPECT)) * TANGENT),
}


@pytest.mark.parametrize("measure", MEASURES)
def test_a_measure_of_the_relief_without_a_name_is_doubted(measure):
    """On smooth ground, where slopes change as slowly as heights; only degrees were doubted before."""
    assert terrain.no_heights(terrain.Terrain([MEASURES[measure]], 1.0)) is not None


def test_low_ground_is_not_taken_for_a_measure():
    for times, lowest in ((0.3, 0.0), (0.1, -3.0), (0.02, 0.5), (1.0, 5.0)):
        assert terrain.no_heights(terrain.Terrain([times * (GROUND - 800.0) + lowest], 1.0)) is None


def test_numbers_that_are_no_heights_are_said_to_be_nothing_else(tmp_path):
    """Not also a surface model, steep, or with steps."""
    assert set(doubts(write(tmp_path / "a.tif", np.rint(MEASURES["percent"])))) == {"not-heights"}
