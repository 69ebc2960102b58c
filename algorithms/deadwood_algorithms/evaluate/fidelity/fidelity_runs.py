"""The same logs at one fidelity: what `compare-fidelity` slides, and what it keeps of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.fidelity.records import FidelityRun, Hits
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.scene.releases import Group, Releases, reached
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.sliding import reporter, slide_batch, until_none_escapes
from deadwood_engine import FIDELITIES, STOP_REASONS, Rasters, Result


def slide_at(
    name: str, ask: ReleasedScene, layers: SceneLayers, logs: Releases, feedback: Feedback
) -> tuple[FidelityRun, SceneLayers]:
    """Slide the logs at one fidelity, in two halves, for the hit rasters of each.

    Also returns the scene that they needed: where logs come near the window of a large DEM, all begin again on a wider.
    """
    n = len(logs)

    def slide_all(on: SceneLayers) -> tuple[tuple[list[Result], list[NDArray[np.uint32]]], list[str]]:
        return _slide_halves(name, ask, on, logs, feedback)

    (results, counts), layers = until_none_escapes(layers, ask, slide_all, feedback)
    feedback.progress(n, n, f"sliding at {name}")

    def joined(field: str) -> NDArray[Any]:
        return np.concatenate([getattr(result, field) for result in results])

    end, start_at, reason = joined("end_position"), joined("release_position"), joined("stop_reason")
    steps = joined("steps").sum()
    return FidelityRun(
        name=name,
        cpu_ms=1000.0 * sum(result.cost["cpu_s"] for result in results) / n,
        steps=float(steps) / n,
        reach=reached(layers.lines, {"reach": joined("reach")}, logs),
        x=end[:, 0],
        y=end[:, 1],
        runout=np.hypot(*(end - start_at)[:, :2].T),
        speed_max=joined("speed_max"),
        jump_max=joined("jump_max"),
        penetration_max=joined("penetration_max"),
        energy_error=joined("energy_error"),
        unconverged_share=float(joined("unconverged").sum() / max(1, steps)),
        failed=int((reason == STOP_REASONS.index("failed")).sum()),
        still_moving=int((reason == STOP_REASONS.index("time_limit")).sum()),
        hits=(
            hits_of(counts[0] + counts[1], n, layers.dem),
            hits_of(counts[0], n // 2, layers.dem),
            hits_of(counts[1], n - n // 2, layers.dem),
        ),
    ), layers


def _slide_halves(
    name: str, ask: ReleasedScene, layers: SceneLayers, logs: Releases, feedback: Feedback
) -> tuple[tuple[list[Result], list[NDArray[np.uint32]]], list[str]]:
    """Results and hit counts of both halves, and the sides of the window that a log came too near to."""
    n = len(logs)
    results, counts = [], []
    for start, stop in ((0, n // 2), (n // 2, n)):
        rasters = Rasters.allocate(layers.scene, layers.threads)
        report = reporter(feedback, n, f"sliding at {name}", before=start)
        half = logs.logs.take(slice(start, stop))
        batch = Batch(half, first=start, goal=n)
        result, sides = slide_batch(layers, batch, FIDELITIES[name], ask, report, rasters=rasters)
        results.append(result)
        counts.append(rasters.totals()["hit_count"])
        if sides:
            return (results, counts), sides
    return (results, counts), []


def hits_of(count: NDArray[np.uint32], n_logs: int, grid: Grid) -> Hits:
    """The cells that were hit, numbered in the whole DEM, for these are few of a large terrain; and by what share."""
    row, column = np.nonzero(count)
    cells = (row + grid.first[1]) * grid.frame.shape[1] + column + grid.first[0]
    return cells, count[row, column] / max(1, n_logs)


def groups_of(logs: Releases, min_runout: float | None) -> list[Group]:
    nearest = logs.logs.length if min_runout is None else np.full(len(logs), min_runout)
    groups = []
    for release_id in sorted(set(logs.release_id.tolist()), key=str):
        rows = np.flatnonzero(logs.release_id == release_id)
        centre = float(logs.x[rows].mean()), float(logs.y[rows].mean())
        groups.append(Group(release_id, rows, centre, nearest[rows]))
    return groups
