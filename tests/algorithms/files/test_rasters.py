"""DEMs and other rasters through files: registration, orientation, nodata, scale, and back out again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio.transform import Affine, from_origin

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.geotiff import TILE_CELLS
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.rasters import read_raster_on, write_bands, write_raster
from deadwood_algorithms.params.tool import UserError

# 3 rows, 4 columns as on a map: the north-west corner first. Every value is unique.
MAP = np.array([[11.0, 12, 13, 14], [21, 22, 23, 24], [31, 32, 33, 34]])
TYROL = Path(__file__).parents[4] / "shared" / "data" / "tyrol_5m" / "terrain.asc"


def write_map(path, values=MAP, *, crs: object = "EPSG:2056", transform=None, **profile):
    """A raster whose south-west corner is (1000, 2000), cells of 2 m."""
    transform = transform or from_origin(1000.0, 2000.0 + 2.0 * values.shape[0], 2.0, 2.0)
    dtype = profile.pop("dtype", "float64")
    scale, offset = profile.pop("scale", None), profile.pop("offset", None)
    profile |= {"height": values.shape[0], "width": values.shape[1], "count": profile.pop("count", 1)}
    profile |= {"driver": "GTiff", "crs": crs, "transform": transform, "dtype": dtype}
    with rasterio.open(path, "w", **profile) as made:
        for band in range(1, made.count + 1):
            made.write(values.astype(dtype), band)
        if scale is not None:
            made.scales, made.offsets = (scale,), (offset,)
    return path


def write_asc(path, rows: str, *, corner="xllcorner 1000\nyllcorner 2000", nodata="NODATA_value -9999\n"):
    lines = rows.strip().splitlines()
    header = f"ncols {len(lines[0].split())}\nnrows {len(lines)}\n{corner}\ncellsize 2\n{nodata}"
    path.write_text(header + "\n".join(lines) + "\n")
    return path


def test_row_0_is_the_southernmost_and_the_origin_is_its_cell_centre(tmp_path):
    grid = read_dem(write_map(tmp_path / "dem.tif"))
    assert grid.values.tolist() == MAP[::-1].tolist()
    assert (grid.x0, grid.y0, grid.cell) == (1001.0, 2001.0, 2.0)
    assert grid.bounds == (1000.0, 2000.0, 1008.0, 2006.0)
    assert grid.values.dtype == np.float32
    assert grid.crs.to_epsg() == 2056


def test_heights_stand_at_the_cell_centres_and_are_bilinear_between_them(tmp_path):
    grid = read_dem(write_map(tmp_path / "dem.tif"))
    assert grid.height(1001.0, 2001.0) == 31.0  # centre of the south-west cell
    assert grid.height(1007.0, 2005.0) == 14.0  # centre of the north-east cell
    assert grid.height(1002.0, 2001.0) == 31.5  # an edge between two cells: the mean of both
    assert grid.height(1002.0, 2002.0) == pytest.approx((31 + 32 + 21 + 22) / 4)


def test_outside_is_where_one_of_four_heights_is_missing(tmp_path):
    values = MAP.copy()
    values[0, 0] = -9999
    grid = read_dem(write_map(tmp_path / "dem.tif", values, nodata=-9999))
    assert np.isnan(grid.values[2, 0])
    assert grid.contains([1001.0, 1004.0, 1000.9, 1007.1], [2001.0, 2004.0, 2001.0, 2001.0]).tolist() == [
        True,
        True,
        False,
        False,
    ]
    assert not grid.contains(1002.0, 2004.0)  # its north-west neighbour is nodata
    assert not grid.contains(np.nan, 2004.0)


def test_corner_and_centre_headers_differ_by_half_a_cell_exactly(tmp_path):
    rows = "1 2 3\n4 5 6"
    corner = read_dem(write_asc(tmp_path / "corner.asc", rows), crs="EPSG:2056")
    centre = read_dem(
        write_asc(tmp_path / "centre.asc", rows, corner="xllcenter 1000\nyllcenter 2000"), crs="EPSG:2056"
    )
    assert (corner.x0, corner.y0) == (1001.0, 2001.0)
    assert (centre.x0, centre.y0) == (1000.0, 2000.0)
    for grid in (corner, centre):
        assert grid.height(grid.x0, grid.y0) == 4.0


def test_a_south_up_file_gives_the_same_grid(tmp_path):
    usual = read_dem(write_map(tmp_path / "north.tif"))
    turned = write_map(tmp_path / "south.tif", MAP[::-1], transform=Affine(2, 0, 1000, 0, 2, 2000))
    grid = read_dem(turned)
    assert grid.values.tolist() == usual.values.tolist()
    assert (grid.x0, grid.y0) == (usual.x0, usual.y0)


def test_scale_and_offset_are_applied_and_nodata_is_compared_before(tmp_path):
    raw = np.array([[100, 200, 300], [400, -1, 600]])
    path = write_map(tmp_path / "dem.tif", raw, dtype="int16", nodata=-1, scale=0.01, offset=1000.0)
    grid = read_dem(path)
    assert grid.values[1].tolist() == [1001.0, 1002.0, 1003.0]
    assert np.isnan(grid.values[0, 1])


@pytest.mark.parametrize(
    ("dtype", "nodata", "hole"),
    [
        ("float32", np.nan, np.nan),
        ("float64", -3.4028234663852886e38, -3.4028234663852886e38),
        ("float32", None, np.nan),
        ("float32", None, np.inf),
        ("int16", 0, 0),
        ("uint16", 65535, 65535),
        ("int32", -32768, -32768),
    ],
)
def test_whatever_means_nothing_becomes_nan(tmp_path, dtype, nodata, hole):
    values = MAP.copy()
    values[1, 2] = hole
    grid = read_dem(write_map(tmp_path / "dem.tif", values, dtype=dtype, nodata=nodata))
    assert np.argwhere(np.isnan(grid.values)).tolist() == [[1, 2]]


@pytest.mark.parametrize("hole", [-9999.0, -32768.0, 1e30])
def test_undeclared_nodata_is_outside_with_a_warning(tmp_path, hole, said):
    values = MAP.copy()
    values[0, 0] = hole
    grid = read_dem(write_map(tmp_path / "dem.tif", values), feedback=said)
    assert np.argwhere(np.isnan(grid.values)).tolist() == [[2, 0]]
    assert "1 cell " in said.warnings[-1]


def test_a_collar_of_zeros_round_a_mountain_is_outside_but_the_sea_is_not(tmp_path, said):
    mountain = MAP + 1000
    mountain[0] = 0
    grid = read_dem(write_map(tmp_path / "mountain.tif", mountain), feedback=said)
    assert np.isnan(grid.values[2]).all()
    assert np.isfinite(grid.values[:2]).all()
    assert "undeclared nodata" in said.warnings[-1]
    coast = MAP.copy()
    coast[0] = 0
    assert read_dem(write_map(tmp_path / "coast.tif", coast)).values[2].tolist() == [0.0] * 4


def test_a_compound_crs_in_metres_is_fine(tmp_path):
    grid = read_dem(write_map(tmp_path / "dem.tif", crs="EPSG:2056+5728"))
    assert grid.crs.is_compound
    assert grid.plan_crs.to_epsg() == 2056


def test_a_crs_in_the_file_overrides_the_option(tmp_path, said):
    grid = read_dem(write_map(tmp_path / "dem.tif"), crs="EPSG:21781", feedback=said)
    assert grid.crs.to_epsg() == 2056
    assert "--crs EPSG:21781 is not used" in said.warnings[0]


def test_strips_of_a_raster_that_is_read_in_parts_are_put_together_right(tmp_path, monkeypatch):
    from deadwood_algorithms.files import dem_windows, rasters

    values = np.arange(37 * 11, dtype=float).reshape(37, 11)
    path = write_map(tmp_path / "dem.tif", values, blockysize=1)
    monkeypatch.setattr(dem_windows, "BLOCK_CELLS", 11 * 5)
    grid = read_dem(path)
    assert np.array_equal(grid.values, values[::-1])
    monkeypatch.setattr(rasters, "STRIP_BYTES", 64 * 11 * 5)
    assert np.array_equal(read_raster_on(path, grid, what="friction"), values[::-1])


@pytest.mark.parametrize("dtype", ["uint32", "float32"])
def test_what_is_written_reads_back_in_the_same_place(tmp_path, dtype):
    grid = read_dem(write_map(tmp_path / "dem.tif"))
    values = np.arange(12).reshape(3, 4).astype(dtype)
    write_raster(tmp_path / "out.tif", values, grid, dtype=dtype, units="m", description="what it is")
    with rasterio.open(tmp_path / "out.tif") as made:
        assert made.read(1).tolist() == values[::-1].tolist()
        assert made.transform == from_origin(1000, 2006, 2, 2)
        assert made.crs.to_epsg() == 2056
        assert (made.units[0], made.descriptions[0]) == ("m", "what it is")
        assert (made.dtypes[0], made.compression.value) == (dtype, "DEFLATE")
        assert made.block_shapes == [(256, 256)]


@pytest.mark.parametrize("side", [20, 600])
def test_a_band_says_what_it_means(tmp_path, side):
    """Also in the layout of a cloud-optimised file, which is a copy of the file."""
    grid = read_dem(write_map(tmp_path / "dem.tif", np.ones((side, side), np.float32)))
    write_raster(
        tmp_path / "a.tif", grid.values, grid, dtype="float32", units="m", description="speed_max", raster="speed_max"
    )
    with rasterio.open(tmp_path / "a.tif") as made:
        assert made.descriptions == ("speed_max",)
        assert made.tags(1)["long_name"] == "Largest speed of a log over the cell"
        assert bool(made.overviews(1)) == (side == 600)


def test_a_raster_on_the_same_cells_is_taken_as_it_is(tmp_path):
    grid = read_dem(write_map(tmp_path / "dem.tif"))
    friction = write_map(tmp_path / "mu.tif", MAP / 100, nodata=0.22)
    values = read_raster_on(friction, grid, what="friction")
    expected = (MAP / 100)[::-1].astype(np.float32)
    expected[1, 1] = np.nan
    assert np.array_equal(values, expected, equal_nan=True)


def test_a_raster_on_other_cells_gives_the_nearest_value_and_nan_beyond_it(tmp_path):
    grid = read_dem(write_map(tmp_path / "dem.tif"))
    coarse = np.array([[1.0], [2.0]])  # two cells of 4 m, the northern one from (1000, 2002) to (1004, 2006)
    path = write_map(tmp_path / "mu.tif", coarse, transform=from_origin(1000, 2006, 4, 4))
    values = read_raster_on(path, grid, what="friction")
    expected = np.array([[2, 2, np.nan, np.nan], [1, 1, np.nan, np.nan], [1, 1, np.nan, np.nan]])
    assert np.array_equal(values, expected, equal_nan=True)


def test_a_raster_in_another_crs_is_brought_over(tmp_path):
    east, north = 2_783_000.0, 1_190_000.0
    grid = Grid(np.zeros((20, 20)), 5.0, east, north, pyproj.CRS(2056))
    to_old = pyproj.Transformer.from_crs(2056, 21781, always_xy=True)
    x, y = to_old.transform(east + 50, north)
    halves = np.repeat([[1.0, 2.0]], 2, axis=0)  # the border between west and east runs through the grid's middle
    path = write_map(tmp_path / "mu.tif", halves, crs="EPSG:21781", transform=Affine(500, 0, x - 500, 0, -500, y + 500))
    values = read_raster_on(path, grid, what="friction")
    assert (values[:, :9] == 1).all()
    assert (values[:, 12:] == 2).all()


@pytest.mark.skipif(not TYROL.exists(), reason="the real terrain is not part of the repository")
def test_the_real_terrain_lies_where_it_should():
    grid = read_dem(TYROL, crs="EPSG:31287")
    assert grid.shape == (446, 526)
    assert (grid.x0, grid.y0) == pytest.approx((272771.421744369, 357502.69532628), abs=1e-6)
    assert grid.cell == 4.997678230579
    lines = TYROL.read_text().splitlines()[6:]
    south = np.array([float(value) for value in lines[-100].split()])
    south[south == -9999] = np.nan
    assert np.array_equal(grid.values[99], south.astype(np.float32), equal_nan=True)
    assert 1455 < np.nanmin(grid.values) < np.nanmax(grid.values) < 2605


# --- refused, each in one line with the fix


def refused(path, **options) -> str:
    with pytest.raises(UserError) as raised:
        read_dem(path, **options)
    message = str(raised.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message


def test_a_missing_crs_names_the_option(tmp_path):
    assert "--crs EPSG:25832, with the code" in refused(write_map(tmp_path / "dem.tif", crs=None))
    with pytest.raises(UserError, match="--crs is 'EPSG:nonsense', which is not a known CRS"):
        read_dem(tmp_path / "dem.tif", crs="EPSG:nonsense")


@pytest.mark.parametrize(
    ("crs", "place", "fix"),
    [
        ("EPSG:4326", (9.8, 46.9, 1e-4), "--dst-crs EPSG:2056 --res 11 "),
        ("EPSG:4326", (15.2, 47.1, 1e-5), "--dst-crs EPSG:32633 --res 1.1 "),
        ("EPSG:4979", (9.8, -46.9, 1e-4), "--dst-crs EPSG:32732 "),
        ("EPSG:2229", (6_500_000, 1_800_000, 3.0), "--dst-crs EPSG:32611 --res 0.914 "),
    ],
)
def test_degrees_and_feet_are_refused_with_the_command_that_fixes_them(tmp_path, crs, place, fix):
    x, y, cell = place
    path = write_map(tmp_path / "my dem.tif", crs=crs, transform=from_origin(x, y, cell, cell))
    message = refused(path)
    assert fix in message
    assert f"'{path}' 'my dem_fixed.tif'" in message  # quoted for the shell


def test_heights_in_feet_are_refused(tmp_path):
    assert "(* 0.3048006" in refused(write_map(tmp_path / "dem.tif", crs="EPSG:26910+6360"))
    path = write_map(tmp_path / "unit.tif")
    with rasterio.open(path, "r+") as made:
        made.set_band_unit(1, "ft")
    assert "heights are in ft" in refused(path)


def test_rotated_mirrored_and_oblong_grids_are_refused(tmp_path):
    rotated = Affine(1.992, 0.174, 1000, 0.174, -1.992, 2000)
    assert "rotated" in refused(write_map(tmp_path / "rotated.tif", transform=rotated))
    mirrored = Affine(-2, 0, 1008, 0, -2, 2006)
    assert "mirrored" in refused(write_map(tmp_path / "mirrored.tif", transform=mirrored))
    oblong = Affine(2, 0, 1000, 0, -2.5, 2006)
    assert "--res 2 --resampling bilinear" in refused(write_map(tmp_path / "oblong.tif", transform=oblong))


def test_rounding_in_a_header_is_not_held_against_a_grid(tmp_path):
    nearly = Affine(2.0000001, 1e-9, 1000, -1e-9, -2, 2006)
    assert read_dem(write_map(tmp_path / "dem.tif", transform=nearly)).cell == pytest.approx(2.0)
    # The same relative error over a wide grid moves its far side by a tenth of a cell.
    wide = np.ones((2, 20_000))
    off = Affine(2.00001, 0, 1000, 0, -2, 2006)
    assert "square" in refused(write_map(tmp_path / "wide.tif", wide, transform=off))


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_pictures_and_unreferenced_rasters_are_refused(tmp_path):
    assert "picture" in refused(write_map(tmp_path / "photo.tif", dtype="uint8", count=3))
    assert "no georeference" in refused(write_map(tmp_path / "plain.tif", transform=Affine.identity()))


def test_a_dem_of_nothing_but_nodata_is_refused(tmp_path):
    assert "no height at all" in refused(write_map(tmp_path / "dem.tif", MAP * 0 - 9999, nodata=-9999))


def test_a_damaged_raster_is_refused(tmp_path):
    path = write_map(tmp_path / "dem.tif", np.random.default_rng(1).random((300, 300)), compress="deflate")
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) // 2])
    refused(path)


@pytest.mark.parametrize(("rows", "count"), [("1 2 3\n4 5", 5), ("1 2 3\n4 5 6 7", 7), ("1 2 3", 3)])
def test_an_ascii_grid_with_too_few_or_too_many_values_is_refused(tmp_path, rows, count):
    """GDAL silently reads the missing ones as 0 m."""
    path = write_asc(tmp_path / "dem.asc", "1 2 3\n4 5 6")
    path.write_text(path.read_text().replace("1 2 3\n4 5 6", rows))
    assert f"holds {count} values, but 2 rows of 3 make 6" in refused(path, crs="EPSG:2056")


def test_an_ascii_header_that_mixes_corner_and_centre_is_refused(tmp_path):
    """GDAL would silently put the grid at the origin."""
    path = write_asc(tmp_path / "dem.asc", "1 2\n3 4", corner="xllcenter 1000\nyllcorner 2000")
    assert "mixes" in refused(path, crs="EPSG:2056")


def test_ascii_grids_of_every_hand_are_read(tmp_path):
    for number, (before, after) in enumerate(
        [("\n", "\r\n"), (" ", "\t"), (".", ","), ("cellsize 2", "dx 2\ndy 2"), ("-9999", "nan"), ("ncols", "NCOLS")]
    ):
        path = write_asc(tmp_path / f"{number}.asc", "1.5 2.25 -9999\n4 5 6")
        path.write_bytes(path.read_text().replace(before, after).encode())
        grid = read_dem(path, crs="EPSG:2056")
        assert np.array_equal(grid.values, [[4, 5, 6], [1.5, 2.25, np.nan]], equal_nan=True), after
        assert (grid.x0, grid.y0) == (1001.0, 2001.0)


def test_words_are_counted_across_pieces(tmp_path, monkeypatch):
    from deadwood_algorithms.files import ascii_grid

    (tmp_path / "words").write_text("one two  three\n four\tfive ")
    for size in range(1, 9):
        monkeypatch.setattr(ascii_grid, "CHUNK_BYTES", size)
        assert ascii_grid.count_words(tmp_path / "words") == 5


@pytest.mark.parametrize(
    ("driver", "name"),
    [("GTiff", "a.tif"), ("ENVI", "a.img"), ("EHdr", "a.bil"), ("SAGA", "a.sdat"), ("AAIGrid", "a.asc")],
)
def test_a_file_that_is_cut_off_is_never_read_as_zeros(tmp_path, driver, name):
    values = np.arange(2500, dtype="float32").reshape(50, 50) + 1
    profile = {"driver": driver, "dtype": "float32", "count": 1, "height": 50, "width": 50, "crs": "EPSG:2056"}
    with rasterio.open(tmp_path / name, "w", transform=from_origin(0, 100, 2, 2), **profile) as made:
        made.write(values, 1)
    assert read_dem(tmp_path / name).values.min() == 1
    raw = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(raw[: len(raw) * 3 // 4])
    refused(tmp_path / name)


@pytest.mark.parametrize("content", [b"", b"not a raster\n"])
def test_a_file_that_is_no_raster_is_refused(tmp_path, content):
    path = tmp_path / "dem.tif"
    path.write_bytes(content)
    refused(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    assert "does not exist" in refused(tmp_path / "none.tif")
    assert "is a folder that holds no tile" in refused(tmp_path)


@pytest.mark.parametrize("side", [700, 300], ids=["laid out again", "as written"])
@pytest.mark.parametrize(
    "part", [None, Part(30, 11, 201, 217), Part(10, 0, 290, 256)], ids=["whole", "window", "whole tiles of one"]
)
@pytest.mark.parametrize(
    ("dtype", "nodata", "nothing"),
    [("uint32", None, 0), ("uint8", 0, 0), ("float32", np.nan, np.nan), ("float32", -9999.0, -9999.0),
     ("float32", None, 0.0)],
)  # fmt: skip
def test_tiles_that_hold_nothing_are_not_stored_and_read_as_they_were(tmp_path, dtype, nodata, nothing, part, side):
    grid = Grid.empty((side, side), 0.5, 2_600_000.25, 1_200_000.25, pyproj.CRS(2056))
    grid = grid.window(part) if part else grid
    bands = {name: np.full(grid.shape, nothing, dtype) for name in ("one", "two")}
    bands["one"][5:9, 3:150] = 7
    bands["two"][-1, -1] = 9
    write_bands(tmp_path / "out.tif", bands, grid, nodata=nodata, dtype=dtype, units=["", ""])
    frame = np.full((side, side), nothing, dtype)
    with rasterio.open(tmp_path / "out.tif") as written:
        for number, values in enumerate(bands.values(), start=1):
            frame[grid.part.slices] = values
            assert np.array_equal(written.read(number), frame[::-1], equal_nan=dtype == "float32")
        across = range(-(-side // TILE_CELLS))
        stored = [
            {(y, x) for y in across for x in across if written.get_tag_item(f"BLOCK_SIZE_{x}_{y}", "TIFF", bidx=n)}
            for n in (1, 2)
        ]
    north, column = side - grid.part.row, grid.part.column
    one = {(y // TILE_CELLS, x // TILE_CELLS) for y in (north - 9, north - 6) for x in (column + 3, column + 149)}
    two = {((north - grid.shape[0]) // TILE_CELLS, (column + grid.shape[1] - 1) // TILE_CELLS)}
    laid_out = side > 2 * TILE_CELLS  # there, a tile has the cells of all bands
    assert stored == ([one | two] * 2 if laid_out else [one, two])
