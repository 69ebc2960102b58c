"""Maps and bars of what other tools found out about a run, in the manner of the report's other figures."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import shapely
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from deadwood_algorithms.files.pictures import (
    limits_of_ends,
    lines_of_shapes,
    scale_and_north,
    show_dots,
    show_ends,
    show_lines,
    show_quantity,
    show_scale,
)
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.report.figures import INK, LABEL, WIDTH, Drawing, plain
from deadwood_algorithms.report.plan import (
    MOST_DOTS,
    draw_relief,
    legend_of_map,
    map_frame,
    roads,
    thinned_rows,
)
from deadwood_algorithms.report.rounded import decimal, with_interval
from deadwood_algorithms.report.sources import Extent, ReportedRun, thinned_raster
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.schemas.looks import BARRIER, BRINGS, CHOSEN, HIGH_END, KEEPS, LOW_END, PLAIN

NARROW = 5.6  # width of one of several maps [inches]
ROOM_M = 10.0  # least ground around the cells from which lines are reached
NAMED = 5  # number of objects named on the map: those that keep most logs away
# map -> (title's phrase, function that selects the class shown for a block of cells: the most severe)
CLASS_MAPS: dict[str, tuple[str, Callable[..., Any]]] = {
    "intensity": ("intensity_map", np.nanmax),
    "passage": ("passage_map", np.nanmax),
    "return_class": ("return_map", np.nanmin),  # 1 is the shortest period
}


def drawings_of_answers(source: ReportedRun, words: Words, key: str) -> dict[str, Drawing]:
    """The figures of the results named with ``--results``, by content."""
    found: dict[str, tuple[str, Callable[[], Figure]]] = {}
    values = source.answers.tree_effect.get("values")
    if values is not None and len(values):
        found["tree_effect"] = "tree_effect", partial(tree_effect_figure, source, values, words)
    folders = source.answers.folders
    if "site-barriers" in folders:
        found["siting"] = "siting", partial(siting_figure, source, folders["site-barriers"][0], words)
    if "map-intensity" in folders:
        folder, facts, _ = folders["map-intensity"]
        for name, (title, gather) in CLASS_MAPS.items():
            if (folder / f"{name}.tif").is_file():
                draw = partial(class_figure, source, folder / f"{name}.tif", facts["classes"], gather, words)
                found[name] = title, draw
    if "map-origins" in folders:
        found["from_where"] = "from_where", partial(origins_figure, source, folders["map-origins"][0], words)
    if "vary" in folders:
        facts = folders["vary"][1]
        for k, outcome in enumerate(outcomes_of(facts)):
            if any(
                row[each] != row["as_it_is"] for row in of_outcome(facts, outcome) for each in ("at_low", "at_high")
            ):
                found[f"varied_{k}"] = "varied", partial(tornado_figure, facts, outcome, words)
    return {name: Drawing(f"{key}_{name}", words.say(title), draw, words) for name, (title, draw) in found.items()}


def _slope(source: ReportedRun, words: Words, extent: Extent | None = None) -> tuple[Figure, Any, list[Any]]:
    """A map with the relief and the lines only, of the run or of a part of it, and the first entries of the legend."""
    west, south, east, north = extent = extent or source.extent
    figure, axes = map_frame(extent, words, NARROW)
    if source.ground is not None:
        draw_relief(axes, source)
    seen = source.lines is not None and source.lines.intersects(shapely.box(west, south, east, north)).any()
    lines = roads(axes, source, words) if seen else []
    axes.set(xlim=(west, east), ylim=(south, north))
    return figure, axes, lines


def _finished(figure: Figure, axes: Any, handles: list[Any]) -> Figure:
    scale_and_north(axes)
    legend_of_map(figure, handles)
    return figure


def tree_effect_figure(source: ReportedRun, values: Any, words: Words) -> Figure:
    """Every object at its place; the size of its dot is its gain, summed over the lines."""
    figure, axes, handles = _slope(source, words)
    by_thing = values.groupby(["kind", "id"], sort=False)
    gain = by_thing["gain_logs"].sum().to_numpy(float)
    shapes = by_thing["geometry"].first()
    x, y = shapely.get_coordinates(shapely.centroid(np.asarray(shapes, object))).T
    idle = gain == 0.0
    some = np.flatnonzero(idle)[thinned_rows(int(idle.sum()), MOST_DOTS)]
    show_dots(axes, x[some], y[some], 1.8, PLAIN, zorder=3.0)
    largest = max(float(np.abs(gain).max()), 1.0)
    for sign, colour, zorder in ((-1.0, BRINGS, 6), (1.0, KEEPS, 7)):
        mine = sign * gain > 0.0
        size = 12.0 + 110.0 * np.sqrt(np.abs(gain[mine]) / largest)
        axes.scatter(
            x[mine], y[mine], s=size, color=colour, alpha=0.85, edgecolors="white", linewidths=0.5, zorder=zorder
        )
    best = [k for k in np.argsort(-gain, kind="stable")[:NAMED] if gain[k] > 0.0]
    handles += [
        Line2D([], [], linestyle="none", marker="o", markersize=size, color=colour, label=words.say(phrase))
        for colour, phrase, size in ((KEEPS, "keeps", 7), (BRINGS, "brings", 7), (PLAIN, "no_tree_effect", 3))
    ]
    _finished(figure, axes, handles)
    show_names(figure, axes, [(plain(shapes.index[k][1]), (x[k], y[k])) for k in best])
    return figure


def show_names(figure: Figure, axes: Any, names: list[tuple[str, tuple[float, float]]], **box: Any) -> None:
    """Names beside their places, each at the first of some sides where it covers no other; without room, none."""
    figure.draw_without_rendering()  # its layout is what sides are measured in
    taken: list[Any] = []
    look = {"boxstyle": "round,pad=0.12", "facecolor": "white", "linewidth": 0} | box
    for name, place in names:
        for up, across in product((4, -12, 18, -26), (6, -6)):
            shown = axes.annotate(
                name,
                place,
                xytext=(across, up),
                textcoords="offset points",
                ha="left" if across > 0 else "right",
                color="#111111",
                zorder=9,
                bbox=look,
            )
            room = shown.get_window_extent().padded(2.0)
            if not any(room.overlaps(other) for other in taken):
                taken.append(room)
                break
            shown.remove()


def siting_figure(source: ReportedRun, folder: Path, words: Words) -> Figure:
    """The chosen barriers, by the step in which they were chosen, and the run's own."""
    figure, axes, handles = _slope(source, words)
    frame = read_table(f"{folder / 'barriers.gpkg'}|layername=barriers", what="barriers")
    steps = frame["step"].to_numpy(int)
    for chosen, colour, phrase in ((False, BARRIER, "layer_barriers"), (True, CHOSEN, "chosen_barrier")):
        mine = frame[(steps > 0) == chosen]
        if len(mine):
            show_lines(axes, lines_of_shapes(mine.geometry), 3.2, colour, zorder=6)
            handles.append(Line2D([], [], color=colour, linewidth=3.2, label=words.say(phrase)))
    _finished(figure, axes, handles)
    ends = [
        (str(steps[row]), shapely.get_coordinates(frame.geometry.iloc[row])[-1]) for row in np.flatnonzero(steps > 0)
    ]
    show_names(figure, axes, ends, edgecolor=CHOSEN, linewidth=1)
    return figure


