"""The figures of the page, drawn from the results file only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter

from . import tables

HERE = Path(__file__).parent / "figures"
FIDELITIES = tables.FIDELITIES
COLOURS = {
    "fidelity": "black", "coarse": "#be185d", "time step": "#1b6ca8", "travel": "#d1495b", "spacing": "#3a7d44",
    "tolerance": "#8e6bbf", "sweeps": "#e08e0b", "trace": "#6b7280", "friction": "#b8860b", "cell": "#0f766e",
    "smooth": "#7c2d12", "halved": "black", "obstacles": "#15803d", "order": "#4338ca", "refined": "#0369a1",
    "flanks": "#8c6d31", "longer": "#9a3412", "roll angle": "#0891b2",
}  # fmt: skip
SCENE_COLOURS = ("#6b7280", "#e08e0b", "#3a7d44", "#8e6bbf", "#d1495b", "#1b6ca8", "#0f766e")
# for these figures only: a process that imports this file may draw others
LOOK: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "deadwood"}


def _save(figure: Any, name: str) -> None:
    HERE.mkdir(exist_ok=True)
    figure.savefig(HERE / f"{name}.png", dpi=110, metadata={"Software": None})
    plt.close(figure)


def work_precision(results: dict[str, Any]) -> None:
    """Cost of a log against the difference in reach from the reference, one panel for each scene."""
    names = [n for n, _ in tables.in_order(results)]
    figure, panels = plt.subplots(2, 4, figsize=(13.0, 6.2), layout="constrained", sharey=True)
    groups = ("time step", "travel", "spacing", "tolerance", "sweeps", "coarse", "fidelity")
    for axis in panels.flat[len(names) :]:
        axis.set_visible(False)
    for axis, name in zip(panels.flat, names, strict=False):
        axis.axhspan(-1, 1, color="0.93", zorder=0)
        axis.axhline(0, color="0.6", lw=0.7)
        for setting, entry in results["entries"][name].items():
            group = tables.group_of(setting)
            if group not in groups or entry.get("against") != "reference":
                continue
            reach = entry["error"]["reach"]
            fidelity = group == "fidelity"
            axis.errorbar(
                entry["cpu_ms_per_log"], 100 * reach["delta"],
                yerr=[[100 * (reach["delta"] - reach["low"])], [100 * (reach["high"] - reach["delta"])]],
                fmt="s" if fidelity else "o", ms=6 if fidelity else 3.5, color=COLOURS[group],
                lw=1.4 if fidelity else 0.7, zorder=4 if fidelity else 3, alpha=1.0 if fidelity else 0.75,
            )  # fmt: skip
            if fidelity:
                axis.annotate(
                    setting, (entry["cpu_ms_per_log"], 100 * reach["delta"]), xytext=(5, 5), textcoords="offset points"
                )
        reference = results["entries"][name].get("reference")
        if reference:
            axis.axvline(reference["cpu_ms_per_log"], color="black", lw=0.7, ls=":")
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(NullFormatter())
        entry = results["entries"][name].get("standard", {})
        p = f", reach {100 * entry['reach']['p']:.0f} %" if entry else ""
        axis.set_title(f"{results['scenes'][name]['title']}{p}", fontsize=8.5)
    for axis in panels[:, 0]:
        axis.set_ylabel("reach minus reference [percentage points]")
    for axis in panels[-1]:
        axis.set_xlabel("CPU time per log [ms], reference dotted")
    panels.flat[0].set_ylim(*_limits(results, names, groups))
    marks = [Line2D([], [], color=COLOURS[g], marker="s" if g == "fidelity" else "o", ls="", label=g) for g in groups]
    figure.legend(handles=marks, loc="outside lower center", ncols=len(groups), frameon=False)
    _save(figure, "work_precision")


def _limits(results: dict[str, Any], names: list[str], groups: tuple[str, ...]) -> tuple[float, float]:
    """Ends of the y axis that hold every estimate (bars may leave it)."""
    found = [
        100 * e["error"]["reach"]["delta"]
        for n in names
        for s, e in results["entries"][n].items()
        if tables.group_of(s) in groups and e.get("against") == "reference"
    ]
    return min([-4.0, *found]) - 1.0, max([4.0, *found]) + 1.0


def factors(results: dict[str, Any]) -> None:
    """Every setting's difference in reach, mean over the scenes, with differences caused by friction for scale."""
    rows = [r for r in tables.pooled_rows(results) if r["against"] == "reference"]
    figure, axis = plt.subplots(figsize=(7.5, 0.24 * len(rows) + 1.1), layout="constrained")
    for place, row in enumerate(reversed(rows)):
        axis.plot([100 * row["low"], 100 * row["high"]], [place, place], color=COLOURS[row["group"]], lw=2, alpha=0.6)
        axis.plot(100 * row["delta"], place, "o", color=COLOURS[row["group"]], ms=4)
    axis.set_yticks(range(len(rows)), [f"{r['name']}  (cost {r['cost']:.2g})" for r in reversed(rows)])
    axis.axvline(0, color="0.6", lw=0.7)
    yard = tables.friction_slope(results)
    if yard:
        for change in (-0.02, -0.01, 0.01, 0.02):
            axis.axvline(100 * yard[0] * change, color=COLOURS["friction"], lw=0.8, ls="--")
            axis.text(
                100 * yard[0] * change,
                len(rows) - 0.3,
                f"mu {change:+.2f}",
                color=COLOURS["friction"],
                ha="center",
                fontsize=7,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
            )
    axis.margins(x=0.09)
    axis.set_xlabel(
        "reach minus reference, mean over the scenes [percentage points], 95 % interval; cost: standard = 1"
    )
    _save(figure, "factors")


