"""The picture of `compare-scenarios`: reach and run-outs side by side, and where logs pass more often or less."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import rasterio
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter
from rasterio.enums import Resampling

from deadwood_algorithms.pictures import (
    COLOURS,
    PERCENT,
    Frame,
    draw_outlines,
    draw_relief,
    frame_around,
    scale_and_north,
)
from deadwood_algorithms.runs.edges import Edges
from deadwood_algorithms.runs.folder import input_paths
from deadwood_algorithms.scenarios.measures import ScenarioRow
from deadwood_algorithms.scenarios.runs import Compared
from deadwood_algorithms.tool import Feedback

LINES_SHOWN = 6
MAPS_SHOWN = 3
CELLS_DRAWN = 900  # along the longer side of the map
MARGIN = 0.06
LINE = "#000000"
RAMP = "RdBu_r"
NOTHING = 0.02  # of the ramp's end: less is not drawn, so that the relief is seen
# Of the figure [in]; every panel, chart or map, has the same size.
PANEL, LEFT, BETWEEN_CHARTS, BETWEEN_MAPS, RIGHT, BELOW, ABOVE = 3.7, 0.65, 0.75, 0.15, 0.95, 0.75, 0.8


def draw(
    path: Path, rows: Sequence[ScenarioRow], compared: Compared, maps: dict[str, Path], feedback: Feedback
) -> None:
    """Reach of the lines (without lines, how logs ended), run-outs, and a map for each scenario but the first."""
    shown = dict(list(maps.items())[:MAPS_SHOWN])
    names = [each.name for each in compared.scenarios]
    bands = {name: read_band(place) for name, place in shown.items()}
    frame = _frame(compared, list(bands.values()))
    high = PANEL * (frame[3] - frame[2]) / (frame[1] - frame[0])
    width = LEFT + 2 * PANEL + BETWEEN_CHARTS + RIGHT * bool(shown)
    width += len(shown) * (PANEL + BETWEEN_MAPS) + (0.0 if shown else 0.2)
    height = BELOW + high + ABOVE
    figure = plt.figure(figsize=(width, height))

    def panel(left: float) -> Axes:
        return figure.add_axes((left / width, BELOW / height, PANEL / width, high / height))

    _shares_panel(panel(LEFT), rows, names)
    _runouts_panel(panel(LEFT + PANEL + BETWEEN_CHARTS), compared)
    if shown:
        far = max(float(np.nanquantile(np.abs(band), 0.995)) for band, _ in bands.values()) or 1.0
        ground = _ground(compared, frame, feedback)
        left = LEFT + 2 * PANEL + BETWEEN_CHARTS + BETWEEN_MAPS
        for k, (name, (band, extent)) in enumerate(bands.items()):
            axes = panel(left + k * (PANEL + BETWEEN_MAPS))
            if ground:
                draw_relief(axes, *ground)
            difference(axes, band, extent, far, compared)
            axes.set(xlim=frame[:2], ylim=frame[2:], xticks=[], yticks=[], facecolor="#F2F2F2")
            axes.set_title(f"{name} minus {names[0]}", fontsize=10, loc="left")
            if k == 0:
                scale_and_north(axes)
        end = left + len(shown) * (PANEL + BETWEEN_MAPS)
        box = figure.add_axes((end / width, BELOW / height, 0.14 / width, high / height))
        bar = figure.colorbar(ScalarMappable(Normalize(-far, far), RAMP), cax=box)
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:+g}" if share else "0"))
        bar.set_label("percentage points", fontsize=8.5)
        bar.ax.tick_params(labelsize=8.5)
        _legend(figure, left / width, bool(compared.lines))
    title = f"{compared.log_id.size} logs in each scenario, bars: 95 % intervals"
    if shown:
        title += "; maps: difference of the share of logs that pass"
    if len(maps) > len(shown):
        title += f" (the first {len(shown)} of {len(maps)})"
    figure.suptitle(title, x=0.15 / width, y=1.0 - 0.12 / height, ha="left", va="top", fontsize=11)
    figure.savefig(path, dpi=110)
    plt.close(figure)


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
        bars = np.clip([value - [row.low for row in mine], [row.high for row in mine] - value], 0.0, None)
        colour = COLOURS[k % len(COLOURS)]
        axes.bar(
            place, value, 0.9 * width, yerr=bars, color=colour, capsize=2.5, label=name, error_kw={"linewidth": 1.0}
        )
        most = np.array([row.value_high_if_lost for row in mine])
        if (most > value).any():
            label = "if all do that left\nthe terrain model before" if k == len(names) - 1 else None
            axes.bar(place, most - value, 0.9 * width, bottom=value, fill=False, edgecolor="#777777", linestyle=":",
                     linewidth=1.0, label=label)  # fmt: skip
    axes.set_xticks(np.arange(len(items[:LINES_SHOWN])), [each.replace("_", " ") for each in items[:LINES_SHOWN]])
    axes.yaxis.set_major_formatter(PERCENT)
    axes.set_ylim(0.0, 1.05 * max([*(max(row.high, row.value_high_if_lost) for row in of.values()), 0.01]))
    axes.set_title("logs that reach" if quantity == "reach" else "how logs ended", fontsize=10, loc="left")
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none")
    axes.grid(axis="y", color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)


def _runouts_panel(axes: Axes, compared: Compared) -> None:
    """Share of the logs that go farther than each distance; of those that left the terrain model, as far as seen."""
    for k, each in enumerate(compared.scenarios):
        far = np.sort(each.column("runout_m").astype(float))
        share = 1.0 - np.arange(1, far.size + 1) / far.size
        axes.step(
            [0.0, *far], [1.0, *share], where="post", color=COLOURS[k % len(COLOURS)], linewidth=1.3, label=each.name
        )
    axes.set(xlabel="run-out, horizontal [m]", ylim=(0.0, 1.02))
    axes.set_xlim(left=0.0)
    axes.yaxis.set_major_formatter(PERCENT)
    axes.set_title("logs that go farther than", fontsize=10, loc="left")
    axes.grid(color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)


def read_band(path: Path) -> tuple[np.ndarray, Frame]:
    """The map in as many cells as are drawn, and its extent (west, east, south, north)."""
    with rasterio.open(path) as source:
        step = max(1, math.ceil(max(source.shape) / CELLS_DRAWN))
        shape = (math.ceil(source.height / step), math.ceil(source.width / step))
        band = source.read(1, out_shape=shape, resampling=Resampling.average)
        bounds = source.bounds
    if not np.isfinite(band).any():
        band = np.zeros_like(band)
    return band, (bounds.left, bounds.right, bounds.bottom, bounds.top)


def _frame(compared: Compared, bands: Sequence[tuple[np.ndarray, Frame]]) -> Frame:
    """Around all that any of the maps shows, and the releases; neither much higher than wide nor the other way."""
    one = compared.reference
    x, y = [one.column("release_x")], [one.column("release_y")]
    for band, (west, east, south, north) in bands:
        known = np.isfinite(band)
        rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
        cell_x, cell_y = (east - west) / band.shape[1], (north - south) / band.shape[0]
        x.append(west + cell_x * np.array([columns[0], columns[-1] + 1]))
        y.append(north - cell_y * np.array([rows[0], rows[-1] + 1]))
    if not bands:
        return 0.0, 1.0, 0.0, 1.15
    x, y = np.concatenate(x), np.concatenate(y)
    margin = MARGIN * max(np.ptp(x), np.ptp(y)) + 5.0
    west, south, east, north = one.run.grid.bounds  # beyond it there is nothing to see
    x = np.clip([x.min() - margin, x.max() + margin], west, east)
    y = np.clip([y.min() - margin, y.max() + margin], south, north)
    return frame_around(x, y, margin=0.0, low=0.9, high=1.6)


def _ground(compared: Compared, frame: Frame, feedback: Feedback) -> Any:
    """Heights under the maps, of the first run whose terrain model still lies where it was."""
    for each in compared.scenarios:
        with Edges(each.run.grid, input_paths(each.run.path, each.run.manifest, "dem"), None) as edges:
            found = edges.ground(frame, CELLS_DRAWN)
        if found:
            return found
    feedback.note("the runs' terrain model was not found, so the maps are without relief")
    return None


def difference(axes: Axes, band: np.ndarray, extent: Frame, far: float, compared: Compared) -> None:
    """Blue where logs pass less often, red where more often; lines and releases above."""
    size = np.nan_to_num(np.abs(band) / far)
    shown = np.ma.masked_where(size < NOTHING, band)
    axes.imshow(shown, cmap=RAMP, vmin=-far, vmax=far, extent=extent, interpolation="nearest", zorder=1.5,
                alpha=np.clip(0.35 + 1.5 * size, 0.0, 0.95))  # fmt: skip
    draw_outlines(axes, compared.lines, LINE, 1.8)
    one = compared.reference
    axes.scatter(one.column("release_x"), one.column("release_y"), s=2, color=COLOURS[2], linewidths=0, zorder=4)


def _legend(figure: Any, left: float, with_lines: bool) -> None:
    def patch(colour: str, label: str) -> Line2D:
        return Line2D([], [], linestyle="", marker="s", markersize=8, color=colour, label=label)

    marks = [
        patch("#B2182B", "logs pass more often"),
        patch("#2166AC", "less often"),
        Line2D([], [], linestyle="", marker="o", markersize=4, color=COLOURS[2], label="release"),
    ]
    if with_lines:
        marks.append(Line2D([], [], color=LINE, linewidth=1.8, label="line, house"))
    figure.legend(handles=marks, loc="lower left", bbox_to_anchor=(left, 0.0), ncols=2, frameon=False, fontsize=8.5)
