"""Which parts of a scene a run modelled, which not, and why: clauses as records, and the same in English.

A clause is a row of the table with its numbers. ``summary.json`` contains the records; the language in which they are
shown is the reader's choice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.results.scenario import breaking_kj, slip_record, soft_ground_record
from deadwood_algorithms.scene.counts import WHYS
from deadwood_algorithms.scene.layers import SceneLayers

if TYPE_CHECKING:
    from deadwood_algorithms.results.run_settings import RunSettings

BETWEEN = "; "  # separates two clauses
AMONG = ", "  # separates the clauses of a list, which fill the placeholder {parts} of another
Clause = Mapping[str, Any]  # its name in the table under "clause", and its numbers

CLAUSES = {
    "absent": "not modelled: no layer was given",
    "terrain": "bilinear surface through {nx} × {ny} cells of {cell_m} m",
    "whole": "the whole DEM",
    "window": (
        "{columns} × {rows} of the DEM's {all_columns} × {all_rows} cells, from column {column} and row {row} (from "
        "the south-west): as far as an energy line reaches"
    ),
    "window_is_enough": (
        "no log came near its sides, so the results are those of the whole DEM, and no log was anywhere else"
    ),
    "friction": "Coulomb, {mu} everywhere",
    "friction_map": "Coulomb, {low} to {high} by cell",
    "slip": (
        "growing to {most} with the slip s on the ground, as (2/pi) atan({kappa} s), and in the air s decays with "
        "{beta} a second"
    ),
    "soft_ground": (
        "soft: a body digs in as deep as a soil strength of {strength} MN/m² allows, and is braked with the drag "
        "coefficient 1 + {drag}"
    ),
    "restitution": "{e} at every contact",
    "at_stems": "{value} at stems and lying logs",
    "at_barriers": "{value} at barriers",
    "rolling": "{c} of the ground's normal force times the radius",
    "rolling_none": "none: rigid ground",
    "rolling_cloud": "only that of the body's corners",
    "cones": "rigid truncated cones, tip half the diameter of the base",
    "shape": "rigid convex bodies of {points} points, {volume_m3} m³, all of one shape",
    "whole_logs": "they neither break nor collide with each other",
    "trees": "{n} rigid truncated cones",
    "stumps": "{n} rigid cylinders with a flat top",
    "breaking": (
        "a tree that would absorb more than {kj} kJ times (DBH / 40 cm) to the power of {power} in a hit absorbs just "
        "that and disappears for that log"
    ),
    "lying": "{n} rigid truncated cones at rest on the terrain, in {pieces} straight pieces",
    "lying_breaking": (
        "{n} of them break: one that would absorb more than its capacity, {low} to {high} kJ, in a hit absorbs just "
        "that and disappears for that log"
    ),
    "blocks": "{n} rigid spheres, with the ground's friction and restitution",
    "off_dem": "{n} off the DEM left out",
    "no_terrain": "{n} left out where the DEM has no height (its outermost half cell, nodata)",
    "beyond_window": "{n} beyond the window",
    "barriers": "{n} rigid thin plates",
    "lines": "{n} watched, as lines or outlines",
    "outputs": "deposits and rasters of every log, and what the layers above ask for",
    "not_computed": "not computed: {parts}",
    "no_poses": "poses and trajectories (--trajectories none)",
    "no_lines": "reach and danger (no roads, railways or houses)",
    "no_trees": "hits of trees (no trees)",
    "no_barriers": "hits of barriers (no barriers)",
}
DIGITS = {"volume_m3": ".4g"}  # significant digits of a number in a clause, if not six


def in_words(
    clauses: Sequence[Clause],
    phrase: Callable[[str], str] = CLAUSES.__getitem__,
    signs: Callable[[str], str] = str,
) -> str:
    """Clauses in words: ``phrase`` gives the sentence for a name, ``signs`` formats a number."""

    def filled(clause: Clause) -> str:
        gaps = {
            name: AMONG.join(phrase(part) for part in value)
            if name == "parts"
            else signs(format(value, DIGITS.get(name, "g" if isinstance(value, float) else "")))
            for name, value in clause.items()
            if name != "clause"
        }
        return phrase(clause["clause"]).format(**gaps)

    return BETWEEN.join(filled(each) for each in clauses)


def modelled(settings: RunSettings, layers: SceneLayers, counted: Mapping[str, Any]) -> dict[str, list[Clause]]:
    """What of the scene was modelled, and what was not and why; ``counted`` is the result of `counted_of`."""
    (ny, nx), scene = layers.dem.shape, layers.scene
    apart = _apart(settings.scene.tree_restitution, settings.scene.barrier_restitution)
    lying, pieces = len(layers.lying.ids), len(scene.arrays.lying.owner)
    barriers, lines = len(layers.barriers.ids), len(layers.lines.ids)

    def standing(name: str) -> list[Clause]:
        return [_clause(name, n=counted[name]["used"]), *_left_out(counted[name], off_dem=0)]

    found = {
        "terrain": [_clause("terrain", nx=nx, ny=ny, cell_m=layers.dem.cell)],
        "window": _window(layers),
        "friction": _friction(settings, layers),
        "restitution": [_clause("restitution", e=settings.scene.restitution), *apart],
        "rolling_friction": [_rolling(settings, layers)],
        "logs": [_logs(layers), _clause("whole_logs")],
        "trees": [*standing("trees"), *_breaking(layers)] if "trees" in counted else [],
        # a part of the layer of trees, not a layer that could have been given
        **({"stumps": [*standing("stumps"), *_breaking(layers)]} if "stumps" in counted else {}),
        "barriers": [_clause("barriers", n=barriers), *_left_out(counted["barriers"])] if scene.barrier_count else [],
        "lying_logs": _lying(layers, lying, pieces, counted) if lying else [],
        "blocks": standing("blocks") if layers.blocks.ids else [],
        "lines": [_clause("lines", n=lines), *_left_out(counted["lines"])] if lines else [],
        "outputs": _outputs(settings, layers),
    }
    return {name: clauses or [_clause("absent")] for name, clauses in found.items()}


def _left_out(count: Mapping[str, Any], **least: int) -> list[Clause]:
    """Why rows of a layer had no part in the run; ``least`` is reported even if it is zero."""
    out = least | {each["why"]: each["n"] for each in count["left_out"]}
    return [_clause(why, n=out[why]) for why in WHYS if why in out]


def _clause(name: str, **numbers: Any) -> Clause:
    return {"clause": name, **numbers}


def _apart(trees: float | None, barriers: float | None) -> list[Clause]:
    """Friction and restitution of stems and barriers; empty if they equal those of the ground."""
    own = (("at_stems", trees), ("at_barriers", barriers))
    return [_clause(name, value=value) for name, value in own if value is not None]


def _friction(settings: RunSettings, layers: SceneLayers) -> list[Clause]:
    mu = layers.friction
    if isinstance(mu, np.ndarray):
        on_dem = mu[np.isfinite(layers.dem.values)]
        ground = _clause("friction_map", low=float(on_dem.min()), high=float(on_dem.max()))
    else:
        ground = _clause("friction", mu=float(mu))
    law = slip_record(settings.scene)
    slip = [_clause("slip", most=law["friction_max"], kappa=law["kappa_per_m"], beta=law["beta_per_s"])] if law else []
    scar = soft_ground_record(settings.scene)
    soft = [_clause("soft_ground", strength=scar["strength_mn_m2"], drag=scar["drag"])] if scar else []
    return [ground, *slip, *soft, *_apart(settings.scene.tree_friction, settings.scene.barrier_friction)]


def _breaking(layers: SceneLayers) -> list[Clause]:
    law = layers.breaking
    return [_clause("breaking", kj=law.capacity_kj, power=law.power)] if law else []


def _lying(layers: SceneLayers, lying: int, pieces: int, counted: Mapping[str, Any]) -> list[Clause]:
    kj = breaking_kj(layers)
    breaking = []
    if kj.size:
        low, high = (float(f"{each:.3g}") for each in (kj.min(), kj.max()))
        breaking = [_clause("lying_breaking", n=kj.size, low=low, high=high)]
    return [_clause("lying", n=lying, pieces=pieces), *_left_out(counted["lying_logs"]), *breaking]


def _rolling(settings: RunSettings, layers: SceneLayers) -> Clause:
    if layers.shape:
        return _clause("rolling_cloud")
    coefficient = settings.scene.rolling_friction
    return _clause("rolling", c=coefficient) if coefficient else _clause("rolling_none")


def _logs(layers: SceneLayers) -> Clause:
    if layers.shape is None:
        return _clause("cones")
    return _clause("shape", points=len(layers.shape.cloud.points), volume_m3=float(layers.shape.volume))


def _window(layers: SceneLayers) -> list[Clause]:
    """Which part of the DEM was modelled, and why that gives the same result as the whole."""
    if layers.dem.whole is None:
        return [_clause("whole")]
    part, (rows, columns) = layers.dem.part, layers.dem.whole.shape
    window = _clause(
        "window",
        columns=part.columns,
        rows=part.rows,
        all_columns=columns,
        all_rows=rows,
        column=part.column,
        row=part.row,
    )
    return [window, _clause("window_is_enough")]


def _outputs(settings: RunSettings, layers: SceneLayers) -> list[Clause]:
    """What was computed for each log and what was not. Rasters are always computed: they take 6 to 10 % of the time of
    sliding on cells of 0.5 m (poses 1 %), too little to justify an option to leave them out."""
    nothing_asked = {
        "no_poses": not settings.keeps_poses,
        "no_lines": not layers.lines.ids,
        "no_trees": not layers.tree_ids,
        "no_barriers": not layers.barriers.ids,
    }
    skipped = [name for name, nobody in nothing_asked.items() if nobody]
    return [_clause("outputs"), *([_clause("not_computed", parts=skipped)] if skipped else [])]
