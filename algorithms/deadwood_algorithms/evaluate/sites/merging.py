"""The mosaics of a region, one for each terrain model that several sites share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from deadwood_algorithms.evaluate.sites.mosaic import merge, pieces_by_grid, scenarios_in
from deadwood_algorithms.evaluate.sites.overview import SiteFound
from deadwood_algorithms.params.tool import Feedback, UserError


def write_merged(
    folder: Path, found: Sequence[SiteFound], danger_least: int, feedback: Feedback
) -> list[dict[str, Any]]:
    """The mosaics, one for each terrain model that several sites share; what cannot be merged is reported."""
    runs = [(folder / "sites" / each.name, each.logs) for each in found if not each.failed]
    merged: list[dict[str, Any]] = []
    for pieces in pieces_by_grid(runs):
        if len(pieces) < 2:
            continue
        if twice := scenarios_in(pieces):
            names = f"{', '.join(twice[:5])}{' ...' if len(twice) > 5 else ''}"
            feedback.note(
                f"{pieces[0].terrain}: not merged, because {names} slid the same logs as another site",
                code="not-merged",
            )
            continue
        name = unlike(pieces[0].terrain, [each["folder"] for each in merged])
        record = {"folder": name, "sites": [each.folder.name for each in pieces], "logs": sum(p.logs for p in pieces)}
        try:
            written = merge(folder / "merged" / name, pieces, danger_least, feedback)
        except UserError as error:
            feedback.warn(str(error), code="not-merged")
            continue
        merged.append({**record, "rasters": sorted(written.values())})
    return merged


def unlike(name: str, taken: Sequence[str]) -> str:
    number, found = 1, name
    while found in taken:
        number += 1
        found = f"{name}_{number}"
    return found
