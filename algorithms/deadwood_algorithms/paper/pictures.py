"""The paper's figures from the twins' runs: hit counts over relief (3, 4a-b, A1), a jump (B1), friction and cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap, LogNorm

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.pictures import hillshade
from deadwood_algorithms.files.rasters import read_raster_on
from deadwood_algorithms.files.vectors import read_vector

HITS = ListedColormap(matplotlib.colormaps["magma_r"](np.linspace(0.12, 1.0, 256)))
ANY_SHAPE = ("point", "line", "polygon")
LINES = {"lines": "#CC79A7", "barriers": "#000000", "dams": "#E69F00", "releases": "#0072B2"}


def draw_hits(path: Path, title: str, panels: Sequence[tuple[str, Path, str, Mapping[str, str | None]]]) -> None:
    """One panel a run: its title, its folder, its terrain model, and the layers drawn over it by kind."""
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    dem = read_dem(panels[0][2])
    west, south, east, north = dem.bounds
    high = 5.6 * (north - south) / (east - west) + 0.7
    figure, axes = plt.subplots(
        rows, columns, figsize=(5.6 * columns + 1.2, high * rows + 0.6), squeeze=False, layout="constrained"
    )
    hits = [read_raster_on(run / "hit_count.tif", read_dem(terrain), what="hits") for _, run, terrain, _ in panels]
    norm = LogNorm(1, max(2.0, *(float(np.nanmax(each)) for each in hits)))
    shown = None
    for axis, (name, _, terrain, layers), counts in zip(axes.flat, panels, hits, strict=False):
        ground = read_dem(terrain)
        extent = (west, east, south, north)
        axis.imshow(
            hillshade(ground.values, ground.cell), cmap="gray", vmin=-0.6, vmax=1.05, extent=extent, origin="lower"
        )
        masked = np.ma.masked_less(np.nan_to_num(counts), 1.0)
        shown = axis.imshow(masked, cmap=HITS, norm=norm, extent=extent, origin="lower", interpolation="nearest")
        for kind, layer in layers.items():
            if layer:
                frame = read_vector(layer, geometry=ANY_SHAPE, target_crs=dem.crs, what=kind)
                if kind == "trees":
                    size = (frame["dbh_cm"].to_numpy() / 60.0) ** 2
                    axis.scatter(frame.geometry.x, frame.geometry.y, s=size, color="#0B5D2A", linewidths=0, alpha=0.7)
                else:
                    frame.plot(ax=axis, color=LINES[kind], linewidth=1.6, markersize=26, zorder=4)
        axis.set(xlim=(west, east), ylim=(south, north), xticks=[], yticks=[], xlabel="", ylabel="", aspect="equal")
        axis.set_title(name, fontsize=10, loc="left")
        axis.plot([west + 15, west + 65], [south + 12] * 2, color="black", linewidth=3)
        axis.text(west + 40, south + 16, "50 m", ha="center", fontsize=8)
    for axis in axes.flat[len(panels) :]:
        axis.axis("off")
    if shown is not None:
        figure.colorbar(shown, ax=axes, shrink=0.7, label="logs that passed over the cell")
    figure.suptitle(f"{title}\npink: road and other lines, black: barriers, orange: dams, blue: releases", fontsize=11)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def draw_jump(path: Path, poses: Mapping[str, np.ndarray], dem: str, words: str, since_s: float = 0.0) -> None:
    """Fig. B1 as a profile: terrain, the path of the centre of mass, and the log at its highest and around.

    The highest is looked for after ``since_s``, the take-off: at the start the log stands upright.
    """
    ground = read_dem(dem)
    x, y, z = (np.asarray(poses[name], float) for name in "xyz")
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    terrain = ground.height(x, y)
    figure, axes = plt.subplots(figsize=(10, 5.5))
    axes.fill_between(way, terrain, np.nanmin(terrain) - 5.0, color="#b9ab94", label="terrain under the path")
    axes.plot(way, z, color="#0072B2", linewidth=1.2, label="centre of mass")
    top = int(np.nanargmax(np.where(np.asarray(poses["t_s"]) >= since_s, z - terrain, -np.inf)))
    for k in sorted({max(0, top + step) for step in range(-30, 31, 6)}):
        if k < way.size:
            ends = [np.hypot(poses[f"x{e}"][k] - x[k], poses[f"y{e}"][k] - y[k]) for e in "bt"]
            side = [np.sign((poses[f"y{e}"][k] - y[k]) * -1.0) for e in "bt"]
            axes.plot([way[k] + side[j] * ends[j] for j in (0, 1)], [poses["zb"][k], poses["zt"][k]],
                      color="#D55E00" if k == top else "#5a3d1e", linewidth=2.4)  # fmt: skip
    axes.set(xlabel="distance along the path in plan [m]", ylabel="height [m]", title=words)
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def draw_sweeps(path: Path, sweeps: Mapping[float, Sequence[Mapping[str, Any]]], road: str) -> None:
    """Reach against friction, one line a cell size."""
    figure, axes = plt.subplots(figsize=(7, 4.2))
    axes.axvspan(0.2, 0.3, color="#0072B2", alpha=0.12, label="the paper's range, 0.5 m cells")
    for (cell, rows), mark in zip(sorted(sweeps.items()), "os^Dv", strict=False):
        axes.plot([row["friction"] for row in rows], [100 * row[f"reach_{road}"] for row in rows], f"{mark}-",
                  label=f"{cell:g} m cells")  # fmt: skip
    axes.set(xlabel="friction coefficient", ylabel="logs that reach the road [%]", ylim=(0, None))
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)
