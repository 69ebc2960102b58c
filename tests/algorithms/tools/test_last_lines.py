"""The last lines of a tool: the answer, and then the scenario that it is of, alike wherever logs slid."""

from __future__ import annotations

from pathlib import Path

import pytest
from slope_case import Case, summary

from deadwood_algorithms.results.scenario import scenario_line
from deadwood_algorithms.tools import compare_fidelity, count_hits, design_values, map_origins, reach_lines


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def run(case) -> Path:
    return case.run(output=str(case.folder / "run"), lines=case.lines)


@pytest.mark.parametrize(
    ("tool", "more"),
    [
        (count_hits, {"output": "hits.tif"}),
        (reach_lines, {"output": "reached.gpkg"}),
        (design_values, {"output": "design.csv"}),
        (map_origins, {"output": "origins", "least": 1}),
    ],
)
def test_who_reads_a_run_says_its_scenario(run, tmp_path, tool, more):
    lines = {"lines": f"{run / 'run.gpkg'}|layername=reach"} if tool is reach_lines else {}
    said = tool.TOOL(run=str(run), **lines, **(more | {"output": str(tmp_path / more["output"])})).lines
    assert said[-1] == scenario_line(summary(run)["scenario"])
    assert len(said) > 1


def test_a_run_without_a_summary_has_no_such_line(run, tmp_path):
    said = count_hits.TOOL(run=str(run), output=str(tmp_path / "with.tif")).lines
    (run / "summary.json").rename(tmp_path / "summary.json")
    try:
        without = count_hits.TOOL(run=str(run), output=str(tmp_path / "without.tif")).lines
    finally:
        (tmp_path / "summary.json").rename(run / "summary.json")
    assert without == said[:-1]


def test_who_slides_says_what_and_with_which_posture(case, tmp_path):
    said = compare_fidelity.TOOL(
        dem=case.dem, releases=case.releases, lines=case.lines, friction="0.3", fidelities="draft,standard",
        output=str(tmp_path / "fidelities"),
    ).lines  # fmt: skip
    assert said[-1].startswith("scenario: ")
    assert "upright" in said[-1]
    assert "friction 0.3" in said[-1]
    assert "draft / standard" in said[-1]
