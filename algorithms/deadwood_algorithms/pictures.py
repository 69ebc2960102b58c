"""What every picture of the toolbox shares: the relief under it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RELIEF = ((225.0, 0.35), (270.0, 0.25), (315.0, 0.40))  # lights from the west all around: (azimuth [deg], weight)
SUN_HEIGHT_DEG = 40.0


def hillshade(heights: NDArray[np.floating], cell: float) -> NDArray[np.float64]:
    """Relief lit from several sides, stretched to 0..1, so that a slope facing away from one light is not black."""
    north, east = np.gradient(heights.astype(np.float64), cell)
    length = np.sqrt(1.0 + north**2 + east**2)
    level, rise = np.cos(np.radians(SUN_HEIGHT_DEG)), np.sin(np.radians(SUN_HEIGHT_DEG))
    light = np.zeros(heights.shape)
    for azimuth, weight in RELIEF:
        x, y = level * np.sin(np.radians(azimuth)), level * np.cos(np.radians(azimuth))
        light += weight * np.clip((rise - east * x - north * y) / length, 0.0, None)
    low, high = np.nanpercentile(light, [1.0, 99.0])
    return np.clip((light - low) / max(high - low, 1e-9), 0.0, 1.0)
