"""The impulses of a step in which Newton's law would generate energy, or in which a solve does not converge.

A step never ends with an approaching closed contact, beyond the solver's tolerance: the impulses P with which it may
end are **admissible**, that is

    P_N >= 0,  |P_T| <= mu P_N,  |M| <= sum(a_k P_k)     inside the cones of friction and of rolling friction,  [n]
    gamma_N+ >= b0                                       no closed contact approaches; a gap is at most closed,
    W = P.gamma- + P.G P / 2 <= W0                       the contacts do no positive work.

b0 is the target of a contact (``contacts.add_contact``) without the part due to restitution (``rebound``), so it is
-gap/dt or 0; gamma- are velocities at the node, and W0 is 0, or the work of the solve without restitution: at most
(g dt)^2 / 8, gravity's own share between the node and the middle of the step (docs/tests.md, T62).

**Restitution.** Newton's law, contact by contact, may generate energy if several contacts or friction act (Kane's
paradox), and may demand what no motion satisfies (a log in a wedge cannot leave both sides); the sweeps then do not
converge. Besides Pe, the solve with restitution, there is therefore P0, the solve with the targets b0. The first two
conditions are convex, and velocities are affine in P: if P0 and Pe satisfy them, so does every blend P0 + s (Pe - P0),
because Pe's targets are at least b0. The work is a parabola in s that opens upwards, W(s) = W0 + s m + s^2 q with q the
kinetic energy of the difference of both velocities, so all s with W(s) <= max(0, W0) form an interval that starts
at 0. Its upper end is used. A blend gives up complementarity: a contact may carry an impulse and yet separate
more slowly than by its own e. Of a solve with restitution that did not converge, the largest share is used at which
no contact approaches, which may be zero.

**Solves that do not converge.** A jam between opposed normals may reach the limit of sweeps without restitution, too.
Impulses that are already admissible are kept; an approach is ignored if a converged solve could leave it as well,
namely one that the last sweep's changes of the other contacts cause. Otherwise no friction impulse may from then on
exceed the least mu P_N of the sweeps so far (``settle``): with limits that only decrease, the sweeps converge to
Tresca's problem, in which friction does not depend on pressure. It is convex: the sweeps descend to its solution, which
does no work, because P = 0 is admissible. The cost is some friction, in that one step. If positive work remains after
the permitted sweeps, they start once more from P = 0 without friction: there every sweep strictly decreases P.(gamma- -
b) + P.G P / 2, which is 0 at the start, so wherever they are cut off there is no positive work. Any remaining approach
is then of the size of a sweep's change; the step counts as not converged.
"""

from __future__ import annotations

import math

from .asymmetric_top import energy_of
from .compiled import kernel
from .contact_solver import add_impulse, disc_impulse, solve
from .contacts import along_normal, along_t, along_u
from .energy import impulse_work
from .limits import LEAST_APPROACH
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ, spin_of


@kernel
def settle(contacts, count, state, rolling, until, share):
    """Continue to sweep with friction that may not grow, until nothing changes by more than the tolerance [m/s].

    until : (tolerance [m/s], most sweeps)
    |P_T,k| <= limit_k [m/s], a field of the contact: the least mu P_N,k so far, times the share (1, or 0: no friction).
    The moment that resists rolling is bounded in the same way. Returns the sweeps used.
    """
    tolerance, sweeps = until
    change, used, most = math.inf, 0, 0.0
    for k in range(count):
        c = contacts[k]
        c.limit = share * c.mu * c.pn
        most += share * c.roll * c.pn
    while used < sweeps and change > tolerance:
        used += 1
        change, rolls = 0.0, 0.0
        for k in range(count):
            c = contacts[k]
            v, w = (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])
            pn, pt, pu = c.pn, c.pt, c.pu
            qn = max(0.0, pn - (along_normal(c, v, w) - c.target) / c.gnn)
            c.limit = min(c.limit, c.mu * qn)
            qt, qu, c.shift = disc_impulse(
                c.gtt,
                c.gtu,
                c.guu,
                along_t(c, v, w) + c.gnt * (qn - pn) - c.gtt * pt - c.gtu * pu,
                along_u(c, v, w) + c.gnu * (qn - pn) - c.gtu * pt - c.guu * pu,
                c.limit,
                c.shift,
            )
            rolls += c.roll * qn
            c.pn, c.pt, c.pu = qn, qt, qu
            qn, qt, qu = qn - pn, qt - pt, qu - pu
            change = max(change, c.gnn * abs(qn), c.gtt * abs(qt), c.guu * abs(qu))
            add_impulse(c, state, qn, qt, qu)
        most = min(most, rolls)
        renewed = min(most, max(-most, rolling.moment - rolling.inertia * spin_of(state)))
        turn = (renewed - rolling.moment) / rolling.inertia
        rolling.moment = renewed
        change = max(change, rolling.skin * abs(turn))
        state[WX] += turn * state[DX]
        state[WY] += turn * state[DY]
        state[WZ] += turn * state[DZ]
    return used


