"""Runs that are compared log by log: read, checked to be of the same releases, and brought into one order."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.crs import crs_name, same_crs
from deadwood_algorithms.files.input_files import places_of
from deadwood_algorithms.files.vectors import read_table, read_vector
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.results.arrivals import Arrived, find_arrivals
from deadwood_algorithms.results.checked import SUMMARY
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, layers_in, read_run
from deadwood_algorithms.results.scenario import overridden_options, summary_if_there
from deadwood_algorithms.scene.default_log import DEFAULTED
from deadwood_algorithms.scene.layers import read_lines
from deadwood_algorithms.stats.endings import ended, known_runouts, left_dem

# Columns of the releases that deposits repeat, and by how much two of the same may differ: coordinates by rounding
# only.
SAME = {
    "release_id": 0.0,
    "release_x": 1e-6,
    "release_y": 1e-6,
    "dbh_cm": 1e-9,
    "length_m": 1e-9,
    "density_kg_m3": 1e-9,
}
# Parameters that change no log's movement, or are compared as releases.
NO_MATTER = (
    "output",
    "overwrite",
    "threads",
    "resume",
    "restart",
    "trajectories",
    "until_ci",
    "error",
    "budget",
    "assume",
    "seed",
    "min_runout_m",
    "releases",
    "report",
    "qgis_project",
    "geoparquet",
    "outline_every_s",
    "danger_least",
    "danger_counts",
    "scheduler",
    "workers",
    "friction_preset",  # its values are in friction
)
SAME_LINE_M = 0.01
OBSTACLES = ("trees", "barriers", "lying_logs", "blocks")


@dataclass(frozen=True)
class Scenario:
    """One run; rows of its deposits in the order of the logs that all runs have.

    reach : (n, lines), the same lines for all runs
    energy : (n, lines), of translation and rotation at the first touch [kJ]; NaN for a log that does not reach
    stored : (n,), logs whose energies are known
    """

    name: str
    run: Run
    rows: NDArray[np.int64]
    reach: NDArray[np.bool_]
    energy: NDArray[np.float64]
    stored: NDArray[np.bool_]

    def column(self, name: str) -> NDArray[Any]:
        return self.run.deposits[name].to_numpy()[self.rows]

    @cached_property
    def left_dem(self) -> NDArray[np.bool_]:
        """Logs that left the terrain model."""
        return left_dem(self.run.deposits)[self.rows]

    @cached_property
    def runouts(self) -> NDArray[np.float64]:
        """Of all logs [m]; infinite without a deposit (`known_runouts`)."""
        return known_runouts(self.run.deposits["runout_m"].to_numpy(), self.run.deposits)[self.rows]

    @cached_property
    def still_moving(self) -> NDArray[np.bool_]:
        """Logs that had not come to rest at the time limit."""
        return ended(self.run.deposits, "time_limit")[self.rows]

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """Deposits in plan [m], shape (n, 2)."""
        points = self.run.deposits.geometry
        return np.column_stack([points.x, points.y])[self.rows]


@dataclass(frozen=True)
class Compared:
    """The scenarios, the reference first, with the logs that all of them have."""

    scenarios: list[Scenario]
    line_ids: list[Any]
    lines: list[Any]  # their shapes
    log_id: NDArray[np.int64]

    @property
    def reference(self) -> Scenario:
        return self.scenarios[0]

    @property
    def others(self) -> list[Scenario]:
        return self.scenarios[1:]


def folders_of(runs: str, names: str | None) -> tuple[list[str], list[str]]:
    """The folders of the runs, whose names may contain commas, and what the scenarios are called."""
    folders = [str(each) for each in places_of(runs)]
    if not all(map(os.path.exists, folders)):  # False also of names that no file can have
        folders = [each.strip() for each in runs.split(",") if each.strip()]
    if len(folders) < 2:
        raise UserError(f"--runs is '{runs}', but must name at least two folders of slide-logs, separated by commas")
    called = [each.strip() for each in names.split(",")] if names else [Path(each).name for each in folders]
    if len(called) != len(folders):
        raise UserError(
            f"--names holds {len(called)} names for {len(folders)} runs; give one each, separated by commas"
        )
    if names is None and len(set(called)) < len(called):  # a/run and b/run
        called = ["_".join(Path(each).parts[-2:]) for each in folders]
    for name in called:
        if not name or called.count(name) > 1:
            raise UserError(
                f"--names: '{name}' does not distinguish the runs; give each a different name, separated by commas"
            )
        if any(sign in name for sign in '/\\:*?"<>|'):
            raise UserError(f"--names: '{name}' cannot be part of a file's name; leave out its special characters")
    return folders, called


def baseline_first(
    summaries: Sequence[Mapping[str, Any]], names: Sequence[str], asked: str | None, feedback: Feedback
) -> list[int]:
    """Rows of the runs in the order in which they are compared: the baseline first, the others in the given order.

    The baseline is the run that the user names, otherwise the one with the fewest obstacles: an index of protection
    measures what the others add to it. Of runs with equally few, or of an older version, it is the first.
    """
    if asked is not None and asked not in names:
        raise UserError(f"--baseline is '{asked}', but the runs are called {', '.join(names)}")
    scenarios = [each.get("scenario") for each in summaries]
    known = [each for each in scenarios if each]
    counts = [sum(each[name]["n"] for name in OBSTACLES) for each in known] if len(known) == len(scenarios) else []
    least = counts.index(min(counts)) if counts else 0
    first = least if asked is None else names.index(asked)
    if asked is None and first:
        feedback.note(
            f"the baseline is {names[first]}, which has the fewest obstacles ({counts[first]}; {names[0]} has "
            f"{counts[0]}); --baseline names another",
            code="baseline-chosen",
        )
    elif counts and counts[first] > counts[least]:
        feedback.warn(
            f"the baseline {names[first]} has more obstacles ({counts[first]}) than {names[least]} ({counts[least]}): "
            "so the indices measure its lack of protection, and are negative",
            code="baseline-has-obstacles",
        )
    return [first, *(k for k in range(len(names)) if k != first)]


def read_compared(
    runs: str,
    names: str | None,
    lines: str | None,
    feedback: Feedback,
    *,
    baseline: str | None = None,
    ordered: bool = False,
) -> Compared:
    """Read the runs, refuse those of other releases, and find what each log reached in each of them.

    ordered : the runs are in the order of `baseline_first` already, so the first is the baseline
    """
    folders, called = folders_of(runs, names)
    found = [read_run(each, feedback=feedback) for each in folders]
    if not ordered:
        summaries = [each.summary() if (each.path / SUMMARY).is_file() else {} for each in found]
        order = baseline_first(summaries, called, baseline, feedback)
        found, called = [found[k] for k in order], [called[k] for k in order]
    for run in found[1:]:
        if not same_crs(run.grid.crs, found[0].grid.crs):
            crs = crs_name(run.grid.crs), crs_name(found[0].grid.crs)
            raise UserError(f"{run.path}: this run is in {crs[0]}, but {found[0].path} is in {crs[1]}")
        refuse_other_releases(found[0], run)
    held = [run.deposits["log_id"].to_numpy(np.int64) for run in found]
    if lines:
        held = [np.intersect1d(each, run.stored_log_ids) for each, run in zip(held, found, strict=True)]
    common = held[0]
    for each in held[1:]:
        common = common[np.isin(common, each)]
    if not common.size:
        fix = "run slide-logs with --trajectories all" if lines else "they have no log in common"
        raise UserError(f"{runs}: no log can be compared in all runs; {fix}")
    most = max(len(run.deposits) for run in found)
    if common.size < most:
        why = "have a stored trajectory" if lines else "were slid"
        feedback.note(
            f"{common.size} of up to {most} logs {why} in all runs and are compared",
            code="logs-in-common",
            logs=common.size,
        )
    rows = [rows_by_log_id(run, common) for run in found]
    if lines:
        line_ids, shapes, energies = energies_of_lines(found, lines, feedback)
        reach = [np.isfinite(each) for each in energies]
    else:
        line_ids, shapes, reach = reach_of_runs(found, feedback)
        energies = energies_of_runs(found, line_ids, feedback)
    stored = [np.isin(run.deposits["log_id"], run.stored_log_ids) for run in found]
    parts = zip(called, found, rows, reach, energies, stored, strict=True)
    scenarios = [Scenario(name, run, row, hit[row], kj[row], kept[row]) for name, run, row, hit, kj, kept in parts]
    return Compared(scenarios, line_ids, shapes, common)


def rows_by_log_id(run: Run, log_id: NDArray[np.int64]) -> NDArray[np.int64]:
    ids = run.deposits["log_id"].to_numpy(np.int64)
    order = np.argsort(ids)
    return order[np.searchsorted(ids[order], log_id)]


def refuse_other_releases(one: Run, other: Run) -> None:
    """Raise ``UserError`` that names the log and the column in which the releases of two runs differ."""
    digests = [run.manifest.get("digests", {}).get("releases") for run in (one, other)]
    if digests[0] and digests[0] == digests[1]:
        return  # the same to the last bit, although a run with --until-ci may have slid only part of them
    fix = "slide the same releases layer with the same options in both"
    ids = [run.deposits["log_id"].to_numpy(np.int64) for run in (one, other)]
    for here, there, lacks in ((ids[0], ids[1], other), (ids[1], ids[0], one)):
        missing = np.setdiff1d(here, there)
        if missing.size:
            having = one if lacks is other else other
            more = f" (and {missing.size - 1} more)" if missing.size > 1 else ""
            raise UserError(f"{lacks.path}: log_id {missing[0]}{more} of {having.path} is not in this run; {fix}")
    common = np.sort(ids[0])
    rows = rows_by_log_id(one, common), rows_by_log_id(other, common)
    for column, allowed in SAME.items():
        a, b = (run.deposits[column].to_numpy()[row] for run, row in zip((one, other), rows, strict=True))
        apart = np.abs(a - b) > allowed if allowed else np.asarray(a.astype(str) != b.astype(str))
        if apart.any():
            k = int(np.argmax(apart))
            raise UserError(
                f"{other.path}: {column} of log_id {common[k]} is {b[k]}, but {a[k]} in {one.path} "
                f"({int(apart.sum())} of {common.size} logs differ); {fix}"
            )
    if all(digests):
        given = [run.manifest.get("parameters", {}) for run in (one, other)]
        options = [name for name in DEFAULTED if given[0].get(name) != given[1].get(name)]
        named = ", ".join(
            f"--{name.replace('_', '-')} {given[1].get(name)} for {given[0].get(name)}" for name in options
        )
        what = (
            f"it was run with {named}" if options else "orientation, tilt, azimuth, speed or drop of a log is another"
        )
        raise UserError(f"{other.path}: its releases are not those of {one.path}: {what}; {fix}")


def reach_of_runs(runs: Sequence[Run], feedback: Feedback) -> tuple[list[Any], list[Any], list[NDArray[np.bool_]]]:
    """The runs' own results for the lines that all of them watched: ids, shapes, reach by row of deposits."""
    layers = [layers_in(run.path) for run in runs]
    if not all("reach" in each for each in layers):
        without = [str(run.path) for run, each in zip(runs, layers, strict=True) if "reach" not in each]
        feedback.note(
            f"{', '.join(without)}: run without --lines, so no reach is compared; give lines with --lines",
            code="no-lines",
        )
        return [], [], [np.zeros((len(run.deposits), 0), bool) for run in runs]
    frames = [
        read_vector(
            f"{run.path / GEOPACKAGE}|layername=reach",
            geometry=("line", "polygon"),
            target_crs=run.grid.crs,
            what="reach",
            feedback=feedback,
        ).set_index("line_id")
        for run in runs
    ]
    shared = [each for each in frames[0].index if all(each in frame.index for frame in frames)]
    if not shared:
        raise UserError(f"{runs[-1].path}: no line of {runs[0].path} was watched in this run; give lines with --lines")
    for run, frame in zip(runs[1:], frames[1:], strict=True):
        for line_id in shared:
            off = frames[0].geometry[line_id].hausdorff_distance(frame.geometry[line_id])
            if off > SAME_LINE_M:
                raise UserError(
                    f"{run.path}: line '{line_id}' lies {off:.2f} m from where it lies in {runs[0].path}; give one "
                    "layer for all runs with --lines"
                )
    left_out = {each for frame in frames for each in frame.index} - set(shared)
    if left_out:
        feedback.note(
            f"not watched in all runs, so not compared: line {', '.join(map(str, sorted(left_out, key=str)))}",
            code="lines-left-out",
            lines=len(left_out),
        )
    reach = []
    for run, names in zip(runs, layers, strict=True):
        touched = np.zeros((len(run.deposits), len(shared)), bool)
        if "reached_by" in names:
            rows = read_table(f"{run.path / GEOPACKAGE}|layername=reached_by", what="reached_by")
            rows = rows[rows["line_id"].isin(shared)]
            column = np.array([shared.index(each) for each in rows["line_id"]], np.int64)
            touched[rows_by_log_id(run, np.asarray(rows["log_id"], np.int64)), column] = True
        reach.append(touched)
    return shared, [frames[0].geometry[line_id] for line_id in shared], reach


