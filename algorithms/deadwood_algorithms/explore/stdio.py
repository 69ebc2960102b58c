"""The session on two pipes: messages come in, one per line; frames go out, each preceded by its length.

The interface for programs: the server of the page and the panel in QGIS start such a process. A request replaces one
that is still being answered, between two batches. The process ends when its input does.
"""

from __future__ import annotations

import contextlib
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from deadwood_algorithms.explore.facts import scene_frame
from deadwood_algorithms.explore.frames import Frame, message_of, refusal
from deadwood_algorithms.explore.kept import Keeper
from deadwood_algorithms.explore.relief import Relief
from deadwood_algorithms.explore.session import Session
from deadwood_algorithms.params.tool import UserError

LENGTH_BYTES = 4  # bytes of the length that precedes a frame
GRACE_S = 2.0  # time for the process to finish its work after the end of its input
MOST_WAITING = 1000  # messages; beyond that the sender has to wait
REPLACED = ("release", "edit")  # by a newer one


class Out:
    """Writes frames one after the other, from whatever thread they come."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream, self.lock = stream, threading.Lock()

    def send(self, frame: Frame) -> None:
        block = frame.packed()
        try:
            with self.lock:
                self.stream.write(len(block).to_bytes(LENGTH_BYTES, "little") + block)
                self.stream.flush()
        except (BrokenPipeError, ValueError):
            os._exit(0)  # no reader is left


def own_stdout() -> Out:
    """Standard output reserved for frames: anything else that prints goes to standard error."""
    sys.stdout.flush()
    stream = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return Out(stream)


@dataclass
class Front:
    """A session, its pipes, and the messages that wait for an answer."""

    session: Session
    relief: Relief
    out: Out
    keeper: Keeper
    waiting: queue.Queue[dict[str, Any] | None] = field(default_factory=lambda: queue.Queue(MOST_WAITING))
    newest: dict[str, int] = field(default_factory=lambda: dict.fromkeys(REPLACED, 0))
    band: dict[str, Any] | None = None  # the newest message that asks for it
    ended: threading.Event = field(default_factory=threading.Event)

    def serve(self, source: BinaryIO) -> None:
        """Answer until the input ends."""
        threading.Thread(target=self._listen, args=(source,), name="messages", daemon=True).start()
        self.out.send(Frame({"op": "ready"}))
        while (message := self.waiting.get()) is not None:
            self._answer(message)

    def _listen(self, source: BinaryIO) -> None:
        with ThreadPoolExecutor(1) as tiles:
            for line in source:
                try:
                    message = message_of(line)
                except UserError as error:
                    self.out.send(refusal(str(error)))
                    continue
                if message.get("op") == "tile":
                    tiles.submit(self._guarded, self._tile, message)
                    continue
                if message.get("op") in REPLACED:
                    self.newest[message["op"]] += 1
                if message.get("op") == "band":
                    self.band = message
                message["turn"] = dict(self.newest)
                try:
                    self.waiting.put_nowait(message)
                except queue.Full:
                    self.out.send(refusal("too many requests at once; wait for the answers", message))
            self.ended.set()
            tiles.shutdown(wait=False, cancel_futures=True)
            self.waiting.put(None)
            threading.Timer(GRACE_S, os._exit, (0,)).start()

    def _answer(self, message: dict[str, Any]) -> None:
        self._guarded(self._do, message)

    def _guarded(self, work: Callable[[dict[str, Any]], None], message: dict[str, Any]) -> None:
        """A wrong message is reported; so is a bug of the toolbox, and the engine continues."""
        try:
            work(message)
        except UserError as error:
            self.out.send(refusal(str(error), message))
        except Exception as error:
            traceback.print_exc(file=sys.stderr)
            self.out.send(refusal(f"a bug in the toolbox: {type(error).__name__}; see the terminal", message))

    def _do(self, message: dict[str, Any]) -> None:
        name, turn = message.get("op"), message.get("turn", {})
        send, session = self.out.send, self.session

        def stale() -> bool:
            return self.ended.is_set() or turn != self.newest

        if name == "open":
            send(scene_frame(session.layers, self.relief, session.defaults, session.warnings))
        elif name == "release":
            if turn["release"] == self.newest["release"]:
                session.release(message, send, stale)
        elif name == "edit":
            if turn["edit"] != self.newest["edit"]:
                return  # the newer message contains the complete set
            if turn["release"] == self.newest["release"]:
                session.edit(message, send, stale)
            else:
                session.change(message)  # the logs released next are reported with it
        elif name == "band":
            self._slide_band(message, stale)
        elif name == "poses":
            session.poses(message, send)
        elif name == "keep":
            if session.answer is None:
                raise UserError("no logs have been released yet; click on the map first")
            answer = session.answer
            run_too = message.get("run") is not False
            send(self.keeper.keep(session.layers, answer.question, answer.changes, message.get("name"), run_too))
        else:
            raise UserError("'op' must be open, release, edit, band, poses or keep")

    def _slide_band(self, message: dict[str, Any], stale: Callable[[], bool]) -> None:
        """The band gives way to every other message, and goes on afterwards unless a newer request replaced it."""

        def give_way() -> bool:
            return stale() or not self.waiting.empty()

        if message is self.band and not stale() and not self.session.band(message, self.out.send, give_way):
            with contextlib.suppress(queue.Full):
                self.waiting.put_nowait(message)

    def _tile(self, message: dict[str, Any]) -> None:
        place = [message.get(name) for name in ("level", "column", "row")]
        if any(isinstance(each, bool) or not isinstance(each, int) for each in place):
            raise UserError("'level', 'column' and 'row' must be whole numbers")
        picture = self.relief.tile(*place)  # type: ignore[arg-type]
        frame = Frame({"op": "tile", "id": message.get("id")}, {"png": np.frombuffer(picture, np.uint8)})
        self.out.send(frame)
