"""Logs that are slid together, and what they share with the batches before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_engine import Fidelity, Logs, Scene, Shape, Start


@dataclass(frozen=True)
class Batch:
    """Logs that are slid together; ``first`` counts those of the run before them, ``goal`` all that it will slide.

    logs : or these placed already
    keep : bool (n,), whose poses are kept; inside : bool (n, lines of the scene), lines that a log starts within
    missing : where logs slide in scenes without some obstacles, which only workers do: how many logs, one after the
        other, and the obstacles that they miss; barrier b counts as -1 - b, others as ``Scene.without`` numbers them
    """

    logs: Logs | Start
    keep: NDArray[np.bool_] | None = None
    inside: NDArray[np.bool_] | None = None
    first: int = 0
    goal: int = 0
    missing: Sequence[tuple[int, NDArray[np.int64]]] = ()

    def __len__(self) -> int:
        return len(self.logs.state) if isinstance(self.logs, Start) else len(self.logs)


@dataclass(frozen=True)
class Sliding:
    """What all batches of one call have in common. laws : keyword arguments of the engine's ``slide``"""

    name: str
    scene: Scene
    shape: Shape | None
    fidelity: Fidelity
    laws: dict[str, Any]
    bands: NDArray[np.int64] | None  # of danger, by line; None: no rasters are wanted
    influences: bool = False  # whether to note what mattered to each log
