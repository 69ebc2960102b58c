"""How much the results of the same logs at a coarser fidelity differ from those of the finest: pure functions on
arrays.

Trajectories of single logs diverge among trees at any fidelity, so the comparison uses what users take from a run:
probabilities, distributions, maps. Each difference comes with a measure of chance: an interval over the logs (McNemar's
pairs, normal, or order statistics) or, for distances between distributions, which are never negative, the distance
between two halves of the finest run's own logs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.fidelity.records import Array, FidelityRow, FidelityRun, Hits
from deadwood_algorithms.evaluate.fidelity.rule import verdict_of_distance, verdict_of_interval
from deadwood_algorithms.scene.releases import Group
from deadwood_algorithms.stats.directions import spread_change, spread_of_release
from deadwood_algorithms.stats.order_statistics import paired_percentiles, quantiles
from deadwood_algorithms.stats.statistics import Z_95, paired_interval, wilson_interval

SPLITS = 32  # ways to halve the logs for the noise of the deposit distance


def rows_of(
    one: FidelityRun, finest: FidelityRun, line_ids: list[Any], groups: list[Group], planned: int, seed: int
) -> list[FidelityRow]:
    """All measures of one fidelity; ``planned`` is the number of logs whose noise is the yardstick."""
    rows = [
        FidelityRow(one.name, "cpu_per_log", "", "ms", one.cpu_ms, finest.cpu_ms),
        FidelityRow(one.name, "steps_per_log", "", "1", one.steps, finest.steps),
        *reach_rows(one, finest, line_ids, planned),
        *spread_rows(one, finest, groups),
        deposit_row(one, finest, planned, seed),
        hits_row(one, finest, planned),
        *top_rows(one, finest, "speed_max", "m/s"),
        *top_rows(one, finest, "jump_max", "m"),
        *own_rows(one, finest),
    ]
    if one is finest:  # the reference of the comparison: only a finer run could show its error
        return [replace(row, ci_low=math.nan, ci_high=math.nan, verdict="") for row in rows]
    return rows


def reach_rows(one: FidelityRun, finest: FidelityRun, line_ids: list[Any], planned: int) -> Iterator[FidelityRow]:
    for column, line_id in enumerate(line_ids):
        p, p_finest, low, high = paired_reach(one.reach[:, column], finest.reach[:, column])
        bottom, top = wilson_interval(round(p_finest * planned), planned)
        noise = (top - bottom) / 2.0
        verdict = verdict_of_interval(low, high, noise)
        yield FidelityRow(one.name, "reach", str(line_id), "1", p, p_finest, p - p_finest, low, high, noise, verdict)


def paired_reach(ours: NDArray[np.bool_], theirs: NDArray[np.bool_]) -> tuple[float, float, float, float]:
    """Shares of the same logs that reach a line in two runs, and the interval of the first minus the second."""
    ends = paired_interval(int((theirs & ~ours).sum()), int((ours & ~theirs).sum()), ours.size)
    return float(ours.mean()), float(theirs.mean()), *ends


def half_width(values: Array) -> float:
    """Half-width of the 95 % interval of the mean; infinite for a single value."""
    return Z_95 * float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else math.inf


def spread_rows(one: FidelityRun, finest: FidelityRun, groups: list[Group]) -> Iterator[FidelityRow]:
    """Angle from the 5 % to the 95 % quantile of each release's deposits; the smallest arc depends on a single log."""
    for group in groups:
        seen = [
            spread_of_release(group.centre, run.x[group.rows], run.y[group.rows], group.min_runout)
            for run in (one, finest)
        ]
        change = spread_change(*seen)
        if math.isfinite(change[0]):
            ours, theirs = (each[0]["p05_p95_deg"] for each in seen)
            yield FidelityRow(one.name, "spread_p05_p95", str(group.release_id), "deg", ours, theirs, *change)


