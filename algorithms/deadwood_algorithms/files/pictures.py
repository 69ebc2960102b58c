"""What every picture of the toolbox shares: the relief under a map, its lines, dots and scales, scale bar and north.

How a quantity or a thing looks is declared in `schemas/looks.py`; here it becomes Matplotlib's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, FuncNorm, LinearSegmentedColormap, Normalize, to_rgba
from matplotlib.image import AxesImage
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.schemas.looks import HIGH_END, LOOKS, LOW_END, ROAD, Look

RELIEF = ((225.0, 0.35), (270.0, 0.25), (315.0, 0.40))  # lights from south-west to north-west: (azimuth [deg], weight)
SUN_HEIGHT_DEG = 40.0
HALO = [withStroke(linewidth=3.0, foreground="white")]
CASING = 1.4  # points of white on both sides of a line, so that it is seen on any ground
RIM, RIM_WIDTH = "#1b1f23", 0.9  # dark, and its width in points around a dot
OPACITY = 0.85  # of a quantity over the relief
NORTH_POINTS = 28.0  # from the tip of the arrow to the letter
ENDS_HEIGHT = 0.62  # share of a factor's row that its two bars take
SIDE_SHARE = 0.06  # of the longest such bar, left free on both sides
BAR_SHARE = 0.2  # largest share of a map's width that its scale bar takes


def hillshade(
    heights: NDArray[np.floating], cell: float, span: tuple[float, float] | None = None
) -> NDArray[np.float64]:
    """Relief lit from several sides, stretched to 0..1, so that a slope facing away from one light is not black.

    span : the intensities drawn black and white (`span_of`), common to windows side by side, which else have seams
    """
    light = lit(heights, cell)
    return stretched(light, *(span or span_of(light)))


def span_of(light: NDArray[np.float64]) -> tuple[float, float]:
    """The intensities that are drawn black and white."""
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
    axes: Axes,
    heights: NDArray[np.floating],
    cell: float,
    extent: tuple[float, float, float, float],
    span: tuple[float, float] | None = None,
) -> AxesImage:
    """Draw heights (row 0 south) as a pale `hillshade`, for overlays; extent: west, east, south, north [m]."""
    shade = hillshade(heights, cell, span)
    return axes.imshow(
        shade, cmap="gray", vmin=-0.6, vmax=1.05, extent=extent, origin="lower", interpolation="bilinear"
    )


def colours_of(look: Look) -> tuple[Colormap, Normalize]:
    """The colour ramp of a look and the scale of its stops, as QGIS draws it, linear between two stops."""
    even = np.linspace(0.0, 1.0, len(look.stops))
    colours = [
        to_rgba(colour, 0.0 if value == look.clear else 1.0)
        for value, colour in zip(look.stops, look.colours, strict=True)
    ]
    ramp = LinearSegmentedColormap.from_list("look", list(zip(even, colours, strict=True)), N=512)
    place = (lambda value: np.interp(value, look.stops, even), lambda share: np.interp(share, even, look.stops))
    return ramp, FuncNorm(place, vmin=look.stops[0], vmax=look.stops[-1])


def show_quantity(
    axes: Axes, values: NDArray[np.floating], name: str, extent: tuple[float, float, float, float], **more: Any
) -> AxesImage:
    """A quantity of `LOOKS` over a map (row 0 south; extent: west, east, south, north), nothing where it is clear."""
    look = LOOKS[name]
    ramp, scale = colours_of(look)
    seen = values if look.clear is None else np.where(values == look.clear, np.nan, values)
    more = {"alpha": OPACITY, "zorder": 2, **more}
    return axes.imshow(seen, cmap=ramp, norm=scale, extent=extent, origin="lower", interpolation="nearest", **more)


def show_scale(
    figure: Any, image: Any, name: str, label: str, *, signs: Callable[[str], str] = str, **more: Any
) -> Any:
    """The scale of a quantity beside its map, with all stops labelled in the displayed unit; ``signs`` are those of
    the reader's language."""
    look = LOOKS[name]
    where = {"fraction": 0.035, "pad": 0.015, "aspect": 32} if "ax" in more and "shrink" not in more else {}
    bar = figure.colorbar(image, **where, **more)
    numbers = [look.label(each).removesuffix(f" {look.shown}").replace("-", "\u2212") for each in look.stops]
    bar.set_ticks(look.stops, labels=[signs(each) for each in numbers])
    bar.ax.minorticks_off()
    bar.set_label(label)
    bar.outline.set_visible(False)
    return bar


