"""MuJoCo and PyBullet on two test cases of ours, if they can be imported: ``pip install mujoco pybullet``.

A log lying on a plane along the fall line, for which the answer is known, and the study's rough slope as a height
field. Their logs are capsules (cones on a height field work poorly), so only cost and bulk motion are compared there.
Both have a dozen settings that matter; these are the plain ones, with artificial damping off.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from deadwood_engine import Logs, Scene, place_logs, slide
from deadwood_engine.limits import GRAVITY

from . import scenes
from .settings import STANDARD

STEP, SECONDS, ANGLE, FRICTION = 0.005, 4.0, np.radians(35.0), 0.25
ROUGH_LOGS, ROUGH_SECONDS, LENGTH, RADIUS, REPEATS = 20, 10.0, 25.0, 0.25, 3
# A job: heights (ny, nx), cell, friction, poses (n, 7: centre, quaternion w x y z), seconds -> (end positions, cpu s)
Job = Callable[[np.ndarray, float, float, np.ndarray, float], tuple[np.ndarray, float]]


def _mujoco(
    heights: np.ndarray, cell: float, friction: float, poses: np.ndarray, seconds: float
) -> tuple[np.ndarray, float]:
    mujoco: Any = importlib.import_module("mujoco")
    low, high = float(heights.min()), float(heights.max())
    rows, columns = heights.shape
    half_x, half_y = 0.5 * cell * (columns - 1), 0.5 * cell * (rows - 1)
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep="{STEP}" gravity="0 0 {-GRAVITY}" integrator="implicit" cone="elliptic"/>
    <asset><hfield name="ground" nrow="{rows}" ncol="{columns}" size="{half_x} {half_y} {high - low} 1"/></asset>
    <worldbody><geom type="hfield" hfield="ground" pos="{half_x} {half_y} {low}" friction="{friction} 0 0"/>
    <body name="log"><freejoint/>
    <geom type="capsule" size="{RADIUS} {0.5 * LENGTH}" density="300" friction="{friction} 0 0"/>
    </body></worldbody></mujoco>""")
    model.hfield_data[:] = ((heights - low) / (high - low)).ravel()
    data = mujoco.MjData(model)
    ends, began = [], time.process_time()
    for pose in poses:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = pose
        for _ in range(round(seconds / STEP)):
            mujoco.mj_step(model, data)
        ends.append(data.qpos[:3].copy())
    return np.array(ends), time.process_time() - began


def _pybullet(
    heights: np.ndarray, cell: float, friction: float, poses: np.ndarray, seconds: float
) -> tuple[np.ndarray, float]:
    bullet: Any = importlib.import_module("pybullet")
    world = bullet.connect(bullet.DIRECT)
    try:
        bullet.setGravity(0, 0, -GRAVITY)
        bullet.setTimeStep(STEP)
        rows, columns = heights.shape
        shape = bullet.createCollisionShape(
            bullet.GEOM_HEIGHTFIELD, meshScale=[cell, cell, 1.0], heightfieldData=heights.ravel().tolist(),
            numHeightfieldRows=columns, numHeightfieldColumns=rows,
        )  # fmt: skip
        middle = 0.5 * (float(heights.min()) + float(heights.max()))  # Bullet centres the field between its extremes
        ground = bullet.createMultiBody(
            0, shape, basePosition=[0.5 * cell * (columns - 1), 0.5 * cell * (rows - 1), middle]
        )
        capsule = bullet.createCollisionShape(bullet.GEOM_CAPSULE, radius=RADIUS, height=LENGTH)
        log = bullet.createMultiBody(300.0 * np.pi * RADIUS**2 * LENGTH, capsule)
        bullet.changeDynamics(ground, -1, lateralFriction=1.0)
        bullet.changeDynamics(
            log, -1, lateralFriction=friction, linearDamping=0.0, angularDamping=0.0, rollingFriction=0.0
        )
        ends, began = [], time.process_time()
        for pose in poses:
            bullet.resetBasePositionAndOrientation(log, pose[:3].tolist(), [*pose[4:7], pose[3]])
            bullet.resetBaseVelocity(log, [0, 0, 0], [0, 0, 0])
            for _ in range(round(seconds / STEP)):
                bullet.stepSimulation()
            ends.append(bullet.getBasePositionAndOrientation(log)[0])
        return np.array(ends), time.process_time() - began
    finally:
        bullet.disconnect(world)


