"""Run by ``test_bounds``: scenes of every kind with every index checked, and planted defects to verify the check.

Compiled code reads and writes beyond its tables silently. Two modes detect it: NUMBA_BOUNDSCHECK=1 compiles the check
into every kernel (50 s for all that logs need; such kernels cannot be cached), and NUMBA_DISABLE_JIT=1 runs the kernels
as Python (no compilation; NumPy checks). Logs use the first, because only there an invalid number becomes the same
integer as for users; clouds, whose kernels would take as long again, and sweeps of stored poses use the second. Prints
one line of JSON: which case ended how, and which planted defects were detected.
"""

import json
import sys
import warnings

import numpy as np

from deadwood_engine import (
    FIDELITIES,
    STOP_REASONS,
    Barriers,
    Blocks,
    Fidelity,
    Lines,
    Logs,
    LyingLogs,
    Rasters,
    Result,
    Scene,
    Shape,
    Stages,
    Start,
    Trees,
    place_logs,
    segments_of,
    slide,
    sweep_hits,
    sweep_touches,
)
from deadwood_engine.peaks import CellPeaks
from deadwood_engine.scratch import Scratch

SIZE = 24.0
COARSE = FIDELITIES["draft"]
FINE = FIDELITIES["standard"]


def scene(*kinds: str) -> Scene:
    """A rough slope of 24 x 24 m, a window of a larger DEM, with the requested obstacles in the path of the logs."""
    rng = np.random.default_rng(4)
    cells = int(SIZE / 0.5)
    heights = 0.7 * 0.5 * np.arange(cells)[:, None] + 0.15 * rng.random((cells, cells))
    if "edge" in kinds:
        heights[14:22, 10:30] = np.nan
        heights[rng.random(heights.shape) < 0.01] = np.nan
    x0, y0, first = 1000.0, 2000.0, (300, 700)
    corner = np.array([x0, y0]) + 0.5 * np.array(first)

    def lines(*points) -> tuple[np.ndarray, np.ndarray]:
        return corner + np.array(points, float), np.arange(0, len(points) + 1, 2)

    parts = {}
    if "trees" in kinds:
        # also one in another, and one that a log is released in
        x, y = np.append(rng.uniform(0, SIZE, (2, 60)), [[12.0, 12.05, 8.0], [9, 9, 15]], axis=1)
        parts["trees"] = Trees(corner[0] + x, corner[1] + y, np.full(len(x), 0.3), rng.choice([0.4, 3.0, 20.0], len(x)))
    if "barriers" in kinds:
        parts["barriers"] = Barriers(
            *lines((2, 9), (11, 9), (11, 9), (22, 7), (3, 9.5), (10, 8.5)), np.array([0.6, 3, 1])
        )
    if "lying logs" in kinds:
        points = lines((2, 8), (12, 8.5), (11, 10), (22, 9), (0, 3), (23.4, 3))
        parts["lying_logs"] = LyingLogs(*points, np.array([0.4, 0.7, 0.3]), np.array([0.2, 0.7, 0.3]))
    if "blocks" in kinds:
        x, y = np.linspace(0.5, 23.5, 16), np.full(16, 6.0)
        parts["blocks"] = Blocks(corner[0] + x, corner[1] + y, np.full(16, 1.4), np.full(16, 1.0))
    if "lines" in kinds:
        parts["lines"] = Lines(*lines((0, 5), (24, 5), (-90, 2), (90, 3), (500, 0), (500, 9)))
    return Scene.prepare(heights, 0.5, x0, y0, friction=0.35, first=first, reference=0.0, **parts)


def logs(place: Scene, number: int) -> Logs:
    """Of every orientation, size and speed, some at the DEM's border."""
    rng = np.random.default_rng(5)
    terrain = place.arrays.terrain
    x = terrain.x0 + 0.5 * terrain.column + rng.uniform(0.3, SIZE - 1.0, number)
    y = terrain.y0 + 0.5 * terrain.row + rng.uniform(11.0, SIZE - 1.0, number)
    x[0], y[0] = terrain.x0 + 0.5 * terrain.column + 8.0, terrain.y0 + 0.5 * terrain.row + 15.0
    there = np.isfinite(place.terrain_height(x, y))
    kind = np.arange(number) % 3
    numbers = rng.random((4, number))
    return Logs(
        np.arange(number), x, y, 0.1 + 0.6 * numbers[0], 0.5 + 9.0 * numbers[1], np.full(number, 300.0),
        kind.astype(np.int8), numbers[2], 6.0 * numbers[3],
        np.where(kind == 2, 8.0, 0.0), np.where(kind == 1, 0.5, 0.0),
    ).take(there)  # fmt: skip


