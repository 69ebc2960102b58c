"""The layers and options of a run, from its manifest, to be used again with changes."""

from __future__ import annotations

import dataclasses
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.configs import value_from_json
from deadwood_algorithms.files.identity import where_now
from deadwood_algorithms.files.input_files import MANIFEST
from deadwood_algorithms.params.manifest import engine_digest, is_path, moved_paths
from deadwood_algorithms.params.tool import Parameter, UserError, check_value
from deadwood_algorithms.results.run_folder import Run, input_record
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.scene.releases import Releases
from deadwood_engine import FIDELITIES, Fidelity, fidelity_with


def question_of(source: Run, **changes: Any) -> ReleasedScene:
    """The layers and options of a run; inputs that were moved together with it are found, otherwise they are reported
    as missing.
    """
    asked = source.manifest.get("parameters", {})
    names = [each.name for each in dataclasses.fields(ReleasedScene)]
    values = {name: asked[name] for name in names if name in asked}
    for each in dataclasses.fields(ReleasedScene):
        declared = dataclasses.replace(each.metadata["parameter"], name=each.name)
        if each.name in changes:
            continue
        if each.name in values:
            _refuse_unfit(source, declared, values[each.name])
        if each.name in values and is_path(declared, values[each.name]):
            values[each.name] = _found(source, each.name, str(values[each.name]))
    try:
        return ReleasedScene(**{**values, **changes})
    except TypeError as error:
        raise UserError(
            f"{source.path}: its manifest names no {error.args[0].split()[-1]}; run slide-logs again"
        ) from error


def _refuse_unfit(source: Run, declared: Parameter, value: Any) -> None:
    """Reject impossible values: the manifest of an older run was edited, or is damaged."""
    try:
        check_value(declared, value)
        if value is not None:
            value_from_json(declared, value)
    except UserError as error:
        raise UserError(f"{source.path / MANIFEST}: {error}; run slide-logs again") from error


def _found(source: Run, parameter: str, named: str) -> str:
    file, bar, layer = named.partition("|")
    record = input_record(source.manifest, parameter)
    same = [where_now(record, source.path, source.manifest.get("folder"))[0].partition("|")[0]] if record else []
    moved = (str(each) for each in moved_paths(file, source.path, source.manifest.get("folder")))
    places = [*same, file, *moved]
    there = next((each for each in places if os.path.exists(each)), None)
    if there is None:
        raise UserError(
            f"{source.path}: {file}, the run's {parameter.replace('_', ' ')}, no longer exists; restore it, because "
            "the logs slide again"
        )
    return f"{there}{bar}{layer}"


def fidelity_of(source: Run) -> Fidelity:
    """The numbers of the run's fidelity, with those that options replaced."""
    asked = source.manifest.get("parameters", {})
    name = source.fidelity
    if name not in FIDELITIES:
        raise UserError(f"{source.path}: its manifest names the fidelity '{name}', which does not exist")
    return fidelity_with(name, asked.get("time_step_s"), asked.get("station_spacing_m"))


def logs_of(source: Run, releases: Releases, rows: NDArray[np.int64]) -> Releases:
    """The releases that these rows of the run's deposits come from."""
    wanted = source.deposits["log_id"].to_numpy(np.int64)[rows]
    order = np.argsort(releases.logs.log_id)
    place = np.minimum(np.searchsorted(releases.logs.log_id[order], wanted), order.size - 1)
    found = order[place]
    lost = releases.logs.log_id[found] != wanted
    if lost.any():
        raise UserError(
            f"{source.path}: the releases have no log {int(wanted[lost][0])} any more, which the run slid; run "
            "slide-logs again"
        )
    return releases.take(found)


def refuse_other_ends(source: Run, rows: NDArray[np.int64], ends: NDArray[np.float64]) -> None:
    """Raise ``UserError`` if logs, slid again, do not end exactly where those rows of the deposits are, to the bit."""
    points: Any = source.deposits.geometry.iloc[rows]
    before: NDArray[np.float64] = np.column_stack([points.x, points.y, points.z])
    same = (before == ends).all(axis=1) | (np.isnan(before) & np.isnan(ends)).any(axis=1)
    if not same.all():
        made = source.manifest.get("engine")
        why = "the engine is another" if made != engine_digest() else "an input has changed since"
        raise UserError(
            f"{source.path}: {int((~same).sum())} of {same.size} logs, slid again, end elsewhere than in the run: "
            f"{why}; run slide-logs again"
        )
