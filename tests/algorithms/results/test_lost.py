"""Logs that left the terrain model: every tool that evaluates a run reports by the same rule what depends on them."""

from __future__ import annotations

from typing import Any

import geopandas
import numpy as np
import pandas
import pytest
from slope_case import Case, cut_above_the_road, summary, write_layer

from deadwood_algorithms.evaluate.sensitivity.design import Place
from deadwood_algorithms.evaluate.sensitivity.factor_runs import SlidRuns, warn_of_runs
from deadwood_algorithms.results.lost import lost_warning, many, reach_phrases, share_if_lost
from deadwood_algorithms.schemas.results import STOP_REASONS
from deadwood_algorithms.simulate import look
from deadwood_algorithms.stats.statistics import IN_BRACKETS, paired_interval, percent, wilson_interval
from deadwood_algorithms.tools import (
    break_trees,
    design_values,
    map_intensity,
    map_origins,
    run_sites,
    site_barriers,
    value_trees,
    vary,
)

WORDS = "left the terrain model or came onto its nodata, and their further movement is not known: "


@pytest.fixture(scope="module")
def cut(tmp_path_factory) -> Case:
    """The case with a terrain model that ends above the road: logs that no tree holds leave it before they arrive."""
    return cut_above_the_road(Case(tmp_path_factory.mktemp("cut")))


@pytest.fixture(scope="module")
def run(cut, tmp_path_factory) -> Any:
    folder = tmp_path_factory.mktemp("lost") / "run"
    cut.run(trees=cut.trees, lines=cut.lines, trajectories="all", output=str(folder))
    return folder


@pytest.fixture(scope="module")
def n_lost(run) -> int:
    count = summary(run)["logs"]["by_stop_reason"]["left_dem"]
    assert 4 <= count < 24
    return count


def of_road(said: Any) -> str:
    """The one warning of a tool."""
    (told,) = [each for each in said.warnings if WORDS in each]
    return told


def test_shares_have_the_bounds_that_none_and_all_of_the_lost_logs_reach():
    left = np.arange(20) < 10
    found = share_if_lost(np.arange(20) >= 8, left)  # two of those that left had reached it before
    assert (found["n_reach"], found["n_lost"], found["p_low_if_lost"], found["p_high_if_lost"]) == (12, 8, 0.6, 1.0)
    assert reach_phrases([{"line_id": "a", **found}]) != []
    assert reach_phrases([{"line_id": "a", **share_if_lost(np.ones(20, bool), left)}]) == []
    assert not many(1, 20)
    assert many(2, 20)
    assert lost_warning(3, 20, []) is None


def test_map_origins(run, n_lost, tmp_path, said):
    done = map_origins.TOOL(run=str(run), cell_m=20.0, output=str(tmp_path / "origins"), feedback=said)
    assert "the reach of line road may be anything from 0 to" in of_road(said)
    assert done.facts["n_left_dem"] == n_lost
    record = done.facts["reach"][1]
    assert (record["n_reach"], record["n_lost"]) == (0, n_lost)
    assert record["ci_high_if_lost"] == wilson_interval(n_lost, 24)[1]
    assert any(f"{n_lost} others left the terrain model before it" in each for each in done.lines)


def test_map_intensity(run, n_lost, tmp_path, said):
    done = map_intensity.TOOL(run=str(run), events_per_year=0.1, output=str(tmp_path / "intensity"), feedback=said)
    told = of_road(said)
    assert "the reach of line road may be anything from 0 to" in told
    assert "outline end where they left" in told
    assert done.facts["n_left_dem"] == n_lost
    table = pandas.read_csv(tmp_path / "intensity" / "lines.csv")
    assert (table["n_lost"] == n_lost).all()
    road = table[(table["line_id"] == "road") & (table["at_least_kj"] == 0.0)].iloc[0]
    highest = 0.2 * wilson_interval(n_lost, 24)[1]  # two areas of 12 logs each; none that left had come to the road
    assert road["return_ci_low_years_if_lost"] == pytest.approx(1.0 / highest)
    assert road["return_ci_low_years"] == pytest.approx(1.0 / (0.2 * wilson_interval(0, 24)[1]))
    assert road["return_ci_low_years"] == pytest.approx(done.facts["no_hit"]["return_ci_low_years"])
    assert road["return_ci_low_years_if_lost"] < road["return_ci_low_years"]
    assert any(f", over {1.0 / highest:.3g} years" in each for each in done.lines)


