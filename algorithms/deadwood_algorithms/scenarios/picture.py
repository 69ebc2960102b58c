"""The picture of `compare-scenarios`: reach and run-outs side by side, and where logs pass more often or less."""

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
from matplotlib.ticker import FuncFormatter
from rasterio.enums import Resampling

from deadwood_algorithms.scenarios.measures import ScenarioRow
from deadwood_algorithms.scenarios.runs import Compared

# Okabe and Ito's colours, which colour-blind readers tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
LINES_SHOWN = 6
CELLS_DRAWN = 700  # along the longer side of the map
MARGIN = 0.04


def draw(path: Path, rows: Sequence[ScenarioRow], compared: Compared, maps: dict[str, Path]) -> None:
    """Reach of the lines (without lines, how logs ended), run-outs, and a map for each scenario but the first."""
    shown = dict(list(maps.items())[:3])
    figure, panels = plt.subplots(1, 2 + len(shown), figsize=(8.6 + 4.2 * len(shown), 5.2))
    names = [each.name for each in compared.scenarios]
    _shares_panel(panels[0], rows, names)
    _runouts_panel(panels[1], compared)
    far = max((float(np.nanquantile(np.abs(band), 0.995)) for band, _ in map(read_band, shown.values())), default=1.0)
    for axes, (name, place) in zip(panels[2:], shown.items(), strict=True):
        difference(axes, place, far or 1.0, f"{name} minus {names[0]}", compared)
    if shown:
        bar = figure.colorbar(panels[-1].images[0], ax=panels[-1], fraction=0.05, pad=0.02)
        bar.ax.yaxis.set_major_formatter(FuncFormatter(percent))
    title = f"{compared.log_id.size} logs in each scenario, bars: 95 % intervals"
    figure.suptitle(
        title + ("; maps: share of the logs that pass, difference" if shown else ""), x=0.01, ha="left", fontsize=11
    )
    figure.tight_layout(rect=(0.0, 0.0, 1.0, 0.97), w_pad=1.2)
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
    axes.set_xticks(np.arange(len(items[:LINES_SHOWN])), [each.replace("_", " ") for each in items[:LINES_SHOWN]])
    axes.yaxis.set_major_formatter(FuncFormatter(percent))
    axes.set_ylim(0.0, 1.05 * max([*(row.high for row in of.values()), 0.01]))
    axes.set_title("logs that reach" if quantity == "reach" else "how logs ended", fontsize=10, loc="left")
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none")
    axes.grid(axis="y", color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)


def _runouts_panel(axes: Axes, compared: Compared) -> None:
    """Share of the logs that go farther than each distance."""
    for k, each in enumerate(compared.scenarios):
        far = np.sort(each.column("runout_m").astype(float))
        share = 1.0 - np.arange(1, far.size + 1) / far.size
        axes.step(
            [0.0, *far], [1.0, *share], where="post", color=COLOURS[k % len(COLOURS)], linewidth=1.3, label=each.name
        )
    axes.set(xlabel="run-out, horizontal [m]", ylim=(0.0, 1.02))
    axes.set_xlim(left=0.0)
    axes.yaxis.set_major_formatter(FuncFormatter(percent))
    axes.set_title("logs that go farther than", fontsize=10, loc="left")
    axes.grid(color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)


def read_band(path: Path) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """The map in as many cells as are drawn, and its extent (west, east, south, north)."""
    with rasterio.open(path) as source:
        step = max(1, math.ceil(max(source.shape) / CELLS_DRAWN))
        shape = (math.ceil(source.height / step), math.ceil(source.width / step))
        band = source.read(1, out_shape=shape, resampling=Resampling.average)
        bounds = source.bounds
    if not np.isfinite(band).any():
        band = np.zeros_like(band)
    return band, (bounds.left, bounds.right, bounds.bottom, bounds.top)


def difference(axes: Axes, path: Path, far: float, title: str, compared: Compared) -> None:
    """Blue where logs pass less often, red where more often; deposits of both as the frame."""
    band, extent = read_band(path)
    axes.imshow(band, cmap="RdBu_r", vmin=-far, vmax=far, extent=extent, interpolation="nearest")
    known = np.isfinite(band)
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    cell_x, cell_y = (extent[1] - extent[0]) / band.shape[1], (extent[3] - extent[2]) / band.shape[0]
    side = MARGIN * max(np.ptp(rows) * cell_y, np.ptp(columns) * cell_x) + 5.0
    axes.set_xlim(extent[0] + columns[0] * cell_x - side, extent[0] + (columns[-1] + 1) * cell_x + side)
    axes.set_ylim(extent[3] - (rows[-1] + 1) * cell_y - side, extent[3] - rows[0] * cell_y + side)
    one = compared.reference
    axes.scatter(one.column("release_x"), one.column("release_y"), s=1, color="black", linewidths=0)
    axes.set(xticks=[], yticks=[], facecolor="#F2F2F2")
    axes.set_title(title, fontsize=10, loc="left")


def percent(share: float, _: object) -> str:
    return f"{100 * share:g} %"
