"""The content of a run's manifest.json and summary.json, checked once when read: the run to which it belongs, and its
types.

A result is sealed: its manifest has the SHA-256 of every file, and of its own content. Runs before version 0.3 have no
seal; only their types are checked.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from deadwood_algorithms.files.embedded import is_sealed
from deadwood_algorithms.files.input_files import MANIFEST
from deadwood_algorithms.params.tool import Tool, UserError
from deadwood_algorithms.results.identity import Making, damaged_files, is_whole, refuse_damaged

SUMMARY = "summary.json"

WHOLE = ("logs", "reach", "spread", "barriers", "speed", "accuracy", "modelled", "cost")  # keys of every summary
# A type, a tuple of types, [what each element is], {key: the type of its value}; a key that ends in "?" may be missing.
Wanted = Any
NUMBER, COUNT, ANY = (int, float), int, object
MAYBE = (int, float, type(None))
WARNINGS: Wanted = [{"code": str, "text": str, "numbers?": dict, "level?": str}]
OF_MANIFEST: Wanted = {
    "tool": str,
    "version?": str,
    "engine?": str,
    "run_id?": str,
    "made_utc?": str,
    "modified_utc?": dict,
    "folder?": str,
    "parameters": dict,
    "grid?": {"nx": COUNT, "ny": COUNT, "cell": NUMBER, "x0": NUMBER, "y0": NUMBER, "crs": str},
    "digests?": {"scene?": str, "releases?": str, "engine?": str},
    "inputs?": [{"parameter": str, "path": str, "layer?": (str, type(None)), "sha256?": (str, type(None))}],
    "files?": dict,
    "effective?": dict,
    "chosen?": dict,
    "presets?": list,
    "warnings?": WARNINGS,
}
OF_SUMMARY: Wanted = {
    "logs?": {"released": COUNT, "not_run?": COUNT, "by_stop_reason": dict, "started_in_contact?": COUNT},
    "reach?": [{"line_id": ANY, "n_total": COUNT, "n_reach": COUNT, "p": MAYBE, "ci_low": MAYBE, "ci_high": MAYBE}],
    "spread?": [{"release_id": ANY, "n": COUNT, "n_left_out?": COUNT, "spread_deg": MAYBE, "p05_p95_deg": MAYBE}],
    "barriers?": [{"barrier_id": ANY, "n_reached?": COUNT, "n_stopped?": COUNT}],
    "speed?": {"mean_ms": MAYBE, "p95_ms": MAYBE, "max_ms": MAYBE},
    "accuracy?": {"fidelity": str, "penetration_max_m": MAYBE, "energy_error_rel_max?": MAYBE},
    "modelled?": dict,
    "warnings?": WARNINGS,
    "cost?": {"cpu_s": NUMBER, "wall_s": NUMBER, "steps": COUNT, "logs_per_s": MAYBE},
}


def read_json(place: Path, wanted: Wanted) -> dict[str, Any]:
    """Read a JSON file whose values have the required types; otherwise one line names the value that has not."""
    try:
        content = json.loads(place.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise UserError(f"{place}: the file cannot be read, or is not JSON ({error}); run slide-logs again") from error
    if fault := fault_of(content, wanted, ""):
        raise UserError(f"{place}: not as written by slide-logs: {fault}; run slide-logs again")
    return content


def fault_of(content: Any, wanted: Wanted, at: str) -> str:
    """The first value that is missing or of another type, in words; empty if there is none."""
    if isinstance(wanted, dict):
        if not isinstance(content, dict):
            return f"{at or 'the whole'} must be an object"
        for key, inner in wanted.items():
            name, optional = key.removesuffix("?"), key.endswith("?")
            where = f"{at}.{name}" if at else name
            if name not in content:
                if not optional:
                    return f"{where} is missing"
            elif fault := fault_of(content[name], inner, where):
                return fault
        return ""
    if isinstance(wanted, list):
        if not isinstance(content, list):
            return f"{at} must be a list"
        return next((fault for each in content if (fault := fault_of(each, wanted[0], f"{at}[]"))), "")
    kinds = wanted if isinstance(wanted, tuple) else (wanted,)
    if wanted is object:
        return ""
    number = isinstance(content, int | float)
    if not isinstance(content, kinds) or isinstance(content, bool) or (number and not math.isfinite(content)):
        return f"{at} is {json.dumps(content)[:60]}"
    return ""


def read_manifest_of(folder: Path) -> dict[str, Any]:
    """The manifest of a result, whole and of the right types."""
    manifest = read_json(folder / MANIFEST, OF_MANIFEST)
    if not is_sealed(manifest):
        raise UserError(
            f"{folder / MANIFEST}: the manifest is not as it was written, so it is not known what made the result; "
            f"restore it, or run {manifest['tool']} again"
        )
    return manifest


def stands(tool: Tool, values: Mapping[str, Any], place: Path, seal: Mapping[str, Any] | None = None) -> bool:
    """Whether a result exists, is complete, and is the one that the tool would make now with these values and inputs.

    seal : for a single file, as returned by `identity.sealed` when it was made
    """
    run_id = Making(tool, tool.ask_from({**values, "output": str(place)})).run_id
    if place.is_file():
        return seal is not None and seal.get("run_id") == run_id and is_whole(place, seal)
    if not (place / MANIFEST).is_file():
        return False
    try:
        manifest = read_manifest_of(place)
    except UserError:
        return False
    return manifest.get("run_id") == run_id and "files" in manifest and not damaged_files(place, manifest)


def read_summary(folder: Path, manifest: Mapping[str, Any], *needed: str) -> dict[str, Any]:
    """The summary of a run, checked: it belongs to the run, has the right types, and contains what is needed."""
    refuse_damaged(folder, manifest, SUMMARY)
    return read_json(
        folder / SUMMARY,
        {key.removesuffix("?") if key[:-1] in needed else key: each for key, each in OF_SUMMARY.items()},
    )