def class_figure(
    source: ReportedRun, path: Path, classes: list[dict[str, Any]], gather: Callable[..., Any], words: Words
) -> Figure:
    """A raster of classes over the relief, in the colours of its own table."""
    figure, axes, handles = _slope(source, words)
    with rasterio.open(path) as raster:
        values, (west, south, east, north) = thinned_raster(raster, source.extent, gather)
        table = raster.colormap(1)
    mine = [each for each in classes if each["map"] == path.stem]
    top = max(each["class"] for each in mine)
    colours = [tuple(part / 255.0 for part in table[k][:3]) for k in range(1, top + 1)]
    axes.imshow(
        values,
        cmap=ListedColormap(colours),
        vmin=0.5,
        vmax=top + 0.5,
        alpha=0.85,
        extent=(west, east, south, north),
        origin="lower",
        interpolation="nearest",
        zorder=2,
    )
    axes.set(xlim=(source.extent[0], source.extent[2]), ylim=(source.extent[1], source.extent[3]))
    handles += [Patch(facecolor=colours[each["class"] - 1], alpha=0.85, label=words.of_class(each)) for each in mine]
    return _finished(figure, axes, handles)


def origins_figure(source: ReportedRun, folder: Path, words: Words) -> Figure:
    """The share of the logs released in each cell that reaches any line."""
    with rasterio.open(folder / "origins.tif") as raster:
        values, (west, south, east, north) = thinned_raster(raster, source.extent, np.nanmean)
    near = around_known(values, (west, south, east, north), source.extent)
    figure, axes, handles = _slope(source, words, near)
    image = show_quantity(axes, values, "danger", (west, east, south, north))
    axes.set(xlim=(near[0], near[2]), ylim=(near[1], near[3]))
    show_scale(figure, image, "danger", words.say("from_where_map"), signs=words.signs, ax=axes)
    return _finished(figure, axes, handles)


