"""The figure of `site-barriers`: map of candidates and chosen barriers, remaining reach by length and height."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from deadwood_algorithms.evaluate.protection.siting import Siting
from deadwood_algorithms.files.pictures import scale_and_north, show_lines, show_relief
from deadwood_algorithms.results.relief import coordinates_of, read_relief
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.schemas.looks import BARRIER, CANDIDATE, CHOSEN, RELEASE, ROAD, RUNS

MARKS = "osD^vP*X"  # one for each height
ASIDE_IN = 0.08  # inches on paper between marks of two heights
TICKS_MOST = 8  # lengths that are all named


def draw(path: Path, source: Run, siting: Siting, table: Any, frame: Any) -> None:
    """A map, and beside it the remaining reach with its interval against the length, for each height."""
    figure, (plan, chart) = plt.subplots(1, 2, figsize=(12.0, 5.6), layout="constrained")
    _map(plan, source, siting, frame)
    _chart(chart, table[table["step"] == 0])
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _chart(axes: Any, alone: Any) -> None:
    """Remaining reach against length; marks of different heights are drawn side by side at their common length."""
    heights = list(alone.groupby("height_m"))
    figure = axes.get_figure()
    for k, (height, rows) in enumerate(heights):
        aside = ScaledTranslation(ASIDE_IN * (k - 0.5 * (len(heights) - 1)), 0.0, figure.dpi_scale_trans)
        reach = 100.0 * rows[["p", "ci_low", "ci_high"]].to_numpy()
        axes.errorbar(
            rows["length_m"],
            reach[:, 0],
            yerr=np.abs(reach[:, 1:] - reach[:, :1]).T,
            fmt=MARKS[k % len(MARKS)],
            linewidth=0.8,
            capsize=2,
            markersize=5,
            label=f"{height:g} m high",
            transform=axes.transData + aside,
            color=RUNS[k % len(RUNS)],
        )
    lengths = np.unique(alone["length_m"].round(1))
    if lengths.size <= TICKS_MOST:
        axes.set_xticks(lengths)
    axes.set(xlabel="length [m]", ylabel="logs that still reach a line [%]", title="Each candidate alone")
    aside = max(0.15 * float(np.ptp(alone["length_m"])), 0.05 * float(alone["length_m"].max()))
    # matplotlib's own limits do not account for the shifted marks
    axes.set_xlim(alone["length_m"].min() - aside, alone["length_m"].max() + aside)
    axes.set_ylim(0.0, 105.0 * max(float(alone["ci_high"].max()), 1e-3))
    axes.legend(frameon=False, fontsize=9)


def _map(axes: Any, source: Run, siting: Siting, frame: Any) -> None:
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
    for shape, step in zip(frame.geometry, frame["step"], strict=True):
        axes.plot(*coordinates_of([shape])[0], color=CHOSEN if step else BARRIER, linewidth=3.0, zorder=5)
        if step:
            axes.annotate(f"{step}", shape.coords[-1], color=CHOSEN, fontsize=11, fontweight="bold", zorder=6)
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
