"""What of a scene a run modelled, and what not and why: the clauses of ``summary.json``, in English and in German.

A clause is written from its row of the table, and known again by it: so a report in German says all that a summary
says, and a clause that is not in the table cannot be written.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.shape import Shape

if TYPE_CHECKING:
    from deadwood_algorithms.results.asked import Asked

BETWEEN = "; "  # two clauses; in none of them
AMONG = ", "  # the clauses of a list, which fill the gap {parts} of another

CLAUSES = {
    "absent": ("not modelled: no layer was given", "nicht modelliert: keine Ebene angegeben"),
    "terrain": (
        "bilinear surface through {nx} x {ny} cells of {cell} m",
        "bilineare Fläche durch {nx} x {ny} Zellen von {cell} m",
    ),
    "whole": ("the whole DEM", "das ganze DEM"),
    "window": (
        "{columns} x {rows} of the DEM's {all_columns} x {all_rows} cells, from column {column} and row {row} (from "
        "the south-west): as far as an energy line reaches",
        "{columns} x {rows} der {all_columns} x {all_rows} Zellen des DEM, ab Spalte {column} und Zeile {row} (von "
        "Südwesten): so weit, wie eine Energielinie reicht",
    ),
    "window_is_enough": (
        "no log came near its sides, so results are those of the whole DEM, and no log was anywhere else",
        "kein Stamm kam seinen Seiten nahe, die Ergebnisse sind also die des ganzen DEM, und kein Stamm war anderswo",
    ),
    "friction": ("Coulomb, {mu} everywhere", "Coulomb, überall {mu}"),
    "friction_map": ("Coulomb, {low} to {high} by cell", "Coulomb, {low} bis {high} je Zelle"),
    "restitution": ("{e} at every contact", "{e} bei jedem Kontakt"),
    "at_stems": ("{value} at stems and lying logs", "{value} an Bäumen und liegenden Stämmen"),
    "at_barriers": ("{value} at barriers", "{value} an Barrieren"),
    "rolling": ("{c} of the ground's push times the radius", "{c} des Drucks des Bodens mal Radius"),
    "rolling_none": ("none: rigid ground", "keine: starrer Boden"),
    "rolling_cloud": ("none but that of the points' corners", "keine ausser der der Ecken des Körpers"),
    "cones": (
        "rigid truncated cones, tip half the diameter of the base",
        "starre Kegelstümpfe, Spitze halb so dick wie die Basis",
    ),
    "shape": (
        "rigid convex bodies of {points} points, {volume} m³, all of one shape",
        "starre konvexe Körper aus {points} Punkten, {volume} m³, alle von einer Form",
    ),
    "whole_logs": ("they do not break or meet each other", "sie brechen nicht und treffen einander nicht"),
    "trees": ("{n} rigid truncated cones", "{n} starre Kegelstümpfe"),
    "lying": (
        "{n} rigid truncated cones at rest on the terrain, in {pieces} straight pieces",
        "{n} starre Kegelstümpfe, ruhend auf dem Gelände, in {pieces} geraden Stücken",
    ),
    "blocks": (
        "{n} rigid spheres, with the ground's friction and restitution",
        "{n} starre Kugeln mit Reibung und Stosszahl des Bodens",
    ),
    "left_out": ("{n} off the DEM left out", "{n} ausserhalb des DEM weggelassen"),
    "left_out_and_beyond": (
        "{n} off the DEM left out, {beyond} beyond the window",
        "{n} ausserhalb des DEM weggelassen, {beyond} jenseits des Ausschnitts",
    ),
    "barriers": ("{n} rigid thin plates", "{n} starre dünne Platten"),
    "lines": ("{n} lines or outlines watched", "{n} Linien oder Umrisse beobachtet"),
    "outputs": (
        "deposits and rasters of every log, and what the layers above ask for",
        "Ablagerungen und Raster jedes Stamms, und was die Ebenen verlangen",
    ),
    "not_computed": ("not computed: {parts}", "nicht berechnet: {parts}"),
    "no_poses": ("poses and trajectories (--trajectories none)", "Posen und Bahnen (--trajectories none)"),
    "no_lines": ("reach and danger (no lines)", "Reichweite und Gefahr (keine Linien)"),
    "no_trees": ("hits of trees (no trees)", "Treffer auf Bäume (keine Bäume)"),
    "no_barriers": ("hits of barriers (no barriers)", "Treffer auf Barrieren (keine Barrieren)"),
}


def clause(name: str, **filled: Any) -> str:
    """A clause in English."""
    return CLAUSES[name][0].format(**filled)


def german_numbers(text: str) -> str:
    """With commas for decimal points."""
    return re.sub(r"(?<=\d)\.(?=\d)", ",", text)


def in_german(said: str) -> str:
    """What ``modelled`` said, in German; a clause that is not of the table (of an older run) as it is written."""
    return BETWEEN.join(_one_in_german(each) or each for each in said.split(BETWEEN))


def _one_in_german(said: str) -> str | None:
    for english, german in CLAUSES.values():
        pattern = re.sub(r"\\\{(\w+)\\\}", r"(?P<\1>[^;]+?)", re.escape(english))
        if found := re.fullmatch(pattern, said):
            filled = {name: german_numbers(value) for name, value in found.groupdict().items()}
            if "parts" in filled:
                filled["parts"] = AMONG.join(_one_in_german(each) or each for each in filled["parts"].split(AMONG))
            return german.format(**filled)
    return None


def modelled(asked: Asked, layers: SceneLayers) -> dict[str, str]:
    """What of the scene was modelled, and what was not and why, in words."""
    (ny, nx), scene, absent = layers.dem.shape, layers.scene, clause("absent")
    trees = len(layers.tree_ids) - len(scene.trees_outside)
    blocks = len(layers.blocks.ids) - len(scene.blocks_outside)
    trees_out = _left_out(layers, layers.trees_left_out, len(scene.trees_outside))
    blocks_out = _left_out(layers, layers.blocks.left_out, len(scene.blocks_outside))
    apart = _apart(asked.scene.tree_restitution, asked.scene.barrier_restitution)
    lying, pieces = len(layers.lying.ids), len(scene.arrays.lying.owner)
    return {
        "terrain": clause("terrain", nx=nx, ny=ny, cell=f"{layers.dem.cell:g}"),
        "window": _window(layers),
        "friction": _friction(asked, layers),
        "restitution": _told(clause("restitution", e=f"{asked.scene.restitution:g}"), *apart),
        "rolling_friction": _rolling(asked, layers),
        "logs": _told(_shape(layers.shape) if layers.shape else clause("cones"), clause("whole_logs")),
        "trees": _told(clause("trees", n=trees), trees_out) if layers.tree_ids else absent,
        "barriers": clause("barriers", n=len(layers.barriers.ids)) if scene.barrier_count else absent,
        "lying_logs": clause("lying", n=lying, pieces=pieces) if lying else absent,
        "blocks": _told(clause("blocks", n=blocks), blocks_out) if layers.blocks.ids else absent,
        "lines": clause("lines", n=len(layers.lines.ids)) if layers.lines.ids else absent,
        "outputs": _outputs(asked, layers),
    }


def _told(*clauses: str) -> str:
    return BETWEEN.join(clauses)


def _apart(trees: float | None, barriers: float | None) -> list[str]:
    """What stems and barriers have of their own; nothing where they have what the ground has."""
    told = (("at_stems", trees), ("at_barriers", barriers))
    return [clause(name, value=f"{value:g}") for name, value in told if value is not None]


def _friction(asked: Asked, layers: SceneLayers) -> str:
    mu = layers.friction
    if isinstance(mu, np.ndarray):
        on_dem = mu[np.isfinite(layers.dem.values)]
        ground = clause("friction_map", low=f"{on_dem.min():g}", high=f"{on_dem.max():g}")
    else:
        ground = clause("friction", mu=f"{mu:g}")
    return _told(ground, *_apart(asked.scene.tree_friction, asked.scene.barrier_friction))


def _rolling(asked: Asked, layers: SceneLayers) -> str:
    if layers.shape:
        return clause("rolling_cloud")
    coefficient = asked.scene.rolling_friction
    return clause("rolling", c=f"{coefficient:g}") if coefficient else clause("rolling_none")


def _shape(shape: Shape) -> str:
    return clause("shape", points=len(shape.cloud.points), volume=f"{shape.volume:.4g}")


def _left_out(layers: SceneLayers, off: int, beyond: int) -> str:
    if layers.dem.whole is None:
        return clause("left_out", n=off)
    return clause("left_out_and_beyond", n=off, beyond=beyond)


def _window(layers: SceneLayers) -> str:
    """Which part of the DEM was modelled, and why that is as good as all of it."""
    if layers.dem.whole is None:
        return clause("whole")
    part, (rows, columns) = layers.dem.part, layers.dem.whole.shape
    window = clause(
        "window", columns=part.columns, rows=part.rows, all_columns=columns, all_rows=rows, column=part.column,
        row=part.row,
    )  # fmt: skip
    return _told(window, clause("window_is_enough"))


def _outputs(asked: Asked, layers: SceneLayers) -> str:
    """What was computed of each log and what was not. The rasters always are: they take 6 to 10 % of the time of
    sliding on cells of 0.5 m (poses 1 %), less than an option to leave them out would be worth."""
    nothing_asked = {
        "no_poses": not asked.keeps_poses,
        "no_lines": not layers.lines.ids,
        "no_trees": not layers.tree_ids,
        "no_barriers": not layers.barriers.ids,
    }
    skipped = [clause(name) for name, nobody in nothing_asked.items() if nobody]
    told = [clause("not_computed", parts=AMONG.join(skipped))] if skipped else []
    return _told(clause("outputs"), *told)
