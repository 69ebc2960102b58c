"""The figure of `site-barriers`: map of candidates and chosen barriers, remaining reach by place and height."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.transforms import ScaledTranslation

from deadwood_algorithms.evaluate.protection.siting import Siting
from deadwood_algorithms.files.pictures import scale_and_north, show_lines, show_relief
from deadwood_algorithms.results.relief import coordinates_of, read_relief
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.schemas.looks import BARRIER, CANDIDATE, CHOSEN, RELEASE, ROAD, RUNS

MARKS = "osD^vP*X"  # one for each height
ASIDE_IN = 0.08  # inches on paper between marks of two heights
MOST = 15  # places of a chart


def draw(path: Path, source: Run, siting: Siting, table: Any, frame: Any) -> None:
    """A map of the places, and beside it the remaining reach with its interval at each, for each height."""
    places = places_of(siting, table[table["step"] == 0])
    figure, (plan, chart) = plt.subplots(1, 2, figsize=(12.0, 5.6), layout="constrained")
    _map(plan, source, siting, frame, places)
    _chart(chart, places)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def places_of(siting: Siting, alone: Any) -> list[tuple[Any, Any]]:
    """The best `MOST` places, best first: each the line and the rows of its candidates, one a height."""
    place = dict(zip([each.id for each in siting.candidates], siting.place.tolist(), strict=True))
    groups = [rows for _, rows in alone.groupby(alone["barrier_id"].map(place))]
    best = sorted(groups, key=lambda rows: rows["p"].min())[:MOST]
    return [(siting.shapes[place[rows["barrier_id"].iloc[0]]], rows) for rows in best]


def _chart(axes: Any, places: Sequence[tuple[Any, Any]]) -> None:
    """Remaining reach, a row for each place with the number that it has on the map; one mark for each height."""
    marks: Any = pandas.concat([rows.assign(row=n) for n, (_, rows) in enumerate(places, 1)])
    heights, figure = list(marks.groupby("height_m")), axes.get_figure()
    for k, (height, rows) in enumerate(heights):
        aside = ScaledTranslation(0.0, ASIDE_IN * (0.5 * (len(heights) - 1) - k), figure.dpi_scale_trans)
        reach = 100.0 * rows[["p", "ci_low", "ci_high"]].to_numpy()
        axes.errorbar(
            reach[:, 0],
            rows["row"],
            xerr=np.abs(reach[:, 1:] - reach[:, :1]).T,
            fmt=MARKS[k % len(MARKS)],
            linewidth=0.8,
            capsize=2,
            markersize=5,
            label=f"{height:g} m high",
            transform=axes.transData + aside,
            color=RUNS[k % len(RUNS)],
        )
    lengths = [rows["length_m"].iloc[0] for _, rows in places]
    names = [f"{n}: {length:.0f} m long" for n, length in enumerate(lengths, 1)]
    axes.set_yticks(range(1, len(places) + 1), labels=names)
    axes.set(xlabel="logs that still reach a line [%]", title="One barrier alone, at each place on the map")
    axes.set_ylim(len(places) + 0.6, 0.4)
    axes.set_xlim(0.0, 105.0 * max(float(marks["ci_high"].max()), 1e-3))
    axes.grid(axis="x", color="#E5E5E5", linewidth=0.6)
    axes.legend(frameon=False, fontsize=9, loc="upper right")


def _map(axes: Any, source: Run, siting: Siting, frame: Any, places: Sequence[tuple[Any, Any]]) -> None:
    x, y = (source.deposits[f"release_{axis}"].to_numpy() for axis in "xy")
    lines = list(siting.plain.lines.geometry)
    bounds = np.array([*(each.bounds for each in siting.shapes), [x.min(), y.min(), x.max(), y.max()]])
    (west, south), (east, north) = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    margin = 0.15 * max(east - west, north - south) + 20.0
    extent = (float(west - margin), float(east + margin), float(south - margin), float(north + margin))
    relief = read_relief(source, extent)
    if relief is not None:
        show_relief(axes, *relief)
    axes.plot(x, y, ".", color=RELEASE, markersize=3.0, alpha=0.6, zorder=2)
    show_lines(axes, [np.transpose(each) for each in coordinates_of(lines)], 1.8, zorder=3)
    for each in coordinates_of(siting.shapes):
        axes.plot(*each, color=CANDIDATE, linewidth=1.4, zorder=4)
    words = {
        "ha": "center",
        "fontsize": 9,
        "zorder": 7,
        "path_effects": [withStroke(linewidth=2.5, foreground="white")],
    }
    for n, (shape, _) in enumerate(places, 1):
        middle = shape.interpolate(0.5, normalized=True)
        axes.annotate(str(n), (middle.x, middle.y), (0, 3), textcoords="offset points", **words)
    for shape, step in zip(frame.geometry, frame["step"], strict=True):
        axes.plot(*coordinates_of([shape])[0], color=CHOSEN if step else BARRIER, linewidth=3.0, zorder=5)
    axes.set(xlim=extent[:2], ylim=extent[2:], xticks=[], yticks=[], aspect="equal", facecolor="#F2F2F2")
    scale_and_north(axes)
    steps = [bool(each) for each in frame["step"]]
    marks = [
        *([Line2D([], [], color=CHOSEN, linewidth=3.0, label="chosen")] if any(steps) else []),
        *([Line2D([], [], color=BARRIER, linewidth=3.0, label="there already")] if not all(steps) else []),
        Line2D([], [], color=CANDIDATE, linewidth=1.4, label="candidates"),
        Line2D([], [], color=ROAD, linewidth=1.8, label="roads, railways, houses"),
        Line2D([], [], color=RELEASE, marker=".", linewidth=0.0, label="releases"),
    ]
    below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.01), "ncols": 3}
    axes.legend(handles=marks, fontsize=8, frameon=False, **below)
