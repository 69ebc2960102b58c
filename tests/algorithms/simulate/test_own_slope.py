"""The logs of a run that slide again at a finer fidelity, against whole runs at that fidelity and counts by hand."""

from __future__ import annotations

import json
import re

import numpy as np
import pyogrio
import pytest
from slope_case import Case, arrivals, assert_same_run, layer, summary

from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.results.own_slope import interval_of, own_slope_record
from deadwood_algorithms.simulate import own_slope
from deadwood_algorithms.simulate.fidelity_trade import COSTS, REACH_ERRORS
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.own_slope import Check, Sample, again_in_logs, check_of, finer_row
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_algorithms.tools import slide_logs
from deadwood_engine import FIDELITIES

IDS = np.arange(24) * 3 + 5  # of the case's logs


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def whole(case):
    return case.run(output=str(case.folder / "whole"), own_slope=10, **case.everything())


def test_the_sample_is_paired_with_what_its_logs_do_in_a_whole_run_at_the_finer_fidelity(case, whole, tmp_path):
    finer = case.run(output=str(tmp_path / "finer"), fidelity="standard", own_slope="none", **case.everything())
    sample = set(IDS[hash_order(IDS, 0)[:10]].tolist())
    told = summary(whole)["own_slope"]
    assert (told["logs"], told["fidelity"], told["finer"]) == (10, "draft", "standard")
    assert sorted(told["by_line"]) == ["house", "road"]
    for line, record in told["by_line"].items():
        here, there = (
            {log for log, reached in arrivals(run) if reached == line and log in sample} for run in (whole, finer)
        )
        assert record["difference"] == (len(here) - len(there)) / 10
        interval = paired_interval(len(there - here), len(here - there), 10)
        assert (record["ci_low"], record["ci_high"]) == interval
    assert summary(whole)["cost"]["own_slope_cpu_s"] > 0.0


def test_differences_and_flag_by_hand():
    """A sample of 100 logs among 150: 45 reach the first line only in the run, 2 only at the finer fidelity."""
    log_id = np.arange(150) * 7
    of_sample = np.setdiff1d(log_id, log_id[::3])
    ours, finer = np.zeros((150, 3), bool), np.zeros((100, 3), bool)
    rows = np.flatnonzero(np.isin(log_id, of_sample))
    ours[rows[:60], 0], finer[:15, 0], finer[60:62, 0] = True, True, True
    ours[rows[:4], 1], finer[:30, 1] = True, True
    ours[rows[:50], 2], finer[3:50, 2] = True, True  # 3 points in excess: an interval that holds what is promised
    found = own_slope_record("standard", Sample("fine", of_sample, finer, 1.0), log_id, ours, ["up", "down", 7])
    low, high = paired_interval(2, 45, 100)
    assert found["by_line"]["up"] == {"difference": 0.43, "ci_low": low, "ci_high": high}
    assert found["by_line"]["down"]["difference"] == -0.26
    assert found["by_line"]["7"]["difference"] == 0.03
    assert found["promised"] == REACH_ERRORS["standard"].worst.farther_end / 100.0
    assert found["flagged"] is True
    for line, flagged in ((0, True), (1, True), (2, False)):
        one = Sample("fine", of_sample, finer[:, [line]], 1.0)
        assert own_slope_record("standard", one, log_id, ours[:, [line]], ["it"])["flagged"] is flagged


def test_no_pair_that_differs_is_not_no_error():
    same = np.zeros((100, 1), bool)
    found = own_slope_record("draft", Sample("fine", np.arange(100), same, 1.0), np.arange(100), same, ["road"])
    low, high = found["by_line"]["road"]["ci_low"], found["by_line"]["road"]["ci_high"]
    assert (low, high) == pytest.approx((-0.037, 0.037), abs=5e-4)  # z^2 / (n + z^2)
    assert interval_of(found["by_line"]["road"]) == ("-4", "+4")
    assert found["flagged"] is False


def test_the_sample_takes_a_fifth_of_a_long_run_and_at_least_a_hundred_logs():
    assert check_of("standard", 60, None) == Check("fine", 60)  # all of them
    assert check_of("standard", 500, None) == Check("fine", 100)
    ratio = COSTS["fine"] / COSTS["standard"]
    between = check_of("standard", round(5 * 150 * ratio), None)
    assert between is not None
    assert 149 <= between.logs <= 150
    assert again_in_logs("standard", round(5 * 150 * ratio), None) <= 0.2 * round(5 * 150 * ratio)
    assert check_of("standard", 10**6, None) == Check("fine", 200)
    affordable = int(0.2 * 1000 * COSTS["draft"] / COSTS["standard"])  # a hundred at fine would cost more than that
    assert check_of("draft", 1000, None) == Check("standard", max(100, affordable))
    assert check_of("draft", 10**6, None) == Check("fine", 200)
    assert check_of("fine", 500, None) == Check("reference", 100)
    assert check_of("standard", 500, 300) == Check("fine", 300)
    assert check_of("standard", 200, 300) == Check("fine", 200)
    assert check_of("reference", 500, None) is check_of("standard", 500, 0) is None


