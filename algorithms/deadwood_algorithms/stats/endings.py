"""How logs ended: as words in the tables of a result, as numbers in the engine's results."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.schemas.results import ENDED, STOP_REASONS

LEFT = "left_dem"
AT_REST = ("rest", "tree", "barrier", "lying_log", "block")  # the reasons of logs that have a deposit


def ended(logs: Any, reason: str) -> NDArray[np.bool_]:
    """Which logs ended for one of these ``STOP_REASONS``, shape (n,).

    logs : a table with their reasons, or only the reasons, as the engine's numbers or as words
    """
    reasons = _reasons(logs)
    numbers = np.issubdtype(reasons.dtype, np.integer)
    return np.asarray(reasons == (STOP_REASONS.index(reason) if numbers else reason), bool)


def left_dem(logs: Any) -> NDArray[np.bool_]:
    """Which logs left the terrain model, or came onto its nodata; as `ended`."""
    return ended(logs, LEFT)


def at_rest(logs: Any) -> NDArray[np.bool_]:
    """Which logs have a deposit: they neither left the terrain model nor were still moving; as `ended`."""
    return np.any([ended(logs, each) for each in AT_REST], axis=0)


def known_runouts(runout: NDArray[np.floating], logs: Any) -> NDArray[np.float64]:
    """Run-outs of all logs, for their quantiles: infinite without a deposit.

    Such a log went farther than is known. To leave it out, or to count it up to where it was lost, would shorten the
    run-out where most logs leave the terrain model.
    """
    return np.where(at_rest(logs), np.asarray(runout, float), np.inf)


def reasons_in_words(logs: Any) -> NDArray[np.object_]:
    """The reasons in words, from the engine's numbers."""
    return np.array(STOP_REASONS, object)[_reasons(logs)]


def _reasons(logs: Any) -> NDArray[Any]:
    return np.asarray(logs if isinstance(logs, np.ndarray) else logs[ENDED.name])
