"""The picture of `decide`: for each line, events a year over the years, one band a treatment, critical years shaded."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.schemas.looks import RUNS

SHOWN = 4  # lines


def draw(
    path: Path,
    rates: Mapping[str, NDArray[np.float64]],
    lines: Sequence[str],
    critical: tuple[float, float] | None,
    sentences: Sequence[str],
) -> None:
    """``rates`` : by treatment, events a year of any energy, shape (draws, years, lines); ``critical`` : years between
    which more than a tenth of the trees are critical, None if never.
    """
    shown = min(len(lines), SHOWN)
    figure, panels = plt.subplots(
        shown, 1, figsize=(9.5, 1.2 + 3.4 * shown), sharex=True, squeeze=False, layout="constrained"
    )
    years = np.arange(next(iter(rates.values())).shape[1]) + 0.5
    for column, axes in enumerate(panels[:, 0]):
        if critical:
            axes.axvspan(*critical, color="#eeeeee", zorder=0, label="critical years")
        for (name, values), colour in zip(rates.items(), RUNS, strict=False):
            of_line = values[..., column]
            low, high = np.percentile(of_line, [2.5, 97.5], axis=0)
            axes.fill_between(years, low, high, color=colour, alpha=0.18, linewidth=0.0)
            axes.plot(years, of_line.mean(axis=0), color=colour, linewidth=2.0, label=name)
        axes.set_title(textwrap.fill(sentences[column], 110, break_on_hyphens=False), loc="left", fontsize=9)
        axes.set(ylabel=f"events a year at {lines[column]}", xlim=(0.0, years[-1] + 0.5))
        axes.set_ylim(bottom=0.0)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0, 0].legend(fontsize=9, loc="upper right", framealpha=0.9)
    panels[-1, 0].set_xlabel("years from now; bands: 95 % of the draws of all numbers and slides")
    figure.savefig(path, dpi=120)
    plt.close(figure)
