"""How logs arrive at a barrier or a line: energy, speed, height and impulse of each log, and percentiles of them.

At a barrier these are the run's own records just before each hit; if a log hits it several times, the
largest value counts, because the hits of a log are not independent. At a line, where nothing is hit, they are those
of the log when its outline first touches the line, from its stored trajectory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.results.arrivals import Arrived, find_arrivals
from deadwood_algorithms.results.edges import Edges
from deadwood_algorithms.results.motion import bodies_of
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, input_paths, layers_in
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import read_lines
from deadwood_algorithms.stats.order_statistics import percentile_record
from deadwood_engine.log_body import MASS

Array = NDArray[np.float64]
UNITS = {"energy": "kJ", "translation": "kJ", "rotation": "kJ", "speed": "m/s", "height": "m", "impulse": "kN s"}
NO_IMPULSE = "nothing is hit at a line, so there is no impulse; draw it as a barrier and run slide-logs"
NO_TERRAIN = "the run's terrain model no longer exists, above which heights are"
NOT_STORED = "no trajectory was stored; run slide-logs with --trajectories all"
STATIONS = 41  # places along a log at which its height above a line is evaluated


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
    """Each barrier of the run, also one that no log hit."""
    ids = [each["barrier_id"] for each in source.summary("barriers")["barriers"]]
    if not ids:
        return
    if "barrier_hits" not in layers_in(source.path):
        for each in ids:
            yield Passages("barrier", str(each), np.zeros(0, np.int64), {name: np.zeros(0) for name in UNITS}, {})
        return
    hits: Any = read_table(f"{source.path / GEOPACKAGE}|layername=barrier_hits", what="barrier_hits")
    mass: Any = pandas.Series(bodies_of(source)[:, MASS], index=source.deposits["log_id"].to_numpy())
    moving = 0.5 * mass[hits["log_id"]].to_numpy() * hits["speed_ms"].to_numpy() ** 2 / 1000.0
    total = hits["energy_kj"].to_numpy()
    found: Any = pandas.DataFrame(
        {
            "energy": total,
            "translation": moving,
            "rotation": np.maximum(total - moving, 0.0),
            "speed": hits["speed_ms"].to_numpy(),
            "height": hits["height_m"].to_numpy(),
            "impulse": hits["impulse_kns"].to_numpy(),
        }
    )
    place = hits["barrier_id"].astype(str).to_numpy()
    for each in ids:
        mine = place == str(each)
        largest = found[mine].groupby(hits["log_id"].to_numpy()[mine]).max()
        values = {name: largest[name].to_numpy(np.float64) for name in UNITS}
        yield Passages("barrier", str(each), largest.index.to_numpy(np.int64), values, {})


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
    lacks = {"impulse": NO_IMPULSE} | ({} if edges.path else {"height": NO_TERRAIN})
    for number, line_id in enumerate(items.ids):
        mine = table[table["line"] == number]
        moving, turning = (mine[name].to_numpy(np.float64) for name in ("energy_kj", "rotation_kj"))
        values = {"energy": moving + turning, "translation": moving, "rotation": turning}
        values["speed"] = mine["speed_ms"].to_numpy(np.float64)
        if edges.path:
            values["height"] = heights_over(mine, items.geometry[number], source.radii(), edges)
        yield Passages("line", str(line_id), log_id[mine["log"].to_numpy()], values, lacks)


def unseen_lines(ids: Sequence[Any]) -> Iterator[Passages]:
    """Lines of a run that stored no trajectory."""
    for each in ids:
        yield Passages("line", str(each), np.zeros(0, np.int64), {}, dict.fromkeys(UNITS, NOT_STORED))


def heights_over(table: Any, shape: Any, radii: tuple[Array, Array], edges: Edges) -> Array:
    """Height above the terrain of the top of each log where it touches a line [m], which a barrier there would need.

    The log is evaluated at `STATIONS` places along its axis: those whose plan outline touches the line, or the
    nearest one, count with their upper edge.
    """
    share = np.linspace(0.0, 1.0, STATIONS)
    row = table["log"].to_numpy()
    base, tip = (np.stack([table[f"{axis}{end}"].to_numpy(np.float64) for axis in "xyz"], axis=1) for end in "bt")
    places = base[:, None, :] + share[None, :, None] * (tip - base)[:, None, :]
    thick = radii[0][row][:, None] + share[None, :] * (radii[1] - radii[0])[row][:, None]
    axis = (tip - base) / np.linalg.norm(tip - base, axis=1)[:, None]
    line = shape.boundary if shapely.get_dimensions(shape) == 2 else shape
    apart = shapely.distance(shapely.points(places[..., 0], places[..., 1]), line) - thick
    touching = apart <= np.maximum(apart.min(axis=1), 0.0)[:, None]
    x, y = places[..., 0].ravel(), places[..., 1].ravel()
    ground = edges.heights(x, y).reshape(apart.shape)
    top = places[..., 2] + thick * np.sqrt(np.maximum(1.0 - axis[:, 2:3] ** 2, 0.0)) - ground
    return np.where(touching & np.isfinite(top), top, -np.inf).max(axis=1, initial=-np.inf)


def design_rows(passages: Passages, levels: Sequence[float], confidence: float) -> Iterator[dict[str, Any]]:
    """Percentiles of each quantity with their intervals, and those that cannot be given, in words."""
    for quantity, unit in UNITS.items():
        values = passages.values.get(quantity, np.zeros(0))
        values = values[np.isfinite(values)]
        for level in levels:
            record = percentile_record(values, level, confidence)
            lack = passages.lacks.get(quantity, "")
            if lack:
                record["n_more"] = 0
            words = (
                f"needs {counted(int(record['n_more']), 'more hit')} for an upper bound" if record["n_more"] else lack
            )
            place = {"kind": passages.kind, "place_id": passages.place_id, "quantity": quantity, "unit": unit}
            yield place | {"percentile": round(100.0 * level, 9)} | record | {"note": words}
