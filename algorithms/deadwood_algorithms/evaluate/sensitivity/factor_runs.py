"""The same logs in every run of a design: how a run's scene is made, and what of it is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.sensitivity.design import Place
from deadwood_algorithms.evaluate.sensitivity.factors import OF_LOGS, OF_TREES, Factor
from deadwood_algorithms.evaluate.sensitivity.noise import error_surface
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.scene.releases import Releases, reached
from deadwood_algorithms.simulate.checkpoints import WorkFolder
from deadwood_algorithms.simulate.sliding import reporter, slide_once, until_none_escapes
from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, Result
from deadwood_engine.limits import DENSITY, DIAMETER, LENGTH

Array = NDArray[np.float64]
LAWS = ("rolling_friction", "restitution", "tree_friction", "tree_restitution")
SIZES = {
    "log_dbh_factor": ("diameter", DIAMETER, "--dbh-cm, the DBH"),
    "log_length_factor": ("length", LENGTH, "--length-m, the length"),
    "log_density_factor": ("density", DENSITY, "--density-kg-m3, the density"),
}
# A work folder keeps rasters as well, which these runs do not have.
NO_CELLS = {"hit_count": np.zeros((1, 1), np.uint32), "deposit_count": np.zeros((1, 1), np.uint32)}


@dataclass(frozen=True)
class SlidRuns:
    """What every log did in every run; the first axis is the run.

    reach : (runs, logs, lines); runout : (runs, logs) [m]; stop_reason : (runs, logs)
    """

    reach: NDArray[np.bool_]
    runout: Array
    stop_reason: NDArray[np.int8]


def refuse_pointless(factors: list[Factor], ask: ReleasedScene, layers: SceneLayers, logs: Releases) -> None:
    """Refuse factors of what the scene does not have, and sizes that no log has."""
    for each in factors:
        if each.name == "friction" and number_of(ask.friction) is None:
            raise UserError(
                f"--vary friction: {ask.friction} is a layer of friction, which has no one value; vary friction_factor"
            )
        if each.name in OF_TREES and not layers.trees.x.size and not layers.lying_logs.diameter.size:
            raise UserError(f"--vary {each.name}: the scene has no trees; leave it out, or give --trees")
        if each.name == "tree_dbh_factor" and not layers.trees.x.size:
            raise UserError(f"--vary {each.name}: the scene has no standing trees; leave it out, or give --trees")
        if each.name in OF_LOGS and layers.shape is not None:
            raise UserError(f"--vary {each.name}: with --shape the points give the size; leave it out")
        if each.name in SIZES and not isinstance(each.low, str) and not isinstance(each.high, str):
            field, (least, most), words = SIZES[each.name]
            size = getattr(logs.logs, field)
            if size.min() * each.low < least or size.max() * each.high > most:
                raise UserError(
                    f"--vary {each.name}: {words} of some logs would leave {least:g} to {most:g} (SI units); narrow "
                    "the range"
                )


def slide_places(
    places: list[Place],
    ask: ReleasedScene,
    fidelity: str,
    noise_length: float,
    layers: SceneLayers,
    logs: Releases,
    work: WorkFolder,
    feedback: Feedback,
) -> SlidRuns:
    """Slide the logs in every run that the work folder does not hold yet, and give what came of all."""
    total = len(places) * len(logs)
    for k, place in enumerate(places):
        if k < work.finished and k not in work.lost:
            continue
        what = f"run {k + 1} of {len(places)} ({place.label})"
        report = reporter(feedback, total, what, before=k * len(logs))
        try:
            result, layers = slide_place(place, ask, fidelity, noise_length, layers, logs, report, feedback)
        except (Cancelled, KeyboardInterrupt) as error:
            feedback.note(f"{k} of {len(places)} runs are kept in {work.path}; --resume goes on from there")
            raise Cancelled from error
        work.save(k, kept_of(result, layers, logs), pa.table({}))
        if k >= work.finished:
            nothing = Grid.empty((1, 1), 1.0, 0.0, 0.0, layers.dem.crs)
            work.checkpoint(k + 1, NO_CELLS, nothing)
    feedback.progress(total, total, f"{len(places)} runs")
    found = [work.chunk(k) for k in range(len(places))]
    return SlidRuns(*(np.stack([each[name] for each in found]) for name in ("reach", "runout", "stop_reason")))


def slide_place(
    place: Place,
    ask: ReleasedScene,
    fidelity: str,
    noise_length: float,
    layers: SceneLayers,
    logs: Releases,
    report: Callable[[int], bool],
    feedback: Feedback,
) -> tuple[Result, SceneLayers]:
    """Slide the logs in one run; also gives the scene as it is, on the window that they needed."""
    asked = replace(ask, **{name: place.values[name] for name in LAWS if name in place.values})
    preset = FIDELITIES[str(place.values.get("fidelity", fidelity))]
    changed = logs_at(place, logs.logs)

    def slide_all(on: SceneLayers) -> tuple[Result, list[str]]:
        return slide_once(scene_at(place, on, noise_length, ask.seed), changed, preset, asked, report)

    return until_none_escapes(layers, ask, slide_all, feedback)


def scene_at(place: Place, layers: SceneLayers, noise_length: float, seed: int) -> SceneLayers:
    """The scene of a run."""
    changes: dict[str, Any] = {}
    values = {name: value for name, value in place.values.items() if not isinstance(value, str)}
    if "friction" in values:
        changes["friction"] = values["friction"]
    if "friction_factor" in values:
        changes["friction"] = layers.friction * values["friction_factor"]
    if "tree_dbh_factor" in values:
        changes["trees"] = layers.trees._replace(diameter=layers.trees.diameter * values["tree_dbh_factor"])
    if values.get("dem_noise_m"):
        dem = layers.dem
        surface = error_surface(dem.shape, dem.first, dem.cell, noise_length, seed, place.surface)
        changes["heights"] = (dem.values + values["dem_noise_m"] * surface).astype(dem.values.dtype)
    return layers.varied(**changes) if changes else layers


def logs_at(place: Place, logs: Logs) -> Logs:
    """The logs of a run: the same places and ids, other sizes."""
    sizes = {field: getattr(logs, field) * place.values[name] for name, (field, _, _) in SIZES.items()
             if name in place.values}  # fmt: skip
    return replace(logs, **sizes)


def kept_of(result: Result, layers: SceneLayers, logs: Releases) -> dict[str, NDArray[Any]]:
    along = result.end_position - result.release_position
    return {
        "reach": reached(layers.lines, {"reach": result.reach}, logs),
        "runout": np.hypot(along[:, 0], along[:, 1]),
        "stop_reason": np.asarray(result.stop_reason, np.int8),
    }


def table_of(places: list[Place], slid: SlidRuns, factors: list[Factor], line_ids: list[str]) -> list[dict[str, Any]]:
    """One record a run: the factors' values (of the others none), the surface, the outcomes, how logs ended."""
    rows = []
    for k, place in enumerate(places):
        row: dict[str, Any] = {"run": k + 1, "label": place.label}
        row |= {f"value_{each.name}": place.values.get(each.name, "") for each in factors}
        if any(each.name == "dem_noise_m" for each in factors):
            row["dem_surface"] = place.surface
        row["logs"] = slid.runout.shape[1]
        row |= {f"reach_{line}": float(slid.reach[k, :, j].mean()) for j, line in enumerate(line_ids)}
        row["runout_mean_m"] = float(slid.runout[k].mean())
        for name in ("left_dem", "time_limit", "failed"):
            row[name] = int((slid.stop_reason[k] == STOP_REASONS.index(name)).sum())
        rows.append(row)
    return rows
