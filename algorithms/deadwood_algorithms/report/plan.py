"""The map: hits over the relief, obstacles, starts and ends of logs; its parts are layers of the page.

One figure serves the page (as SVG, whose groups ``layer_*`` its checkboxes switch) and the files. Numerous items, trees
and deposits, are one path of dots each: separate markers would be ten times as large.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from deadwood_algorithms.files.pictures import (
    colours_of,
    lines_of_shapes,
    lit,
    scale_and_north,
    show_dots,
    show_lines,
    show_quantity,
    show_relief,
    show_scale,
    span_of,
)
from deadwood_algorithms.report.figures import INK, TEXT, WIDTH, plain
from deadwood_algorithms.report.sources import Extent, ReportedRun, lying_radii
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.schemas.looks import BARRIER, ENDS, LOOKS, RELEASE, ROAD, STONE, STUMP, TREE, WOOD
from deadwood_algorithms.schemas.obstacles import OBSTACLES
from deadwood_algorithms.schemas.results import STOPS

MOST_DOTS = 8000  # of each kind
MOST_WAYS = 150
WAY_STEP_M = 3.0
LONGEST, SHORTEST = 4.4, 3.0  # inches, of the map's height: as much as fits on paper (`page.css`)
NUMBER_IN = 0.85  # length of a coordinate along a map's side, with the gap to the next [inches]
LETTER_IN, KEY_IN = 0.075, 0.45  # size of a legend [inches]: a letter of its longest entry, and the key before it
# Space beside a map for its coordinates and its scale [inches], and for its legend, whose lines have so many characters
SIDES_IN, BESIDE_IN, BESIDE_WORDS = 1.4, 2.1, 22
SMALL = 0.55  # relative size of dots on a map beside others
ABREAST, HIGHEST = 3, 4.4  # number of maps side by side, and height of all rows [inches]
# The quantities shown over the map, and the look of each
QUANTITIES = {"hits": "shares", "speed": "speed", "energy": "energy", "jump": "jump", "danger": "danger"}
SHOWN_AT_FIRST = ("relief", "hits", *(each.key for each in OBSTACLES), "lines", "releases", "deposits")


def draw_map(source: ReportedRun, words: Words, *, every_layer: bool = False) -> Figure:
    """The map; with every layer for the page, which hides those that it does not show at first."""
    figure, axes = map_frame(source.extent, words)
    handles: list[Any] = []
    if source.ground is not None:
        draw_relief(axes, source)
    for name, look in QUANTITIES.items():
        if name in source.rasters and (every_layer or name == "hits"):
            image = show_layer(axes, source, name, gid=f"layer_{name}")
            if name == "hits":
                show_scale(figure, image, look, words.say("hits_bar"), signs=words.signs, ax=axes)
    handles += _scene(axes, source, words)
    handles += _logs(axes, source, words, every_layer)
    scale_and_north(axes)
    legend_of_map(figure, handles)
    return figure


def legend_of_map(figure: Figure, handles: list[Any]) -> None:
    """The legend of a map: beside a tall one, otherwise below, in as many columns as fit."""
    (west, east), (south, north) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
    if has_room_beside((west, south, east, north), figure.get_figwidth()):
        for each in handles:
            each.set_label(textwrap.fill(str(each.get_label()), BESIDE_WORDS))
        switched(figure.legend(handles=handles, loc="outside right upper", handlelength=1.4, labelspacing=0.8), handles)
        return
    legend_below(figure, handles)


def has_room_beside(extent: Extent, width: float) -> bool:
    """Whether a map is so tall that its legend fits beside it in a figure so wide [in]."""
    return width_with_legend(extent) <= width + 1e-6


def width_with_legend(extent: Extent) -> float:
    """Width of a figure [in] with a map of the greatest height and its legend beside it."""
    west, south, east, north = extent
    return LONGEST * (east - west) / (north - south) + SIDES_IN + BESIDE_IN


def legend_below(figure: Figure, handles: list[Any]) -> None:
    """The legend of maps side by side, in as many columns as fit."""
    longest = max((len(str(each.get_label())) for each in handles), default=0)
    columns = int(np.clip(figure.get_figwidth() / (longest * LETTER_IN + KEY_IN), 1, 3))
    switched(figure.legend(handles=handles, loc="outside lower center", ncols=columns, handlelength=1.4), handles)


def switched(legend: Any, handles: list[Any]) -> None:
    """The entries of layers that the page hides at first have their names, so that it hides them too."""
    for each, key, word in zip(handles, legend.legend_handles, legend.get_texts(), strict=True):
        if name := each.get_gid():
            key.set_gid(f"{name}_key")
            word.set_gid(f"{name}_word")


def map_frame(extent: Extent, words: Words, width: float = WIDTH) -> tuple[Figure, Any]:
    """An empty map with the coordinates of its CRS along its sides."""
    west, south, east, north = extent
    tall = float(np.clip((width - 1.6) * (north - south) / (east - west), SHORTEST, LONGEST))
    beside = has_room_beside(extent, width)
    width, below = (width_with_legend(extent), 0.6) if beside else (width, 1.1)  # no empty strips beside a narrow map
    figure = Figure(figsize=(width, tall + below), layout="compressed")  # around a map, whose aspect ratio is kept
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set(xlim=(west, east), ylim=(south, north), xlabel=words.say("east"), ylabel=words.say("north"))
    axes.set_gid("frame")
    # without the lowest of the vertical numbers, which would overlap those along the bottom
    wide = min(tall * (east - west) / (north - south), width - SIDES_IN)
    for axis, side, prune in ((axes.xaxis, wide, None), (axes.yaxis, tall, "lower")):
        many = max(2, int(side / NUMBER_IN))
        axis.set_major_locator(MaxNLocator(many, steps=[1, 2, 5, 10], prune=prune))
        axis.set_major_formatter(lambda at, _: f"{at:,.0f}".replace(",", "\u2009"))
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
    show_relief(axes, ground.values, ground.cell, (west, east, south, north), source.relief_span).set_gid(
        "layer_relief"
    )


def draw_reliefs(axes: Any, sources: Sequence[ReportedRun]) -> None:
    """Relief for a map of several runs: at the bottom that of the run with the largest terrain."""
    for each in sorted((each for each in sources if each.ground is not None), key=lambda each: -area(each.extent)):
        draw_relief(axes, each)


def span_of_reliefs(sources: Sequence[ReportedRun]) -> tuple[float, float] | None:
    """One stretch for the terrains of all runs: the same ground is equally grey on every map, without seams."""
    light = [lit(each.ground.values, each.ground.cell).ravel() for each in sources if each.ground is not None]
    return span_of(np.concatenate(light)) if light else None


def covering(sources: Sequence[ReportedRun]) -> list[ReportedRun]:
    """The runs whose terrains together reach as far as those of all: the largest, and those that reach beyond it."""
    chosen: list[ReportedRun] = []
    known = [each for each in sources if each.ground is not None]
    for each in sorted(known, key=lambda each: -area(each.extent)):
        if not shapely.union_all([shapely.box(*one.extent) for one in chosen]).covers(shapely.box(*each.extent)):
            chosen.append(each)
    return chosen


def area(extent: Extent) -> float:
    west, south, east, north = extent
    return (east - west) * (north - south)


def show_layer(axes: Any, source: ReportedRun, name: str, **more: Any) -> Any:
    """A quantity of the run in its look; nothing is drawn where no log passed, but a danger of 0 is drawn."""
    values, (west, south, east, north) = source.rasters[name]
    values = values if name == "danger" else np.where(values > 0.0, values, np.nan)
    return show_quantity(axes, values, QUANTITIES[name], (west, east, south, north), **more)


def thinned_rows(number: int, most: int, seed: int = 0) -> NDArray[np.int64]:
    """All rows, or a random subset of them, always the same."""
    if number <= most:
        return np.arange(number)
    return np.sort(np.random.default_rng(seed).choice(number, most, replace=False))


def _scene(axes: Any, source: ReportedRun, words: Words, size: float = 1.0) -> list[Any]:
    """The obstacles; ``size`` is the relative size of their dots."""
    handles: list[Any] = []
    for name, colour, share in (("trees", TREE, 1.6), ("stumps", STUMP, 0.7)):
        if name in source.scene:
            x, y = shapely.get_coordinates(np.asarray(source.scene[name].geometry)).T
            rows = points_drawn(source, name)
            show_dots(axes, x[rows], y[rows], share * size, colour, gid=f"layer_{name}", zorder=3.0)
            handles.append(_dot(colour, words.say(f"layer_{name}")))
    if "barriers" in source.scene:
        show_lines(axes, lines_of_shapes(source.scene["barriers"].geometry), 2.2, BARRIER, gid="layer_barriers")
        handles.append(Line2D([], [], color=BARRIER, linewidth=2.2, label=words.say("layer_barriers")))
    if "lying_logs" in source.scene:
        handles.append(_lying_logs(axes, source, words))
    if "blocks" in source.scene:
        x, y = shapely.get_coordinates(np.asarray(source.scene["blocks"].geometry)).T
        rows = thinned_rows(x.size, MOST_DOTS)
        show_dots(axes, x[rows], y[rows], 2.4, STONE, gid="layer_blocks", zorder=5.0)
        handles.append(_dot(STONE, words.say("layer_blocks")))
    return handles + roads(axes, source, words)


def roads(axes: Any, source: ReportedRun, words: Words) -> list[Any]:
    """The lines whose reach is counted, and their legend entry."""
    if source.lines is None:
        return []
    show_lines(axes, lines_of_shapes(source.lines.geometry), gid="layer_lines")
    return [Line2D([], [], color=ROAD, linewidth=2.0, label=words.say("layer_lines"))]


def _lying_logs(axes: Any, source: ReportedRun, words: Words) -> Any:
    """Lying logs to scale: their outlines in plan, with a hairline so that none is invisible."""
    frame = source.scene["lying_logs"]
    outlines = [
        part.exterior.coords
        for shape, (thick, _) in zip(np.asarray(frame.geometry), lying_radii(source), strict=True)
        for part in shapely.get_parts(shape.buffer(thick, cap_style="flat"))
    ]
    axes.add_collection(
        PolyCollection(outlines, facecolor=WOOD, edgecolor=WOOD, linewidth=0.3, gid="layer_lying_logs", zorder=3.5),
        autolim=False,
    )
    return Line2D([], [], color=WOOD, linewidth=1.6, label=words.say("layer_lying_logs"))


def points_drawn(source: ReportedRun, name: str) -> NDArray[np.int64]:
    """Rows of the trees or stumps within the map, at most a given number."""
    x, y = shapely.get_coordinates(np.asarray(source.scene[name].geometry)).T
    west, south, east, north = source.extent
    inside = np.flatnonzero((x > west) & (x < east) & (y > south) & (y < north))
    return inside[thinned_rows(inside.size, MOST_DOTS)]


def _logs(axes: Any, source: ReportedRun, words: Words, ways_too: bool, size: float = 1.0) -> list[Any]:
    handles: list[Any] = []
    frame = source.deposits
    ways = source.layer("trajectories") if ways_too else None
    hidden: list[Any] = []  # last in the legend, where they leave no gap
    if ways is not None and len(ways):
        strings, rows = [], thinned_rows(len(ways), MOST_WAYS)
        for shape in np.asarray(ways.geometry)[rows]:
            points = shapely.get_coordinates(shape)
            far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
            keep = np.diff(np.floor(far / WAY_STEP_M), prepend=-1.0) > 0.0
            keep[-1] = True
            strings.append(points[keep])
        ramp, scale = colours_of(LOOKS["speed"])  # as in QGIS: by the largest speed
        colours = ramp(scale(ways["speed_max_ms"].to_numpy(float)[rows]))
        axes.add_collection(
            LineCollection(strings, colors=colours, linewidths=0.7, gid="layer_trajectories", zorder=4), autolim=False
        )
        middle = LOOKS["speed"].colours[3]
        label = words.say("layer_trajectories")
        hidden.append(Line2D([], [], color=middle, linewidth=1.2, label=label, gid="layer_trajectories"))
    rows = thinned_rows(len(frame), MOST_DOTS)
    x, y = frame["release_x"].to_numpy()[rows], frame["release_y"].to_numpy()[rows]
    show_dots(axes, x, y, 1.5 * size, RELEASE, gid="layer_releases", zorder=6.0)
    handles.append(_dot(RELEASE, words.say("layer_releases")))
    ends = shapely.get_coordinates(np.asarray(frame.geometry))[rows]
    reasons = frame["stop_reason"].astype(str).to_numpy()[rows]
    for reason in [each for each in STOPS if (reasons == each).any()]:
        mine = ends[reasons == reason]
        mine = mine[np.isfinite(mine).all(axis=1)]
        colour = ENDS[reason][1]
        show_dots(
            axes,
            mine[:, 0],
            mine[:, 1],
            2.2 * size,
            colour,
            rim=size == 1.0,
            gid=f"layer_deposits_{reason}",
            zorder=7.0,
        )
        handles.append(_dot(colour, words.say("layer_deposits", stop=words.stop(reason))))
    return handles + hidden


def _dot(colour: str, label: str) -> Line2D:
    return Line2D([], [], linestyle="none", marker="o", markersize=4, color=colour, label=label)


def layers_drawn(source: ReportedRun) -> list[str]:
    """The switchable layers of this run's map, in the order of the checkboxes."""
    reasons = set(source.deposits["stop_reason"].astype(str))
    ways = source.layer("trajectories")
    there = {
        "relief": source.ground is not None,
        **{name: name in source.rasters for name in ("hits", "speed", "energy", "jump", "danger")},
        **{name: name in source.scene for name in (each.key for each in OBSTACLES)},
        "lines": source.lines is not None,
        "releases": True,
        "trajectories": ways is not None and len(ways) > 0,
    }
    return [name for name, yes in there.items() if yes] + [f"deposits_{each}" for each in STOPS if each in reasons]


