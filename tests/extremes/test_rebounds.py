"""Logs that rebound pass through nothing that is rigid, at any restitution, friction and slope.

What overlaps is sampled here, point by point on the log's surface and on plates, with none of the engine's gaps.
"""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Barriers, Blocks, Logs, LyingLogs, Scene, Start, Trees, place_logs
from deadwood_engine.cores import BARRIER
from deadwood_engine.log_body import BASE_RADIUS, LENGTH, TIP_RADIUS

CELL, NODES, ROW = 0.5, 161, 25.0  # m, of the DEM; y of what is in the way
TOP = 3.0  # [m] height of the barrier, and of the wall in the DEM
LINE = np.array([[10.0, ROW], [70.0, ROW]])
ALONG = np.arange(10.0, 70.0, 1.1)
KINDS = {
    "barrier": {"barriers": Barriers(LINE, np.array([0, 2]), np.array([TOP]))},
    "stems": {"trees": Trees(ALONG, np.full(len(ALONG), ROW), np.full(len(ALONG), 0.5), np.full(len(ALONG), 25.0))},
    "lying": {"lying_logs": LyingLogs(LINE, np.array([0, 2]), np.array([0.8]), np.array([0.5]))},
    "blocks": {
        "blocks": Blocks(ALONG[::2], np.full(len(ALONG[::2]), ROW), np.full(len(ALONG[::2]), 2.0),
                         np.full(len(ALONG[::2]), 1.3))
    },
    "wall": {},
}  # fmt: skip


def slope(degrees: float, friction: float, kind: str) -> Scene:
    """A slope that rises to the north, with 0.1 m of white noise, and one kind of obstacle across it."""
    north = CELL * np.arange(NODES)[:, None]
    heights = np.tan(np.radians(degrees)) * north + 0.1 * np.random.default_rng(0).standard_normal((NODES, NODES))
    if kind == "wall":
        heights[48:51] += TOP
    return Scene.prepare(heights, CELL, 0.0, 0.0, friction=friction, **KINDS[kind])


def released(scene: Scene, number: int, **sizes) -> Start:
    """Lying logs above the obstacle, their tips downhill."""
    rng = np.random.default_rng(1)
    return place_logs(
        scene,
        Logs.alike(
            rng.uniform(28.0, 52.0, number), rng.uniform(45.0, 58.0, number), orientation=1, azimuth=np.pi, **sizes
        ),
    )


def surface_points(body, base, tip):
    """Points all over a log, (n, 3)."""
    axis = (tip - base) / np.linalg.norm(tip - base)
    side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    s, turn = np.linspace(0.0, 1.0, 61), np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    radius = body[BASE_RADIUS] + (body[TIP_RADIUS] - body[BASE_RADIUS]) * s
    ring = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
    return ((base + s[:, None] * (tip - base))[:, None, :] + radius[:, None, None] * ring).reshape(-1, 3)


def in_the_ground(scene, points):
    found = scene.terrain_surface(points[:, 0], points[:, 1])
    gap = (points[:, 2] - found[:, 0]) / np.sqrt(1.0 + found[:, 1] ** 2 + found[:, 2] ** 2)
    return max(0.0, -np.nanmin(gap, initial=0.0))


def in_cores(scene, points):
    """How deep [m] any of the points lies in a stem, lying log or boulder."""
    terrain, cores = scene.arrays.terrain, scene.arrays.cores
    deepest = 0.0
    for node, core in zip(cores.node, cores.solid, strict=True):
        if core["kind"] == BARRIER:
            continue
        start = np.array(
            [terrain.x0 + node[0] * CELL + core["x"], terrain.y0 + node[1] * CELL + core["y"],
             terrain.reference + core["z"]]
        )  # fmt: skip
        u = np.array([core["ux"], core["uy"], core["uz"]])
        low, high = np.minimum(start, start + core["long"] * u)[0], np.maximum(start, start + core["long"] * u)[0]
        if points[:, 0].max() < low - 2.0 or points[:, 0].min() > high + 2.0:
            continue
        far = points - start
        t = far @ u
        rho = np.sqrt(np.maximum(0.0, (far * far).sum(axis=1) - t * t))
        z = np.clip(t + core["slope"] * rho / np.sqrt(1.0 - core["slope"] ** 2), 0.0, core["long"])
        deepest = max(deepest, (core["wide"] + core["slope"] * z - np.hypot(rho, t - z)).max())
    return deepest


