"""All obstacles as the kernels read them: swept spheres (cores) of whatever kind, in one table with one index.

A core with its radius is the set of points within wide + slope z of the points of its axis, start + z u, 0 <= z <=
long: a swept sphere with a linearly varying radius. A stump is an upright cylinder with a flat end: all points within
wide - disc of the discs of radius disc about its axis. A file of one kind of obstacle (``trees``, ``barriers``,
``lying_logs``, ``blocks``) only has to state of which cores its objects consist (``lay_out``); ``narrow_phase`` and
``obstacles`` compute the contacts.

Cores joined end to end are a chain. If their least gap to a log is at a joint, it counts only if the gap grows along
both cores, and the contact belongs to the core that begins there: ``before`` is the direction in which the preceding
core leaves the joint (zero where the end is free), ``after`` states that another core begins at its end.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .grid_index import GridIndex, index_boxes, list_near

Array = NDArray[np.float64]

# Kinds of obstacles; 0 is the terrain. A barrier is an edge with a plate below it
TREE, BARRIER, LYING, BLOCK = 1, 2, 3, 4

# Greatest number of contacts of a log with one core: two on a shared line, or one; a plate has three such cores, its
# edge and two posts, and the two ends of the log
CORE_CONTACTS = 8

CORE = np.dtype(
    [
        # in plan from the node of the cell in the scene, from that of the log in the near table [m]; height above the
        # reference
        ("x", "f8"),
        ("y", "f8"),
        ("z", "f8"),
        ("ux", "f8"),
        ("uy", "f8"),
        ("uz", "f8"),
        ("long", "f8"),  # direction [-] and length [m]
        ("wide", "f8"),
        ("slope", "f8"),  # radius at the start [m], its change along the core [-]
        ("disc", "f8"),  # radius [m] of the flat part of a stump's top; the rounding of the rim is wide - disc
        ("before_x", "f8"),
        ("before_y", "f8"),
        ("before_z", "f8"),
        ("after", "f8"),
        ("first_post", "f8"),
        ("last_post", "f8"),  # of a barrier's edge: a post at its start, at its end
        ("kind", "i8"),
        ("owner", "i8"),  # row in the user's table; fallen logs, boulders after the trees
        ("capacity", "f8"),  # J that it absorbs in a hit before it breaks (``breaking``); infinite: it does not break
        # near table only: ``obstacles.time_beside``; least clearance of the log from it [m]
        ("along", "f8"),
        ("room", "f8"),
        ("clear", "f8"),
    ]
)


class SweptSphere(NamedTuple):
    """A core's shape: all points within wide + slope z of start + z u, 0 <= z <= long (a tapered capsule)."""

    start: tuple[float, float, float]  # [m]
    u: tuple[float, float, float]  # direction, a unit vector
    long: float  # [m]
    wide: float  # [m] radius at the start
    slope: float  # [-] its change along the core


class Cores(NamedTuple):
    """Cores, shape (n, ...): node, DEM column and row below the start, int64 (n, 2); solid, of dtype CORE."""

    node: np.ndarray
    solid: np.ndarray
    index: GridIndex  # pyright: ignore[reportIncompatibleMethodOverride]  (nobody looks a value up in a table)


def lay_out(
    kind: int, item: NDArray[np.int64], start: Array, end: Array, wide: Array, slope: Array, **ends: Any
) -> Any:
    """Cores from start to end [m], shape (n, 3), in plan from the centre of the DEM's cell (0, 0); ends: fields.

    wide : [m] radius at the start; slope : [-] its change along the core
    """
    solid = np.zeros(len(item), CORE)
    way = end - start
    long = np.linalg.norm(way, axis=1)
    unit = np.where(long[:, None] > 0.0, way / np.where(long > 0.0, long, 1.0)[:, None], (0.0, 0.0, 1.0))
    for k, name in enumerate("xyz"):
        solid[name], solid["u" + name] = start[:, k], unit[:, k]
    solid["long"], solid["wide"], solid["slope"], solid["kind"], solid["owner"] = long, wide, slope, kind, item
    solid["capacity"] = np.inf
    solid["room"] = np.inf  # until ``obstacles`` sets it; the steps of a cloud do not use it
    for name, values in ends.items():
        solid[name] = values
    return solid


def joined(parts: list[Any], cell: float) -> Cores:
    """One table of all kinds, indexed in plan."""
    solid = np.concatenate(parts).view(np.recarray)  # so that kernels can be called from Python in the same way
    start = np.column_stack([solid["x"], solid["y"]])
    end = start + solid["long"][:, None] * np.column_stack([solid["ux"], solid["uy"]])
    wide = np.maximum(solid["wide"], solid["wide"] + solid["long"] * solid["slope"])[:, None]
    node = np.floor(start / cell).astype(np.int64)
    solid["x"], solid["y"] = (start - node * cell).T
    return Cores(node, solid, index_boxes(np.minimum(start, end) - wide, np.maximum(start, end) + wide))


