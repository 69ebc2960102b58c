"""What every picture of the toolbox shares: colours, the relief under a map, its lines, scale, north arrow and frame.

Maps are drawn into axes in world coordinates [m]; nothing here knows a file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter
from numpy.typing import ArrayLike, NDArray

# Okabe and Ito's colours, which colour-blind readers tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
ROAD, RELEASE = "#D55E00", "#0072B2"
HALO = [withStroke(linewidth=3.0, foreground="white")]
MARKERS = {"circle": "o", "triangle": "^", "square": "s", "cross2": "x"}  # of QGIS's names for shapes
PERCENT = FuncFormatter(lambda share, _: f"{100 * share:g} %")  # ticks of an axis of shares

Frame = tuple[float, float, float, float]  # west, east, south, north [m]

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


def frame_around(x: ArrayLike, y: ArrayLike, *, margin: float, low: float, high: float) -> Frame:
    """The frame that holds these places and a margin [m], made higher or wider until height / width is in low..high."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    west, east, south, north = x.min() - margin, x.max() + margin, y.min() - margin, y.max() + margin
    width, height = east - west, north - south
    wider, higher = max(0.0, height / high - width) / 2.0, max(0.0, low * width - height) / 2.0
    return float(west - wider), float(east + wider), float(south - higher), float(north + higher)


def draw_relief(axes: Axes, heights: NDArray[np.floating], cell: float, west: float, south: float) -> None:
    """The relief in grey; ``heights`` with row 0 in the south, their south-western corner at (west, south)."""
    rows, columns = heights.shape
    if min(rows, columns) > 1:
        extent = (west, west + columns * cell, south, south + rows * cell)
        shade = hillshade(heights, cell)
        axes.imshow(shade, cmap="gray", vmin=-0.6, vmax=1.05, extent=extent, origin="lower", interpolation="bilinear")


def draw_outlines(axes: Axes, shapes: Iterable[Any], colour: str, width: float, *, zorder: float = 3.0) -> None:
    """Lines, and the outlines of areas, with a pale rim that parts them from what is under them."""
    for shape in shapes:
        outline = shape.boundary if shapely.get_dimensions(shape) == 2 else shape
        for part in shapely.get_parts(outline):
            rim = [withStroke(linewidth=width + 1.6, foreground="white", alpha=0.7)]
            axes.plot(*part.xy, color=colour, linewidth=width, zorder=zorder, path_effects=rim)


def scale_and_north(axes: Axes) -> None:
    """A scale bar of a round length, about a fifth of the width, and a north arrow, in corners of axes with limits."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    width, height = east - west, north - south
    length = round_length(0.28 * width)
    x, y = west + 0.05 * width, south + 0.03 * height
    axes.plot([x, x + length], [y, y], color="black", linewidth=3.5, solid_capstyle="butt", zorder=8, path_effects=HALO)
    axes.annotate(
        f"{length:g} m", (x + length / 2.0, y), xytext=(0, 4), textcoords="offset points", ha="center", va="bottom",
        fontsize=9, path_effects=HALO, zorder=8,
    )  # fmt: skip
    tip, foot = (0.075, 0.975), (0.075, 0.90)
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.5, "path_effects": HALO}
    axes.annotate(
        "N", tip, foot, "axes fraction", "axes fraction", arrowprops=arrow, ha="center", va="center", fontsize=11,
        fontweight="bold", path_effects=HALO, zorder=8,
    )  # fmt: skip


def round_length(longest: float) -> float:
    """The longest of 1, 2, 5, 10, 20, 50, ... m that is no longer than this."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(power * each for each in (1.0, 2.0, 5.0) if power * each <= longest)
