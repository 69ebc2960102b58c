"""Small studies in addition to the large one: short restarts, and the engine's savings for simpler scenes.

Trajectories among bumps and trees are chaotic, so over a whole slide only distributions can be compared. Over a
quarter of a second they can be compared log by log: that shows the order of the method itself.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.statistics import Z_95, wilson_interval
from deadwood_engine import FIDELITIES, Fidelity, Logs, Rasters, Result, Scene, Start, place_logs, slide

from . import measures, scenes, study
from .settings import REFERENCE, STANDARD, UNBOUND

RESTART_AT, HORIZON = (2.0, 4.0, 6.0), 0.25  # [s]
RESTART_STEPS = (0.010, 0.005, 0.0025, 0.00125)  # [s]
RESTART_TRUTH = HORIZON / 2560  # [s], a tenth of a millisecond
CRAWL_AT, CRAWL_SPEEDS, CRAWL_FOR = (5.0, 10.0, 20.0, 30.0, 40.0), (0.1, 2.0), 2.0  # [s], [m/s], [s]
CRAWL_BLOCKS = 8
CRAWL_SPACINGS, CRAWL_DENSE = (2.0, 1.0, 0.5, 0.25), 0.125  # [m]
PLANE_SPACING = 4.0  # [m]
SWITCH_LOGS = 2000  # for comparisons in which too few logs would hide a difference in reach
SWITCH_REPEATS = 5
# cells of a window beside the slope; otherwise the end of a log beyond it would have no ground
BESIDE = 128
MANY, MANY_REPEATS = 20_000, 3  # number of logs whose wall time is measured, and repetitions
LARGE = 4000  # cells along a side of the DEM from which a window is cut


def _node_time(step: float) -> float:
    """Time limit at which runs with this constant step stop when they have reached HORIZON."""
    return HORIZON - 0.75 * step


def _on_the_way(
    scene: Scene, row: Fidelity, moments: tuple[float, ...], speeds: tuple[float, float], blocks: int, threads: int
) -> Start:
    """Logs in motion, some time after their release; those faster than a limit."""
    starts = []
    for block in range(blocks):
        start = place_logs(scene, scenes.logs_of_block(block, study.BLOCK))
        for moment in moments:
            state = slide(scene, start, row, time_limit=moment, threads=threads)
            speed = np.hypot(*state.last_state[:, 7:9].T)
            chosen = (speed > speeds[0]) & (speed < speeds[1]) & (state.duration >= moment)
            starts.append(Start(state.frame[chosen], state.last_state[chosen], start.body[chosen]))
    return Start(
        np.vstack([s.frame for s in starts]), np.vstack([s.state for s in starts]), np.vstack([s.body for s in starts])
    )


def crawls(*, threads: int) -> dict[str, Any]:
    """Slow logs on the rough slope, released from the same states with different rings: how far down they get.

    A cone has no rings, so their spacing must have no influence.
    """
    scene = scenes.build("rough").scene
    start = _on_the_way(scene, STANDARD, CRAWL_AT, CRAWL_SPEEDS, CRAWL_BLOCKS, threads)

    def way(spacing: float) -> tuple[NDArray, NDArray]:
        row = STANDARD._replace(station_spacing=spacing, spacing_cells=UNBOUND)
        result = slide(scene, start, row, time_limit=CRAWL_FOR, threads=threads)
        return result.release_position[:, 1] - result.end_position[:, 1], result.duration >= CRAWL_FOR

    dense, slid = way(CRAWL_DENSE)
    rows = []
    for spacing in CRAWL_SPACINGS:
        ours, too = way(spacing)
        both = slid & too
        apart = (ours - dense)[both]
        half = Z_95 * apart.std() / np.sqrt(len(apart))
        share = apart.mean() / dense[both].mean()
        rows.append(
            {
                "spacing_m": spacing, "logs": len(apart), "way_m": float(dense[both].mean()), "share": float(share),
                "half": float(half / dense[both].mean()),
            }
        )  # fmt: skip
    return {"dense_m": CRAWL_DENSE, "seconds": CRAWL_FOR, "speeds_ms": CRAWL_SPEEDS, "rows": rows}


def on_the_plane(*, threads: int) -> dict[str, Any]:
    """The plane with each row's rings and with few: a cone on a plane touches along a line."""
    scene, logs, rows = scenes.build("plane").scene, _blocks(study.BLOCK), []
    for name in ("standard", "fine", "reference"):
        few = FIDELITIES[name]._replace(station_spacing=PLANE_SPACING, spacing_cells=UNBOUND)
        for row, rings in ((FIDELITIES[name], "its own"), (few, f"{PLANE_SPACING:g} m")):
            result = slide(scene, logs, row, time_limit=study.TIME_LIMIT, threads=threads)
            reached = int(result.reach[:, -1].sum())
            low, high = wilson_interval(reached, study.BLOCK)
            rows.append(
                {
                    "fidelity": name, "rings": rings, "contacts": result.cost["contacts"] / float(result.steps.sum()),
                    "p": reached / study.BLOCK, "low": low, "high": high,
                }
            )  # fmt: skip
    return {"rows": rows}


