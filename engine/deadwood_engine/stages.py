"""Stages: checkpoints of the complete state of a log, from which it can be slid again without an obstacle.

Up to the step in which an obstacle is first queried as the nearest, or first matters (``influence.enter``), the motion
of a log is the same as without it, and so is the knowledge of its surroundings, except for the obstacle's place in the
near list. Every few steps a stage therefore overwrites the previous one, unless an obstacle has been entered since: the
previous one is then kept for that obstacle. Continuing from it in the scene without the obstacle gives the same bits as
from the release (``tests/engine/test_stages.py``), except for what came before: poses, and hits.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import cores
from .compiled import kernel
from .contacts import KEY_WIDTH, OLD_CONTACT
from .cores import BARRIER
from .influence import KEPT, NOTE, NOTED, STAGES
from .limits import NEAR_MARGIN, REST_WINDOW, STAGE_BYTES, STAGE_CONTACTS
from .log_body import BASE_RADIUS
from .rocking import ROCKING_WIDTH, WINDOWS
from .rolling import ROLLING
from .rotation import STATE_WIDTH
from .surroundings import NEAR
from .trace import MEMORY_WIDTH
from .way import SUMMARY, WAY

Numbers = NDArray[np.int64]


class StageTable(NamedTuple):
    """Stages, a row each; as in ``scratch.Scratch``, the state and summary of a log, and its marks (``trace.Marks``).

    contact_rows, core_rows : int64 (n, 2), first row and the one after the last in keys and contacts, the loaded
        contacts of the previous step, and in listed and beside, the near cores; beside : along, room, clear of each
    """

    state: np.ndarray
    way: np.ndarray
    near: np.ndarray
    rolling: np.ndarray
    memory: np.ndarray
    rest: np.ndarray
    rocking: np.ndarray
    summary: np.ndarray
    lines: np.ndarray
    line_time: np.ndarray
    fences: np.ndarray
    crossed: np.ndarray
    contact_rows: np.ndarray
    core_rows: np.ndarray
    keys: np.ndarray
    contacts: np.ndarray
    listed: np.ndarray
    beside: np.ndarray

    @staticmethod
    def allocate(number: int, lines: int, barriers: int) -> StageTable:
        """Allocate memory for this number of stages of one log."""
        few = number * STAGE_CONTACTS
        return StageTable(
            np.zeros((number, STATE_WIDTH)),
            np.zeros(number, WAY).view(np.recarray),
            np.zeros(number, NEAR).view(np.recarray),
            np.zeros(number, ROLLING).view(np.recarray),
            np.zeros((number, MEMORY_WIDTH)),
            np.zeros((number, MEMORY_WIDTH)),
            np.zeros((number, WINDOWS, ROCKING_WIDTH)),
            np.zeros(number, SUMMARY).view(np.recarray),
            np.zeros((number, lines), np.bool_),
            np.zeros((number, lines)),
            np.zeros((number, barriers), np.bool_),
            np.zeros((number, barriers), np.bool_),
            np.zeros((number, 2), np.int64),
            np.zeros((number, 2), np.int64),
            np.zeros((few, KEY_WIDTH), np.int64),
            np.zeros(few, OLD_CONTACT).view(np.recarray),
            np.zeros(few, np.int64),
            np.zeros((few, 3)),
        )

    def first(self, number: int) -> StageTable:
        """A copy of the first stages."""
        ends = {"keys": self.contact_rows, "contacts": self.contact_rows, "listed": self.core_rows}
        ends["beside"] = self.core_rows
        last = {name: int(rows[number - 1, 1]) if number else 0 for name, rows in ends.items()}
        return StageTable(*(getattr(self, name)[: last.get(name, number)].copy() for name in self._fields))

    @staticmethod
    def joined(tables: list[StageTable]) -> StageTable:
        moved, contacts, listed = [], 0, 0
        for each in tables:
            moved.append(each._replace(contact_rows=each.contact_rows + contacts, core_rows=each.core_rows + listed))
            contacts, listed = contacts + len(each.contacts), listed + len(each.listed)
        return StageTable(
            *(
                part[0] if len(part) == 1 else np.concatenate(part).view(type(part[0]))
                for part in zip(*moved, strict=True)
            )
        )

    @property
    def bytes(self) -> int:
        return sum(each.nbytes for each in self)


@dataclass
class Stages:
    """What ``slide`` stores of a run with ``influences``, and continues from.

    table : the stages of all logs; log, owner, stage : for each log and entered obstacle the row of the table
        from which the log can be continued without it, -1: from its release; owner as ``number_of``; sorted by it
    """

    table: StageTable = field(default_factory=lambda: StageTable.allocate(0, 0, 0))
    log: Numbers = field(default_factory=lambda: np.zeros(0, np.int64))
    owner: Numbers = field(default_factory=lambda: np.zeros(0, np.int64))
    stage: Numbers = field(default_factory=lambda: np.zeros(0, np.int64))

    def before(self, logs: Numbers, gone: Numbers) -> Numbers:
        """For each log the row of the stage from which it can be continued without these obstacles, -1: from its
        release.
        """
        gone = np.unique(gone)
        first, last = (np.searchsorted(self.owner, gone, side=side) for side in ("left", "right"))
        rows = np.concatenate([np.zeros(0, np.int64), *(np.arange(a, b) for a, b in zip(first, last, strict=True))])
        order = np.argsort(logs, kind="stable")
        place = np.minimum(np.searchsorted(logs, self.log[rows], sorter=order), len(logs) - 1)
        mine = logs[order[place]] == self.log[rows]
        none = np.iinfo(np.int64).max
        found = np.full(len(logs), none)
        np.minimum.at(found, order[place[mine]], self.stage[rows[mine]])
        return np.where(found == none, -1, found)


def number_of(by_barrier: Any, item: Any) -> Any:
    """One number per obstacle: negative for barriers."""
    return np.where(by_barrier, -1 - item, item)


class StageKeeper:
    """Collects the stages of logs, in any order of completion."""

    def __init__(self) -> None:
        self.tables: dict[int, StageTable] = {}
        self.entered: dict[int, Any] = {}
        self.bytes = 0

    def add(self, row: int, room: StageTable, notes: Any, number: int) -> None:
        """Add those of the log of this row, when it is done; beyond the limit, logs continue from their release."""
        entered = notes[:number].copy()
        table = room.first(int(entered["stage"].max(initial=-1)) + 1)
        self.bytes += table.bytes
        if self.bytes > STAGE_BYTES:
            entered["stage"] = -1
            table = room.first(0)
        self.tables[row], self.entered[row] = table, entered

    def fill(self, stages: Stages, solid: Any) -> None:
        """solid : the scene's cores"""
        rows = sorted(self.tables)
        sizes = [len(self.tables[row].state) for row in rows]
        notes = [self.entered[row] for row in rows]
        counts = [len(each) for each in notes]
        all_notes = np.concatenate([np.zeros(0, NOTE), *notes])
        firsts = np.repeat(np.cumsum([0, *sizes])[:-1], counts).astype(np.int64)
        owner = number_of(solid["kind"][all_notes["core"]] == BARRIER, solid["owner"][all_notes["core"]])
        order = np.argsort(owner, kind="stable")
        stages.log = np.repeat(np.array(rows, np.int64), counts)[order]
        stages.owner = owner[order].astype(np.int64)
        stages.stage = np.where(all_notes["stage"] < 0, -1, all_notes["stage"] + firsts)[order]
        if rows:
            stages.table = StageTable.joined([self.tables.pop(row) for row in rows])