def test_the_finer_run_is_nowhere_coarser_than_the_users_numbers():
    assert finer_row("fine", None, None) == FIDELITIES["fine"]
    assert finer_row("fine", 0.05, 2.0).time_step == FIDELITIES["fine"].time_step
    assert finer_row("fine", 0.001, 2.0).time_step == 0.001
    assert finer_row("fine", 0.05, 0.1).station_spacing == 0.1


@pytest.mark.parametrize("changes", [{"lines": None}, {"own_slope": "none"}, {"own_slope": 0}])
def test_without_lines_or_sample_nothing_is_told(case, tmp_path, changes):
    run = case.run(output=str(tmp_path / "run"), **(case.everything() | changes))
    assert "own_slope" not in summary(run)
    assert "own_slope_cpu_s" not in summary(run)["cost"]


def test_a_time_is_kept_to_unless_the_sample_is_asked_for(case, tmp_path):
    values = {"fidelity": "auto", "budget": "600s", **case.everything(), "assume": "draft"}
    assert "own_slope" not in summary(case.run(output=str(tmp_path / "timed"), **values))
    ask = slide_logs.Ask(**case.values(fidelity="auto", budget="5s", own_slope="20"))
    assert ask.own_slope_logs == 20


def test_a_word_that_is_no_number_is_refused(case):
    with pytest.raises(UserError, match="--own-slope"):
        case.run(own_slope="many", **case.everything())


def test_threads_and_order_of_the_layer_decide_nothing(case, whole, tmp_path):
    one = case.run(output=str(tmp_path / "one"), own_slope=10, threads=1, **case.everything())
    assert_same_run(whole, one)
    frame = pyogrio.read_dataframe(case.releases).sample(frac=1.0, random_state=3)
    frame.to_file(tmp_path / "mixed.gpkg", driver="GPKG")
    mixed = case.run(
        output=str(tmp_path / "mixed"), own_slope=10, releases=str(tmp_path / "mixed.gpkg"), **case.everything()
    )
    assert summary(mixed)["own_slope"] == summary(whole)["own_slope"]


class StopsAgain(Quiet):
    """Requests a stop as soon as the sample slides."""

    def __init__(self) -> None:
        self.sample = False

    def progress(self, done: float, total: float, what: str) -> None:
        self.sample = what == "sliding some again at standard"

    def cancelled(self) -> bool:
        return self.sample


def test_an_interrupted_sample_is_resumed_and_a_finished_one_is_not_slid_again(case, whole, tmp_path, monkeypatch):
    values = {"output": str(tmp_path / "run"), "own_slope": 10, **case.everything()}
    with pytest.raises(Cancelled):
        case.run(StopsAgain(), **values)
    assert not (tmp_path / "run").exists()

    def full_disk(*_, **__):
        raise UserError("disk full")

    with monkeypatch.context() as broken:
        broken.setattr("deadwood_algorithms.results.writing.write_vector", full_disk)
        with pytest.raises(UserError, match="disk full"):
            case.run(**values, resume=True)
    monkeypatch.setattr(own_slope, "slide_once", None)
    assert_same_run(whole, case.run(**values, resume=True))
    assert [each.name for each in tmp_path.iterdir()] == ["run"]


def test_what_is_flagged_is_warned_of_and_on_the_page(case, said, tmp_path, monkeypatch):
    def opposite(done, check, fidelity, seed) -> Sample:
        rows = hash_order(IDS, seed)[: check.logs]
        chosen = np.sort(rows)
        reached = np.column_stack(
            [[(log, line) not in found for log in IDS[chosen].tolist()] for line in ("road", "house")]
        )
        return Sample(check.finer, IDS[chosen], reached, 1.0)

    found = arrivals(case.run(output=str(tmp_path / "plain"), own_slope="none", lines=case.lines))
    monkeypatch.setattr(own_slope, "slide_sample", opposite)
    run = case.run(said, output=str(tmp_path / "run"), report=True, lines=case.lines)
    told = summary(run)["own_slope"]
    assert told["flagged"] is True
    assert told["by_line"]["road"]["difference"] == 1.0  # all logs reach it in the run
    assert len(layer(run, "deposits")) == told["logs"] == 24
    warned = {each["code"]: each["numbers"] for each in summary(run)["warnings"]}
    assert warned["own-slope"] == {**told["by_line"]["road"], "promised": told["promised"], "logs": 24}
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "slide the logs at standard" in page
    assert "draft minus standard" in page
    boxes = re.findall(r'<ul class="warning">.*?</ul>', page, re.DOTALL)
    assert any("slide the logs at standard" in each for each in boxes)
    # nor the record of the same, which the page says in its own words
    assert not any("run again with --fidelity" in each for each in boxes)


def test_a_plan_counts_the_logs_that_slide_again(case):
    outcome = slide_logs.TOOL(**case.values(lines=case.lines, plan=True, fidelity="standard"))
    pilot = outcome.facts["pilot"]
    assert pilot["again"] == pytest.approx(24 * COSTS["fine"] / COSTS["standard"])
    assert outcome.facts["cpu_s"] == pytest.approx(pilot["cpu_s"] * (1.0 + COSTS["fine"] / COSTS["standard"]))
    plain = slide_logs.TOOL(**case.values(lines=case.lines, plan=True, own_slope="none"))
    assert plain.facts["pilot"]["again"] == 0.0
    assert json.dumps(plain.facts)
