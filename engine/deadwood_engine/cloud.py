"""A body of any convex shape, given as a point cloud, that slides instead of a log (``slide(..., shape=...)``).

The solid is the convex hull of the cloud, with the exact mass, centre and inertia of the hull. It touches the terrain
only with its points, as the bodies of RAMMS::Rockfall do: with all points on the surface of the hull, not only its
vertices, so that rings of points along a log touch the ground at every ring. Trees, barriers and lying logs meet the
whole hull (``cloud_obstacles``). Body frame: origin at the centre of mass, principal axes, e3 the axis of least
inertia.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .hull import hull_of, of_triangles
from .limits import ALIKE, ON_SURFACE, SHAPE_SIZE
from .log_body import AXIAL, BASE_RADIUS, BODY_WIDTH, CENTRE, LENGTH, MASS, REACH, SKEW, TIP_RADIUS, TRANSVERSE
from .rotation import Q0, Q1, Q2, Q3, X, Y, Z
from .terrain import surface

Array = NDArray[np.float64]


class Cloud(NamedTuple):
    """A shape as the kernels use it, in the body frame; no rows where logs slide.

    points : [m] (n, 3), all on the surface; corners : [m] (m, 3) of the hull; normals (f, 3), offsets [m] (f,) of its
        faces; face k has the corners loops[starts[k]:starts[k + 1]]; edges : (e, 2), rows of corners
    thickness : [m] from the centre of mass to the nearest face
    """

    points: np.ndarray
    corners: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    starts: np.ndarray
    loops: np.ndarray
    edges: np.ndarray
    thickness: float

    @staticmethod
    def none() -> Cloud:
        empty, whole = np.zeros((0, 3)), np.zeros(0, np.int64)
        return Cloud(empty, empty, empty, np.zeros(0), np.zeros(1, np.int64), whole, np.zeros((0, 2), np.int64), 0.0)


@dataclass(frozen=True)
class Shape:
    """A point cloud, prepared.

    cloud : for the kernels; axes : (3, 3), columns are the body axes in the coordinates of the cloud
    volume [m3], centre [m] (3,), inertia : [m2] (3,), principal moments per mass about the body axes
    inside : number of points that lie below the surface of the hull and touch nothing
    """

    cloud: Cloud
    axes: Array
    volume: float
    centre: Array
    inertia: Array
    inside: int

    @staticmethod
    def of(points: Array) -> Shape:
        """Hull, mass properties and principal axes of a cloud [m], shape (n, 3).

        Raises
        ------
        ValueError
            if a coordinate is not finite, the hull has no volume, or the size of the body is implausible
        """
        points = np.unique(np.asarray(points, float).reshape(-1, 3), axis=0)
        if not np.isfinite(points).all():
            raise ValueError("a coordinate is not a finite number")
        size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
        if 0.0 < size < SHAPE_SIZE[0] or size > SHAPE_SIZE[1]:
            raise ValueError(f"a body must be {SHAPE_SIZE[0]:g} to {SHAPE_SIZE[1]:g} m long, and this has {size:g} m")
        hull = hull_of(points)
        volume, centre, inertia = of_triangles(points, hull.triangles)
        moments, axes = _principal(inertia / volume)
        depth = (hull.offsets - points @ hull.normals.T).min(axis=1)
        surface_points = depth <= ON_SURFACE * float(np.ptp(points, axis=0).max())
        body = (points - centre) @ axes
        normals = hull.normals @ axes
        offsets = hull.offsets - hull.normals @ centre
        cloud = Cloud(
            np.ascontiguousarray(body[surface_points]),
            np.ascontiguousarray(body[hull.corners]),
            np.ascontiguousarray(normals),
            offsets,
            np.concatenate([[0], np.cumsum([len(loop) for loop in hull.loops])]).astype(np.int64),
            np.concatenate(hull.loops).astype(np.int64),
            hull.edges,
            float(offsets.min()),
        )
        return Shape(cloud, axes, volume, centre, moments, int((~surface_points).sum()))

    def bodies(self, density: Array) -> Array:
        """Body table of this shape at these densities [kg/m3], shape (n, BODY_WIDTH)."""
        points = self.cloud.points
        radius = float(np.hypot(points[:, 0], points[:, 1]).max())
        body = np.zeros((len(density), BODY_WIDTH))
        body[:, BASE_RADIUS] = body[:, TIP_RADIUS] = radius
        body[:, LENGTH], body[:, CENTRE] = np.ptp(points[:, 2]), -points[:, 2].min()
        body[:, TRANSVERSE], body[:, AXIAL] = self.inertia[1], self.inertia[2]
        skew = 1.0 / self.inertia[0] - 1.0 / self.inertia[1]
        body[:, SKEW] = skew if abs(skew) * self.inertia[1] > ALIKE else 0.0
        body[:, REACH] = np.linalg.norm(points, axis=1).max()
        body[:, MASS] = self.volume * density
        return body

    def facing(self, x: Array, z: Array) -> Array:
        """Quaternions (n, 4) of the body if the cloud's own x and z axes have these directions in the world
        (orthonormal).
        """
        frames = np.stack([x, np.cross(z, x), z], axis=2)
        return self.turned(np.array([_quaternion(frame) for frame in frames]).reshape(-1, 4))

    def turned(self, quaternion: Array) -> Array:
        """Convert quaternions (n, 4) that rotate the cloud's own coordinates into the world to those of the body."""
        return _product(quaternion, _quaternion(self.axes))