@kernel
def _copy(values, place):
    """Copy the values of one array into another."""
    for k in range(values.shape[0]):
        place[k] = values[k]


@kernel
def keep_stage(stages, scratch, state, summary, marks, travel):
    """Store the present stage of the log, at the beginning of a step, over the previous one if that is not needed.

    Not if a thin obstacle bounds the next step [m], but was not entered: without it the predicted path would differ.
    """
    book, near, way = scratch.notes.book, scratch.near[0], scratch.way[0]
    if way.travel < travel:
        looked = way.next_look == way.time + REST_WINDOW  # the thin obstacle is then that of the test for rest
        if looked or (near.thin >= 0 and scratch.notes.place[near.thin] == 0):
            return
    more = book[STAGES] == 0.0 or book[NOTED] > book[KEPT]
    row = int(book[STAGES]) - (0 if more else 1)
    if row >= stages.state.shape[0]:
        return
    contact = stages.contact_rows[row - 1, 1] if row > 0 else 0
    core = stages.core_rows[row - 1, 1] if row > 0 else 0
    if contact + way.old_count > stages.contacts.shape[0] or core + near.cores > stages.listed.shape[0]:
        return
    stages.way[row], stages.near[row], stages.rolling[row] = way, near, scratch.rolling[0]
    stages.summary[row] = summary
    _copy(state, stages.state[row])
    _copy(scratch.memory, stages.memory[row])
    _copy(scratch.rest, stages.rest[row])
    for window in range(WINDOWS):
        _copy(scratch.rocking[window], stages.rocking[row, window])
    _copy(marks.lines, stages.lines[row])
    _copy(marks.line_time, stages.line_time[row])
    _copy(marks.fences, stages.fences[row])
    _copy(marks.crossed, stages.crossed[row])
    for k in range(way.old_count):
        stages.contacts[contact + k] = scratch.old_contacts[k]
        _copy(scratch.old_keys[k], stages.keys[contact + k])
    for k in range(near.cores):
        each = scratch.near_cores[k]
        stages.listed[core + k] = scratch.listed[k]
        beside = stages.beside[core + k]
        beside[0], beside[1], beside[2] = each.along, each.room, each.clear
    stages.contact_rows[row, 0], stages.contact_rows[row, 1] = contact, contact + way.old_count
    stages.core_rows[row, 0], stages.core_rows[row, 1] = core, core + near.cores
    book[KEPT] = book[NOTED]
    book[STAGES] = row + 1.0


