"""The results of a design's runs: every outcome's bars, indices and sentence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.sensitivity.answer import Answer, Measured, most_influential
from deadwood_algorithms.evaluate.sensitivity.factor_runs import SlidRuns
from deadwood_algorithms.evaluate.sensitivity.factors import Factor
from deadwood_algorithms.evaluate.sensitivity.indices import indices_of, rows_drawn, weights_of
from deadwood_algorithms.evaluate.sensitivity.tornado import bars_of
from deadwood_algorithms.params.tool import Cancelled, Feedback


def measure(
    factors: list[Factor],
    slid: SlidRuns,
    samples: int,
    lines: Sequence[Any],
    log_id: NDArray[np.int64],
    seed: int,
    feedback: Feedback,
) -> tuple[list[Measured], list[Answer]]:
    """Bars, indices and sentences of every outcome; ``samples``: rows of the design, 0 if only the ends were run."""
    weights = weights_of(log_id, seed)
    ends, n = 1 + 2 * len(factors), samples
    drawn = rows_drawn(n, seed) if samples else None
    outcomes = [(f"reach_{line}", str(line), slid.reach[:, :, k].astype(float)) for k, line in enumerate(lines)]
    outcomes.append(("runout_mean_m", "", slid.runout))
    measured = []
    for turn, (name, line, values) in enumerate(outcomes):

        def look(turn: int = turn) -> None:
            feedback.progress(turn, len(outcomes), "evaluating")
            if feedback.cancelled():
                raise Cancelled

        look()
        bars = bars_of(factors, values[:ends], weights, share=bool(line))
        found = None
        if drawn is not None:
            a, b = values[ends : ends + n], values[ends + n : ends + 2 * n]
            mixed = values[ends + 2 * n :].reshape(len(factors), n, values.shape[1])
            found = indices_of(a, b, mixed, weights, drawn, look)
        measured.append(Measured(name, line, bars, found))
    feedback.progress(1, 1, "evaluating")
    return measured, [most_influential(each, log_id.size) for each in measured]
