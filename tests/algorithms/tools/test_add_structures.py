"""add-structures, through its files: the volumes of trapezoids and cones, and a DEM that is otherwise unchanged."""

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
from scipy.integrate import quad
from shapely import LineString, MultiLineString

from deadwood_algorithms.files import dem_windows
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import add_structures

ROOT = Path(__file__).parents[3]
EAST, NORTH, CELL, NX, NY = 2_786_000.0, 1_196_000.0, 0.5, 240, 200
SOUTH_UP = Affine(CELL, 0.0, EAST, 0.0, CELL, NORTH)


def write_dem(path: Path, gradient=(0.0, 0.0), cell: float = CELL, values: np.ndarray | None = None, **profile) -> str:
    """A plane of 120 x 100 m, 1000 m high at the corner; gradient to the east and north."""
    nx, ny = round(NX * CELL / cell), round(NY * CELL / cell)
    x, y = (np.arange(nx) + 0.5) * cell, (np.arange(ny)[::-1, None] + 0.5) * cell
    heights = 1000.0 + gradient[0] * x + gradient[1] * y if values is None else values
    facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "nodata": -9999, "crs": "EPSG:2056"}
    facts |= {"transform": from_origin(EAST, NORTH + ny * cell, cell, cell)}
    with rasterio.open(path, "w", height=ny, width=nx, **(facts | profile)) as made:
        made.write(np.asarray(heights).astype(made.dtypes[0]), 1)
    return str(path)


def write_lines(path: Path, shapes, crs: str | None = "EPSG:2056", **columns) -> str:
    moved = [shapely.transform(s, lambda p: p + [EAST, NORTH, 0.0][: p.shape[1]], include_z=s.has_z) for s in shapes]
    gpd.GeoDataFrame(columns, geometry=moved, crs=crs).to_file(path, layer=path.stem, driver="GPKG")
    return str(path)


class Built:
    """The output of a run of the tool on a DEM; heights with row 0 south."""

    def __init__(self, folder: Path, said=None, **values) -> None:
        self.path, self.table = folder / "built.tif", folder / "earthworks.gpkg"
        values = {"output": str(self.path), "earthworks": str(self.table), "overwrite": True} | values
        self.outcome = add_structures.TOOL(add_structures.TOOL.ask_from(values), said)
        with rasterio.open(values["dem"]) as old, rasterio.open(self.path) as new:
            self.old, self.new = old.read(1)[::-1], new.read(1)[::-1]
            self.cell = abs(new.transform.a)
        self.rows = gpd.read_file(self.table)
        self.fill, self.cut = (self.outcome.facts[name] for name in ("fill_m3", "cut_m3"))

    def area_of_change(self) -> float:
        return float((self.moved != 0).sum()) * self.cell**2

    @property
    def moved(self) -> np.ndarray:
        return self.new.astype(float) - self.old


def slope(degrees: float) -> float:
    return math.tan(math.radians(degrees))


def level_volume(line, width: float, height: float, fall: float) -> float:
    """On level ground, the section at each height is the line's buffer: an integral over heights, by shapely."""
    return quad(lambda z: shapely.buffer(line, width / 2 + (height - z) / fall, quad_segs=200).area, 0, height)[0]


def sampling_error(line, width: float, height: float, fall: float, cell: float) -> float:
    """Bound of the volume's error [m3]: cells are counted by their centres, and only those on an edge count wrong.

    The height bends by ``fall`` along the crest's edges and the foot: a cell there errs by at most fall * cell^3 / 4.
    """
    edges = sum(shapely.buffer(line, r).length for r in (width / 2, width / 2 + height / fall))
    return edges / cell * fall * cell**3 / 4


STRAIGHT = LineString([(30.0, 40.0), (85.0, 57.0)])


def test_a_dam_on_level_ground_is_a_trapezoid_with_half_a_cone_at_each_end(tmp_path):
    dem = write_dem(tmp_path / "dem.tif")
    lines = write_lines(tmp_path / "lines.gpkg", [STRAIGHT])
    built = Built(tmp_path, dem=dem, structures=lines, height_m=3.0, crest_width_m=2.0, slope_deg=40.0)
    foot = 1.0 + 3.0 / slope(40)
    trapezoid = (1.0 + foot) * 3.0 * STRAIGHT.length
    cone = math.pi * 3.0 / 3 * (1.0 + foot + foot**2)
    assert level_volume(STRAIGHT, 2.0, 3.0, slope(40)) == pytest.approx(trapezoid + cone, rel=1e-4)
    assert built.fill == pytest.approx(trapezoid + cone, abs=sampling_error(STRAIGHT, 2.0, 3.0, slope(40), CELL))
    assert built.cut == 0.0
    assert built.moved.sum() * CELL**2 == pytest.approx(built.fill, rel=1e-12)
    assert built.moved.max() == pytest.approx(3.0, abs=1e-9)