@kernel
def restart(contacts, count, state, free, rolling):
    """Withdraw all impulses: the velocities are those before them, ``free``."""
    for k in range(count):
        c = contacts[k]
        c.pn, c.pt, c.pu, c.shift = 0.0, 0.0, 0.0, 0.0
        c.last_n, c.last_t, c.last_u = 0.0, 0.0, 0.0
    for k in range(6):
        state[VX + k] = free[k]
    rolling.moment = 0.0


@kernel
def may_rebound(settings):
    """Whether anything in the run rebounds."""
    return settings.restitution + settings.tree_restitution + settings.barrier_restitution > 0.0


@kernel
def rebounds_at_all(contacts, count):
    """Whether any contact is to rebound (eq. 8)."""
    most = 0.0
    for k in range(count):
        most = max(most, contacts[k].rebound)
    return most > 0.0


@kernel
def closing_speed(contacts, count, state):
    """Greatest speed [m/s] at which a contact closes, beyond its target; at least 0."""
    most = 0.0
    for k in range(count):
        c = contacts[k]
        most = max(
            most, c.target - along_normal(c, (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ]))
        )
    return most


@kernel
def largest_share(held, gained, parting):
    """The largest s in [0, 1] with W(s) = W0 + s m + s^2 q <= max(0, W0), where W(0) = held, W(1) = gained and
    q = parting >= 0 [J/kg]."""
    m = gained - held - parting
    if gained <= max(0.0, held):
        return 1.0
    if held >= 0.0:
        return max(0.0, -m / parting) if parting > 0.0 else 0.0
    root = math.sqrt(m * m - 4.0 * parting * held)
    return min(1.0, -2.0 * held / (m + root) if m > 0.0 else (root - m) / (2.0 * parting))


@kernel
def share_that_holds_out(contacts, count, state, tried, allowed):
    """The largest s in [0, 1] for which gamma_N(s) - b0 >= -allowed [m/s] in every contact, for velocities between
    those of ``state`` and those that were tried; targets are those without restitution.
    """
    share = 1.0
    for k in range(count):
        c = contacts[k]
        held = along_normal(c, (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])) - c.target
        then = along_normal(c, (tried[VX], tried[VY], tried[VZ]), (tried[WX], tried[WY], tried[WZ])) - c.target
        if then < -allowed and then < held:
            share = min(share, max(0.0, (held + allowed) / (held - then)))
    return share


@kernel
def blend(contacts, count, state, tried, rolling, moment, share):
    """Add the missing share to the impulses that were tried, to their velocities and their moment."""
    for k in range(count):
        c = contacts[k]
        c.pn += share * (c.tried_n - c.pn)
        c.pt += share * (c.tried_t - c.pt)
        c.pu += share * (c.tried_u - c.pu)
    rolling.moment += share * (moment - rolling.moment)
    for k in range(VX, WZ + 1):
        state[k] += share * (tried[k] - state[k])


@kernel
def make_admissible(scratch, count, state, body, free, gained, sweeps):
    """Replace the impulses of the first ``count`` contacts, with which a solve ended, by admissible ones [n].

    free : (6,), velocities before the impulses [m/s, 1/s]; gained : [J/kg] the work of the impulses
    sweeps : most of a solve

    Returns (work now [J/kg], sweeps used); the residual of the slide is then that of the solve without restitution.
    """
    contacts, rolling, tried, way = scratch.contacts, scratch.rolling[0], scratch.trial_state, scratch.way[0]
    tolerance, residual, until = way.tolerance, way.residual, (way.tolerance, sweeps)
    fall = way.fall  # in the state and in ``free``
    used, moment = 0, rolling.moment
    rebounds = rebounds_at_all(contacts, count)
    if rebounds:
        for k in range(state.shape[0]):
            tried[k] = state[k]
        for k in range(count):
            c = contacts[k]
            c.tried_n, c.tried_t, c.tried_u = c.pn, c.pt, c.pu
            c.target -= c.rebound
            c.line = 0
        restart(contacts, count, state, free, rolling)
        used, residual = solve(contacts, count, state, rolling, until, False)
        way.residual = residual
    enough = 0.5 * fall * fall
    if residual > tolerance and (
        closing_speed(contacts, count, state) > count * tolerance
        or impulse_work(contacts, count, state, rolling, fall) > enough
    ):
        used += settle(contacts, count, state, rolling, until, 1.0)
        if impulse_work(contacts, count, state, rolling, fall) > enough:
            restart(contacts, count, state, free, rolling)
            used += settle(contacts, count, state, rolling, until, 0.0)
    held = impulse_work(contacts, count, state, rolling, fall)
    if not rebounds:
        return held, used
    share = share_that_holds_out(contacts, count, state, tried, max(tolerance, LEAST_APPROACH))
    for k in range(VX, WZ + 1):
        tried[k] -= state[k]
    share = min(share, largest_share(held, gained, energy_of(tried, body)))
    for k in range(VX, WZ + 1):
        tried[k] += state[k]
    blend(contacts, count, state, tried, rolling, moment, share)
    for k in range(count):
        contacts[k].rebound *= share
        contacts[k].target += contacts[k].rebound  # what the impulses now satisfy, for the energy balance
    return impulse_work(contacts, count, state, rolling, fall), used
