"""The last lines of a tool: answer and scenario, alike for all tools that slide logs, and the next command."""

from __future__ import annotations

import shlex
from pathlib import Path

import geopandas
import pandas
import pytest
from slope_case import Case, summary

from deadwood_algorithms.params.tool import Outcome
from deadwood_algorithms.results.scenario import scenario_line
from deadwood_algorithms.tools import (
    assess_mobilisation,
    calibrate_friction,
    compare_fidelity,
    compare_scenarios,
    count_hits,
    design_values,
    lateral_spread,
    map_origins,
    reach_lines,
    run_sites,
    vary,
)
from deadwood_toolbox import cli


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


# --- the command that follows ---


def pasted(outcome: Outcome, folder: Path, monkeypatch) -> list[list[str]]:
    """Run the printed next command unchanged; returns the words of each command."""
    monkeypatch.chdir(folder)
    commands = [shlex.split(each) for each in outcome.then.split(" && ")]
    for program, *words in commands:
        assert program == "deadwood-tool"
        assert cli.run([*words, "--progress", "none"]) == 0, words
    return commands


def test_what_follows_a_variation_slides_the_run_and_shows_both(case, tmp_path, monkeypatch):
    given = {"dem": case.dem, "releases": case.releases, "lines": case.lines, "friction": "0.3", "dbh_cm": 40.0}
    ask = {**given, "trees": case.trees, "length_m": 10.0, "design": "ends", "vary": "rolling_friction"}
    outcome = vary.TOOL(**ask, output=str(tmp_path / "all varied"))
    slide, page = pasted(outcome, tmp_path, monkeypatch)
    assert slide[1:3] == ["slide-logs", "--dem"]
    assert {case.trees, case.lines, "40.0", "10.0"} <= set(slide)
    assert page[page.index("--results") + 1] == str(tmp_path / "all varied")
    assert (tmp_path / "report.html").is_file()


def test_what_follows_a_spread_is_the_page_of_its_run_and_of_a_lone_layer_nothing(run, tmp_path, monkeypatch):
    outcome = lateral_spread.TOOL(deposits=str(run / "run.gpkg"), output=str(tmp_path / "spread.gpkg"))
    (page,) = pasted(outcome, tmp_path, monkeypatch)
    assert page[:4] == ["deadwood-tool", "make-report", "--runs", str(run)]
    geopandas.read_file(run / "run.gpkg", layer="deposits").to_file(tmp_path / "deposits.gpkg")
    alone = lateral_spread.TOOL(deposits=str(tmp_path / "deposits.gpkg"), output=str(tmp_path / "alone.gpkg"))
    assert alone.then == ""


def test_what_follows_mobilisation_draws_from_the_areas_or_else_from_the_raster(case, tmp_path, monkeypatch):
    areas, raster = str(tmp_path / "areas.gpkg"), str(tmp_path / "mobilisation.tif")
    with_areas = assess_mobilisation.TOOL(dem=case.dem, release_areas=areas, output=raster, logs_per_cell=1)
    (drawn,) = pasted(with_areas, tmp_path, monkeypatch)
    assert drawn[drawn.index("--areas") + 1] == areas
    assert "--weights" not in drawn
    (tmp_path / "releases.gpkg").unlink()
    without = assess_mobilisation.TOOL(dem=case.dem, output=raster, overwrite=True, logs_per_cell=1)
    (drawn,) = pasted(without, tmp_path, monkeypatch)
    assert drawn[drawn.index("--weights") + 1] == raster
    assert "--areas" not in drawn


def test_what_follows_fidelities_is_the_run_with_the_friction_that_was_given(case, tmp_path, monkeypatch):
    outcome = compare_fidelity.TOOL(
        dem=case.dem, releases=case.releases, lines=case.lines, friction="0.37", fidelities="draft,standard",
        dbh_cm=40.0, length_m=10.0, output=str(tmp_path / "fidelities"),
    )  # fmt: skip
    (slide,) = pasted(outcome, tmp_path, monkeypatch)
    assert slide[slide.index("--friction") + 1] == "0.37"
    assert case.lines in slide


def test_what_follows_a_calibration_varies_the_range_that_was_found(case, tmp_path, monkeypatch):
    calibrated = calibrate_friction.TOOL(
        dem=case.dem, releases=case.releases, reached=case.lines, friction=(0.2, 0.4, 0.6), fidelity="draft",
        dbh_cm=40.0, length_m=10.0, output=str(tmp_path / "calibrated"),
    )  # fmt: skip
    found = calibrated.facts["range"]
    (varied,) = pasted(calibrated, tmp_path, monkeypatch)
    low, high = varied[varied.index("--vary") + 1].removeprefix("friction=").split(":")
    assert (float(low), float(high)) == pytest.approx((found["low"], found["high"]), rel=1e-3)
    assert varied[varied.index("--lines") + 1] == case.lines


def test_what_follows_sites_is_the_page_of_the_first(case, tmp_path, monkeypatch):
    outcome = run_sites.TOOL(
        dem=case.dem, releases=case.releases, by="release_id", friction="0.4", output=str(tmp_path / "my sites")
    )
    (page,) = pasted(outcome, tmp_path, monkeypatch)
    assert page[page.index("--runs") + 1] == str(tmp_path / "my sites" / "sites" / "a")
