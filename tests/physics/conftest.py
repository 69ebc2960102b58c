"""Scenes and starts for tests with known answers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Scene, Start, slide
from deadwood_engine.log_body import CENTRE, LENGTH, cone_bodies
from deadwood_engine.rotation import quaternion_from_axis

G = 9.81


def plane(tangent: float, azimuth: float = 0.0, *, size: float = 400.0, cell: float = 10.0, **parts) -> Scene:
    """A plane through the origin that rises with the tangent towards the azimuth [deg]."""
    axis = np.arange(-size, size + 0.5 * cell, cell)
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    heights = tangent * (east * axis[None, :] + north * axis[:, None])
    return Scene.prepare(heights, cell, -size, -size, **({"friction": 0.25} | parts))


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
    state[0, 7:10] = velocity
    state[0, 10:13] = spin
    state[0, 13:16] = axis
    return Start(frame, state, solid)


def lying(
    scene: Scene, solid: np.ndarray, tangent: float, azimuth: float, heading: float, *, centre=(0.0, 0.0), **motion
) -> Start:
    """A log whose whole length touches a plane, tip turned from the fall line (downwards) by ``heading`` [deg].

    Its speeds are given in the plane's frame: along (the axis), across (to its left), and spin about the axis.
    """
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    normal = np.array([-tangent * east, -tangent * north, 1.0])
    normal /= np.linalg.norm(normal)
    fall = np.array([-east, -north, -tangent])
    fall /= np.linalg.norm(fall)
    left = np.cross(normal, fall)
    turn = np.radians(heading)
    along = np.cos(turn) * fall + np.sin(turn) * left
    base, tip, length, zc = solid[0, 0], solid[0, 1], solid[0, LENGTH], solid[0, CENTRE]
    lean = np.arcsin((base - tip) / length)  # the axis points into the ground by the taper
    axis = np.cos(lean) * along - np.sin(lean) * normal
    # the contact line is the support of both discs: centre of the base face is base*cos(lean) above the plane
    height = base * np.cos(lean) - zc * np.sin(lean)
    point = np.array([*centre, tangent * (east * centre[0] + north * centre[1])])
    across = np.cross(normal, along)
    velocity = motion.get("along", 0.0) * along + motion.get("across", 0.0) * across
    spin = motion.get("spin", 0.0) * axis + motion.get("yaw", 0.0) * normal
    return start(scene, solid, axis, point + height * normal, velocity, spin)


@pytest.fixture
def physics() -> SimpleNamespace:
    def run(scene: Scene, begin: Start, *, fidelity: str = "standard", **options):
        """Rolls without friction, as rigid bodies on rigid ground do, unless told otherwise."""
        numbers = {k: options.pop(k) for k in list(options) if k in FIDELITIES["standard"]._fields}
        return slide(scene, begin, FIDELITIES[fidelity]._replace(**numbers), **({"rolling_friction": 0.0} | options))

    return SimpleNamespace(plane=plane, body=body, start=start, lying=lying, run=run, G=G)
