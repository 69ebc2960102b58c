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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
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
def open_notes(noted, notes, book):
    """Clear the notes of the previous log."""
    for k in range(int(book[NOTED])):
        noted[notes[k].core] = 0
    book[:] = 0.0


@kernel
def copy_notes(notes, book, kept, used):
    """Append the notes of what mattered to the first ``used`` stored ones, if there is room; returns their number."""
    number = 0
    for k in range(int(book[NOTED])):
        if notes[k].time < math.inf:
            if used + number < kept.shape[0]:
                kept[used + number] = notes[k]
            number += 1
    return number


@kernel
def enter(noted, notes, book, row):
    """Enter a core that has not mattered yet; noted : place + 1 of each core among the notes, 0 where it is not."""
    if noted[row] == 0:
        k = int(book[NOTED])
        notes[k].core, notes[k].time, notes[k].stage = row, math.inf, int(book[STAGES]) - 1
        book[NOTED] = k + 1.0
        noted[row] = k + 1


@kernel
def note(noted, notes, book, row):
    """Record that a core matters, from now on at the latest."""
    enter(noted, notes, book, row)
    k = noted[row] - 1
    if notes[k].time == math.inf:
        notes[k].time = book[NOW]


@kernel
def note_all(notes, book):
    """Record that all cores entered so far matter."""
    for k in range(int(book[SETTLED]), int(book[NOTED])):
        if notes[k].time == math.inf:
            notes[k].time = book[NOW]
    book[SETTLED] = book[NOTED]


@kernel
def note_contacts(noted, notes, book, keys, first, last):
    """Record that the cores of these rows of the contact table matter."""
    for k in range(first, last):
        note(noted, notes, book, keys[k, 1])


@kernel
def note_step(noted, notes, book, listed, near_cores, near, travel, decider, limited, unsure):
    """Record what determined the length of a step.

    travel : [m] of a step; decider : the near core that ``time_beside`` names, or -1; limited : whether, without one,
        the bound [m] of a thin or lying obstacle, or that of the list, determined it
    unsure : whether an obstacle that was not queried could have done so
    """
    if decider >= 0:
        note(noted, notes, book, listed[decider])
        unsure = unsure or near_cores[decider].clear > SAFE * min(travel, near.clear)
    elif limited:
        if near.thin >= 0:
            note(noted, notes, book, near.thin)
        else:
            unsure = True
    if unsure or travel > 0.5 * NEAR_MARGIN:
        note_all(notes, book)