def fields(results: dict[str, Any]) -> None:
    """Distances of deposits and hit rasters from the reference's, relative to sampling noise."""
    quantities = (
        ("runout_w1_m", "runout_w1_floor_m", "runout, Wasserstein-1"),
        ("deposit_energy_m", "deposit_energy_floor_m", "deposits, energy distance"),
        ("hits_jaccard", "hits_jaccard_floor", "hit raster, weighted Jaccard"),
    )
    figure, panels = plt.subplots(1, 3, figsize=(10.5, 3.0), layout="constrained")
    names = [n for n, _ in tables.in_order(results)]
    for axis, (key, floor, title) in zip(panels, quantities, strict=True):
        axis.axhline(1.0, color="0.5", lw=0.8, ls="--")
        for k, name in enumerate(names):
            found = [results["entries"][name].get(f, {}).get("error", {}) for f in FIDELITIES[:3]]
            ratio = [e[key] / e[floor] if e.get(floor) else np.nan for e in found]
            axis.plot(range(3), ratio, "o-", color=SCENE_COLOURS[k], lw=0.8, ms=4, label=name)
        axis.set_xticks(range(3), FIDELITIES[:3])
        axis.set_yscale("log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.set_ylim(0.1, 10.0)
        axis.set_title(title, fontsize=8.5)
    panels[0].set_ylabel("distance / noise floor of as many logs")
    panels[-1].legend(frameon=False, fontsize=7)
    _save(figure, "fields")


def penetration(results: dict[str, Any]) -> None:
    """Penetration of every scene against the step: median of the logs' deepest, 99 % and deepest of all."""
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.2), layout="constrained", sharey=True)
    names = [n for n, _ in tables.in_order(results)]
    travels = sorted({s for n in names for s in results["entries"][n] if s.startswith("travel")} | {"standard"})
    for k, name in enumerate(names):
        entries = results["entries"][name]
        for axis, settings, value in (
            (panels[0], [f for f in FIDELITIES if f in entries], lambda s: float(FIDELITIES.index(s))),
            (panels[1], [t for t in travels if t in entries], lambda s, e=entries: e[s]["fidelity"]["travel_cells"]),
        ):
            order = sorted(settings, key=value)
            x = np.array([value(s) for s in order]) + (0.05 * (k - 2.5) if axis is panels[0] else 0.0)
            deep = [entries[s]["penetration_m"] for s in order]
            axis.plot(x, [d["median"] for d in deep], "o-", color=SCENE_COLOURS[k], lw=0.8, ms=4, label=name)
            axis.plot(x, [d["max"] for d in deep], "^", color=SCENE_COLOURS[k], ms=4, mfc="none")
    panels[0].set_xticks(range(4), FIDELITIES)
    panels[1].set_xscale("log")
    panels[1].set_xlabel("travel in a step [cells], otherwise standard")
    panels[1].xaxis.set_major_locator(FixedLocator([0.2, 0.4, 0.6, 1.0, 2.0]))
    panels[1].xaxis.set_major_formatter("{x:g}")
    panels[1].xaxis.set_minor_formatter(NullFormatter())
    for axis in panels:
        axis.set_yscale("log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter(NullFormatter())
        for level in (0.05, 0.15):
            axis.axhline(level, color="0.6", lw=0.7, ls="--")
    panels[0].set_ylabel("deepest contact of a log [m]")
    panels[0].legend(frameon=False, fontsize=7, ncols=2)
    panels[1].set_title(
        "circles: median over logs; triangles: deepest of all; dashed: 5 and 15 cm", fontsize=7.5, loc="right"
    )
    _save(figure, "penetration")


def cells(results: dict[str, Any]) -> None:
    """The effect of the DEM's cell size on reach, and the change of friction that would compensate it."""
    rows = tables.cell_rows(results)
    if not rows:
        return
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.0), layout="constrained")
    for k, name in enumerate(n for n, _ in tables.in_order(results)):
        mine = [r for r in rows if r["scene"] == name]
        if not mine:
            continue
        x = [r["cell"] for r in mine]
        delta, low, high = (100 * np.array([r[key] for r in mine]) for key in ("delta", "low", "high"))
        panels[0].errorbar(
            x, delta, [delta - low, high - delta], fmt="o-", ms=4, lw=0.8, color=SCENE_COLOURS[k], label=name
        )
        panels[1].plot(x, [r["friction"] for r in mine], "o-", ms=4, lw=0.8, color=SCENE_COLOURS[k])
    panels[0].set_ylabel("reach minus that of 0.5 m cells [points]")
    panels[1].set_ylabel("change of mu that undoes it")
    for axis in panels:
        axis.axhline(0, color="0.6", lw=0.7)
        axis.set_xscale("log")
        axis.set_xticks([0.25, 0.5, 1, 2, 5], ["0.25", "0.5", "1", "2", "5"])
        axis.set_xlabel("DEM cell [m]")
        axis.minorticks_off()
    panels[0].legend(frameon=False, fontsize=7)
    _save(figure, "cells")


