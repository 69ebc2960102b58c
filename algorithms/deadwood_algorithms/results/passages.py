"""How logs arrive at a barrier or a line: energy, speed and height of each log, and percentiles of them.

They are those of every log that comes there, in the plane of the place, whether a barrier stops it or not: at a barrier
as recorded by the run (`barrier_arrivals`), at a line those of the first touch, from stored trajectories. At a barrier
there are also those of the logs that hit it, just before the hit, with the impulse; if a log hits it several times, the
largest value counts, because the hits of a log are not independent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.results.arrivals import Arrived, find_arrivals, heights_over
from deadwood_algorithms.results.edges import Edges
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, input_paths, layers_in
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import read_lines
from deadwood_algorithms.stats.order_statistics import percentile_record

Array = NDArray[np.float64]
ARRIVING = {"energy": "kJ", "translation": "kJ", "rotation": "kJ", "speed": "m/s", "height_needed": "m"}
HITTING = {"energy_hit": "kJ", "speed_hit": "m/s", "height_hit": "m", "impulse": "kN s"}
UNITS = ARRIVING | HITTING
NO_IMPULSE = "nothing is hit at a line, so there is no impulse; draw it as a barrier and run slide-logs"
NO_TERRAIN = "the run's terrain model no longer exists, above which heights are"
NOT_STORED = "no trajectory was stored; run slide-logs with --trajectories all"


@dataclass(frozen=True)
class Passages:
    """The logs that came to one place: values by quantity, one for each log, in the order of ``log_id``.

    kind : barrier or line
    lacks : why a quantity has no values, by quantity
    """

    kind: str
    place_id: str
    log_id: NDArray[np.int64]
    values: dict[str, Array]
    lacks: dict[str, str]


def barrier_passages(source: Run) -> Iterator[Passages]:
    """Each barrier of the run, also one that no log came to."""
    ids = [each["barrier_id"] for each in source.summary("barriers")["barriers"]]
    there = layers_in(source.path)
    if "barrier_hits" in there and "barrier_arrivals" not in there:
        raise UserError(
            f"{source.path}: this run was written by an earlier version, which recorded only the logs that hit a "
            "barrier, not those that jump over it; run slide-logs again"
        )
    came, hits = (
        read_table(f"{source.path / GEOPACKAGE}|layername={name}", what=name) if name in there else None
        for name in ("barrier_arrivals", "barrier_hits")
    )
    for each in ids:
        log_id, values = np.zeros(0, np.int64), {name: np.zeros(0) for name in UNITS}
        if came is not None:
            mine: Any = came[came["barrier_id"].astype(str) == str(each)]
            log_id = mine["log_id"].to_numpy(np.int64)
            values |= {
                "energy": mine["energy_kj"].to_numpy(np.float64),
                "translation": (mine["energy_kj"] - mine["rotation_kj"]).to_numpy(np.float64),
                "rotation": mine["rotation_kj"].to_numpy(np.float64),
                "speed": mine["speed_ms"].to_numpy(np.float64),
                "height_needed": mine["height_needed_m"].to_numpy(np.float64),
            }
        if hits is not None:
            largest: Any = hits[hits["barrier_id"].astype(str) == str(each)].groupby("log_id").max(numeric_only=True)
            columns = {"energy_hit": "energy_kj", "speed_hit": "speed_ms", "height_hit": "height_hit_m"}
            columns |= {"impulse": "impulse_kns"}
            values |= {name: largest[column].to_numpy(np.float64) for name, column in columns.items()}
        yield Passages("barrier", str(each), log_id, values, {})


def passages_of_lines(source: Run, lines: str | None, feedback: Feedback) -> list[Passages]:
    """The logs that reach each line of a layer or, without a layer, each line of the run; none if it has no lines."""
    if lines is None and "reach" not in layers_in(source.path):
        return []
    place = lines or f"{source.path / GEOPACKAGE}|layername=reach"
    polylines, items = read_lines(place, source.grid, feedback if lines else Quiet())
    if not source.stored_log_ids.size:
        if lines:
            raise UserError(f"{source.path}: {NOT_STORED}")
        feedback.warn(f"{source.path}: there are no energies at lines: {NOT_STORED}", code="no-energies")
        return list(unseen_lines(items.ids))
    if source.stored_log_ids.size < len(source.deposits):
        text = f"{source.stored_log_ids.size} of {len(source.deposits)}"
        feedback.note(
            f"{text} logs have a stored trajectory; the values at lines are based on these", code="some-trajectories"
        )
    with Edges(source.grid, input_paths(source.path, source.manifest, "dem"), feedback) as edges:
        arrived = find_arrivals(source, polylines, items, None, 0.0, feedback)
        return list(line_passages(source, arrived, items, edges))


def line_passages(source: Run, arrived: Arrived, items: Items, edges: Edges) -> Iterator[Passages]:
    """Each line, from the logs' first touches of it (`arrivals.find_arrivals`)."""
    table: Any = arrived.table
    log_id = source.deposits["log_id"].to_numpy(np.int64)
    lacks = {"impulse": NO_IMPULSE} | ({} if edges.path else {"height_needed": NO_TERRAIN})
    for number, line_id in enumerate(items.ids):
        mine = table[table["line"] == number]
        moving, turning = (mine[name].to_numpy(np.float64) for name in ("energy_kj", "rotation_kj"))
        values = {"energy": moving + turning, "translation": moving, "rotation": turning}
        values["speed"] = mine["speed_ms"].to_numpy(np.float64)
        if edges.path:
            values["height_needed"] = heights_over(mine, items.geometry[number], source.radii(), edges.heights)
        yield Passages("line", str(line_id), log_id[mine["log"].to_numpy()], values, lacks)


def unseen_lines(ids: Sequence[Any]) -> Iterator[Passages]:
    """Lines of a run that stored no trajectory."""
    for each in ids:
        yield Passages("line", str(each), np.zeros(0, np.int64), {}, dict.fromkeys([*ARRIVING, "impulse"], NOT_STORED))


def design_rows(passages: Passages, levels: Sequence[float], confidence: float) -> Iterator[dict[str, Any]]:
    """Percentiles of each quantity with their intervals, and those that cannot be given, in words."""
    for quantity, unit in UNITS.items():
        if quantity not in passages.values and quantity not in passages.lacks:
            continue
        values = passages.values.get(quantity, np.zeros(0))
        values = values[np.isfinite(values)]
        for level in levels:
            record = percentile_record(values, level, confidence)
            lack = passages.lacks.get(quantity, "")
            if lack:
                record["n_more"] = 0
            words = f"needs {counted(int(record['n_more']), 'more arrival')}" if record["n_more"] else lack
            place = {"kind": passages.kind, "place_id": passages.place_id, "quantity": quantity, "unit": unit}
            yield place | {"percentile": round(100.0 * level, 9)} | record | {"note": words}
