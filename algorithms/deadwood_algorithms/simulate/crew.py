"""The workers of a Dask scheduler that may slide logs: those with this engine that compute this machine's bits, and the
scenes that each of them has.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import Any

from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import VERSION, Feedback, UserError
from deadwood_algorithms.simulate import piece as on_worker
from deadwood_algorithms.simulate.batch import Sliding
from deadwood_algorithms.simulate.packed import digest_of_block, from_block
from deadwood_engine import Scene, Shape

LOOK_EVERY_S = 1.0  # between two checks of the workers
LOST_S = 20.0  # without a word from the scheduler, before it counts as lost


class NobodySlides(UserError):
    """The scheduler is lost, or none of its workers can be used for any work."""


@dataclass
class SentScene:
    """A scene as stored on the workers."""

    scene: Scene
    shape: Shape | None
    block: bytes
    large: dict[str, NDArray]
    digest: str

    @property
    def parts(self) -> dict[str, Any]:
        """All parts by their names on the scheduler, the block first."""
        named = {f"deadwood-scene-{digest[:32]}": array for digest, array in self.large.items()}
        return {f"deadwood-scene-{self.digest[:32]}": self.block, **named}


@dataclass
class _Lying:
    """A part of a scene on the scheduler, and the workers that have it."""

    future: Any = None
    at: set[str] = field(default_factory=set)


@dataclass
class Carried:
    """Network traffic [bytes]: orders and answers, and scenes sent to each worker; and the number of logs."""

    orders: int = 0
    answers: int = 0
    scenes: int = 0
    logs: int = 0


class Crew:
    """The workers of one scheduler that may be used, and what lies on them."""

    def __init__(self, client: Any, where: str, feedback: Feedback) -> None:
        self.client, self.where, self.feedback = client, where, feedback
        self.good: dict[str, int] = {}  # threads by address
        self.refused: dict[str, str] = {}  # why, by address
        self.looking: dict[str, Any] = {}  # futures of tests, by address
        self.carried = Carried()
        self._sent: list[SentScene] = []
        self._lying: dict[str, _Lying] = {}  # parts of these scenes
        self._looked = -math.inf
        self._bits = from_block(on_worker.look(VERSION, engine_digest()))[0]["bits"]

    @property
    def threads(self) -> int:
        return sum(self.good.values())

    def ready(self, sent: SentScene) -> frozenset[str]:
        """The workers that have the whole scene."""
        return frozenset(self.good).intersection(*(self._lying[name].at for name in sent.parts))

    def futures_of(self, sent: SentScene) -> list[Any]:
        """The scene's parts on the scheduler, the block first."""
        return [self._lying[name].future for name in sent.parts]

    def lose(self, sent: SentScene) -> None:
        """Send the scene again to all, because it may be lost with the workers that had it; check these at once."""
        for name in sent.parts:
            self._lying[name].at.clear()
        self._looked = -math.inf

    def close(self) -> None:
        for future in self.looking.values():
            future.release()
        self.looking.clear()
        self._sent.clear()
        self._lying.clear()

    def scene_of(self, sliding: Sliding) -> SentScene:
        """The scene of this work, packed for the workers; the last three are kept."""
        for each in self._sent:
            if each.scene is sliding.scene and each.shape is sliding.shape:
                return each
        scene = sliding.scene
        if sliding.shape:  # as the engine does
            scene = replace(scene, arrays=scene.arrays._replace(cloud=sliding.shape.cloud))
        block, large = on_worker.packed_scene(scene)
        self._sent = [*self._sent[-2:], SentScene(sliding.scene, sliding.shape, block, large, digest_of_block(block))]
        wanted = {name for each in self._sent for name in each.parts}
        self._lying = {name: self._lying.get(name, _Lying()) for name in wanted}
        return self._sent[-1]

    def meet(self, sent: SentScene) -> None:
        """Check the workers: forget those that are gone, test new ones, and send them the scene."""
        if time.monotonic() - self._looked < LOOK_EVERY_S and not self.looking:
            return
        self._looked = time.monotonic()
        there = self._addresses()
        for address in set(self.good) - set(there):
            del self.good[address]
            self.feedback.note(f"--scheduler: the worker {address} was lost; its work is sent out again")
            for each in self._lying.values():
                each.at.discard(address)
        for address in set(there) - {*self.good, *self.refused, *self.looking}:
            name = f"deadwood-toolbox-look at {address} ({self.client.id})"
            self.looking[address] = self.client.submit(
                on_worker.look, VERSION, engine_digest(), key=name, workers=[address], pure=False, priority=10
            )
        for address, future in list(self.looking.items()):
            if address not in there or future.status in ("cancelled", "lost"):
                future.release()
                del self.looking[address]
            elif future.status != "pending":
                del self.looking[address]
                self._judge(address, there[address], future)
        self._hand_over(sent)

    def _addresses(self) -> dict[str, int]:
        """Threads of each worker by its address, as reported by the scheduler."""
        since = time.monotonic()
        while True:
            try:
                if self.client.status == "running":
                    found = self.client.sync(self.client.scheduler.identity, callback_timeout=LOST_S)["workers"]
                    return {address: int(facts["nthreads"]) for address, facts in found.items()}
            except (OSError, TimeoutError):
                pass
            if time.monotonic() - since > LOST_S or self.client.status in ("closed", "closing"):
                raise NobodySlides(f"--scheduler {self.where}: the scheduler is lost; start it again")
            time.sleep(0.2)

    def _judge(self, address: str, threads: int, future: Any) -> None:
        """Whether a worker may be used; why not is reported once."""
        fix = f"install deadwood-toolbox {VERSION} on both sides, from the same source"
        try:
            facts = from_block(future.result(timeout=LOST_S))[0]
        except (*gone_for_a_while(), TimeoutError):
            return  # it is checked again if it is still there
        except Exception as error:
            said = (str(error).splitlines() or [""])[0]
            why = f"it has no deadwood-toolbox {VERSION} ({type(error).__name__}: {said}); {fix}"
        else:
            ours = {"version": VERSION, "engine": engine_digest(), "bits": self._bits}
            if facts == ours:
                self.good[address] = threads
                self.feedback.note(f"--scheduler: the worker {address} ({counted(threads, 'thread')}) joins")
                return
            if (facts["version"], facts["engine"]) != (VERSION, engine_digest()):
                why = f"it has engine {facts['engine']}, version {facts['version']}; here it is engine "
                why += f"{engine_digest()}, version {VERSION}; {fix}"
            else:
                why = "the same engine gives other bits on its processor or system library than here, and two must not "
                why += "mix in one result; take workers like this machine, or start the run on a machine like them"
        self.refused[address] = why
        self.feedback.warn(f"--scheduler: the worker {address} is not used: {why}")

    def _hand_over(self, sent: SentScene) -> None:
        """Send a scene to the workers that may be used: to each the parts that it lacks, once."""
        lacking: dict[frozenset[str], dict[str, Any]] = {}
        for name, part in sent.parts.items():
            to = frozenset(set(self.good) - self._lying[name].at)
            lacking.setdefault(to, {})[name] = part
        for to, parts in lacking.items():
            if not to:
                continue
            try:
                futures = self.client.scatter(parts, workers=sorted(to), broadcast=True, hash=False)
            except (OSError, TimeoutError, ValueError, KeyError):  # one of them has gone, which the next check finds
                return
            for name, future in futures.items():
                self._lying[name].future = future
                self._lying[name].at |= to
            self.carried.scenes += len(to) * sum(len(p) if isinstance(p, bytes) else p.nbytes for p in parts.values())


def gone_for_a_while() -> tuple[type[Exception], ...]:
    """Whether a piece failed because its worker, scene or scheduler is gone, so that it is sent again."""
    from distributed.client import FutureCancelledError
    from distributed.scheduler import KilledWorker

    return KilledWorker, FutureCancelledError, on_worker.WrongScene, OSError
