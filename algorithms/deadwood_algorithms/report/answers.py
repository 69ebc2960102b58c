"""Results of other tools for a run, for the report: effects of trees, barriers, classes, origins.

`make-report --results` names them: a layer of value-trees, folders of site-barriers, map-intensity, map-origins, vary.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.files.embedded import is_sealed, record_in
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.results.identity import refuse_damaged

if TYPE_CHECKING:
    import pandas

FACTS = {
    "site-barriers": "summary.json",
    "map-intensity": "classes.json",
    "map-origins": "origins.json",
    "vary": "summary.json",
}
TAKEN = "a layer of value-trees, or a folder of site-barriers, map-intensity, map-origins or vary"
WORTH_LAYERS = ("values", "planted")
SCENE = ("dem", "releases", "trees", "barriers", "lying_logs", "blocks", "friction")  # vary records no run


def read_answers(named: str, sources: Sequence[ReportedRun]) -> None:
    """Assign the named results to their runs; results of another run, or of an unsuitable tool, are rejected."""
    for place in places_of(named):
        if place.is_file() and place.suffix.lower() == ".gpkg":
            _take_tree_effects(place, sources)
        else:
            _take_folder(place, sources)


def places_of(named: str) -> list[Path]:
    """The paths between the commas; parts that are not paths belong to the next."""
    found, name = [], ""
    for part in named.split(","):
        name = f"{name},{part}" if name else part
        if os.path.exists(name.strip()):
            found.append(Path(name.strip()))
            name = ""
    if name.strip() or not found:
        raise UserError(f"--results: '{name.strip()}' does not exist; name {TAKEN}")
    return found


def _take_tree_effects(place: Path, sources: Sequence[ReportedRun]) -> None:
    import pyogrio
    from pyogrio.errors import DataSourceError

    from deadwood_algorithms.files.vectors import read_table

    try:
        known = pyogrio.list_layers(place)[:, 0]
    except (DataSourceError, RuntimeError) as error:
        raise UserError(f"--results: {place} cannot be read; name {TAKEN}") from error
    there = [each for each in WORTH_LAYERS if each in known]
    if not there:
        raise UserError(f"--results: {place} has no layer 'values' or 'planted'; name {TAKEN}")
    layers = {each: read_table(f"{place}|layername={each}", what=each) for each in there}
    run_id = run_id_in(record_in(place))
    if run_id is not None:
        source = next((each for each in sources if each.run.manifest.get("run_id", run_id) == run_id), None)
    else:  # from before version 0.3
        source = next((each for each in sources if all(_is_of(frame, each) for frame in layers.values())), None)
    if source is None and run_id is not None:
        raise UserError(
            f"--results: {place} belongs to the run {run_id}, which is not one of "
            f"{', '.join(each.name for each in sources)}; add its own run"
        )
    if source is None:
        raise UserError(
            f"--results: {place} belongs to none of the runs {', '.join(each.name for each in sources)}: the number "
            "of logs that reach the lines is different in each of them; add its own run"
        )
    _refuse_twice(bool(set(layers) & set(source.answers.tree_effect)), "value-trees", source)
    source.answers.tree_effect |= layers


def _is_of(frame: pandas.DataFrame, source: ReportedRun) -> bool:
    """Whether as many logs reach the lines as in the run; not decidable for a random subset of its logs."""
    if not len(frame):
        return True
    n_logs = len(source.deposits)
    reach = {str(each["line_id"]): each["n_reach"] for each in source.summary["reach"]}
    firsts = frame.drop_duplicates("line_id")
    return all(
        total <= n_logs and (total < n_logs or reach.get(str(line), n_reach) == n_reach)
        for line, total, n_reach in zip(firsts["line_id"], firsts["n_total"], firsts["n_reach"], strict=True)
    )


def _take_folder(place: Path, sources: Sequence[ReportedRun]) -> None:
    try:
        manifest = json.loads((place / "manifest.json").read_text(encoding="utf-8"))
        made_by = manifest["tool"]
        for name in (FACTS[made_by], *manifest.get("files", ())):
            refuse_damaged(place, manifest, name)
        if not is_sealed(manifest):
            raise ValueError
        facts = json.loads((place / FACTS[made_by]).read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"--results: {place} is not {TAKEN}, or is damaged") from error
    if made_by == "vary":
        apart = [other_inputs(manifest, each.run.manifest) for each in sources]
        nearest = min(range(len(sources)), key=lambda k: len(apart[k]))
        source = sources[nearest]
        source.answers.varied_apart = apart[nearest]
    else:
        source = _run_of(place, manifest, sources)
    _refuse_twice(made_by in source.answers.folders, made_by, source)
    source.answers.folders[made_by] = (place, facts, manifest["parameters"])


def other_inputs(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """The inputs of the scene in which two records differ: layers by their content, numbers by their value."""

    def given(record: Mapping[str, Any], name: str) -> Any:
        rows = [each for each in record.get("inputs", []) if each.get("parameter") == name]
        return sorted(each.get("content") or each["sha256"] for each in rows) or record["parameters"].get(name)

    return [name for name in SCENE if given(one, name) != given(other, name)]


def _run_of(place: Path, manifest: dict[str, Any], sources: Sequence[ReportedRun]) -> ReportedRun:
    """The page's run from which a folder was made; if it cannot be identified, the only run."""
    asked, run_id = Path(manifest["parameters"]["run"]), run_id_in(manifest)
    for each in sources:
        known = each.run.manifest.get("run_id")
        if run_id and known and run_id == known:
            return each
        if not (run_id and known) and asked.resolve() == each.run.path.resolve():
            return each
    if len(sources) == 1 and not asked.exists() and not (run_id and sources[0].run.manifest.get("run_id")):
        return sources[0]  # the run has been moved
    suffix = f" (run {run_id})" if run_id else ""
    raise UserError(
        f"--results: {place} belongs to the run {asked}{suffix}, which is not on the page; add that run, or leave "
        "this out"
    )


def run_id_in(record: Mapping[str, Any] | None) -> str | None:
    """The run from which a result was made; None in records before version 0.3."""
    listed = (record or {}).get("inputs")
    rows = [each for each in listed if isinstance(each, dict)] if isinstance(listed, list) else []
    return next((each.get("run_id") for each in rows if each.get("parameter") == "run"), None)


def _refuse_twice(there: bool, made_by: str, source: ReportedRun) -> None:
    if there:
        raise UserError(f"--results names two results of {made_by} for the run {source.name}; give one of them")
