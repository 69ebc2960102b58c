"""Danger: the share of the logs passing a cell that reach a line then or later.

A log passes a cell if its outline in plan touches it. It reaches a line afterwards if its first touch of the line
occurs with the outline that first touched the cell, or with a later one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import Band, ByRows, rows_of
from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.results.arrivals import first_touches
from deadwood_algorithms.results.run_folder import Run, ends_of
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.memory import refuse_too_many
from deadwood_algorithms.schemas.files import DANGER
from deadwood_engine import Lines, sweep_danger

ANY, COUNT = (each.name for each in DANGER.bands[:2])
LEAST = 10
BAND_BYTES = 20  # per cell and line: counted in a piece, in total, and written


def danger_bands(
    passed: NDArray[np.uint32], danger: NDArray[np.uint32], line_ids: Sequence[Any], least: int
) -> dict[str, NDArray[np.float32]]:
    """The bands of a danger raster by name; NaN where fewer than ``least`` logs passed.

    Parameters
    ----------
    passed : shape (ny, nx), logs that passed each cell
    danger : shape (lines + 1, ny, nx), those that reached any line afterwards, then each line
    """
    rows = slice(0, len(passed))
    return {name: band.of(rows) for name, band in bands_by_rows(passed, danger, line_ids, least).items()}


def bands_by_rows(
    passed: Band, danger: Sequence[Band] | NDArray[np.uint32], line_ids: Sequence[Any], least: int
) -> dict[str, ByRows]:
    """The same bands, computed for the requested rows only."""

    def band(reached: Band | None) -> ByRows:
        def of(rows: slice) -> NDArray[np.float32]:
            here = rows_of(passed, rows)
            enough = here >= least
            count = here[enough].astype(np.float64)
            values = np.full(enough.shape, np.nan, np.float32)
            values[enough] = count if reached is None else rows_of(reached, rows)[enough] / count
            return values

        return ByRows((passed.shape[0], passed.shape[1]), of)

    lines = dict(zip(bands_of_lines(line_ids), danger[1:], strict=True))
    return {ANY: band(danger[0]), COUNT: band(None)} | {name: band(reached) for name, reached in lines.items()}


def bands_of_lines(line_ids: Sequence[Any]) -> list[str]:
    """The name of each line's band: its own, unless another band has that name."""
    return [f"line {each}" if str(each) in (ANY, COUNT) else str(each) for each in line_ids]


def units_of(bands: Sequence[str]) -> list[str]:
    return ["logs" if name == COUNT else "1" for name in bands]


def danger_of(
    source: Run, wanted: NDArray[np.int64], grid: Grid, lines: Lines, items: Items, feedback: Feedback
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """How many of the chosen logs pass each cell, and how many of these reach any line afterwards, and each line."""
    cells = grid.shape[0] * grid.shape[1]
    refuse_too_many(
        cells, "cells", source.grid.path, each=BAND_BYTES * (len(items.ids) + 1), fix="use a larger --cell-m"
    )
    count = np.zeros(grid.shape, np.uint32)
    danger = np.zeros((len(items.ids) + 1, *grid.shape), np.uint32)
    place = {"x0": grid.x0, "y0": grid.y0, "cell": grid.cell, "shape": grid.shape}
    done = 0
    for piece in source.poses(wanted):
        if feedback.cancelled():
            raise Cancelled
        base, tip = ends_of(piece)
        touch = first_touches(piece, lines, items, source.radii(), (source.grid.x0, source.grid.y0))
        passed, reached = sweep_danger(piece["log_row"], base, tip, *source.radii(), touch, **place)
        count += passed
        danger += reached
        done += np.unique(piece["log_id"]).size
        feedback.progress(done, wanted.size, "following logs to the lines")
    return count, danger
