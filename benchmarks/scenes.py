"""The scenes of the study: synthetic, seeded, generated here, so that they can be reproduced without data.

Local frame: x to the east (0 to WIDTH), y up the slope to the north (0 to LENGTH); slopes fall to the south. Every
terrain is generated with FINEST cells and averaged to coarser ones, as a laser scan is: the same ground is available
with any cell size. Relief is a sum of random waves with the wavelengths that matter to a log of 30 m
(``sample/slope.py``).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from deadwood_engine import Barriers, Lines, Logs, Scene, Shape, Trees
from deadwood_engine.logs import LYING, UPRIGHT

Array = NDArray[np.float64]

SEED = 20261121
WIDTH, LENGTH, FINEST, CELL = 240.0, 400.0, 0.25, 0.5  # [m]
FOOT, RUNOUT = 120.0, 60.0  # [m] y where the steep slope ends, and where the talus does
STEEP, TALUS, MEADOW = np.tan(np.radians((35.0, 17.0, 2.0)))
ROUGHNESS = ((2.0, 0.05), (5.0, 0.12), (14.0, 0.40), (35.0, 0.80))  # (wavelength, standard deviation) [m]
RELEASE, RELEASE_RADIUS, CLEARING = (120.0, 300.0), 5.0, 25.0  # [m]
STEMS_PER_HA, DBH_MEAN, DBH_SD, DBH_LEAST = 200.0, 0.60, 0.19, 0.10  # the sizes of the paper's Klosters forest
LINES_Y = tuple(float(y) for y in (*range(260, 40, -20), 50, 40, 30, 20, 10))  # [m] lines whose reach is counted
FAR_BANK, RISE = 60.0, np.tan(np.radians(14.0))  # [m] y where the ground beyond the gully begins to rise, and how
RING_LOG = (0.6, 25.0, 0.5)  # [m] base diameter and length of the logs made of rings, and the distance of the rings
POSTURES = ("upright", "lying", "random-lying")  # as the releases' orientation calls them; lying: down the slope
LINE_MARGIN = 1.0  # [m] between the ends of the lines and the sides of the DEM


@dataclass(frozen=True)
class Case:
    """A scene of the study.

    name, title : its name and description; friction : Coulomb's coefficient
    heights : function of (x, y, relief) giving the ground [m]
    cell : [m] of its DEM, unless a setting says otherwise
    line : which of LINES_Y counts as "reach" in tables and figures; the others are stored, too
    stems : trees per hectare; fences : (height, x0, y0, x1, y1) of barriers [m]
    """

    name: str
    title: str
    friction: float
    heights: Callable[[Array, Array, Array], Array]
    line: float
    cell: float = CELL
    stems: float = 0.0
    fences: tuple[tuple[float, float, float, float, float], ...] = ()

    @property
    def line_row(self) -> int:
        """Row of the line in LINES_Y."""
        return LINES_Y.index(self.line)


def _slope(x: Array, y: Array, relief: Array) -> Array:
    """A steep slope, a talus, a meadow."""
    smooth = MEADOW * np.minimum(y, RUNOUT) + TALUS * np.clip(y - RUNOUT, 0.0, FOOT - RUNOUT)
    return smooth + STEEP * np.maximum(y - FOOT, 0.0) + relief + 0.0 * x


def _plane(x: Array, y: Array, relief: Array) -> Array:
    return np.tan(np.radians(20.0)) * y + 0.0 * (x + relief)


def _cliff(x: Array, y: Array, relief: Array) -> Array:
    """The slope with a wall of 15 m that a ramp of 15 degrees leads over: logs leave it in flight."""
    edge = 220.0 + 4.0 * np.sin(x / 17.0)
    ramp = np.clip(y - edge, 0.0, 20.0)
    return _slope(x, y, relief) + 15.0 * np.clip((y - edge) / 1.5 + 1.0, 0.0, 1.0) - (STEEP - np.tan(0.26)) * ramp


def _gully(x: Array, y: Array, relief: Array) -> Array:
    """A winding gully, 8 m deep with a bed narrower than a log is long, which catches what slides beside it."""
    bed = 120.0 + 14.0 * np.sin((y - RELEASE[1]) / 32.0)
    # stops logs that come through the bed, which would otherwise leave the DEM
    bank = RISE * np.maximum(FAR_BANK - y, 0.0)
    return _slope(x, y, 0.6 * relief) - 8.0 * np.exp(-(((x - bed) / 13.0) ** 2)) + bank


CASES: dict[str, Case] = {
    case.name: case
    for case in (
        Case("plane", "plane of 20 degrees", 0.50, _plane, 200.0, cell=2.0),
        Case("rough", "rough slope without trees", 0.30, _slope, 30.0),
        Case("forest", "rough slope with 200 stems/ha", 0.30, _slope, 220.0, stems=STEMS_PER_HA),
        Case(
            "barriers", "forest with two barriers", 0.30, _slope, 220.0, stems=STEMS_PER_HA,
            fences=((2.0, 60.0, 238.0, 112.0, 234.0), (4.0, 130.0, 234.0, 190.0, 238.0)),
        ),
        Case("cliff", "cliff and jump", 0.30, _cliff, 30.0),
        Case("gully", "gully and rise beyond it", 0.30, _gully, 30.0),
        Case("sensitive", "rough slope at a friction near its tangent", 0.60, _slope, 120.0),
    )
}  # fmt: skip


def waves(rng: np.random.Generator, shape: tuple[int, int], cell: float, wavelength: float) -> Array:
    """Random relief of one wavelength (+-30 %), mean 0 and standard deviation 1: white noise passed through a ring."""
    frequency = np.hypot(np.fft.fftfreq(shape[0], cell)[:, None], np.fft.rfftfreq(shape[1], cell))
    with np.errstate(divide="ignore"):
        ring = np.exp(-0.5 * (np.log(frequency * wavelength) / 0.3) ** 2)
    relief = np.fft.irfft2(np.fft.rfft2(rng.standard_normal(shape)) * ring, s=shape)
    return relief / relief.std()


@cache
def ground(name: str, cell: float) -> Array:
    """Heights [m] of a scene with cells of this size, row 0 southernmost: the means of the finest ones."""
    shape = (round(LENGTH / FINEST), round(WIDTH / FINEST))
    x, y = (np.arange(shape[1], dtype=float) + 0.5) * FINEST, (np.arange(shape[0], dtype=float)[:, None] + 0.5) * FINEST
    rng = np.random.default_rng(SEED)
    relief = sum((d * waves(rng, shape, FINEST, w) for w, d in ROUGHNESS), np.zeros(shape))
    heights = CASES[name].heights(x, y, relief)
    side = round(cell / FINEST)
    return heights.reshape(shape[0] // side, side, shape[1] // side, side).mean(axis=(1, 3))


def forest(stems: float, *, seed: int = SEED + 1) -> Trees:
    """Trees in random places at least 2 m apart, none where logs are released."""
    rng = np.random.default_rng(seed)
    wanted = round(stems * WIDTH * LENGTH / 1e4)
    place = np.empty((0, 2))
    while len(place) < wanted:
        one = rng.uniform((0.0, 0.0), (WIDTH, LENGTH))
        if np.hypot(*(one - RELEASE)) > CLEARING and (len(place) == 0 or np.hypot(*(place - one).T).min() > 2.0):
            place = np.vstack([place, one])
    dbh = rng.normal(DBH_MEAN, DBH_SD, 4 * wanted + 8)
    dbh = dbh[dbh > DBH_LEAST][:wanted]
    return Trees(place[:, 0], place[:, 1], dbh, (100.0 * dbh) ** 0.8)  # DBH[cm] = H[m]^1.25, the paper's power law


@dataclass(frozen=True)
class Built:
    """A prepared scene, with a digest of everything in it."""

    case: Case
    scene: Scene
    cell: float
    digest: str


@cache
def build(name: str, *, cell: float | None = None, friction_change: float = 0.0, smooth: bool = False) -> Built:
    """Make a scene; ``smooth`` refines its DEM by cubic splines to half the cell, as if it were finer than it is."""
    case = CASES[name]
    cell = cell or case.cell
    heights = ground(name, cell)
    if smooth:
        from scipy.ndimage import zoom  # only here: a test dependency

        heights = np.asarray(zoom(heights, 2, order=3, mode="nearest", grid_mode=True), float)
        cell = cell / 2.0
    trees = forest(case.stems)
    corners = [[(a, b), (c, d)] for _, a, b, c, d in case.fences]
    barriers = Barriers(
        np.array(corners, float).reshape(-1, 2), 2 * np.arange(len(corners) + 1), np.array([f[0] for f in case.fences])
    )
    ends = [[(LINE_MARGIN, y), (WIDTH - LINE_MARGIN, y)] for y in LINES_Y]
    lines = Lines(np.array(ends).reshape(-1, 2), 2 * np.arange(len(LINES_Y) + 1))
    friction = case.friction + friction_change
    scene = Scene.prepare(
        heights, cell, 0.5 * cell, 0.5 * cell, friction=friction, trees=trees, barriers=barriers, lines=lines
    )
    digest = hashlib.sha256(np.asarray(heights, np.float32).tobytes())
    for part in (trees.x, trees.y, trees.diameter, trees.height, barriers.vertices, barriers.height, lines.vertices):
        digest.update(np.ascontiguousarray(part).tobytes())
    digest.update(repr((cell, friction)).encode())
    return Built(case, scene, cell, digest.hexdigest()[:16])


def logs_of_block(block: int, size: int) -> Logs:
    """The logs of one block: the same in every scene and setting, and independent of how many blocks are run."""
    rng = np.random.default_rng((SEED, block))
    distance, around = RELEASE_RADIUS * np.sqrt(rng.random(size)), rng.uniform(0.0, 2.0 * np.pi, size)
    return Logs(
        log_id=np.arange(block * size, (block + 1) * size),
        x=RELEASE[0] + distance * np.cos(around),
        y=RELEASE[1] + distance * np.sin(around),
        diameter=rng.uniform(0.4, 0.8, size),
        length=rng.uniform(15.0, 32.0, size),
        density=np.full(size, 300.0),
        orientation=rng.integers(0, 3, size).astype(np.int8),
        tilt=np.radians(rng.uniform(5.0, 60.0, size)),
        azimuth=rng.uniform(0.0, 2.0 * np.pi, size),
        speed=np.zeros(size),
        drop=np.zeros(size),
    )


def alike(logs: Logs) -> Logs:
    """The same releases, all with the same size."""
    number = len(logs)
    return replace(logs, diameter=np.full(number, RING_LOG[0]), length=np.full(number, RING_LOG[1]))


def in_posture(logs: Logs, posture: str) -> Logs:
    """The same releases, all upright, all lying with the tip down the slope, or all lying towards any azimuth."""
    lying = np.full(len(logs), UPRIGHT if posture == "upright" else LYING, np.int8)
    azimuth = np.full(len(logs), np.pi) if posture == "lying" else logs.azimuth
    return replace(logs, orientation=lying, azimuth=azimuth)


@cache
def rings(vertices: int) -> Shape:
    """Such a log as rings of vertices, as the framework's ``make-log`` writes them."""
    diameter, length, spacing = RING_LOG
    along = np.linspace(0.0, length, round(length / spacing) + 1)
    radius = 0.5 * diameter * (1.0 - 0.5 * along / length)
    turn = 2 * np.pi * np.arange(vertices) / vertices
    rim = radius[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    points = np.concatenate([rim, np.broadcast_to(along[:, None, None], (*rim.shape[:2], 1))], axis=-1)
    return Shape.of(points.reshape(-1, 3))
