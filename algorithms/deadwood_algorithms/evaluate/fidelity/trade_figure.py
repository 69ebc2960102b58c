"""The picture of `compare-fidelity`: the CPU time of a log at each fidelity, against the error."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.fidelity.records import FidelityRow
from deadwood_algorithms.evaluate.fidelity.rule import Recommendation
from deadwood_algorithms.files.pictures import with_minus
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.schemas.looks import RUNS

MARKERS = "osD^vP"
NOISE = "#BBBBBB"
ITEMS_SHOWN = len(RUNS)  # lines or releases in a panel; the table has them all


def draw(
    rows: Sequence[FidelityRow], names: Sequence[str], advice: Recommendation, logs: Mapping[str, int], path: Path
) -> None:
    """Six panels over the same axis of CPU time."""
    cost = {row.fidelity: row.value for row in rows if row.quantity == "cpu_per_log"}
    figure, panels = plt.subplots(2, 3, figsize=(13.5, 8.2), sharex=True)
    spoken = [row for row in rows if row.quantity != "reach" or row.item not in advice.silent_lines]
    differences(panels[0, 0], spoken, cost, "reach", 100.0, "reach of lines: difference [points]")
    distances(panels[0, 1], rows, cost, "deposit_distance", "run-outs: Wasserstein distance [m]")
    distances(panels[0, 2], rows, cost, "hit_raster_distance", "hit raster: 1 \N{MINUS SIGN} weighted Jaccard")
    differences(panels[1, 0], rows, cost, "spread_p05_p95", 1.0, "lateral spread (5 to 95 %): difference [°]")
    tops(panels[1, 1], rows, cost)
    own(panels[1, 2], rows, cost)
    for place, axes in enumerate(panels.flat):
        axes.set_xscale("log")
        axes.set_xlim(min(cost.values()) / 1.6, max(cost.values()) * 1.6)
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(color="#E5E5E5", linewidth=0.6)
        axes.set_axisbelow(True)
        for name in names:
            axes.axvline(cost[name], color="#D0D0D0", linewidth=0.8, zorder=0)
            if place < 3:
                axes.annotate(
                    name,
                    (cost[name], 1.0),
                    xycoords=("data", "axes fraction"),
                    xytext=(0, 3),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    fontsize=8.5,
                    color="#555555",
                )
        if place >= 3:
            axes.set_xlabel("CPU time per log [ms]")
    figure.suptitle(
        f"{counted(logs['compared'], 'log')} at each fidelity, against {names[-1]}; bars: 95 % intervals; "
        f"grey: sampling noise of {logs['planned']} logs",
        x=0.01,
        ha="left",
        fontsize=12,
    )
    figure.text(0.01, 0.012, textwrap.fill(with_minus(advice.sentence), 190), ha="left", va="bottom", fontsize=9.5)
    figure.tight_layout(rect=(0.0, 0.055, 1.0, 0.975), h_pad=1.5, w_pad=1.2)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def differences(
    axes: Axes, rows: Sequence[FidelityRow], cost: Mapping[str, float], quantity: str, scale: float, label: str
) -> None:
    """Signed differences with their intervals, one colour for each item; its noise as short grey bars."""
    axes.set_title(label, fontsize=10, loc="left", pad=16)
    axes.axhline(0.0, color="black", linewidth=0.8)
    items = list(dict.fromkeys(row.item for row in rows if row.quantity == quantity))
    if not items:
        say(axes, "no line that some logs reach" if quantity == "reach" else "too few logs per release")
        return
    for place, item in enumerate(items[:ITEMS_SHOWN]):
        mine = [row for row in rows if row.quantity == quantity and row.item == item]
        aside = 1.07 ** (place - (min(len(items), ITEMS_SHOWN) - 1) / 2.0)
        x = np.array([cost[row.fidelity] for row in mine]) * aside
        noise = scale * np.array([row.noise for row in mine])
        if np.isfinite(noise).any():  # the place of the reference stays free for the legend
            axes.errorbar(x[:-1], np.zeros(x.size - 1), noise[:-1], fmt="none", ecolor=NOISE, elinewidth=7.0, zorder=1)
        with_bars(axes, x, mine, scale, place, item)
    hidden = len(items) - ITEMS_SHOWN
    title = f"and {hidden} more" if hidden > 0 else None
    if len(items) > 1 or quantity == "reach":
        axes.legend(fontsize=8, frameon=False, title=title, title_fontsize=8, alignment="left")


def with_bars(axes: Axes, x: NDArray[Any], rows: Sequence[FidelityRow], scale: float, place: int, label: str) -> None:
    """The rows' differences with their intervals; the finest has none."""
    y, low, high = (
        scale * np.array([getattr(row, key) for row in rows]) for key in ("difference", "ci_low", "ci_high")
    )
    bars = np.nan_to_num(np.clip([y - low, high - y], 0.0, None))
    style = {"color": RUNS[place], "marker": MARKERS[place], "markersize": 5, "linewidth": 1.0, "capsize": 2.5}
    axes.errorbar(x, y, bars, label=label, **style)


