"""Quantiles, over the logs that pass a cell, of the largest speed, energy and jump of each of them in it.

Every log that overlaps a cell counts once in it, with its largest value there, as in PlatRock's rasters: not the
poses, of which a slow log has more, and not the logs that pass elsewhere. With n logs in a cell the quantile is the
usual one (linear between order statistics); cells that too few logs pass to show it are empty.

Memory is bounded by the number of rows processed at once: as many as keep their hits, which are counted first,
below `HITS_AT_ONCE`. The stored poses are read once for each such band of rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.results.motion import bodies_of, energies_kj
from deadwood_algorithms.results.run_folder import Run, ends_of
from deadwood_algorithms.stats.order_statistics import values_needed
from deadwood_engine.peaks import CellPeaks

HITS_AT_ONCE = 20_000_000  # 4 bytes each and quantity, and 16 more while one is sorted: 0.6 GB
QUANTITIES = {"speed": "m/s", "energy": "kJ", "jump": "m"}


def cell_quantiles(
    source: Run,
    chosen: NDArray[np.int64],
    counts: NDArray[np.uint32],
    grid: Grid,
    quantities: Sequence[str],
    levels: Sequence[float],
    feedback: Feedback,
) -> dict[str, NDArray[np.float32]]:
    """Rasters of quantiles, by quantity shape (levels, ny, nx), NaN where too few logs passed.

    ``counts`` are the hits of the chosen logs on ``grid``; they determine the memory needed.
    """
    out = {name: np.full((len(levels), *grid.shape), np.nan, np.float32) for name in quantities}
    for rows, peaks in peaks_by_rows(source, chosen, counts, grid, quantities, feedback):
        for channel, name in enumerate(quantities):
            found = quantiles_by_cell(peaks.peaks[channel], peaks.start, levels)
            out[name][:, rows] = found.reshape(len(levels), rows.stop - rows.start, -1)
    return out


def largest_by_rank(
    source: Run,
    chosen: NDArray[np.int64],
    counts: NDArray[np.uint32],
    grid: Grid,
    quantity: str,
    ranks: Sequence[int],
    feedback: Feedback,
) -> NDArray[np.float32]:
    """Rasters of the values that given numbers of logs reach or exceed, shape (ranks, ny, nx): rank 1 is the largest
    of all.

    NaN where fewer logs than the rank passed. ``counts`` as in `cell_quantiles`.
    """
    out = np.full((len(ranks), *grid.shape), np.nan, np.float32)
    for rows, peaks in peaks_by_rows(source, chosen, counts, grid, [quantity], feedback):
        ordered = ordered_by_cell(peaks.peaks[0], peaks.start)
        for k, rank in enumerate(ranks):
            enough = np.diff(peaks.start) >= rank
            band = np.full(enough.size, np.nan, np.float32)
            band[enough] = ordered[peaks.start[1:][enough] - rank]
            out[k, rows] = band.reshape(rows.stop - rows.start, -1)
    return out


def counts_above(
    source: Run,
    chosen: NDArray[np.int64],
    counts: NDArray[np.uint32],
    grid: Grid,
    quantity: str,
    bounds: Sequence[float],
    feedback: Feedback,
) -> NDArray[np.uint32]:
    """Rasters of how many of the chosen logs bring at least each of these values to a cell, shape (bounds, ny, nx)."""
    out = np.zeros((len(bounds), *grid.shape), np.uint32)
    for rows, peaks in peaks_by_rows(source, chosen, counts, grid, [quantity], feedback):
        cell = np.repeat(np.arange(peaks.start.size - 1), np.diff(peaks.start))
        for k, bound in enumerate(bounds):
            found = np.bincount(cell[peaks.peaks[0] >= bound], minlength=peaks.start.size - 1)
            out[k, rows] = found.reshape(rows.stop - rows.start, -1)
    return out


def peaks_by_rows(
    source: Run,
    chosen: NDArray[np.int64],
    counts: NDArray[np.uint32],
    grid: Grid,
    quantities: Sequence[str],
    feedback: Feedback,
) -> Iterator[tuple[slice, CellPeaks]]:
    """The largest value of each log in each cell, by bands of rows; one channel for each quantity."""
    bands = list(row_bands(counts.sum(axis=1, dtype=np.int64), HITS_AT_ONCE))
    bodies, reach = bodies_of(source), extents(source, chosen)
    for number, rows in enumerate(bands):
        peaks = CellPeaks(counts[rows], len(quantities))
        y0 = grid.y0 + rows.start * grid.cell
        south, north = y0 - 0.5 * grid.cell, y0 + (rows.stop - rows.start - 0.5) * grid.cell
        wanted = chosen[(reach[0] <= north) & (reach[1] >= south)]
        done = 0
        for piece in source.poses(wanted):
            if feedback.cancelled():
                raise Cancelled
            base, tip = ends_of(piece)
            values = np.stack([values_of(name, piece, bodies) for name in quantities])
            place = {"x0": grid.x0, "y0": y0, "cell": grid.cell}
            peaks.add(piece["log_row"], base, tip, *source.radii(), values, **place)
            done += np.unique(piece["log_id"]).size
            feedback.progress(
                number + done / max(1, wanted.size), len(bands), "collecting the values of each log in each cell"
            )
        yield rows, peaks
    feedback.progress(1, 1, "collecting the values of each log in each cell")


def values_of(name: str, piece: dict[str, NDArray], bodies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Speed [m/s], kinetic energy of translation and rotation [kJ], or clearance under the log [m] at each pose."""
    if name == "energy":
        return np.add(*energies_kj(piece, bodies))
    values = piece["speed_ms"] if name == "speed" else piece["clearance_m"]
    return np.maximum(values, 0.0).astype(np.float64)


