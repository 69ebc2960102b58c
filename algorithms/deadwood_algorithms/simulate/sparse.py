"""The rasters of a piece as the cells that its logs have passed, and their sum: exact, because counts and maxima
are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_engine import Rasters
from deadwood_engine.trace import HITS


def take_sparse(rasters: Rasters) -> dict[str, NDArray]:
    """Take the cells that a log has hit or come to rest on out of the first worker's rasters, which are empty
    afterwards.

    The system is slow in providing new memory (10 us per page): emptied rasters are reused for the next piece.
    """
    first = rasters.workers[0]
    hits = first.hits[:, :, HITS]
    # row by row: most of a large window was never touched, and the touched cells are in few rows
    rows = np.flatnonzero(hits.any(axis=1) | first.deposits.any(axis=1))
    at, column = np.nonzero((hits[rows] > 0) | (first.deposits[rows] > 0))
    row = rows[at]
    cells = row * hits.shape[1] + column
    found = {
        # neighbours differ by one, which compresses to almost nothing
        "cells": np.diff(cells, prepend=0).astype(np.int64),
        "hits": hits[row, column],
        "deposits": first.deposits[row, column],
        "maxima": np.ascontiguousarray(first.maxima[row, column].T),
        "danger": first.danger[:, cells] if len(first.danger) else np.zeros((0, 0), np.uint32),
    }
    first.hits[row, column], first.maxima[row, column], first.deposits[row, column] = 0, 0.0, 0
    if len(first.danger):
        first.danger[:, cells] = 0
    return found


def add_sparse(rasters: Rasters, piece: dict[str, NDArray]) -> None:
    """Add the cells that `take_sparse` took from a piece's rasters."""
    first = rasters.workers[0]
    cells = np.cumsum(piece["cells"])
    row, column = np.divmod(cells, first.deposits.shape[1])
    first.hits[row, column, HITS] += piece["hits"]
    first.deposits[row, column] += piece["deposits"]
    if len(first.maxima):
        first.maxima[row, column] = np.maximum(first.maxima[row, column], piece["maxima"].T)
    if len(first.danger):
        first.danger[:, cells] += piece["danger"]
