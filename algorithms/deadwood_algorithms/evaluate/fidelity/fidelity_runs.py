"""The same logs at each fidelity in turn, for `compare-fidelity`, and the stored outcomes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from deadwood_algorithms.ensemble.variants import Arrays, Variant, hits_of, joined
from deadwood_algorithms.evaluate.fidelity.records import FidelityRun
from deadwood_algorithms.scene.releases import Group, Releases
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.stats.endings import ended
from deadwood_engine import FIDELITIES

WANTED = (
    "reach",
    "x",
    "y",
    "runout",
    "speed_max",
    "jump_max",
    "penetration_max",
    "energy_error",
    "unconverged",
    "steps",
    "stop_reason",
    "cpu_s",
)


def variants_of(names: Sequence[str], simulation: Simulation) -> list[Variant]:
    return [Variant(f"sliding at {name}", replace(simulation, fidelity=FIDELITIES[name])) for name in names]


def run_of(name: str, parts: Sequence[Arrays]) -> FidelityRun:
    """Outcomes of the logs at one fidelity, from the chunks of both halves."""
    of = {each: joined(parts, each) for each in WANTED}
    n, steps = of["x"].size, of["steps"].sum()
    ends = np.cumsum([part["x"].size for part in parts])
    halves = [part for part, end in zip(parts, ends, strict=True) if end <= n // 2]
    others = parts[len(halves) :]
    return FidelityRun(
        name=name,
        cpu_ms=1000.0 * float(of["cpu_s"].sum()) / n,
        steps=float(steps) / n,
        reach=of["reach"],
        x=of["x"],
        y=of["y"],
        runout=of["runout"],
        speed_max=of["speed_max"],
        jump_max=of["jump_max"],
        penetration_max=of["penetration_max"],
        energy_error=of["energy_error"],
        unconverged_share=float(of["unconverged"].sum() / max(1, steps)),
        failed=int(ended(of, "failed").sum()),
        still_moving=int(ended(of, "time_limit").sum()),
        hits=(hits_of(parts, n), hits_of(halves, n // 2), hits_of(others, n - n // 2)),
    )


def groups_of(logs: Releases, min_runout: float | None) -> list[Group]:
    nearest = logs.logs.length if min_runout is None else np.full(len(logs), min_runout)
    groups = []
    for release_id in sorted(set(logs.release_id.tolist()), key=str):
        rows = np.flatnonzero(logs.release_id == release_id)
        centre = float(logs.x[rows].mean()), float(logs.y[rows].mean())
        groups.append(Group(release_id, rows, centre, nearest[rows]))
    return groups