def test_the_volume_converges_to_the_true_one_with_the_cells(tmp_path):
    lines = write_lines(tmp_path / "lines.gpkg", [STRAIGHT])
    true = level_volume(STRAIGHT, 2.0, 3.0, 1.0)
    error = []
    for cell in (2.0, 1.0, 0.5, 0.25):
        dem = write_dem(tmp_path / f"{cell}.tif", cell=cell)
        built = Built(tmp_path, dem=dem, structures=lines, height_m=3.0)
        error.append(abs(built.fill / true - 1))
        assert error[-1] * true < sampling_error(STRAIGHT, 2.0, 3.0, 1.0, cell)
    assert error[-1] < 2e-4


@pytest.mark.parametrize("gradient", [(0.0, 0.6), (0.3, -0.4)])
@pytest.mark.parametrize("kind", ["embankment", "ditch"])
def test_across_a_slope_the_section_is_that_of_the_drawing_board(tmp_path, gradient, kind):
    """Two lengths of one dam along a contour: their ends are equal, so the difference is the section times 10 m."""
    dem = write_dem(tmp_path / "dem.tif", gradient)
    g = math.hypot(*gradient)
    contour = np.array([-gradient[1], gradient[0]]) / g  # the slope rises on its right
    start = np.array([60.0, 50.0]) - 15 * contour
    volumes = []
    for length in (20.0, 30.0):
        line = LineString([start, start + length * contour])
        lines = write_lines(tmp_path / f"{length}.gpkg", [line], slope_left_deg=[55.0], slope_right_deg=[70.0])
        built = Built(tmp_path, dem=dem, structures=lines, kind=kind, height_m=2.5, crest_width_m=3.0)
        volumes.append(built.fill if kind == "embankment" else built.cut)
        assert built.rows["kind"].tolist() == [kind]
        assert built.rows["height_min_m"][0] == pytest.approx(2.5, abs=1e-6)
        assert built.rows["height_max_m"][0] == pytest.approx(2.5, abs=1e-6)
    up, down = (slope(70), slope(55)) if kind == "embankment" else (slope(55), slope(70))
    if kind == "ditch":  # inverted, the ground falls where it rose: left and right are exchanged
        up, down = slope(55), slope(70)
    section = 2.5 * 3.0 + 0.5 * (2.5 - 1.5 * g) ** 2 / (up + g) + 0.5 * (2.5 + 1.5 * g) ** 2 / (down - g)
    # Edges at an angle to the cells average over all positions: four edges of 10 m, as in `sampling_error`.
    allowed = 4 * 10.0 / CELL * slope(70) * CELL**3 / 4 if gradient[0] else 4 * 10.0 * slope(70) * CELL**2 / 8
    assert volumes[1] - volumes[0] == pytest.approx(10.0 * section, abs=allowed)


def test_left_and_right_are_those_of_the_line(tmp_path):
    dem = write_dem(tmp_path / "dem.tif")
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(20.25, 50.25), (100.25, 50.25)])])
    built = Built(
        tmp_path, dem=dem, structures=lines, height_m=4.0, crest_width_m=2.0, slope_left_deg=90.0, slope_right_deg=30.0
    )
    across = built.moved[:, 120]  # the line runs through the centres of row 100
    assert across[98:103] == pytest.approx(4.0)
    assert across[103:] == pytest.approx(0.0)  # the north side, on the left, is vertical
    assert across[90] == pytest.approx(4.0 - (5.0 - 1.0) * slope(30))
    # Around the end the slope changes evenly from one side to the other: straight ahead it is the mean of both.
    built = Built(
        tmp_path, dem=dem, structures=lines, height_m=4.0, crest_width_m=2.0, slope_left_deg=60.0, slope_right_deg=30.0
    )
    assert built.moved[100, 204] == pytest.approx(4.0 - (2.0 - 1.0) * (slope(60) + slope(30)) / 2, abs=1e-9)
    assert built.moved[100, 36] == pytest.approx(built.moved[100, 204], abs=1e-9)
    assert built.moved[98, 203] > built.moved[102, 203] > 0