def by_kind(cores: Cores, cell: float, first: tuple[int, int]) -> dict[int, Any]:
    """The listed cores, as ``lay_out`` made them, by kind; first : DEM node from which their nodes are counted.

    Exact to the bit: x = start - node cell is exact, because both are close to each other, and so is their sum.
    """
    rows = np.unique(cores.index.items)
    solid, node = cores.solid[rows].copy(), cores.node[rows] + first
    solid["x"], solid["y"] = (node * cell + np.column_stack([solid["x"], solid["y"]])).T
    return {kind: solid[solid["kind"] == kind] for kind in (TREE, BARRIER, LYING, BLOCK)}


def left_out(cores: Cores, gone: NDArray[np.bool_]) -> Cores:
    """Remove some cores from the index; the row numbers stay the same. No cores at all if none is left."""
    if gone.all():
        return joined([np.zeros(0, CORE)], 1.0)
    stays = ~gone[cores.index.items]
    start = np.append(0, np.cumsum(stays))[cores.index.start]
    return cores._replace(index=cores.index._replace(start=start, items=cores.index.items[stays]))


@kernel
def swept_sphere(core):
    """The ``SweptSphere`` of a record of CORE."""
    return SweptSphere((core.x, core.y, core.z), (core.ux, core.uy, core.uz), core.long, core.wide, core.slope)


@kernel
def _beside(p, a, b):
    """Squared distance [m2] in plan of a point p from a segment a to b: |p - a - s (b - a)|^2, s in [0, 1]."""
    (x, y), (ax, ay) = p, a
    ex, ey = b[0] - ax, b[1] - ay
    square, share = ex * ex + ey * ey, 0.0
    if square > 0.0:
        share = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / square))
    gx, gy = ax + share * ex - x, ay + share * ey - y
    return gx * gx + gy * gy


@kernel
def apart_in_plan(a, b, c, d):
    """Distance [m] in plan of two segments, a to b and c to d: 0 where they cross, else that of one of their ends."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = a, b, c, d
    ex, ey, fx, fy = bx - ax, by - ay, dx - cx, dy - cy
    one, two = ex * (cy - ay) - ey * (cx - ax), ex * (dy - ay) - ey * (dx - ax)
    three, four = fx * (ay - cy) - fy * (ax - cx), fx * (by - cy) - fy * (bx - cx)
    if one * two < 0.0 and three * four < 0.0:
        return 0.0
    least = min(_beside(c, a, b), _beside(d, a, b))
    return math.sqrt(min(least, _beside(a, c, d), _beside(b, c, d)))


@kernel
def near(cores, frame, cell, listed, table, axis, reach):
    """List the cores within reach [m] of the log's axis in plan, in its frame; returns the count.

    axis : base and tip (x, y) [m]; listed, table : receive the rows of these cores, and their records in the frame
    A core is listed if the distance in plan from axis to axis [m], minus the core's largest radius, is at most
    ``reach``: this depends on the core alone, not on other obstacles or on the layout of the index. Tools rely on that
    (``evaluate.protection.siting``).
    """
    if cores.solid.shape[0] == 0:
        return 0
    base, tip = axis
    ox, oy = frame[0] * cell, frame[1] * cell
    found = list_near(
        cores.index,
        listed,
        ox + min(base[0], tip[0]) - reach,
        oy + min(base[1], tip[1]) - reach,
        ox + max(base[0], tip[0]) + reach,
        oy + max(base[1], tip[1]) + reach,
    )
    count = 0
    for m in range(found):
        item = listed[m]
        core = cores.solid[item]
        x = (cores.node[item, 0] - frame[0]) * cell + core.x
        y = (cores.node[item, 1] - frame[1]) * cell + core.y
        if core.ux == 0.0 and core.uy == 0.0:
            apart = math.sqrt(_beside((x, y), base, tip))
        else:
            apart = apart_in_plan(base, tip, (x, y), (x + core.long * core.ux, y + core.long * core.uy))
        if apart - max(core.wide, core.wide + core.long * core.slope) > reach:
            continue
        listed[count] = item
        table[count] = core
        table[count].x, table[count].y = x, y
        count += 1
    return count


@kernel
def still_there(listed, table, count, gone, number):
    """Remove from a list the cores broken by the log, the first ``number`` rows of ``gone``; returns the count."""
    left = 0
    for m in range(count):
        stands = True
        for k in range(number):
            stands = stands and listed[m] != gone[k]
        if stands:
            if left < m:
                listed[left] = listed[m]
                table[left] = table[m]
            left += 1
    return left


@kernel
def skin_of(settings, kind):
    """(friction, negative: that of the ground; restitution) of an obstacle: wood has that of wood, boulders that of the
    ground.
    """
    if kind == BARRIER:
        return settings.barrier_friction, settings.barrier_restitution
    if kind == BLOCK:
        return -1.0, settings.restitution
    return settings.tree_friction, settings.tree_restitution