def deposit_row(one: FidelityRun, finest: FidelityRun, planned: int, seed: int) -> FidelityRow:
    """Wasserstein distance between the run-outs: by how many metres a deposit is moved on average."""
    distance = wasserstein(one.runout, finest.runout)
    verdict, noise = verdict_of_distance(distance, split_half(finest.runout, seed), len(one.x), planned)
    means = float(one.runout.mean()), float(finest.runout.mean())
    return FidelityRow(one.name, "deposit_distance", "", "m", *means, distance, noise=noise, verdict=verdict)


def hits_row(one: FidelityRun, finest: FidelityRun, planned: int) -> FidelityRow:
    """1 minus the weighted Jaccard index of the maps of hit probability; the values are the cells that were hit."""
    distance = jaccard_distance(one.hits[0], finest.hits[0])
    halves = jaccard_distance(finest.hits[1], finest.hits[2])
    verdict, noise = verdict_of_distance(distance, halves, len(one.x), planned)
    sizes = float(one.hits[0][0].size), float(finest.hits[0][0].size)
    return FidelityRow(one.name, "hit_raster_distance", "", "1", *sizes, distance, noise=noise, verdict=verdict)


def top_rows(one: FidelityRun, finest: FidelityRun, name: str, unit: str) -> Iterator[FidelityRow]:
    """Mean and 95 % quantile, over the logs, of the largest value of each."""
    ours, theirs = getattr(one, name), getattr(finest, name)
    change = ours - theirs
    mean, half = float(change.mean()), half_width(change)
    means = float(ours.mean()), float(theirs.mean())
    yield FidelityRow(one.name, f"{name}_mean", "", unit, *means, mean, mean - half, mean + half)

    found, shift, low, high = paired_percentiles(ours, theirs, 0.95)
    if math.isfinite(shift):
        value = found["value"]
        yield FidelityRow(one.name, f"{name}_p95", "", unit, value, value - shift, shift, low, high)


def own_rows(one: FidelityRun, finest: FidelityRun) -> Iterator[FidelityRow]:
    """Numerical measures of each run itself; the ideal is 0."""
    for name, unit in (("penetration_max", "m"), ("energy_error", "1")):
        ours, theirs = getattr(one, name), getattr(finest, name)
        middle, theirs_middle = (float(quantiles(each, [0.5])[0]) for each in (ours, theirs))
        yield FidelityRow(one.name, f"{name}_median", "", unit, middle, theirs_middle)
        yield FidelityRow(one.name, name, "", unit, float(ours.max()), float(theirs.max()))
    yield FidelityRow(one.name, "unconverged_steps", "", "1", one.unconverged_share, finest.unconverged_share)
    yield FidelityRow(one.name, "failed", "", "logs", one.failed, finest.failed)
    yield FidelityRow(one.name, "still_moving", "", "logs", one.still_moving, finest.still_moving)


def wasserstein(a: Array, b: Array) -> float:
    """First Wasserstein distance of two samples of any sizes: the area between their distribution functions."""
    everything = np.sort(np.concatenate([a, b]))
    at_a = np.searchsorted(np.sort(a), everything[:-1], side="right") / a.size
    at_b = np.searchsorted(np.sort(b), everything[:-1], side="right") / b.size
    return float(np.sum(np.abs(at_a - at_b) * np.diff(everything)))


def split_half(values: Array, seed: int) -> float:
    """Mean distance between two random halves."""
    rng = np.random.default_rng(seed)
    half = values.size // 2
    shuffled = (rng.permutation(values) for _ in range(SPLITS))
    return float(np.mean([wasserstein(each[:half], each[half:]) for each in shuffled])) if half else math.nan


def jaccard_distance(a: Hits, b: Hits) -> float:
    """1 - sum(min(p, q)) / sum(max(p, q)) over the cells; 0 if neither run hit any cell."""
    cells = np.union1d(a[0], b[0])
    p, q = np.zeros(cells.size), np.zeros(cells.size)
    p[np.searchsorted(cells, a[0])] = a[1]
    q[np.searchsorted(cells, b[0])] = b[1]
    return 1.0 - float(np.minimum(p, q).sum() / np.maximum(p, q).sum()) if cells.size else 0.0
