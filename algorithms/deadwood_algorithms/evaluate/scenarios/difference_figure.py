"""The picture of `compare-scenarios`: reach and run-outs, and below them maps of where logs pass more often or less.

The maps have one size, frame and colour scale; the relief of the reference's DEM is shown under them if that file is
found.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import rasterio
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter
from rasterio.enums import Resampling

from deadwood_algorithms.evaluate.scenarios.measures import ScenarioRow
from deadwood_algorithms.evaluate.scenarios.paired_runs import Compared
from deadwood_algorithms.files.pictures import scale_and_north, show_lines, show_quantity, show_relief, show_scale
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.results.relief import CELLS_DRAWN, Extent, coordinates_of, read_relief
from deadwood_algorithms.schemas.looks import LESS_MORE, RELEASE, ROAD, RUNS

LINES_SHOWN = 6
SHORT_NAME = 14  # longest name [letters] for which a key has three columns
MARGIN = 0.04
# Inches: a map's width and greatest height, the charts, margins.
MAP_IN, MOST_MAP_IN, CHARTS_IN = 4.6, 9.0, 4.2
MARGIN_IN, GAP_IN, TITLE_IN, LEGEND_IN, FOOT_IN, BAR_IN = 0.6, 0.35, 0.75, 0.35, 0.1, 0.9
MAPS_ABREAST = 3
Band = tuple[np.ndarray, Extent]
Place = tuple[float, float, float, float]


def draw(path: Path, rows: Sequence[ScenarioRow], compared: Compared, maps: dict[str, Path]) -> None:
    """Reach of the lines (without lines, how logs ended), run-outs, and a map for each scenario but the first."""
    bands = {name: read_band(place) for name, place in maps.items()}
    frame = frame_of(list(bands.values()))
    map_in = min(MAP_IN * (frame[3] - frame[2]) / (frame[1] - frame[0]), MOST_MAP_IN) if frame else 0.0
    (width, height), charts, places = places_of(len(bands), map_in)
    figure = plt.figure(figsize=(width, height))

    def panel(left: float, top: float, wide: float, high: float) -> Axes:
        """Axes whose top left corner lies at a distance [inches] from the figure's."""
        return figure.add_axes((left / width, 1.0 - (top + high) / height, wide / width, high / height))

    names = [each.name for each in compared.scenarios]
    _shares_panel(panel(*charts[0]), rows, names)
    _runouts_panel(panel(*charts[1]), compared)
    title = f"{counted(compared.log_id.size, 'log')} in each scenario, bars: 95 % intervals"
    figure.text(0.15 / width, 1.0 - 0.3 / height, title, fontsize=11)
    if frame:
        panels = [panel(*place) for place in places]
        _maps(panels, bands, frame, compared)
        bar_at = panel(max(place[0] for place in places) + MAP_IN + 0.15, places[0][1], 0.16, map_in)
        words = "share of the logs that pass a cell, difference [points]"
        show_scale(figure, panels[0].images[-1], "difference of shares", words, cax=bar_at)
        _legend(figure, names[0])
    figure.savefig(path, dpi=110)
    plt.close(figure)