def test_a_log_that_came_with_less_energy_and_then_left_is_not_unknown(run, n_lost, tmp_path, said):
    """Energies are those of the first touch. Before: such logs were said to have left before the line."""
    near = write_layer(tmp_path / "near.gpkg", [line(42.0), line(25.0)], line_id=["near", "road"])
    bounds = (0.001, 1e5)
    done = map_intensity.TOOL(
        run=str(run), lines=near, energy_classes_kj=bounds, output=str(tmp_path / "intensity"), feedback=said
    )
    table = pandas.read_csv(tmp_path / "intensity" / "lines.csv").set_index(["line_id", "at_least_kj"])
    assert table.loc[("near", 1e5), "n_reach"] == 0
    assert (table.loc["near", "n_lost"] == 0).all()  # all that left had passed it
    assert (table.loc["road", "n_lost"] == n_lost).all()
    assert not any("others left" in each for each in done.lines if each.startswith("near"))


def test_run_sites_looks_before_each_site(cut, tmp_path, monkeypatch, said):
    """Before: a site is begun such that it can be resumed, and a resumed run had no pilot."""
    monkeypatch.setattr(look, "LOGS", 6)
    run_sites.TOOL(
        dem=cut.dem, releases=cut.releases, by="release_id", lines=cut.lines, friction="0.2",
        output=str(tmp_path / "sites"), feedback=said,
    )  # fmt: skip
    told = [each for each in said.warnings if "a pilot before the run" in each]
    assert len(told) == 2


def test_design_values(run, n_lost, tmp_path, said):
    near = write_layer(tmp_path / "near.gpkg", [line(42.0), line(25.0)], line_id=["near", "road"])
    done = design_values.TOOL(run=str(run), lines=near, output=str(tmp_path / "values.csv"), feedback=said)
    rows = {row["place_id"]: row for row in done.facts["rows"]}
    assert (rows["road"]["n_lost"], rows["road"]["n"]) == (n_lost, 0)
    assert rows["near"]["n_lost"] == 0  # all that left had reached it
    assert "the percentiles of line road are of the 0 logs" in of_road(said)
    assert "line near" not in of_road(said)


def test_value_trees(run, n_lost, tmp_path, said):
    """No log reaches the road in sight, so every gain is 0, and at most the number of logs that leave only without the
    tree: slid without it on the whole slope they are counted by hand."""
    value_trees.TOOL(run=str(run), output=str(tmp_path / "values.gpkg"), feedback=said)
    frame = geopandas.read_file(tmp_path / "values.gpkg", layer="values")
    assert (frame["gain_logs"] == 0).all()
    assert (frame["gain_p_low_if_lost"] <= 0).all()
    assert (frame["gain_p_high_if_lost"] >= 0).all()
    holding = frame[frame["stopped"] > 0]
    assert (holding["gain_p_high_if_lost"] > 0).any()
    assert "the reach of line road may be anything from 0 to" in of_road(said)


