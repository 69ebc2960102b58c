"""The ledger of hits: the energy and impulse that each tree and barrier absorbed from each log.

A hit is one uninterrupted episode of contact between a log and one tree or barrier: it begins with the first impulse
and ends when there has been none for HIT_PAUSE. A log that rolls along a stem hits it once; one that bounces off and
returns hits it again. All contacts with one barrier (its plates, top edges and posts) belong to the same hit.

Recorded at the first impulse: time, place, the log's speed and energy just before, and the angle between its velocity
and the normal of the obstacle. Recorded over the whole episode: the energy absorbed by the contact (its work, friction
included; the work of all contacts is all that a log loses, see ``energy``) and the impulse of its blows, the sum over
its steps.

The *blow* (impact impulse) of a step is the part that stops the log's approach to this one owner. The contacts with it
exert, friction included, the impulse J = sum P_k [m/s, per mass] and the moment T = sum r_k x P_k. Along J the log
approaches with u = -sum P_k . gamma_k- / |J| [m/s] (gamma- the contact velocities before), with the inverse effective
mass G = 1 + T . I^-1 T / |J|^2 [-]. Stopping it takes u / G; reversing it to the speed required by the impact law, b =
sum P_N max(0, target) / |J| [m/s], takes (u + b) / G. Hence

    blow = J min(1, (u + b) / (G |J|)),    if u exceeds ``BLOW`` g dt; otherwise none.

- Head-on it is m (1 + e) v: G = 1, u = v.
- The static load of a leaning log is not a blow, at any time step, because the log does not approach; it would grow
with
  the time of observation. Nor is the force that squeezes a jammed log between two owners, or between one and the
  ground, however large it is.
- It is at most what the log can deliver: a body that moves with u along an impulse with the inverse effective mass G
has at
  least the energy u^2 / 2G, so u / G <= sqrt(2 E / G) <= sqrt(2 E), E its kinetic energy per mass; with e, (1 + e)
  times that. In a hit with several blows each is bounded in this way; to approach again the log must have rebounded, or
  have been pulled down by its weight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .compiled import inlined, kernel
from .contacts import TERRAIN
from .detection import owner_of
from .energy import contact_work
from .limits import BLOW, HIT_PAUSE, LEAST_PUSH
from .rotation import X, Y, Z
from .terrain import surface
from .vectors import dot, norm, point

Array = NDArray[np.float64]

# Columns of the hit table, in the log's frame and per unit of mass
BY_BARRIER, ITEM, FIRST, LAST, PLACE, HEIGHT, SPEED, ENERGY, ANGLE = 0, 1, 2, 3, 4, 7, 8, 9, 10
TAKEN, BLOW_X, BLOW_Y, BLOW_Z, STEP, STRONGEST, BROKE = range(11, 18)
HIT_WIDTH = 18


@dataclass(frozen=True)
class Hits:
    """Hits ordered by log row, then by their beginning; shape (m,) each.

    log_row, item : int64, rows of the log and of the tree or barrier; by_barrier : bool
    time, duration : [s] of the first impulse, from the first to the last
    place : [m] (m, 3), world; height : [m] of the place above the terrain
    speed [m/s], energy [J] : of the log just before; angle : [rad] between its velocity and the normal of the obstacle
    impulse : [N s] of the blows, the length of their sum; energy_taken : [J] energy absorbed by the contact
    broke : bool, whether the tree broke, at the end of the hit, when it had absorbed its capacity (``breaking``)
    """

    log_row: NDArray[np.int64]
    item: NDArray[np.int64]
    by_barrier: NDArray[np.bool_]
    time: Array
    duration: Array
    place: Array
    height: Array
    speed: Array
    energy: Array
    angle: Array
    impulse: Array
    energy_taken: Array
    broke: NDArray[np.bool_]


def hits_of(tables: dict[int, Array], origin: Array, mass: Array) -> Hits:
    """The hit tables of the logs as one, in world coordinates and multiplied by the mass; origin (n, 3), mass (n,)."""
    rows = sorted(tables)
    table = np.vstack([np.zeros((0, HIT_WIDTH)), *(tables[row] for row in rows)])
    log_row = np.repeat(np.array(rows, np.int64), [len(tables[row]) for row in rows])
    heavy = mass[log_row]
    return Hits(
        log_row,
        table[:, ITEM].astype(np.int64),
        table[:, BY_BARRIER] > 0.0,
        table[:, FIRST].copy(),
        table[:, LAST] - table[:, FIRST],
        table[:, PLACE : PLACE + 3] + origin[log_row],
        table[:, HEIGHT].copy(),
        table[:, SPEED].copy(),
        table[:, ENERGY] * heavy,
        table[:, ANGLE].copy(),
        np.linalg.norm(table[:, BLOW_X : BLOW_Z + 1], axis=1) * heavy,
        table[:, TAKEN] * heavy,
        table[:, BROKE] > 0.0,
    )


@kernel
def hit_row(hits, number, by_barrier, item, time):
    """Row of the hit that is still in progress at this time, or ``number`` if a new one begins."""
    for back in range(number):
        row = number - 1 - back
        if hits[row, ITEM] == item and hits[row, BY_BARRIER] == by_barrier:
            # the latest of this owner: either it is still in progress, or none is
            return row if time - hits[row, LAST] <= HIT_PAUSE else number
    return number


@inlined
def note_pushes(model, log, state, scratch, hits, summary, energy):
    """Enter the impulses of this step's trees and barriers.

    state : after the solve; it and ``scratch.free``, the velocities without its impulses, lack gravity's half of the
        step behind
    summary : has the number of the step, and that of the hits so far
    energy : kinetic, per mass, just before the impulses of the step [J/kg]
    Returns the number of hits; one more than fits if the table is full (slide again with a larger one).
    """
    cores, contacts, keys, free, way = model.cores, scratch.contacts, scratch.keys, scratch.free, scratch.way[0]
    time, dt, fall, step, number = way.time, way.dt, way.fall, summary.steps, summary.hits
    if number > hits.shape[0]:
        return number
    for k in range(way.count):
        c = contacts[k]
        if keys[k, 0] == TERRAIN or c.pn <= 0.0:
            continue
        is_barrier, item = owner_of(cores, keys[k])
        by_barrier = 1.0 if is_barrier else 0.0
        row = hit_row(hits, number, by_barrier, item, time)
        if row == number and c.pn < LEAST_PUSH:
            continue
        if row >= hits.shape[0]:
            return hits.shape[0] + 1
        hit = hits[row]
        if row == number:
            number += 1
            hit[:] = 0.0
            hit[BY_BARRIER], hit[ITEM], hit[STEP], hit[ENERGY] = by_barrier, item, step, energy
        hit[LAST] = max(hit[LAST], time)
        if hit[STEP] == step and c.pn > hit[STRONGEST]:
            hit[STRONGEST] = c.pn
            p, ahead = _first_touch(state, c, dt)
            height, _, _ = surface(model.terrain, log.frame[0], log.frame[1], p[0], p[1])
            _open_hit(hit, time + ahead, p, height, (free[0], free[1], free[2] + fall), (c.nx, c.ny, c.nz))
        hit[TAKEN] -= contact_work(c, state, fall)
        if _is_first(cores, contacts, keys, k):
            blow = _blow(cores, contacts, keys, (k, way.count), BLOW * model.settings.gravity * dt)
            hit[BLOW_X] += blow[0]
            hit[BLOW_Y] += blow[1]
            hit[BLOW_Z] += blow[2]
    return number


@kernel
def _is_first(cores, contacts, keys, row):
    """Whether none of the earlier contacts acts on the same owner."""
    mine = owner_of(cores, keys[row])
    for k in range(row):
        if keys[k, 0] != TERRAIN and contacts[k].pn > 0.0 and owner_of(cores, keys[k]) == mine:
            return False
    return True


@kernel
def _blow(cores, contacts, keys, rows, least):
    """Impulse per mass [m/s] that stops the approach to the owner of the first of these rows, of all contacts with it:
    J min(1, (u + b) / (G |J|)), zero if u is at most ``least`` [m/s] (see above).
    """
    first, count = rows
    mine = owner_of(cores, keys[first])
    push, turn, turned, approach, back = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0
    for k in range(first, count):
        c = contacts[k]
        if keys[k, 0] == TERRAIN or c.pn <= 0.0 or owner_of(cores, keys[k]) != mine:
            continue
        push = point(point(point(push, c.pn, (c.nx, c.ny, c.nz)), c.pt, (c.tx, c.ty, c.tz)), c.pu, (c.ux, c.uy, c.uz))
        turn = point(turn, c.pn, (c.rnx, c.rny, c.rnz))
        turn = point(point(turn, c.pt, (c.rtx, c.rty, c.rtz)), c.pu, (c.rux, c.ruy, c.ruz))
        turned = point(turned, c.pn, (c.bnx, c.bny, c.bnz))
        turned = point(point(turned, c.pt, (c.btx, c.bty, c.btz)), c.pu, (c.bux, c.buy, c.buz))
        approach -= c.pn * c.before_n + c.pt * c.before_t + c.pu * c.before_u
        back += c.pn * max(0.0, c.target)
    square = dot(push, push)
    size = math.sqrt(square)
    if not approach > least * size:
        return 0.0, 0.0, 0.0
    share = min(1.0, (approach + back) / (square + dot(turn, turned)))
    return share * push[0], share * push[1], share * push[2]


@kernel
def _first_touch(state, c, dt):
    """(place [m], time [s] from the node) where and when a contact first acts.

    The contact was found one step ahead: the point moves on with its own velocity until its gap is closed.
    """
    ahead = 0.0
    if c.gap > 0.0 and c.before_n < 0.0:
        ahead = min(dt, -c.gap / c.before_n)
    px = state[X] + c.rx + ahead * (c.nx * c.before_n + c.tx * c.before_t + c.ux * c.before_u)
    py = state[Y] + c.ry + ahead * (c.ny * c.before_n + c.ty * c.before_t + c.uy * c.before_u)
    pz = state[Z] + c.rz + ahead * (c.nz * c.before_n + c.tz * c.before_t + c.uz * c.before_u)
    return (px, py, pz), ahead


@kernel
def _open_hit(hit, time, p, ground, v, n):
    """Enter when [s], where [m], how high above the ground [m], how fast [m/s] and at what angle to the obstacle's
    normal n a hit begins: arccos(-v.n / |v|).
    """
    hit[FIRST] = time
    hit[LAST] = max(hit[LAST], time)
    hit[PLACE], hit[PLACE + 1], hit[PLACE + 2] = p
    hit[HEIGHT] = p[2] - ground
    speed = norm(v)
    hit[SPEED] = speed
    if speed > 0.0:
        hit[ANGLE] = math.acos(min(1.0, max(-1.0, -dot(v, n) / speed)))