@kernel
def go_on(stage, model, log, state, scratch, marks):
    """Restore everything from a stage (table, row). The near list is made again, without removed obstacles, for the
    place where it was made.
    """
    stages, row = stage
    scratch.way[0], scratch.near[0], scratch.rolling[0] = stages.way[row], stages.near[row], stages.rolling[row]
    _copy(stages.state[row], state)
    _copy(stages.memory[row], scratch.memory)
    _copy(stages.rest[row], scratch.rest)
    for window in range(WINDOWS):
        _copy(stages.rocking[row, window], scratch.rocking[window])
    _copy(stages.lines[row], marks.lines)
    _copy(stages.line_time[row], marks.line_time)
    _copy(stages.fences[row], marks.fences)
    _copy(stages.crossed[row], marks.crossed)
    way, near = scratch.way[0], scratch.near[0]
    way.kept = 0
    first = stages.contact_rows[row, 0]
    for k in range(way.old_count):
        scratch.old_contacts[k] = stages.contacts[first + k]
        _copy(stages.keys[first + k], scratch.old_keys[k])
    if near.cores == 0:
        return
    looked_at = near.beside > 0
    axis, reach = ((near.base_x, near.base_y), (near.tip_x, near.tip_y)), log.body[BASE_RADIUS] + NEAR_MARGIN
    near.cores = cores.near(model.cores, log.frame, model.terrain.cell, scratch.listed, scratch.near_cores, axis, reach)
    near.beside = near.cores if looked_at else 0
    first, last = stages.core_rows[row, 0], stages.core_rows[row, 1]
    for k in range(near.cores):
        while first < last and stages.listed[first] < scratch.listed[k]:  # both are ascending
            first += 1
        each, beside = scratch.near_cores[k], stages.beside[first]
        each.along, each.room, each.clear = beside[0], beside[1], beside[2]


@kernel
def all_reached(marks):
    """Whether a log has touched every line that it did not start within."""
    reached = True
    for line in range(marks.lines.shape[0]):
        reached = reached and (marks.lines[line] or marks.inside[line])
    return reached