def _principal(inertia: Array) -> tuple[Array, Array]:
    """Principal moments and axes (columns), right-handed; e3 has the least moment and points along the cloud's +z.

    If the axes of the cloud are principal axes they are kept, so a cube or a log of ``make-log`` keeps its orientation.
    """
    size = np.trace(inertia)
    if np.abs(inertia - np.diag(np.diag(inertia))).max() <= ALIKE * size:
        moments = np.diag(inertia)
        least = 2 if moments[2] <= moments.min() + ALIKE * size else int(moments.argmin())
        order = [(least + 1) % 3, (least + 2) % 3, least]
        return moments[order], np.eye(3)[:, order]
    moments, axes = np.linalg.eigh(inertia)
    order = [1, 2, 0]
    moments, axes = moments[order], axes[:, order]
    axes[:, 2] *= np.sign(axes[2, 2]) or 1.0
    axes[:, 0] *= np.sign(axes[0, 0]) or 1.0
    axes[:, 1] = np.cross(axes[:, 2], axes[:, 0])
    return moments, axes


def _quaternion(matrix: Array) -> Array:
    """Unit quaternion of a rotation matrix, from its largest component (Shepperd)."""
    trace = np.trace(matrix)
    square = np.array([trace, *np.diag(matrix) * 2.0 - trace]) + 1.0
    k = int(square.argmax())
    m = matrix
    rows = (
        (square[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]),
        (m[2, 1] - m[1, 2], square[1], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]),
        (m[0, 2] - m[2, 0], m[1, 0] + m[0, 1], square[2], m[2, 1] + m[1, 2]),
        (m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2], square[3]),
    )
    out = np.array(rows[k])
    return out / np.linalg.norm(out)


def _product(p: Array, q: Array) -> Array:
    """Products of quaternions (n, 4) with one quaternion (4,)."""
    a, b, c, d = p.T
    e, f, g, h = q
    return np.column_stack(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ]
    )


@kernel
def matrix_of(state, turn, at):
    """Write the rotation matrix R(q), row by row, into turn[at:at + 9]."""
    a, b, c, e = state[Q0], state[Q1], state[Q2], state[Q3]
    turn[at], turn[at + 1], turn[at + 2] = 1.0 - 2.0 * (c * c + e * e), 2.0 * (b * c - a * e), 2.0 * (b * e + a * c)
    turn[at + 3], turn[at + 4], turn[at + 5] = 2.0 * (b * c + a * e), 1.0 - 2.0 * (b * b + e * e), 2.0 * (c * e - a * b)
    turn[at + 6], turn[at + 7], turn[at + 8] = 2.0 * (b * e - a * c), 2.0 * (c * e + a * b), 1.0 - 2.0 * (b * b + c * c)


@kernel
def to_world(turn, at, p):
    """R p."""
    return (
        turn[at] * p[0] + turn[at + 1] * p[1] + turn[at + 2] * p[2],
        turn[at + 3] * p[0] + turn[at + 4] * p[1] + turn[at + 5] * p[2],
        turn[at + 6] * p[0] + turn[at + 7] * p[1] + turn[at + 8] * p[2],
    )


@kernel
def lift_cloud(terrain, cloud, frame, state, drop, turn):
    """Set the height of each body so that the least vertical gap of its points is ``drop`` [m]."""
    for n in range(state.shape[0]):
        matrix_of(state[n], turn, 0)
        least = math.inf
        for k in range(cloud.points.shape[0]):
            p = to_world(turn, 0, cloud.points[k])
            height, _, _ = surface(terrain, frame[n, 0], frame[n, 1], state[n, X] + p[0], state[n, Y] + p[1])
            if p[2] - height < least:
                least = p[2] - height
        state[n, Z] = drop[n] - least
