"""Which results decide a finding that few logs leave open: for each finding those that it needs, and no others."""

from __future__ import annotations

from dataclasses import replace

import pytest

from deadwood_algorithms.paper import evidence as gathered
from deadwood_algorithms.paper import sensitivity
from deadwood_algorithms.paper.finding import Finding
from deadwood_algorithms.paper.findings import findings_of
from deadwood_algorithms.paper.sensitivity import DECIDED_BY, decided_findings
from deadwood_algorithms.paper.site import read_site, write_twin
from deadwood_algorithms.paper.site_runs import SiteRuns, Wanted
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.tools.reproduce_paper import CALLED

TOOLS = {each.TOOL.name: each.TOOL for each in CALLED}
WANTED = Wanted(logs=24, fidelity="draft", seed=0, threads=2, quick=True, twin=True, draws=1)
# of single logs, or of no logs at all
NOT_BY_MORE_LOGS = {"largest_speed", "parabola_clears_barrier", "a_log_jumps_to_the_road"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["klosters", "rothenbrunnen"])
def test_what_a_finding_needs_decides_it(name, tmp_path):
    """The same figures from all evidence and from that which a finding needs, except for the high friction, which a
    run of its own gives; and every finding is listed or depends on single logs.
    """
    write_twin(name, tmp_path / "data")
    site = read_site(name, tmp_path / "data", tmp_path / "prepared")

    def runs_for(needed: set[str]) -> SiteRuns:
        return SiteRuns(site, tmp_path / "runs", replace(WANTED, needed=frozenset(needed)), TOOLS, Quiet())

    whole = {each.id.partition(".")[2]: each for each in findings_of(gathered.evidence_of(runs_for(set())))}
    assert set(whole) - set(DECIDED_BY) <= NOT_BY_MORE_LOGS
    for needed in {frozenset(DECIDED_BY[each]) for each in set(whole) & set(DECIDED_BY)}:
        part = findings_of(gathered.evidence_of(runs_for(set(needed))))
        found = {each.id.partition(".")[2]: each for each in part}
        for each in (id_ for id_ in whole if DECIDED_BY.get(id_) == needed):
            assert each in found
            if needed != {"friction"}:
                assert replace(found[each], why="") == replace(whole[each], why="")


def test_only_undecided_findings_are_assessed_again(monkeypatch, tmp_path):
    def finding(id_: str, holds: bool | None, why: str = "few") -> Finding:
        return Finding(f"klosters.{id_}", "", "", "", 0.28, 0.24, 0.33, holds, why)

    wanted_of_runs = []
    monkeypatch.setattr(sensitivity, "SiteRuns", lambda site, place, wanted, tools, feedback: wanted)
    monkeypatch.setattr(sensitivity, "evidence_of", lambda wanted: wanted_of_runs.append(wanted))
    more = [finding("coarser_cells_need_more", True, "more"), finding("slides_to_the_road", False, "more")]
    monkeypatch.setattr(sensitivity, "findings_of", lambda of: more)

    few = [finding("coarser_cells_need_more", None), finding("slides_to_the_road", True)]
    found = decided_findings(None, tmp_path, few, 20_000, WANTED, TOOLS, Quiet())
    assert [each.holds for each in found] == [True, True]
    assert found[0].why == "20000 logs per scenario, for 24 left it open: more"
    assert found[1] is few[1]
    assert wanted_of_runs == [replace(WANTED, logs=20_000, needed=frozenset({"sweeps"}))]

    assert decided_findings(None, tmp_path, few[1:], 20_000, WANTED, TOOLS, Quiet()) == few[1:]
    assert decided_findings(None, tmp_path, few, 0, WANTED, TOOLS, Quiet()) == few
    assert len(wanted_of_runs) == 1
