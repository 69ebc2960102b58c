"""What every tool asks that slides logs itself: the layers of the scene, the released logs, and how to slide them.

Declared once, as the base of the ``Ask`` of `slide-logs` and of `compare-fidelity`, so that one manifest's values mean
the same in the other.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.presets import FRICTION_CELL_M, FRICTIONS, Taken, choices_told
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.schemas import DBH_CM, DENSITY_KG_M3, DROP_M, SPEED_MS, TREE_M

# Ground that a log sinks into so far that it resists more does not carry a rigid log
MOST_ROLLING = 0.5

DEFAULTED = ("dbh_cm", "length_m", "density_kg_m3", "orientation", "tilt_deg", "azimuth_deg", "speed_ms", "drop_m")


@dataclass(frozen=True, kw_only=True)
class ReleasedScene:
    dem: str = tool.terrain("Terrain model")
    releases: str = tool.vector("Released logs", "point")
    trees: str | None = tool.vector("Standing trees", "point", default=None)
    barriers: str | None = tool.vector("Barriers", "line", default=None)
    lying_logs: str | None = tool.vector(
        "Lying logs that hold others back",
        "line",
        default=None,
        help="Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and, optionally, 'tip_diameter_cm'. They "
        "are rigid, rest on the terrain and do not move.",
    )
    blocks: str | None = tool.vector(
        "Boulders that hold logs back",
        "point",
        default=None,
        help="Points with a field 'diameter_m' (or 'radius_m') and, optionally, 'height_m', that of the top above the "
        "terrain. They are rigid spheres, do not move, and have the ground's friction and restitution.",
    )
    lines: str | None = tool.vector("Roads, railways, houses to be reached", "line", "polygon", default=None)
    friction: str | float = tool.number_or_layer(
        "Friction coefficient", minimum=0.0, help="A number, a raster, or polygons with a field 'friction' or 'mu'."
    )
    friction_column: str | None = tool.text(
        "Column of the friction polygons", default=None, advanced=True, help="Default: 'friction', else 'mu'."
    )
    friction_elsewhere: float | None = tool.number(
        "Friction where the raster or the polygons have none",
        default=None,
        minimum=0.0,
        advanced=True,
        help="Without it, a layer that does not cover the DEM is refused.",
    )
    restitution: float = tool.number("Normal restitution of impacts", default=0.0, minimum=0.0, maximum=1.0)
    rolling_friction: float = tool.number(
        "Coefficient of rolling friction of the ground",
        default=0.1,
        minimum=0.0,
        maximum=MOST_ROLLING,
        help="The moment against rolling is at most this times the push of the ground times the log's radius. A roller "
        "of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09, 0.13; 0 is rigid ground. No value measured for logs is "
        "known.",
    )
    tree_friction: float | None = tool.number(
        "Friction of stems and lying logs",
        default=None,
        minimum=0.0,
        advanced=True,
        help="Default: the ground's there.",
    )
    tree_restitution: float | None = tool.number(
        "Restitution of stems and lying logs",
        default=None,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
        help="Default: that of the ground.",
    )
    barrier_friction: float | None = tool.number(
        "Friction of barriers", default=None, minimum=0.0, advanced=True, help="Default: the ground's there."
    )
    barrier_restitution: float | None = tool.number(
        "Restitution of barriers",
        default=None,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
        help="Default: that of the ground.",
    )
    shape: str = tool.text(
        "Shape of what slides: cone, or a file of points",
        default="cone",
        advanced=True,
        path_like=True,
        help="A .pts file (x y z a line, metres, no header) lets the convex hull of its points slide instead of logs: "
        "rocks, or logs as rings of vertices. dbh_cm and length_m of the releases then do not count, the density does; "
        "its z axis takes the place of a log's axis.",
    )
    time_limit: float = tool.number("Longest run of a log", unit="s", default=300.0, minimum=0.0, exclusive=True)
    rest_speed: float = tool.number(
        "Speed below which a log may be at rest", unit="m/s", default=0.1, minimum=0.0, exclusive=True, advanced=True
    )
    dbh_cm: float = tool.number(
        "DBH of logs whose layer names none",
        unit="cm",
        default=75.0,
        minimum=0.0,
        maximum=DBH_CM[1],
        exclusive=True,
    )
    length_m: float = tool.number(
        "Length, likewise", unit="m", default=30.0, minimum=0.0, maximum=TREE_M[1], exclusive=True
    )
    density_kg_m3: float = tool.number(
        "Density, likewise",
        unit="kg/m³",
        default=300.0,
        minimum=0.0,
        maximum=DENSITY_KG_M3,
        exclusive=True,
    )
    orientation: str = tool.choice("Orientation, likewise", "upright", "lying", "tilted", default="upright")
    tilt_deg: float = tool.number("Tilt from the vertical, likewise", unit="°", default=0.0, minimum=0, maximum=180)
    azimuth_deg: float = tool.number("Azimuth of tip and speed, likewise", unit="°", default=0.0)
    speed_ms: float = tool.number("Initial speed, likewise", unit="m/s", default=0.0, minimum=0.0, maximum=SPEED_MS)
    drop_m: float = tool.number("Clearance at the start, likewise", unit="m", default=0.0, minimum=0.0, maximum=DROP_M)
    lying_diameter_cm: float = tool.number(
        "Base diameter of lying logs whose layer names none",
        unit="cm",
        default=40.0,
        minimum=0.0,
        maximum=DBH_CM[1],
        exclusive=True,
    )
    min_runout: float | None = tool.min_runout()
    seed: int = tool.seed()
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    scheduler: str | None = tool.scheduler()
    workers: int | None = tool.workers()
    crs: str | None = tool.crs()

    def laws(self) -> dict[str, Any]:
        """The laws of contact but the ground's sliding friction, by the names that the engine's ``slide`` takes."""
        return {
            "restitution": self.restitution,
            "rolling_friction": self.rolling_friction,
            "tree_friction": self.tree_friction,
            "tree_restitution": self.tree_restitution,
            "barrier_friction": self.barrier_friction,
            "barrier_restitution": self.barrier_restitution,
        }


@dataclass(frozen=True, kw_only=True)
class SceneByName(ReleasedScene):
    """The same, with a friction that may be picked by name."""

    friction: str | float = tool.number_or_layer(
        "Friction coefficient",
        minimum=0.0,
        default=None,
        help="A number, a raster, or polygons with a field 'friction' or 'mu'. Needed, unless --friction-preset names "
        "one.",
    )
    friction_preset: str | None = tool.choice(
        "Friction coefficient by name", *FRICTIONS, default=None, help=choices_told(FRICTIONS)
    )

    def __post_init__(self) -> None:
        if self.friction is None and self.friction_preset in FRICTIONS:
            object.__setattr__(self, "friction", FRICTIONS[self.friction_preset].values["friction"])

    def taken_presets(self) -> tuple[Taken, ...]:
        if self.friction_preset is None:
            return ()
        return (Taken.of(FRICTIONS[self.friction_preset], "--friction-preset", {"friction": self.friction}),)


def refuse_no_friction(ask: ReleasedScene) -> None:
    if ask.friction is None:
        raise UserError("--friction is missing (Friction coefficient); give it, or name one with --friction-preset")


def say_friction(ask: ReleasedScene, cell: float, feedback: Feedback) -> None:
    """What a friction by name is, and that it was found on cells of another size."""
    if not isinstance(ask, SceneByName):
        return
    for each in ask.taken_presets():
        feedback.note(each.said)
        if each.sets and abs(cell - FRICTION_CELL_M) > 0.02 * FRICTION_CELL_M:
            feedback.warn(
                f"--friction-preset {each.preset.name} was found on cells of {FRICTION_CELL_M:g} m, and the terrain "
                f"model has cells of {cell:g} m: on coarser ones friction should be higher (the paper, 6.1)"
            )


def threads_of(asked: int | None) -> int:
    """The threads asked for, else one for each core that this process may use."""
    if asked is not None:
        return asked
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