def test_a_ditch_is_a_dam_upside_down(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", (0.2, 0.1))
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(30, 30), (60, 70), (90, 40)])])
    shared = {"height_m": 2.0, "crest_width_m": 1.5, "slope_deg": 50.0}
    dam = Built(tmp_path, dem=write_dem(tmp_path / "turned.tif", (-0.2, -0.1)), structures=lines, **shared)
    ditch = Built(tmp_path, dem=dem, structures=lines, kind="ditch", **shared)
    assert ditch.moved == pytest.approx(-dam.moved, abs=1e-9)
    assert (ditch.cut, ditch.fill) == (pytest.approx(dam.fill, rel=1e-12), 0.0)


@pytest.mark.parametrize(
    "line",
    [
        LineString([(30, 30), (60, 30), (60, 60)]),
        LineString([(30, 30), (60, 60), (60, 55), (90, 40), (70, 35)]),
        LineString([(40, 40), (80, 40), (70, 70), (40, 40)]),
        MultiLineString([[(30, 30), (50, 40)], [(48, 42), (90, 70)]]),
        LineString([(30, 30), (30, 30), (60, 50), (60, 50), (30, 30)]),
    ],
    ids=["corner", "zigzag", "ring", "parts", "there and back"],
)
def test_turns_rings_and_parts_are_united(tmp_path, line):
    dem = write_dem(tmp_path / "dem.tif")
    lines = write_lines(tmp_path / "lines.gpkg", [line])
    built = Built(tmp_path, dem=dem, structures=lines, height_m=3.0, crest_width_m=2.0, slope_deg=45.0)
    bound = sampling_error(line, 2.0, 3.0, 1.0, CELL)
    assert built.fill == pytest.approx(level_volume(line, 2.0, 3.0, 1.0), abs=bound)


def test_the_outside_of_a_turn_has_the_slope_of_its_side(tmp_path):
    dem = write_dem(tmp_path / "dem.tif")
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(30.25, 40.25), (70.25, 40.25), (70.25, 80.25)])])
    shared = {"height_m": 6.0, "crest_width_m": 0.0, "dem": dem, "structures": lines}
    built = Built(tmp_path, slope_left_deg=25.0, slope_right_deg=60.0, **shared)
    # Outside: 2 m east and 1.5 m south of the corner, 2.5 m away, on the right of both legs.
    assert built.moved[77, 144] == pytest.approx(6.0 - 2.5 * slope(60), abs=1e-9)
    # Inside: the nearer leg counts, 3 m away, on the left.
    assert built.moved[86, 130] == pytest.approx(6.0 - 3.0 * slope(25), abs=1e-9)


