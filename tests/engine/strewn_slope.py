"""Rough slopes strewn with obstacles of all kinds, for tests of what mattered to a log; shared by those."""

import numpy as np

from deadwood_engine import Barriers, Blocks, Lines, Logs, LyingLogs, Result, Scene, Shape, Start, Trees, place_logs

SIZE = 100.0
# What is reported about each log; positions and poses follow from the last state and the steps
TOLD = (
    "last_state", "duration", "path", "stop_reason", "stop_item", "speed_max", "energy_max", "jump_max", "tree_hits",
    "barrier_hits", "energy_error", "penetration_max", "overlap_max", "residual_max", "unconverged", "steps", "grip",
    "reach", "reach_time", "started_in_contact",
)  # fmt: skip


def obstacles(seed: int) -> dict:
    rng = np.random.default_rng(seed)
    here = rng.uniform(0, SIZE, (12, 2))
    (x, y), (u, v) = rng.uniform(0, SIZE, (2, 300)), rng.uniform(0, SIZE, (2, 10))
    return {
        "trees": Trees(x, y, rng.uniform(0.1, 0.8, 300), rng.choice([0.5, 3.0, 20.0], 300)),
        "barriers": Barriers(
            np.array([[20.0, 40], [60, 42], [60, 20], [90, 22]]), np.array([0, 2, 4]), np.array([1.5, 3.0])
        ),
        "lying_logs": LyingLogs(
            np.stack([here, here + rng.uniform(-8, 8, (12, 2))], axis=1).reshape(-1, 2),
            2 * np.arange(13), np.full(12, 0.5), np.full(12, 0.3),
        ),
        "blocks": Blocks(u, v, np.full(10, 1.5), np.full(10, 1.0)),
    }  # fmt: skip


def slope(cell: float, seed: int, **parts) -> Scene:
    rng = np.random.default_rng(seed)
    number = int(SIZE / cell)
    heights = 0.75 * cell * np.arange(number)[:, None] + 0.3 * cell * rng.random((number, number))
    road = Lines(np.array([[0.0, 6.0], [SIZE, 6.0]]), np.array([0, 2]))
    return Scene.prepare(heights, cell, 0.0, 0.0, friction=0.4, lines=road, **parts)


def released(scene: Scene, number: int, seed: int, shape: Shape | None = None) -> Start:
    """Logs of every size and attitude; every other one is thrown and spins."""
    rng = np.random.default_rng(seed)
    start = place_logs(
        scene,
        Logs(
            np.arange(number), rng.uniform(20, SIZE - 20, number), rng.uniform(50, SIZE - 20, number),
            rng.uniform(0.2, 0.8, number), rng.uniform(4, 25, number), np.full(number, 300.0),
            rng.integers(0, 3, number).astype(np.int8), rng.uniform(0, 1, number), rng.uniform(0, 6.28, number),
            rng.uniform(0, 8, number), np.zeros(number),
        ),
        shape,
    )  # fmt: skip
    start.state[::2, 7:10] += 8.0 * rng.normal(size=(len(start.state[::2]), 3))
    start.state[::2, 10:13] += rng.normal(size=(len(start.state[::2]), 3))
    return start


def only(start: Start, row: int) -> Start:
    return Start(*(getattr(start, name)[row : row + 1] for name in ("frame", "state", "body")))


def owners(scene: Scene) -> np.ndarray:
    """All obstacles of a scene as one number each: barriers below zero."""
    solid = scene.arrays.cores.solid
    return np.unique(np.where(solid["kind"] == 2, -1 - solid["owner"], solid["owner"]))


def mattered(result: Result, row: int) -> tuple[np.ndarray, np.ndarray]:
    """The obstacles that mattered to a log, as ``owners``, and from when."""
    told = result.influences
    mine = told.log_row == row
    return np.where(told.by_barrier[mine], -1 - told.item[mine], told.item[mine]), told.time[mine]


def spared(scene: Scene, gone: np.ndarray) -> Scene:
    return scene.without(barriers=-1 - gone[gone < 0], others=gone[gone >= 0])


def differing(whole: Result, row: int, again: Result) -> list[str]:
    return [
        name for name in TOLD if not np.array_equal(getattr(whole, name)[row], getattr(again, name)[0], equal_nan=True)
    ]
