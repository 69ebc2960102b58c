"""Logs that left the terrain model: how every tool reports them, by one rule.

Their further movement is unknown. A share therefore has bounds beside its interval (``bounds_if_lost``): if
none of the lost logs reaches the line, and if all do. Results without such bounds, such as maps and percentiles, hold
as far as the logs were seen. A warning states the number of logs and the results concerned if the bounds leave the
interval or if
more than ``WORTH_A_WARNING`` of the logs were lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.stats.statistics import bounds_if_lost, loss_matters, percent, percent_of, reach_record

WORTH_A_WARNING = 0.05  # share of the logs


def share_if_lost(reached: NDArray[np.bool_], left: NDArray[np.bool_]) -> dict[str, Any]:
    """Reach probability of logs, shape (n,), with its interval and its bounds for those that left before."""
    n, hit, gone = reached.size, int(reached.sum()), int((left & ~reached).sum())
    return reach_record(hit, n) | bounds_if_lost(hit, n, gone)


def reach_records(line_ids: Iterable[Any], touched: NDArray[np.bool_], left: NDArray[np.bool_]) -> list[dict[str, Any]]:
    """`share_if_lost` of each line; touched : (logs, lines), left : (logs,)."""
    return [{"line_id": line, **share_if_lost(hit, left)} for line, hit in zip(line_ids, touched.T, strict=True)]


def reach_phrases(records: Iterable[Mapping[str, Any]]) -> list[str]:
    """The possible reach of each line whose bounds leave the interval."""
    phrases = []
    for record in records:
        if loss_matters(record):
            low, high = record["ci_low_if_lost"], record["ci_high_if_lost"]
            ends = f"{percent(low, low, high)} to {percent(high, low, high)} %"
            phrases.append(f"the reach of line {record['line_id']} may be anything from {ends}")
    return phrases


def many(n_lost: int, n: int) -> bool:
    """Whether enough logs were lost for a warning about results without bounds."""
    return n_lost > WORTH_A_WARNING * n


def warn_of_lost(n_lost: int, n: int, phrases: Sequence[str], feedback: Feedback, *, where: str = "") -> None:
    """`lost_warning` as a warning, if there is one; ``where`` names the run."""
    if warning := lost_warning(n_lost, n, phrases):
        feedback.warn(f"{where}: {warning}" if where else warning, code="left-dem", left=n_lost, logs=n)


def lost_warning(n_lost: int, n: int, phrases: Sequence[str]) -> str | None:
    """The warning, or None if there is none.

    phrases : the numbers that depend on the lost logs, each as a clause
    """
    if not phrases:
        return None
    return (
        f"{n_lost} of {n} logs ({percent_of(n_lost, n)}) left the terrain model or came onto its nodata, and their "
        f"further movement is not known: {'; '.join(phrases)}; use a larger terrain model"
    )
