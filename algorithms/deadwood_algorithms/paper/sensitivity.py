"""Findings assessed again: with more logs if few leave them undecided, and with the numbers of the twins changed."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from deadwood_algorithms.paper import klosters
from deadwood_algorithms.paper.evidence import evidence_of
from deadwood_algorithms.paper.finding import VERDICTS, Finding
from deadwood_algorithms.paper.findings import findings_of
from deadwood_algorithms.paper.site import Site, read_site, write_twin
from deadwood_algorithms.paper.site_runs import SiteRuns, Wanted
from deadwood_algorithms.paper.variations import VARIATIONS
from deadwood_algorithms.params.tool import Feedback, Tool

DECIDED_BY = {  # by finding whose interval more logs narrow: the results that it needs (``evidence_of``)
    "none_far_above_mapped": {"none"},
    "mapped_above_random": {"random"},
    "mapped_about_random": {"random"},
    "spread_wider_with_forest": {"none"},
    "log_above_platy_rock": {"rocks"},
    "platy_above_cubic_rock": {"rocks"},
    "protection_holds": {"barriers"},
    "one_in_a_hundred_jumps": {"barriers"},
    "barrier_stops_most": {"barriers"},
    "mean_speed": {"als"},
    "some_jump_metres": {"als"},
    "trees_hold_near_release": {"als"},
    "slides_to_the_road": {"als"},
    "high_friction_does_not_reach": {"friction"},
    "range_reproduces": {"sweeps"},
    "low_friction_passes": {"sweeps"},
    "coarser_cells_need_more": {"sweeps"},
    "takeoff_speed_needs_low_friction": {"takeoffs"},
}


def panel_wanted(wanted: Wanted, needed: set[str]) -> Wanted:
    """A run of the panel: a tenth of the logs, at `draft`."""
    return replace(wanted, logs=max(8, wanted.logs // 10), fidelity="draft", needed=frozenset(needed))


def findings_with_cloud(
    site: Site, place: Path, wanted: Wanted, tools: Mapping[str, Tool], feedback: Feedback
) -> list[Finding]:
    """The findings with the panel's logs as the paper's point cloud, which takes ten times as long."""
    of_panel = panel_wanted(wanted, {"none", "random", "barriers", "friction"})
    return findings_of(evidence_of(SiteRuns(site, place / ".cloud", of_panel, tools, feedback), "cloud"))


def decided_findings(
    site: Site,
    place: Path,
    found: list[Finding],
    logs: int,
    wanted: Wanted,
    tools: Mapping[str, Tool],
    feedback: Feedback,
) -> list[Finding]:
    """The findings; undecided ones are assessed again with this number of logs, by the results that they need."""
    open_ = {each.id for each in found if each.verdict == VERDICTS[None]}
    needed = {name for each in open_ for name in DECIDED_BY.get(each.partition(".")[2], ())}
    if wanted.logs >= logs or not needed:
        return found
    more = replace(wanted, logs=logs, needed=frozenset(needed))
    of = evidence_of(SiteRuns(site, place / ".more", more, tools, feedback))
    again = {each.id: each for each in findings_of(of) if each.id in open_}
    text = f"{logs} logs per scenario, for {wanted.logs} left it open: "
    return [replace(again[each.id], why=text + again[each.id].why) if each.id in again else each for each in found]


def findings_by_change(
    name: str, place: Path, wanted: Wanted, tools: Mapping[str, Tool], feedback: Feedback
) -> list[tuple[str, list[Finding]]]:
    """The findings with each chosen number of the twin changed."""
    found = []
    for each in VARIATIONS[name][: 1 if wanted.quick else None]:
        folder = place / ".panel" / each.name
        shutil.rmtree(folder / "data", ignore_errors=True)
        write_twin(name, folder / "data", each.version, **each.changes)
        site = read_site(name, folder / "data", folder / "prepared")
        needed = {"none", "random", "friction" if name == klosters.NAME else "barriers"}
        of_panel = panel_wanted(wanted, needed | ({"rocks"} if each.rocks else set()))
        runs = SiteRuns(site, folder, replace(of_panel, options=each.options, draws=1), tools, feedback)
        found.append((each.words, findings_of(evidence_of(runs), quick=wanted.quick)))
    return found
