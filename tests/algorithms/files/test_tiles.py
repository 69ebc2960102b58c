"""A DEM in tiles gives the same bits as the same DEM in one file, for every tool that reads one."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.shutil import copy
from rasterio.transform import Affine, from_origin
from slope_case import Case, assert_same_run, raster

from deadwood_algorithms.files import tiles as of_tiles
from deadwood_algorithms.files.dem_windows import open_windows, read_dem, read_part
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.files.tiles import open_to_draw
from deadwood_algorithms.params.manifest import manifest
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.run_folder import read_run
from deadwood_algorithms.tools import add_structures, slide_logs

WEST, NORTH, CELL = 2_783_000.0, 1_190_100.0, 2.0


def write(path: Path, values: np.ndarray, row: int = 0, column: int = 0, **facts) -> str:
    """A tile whose first cell is this one of the grid."""
    place = from_origin(WEST + column * CELL, NORTH - row * CELL, CELL, CELL)
    facts = {
        "driver": "GTiff",
        "dtype": values.dtype.name,
        "crs": "EPSG:2056",
        "nodata": -9999,
        "transform": place,
    } | facts
    path.parent.mkdir(exist_ok=True)
    with rasterio.open(path, "w", count=1, height=values.shape[0], width=values.shape[1], **facts) as made:
        made.write(values, 1)
    return str(path)


def cut(folder: Path, values: np.ndarray, rows: int, columns: int, **facts) -> list[str]:
    starts = product(range(0, values.shape[0], rows), range(0, values.shape[1], columns))
    return [
        write(
            folder / f"t_{row:03}_{column:03}.tif",
            values[row : row + rows, column : column + columns],
            row,
            column,
            **facts,
        )
        for row, column in starts
    ]


@pytest.fixture
def rough() -> np.ndarray:
    values = np.random.default_rng(3).normal(1000.0, 5.0, (70, 50)).astype("float32")
    values[10:14, 20:30] = -9999.0
    return values


def same(one, other) -> bool:
    alike = (one.shape, one.cell, one.x0, one.y0) == (other.shape, other.cell, other.x0, other.y0)
    return alike and one.values.dtype == other.values.dtype and np.array_equal(one.values, other.values, equal_nan=True)


@pytest.mark.parametrize("kept_open", [1, 32])
def test_tiles_are_the_one_file(tmp_path, rough, kept_open, monkeypatch):
    """A folder or a list, in any order, with a tile between two windows, and with few files open at once."""
    monkeypatch.setattr(of_tiles, "KEPT_OPEN", kept_open)
    whole = read_dem(write(tmp_path / "dem.tif", rough))
    files = cut(tmp_path / "tiles", rough, 32, 16)
    assert len(files) == 12
    copy(tmp_path / "dem.tif", tmp_path / "cog.tif", driver="COG", blocksize=128)
    assert same(read_dem(str(tmp_path / "cog.tif")), whole)
    for named in (str(tmp_path / "tiles"), ",".join(files[::-1]), ", ".join(files)):
        assert same(read_dem(named), whole)
        with open_windows(named, crs=None, feedback=Quiet(), look_through=False) as dem:
            part = Part(5, 11, 40, 25)
            assert np.array_equal(read_part(dem, part, Quiet()).values, whole.values[part.slices], equal_nan=True)
            assert np.array_equal(dem.height(whole.x0 + rough[0] % 90, whole.y0 + rough[1] % 90), whole.height(
                whole.x0 + rough[0] % 90, whole.y0 + rough[1] % 90), equal_nan=True)  # fmt: skip


def test_a_gap_is_outside_and_so_is_nodata_of_each_tile(tmp_path, rough):
    files = cut(tmp_path / "tiles", rough, 32, 16)
    Path(files[5]).unlink()
    marked = rough[64:, 32:48].copy()
    marked[2, 3] = -1.0
    write(Path(files[10]), marked, 64, 32, nodata=-1.0)
    found = read_dem(str(tmp_path / "tiles")).values[::-1]
    expected = rough.copy()
    expected[expected == -9999.0] = np.nan
    expected[32:64, 16:32] = np.nan
    expected[66, 35] = np.nan
    assert np.array_equal(found, expected, equal_nan=True)


def test_scaled_whole_numbers_keep_their_scale(tmp_path):
    numbers = np.arange(70 * 50, dtype="int16").reshape(70, 50)
    files = [write(tmp_path / "dem.tif", numbers), *cut(tmp_path / "tiles", numbers, 40, 50)]
    for each in files:
        with rasterio.open(each, "r+") as target:
            target.scales, target.offsets = (0.1,), (500.0,)
    assert same(read_dem(str(tmp_path / "tiles")), read_dem(files[0]))


def test_south_up_tiles_and_tiles_as_text(tmp_path, rough):
    upward = Affine(CELL, 0.0, WEST, 0.0, CELL, NORTH - 70 * CELL)
    whole = read_dem(write(tmp_path / "up.tif", rough, transform=upward))
    for row in (0, 40):
        place = Affine(CELL, 0.0, WEST, 0.0, CELL, upward.f + row * CELL)
        write(tmp_path / "up" / f"{row}.tif", rough[row : row + 40][: 70 - row], transform=place)
    assert same(read_dem(str(tmp_path / "up")), whole)
    heights = np.round(rough)
    (tmp_path / "text").mkdir()
    for each in cut(tmp_path / "tiles", heights, 70, 25):
        copy(each, tmp_path / "text" / f"{Path(each).stem}.asc", driver="AAIGrid")
    assert same(read_dem(str(tmp_path / "text"), crs="EPSG:2056"), read_dem(write(tmp_path / "dem.tif", heights)))


def test_of_overlapping_tiles_the_first_counts_and_others_are_reported(tmp_path, said, rough):
    rough = (rough / 20.0).astype("float32")  # realistic slopes
    write(tmp_path / "tiles" / "a.tif", rough[:40])
    other = rough[30:].copy()
    write(tmp_path / "tiles" / "b.tif", other, 30)
    whole = read_dem(write(tmp_path / "dem.tif", rough))
    assert same(read_dem(str(tmp_path / "tiles"), feedback=said), whole)
    assert said.warnings == []
    other[3, 7] += 1.25
    write(tmp_path / "tiles" / "b.tif", other, 30)
    assert same(read_dem(str(tmp_path / "tiles"), feedback=said), whole)
    assert len(said.warnings) == 1
    assert "b.tif" in said.warnings[0]
    assert "1 cell differs from theirs, by up to 1.25 m" in said.warnings[0]


@pytest.mark.parametrize(
    ("facts", "told"),
    [
        ({"transform": from_origin(WEST + 100.0, NORTH, 1.0, 1.0)}, ("cells are 1 m large", "2 m")),
        ({"transform": from_origin(WEST + 100.8, NORTH, CELL, CELL)}, ("between those of", "0.4 of a cell")),
        ({"transform": Affine(CELL, 0.0, WEST + 100, 0.0, CELL, NORTH)}, ("rows run in the opposite direction",)),
        ({"crs": "EPSG:21781"}, ("EPSG:21781", "EPSG:2056", "one CRS")),
        ({"crs": "EPSG:4326"}, ("geographic",)),
        ({"crs": None}, ("has no CRS",)),
    ],
)
def test_a_tile_of_another_grid_is_named(tmp_path, rough, facts, told):
    write(tmp_path / "tiles" / "a.tif", rough)
    odd = write(tmp_path / "tiles" / "odd.tif", rough, 0, 50, **facts)
    with pytest.raises(UserError) as error:
        read_dem(str(tmp_path / "tiles"))
    assert str(error.value).startswith(odd)
    assert "\n" not in str(error.value)
    for each in told:
        assert each in str(error.value)


def test_what_is_no_tile_is_named(tmp_path, rough):
    first = write(tmp_path / "tiles" / "a.tif", rough)
    (tmp_path / "none").mkdir()
    with pytest.raises(UserError, match="a folder that holds no tile"):
        read_dem(str(tmp_path / "none"))
    with pytest.raises(UserError, match=r"b\.tif: the DEM file does not exist"):
        read_dem(f"{first},{tmp_path / 'b.tif'}")
    torn = Path(write(tmp_path / "tiles" / "b.tif", rough, 70))
    torn.write_bytes(torn.read_bytes()[:-6000])
    with pytest.raises(UserError, match=r"b\.tif: the tile is damaged"):
        read_dem(str(tmp_path / "tiles"))


def test_a_virtual_raster_of_the_tiles_is_the_same_raster(tmp_path, rough):
    cut(tmp_path / "tiles", rough, 32, 16, nodata=None)
    with open_to_draw(tmp_path / "tiles") as source:
        assert np.array_equal(source.read(1), rough)


def test_a_run_on_tiles_is_the_run_on_one_file(tmp_path, monkeypatch):
    """Including its project and report, and repeated from its manifest after everything was moved."""
    case = Case(tmp_path / "case")
    one = case.run(lines=case.lines, trees=case.trees)
    with rasterio.open(case.dem) as source:
        values, place = source.read(1), source.transform
    files = []
    for row, column in product((0, 40), (0, 35)):
        at = place @ Affine.translation(column, row)
        part = values[row : row + (40 if row == 0 else 60), column : column + (35 if column == 0 else 25)]
        files.append(write(tmp_path / "case" / "tiles" / f"{row}_{column}.tif", part, transform=at))
    for name, dem in (("list", ",".join(files)), ("folder", str(tmp_path / "case" / "tiles"))):
        other = case.run(
            dem=dem,
            lines=case.lines,
            trees=case.trees,
            output=str(tmp_path / "case" / name),
            report=True,
            qgis_project=True,
        )
        assert_same_run(one, other)
        with rasterio.open(other / "terrain.vrt") as source:
            assert np.array_equal(source.read(1), values)
        assert "0_35.tif" in (other / "report.html").read_text(encoding="utf-8")
    moved = (tmp_path / "case").rename(tmp_path / "moved")
    from deadwood_algorithms.results.edges import Edges
    from deadwood_algorithms.results.run_folder import input_paths

    for name in ("list", "folder"):
        run = read_run(str(moved / name), feedback=Quiet())
        with Edges(run.grid, input_paths(run.path, run.manifest, "dem"), Quiet()) as edges:
            assert edges.path is not None


def test_structures_built_into_tiles_give_one_dem(tmp_path):
    case = Case(tmp_path)
    with rasterio.open(case.dem) as source:
        values, place = source.read(1), source.transform
    for row in (0, 50):
        write(tmp_path / "tiles" / f"{row}.tif", values[row : row + 50], transform=place @ Affine.translation(0, row))
    made = [tmp_path / "one.tif", tmp_path / "other.tif"]
    for dem, output in zip((case.dem, str(tmp_path / "tiles")), made, strict=True):
        facts = {"structures": case.barriers, "height_m": 2.0, "slope_deg": 45.0, "output": str(output)}
        add_structures.TOOL(dem=dem, **facts)
    assert np.array_equal(raster(made[0]), raster(made[1]))
    with pytest.raises(UserError, match="also an input"):
        add_structures.TOOL(
            dem=str(tmp_path / "tiles"),
            structures=case.barriers,
            height_m=2.0,
            output=str(tmp_path / "tiles" / "0.tif"),
            overwrite=True,
        )


def test_a_manifest_names_tiles_that_mean_the_same_anywhere(tmp_path, monkeypatch):
    case = Case(tmp_path)
    monkeypatch.chdir(tmp_path)
    ask = slide_logs.Ask(**case.values(dem="dem.tif, lines.gpkg"))

    assert manifest(slide_logs.TOOL, ask)["parameters"]["dem"] == f"{tmp_path}/dem.tif,{tmp_path}/lines.gpkg"


def test_tiles_that_lie_a_billion_metres_apart_are_refused_by_name(tmp_path):
    """Before: a frame of a billion columns, and an allocation of 149 GiB where it was read whole."""
    heights, folder = np.full((40, 40), 1000.0, np.float32), tmp_path / "tiles"
    write(folder / "a.tif", heights)
    write(folder / "b.tif", heights, column=40)
    far = write(folder / "far.tif", heights, column=500_000_000)
    with pytest.raises(UserError, match=r"far\.tif \(its corner at 1002783000, 1190100\) lies farthest"):
        read_dem(folder)
    Path(far).unlink()
    assert read_dem(folder).shape == (40, 80)