def places_of(maps: int, map_in: float) -> tuple[tuple[float, float], list[Place], list[Place]]:
    """Size of the figure [inches], and left, top, width and height of its two charts and of its maps, ``map_in`` high:
    maps below the charts, but a single one beside them.
    """
    columns, chart_in = max(2, min(maps, MAPS_ABREAST)), CHARTS_IN - 0.5
    width = MARGIN_IN + columns * (MAP_IN + GAP_IN) + BAR_IN
    if maps == 1:
        wide = width - 3.0 * MARGIN_IN - MAP_IN - BAR_IN
        height = TITLE_IN + max(2.0 * CHARTS_IN, map_in + GAP_IN) + LEGEND_IN + FOOT_IN
        charts = [(MARGIN_IN, TITLE_IN + k * CHARTS_IN, wide, chart_in) for k in range(2)]
        return (width, height), charts, [(2.0 * MARGIN_IN + wide, TITLE_IN, MAP_IN, map_in)]
    wide, top = (width - 3.0 * MARGIN_IN) / 2.0, 2.0 * TITLE_IN + CHARTS_IN
    charts = [(MARGIN_IN + k * (MARGIN_IN + wide), TITLE_IN, wide, chart_in) for k in range(2)]
    places = [
        (MARGIN_IN + k % columns * (MAP_IN + GAP_IN), top + k // columns * (map_in + GAP_IN), MAP_IN, map_in)
        for k in range(maps)
    ]
    height = top + math.ceil(maps / columns) * (map_in + GAP_IN) + LEGEND_IN if maps else TITLE_IN + CHARTS_IN
    return (width, height + FOOT_IN), charts, places


def _maps(panels: list[Axes], bands: dict[str, Band], frame: Extent, compared: Compared) -> None:
    """The differences of one colour scale and frame, on the relief, with the lines and the releases."""
    one = compared.reference
    ground, roads = read_relief(one.run, frame), coordinates_of(compared.lines)
    for axes, (name, (band, extent)) in zip(panels, bands.items(), strict=True):
        if ground is not None:
            show_relief(axes, *ground)
        show_quantity(axes, band[::-1], "difference of shares", extent)
        show_lines(axes, [np.transpose(road) for road in roads], zorder=3)
        axes.scatter(one.column("release_x"), one.column("release_y"), s=2, color=RELEASE, linewidths=0, zorder=4)
        axes.set(xlim=frame[:2], ylim=frame[2:], xticks=[], yticks=[], aspect="equal", facecolor="#F2F2F2")
        axes.set_title(f"{name} minus {one.name}", fontsize=10, loc="left")
    scale_and_north(panels[0])


def _legend(figure: Figure, reference: str) -> None:
    marks = [
        Line2D([], [], linestyle="", marker="o", markersize=4, color=RELEASE, label="releases"),
        Line2D([], [], color=ROAD, linewidth=1.8, label="roads, railways, houses"),
        Patch(color=LESS_MORE[-2], label=f"more logs pass than in {reference}"),
        Patch(color=LESS_MORE[1], label="fewer"),
    ]
    figure.legend(handles=marks, loc="lower left", ncols=4, frameon=False, fontsize=9)


def _shares_panel(axes: Axes, rows: Sequence[ScenarioRow], names: Sequence[str]) -> None:
    """Bars by line and scenario."""
    quantity = "reach" if any(row.quantity == "reach" for row in rows) else "ended"
    items = list(dict.fromkeys(row.item for row in rows if row.quantity == quantity))
    of = {(row.scenario, row.item): row for row in rows if row.quantity == quantity}
    width = 0.8 / len(names)
    for k, name in enumerate(names):
        mine = [of[name, item] for item in items[:LINES_SHOWN]]
        place = np.arange(len(mine)) + (k - (len(names) - 1) / 2.0) * width
        value = np.array([row.value for row in mine])
        bars = np.clip([value - [row.ci_low for row in mine], [row.ci_high for row in mine] - value], 0.0, None)
        colour = RUNS[k % len(RUNS)]
        axes.bar(
            place, value, 0.9 * width, yerr=bars, color=colour, capsize=2.5, label=name, error_kw={"linewidth": 1.0}
        )
    axes.set_xticks(np.arange(len(items[:LINES_SHOWN])), [each.replace("_", " ") for each in items[:LINES_SHOWN]])
    axes.yaxis.set_major_formatter(FuncFormatter(_percent))
    columns = 1 if max(map(len, names)) > SHORT_NAME else 3
    above = 1.06 + 0.09 * -(-len(names) // columns)  # room for the key above the bars
    axes.set_ylim(0.0, above * max([*(row.ci_high for row in of.values()), 0.01]))
    axes.set_yticks([each for each in axes.get_yticks() if each <= 1.0])
    axes.set_title("logs that reach" if quantity == "reach" else "how logs ended", fontsize=10, loc="left")
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none", loc="upper center", ncols=columns)
    axes.grid(axis="y", color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)


def _runouts_panel(axes: Axes, compared: Compared) -> None:
    """Share of the logs with a longer run-out than each distance."""
    for k, each in enumerate(compared.scenarios):
        far = np.sort(each.runouts)
        share = 1.0 - np.arange(1, far.size + 1) / far.size
        share, far = share[np.isfinite(far)], far[np.isfinite(far)]  # it ends above 0 where logs have no deposit
        axes.step([0.0, *far], [1.0, *share], where="post", color=RUNS[k % len(RUNS)], linewidth=1.3, label=each.name)
    axes.set(xlabel="run-out, horizontal [m]", ylim=(0.0, 1.02))
    axes.set_xlim(left=0.0)
    axes.yaxis.set_major_formatter(FuncFormatter(_percent))
    axes.set_title("logs with a longer run-out than", fontsize=10, loc="left")
    axes.grid(color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)


def read_band(path: Path) -> Band:
    """The map, reduced to the number of cells that are drawn, and its extent (west, east, south, north)."""
    with rasterio.open(path) as source:
        step = max(1, math.ceil(max(source.shape) / CELLS_DRAWN))
        shape = (math.ceil(source.height / step), math.ceil(source.width / step))
        band = source.read(1, out_shape=shape, resampling=Resampling.average)
        bounds = source.bounds
    if not np.isfinite(band).any():
        band = np.zeros_like(band)
    return band, (bounds.left, bounds.right, bounds.bottom, bounds.top)


def frame_of(bands: Sequence[Band]) -> Extent | None:
    """West, east, south and north [m] of all cells that differ in any of the maps, with a margin."""
    found = []
    for band, extent in bands:
        known = np.isfinite(band)
        rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        x, y = (extent[1] - extent[0]) / band.shape[1], (extent[3] - extent[2]) / band.shape[0]
        west, east = extent[0] + columns[0] * x, extent[0] + (columns[-1] + 1) * x
        found.append((west, east, extent[3] - (rows[-1] + 1) * y, extent[3] - rows[0] * y))
    if not found:
        return None
    low, high = np.min(found, axis=0), np.max(found, axis=0)
    side = MARGIN * max(high[1] - low[0], high[3] - low[2]) + 5.0
    # no farther than the terrain
    least, most = np.min([extent for _, extent in bands], axis=0), np.max([extent for _, extent in bands], axis=0)
    west, east = max(low[0] - side, least[0]), min(high[1] + side, most[1])
    south, north = max(low[2] - side, least[2]), min(high[3] + side, most[3])
    return float(west), float(east), float(south), float(north)


def _percent(share: float, _: object) -> str:
    return f"{100 * share:g} %"