def lines_of_shapes(shapes: Any) -> list[NDArray[np.float64]]:
    """Lines, and outlines of polygons, part by part."""
    parts = shapely.get_parts(np.asarray(shapes))
    filled = shapely.get_type_id(parts) == 3
    strings = [*parts[~filled], *shapely.get_rings(parts[filled])]
    return [shapely.get_coordinates(each) for each in strings]


def show_lines(
    axes: Axes, strings: Iterable[ArrayLike], width: float = 2.0, colour: str = ROAD, **more: Any
) -> LineCollection:
    """Lines of a map, each an array of shape (n, 2), in their colour within a white casing."""
    more = {"zorder": 5, **more}
    drawn = LineCollection([np.asarray(each) for each in strings], colors=colour, linewidths=width, **more)
    drawn.set_path_effects([withStroke(linewidth=width + CASING, foreground="white")])
    axes.add_collection(drawn, autolim=False)
    return drawn


def show_dots(
    axes: Axes,
    x: NDArray,
    y: NDArray,
    size: float,
    colour: str,
    *,
    rim: bool = False,
    gid: str | None = None,
    **more: Any,
) -> None:
    """Dots of a map as one path: lines of next to no length with round ends; size in points.

    One marker for each would make a file ten times as large. They are not snapped to pixels: Agg would omit those whose
    two ends fall on one. With ``rim`` they are drawn on darker ones, so that a pale colour is visible on pale ground;
    these have the ``gid`` with ``_rim`` behind it.
    """
    ends = np.column_stack([x, y, np.asarray(x) + 0.01, y]).reshape(-1, 2)
    path = Path(ends, np.tile([Path.MOVETO, Path.LINETO], len(x)))
    rims = f"{gid}_rim" if gid else None
    for width, edge, name in ((size + RIM_WIDTH, RIM, rims), (size, colour, gid))[0 if rim else 1 :]:
        drawn = PathPatch(path, facecolor="none", edgecolor=edge, linewidth=width, capstyle="round", gid=name, **more)
        drawn.set_snap(False)
        axes.add_patch(drawn)


def show_ends(axes: Axes, place: float, base: float, at_low: float, at_high: float) -> None:
    """A factor's two bars, from the unchanged outcome to that at each end of the range: side by side, so that neither
    hides the other where both ends move the outcome the same way."""
    one_way = (at_low - base) * (at_high - base) > 0.0
    height, aside = (0.5 * ENDS_HEIGHT, 0.25 * ENDS_HEIGHT) if one_way else (ENDS_HEIGHT, 0.0)
    for value, colour, step in ((at_low, LOW_END, -aside), (at_high, HIGH_END, aside)):
        axes.barh(place + step, value - base, height, left=base, color=colour, zorder=2)


def limits_of_ends(values: Sequence[float], most: float) -> tuple[float, float]:
    """Limits of the axis of such bars, of an outcome between 0 and ``most``: with some room, because bars that end at
    the frame cannot be seen as bars, and with a width even if no value differs.
    """
    room = SIDE_SHARE * (max(values) - min(values)) or 1.0
    return max(min(values) - room, 0.0), min(max(values) + room, most)


def with_minus(text: str) -> str:
    """A text with true minus signs before its negative numbers, as axes have them."""
    return re.sub(r"(?<![\w.])-(?=\d)", "\N{MINUS SIGN}", text)


def bar_length(width: float) -> float:
    """A round length [m] of 1, 2 or 5 times a power of ten that takes up to `BAR_SHARE` of a map so wide [m]."""
    most = BAR_SHARE * width
    power = 10.0 ** math.floor(math.log10(most))
    return max(each * power for each in (1.0, 2.0, 5.0) if each * power <= most)


def scale_and_north(axes: Axes) -> None:
    """A scale bar at the bottom left and a north arrow at the top left of a map whose limits are set."""
    (west, east), south = axes.get_xlim(), axes.get_ylim()[0]
    width, bar = east - west, bar_length(east - west)
    x, y = west + 0.04 * width, south + 0.045 * width
    axes.plot([x, x + bar], [y, y], color="black", linewidth=3.5, solid_capstyle="butt", zorder=9)
    word = f"{bar / 1000:g} km" if bar >= 1000.0 else f"{bar:g} m"
    axes.text(
        x + bar / 2.0,
        y + 0.013 * width,
        word,
        ha="center",
        va="bottom",
        fontsize=9,
        color="black",
        zorder=9,
        path_effects=HALO,
    )
    axes.annotate(
        "N",
        xy=(0.06, 0.975),
        xycoords="axes fraction",
        xytext=(0.0, -NORTH_POINTS),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=11,
        fontweight="bold",
        color="black",
        arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.5, "path_effects": HALO},
        path_effects=HALO,
        zorder=9,
    )