def test_break_trees(run, n_lost, tmp_path, said):
    done = break_trees.TOOL(run=str(run), tree_capacity_kj=1e-9, output=str(tmp_path / "broken.gpkg"), feedback=said)
    told = of_road(said)
    assert f"{n_lost} of 24 logs" in told
    assert "the reach of line road may be anything from 0 to" in told
    (road,) = [row for row in done.facts["reach_breaking"] if row["line_id"] == "road"]
    gone = road["n_lost_breaking"]  # without trees more leave; some that left broke none, and go the same way
    assert (road["n_reach"], road["n_lost"], road["gain_logs"]) == (0, n_lost, 0)
    assert gone > n_lost
    assert -n_lost / 24 <= road["gain_p_low_if_lost"] <= 0.0
    assert (gone - n_lost) / 24 <= road["gain_p_high_if_lost"] <= gone / 24
    most, least = road["gain_p_high_if_lost"] * 24, -road["gain_p_low_if_lost"] * 24
    assert road["ci_high_if_lost"] == pytest.approx(paired_interval(0, round(most), 24)[1])
    assert road["ci_low_if_lost"] == pytest.approx(paired_interval(round(least), 0, 24)[0])
    (words,) = [each for each in done.lines if each.startswith("road: ")]
    ends = [percent(wilson_interval(number, 24)[1], *wilson_interval(0, 24)) for number in (n_lost, gone)]
    assert f"[0.0 to {ends[0]} %] with unbreakable trees" in words
    assert f"[0.0 to {ends[1]} %] if those" in words
    assert IN_BRACKETS in done.lines


def test_break_trees_that_hold(run, n_lost, tmp_path):
    """Where no tree breaks the two ends are one run: no difference, whatever the lost logs did."""
    done = break_trees.TOOL(run=str(run), tree_capacity_kj=1e9, output=str(tmp_path / "holding.gpkg"))
    (road,) = [row for row in done.facts["reach_breaking"] if row["line_id"] == "road"]
    assert (road["n_lost"], road["n_lost_breaking"]) == (n_lost, n_lost)
    assert (road["gain_p_low_if_lost"], road["gain_p_high_if_lost"]) == (0.0, 0.0)


def test_vary(cut, tmp_path, said):
    vary.TOOL(
        vary="friction=0.2:0.4",
        dem=cut.dem,
        releases=cut.releases,
        lines=cut.lines,
        friction=0.3,
        logs=24,
        output=str(tmp_path / "v"),
        feedback=said,
    )
    told = of_road(said)
    assert told.startswith("in the run 'as it is', which lost most: ")
    assert "mean run-outs, and the effect of each factor on them, count only up to where the logs left" in told
    assert "the reach of line road may be anything" in told


def test_vary_tells_of_the_run_that_lost_most_and_of_things_as_they_are(said):
    """With nothing varied, 4 of 40 leave, which may be 0 to 10 % of the reach; with low friction, half of them."""
    left = np.arange(40) < np.array([[4], [20], [2]])
    reasons = np.where(left, STOP_REASONS.index("left_dem"), STOP_REASONS.index("rest")).astype(np.int8)
    slid = SlidRuns(np.zeros((3, 40, 1), bool), np.ones((3, 40)), reasons)
    warn_of_runs([Place(each, {}) for each in ("as it is", "low", "high")], slid, ["road"], said)
    (told,) = said.warnings
    assert told.startswith("in the run 'low', which lost most: 20 of 40 logs (50 %) left the terrain model")
    assert told.count("the reach of line road may be anything from ") == 2
    assert "in the run 'as it is', where 4 left, the reach of line road may be anything from 0 to 2" in told
    assert "mean run-outs" in told


def line(y: float) -> Any:
    from shapely import LineString

    return LineString([(0.5, y), (59.5, y)])


def test_site_barriers_needs_logs_that_reach_a_line_and_says_which_logs_were_lost(cut, tmp_path, said):
    both = write_layer(tmp_path / "both.gpkg", [line(48.0), line(25.0)], line_id=["near", "road"])
    cut.run(trees=cut.trees, lines=both, trajectories="all", output=str(tmp_path / "run"))
    candidates = write_layer(tmp_path / "candidates.gpkg", [line(52.0)], barrier_id=["a"], height_m=[3.0])
    done = site_barriers.TOOL(
        run=str(tmp_path / "run"), candidates=candidates, output=str(tmp_path / "sited"), feedback=said
    )
    record = {each["line_id"]: each for each in done.facts["reach_by_line"]}["road"]
    assert record["n_lost"] > 0
    assert "the reach of line road may be anything from 0 to" in of_road(said)
