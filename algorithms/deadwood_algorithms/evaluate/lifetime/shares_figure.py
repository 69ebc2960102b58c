"""The picture of `age`: the shares of the states over the years, and of the critical trees, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from deadwood_algorithms.evaluate.lifetime.life import STATES, Ages
from deadwood_algorithms.schemas.looks import PLAIN, ROAD, STUMP, TREE, WOOD

COLOURS = dict(zip(STATES, (TREE, STUMP, WOOD, "#dddddd"), strict=True))
LABELS = dict(zip(STATES, ("standing", "broken", "lying whole", "gone"), strict=True))


def draw(path: Path, ages: Ages, title: str, note: str) -> None:
    years = np.arange(ages.shares.shape[1])
    figure, (above, below) = plt.subplots(2, 1, figsize=(9.0, 7.5), sharex=True, layout="constrained")
    mean = 100.0 * ages.shares.mean(axis=0).T
    above.stackplot(years, mean, colors=list(COLOURS.values()), labels=list(LABELS.values()))
    above.set(ylabel="share of the dead trees [%]", ylim=(0.0, 100.0), title=title)
    above.legend(loc="upper right", framealpha=0.9, fontsize=9)
    series: Sequence[tuple[str, np.ndarray, str, str]] = (
        ("standing", ages.shares[..., 0], TREE, "--"),
        ("critical: smooth and still strong", ages.critical.sum(axis=2), ROAD, "-"),
        ("of these, standing", ages.critical[..., 0], PLAIN, ":"),
    )
    for label, values, colour, style in series:
        low, high = np.percentile(100.0 * values, [2.5, 97.5], axis=0)
        below.plot(years, 100.0 * values.mean(axis=0), style, color=colour, label=label)
        below.fill_between(years, low, high, color=colour, alpha=0.18, linewidth=0.0)
    below.set(xlabel="years from now", ylabel="share [%], mean and 95 %", ylim=(0.0, 100.0), xlim=(0, years[-1]))
    below.legend(loc="upper right", framealpha=0.9, fontsize=9)
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
    figure.supxlabel(note, fontsize=8.5)
    figure.savefig(path, dpi=120)
    plt.close(figure)
