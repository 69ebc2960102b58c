"""Hit counts from stored trajectories: equal to the run's, to cells counted by hand, and to shapely's outlines."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
import rasterio
import shapely
from slope_case import EAST, NORTH, Case, edit_manifest, layer, points, raster, write_dem, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results import run_folder
from deadwood_algorithms.tools import count_hits


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    return case.run(output=str(case.folder / "full"), **case.everything())


def counted(run: Path, path: Path, **changes) -> np.ndarray:
    count_hits.TOOL(run=str(run), output=str(path), overwrite=True, **changes)
    return raster(path)


def test_all_stored_trajectories_give_the_runs_own_count(full, tmp_path):
    ours = counted(full, tmp_path / "hits.tif")
    assert np.array_equal(ours, raster(full / "hit_count.tif"))
    with rasterio.open(tmp_path / "hits.tif") as made, rasterio.open(full / "hit_count.tif") as runs:
        assert made.transform == runs.transform
        assert made.crs == runs.crs
        assert made.dtypes == ("uint32",)


def test_subsets_add_up(full, tmp_path):
    whole = counted(full, tmp_path / "all.tif")
    parts = [counted(full, tmp_path / "part.tif", release_id=name) for name in ("a", "b")]
    assert np.array_equal(sum(parts), whole)
    ids = layer(full, "deposits")["log_id"].tolist()
    ones = [counted(full, tmp_path / "one.tif", log_id=str(log_id)) for log_id in ids[:6]]
    assert all(one.max() == 1 for one in ones)
    listed = counted(full, tmp_path / "six.tif", log_id=",".join(map(str, ids[:6])))
    assert np.array_equal(sum(each.astype(int) for each in ones), listed)
    reasons = layer(full, "deposits")["stop_reason"].unique()
    assert len(reasons) > 1
    by_reason = [counted(full, tmp_path / "r.tif", stop_reason=str(name)) for name in reasons]
    assert np.array_equal(sum(by_reason), whole)


def test_pieces_of_the_poses_do_not_cut_logs(full, tmp_path):
    """Row groups that end within a log, as other programs may write them, make no difference."""
    whole = counted(full, tmp_path / "all.tif")
    table = parquet.read_table(full / "poses.parquet")
    other = tmp_path / "other"
    other.mkdir()
    for name in ("manifest.json", "run.gpkg"):
        (other / name).write_bytes((full / name).read_bytes())
    edit_manifest(other)  # not the file sealed by the run
    parquet.write_table(table, other / "poses.parquet", row_group_size=17)
    assert parquet.ParquetFile(other / "poses.parquet").num_row_groups > 20
    assert np.array_equal(counted(other, tmp_path / "cut.tif"), whole)
    run = run_folder.read_run(str(other), feedback=None)  # type: ignore[arg-type]
    pieces = [np.unique(piece["log_id"]) for piece in run.poses(run.stored_log_ids)]
    assert np.array_equal(np.sort(np.concatenate(pieces)), run.stored_log_ids)


def test_coarser_cells_are_hit_by_whoever_hits_a_finer_one(full, tmp_path):
    fine = counted(full, tmp_path / "fine.tif", cell_m=1.0, log_id="5")
    coarse = counted(full, tmp_path / "coarse.tif", cell_m=5.0, log_id="5")
    assert coarse.shape == (20, 12)
    assert np.array_equal(coarse > 0, fine.reshape(20, 5, 12, 5).max(axis=(1, 3)) > 0)
    odd = counted(full, tmp_path / "odd.tif", cell_m=7.0)
    assert odd.shape == (15, 9)  # the last cells reach beyond the terrain
    with rasterio.open(tmp_path / "odd.tif") as made:
        assert made.bounds.left == EAST
        assert made.bounds.bottom == NORTH


def test_a_log_at_rest_hits_the_cells_under_its_outline(case, tmp_path):
    """By hand: 10 m from west to east within one row of 1 m cells, its thick end 40 cm wide."""
    flat = write_dem(tmp_path / "flat.tif", flat=True)
    one = write_layer(tmp_path / "one.gpkg", points((30.0, 50.5)), orientation=["lying"], azimuth_deg=[90.0])
    run = case.run(dem=flat, releases=one, output=str(tmp_path / "run"), time_limit_s=5.0)
    lies = layer(run, "deposited_logs").geometry.iloc[0]
    west, east = lies.coords[0][0] - EAST, lies.coords[1][0] - EAST
    expected = np.zeros((100, 60))
    expected[49, int(west - 0.01) : int(np.ceil(east + 0.01))] = 1  # row 49 from the north is v 50 to 51
    assert expected.sum() in (10, 11)
    assert np.array_equal(counted(run, tmp_path / "hits.tif"), expected)
    assert np.array_equal(raster(run / "deposit_count.tif"), expected)


def ends_outline(base: np.ndarray, tip: np.ndarray, base_radius: float, tip_radius: float) -> shapely.Geometry:
    """Hull, in plan, of the two end discs; by shapely from 64 points a disc."""
    axis = (tip - base) / np.linalg.norm(tip - base)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side = side / np.linalg.norm(side) if np.linalg.norm(side) > 1e-9 else np.array([1.0, 0.0, 0.0])
    up = np.cross(side, axis)
    turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)[:, None]
    rims = [end + r * (np.cos(turn) * side + np.sin(turn) * up) for end, r in ((base, base_radius), (tip, tip_radius))]
    return shapely.MultiPoint(np.vstack(rims)[:, :2]).convex_hull


def test_the_count_is_that_of_swept_outlines(full, tmp_path):
    """One log's cells against hulls of successive outlines made by another library; end discs have 8 points there."""
    table = parquet.read_table(full / "poses.parquet").to_pandas()
    cells = shapely.box(
        *np.meshgrid(EAST + np.arange(60.0), NORTH + np.arange(100.0)[::-1]),
        *(np.meshgrid(EAST + np.arange(60.0) + 1.0, NORTH + np.arange(100.0)[::-1] + 1.0)),
    )
    for log_id in (5, 8, 11):
        rows = table[table["log_id"] == log_id]
        base, tip = rows[["xb", "yb", "zb"]].to_numpy(), rows[["xt", "yt", "zt"]].to_numpy()
        outlines = [ends_outline(b, t, 0.2, 0.1) for b, t in zip(base, tip, strict=True)]
        swept = shapely.union_all([shapely.convex_hull(shapely.union(a, b)) for a, b in pairwise(outlines)])
        ours = counted(full, tmp_path / "one.tif", log_id=str(log_id)) > 0
        surely, perhaps = (shapely.intersects(cells, swept.buffer(by)) for by in (-0.02, 0.005))
        assert surely.sum() > 30
        assert (ours >= surely).all()
        assert (ours <= perhaps).all()


