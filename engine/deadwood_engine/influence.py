"""Which obstacles mattered to a log, and from when: without any of the others its motion is the same, bit for bit.

An obstacle affects the motion of a log in three ways, each recorded with the time of its first occurrence:

- it is in contact (``note_contacts``), in a step or in the static equilibrium test;
- of all that shortens a step, it determines the length (``note_step``). An obstacle that would allow a longer step
  determines nothing, and removing it changes nothing;
- it is the nearest of all, and so determines when the obstacles are queried next (``enter``). This alone changes no
bit:
  an obstacle that is not queried is too far away to be touched, or to shorten a step by its distance. But the bound on
  a step beside a stem (``obstacles.time_beside``) is more cautious than the bound on the step itself, so a stem
  slightly farther away than a step's travel can shorten the step if it happens to be queried. Where this is so, or
  could be so for an obstacle that is not queried, all that ever determined the time of a query have mattered
  (``note_all``).

The statement thus holds for one obstacle and for several removed together. For a cloud, all listed obstacles are noted.
One condition: where a step may be longer than the remaining margin of the list (``limits.NEAR_MARGIN``; draft on cells
of more than a metre), at least one obstacle must be left, because a scene without obstacles has no such margin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import inlined, kernel
from .cores import BARRIER
from .limits import NEAR_MARGIN, SAFE

Array = NDArray[np.float64]

# A core near a log; time [s] since its release from which it mattered, infinite as long as it did not
# stage : the last one stored before it was entered (``stages``), -1: none
NOTE = np.dtype([("core", "i8"), ("time", "f8"), ("stage", "i8")])
# Columns of a worker's book: the time now [s], the number of notes, how many of these, the first, have a time;
# the number of stored stages, and the number of notes when the last one was stored
NOW, NOTED, SETTLED, STAGES, KEPT = range(5)
BOOK_WIDTH = 5


class Notes(NamedTuple):
    """What is noted of the present log; without rows where nothing is."""

    place: np.ndarray  # int64 (cores,), each core's place + 1 among the notes, 0: it is not noted
    rows: np.ndarray  # of dtype NOTE, in the order in which they were entered
    book: np.ndarray  # (BOOK_WIDTH,), see NOW, NOTED, ...

    @staticmethod
    def allocate(cores: int) -> Notes:
        return Notes(np.zeros(cores, np.int64), np.zeros(cores, NOTE).view(np.recarray), np.zeros(BOOK_WIDTH))


@dataclass(frozen=True)
class Influences:
    """Obstacles that mattered to logs, ordered by log row, then obstacle; shape (m,) each.

    log_row : int64; by_barrier : bool; item : int64, row of the barrier, or of the tree (lying logs are numbered after
        the trees, boulders after these); time : [s] from which it mattered; it had no effect on the motion before
    """

    log_row: NDArray[np.int64]
    by_barrier: NDArray[np.bool_]
    item: NDArray[np.int64]
    time: Array


def influences_of(tables: dict[int, Any], solid: Any) -> Influences:
    """The notes of the logs as one table; solid : the scene's cores. Of several cores of one owner the earliest time
    counts.
    """
    rows = sorted(tables)
    notes = np.concatenate([np.zeros(0, NOTE), *(tables[row] for row in rows)])
    log_row = np.repeat(np.array(rows, np.int64), [len(tables[row]) for row in rows])
    item, by_barrier = solid["owner"][notes["core"]], solid["kind"][notes["core"]] == BARRIER
    order = np.lexsort([notes["time"], item, by_barrier, log_row])
    log_row, by_barrier, item, time = log_row[order], by_barrier[order], item[order], notes["time"][order]
    same = (np.diff(log_row) == 0) & (np.diff(by_barrier.astype(int)) == 0) & (np.diff(item) == 0)
    first = np.append(True, ~same)[: len(item)]
    return Influences(log_row[first], by_barrier[first], item[first].astype(np.int64), time[first])


@kernel
def open_notes(notes):
    """Clear the notes of the previous log."""
    for k in range(int(notes.book[NOTED])):
        notes.place[notes.rows[k].core] = 0
    notes.book[:] = 0.0


@kernel
def copy_notes(notes, kept, used):
    """Append the notes of what mattered to the first ``used`` stored ones, if there is room; returns their number."""
    number = 0
    for k in range(int(notes.book[NOTED])):
        if notes.rows[k].time < math.inf:
            if used + number < kept.shape[0]:
                kept[used + number] = notes.rows[k]
            number += 1
    return number


@kernel
def enter(notes, core):
    """Enter the core of this row, which has not mattered yet."""
    if notes.place[core] == 0:
        k = int(notes.book[NOTED])
        row = notes.rows[k]
        row.core, row.time, row.stage = core, math.inf, int(notes.book[STAGES]) - 1
        notes.book[NOTED] = k + 1.0
        notes.place[core] = k + 1


@kernel
def note(notes, core):
    """Record that the core of this row matters, from now on at the latest."""
    enter(notes, core)
    row = notes.rows[notes.place[core] - 1]
    if row.time == math.inf:
        row.time = notes.book[NOW]


@kernel
def note_all(notes):
    """Record that all cores entered so far matter."""
    for k in range(int(notes.book[SETTLED]), int(notes.book[NOTED])):
        if notes.rows[k].time == math.inf:
            notes.rows[k].time = notes.book[NOW]
    notes.book[SETTLED] = notes.book[NOTED]


@kernel
def note_contacts(notes, keys, first, last):
    """Record that the cores of these rows of the contact table matter."""
    for k in range(first, last):
        note(notes, keys[k, 1])


@inlined
def note_step(scratch, travel, decider, limited, unsure):
    """Record what determined the length of a step.

    travel : [m] of a step; decider : the near core that ``time_beside`` names, or -1; limited : whether, without one,
        the bound [m] of a thin or lying obstacle, or that of the list, determined it
    unsure : whether an obstacle that was not queried could have done so
    """
    notes, near = scratch.notes, scratch.near[0]
    if decider >= 0:
        note(notes, scratch.listed[decider])
        unsure = unsure or scratch.near_cores[decider].clear > SAFE * min(travel, near.clear)
    elif limited:
        if near.thin >= 0:
            note(notes, near.thin)
        else:
            unsure = True
    if unsure or travel > 0.5 * NEAR_MARGIN:
        note_all(notes)
