"""Oscillation: a log that rolls to and fro in a hollow stays there, although it does not come to rest.

Rolling costs a rigid log no energy (no friction opposes it), so an oscillation in a hollow continues for minutes, and
the certificate of ``rest`` never holds. But energy only decreases: a log that turns back at the same places, period
after period, without gaining energy, seldom leaves. While a log is slow, the bounding box of the motion of its ends and
its peak energy are therefore recorded in windows of time: a log that shows nothing new in the last of them is at rest.
One that slides on, however slowly, leaves the box; one that topples gains energy. How far logs stopped in this way
would still have moved is measured (engine/README.md).
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .limits import ROCKING_CREEP, ROCKING_GROWTH, ROCKING_RANGE, ROCKING_SPEED, ROCKING_WINDOW
from .log_body import CENTRE, LENGTH
from .rotation import DX, X

# A row for each window, the present one first: lowest and highest x, y, z of both ends [m], and peak energy [J/kg]
LOW, HIGH, PEAK = 0, 6, 12
ROCKING_WIDTH = 13
WINDOWS = 4


@kernel
def _forget(windows, row):
    """Clear one window: a box of nothing, without energy."""
    for k in range(6):
        windows[row, LOW + k], windows[row, HIGH + k] = math.inf, -math.inf
    windows[row, PEAK] = 0.0


@kernel
def forget_windows(windows):
    """Clear all windows."""
    for row in range(WINDOWS):
        _forget(windows, row)


@inlined
def watch(windows, state, body, energy, rest_speed):
    """Extend the present window's box by this pose; a window with too much energy [J/kg] does not count."""
    if energy > (ROCKING_SPEED * rest_speed) ** 2:
        windows[0, PEAK] = math.inf
        return
    windows[0, PEAK] = max(windows[0, PEAK], energy)
    for end in range(2):
        s = -body[CENTRE] if end == 0 else body[LENGTH] - body[CENTRE]
        for axis in range(3):
            place, k = state[X + axis] + s * state[DX + axis], 3 * end + axis
            windows[0, LOW + k] = min(windows[0, LOW + k], place)
            windows[0, HIGH + k] = max(windows[0, HIGH + k], place)


@kernel
def rocks_in_place(windows, rest_speed):
    """Whether the log stayed where it had been in the previous windows, and gained no energy; starts the next window.

    In these it must have moved within ROCKING_RANGE, and it may creep by ROCKING_CREEP of the rest_speed [m/s].
    """
    creep, before, stayed = ROCKING_CREEP * rest_speed * ROCKING_WINDOW, 0.0, True
    for row in range(1, WINDOWS):
        before = max(before, windows[row, PEAK])
        # otherwise the slow turning point of a wide oscillation would look like a place
        stayed = stayed and windows[row, LOW] < math.inf
    for k in range(6):
        low, high = math.inf, -math.inf
        for row in range(1, WINDOWS):
            low, high = min(low, windows[row, LOW + k]), max(high, windows[row, HIGH + k])
        stayed = stayed and high - low <= ROCKING_RANGE
        stayed = stayed and windows[0, LOW + k] >= low - creep and windows[0, HIGH + k] <= high + creep
    stayed = stayed and windows[0, PEAK] <= ROCKING_GROWTH * before
    for row in range(WINDOWS - 1, 0, -1):
        for k in range(ROCKING_WIDTH):
            windows[row, k] = windows[row - 1, k]
    if windows[1, PEAK] == math.inf:
        _forget(windows, 1)
    _forget(windows, 0)
    return stayed
