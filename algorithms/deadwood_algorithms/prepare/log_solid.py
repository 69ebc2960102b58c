"""The solid of a log, or of a rock, as points and triangles, and its mass properties.

Body frame of a log: z along the axis from the base to the tip, z = 0 at the base.
"""

from __future__ import annotations

import itertools
from dataclasses import asdict, dataclass

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


def properties_of_cone(diameter: float, length: float, taper: float, density: float) -> MassProperties:
    """Exact properties of the smooth truncated cone; diameter of the base and length [m], density [kg/m3]."""
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


def properties_of_solid(points: Array, triangles: NDArray[np.int64], density: float) -> MassProperties:
    """Properties of the inscribed frustum whose base is at z = 0."""
    from deadwood_engine.hull import of_triangles

    volume, centre, inertia = of_triangles(points, triangles)
    axial, transverse = density * inertia[2, 2], density * 0.5 * (inertia[0, 0] + inertia[1, 1])
    return MassProperties(volume, density * volume, float(centre[2]), float(axial), float(transverse))


def norm_body(length: float, width: float, height: float) -> tuple[Array, NDArray[np.int64]]:
    """A rock between a box and an ellipsoid: the body that nets are tested with (ETAG 027), stretched to three sizes.

    A cube whose edges and corners are cut off at a quarter of its side: 26 faces. It has 0.708 (17/24) of the volume of
    its box.

    Returns
    -------
    points : [m], shape (24, 3)
        x along the length, y along the width, z up; the centre of mass is the origin.
    triangles : shape (t, 3)
        Rows of ``points``, counterclockwise seen from outside; every edge belongs to two of them.
    """
    from deadwood_engine.hull import hull_of

    signs = np.array(list(itertools.product((-0.25, 0.25), repeat=3)))
    points = np.concatenate([signs * (1.0 + np.eye(3)[axis]) for axis in range(3)])  # 1/2 on one axis, 1/4 on two
    hull = hull_of(points)
    return points * (length, width, height), hull.triangles


@dataclass(frozen=True)
class RockProperties:
    """Mass properties of a rock; the moments of inertia are about the axes of its length, width and height."""

    volume_m3: float
    mass_kg: float
    inertia_length_kg_m2: float
    inertia_width_kg_m2: float
    inertia_height_kg_m2: float

    def as_dict(self) -> dict[str, float]:
        return asdict(self)


def properties_of_rock(points: Array, triangles: NDArray[np.int64], density: float) -> RockProperties:
    """Properties of a solid whose axes are its principal axes, as those of ``norm_body`` are; density [kg/m3]."""
    from deadwood_engine.hull import of_triangles

    volume, _, inertia = of_triangles(points, triangles)
    return RockProperties(volume, density * volume, *(float(density * inertia[k, k]) for k in range(3)))
