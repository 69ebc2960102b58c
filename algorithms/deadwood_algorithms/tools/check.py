"""Verify a result: which run it belongs to, and whether its inputs and files are unchanged.

    deadwood-tool check my_run
    deadwood-tool check releases.gpkg

For any result (a folder, a file in it, or a single file) the tool reports which tool made it, when, and in which run;
whether this toolbox has the same engine, which gives the same bits; whether files, rows and pixels are as they were
written; and which inputs are the same, have changed or are missing. Inputs that were moved together with the result are
found. How a layer is drawn (a style, the QGIS project) may change.

The exit status is 0 if nothing has changed, 3 if something has changed or is missing or if the result has no seal, so
that this is unknown, and 2 for a file that is not a result.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

CHANGED = 3  # the exit status


@dataclass(frozen=True, kw_only=True)
class Ask:
    path: str = tool.text("Result to check: a folder or a file", positional=True, path_like=True)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.identity import SAME, where_now

    place = Path(ask.path)
    record, home, files = record_of(place)
    inputs: list[dict[str, Any]] = []
    listed = record.get("inputs", [])
    for done, each in enumerate(listed, start=1):
        path, stands, file = where_now(each, home, record.get("folder"))
        inputs.append({"parameter": each["parameter"], "path": path, "stands": stands, "file": file})
        feedback.progress(done, len(listed), "comparing the inputs")
    engine = "same" if record.get("engine") == engine_digest() else "other"
    facts = {
        **{key: record.get(key) for key in ("tool", "version", "engine", "run_id", "made_utc")},
        "engine_here": engine,
        "files": files,
        "inputs": inputs,
    }
    stands = files["sealed"] and not files["damaged"] and all(each["stands"] == SAME for each in inputs)
    return Outcome({}, facts, lines_of(place, facts), 0 if stands else CHANGED)


def record_of(place: Path) -> tuple[dict[str, Any], Path, dict[str, Any]]:
    """The record of a result, the folder to which its inputs are relative, and how many files are sealed and which of
    them have changed; rejected if there is no record.
    """
    from deadwood_algorithms.files.embedded import record_in, state_of
    from deadwood_algorithms.files.identity import CHANGED
    from deadwood_algorithms.files.input_files import MANIFEST, made_from
    from deadwood_algorithms.files.network import is_special
    from deadwood_algorithms.results.checked import read_manifest_of
    from deadwood_algorithms.results.identity import damaged_files

    if not os.path.exists(place):  # a name may also be too long, or contain a NUL
        raise UserError(f"{place}: there is no such file or folder")
    if is_special(place):
        raise UserError(f"{place}: this is a pipe or a device, not a file")
    folder = place if place.is_dir() else place.parent
    whole = place.is_dir() or place.name == MANIFEST
    record, found = (None if whole else record_in(place)), {}
    if record is not None:
        state = state_of(place, record)
        found = {"sealed": int("seal" in record), "damaged": [place.name] if state == CHANGED else []}
    elif (whole or place.name in made_from(folder).get("files", {})) and (folder / MANIFEST).is_file():
        record = read_manifest_of(folder)
        names = list(record.get("files", {})) if whole else [place.name]
        sealed = len(names) if "seal" in record else 0
        found = {"sealed": sealed, "damaged": damaged_files(folder, record, names)}
    if record is None or "run_id" not in record:
        raise UserError(
            f"{place}: this carries no record of a run; results of deadwood-tool have one since version 0.3"
        )
    return record, folder, found


def lines_of(place: Path, facts: Mapping[str, Any]) -> tuple[str, ...]:
    """The report, as lines of text."""
    made = f", made {facts['made_utc']}" if facts["made_utc"] else ""
    engine = "the one here" if facts["engine_here"] == "same" else "not the one here, whose bits may differ"
    lines = [
        f"{place}: run {facts['run_id']} of {facts['tool']} {facts['version']}{made}",
        f"engine {facts['engine']}, {engine}",
    ]
    files = facts["files"]
    if files["sealed"] and not files["damaged"]:
        lines.append(f"{counted(files['sealed'], 'file, as it was', 'files, as they were')} written")
    if not files["sealed"]:
        lines.append("unsealed: whether it is as it was written is not known")
    lines += [f"{name}: damaged, changed or gone" for name in files["damaged"]]
    for each in facts["inputs"]:
        file = each["path"] if each["stands"] == "same" else each["file"]
        lines.append(f"{each['parameter'].replace('_', ' ')}: {each['stands']}  {file}")
    return tuple(lines) if facts["inputs"] else (*lines, "no inputs")


TOOL = Tool("check", "Evaluate", "Verify a result: its run, its inputs and its files", Ask, run, in_qgis=False)