def in_the_plate(scene, body, base, tip):
    """How deep [m] a point of the barrier's plate lies in a log."""
    x = np.arange(LINE[0, 0], LINE[1, 0], 0.1)
    x = x[(x > min(base[0], tip[0]) - 1.0) & (x < max(base[0], tip[0]) + 1.0)]
    foot = scene.terrain_height(x, np.full(len(x), ROW))
    up = np.linspace(0.0, TOP, 31)
    points = np.stack(
        [*np.broadcast_arrays(x[:, None], ROW, foot[:, None] + up)], axis=-1
    ).reshape(-1, 3)  # fmt: skip
    axis = (tip - base) / body[LENGTH]
    s = (points - base) @ axis
    rho = np.linalg.norm(points - base - s[:, None] * axis, axis=1)
    radius = body[BASE_RADIUS] + (body[TIP_RADIUS] - body[BASE_RADIUS]) * s / body[LENGTH]
    return max(0.0, np.minimum(radius - rho, np.minimum(s, body[LENGTH] - s)).max(initial=0.0))


def deepest(scene, begin, result, kind):
    """Of all poses that were kept, how deep [m] a log is in the ground, and in what is in the way."""
    ground = things = 0.0
    poses = result.poses
    for row, base, tip in zip(poses.log_row, poses.base, poses.tip, strict=True):
        inside = (np.minimum(base, tip)[:2] > 1.0).all() and (
            np.maximum(base, tip)[:2] < CELL * (NODES - 1) - 1.0
        ).all()
        if not inside:  # what hangs over the border is another matter
            continue
        points = surface_points(begin.body[row], base, tip)
        ground = max(ground, in_the_ground(scene, points))
        if min(base[1], tip[1]) > ROW + 2.0 or max(base[1], tip[1]) < ROW - 2.0:
            continue
        if kind == "barrier":
            things = max(things, in_the_plate(scene, begin.body[row], base, tip))
        elif kind != "wall":
            things = max(things, in_cores(scene, points))
    return ground, things


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("restitution", [0.2, 0.5])
def test_no_log_goes_through_a_barrier(at, fidelity, restitution):
    """Logs of 30 m on 45 degrees with a friction of 0.6. At 0.5 one in nine of standard's went through the barrier, up
    to 17 m deep in the ground, and was counted as having jumped it."""
    scene = slope(45.0, 0.6, "barrier")
    number = 12 if fidelity == "reference" else 60
    begin = released(scene, number)
    result = at.run(
        scene, begin, fidelity=fidelity, restitution=restitution, time_limit=30.0, rolling_friction=0.1,
        keep_poses=np.ones(number, bool),
    )  # fmt: skip
    radius = begin.body[0, BASE_RADIUS]
    ground, plate = deepest(scene, begin, result, "barrier")
    assert plate < 0.5 * radius
    assert ground < 0.5 * radius
    assert (result.stop_reason == STOP_REASONS.index("barrier")).mean() > 0.9
    assert (result.stop_reason != STOP_REASONS.index("failed")).all()
    assert result.penetration_max.max() < 0.5 * radius
    assert result.energy_error.max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("kind", list(KINDS))
def test_nothing_rigid_is_passed(at, kind, fidelity):
    """Nine of the 27 triples of restitution, friction and slope: every pair of two of them is among these."""
    number = 2 if fidelity == "reference" else 5
    for a, restitution in enumerate((0.2, 0.5, 0.8)):
        for b, friction in enumerate((0.2, 0.5, 0.8)):
            scene = slope((35.0, 45.0, 55.0)[(a + b) % 3], friction, kind)
            begin = released(scene, number, diameter=0.6, length=15.0)
            result = at.run(
                scene, begin, fidelity=fidelity, restitution=restitution, time_limit=12.0, rolling_friction=0.1,
                keep_poses=np.ones(number, bool),
            )  # fmt: skip
            where = f"e {restitution}, friction {friction}"
            ground, things = deepest(scene, begin, result, kind)
            assert things < begin.body[0, BASE_RADIUS], where
            assert ground < begin.body[0, BASE_RADIUS], where
            assert (result.stop_reason != STOP_REASONS.index("failed")).all(), where
            assert result.energy_error.max() < 0.02, where
