"""Aitken's extrapolation of a slowly converging solve: the effect of many sweeps in one step.

If normals oppose each other (a log jammed between stems, or touching both flanks of a channel), a Gauss-Seidel sweep
removes a hundredth of the remaining error, always along the same direction of the impulses. If the change of a sweep
is lambda times that of the previous sweep, all following sweeps together amount to

    lambda / (1 - lambda) times the last change,    lambda = (D1.D0) / (D0.D0),

which is Aitken's delta-squared process along one direction (Aitken 1926). The result is projected onto the cones, and
the sweeps continue: they alone decide when a solve has converged.
"""

from __future__ import annotations

import math

from .compiled import kernel
from .contacts import pushed
from .limits import EXTRAPOLATE_ALIKE


@kernel
def sweeps_ahead(same, before, now):
    """Eq. [n]: the multiple of the last change of the impulses to which the following sweeps amount; 0 if it cannot be
    estimated.

    same, before, now : D1.D0, D0.D0 and D1.D1 of the changes in the last two sweeps
    """
    if same <= EXTRAPOLATE_ALIKE * math.sqrt(before * now) or before == 0.0:
        return 0.0
    rate = same / before
    return rate / (1.0 - rate) if rate < 1.0 else math.inf


@kernel
def _until_unloaded(load, change, times):
    """The largest multiple at which no loaded contact is more than unloaded."""
    return min(times, -load / change) if change < 0.0 else times


@kernel
def before_unloading(contacts, count, times):
    """The largest multiple of the last changes before a contact or the end of a line opens and another mode begins."""
    start = 0
    while start < count:
        number = max(contacts[start].line, 1)
        if number == 1:
            times = _until_unloaded(contacts[start].pn, contacts[start].last_n, times)
        else:
            low, length = contacts[start].along, contacts[start + number - 1].along - contacts[start].along
            total = far = total_change = far_change = 0.0
            for k in range(start, start + number):
                c = contacts[k]
                share = (c.along - low) / length
                total, far = total + c.pn, far + share * c.pn
                total_change, far_change = total_change + c.last_n, far_change + share * c.last_n
            times = _until_unloaded(far, far_change, times)
            times = _until_unloaded(total - far, total_change - far_change, times)
        start += number
    return times


@kernel
def go_ahead(contacts, count, times, v, w):
    """Advance all impulses by a multiple of their last change and project them onto their cones; returns the
    velocities (v, w) [m/s, 1/s].
    """
    for k in range(count):
        c = contacts[k]
        pn = max(0.0, c.pn + times * c.last_n)
        pt, pu = c.pt + times * c.last_t, c.pu + times * c.last_u
        size, most = math.sqrt(pt * pt + pu * pu), c.mu * pn
        if size > most:
            pt, pu = pt * most / size, pu * most / size
        qn, qt, qu = pn - c.pn, pt - c.pt, pu - c.pu
        c.pn, c.pt, c.pu = pn, pt, pu
        v, w = pushed(c, v, w, (qn, qt, qu))
    return v, w
