"""slide-logs on the window of a large DEM: the results of the whole, bit for bit, at the cost of the window."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow.parquet as parquet
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from rasterio.windows import Window
from slope_case import RASTERS, layer, points, raster, summary, write_layer

from deadwood_algorithms.files.dem_windows import open_windows, read_part
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.scene import layers as scene_from_layers
from deadwood_algorithms.scene import reach as dem_reach
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.simulate import windows as scene_window
from deadwood_algorithms.tools import compare_fidelity, count_hits, slide_logs

EAST, NORTH = 2_786_000.0, 1_196_000.0  # the origin of slope_case's coordinates
CELL = 0.8  # not exact as a float: nodes must be counted in the whole DEM for the same bits
SIZE = 300
CORNER = -90.0  # of the DEM, from (EAST, NORTH)


def heights() -> np.ndarray:
    """A valley: flat for 30 m, then 35 degrees up to the north and, after a ridge, down again; rough. Row 0 south."""
    rng = np.random.default_rng(2)
    v = CORNER + (np.arange(SIZE)[:, None] + 0.5) * CELL
    slope = np.tan(np.radians(35.0)) * np.clip(v - 30.0, 0.0, 70.0) - 0.5 * np.maximum(v - 110.0, 0.0)
    return (1000.0 + slope + rng.normal(0.0, 0.03, (SIZE, SIZE))).astype(np.float32)


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Files of a large DEM with everything on it, and how to run slide-logs on them."""
    folder = tmp_path_factory.mktemp("large")
    transform = from_origin(EAST + CORNER, NORTH + CORNER + SIZE * CELL, CELL, CELL)
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": SIZE, "width": SIZE, "crs": "EPSG:2056"}
    values = heights()
    values[:20] = -9999.0
    for name, array in (("dem", values), ("friction", np.where(heights() > 1020.0, 0.5, 0.55).astype(np.float32))):
        with rasterio.open(folder / f"{name}.tif", "w", nodata=-9999.0, transform=transform, **facts) as made:
            made.write(array[::-1], 1)
    rng = np.random.default_rng(4)
    places = [(20.0 + 20.0 * a, 70.0 + 10.0 * b) for a, b in rng.random((20, 2))]
    stems = [(-40.0 + 140.0 * a, 35.0 + 60.0 * b) for a, b in rng.random((150, 2))]
    trees = {"tree_id": np.arange(150) + 900, "dbh_cm": [40.0] * 150, "height_m": [20.0] * 150}
    lines = [shapely.LineString([(-20.0, 32.0), (80.0, 31.0)]), shapely.box(100.0, 120.0, 110.0, 130.0)]
    barriers = [shapely.LineString([(25.0, 45.0), (35.0, 45.0)]), shapely.LineString([(-60.0, 40.0), (-50.0, 42.0)])]
    boulders = [(15.0 + 30.0 * a, 50.0 + 20.0 * b) for a, b in rng.random((8, 2))] + [(-80.0, 60.0), (500.0, 500.0)]
    return {
        "dem": str(folder / "dem.tif"),
        "friction": str(folder / "friction.tif"),
        "releases": write_layer(folder / "releases.gpkg", points(*places), log_id=np.arange(20) * 3 + 5),
        "trees": write_layer(folder / "trees.gpkg", points(*stems), **trees),
        "blocks": write_layer(folder / "blocks.gpkg", points(*boulders), diameter_m=[2.0] * 10, height_m=[1.5] * 10),
        "lines": write_layer(folder / "lines.gpkg", lines, line_id=["road", "house"]),
        "barriers": write_layer(folder / "barriers.gpkg", barriers, barrier_id=["a", "far"], height_m=[1.5, 2.0]),
        "dbh_cm": 40.0,
        "length_m": 9.0,
        "fidelity": "draft",
        "time_limit_s": 40.0,
        "trajectories": "all",
        "threads": 2,
    }


