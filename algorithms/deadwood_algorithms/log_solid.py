"""The solid of a log as points and triangles, its mass properties, and the files that other programs read.

For `make_log`. Body frame: origin at the centre of mass, z along the axis from the base to the tip.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MassProperties:
    """Mass properties of a log; the moments of inertia are about its centre of mass, along and across its axis."""

    volume_m3: float
    mass_kg: float
    centre_from_base_m: float
    inertia_axial_kg_m2: float
    inertia_transverse_kg_m2: float

    def as_dict(self) -> dict[str, float]:
        return asdict(self)


def of_cone(diameter: float, length: float, taper: float, density: float) -> MassProperties:
    """Of the smooth truncated cone, exactly; diameter of the base and length [m], density [kg/m3]."""
    from deadwood_engine.log_body import AXIAL, CENTRE, MASS, TRANSVERSE, cone_bodies

    body = cone_bodies(np.array([diameter]), np.array([length]), np.array([density]), taper=taper)[0]
    mass = float(body[MASS])
    axial, transverse = mass * float(body[AXIAL]), mass * float(body[TRANSVERSE])
    return MassProperties(mass / density, mass, float(body[CENTRE]), axial, transverse)


def frustum(diameter: float, length: float, taper: float, vertices: int, rings: int) -> tuple[Array, NDArray[np.int64]]:
    """The frustum inscribed in the cone: its points and its triangles.

    Returns
    -------
    points : [m], shape (rings * vertices, 3)
        Ring by ring from the base, each counterclockwise seen from the tip; z = 0 at the base.
    triangles : shape (2 * rings * vertices - 4, 3)
        Rows of ``points``, counterclockwise seen from outside; every edge belongs to two of them.
    """
    turn = 2.0 * np.pi * np.arange(vertices) / vertices
    share = np.linspace(0.0, 1.0, rings)[:, None]
    radius = 0.5 * diameter * (1.0 + (taper - 1.0) * share)
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    points = np.stack([x, y, np.broadcast_to(length * share, x.shape)], axis=-1).reshape(-1, 3)

    here = np.arange(vertices)
    after = np.roll(here, -1)
    below = (vertices * np.arange(rings - 1))[:, None]
    a, b, c, d = below + here, below + after, below + vertices + after, below + vertices + here
    sides = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    fan, zero = np.arange(1, vertices - 1), np.zeros(vertices - 2, np.int64)
    base = np.stack([zero, fan + 1, fan], axis=-1)
    tip = np.stack([zero, fan, fan + 1], axis=-1) + vertices * (rings - 1)
    return points, np.concatenate([base, sides, tip])


def of_solid(points: Array, triangles: NDArray[np.int64], density: float) -> MassProperties:
    """Of the inscribed frustum whose base lies at z = 0."""
    from deadwood_engine.hull import of_triangles

    volume, centre, inertia = of_triangles(points, triangles)
    axial, transverse = density * inertia[2, 2], density * 0.5 * (inertia[0, 0] + inertia[1, 1])
    return MassProperties(volume, density * volume, float(centre[2]), float(axial), float(transverse))


def write_points(path: Path, points: Array) -> None:
    """The custom shape of RAMMS::Rockfall: ``x y z`` a line, without a header."""
    _write(path, (f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points))


def write_obj(path: Path, points: Array, triangles: NDArray[np.int64]) -> None:
    """Wavefront OBJ; its indices count from 1."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    _write(path, iter(lines + [f"f {i} {j} {k}" for i, j, k in triangles + 1]))


def write_stl(path: Path, points: Array, triangles: NDArray[np.int64]) -> None:
    """STL as text, the normals pointing outwards."""
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]

    def lines() -> Iterator[str]:
        yield "solid log"
        for normal, triangle in zip(normals, corners, strict=True):
            yield "facet normal {:.9g} {:.9g} {:.9g}".format(*normal)
            yield "outer loop"
            yield from ("vertex {:.9g} {:.9g} {:.9g}".format(*corner) for corner in triangle)
            yield "endloop"
            yield "endfacet"
        yield "endsolid log"

    _write(path, lines())


def _write(path: Path, lines: Iterator[str]) -> None:
    path.write_text("".join(f"{line}\n" for line in lines), encoding="ascii", newline="\n")
