"""A log's motion from stored poses: the path so far, the direction of travel, the kinetic energy.

Poses contain the rate of rotation but not its axis. The rotation of the log's own axis follows from neighbouring poses;
the remainder of the rate is spin about that axis. With both moments of inertia this gives the energy of rotation to
within a few percent of the run's own (which knows every step); it is a small part for logs that slide, and up to half
of that of translation for those that roll.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.run_folder import Run, input_paths
from deadwood_algorithms.scene.shape import CONE, read_points
from deadwood_engine import Shape
from deadwood_engine.log_body import AXIAL, MASS, TRANSVERSE, cone_bodies

Array = NDArray[np.float64]


def bodies_of(source: Run) -> Array:
    """Mass properties of the logs, one row for each deposit: the engine's table (`log_body.cone_bodies`).

    For a run with ``--shape`` those of its body, whose file must still exist.
    """
    density = source.deposits["density_kg_m3"].to_numpy(np.float64)
    named = str(source.manifest.get("parameters", {}).get("shape", CONE))
    if named == CONE:
        dbh_cm, length = (source.deposits[name].to_numpy(np.float64) for name in ("dbh_cm", "length_m"))
        return cone_bodies(dbh_cm / 100.0, length, density)
    for path in input_paths(source.path, source.manifest, "shape"):
        if path.is_file():
            return Shape.of(read_points(str(path))).bodies(density)
    raise UserError(
        f"{source.path}: the shape that slid, {named}, no longer exists; restore it, because the masses are computed "
        "from it"
    )


def energies_kj(piece: dict[str, NDArray], bodies: Array) -> tuple[Array, Array]:
    """Kinetic energy of translation and of rotation at each pose [kJ]; ``bodies`` by log row."""
    body = bodies[piece["log_row"]]
    spin = piece["spin_rad_s"].astype(np.float64)
    turn = np.minimum(axis_rate(piece), spin)
    moving = 0.5 * body[:, MASS] * piece["speed_ms"].astype(np.float64) ** 2
    turning = 0.5 * body[:, MASS] * (body[:, TRANSVERSE] * turn**2 + body[:, AXIAL] * (spin**2 - turn**2))
    return moving / 1000.0, turning / 1000.0


def axis_rate(piece: dict[str, NDArray]) -> Array:
    """How fast the log's axis turns [rad/s]: mean of the rates before and after each pose; 0 if a log has only one
    pose.
    """
    axis = np.stack([piece[f"{name}t"] - piece[f"{name}b"] for name in "xyz"], axis=1)
    axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    chord = np.linalg.norm(np.diff(axis, axis=0), axis=1)
    span = np.diff(piece["t_s"])
    known = (np.diff(piece["log_row"]) == 0) & (span > 0.0)
    rate = np.where(known, 2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)), 0.0) / np.where(known, span, 1.0)
    total = np.append(0.0, rate) + np.append(rate, 0.0)
    sides = np.append(0, known) + np.append(known, 0)
    return total / np.maximum(sides, 1)


def path_so_far(piece: dict[str, NDArray]) -> Array:
    """Length of the path of the centre of mass up to each pose, from the first pose of its log [m]."""
    points = np.stack([piece["x"], piece["y"], piece["z"]], axis=1)
    steps = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    first = np.diff(piece["log_row"], prepend=-1) != 0
    steps[first] = 0.0
    path = np.cumsum(steps)
    return path - path[first][np.cumsum(first) - 1]


def travel(piece: dict[str, NDArray], pose: NDArray[np.int64]) -> Array:
    """Vector in plan from the previous pose to each of these poses [m], shape (k, 2); from a log's first pose to its
    next.

    (0, 0) where a log did not move.
    """
    before = np.maximum(pose - 1, 0)
    first = piece["log_row"][before] != piece["log_row"][pose]
    first |= pose == 0
    after = np.minimum(pose + 1, piece["x"].size - 1)
    alone = piece["log_row"][after] != piece["log_row"][pose]
    start, end = np.where(first, pose, before), np.where(first & ~alone, after, pose)
    return np.stack([piece[name][end] - piece[name][start] for name in "xy"], axis=1)