def around_known(values: NDArray[np.float64], place: Extent, whole: Extent) -> Extent:
    """The cells with values (row 0 south, at ``place``), with as much ground around them, within the whole map."""
    rows, columns = np.nonzero(np.isfinite(values))
    if not rows.size:
        return whole
    x, y = (place[2] - place[0]) / values.shape[1], (place[3] - place[1]) / values.shape[0]
    west, east = place[0] + columns.min() * x, place[0] + (columns.max() + 1) * x
    south, north = place[1] + rows.min() * y, place[1] + (rows.max() + 1) * y
    room = max(0.5 * max(east - west, north - south), ROOM_M)
    return (
        float(max(west - room, whole[0])),
        float(max(south - room, whole[1])),
        float(min(east + room, whole[2])),
        float(min(north + room, whole[3])),
    )


def outcomes_of(facts: dict[str, Any]) -> list[str]:
    """The outcomes of vary, lines first."""
    names = list(dict.fromkeys(row["outcome"] for row in facts["tornado"]))
    return sorted(names, key=lambda name: not name.startswith("reach_"))


def of_outcome(facts: dict[str, Any], outcome: str) -> list[dict[str, Any]]:
    return [row for row in facts["tornado"] if row["outcome"] == outcome]


def outcome_words(name: str, words: Words) -> str:
    if name.startswith("reach_"):
        return words.say("outcome_reach", line=name.removeprefix("reach_"))
    return words.say("outcome_runout")


def tornado_figure(facts: dict[str, Any], outcome: str, words: Words) -> Figure:
    """A bar a factor, from its low to its high end, in the order of the table."""
    rows = of_outcome(facts, outcome)
    labels = [textwrap.wrap(f"{factor_words(row['factor'], words)}, {range_words(row, words)}", LABEL) for row in rows]
    step = 0.1 + 0.16 * max(len(each) for each in labels)  # inches of a row
    figure = Figure(figsize=(WIDTH, 1.3 + step * len(rows)), layout="constrained")
    axes = figure.subplots()
    scale = 100.0 if outcome.startswith("reach_") else 1.0
    base = scale * rows[0]["as_it_is"]
    for k, row in enumerate(rows):
        show_ends(axes, k, base, scale * row["at_low"], scale * row["at_high"])
        axes.text(1.01, k, swing_words(row, scale, words), transform=axes.get_yaxis_transform(), va="center")
    axes.axvline(base, color=INK, linewidth=1.2, zorder=3)
    ends = [scale * row[each] for row in rows for each in ("at_low", "as_it_is", "at_high")]
    axes.set_xlim(*limits_of_ends(ends, 100.0 if outcome.startswith("reach_") else math.inf))
    axes.set_yticks(range(len(rows)), ["\n".join(map(plain, each)) for each in labels])
    axes.set(ylim=(len(rows) - 0.4, -0.6), xlabel=plain(outcome_words(outcome, words)))
    axes.grid(axis="y", visible=False)
    handles = [
        Patch(color=LOW_END, label=words.say("low_end")),
        Patch(color=HIGH_END, label=words.say("high_end")),
    ]
    handles.append(Line2D([], [], color=INK, linewidth=1.2, label=words.say("as_it_is")))  # type: ignore[arg-type]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def swing_words(row: dict[str, Any], scale: float, words: Words) -> str:
    """The change from the low end to the high one, with its interval."""
    value, low, high = (
        float("nan") if each is None else scale * each for each in (row["swing"], row["ci_low"], row["ci_high"])
    )
    return with_interval(value, low, high, words, signed=True)


def factor_words(name: str, words: Words) -> str:
    return words.say_or(f"factor_{name}", name)


def range_words(row: dict[str, Any], words: Words) -> str:
    """``0.2–0.3``, or the two that a choice is between: ``upright / lying, random direction``."""
    ends = (row["low"], row["high"])
    if all(isinstance(each, (int, float)) for each in ends):
        return "–".join(decimal(each, words) for each in ends)
    return " / ".join(words.say_or(f"posture_{each}", str(each)) for each in ends)
