"""Builders and rulers for the extremes. The rulers measure from outside: from end points and the log's shape, with
nothing of the engine's own contact detection."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Barriers, Fidelity, Result, Scene, Start, Trees, slide
from deadwood_engine.log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS, TRANSVERSE, cone_bodies
from deadwood_engine.rotation import quaternion_from_axis

G = 9.81


def flat(*, size: float = 60.0, cell: float = 1.0, friction: float = 0.25, **parts) -> Scene:
    count = round(2 * size / cell) + 1
    return Scene.prepare(np.zeros((count, count)), cell, -size, -size, friction=friction, **parts)


def trees(x, y, diameter: float, height: float = 100.0) -> Trees:
    x, y = np.broadcast_arrays(np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float)))
    return Trees(x.copy(), y.copy(), np.full(len(x), diameter), np.full(len(x), height))


def barrier(*points, height: float = 30.0) -> Barriers:
    return Barriers(np.array(points, float), np.array([0, len(points)]), np.array([height]))


def body(diameter: float = 0.75, length: float = 30.0, density: float = 300.0, taper: float = 0.5) -> np.ndarray:
    return cone_bodies(np.array([diameter]), np.array([length]), np.array([density]), taper=taper)


def start(scene: Scene, solid: np.ndarray, axis, centre, velocity=(0, 0, 0), spin=(0, 0, 0)) -> Start:
    """One log with its centre of mass, axis, velocity and angular velocity given in the world."""
    terrain = scene.arrays.terrain
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    plan = np.array([[centre[0] - terrain.x0, centre[1] - terrain.y0]])
    frame = np.floor(plan * terrain.inverse_cell).astype(np.int64)
    state = np.zeros((1, 16))
    state[0, 0:2] = plan[0] - frame[0] * terrain.cell
    state[0, 2] = centre[2] - terrain.reference
    state[0, 3:7] = quaternion_from_axis(axis[None])[0]
    state[0, 7:10], state[0, 10:13], state[0, 13:16] = velocity, spin, axis
    return Start(frame, state, solid)


def together(starts: list[Start]) -> Start:
    return Start(*(np.vstack([getattr(each, name) for each in starts]) for name in ("frame", "state", "body")))


def run(scene: Scene, begin: Start, *, fidelity: str = "standard", **options) -> Result:
    """Slide; rolling has no friction unless told otherwise: the harder case. Options may be the fidelity's fields."""
    numbers = {k: options.pop(k) for k in list(options) if k in Fidelity._fields}
    return slide(
        scene, begin, FIDELITIES[fidelity]._replace(**numbers), **({"threads": 2, "rolling_friction": 0.0} | options)
    )


def farthest(result: Result, axis: int = 0) -> np.ndarray:
    """Of each log the farthest that an end of it ever was along an axis of the world [m] (poses must be kept)."""
    poses = result.poses
    ends = np.maximum(poses.tip[:, axis], poses.base[:, axis])
    return np.array([ends[poses.log_row == row].max() for row in range(len(result.steps))])


