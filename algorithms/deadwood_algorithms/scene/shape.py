"""A body that slides instead of the logs, from a file of points: ``x y z`` on each line, in metres, without a header.

This is the custom shape of RAMMS::Rockfall and what `make_log` writes. The body is the points' convex hull.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.inputs import refuse_missing
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.schemas import TREE_M
from deadwood_engine import Shape

if TYPE_CHECKING:
    from deadwood_algorithms.scene.releases import Releases

CONE = "cone"
MOST_POINTS = 20_000
USUAL_M = (0.05, 60.0)  # a body smaller or larger than this was more likely given in another unit
# Beyond this it is rejected: a stone below 1 cm would take too many steps, and no log is longer than a tree.
LIMITS_M = (0.01, TREE_M[1])
FARTHEST_M = 1e8  # largest distance of points from their origin; beyond it, numbers cannot represent millimetres


def read_points(path: str) -> NDArray[np.float64]:
    """The points of a file [m], shape (n, 3)."""
    refuse_missing(path, "shape")
    rows: list[list[float]] = []
    with open(path, encoding="utf-8-sig", errors="replace") as source:
        for number, line in enumerate(source, 1):
            words = line.split()
            if not words:
                continue
            try:
                row = [float(word) for word in words]
            except ValueError:
                row = []
            if len(row) != 3 or not np.isfinite(row).all():
                shown = line.strip()[:40]
                raise UserError(
                    f"{path}, line {number}: '{shown}' is not three numbers x y z, separated by spaces; "
                    "the file must hold one point per line, in metres, with decimal points and without a header"
                )
            rows.append(row)
            if len(rows) > MOST_POINTS:
                raise UserError(
                    f"{path}: more than {MOST_POINTS} points; every point is tested in every step, so use fewer"
                )
    return np.array(rows).reshape(-1, 3)


def read_shape(name: str, cell: float, feedback: Feedback) -> Shape | None:
    """The shape of ``--shape``: None for the cone, else that of a file of points; ``cell`` is that of the DEM [m]."""
    if str(name).strip().lower() == CONE:
        return None
    points = read_points(name)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    far = float(np.abs(points).max(initial=0.0))
    if far > FARTHEST_M:
        raise UserError(f"{name}: a point lies {far:g} m from the origin; give the points around it, in metres")
    if len(points) and not LIMITS_M[0] <= size <= LIMITS_M[1]:
        raise UserError(
            f"{name}: the body is {size:g} m long, but must be {LIMITS_M[0]:g} to {LIMITS_M[1]:g} m; give the points "
            "in metres"
        )
    try:
        shape = Shape.of(points)
    except ValueError as error:
        raise UserError(f"{name}: {error}; give at least four points that span a body") from error
    if not USUAL_M[0] <= size <= USUAL_M[1]:
        feedback.warn(
            f"{name}: the body is {size:g} m long; the file must be in metres",
            code="implausible-size",
            size_m=float(size),
        )
    if shape.inside:
        feedback.note(
            f"{name}: {shape.inside} of {len(points)} points lie inside the convex hull and touch nothing",
            code="points-within",
            points=shape.inside,
        )
    gap = longest_gap(shape)
    if gap > 2.0 * cell:
        feedback.note(
            f"{name}: points lie up to {gap:.3g} m apart along an edge, the DEM's cells are {cell:g} m: terrain that "
            "rises between points is not detected; put the points closer together than a cell (make-log --rings)",
            code="points-apart",
            gap_m=float(gap),
        )
    return shape


def longest_gap(shape: Shape) -> float:
    """Largest distance [m] of neighbouring points along an edge of the hull: nothing between them is tested against
    the ground.
    """
    points, corners = shape.cloud.points, shape.cloud.corners
    near = 1e-5 * float(np.ptp(points, axis=0).max())
    worst = 0.0
    for a, b in corners[shape.cloud.edges]:
        length = float(np.linalg.norm(b - a))
        along = (points - a) @ (b - a) / length
        aside = np.linalg.norm(points - a - along[:, None] * (b - a) / length, axis=1)
        on = np.sort(along[(aside <= near) & (along >= -near) & (along <= length + near)])
        worst = max(worst, float(np.diff(on).max(initial=0.0)))
    return worst


def as_shape(releases: Releases, shape: Shape) -> Releases:
    """Releases whose diameters and lengths are those of the shape: across and along its longest principal axis."""
    body = shape.bodies(np.ones(1))[0]
    number = len(releases)
    diameter, length = np.full(number, 2.0 * body[0]), np.full(number, body[2])
    logs = dataclasses.replace(releases.logs, diameter=diameter, length=length)
    return dataclasses.replace(releases, logs=logs, dbh_cm=100.0 * diameter)