def distances(axes: Axes, rows: Sequence[FidelityRow], cost: Mapping[str, float], quantity: str, label: str) -> None:
    """Distances of the coarser fidelities, and the noise, below which they should stay."""
    axes.set_title(label, fontsize=10, loc="left", pad=16)
    mine = [row for row in rows if row.quantity == quantity]
    x, y = [cost[row.fidelity] for row in mine[:-1]], [row.difference for row in mine[:-1]]
    axes.plot(x, y, color=RUNS[0], marker=MARKERS[0], markersize=5, linewidth=1.0)
    noise = mine[0].noise
    if math.isfinite(noise):
        axes.axhspan(0.0, noise, color=NOISE, alpha=0.6, zorder=0)
    axes.set_ylim(0.0, 1.15 * max([noise if math.isfinite(noise) else 0.0, *y, 1e-9]))


def tops(axes: Axes, rows: Sequence[FidelityRow], cost: Mapping[str, float]) -> None:
    """Top speed and highest jump, means over the logs."""
    axes.set_title("means over the logs: difference", fontsize=10, loc="left")
    axes.axhline(0.0, color="black", linewidth=0.8)
    for place, (quantity, label) in enumerate((("speed_max_mean", "top speed [m/s]"), ("jump_max_mean", "jump [m]"))):
        mine = [row for row in rows if row.quantity == quantity]
        x = np.array([cost[row.fidelity] for row in mine]) * 1.07 ** (place - 0.5)
        with_bars(axes, x, mine, 1.0, place, label)
    axes.legend(fontsize=8, frameon=False)


def own(axes: Axes, rows: Sequence[FidelityRow], cost: Mapping[str, float]) -> None:
    """The calculation's own numerical measures."""
    axes.set_title("measures of the calculation's error", fontsize=10, loc="left")
    shown = (
        ("penetration_max", "deepest penetration [cm]"),
        ("penetration_max_median", "median log's deepest [cm]"),
        ("energy_error", "largest energy error [%]"),
        ("unconverged_steps", "unconverged steps [%]"),
    )
    for place, (quantity, label) in enumerate(shown):
        mine = [row for row in rows if row.quantity == quantity]
        y = 100.0 * np.array([row.value for row in mine])
        y[y <= 0.0] = np.nan  # cannot stand on a logarithmic axis
        if np.isfinite(y).any():
            x = [cost[row.fidelity] for row in mine]
            axes.plot(x, y, color=RUNS[place], marker=MARKERS[place], markersize=5, linewidth=1.0, label=label)
    axes.set_yscale("log")
    axes.legend(fontsize=8, frameon=False)


def say(axes: Axes, words: str) -> None:
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", color="#777777")
    axes.set_yticks([])
