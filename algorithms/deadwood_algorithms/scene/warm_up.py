"""The engine's kernels, compiled or read from disk before a clock runs."""

from __future__ import annotations

import numpy as np

from deadwood_algorithms.tool import Feedback
from deadwood_engine import FIDELITIES, Logs, Rasters, Scene, Shape, slide


def load_kernels(shape: Shape | None, feedback: Feedback) -> None:
    """Slide one log for a moment on a small plain.

    What is compiled once a version (half a minute) would else count as the first logs' cost and spoil the time left.
    """
    feedback.progress(0, 1, "loading the engine")
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
