"""Quantiles per cell compared with brute force over single logs and poses, at once and in bands; the run's maxima."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import rasterio
from hand_run import Track, write_run
from slope_case import Case, points, raster, write_layer

from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results import cell_quantiles
from deadwood_algorithms.results.cell_quantiles import largest_by_rank, quantiles_by_cell, row_bands
from deadwood_algorithms.results.hit_counts import count_of
from deadwood_algorithms.results.motion import bodies_of, energies_kj
from deadwood_algorithms.results.run_folder import read_run
from deadwood_algorithms.tools import count_hits
from deadwood_engine import sweep_hits

LEVELS = (50.0, 90.0, 95.0, 99.0)
NAMES = ("speed", "energy", "jump")
IDS = np.arange(100) * 3 + 5


@pytest.fixture(scope="module")
def full(tmp_path_factory) -> Path:
    """100 logs: in some cells enough for a quantile of 95 %, in none for one of 99 %."""
    case, rng = Case(tmp_path_factory.mktemp("case")), np.random.default_rng(2)
    spots = zip(29.0 + 2.0 * rng.random(100), 70.0 + 10.0 * rng.random(100), strict=True)
    releases = write_layer(case.folder / "many.gpkg", points(*spots), log_id=IDS)
    return case.run(trees=case.trees, friction="0.25", releases=releases)


def made(run: Path, folder: Path, **changes) -> dict[str, np.ndarray]:
    """Bands by quantity, row 0 in the south."""
    paths = {name: str(folder / f"{name}.tif") for name in NAMES}
    count_hits.TOOL(run=str(run), output=str(folder / "hits.tif"), overwrite=True, **(paths | changes))
    out = {}
    for name, path in paths.items():
        with rasterio.open(path) as source:
            out[name] = source.read()[:, ::-1]
    return out


def numpys(values, levels) -> list[float]:
    """Quantiles by numpy; none with fewer values than bound it: the largest of n is below it with p^n > 0.025."""
    few = [0.0 < p < 1.0 and max(p, 1.0 - p) ** len(values) > 0.025 for p in levels]
    return [np.nan if less or not len(values) else np.quantile(values, p) for p, less in zip(levels, few, strict=True)]


def brute_force(run: Path, cell: float, chosen=None) -> dict[str, np.ndarray]:
    """Each log's cells by sweeping each pair of its poses separately; each cell's quantiles by numpy."""
    source = read_run(str(run), feedback=Quiet())
    grid = count_hits.with_cell(source.grid, cell)
    place = {"x0": grid.x0, "y0": grid.y0, "cell": cell, "shape": grid.shape}
    held: dict[str, list[list[float]]] = {name: [[] for _ in range(grid.shape[0] * grid.shape[1])] for name in NAMES}
    for piece in source.poses(source.stored_log_ids if chosen is None else np.array(chosen)):
        energy = np.add(*energies_kj(piece, bodies_of(source)))
        facts = {"speed": piece["speed_ms"], "energy": energy, "jump": np.maximum(piece["clearance_m"], 0.0)}
        ends = [np.stack([piece[f"{name}{end}"] for name in "xyz"], axis=1) for end in "bt"]
        for log in np.unique(piece["log_row"]):
            mine = np.flatnonzero(piece["log_row"] == log)
            best = {name: np.full(grid.shape[0] * grid.shape[1], -1.0) for name in NAMES}
            for k in mine:
                pair = [max(k - 1, mine[0]), k]
                radii = [each[[log]] for each in source.radii()]
                hit = sweep_hits(np.zeros(2, int), ends[0][pair], ends[1][pair], *radii, **place).ravel() > 0
                for name in NAMES:
                    best[name][hit] = np.maximum(best[name][hit], facts[name][pair].max())
            for name in NAMES:
                for index in np.flatnonzero(best[name] >= 0.0):
                    held[name][index].append(best[name][index])
    return {
        name: np.array([numpys(each, np.array(LEVELS) / 100) for each in cells])
        .T.reshape(4, *grid.shape)
        for name, cells in held.items()
    }  # fmt: skip


@pytest.fixture(scope="module")
def expected(full) -> dict[str, np.ndarray]:
    return brute_force(full, 5.0)


@pytest.mark.parametrize("most", [20_000_000, 150])
def test_every_cell_is_as_by_brute_force(full, expected, tmp_path, monkeypatch, most):
    """In one band, and in about as many as there are rows, as in a large run; float32 in the files."""
    monkeypatch.setattr(cell_quantiles, "HITS_AT_ONCE", most)
    ours = made(full, tmp_path, cell_m=5.0)
    hits = raster(tmp_path / "hits.tif")[::-1]
    assert hits.max() >= 72
    for name in NAMES:
        for band, least in zip(ours[name], (6, 36, 72, 368), strict=True):
            assert np.array_equal(np.isnan(band), hits < least), name
        assert np.allclose(ours[name], expected[name], rtol=1e-5, atol=1e-6, equal_nan=True), name
        assert (np.diff(ours[name][:3], axis=0)[:, hits >= 72] >= 0.0).all()


def test_a_subset_has_its_own_quantiles(full, tmp_path):
    some = IDS[::3]
    ours, theirs = made(full, tmp_path, cell_m=6.0, log_id=",".join(map(str, some))), brute_force(full, 6.0, some)
    for name in NAMES:
        assert np.isfinite(ours[name][0]).sum() > 10
        assert np.allclose(ours[name], theirs[name], rtol=1e-5, atol=1e-6, equal_nan=True)


def test_the_largest_is_the_runs_own_maximum(full, tmp_path):
    """The 100 % quantile at the run's cells, compared with the rasters that watched every step: nowhere above them, and
    mostly equal. Both count the pose from which a swept area starts. The rotation of the axis is derived from poses
    some distance apart, so the energy may be higher by a quarter.
    """
    ours = made(full, tmp_path, quantiles="100")
    for name, slack, more in (("speed", 1e-6, 1e-6), ("energy", 0.25, 0.1), ("jump", 1e-6, 1e-6)):
        runs = raster(full / f"{name}_max.tif")[::-1]
        known = ~np.isnan(runs)
        assert np.array_equal(known, ~np.isnan(ours[name][0]))
        a, b = ours[name][0][known], runs[known]
        assert (a <= b * (1.0 + slack) + more).all(), name
        high = b >= np.median(b)
        assert np.median(a[high]) >= 0.9 * np.median(b[high]), name  # the slope is too smooth for jumps


def test_by_hand(tmp_path):
    """Seven logs over the same ground at 5 to 20 m/s, 87.965 kg each: too few for a quantile of 75 %."""
    speeds = (5.0, 6.0, 7.0, 10.0, 15.0, 18.0, 20.0)
    tracks = [Track((30.0, 60.0), (30.0, 20.0), speed=v, clearance=v / 10.0) for v in speeds]
    ours = made(write_run(tmp_path / "run", tracks), tmp_path, quantiles="0,50,75,100")
    for name, values in (("speed", (5, 10, np.nan, 20)), ("jump", (0.5, 1.0, np.nan, 2.0))):
        assert ours[name][:, 40, 30] == pytest.approx(values, nan_ok=True)
    kj = 0.5 * 87.965 / 1000.0
    assert ours["energy"][:, 40, 30] == pytest.approx([kj * 25, kj * 100, np.nan, kj * 400], rel=1e-4, nan_ok=True)
    assert np.isnan(ours["speed"][:, 5, 5]).all()
    with rasterio.open(tmp_path / "energy.tif") as source:
        assert source.descriptions == ("energy, 0 %", "energy, 50 %", "energy, 75 %", "energy, 100 %")
        assert source.units == ("kJ",) * 4
        assert np.isnan(source.nodata)


def test_the_largest_by_rank_are_counted_from_above(tmp_path):
    """What a share of the logs brings at least: of four logs at 3, 9, 5 and 7 m/s the second brings 7."""
    tracks = [Track((30.0, 60.0), (30.0, 20.0), speed=v) for v in (3.0, 9.0, 5.0, 7.0)]
    source = read_run(str(write_run(tmp_path / "run", [*tracks, Track((10.0, 60.0), (10.0, 20.0))])), feedback=Quiet())
    counts = count_of(source, source.stored_log_ids, source.grid, Quiet())
    ranks = (1, 2, 4, 5)
    found = largest_by_rank(source, source.stored_log_ids, counts, source.grid, "speed", ranks, Quiet())
    assert found[:, 40, 30] == pytest.approx([9.0, 7.0, 3.0, np.nan], nan_ok=True)
    assert found[:, 40, 10] == pytest.approx([10.0, np.nan, np.nan, np.nan], nan_ok=True)


def test_bands_of_rows():
    assert list(row_bands(np.array([3, 4, 20, 1, 1, 0]), 8)) == [slice(0, 2), slice(2, 3), slice(3, 6)]
    assert list(row_bands(np.array([0, 0]), 8)) == [slice(0, 2)]


def test_sorting_by_bits_is_sorting():
    rng = np.random.default_rng(1)
    counts = rng.integers(0, 30, 500)
    start = np.concatenate([[0], np.cumsum(counts)])
    values = (10.0 ** rng.uniform(-30, 30, start[-1])).astype(np.float32)
    values[::7] = 0.0
    ours = quantiles_by_cell(values, start, [0.0, 0.31, 1.0])
    for cell, (low, high) in enumerate(pairwise(start)):
        expected = numpys(values[low:high].astype(float), [0.0, 0.31, 1.0])
        assert ours[:, cell] == pytest.approx(expected, rel=1e-6, nan_ok=True)


@pytest.mark.parametrize("quantiles", ["", "high", "50,101", "-1", "50,50"])
def test_quantiles_that_are_none(full, tmp_path, quantiles):
    with pytest.raises(UserError, match="--quantiles"):
        made(full, tmp_path, quantiles=quantiles)
    assert list(tmp_path.iterdir()) == []
