"""The settings of a run, as repeated in its results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.results.capacity import Capacity
from deadwood_algorithms.results.friction_band import SlidBand
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.simulate.own_slope import Sample


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of a run: the scene, the fidelity by name, whether any trajectory is kept, the number of logs from
    which danger is given, whether its counts are kept, and the capacity of stems. With --fidelity auto also what was
    promised, and what the pilot cost beside the run; with --friction-range what slid over it. own_slope : the logs that
    slid again at a finer fidelity, if any did"""

    scene: ReleasedScene
    fidelity: str
    keeps_poses: bool
    danger_least: int
    danger_counts: bool = False
    capacity: Capacity = Capacity()
    auto: dict[str, Any] | None = None
    pilot_cpu_s: float = 0.0
    own_slope: Sample | None = None
    band: SlidBand | None = None
