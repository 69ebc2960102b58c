"""The figure of `map-origins`: origins of the logs that reach any line, and their uncertainty, over the relief."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.lines import Line2D

from deadwood_algorithms.evaluate.hazard.origins import ANY, Origins
from deadwood_algorithms.files.pictures import scale_and_north, show_lines, show_quantity, show_relief, show_scale
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.results.relief import Extent, coordinates_of, read_relief
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.schemas.looks import ROAD

MAP_IN, MOST_MAP_IN = 4.4, 9.0  # a map's width and greatest height [inches]
ROOM, LEAST_ROOM_M = 0.25, 5.0  # around the cells: a share of their longer side, and metres


def draw(path: Path, source: Run, origins: Origins, lines: Sequence[Any]) -> None:
    """Three maps with one colour scale: the share and the ends of its interval; with the lines near the cells."""
    frame = frame_around(origins)
    high = min(MAP_IN * (frame[3] - frame[2]) / (frame[1] - frame[0]), MOST_MAP_IN)
    figure, panels = plt.subplots(1, 3, figsize=(3.0 * MAP_IN + 1.2, high + 1.0), layout="constrained")
    near = shapely.box(frame[0], frame[2], frame[1], frame[3])
    roads = coordinates_of([each for each in lines if each.intersects(near)])
    relief = read_relief(source, frame)
    if relief is not None:  # no white strip at a side where the terrain has no whole cell
        ends = np.array([frame, relief[2]])
        frame = ends[:, 0].max(), ends[:, 1].min(), ends[:, 2].max(), ends[:, 3].min()
    west, south, east, north = origins.grid.bounds
    titles = ("share", "lower end of its 95 % interval", "upper end")
    order = (1, 0, 2)  # lower end, share, upper end, from left to right
    shares = origins.shares(ANY)
    image: Any = None
    for axes, k in zip(panels, order, strict=True):
        if relief is not None:
            show_relief(axes, *relief)
        image = show_quantity(axes, shares[k], "danger", (west, east, south, north))
        show_lines(axes, [np.transpose(road) for road in roads], 1.8, zorder=4)
        axes.set(xlim=frame[:2], ylim=frame[2:], xticks=[], yticks=[], aspect="equal", facecolor="#F2F2F2")
        axes.set_title(titles[k], fontsize=10, loc="left")
    scale_and_north(panels[0])
    show_scale(figure, image, "danger", "logs released in a cell that reach any line [%]", ax=panels, shrink=0.8)
    number = int(origins.released.sum())
    figure.suptitle(
        f"Places from which lines are reached: {counted(number, 'log')} in cells of {origins.grid.cell:g} m;\n"
        f"empty where fewer than {origins.least} were released",
        fontsize=11,
    )
    if roads:
        marks = [Line2D([], [], color=ROAD, linewidth=1.8, label="roads, railways, houses")]
        figure.legend(handles=marks, loc="outside lower left", ncols=2, frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def frame_around(origins: Origins) -> Extent:
    """West, east, south and north [m] of the cells in which logs started, with a margin."""
    west, south, _, _ = origins.grid.bounds
    cell = origins.grid.cell
    rows, columns = np.nonzero(origins.released)
    margin = ROOM * cell * max(np.ptp(rows) + 1, np.ptp(columns) + 1) + LEAST_ROOM_M
    return (
        float(west + cell * columns.min() - margin),
        float(west + cell * (columns.max() + 1) + margin),
        float(south + cell * rows.min() - margin),
        float(south + cell * (rows.max() + 1) + margin),
    )
