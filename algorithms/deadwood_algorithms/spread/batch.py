"""What is slid together, and what it has in common with what is slid before and after it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_engine import Fidelity, Logs, Scene, Shape


@dataclass(frozen=True)
class Batch:
    """Logs that are slid together; ``first`` counts those of the run before them, ``goal`` all that it will slide.

    keep : bool (n,), whose poses are kept; inside : bool (n, lines of the scene), lines that a log starts within
    """

    logs: Logs
    keep: NDArray[np.bool_] | None = None
    inside: NDArray[np.bool_] | None = None
    first: int = 0
    goal: int = 0


@dataclass(frozen=True)
class Sliding:
    """What all batches of one call have in common. laws : keyword arguments of the engine's ``slide``"""

    name: str
    scene: Scene
    shape: Shape | None
    fidelity: Fidelity
    laws: dict[str, Any]
    bands: NDArray[np.int64] | None  # of danger, by line; None: no rasters are wanted
