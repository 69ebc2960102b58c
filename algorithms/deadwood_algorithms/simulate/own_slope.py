"""A sample of a run's own logs slides again at a finer fidelity: how far is the run's reach off on this very slope?

The error of a fidelity is measured on the benchmark's slopes. Another slope may have what those lack, and nothing in a
run shows it: logs that slide too far conserve energy just as well. A sample is too small to prove a run right, but 200
logs find an error of 10 points three times in four, and one of 15 almost always.

The sample is the first logs in the order of the hash of seed and id, so it depends on neither threads nor order. It
is stored beside the run's chunks. What it takes is planned with the costs of the benchmark page, never with a clock:
every machine slides the same logs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.run_options import FidelityOptions
from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import reached, starts_inside
from deadwood_algorithms.simulate.chunks import ChunkedRun
from deadwood_algorithms.simulate.fidelity_trade import COSTS
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.sinking import Sinking
from deadwood_algorithms.simulate.sliding import reporter, slide_once, until_none_escapes
from deadwood_engine import FIDELITIES, Fidelity, fidelity_with

# The finer fidelities of each, the first of which is taken unless its smallest sample is too expensive
FINER = {"draft": ("fine", "standard"), "standard": ("fine",), "fine": ("reference",)}
LEAST, MOST = 100, 200  # logs of a sample, if the run has as many
SHARE = 0.2  # of the run's cost that a sample of more than LEAST logs may take


@dataclass(frozen=True)
class Check:
    """How a run is checked: at which fidelity, and on how many of its logs."""

    finer: str
    logs: int


@dataclass(frozen=True)
class Sample:
    """The logs that slid again, in the order of the releases; reach (n, lines); cpu_s : time of all cores."""

    finer: str
    log_id: NDArray[np.int64]
    reach: NDArray[np.bool_]
    cpu_s: float


def check_of(fidelity: str, logs: int, asked: int | None) -> Check | None:
    """The check of a run of so many logs; None if it was not wanted, or if nothing is finer.

    asked : logs of the sample; None: as many as are worth it
    """
    if asked == 0 or fidelity not in FINER:
        return None
    least, most = (LEAST, MOST) if asked is None else (asked, asked)
    found = None
    for finer in FINER[fidelity]:
        affordable = int(SHARE * logs * COSTS[fidelity] / COSTS[finer])
        found = Check(finer, min(logs, max(least, min(most, affordable))))
        if affordable >= least:
            break
    return found


def again_in_logs(fidelity: str, logs: int, asked: int | None) -> float:
    """What the check of a run costs at most, in logs of the run: they end once they have reached every line."""
    check = check_of(fidelity, logs, asked)
    return check.logs * COSTS[check.finer] / COSTS[fidelity] if check else 0.0


def finer_row(finer: str, time_step_s: float | None, station_spacing_m: float | None) -> Fidelity:
    """The numbers of the finer fidelity: nowhere coarser than what the user asked of the run."""
    row = FIDELITIES[finer]
    step = None if time_step_s is None else min(time_step_s, row.time_step)
    spacing = None if station_spacing_m is None else min(station_spacing_m, row.station_spacing)
    return fidelity_with(finer, step, spacing)


def own_sample(done: ChunkedRun, fidelity: str, options: FidelityOptions, seed: int) -> Sample | None:
    """Slide the sample of a finished run; None if it has no lines, or if none is wanted or finer."""
    check = check_of(fidelity, done.queue.slid, options.own_slope_logs) if done.slope.layers.lines.ids else None
    if check is None:
        return None
    return slide_sample(done, check, finer_row(check.finer, options.time_step_s, options.station_spacing_m), seed)


def slide_sample(done: ChunkedRun, check: Check, fidelity: Fidelity, seed: int) -> Sample:
    """Slide the sample of a finished run, unless it is stored with it."""
    rows, _ = done.queue.slid_rows()
    log_id = done.releases.logs.log_id[rows]
    chosen = np.sort(hash_order(log_id, seed)[: check.logs])
    releases = done.releases.take(rows[chosen])
    simulation = replace(done.simulation, fidelity=fidelity, counts_danger=False, sinking=Sinking())

    def slide_on(layers: SceneLayers) -> tuple[tuple[NDArray[np.bool_], float], list[str]]:
        inside = layers.by_scene_line(starts_inside(layers.lines, releases), sides=True)
        report = reporter(done.feedback, check.logs, f"sliding some again at {check.finer}")
        result, sides = slide_once(layers, releases.logs, simulation, report, inside=inside, until_reached=True)
        return (reached(layers.lines, {"reach": result.reach}, releases), result.cost["cpu_s"]), sides

    def slide() -> dict[str, NDArray]:
        try:
            (reach, cpu_s), _ = until_none_escapes(done.slope.layers, simulation, slide_on, done.feedback)
        except (Cancelled, UserError):
            done.feedback.note(
                f"{counted(rows.size, 'log')} are kept in {done.work.path}; --resume continues from there"
            )
            raise
        return {"reach": reach, "cpu_s": np.array(cpu_s)}

    stored = done.work.once(f"own_slope_{check.finer}_{check.logs}", slide)
    return Sample(check.finer, log_id[chosen], stored["reach"], float(stored["cpu_s"]))
