"""Logs slid by the workers of a Dask scheduler: pieces of the work are sent out, results come back, with the same bits
as here.

Dask provides messages, scheduling and the list of workers; `crew` decides which of them may be used. This module
decides the size of a piece. It keeps few pieces out at a time, so that a worker added late is soon used and a slow log
at the end delays nobody, and sends the piece of a dead worker again.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import queue
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import VERSION, Feedback, UserError
from deadwood_algorithms.simulate import piece as on_worker
from deadwood_algorithms.simulate.batch import Batch, Sliding
from deadwood_algorithms.simulate.crew import Carried, Crew, NobodySlides, SentScene, gone_for_a_while
from deadwood_algorithms.simulate.joined import joined_results
from deadwood_algorithms.simulate.packed import block_of, digest_of_block
from deadwood_algorithms.simulate.sparse import add_sparse
from deadwood_engine import Interrupted, Rasters, Result, Start, place_logs

# Target duration of a piece, long compared with the milliseconds that Dask needs; and the minimum, at the end of a run.
PIECE_S, LEAST_PIECE_S = 1.0, 0.02
FIRST_PIECE, MOST_A_PIECE = 8, 512  # logs, before the time of one is known, and at most
OUT_PER_THREAD = 2  # pieces: one being computed, one waiting
MOST_WAITING = 8192  # logs done ahead of a batch that a slow log delays: their results are kept in memory
WAIT_S = 60.0  # for a worker, before their absence is reported
MOST_TRIES = 6  # of a piece; each try means one or more dead workers


@dataclass
class _Job:
    """A batch in progress: rows up to ``given`` are out or done."""

    digest: str
    batch: Batch
    sliding: Sliding
    sent: SentScene
    start: Start
    given: int = 0
    done: int = 0
    answers: dict[int, tuple[Result, dict[str, NDArray]]] = field(default_factory=dict)

    @property
    def total(self) -> int:
        return len(self.batch)


@dataclass
class _Piece:
    """Rows of a job that are out."""

    job: _Job
    rows: slice
    tries: int = 0
    order: str = ""  # its digest
    workers: frozenset[str] = frozenset()
    future: Any = None

    @property
    def words(self) -> str:
        first = self.job.batch.first
        return f"logs {first + self.rows.start} to {first + self.rows.stop - 1}"


class Workers:
    """The workers of one scheduler, for as many calls of `slide` as there are."""

    def __init__(self, client: Any, where: str, feedback: Feedback, *, wanted: int = 1) -> None:
        self.client, self.where, self.feedback, self.wanted = client, where, feedback, wanted
        self.crew = Crew(client, where, feedback)
        self._jobs: dict[str, _Job] = {}
        self._out: dict[Any, _Piece] = {}  # by the future's key
        self._again: list[_Piece] = []
        self._news: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._numbers = itertools.count()  # numbers of what was sent
        self._heard = -math.inf
        self._pace: tuple[float, int] = (0.0, 0)  # CPU seconds, logs

    @property
    def carried(self) -> Carried:
        return self.crew.carried

    def slide(
        self,
        sliding: Sliding,
        batch: Batch,
        later: Iterable[Batch],
        rasters: Rasters | None,
        report: Callable[[int], bool],
    ) -> Result:
        """Slide a batch like the engine's ``slide``, and meanwhile start on the batches that come ``later`` in the
        same sliding.

        Raises
        ------
        Interrupted
            if ``report`` requested to stop
        UserError
            if the scheduler is lost, or no worker can be used
        """
        try:
            self._drop_all_but(sliding)  # first: a dropped job, started ahead, may have pieces out
            job = self._job(sliding, batch)
            self._jobs[job.digest] = job
            ahead = iter(later)
            while True:
                if report(job.done):  # also for what was done ahead
                    raise Interrupted
                if job.done == job.total:
                    break
                self.crew.meet(job.sent)
                for piece in [each for each in self._out.values() if not each.workers & set(self.crew.good)]:
                    self._send_again(piece)
                self._give_out(job, sliding, ahead)
                self._take_in(0.2)
        except BaseException:
            self.drop()
            raise
        del self._jobs[job.digest]
        answers = [job.answers[first] for first in sorted(job.answers)]
        if rasters:
            for _, cells in answers:
                add_sparse(rasters, cells)
        self.carried.logs += job.total
        return joined_results([result for result, _ in answers])

    def drop(self) -> None:
        """Forget everything that is out."""
        futures = [each.future for each in self._out.values()]
        self._out.clear()
        self._again.clear()
        self._jobs.clear()
        self._cancel(futures)

    def _cancel(self, futures: list[Any]) -> None:
        if futures and self.client.status == "running":
            with suppress(OSError):
                self.client.cancel(futures, force=True)

    def close(self) -> None:
        self.drop()
        self.crew.close()

    def _drop_all_but(self, sliding: Sliding) -> None:
        """Drop what was started of other work, or of a scene that has grown since."""
        if any(not _is_same(each.sliding, sliding) for each in self._jobs.values()):
            self.drop()

    def _job(self, sliding: Sliding, batch: Batch) -> _Job:
        """The batch as a job: the one that was started ahead, or a new one."""
        sent = self.crew.scene_of(sliding)
        digest = hashlib.sha256(sent.digest.encode())
        said = [sliding.name, *sliding.fidelity, sliding.laws, sliding.influences, batch.first]
        said.append([(number, missing.tolist()) for number, missing in batch.missing])
        digest.update(json.dumps(said, sort_keys=True).encode())
        for each in (*vars(batch.logs).values(), batch.keep, batch.inside, sliding.bands):
            digest.update(b"none" if each is None else np.ascontiguousarray(each).tobytes())
        name = digest.hexdigest()
        if name in self._jobs:
            return self._jobs[name]
        # Placed here, because numpy's sines and cosines of arrays depend on the processor
        logs = batch.logs
        start = logs if isinstance(logs, Start) else place_logs(sliding.scene, logs, sliding.shape)
        return _Job(name, batch, sliding, sent, start)

    def _give_out(self, job: _Job, sliding: Sliding, ahead: Iterator[Batch]) -> None:
        """Send pieces until no thread waits; first those that came back, then the job's own."""
        threads, ready = self.crew.threads, self.crew.ready(job.sent)
        if not ready or (len(self.crew.good) < self.wanted and not self._out and job.done == 0):
            self._wait_for_workers()
            return
        self._heard, self.wanted = -math.inf, 1
        while len(self._out) < OUT_PER_THREAD * threads:
            piece = self._again.pop() if self._again else self._next_piece(job, sliding, ahead, threads)
            if piece is None:
                return
            self._send(piece, ready)

    def _wait_for_workers(self) -> None:
        """Wait while no worker can be used, for a limited time."""
        now = time.monotonic()
        if self.crew.looking:  # it may be compiling the engine, which takes minutes
            self._heard = now
        if self._heard == -math.inf:
            self._heard = now
        hopeless = self.crew.refused and not self.crew.good and not self._pace[1]
        if now - self._heard <= (0.0 if hopeless else WAIT_S):
            return
        if self.crew.good and self.wanted > 1:
            self.feedback.warn(
                f"--workers {self.wanted}: only {len(self.crew.good)} have connected; the run begins with them"
            )
            self.wanted = 1
            return
        why = next(iter(self.crew.refused.values()), "none has come; start one: dask worker ADDRESS-OF-THE-SCHEDULER")
        raise NobodySlides(f"--scheduler {self.where}: no worker can be used: {why}")

    def _next_piece(self, job: _Job, sliding: Sliding, ahead: Iterator[Batch], threads: int) -> _Piece | None:
        """The next piece of the job, then of jobs started ahead, then of a new one."""
        each = next((one for one in [job, *self._jobs.values()] if one.given < one.total), None)
        while each is None:
            waiting = sum(one.done for one in self._jobs.values() if one is not job)
            batch = next(ahead, None) if waiting < MOST_WAITING else None
            if batch is None:
                return None
            new = self._job(sliding, batch)
            if new.digest not in self._jobs:  # otherwise an earlier call has started it
                self._jobs[new.digest] = each = new
        seconds, logs = self._pace
        # of the remainder of the run, not only of this batch
        left = max(each.total, each.batch.goal - each.batch.first) - each.given
        size = piece_size(left, threads, seconds / logs if logs else None)
        rows = slice(each.given, min(each.given + size, each.total))
        each.given = rows.stop
        return _Piece(each, rows)

    def _send(self, piece: _Piece, ready: frozenset[str]) -> None:
        job, rows = piece.job, piece.rows
        sliding, batch, lines = job.sliding, job.batch, job.sliding.scene.line_count
        number = rows.stop - rows.start
        facts = {
            "version": VERSION,
            "engine": engine_digest(),
            "scene": job.sent.digest,
            "fidelity": [float(each) for each in sliding.fidelity],
            "laws": sliding.laws,
            "rasters": sliding.bands is not None,
            "influences": sliding.influences,
            "missing": missing_in(batch, rows),
        }
        arrays = [
            job.start.frame[rows],
            job.start.state[rows],
            job.start.body[rows],
            np.zeros(number, np.bool_) if batch.keep is None else batch.keep[rows],
            np.zeros((number, lines), np.bool_) if batch.inside is None else batch.inside[rows],
            np.zeros(0, np.int64) if sliding.bands is None else sliding.bands,
        ]
        order = block_of(facts, arrays)
        piece.order, piece.workers = digest_of_block(order), ready
        scene, *large = self.crew.futures_of(job.sent)
        attempt = f", try {piece.tries + 1}" if piece.tries else ""
        piece.future = self.client.submit(
            on_worker.slide_piece,
            order,
            scene,
            large,
            # Never use a key twice: a cancelled one may still be in progress
            key=f"{sliding.name}-{piece.words} ({job.digest[:16]}{attempt}, {next(self._numbers)})",
            workers=sorted(ready),
            allow_other_workers=False,
            pure=False,
            priority=-batch.first,
        )
        self.carried.orders += len(order)
        self._out[piece.future.key] = piece
        self.client.loop.add_callback(self._fetch, piece.future)

    def _send_again(self, piece: _Piece) -> None:
        """Queue a piece again whose workers are gone, or whose scene is lost with them."""
        self._out.pop(piece.future.key, None)
        self._cancel([piece.future])
        piece.tries += 1
        if piece.tries >= MOST_TRIES:
            raise UserError(
                f"--scheduler {self.where}: the workers of {piece.words} died {piece.tries} times; check their "
                "messages, and whether they have enough memory for the scene"
            )
        self._again.append(piece)

    async def _fetch(self, future: Any) -> None:
        """On the client's own loop, wait for a piece, fetch its result, and report it."""
        try:
            answer = await self.client.gather(future, asynchronous=True)
        except Exception as error:
            answer = error
        self._news.put((future.key, answer))

    def _take_in(self, patience: float) -> None:
        """Process the results that have come back since."""
        news = []
        with suppress(queue.Empty):
            news.append(self._news.get(timeout=patience))
            while True:
                news.append(self._news.get_nowait())
        for key, answer in news:
            if key in self._out:
                self._settle(self._out[key], answer)

    def _settle(self, piece: _Piece, answer: bytes | Exception) -> None:
        if isinstance(answer, Exception):
            if not isinstance(answer, gone_for_a_while()):
                raise answer
            self.crew.lose(piece.job.sent)
            self._send_again(piece)
            return
        del self._out[piece.future.key]
        result, cells = on_worker.answer_of(answer, piece.order)
        self.carried.answers += len(answer)
        piece.job.answers[piece.rows.start] = result, cells
        number = piece.rows.stop - piece.rows.start
        piece.job.done += number
        self._pace = self._pace[0] + result.cost["cpu_s"], self._pace[1] + number


def missing_in(batch: Batch, rows: slice) -> list[tuple[int, list[int]]]:
    """``Batch.missing`` for some rows of the batch."""
    first, found = 0, []
    for number, missing in batch.missing:
        mine = min(first + number, rows.stop) - max(first, rows.start)
        if mine > 0:
            found.append((mine, missing.tolist()))
        first += number
    return found


def piece_size(left: int, threads: int, each_s: float | None) -> int:
    """How many of the remaining logs to send next, given the time of one [s], if known.

    Pieces are long compared with the cost of sending them, and shorter towards the end, where all wait for the last: a
    log that takes a hundred times as long as others then delays few of them.
    """
    size, least = FIRST_PIECE, 1
    if each_s is not None:
        size, least = (max(1, int(wanted / max(each_s, 1e-9))) for wanted in (PIECE_S, LEAST_PIECE_S))
    return max(min(size, MOST_A_PIECE, math.ceil(left / (2 * threads))), least)


def _is_same(one: Sliding, other: Sliding) -> bool:
    mine, yours = ((each.name, tuple(each.fidelity), each.laws, each.influences) for each in (one, other))
    return one.scene is other.scene and one.shape is other.shape and mine == yours
