"""The predicted pose of a log, and what is known of its surroundings there, as records."""

from __future__ import annotations

import numpy as np

from .compiled import kernel

# A predicted pose of a round log: its axis
POSE = np.dtype(
    [
        ("dx", "f8"),
        ("dy", "f8"),
        ("dz", "f8"),  # direction, base to tip
        ("x", "f8"),
        ("y", "f8"),
        ("z", "f8"),  # m, centre of mass
    ]
)

# The surroundings
NEAR = np.dtype(
    [
        ("base_x", "f8"),
        ("base_y", "f8"),
        ("tip_x", "f8"),
        ("tip_y", "f8"),  # m, ends in plan for which it was made
        ("cores", "i8"),
        ("beside", "i8"),  # cores in the list, and of these, how many may limit the next step
        ("obstacles_wake", "f8"),  # m, path before which no obstacle needs a query
        ("clear", "f8"),  # m, least clearance of the log from all that was not queried
        ("thin", "i8"),  # row of the core that bounds the next step, or -1
        ("listed", "b1"),  # whether there is a list of the near cores
        ("gone", "i8"),  # trees that the log has broken: number of rows of ``scratch.gone``
    ]
)


@kernel
def know_nothing(near):
    """As for a log that has not been queried."""
    near.listed, near.cores, near.beside, near.obstacles_wake = False, 0, 0, 0.0
    near.clear, near.thin, near.gone = 0.0, -1, 0
