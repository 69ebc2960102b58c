"""The scenario of a run, as values: the actual sizes of its logs and trees, and the use of every row of the given
layers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.checked import read_summary
from deadwood_algorithms.scene.items import NO_TERRAIN, OFF_DEM, Items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.schemas import ORIENTATIONS

if TYPE_CHECKING:
    from deadwood_algorithms.results.run_folder import Run
    from deadwood_algorithms.scene.released_scene import ReleasedScene

# Further reasons, in addition to those of `items`, why a row of a layer had no part in a run
BEYOND_WINDOW = "beyond_window"  # beyond the part of the terrain model that logs can reach
NOT_RUN = "not_run"  # a log that was not needed because of --until-ci or --error
WHYS = (OFF_DEM, NO_TERRAIN, BEYOND_WINDOW, NOT_RUN)


def scenario_of(scene: ReleasedScene, fidelity: str, layers: SceneLayers, releases: Releases) -> dict[str, Any]:
    """Logs, contact laws and scene; sizes are those of the logs that were slid and of the trees and barriers of the
    scene.
    """
    logs, prepared = releases.logs, layers.scene
    trees = _used(len(layers.tree_ids), prepared.trees_outside)
    barriers = _used(len(layers.barriers.item), prepared.barriers_outside)
    lying = _used(len(layers.lying.item), prepared.lying_outside)
    rows, columns = layers.dem.frame.shape
    mu = layers.friction
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
        "trees": _things(
            int(trees.sum()), dbh_cm=layers.tree_dbh_cm[trees], height_m=np.asarray(layers.trees.height)[trees]
        ),
        "breaking": asdict(layers.breaking) if layers.breaking else None,
        "barriers": _things(
            len(set(layers.barriers.item[barriers].tolist())),
            height_m=np.asarray(layers.engine_barriers.height)[barriers],
        ),
        "lying_logs": _things(len(set(layers.lying.item[lying].tolist()))),
        "blocks": _things(int(_used(len(layers.blocks.ids), prepared.blocks_outside).sum())),
        "lines": _things(len(layers.lines.ids)),
        "dem": {"nx": columns, "ny": rows, "cell_m": layers.dem.cell},
        "fidelity": fidelity,
        "seed": scene.seed,
    }


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
    met = [
        counted(scenario[name]["n"], what)
        for name, what in (
            ("trees", "tree"),
            ("barriers", "barrier"),
            ("lying_logs", "lying log"),
            ("blocks", "boulder"),
        )
        if scenario[name]["n"]
    ]
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
    shown = f"{values['median']:.4g}" + (f" {unit}" if unit else "")
    return shown if values["low"] == values["high"] else f"{shown} ({values['low']:.4g} to {values['high']:.4g})"


def counted_of(layers: SceneLayers, releases: Releases, n_read: int) -> dict[str, Any]:
    """For each layer that was given: its rows, those that had a part in the run, and why the others had none."""
    scene = layers.scene
    trees, blocks = (
        _left_out(layers, np.asarray(shapely.points(np.column_stack([of.x, of.y])))[outside])
        for of, outside in ((layers.trees, scene.trees_outside), (layers.blocks.solid, scene.blocks_outside))
    )
    counts = {
        "releases": _count(n_read, Counter({NOT_RUN: n_read - len(releases)})),
        "trees": _points(layers.tree_ids, layers.trees_left_out, trees),
        "barriers": _count_rows(layers, layers.barriers, layers.engine_barriers, scene.barriers_outside),
        "lying_logs": _count_rows(layers, layers.lying, layers.lying_logs, scene.lying_outside),
        "blocks": _points(layers.blocks.ids, layers.blocks.left_out, blocks),
        "lines": _count(layers.lines.row_count, _rows_off(layers.lines)),
    }
    return {name: count for name, count in counts.items() if count["read"]}


def range_of(values: NDArray[np.float64]) -> dict[str, float | None]:
    """Median, smallest and largest of some values; None if there are none."""
    if not values.size:
        return {"median": None, "low": None, "high": None}
    return {"median": float(np.median(values)), "low": float(values.min()), "high": float(values.max())}


def _things(number: int, **sizes: NDArray[np.float64]) -> dict[str, Any]:
    return {"n": number, **({name: range_of(values) for name, values in sizes.items()} if number else {})}


def _used(number: int, outside: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of n objects are not among those outside."""
    used = np.ones(number, bool)
    used[outside] = False
    return used


def _left_out(layers: SceneLayers, shapes: NDArray[Any]) -> Counter[str]:
    """Why objects have no terrain below them: the DEM has no height there, or they are outside the window that was
    read.
    """
    here = shapely.intersects(shapes, shapely.box(*layers.dem.bounds))
    return Counter({NO_TERRAIN: int(here.sum()), BEYOND_WINDOW: int((~here).sum())})


def _points(on_dem: Sequence[Any], off: Counter[str], outside: Counter[str]) -> dict[str, Any]:
    return _count(len(on_dem) + off.total(), off + outside)


def _count_rows(layers: SceneLayers, items: Items, paths: Any, outside: NDArray[np.int64]) -> dict[str, Any]:
    """Count the rows of a layer of lines, which may have several parts: a row is used if one of its parts is."""
    used = set(items.row[_used(len(items.row), outside)].tolist())
    lost = [np.flatnonzero(items.row == row)[0] for row in sorted(set(items.row.tolist()) - used)]
    shapes = np.array([shapely.linestrings(paths.vertices[slice(*paths.starts[k : k + 2])]) for k in lost], object)
    return _count(items.row_count, _rows_off(items) + (_left_out(layers, shapes) if lost else Counter()))


def _rows_off(items: Items) -> Counter[str]:
    """Rows of a layer of lines that lie off the DEM: those without a path."""
    return Counter({OFF_DEM: items.row_count - np.unique(items.row).size})


def _count(read: int, left_out: Counter[str]) -> dict[str, Any]:
    reasons = [{"why": why, "n": left_out[why]} for why in WHYS if left_out[why]]
    return {"read": read, "used": read - left_out.total(), "left_out": reasons}


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
