"""Compile the engine for this machine before the first run: once after each installation or update.

    deadwood-tool warm-up

The compiled code is kept in the user's cache folder (`NUMBA_CACHE_DIR` names another one) and is used by every tool and
QGIS; an engine is compiled only once. `--shapes` also compiles the kernels of point clouds (`slide-logs --shape`),
which otherwise happens with the first of them.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool


@dataclass(frozen=True, kw_only=True)
class Ask:
    shapes: bool = tool.flag("Also the kernels of point clouds")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.simulate.warm_up import load_kernels
    from deadwood_engine import Shape

    began = time.monotonic()
    load_kernels(None, feedback)
    if ask.shapes:
        load_kernels(Shape.of(np.array(CUBE)), feedback)
    seconds = time.monotonic() - began
    feedback.note(f"the engine is ready ({seconds:.0f} s)")
    return Outcome({}, {"seconds": round(seconds, 1), "engine": engine_digest()})


CUBE = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]

TOOL = Tool("warm-up", "Simulate", "Compile the engine for this machine, before the first run", Ask, run, in_qgis=False)
