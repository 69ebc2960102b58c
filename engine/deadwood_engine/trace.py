"""The traces of a sliding log: rasters, touched lines, and poses, written whenever an outline is due."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .cloud import matrix_of, to_world
from .compiled import inlined, kernel
from .limits import WITHIN
from .lines import touch_segments
from .log_body import BASE_RADIUS, CENTRE, LENGTH, MASS, TIP_RADIUS
from .outline import LISTED, convex_hull, hull_rows, outline
from .prefetch import prefetch
from .rotation import DX, DY, DZ, VX, WX, WY, WZ, X, Y, Z


class RasterArrays(NamedTuple):
    """Rasters of one worker, rows x columns, or 0 x 0: nothing requested, nothing done.

    The values that a passing log changes are adjacent for each cell, because a log's cells are far apart in memory.

    hits : uint32 (rows, columns, 2), logs that hit the cell (HITS), and the last of them, row + 1 (STAMP)
    maxima : float32 (rows, columns, 4), SPEED [m/s], ENERGY [J], JUMP, HEIGHT [m], or 0 x 0: only hits are counted
    deposits : uint32 (rows, columns)

    For a scene with lines, where logs that pass a cell end (``outline.count_danger``); without lines nothing is listed:

    band : int64 (lines,), the band of danger to which a line of the scene belongs; 0: none
    passed : uint32 (cells,), the cells that the current log has hit, in this order; each at most once
    order : int64 (bands,), their number (LISTED), and for each band the number when it was touched, or -1
    danger : uint32 (bands, cells), logs that hit the cell and touched a line of the band then or later; band 0: any
    """

    hits: np.ndarray
    maxima: np.ndarray
    deposits: np.ndarray
    band: np.ndarray
    passed: np.ndarray
    order: np.ndarray
    danger: np.ndarray


HITS, STAMP = range(2)
SPEED, ENERGY, JUMP, HEIGHT = range(4)
HIT_BYTES, MAXIMA_BYTES, CACHE_LINE = 8, 16, 64  # of a cell, and of a unit of transfer from memory


class Marks(NamedTuple):
    """What one log touches: lines, lines of barriers, and those crossed by its centre of mass; bool (n,)."""

    lines: np.ndarray
    fences: np.ndarray
    crossed: np.ndarray
    line_time: np.ndarray  # [s] first touch of each line
    inside: np.ndarray  # bool (n,): lines that contain the log's start, reached with its first outline


class Output(NamedTuple):
    """What one log leaves behind."""

    rasters: RasterArrays
    stamp: Any  # a number that no other log has, for the rasters
    marks: Marks
    poses: np.ndarray  # room for poses
    keep: Any  # whether they are stored
    hits: np.ndarray  # room for hits (``ledger``)
    summary: Any  # a ``way.SUMMARY``


# Columns of a pose
POSE_T, POSE_X, POSE_BASE, POSE_TIP, POSE_SPEED, POSE_SPIN, POSE_CLEARANCE = 0, 1, 4, 7, 10, 11, 12
POSE_HEIGHT = 13  # [m] of the centre of mass above the terrain
POSE_WIDTH = 14

# Columns of the trace's memory: ends at the last outline, centre there, and maxima since
LAST_BASE, LAST_TIP, LAST_X, LAST_Y, PEAK_SPEED, PEAK_ENERGY, PEAK_JUMP, LAST_TURN = 0, 3, 6, 7, 8, 9, 10, 11
PEAK_HEIGHT = 20
# and of each end's path since, in plan: its course (x, y), the least and the greatest slope against that of a chord
# that passes all positions since, and the distance covered
COURSE, COURSE_WIDTH = 21, 5
MEMORY_WIDTH = COURSE + 2 * COURSE_WIDTH


@kernel
def ends_moved(memory, state, body):
    """Distance [m] of the end that moved more from its position at the last outline."""
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    moved = 0.0
    for end in range(2):
        s = back if end == 0 else front
        at = LAST_BASE if end == 0 else LAST_TIP
        x = state[X] + s * state[DX] - memory[at]
        y = state[Y] + s * state[DY] - memory[at + 1]
        z = state[Z] + s * state[DZ] - memory[at + 2]
        moved = max(moved, x * x + y * y + z * z)
    return math.sqrt(moved)


@kernel
def _strays(memory, at, x, y, within):
    """Whether the chord from an end's position at the last outline to one (x, y) [m] from it misses a position in
    between.

    A chord may pass a position at a distance of at most ``within`` [m]: every position therefore admits a range of
    slopes against the course (the chord to the first position farther away than that), and all of them their
    intersection. An end that turns back leaves positions beyond it.
    at : where the memory holds the course
    """
    if x * x + y * y <= within * within:
        return memory[at + 4] > 0.0  # back from farther away
    ux, uy = memory[at], memory[at + 1]
    if ux == 0.0 and uy == 0.0:
        way = math.sqrt(x * x + y * y)
        memory[at], memory[at + 1] = x / way, y / way
        memory[at + 2], memory[at + 3], memory[at + 4] = -within / way, within / way, way
        return False
    along, aside = x * ux + y * uy, y * ux - x * uy
    low, high = memory[at + 2], memory[at + 3]
    if not (along > memory[at + 4] - within and low * along <= aside <= high * along):
        return True
    memory[at + 2], memory[at + 3] = max(low, (aside - within) / along), min(high, (aside + within) / along)
    memory[at + 4] = max(memory[at + 4], along)
    return False


@kernel
def outline_is_due(memory, state, body, moved, most, grain):
    """Whether the area swept since the last outline is due to be drawn.

    It is drawn as the hull of both outlines, which is exact for straight motion. An outline is therefore due if an end
    has moved by ``most`` [m] (``moved`` is the distance of the farther one), has deviated from the straight path by
    more than WITHIN times the grain [m] (a cell, or the distance of two steps), or has moved a grain farther than the
    other.
    """
    if moved >= most:
        return True
    within = WITHIN * grain
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    bx = state[X] + back * state[DX] - memory[LAST_BASE]
    by = state[Y] + back * state[DY] - memory[LAST_BASE + 1]
    tx = state[X] + front * state[DX] - memory[LAST_TIP]
    ty = state[Y] + front * state[DY] - memory[LAST_TIP + 1]
    turned = (tx - bx) ** 2 + (ty - by) ** 2 >= grain * grain
    base = _strays(memory, COURSE, bx, by, within)
    return _strays(memory, COURSE + COURSE_WIDTH, tx, ty, within) or base or turned


@kernel
def _outline_of(points, at, memory, body):
    """Outline of the pose in the memory, from row ``at``."""
    ex, ey = memory[LAST_TIP] - memory[LAST_BASE], memory[LAST_TIP + 1] - memory[LAST_BASE + 1]
    ez = memory[LAST_TIP + 2] - memory[LAST_BASE + 2]
    plan = math.sqrt(ex * ex + ey * ey)
    u = (ex / plan, ey / plan) if plan > 0.0 else (1.0, 0.0)
    ends = (memory[LAST_BASE], memory[LAST_BASE + 1]), (memory[LAST_TIP], memory[LAST_TIP + 1])
    return outline(points, at, ends, (body[BASE_RADIUS], body[TIP_RADIUS]), u, ez / body[LENGTH])


@kernel
def remember_pose(memory, state, body):
    """Store the present pose as that of the last outline."""
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    for axis in range(3):
        memory[LAST_BASE + axis] = state[X + axis] + back * state[DX + axis]
        memory[LAST_TIP + axis] = state[X + axis] + front * state[DX + axis]
    memory[LAST_X], memory[LAST_Y] = state[X], state[Y]
    for k in range(COURSE, MEMORY_WIDTH):
        memory[k] = 0.0


@kernel
def remember_peaks(memory, speed, energy, jump, height):
    """Restart the maxima with the values at the last outline's pose, which is part of the area swept from it."""
    memory[PEAK_SPEED], memory[PEAK_ENERGY], memory[PEAK_JUMP], memory[PEAK_HEIGHT] = speed, energy, jump, height


