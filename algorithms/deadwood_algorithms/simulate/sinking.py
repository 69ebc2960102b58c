"""Logs that sink deep while they slide: counted wherever logs are slid, and warned about once."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Lock

import numpy as np

from deadwood_algorithms.params.counts import counted, significant
from deadwood_engine import Logs, Result, Shape, Start
from deadwood_engine.log_body import BASE_RADIUS

# [-] of its diameter, into the ground or an obstacle: the axis of a log that lies is then under the surface. It is what
# `standard` stays within on very rough ground of any cells (engine/README.md); what sinks deeper takes another way.
TOO_DEEP = 0.5


@dataclass
class Sinking:
    """How often a log was slid, how often it sank deeper than ``TOO_DEEP``, and how deep the deepest did.

    deepest : [m], and as a part of that log's diameter
    """

    slid: int = 0
    deep: int = 0
    deepest: tuple[float, float] = (0.0, 0.0)
    _lock: Lock = field(default_factory=Lock)  # several threads slide at once

    def add(self, logs: Logs | Start, shape: Shape | None, result: Result) -> None:
        if isinstance(logs, Start):
            diameter = 2.0 * logs.body[:, BASE_RADIUS]
        else:
            diameter = 2.0 * shape.bodies(logs.density)[:, BASE_RADIUS] if shape else np.asarray(logs.diameter)
        depth = result.penetration_max
        part = depth / diameter
        with self._lock:
            self.slid += part.size
            self.deep += int((part > TOO_DEEP).sum())
            if part.size and part.max() > self.deepest[1]:
                most = int(np.argmax(part))
                self.deepest = float(depth[most]), float(part[most])

    def words(self, cell: float) -> str | None:
        """The warning, for a terrain of such cells [m]; None where no log sank so deep."""
        if not self.deep:
            return None
        metres, part = self.deepest
        return (
            f"{self.deep} of {counted(self.slid, 'log')} that slid sank deeper than {TOO_DEEP:g} of their diameter "
            f"into the ground or an obstacle, the deepest {significant(metres, 2)} m ({significant(part, 2)} "
            f"diameters), on cells of {cell:g} m: their paths are not reliable; take a finer fidelity, and look at the "
            "terrain model where they went"
        )
