"""The map: hits over the relief, what stands in the way, where logs start and end; its parts are layers of the page.

One figure serves the page (as SVG, whose groups ``layer_*`` its checkboxes switch) and the files. What is many, trees
and deposits, is one path of dots each: a marker each would be ten times as large.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from deadwood_algorithms.files.pictures import scale_and_north, show_relief
from deadwood_algorithms.files.styles import ENDS
from deadwood_algorithms.report.colours import BARRIER, BLOCK, LINE, LYING, RELEASE, TREE, WAY
from deadwood_algorithms.report.figures import INK, WIDTH
from deadwood_algorithms.report.phrases import STOPS
from deadwood_algorithms.report.sources import Extent, ReportedRun
from deadwood_algorithms.report.words import Words

MOST_DOTS = 8000  # of a kind
MOST_WAYS = 150
WAY_STEP_M = 3.0
OPAQUE = 0.15  # of the largest difference: from there on a map hides the relief
LONGEST, SHORTEST = 9.0, 3.0  # inches, of the map's height
SHOWN_AT_FIRST = ("relief", "hits", "trees", "barriers", "lying_logs", "blocks", "lines", "releases", "deposits")


def draw_map(source: ReportedRun, words: Words, *, every_layer: bool = False) -> Figure:
    """The map; with every layer for the page, which hides those that it does not show at first."""
    figure, axes = map_frame(source.extent, words)
    handles: list[Any] = []
    if source.ground is not None:
        draw_relief(axes, source)
    if "hits" in source.rasters:
        image = _hits(axes, source)
        bar = figure.colorbar(image, ax=axes, fraction=0.035, pad=0.015, aspect=32)
        bar.set_label(words.say("hits_bar"))
        bar.outline.set_visible(False)  # type: ignore[operator]
    for name, cmap in (("speed", "cividis"), ("energy", "cividis"), ("jump", "cividis"), ("danger", "magma")):
        if every_layer and name in source.rasters:
            top = 1.0 if name == "danger" else None
            _image(axes, *source.rasters[name], cmap, f"layer_{name}", 0.75, 2.5, top)
    handles += _scene(axes, source, words)
    handles += _logs(axes, source, words, every_layer)
    scale_and_north(axes)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, handlelength=1.4)
    return figure


def map_frame(extent: Extent, words: Words, width: float = WIDTH) -> tuple[Figure, Any]:
    """An empty map with the coordinates of its CRS along its sides."""
    west, south, east, north = extent
    tall = float(np.clip((width - 1.6) * (north - south) / (east - west), SHORTEST, LONGEST))
    figure = Figure(figsize=(width, tall + 1.1), layout="constrained")
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set(xlim=(west, east), ylim=(south, north), xlabel=words.say("east"), ylabel=words.say("north"))
    axes.set_gid("frame")
    for axis, many in ((axes.xaxis, 5), (axes.yaxis, 8)):
        axis.set_major_locator(MaxNLocator(many, steps=[1, 2, 5, 10]))
        axis.set_major_formatter(lambda at, _: f"{at:,.0f}".replace(",", "\u2009"))
    axes.tick_params(labelsize=8)
    axes.tick_params(axis="y", labelrotation=90)
    for label in axes.get_yticklabels():
        label.set_verticalalignment("center")
    axes.grid(visible=True, color=INK, alpha=0.12, linewidth=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)
    return figure, axes


def draw_relief(axes: Any, source: ReportedRun) -> None:
    ground = source.ground
    assert ground is not None
    west, south, east, north = ground.bounds
    show_relief(axes, ground.values, ground.cell, (west, east, south, north)).set_gid("layer_relief")


def _hits(axes: Any, source: ReportedRun) -> Any:
    values, extent = source.rasters["hits"]
    return _image(axes, np.where(values > 0.0, 100.0 * values, np.nan), extent, "viridis", "layer_hits", 0.72, 2.0)


def _image(
    axes: Any,
    values: NDArray,
    extent: Extent,
    cmap: str,
    gid: str,
    alpha: float,
    zorder: float,
    top: float | None = None,
) -> Any:
    west, south, east, north = extent
    values = values if top else np.where(values > 0.0, values, np.nan)  # of a known scale, 0 is a value too
    known = values[np.isfinite(values)]
    top = top or (float(np.quantile(known, 0.995)) if known.size else 1.0)
    return axes.imshow(
        values, cmap=cmap, vmin=0.0, vmax=max(top, 1e-9), alpha=alpha, extent=(west, east, south, north),
        origin="lower", interpolation="nearest", zorder=zorder, gid=gid,
    )  # fmt: skip


def dots(axes: Any, x: NDArray, y: NDArray, size: float, colour: str, gid: str, zorder: float) -> None:
    """Dots as one path: lines of next to no length with round ends; size in points."""
    ends = np.column_stack([x, y, x + 0.01, y]).reshape(-1, 2)
    codes = np.tile([Path.MOVETO, Path.LINETO], len(x))
    axes.add_patch(
        PathPatch(
            Path(ends, codes),
            facecolor="none",
            edgecolor=colour,
            linewidth=size,
            capstyle="round",
            gid=gid,
            zorder=zorder,
        )
    )


def lines_of_shapes(shapes: Any) -> list[NDArray[np.float64]]:
    """Lines, and outlines of polygons, part by part."""
    parts = shapely.get_parts(np.asarray(shapes))
    filled = shapely.get_type_id(parts) == 3
    strings = [*parts[~filled], *shapely.get_rings(parts[filled])]
    return [shapely.get_coordinates(each) for each in strings]


def thinned_rows(number: int, most: int, seed: int = 0) -> NDArray[np.int64]:
    """All rows, or an even draw of them, the same every time."""
    if number <= most:
        return np.arange(number)
    return np.sort(np.random.default_rng(seed).choice(number, most, replace=False))


def _scene(axes: Any, source: ReportedRun, words: Words) -> list[Any]:
    handles: list[Any] = []
    if "trees" in source.scene:
        x, y = shapely.get_coordinates(np.asarray(source.scene["trees"].geometry)).T
        rows = trees_drawn(source)
        dots(axes, x[rows], y[rows], 1.6, TREE, "layer_trees", 3.0)
        handles.append(_dot(TREE, words.say("layer_trees")))
    for name, colour, width in (("barriers", BARRIER, 2.2), ("lying_logs", LYING, 1.6)):
        if name in source.scene:
            strings = lines_of_shapes(source.scene[name].geometry)
            axes.add_collection(LineCollection(strings, colors=colour, linewidths=width, gid=f"layer_{name}", zorder=5))
            handles.append(Line2D([], [], color=colour, linewidth=width, label=words.say(f"layer_{name}")))
    if "blocks" in source.scene:
        x, y = shapely.get_coordinates(np.asarray(source.scene["blocks"].geometry)).T
        rows = thinned_rows(x.size, MOST_DOTS)
        dots(axes, x[rows], y[rows], 2.4, BLOCK, "layer_blocks", 5.0)
        handles.append(_dot(BLOCK, words.say("layer_blocks")))
    if source.lines is not None:
        strings = lines_of_shapes(source.lines.geometry)
        axes.add_collection(LineCollection(strings, colors=LINE, linewidths=2.0, gid="layer_lines", zorder=5))
        handles.append(Line2D([], [], color=LINE, linewidth=2.0, label=words.say("layer_lines")))
    return handles


def trees_drawn(source: ReportedRun) -> NDArray[np.int64]:
    """Rows of the trees within the map, at most so many."""
    x, y = shapely.get_coordinates(np.asarray(source.scene["trees"].geometry)).T
    west, south, east, north = source.extent
    inside = np.flatnonzero((x > west) & (x < east) & (y > south) & (y < north))
    return inside[thinned_rows(inside.size, MOST_DOTS)]


def _logs(axes: Any, source: ReportedRun, words: Words, ways_too: bool) -> list[Any]:
    handles: list[Any] = []
    frame = source.deposits
    ways = source.layer("trajectories") if ways_too else None
    if ways is not None and len(ways):
        strings = []
        for shape in np.asarray(ways.geometry)[thinned_rows(len(ways), MOST_WAYS)]:
            points = shapely.get_coordinates(shape)
            far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
            keep = np.diff(np.floor(far / WAY_STEP_M), prepend=-1.0) > 0.0
            keep[-1] = True
            strings.append(points[keep])
        axes.add_collection(
            LineCollection(strings, colors=[to_rgba(WAY, 0.75)], linewidths=0.5, gid="layer_trajectories", zorder=4)
        )
        handles.append(Patch(facecolor=WAY, edgecolor="#777777", label=words.say("layer_trajectories")))
    rows = thinned_rows(len(frame), MOST_DOTS)
    x, y = frame["release_x"].to_numpy()[rows], frame["release_y"].to_numpy()[rows]
    dots(axes, x, y, 1.5, RELEASE, "layer_releases", 6.0)
    handles.append(_dot(RELEASE, words.say("layer_releases")))
    ends = shapely.get_coordinates(np.asarray(frame.geometry))[rows]
    reasons = frame["stop_reason"].astype(str).to_numpy()[rows]
    for reason in [each for each in STOPS if (reasons == each).any()]:
        mine = ends[reasons == reason]
        mine = mine[np.isfinite(mine).all(axis=1)]
        colour = ENDS[reason][1]
        dots(axes, mine[:, 0], mine[:, 1], 2.4, colour, f"layer_deposits_{reason}", 7.0)
        handles.append(_dot(colour, words.say("layer_deposits", stop=words.stop(reason))))
    return handles


def _dot(colour: str, label: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker="o", markersize=4, color=colour, label=label)


def layers_drawn(source: ReportedRun) -> list[str]:
    """The switchable layers of this run's map, in the order of the checkboxes."""
    reasons = set(source.deposits["stop_reason"].astype(str))
    ways = source.layer("trajectories")
    there = {
        "relief": source.ground is not None,
        **{name: name in source.rasters for name in ("hits", "speed", "energy", "jump", "danger")},
        **{name: name in source.scene for name in ("trees", "barriers", "lying_logs", "blocks")},
        "lines": source.lines is not None,
        "releases": True,
        "trajectories": ways is not None and len(ways) > 0,
    }
    return [name for name, yes in there.items() if yes] + [f"deposits_{each}" for each in STOPS if each in reasons]