def test_a_run_with_few_trajectories_reports_it(case, tmp_path, said):
    run = case.run(output=str(tmp_path / "run"), trajectories="7")
    outcome = count_hits.TOOL(feedback=said, run=str(run), output=str(tmp_path / "hits.tif"))
    assert outcome.facts["n_counted"] == 7
    assert any("only 7 of the 24" in warning for warning in said.warnings)
    none = case.run(output=str(tmp_path / "none"), trajectories="none")
    with pytest.raises(UserError, match="--trajectories all"):
        counted(none, tmp_path / "none.tif")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"log_id": "6"}, "the run has no log_id '6'"),
        ({"release_id": "c"}, "it has a, b"),
        ({"stop_reason": "asleep"}, "no stop_reason 'asleep'"),
        ({"release_id": " , "}, "--release-id"),
        ({"cell_m": 1e-5}, "use a larger cell"),
        ({"cell_m": 0.0}, "greater than 0"),
    ],
)
def test_what_cannot_be_counted_is_refused_in_a_line(full, tmp_path, changes, words):
    with pytest.raises(UserError) as error:
        counted(full, tmp_path / "hits.tif", **changes)
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "hits.tif").exists()


@pytest.mark.parametrize("missing", ["manifest.json", "run.gpkg", "poses.parquet"])
def test_a_folder_that_is_no_run_is_refused(full, tmp_path, missing):
    other = tmp_path / "other"
    other.mkdir()
    for name in {"manifest.json", "run.gpkg", "poses.parquet"} - {missing}:
        (other / name).write_bytes((full / name).read_bytes())
    with pytest.raises(UserError, match=missing):
        counted(other, tmp_path / "hits.tif")
    with pytest.raises(UserError, match="does not exist"):
        counted(tmp_path / "nowhere", tmp_path / "hits.tif")
