"""The settings that the study compares: the four fidelities, and one factor at a time around ``standard``."""

from __future__ import annotations

from dataclasses import dataclass

from deadwood_engine import FIDELITIES, Fidelity

from .scenes import POSTURES

STANDARD, REFERENCE = FIDELITIES["standard"], FIDELITIES["reference"]
REFINED = ("time_step", "travel_cells", "roll_angle", "station_spacing", "spacing_cells", "coarse_cells")
UNBOUND = 1e6  # travel in cells, or an angle in rad, that never shortens a step


@dataclass(frozen=True)
class Setting:
    """A way to calculate a scene.

    name : unique; group : the factor that it belongs to, "fidelity" for the four rows; value : the factor's number
    fidelity : the engine's numbers; against : name of the setting that it is compared with, log by log
    cell, friction_change, smooth : changes of the scene (``scenes.build``)
    options : further arguments of ``slide``; if there are none, those of the product
    vertices : None: the study's logs; 0: cones of one size, ``scenes.RING_LOG``; otherwise rings with this number of
    vertices
    posture : posture in which all logs are released (``scenes.POSTURES``); None: a third of them each upright, lying
    and tilted
    """

    name: str
    group: str
    value: float
    fidelity: Fidelity
    against: str = "reference"
    cell: float | None = None
    friction_change: float = 0.0
    smooth: bool = False
    options: tuple[tuple[str, float], ...] = ()
    vertices: int | None = None
    posture: str | None = None


IMPACTS = (0.05, 0.2)  # [-] restitutions that are examined
RINGS = (8, 16, 32)  # vertices of a ring
ROLLING = 0.1  # [-] rolling friction of the product
NO_REBOUND = (("tree_restitution", 0.0), ("barrier_restitution", 0.0))  # by default these are those of the ground


# The name of a factor in tables, and its unit
FACTORS: dict[str, tuple[str, str]] = {
    "fidelity": ("fidelity", ""),
    "coarse": ("several at once, between draft and standard", ""),
    "halved": ("reference with half its step, travel and spacing", ""),
    "refined": ("step, travel and station spacing of standard, together", "of standard"),
    "longer": ("0.8 cells instead of standard's travel", "m between rings"),
    "time step": ("time step alone (travel and roll unbounded)", "ms"),
    "travel": ("travel in a step", "cells"),
    "roll angle": ("angle that a log in contact rolls in a step", "rad"),
    "spacing": ("station spacing", "m"),
    "tolerance": ("solver tolerance", "of g dt"),
    "sweeps": ("cap of solver sweeps", ""),
    "trace": ("distance between outlines", "cells"),
    "obstacles": ("travel in a step near obstacles", "of both radii"),
    "flanks": ("candidate points of a ring", ""),
    "order": ("sweeps from the last contact to the first", ""),
    "friction": ("friction", "change of mu"),
    "rolling": ("friction of rolling", "c"),
    "tree restitution": ("restitution of stems alone", "e"),
    "tree friction": ("friction of stems alone", "mu"),
    "barrier restitution": ("restitution of barriers alone", "e"),
    "barrier friction": ("friction of barriers alone", "mu"),
    "ground restitution": ("restitution of the ground alone", "e"),
    "impacts": ("restitution of everything", "e"),
    "rings": ("smooth cone or rings of vertices", "vertices"),
    "posture": ("how all logs are released", ""),
    "cell": ("DEM cell", "m"),
    "smooth": ("DEM refined by cubic splines", ""),
}