def energy(solid: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Kinetic energy per mass [J/kg] of states (n, 16)."""
    v, w, d = state[:, 7:10], state[:, 10:13], state[:, 13:16]
    along = (w * d).sum(axis=1)
    across = (w * w).sum(axis=1) - along**2
    return 0.5 * ((v * v).sum(axis=1) + solid[:, TRANSVERSE] * across + solid[:, AXIAL] * along**2)


def sunk(scene: Scene, begin: Start, base: np.ndarray, tip: np.ndarray, row: int = 0) -> float:
    """How deep [m] the log's surface lies under the terrain at most, along the terrain's normal: dense brute force."""
    solid = begin.body[row]
    s = np.linspace(0.0, 1.0, 241)
    axis = (tip - base) / np.linalg.norm(tip - base)
    side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    radius = solid[BASE_RADIUS] + (solid[TIP_RADIUS] - solid[BASE_RADIUS]) * s
    ring = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
    points = (base + s[:, None] * (tip - base))[:, None, :] + radius[:, None, None] * ring
    points = points.reshape(-1, 3)
    found = scene.terrain_surface(points[:, 0], points[:, 1])
    gap = (points[:, 2] - found[:, 0]) / np.sqrt(1 + found[:, 1] ** 2 + found[:, 2] ** 2)
    return float(max(0.0, -np.nanmin(gap)))


def healthy(
    scene: Scene, begin: Start, result: Result, *, gained: float = 1e-3, longest: float = 0.01, gravity: float = G
) -> None:
    """What holds for every log of every scene: finite, unit quaternion, an end for a reason, no energy out of nothing.

    gained : [-] most of the energy spent that contacts may give or the books may miss, besides the scheme's own bound:
        a separating contact that gravity pushes back gives at most (g dt)^2 / 8 a step (docs/tests.md, T62)
    longest : [s] longest time step of the run
    gravity : [m/s2] that it ran with, or what rises or falls without is booked as fall
    """
    state = result.last_state
    assert np.isfinite(state).all()
    assert np.abs(np.linalg.norm(state[:, 3:7], axis=1) - 1).max(initial=0) < 1e-12
    assert np.abs(np.linalg.norm(state[:, 13:16], axis=1) - 1).max(initial=0) < 1e-12
    assert ((result.stop_reason >= 0) & (result.stop_reason < len(STOP_REASONS))).all()
    assert (result.stop_reason != STOP_REASONS.index("failed")).all()
    assert (result.steps > 0).all()
    for name in ("duration", "path", "speed_max", "energy_max", "jump_max", "penetration_max", "residual_max"):
        assert np.isfinite(getattr(result, name)).all(), name
    before, after = energy(begin.body, begin.state), energy(begin.body, state)
    fall = gravity * (begin.state[:, 2] - state[:, 2])
    scheme = result.steps * (gravity * longest) ** 2 / 8
    excess = result.energy_error * np.maximum(before + fall, G) - scheme
    assert (excess <= gained * np.maximum(before + fall, G)).all(), f"{excess.max()} J/kg too much"
    # the start's energy and what the fall gave, and nothing else; velocities are those of the middle of the last step
    scheme += 0.5 * gravity * longest * (result.speed_max + gravity * longest)
    assert (after <= before + fall + scheme + gained * np.maximum(before + np.abs(fall), G)).all()


def sunk_each(scene: Scene, base: np.ndarray, tip: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """The same of many logs at once, (n, ...), of radius first and last at their ends: 61 x 16 points of each."""
    axis = tip - base
    d = axis / np.linalg.norm(axis, axis=1)[:, None]
    one = np.cross(d, np.where(np.abs(d[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    one /= np.linalg.norm(one, axis=1)[:, None]
    two, deepest = np.cross(d, one), np.zeros(len(base))
    for s in np.linspace(0.0, 1.0, 61):
        radius = (first + s * (last - first))[:, None]
        for turn in np.linspace(0.0, 2 * np.pi, 16, endpoint=False):
            p = base + s * axis + radius * (np.cos(turn) * one + np.sin(turn) * two)
            found = scene.terrain_surface(p[:, 0], p[:, 1])
            gap = (p[:, 2] - found[:, 0]) / np.sqrt(1 + found[:, 1] ** 2 + found[:, 2] ** 2)
            deepest = np.fmax(deepest, -gap)
    return deepest


def reasons(result: Result) -> list[str]:
    return [STOP_REASONS[code] for code in result.stop_reason]


@pytest.fixture(scope="session")
def at() -> SimpleNamespace:
    """Everything above: ``at.flat()``, ``at.healthy(...)`` and so on."""
    tools = (flat, trees, barrier, body, start, together, run, farthest, energy, sunk, sunk_each, healthy, reasons)
    columns = {"CENTRE": CENTRE, "LENGTH": LENGTH, "BASE": BASE_RADIUS, "TIP": TIP_RADIUS}
    return SimpleNamespace(**{tool.__name__: tool for tool in tools}, **columns)
