"""Each log's largest value a cell against one sweep a pair of poses; quantities by hand; what cannot be placed."""

import numpy as np
import pytest

from deadwood_engine import sweep_hits
from deadwood_engine.peaks import CellPeaks

CELL, SHAPE = 0.7, (30, 24)


def random_logs(seed: int, logs: int = 7) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    count = rng.integers(1, 9, logs)
    log_row = np.repeat(np.arange(logs), count)
    start = rng.uniform((0.0, 0.0, 0.0), (17.0, 21.0, 9.0), (logs, 3))[log_row]
    base = start + np.cumsum(rng.normal(0.0, 0.8, (log_row.size, 3)), axis=0)
    axis = rng.normal(size=(log_row.size, 3))
    tip = base + 5.0 * axis / np.linalg.norm(axis, axis=1)[:, None]
    values = rng.uniform(0.0, 30.0, (2, log_row.size))
    return log_row, base, tip, np.full(logs, 0.4), np.full(logs, 0.2), values


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("rows", [slice(0, 30), slice(11, 19)])
def test_the_peaks_are_those_of_single_sweeps(seed, rows):
    """Brute force: two poses alone at a time say which cells they sweep; the largest of a log's sweeps is its peak."""
    log_row, base, tip, big, small, values = random_logs(seed)
    place = {"x0": 3.0, "y0": 2.0 + CELL * rows.start, "cell": CELL}
    shape = (rows.stop - rows.start, SHAPE[1])
    counts = sweep_hits(log_row, base, tip, big, small, shape=shape, **place)
    peaks = CellPeaks(counts, 2)
    for chosen in (log_row < 3, log_row >= 3):  # in two pieces, as poses are read
        peaks.add(log_row[chosen], base[chosen], tip[chosen], big, small, values[:, chosen], **place)

    expected: list[list[tuple[float, float]]] = [[] for _ in range(counts.size)]
    for log in range(big.size):
        mine = np.flatnonzero(log_row == log)
        best = np.full((2, counts.size), -1.0)
        for k in mine:
            pair = [max(k - 1, mine[0]), k]
            alone = sweep_hits(np.zeros(2, int), base[pair], tip[pair], big[:1], small[:1], shape=shape, **place)
            hit = alone.ravel() > 0
            best[:, hit] = np.maximum(best[:, hit], values[:, pair].max(axis=1)[:, None])
        for cell in np.flatnonzero(best[0] >= 0.0):
            expected[cell].append(tuple(best[:, cell].astype(np.float32)))
    assert counts.sum() > 20
    for cell, logs in enumerate(expected):
        stored = peaks.peaks[:, peaks.start[cell] : peaks.start[cell + 1]]
        assert list(zip(*stored.tolist(), strict=True)) == logs


def test_counts_of_other_logs_are_refused():
    log_row, base, tip, big, small, values = random_logs(1)
    place = {"x0": 0.0, "y0": 0.0, "cell": CELL}
    first = log_row == 0
    counts = sweep_hits(log_row[first], base[first], tip[first], big, small, shape=SHAPE, **place)
    with pytest.raises(ValueError, match="not of these logs"):
        CellPeaks(counts, 2).add(log_row, base + 0.0, tip, big, small, values, **place)
