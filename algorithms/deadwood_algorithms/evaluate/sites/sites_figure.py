"""The map of `run-sites`: where the sites are, and which share of their logs reaches a line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import rasterio
import shapely
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.sites.overview import FAILED, SiteFound
from deadwood_algorithms.files.pictures import (
    HALO,
    colours_of,
    lines_of_shapes,
    scale_and_north,
    show_lines,
    show_quantity,
    show_scale,
)
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.results.run_folder import GEOPACKAGE
from deadwood_algorithms.schemas.looks import ENDS, LOOKS, PLAIN, ROAD

if TYPE_CHECKING:
    import geopandas

RAMP, SHARES = colours_of(LOOKS["shares"])
MOST_CELLS, CELLS_DRAWN = 2**28, 900  # of a raster that is read for the map; and drawn along its longer side
NAMED = 40  # up to so many sites are named; more names would hide the map
MARGIN = 0.08
NEAR = 0.05  # of the layer's size: names of sites closer than this would overlap
COLOURS = {"none": PLAIN, "failed": ENDS["failed"][1]}
SIZE_IN, LEAST_DOTS = 8.0, 9.0


def draw(path: Path, layer: geopandas.GeoDataFrame, done: Sequence[SiteFound], merged: Sequence[Path]) -> None:
    """One mark per site, coloured by the largest share of its logs that reaches a line; its name if there is room.

    If the folder has ``merged`` rasters in the layer's CRS, the map also shows where logs passed.
    """
    figure, axes = plt.subplots(figsize=(SIZE_IN, SIZE_IN), layout="constrained")
    worst = layer.sort_values("p", ascending=False, na_position="last").drop_duplicates("site").sort_index()
    centres = np.array([each.coords[0] for each in shapely.centroid(worst.geometry.to_numpy())])
    failed, share = (worst["status"] == FAILED).to_numpy(), worst["p"].to_numpy(float)
    layer.drop_duplicates("site").boundary.plot(ax=axes, color="#444444", linewidth=0.6)
    known = np.isfinite(share) & ~failed
    kinds = ((~known & ~failed, COLOURS["none"], "o"), (failed, COLOURS["failed"], "x"))
    for chosen, colour, mark in kinds:
        axes.scatter(*centres[chosen].T, color=colour, marker=mark, s=LEAST_DOTS**2 / 2, zorder=3)
    dots = axes.scatter(
        *centres[known].T,
        c=share[known],
        cmap=RAMP,
        norm=SHARES,
        s=LEAST_DOTS**2,
        edgecolor="black",
        linewidth=0.6,
        zorder=3,
    )
    if len(worst) <= NAMED:
        reach = NEAR * float(np.ptp(layer.total_bounds.reshape(2, 2), axis=0).max())
        for k, (name, (x, y)) in enumerate(zip(worst["site"], centres, strict=True)):
            before = int((np.abs(centres[:k] - centres[k]).max(axis=1) < reach).sum())  # below their names
            place = (6, 4 - 11 * before)
            axes.annotate(
                name, (x, y), xytext=place, textcoords="offset points", fontsize=8, path_effects=HALO, zorder=4
            )
    strings = reached_lines(done, layer.crs)
    show_lines(axes, strings, zorder=2)
    extents = [layer.total_bounds, *show_passed(axes, merged, layer.crs)]
    (west, south), (east, north) = np.min(extents, axis=0)[:2], np.max(extents, axis=0)[2:]
    middle, half = ((west + east) / 2, (south + north) / 2), (0.5 + MARGIN) * max(east - west, north - south)
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
    axes.set(xticks=[], yticks=[], xlabel="", ylabel="", aspect="equal", facecolor="#F2F2F2")
    scale_and_north(axes)
    if known.any():
        words = "share of the logs [%]: dots, that reach a line; ground, that pass (of all sites)"
        show_scale(figure, dots, "shares", words, ax=axes, shrink=0.6)
    words = ("no roads, railways, houses", FAILED)
    marks = [
        Line2D([], [], linestyle="", marker=mark, color=colour, label=word)
        for (chosen, colour, mark), word in zip(kinds, words, strict=True)
        if chosen.any()
    ]
    marks += [Line2D([], [], color=ROAD, linewidth=2.0, label="roads, railways, houses")] if strings else []
    if marks:
        axes.legend(handles=marks, loc="lower right", fontsize=8)
    title = f"{counted(len(worst), 'site')}, {counted(sum(each.logs for each in done), 'log')}"
    axes.set_title(title + (f"; {int(failed.sum())} failed" if failed.any() else ""), fontsize=11)
    figure.savefig(path, dpi=110, bbox_inches="tight")  # without white bands beside a map that is square
    plt.close(figure)


def reached_lines(done: Sequence[SiteFound], crs: Any) -> list[NDArray[np.float64]]:
    """The roads, railways and houses of the sites, each once; houses as outlines."""
    seen: dict[bytes, Any] = {}
    for folder in (each.folder for each in done if each.folder is not None and each.rows[0].line_id is not None):
        layer = f"{folder / GEOPACKAGE}|layername=reach"
        frame = read_vector(layer, geometry=("line", "polygon"), target_crs=crs, what="reach", feedback=Quiet())
        seen |= {each.wkb: each for each in frame.geometry}
    return lines_of_shapes(list(seen.values()))


def show_passed(axes: Axes, merged: Sequence[Path], crs: Any) -> list[tuple[float, float, float, float]]:
    """Draw the cells that logs passed, at reduced resolution; returns their extent (west, south, east, north)."""
    found = []
    for folder in merged:
        with rasterio.open(folder / "reach_probability.tif") as source:
            if source.width * source.height > MOST_CELLS or (source.crs and crs and source.crs != crs):
                continue
            share = source.read(1)
            passed = np.argwhere(share > 0.0)
            if not len(passed):
                continue
            (top, left), (bottom, right) = passed.min(axis=0), passed.max(axis=0) + 1
            step = max(1, math.ceil(max(bottom - top, right - left) / CELLS_DRAWN))
            seen = share[top:bottom:step, left:right:step]
            cell, west, north = source.transform.a, source.transform.c, source.transform.f
            west, north = west + cell * left, north - cell * top
        high, wide = (step * cell * size for size in seen.shape)
        show_quantity(axes, seen[::-1], "shares", (west, west + wide, north - high, north), alpha=1.0, zorder=1)
        found.append((west, north - high, west + wide, north))
    return found