@kernel
def remember_turn(memory, state):
    """Rotation of the present pose, for a cloud's outline."""
    matrix_of(state, memory, LAST_TURN)


@kernel
def _outline_at(cloud, points, at, memory, body):
    """Outline of the pose in the memory, of a log or of a cloud's corners, from row ``at``; returns its points."""
    if cloud is None:
        return _outline_of(points, at, memory, body)
    for k in range(cloud.corners.shape[0]):
        p = to_world(memory, LAST_TURN, cloud.corners[k])
        points[at + k, 0], points[at + k, 1] = memory[LAST_X] + p[0], memory[LAST_Y] + p[1]
    return cloud.corners.shape[0]


@kernel
def _grid_of(terrain, frame, rasters):
    """The rasters' grid in a log's frame, and their part of it, as ``hull_rows`` takes them; and the shift (x, y) [m]
    from the frame to the corner of the whole DEM.
    """
    shift = (frame[0] + terrain.column) * terrain.cell, (frame[1] + terrain.row) * terrain.cell
    rows, columns = rasters.deposits.shape
    return (-shift[0], -shift[1], terrain.cell), (terrain.column, terrain.row, columns, rows), shift


@inlined
def draw(model, log, state, scratch, out, time):
    """Draw the area swept since the last outline into the rasters and mark the lines that it touches.

    time : [s] now. On the first call the memory holds the present pose: the area is the outline.
    """
    memory, points, hull, body = scratch.memory, scratch.points, scratch.hull, log.body
    path = hull[hull.shape[0] - 1]
    path[0], path[1], path[2], path[3] = memory[LAST_X], memory[LAST_Y], state[X], state[Y]
    number = _outline_at(model.cloud, points, 0, memory, body)
    remember_pose(memory, state, body)
    remember_turn(memory, state)
    number += _outline_at(model.cloud, points, number, memory, body)
    size = convex_hull(points, number, hull)
    grid, part, shift = _grid_of(model.terrain, log.frame, out.rasters)
    marks = out.marks
    if marks.lines.shape[0] > 0:
        touch_segments(model.lines, hull, size, path, shift, marks.lines, marks.lines)
        for line in range(marks.lines.shape[0]):
            if marks.lines[line] and not marks.line_time[line] <= time:
                marks.line_time[line] = time
    if marks.fences.shape[0] > 0:
        touch_segments(model.fences, hull, size, path, shift, marks.fences, marks.crossed)
    first, last = hull_rows(hull, size, grid, part, scratch.left, scratch.right)
    _hit_cells(memory, (scratch.left, scratch.right), (first, last), out, body[MASS])