@pytest.fixture
def small_is_large(monkeypatch):
    """DEMs of more than 100 cells are large: read by windows, found on blocks of 8 cells."""
    monkeypatch.setattr(dem_reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(scene_window, "WHOLE_CELLS", 100)
    monkeypatch.setattr(scene_from_layers, "WHOLE_CELLS", 100)
    return monkeypatch


def run(case: dict, folder: Path, feedback=None, **changes) -> Path:
    slide_logs.TOOL(feedback=feedback, **(case | {"output": str(folder), "danger_least": 1} | changes))
    return folder


@pytest.fixture(scope="module")
def whole(case, tmp_path_factory):
    """The run on the whole DEM, with the reference height of large ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_from_layers, "WHOLE_CELLS", 100)
        return run(case, tmp_path_factory.mktemp("whole") / "run")


def assert_same_results(one: Path, other: Path) -> None:
    """As `assert_same_run`, except for what is reported of the window, and items off the DEM or beyond the window."""
    for name in ("deposits", "deposited_logs", "trajectories", "reach", "tree_hits", "barrier_hits", "block_hits"):
        a, b = layer(one, name), layer(other, name)
        assert a.geometry.to_wkb().equals(b.geometry.to_wkb())
        assert a.drop(columns="geometry").equals(b.drop(columns="geometry")), name
    assert parquet.read_table(one / "poses.parquet").equals(parquet.read_table(other / "poses.parquet"))
    for name in RASTERS:
        a, b = raster(one / f"{name}.tif"), raster(other / f"{name}.tif")
        if name == "reach_probability":
            a, b = np.nan_to_num(a), np.nan_to_num(b)
        assert np.array_equal(a, b, equal_nan=True), name
    with rasterio.open(one / "danger.tif") as a, rasterio.open(other / "danger.tif") as b:
        assert a.descriptions == b.descriptions
        assert np.array_equal(a.read(), b.read(), equal_nan=True)
    a, b = summary(one), summary(other)
    for each in (a, b):
        del each["cost"], each["modelled"], each["modelled_facts"], each["scenario"], each["counted"]
    assert a == b


def test_a_window_gives_the_bits_of_the_whole(case, whole, small_is_large, tmp_path, said):
    small_is_large.setattr(scene_window, "SLOPE_LEAST", 0.9)
    small_is_large.setattr(scene_window, "SLOPE_MOST", 0.9)
    window = run(case, tmp_path / "run", said)
    assert_same_results(whole, window)
    deposits = layer(whole, "deposits")
    assert deposits["tree_hits"].sum() > 5
    assert summary(whole)["reach"][0]["n_reach"] > 0
    words = summary(window)["modelled"]["window"]
    columns, rows = (int(word) for word in words.split(" of ")[0].split(" × "))
    assert columns * rows < 0.6 * SIZE**2
    assert summary(whole)["modelled"]["window"] == "the whole DEM"
    assert any("cells are read" in note for note in said.notes)


@pytest.mark.parametrize("first_checkpoint", [0.0, 1e9])
def test_a_first_guess_that_is_too_small_grows_until_no_log_comes_near_its_sides(
    case, whole, small_is_large, tmp_path, said, first_checkpoint
):
    """With a checkpoint after every chunk of 3 logs, and with none: finished logs are kept, or slid again."""
    small_is_large.setattr(scene_window, "SLOPE_LEAST", 20.0)
    small_is_large.setattr(scene_window, "SLOPE_MOST", 20.0)
    small_is_large.setattr(chunks, "CHUNK", 3)
    small_is_large.setattr(chunks, "CHECKPOINT_S", first_checkpoint)
    window = run(case, tmp_path / "run", said)
    assert_same_results(whole, window)
    assert sum("is read wider" in note for note in said.notes) >= 1


def test_an_interrupted_run_continues_in_the_window_that_it_had(case, whole, small_is_large, tmp_path, said):
    small_is_large.setattr(scene_window, "SLOPE_LEAST", 20.0)
    small_is_large.setattr(scene_window, "SLOPE_MOST", 20.0)
    small_is_large.setattr(chunks, "CHUNK", 3)
    small_is_large.setattr(chunks, "CHECKPOINT_S", 0.0)

    class Stops(Quiet):
        wider = done = False

        def note(self, message: str, code: str = "", **numbers: Any) -> None:
            self.wider = self.wider or "is read wider" in message

        def progress(self, done: float, total: float, what: str) -> None:
            self.done = what == "sliding logs" and done > 12

        def cancelled(self) -> bool:
            return self.wider and self.done

    with pytest.raises(Cancelled):
        run(case, tmp_path / "run", Stops())
    assert (tmp_path / ".run.part").is_dir()
    window = run(case, tmp_path / "run", said, resume=True)
    assert any("finished chunks" in note for note in said.notes)
    assert_same_results(whole, window)


def test_the_rasters_cover_the_whole_dem_and_store_the_window(case, whole, small_is_large, tmp_path):
    window = run(case, tmp_path / "run")
    for name in RASTERS:
        with rasterio.open(whole / f"{name}.tif") as one, rasterio.open(window / f"{name}.tif") as other:
            assert (one.shape, one.transform, one.crs) == (other.shape, other.transform, other.crs)
            far = other.read(1)[:5, -5:]  # the north-eastern corner, where no log comes
            assert np.isnan(far).all() if name.endswith("max") else (far == 0).all(), name
    counted = tmp_path / "hits.tif"
    held = []
    small_is_large.setattr(count_hits, "CELLS_HELD", 100)
    small_is_large.setattr(
        count_hits, "visited", lambda *given, of=count_hits.visited: held.append(of(*given)) or held[0]
    )
    count_hits.TOOL(run=str(window), output=str(counted))
    assert np.array_equal(raster(counted), raster(whole / "hit_count.tif"))
    assert held[0].part.cells < 0.3 * SIZE**2


def test_compare_fidelity_in_a_window_finds_what_it_finds_on_the_whole(case, small_is_large, tmp_path, said):
    values = {key: value for key, value in case.items() if key not in ("fidelity", "trajectories")}
    values |= {"fidelities": "draft,standard", "friction": "0.5"}
    small_is_large.setattr(scene_window, "SLOPE_LEAST", 20.0)
    small_is_large.setattr(scene_window, "SLOPE_MOST", 20.0)
    small = compare_fidelity.TOOL(feedback=said, output=str(tmp_path / "small"), **values)
    assert any("is read wider" in note for note in said.notes)
    small_is_large.setattr(scene_window, "WHOLE_CELLS", 10**9)
    large = compare_fidelity.TOOL(output=str(tmp_path / "large"), **values)
    tables = [
        [line for line in (Path(each.outputs["table"]).read_text().splitlines()) if "cpu" not in line]
        for each in (small, large)
    ]
    assert tables[0] == tables[1]


def test_until_ci_takes_the_same_logs_in_a_window(case, small_is_large, tmp_path):
    small_is_large.setattr(chunks, "CHUNK", 4)
    small_is_large.setattr("deadwood_algorithms.simulate.queue.FIRST_LOOK", 5)
    window = run(case, tmp_path / "window", until_ci=0.4)
    small_is_large.setattr(scene_window, "WHOLE_CELLS", 10**9)
    everything = run(case, tmp_path / "everything", until_ci=0.4)
    assert 0 < summary(window)["logs"]["not_run"] < 20
    assert_same_results(everything, window)


def test_a_run_that_memory_cannot_hold_is_refused_with_the_fix(case, small_is_large, tmp_path, said):
    small_is_large.setattr("deadwood_algorithms.scene.memory.free_bytes", lambda: 200_000)
    with pytest.raises(UserError, match="million cells need .* GB of memory, .* free; slide the releases of each area"):
        run(case, tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_fewer_threads_where_memory_is_short_change_nothing(case, whole, small_is_large, tmp_path, said):
    room = SIZE * SIZE * 180  # for the whole DEM with two threads and lines; the window is a little smaller
    small_is_large.setattr("deadwood_algorithms.scene.memory.free_bytes", lambda: room)
    window = run(case, tmp_path / "run", said, threads=16)
    assert any("threads are used instead of 16" in note for note in said.notes)
    assert_same_results(whole, window)


@pytest.mark.skipif(sys.platform != "linux", reason="the peak of a process' own memory is read from /proc")
def test_a_dem_of_14_gigabytes_costs_less_than_one(case, tmp_path):
    """60 000 x 60 000 cells, 3000 x 3000 of them with heights; the command's peak, including libraries."""
    side, low = 60_000, 28_500  # the valley's rows and columns begin there
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": side, "width": side, "crs": "EPSG:2056"}
    facts |= {"tiled": True, "blockxsize": 512, "blockysize": 512, "compress": "deflate", "sparse_ok": True}
    v = np.abs(np.arange(3000)[:, None] - 1500.0) * 0.5  # metres from the valley's middle
    valley = np.broadcast_to(1000.0 + 0.7 * np.maximum(v - 30.0, 0.0), (3000, 3000)).astype(np.float32)
    facts |= {"nodata": -9999.0, "transform": from_origin(EAST, NORTH, 0.5, 0.5)}
    with rasterio.open(tmp_path / "d.tif", "w", **facts) as made:
        made.write(valley, 1, window=Window(low, low, 3000, 3000))  # type: ignore[call-arg]
    x, y = EAST + (low + 1500.0) * 0.5 + np.arange(8.0), np.full(8, NORTH - (low + 1500.0) * 0.5 + 130.0)
    gpd.GeoDataFrame(geometry=gpd.points_from_xy(x, y), crs=2056).to_file(tmp_path / "r.gpkg")
    flags = {
        "dem": "d.tif",
        "releases": "r.gpkg",
        "friction": "0.5",
        "output": "run",
        "fidelity": "draft",
        "threads": "2",
    }
    code = (
        # not ru_maxrss, which begins with the peak of the process that started this one
        "import sys; from deadwood_toolbox import cli; status = cli.run(sys.argv[1:]);"
        "print(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')));"
        "sys.exit(status)"
    )
    command = [
        sys.executable,
        "-c",
        code,
        "slide-logs",
        *(part for key, value in flags.items() for part in (f"--{key}", value)),
    ]
    root = Path(__file__).parents[3]
    paths = f"{root}:{root / 'engine'}:{root / 'algorithms'}"
    ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=os.environ | {"PYTHONPATH": paths})
    assert ran.returncode == 0, ran.stderr
    peak = int(ran.stdout.split()[-1]) * 1024
    assert peak < 1.2e9
    told = summary(tmp_path / "run")
    assert told["logs"]["by_stop_reason"]["left_dem"] == 0
    assert "of the DEM's 60000 × 60000 cells" in told["modelled"]["window"]
    with rasterio.open(tmp_path / "run" / "hit_count.tif") as hits:
        assert hits.shape == (side, side)
        assert hits.read(1, window=Window(low, low, 3000, 3000)).max() >= 1  # type: ignore[call-arg]
    assert (tmp_path / "run" / "hit_count.tif").stat().st_size < 5e6


