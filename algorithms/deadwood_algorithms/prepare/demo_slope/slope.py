"""A synthetic slope in the manner of the paper's Klosters case: terrain, forest, road, release circle, barriers.

Nothing here is measured. Figures taken from the paper (sections 2.1 and 4): a slope of 35 degrees between 1050 and
1300 m, a road at its foot, a release circle of 10 m radius, 300 stems/ha with DBH ~ N(60.23, 18.64) cm, gullies that
the forest leaves free. Arrays and shapes only; ``demo.py`` and ``sample_data/make_sample.py`` write the files.

Local frame: u to the east (0 to 300 m), v up the slope to the north (0 to 500 m); the slope falls to the south.
"""

from __future__ import annotations

import numpy as np
import pyproj
import shapely
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.prepare.synthetic_slope import stem_sizes, stems_apart, waves

CRS_NAME = "EPSG:2056"
EAST, NORTH = 2_786_000.0, 1_196_000.0  # world coordinates of the local origin, a round place in the Praettigau
WIDTH, LENGTH, CELL = 300.0, 500.0, 0.5  # [m]
SEED = 2026

ROAD_V, ROAD_WIDTH, ROAD_HEIGHT = 80.0, 7.0, 1050.0  # [m]
FOOT_V = 117.0  # above this the slope is steep, below it the talus flattens towards the road
SLOPE = np.tan(np.radians(35.0))
TALUS = np.tan(np.radians(22.0))
RELEASE_U, RELEASE_V, RELEASE_RADIUS = 174.0, 262.0, 10.0
CLIFF_V, CLIFF_HEIGHT = 192.0, 8.0  # foot of the cliff band, and its full height
GULLY_DEPTH, GULLY_WIDTH = 1.2, 9.0  # [m] depth, and the distance over which it falls off to 1/e
GULLY_FREE = 9.0  # no tree stands nearer to the gully's bed than this [m]
FOREST_V = (104.0, 490.0)
STEMS_PER_HA = 300.0
DBH_MEAN_CM, DBH_SD_CM, DBH_LEAST_CM = 60.23, 18.64, 10.0
TREE_DISTANCE = 2.0  # living trees compete: no two stand nearer than this [m]

# Roughness: (wavelength [m], standard deviation of height [m]). Micro-relief of a blocky forest floor, blocks and root
# plates, hummocks and shallow benches, and the broad undulation of a slope. A 30 m log bridges relief much shorter
# than itself; relief of its own length makes it pitch and jump, which dissipates its energy.
ROUGHNESS = ((2.0, 0.08), (5.0, 0.22), (14.0, 0.60), (35.0, 1.00), (90.0, 1.20))
# Beyond the road: old rockfall debris under grass. On a smooth meadow a log, which has no rolling resistance, would
# roll to and fro for minutes.
MEADOW_ROUGHNESS = ((3.0, 0.15), (12.0, 0.40))
BEYOND = 0.02  # slope of the meadow, towards the road
NOISE = 0.03  # [m] of the heights even on the road, as in any laser scan


def gully_u(v: ArrayLike) -> NDArray[np.float64]:
    """East coordinate of the gully's bed, which winds a little [m]."""
    v = np.asarray(v, float)
    return 150.0 + 9.0 * np.sin(v / 52.0) + 0.03 * (v - RELEASE_V)


def terrain() -> Grid:
    """Heights of the slope, rounded to a centimetre [m]."""
    columns, rows = int(WIDTH / CELL), int(LENGTH / CELL)
    u = (np.arange(columns) + 0.5) * CELL
    v = ((np.arange(rows) + 0.5) * CELL)[:, None]
    gully = np.exp(-(((u - gully_u(v)) / GULLY_WIDTH) ** 2))
    fade = np.clip((v - ROAD_V - 6.0) / 25.0, 0.0, 1.0)  # the relief fades out towards the road
    rough = np.zeros((rows, columns))
    rng = np.random.default_rng(SEED)
    for wavelength, deviation in ROUGHNESS:
        rough += deviation * waves(rng, rows, columns, wavelength, CELL)
    heights = profile(v) + cliff(u, v) * (1.0 - gully)
    heights = heights + fade * (rough * (1.0 - 0.5 * gully) - GULLY_DEPTH * gully)
    meadow = np.clip((ROAD_V - 0.5 * ROAD_WIDTH - v) / 5.0, 0.0, 1.0)
    heights = heights + meadow * sum(d * waves(rng, rows, columns, w, CELL) for w, d in MEADOW_ROUGHNESS)
    heights = heights + (1.0 - fade) * NOISE * waves(rng, rows, columns, 1.5, CELL)
    return Grid(
        values=np.round(heights, 2).astype(np.float32),
        cell=CELL,
        x0=EAST + 0.5 * CELL,
        y0=NORTH + 0.5 * CELL,
        crs=pyproj.CRS.from_user_input(CRS_NAME),
        path="the sample slope",
    )


def profile(v: ArrayLike) -> NDArray[np.float64]:
    """Height of the smooth slope: valley floor, road, talus, then 35 degrees [m]."""
    v = np.asarray(v, float)
    edge = ROAD_V + 0.5 * ROAD_WIDTH
    floor = BEYOND * np.maximum(edge - ROAD_WIDTH - v, 0.0)  # the road is level, the meadow beyond it rises gently
    talus = TALUS * (np.minimum(v, FOOT_V) - edge)
    steep = SLOPE * (v - FOOT_V)
    return ROAD_HEIGHT + np.where(v <= edge, floor, talus + np.maximum(steep, 0.0))


