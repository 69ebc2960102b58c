"""Records of the logs at one fidelity, and of one row of the comparison of two."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Hits = tuple[NDArray[np.int64], Array]  # cells that were hit, ascending, and the share of the logs that hit each


@dataclass(frozen=True)
class FidelityRun:
    """Outcomes of the logs at one fidelity; arrays by log (n,), the same logs in the same order for every fidelity.

    reach : (n, lines); x, y : deposits [m]; hits : the cells hit by all, and by the first and the second half
    """

    name: str
    cpu_ms: float  # per log
    steps: float  # per log
    reach: NDArray[np.bool_]
    x: Array
    y: Array
    runout: Array
    speed_max: Array
    jump_max: Array
    penetration_max: Array
    energy_error: Array
    unconverged_share: float  # of the steps
    failed: int
    still_moving: int
    hits: tuple[Hits, Hits, Hits]


@dataclass(frozen=True)
class FidelityRow:
    """One row of the comparison: a quantity at one fidelity, compared with the finest.

    difference : value minus the finest's, or a distance, with its 95 % interval (NaN: none)
    noise : sampling error of this quantity in a run of the planned number of logs (NaN: not assessed)
    """

    fidelity: str
    quantity: str
    item: str
    unit: str
    value: float
    finest: float = math.nan
    difference: float = math.nan
    ci_low: float = math.nan
    ci_high: float = math.nan
    noise: float = math.nan
    verdict: str = ""