def slid(
    place: Scene, fidelity: Fidelity, number: int, time: float, shape: Shape | None = None
) -> tuple[Start, Result]:
    """Slide logs, one of them without a finite pose."""
    start = place_logs(place, logs(place, number), shape)
    start.state[-1, 2] = np.nan
    keep = np.ones(len(start.state), bool)
    rasters = Rasters.allocate(place, 1)
    stages = Stages()
    result = slide(
        place, start, fidelity, time_limit=time, rasters=rasters, keep_poses=keep, shape=shape, influences=True,
        stages=stages,
    )  # fmt: skip
    latest = np.full(len(start.state), -1)
    np.maximum.at(latest, stages.log, stages.stage)
    slide(place, start, fidelity, time_limit=time, shape=shape, stages=stages, going_on=latest, until_reached=True)
    return start, result


def ends(*options) -> dict[str, int]:
    """Number of logs by stop reason."""
    _, result = slid(*options)
    return {name: int((result.stop_reason == code).sum()) for code, name in enumerate(STOP_REASONS)}


def sweeps(start: Start, result: Result) -> int:
    """Sweep stored poses, which may hold anything; returns the hits of the cells."""
    poses = result.poses
    base = poses.base.copy()
    base[::7] = np.inf
    base[3::7, 1] = np.nan
    place, radii = {"x0": 1150.0, "y0": 2350.0, "cell": 0.5}, (start.body[:, 0], start.body[:, 1])
    counts = sweep_hits(poses.log_row, base, poses.tip, *radii, **place, shape=(48, 48))
    CellPeaks(counts, 1).add(poses.log_row, base, poses.tip, *radii, poses.speed[None], **place)
    road = Lines(np.array([[1150.0, 2355.0], [1174.0, 2355.0]]), np.array([0, 2]))
    sweep_touches(poses.log_row, base, poses.tip, *radii, segments_of(road))
    return int(counts.sum())


def seen(table: str, rows: int, place: Scene, *rest) -> bool:
    """Whether a worker's table that is too short is detected: a check that cannot fail is useless."""
    whole = Scratch.allocate

    def short(*sizes) -> Scratch:
        made = whole(*sizes)
        if table in made.notes._fields:
            return made._replace(notes=made.notes._replace(**{table: getattr(made.notes, table)[:rows]}))
        return made._replace(**{table: getattr(made, table)[:rows]})

    Scratch.allocate = staticmethod(short)
    try:
        ends(place, *rest)
    except IndexError:
        return True
    finally:
        Scratch.allocate = staticmethod(whole)
    return False


def cones() -> dict[str, dict]:
    every = ("trees", "barriers", "lying logs", "blocks", "lines")
    kinds = [(), ("edge", "lines"), *((kind, "lines") for kind in every[:4]), (*every, "edge")]
    told = {}
    for kind in kinds:
        for name, fidelity in (("draft", COARSE), ("standard", FINE)):
            told[f"{' '.join(kind) or 'open'}, {name}"] = ends(scene(*kind), fidelity, 24, 6.0)
    place = scene(*every)
    tables = ("listed", "near_cores", "left", "right")
    tables += ("hit_trees", "hit_barriers", "rings", "points", "keys", "old_contacts", "memory", "rocking", "trial")
    tables += ("place", "rows")  # of the notes
    # few logs meet two barriers, and there is one pose ahead
    rows = dict.fromkeys(tables, 1) | {"hit_barriers": 0, "trial": 0}
    return {"ends": told, "seen": {table: seen(table, rows[table], place, COARSE, 24, 6.0) for table in tables}}


def clouds() -> dict[str, dict]:
    body = Shape.of(np.random.default_rng(1).normal(size=(14, 3)) * [0.3, 0.4, 0.9])
    place = scene("trees", "barriers", "lying logs", "blocks", "lines", "edge")
    rest = (place, COARSE._replace(sweeps=20), 8, 0.8, body)
    return {
        "ends": {"cloud among everything": ends(*rest)},
        "swept": sweeps(*slid(*rest)),
        "seen": {table: seen(table, 1, *rest) for table in ("corners", "normals", "turned", "turns", "left")},
    }


if __name__ == "__main__":
    # as Python, what is NaN or infinite on purpose warns
    warnings.simplefilter("ignore")
    print(json.dumps({"cones": cones, "clouds": clouds}[sys.argv[1]]()))
