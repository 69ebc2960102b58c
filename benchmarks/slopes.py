"""Random slopes of ordinary use, by number: the population of which ``population`` measures the errors.

Every slope is drawn from its number and nothing else. It has a steep part (20 to 45 degrees) and a flatter foot, the
relief that was measured on real steep ground (waves of 2.5 to 90 m in patches, times 0.3 to 1.3), up to 12 cm of noise
from cell to cell, and any of: channels, road benches, cliffs, boulders, stumps, lying logs, a forest, a barrier. One
slope in four (``in_gully``) has only the ground, and one or two channels in which the logs are released.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_engine import Barriers, Blocks, Lines, Logs, LyingLogs, Scene, Trees
from deadwood_engine.logs import LYING, TILTED, UPRIGHT

from .scenes import waves

Array = NDArray[np.float64]

SEED = 20261128
WIDTH, LENGTH, MARGIN = 120.0, 240.0, 2.0  # [m]
RELEASE, RELEASE_RADIUS = (60.0, 200.0), 6.0  # [m]
LINES_Y = (180.0, 160.0, 135.0, 110.0, 85.0, 60.0, 35.0)  # [m]
OBSTACLES_Y = (10.0, 180.0)  # [m] none where logs are released
RELIEF = ((2.5, 0.07), (6.0, 0.15), (14.0, 0.25), (35.0, 0.6), (90.0, 1.7))  # (wavelength, standard deviation) [m]
IN_PATCHES = 20.0  # [m] waves up to this length come in patches of ROUGH_PATCHES metres
ROUGH_PATCHES = 60.0
RESOLVED = 2.4  # cells of a wave that a terrain model shows
DEEPEST = 6.0  # [m] of a channel
SLENDER = 55.0  # greatest length over diameter
CAUGHT = 0.03  # least distance of friction from the slope's tangent


def in_gully(number: int) -> bool:
    return number % 4 == 3


@dataclass(frozen=True)
class Slope:
    """A slope: what it is made of, its scene, and its name."""

    number: int
    attempt: int
    made_of: dict[str, Any]
    scene: Scene

    def logs(self, stream: int, count: int) -> Logs:
        """Logs to release; streams share none."""
        p, rng = self.made_of, np.random.default_rng((SEED, self.number, self.attempt, stream))
        distance, around = RELEASE_RADIUS * np.sqrt(rng.random(count)), rng.uniform(0.0, 2.0 * np.pi, count)
        sizes = 1.0 + p["sizes_vary"] * rng.uniform(-1.0, 1.0, (2, count))
        any_way = rng.uniform(0.0, 2.0 * np.pi, count)
        mixed = rng.integers(0, 3, count)
        posture = {"upright": UPRIGHT, "tilted": TILTED, "mixed": mixed}.get(p["posture"], LYING)
        return Logs(
            log_id=np.arange(count),
            x=RELEASE[0] + distance * np.cos(around),
            y=RELEASE[1] + distance * np.sin(around),
            diameter=p["diameter_m"] * sizes[0],
            length=p["length_m"] * sizes[1],
            density=np.full(count, 300.0),
            orientation=np.broadcast_to(posture, count).astype(np.int8),
            tilt=np.radians(rng.uniform(5.0, 60.0, count)),
            azimuth=np.full(count, np.pi) if p["posture"] == "lying downhill" else any_way,
            speed=np.zeros(count),
            drop=np.zeros(count),
        )


def _drawn(number: int, rng: np.random.Generator) -> dict[str, Any]:
    """What a slope is made of, in metres, degrees and pieces per hectare."""

    def perhaps(chance: float, low: float, high: float) -> float:
        value, there = rng.uniform(low, high), rng.random() < chance
        return float(value) if there else 0.0

    p: dict[str, Any] = {
        "slope_deg": rng.uniform(20, 45), "foot_deg": rng.uniform(4, 18), "foot_y": rng.uniform(70, 130),
        "cell_m": float(rng.choice([0.25, 0.5, 0.5, 0.5, 1.0, 1.0, 2.0])),
        "friction": rng.uniform(0.2, 0.5), "rolling": rng.uniform(0.05, 0.15),
        "relief": rng.uniform(0.3, 1.3), "noise_m": perhaps(0.8, 0.0, 0.12),
        "diameter_m": rng.uniform(0.2, 0.8), "length_m": rng.uniform(8, 35), "sizes_vary": perhaps(0.5, 0.25, 0.25),
        "posture": str(rng.choice(["upright", "lying", "lying downhill", "tilted", "mixed"])),
        "channels": int(rng.choice([0, 0, 1, 1, 2, 3])), "benches": int(rng.choice([0, 0, 1, 2])),
        "cliffs": int(rng.choice([0, 0, 0, 1, 2])), "boulders": perhaps(0.3, 20, 300), "stumps": perhaps(0.2, 50, 400),
        "lying_logs": perhaps(0.25, 10, 100), "stems": perhaps(0.5, 50, 800), "dbh_m": rng.uniform(0.15, 0.6),
        "barrier_m": perhaps(0.15, 0.8, 4.0),
    }  # fmt: skip
    p["diameter_m"] = max(p["diameter_m"], p["length_m"] / SLENDER)
    if in_gully(number):
        p |= {"channels": 1 + p["channels"] % 2}
        p |= dict.fromkeys(("boulders", "stumps", "lying_logs", "stems", "barrier_m"), 0.0)
    return {name: float(value) if isinstance(value, float) else value for name, value in p.items()}


def slides(number: int, attempt: int) -> bool:
    """Whether logs would start to slide on the mean slope at all."""
    p = _drawn(number, np.random.default_rng((SEED, number, attempt)))
    return p["friction"] < np.tan(np.radians(p["slope_deg"])) - CAUGHT


def slope_of(number: int, attempt: int) -> Slope:
    """A slope; if it is of no use (``population.chosen``), the next attempt is another one of the same number."""
    rng = np.random.default_rng((SEED, number, attempt))
    p = _drawn(number, rng)
    heights = _ground(number, p, rng)
    trees, blocks, lying, barriers = _obstacles(p, rng)
    ends = np.array([[(1.5, y), (WIDTH - 1.5, y)] for y in LINES_Y]).reshape(-1, 2)
    cell = p["cell_m"]
    scene = Scene.prepare(
        heights, cell, 0.5 * cell, 0.5 * cell, friction=p["friction"], trees=trees, blocks=blocks, lying_logs=lying,
        barriers=barriers, lines=Lines(ends, 2 * np.arange(len(LINES_Y) + 1)),
    )  # fmt: skip
    return Slope(number, attempt, p, scene)


def _ground(number: int, p: dict[str, Any], rng: np.random.Generator) -> Array:
    """Heights, row 0 southernmost; the slope falls to the south."""
    cell, steep = p["cell_m"], np.tan(np.radians(p["slope_deg"]))
    shape = (round(LENGTH / cell), round(WIDTH / cell))
    x, y = (np.arange(shape[1]) + 0.5)[None, :] * cell, (np.arange(shape[0]) + 0.5)[:, None] * cell
    foot = np.minimum(y, p["foot_y"])
    z = np.tan(np.radians(p["foot_deg"])) * foot + steep * (y - foot) + 0.0 * x
    patches = np.clip(np.exp(0.6 * waves(rng, shape, cell, ROUGH_PATCHES)), 0.4, 2.0)
    for wavelength, deviation in RELIEF:
        if wavelength >= RESOLVED * cell:
            relief = p["relief"] * deviation * waves(rng, shape, cell, wavelength)
            z += relief * (patches if wavelength < IN_PATCHES else 1.0)
    for _ in range(p["channels"]):
        z -= _channel(number, p, x, y, rng)
    for _ in range(p["benches"]):
        middle, width, edge = rng.uniform(p["foot_y"], 180.0), rng.uniform(2.5, 5.0), rng.choice([0.5, 1.5, 3.0])
        dy = y - middle - rng.uniform(0.0, 4.0) * np.sin(x / 20.0)
        beyond = np.clip(1.0 - (np.abs(dy) - width / 2.0) / edge, 0.0, 1.0)
        z -= steep * np.where(np.abs(dy) < width / 2.0, dy, np.sign(dy) * width / 2.0 * beyond)
    for _ in range(p["cliffs"]):
        middle, height, edge = rng.uniform(p["foot_y"] - 30.0, 180.0), rng.uniform(2, 10), rng.uniform(0.5, 2)
        z += height * np.clip((y - middle - 4.0 * np.sin(x / 17.0)) / edge, 0.0, 1.0)
    return z + p["noise_m"] * rng.standard_normal(shape)


def _channel(number: int, p: dict[str, Any], x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Depth of a winding channel of V or round section; in the gullies it is nearly straight, below the releases."""
    straight = in_gully(number)
    width, side, is_round = rng.uniform(2, 12), rng.uniform(20, 60), rng.random() < 0.5
    swing, wavelength = rng.uniform(0, 8) * (0.2 if straight else 1.0), rng.uniform(12, 40)
    x0 = RELEASE[0] + rng.uniform(-12, 12) / (3.0 if straight else 1.0)
    end, phase = rng.uniform(15, p["foot_y"]), rng.uniform(0, 2.0 * np.pi)
    off = np.abs(x - x0 - swing * (np.sin(y / wavelength + phase) - np.sin(RELEASE[1] / wavelength + phase)))
    deep = min(np.tan(np.radians(side)) * width / (4.0 if is_round else 2.0), DEEPEST)
    cut = np.maximum(0.0, deep * (1.0 - (2.0 * off / width) ** (2 if is_round else 1)))
    section, aside = "round" if is_round else "V", abs(x0 - RELEASE[0])
    p.setdefault("channel", []).append(f"{section}, {width:.0f} m wide, sides {side:.0f} degrees, {aside:.0f} m off")
    return cut * np.clip((y - end) / 15.0, 0.0, 1.0)