def _all() -> list[Setting]:
    found = [Setting(name, "fidelity", FIDELITIES[name].time_step, FIDELITIES[name]) for name in FIDELITIES]
    half = REFERENCE._replace(**{name: 0.5 * getattr(REFERENCE, name) for name in REFINED})
    found.append(Setting("reference halved", "halved", half.time_step, half))
    found += [
        Setting(
            f"coarse {1e3 * step:g} ms",
            "coarse",
            1e3 * step,
            Fidelity(step, travel, angle, spacing, spacing / 0.5, 1e-2, 100, 1.0),
        )
        for step, travel, angle, spacing in ((0.050, 1.0, 0.5, 0.5), (0.060, 2.0, 1.0, 1.0), (0.100, 4.0, 2.0, 2.0))
    ]
    found += [
        Setting(
            f"refined {share:g}", "refined", share,
            STANDARD._replace(**{name: share * getattr(STANDARD, name) for name in REFINED}),
        )
        for share in (0.5, 0.25)
    ]  # fmt: skip
    # standard does not use these, although they cost less: jumps are lower with longer steps, and with rings farther
    # apart the ground between two of them is missed more often
    longer = STANDARD._replace(travel_cells=0.8)
    found += [
        Setting(
            name, "longer", spacing, longer._replace(station_spacing=spacing, spacing_cells=2.0 * spacing), "standard"
        )
        for name, spacing in (("longer steps", STANDARD.station_spacing), ("longer steps, rings 1.5 m", 1.5))
    ]
    found += [
        Setting(f"obstacles {n:g}", "obstacles", n, STANDARD._replace(obstacle_travel=n)) for n in (0.05, 0.2, 0.3)
    ]
    found.append(Setting("flanks 1", "flanks", 1.0, STANDARD._replace(ring_points=1)))
    found.append(Setting("backward", "order", 1.0, STANDARD._replace(backward=True)))
    found += [
        Setting(
            f"step {s:g} ms", "time step", s,
            STANDARD._replace(time_step=1e-3 * s, travel_cells=UNBOUND, roll_angle=UNBOUND),
        )
        for s in (40.0, 20.0, 10.0, 5.0, 2.5)
    ]  # fmt: skip
    found += [Setting(f"travel {n:g}", "travel", n, STANDARD._replace(travel_cells=n)) for n in (2.0, 1.0, 0.4, 0.2)]
    found += [Setting(f"roll {a:g}", "roll angle", a, STANDARD._replace(roll_angle=a)) for a in (0.1, 0.2, 0.8, 1.6)]
    found += [
        Setting(f"spacing {s:g} m", "spacing", s, STANDARD._replace(station_spacing=s, spacing_cells=1e6))
        for s in (2.0, 1.5, 0.5, 0.25)
    ]
    found += [Setting(f"tolerance {t:g}", "tolerance", t, STANDARD._replace(tolerance=t)) for t in (0.1, 0.01, 0.0001)]
    found += [Setting(f"sweeps {n}", "sweeps", n, STANDARD._replace(sweeps=n)) for n in (4, 20, 1000)]
    found += [Setting(f"trace {n:g}", "trace", n, STANDARD._replace(trace_cells=n)) for n in (0.25, 1.0)]
    found += [
        Setting(f"mu {d:+.2f}", "friction", d, STANDARD, against="standard", friction_change=d) for d in (-0.02, 0.02)
    ]
    found += [
        Setting(f"{thing} {value:g}", group, value, STANDARD, against="standard", options=((option, value), *rest))
        for thing, group, option, values, rest in (
            ("rolling", "rolling", "rolling_friction", (0.0, 0.05, 0.15, 0.3), ()),
            ("stem e", "tree restitution", "tree_restitution", IMPACTS, ()),
            ("stem mu", "tree friction", "tree_friction", (0.15, 0.5), ()),
            ("barrier e", "barrier restitution", "barrier_restitution", IMPACTS[1:], ()),
            ("barrier mu", "barrier friction", "barrier_friction", (0.15, 0.5), ()),
            ("ground e", "ground restitution", "restitution", IMPACTS, NO_REBOUND),
        )
        for value in values
    ]
    found += [
        Setting(f"{name} e {e:g}", "impacts", e, row, f"reference e {e:g}", options=(("restitution", e),))
        for e in IMPACTS
        for name, row in FIDELITIES.items()
    ]
    still = (("rolling_friction", 0.0),)
    found += [Setting("cone", "rings", 0.0, STANDARD, "cone", vertices=0)]
    found += [Setting("cone, rolling 0", "rings", 0.0, STANDARD, "cone", vertices=0, options=still)]
    found += [Setting(f"rings {n}", "rings", n, STANDARD, "cone", vertices=n, options=still) for n in RINGS]
    found += [Setting(posture, "posture", 0.0, STANDARD, "upright", posture=posture) for posture in POSTURES]
    found += [
        Setting(f"cell {c:g} m", "cell", c, STANDARD, against="standard", cell=c) for c in (0.25, 0.5, 1.0, 2.0, 5.0)
    ]
    found.append(Setting("smooth", "smooth", 0.0, STANDARD, against="standard", smooth=True))
    return found


SETTINGS: dict[str, Setting] = {setting.name: setting for setting in _all()}
