"""Trees that break: what would take more than it can takes just that much, and is gone for this log.

A tree's capacity C [J] is the most energy that it takes in one hit. A hit is the ledger's (``ledger``): one
uninterrupted episode of contact, its energy the work [f] of its contacts, friction included. So a tree breaks here in
the very hit that counts as above its capacity elsewhere; two hits with a pause between them do not add up, for each
loads a stem that has swung back.

Let the impulses P_k of a tree's contacts be those that hold a rigid tree's log off. In the step in which the hit would
come to more than C, the tree pushes with s P_k only, s in [0, 1], so that it has then taken exactly C:

    taken(s) = -s sum_k P_k.(gamma_k- + gamma_k+(s)) / 2 = r,    r = C/m - what the hit has taken before         [o]

With the impulses of all other contacts as they are, gamma+ is affine in s, and [o] is a parabola:

    gamma_k+(s) = b_k + s sum_j G_kj P_j,   s^2 q + s h + 2 r = 0,   h = sum P_k.(gamma_k- + b_k),  q = sum P_k.G_kj P_j

- Where the tree is the only contact of the step, that is all: the log's kinetic energy falls by C - (what the hit took
  before) to rounding, whatever the direction, friction and lever of the push.
- Where others push too (ground, other trees), they are solved again under the push s P_k, and s again for them, between
  an s that is too little and one that is too much, until no velocity changes by more than the solver's tolerance. The
  last word is with s: [o] is met to rounding, and the others are left as far from their laws as a solve leaves them.
- If two trees break in one step, the one that would be the most above its capacity goes first. What the second then
  changes of gamma+ the first one's share changes by; the sum of all works, [f], stays exact.

The broken tree is left out of what is near from the next step on.

symbol  in code   unit
C/m     capacity  J/kg
r       rest      J/kg
s       share     -
h, q    h, q      J/kg
"""

from __future__ import annotations

import math

from .compiled import kernel
from .contact_solver import add_impulse, exchange, solve
from .contacts import along_normal, along_t, along_u
from .cores import TREE
from .energy import contact_work, impulse_work
from .impacts import make_admissible, rebounds_at_all
from .ledger import BROKE, TAKEN, hit_row
from .limits import BREAKING_LOOKS, BROKEN_WITHIN, LEAST_PUSH
from .log_body import MASS
from .rotation import VX, VY, VZ, WX, WY, WZ, spin_of


@kernel
def overloaded(scene, contacts, keys, count, state, body, fall, hits, number, time):
    """(row of its first contact or -1, r [J/kg]) of the tree that would be the most above its capacity, of all that
    would, once this step's impulses are booked."""
    worst, found, rest = 1.0, -1, 0.0
    for k in range(count):
        if keys[k, 0] != TREE or contacts[k].pn <= 0.0:
            continue
        core = scene.cores.solid[keys[k, 1]]
        capacity = core.capacity / body[MASS]
        if capacity == math.inf:
            continue
        work, strongest, is_first = 0.0, 0.0, True
        for j in range(count):
            if keys[j, 0] == TREE and keys[j, 1] == keys[k, 1] and contacts[j].pn > 0.0:
                is_first = is_first and j >= k
                work -= contact_work(contacts[j], state, VX, fall)
                strongest = max(strongest, contacts[j].pn)
        row = hit_row(hits, number, 0.0, core.owner, time)
        before = hits[row, TAKEN] if row < number else 0.0
        if not is_first or (row == number and strongest < LEAST_PUSH):
            continue
        if before + work > worst * capacity:
            worst, found, rest = (before + work) / capacity, k, max(0.0, capacity - before)
    return found, rest


@kernel
def put_last(contacts, keys, count, core, spare):
    """Bring the contacts with this core to the end of the table; returns how many others stand before them."""
    left = count
    k = 0
    while k < left:
        if keys[k, 0] == TREE and keys[k, 1] == core:
            left -= 1
            exchange(contacts, keys, k, left, spare)
        else:
            k += 1
    return left


@kernel
def push_with(contacts, first, last, share, velocities):
    """Add a share of the impulses of a rigid tree (``tried``) to velocities; a state, of which only these change."""
    for k in range(first, last):
        c = contacts[k]
        add_impulse(c, velocities, share * c.tried_n, share * c.tried_t, share * c.tried_u)


