"""The engine's kernels, compiled or read from disk before any timing starts; a compilation is announced."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numba.core import event

from deadwood_algorithms.params.tool import Feedback
from deadwood_engine import FIDELITIES, Logs, Rasters, Scene, Shape, slide

COMPILING = (
    "compiling the engine for this machine, once for each version, which takes one to two minutes; this time is not "
    "included in the figures shown"
)


def load_kernels(shape: Shape | None, feedback: Feedback) -> None:
    """Slide one log for a moment on a small plain.

    Otherwise the compilation, done once per version, would be attributed to the first logs and distort the remaining
    time.
    """
    feedback.progress(0, 1, "loading the engine")
    with compiling_said(feedback):
        scene = Scene.prepare(np.zeros((20, 20)), 1.0, 0.0, 0.0, friction=0.5)
        slide(
            scene,
            Logs.alike(np.array([10.0]), np.array([10.0]), length=2.0),
            FIDELITIES["draft"],
            time_limit=0.1,
            rasters=Rasters.allocate(scene, 1),
            shape=shape,
        )
    feedback.progress(1, 1, "loading the engine")


@contextmanager
def compiling_said(feedback: Feedback) -> Iterator[None]:
    """Inside the block, compilation is announced before the first kernel that is not in the cache; otherwise nothing is
    printed.

    Only Numba knows whether one is in the cache, and reports it when it starts to compile.
    """
    listener = _Announcer(feedback)
    with event.install_listener("numba:compile", listener):
        yield
    if listener.began is not None:
        feedback.note(f"the engine is compiled ({time.monotonic() - listener.began:.0f} s)")


class _Announcer(event.Listener):
    def __init__(self, feedback: Feedback) -> None:
        self.feedback = feedback
        self.began: float | None = None

    def on_start(self, event: Any) -> None:
        if self.began is None:
            self.began = time.monotonic()
            self.feedback.note(COMPILING)

    def on_end(self, event: Any) -> None:
        pass