def test_the_guess_reads_little_more_than_its_answer(tmp_path, monkeypatch):
    """A cone of 45 degrees around a pit: the blocks that are read cover less than twice the resulting window."""
    monkeypatch.setattr(dem_reach, "BLOCK_CELLS", 10)
    y, x = np.mgrid[-500:500, -500:500] + 0.5
    values = (1000.0 + np.hypot(x, y)).astype(np.float32)
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 1000, "width": 1000, "crs": "EPSG:2056"}
    with rasterio.open(
        tmp_path / "d.tif", "w", transform=from_origin(EAST, NORTH, 1.0, 1.0), tiled=True, **facts
    ) as made:
        made.write(values, 1)
    place = np.array([EAST + 500.0]), np.array([NORTH - 500.0 + 100.0])
    read = []
    with open_windows(tmp_path / "d.tif", crs=None, feedback=Quiet(), look_through=False) as dem:
        take = dem_reach._block
        monkeypatch.setattr(dem_reach, "_block", lambda dem, block: read.append(block) or take(dem, block))
        part = dem_reach.first_part(dem, *place, lift_m=5.0, slope=0.5, margin_m=10.0)
    # at the pit 55 m of head are left, enough for 36 m up the other side
    rows = part.slices[0]
    assert rows.start < 450 < 600 < rows.stop
    assert part.cells < 400 * 400
    assert len(set(read)) * 100 < 2 * part.cells