def test_heights_elevations_and_z_give_the_same_dam(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", (0.1, 0.05))
    ends = [(30.0, 40.0), (80.0, 55.0)]
    grade = [(x, y, 1003.0 + 0.1 * x + 0.05 * y) for x, y in ends]
    by_height = Built(tmp_path, dem=dem, structures=write_lines(tmp_path / "a.gpkg", [LineString(ends)]), height_m=3.0)
    by_z = Built(
        tmp_path, dem=dem, structures=write_lines(tmp_path / "b.gpkg", [LineString(grade)]), elevation_from_z=True
    )
    assert by_z.new == pytest.approx(by_height.new, abs=1e-6)
    level = Built(tmp_path, dem=dem, structures=str(tmp_path / "a.gpkg"), elevation_m=1011.0, height_m=99.0)
    ground = 1000 + 0.1 * 30 + 0.05 * 40
    assert level.rows["height_max_m"][0] == pytest.approx(1011.0 - ground, abs=1e-6)
    changed = level.moved > 0
    assert level.new[changed].max() == pytest.approx(1011.0)


def test_columns_go_before_options_and_gaps_take_them(tmp_path):
    shapes = [LineString([(20, 20 * k), (100, 20 * k)]) for k in (1, 2, 3, 4)]
    lines = write_lines(
        tmp_path / "lines.gpkg",
        shapes,
        structure_id=["a", "b", "c", "d"],
        kind=["ditch", None, "Embankment", "embankment"],
        height_m=[1.0, None, 3.0, None],
        elevation_m=[None, None, None, 1004.0],
        slope_deg=[80.0, None, 60.0, None],
        slope_left_deg=[None, None, 90.0, None],
    )
    built = Built(tmp_path, dem=write_dem(tmp_path / "dem.tif"), structures=lines, height_m=2.0, slope_right_deg=70.0)
    rows = built.rows.set_index("structure_id")
    assert rows["kind"].tolist() == ["ditch", "embankment", "embankment", "embankment"]
    assert rows["height_max_m"].to_numpy() == pytest.approx([1.0, 2.0, 3.0, 4.0], abs=1e-6)
    assert (rows["fill_m3"] > 0).tolist() == [False, True, True, True]
    column = built.moved[:, 120]
    expected = {
        "a": (-1.0 + (1.25 - 1) * slope(80), -1.0 + (1.25 - 1) * slope(80)),
        "b": (2.0 - 0.25 * slope(70), 2.0 - 0.25 * 1.0),
        "c": (3.0 - 0.25 * slope(60), 0.0),
        "d": (4.0 - 0.25 * slope(70), 4.0 - 0.25),
    }
    for k, (south, north) in enumerate(expected.values()):
        row = 40 * (k + 1)  # its centre is 0.25 m north of the line; 1.25 m away lie 3 rows south, 2 north
        assert column[row - 3] == pytest.approx(min(south, 0.0) if k == 0 else max(south, 0.0), abs=1e-6)
        assert column[row + 2] == pytest.approx(min(north, 0.0) if k == 0 else max(north, 0.0), abs=1e-6)


def test_where_dams_cross_the_earth_is_counted_once(tmp_path):
    dem = write_dem(tmp_path / "dem.tif")
    one, other = LineString([(20, 50), (100, 50)]), LineString([(60, 20), (60, 80)])
    both = [
        Built(tmp_path, dem=dem, structures=write_lines(tmp_path / f"{k}.gpkg", shapes), height_m=3.0)
        for k, shapes in enumerate([[one, other], [other, one]])
    ]
    assert np.array_equal(both[0].new, both[1].new)
    union = level_volume(MultiLineString([one, other]), 2.0, 3.0, 1.0)
    bound = sampling_error(one, 2.0, 3.0, 1.0, CELL) + sampling_error(other, 2.0, 3.0, 1.0, CELL)
    for built, order in zip(both, ([one, other], [other, one]), strict=True):
        assert built.fill == pytest.approx(union, abs=bound)
        assert built.fill == pytest.approx(built.moved.sum() * CELL**2, rel=1e-9)
        assert built.rows["fill_m3"][0] == pytest.approx(level_volume(order[0], 2.0, 3.0, 1.0), abs=bound)
        assert built.rows["fill_m3"].sum() == pytest.approx(built.fill)


def test_a_ditch_cuts_into_the_dam_before_it_and_a_dam_fills_the_ditch_before_it(tmp_path):
    dem = write_dem(tmp_path / "dem.tif")
    dam, ditch = LineString([(20.25, 50.25), (100.25, 50.25)]), LineString([(60.25, 20.25), (60.25, 80.25)])
    first = write_lines(tmp_path / "a.gpkg", [dam, ditch], kind=["embankment", "ditch"])
    second = write_lines(tmp_path / "b.gpkg", [ditch, dam], kind=["ditch", "embankment"])
    cutting, filling = (Built(tmp_path, dem=dem, structures=each, height_m=2.0) for each in (first, second))
    # Both heights are relative to the original ground, whatever was built there before.
    assert (cutting.moved[100, 120], filling.moved[100, 120]) == (pytest.approx(-2.0), pytest.approx(2.0))
    assert cutting.cut > filling.cut
    for built in (cutting, filling):
        assert built.fill - built.cut == pytest.approx(built.moved.sum() * CELL**2, rel=1e-9)


@pytest.mark.parametrize("transform", [None, SOUTH_UP])
def test_strips_make_no_difference(tmp_path, monkeypatch, transform):
    values = np.random.default_rng(1).normal(1000.0, 1.0, (NY, NX))
    dem = write_dem(tmp_path / "dem.tif", values=values, **({"transform": transform} if transform else {}))
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(10, 10), (100, 90), (110, 20)])], height_m=[4.0])
    whole = Built(tmp_path, dem=dem, structures=lines)
    monkeypatch.setattr(dem_windows, "BLOCK_CELLS", 1)
    monkeypatch.setattr(dem_windows, "TILE_CELLS", 16)
    monkeypatch.setattr(dem_windows, "POINT_REACH_CELLS", 7)
    parts = Built(tmp_path, dem=dem, structures=lines)
    assert np.array_equal(parts.new, whole.new)
    assert parts.fill == pytest.approx(whole.fill, rel=1e-12)
    with rasterio.open(dem) as old, rasterio.open(parts.path) as new:
        assert new.transform == old.transform