def restarts(name: str, blocks: int, *, threads: int) -> dict[str, Any]:
    """Moving logs, released from the same states with different steps, and their distances after HORIZON."""
    scene = scenes.build(name).scene
    start = _on_the_way(scene, REFERENCE, RESTART_AT, (1.0, np.inf), blocks, threads)

    def run(step: float) -> tuple[NDArray, Result]:
        row = STANDARD._replace(time_step=step, travel_cells=UNBOUND, roll_angle=UNBOUND, tolerance=1e-5, sweeps=5000)
        result = slide(scene, start, row, time_limit=_node_time(step), threads=threads)
        return np.hstack([result.base_end, result.tip_end]), result

    truth, exact = run(RESTART_TRUTH)
    points = []
    for step in RESTART_STEPS:
        ends, result = run(step)
        together = np.abs(result.duration - exact.duration) < 1e-6  # neither left the DEM nor came to rest
        apart = np.sqrt(0.5 * np.sum((ends - truth)[together] ** 2, axis=1))
        points.append(
            {
                "step_ms": 1e3 * step,
                "logs": int(together.sum()),
                "median_m": float(np.median(apart)),
                "p90_m": float(np.quantile(apart, 0.9)),
            }
        )
    slope = np.polyfit(np.log([p["step_ms"] for p in points]), np.log([p["median_m"] for p in points]), 1)[0]
    return {"horizon_s": HORIZON, "truth_ms": 1e3 * RESTART_TRUTH, "order": float(slope), "points": points}


def all_restarts(*, threads: int) -> dict[str, Any]:
    """Restarts on the scenes whose steps depend on the time step only: those without obstacles."""
    return {"scenes": {name: restarts(name, 1, threads=threads) for name in ("rough", "gully")}}


def _cost(
    scene: Scene, start: Start, threads: int, *, row: Fidelity = STANDARD, **options: Any
) -> tuple[float, Result]:
    """Median CPU seconds of a few runs, and the result."""
    spent = []
    result = slide(scene, start, row, time_limit=study.TIME_LIMIT, threads=threads, **options)
    for _ in range(SWITCH_REPEATS):
        options = {k: study.fresh_rasters(scene, threads) if k == "rasters" else v for k, v in options.items()}
        result = slide(scene, start, row, time_limit=study.TIME_LIMIT, threads=threads, **options)
        spent.append(result.cost["cpu_s"])
    return float(np.median(spent)), result


def _same(one: Result, other: Result) -> bool:
    return bool(np.array_equal(one.end_position, other.end_position) and np.array_equal(one.steps, other.steps))