@inlined
def _hit_cells(memory, sides, rows, out, mass):
    """Count the log in the cells of these rows (first, last) between both sides (left and right columns), and enter its
    peaks there. mass : [kg]
    """
    rasters, marks = out.rasters, out.marks
    (left, right), (first, last), columns = sides, rows, rasters.deposits.shape[1]
    now, fast = np.uint32(out.stamp + 1), np.float32(memory[PEAK_SPEED])
    heavy, high = np.float32(memory[PEAK_ENERGY] * mass), np.float32(memory[PEAK_JUMP])
    tall = np.float32(memory[PEAK_HEIGHT])
    listed, maxima = rasters.order[LISTED], rasters.maxima.shape[0] > 0
    # the rows are far apart in memory: requested all at once, they arrive together
    for j in range(first, last + 1):
        place = j * columns + min(left[j], columns - 1)
        prefetch(rasters.hits, place * HIT_BYTES)
        if maxima:
            prefetch(rasters.maxima, place * MAXIMA_BYTES)
            prefetch(rasters.maxima, place * MAXIMA_BYTES + CACHE_LINE)
    for j in range(first, last + 1):
        # unsigned: Numba then does not test for negative indices
        west, east = np.uint64(left[j]), np.uint64(right[j] + 1)
        cells = rasters.hits[j]
        if listed < rasters.passed.shape[0]:
            start = np.uint64(j * columns)
            for i in range(west, east):
                if cells[i, STAMP] != now and listed < rasters.passed.shape[0]:
                    rasters.passed[listed] = np.uint32(start + i)
                    listed += 1
        # without a branch: whether a log is new to a cell, or faster there, is unpredictable for the processor
        for i in range(west, east):
            cells[i, HITS] += np.uint32(cells[i, STAMP] != now)
            cells[i, STAMP] = now
        if not maxima:
            continue
        most = rasters.maxima[j]
        for i in range(west, east):
            a, b, c, d = most[i, SPEED], most[i, ENERGY], most[i, JUMP], most[i, HEIGHT]
            most[i, SPEED] = fast if a < fast else a
            most[i, ENERGY] = heavy if b < heavy else b
            most[i, JUMP] = high if c < high else c
            most[i, HEIGHT] = tall if d < tall else d
    rasters.order[LISTED] = listed
    for line in range(rasters.band.shape[0]):
        band = rasters.band[line]
        if (marks.lines[line] or marks.inside[line]) and band > 0 and rasters.order[band] < 0:
            rasters.order[band] = listed


