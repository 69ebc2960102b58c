"""The same logs in every run of a design: how the scene of a run is made, and which outcomes are stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.ensemble.variants import Arrays, Variant, joined
from deadwood_algorithms.evaluate.sensitivity.design import Place
from deadwood_algorithms.evaluate.sensitivity.factors import OF_LOGS, OF_TREES, Factor
from deadwood_algorithms.evaluate.sensitivity.noise import error_surface
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.releases.logs import in_posture
from deadwood_algorithms.results.lost import many, reach_phrases, reach_records, warn_of_lost
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.inputs import CONTACT_LAWS
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.stats.endings import ended, left_dem
from deadwood_engine import FIDELITIES, Logs
from deadwood_engine.limits import DENSITY, DIAMETER, LENGTH

Array = NDArray[np.float64]
SIZES = {
    "log_dbh_factor": ("diameter", DIAMETER, "--dbh-cm, the DBH"),
    "log_length_factor": ("length", LENGTH, "--length-m, the length"),
    "log_density_factor": ("density", DENSITY, "--density-kg-m3, the density"),
}
WANTED = ("reach", "runout", "stop_reason")


@dataclass(frozen=True)
class SlidRuns:
    """Outcomes of every log in every run; the first axis is the run.

    reach : (runs, logs, lines); runout : (runs, logs) [m]; stop_reason : (runs, logs)
    """

    reach: NDArray[np.bool_]
    runout: Array
    stop_reason: NDArray[np.int8]


def refuse_pointless(factors: list[Factor], friction: str | float, layers: SceneLayers, logs: Releases) -> None:
    """Refuse factors of what the scene does not have, and sizes that no log has."""
    for each in factors:
        if each.name == "friction" and number_of(friction) is None:
            raise UserError(
                f"--vary friction: {friction} is a layer of friction, which has no single value; vary friction_factor"
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
                    f"--vary {each.name}: {words} of some logs would be outside {least:g} to {most:g} (SI units); "
                    "narrow "
                    "the range"
                )


def variants_of(places: Sequence[Place], simulation: Simulation, noise_length: float, seed: int) -> list[Variant]:
    """A variant for each run of the design."""
    found = []
    for k, place in enumerate(places):
        laws = {name: place.values[name] for name in CONTACT_LAWS if name in place.values}
        fidelity = FIDELITIES[str(place.values["fidelity"])] if "fidelity" in place.values else simulation.fidelity
        own = replace(simulation, laws={**simulation.laws, **laws}, fidelity=fidelity)
        scene = partial(scene_at, place, noise_length=noise_length, seed=seed)
        what = f"run {k + 1} of {len(places)} ({place.label})"
        found.append(Variant(what, own, scene, partial(logs_at, place, seed=seed)))
    return found


def runs_of(variants: Sequence[Sequence[Arrays]]) -> SlidRuns:
    return SlidRuns(*(np.stack([joined(parts, name) for parts in variants]) for name in WANTED))


def scene_at(place: Place, layers: SceneLayers, *, noise_length: float, seed: int) -> SceneLayers:
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


def logs_at(place: Place, logs: Logs, *, seed: int) -> Logs:
    """The logs of a run: the same places and ids, other sizes, and another posture if that is varied."""
    sizes = {
        field: getattr(logs, field) * place.values[name]
        for name, (field, _, _) in SIZES.items()
        if name in place.values
    }
    sized = replace(logs, **sizes)
    return in_posture(str(place.values["orientation"]), sized, seed) if "orientation" in place.values else sized


def table_of(places: list[Place], slid: SlidRuns, factors: list[Factor], line_ids: list[str]) -> list[dict[str, Any]]:
    """One record for each run: the values of its factors, the surface, the outcomes, how logs ended."""
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
            row[name] = int(ended(slid.stop_reason[k], name).sum())
        rows.append(row)
    return rows


def warn_of_runs(places: list[Place], slid: SlidRuns, line_ids: list[Any], feedback: Feedback) -> None:
    """Warn of results that depend on logs that left the terrain model, in the run that lost most and in the unchanged
    one.
    """
    left = left_dem(slid.stop_reason)
    gone, n = left.sum(axis=1), left.shape[1]
    most = int(gone.argmax())
    phrases = reach_phrases(reach_records(line_ids, slid.reach[most], left[most]))
    if most != 0:
        of_base = reach_phrases(reach_records(line_ids, slid.reach[0], left[0]))
        phrases += [f"in the run '{places[0].label}', where {gone[0]} left, {each}" for each in of_base]
    if many(int(gone[most]), n):
        phrases.append("mean run-outs, and the effect of each factor on them, count only up to where the logs left")
    warn_of_lost(int(gone[most]), n, phrases, feedback, where=f"in the run '{places[most].label}', which lost most")