def test_a_large_dem_is_never_held_whole(tmp_path, monkeypatch):
    """3000 x 3000 cells: one copy as float64 is 72 MB, and the tool may hold no more than half of that."""
    monkeypatch.setattr(dem_windows, "BLOCK_CELLS", 2**17)
    values = np.broadcast_to(np.float32(1000.0), (3000, 3000))
    with rasterio.open(
        tmp_path / "dem.tif", "w", driver="GTiff", height=3000, width=3000, count=1, dtype="float32", tiled=True,
        crs="EPSG:2056", transform=from_origin(EAST, NORTH + 1500, CELL, CELL), compress="deflate",
    ) as made:  # fmt: skip
        made.write(values, 1)
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(100, 100), (1400, 1400)])], height_m=[4.0])
    tracemalloc.start()
    add_structures.TOOL(dem=str(tmp_path / "dem.tif"), structures=lines, output=str(tmp_path / "out.tif"))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 36e6


def test_nodata_stays_nodata_and_all_else_keeps_its_bits(tmp_path, said):
    values = np.random.default_rng(2).normal(1000.0, 0.3, (NY, NX)).astype("float32")
    values[90:110, 100:140] = -9999.0
    values[0, 0] = np.nan
    dem = write_dem(tmp_path / "dem.tif", values=values, dtype="float32", crs="EPSG:2056+5728")
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(20, 50), (100, 50)])], elevation_m=[1004.0])
    built = Built(tmp_path, said, dem=dem, structures=lines)
    with rasterio.open(dem) as old, rasterio.open(built.path) as new:
        assert (new.dtypes, new.nodata, new.shape) == (old.dtypes, old.nodata, old.shape)
        assert (new.transform, new.crs) == (old.transform, old.crs)
    hole = built.old == -9999.0
    assert np.array_equal(built.new == -9999.0, hole)
    assert np.isnan(built.new[-1, 0])
    # 20 m of 80 m, and half a cell on both sides, where the surface between the cells has no height
    assert "26 % of the line lies off the DEM, or on its nodata" in said.warnings[0]
    changed = built.new != built.old
    changed[-1, 0] = False
    assert changed.sum() * CELL**2 == pytest.approx(built.rows["area_m2"][0])
    assert built.moved[changed].min() > 0


def test_whole_numbers_with_scale_and_offset_stay_such(tmp_path):
    raw = np.full((NY, NX), 1234, "int16")
    raw[:5] = -32768
    dem = write_dem(tmp_path / "dem.tif", values=raw, dtype="int16", nodata=-32768)
    with rasterio.open(dem, "r+") as made:
        made.scales, made.offsets = (0.01,), (1000.0,)
    lines = write_lines(tmp_path / "lines.gpkg", [STRAIGHT], height_m=[3.0])
    built = Built(tmp_path, dem=dem, structures=lines)
    with rasterio.open(built.path) as new:
        assert (new.dtypes, new.scales, new.offsets, new.nodata) == (("int16",), (0.01,), (1000.0,), -32768)
    assert built.new.max() == 1234 + 300
    assert np.array_equal(built.new[-5:], built.old[-5:])
    # Rounding to a centimetre changes a cell by half a centimetre at most, up as often as down.
    assert built.moved.sum() * 0.01 * CELL**2 == pytest.approx(built.fill, rel=1e-3)


def test_a_mask_beside_the_values_is_kept(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", nodata=None)
    mask = np.full((NY, NX), 255, "uint8")
    mask[100:, :] = 0
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), rasterio.open(dem, "r+") as made:
        made.write_mask(mask)
    lines = write_lines(tmp_path / "lines.gpkg", [LineString([(60, 20), (60, 80)])], elevation_m=[1003.0])
    built = Built(tmp_path, dem=dem, structures=lines)
    with rasterio.open(built.path) as new:
        assert np.array_equal(new.read_masks(1), mask)
    assert (built.moved[:100] == 0).all()
    assert built.moved[100:].max() == pytest.approx(3.0)


