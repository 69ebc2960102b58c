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
    """Logs that are slid together; ``first`` is the number of the run's logs before them, ``goal`` that of all logs it
    will slide.

    logs : may be already placed
    keep : bool (n,), logs whose poses are stored; inside : bool (n, lines of the scene), lines inside which a log
    starts
    missing : for logs that slide in scenes without some obstacles (only on workers): numbers of consecutive
        logs, and the obstacles that they lack; barrier b counts as -1 - b, others as numbered by ``Scene.without``
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
    """Everything that the batches of one call have in common. laws : keyword arguments of the engine's ``slide``"""

    name: str
    scene: Scene
    shape: Shape | None
    fidelity: Fidelity
    laws: dict[str, Any]
    bands: NDArray[np.int64] | None  # bands of danger, by line; None: no rasters are needed
    influences: bool = False  # whether to record what affected each log
