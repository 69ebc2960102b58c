"""Released logs: their properties as given by the user, and their initial position on the terrain."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .cloud import Shape, lift_cloud
from .compiled import kernel
from .limits import DENSITY, DIAMETER, LEAST_STATIONS, VERTICAL, WHOLE
from .limits import LENGTH as LOG_LENGTH
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS, cone_bodies
from .rotation import quaternion_from_axis, set_axis
from .scene import Scene
from .terrain import surface

Array = NDArray[np.float64]

UPRIGHT, LYING, TILTED = range(3)


@dataclass(frozen=True)
class Logs:
    """Released logs; arrays of shape (n,).

    log_id : int64; x, y : plan position of the centre of mass [m]; diameter, length [m]; density [kg/m3]
    orientation : int8, 0 upright (base down), 1 lying (on its side, towards the azimuth), 2 tilted
    tilt : [rad] from the vertical; azimuth : [rad] clockwise from north, where the tip points
    speed : [m/s] towards the azimuth in the tangent plane; drop : [m] clearance of the lowest point
    """

    log_id: NDArray[np.int64]
    x: Array
    y: Array
    diameter: Array
    length: Array
    density: Array
    orientation: NDArray[np.int8]
    tilt: Array
    azimuth: Array
    speed: Array
    drop: Array

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: NDArray | slice) -> Logs:
        """The logs of these rows."""
        return Logs(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    @staticmethod
    def alike(x: Array, y: Array, *, diameter: float = 0.75, length: float = 30.0, **values: float) -> Logs:
        """Logs that differ in position only; further fields by name, otherwise 300 kg/m3, upright, at rest on the
        ground.
        """
        x, y = np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float))
        fields = {"density": 300.0, "orientation": UPRIGHT, "tilt": 0.0, "azimuth": 0.0, "speed": 0.0, "drop": 0.0}
        fields |= {"diameter": diameter, "length": length} | values
        full = {k: np.full(len(x), v, dtype=np.int8 if k == "orientation" else float) for k, v in fields.items()}
        return Logs(log_id=np.arange(len(x)), x=x, y=y, **full)


@dataclass(frozen=True)
class Start:
    """Placed logs, ready to slide.

    frame : int64 (n, 2), DEM node (column, row) of each log's local frame
    state : (n, 16), initial state in that frame (``rotation`` names the columns); body : (n, BODY_WIDTH), ``log_body``
    """

    frame: NDArray[np.int64]
    state: Array
    body: Array


def check_logs(logs: Logs, shape: Shape | None = None) -> None:
    """Reject impossible logs; with a shape, diameters and lengths are ignored.

    Raises
    ------
    ValueError
        naming the first such row
    """
    sizes = [] if shape else [("diameter", DIAMETER, "m"), ("length", LOG_LENGTH, "m")]
    for name, (least, most), unit in [*sizes, ("density", DENSITY, "kg/m3")]:
        values = np.asarray(getattr(logs, name), float)
        odd = np.flatnonzero(~((values >= least) & (values <= most)))
        if odd.size:
            raise ValueError(
                f"the {name} of a log must be {least:g} to {most:g} {unit}, and is {values[odd[0]]:g} in row {odd[0]}"
            )
    for name in ("x", "y", "tilt", "azimuth", "speed", "drop"):
        odd = np.flatnonzero(~np.isfinite(np.asarray(getattr(logs, name), float)))
        if odd.size:
            raise ValueError(f"the {name} of the log in row {odd[0]} is no finite number")


def place_logs(scene: Scene, logs: Logs, shape: Shape | None = None, threads: int = 1) -> Start:
    """Place logs on the terrain: oriented, and raised or lowered until the lowest gap is ``drop``.

    With a shape, bodies of that shape: its z axis replaces the axis of a log, its x axis is horizontal across the
    azimuth (in the terrain's tangent plane if it lies). Diameters and lengths are ignored, densities are used. The
    result does not depend on ``threads``.

    Raises
    ------
    ValueError
        if a log's centre of mass is not on the terrain, or ``check_logs`` rejects it
    """
    check_logs(logs, shape)
    terrain = scene.arrays.terrain
    body = shape.bodies(logs.density) if shape else cone_bodies(logs.diameter, logs.length, logs.density)
    ground = scene.terrain_surface(logs.x, logs.y)
    if not np.isfinite(ground[:, 0]).all():
        raise ValueError(f"log in row {int(np.flatnonzero(~np.isfinite(ground[:, 0]))[0])} is not on the terrain")
    east, north = np.sin(logs.azimuth), np.cos(logs.azimuth)
    downhill = np.column_stack([east, north, ground[:, 1] * east + ground[:, 2] * north])
    downhill /= np.linalg.norm(downhill, axis=1, keepdims=True)
    sine = np.sin(logs.tilt)
    axis = np.column_stack([sine * east, sine * north, np.cos(logs.tilt)])
    axis[logs.orientation == UPRIGHT] = (0.0, 0.0, 1.0)
    lying = logs.orientation == LYING
    axis[lying] = downhill[lying]
    upward = np.column_stack([-ground[:, 1], -ground[:, 2], np.ones(len(logs))])
    upward /= np.linalg.norm(upward, axis=1, keepdims=True)
    if not shape:
        # on its side: the axis is inclined by the half angle of the cone, otherwise the tip would drop by the taper
        dip = ((body[:, BASE_RADIUS] - body[:, TIP_RADIUS]) / body[:, LENGTH])[lying, None]
        axis[lying] = np.sqrt(1.0 - dip**2) * downhill[lying] - dip * upward[lying]
    plan = np.column_stack([logs.x - terrain.x0, logs.y - terrain.y0])
    frame = np.floor(plan * terrain.inverse_cell).astype(np.int64)
    state = np.zeros((len(logs), 16))
    state[:, 0:2] = plan - frame * terrain.cell
    frame -= (terrain.column, terrain.row)
    state[:, 3:7] = quaternion_from_axis(axis)
    state[:, 7:10] = logs.speed[:, None] * downhill
    state[:, 13:16] = axis
    if shape:
        across = np.column_stack([north, -east, 0.0 * east])
        across[lying] = np.cross(axis[lying], upward[lying])
        state[:, 3:7] = shape.facing(across, axis)
        for each in state:
            set_axis(each)
        lift_cloud(terrain, shape.cloud, frame, state, np.ascontiguousarray(logs.drop, float), np.zeros(9))
    else:
        turn = np.pi * np.arange(32) / 16
        turns = np.cos(turn), np.sin(turn)
        cuts = np.linspace(0, len(logs), max(1, threads) + 1).astype(int)
        with ThreadPoolExecutor(max(1, threads)) as pool:
            parts = [slice(first, last) for first, last in pairwise(cuts)]
            list(pool.map(lambda p: _lift(terrain, frame[p], state[p], body[p], logs.drop[p], *turns), parts))
    return Start(frame, state, body)


@kernel
def _lift(terrain, frame, state, body, drop, cosine, sine):
    """Set the height of each log so that the least vertical gap of its surface points is ``drop``.

    cosine, sine : of the angles of the points on a ring
    """
    for n in range(state.shape[0]):
        dx, dy, dz = state[n, 13], state[n, 14], state[n, 15]
        length, centre = body[n, LENGTH], body[n, CENTRE]
        rings = max(LEAST_STATIONS, int(np.ceil(2.0 * length / terrain.cell)) + 1)
        plan = np.sqrt(dx * dx + dy * dy)
        lx, ly = (-dy / plan, dx / plan) if plan > VERTICAL else (1.0, 0.0)
        # second diameter of the rings: d x lateral
        mx, my, mz = -dz * ly, dz * lx, dx * ly - dy * lx
        least = np.inf
        for k in range(rings):
            along = length * k / (rings - 1)
            a = body[n, BASE_RADIUS] + (body[n, TIP_RADIUS] - body[n, BASE_RADIUS]) * along / length
            s = along - centre
            for m in range(cosine.shape[0]):
                c, e = a * cosine[m], a * sine[m]
                height, _, _ = surface(
                    terrain,
                    frame[n, 0],
                    frame[n, 1],
                    state[n, 0] + s * dx + c * lx + e * mx,
                    state[n, 1] + s * dy + c * ly + e * my,
                )
                gap = s * dz + e * mz - height
                if gap < least:
                    least = gap
        state[n, 2] = drop[n] - least


def stations_for(length: Array, spacing: float) -> NDArray[np.int64]:
    """Number of contact rings of logs of these lengths."""
    return np.maximum(LEAST_STATIONS, np.ceil(length / spacing - WHOLE).astype(np.int64) + 1)