def row_bands(hits: NDArray[np.int64], most: int) -> Iterator[slice]:
    """Successive rows with at most ``most`` hits together; a row with more hits is a separate band."""
    start, held = 0, 0
    for row, count in enumerate(hits.tolist()):
        if held + count > most and row > start:
            yield slice(start, row)
            start, held = row, 0
        held += count
    yield slice(start, len(hits))


def extents(source: Run, chosen: NDArray[np.int64]) -> NDArray[np.float64]:
    """Southernmost and northernmost reach of each chosen log [m], shape (2, k)."""
    low, high = np.full(len(source.deposits), np.inf), np.full(len(source.deposits), -np.inf)
    base_radius, _ = source.radii()
    for piece in source.poses(chosen):
        row = piece["log_row"]
        np.minimum.at(low, row, np.minimum(piece["yb"], piece["yt"]) - base_radius[row])
        np.maximum.at(high, row, np.maximum(piece["yb"], piece["yt"]) + base_radius[row])
    ids = source.deposits["log_id"].to_numpy()
    order = np.argsort(ids)
    rows = order[np.searchsorted(ids[order], chosen)]
    return np.stack([low[rows], high[rows]])


def quantiles_by_cell(
    values: NDArray[np.float32], start: NDArray[np.int64], levels: Sequence[float]
) -> NDArray[np.float32]:
    """Quantiles of the values of each cell, shape (levels, cells); values are not negative, NaN with too few."""
    count = np.diff(start)
    ordered = ordered_by_cell(values, start)
    out = np.full((len(levels), count.size), np.nan, np.float32)
    for k, level in enumerate(levels):
        filled = np.flatnonzero(count >= values_needed(level))
        at = level * (count[filled] - 1)
        low = np.floor(at).astype(np.int64)
        first = ordered[start[filled] + low].astype(np.float64)
        second = ordered[start[filled] + np.minimum(low + 1, count[filled] - 1)]
        out[k, filled] = first + (at - low) * (second - first)
    return out


def ordered_by_cell(values: NDArray[np.float32], start: NDArray[np.int64]) -> NDArray[np.float32]:
    """The values of each cell in ascending order; they are not negative.

    Sorted all at once: the bits of non-negative floats have the same order as their values, and the cell's number
    precedes them.
    """
    count = np.diff(start)
    keys = np.repeat(np.arange(count.size, dtype=np.uint64), count)
    keys <<= np.uint64(32)  # in place: these are the largest arrays of the tool
    keys |= values.view(np.uint32)
    keys.sort()
    return keys.astype(np.uint32).view(np.float32)  # the lower half
