"""Which logs reach which line, for the map of their origins; and its summary in words."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard.line_passages import reached_logs
from deadwood_algorithms.files.vectors import read_table, read_vector
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.results import arrivals
from deadwood_algorithms.results.edges import Edges
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, input_paths, layers_in
from deadwood_algorithms.scene.layers import read_lines
from deadwood_algorithms.stats.statistics import lost_words, percent_with_interval

EDGE_M = 20.0


def line_shapes(others: str | None, source: Run) -> list[Any]:
    """The lines that are drawn."""
    path = others or f"{source.path / GEOPACKAGE}|layername=reach"
    kinds = ("line", "polygon")
    return list(read_vector(path, geometry=kinds, target_crs=source.grid.crs, what="lines", feedback=Quiet()).geometry)


def reached_rows(
    others: str | None, source: Run, feedback: Feedback
) -> tuple[NDArray[np.int64], dict[str, NDArray[np.bool_]]]:
    """The rows of the logs that count, and for each line which of them reach it.

    For the run's own lines all logs count, for other lines only those whose trajectory was stored.
    """
    ids = source.deposits["log_id"].to_numpy(np.int64)
    if others is None:
        if "reach" not in layers_in(source.path):
            raise UserError(f"{source.path}: the run has no roads, railways or houses; name them with --lines LAYER")
        names = read_table(f"{source.path / GEOPACKAGE}|layername=reach", what="reach")["line_id"].astype(str)
        by_line = reached_logs(source)
        nobody = np.zeros(0, np.int64)
        return np.arange(ids.size), {name: np.isin(ids, by_line.get(name, nobody)) for name in names}
    lines, items = read_lines(others, source.grid, feedback)
    if not source.stored_log_ids.size:
        raise UserError(f"{source.path}: no trajectory was stored; run slide-logs with --trajectories all")
    rows = np.flatnonzero(np.isin(ids, source.stored_log_ids))
    if rows.size < ids.size:
        feedback.note(
            f"{rows.size} of {ids.size} logs have a stored trajectory; the shares are based on these",
            code="some-trajectories",
            stored=rows.size,
            logs=ids.size,
        )
    with Edges(source.grid, input_paths(source.path, source.manifest, "dem"), feedback) as edges:
        arrived = arrivals.find_arrivals(source, lines, items, edges, EDGE_M, feedback)
    reached = arrived.reached(ids.size, len(items.ids))[rows]
    return rows, {str(name): reached[:, k] for k, name in enumerate(items.ids)}


def lines_of(facts: dict[str, Any]) -> tuple[str, ...]:
    """How many logs reach each line, and the area from which they come."""
    shown = [
        f"{counted(facts['logs'], 'log')} in cells of {facts['cell_m']:g} m, {100 * facts['told']:.0f} % of them in "
        "cells with a share"
    ]
    for each in facts["reach"][1 if len(facts["reach"]) == 2 else 0 :]:
        shown.append(
            f"{each['line_id']}: {each['n_reach']} of {each['n_total']} logs, {percent_with_interval(each)}"
            f"{lost_words(each)}"
        )
        for row in facts["sources"]:
            if row["line_id"] == each["line_id"]:
                shown.append(
                    f"  at least {100 * row['least_p']:g} %: from {significant(row['area_m2'] / 1e4, 2)} ha, "
                    f"of whose logs {percent_with_interval(row)} reach it"
                )
    for row in facts["affected"] or []:
        shown.append(
            f"release {row['release_id']}: {significant(row['area_m2'] / 1e4, 2)} ha passed by at least "
            f"{100 * row['least_p']:g} % of its {counted(row['n_logs'], 'log')}"
        )
    return tuple(shown)
