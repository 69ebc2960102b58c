"""The scenario of a run, as values: the actual sizes of its logs and trees, and the use of every row of the given
layers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import count_of
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.checked import read_summary
from deadwood_algorithms.scene.counts import NOT_RUN, counts_of_scene, in_scene
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.lying_logs import capacities
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.schemas import ORIENTATIONS
from deadwood_algorithms.schemas.obstacles import OBSTACLES, STUMP_BELOW_M
from deadwood_algorithms.stats.statistics import alike

if TYPE_CHECKING:
    from deadwood_algorithms.results.run_folder import Run
    from deadwood_algorithms.scene.released_scene import ReleasedScene


def scenario_of(scene: ReleasedScene, fidelity: str, layers: SceneLayers, releases: Releases) -> dict[str, Any]:
    """Logs, contact laws and scene; sizes are those of the logs that were slid and of the trees and barriers of the
    scene.
    """
    logs, prepared = releases.logs, layers.scene
    trees = in_scene(len(layers.tree_ids), prepared.trees_outside)
    height = np.asarray(layers.trees.height)
    low = height < STUMP_BELOW_M
    barriers = in_scene(len(layers.barriers.item), prepared.barriers_outside)
    lying = in_scene(len(layers.lying.item), prepared.lying_outside)
    rows, columns = layers.dem.frame.shape
    mu, breaks = layers.friction, layers.lying_logs.capacity is not None
    return {
        "logs": {
            "n": len(releases),
            "length_m": range_of(logs.length),
            "dbh_cm": range_of(releases.dbh_cm),
            "density_kg_m3": range_of(logs.density),
            "posture": posture_shares(releases),
        },
        "friction": range_of(mu[np.isfinite(layers.dem.values)]) if isinstance(mu, np.ndarray) else float(mu),
        "rolling_friction": None if layers.shape else scene.rolling_friction,
        "restitution": scene.restitution,
        "slip_friction": slip_record(scene),
        "soft_ground": soft_ground_record(scene),
        **{
            name: _things(int(mine.sum()), dbh_cm=layers.tree_dbh_cm[mine], height_m=height[mine])
            for name, mine in (("trees", trees & ~low), ("stumps", trees & low))
        },
        "breaking": asdict(layers.breaking) if layers.breaking else None,
        "barriers": _things(
            len(set(layers.barriers.item[barriers].tolist())),
            height_m=np.asarray(layers.engine_barriers.height)[barriers],
        ),
        "lying_logs": _things(
            len(set(layers.lying.item[lying].tolist())), **({"capacity_kj": breaking_kj(layers)} if breaks else {})
        ),
        "blocks": _things(int(in_scene(len(layers.blocks.ids), prepared.blocks_outside).sum())),
        "lines": _things(len(layers.lines.ids)),
        "dem": {"nx": columns, "ny": rows, "cell_m": layers.dem.cell},
        "fidelity": fidelity,
        "seed": scene.seed,
    }


def breaking_kj(layers: SceneLayers) -> NDArray[np.float64]:
    """The energy [kJ] that each lying log on the DEM that can break absorbs before it does, of its weakest part."""
    here = in_scene(len(layers.lying.item), layers.scene.lying_outside)
    weakest = np.full(len(layers.lying.ids), np.inf)
    np.minimum.at(weakest, layers.lying.item[here], capacities(layers.lying_logs)[here])
    return weakest[np.isfinite(weakest)] / 1000.0


def slip_record(scene: ReleasedScene) -> dict[str, float | None] | None:
    """The law by which friction grows with slip; None if it does not."""
    if scene.friction_max is None:
        return None
    return {"friction_max": scene.friction_max, "kappa_per_m": scene.friction_kappa, "beta_per_s": scene.friction_beta}


def soft_ground_record(scene: ReleasedScene) -> dict[str, float | None] | None:
    """The properties of soft ground, in which bodies leave scars; None if it is hard."""
    if scene.soil_strength_mn_m2 is None:
        return None
    return {"strength_mn_m2": scene.soil_strength_mn_m2, "drag": scene.scar_drag}


def posture_shares(releases: Releases) -> dict[str, float]:
    """Which share of the logs starts upright, lying or tilted."""
    counts = np.bincount(releases.logs.orientation, minlength=len(ORIENTATIONS))
    return dict(zip(ORIENTATIONS, (counts / max(len(releases), 1)).tolist(), strict=True))


def posture_words(logs: dict[str, Any]) -> str:
    """``upright``, or the share of each posture."""
    postures = [name for name in ORIENTATIONS if logs["posture"][name]]
    if len(postures) == 1:
        return postures[0]
    return ", ".join(f"{100.0 * logs['posture'][name]:.3g} % {name}" for name in postures)


def scenario_line(scenario: dict[str, Any], name: str = "") -> str:
    """The scenario in one line of a terminal; ``name`` if there are several runs."""
    logs = scenario["logs"]
    sizes = f"{_span(logs['length_m'], 'm')} long, DBH {_span(logs['dbh_cm'], 'cm')}"
    friction = scenario["friction"]
    laws = [f"friction {_span(friction) if isinstance(friction, dict) else format(friction, 'g')}"]
    if scenario["rolling_friction"] is not None:
        laws.append(f"rolling friction {scenario['rolling_friction']:g}")
    laws.append(f"restitution {scenario['restitution']:g}")
    if slip := scenario.get("slip_friction"):
        laws.append(f"friction up to {slip['friction_max']:g} with slip")
    if soft := scenario.get("soft_ground"):
        laws.append(f"soft ground ({soft['strength_mn_m2']:g} MN/m2, drag {soft['drag']:g})")
    if breaking := scenario.get("breaking"):
        laws.append(f"trees break ({breaking['capacity_kj']:g} kJ at 40 cm DBH)")
    if weak := scenario.get("lying_logs", {}).get("capacity_kj"):
        laws.append(f"lying logs break ({_span(weak, 'kJ')})")
    found = [(each.word, scenario.get(each.key, {}).get("n")) for each in OBSTACLES]  # older runs know no stumps
    met = [counted(number, word) for word, number in found if number]
    dem = scenario["dem"]
    whose = f"scenario of {name}" if name else "scenario"
    return (
        f"{whose}: {counted(logs['n'], 'log')}, {posture_words(logs)}, {sizes}; "
        f"{', '.join(laws)}; {', '.join(met) or 'no obstacle'}; "
        f"{dem['nx']} x {dem['ny']} cells of {dem['cell_m']:g} m; {scenario['fidelity']}, seed {scenario['seed']}"
    )


def lines_of_run(source: Run, name: str = "") -> tuple[str, ...]:
    """The scenario of a run that a tool has read, as its last line; empty if its summary does not record it."""
    return lines_of_folder(source.path, source.manifest, name)


def summary_if_there(folder: Path, manifest: Mapping[str, Any]) -> dict[str, Any]:
    """The content of a run's summary; empty if it is missing or damaged, for tools that do not depend on it."""
    try:
        return read_summary(folder, manifest)
    except UserError:
        return {}