def restarts(results: dict[str, Any]) -> None:
    """Short restarts: distance from the finest step after a quarter of a second."""
    if "restarts" not in results:
        return
    figure, axis = plt.subplots(figsize=(4.6, 3.0), layout="constrained")
    for k, (name, found) in enumerate(results["restarts"]["scenes"].items()):
        step = [p["step_ms"] for p in found["points"]]
        axis.plot(
            step, [p["median_m"] for p in found["points"]], "o-", ms=4, color=SCENE_COLOURS[k], label=f"{name}, median"
        )
        axis.plot(
            step,
            [p["p90_m"] for p in found["points"]],
            "^--",
            ms=4,
            lw=0.8,
            color=SCENE_COLOURS[k],
            label=f"{name}, 90 %",
        )
    low, high = axis.get_xlim()
    base = min(p["median_m"] for f in results["restarts"]["scenes"].values() for p in f["points"])
    axis.plot([1.25, 10], [base, 8 * base], color="0.6", lw=0.8, label="order 1")
    axis.set_xlim(low, high)
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xticks([1.25, 2.5, 5, 10], ["1.25", "2.5", "5", "10"])
    axis.minorticks_off()
    axis.set_xlabel("time step [ms]")
    axis.set_ylabel("ends apart after 0.25 s [m]")
    axis.legend(frameon=False, fontsize=7)
    _save(figure, "restarts")


def draw(results: dict[str, Any]) -> list[str]:
    """Draw all figures for which there are results; returns their names."""
    with plt.rc_context(LOOK):
        for figure in (work_precision, factors, fields, penetration, cells, restarts):
            figure(results)
    return sorted(p.name for p in HERE.glob("*.png"))
