"""The Rothenbrunnen-like twin (paper, section 2.2): no gullies, a row of barriers, a terrace above one, road and rail.

Fixed before anything slid on it; ``NUMBERS`` marks the paper's own numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.paper import twin
from deadwood_algorithms.paper.twin import (
    CHOSEN,
    FLOOR_ROUGHNESS,
    NOISE,
    RELIEF,
    Frame,
    Number,
    Twin,
    layer,
)

NAME = "rothenbrunnen"
NUMBERS = (
    Number("foot_m", 600.0, "m", "2.2", "height of the road; the forest lies between 600 and 1000 m"),
    Number("slope_deg", 37.5, "°", "2.2", "the middle of 35 to 40 degrees"),
    Number("fall_m", 200.0, "m", "2.2", "from the release down to the road"),
    Number("barrier_height_m", 3.5, "m", "2.2", "of the barrier that was jumped; of all of them here"),
    Number("terrace_above_m", 20.0, "m", "2.2", "from the barrier up to the terrace's edge, in plan"),
    Number(
        "takeoff_ms",
        24.0,
        "m/s",
        "5.2",
        "of the paper's parabola; sets how far the wall is from the terrace",
        compared=True,
    ),
    Number("dbh_cm", 30.0, "cm", "4", "of the log; tip 0.5 DBH (3)"),
    Number("length_m", 15.0, "m", "4", "of the log"),
    Number("density_kg_m3", 300.0, "kg/m³", "4", ""),
    Number("friction", 0.25, "", "5.2", "on cells of 0.5 m (4)"),
    Number("release_radius_m", 10.0, "m", "4", "circle around the mapped place, logs upright"),
    Number("stems_per_ha", 315.0, "1/ha", "4", ""),
    Number("dbh_mean_cm", 44.0, "cm", "4", "of the standing trees"),
    Number("dbh_sd_cm", 22.0, "cm", "4", "of the standing trees"),
    Number("gullies", 0, "", "6.2", "no clear preferential paths in gullies", compared=True),
    Number("width_m", 360.0, "m", CHOSEN, "room for one release and its spread"),
    Number("extent_m", 400.0, "m", CHOSEN, "along v: valley floor, rail, road, and the slope to above the release"),
    Number("seed", 2202, "", CHOSEN, "of the relief; the trees have the next one. The month of the event"),
    Number("road_v_m", (60.0, 67.0), "m", CHOSEN, "its two edges; the guard rail stands on the lower one"),
    Number("rail_v_m", 48.0, "m", CHOSEN, "the railway beyond the road"),
    Number("wall_m", 3.0, "m", CHOSEN, "retaining wall at the road's upper edge; the paper names one (2.2)"),
    Number(
        "terrace_to_wall_m",
        55.0,
        "m",
        CHOSEN,
        "in plan: a flight of 24 m/s (5.2) from a terrace of 15 degrees comes down there",
    ),
    Number("terrace_deg", 15.0, "°", CHOSEN, "a small terrace is flatter than its slope, seldom level"),
    Number("terrace_deep_m", 6.0, "m", CHOSEN, "in plan; below its edge 45 degrees down to the slope"),
    Number("terrace_u_m", (50.0, 120.0), "m", CHOSEN, "over the width of the first barrier, fading out over 10 m"),
    Number("terrace_calm", 0.9, "", CHOSEN, "reduction of the roughness on it and 8 m around, fading out over 12 m"),
    Number(
        "terrace_ease_m",
        40.0,
        "m",
        CHOSEN,
        "the long waves return over this length: closer ones would tilt the terrace and the barrier below it",
    ),
    Number(
        "barrier_u_m",
        (50.0, 110.0, 170.0, 230.0, 290.0),
        "m",
        CHOSEN,
        "ends of four barriers in a row; the first is the paper's southernmost",
    ),
    Number("release_u_m", 140.0, "m", CHOSEN, "off the first barrier, which in the paper a third of the logs met"),
    Number("floor_slope", 0.02, "", CHOSEN, "the ground beyond the road rises away from it a little"),
    Number("forest_v_m", (80.0, 395.0), "m", CHOSEN, "from above the road to the top"),
    Number("dbh_least_cm", 1.0, "cm", CHOSEN, "a draw below is drawn again, as generate-forest does"),
    Number("tree_distance_m", 2.0, "m", CHOSEN, "minimum distance of mapped stems; living trees compete"),
    Number(
        "rock_friction",
        0.2,
        "",
        CHOSEN,
        "of the rocks of 6.3, before they slip. The paper uses ground parameters of RAMMS but does not give them; "
        "this and the next are those of the example in Leine et al. (2014, 5.1), whose friction law this is",
    ),
    Number(
        "rock_slip",
        (1.3, 0.7, 20.0),
        "-, 1/m, 1/s",
        CHOSEN,
        "friction after much slip, how fast it grows with slip, how fast slip decays in the air; version 1 "
        "has one friction, with which most rocks stay where they are released",
    ),
    Number("rock_density_kg_m3", 2700.0, "kg/m³", CHOSEN, "of the rocks of 6.3"),
    *RELIEF,
)
VERSION_1: dict[str, Any] = twin.VERSION_1 | {"rock_friction": 0.5, "rock_slip": None}
K = twin.numbers_by_name(NUMBERS)


def frame_of(k: Mapping[str, Any]) -> Frame:
    return Frame(2_752_000.0, 1_181_000.0, k["width_m"], k["extent_m"])


FRAME = frame_of(K)


def lip_of(k: Mapping[str, Any]) -> float:
    """Where the lower edge of the terrace is, along v [m]."""
    return k["road_v_m"][1] + k["terrace_to_wall_m"]


def slope_of(k: Mapping[str, Any]) -> float:
    return np.tan(np.radians(k["slope_deg"]))


def _profile(v: ArrayLike, k: Mapping[str, Any]) -> NDArray[np.float64]:
    """Height of the smooth slope: valley floor, level road, retaining wall, then 37.5 degrees [m]."""
    v = np.asarray(v, float)
    low, high = k["road_v_m"]
    floor = k["floor_slope"] * np.maximum(low - v, 0.0)
    return k["foot_m"] + floor + k["wall_m"] * (v >= high) + slope_of(k) * np.maximum(v - high, 0.0)


def _terrace(u: NDArray[np.float64], v: NDArray[np.float64], k: Mapping[str, Any]) -> NDArray[np.float64]:
    """Height that the terrace adds to the smooth slope: a wedge, highest at its lower edge [m]."""
    rise = k["terrace_deep_m"] * (slope_of(k) - np.tan(np.radians(k["terrace_deg"])))
    above = rise * (1.0 - (v - lip_of(k)) / k["terrace_deep_m"])
    below = rise - (lip_of(k) - v) * (1.0 - slope_of(k))  # 45 degrees
    return _along_terrace(u, k) * np.maximum(np.where(v >= lip_of(k), above, below), 0.0)


def _along_terrace(u: NDArray[np.float64], k: Mapping[str, Any], ease: float = 10.0) -> NDArray[np.float64]:
    """1 on the terrace, fading out to 0 beside it [m]."""
    first, last = k["terrace_u_m"]
    return np.clip((u - first) / ease + 1.0, 0.0, 1.0) * np.clip((last - u) / ease + 1.0, 0.0, 1.0)


def _calm(
    u: NDArray[np.float64], v: NDArray[np.float64], k: Mapping[str, Any], along: float, down: float
) -> NDArray[np.float64]:
    """The share of the relief that remains around the terrace; it returns over these lengths [m]."""
    beside = np.maximum(np.abs(v - lip_of(k)) - 8.0, 0.0) / down
    return 1.0 - k["terrace_calm"] * _along_terrace(u, k, along) * np.clip(1.0 - beside, 0.0, 1.0)


def _terrain(k: Mapping[str, Any]) -> twin.Grid:
    """Heights of the slope."""
    frame = frame_of(k)
    u, v = frame.axes()
    rng = np.random.default_rng(k["seed"])
    _, high = k["road_v_m"]
    fade = np.clip((v - high - 2.0) / 25.0, 0.0, 1.0)  # the relief fades out towards the road
    short, long = twin.relief(rng, frame, k)
    heights = _profile(v, k) + _terrace(u, v, k) + fade * _calm(u, v, k, 10.0, 12.0) * short
    heights = heights + fade * _calm(u, v, k, k["terrace_ease_m"], k["terrace_ease_m"]) * long
    heights = heights + np.clip((k["rail_v_m"] - 5.0 - v) / 5.0, 0.0, 1.0) * twin.roughness(rng, frame, FLOOR_ROUGHNESS)
    return frame.grid(heights + (1.0 - fade) * twin.roughness(rng, frame, ((1.5, NOISE),)), NAME)


def rothenbrunnen(version: int = 2, **changes: Any) -> Twin:
    """The twin, computed from its numbers, of which some may be changed to see what depends on them."""
    k = twin.changed(NUMBERS, VERSION_1, version, **changes)
    frame, lip = frame_of(k), lip_of(k)
    release = k["road_v_m"][1] + (k["fall_m"] - k["wall_m"]) / slope_of(k)
    low, high = k["road_v_m"]
    ends = k["barrier_u_m"]
    names = ["south", *(f"net_{n}" for n in range(2, len(ends)))]
    lines = {
        "road": frame.across(high),
        "guard_rail": frame.across(low),
        "railway": frame.across(k["rail_v_m"]),
        "terrace": frame.across(lip, *k["terrace_u_m"]),
    }
    middle = 0.5 * (ends[0] + ends[1])
    layers = {
        "trees": twin.forest_layer(frame, k),
        "forest": layer({"name": ["forest"]}, [frame.strip(*k["forest_v_m"])]),
        "releases": layer({"release_id": [1]}, [frame.point(k["release_u_m"], release)]),
        "lines": layer({"line_id": list(lines)}, list(lines.values())),
        "barriers": layer(
            {"barrier_id": names, "height_m": k["barrier_height_m"]},
            [frame.across(lip - k["terrace_above_m"], a + 0.5, b - 0.5) for a, b in pairwise(ends)],
        ),
        "flight": layer(
            {"flight_id": ["event"], "dbh_cm": [k["dbh_cm"]], "length_m": [k["length_m"]]},
            [frame.line((middle, lip), (middle, high + 0.75))],
        ),
    }
    facts = {
        "title": "Rothenbrunnen-like twin",
        **{name: k[name] for name in FACTS},
        "road": "road",
        "jumped_barrier": "south",
        "takeoff_line": "terrace",
    }
    return Twin(NAME, _terrain(k), layers, facts)


FACTS = (
    "friction",
    "dbh_cm",
    "length_m",
    "density_kg_m3",
    "release_radius_m",
    "rock_friction",
    "rock_slip",
    "rock_density_kg_m3",
)