def test_a_window_grows_where_it_was_touched_and_ends_at_the_dem():
    part = Part(100, 200, 40, 60)
    assert dem_reach.wider(part, ["west"], (1000, 1000)) == Part(80, 200, 60, 60)
    assert dem_reach.wider(part, ["south", "east"], (1000, 1000)) == Part(100, 170, 60, 90)
    assert dem_reach.wider(part, ["west", "south", "east", "north"], (250, 130)) == Part(80, 170, 50, 80)


def test_sides_of_the_dem_itself_are_not_watched():
    whole = Grid.empty((100, 100), 2.0, 0.0, 0.0, None)
    assert dem_reach.watched_sides(whole) == {}
    assert dem_reach.watched_sides(whole.window(Part(0, 0, 100, 100))) == {}
    assert list(dem_reach.watched_sides(whole.window(Part(0, 10, 60, 90)))) == ["south", "east"]
    lines = dem_reach.watched_sides(whole.window(Part(10, 0, 90, 100)), beyond_m=5.0)
    assert list(lines) == ["west"]
    assert lines["west"][:, 0].tolist() == [19.0 + 16 * 2.0 + 8.0 + 5.0] * 2  # the window's edge, and inward


def test_a_boulder_that_the_side_cuts_must_not_be_met(case, small_is_large):
    """A log closer to the window's side than a boulder's radius could meet one whose middle is beyond it."""
    with open_windows(case["dem"], crs=None, feedback=Quiet(), look_through=False) as dem:
        grid = read_part(dem, Part(20, 40, 200, 220), Quiet())
    watched = [
        scene_from_layers.read_scene(
            case["dem"], "0.4", None, None, None, crs=None, feedback=Quiet(), blocks=blocks, grid=grid
        ).watched
        for blocks in (None, case["blocks"])
    ]
    assert set(watched[0]) == {"west", "south", "east", "north"}
    for side, inward in {"west": (1, 0), "south": (0, 1), "east": (-1, 0), "north": (0, -1)}.items():
        moved = (watched[1][side] - watched[0][side]) @ np.array(inward)
        assert moved.tolist() == pytest.approx([1.0, 1.0])  # m, the boulders' radius
