"""Convex hull of a point cloud, and the mass properties of a solid bounded by triangles. Plain NumPy, once per run.

Quickhull (Barber et al. 1996): every outside point is assigned to one face that it is outside of; the farthest point of
a face is added, and the faces visible from it are replaced by faces to their horizon. Of several points equally far,
the last in the order of coordinates is taken, so an added point is always a vertex, never a point on an edge. Coplanar
faces are merged into one polygon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .limits import FLAT, LEAST_THICKNESS, SAME_FACE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hull:
    """A convex polyhedron.

    corners : int64 (m,), rows of the points; triangles : int64 (t, 3), rows of the points, outward
    normals : (f, 3), outward, and offsets [m] (f,) of the faces: a point p inside has normal . p <= offset
    loops : for each face the rows of its corners (in ``corners``), counterclockwise seen from outside
    edges : int64 (e, 2), rows in ``corners``, each once
    """

    corners: NDArray[np.int64]
    triangles: NDArray[np.int64]
    normals: Array
    offsets: Array
    loops: list[NDArray[np.int64]]
    edges: NDArray[np.int64]


def hull_of(points: Array) -> Hull:
    """Convex hull of points [m], shape (n, 3).

    Raises
    ------
    ValueError
        if all points lie in one plane, on one line or in one place
    """
    points = np.asarray(points, float)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    faces = _triangles(points, size)
    return _merged(points, np.array(faces, np.int64), size)


def _farthest(points: Array, rows: NDArray[np.int64], distance: Array, slack: float) -> int:
    """The row with the largest distance; of equal ones the last in the order of coordinates."""
    ties = rows[distance >= distance.max() - slack]
    return int(ties[np.lexsort(points[ties].T[::-1])[-1]])


def _plane(points: Array, face: tuple[int, int, int]) -> tuple[Array, float]:
    a, b, c = points[list(face)]
    normal = np.cross(b - a, c - a)
    normal = normal / np.linalg.norm(normal)
    return normal, float(normal @ a)


def _first_simplex(points: Array, size: float) -> list[int]:
    rows = np.arange(len(points))
    slack = FLAT * size
    if len(points) >= 4 and size > 0.0:
        first = _farthest(points, rows, points[:, int(np.ptp(points, axis=0).argmax())], slack)
        second = _farthest(points, rows, np.linalg.norm(points - points[first], axis=1), slack)
        along = (points[second] - points[first]) / np.linalg.norm(points[second] - points[first])
        third = _farthest(points, rows, np.linalg.norm(np.cross(points - points[first], along), axis=1), slack)
        normal = np.cross(along, points[third] - points[first])
        if np.linalg.norm(normal) > LEAST_THICKNESS * size:
            normal /= np.linalg.norm(normal)
            height = (points - points[first]) @ normal
            fourth = _farthest(points, rows, np.abs(height), slack)
            if abs(height[fourth]) > LEAST_THICKNESS * size:
                simplex = [first, second, third, fourth]
                return simplex if height[fourth] < 0.0 else [first, third, second, fourth]
    raise ValueError("the points lie in one plane, line or place: their hull has no volume")


def _triangles(points: Array, size: float) -> list[tuple[int, int, int]]:
    a, b, c, d = _first_simplex(points, size)
    slack = FLAT * size
    faces: dict[int, tuple[int, int, int]] = {}
    planes: dict[int, tuple[Array, float]] = {}
    waiting: dict[int, NDArray[np.int64]] = {}
    side: dict[tuple[int, int], int] = {}  # directed edge -> face
    made = 0

    def add(face: tuple[int, int, int]) -> int:
        nonlocal made
        faces[made], planes[made] = face, _plane(points, face)
        waiting[made] = np.zeros(0, np.int64)
        for k in range(3):
            side[face[k], face[(k + 1) % 3]] = made
        made += 1
        return made - 1

    def assign(rows: NDArray[np.int64], to: list[int]) -> None:
        for face in to:
            normal, offset = planes[face]
            outside = points[rows] @ normal - offset > slack
            waiting[face] = rows[outside]
            rows = rows[~outside]

    first = [add(face) for face in ((a, b, c), (a, d, b), (b, d, c), (c, d, a))]
    assign(np.setdiff1d(np.arange(len(points)), [a, b, c, d]), first)
    ready = list(first)
    while ready:
        face = ready.pop()
        if face not in faces or not waiting[face].size:
            continue
        normal, offset = planes[face]
        top = _farthest(points, waiting[face], points[waiting[face]] @ normal - offset, slack)
        seen, stack, rim = {face}, [face], []
        while stack:
            corners = faces[stack.pop()]
            for k in range(3):
                edge = corners[k], corners[(k + 1) % 3]
                other = side[edge[1], edge[0]]
                if other in seen:
                    continue
                normal, offset = planes[other]
                if points[top] @ normal - offset > slack:
                    seen.add(other)
                    stack.append(other)
                else:
                    rim.append(edge)
        rim = [edge for edge in rim if side[edge[1], edge[0]] not in seen]
        rows = np.unique(np.concatenate([waiting.pop(each) for each in seen]))
        for each in seen:
            del faces[each], planes[each]
        fresh = [add((p, q, top)) for p, q in rim]
        assign(rows[rows != top], fresh)
        ready += fresh
    return list(faces.values())


def _merged(points: Array, triangles: NDArray[np.int64], size: float) -> Hull:
    """Coplanar triangles as one face."""
    normals, offsets, members = [], [], []
    pending = set(range(len(triangles)))
    side = {(t[k], t[(k + 1) % 3]): row for row, t in enumerate(triangles.tolist()) for k in range(3)}
    a, b, c = points[triangles].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    for seed in np.argsort(-area, kind="stable").tolist():  # the largest triangle defines the plane best
        if seed not in pending:
            continue
        normal, offset = _plane(points, tuple(triangles[seed].tolist()))
        pending.remove(seed)
        group, stack = [seed], [seed]
        while stack:
            corners = triangles[stack.pop()].tolist()
            for k in range(3):
                other = side[corners[(k + 1) % 3], corners[k]]
                if other in pending and np.abs(points[triangles[other]] @ normal - offset).max() <= SAME_FACE * size:
                    pending.remove(other)
                    group.append(other)
                    stack.append(other)
        normals.append(normal)
        offsets.append(offset)
        members.append(group)
    around = []
    for group in members:
        inside = {(t[k], t[(k + 1) % 3]) for t in triangles[group].tolist() for k in range(3)}
        after = {a: b for a, b in inside if (b, a) not in inside}
        loop = [min(after)]
        while after[loop[-1]] != loop[0]:
            loop.append(after[loop[-1]])
        around.append(loop)
    # a point of two faces only lies on their common edge: it was added because no farther point was assigned to its
    # face
    number = np.bincount([row for loop in around for row in loop], minlength=len(points))
    corners = np.flatnonzero(number > 2)
    place = {int(row): k for k, row in enumerate(corners)}
    loops = [np.array([place[row] for row in loop if number[row] > 2], np.int64) for loop in around]
    pairs = [(a, b) for loop in loops for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True) if a < b]
    return Hull(corners, triangles, np.array(normals), np.array(offsets), loops, np.array(pairs, np.int64))


def of_triangles(points: Array, triangles: NDArray[np.int64]) -> tuple[float, Array, Array]:
    """Volume [m3], centre [m] and inertia about the centre, per density [m5], of a solid bounded by triangles.

    Signed sums over the tetrahedra between the triangles and a point inside (moments after Tonon 2004).
    """
    middle = points[np.unique(triangles)].mean(axis=0)
    a, b, c = (points[triangles] - middle).transpose(1, 0, 2)
    six = np.einsum("ij,ij->i", a, np.cross(b, c))  # six times the volume of each tetrahedron
    s = a + b + c
    volume = six.sum() / 6.0
    centre = six @ s / 24.0 / volume
    second = sum(np.einsum("i,ij,ik->jk", six, each, each) for each in (s, a, b, c)) / 120.0
    second -= volume * np.outer(centre, centre)
    return float(volume), centre + middle, np.trace(second) * np.eye(3) - second