def energies_of_lines(
    runs: Sequence[Run], lines: str, feedback: Feedback
) -> tuple[list[Any], list[Any], list[NDArray[np.float64]]]:
    """Energies with which stored trajectories reach lines: ids, shapes, and kJ by row of deposits, NaN for none."""
    energies, ids, shapes = [], [], []
    for run in runs:
        polylines, items = read_lines(lines, run.grid, feedback)
        arrived = find_arrivals(run, polylines, items, None, 0.0, feedback)
        energies.append(_energies(arrived, len(run.deposits), len(items.ids)))
        ids, shapes = items.ids, list(items.geometry)
    return ids, shapes, energies


def energies_of_runs(runs: Sequence[Run], line_ids: Sequence[Any], feedback: Feedback) -> list[NDArray[np.float64]]:
    """The same for the runs' own lines; NaN throughout, with a note, if a run stored no trajectory."""
    found = []
    for run in runs:
        energy = np.full((len(run.deposits), len(line_ids)), np.nan)
        found.append(energy)
        if not line_ids:
            continue
        if not run.stored_log_ids.size:
            feedback.note(
                f"{run.path.name}: no trajectory was stored, so no energy at lines (MIRI, ORPI) is compared; "
                "run slide-logs with --trajectories all",
                code="no-trajectories",
            )
            continue
        try:
            polylines, items = read_lines(f"{run.path / GEOPACKAGE}|layername=reach", run.grid, Quiet())
            arrived = find_arrivals(run, polylines, items, None, 0.0, feedback)
        except UserError as error:  # the file of the shape no longer exists
            feedback.warn(f"no energy at lines (MIRI, ORPI) is compared: {error}", code="no-energies")
            continue
        energy[:] = _energies(arrived, len(energy), len(items.ids))[:, [items.ids.index(each) for each in line_ids]]
    return found


def _energies(arrived: Arrived, n_logs: int, n_lines: int) -> NDArray[np.float64]:
    out = np.full((n_logs, n_lines), np.nan)
    table: Any = arrived.table
    out[table["log"], table["line"]] = (table["energy_kj"] + table["rotation_kj"]).to_numpy()
    return out


def differing(compared: Compared) -> dict[str, dict[str, Any]]:
    """Parameters of slide-logs in which the scenarios differ: by parameter, then by scenario. What a column of the
    releases overrides in one run had no effect in any, for the releases are the same.
    """
    idle: set[str] = set()
    given = {each.name: dict(each.run.manifest.get("parameters", {})) for each in compared.scenarios}
    for each in compared.scenarios:
        if given[each.name].get("fidelity") == "auto":  # the one that was chosen
            given[each.name]["fidelity"] = each.run.fidelity
        idle |= overridden_options(each.run.manifest, summary_if_there(each.run.path, each.run.manifest))
    names = dict.fromkeys(name for values in given.values() for name in values if name not in {*NO_MATTER, *idle})
    table = {name: {scenario: values.get(name) for scenario, values in given.items()} for name in names}
    return {name: values for name, values in table.items() if len({str(each) for each in values.values()}) > 1}