def draw_differences(
    maps: Mapping[str, tuple[NDArray[np.float64], Extent]],
    shown: Extent,
    sources: Sequence[ReportedRun],
    words: Words,
) -> Figure:
    """Where logs pass more often (red) or less often (blue) than in the first run; with a common scale and frame."""
    reference, names = sources[0], list(maps)
    figure, panels, room = map_panels(len(names), shown, words)
    image: Any = None
    handles: list[Any] = []
    for axes, name in zip(panels, names, strict=False):
        draw_reliefs(axes, [each for each in sources if each.name in (name, reference.name)])
        band, (west, south, east, north) = maps[name]
        image = show_quantity(axes, band, "difference of shares", (west, east, south, north))
        axes.set(xlim=(shown[0], shown[2]), ylim=(shown[1], shown[3]))
        axes.set_title(words.say("minus", name=plain(name), reference=plain(reference.name)), fontsize=TEXT, loc="left")
        handles = roads(axes, reference, words)
    scale_and_north(panels[0])
    scale_of_panels(figure, image, "difference of shares", words.say("difference_bar"), words, room)
    if handles:
        figure.legend(handles=handles, loc="outside lower left", ncols=3, handlelength=1.4)
    return figure


def draw_runs(sources: Sequence[ReportedRun], shown: Extent, words: Words) -> Figure:
    """The runs side by side: where logs pass, and where they end; with a common scale and frame."""
    figure, panels, room = map_panels(len(sources), shown, words)
    handles: dict[str, Any] = {}
    image: Any = None
    under = covering(sources)
    for axes, source in zip(panels, sources, strict=False):
        draw_reliefs(axes, under if any(each is source for each in under) else [*under, source])
        if "hits" in source.rasters:
            image = show_layer(axes, source, "hits")
        drawn = _scene(axes, source, words, SMALL) + _logs(axes, source, words, ways_too=False, size=SMALL)
        handles |= {each.get_label(): each for each in drawn}
        axes.set(xlim=(shown[0], shown[2]), ylim=(shown[1], shown[3]))
        axes.set_title(plain(source.name), fontsize=TEXT, loc="left")
    scale_and_north(panels[0])
    if image is not None:
        scale_of_panels(figure, image, "shares", words.say("hits_bar"), words, room)
    legend_below(figure, list(handles.values()))
    return figure


