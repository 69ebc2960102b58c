"""Where a log is about to be, and what it knows of its surroundings there, as records."""

from __future__ import annotations

import numpy as np

from .compiled import kernel

# A pose ahead of a round log: its axis
POSE = np.dtype(
    [
        ("dx", "f8"), ("dy", "f8"), ("dz", "f8"),  # direction, base to tip
        ("x", "f8"), ("y", "f8"), ("z", "f8"),  # m, centre of mass
    ]
)  # fmt: skip

# What is near
NEAR = np.dtype(
    [
        ("base_x", "f8"), ("base_y", "f8"), ("tip_x", "f8"), ("tip_y", "f8"),  # m, plan ends that it was made for
        ("cores", "i8"), ("beside", "i8"),  # cores in the list, and of these, how many may limit the next step
        ("rings_wake", "f8"), ("obstacles_wake", "f8"),  # m, path before which no ring, no obstacle, need be looked at
        ("clear", "f8"),  # m, that the log is clear at least of what was not looked at
        ("thin", "i8"),  # row of the core that bounds the next step, or -1
        ("listed", "b1"),  # whether there is such a list of the cores that are near
        ("gone", "i8"),  # trees that the log has broken: so many of ``scratch.gone``
    ]
)  # fmt: skip


@kernel
def know_nothing(near):
    """As of a log that has not been looked at."""
    near.listed, near.cores, near.beside, near.rings_wake, near.obstacles_wake = False, 0, 0, 0.0, 0.0
    near.clear, near.thin, near.gone = 0.0, -1, 0
