"""The Klosters-like twin (paper, section 2.1): 35 degrees, gullies with fewer trees, four releases, a road.

Fixed before anything slid on it; ``NUMBERS`` marks the paper's own numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.paper import twin
from deadwood_algorithms.paper.twin import (
    CHOSEN,
    FLOOR_ROUGHNESS,
    GROUND,
    NOISE,
    RELIEF,
    Frame,
    Number,
    Twin,
    layer,
)

NAME = "klosters"
NUMBERS = (
    Number("foot_m", 1050.0, "m", "2.1", "height of the road; the forest lies between 1050 and 1300 m"),
    Number("top_m", 1300.0, "m", "2.1", "minimum height of the terrain's upper edge", compared=True),
    Number("slope_deg", 35.0, "°", "2.1", "of the forested slope"),
    Number("dbh_cm", 75.0, "cm", "2.1, 4", "of all four logs; tip 0.5 DBH (3)"),
    Number("length_m", 30.0, "m", "2.1, 4", "of all four logs"),
    Number("density_kg_m3", 300.0, "kg/m³", "4", ""),
    Number("friction", 0.25, "", "5.1", "on cells of 0.5 m (4)"),
    Number("release_radius_m", 10.0, "m", "4", "circles around the mapped places, logs upright"),
    Number("event_1_path_m", 120.0, "m", "2.1", "slid by event 1 down to the road", compared=True),
    Number("stems_per_ha", 300.0, "1/ha", "4", "over the whole forest, gullies included"),
    Number("dbh_mean_cm", 60.23, "cm", "4", "of the standing trees"),
    Number("dbh_sd_cm", 18.64, "cm", "4", "of the standing trees"),
    Number("embankments", 2, "", "5.1", "in the section shown", compared=True),
    Number("barriers", 6, "", "5.1", "in the section shown"),
    Number("width_m", 600.0, "m", CHOSEN, "room for four releases and their spread"),
    Number("extent_m", 520.0, "m", CHOSEN, "along v: the valley floor, the road and 250 m of altitude"),
    Number("seed", 2022, "", CHOSEN, "of the relief; the trees have the next one. The year of the events"),
    Number("road_v_m", 80.0, "m", CHOSEN, "middle of the road"),
    Number("road_width_m", 7.0, "m", CHOSEN, "two lanes of a national road"),
    Number("beyond_m", 20.0, "m", CHOSEN, "below the road's lower edge: more than the half log that overhangs it"),
    Number("talus_deg", 22.0, "°", CHOSEN, "of the flatter foot above the road, as on the sample slope"),
    Number("talus_top_v_m", 117.0, "m", CHOSEN, "above it the slope has its 35 degrees, as on the sample slope"),
    Number("floor_slope", 0.02, "", CHOSEN, "the ground beyond the road rises away from it a little"),
    Number(
        "release_v_m",
        (183.0, 240.0, 315.0, 385.0),
        "m",
        CHOSEN,
        "event 1 at the distance from the road given in the paper; the others spread over the slope",
    ),
    Number("release_gully", (1, 2, 2, 3), "", CHOSEN, "the gully by which each release is placed"),
    Number(
        "release_off_gully_m",
        (-16.25, -48.75, 48.75, 16.25),
        "m",
        CHOSEN,
        "east of its bed: middles of four equal parts of the spacing, so that no distance is favoured",
    ),
    Number("gully_u_m", (170.0, 300.0, 430.0), "m", GROUND, "mean place of three winding gullies; 100 to 150 m apart"),
    Number("gully_wind_m", 9.0, "m", CHOSEN, "by how much they wind, over 2 pi x 52 m, as on the sample slope"),
    Number("gully_depth_m", 4.0, "m", GROUND, "2 to 8; channels of 1.2 m vanish in the relief"),
    Number("gully_width_m", 9.0, "m", GROUND, "falls off to 1/e over it: 15 m wide at half its depth, real: 5 to 28"),
    Number("gully_calm", 0.5, "", CHOSEN, "reduction of the roughness in a bed; 'low surface roughness' (6.3)"),
    Number("gully_free_m", 2.0, "m", GROUND, "no mapped tree closer to a bed; 1.5 to 3. That beds are free: 6.2"),
    Number(
        "gully_edge_m", 5.0, "m", GROUND, "fewer trees out to this distance from a bed; 'less densely forested' (6.2)"
    ),
    Number("gully_edge_density", 0.72, "", GROUND, "relative to the density elsewhere; 0.65 to 0.8"),
    Number("cliff_v_m", (), "m", "2.1", "feet of cliff bands: the paper's cliffs are above the forest, so none"),
    Number("cliff_height_m", (), "m", "2.1", "full height of the bands; interrupted by the gullies"),
    Number("forest_v_m", (104.0, 510.0), "m", CHOSEN, "from above the road to the top"),
    Number("dbh_least_cm", 1.0, "cm", CHOSEN, "a draw below is drawn again, as generate-forest does"),
    Number("tree_distance_m", 2.0, "m", CHOSEN, "minimum distance of mapped stems; living trees compete"),
    Number("dam_height_m", 5.0, "m", CHOSEN, "about the height of reinforced earth for 5000 kJ (2.1)"),
    Number("dam_v_m", (98.0, 103.0), "m", CHOSEN, "on the talus above the road, overlapping in the middle"),
    Number("barrier_height_m", 4.0, "m", CHOSEN, "usual for nets of 2000 kJ (2.1)"),
    Number("barrier_v_m", 128.0, "m", CHOSEN, "where the slope begins; 400 m in all (2.1)"),
    *RELIEF,
)
VERSION_1: dict[str, Any] = twin.VERSION_1 | {
    "release_gully": (1, 2, 3, 2),
    "release_off_gully_m": (-12.0, -16.0, 14.0, 60.0),
    "gully_depth_m": 1.2,
    "gully_free_m": 9.0,
    "gully_edge_m": 9.0,
    "gully_edge_density": 1.0,
    "cliff_v_m": (215.0, 290.0),
    "cliff_height_m": (6.0, 10.0),
}
K = twin.numbers_by_name(NUMBERS)


def frame_of(k: Mapping[str, Any]) -> Frame:
    return Frame(2_786_000.0, 1_196_000.0, k["width_m"], k["extent_m"])


FRAME = frame_of(K)


def gully_beds(v: ArrayLike, k: Mapping[str, Any] = K) -> list[NDArray[np.float64]]:
    """East coordinate of the bed of each gully [m]."""
    v = np.asarray(v, float)
    return [u + k["gully_wind_m"] * np.sin(v / 52.0 + 2.1 * turn) for turn, u in enumerate(k["gully_u_m"])]


def _profile(v: ArrayLike, k: Mapping[str, Any]) -> NDArray[np.float64]:
    """Height of the smooth slope: valley floor, level road, talus, then 35 degrees [m]."""
    v = np.asarray(v, float)
    edge = k["road_v_m"] + 0.5 * k["road_width_m"]
    top = k["talus_top_v_m"]
    floor = k["floor_slope"] * np.maximum(edge - k["road_width_m"] - v, 0.0)
    talus = np.tan(np.radians(k["talus_deg"])) * np.clip(v - edge, 0.0, top - edge)
    return k["foot_m"] + floor + talus + np.tan(np.radians(k["slope_deg"])) * np.maximum(v - top, 0.0)


def _terrain(k: Mapping[str, Any]) -> twin.Grid:
    """Heights of the slope."""
    frame = frame_of(k)
    u, v = frame.axes()
    rng = np.random.default_rng(k["seed"])
    gully = sum(np.exp(-(((u - bed) / k["gully_width_m"]) ** 2)) for bed in gully_beds(v, k))
    lower = k["road_v_m"] - 0.5 * k["road_width_m"]
    fade = np.clip((v - k["road_v_m"] - 6.0) / 25.0, 0.0, 1.0)  # the relief fades out towards the road
    bands = zip(k["cliff_v_m"], k["cliff_height_m"], strict=True)
    heights = _profile(v, k) + sum((_cliff(u, v, *band) for band in bands), np.zeros(frame.shape)) * (1.0 - gully)
    short, long = twin.relief(rng, frame, k)
    rough = short * (1.0 - k["gully_calm"] * gully) + long
    heights = heights + fade * (rough - k["gully_depth_m"] * gully)
    heights = heights + np.clip((lower - v) / 5.0, 0.0, 1.0) * twin.roughness(rng, frame, FLOOR_ROUGHNESS)
    return frame.grid(heights + (1.0 - fade) * twin.roughness(rng, frame, ((1.5, NOISE),)), NAME)


def _cliff(u: NDArray[np.float64], v: NDArray[np.float64], foot: float, height: float) -> NDArray[np.float64]:
    """Height that a cliff band adds to the smooth slope: a step over 5 m, fading out over 60 m above it [m]."""
    up = v - foot - 3.0 * np.sin(u / 23.0)
    return height * np.clip(up / 5.0, 0.0, 1.0) * np.clip(1.0 - (up - 5.0) / 60.0, 0.0, 1.0)


def _free_of_trees(k: Mapping[str, Any]) -> Callable[[float, float], bool]:
    """Whether a drawn tree is dropped: always in a bed, by chance beside one."""
    rng = np.random.default_rng(k["seed"] + 2)

    def free(u: float, v: float) -> bool:
        distance = min(abs(u - float(bed)) for bed in gully_beds(v, k))
        if distance < k["gully_free_m"]:
            return True
        return distance < k["gully_edge_m"] and bool(rng.random() >= k["gully_edge_density"])

    return free


def releases(k: Mapping[str, Any]) -> list[tuple[float, float]]:
    """u and v of the centres of the four release circles [m]."""
    places = zip(k["release_gully"], k["release_off_gully_m"], k["release_v_m"], strict=True)
    return [(float(gully_beds(v, k)[gully - 1]) + off, v) for gully, off, v in places]


def klosters(version: int = 2, **changes: Any) -> Twin:
    """The twin, computed from its numbers, of which some may be changed to see what depends on them."""
    k = twin.changed(NUMBERS, VERSION_1, version, **changes)
    frame = frame_of(k)
    edge = k["road_v_m"] + 0.5 * k["road_width_m"]
    below = edge - k["road_width_m"] - k["beyond_m"]
    dams = [("west", 30.0, 310.0, k["dam_v_m"][0]), ("east", 300.0, 570.0, k["dam_v_m"][1])]
    nets = [(f"net_{n + 1}", 90.0 + 70.0 * n, 157.0 + 70.0 * n) for n in range(k["barriers"])]
    sides = {"kind": "embankment", "height_m": k["dam_height_m"], "crest_width_m": 2.0}
    layers = {
        "trees": twin.forest_layer(frame, k, _free_of_trees(k)),
        "forest": layer({"name": ["forest"]}, [frame.strip(*k["forest_v_m"])]),
        "releases": layer({"release_id": [1, 2, 3, 4]}, [frame.point(*place) for place in releases(k)]),
        "lines": layer({"line_id": ["road", "beyond"]}, [frame.across(edge), frame.across(below)]),
        "barriers": layer(
            {"barrier_id": [row[0] for row in nets], "height_m": k["barrier_height_m"]},
            [frame.across(k["barrier_v_m"], *row[1:]) for row in nets],
        ),
        "dams": layer(
            {"structure_id": [row[0] for row in dams], **sides, "slope_left_deg": 65.0, "slope_right_deg": 40.0},
            [frame.across(v, a, b) for _, a, b, v in dams],
        ),
    }
    facts = {"title": "Klosters-like twin", **{name: k[name] for name in FACTS}, "road": "road", "beyond": "beyond"}
    return Twin(NAME, _terrain(k), layers, facts)


FACTS = ("friction", "dbh_cm", "length_m", "density_kg_m3", "release_radius_m")
