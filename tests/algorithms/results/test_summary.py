"""What a summary reports about logs that left the terrain model, or still moved at the end."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from slope_case import Case, cut_above_the_road, layer, summary

from deadwood_algorithms.results.summary import (
    barrier_records,
    lines_of,
    loss_of_run,
    speed_record,
    spreadless_lines,
)
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.stats.directions import spread_of_release
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import slide_logs
from deadwood_engine import STOP_REASONS


@pytest.fixture(scope="module")
def cut(tmp_path_factory) -> Case:
    """The case with a terrain model that ends above the road: logs that no tree holds leave it before they arrive."""
    return cut_above_the_road(Case(tmp_path_factory.mktemp("cut")))


def test_logs_that_left_before_a_line_are_lost_for_it_and_warned_of(cut, tmp_path, said):
    """Before: `line road: reached by 0 of 24 logs, < 14 %` without mentioning the logs that left."""
    values = cut.values(trees=cut.trees, lines=cut.lines, output=str(tmp_path / "run"))
    outcome = slide_logs.TOOL(feedback=said, **values)
    told = summary(tmp_path / "run")
    lost = told["logs"]["by_stop_reason"]["left_dem"]
    assert 4 <= lost < 24
    for record in told["reach"]:
        assert (record["n_reach"], record["n_lost"]) == (0, lost)
        assert (record["p_low_if_lost"], record["p_high_if_lost"]) == (0.0, lost / 24)
        assert record["ci_high_if_lost"] == wilson_interval(lost, 24)[1] > record["ci_high"]
    reach = layer(tmp_path / "run", "reach").set_index("line_id")
    assert reach.loc["road", "p_high_if_lost"] == lost / 24
    assert f"{lost} left the terrain model" in outcome.lines[0]
    assert any(f"{lost} others left the terrain model before it: " in each for each in outcome.lines)
    warned = [each for each in said.warnings if "left the terrain model" in each]
    assert len(warned) == 1
    assert "the reach of line road may be anything from 0 to" in warned[0]
    assert warned[0].count("the lateral spread of release") == 1
    assert "their deposits and run-outs end where they left" in warned[0]
    assert sum(each["n_left_dem"] for each in told["spread"]) == lost
    assert any("left the terrain model" in each for each in outcome.lines if each.startswith("release "))


def test_releases_whose_logs_left_are_named_in_one_sentence():
    """Before: "the spread of release A refers to the places where they left; the spread of release B refers to ..."."""
    spread = [
        {"release_id": name, "n": 60, "n_left_dem": 30, "spread_deg": 20.0, "spread_without_lost_deg": 10.0}
        for name in "ABCDEFG"
    ]
    told = {"logs": {"released": 420, "by_stop_reason": {"left_dem": 210}}, "reach": [], "spread": spread}
    said = loss_of_run(told)
    assert said is not None
    assert "the lateral spread of releases A, B, C, D, E and 2 more refers to the places where they left;" in said
    assert "the lateral spread of release A refers" in str(loss_of_run({**told, "spread": spread[:1]}))


def test_a_log_that_reached_a_line_before_it_left_is_not_lost_for_it(cut, tmp_path, said):
    from shapely import LineString
    from slope_case import write_layer

    near = write_layer(tmp_path / "near.gpkg", [LineString([(0.5, 42.0), (59.5, 42.0)])], line_id=["near"])
    cut.run(feedback=said, lines=near, output=str(tmp_path / "run"))
    told = summary(tmp_path / "run")
    left = told["logs"]["by_stop_reason"]["left_dem"]
    assert left > 20
    record = told["reach"][0]
    assert record["n_reach"] >= left
    assert record["n_lost"] == 0
    assert record["p_high_if_lost"] == record["p"]
    assert not any("the reach of line" in each for each in said.warnings)  # the warning is about the deposits


def test_where_none_left_nothing_is_reported_of_it(tmp_path, said):
    case = Case(tmp_path / "case")
    case.run(feedback=said, lines=case.lines, trees=case.trees, friction="0.9")
    told = summary(tmp_path / "case" / "run")
    assert told["logs"]["by_stop_reason"]["left_dem"] == 0
    assert [each["n_lost"] for each in told["reach"]] == [0, 0]
    assert not any("left the terrain model" in each for each in said.warnings)
    for record in told["spread"]:
        assert record["spread_without_lost_deg"] == record["spread_deg"]


def test_the_mean_speed_leaves_out_logs_that_still_moved_at_the_time_limit():
    """Two that came to rest at 10 and 12 m/s on average, and one that rolled on for minutes: 11, not 7.7."""
    reason = np.array([STOP_REASONS.index(name) for name in ("rest", "tree", "time_limit")])
    mean, most = np.array([10.0, 12.0, 1.0]), np.array([20.0, 22.0, 30.0])
    found = speed_record({"stop_reason": reason, "speed_mean": mean, "speed_max": most})
    assert (found["mean_ms"], found["n_mean"], found["max_ms"]) == (11.0, 2, 30.0)
    rolling = speed_record({"stop_reason": reason[2:], "speed_mean": mean[2:], "speed_max": most[2:]})
    assert np.isnan(rolling["mean_ms"])
    assert rolling["n_mean"] == 0


def test_the_speed_that_95_percent_stay_below_is_that_of_the_largest_of_each_log():
    most = np.random.default_rng(4).gamma(3.0, 4.0, 111)
    facts = {"stop_reason": np.full(111, STOP_REASONS.index("rest")), "speed_mean": 0.4 * most, "speed_max": most}
    assert speed_record(facts)["p95_ms"] == pytest.approx(np.quantile(most, 0.95))


def test_a_log_counts_once_for_each_barrier():
    """Barrier a in two pieces and b in one: held by a, beyond one piece of it or not, over, beside, and not at all."""
    barriers = Items(["a", "b"], np.empty(2, object), np.array([0, 0, 1]))
    crossed = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1], [0, 0, 0], [0, 0, 0]], bool)
    reached = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], bool)
    by_log = {
        "barrier_crossed": crossed,
        "barrier_reached": reached,
        "stop_reason": np.array([STOP_REASONS.index(each) for each in ("barrier", "barrier", "rest", "tree", "rest")]),
        "stop_item": np.array([0, 1, -1, 1, -1]),
    }
    found = {each.pop("barrier_id"): list(each.values()) for each in barrier_records(barriers, by_log)}
    assert found == {"a": [3, 2, 1, 0], "b": [2, 0, 1, 1]}  # reached, stopped, overjumped, passed beside


def test_the_printed_speed_says_which_logs_it_leaves_out(tmp_path: Path):
    case = Case(tmp_path / "case")
    values = case.values(time_limit_s=2.0, output=str(tmp_path / "run"))
    outcome = slide_logs.TOOL(**values)
    told = summary(tmp_path / "run")
    still = told["logs"]["by_stop_reason"]["time_limit"]
    assert still > 0
    assert told["speed"]["n_mean"] == 24 - still
    line = next(each for each in lines_of(told) if each.startswith("speed: "))
    assert line in outcome.lines
    words = "every log still moved" if still == 24 else f"without {still} logs that still moved at the time limit"
    assert words in line


def test_releases_without_a_spread_are_named_and_one_log_has_none():
    """Before, they were omitted silently, and one log had a spread of 0 degrees."""
    told = [{"release_id": k, "spread_deg": 40.0 if k == 1 else math.nan} for k in range(1, 4)]
    assert spreadless_lines(told) == [
        "releases 2, 3: no lateral spread, for fewer than two logs went farther than the minimum run-out"
    ]
    assert spreadless_lines(told[:1]) == []
    many = [{"release_id": k, "spread_deg": math.nan} for k in range(1, 48)]
    assert "releases 1, 2, 3, 4, 5, 6, 7, 8, 9, 10 and 37 more: no" in spreadless_lines(many)[0]
    record, azimuths, counted = spread_of_release((0.0, 0.0), [0.0, 1.0], [50.0, 1.0], 10.0)
    assert (record["n"], record["n_left_out"], counted.tolist()) == (2, 1, [True, False])
    assert math.isnan(record["spread_deg"])
    assert math.isnan(record["p05_p95_deg"])
    assert azimuths[0] == 0.0