@kernel
def share_taking(contacts, first, last, state, kick, share, fall, rest):
    """Eq. [o]: the s in (0, 1] with which the tree takes r [J/kg], the other impulses as they are: of two the one
    nearer to the share that acts now; -1 where there is none.

    state : with that share of the tree's impulses, which as a whole would change the velocities by ``kick``
    """
    h = q = 0.0
    v = (state[VX] - share * kick[VX], state[VY] - share * kick[VY], state[VZ] + fall - share * kick[VZ])
    w = (state[WX] - share * kick[WX], state[WY] - share * kick[WY], state[WZ] - share * kick[WZ])
    dv, dw = (kick[VX], kick[VY], kick[VZ]), (kick[WX], kick[WY], kick[WZ])
    for k in range(first, last):
        c = contacts[k]
        h += (
            c.tried_n * (c.before_n + along_normal(c, v, w))
            + c.tried_t * (c.before_t + along_t(c, v, w))
            + c.tried_u * (c.before_u + along_u(c, v, w))
        )
        q += c.tried_n * along_normal(c, dv, dw) + c.tried_t * along_t(c, dv, dw) + c.tried_u * along_u(c, dv, dw)
    square, found = h * h - 8.0 * q * rest, -1.0
    if h < 0.0 and square >= 0.0:
        root = math.sqrt(square) - h
        less, more = 4.0 * rest / root, 0.5 * root / q
        if more <= 1.0:
            found = more
        if less <= 1.0 and (found < 0.0 or abs(less - share) <= abs(more - share)):
            found = less
    return found


@kernel
def give_way(contacts, first, last, state, kick, rolling, tolerance, sweeps, fall, rest):
    """Scale the impulses of the tree whose contacts are ``first`` to before ``last`` so that it takes r, and solve the
    contacts before them again. kick : (16,), room for a state. Returns the residual [m/s] of the last solve."""
    for k in range(kick.shape[0]):
        kick[k] = 0.0
    fastest = 0.0
    for k in range(first, last):
        c = contacts[k]
        c.tried_n, c.tried_t, c.tried_u = c.pn, c.pt, c.pu
        fastest = max(fastest, c.gnn * c.pn)
    push_with(contacts, first, last, 1.0, kick)
    for k in range(first):
        contacts[k].line = 0
    share, low, high, residual = 1.0, 0.0, 1.0, 0.0
    for _ in range(BREAKING_LOOKS):
        now = share_taking(contacts, first, last, state, kick, share, fall, rest)
        moved = fastest * abs(now - share)
        if now < 0.0 or (moved > tolerance and not low < now <= high):
            now = 0.5 * (low + high)  # with the others as they are, none is between too little and too much
            moved = fastest * (high - low)
        push_with(contacts, first, last, now - share, state)
        share = now
        if first == 0 or moved <= tolerance:
            break
        _, residual = solve(contacts, first, state, rolling, tolerance, sweeps, False)
        taken = 0.0
        for k in range(first, last):
            c = contacts[k]
            c.pn, c.pt, c.pu = share * c.tried_n, share * c.tried_t, share * c.tried_u
            taken -= contact_work(c, state, VX, fall)
        if taken > rest:
            high = share
        else:
            low = share
        if abs(taken - rest) <= BROKEN_WITHIN * rest:
            break
    now = share_taking(contacts, first, last, state, kick, share, fall, rest)
    now = share if now < 0.0 else now
    push_with(contacts, first, last, now - share, state)
    for k in range(first, last):
        c = contacts[k]
        c.pn, c.pt, c.pu = now * c.tried_n, now * c.tried_t, now * c.tried_u
    return residual


@kernel
def break_trees(scene, state, body, settings, scratch, way, hits, number, count, fall, bounces):
    """Let every tree give way that would take more than it can.

    hits, number : the ledger of this log, before this step; count : contacts of the step; fall : [m/s] as in ``energy``

    Returns how many contacts, the first of the table, are with what still stands.
    """
    contacts, keys, rolling, near = scratch.contacts, scratch.keys, scratch.rolling[0], scratch.near[0]
    left = count
    while True:
        worst, rest = overloaded(scene, contacts, keys, left, state, body, fall, hits, number, way.time)
        if worst < 0:
            break
        core = keys[worst, 1]
        last, left = left, put_last(contacts, keys, left, core, scratch.spare)
        scratch.gone[near.gone] = core
        near.gone += 1
        near.listed, near.obstacles_wake = False, 0.0  # what is near is listed anew, without it
        way.residual = give_way(
            contacts, left, last, state, scratch.trial_state, rolling, way.tolerance, settings.sweeps, fall, rest
        )
    if left == count:
        return count
    gained = impulse_work(contacts, left, state, VX, fall, rolling, spin_of(state))
    if way.residual > way.tolerance or (gained > 0.0 and bounces and rebounds_at_all(contacts, left)):
        trial = scratch.trial_state
        for k in range(6):
            trial[VX + k] = scratch.free[k]
        for k in range(left, count):
            c = contacts[k]
            add_impulse(c, trial, c.pn, c.pt, c.pu)
        for k in range(6):
            scratch.kicked[k] = trial[VX + k]
        _, way.residual, _ = make_admissible(
            contacts, left, state, body, scratch.kicked, trial, rolling, way.tolerance, settings.sweeps, way.residual,
            fall, gained,
        )  # fmt: skip
    return left


@kernel
def note_broken(scene, keys, first, last, hits, number, time):
    """Say in the ledger, after this step's pushes are entered, that the trees of these contacts broke in their hits."""
    if number > hits.shape[0]:
        return
    for k in range(first, last):
        row = hit_row(hits, number, 0.0, scene.cores.solid[keys[k, 1]].owner, time)
        if row < number:
            hits[row, BROKE] = 1.0