def cliff(u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
    """Height that the cliff band adds to the smooth slope: a step of about 65 degrees, fading out over 60 m above it
    [m].
    """
    v = np.asarray(v, float) - CLIFF_V - 3.0 * np.sin(np.asarray(u, float) / 23.0)
    whole = np.clip((220.0 - np.asarray(u, float)) / 60.0, 0.0, 1.0)  # it fades out to the east
    rise = np.clip(v / 5.0, 0.0, 1.0)
    ease = np.clip(1.0 - (v - 5.0) / 60.0, 0.0, 1.0)
    return CLIFF_HEIGHT * whole * rise * ease


def forest() -> dict[str, NDArray]:
    """Trees as if mapped: with a minimum distance, none in the gully; 300 stems/ha over the whole forest, gully
    included.
    """
    rng = np.random.default_rng(SEED + 1)
    low, high = FOREST_V
    wanted = round(STEMS_PER_HA * WIDTH * (high - low) / 1e4)
    place = stems_apart(
        rng,
        wanted,
        (1.0, WIDTH - 1.0, low, high),
        TREE_DISTANCE,
        lambda u, v: bool(abs(u - gully_u(v)) < GULLY_FREE),
    )
    dbh, height = stem_sizes(rng, wanted, DBH_MEAN_CM, DBH_SD_CM, DBH_LEAST_CM)
    return {
        "tree_id": np.arange(1, wanted + 1),
        "x": np.round(EAST + place[:, 0], 2),
        "y": np.round(NORTH + place[:, 1], 2),
        "dbh_cm": dbh,
        "height_m": height,
    }


def forest_area() -> shapely.Polygon:
    """The whole forest, gully included."""
    return shapely.box(EAST, NORTH + FOREST_V[0], EAST + WIDTH, NORTH + FOREST_V[1])


def road() -> shapely.LineString:
    """The edge of the road towards the slope: a log that touches it has reached the road."""
    v = NORTH + ROAD_V + 0.5 * ROAD_WIDTH
    return shapely.LineString([(EAST + 2.0, v), (EAST + WIDTH - 2.0, v)])


def release_circle() -> shapely.Polygon:
    return shapely.Point(EAST + RELEASE_U, NORTH + RELEASE_V).buffer(RELEASE_RADIUS, quad_segs=16)


def barriers() -> list[tuple[str, float, shapely.LineString]]:
    """Two rockfall barriers above the road: id, height [m], line."""
    rows = [("west", 3.0, 95.0, 190.0, 112.0), ("east", 5.0, 170.0, 240.0, 122.0)]
    return [
        (name, height, shapely.LineString([(EAST + a, NORTH + v), (EAST + b, NORTH + v + 4.0)]))
        for name, height, a, b, v in rows
    ]


def dams() -> list[dict[str, object]]:
    """Two embankments above the road, as at Klosters; drawn to the east, so that the steep left side is uphill."""
    rows = [("west", 4.0, 30.0, 120.0, 98.0), ("east", 5.0, 112.0, 250.0, 103.0)]
    sides = {"kind": "embankment", "crest_width_m": 2.0, "slope_left_deg": 65.0, "slope_right_deg": 40.0}
    return [
        {"structure_id": name, "height_m": height, **sides, "geometry": _level_line(a, b, v)}
        for name, height, a, b, v in rows
    ]


def flights() -> list[dict[str, object]]:
    """A jump over the cliff band as if mapped: from the last trace above it to the first below."""
    ends = [(EAST + 80.0, NORTH + 199.0), (EAST + 80.0, NORTH + 162.0)]
    return [{"flight_id": "cliff", "dbh_cm": 30.0, "length_m": 15.0, "geometry": shapely.LineString(ends)}]


def deadwood() -> list[dict[str, object]]:
    """Dead trees as if mapped, with what is known of their decay; by no means all of them can slide."""
    rows = [
        (174.0, 262.0, "late II", None, "spruce", 75.0, 30.0),
        (160.0, 275.0, "early III", None, "spruce", 62.0, 27.0),
        (148.0, 305.0, "II", None, "spruce", 48.0, 24.0),
        (152.0, 340.0, None, 3.0, "spruce", 55.0, 26.0),
        (141.0, 230.0, None, 2.0, "beech", 44.0, 22.0),
        (60.0, 300.0, None, 4.0, "beech", 51.0, 23.0),
        (96.0, 260.0, "I", 1.0, "spruce", 66.0, 29.0),
        (210.0, 350.0, "IV", 9.0, "spruce", 70.0, 18.0),
        (240.0, 180.0, None, None, "fir", 58.0, 27.0),
        (120.0, 98.0, "late II", None, "spruce", 60.0, 28.0),
        (200.0, 60.0, "III", None, "pine", 40.0, 20.0),
        (262.0, 410.0, None, 7.0, "pine", 37.0, 19.0),
    ]
    names = ("decay_stage", "years_dead", "species", "dbh_cm", "length_m")
    return [
        {"deadwood_id": k, **dict(zip(names, known, strict=True)), "geometry": shapely.Point(EAST + u, NORTH + v)}
        for k, (u, v, *known) in enumerate(rows, start=1)
    ]


def _level_line(start: float, end: float, v: float) -> shapely.LineString:
    return shapely.LineString([(EAST + start, NORTH + v), (EAST + end, NORTH + v)])
