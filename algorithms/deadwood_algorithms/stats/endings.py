"""How logs ended: words in the tables of a result, the engine's numbers in its results."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.schemas.results import ENDED, STOP_REASONS

LEFT = "left_dem"


def ended(logs: Any, reason: str) -> NDArray[np.bool_]:
    """Which logs ended for one of ``STOP_REASONS``, shape (n,).

    logs : a table that has their reasons, or the reasons alone, as the engine's numbers or as words
    """
    reasons = _reasons(logs)
    numbers = np.issubdtype(reasons.dtype, np.integer)
    return np.asarray(reasons == (STOP_REASONS.index(reason) if numbers else reason), bool)


def left_dem(logs: Any) -> NDArray[np.bool_]:
    """Which logs left the terrain model, or came onto its nodata; as `ended`."""
    return ended(logs, LEFT)


def reasons_in_words(logs: Any) -> NDArray[np.object_]:
    """The reasons, of numbers of the engine."""
    return np.array(STOP_REASONS, object)[_reasons(logs)]


def _reasons(logs: Any) -> NDArray[Any]:
    return np.asarray(logs if isinstance(logs, np.ndarray) else logs[ENDED.name])
