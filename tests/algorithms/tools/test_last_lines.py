"""The last lines of a tool: the answer, and then the scenario that it is of, alike wherever logs slid."""

from __future__ import annotations

from pathlib import Path

import geopandas
import pandas
import pytest
from slope_case import Case, summary

from deadwood_algorithms.results.scenario import scenario_line
from deadwood_algorithms.tools import (
    compare_fidelity,
    compare_scenarios,
    count_hits,
    design_values,
    lateral_spread,
    map_origins,
    reach_lines,
    run_sites,
)


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


def test_the_spread_of_a_run_says_its_scenario_that_of_a_layer_none(run, tmp_path):
    said = lateral_spread.TOOL(deposits=str(run), output=str(tmp_path / "spread.gpkg")).lines
    assert said[-1] == scenario_line(summary(run)["scenario"])
    geopandas.read_file(run / "run.gpkg", layer="deposits").to_file(tmp_path / "deposits.gpkg")
    alone = lateral_spread.TOOL(
        deposits=str(tmp_path / "deposits.gpkg"), dem=None, output=str(tmp_path / "alone.gpkg")
    ).lines
    assert not [line for line in alone if line.startswith("scenario")]


def test_several_runs_say_theirs_by_name(case, run, tmp_path):
    other = case.run(output=str(tmp_path / "slippery"), lines=case.lines, friction="0.2")
    said = compare_scenarios.TOOL(runs=f"{run},{other}", output=str(tmp_path / "compared")).lines
    told = {each.name: scenario_line(summary(each)["scenario"], each.name) for each in (run, other)}
    assert set(said[-2:]) == set(told.values())
    assert told["slippery"].startswith("scenario of slippery: ")


def test_the_first_sites_say_theirs_and_the_others_are_counted(case, tmp_path):
    releases = geopandas.read_file(case.releases)
    releases = geopandas.GeoDataFrame(pandas.concat([releases] * 5, ignore_index=True), crs=releases.crs)
    releases["site"] = [f"s{k % 5}" for k in range(len(releases))]
    releases["log_id"] = range(1, len(releases) + 1)
    releases.to_file(tmp_path / "sites.gpkg")
    said = run_sites.TOOL(
        dem=case.dem, releases=str(tmp_path / "sites.gpkg"), by="site", friction="0.4", output=str(tmp_path / "sites")
    ).lines
    assert [line.partition(":")[0] for line in said[-4:-1]] == [f"scenario of s{k}" for k in range(3)]
    assert said[-1] == "2 more sites have their scenario in summary.json"
