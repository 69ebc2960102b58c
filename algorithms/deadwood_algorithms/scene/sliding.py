"""The one place where logs are slid: once on the scene's window, or until the window is wide enough for all of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.scene.read import SceneLayers
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.scene.window import wider_scene
from deadwood_algorithms.tool import Cancelled, Feedback
from deadwood_engine import Fidelity, Interrupted, Logs, Rasters, Result, slide

Found = TypeVar("Found")


def slide_once(
    layers: SceneLayers,
    logs: Logs,
    fidelity: Fidelity,
    ask: ReleasedScene,
    report: Callable[[int], bool],
    *,
    keep_poses: NDArray[np.bool_] | None = None,
    rasters: Rasters | None = None,
    inside: NDArray[np.bool_] | None = None,
) -> tuple[Result, list[str]]:
    """Slide the logs as ``ask`` says (laws of contact, limits), on the window that there is.

    ``report`` is told how many logs are done, and says whether to stop. Also returns the sides of the window that some
    log came too near to: where there are any, neither the result nor what was drawn on the rasters may be used.

    Raises
    ------
    Cancelled
        where the user or ``report`` stopped it
    """
    try:
        result = slide(
            layers.scene,
            logs,
            fidelity,
            **ask.laws(),
            time_limit=ask.time_limit,
            rest_speed=ask.rest_speed,
            threads=layers.threads,
            keep_poses=keep_poses,
            rasters=rasters,
            inside=inside,
            report=report,
            shape=layers.shape,
        )
    except (Interrupted, KeyboardInterrupt) as error:
        raise Cancelled from error
    return layers.without_watch(result), layers.escaped(result)


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
