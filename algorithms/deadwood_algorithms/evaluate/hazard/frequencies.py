"""How often logs start in each release area: one number for all, or a column of the releases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.evaluate.hazard.rates import ReleaseArea
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import number_column, where_of
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.results.run_folder import Run, input_paths
from deadwood_algorithms.scene.items import ids_of

FIELD = "events_per_year"


def release_areas(
    source: Run, events: float | None, layer: str | None, field: str | None, feedback: Feedback
) -> list[ReleaseArea]:
    """The release areas of a run with their events a year; none where no frequency is given."""
    if events is None and layer is None and field is None:
        return []
    if events is not None and (layer is not None or field is not None):
        raise UserError(
            "--events-per-year is one number for all release areas; leave out --releases and --events-field"
        )
    ids = source.deposits["release_id"]
    logs: Any = ids.value_counts(sort=False)
    names = list(dict.fromkeys(ids.tolist()))
    if events is not None:
        return [ReleaseArea(each, events, int(logs[each])) for each in names]
    place = layer or _layer_of_run(source)
    frame: Any = read_table(place, what="releases")
    rates = number_column(frame, field or FIELD, minimum=0.0)
    called = [str(each) for each in ids_of(frame, "release_id").tolist()]
    of_id: dict[str, float] = {}
    for row, (each, rate) in enumerate(zip(called, rates.tolist(), strict=True)):
        if of_id.setdefault(each, rate) != rate:
            raise UserError(
                f"{where_of(frame)}, field '{field or FIELD}', row {row + 1}: {rate:g} for release area '{each}', but "
                f"{of_id[each]:g} in an earlier row; it is the number of events of the whole area, so all rows of an "
                "area must have the same"
            )
    missing = [str(each) for each in names if str(each) not in of_id]
    if missing:
        raise UserError(
            f"{where_of(frame)}: release area '{missing[0]}' of the run is not there"
            f"{f', nor are {len(missing) - 1} more' if len(missing) > 1 else ''}; its column release_id must name it"
        )
    mine = np.isin(called, [str(each) for each in names])
    if not mine.all():
        feedback.note(
            f"{where_of(frame)}: {counted(int((~mine).sum()), 'row belongs', 'rows belong')} to no release area of "
            "the run: left out",
            code="rows-left-out",
            rows=int((~mine).sum()),
        )
    account("releases", count_of(len(frame), mine.sum(), {"not_in_run": (~mine).sum()}))
    if not any(of_id[str(each)] > 0.0 for each in names):
        raise UserError(f"{where_of(frame)}, field '{field or FIELD}': no release area has any event")
    return [ReleaseArea(each, of_id[str(each)], int(logs[each])) for each in names]


def _layer_of_run(source: Run) -> str:
    places = [str(each) for each in input_paths(source.path, source.manifest, "releases")]
    found = next((each for each in places if Path(each.split("|")[0]).exists()), None)
    if found is None:
        raise UserError(f"{source.path}: the run's releases were moved or deleted; name them with --releases")
    return found


def stored_areas(source: Run, areas: list[ReleaseArea]) -> list[ReleaseArea]:
    """The same areas, restricted to their logs with a stored trajectory."""
    kept = source.deposits["release_id"][np.isin(source.deposits["log_id"], source.stored_log_ids)]
    return [ReleaseArea(each.release_id, each.events_per_year, int((kept == each.release_id).sum())) for each in areas]
