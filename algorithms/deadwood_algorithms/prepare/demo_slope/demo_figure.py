"""The demo's picture: where logs pass, over the relief, one panel for each forest, with releases, road, trees and
deposits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import shapely
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.pictures import scale_and_north, show_lines, show_quantity, show_relief, show_scale
from deadwood_algorithms.files.rasters import read_raster_on
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.schemas.looks import ENDS, RELEASE, ROAD, TREE
from deadwood_algorithms.stats.endings import ended
from deadwood_algorithms.stats.statistics import percent_with_interval

MARKERS = {"circle": "o", "triangle": "^", "square": "s", "cross2": "x"}
TITLES = {"mapped": "Forest as mapped", "random": "Random forest, same density", "none": "No forest"}
PANEL_IN = 4.9  # width of a panel
MARGIN_M = 30.0  # shown above the releases


def draw(folder: Path, forests: Sequence[str], summaries: Mapping[str, Any], path: Path) -> None:
    """Draw the runs in ``folder``; every panel has the same frame and the same colours."""
    dem = read_dem(folder / "dem.tif")
    hits = {
        name: read_raster_on(folder / f"run_{name}" / "reach_probability.tif", dem, what="shares") for name in forests
    }
    areas = read_vector(folder / "release_area.gpkg", geometry=("polygon",), target_crs=dem.crs, what="release areas")
    road = read_vector(folder / "road.gpkg", geometry=("line",), target_crs=dem.crs, what="lines")
    west, south, east, north = dem.bounds
    top = min(north, float(areas.total_bounds[3]) + MARGIN_M)

    # The figure is as high as its panels need, plus the titles above and the legend below.
    panel = PANEL_IN * (top - south) / (east - west)
    height = panel + 1.15 + 0.75
    figure, panels = plt.subplots(1, len(forests), figsize=(PANEL_IN * 3.26, height), sharey=True)
    figure.subplots_adjust(left=0.012, right=0.93, bottom=0.75 / height, top=1.0 - 1.15 / height, wspace=0.025)
    image: Any = None
    for axes, name in zip(panels, forests, strict=True):
        extent = (west, east, south, north)
        show_relief(axes, dem.values, dem.cell, extent)
        image = show_quantity(axes, hits[name], "shares", extent, zorder=1)
        _trees(axes, folder / f"trees_{name}.gpkg", dem)
        _deposits(axes, folder / f"run_{name}" / "run.gpkg", dem)
        show_lines(axes, [shapely.get_coordinates(line) for line in road.geometry], 2.2, zorder=3)
        for area in areas.geometry:
            axes.plot(*area.exterior.xy, color=RELEASE, linewidth=2.0, zorder=5)
        axes.set(xlim=(west, east), ylim=(south, top), xticks=[], yticks=[], aspect="equal")
        axes.set_title(_title(name, summaries[name]), fontsize=10.5, loc="left", linespacing=1.35)
    scale_and_north(panels[0])
    box = panels[-1].get_position()
    place = figure.add_axes((0.94, box.y0, 0.012, box.height))
    show_scale(figure, image, "shares", "logs that pass over the cell [%] (none: transparent)", cax=place)
    _legend(figure, {name for each in summaries.values() for name in _ends(each)})
    figure.suptitle(
        "Sliding deadwood on a synthetic slope of 35°: the same logs, three forests", x=0.02, ha="left", fontsize=13
    )
    figure.savefig(path, dpi=120)
    plt.close(figure)


def _trees(axes: Axes, path: Path, dem: Grid) -> None:
    if path.exists():
        trees = read_vector(path, target_crs=dem.crs, what="trees")
        size = (trees["dbh_cm"].to_numpy() / 30.0) ** 2
        axes.scatter(trees.geometry.x, trees.geometry.y, s=size, color=TREE, linewidths=0, zorder=2, alpha=0.8)


def _deposits(axes: Axes, path: Path, dem: Grid) -> None:
    deposits = read_vector(f"{path}|layername=deposits", target_crs=dem.crs, what="deposits")
    for reason, (_, colour, shape) in ENDS.items():
        marker = MARKERS[shape]
        some = deposits[ended(deposits, reason)]
        edges = {} if marker == "x" else {"edgecolors": "black", "linewidths": 0.25}
        axes.scatter(some.geometry.x, some.geometry.y, s=7, color=colour, marker=marker, zorder=4, **edges)


def _ends(summary: Mapping[str, Any]) -> list[str]:
    return [name for name, count in summary["logs"]["by_stop_reason"].items() if count]


def _title(name: str, summary: Mapping[str, Any]) -> str:
    spread = summary["spread"][0]["spread_deg"]
    fan = "" if spread is None else f" · lateral spread {spread:.0f}°"
    return f"{TITLES[name]}\nreach the road: {percent_with_interval(summary['reach'][0])}{fan}"


def _legend(figure: Any, ends: set[str]) -> None:
    marks: list[Line2D] = [
        Line2D([], [], linestyle="", marker="o", markersize=8, color=RELEASE, fillstyle="none", label="release area"),
        Line2D([], [], color=ROAD, linewidth=2.2, label="road"),
        Line2D([], [], linestyle="", marker="o", markersize=3, color=TREE, label="standing tree (size: DBH)"),
    ]
    for name, (label, colour, shape) in ENDS.items():
        if name in ends:
            marker = MARKERS[shape]
            edge = colour if marker == "x" else "black"
            marks.append(
                Line2D(
                    [],
                    [],
                    linestyle="",
                    marker=marker,
                    markersize=5,
                    color=colour,
                    markeredgecolor=edge,
                    markeredgewidth=0.4,
                    label=f"deposit: {label}",
                )
            )
    figure.legend(handles=marks, loc="lower left", bbox_to_anchor=(0.006, 0.0), ncols=6, frameon=False, fontsize=9.5)
