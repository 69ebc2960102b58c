"""A map of a result for a notebook: a raster, and layers on it. The maps of the report are made elsewhere."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Protocol

import numpy as np
from matplotlib import pyplot
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

from deadwood_algorithms.files.pictures import scale_and_north, show_quantity, show_relief, show_scale
from deadwood_algorithms.schemas.files import RUN_RASTERS
from deadwood_algorithms.schemas.looks import ENDS, HITS, LOOKS, ROAD, RUNS, TREE

if TYPE_CHECKING:
    import geopandas
    from matplotlib.axes import Axes

# Looks of a run's rasters, by the name of the first band
LOOKED_AT = {each.bands[0].name: each.look for each in RUN_RASTERS if each.look in LOOKS}
RAMP = LinearSegmentedColormap.from_list("hits", list(HITS))
Extent = tuple[float, float, float, float]
LONGEST_IN = 8.0  # of a map, in inches
LINE_OF_BAR = 50  # characters per line beside a colour bar
MARGIN = 0.05  # around the content, as a share of its longer side


class Raster(Protocol):
    """The part of a raster (`in_memory.Raster`) that a map needs."""

    @property
    def nodata(self) -> float | None: ...

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def meanings(self) -> tuple[str, ...]: ...

    @property
    def band(self) -> np.ndarray: ...

    @property
    def extent(self) -> Extent: ...


def map_axes() -> Axes:
    """Axes of a separate figure."""
    _, axes = pyplot.subplots(figsize=(LONGEST_IN, LONGEST_IN), layout="constrained")
    return axes


def draw_raster(axes: Axes, raster: Raster) -> None:
    """Draw the first band; counts on a logarithmic scale, transparent where nothing was counted."""
    values = np.ma.masked_invalid(raster.band)
    if raster.nodata is not None:
        values = np.ma.masked_equal(values, raster.nodata)
    counts = raster.band.dtype.kind in "ui"
    values = np.ma.masked_equal(values, 0) if counts else values
    name = next((each for each in raster.names if each), "")
    meaning = next((each for each in raster.meanings if each), name)
    assert axes.figure is not None
    if name in LOOKED_AT:
        look, above = LOOKED_AT[name], np.ma.masked_equal(values, 0).filled(np.nan)
        shown = show_quantity(axes, above[::-1], look, raster.extent)
        label = textwrap.fill(f"{meaning} [{LOOKS[look].shown}]", LINE_OF_BAR)
        show_scale(axes.figure, shown, look, label, ax=axes, shrink=0.6)
        _finish(axes)
        return
    most = max(2.0, float(values.max())) if values.count() else 2.0
    norm = LogNorm(1, most) if counts else Normalize()
    shown = axes.imshow(values, norm=norm, extent=raster.extent, cmap=RAMP, interpolation="nearest")
    bar = axes.figure.colorbar(shown, ax=axes, shrink=0.6, label=textwrap.fill(meaning, LINE_OF_BAR))
    if counts:
        round_ones = [each * 10**power for power in range(10) for each in (1, 2, 5)]
        ticks = [each for each in round_ones if each <= most]
        bar.set_ticks(ticks, labels=[str(each) for each in ticks])
        bar.minorticks_off()
    _finish(axes)


def draw_layer(axes: Axes, layer: geopandas.GeoDataFrame, by: str | None = None, label: str | None = None) -> None:
    """Draw points by the values of a text column, with a legend; lines and outlines of areas like the lines of a
    run, with a ``label`` in a legend that is drawn later.
    """
    if layer.empty:
        return
    if by is None or set(layer.geom_type) != {"Point"}:
        lines = layer.boundary if set(layer.geom_type) <= {"Polygon", "MultiPolygon"} else layer.geometry
        lines.plot(ax=axes, color=ROAD, linewidth=2.0, markersize=6.0, zorder=4)
        if label:
            axes.plot([], [], color=ROAD, linewidth=2.0, label=label)
    else:
        words = layer[by].value_counts()
        for k, (word, n) in enumerate(words.items()):
            colour = ENDS[str(word)][1] if word in ENDS else RUNS[k % len(RUNS)]
            chosen = layer[layer[by] == word]
            looks = {"color": colour, "edgecolors": "white", "linewidths": 0.7, "zorder": 5}
            axes.scatter(chosen.geometry.x, chosen.geometry.y, s=34.0, label=f"{word} ({n})", **looks)
        axes.legend(title=by.replace("_", " "), loc="upper right", fontsize=8, title_fontsize=8)
    _finish(axes)


def frame_of(raster: Raster) -> Extent:
    """West, east, south, north of the cells with values, with a margin; of the whole raster if there are none."""
    band = raster.band
    held = band != 0 if band.dtype.kind in "ui" else np.isfinite(band)
    west, east, south, north = raster.extent
    if not held.any():
        return raster.extent
    rows, columns = np.flatnonzero(held.any(axis=1)), np.flatnonzero(held.any(axis=0))
    across, up = (east - west) / band.shape[1], (north - south) / band.shape[0]
    left, right = west + across * columns[0], west + across * (columns[-1] + 1)
    top, bottom = north - up * rows[0], north - up * (rows[-1] + 1)
    margin = MARGIN * max(right - left, top - bottom)
    return left - margin, right + margin, bottom - margin, top + margin


def draw_ground(axes: Axes, relief: tuple[np.ndarray, float, Extent] | None, trees: np.ndarray) -> None:
    """The relief (heights with row 0 south, their cell, west, east, south, north), and stems, shape (n, 2), on it."""
    if relief is not None:
        show_relief(axes, *relief)
    if len(trees):
        axes.scatter(*trees.T, s=3.0, color=TREE, linewidths=0.0, label="trees")


def finish(axes: Axes) -> None:
    """The scale bar and the arrow to the north, once all is drawn."""
    scale_and_north(axes)


def _finish(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.set(xticks=[], yticks=[], xlabel="", ylabel="")
