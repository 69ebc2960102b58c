"""Logs that sink deep while they slide: counted wherever logs are slid, with one warning."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback
from deadwood_engine import Logs, Shape, Start
from deadwood_engine.log_body import BASE_RADIUS

# Share of the diameter, into the ground or an obstacle: the axis of a lying log is then below the surface. This is what
# `standard` does not exceed on very rough ground of any cell size (engine/README.md); deeper logs take another path.
TOO_DEEP = 0.5


@dataclass
class Sinking:
    """How often a log was slid, how often it sank deeper than ``TOO_DEEP``, and how deep the deepest did.

    deepest : [m], and as a part of that log's diameter
    """

    slid: int = 0
    deep: int = 0
    deepest: tuple[float, float] = (0.0, 0.0)
    _lock: Lock = field(default_factory=Lock)  # several threads slide at the same time

    def add(self, logs: Logs | Start, shape: Shape | None, depth: NDArray[np.float64]) -> None:
        if isinstance(logs, Start):
            diameter = 2.0 * logs.body[:, BASE_RADIUS]
        else:
            diameter = 2.0 * shape.bodies(logs.density)[:, BASE_RADIUS] if shape else np.asarray(logs.diameter)
        part = depth / diameter
        with self._lock:
            self.slid += part.size
            self.deep += int((part > TOO_DEEP).sum())
            if part.size and part.max() > self.deepest[1]:
                most = int(np.argmax(part))
                self.deepest = float(depth[most]), float(part[most])

    def say(self, cell: float, feedback: Feedback) -> None:
        """Warn if logs sank so deep, on cells of this size [m]."""
        if not self.deep:
            return
        metres, part = self.deepest
        feedback.warn(
            f"{self.deep} of {counted(self.slid, 'log')} that slid sank deeper than {TOO_DEEP:g} of their diameter "
            f"into the ground or an obstacle, the deepest {significant(metres, 2)} m ({significant(part, 2)} "
            f"diameters), on cells of {cell:g} m: their paths are not reliable; take a finer fidelity, and look at the "
            "terrain model where they went",
            code="sank-deep",
            deep=self.deep,
            logs=self.slid,
            deepest_m=metres,
        )
