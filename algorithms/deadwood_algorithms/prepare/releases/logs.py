"""Properties of released logs: by area or option, drawn from normal distributions or from a table of mapped deadwood.

For `sample_releases`. The draws of a log depend on the seed and its own id.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms import schemas
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import number_column, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.units import say_defaults, with_schema_names
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.drawn_sizes import TURNS, draw_pair
from deadwood_algorithms.stats import draws

if TYPE_CHECKING:
    import pandas

    from deadwood_engine import Logs

NUMBERS = ("dbh_cm", "length_m", "density_kg_m3", "tilt_deg", "azimuth_deg", "speed_ms", "drop_m")
SPREADS = ("dbh_sd_cm", "length_sd_m", "density_sd_kg_m3")
RANDOM, RANDOM_LYING = "random", "random-lying"
ORIENTATIONS = (*schemas.ORIENTATIONS, RANDOM, RANDOM_LYING)
LEAST_DBH_CM = 1.0
LEAST_LENGTH_M = 0.5
LEAST_DENSITY_KG_M3 = 50.0


@dataclass(frozen=True)
class Drawn:
    """The columns of each log, and the report about the draws."""

    columns: dict[str, np.ndarray]
    redrawn: int
    said: tuple[str, ...]


def columns_of_rows(frame: pandas.DataFrame, options: Mapping[str, Any], feedback: Feedback) -> dict[str, np.ndarray]:
    """Properties of the logs of each row (an area): its own columns, otherwise the options."""
    columns = {name: numbers(frame, name, options, feedback) for name in NUMBERS}
    columns["azimuth_deg"] %= 360.0
    if "geometry" in frame:
        sizes = {name: options[name] for name in ("dbh_cm", "length_m", "density_kg_m3")}
        say_defaults(frame, "releases", sizes, where_of(frame), feedback)
    columns |= {name: number_column(frame, name, default=options[name], minimum=0.0) for name in SPREADS}
    columns["orientation"] = np.full(len(frame), options["orientation"], object)
    if "orientation" in frame:
        columns["orientation"] = orientations(frame)
    return columns


def numbers(frame: pandas.DataFrame, name: str, options: Mapping[str, Any], feedback: Feedback) -> np.ndarray:
    column = schemas.RELEASES.column(name)
    values = schema_column(frame, column, options.get(name))
    warn_implausible(values, column, where_of(frame) if name in frame else "--" + name.replace("_", "-"), feedback)
    return values


def orientations(frame: pandas.DataFrame) -> np.ndarray:
    words = np.array([str(word).strip().lower() for word in frame["orientation"]], object)
    for row, word in enumerate(words):
        if word not in ORIENTATIONS:
            raise UserError(
                f"{where_of(frame)}, field 'orientation', row {row + 1}: '{word}' is not one of "
                + ", ".join(ORIENTATIONS)
            )
    return words


def mapped_deadwood(rows: pandas.DataFrame, feedback: Feedback) -> dict[str, np.ndarray]:
    """The columns of a table of mapped deadwood, which must have DBH and length (or the height of a tree)."""
    if not len(rows):
        raise UserError(f"{where_of(rows)}: the mapped deadwood layer is empty (no feature)")
    rows = rows.rename(columns={name: str(name).lower() for name in rows.columns})
    if "length_m" not in rows and "height_m" not in rows:
        rows = with_schema_names(rows, "trees", where_of(rows), feedback)
    rows = with_schema_names(rows, "releases", where_of(rows), feedback)
    if "length_m" not in rows and "height_m" in rows:
        feedback.note(f"{where_of(rows)}: the field 'height_m' is read as the length", code="field-renamed")
        rows = rows.rename(columns={"height_m": "length_m"})
    needed = ("dbh_cm", "length_m")
    columns = {name: numbers(rows, name, {}, feedback) for name in NUMBERS if name in rows or name in needed}
    account("deadwood", count_of(len(rows), len(columns["dbh_cm"]), {}))
    if "azimuth_deg" in columns:
        columns["azimuth_deg"] %= 360.0
    return columns | ({"orientation": orientations(rows)} if "orientation" in rows else {})


def draw_logs(
    of_area: Mapping[str, np.ndarray],
    area: np.ndarray,
    log_id: np.ndarray,
    seed: int,
    correlation: float,
    deadwood: Mapping[str, np.ndarray] | None,
) -> Drawn:
    """Draw the logs; ``area`` and ``log_id`` have shape (n,); the result has the columns of the releases layer."""
    columns = {name: values[area] for name, values in of_area.items()}
    spreads = {name: columns.pop(name) for name in SPREADS}
    said, redrawn = [], 0
    if deadwood:
        count = len(deadwood["dbh_cm"])
        row = np.minimum((draws.uniforms(seed, log_id, draws.LOG_ROW)[0] * count).astype(np.int64), count - 1)
        columns |= {name: values[row] for name, values in deadwood.items()}
        said.append(f"sizes drawn from {counted(count, 'mapped log')}")
    elif spreads["dbh_sd_cm"].any() or spreads["length_sd_m"].any():
        columns["dbh_cm"], columns["length_m"], redrawn = draw_pair(
            (columns["dbh_cm"], columns["length_m"]),
            (spreads["dbh_sd_cm"], spreads["length_sd_m"]),
            correlation,
            (LEAST_DBH_CM, LEAST_LENGTH_M),
            seed,
            log_id,
            draws.LOG_SIZE,
            "the distributions of DBH and length hardly ever give a possible log; check the numbers and their units",
        )
        if redrawn:
            limits = f"DBH < {LEAST_DBH_CM:g} cm or length < {LEAST_LENGTH_M:g} m"
            said.append(f"{counted(redrawn, 'draw was', 'draws were')} not a log ({limits}), redrawn")
    if spreads["density_sd_kg_m3"].any() and "density_kg_m3" not in (deadwood or {}):
        columns["density_kg_m3"] = densities(columns["density_kg_m3"], spreads["density_sd_kg_m3"], log_id, seed)
    for name, unit, label in (
        ("dbh_cm", "cm", "DBH"),
        ("length_m", "m", "length"),
        ("density_kg_m3", "kg/m³", "density"),
    ):
        if np.ptp(columns[name]) > 0:
            said.append(f"{label} {columns[name].mean():.1f} ± {columns[name].std():.1f} {unit}")
    directed(columns, log_id, seed)
    return Drawn(
        {each.name: columns[each.name] for each in schemas.RELEASES.columns if each.name in columns},
        redrawn,
        tuple(said),
    )


def densities(mean: np.ndarray, sd: np.ndarray, log_id: np.ndarray, seed: int) -> np.ndarray:
    """Normally distributed densities [kg/m3]; those below ``LEAST_DENSITY_KG_M3`` are drawn again."""
    density, left = mean.copy(), np.arange(mean.size)
    for turn in range(TURNS):
        density[left] = np.round(
            mean[left] + sd[left] * draws.normals(seed, log_id[left], draws.LOG_DENSITY, turn)[0], 2
        )
        left = left[density[left] < LEAST_DENSITY_KG_M3]
        if not left.size:
            return density
    raise UserError(
        "the distribution of the density hardly ever gives a possible log; check --density-kg-m3 and --density-sd-kg-m3"
    )


def directed(columns: dict[str, np.ndarray], log_id: np.ndarray, seed: int) -> None:
    """Draw the axis of the logs that lie or stand at random, in place.

    ``random``: every direction in space is equally likely (the cosine of the tilt is uniform), written as ``tilted``;
    ``random-lying``: in the terrain's tangent plane, towards any azimuth.
    """
    words = columns["orientation"]
    in_space, lying = words == RANDOM, words == RANDOM_LYING
    if not (in_space | lying).any():
        return
    u, v = draws.uniforms(seed, log_id, draws.LOG_AXIS)
    columns["tilt_deg"] = np.where(in_space, np.round(np.degrees(np.arccos(1 - 2 * u)), 2), columns["tilt_deg"])
    columns["azimuth_deg"] = np.where(in_space | lying, np.floor(v * 36000) / 100, columns["azimuth_deg"])
    columns["orientation"] = np.where(in_space, "tilted", np.where(lying, "lying", words))


def in_posture(orientation: str, logs: Logs, seed: int) -> Logs:
    """The same logs at the same places in another posture: a value of ``--orientation`` of sample-releases."""
    columns = {
        "orientation": np.full(logs.x.size, orientation, object),
        "tilt_deg": np.degrees(logs.tilt),
        "azimuth_deg": np.degrees(logs.azimuth),
    }
    directed(columns, logs.log_id, seed)
    return replace(
        logs,
        orientation=np.array([schemas.ORIENTATIONS.index(each) for each in columns["orientation"]], np.int8),
        tilt=np.radians(columns["tilt_deg"]),
        azimuth=np.radians(columns["azimuth_deg"]),
    )
