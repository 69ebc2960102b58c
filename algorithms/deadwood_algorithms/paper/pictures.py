"""The paper's figures from the twins' runs: hit counts over relief (3, 4a-b, A1), a jump (B1), friction and cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.pictures import scale_and_north, show_quantity, show_relief, show_scale
from deadwood_algorithms.files.rasters import read_raster_on
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.schemas.looks import BARRIER, RELEASE, ROAD, RUNS, TREE, WOOD

ANY_SHAPE = ("point", "line", "polygon")
LINES = {"lines": ROAD, "barriers": BARRIER, "dams": WOOD, "releases": RELEASE}


def draw_hits(path: Path, title: str, panels: Sequence[tuple[str, Path, str, Mapping[str, str | None]]]) -> None:
    """One panel for each run: its title, its folder, its terrain model, and the layers drawn over it, by kind."""
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    dem = read_dem(panels[0][2])
    west, south, east, north = dem.bounds
    high = 5.6 * (north - south) / (east - west) + 0.7
    figure, axes = plt.subplots(
        rows, columns, figsize=(5.6 * columns + 1.2, high * rows + 0.6), squeeze=False, layout="constrained"
    )
    hits = [
        read_raster_on(run / "reach_probability.tif", read_dem(terrain), what="shares") for _, run, terrain, _ in panels
    ]
    shown = None
    for axis, (name, _, terrain, layers), shares in zip(axes.flat, panels, hits, strict=False):
        ground = read_dem(terrain)
        extent = (west, east, south, north)
        show_relief(axis, ground.values, ground.cell, extent)
        shown = show_quantity(axis, shares, "shares", extent)
        for kind, layer in layers.items():
            if layer:
                frame = read_vector(layer, geometry=ANY_SHAPE, target_crs=dem.crs, what=kind)
                if kind == "trees":
                    size = (frame["dbh_cm"].to_numpy() / 60.0) ** 2
                    axis.scatter(frame.geometry.x, frame.geometry.y, s=size, color=TREE, linewidths=0, alpha=0.7)
                else:
                    frame.plot(ax=axis, color=LINES[kind], linewidth=1.6, markersize=9, zorder=4)
        axis.set(xlim=(west, east), ylim=(south, north), xticks=[], yticks=[], xlabel="", ylabel="", aspect="equal")
        axis.set_title(name, fontsize=10, loc="left")
        scale_and_north(axis)
    for axis in axes.flat[len(panels) :]:
        axis.axis("off")
    if shown is not None:
        show_scale(figure, shown, "shares", "logs that pass over the cell [%]", ax=axes, shrink=0.7)
    figure.suptitle(
        f"{title}\nvermilion: road and other lines, purple: barriers, brown: dams, blue: releases", fontsize=11
    )
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def draw_jump(path: Path, poses: Mapping[str, np.ndarray], dem: str, words: str, since_s: float = 0.0) -> None:
    """Fig. B1 as a profile: terrain, the path of the centre of mass, and the log at its highest point and around it.

    The highest point is searched for after ``since_s``, the take-off, because the log stands upright at the start.
    """
    ground = read_dem(dem)
    x, y, z = (np.asarray(poses[name], float) for name in "xyz")
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    terrain = ground.height(x, y)
    figure, axes = plt.subplots(figsize=(10, 5.5))
    axes.fill_between(way, terrain, np.nanmin(terrain) - 5.0, color="#b9ab94", label="terrain under the path")
    axes.plot(way, z, color=RUNS[0], linewidth=1.2, label="centre of mass")
    top = int(np.nanargmax(np.where(np.asarray(poses["t_s"]) >= since_s, z - terrain, -np.inf)))
    for k in sorted({max(0, top + step) for step in range(-30, 31, 6)}):
        if k < way.size:
            ends = [np.hypot(poses[f"x{e}"][k] - x[k], poses[f"y{e}"][k] - y[k]) for e in "bt"]
            side = [np.sign((poses[f"y{e}"][k] - y[k]) * -1.0) for e in "bt"]
            axes.plot(
                [way[k] + side[j] * ends[j] for j in (0, 1)],
                [poses["zb"][k], poses["zt"][k]],
                color=RUNS[1] if k == top else "#5a3d1e",
                linewidth=2.4,
            )
    axes.set(xlabel="distance along the path in plan [m]", ylabel="height [m]", title=words)
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def draw_sweeps(path: Path, sweeps: Mapping[float, Sequence[Mapping[str, Any]]], road: str) -> None:
    """Reach against friction, one line for each cell size."""
    figure, axes = plt.subplots(figsize=(7, 4.2))
    axes.axvspan(0.2, 0.3, color=RUNS[0], alpha=0.12, label="the paper's range, 0.5 m cells")
    for (cell, rows), mark, colour in zip(sorted(sweeps.items()), "os^Dv", RUNS, strict=False):
        axes.plot(
            [row["friction"] for row in rows],
            [100 * row[f"reach_{road}"] for row in rows],
            f"{mark}-",
            color=colour,
            label=f"{cell:g} m cells",
        )
    axes.set(xlabel="friction coefficient", ylabel="logs that reach the road [%]", ylim=(0, None))
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)