def _blocks(number: int) -> Logs:
    """The first logs of the study."""
    blocks = [scenes.logs_of_block(k, study.BLOCK) for k in range(number // study.BLOCK)]
    return Logs(**{name: np.concatenate([getattr(b, name) for b in blocks]) for name in vars(blocks[0])})


def switches(*, threads: int) -> dict[str, Any]:
    """Pairs of runs at ``standard`` that differ in one requirement of a scene or an analyst."""
    found = []
    line = scenes.CASES["forest"].line_row

    def pair(what: str, less: tuple[float, Result], more: tuple[float, Result]) -> None:
        steps = [int(r.steps.sum()) for _, r in (less, more)]
        found.append(
            {
                "what": what,
                "less_ms_per_log": 1e3 * less[0] / len(less[1].steps),
                "more_ms_per_log": 1e3 * more[0] / len(more[1].steps),
                "less_us_per_step": 1e6 * less[0] / steps[0],
                "more_us_per_step": 1e6 * more[0] / steps[1],
                "same": _same(less[1], more[1]),
                "logs": len(less[1].steps),
            }
        )
        if not found[-1]["same"]:
            found[-1]["difference"] = measures.reach_difference(more[1].reach[:, line], less[1].reach[:, line])

    logs = scenes.logs_of_block(0, study.BLOCK)
    forest, rough = scenes.build("forest").scene, scenes.build("rough").scene
    start, open_start = place_logs(forest, logs), place_logs(rough, logs)
    plain = _cost(forest, start, threads)
    pair(
        "nothing more: the same run again, for what timing on this machine can tell",
        plain,
        _cost(forest, start, threads),
    )
    pair("the five rasters", plain, _cost(forest, start, threads, rasters=study.fresh_rasters(forest, threads)))
    pair("poses of every log", plain, _cost(forest, start, threads, keep_poses=np.ones(len(logs), bool)))
    open_run = _cost(rough, open_start, threads)
    pair("trees where no log comes", open_run, _cost(_with_far_trees(), open_start, threads))
    pair("trees among the logs", open_run, plain)
    far = "a bound on the terrain's kinks spares rings a search for contacts (with), or does not (without); forest"
    many = place_logs(forest, _blocks(SWITCH_LOGS))
    pair(far, _cost(_unculled(forest), many, threads), _cost(forest, many, threads))
    large = [_in_a_large_dem(window) for window in (False, True)]
    whole, part = (
        (spent + cost, result)
        for spent, scene in large
        for placed in [place_logs(scene, logs)]
        for cost, result in [_cost(scene, placed, threads, rasters=study.fresh_rasters(scene, threads))]
    )
    of_it = f"the window that logs can reach of a DEM of {LARGE} x {LARGE} cells (with), or all of it (without)"
    pair(f"{of_it}; forest with rasters, laying out the scene included", whole, part)
    endless = _cost(forest, start, threads, rest_speed=1e-9)
    pair("every log until the time limit: no certificate of rest", plain, endless)
    return {"rows": found}


def speed(*, threads: int) -> dict[str, Any]:
    """Wall time of MANY logs in the forest, rasters included, kernels loaded: the median of a few runs."""
    scene = scenes.build("forest").scene
    start, found = place_logs(scene, _blocks(MANY)), []

    def timed(name: str) -> tuple[float, float, NDArray]:
        rasters = Rasters.allocate(scene, threads)
        began = time.perf_counter()
        result = slide(scene, start, FIDELITIES[name], time_limit=study.TIME_LIMIT, threads=threads, rasters=rasters)
        return time.perf_counter() - began, result.cost["cpu_s"], result.penetration_max

    for name in ("draft", "standard"):
        walls, cpus, (depth, *_) = zip(*(timed(name) for _ in range(MANY_REPEATS)), strict=True)
        row = {"fidelity": name, "logs": MANY, "runs": MANY_REPEATS, "threads": threads}
        row |= {"wall_s": float(np.median(walls)), "cpu_s": float(np.median(cpus))}
        found.append(row | {"deepest_m": float(depth.max()), "deeper_than_25_cm": int((depth > 0.25).sum())})
    return {"rows": found}


def _unculled(scene: Scene) -> Scene:
    """The scene without a bound on its kinks: every active ring is checked for contacts."""
    terrain = scene.arrays.terrain
    kinks = np.full_like(terrain.kinks, np.iinfo(np.uint32).max)
    return replace(scene, arrays=scene.arrays._replace(terrain=terrain._replace(kinks=kinks)))


def _in_a_large_dem(window: bool) -> tuple[float, Scene]:
    """The forest in the middle of a large DEM: all of it, or the window that contains it, and the CPU seconds to
    prepare it.
    """
    case = scenes.CASES["forest"]
    cell, heights = case.cell, scenes.ground("forest", case.cell)
    row, column = ((LARGE - n) // 2 for n in heights.shape)
    reference, first = float(np.floor(heights.min())), (column - BESIDE, row - BESIDE)
    margins = [(BESIDE, BESIDE)] * 2
    if not window:
        margins, first = [(at, LARGE - n - at) for at, n in zip((row, column), heights.shape, strict=True)], (0, 0)
    heights = np.pad(heights, margins, mode="edge")
    corner = 0.5 * cell - column * cell, 0.5 * cell - row * cell
    trees = scenes.forest(case.stems)

    def prepare() -> tuple[float, Scene]:
        began = time.process_time()
        scene = Scene.prepare(
            heights, cell, *corner, friction=case.friction, trees=trees, first=first, reference=reference
        )
        return time.process_time() - began, scene

    prepare()  # the first may compile
    return prepare()


def _with_far_trees() -> Scene:
    """The rough slope with as many trees as the forest has, all beyond the logs' reach at its upper end."""
    trees = scenes.forest(scenes.STEMS_PER_HA)
    case = scenes.CASES["rough"]
    far = trees._replace(y=scenes.LENGTH - 1.0 - 40.0 * trees.y / scenes.LENGTH)
    heights = scenes.ground("rough", case.cell)
    return Scene.prepare(heights, case.cell, 0.5 * case.cell, 0.5 * case.cell, friction=case.friction, trees=far)
