"""The one place where logs are slid: once on the scene's window, or until the window is wide enough for all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Cancelled, Feedback, Quiet
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.released_scene import ReleasedScene, threads_of
from deadwood_algorithms.simulate.batch import Batch, Sliding
from deadwood_algorithms.simulate.scheduler import workers_of
from deadwood_algorithms.simulate.windows import wider_scene
from deadwood_engine import Fidelity, Interrupted, Logs, Rasters, Result, Start, slide

Found = TypeVar("Found")


@contextmanager
def workers_for(ask: ReleasedScene, feedback: Feedback, name: str = "") -> Iterator[None]:
    """Keeps the workers of ``--scheduler`` for all that is slid within; tools may stand within one another.

    name : what a scheduler's page shows, where ``ask`` is not the tool's own
    """
    with workers_of(ask.scheduler, ask.workers, threads_of(ask.threads), feedback) as workers:
        if workers and name:
            workers.name = name
        yield


def slide_once(
    layers: SceneLayers,
    logs: Logs | Start,
    fidelity: Fidelity,
    ask: ReleasedScene,
    report: Callable[[int], bool],
    *,
    keep_poses: NDArray[np.bool_] | None = None,
    rasters: Rasters | None = None,
    inside: NDArray[np.bool_] | None = None,
    influences: bool = False,
    **more: Any,
) -> tuple[Result, list[str]]:
    """Slide the logs as `slide_batch` does: all that the caller has of them."""
    batch = Batch(logs, keep_poses, inside)
    return slide_batch(layers, batch, fidelity, ask, report, rasters=rasters, influences=influences, **more)


def slide_batch(
    layers: SceneLayers,
    batch: Batch,
    fidelity: Fidelity,
    ask: ReleasedScene,
    report: Callable[[int], bool],
    *,
    rasters: Rasters | None = None,
    later: Iterable[Batch] = (),
    influences: bool = False,
    until_reached: bool = False,
    **more: Any,
) -> tuple[Result, list[str]]:
    """Slide the logs as ``ask`` says (laws of contact, limits, where), on the window that there is.

    ``report`` is told how many logs are done, and says whether to stop. Also returns the sides of the window that some
    log came too near to: where there are any, neither the result nor what was drawn on the rasters may be used.

    ``later`` are the batches that will be asked for next, with which the workers of a scheduler may begin while a slow
    log keeps this one waiting. With ``influences`` the result tells what mattered to each log, with ``until_reached``
    a log is left when it has reached every line that it is not ``inside``; more : stages, as the engine takes them,
    which make it shorter and change no answer: workers do without.

    Raises
    ------
    Cancelled
        where the user or ``report`` stopped it
    """

    laws = {**ask.laws(), "time_limit": ask.time_limit_s, "rest_speed": ask.rest_speed_ms}
    laws |= {"until_reached": True} if until_reached else {}

    def anywhere() -> Result:
        with workers_of(ask.scheduler, ask.workers, threads_of(ask.threads), Quiet()) as workers:
            if workers and len(batch):
                bands = rasters.workers[0].band if rasters else None
                sliding = Sliding(_name_of(ask), layers.scene, layers.shape, fidelity, laws, bands, influences)
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

    return _told(layers, anywhere)


def _told(layers: SceneLayers, slid: Callable[[], Result]) -> tuple[Result, list[str]]:
    """What the caller has of a result."""
    try:
        result = slid()
    except (Interrupted, KeyboardInterrupt) as error:
        raise Cancelled from error
    return layers.without_watch(result), layers.escaped(result)


def _name_of(ask: ReleasedScene) -> str:
    """What a scheduler's page shows: the tool, and what its output is called."""
    tool_name = type(ask).__module__.rpartition(".")[2].replace("_", "-")
    output = getattr(ask, "output", None)
    return f"{tool_name}-{Path(output).name}" if output else tool_name


def until_none_escapes(
    layers: SceneLayers,
    ask: ReleasedScene,
    slide_all: Callable[[SceneLayers], tuple[Found, list[str]]],
    feedback: Feedback,
) -> tuple[Found, SceneLayers]:
    """What ``slide_all`` finds on a window that no log comes too near to the sides of, and the scene on that window."""
    while True:
        found, sides = slide_all(layers)
        if not sides:
            return found, layers
        layers = wider_scene(ask, layers, sides, feedback)


def reporter(feedback: Feedback, total: int, what: str, *, before: int = 0) -> Callable[[int], bool]:
    """What the engine calls with the logs done, of ``total`` of which ``before`` were done earlier."""

    def report(done: int) -> bool:
        feedback.progress(before + done, total, what)
        return feedback.cancelled()

    return report