def test_a_side_that_never_meets_the_ground_is_refused(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", (0.0, slope(40)))
    line = LineString([(30, 85), (80, 85)])
    lines = write_lines(tmp_path / "lines.gpkg", [line], height_m=[2.0], crest_width_m=[3.0])
    values = {"dem": dem, "structures": lines, "max_reach_m": 40.0}
    with pytest.raises(UserError, match=r"lines.gpkg.*row 1: a side does not meet the ground within --max-reach-m"):
        Built(tmp_path, slope_deg=38.0, **values)
    assert not (tmp_path / "built.tif").exists()
    # 2 m of crest and 1.5 m of its half width times the ground's fall, over the difference of the falls: 33 m.
    assert (2.0 + 1.5 * slope(40)) / (slope(44) - slope(40)) == pytest.approx(25.7, abs=0.1)
    built = Built(tmp_path, slope_deg=44.0, **values)
    low = np.flatnonzero(built.moved[:, 110].round(6))[0]
    assert 85 - (low + 0.5) * CELL == pytest.approx(1.5 + 25.7, abs=CELL)


@pytest.mark.parametrize("kind", ["embankment", "ditch"])
def test_a_side_ends_where_it_first_meets_the_ground(tmp_path, kind):
    """On a terrace above a cliff: beyond its edge the plane of the side is above ground again, but unfilled."""
    sign = 1.0 if kind == "embankment" else -1.0
    y = (np.arange(NY)[::-1, None] + 0.5) * CELL
    terrace = 1000.0 + sign * np.where(y > 40.0, 0.0, np.maximum(-60.0, 2.5 * (y - 40.0))) + np.zeros((NY, NX))
    line = LineString([(40.0, 55.0), (80.0, 55.0)])
    lines = write_lines(tmp_path / "lines.gpkg", [line], height_m=[4.0], kind=[kind])
    dem = write_dem(tmp_path / "dem.tif", values=terrace)
    built = Built(tmp_path, dem=dem, structures=lines)
    bound = sampling_error(line, 2.0, 4.0, 1.0, CELL)
    moved = built.fill if kind == "embankment" else built.cut
    assert moved == pytest.approx(level_volume(line, 2.0, 4.0, 1.0), abs=bound)
    assert (built.moved[: round(50.0 / CELL) - 1] == 0).all()
    # Without the terrace between, the same side does reach far down.
    near = write_lines(tmp_path / "near.gpkg", [LineString([(40.0, 42.0), (80.0, 42.0)])], height_m=[4.0], kind=[kind])
    far = Built(tmp_path, dem=dem, structures=near)
    assert far.area_of_change() > 2 * built.area_of_change()


def test_many_vertices_and_a_long_reach_change_nothing(tmp_path):
    """The same line in 2 and in 400 segments; sides are followed step by step, or at once if a window ends."""
    dem = write_dem(tmp_path / "dem.tif", (0.0, 0.9))
    coarse = LineString([(35.0, 70.0), (85.0, 70.0)])
    fine = shapely.segmentize(coarse, 0.125)
    shared = {"height_m": 2.0, "slope_deg": 44.5, "max_reach_m": 80.0}
    one, other = (
        Built(tmp_path, dem=dem, structures=write_lines(tmp_path / f"{k}.gpkg", [line]), **shared)
        for k, line in enumerate((coarse, fine))
    )
    assert other.new == pytest.approx(one.new, abs=1e-6)
    low = np.flatnonzero(one.moved[:, 120] > 1e-6)[0]
    assert 70.0 - (low + 0.5) * CELL > 12.0 + 12.0  # beyond the first reach and the second


def test_what_is_odd_is_reported(tmp_path, said):
    values = {"dem": write_dem(tmp_path / "dem.tif", dtype="int16"), "elevation_m": 1000.0}
    lines = write_lines(tmp_path / "lines.gpkg", [STRAIGHT], crest_width_m=[0.3], crs=None)
    built = Built(tmp_path, said, structures=lines, **values)
    assert built.fill == 0.0
    assert len(said.warnings) == 3
    for part, line in zip(
        ("narrower than the diagonal", "not above the ground", "steps of 1 m"), said.warnings, strict=True
    ):
        assert part in line
    assert any("has no CRS" in note for note in said.notes)


BAD = {
    "no height": ({}, {}, "row 1: neither height_m nor elevation_m is given"),
    "a gap": ({"height_m": [None]}, {}, "row 1: neither height_m"),
    "a negative height": ({"height_m": [-2.0]}, {}, "field 'height_m', row 1: -2 is not a number greater than 0"),
    "a text": ({"height_m": ["high"]}, {}, "field 'height_m', row 1: 'high' is not"),
    "a foreign kind": ({"kind": ["wall"], "height_m": [2.0]}, {}, "field 'kind', row 1: 'wall' is not one of"),
    "an overhang": ({"slope_deg": [95.0], "height_m": [2.0]}, {}, "field 'slope_deg', row 1: 95 is not"),
    "a slope of 0": ({"height_m": [2.0]}, {"slope_left_deg": 0.0}, "--slope-left-deg is 0 °"),
    "an elevation of nowhere": ({}, {"elevation_m": -1e9}, "--elevation-m is -1e+09 m"),
    "an elevation of nowhere in the layer": ({"elevation_m": [1e5]}, {}, "field 'elevation_m', row 1: 100000 is not"),
    "no z": ({"height_m": [2.0]}, {"elevation_from_z": True}, "row 1: the line has no Z"),
    "another country": ({"height_m": [2.0]}, {"shift": 9e5}, "row 1: the line lies off the DEM"),
    "no length": ({"height_m": [2.0]}, {"line": LineString([(5, 5), (5, 5)])}, "row 1: the line has no length"),
    "a polygon": ({"height_m": [2.0]}, {"line": shapely.box(5, 5, 9, 9)}, "row 1: a Polygon"),
    "a txt file": ({"height_m": [2.0]}, {"output": "out.txt"}, "must be a .tif file"),
    "a height beyond the type": (
        {"elevation_m": [9000.0]},
        {"dtype": "uint8", "low": True},
        "cannot be stored in the DEM's type",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_reported_in_one_line_and_leaves_nothing(tmp_path, name):
    columns, values, said_of_it = BAD[name]
    values = dict(values)
    shift = values.pop("shift", 0.0)
    line = shapely.transform(values.pop("line", STRAIGHT), lambda p: p + shift)
    dtype, low = values.pop("dtype", "float64"), values.pop("low", False)
    heights = np.full((NY, NX), 200.0) if low else None
    dem = write_dem(tmp_path / "dem.tif", values=heights, dtype=dtype, nodata=0)
    lines = write_lines(tmp_path / "lines.gpkg", [line], **columns)
    values = {"output": "out.tif"} | values
    values["output"] = str(tmp_path / values["output"])
    with pytest.raises(UserError) as raised:
        add_structures.TOOL(dem=dem, structures=lines, earthworks=str(tmp_path / "e.gpkg"), **values)
    assert said_of_it in str(raised.value)
    assert "\n" not in str(raised.value)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["dem.tif", "lines.gpkg"]


def test_the_dem_itself_is_never_replaced(tmp_path):
    dem = write_dem(tmp_path / "dem.tif")
    lines = write_lines(tmp_path / "lines.gpkg", [STRAIGHT], height_m=[2.0])
    with pytest.raises(UserError, match="is also an input"):
        add_structures.TOOL(dem=dem, structures=lines, output=dem, overwrite=True)


def test_the_worked_example_runs(tmp_path):
    sample = ROOT / "sample_data"
    (tmp_path / "sample_data").symlink_to(sample)
    text = add_structures.TOOL.description.replace("\\\n", " ")
    (line,) = [line for line in text.splitlines() if line.startswith("    deadwood-tool ")]
    command = [sys.executable, "-m", "deadwood_toolbox", *shlex.split(line)[1:]]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert "2 structures: fill" in ran.stdout
    with rasterio.open(tmp_path / "dem_with_dams.tif") as new, rasterio.open(sample / "dem.tif") as old:
        moved = (new.read(1).astype(int) - old.read(1)) * 0.01
    fill = gpd.read_file(tmp_path / "earthworks.gpkg", layer="earthworks")["fill_m3"].sum()
    assert moved.min() == 0
    assert moved.sum() * 0.25 == pytest.approx(fill, rel=1e-3)
