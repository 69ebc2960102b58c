"""What every picture of the toolbox shares: the relief under a map, its scale bar and north arrow."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

RELIEF = ((225.0, 0.35), (270.0, 0.25), (315.0, 0.40))  # lights from the west all around: (azimuth [deg], weight)
SUN_HEIGHT_DEG = 40.0
HALO = [withStroke(linewidth=3.0, foreground="white")]
ROAD = "#D55E00"  # lines that are watched, in every map
RELEASE = "#0072B2"
BAR_SHARE = 0.2  # of a map's width that its scale bar takes, at most


def hillshade(heights: NDArray[np.floating], cell: float) -> NDArray[np.float64]:
    """Relief lit from several sides, stretched to 0..1, so that a slope facing away from one light is not black."""
    light = lit(heights, cell)
    return stretched(light, *span_of(light))


def span_of(light: NDArray[np.float64]) -> tuple[float, float]:
    """What of a light is black and white."""
    low, high = np.nanpercentile(light, [1.0, 99.0])
    return float(low), float(high)


def stretched(light: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
    return np.clip((light - low) / max(high - low, 1e-9), 0.0, 1.0)


def lit(heights: NDArray[np.floating], cell: float) -> NDArray[np.float64]:
    """How much light falls on each cell from all sides together."""
    north, east = np.gradient(heights.astype(np.float64), cell)
    length = np.sqrt(1.0 + north**2 + east**2)
    level, rise = np.cos(np.radians(SUN_HEIGHT_DEG)), np.sin(np.radians(SUN_HEIGHT_DEG))
    light = np.zeros(heights.shape)
    for azimuth, weight in RELIEF:
        x, y = level * np.sin(np.radians(azimuth)), level * np.cos(np.radians(azimuth))
        light += weight * np.clip((rise - east * x - north * y) / length, 0.0, None)
    return light


def show_relief(
    axes: Axes, heights: NDArray[np.floating], cell: float, extent: tuple[float, float, float, float]
) -> AxesImage:
    """Draw heights (row 0 south) as relief, pale enough for what lies on it; extent: west, east, south, north [m]."""
    shade = hillshade(heights, cell)
    return axes.imshow(
        shade, cmap="gray", vmin=-0.6, vmax=1.05, extent=extent, origin="lower", interpolation="bilinear"
    )


def bar_length(width: float) -> float:
    """A round length [m] of 1, 2 or 5 times a power of ten that takes up to `BAR_SHARE` of a map so wide [m]."""
    most = BAR_SHARE * width
    power = 10.0 ** math.floor(math.log10(most))
    return max(each * power for each in (1.0, 2.0, 5.0) if each * power <= most)


def scale_and_north(axes: Axes) -> None:
    """A scale bar at the bottom left and a north arrow at the top left of a map whose limits are set."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    width, bar = east - west, bar_length(east - west)
    x, y = west + 0.04 * width, south + 0.045 * width
    axes.plot([x, x + bar], [y, y], color="black", linewidth=3.5, solid_capstyle="butt", zorder=9)
    word = f"{bar / 1000:g} km" if bar >= 1000.0 else f"{bar:g} m"
    axes.text(x + bar / 2.0, y + 0.013 * width, word, ha="center", va="bottom", fontsize=9, zorder=9, path_effects=HALO)
    axes.annotate(
        "N",
        xy=(west + 0.06 * width, north - 0.027 * width),
        xytext=(west + 0.06 * width, north - 0.113 * width),
        ha="center",
        va="center",
        fontsize=11,
        fontweight="bold",
        arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.5, "path_effects": HALO},
        path_effects=HALO,
        zorder=9,
    )
