"""Lying logs as obstacles, from a layer of lines: positions, diameters, ids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.columns import filled_column, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.units import say_defaults
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import rows_named
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import Items, items_of, paths_of
from deadwood_algorithms.schemas import LYING_LOGS
from deadwood_engine import LyingLogs

TIP, CAPACITY = "tip_diameter_cm", "capacity_kj"


def read_lying_logs(path: str | None, grid: Grid, default_cm: float, feedback: Feedback) -> tuple[LyingLogs, Items]:
    """Lying logs with their diameters, drawn from base to tip; rows of one lying_id count as one log.

    The diameter is taken from ``diameter_cm``, else ``dbh_cm``, else the default; the tip's from
    ``tip_diameter_cm``, else it is half the base's, as for all logs. Those with ``capacity_kj`` break, others do not.
    """
    if path is None:
        return LyingLogs.none(), Items([], np.array([], object), np.array([], np.int64))
    frame = read_vector(path, geometry=("line",), target_crs=grid.crs, what="lying_logs", feedback=feedback)
    base = schema_column(frame, LYING_LOGS.column("diameter_cm"), default_cm)
    say_defaults(frame, "lying_logs", {"diameter_cm": default_cm}, where_of(frame), feedback)
    warn_implausible(base, LYING_LOGS.column("diameter_cm"), where_of(frame), feedback)
    tip = schema_column(frame, LYING_LOGS.column(TIP)) if TIP in frame else 0.5 * base
    swapped = np.flatnonzero(tip > 2.0 * base)
    if swapped.size:
        raise UserError(
            f"{where_of(frame)}, field '{TIP}', {rows_named(swapped)}: the tip is more than twice as thick as "
            "the base; draw the line from base to tip, or correct the field"
        )
    paths = paths_of(frame, grid, "lying log", feedback)
    kj = filled_column(frame, CAPACITY, np.inf, minimum=0.0, exclusive=True)
    capacity = 1000.0 * kj[paths.item] if np.isfinite(kj).any() else None
    lying = LyingLogs(paths.vertices, paths.starts, base[paths.item] / 100.0, tip[paths.item] / 100.0, capacity)
    return lying, items_of(frame, ("lying_id", "tree_id", "log_id", "name"), paths, feedback)


def with_more(own: LyingLogs, more: LyingLogs) -> LyingLogs:
    """Lying logs, and others after them."""
    capacity = None
    if own.capacity is not None or more.capacity is not None:
        capacity = np.concatenate([capacities(own), capacities(more)])
    return LyingLogs(
        np.concatenate([own.vertices, more.vertices]),
        np.concatenate([own.starts, own.starts[-1] + more.starts[1:]]),
        np.concatenate([own.diameter, more.diameter]),
        np.concatenate([own.tip_diameter, more.tip_diameter]),
        capacity,
    )


def capacities(lying: LyingLogs) -> NDArray[np.float64]:
    """Energy [J] that each absorbs before it breaks; infinite: it does not."""
    return np.full(len(lying.diameter), np.inf) if lying.capacity is None else np.asarray(lying.capacity, float)
