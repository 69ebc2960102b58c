"""The one place where logs are slid: once on the scene's window, or until the window is wide enough for all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Cancelled, Feedback, Quiet
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.simulate.batch import Batch, Sliding
from deadwood_algorithms.simulate.scheduler import workers_of
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.windows import wider_scene
from deadwood_engine import Interrupted, Logs, Rasters, Result, Start, slide

Found = TypeVar("Found")


@dataclass(eq=False)  # each is itself alone: two that have counted the same are not one
class Meter:
    """What was slid while it was active: logs, their simulated time [s], processor time of all cores and wall time
    [s].
    """

    logs: int = 0
    cpu_s: float = 0.0
    wall_s: float = 0.0
    durations: list[NDArray[np.float64]] = field(default_factory=list)
    _lock: Lock = field(default_factory=Lock)
    _active: int = 0  # active calls: several threads slide at the same time
    _since: float = 0.0

    @contextmanager
    def clock(self) -> Iterator[None]:
        with self._lock:
            if not self._active:
                self._since = time.perf_counter()
            self._active += 1
        try:
            yield
        finally:
            with self._lock:
                self._active -= 1
                if not self._active:
                    self.wall_s += time.perf_counter() - self._since

    def add(self, result: Result) -> None:
        with self._lock:
            self.logs += result.duration.size
            self.cpu_s += result.cost["cpu_s"]
            self.durations.append(result.duration)

    @property
    def spread(self) -> float:
        """Standard deviation of the simulated time of a log, divided by its mean."""
        run = np.concatenate([np.zeros(0), *self.durations])
        return float(run.std() / run.mean()) if run.any() else 0.0


_meters: list[Meter] = []


@contextmanager
def metered() -> Iterator[Meter]:
    """Measure everything that is slid inside the block."""
    meter = Meter()
    _meters.append(meter)
    try:
        yield meter
    finally:
        _meters.remove(meter)


@contextmanager
def workers_for(where: Where, feedback: Feedback) -> Iterator[None]:
    """Keep the workers of ``--scheduler`` for everything that is slid inside the block; blocks may be nested."""
    with workers_of(where.scheduler, where.workers, where.cores, feedback):
        yield


def slide_once(
    layers: SceneLayers,
    logs: Logs | Start,
    simulation: Simulation,
    report: Callable[[int], bool],
    *,
    keep_poses: NDArray[np.bool_] | None = None,
    rasters: Rasters | None = None,
    inside: NDArray[np.bool_] | None = None,
    influences: bool = False,
    **more: Any,
) -> tuple[Result, list[str]]:
    """Slide the logs with `slide_batch`: all logs of the caller in one batch."""
    batch = Batch(logs, keep_poses, inside)
    return slide_batch(layers, batch, simulation, report, rasters=rasters, influences=influences, **more)


def slide_batch(
    layers: SceneLayers,
    batch: Batch,
    simulation: Simulation,
    report: Callable[[int], bool],
    *,
    rasters: Rasters | None = None,
    later: Iterable[Batch] = (),
    influences: bool = False,
    until_reached: bool = False,
    **more: Any,
) -> tuple[Result, list[str]]:
    """Slide the logs according to the simulation (laws, fidelity, where), on the present window.

    ``report`` is called with the number of logs done, and returns whether to stop. Also returns the sides of the window
    that some log came too close to: if there are any, neither the result nor the rasters may be used.

    ``later`` are the batches needed next, on which the workers of a scheduler may start while a slow log delays this
    one. With ``influences`` the result contains what affected each log, with ``until_reached`` a log ends when it
    has reached every line that it is not ``inside``; more : stages, in the engine's form, which save time and
    change no result; workers do not use them.

    Raises
    ------
    Cancelled
        if the user or ``report`` stopped it
    """
    where, fidelity = simulation.where, simulation.fidelity
    laws = dict(simulation.laws) | ({"until_reached": True} if until_reached else {})

    def anywhere() -> Result:
        with workers_of(where.scheduler, where.workers, where.cores, Quiet()) as workers:
            if workers and len(batch):
                bands = rasters.workers[0].band if rasters else None
                sliding = Sliding(where.name, layers.scene, layers.shape, fidelity, laws, bands, influences)
                return workers.slide(sliding, batch, later, rasters, report)
            return slide(
                layers.scene,
                batch.logs,
                fidelity,
                **laws,
                threads=layers.threads,
                keep_poses=batch.keep,
                rasters=rasters,
                inside=batch.inside,
                report=report,
                shape=layers.shape,
                influences=influences,
                **more,
            )

    with ExitStack() as clocks:
        for meter in _meters:
            clocks.enter_context(meter.clock())
        try:
            result = anywhere()
        except (Interrupted, KeyboardInterrupt) as error:
            raise Cancelled from error
    for meter in _meters:
        meter.add(result)
    sides = layers.escaped(result)
    if not sides:  # otherwise they slide again
        simulation.sinking.add(batch.logs, layers.shape, result.penetration_max)
    return layers.without_watch(result), sides


def until_none_escapes(
    layers: SceneLayers,
    simulation: Simulation,
    slide_all: Callable[[SceneLayers], tuple[Found, list[str]]],
    feedback: Feedback,
) -> tuple[Found, SceneLayers]:
    """The result of ``slide_all`` on a window whose sides no log comes too close to, and the scene on that window."""
    while True:
        found, sides = slide_all(layers)
        if not sides:
            return found, layers
        layers = wider_scene(simulation, layers, sides, feedback)


def reporter(feedback: Feedback, total: int, what: str, *, before: int = 0) -> Callable[[int], bool]:
    """The callback for the engine: it gets the number of logs done, of ``total``, of which ``before`` were done
    earlier.
    """

    def report(done: int) -> bool:
        feedback.progress(before + done, total, what)
        return feedback.cancelled()

    return report