@kernel
def forget_touches(marks):
    """Before a log slides again with more room: otherwise its lines would count as touched from the start.

    What the rasters have listed remains: they list no cell twice, and the motion is the same.
    """
    for line in range(marks.lines.shape[0]):
        marks.lines[line] = False
        marks.line_time[line] = math.inf


@kernel
def forget_after(marks, sunk):
    """For a log that failed: disregard touches since it was deeper in something than its radius (time sunk [s]), and
    all barriers that it crossed, which have no time.
    """
    for line in range(marks.lines.shape[0]):
        if marks.line_time[line] >= sunk:
            marks.lines[line] = False
            marks.line_time[line] = math.inf
    for fence in range(marks.crossed.shape[0]):
        marks.crossed[fence] = False


@kernel
def draw_deposit(model, log, state, scratch, rasters):
    """Count the log in the cells that its final outline overlaps."""
    memory, points, hull, left, right = scratch.memory, scratch.points, scratch.hull, scratch.left, scratch.right
    remember_pose(memory, state, log.body)
    remember_turn(memory, state)
    size = convex_hull(points, _outline_at(model.cloud, points, 0, memory, log.body), hull)
    grid, part, _ = _grid_of(model.terrain, log.frame, rasters)
    first, last = hull_rows(hull, size, grid, part, left, right)
    for j in range(first, last + 1):
        for i in range(left[j], right[j] + 1):
            rasters.deposits[j, i] += 1


@kernel
def keep_pose(poses, kept, time, state, body, clearance, height):
    """Append a pose if there is room; returns the number needed so far."""
    if kept < poses.shape[0]:
        pose = poses[kept]
        pose[POSE_T] = time
        back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
        speed = 0.0
        for axis in range(3):
            pose[POSE_X + axis] = state[X + axis]
            pose[POSE_BASE + axis] = state[X + axis] + back * state[DX + axis]
            pose[POSE_TIP + axis] = state[X + axis] + front * state[DX + axis]
            speed += state[VX + axis] ** 2
        spin = state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2
        pose[POSE_SPEED] = math.sqrt(speed)
        pose[POSE_SPIN] = math.sqrt(spin)
        pose[POSE_CLEARANCE], pose[POSE_HEIGHT] = clearance, height
    return kept + 1