def _obstacles(p: dict[str, Any], rng: np.random.Generator) -> tuple[Trees, Blocks, LyingLogs, Barriers]:
    hectares = WIDTH * (OBSTACLES_Y[1] - OBSTACLES_Y[0]) / 1e4

    def places(per_hectare: float) -> tuple[Array, Array]:
        count = round(per_hectare * hectares)
        return rng.uniform(MARGIN, WIDTH - MARGIN, count), rng.uniform(*OBSTACLES_Y, count)

    x, y = places(p["stems"])
    dbh = np.maximum(rng.normal(p["dbh_m"], 0.3 * p["dbh_m"], len(x)), 0.08)
    stump_x, stump_y = places(p["stumps"])
    stump = rng.uniform([[0.2], [0.3]], [[0.6], [0.8]], (2, len(stump_x)))  # diameters and heights [m]
    trees = Trees(
        np.r_[x, stump_x], np.r_[y, stump_y], np.r_[dbh, stump[0]], np.r_[(100.0 * dbh) ** 0.8, stump[1]]
    )  # DBH[cm] = H[m]^1.25
    x, y = places(p["boulders"])
    across = rng.uniform(0.5, 2.0, len(x))
    blocks = Blocks(x, y, across, across * rng.uniform(0.3, 0.9, len(x)))
    middle = np.column_stack(places(p["lying_logs"]))
    towards, length = rng.uniform(0.0, np.pi, len(middle)), rng.uniform(8, 25, len(middle))
    half = 0.5 * length[:, None] * np.column_stack([np.cos(towards), np.sin(towards)])
    ends = np.stack([middle - half, middle + half], axis=1).reshape(-1, 2)
    thick = rng.uniform(0.2, 0.6, len(middle))
    inside = ([MARGIN, MARGIN], [WIDTH - MARGIN, LENGTH - MARGIN])
    lying = LyingLogs(np.clip(ends, *inside), 2 * np.arange(len(middle) + 1), thick, thick / 2.0)
    if not p["barrier_m"]:
        return trees, blocks, lying, Barriers.none()
    x0, y0, wide = rng.uniform(40, 80), rng.uniform(p["foot_y"] - 20.0, 150.0), rng.uniform(15, 40)
    fence = np.clip([[x0 - wide, y0], [x0 + wide, y0]], *inside)
    return trees, blocks, lying, Barriers(fence, np.array([0, 2]), np.array([p["barrier_m"]]))
