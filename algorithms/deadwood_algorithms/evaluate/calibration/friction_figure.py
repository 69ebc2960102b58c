"""The figure of `calibrate-friction`: likelihood of each coefficient, its effect, and the result of the best one."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from deadwood_algorithms.evaluate.calibration.friction_runs import FrictionRun, Observed, Watched
from deadwood_algorithms.evaluate.calibration.score import LEVEL, Range
from deadwood_algorithms.files.pictures import scale_and_north, show_relief, with_minus
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.schemas.looks import ENDS, RELEASE, ROAD, RUNS

LIKELY, WITHIN, TESTED, SEEN = RUNS[0], RUNS[1], RUNS[2], RUNS[3]
FEW_SEEN, SEEN_SHARE = 5, 0.06  # more places than this are short marks; their length, as a share of the axes
MARGIN_M = 20.0
CELLS_DRAWN = 900  # along the longer side of the map


def draw(
    path: Path,
    rows: list[dict[str, Any]],
    found: Range | None,
    sentence: str,
    best: FrictionRun,
    layers: SceneLayers,
    logs: Releases,
    observed: Observed | None,
    watched: Watched,
    share_seen: float | None,
) -> None:
    """Likelihood and test over the coefficients; run-outs or shares over them; the map of the best.

    ``share_seen`` is the share of the event's logs that did what was observed, where that was counted.
    """
    friction = np.array([row["friction"] for row in rows])
    figure, panels = plt.subplots(1, 3, figsize=(15.0, 5.6), gridspec_kw={"width_ratios": [1.0, 1.0, 1.05]})
    likelihoods(panels[0], friction, rows)
    if "share" in rows[0]:
        _shares_panel(panels[1], friction, rows, share_seen)
    else:
        _runouts_panel(panels[1], friction, rows, seen_runouts(observed, logs))
    for axes in panels[:2]:
        axes.set_xlabel("friction coefficient")
        axes.grid(color="#E5E5E5", linewidth=0.6)
        axes.set_axisbelow(True)
        if found:
            axes.axvspan(found.low, found.high, color=WITHIN, alpha=0.15, zorder=0)
    ground(panels[2], best, layers, logs, observed, watched)
    cell = f"{layers.dem.cell:g} m cells"
    figure.suptitle(
        textwrap.fill(f"{with_minus(sentence)} {counted(len(logs), 'log')} at each coefficient, {cell}.", 150),
        x=0.01,
        ha="left",
        fontsize=11,
    )
    figure.tight_layout(rect=(0.0, 0.0, 1.0, 0.96), w_pad=1.5)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def likelihoods(axes: Axes, friction: np.ndarray, rows: list[dict[str, Any]]) -> None:
    """The test that decides on the range; the likelihood itself and its interval are in the table."""
    tested = np.array([row["p_range"] for row in rows])
    axes.vlines(friction, 0.0, tested, color=TESTED, linewidth=3.0)
    for kept, face, words in ((True, TESTED, "not ruled out"), (False, "white", f"ruled out: below {LEVEL:g}")):
        some = (tested >= LEVEL) == kept
        looks = {"facecolors": face, "edgecolors": TESTED, "zorder": 3}
        axes.scatter(friction[some], tested[some], s=36.0, label=words, **looks)
    axes.axhline(LEVEL, color="#777777", linewidth=0.8, linestyle=":")
    axes.annotate(
        f"{LEVEL:g}",
        (1.0, LEVEL),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 2),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=8,
        color="#777777",
    )
    axes.set_ylim(-0.03, 1.08)
    axes.set_title("simulated events that fit no better than the observed one;\ngreen: range", fontsize=10, loc="left")
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none")


def _shares_panel(axes: Axes, friction: np.ndarray, rows: list[dict[str, Any]], seen: float | None) -> None:
    value, low, high = (np.array([row[key] for row in rows]) for key in ("share", "share_ci_low", "share_ci_high"))
    bars = np.clip([value - low, high - value], 0.0, None)
    axes.errorbar(friction, value, bars, color=ENDS["rest"][1], marker="o", markersize=5, linewidth=1.2, capsize=2.5)
    if seen is not None:
        axes.axhline(seen, color=SEEN, linewidth=1.2)
        axes.annotate(
            "observed",
            (0.0, seen),
            xycoords=("axes fraction", "data"),
            xytext=(4, 3),
            textcoords="offset points",
            va="bottom",
            fontsize=8.5,
            color=SEEN,
        )
    axes.set_ylim(0.0, max(1.12 * high.max(), 1.08 * (seen or 0.0), 1e-3))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:g} %"))
    axes.set_title("simulated logs that behave as observed", fontsize=10, loc="left")


def _runouts_panel(axes: Axes, friction: np.ndarray, rows: list[dict[str, Any]], seen: np.ndarray) -> None:
    low, middle, high = (np.array([row[f"runout_{key}_m"] for row in rows]) for key in ("p05", "median", "p95"))
    axes.fill_between(
        friction, low, high, color=ENDS["rest"][1], alpha=0.35, linewidth=0, label="5 to 95 % of the logs"
    )
    axes.plot(friction, middle, color=LIKELY, marker="o", markersize=4, linewidth=1.2, label="median")
    for k, distance in enumerate(seen):  # short marks at the side, because full lines would hide the curves
        axes.axhline(
            distance,
            0.0,
            SEEN_SHARE if seen.size > FEW_SEEN else 1.0,
            color=SEEN,
            linewidth=1.2,
            label="observed" if k == 0 else None,
        )
    # Leave room for the legend above the content; a coefficient without deposits has no run-outs.
    axes.set_ylim(0.0, 1.2 * float(np.nanmax([*high, *seen, 1.0])))
    axes.set_title("run-out, horizontal [m]", fontsize=10, loc="left")
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none", loc="upper center", ncols=3)


def seen_runouts(observed: Observed | None, logs: Releases) -> np.ndarray:
    """Distance of each observed point from the middle of the releases that it may come from [m]."""
    if observed is None:
        return np.zeros(0)
    return np.array(
        [
            np.hypot(shape.x - logs.x[rows].mean(), shape.y - logs.y[rows].mean())
            for shape, rows in zip(observed.geometry, observed.logs, strict=True)
        ]
    )


def ground(
    axes: Axes, best: FrictionRun, layers: SceneLayers, logs: Releases, observed: Observed | None, watched: Watched
) -> None:
    """Releases, simulated deposits of the most likely coefficient, and what was observed, on the relief."""
    rests = best.resting
    x, y = (np.concatenate([getattr(logs, name), getattr(best, name)]) for name in "xy")
    if observed:
        west, south, east, north = shapely.total_bounds(observed.geometry)
        x, y = np.append(x, [west, east]), np.append(y, [south, north])
    frame = x.min() - MARGIN_M, x.max() + MARGIN_M, y.min() - MARGIN_M, y.max() + MARGIN_M
    dem = layers.dem
    (ny, nx), cell = dem.shape, dem.cell
    columns = slice(max(0, int((frame[0] - dem.x0) / cell)), min(nx, int((frame[1] - dem.x0) / cell) + 2))
    rows = slice(max(0, int((frame[2] - dem.y0) / cell)), min(ny, int((frame[3] - dem.y0) / cell) + 2))
    step = max(1, max(columns.stop - columns.start, rows.stop - rows.start) // CELLS_DRAWN)
    heights = dem.values[rows, columns][::step, ::step]
    if min(heights.shape) > 1:
        west, south = dem.x0 + (columns.start - 0.5) * cell, dem.y0 + (rows.start - 0.5) * cell
        size = heights.shape[1] * step * cell, heights.shape[0] * step * cell
        extent = (west, west + size[0], south, south + size[1])
        show_relief(axes, heights, step * cell, extent)
    for k, shape in enumerate(watched.items.geometry):
        for part in shapely.get_parts(shape.boundary if shapely.get_dimensions(shape) == 2 else shape):
            axes.plot(*part.xy, color=SEEN if k not in watched.own else ROAD, linewidth=1.5, zorder=3)
    axes.scatter(logs.x, logs.y, s=4, color=RELEASE, linewidths=0, zorder=2, label="released")
    axes.scatter(
        best.x[rests],
        best.y[rests],
        s=7,
        color=ENDS["rest"][1],
        edgecolors="black",
        linewidths=0.2,
        zorder=4,
        label=f"deposits at {best.friction:g}",
    )
    if not rests.all():
        axes.scatter(
            best.x[~rests],
            best.y[~rests],
            s=9,
            marker="x",
            color="#444444",
            linewidths=0.5,
            zorder=4,
            label="left, or no rest",
        )
    if observed:
        points = observed.geometry[observed.are_points]
        for shape in observed.geometry[~observed.are_points]:
            for part in shapely.get_parts(shape.boundary):
                axes.plot(*part.xy, color=SEEN, linewidth=1.5, zorder=5)
        if points.size:
            axes.scatter(
                shapely.get_x(points),
                shapely.get_y(points),
                s=70,
                marker="X",
                color=SEEN,
                edgecolors="white",
                linewidths=0.8,
                zorder=6,
                label="observed",
            )
    axes.set(xlim=frame[:2], ylim=frame[2:], xticks=[], yticks=[], aspect="equal")
    scale_and_north(axes)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.01), ncol=3, frameon=False, markerscale=1.6)