def lines_of_folder(folder: Path, manifest: Mapping[str, Any], name: str = "") -> tuple[str, ...]:
    """The same for a run's folder; ``name`` distinguishes it from others."""
    scenario = summary_if_there(folder, manifest).get("scenario")
    try:
        return (scenario_line(scenario, name),) if scenario else ()
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UserError(
            f"{folder}: the scenario in summary.json is not as written by slide-logs; run slide-logs again"
        ) from error


def _span(values: dict[str, float | None], unit: str = "") -> str:
    """``45 cm``, or ``45 cm (32 to 61)`` where the values differ."""
    if values["median"] is None:
        return "unknown"
    if values["low"] == values["high"]:
        return f"{values['median']:g} {unit}".strip()
    middle, low, high = alike([values["median"] or 0.0, values["low"] or 0.0, values["high"] or 0.0])
    return f"{f'{middle} {unit}'.strip()} ({low} to {high})"


def counted_of(layers: SceneLayers, releases: Releases, n_read: int) -> dict[str, Any]:
    """For each layer that was given: its rows, those that had a part in the run, and why the others had none."""
    logs = count_of(n_read, len(releases), {NOT_RUN: n_read - len(releases)})
    return {"releases": logs, **counts_of_scene(layers)}


def range_of(values: NDArray[np.float64]) -> dict[str, float | None]:
    """Median, smallest and largest of some values; None if there are none."""
    if not values.size:
        return {"median": None, "low": None, "high": None}
    return {"median": float(np.median(values)), "low": float(values.min()), "high": float(values.max())}


def _things(number: int, **sizes: NDArray[np.float64]) -> dict[str, Any]:
    return {"n": number, **({name: range_of(values) for name, values in sizes.items()} if number else {})}


def overridden_options(manifest: Mapping[str, Any], summary: Mapping[str, Any]) -> set[str]:
    """Options of the default log that no log of the run had: columns of its releases override them."""
    parameters, found = manifest.get("parameters", {}), set()
    for name, values in manifest.get("effective", {}).items():
        given = parameters.get(name)
        if isinstance(given, (int, float)) and not values["min"] - 1e-6 <= given <= values["max"] + 1e-6:
            found.add(name)
    posture = summary.get("scenario", {}).get("logs", {}).get("posture", {})
    if posture and not posture.get(parameters.get("orientation"), 0.0):
        found.add("orientation")
    return found