def _row(
    engine: str,
    setting: str,
    cost: list[float],
    logs: int,
    seconds: float,
    plane: list[np.ndarray],
    ends: np.ndarray,
    begin: np.ndarray,
) -> dict[str, Any]:
    exact = 0.5 * GRAVITY * (np.sin(ANGLE) - FRICTION * np.cos(ANGLE)) * SECONDS**2
    distance = float(np.linalg.norm(plane[1] - plane[0]))
    return {
        "engine": engine,
        "setting": setting,
        "distance_error_m": distance - exact,
        "ms_per_log": 1e3 * float(np.median(cost)) / logs,
        "median_descent_m": float(np.median(begin[:, 2] - ends[:, 2])),
        "lost": int(np.sum(~np.isfinite(ends).all(axis=1) | (begin[:, 2] - ends[:, 2] > 0.8 * begin[:, 2]))),
    }


def compare() -> dict[str, Any]:
    """Cost and motion of every available engine, ours first."""
    axis = np.arange(-40.0, 240.0, 4.0)
    tilt = np.tan(ANGLE) * axis[:, None] + 0.0 * axis[None, :]
    plane = Scene.prepare(tilt, 4.0, 0.0, 0.0, friction=FRICTION)
    case, rough = scenes.CASES["rough"], scenes.build("rough")
    heights = scenes.ground("rough", rough.cell)
    some = scenes.logs_of_block(0, ROUGH_LOGS)
    shapes = {"diameter": 2.0 * RADIUS, "length": LENGTH, "orientation": 1}
    logs = Logs.alike(some.x, some.y, **shapes)
    logs = Logs(**{**logs.__dict__, "azimuth": some.azimuth})
    start = place_logs(rough.scene, logs)
    one = place_logs(plane, Logs.alike(np.array([120.0]), np.array([200.0]), **shapes, azimuth=np.pi))

    def poses(scene: Scene, placed: Any, cell: float) -> np.ndarray:
        found = placed.state[:, :7].copy()
        found[:, :2] += placed.frame * cell
        found[:, 2] += scene.arrays.terrain.reference
        found[:, :3] += (RADIUS + 0.02) * np.array([0.0, 0.0, 1.0])  # a capsule's surface, not a cone's; a small drop
        return found

    slide(plane, one, STANDARD, rolling_friction=0.0, time_limit=0.1)
    on_plane = slide(plane, one, STANDARD, rolling_friction=0.0, time_limit=SECONDS)
    results = [
        slide(rough.scene, start, STANDARD, rolling_friction=0.0, time_limit=ROUGH_SECONDS) for _ in range(REPEATS)
    ]
    cost = [each.cost["cpu_s"] for each in results]
    result = results[-1]
    shift = on_plane.duration[0] / SECONDS  # ours ends at the first node after the limit
    ours = [
        on_plane.release_position[0],
        on_plane.release_position[0] + (on_plane.end_position[0] - on_plane.release_position[0]) / shift**2,
    ]
    rows = [
        _row(
            "this engine",
            "standard, cone",
            cost,
            ROUGH_LOGS,
            ROUGH_SECONDS,
            ours,
            result.end_position,
            result.release_position,
        )
    ]
    jobs: dict[str, tuple[str, Job]] = {"mujoco": ("MuJoCo", _mujoco), "pybullet": ("PyBullet", _pybullet)}
    missing = []
    for module, (name, job) in jobs.items():
        try:
            version = getattr(importlib.import_module(module), "__version__", "")
        except ImportError:
            missing.append(name)
            continue
        begin = poses(plane, one, 4.0)
        begin[:, 2] -= 0.02
        flat, _ = job(tilt, 4.0, FRICTION, begin, SECONDS)
        first = poses(rough.scene, start, rough.cell)
        runs = [
            job(heights, rough.cell, case.friction, first, ROUGH_SECONDS)
            for _ in range(REPEATS if module == "mujoco" else 1)
        ]
        rows.append(
            _row(
                f"{name} {version}".strip(),
                f"{1e3 * STEP:g} ms, capsule",
                [c for _, c in runs],
                ROUGH_LOGS,
                ROUGH_SECONDS,
                [begin[0, :3], flat[0]],
                runs[0][0],
                first[:, :3],
            )
        )
    what = (
        f"A log lying along the fall line of a plane of 35 degrees (mu {FRICTION:g}, {SECONDS:g} s, a height field of "
        f"4 m cells), for which the distance is known; and {ROUGH_LOGS} logs, {ROUGH_SECONDS:g} s on the rough slope "
        "without trees: CPU time per log, median descent, and how many fell through or flew off. "
        + (f"Not importable here: {', '.join(missing)}." if missing else "")
    )
    return {"what": what, "rows": rows}