def scale_of_panels(figure: Figure, image: Any, look: str, label: str, words: Words, room: list[Any]) -> None:
    """The common scale: below a full row of maps, which take the whole width; else beside them."""
    where = "bottom" if len(room) >= ABREAST else "right"
    show_scale(figure, image, look, label, signs=words.signs, ax=room, shrink=0.9, aspect=32, location=where)


def map_panels(number: int, shown: Extent, words: Words) -> tuple[Figure, list[Any], list[Any]]:
    """Maps with a common frame without coordinates, at most three side by side; returns the figure, its maps, and all
    axes.
    """
    columns = min(number, ABREAST)
    rows = -(-number // columns)
    west, south, east, north = shown
    below = columns == ABREAST  # the scale: `scale_of_panels`
    wide = (WIDTH - (0.1 if below else 0.8)) / max(columns, 2)  # a single one would fill the page
    tall = float(np.clip(wide * (north - south) / (east - west), SHORTEST / 2, HIGHEST / rows))
    width = WIDTH if columns > 1 else wide + 1.4  # with the scale beside it
    figure = Figure(figsize=(width, rows * (tall + 0.3) + (1.9 if below else 0.7)), layout="constrained")
    room = list(figure.subplots(rows, columns, squeeze=False).ravel())
    for axes in room:
        axes.set(xticks=[], yticks=[], aspect="equal", xlim=(west, east), ylim=(south, north))
        axes.grid(visible=False)
        for side in ("top", "right"):
            axes.spines[side].set_visible(True)
    for axes in room[number:]:
        axes.set_axis_off()
    return figure, room[:number], room
