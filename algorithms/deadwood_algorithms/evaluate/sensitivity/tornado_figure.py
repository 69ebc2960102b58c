"""The picture of `vary`: a tornado for each outcome, and beside it the indices, where a design was run."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from deadwood_algorithms.evaluate.sensitivity.answer import Answer, Measured
from deadwood_algorithms.files.pictures import limits_of_ends, show_ends, with_minus
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.schemas.looks import HIGH_END, LOW_END, RUNS

FIRST, TOTAL = "#999999", RUNS[0]
OUTCOMES_SHOWN = 5
PANEL_IN, BAR_IN, HEAD_IN, FOOT_IN = 1.25, 0.36, 0.75, 0.55


def draw(
    path: Path,
    measured: Sequence[Measured],
    answers: Sequence[Answer],
    order: Sequence[int],
    logs: int,
    runs: int,
    note: str,
) -> None:
    """Every outcome's factors in the same ``order``, from the top."""
    shown = list(zip(measured, answers, strict=True))[:OUTCOMES_SHOWN]
    factors = len(shown[0][0].bars)
    design = any(each.indices is not None for each, _ in shown)
    drawn = any(has_indices(each) for each, _ in shown)
    panel = PANEL_IN + BAR_IN * factors
    height = HEAD_IN + panel * len(shown) + FOOT_IN
    figure, grid = plt.subplots(
        len(shown),
        2 if design else 1,
        figsize=(13.0, height),
        squeeze=False,
        layout="constrained",
        width_ratios=(3, 2) if design else None,
    )
    for (one, answer), panels in zip(shown, grid, strict=True):
        bars(panels[0], one, order, answer)
        if design:
            indices(panels[1], one, order)
    hidden = len(measured) - len(shown)
    more = f"; {hidden} more outcomes in tornado.csv" if hidden > 0 else ""
    figure.suptitle(
        f"The most influential inputs: the same {counted(logs, 'log')} in {counted(runs, 'run')}{more}", fontsize=12
    )
    handles = [
        Patch(facecolor=LOW_END, label="low end of the range"),
        Patch(facecolor=HIGH_END, label="high end"),
        Line2D([], [], color="black", linewidth=1.0, label="as it is"),
    ]
    if drawn:
        handles += [
            Patch(facecolor=TOTAL, label="total-effect index"),
            Patch(facecolor=FIRST, label="first-order index"),
            Line2D([], [], color="black", marker="|", linewidth=1.2, label="95 % interval"),
        ]
    figure.legend(
        handles=handles,
        loc="outside lower left",
        ncols=len(handles),
        frameon=False,
        fontsize=8.5,
        title=textwrap.fill(note, 190, break_on_hyphens=False),
        title_fontsize=8.5,
        alignment="left",
    )
    figure.savefig(path, dpi=120)
    plt.close(figure)


def bars(axes: Axes, one: Measured, order: Sequence[int], answer: Answer) -> None:
    """Bars from the unchanged outcome to that at each end; beside them the difference between the ends, with its
    interval.
    """
    scale = 100.0 if one.is_share else 1.0
    base = scale * one.bars[0].base
    for place, k in enumerate(order):
        bar = one.bars[k]
        show_ends(axes, place, base, scale * bar.at_low, scale * bar.at_high)
        axes.text(
            1.01,
            place,
            with_minus(one.change(bar)),
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=8.5,
            fontweight="bold" if bar.beyond_chance else "normal",
        )
    axes.axvline(base, color="black", linewidth=1.0, zorder=3)
    names = [f"{one.bars[k].factor.words}\n{one.bars[k].factor.range_words}" for k in order]
    axes.set_yticks(range(len(order)), names, fontsize=8.5)
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.set_xlabel(f"reach of {one.line} [%]" if one.is_share else "mean run-out [m]", fontsize=9)
    axes.set_title(textwrap.fill(with_minus(answer.sentence), 120, break_on_hyphens=False), fontsize=8.5, loc="left")
    ends = [base, *(scale * each for bar in one.bars for each in (bar.at_low, bar.at_high))]
    axes.set_xlim(*limits_of_ends(ends, 100.0 if one.is_share else math.inf))
    bare_frame(axes)


def has_indices(one: Measured) -> bool:
    """Whether the outcome varies enough for shares of its variance."""
    return one.indices is not None and bool(np.isfinite(one.indices.total).all())


def indices(axes: Axes, one: Measured, order: Sequence[int]) -> None:
    axes.set_xlabel("share of the outcome's variance", fontsize=9)
    axes.set_xlim(0.0, 1.03)
    axes.set_yticks(range(len(order)), [""] * len(order))
    axes.set_ylim(len(order) - 0.5, -0.5)
    found = one.indices
    if found is None or not has_indices(one):
        axes.text(0.5, 0.5, "does not vary beyond chance", transform=axes.transAxes, ha="center", color="#777777")
        bare_frame(axes)
        return
    for place, k in enumerate(order):
        for aside, value, (low, high), colour in (
            (-0.18, found.total[k], found.total_interval[:, k], TOTAL),
            (0.18, found.first[k], found.first_interval[:, k], FIRST),
        ):
            axes.barh(place + aside, min(max(value, 0.0), 1.0), height=0.32, color=colour, zorder=2)
            axes.plot([low, high], [place + aside] * 2, color="black", linewidth=1.2, marker="|", zorder=3)
    bare_frame(axes)


def bare_frame(axes: Axes) -> None:
    axes.grid(axis="x", color="#E5E5E5", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(axis="x", labelsize=8.5)
