"""Trees that break: a tree that would absorb more than its capacity absorbs exactly that, and disappears for this log.
So does a straight piece of a lying log, if that has a capacity; the words below say tree for both.

A tree's capacity C [J] is the greatest energy that it can absorb in one hit. A hit is defined as in ``ledger``: one
uninterrupted episode of contact, its energy the work [f] of its contacts, friction included. A tree therefore breaks in
exactly the hit that is elsewhere counted as above its capacity. Two hits with a pause between them do not add up,
because each loads a stem that has swung back.

Let P_k be the impulses at the contacts of a rigid tree. In the step in which the energy of the hit would exceed C, the
tree acts with s P_k only, s in [0, 1], so that it has then absorbed exactly C:

    taken(s) = -s sum_k P_k.(gamma_k- + gamma_k+(s)) / 2 = r,    r = C/m - energy absorbed earlier in the hit   [o]

With the impulses of all other contacts fixed, gamma+ is affine in s, and [o] is quadratic:

    gamma_k+(s) = b_k + s sum_j G_kj P_j,   s^2 q + s h + 2 r = 0,   h = sum P_k.(gamma_k- + b_k),  q = sum P_k.G_kj P_j

- If the tree is the only contact of the step, this is the solution: the log's kinetic energy falls by C minus the
energy
  absorbed earlier, to rounding, whatever the direction, friction and lever arm of the impulse.
- If there are other contacts (ground, other trees), they are solved again with the impulse s P_k, and s again for them,
  between a lower and an upper bound of s, until no velocity changes by more than the solver's tolerance. The last
  update is that of s: [o] is satisfied to rounding, and the other contacts as well as a solve satisfies their laws.
- If two trees break in one step, the one that would exceed its capacity by more is treated first. The second then
changes
  gamma+, and with it the share of the first; the sum of all work, [f], remains exact.

From the next step on, the broken tree is excluded from the obstacles nearby.

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
from .cores import LYING, TREE
from .energy import contact_work, impulse_work
from .impacts import make_admissible, may_rebound, rebounds_at_all
from .ledger import BROKE, TAKEN, hit_row
from .limits import BREAKING_LOOKS, BROKEN_WITHIN, LEAST_PUSH
from .log_body import MASS
from .rotation import VX, VY, VZ, WX, WY, WZ


@kernel
def overloaded(cores, mass, scratch, state, count, hits, number):
    """(row of its first contact or -1, r [J/kg]) of the tree that would exceed its capacity by most, of all that would
    exceed it once the impulses of this step are recorded.
    """
    contacts, keys, way = scratch.contacts, scratch.keys, scratch.way[0]
    worst, found, rest = 1.0, -1, 0.0
    for k in range(count):
        if (keys[k, 0] != TREE and keys[k, 0] != LYING) or contacts[k].pn <= 0.0:
            continue
        core = cores.solid[keys[k, 1]]
        capacity = core.capacity / mass
        if capacity == math.inf:
            continue
        work, strongest, is_first = 0.0, 0.0, True
        for j in range(count):
            if keys[j, 0] == keys[k, 0] and keys[j, 1] == keys[k, 1] and contacts[j].pn > 0.0:
                is_first = is_first and j >= k
                work -= contact_work(contacts[j], state, way.fall)
                strongest = max(strongest, contacts[j].pn)
        row = hit_row(hits, number, 0.0, core.owner, way.time)
        before = hits[row, TAKEN] if row < number else 0.0
        if not is_first or (row == number and strongest < LEAST_PUSH):
            continue
        if before + work > worst * capacity:
            worst, found, rest = (before + work) / capacity, k, max(0.0, capacity - before)
    return found, rest


@kernel
def put_last(contacts, keys, count, core, spare):
    """Move the contacts with this core to the end of the table; returns the number of other contacts before them.

    core : its row; that of the terrain's contacts means something else
    """
    left = count
    k = 0
    while k < left:
        if (keys[k, 0] == TREE or keys[k, 0] == LYING) and keys[k, 1] == core:
            left -= 1
            exchange(contacts, keys, k, left, spare)
        else:
            k += 1
    return left


@kernel
def push_with(contacts, first, last, share, velocities):
    """Add a share of the impulses of a rigid tree (``tried``) to the velocities of a state; nothing else changes."""
    for k in range(first, last):
        c = contacts[k]
        add_impulse(c, velocities, share * c.tried_n, share * c.tried_t, share * c.tried_u)


@kernel
def share_taking(contacts, rows, state, kick, share, fall, rest):
    """Eq. [o]: the s in (0, 1] with which the tree absorbs r [J/kg] if the other impulses are fixed: of two roots of
    s^2 q + s h + 2 r = 0 the one nearer to the current share; -1 if there is none.

    rows : first and last + 1 of the tree's contacts; fall : [m/s] as in ``energy``
    state : includes that share of the tree's impulses, which as a whole would change the velocities by ``kick``
    """
    h = q = 0.0
    v = (state[VX] - share * kick[VX], state[VY] - share * kick[VY], state[VZ] + fall - share * kick[VZ])
    w = (state[WX] - share * kick[WX], state[WY] - share * kick[WY], state[WZ] - share * kick[WZ])
    dv, dw = (kick[VX], kick[VY], kick[VZ]), (kick[WX], kick[WY], kick[WZ])
    for k in range(rows[0], rows[1]):
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
def give_way(scratch, state, rows, rest, sweeps):
    """Scale the impulses of the tree with these rows of contacts (first, last + 1) so that it absorbs r [J/kg], and
    solve the contacts before them again. Returns the residual [m/s] of the last solve.
    """
    contacts, rolling, kick, way = scratch.contacts, scratch.rolling[0], scratch.trial_state, scratch.way[0]
    first, last = rows
    tolerance, fall = way.tolerance, way.fall
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
        now = share_taking(contacts, rows, state, kick, share, fall, rest)
        moved = fastest * abs(now - share)
        if now < 0.0 or (moved > tolerance and not low < now <= high):
            now = 0.5 * (low + high)  # with the other impulses fixed there is no root between the bounds
            moved = fastest * (high - low)
        push_with(contacts, first, last, now - share, state)
        share = now
        if first == 0 or moved <= tolerance:
            break
        _, residual = solve(contacts, first, state, rolling, (tolerance, sweeps), False)
        taken = 0.0
        for k in range(first, last):
            c = contacts[k]
            c.pn, c.pt, c.pu = share * c.tried_n, share * c.tried_t, share * c.tried_u
            taken -= contact_work(c, state, fall)
        if taken > rest:
            high = share
        else:
            low = share
        if abs(taken - rest) <= BROKEN_WITHIN * rest:
            break
    now = share_taking(contacts, rows, state, kick, share, fall, rest)
    now = share if now < 0.0 else now
    push_with(contacts, first, last, now - share, state)
    for k in range(first, last):
        c = contacts[k]
        c.pn, c.pt, c.pu = now * c.tried_n, now * c.tried_t, now * c.tried_u
    return residual


@kernel
def break_trees(model, log, state, scratch, hits, number):
    """Break every tree that would absorb more than its capacity.

    hits, number : the ledger of this log, before this step

    Returns how many contacts, the first of the table, are with obstacles that remain.
    """
    contacts, keys, near, way = scratch.contacts, scratch.keys, scratch.near[0], scratch.way[0]
    settings, count = model.settings, way.count
    left = count
    while True:
        worst, rest = overloaded(model.cores, log.body[MASS], scratch, state, left, hits, number)
        if worst < 0:
            break
        core = keys[worst, 1]
        last, left = left, put_last(contacts, keys, left, core, scratch.spare)
        scratch.gone[near.gone] = core
        near.gone += 1
        near.listed, near.obstacles_wake = False, 0.0  # the list of obstacles nearby is made again, without this tree
        way.residual = give_way(scratch, state, (left, last), rest, settings.sweeps)
    if left == count:
        return count
    gained = impulse_work(contacts, left, state, scratch.rolling[0], way.fall)
    if way.residual > way.tolerance or (gained > 0.0 and may_rebound(settings) and rebounds_at_all(contacts, left)):
        trial = scratch.trial_state
        for k in range(6):
            trial[VX + k] = scratch.free[k]
        for k in range(left, count):
            c = contacts[k]
            add_impulse(c, trial, c.pn, c.pt, c.pu)
        for k in range(6):
            scratch.kicked[k] = trial[VX + k]
        make_admissible(scratch, left, state, log.body, scratch.kicked, gained, settings.sweeps)
    return left


@kernel
def note_broken(cores, keys, rows, hits, number, time):
    """Record in the ledger, after this step's impulses, that the trees of these contacts (rows: first, last + 1) broke
    in their hits.
    """
    if number > hits.shape[0]:
        return
    for k in range(rows[0], rows[1]):
        row = hit_row(hits, number, 0.0, cores.solid[keys[k, 1]].owner, time)
        if row < number:
            hits[row, BROKE] = 1.0