def draw_difference(
    band: NDArray[np.float64], extent: Extent, shown: Extent, source: ReportedRun, title: str, words: Words
) -> Figure:
    """Where logs pass more often (red) or less often (blue) than in the reference, over the relief."""
    figure, axes = map_frame(shown, words)
    if source.ground is not None:
        draw_relief(axes, source)
    points = 100.0 * band
    known = np.abs(points[np.isfinite(points)])
    far = max(float(np.quantile(known, 0.995)) if known.size else 1.0, 1e-9)
    seen = np.clip(np.nan_to_num(np.abs(points)) / (OPAQUE * far), 0.0, 0.85)  # little difference shows the relief
    west, south, east, north = extent
    image = axes.imshow(
        points, cmap="RdBu_r", vmin=-far, vmax=far, alpha=seen,
        extent=(west, east, south, north), origin="lower", interpolation="nearest", zorder=2,
    )  # fmt: skip
    axes.set(xlim=(shown[0], shown[2]), ylim=(shown[1], shown[3]))
    if source.lines is not None:
        axes.add_collection(
            LineCollection(lines_of_shapes(source.lines.geometry), colors=LINE, linewidths=1.6, zorder=5)
        )
    bar = figure.colorbar(image, ax=axes, fraction=0.035, pad=0.015, aspect=32)
    bar.set_label(title, fontsize=8)
    bar.outline.set_visible(False)  # type: ignore[operator]
    scale_and_north(axes)
    return figure
