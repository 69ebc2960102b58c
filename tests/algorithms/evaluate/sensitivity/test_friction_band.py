"""--friction-range: the band of a run against runs at its ends of the same logs, and what is refused."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from slope_case import Case, arrivals, points, summary, write_layer

from deadwood_algorithms.evaluate.sensitivity.friction_band import FEWEST, friction_ends
from deadwood_algorithms.params.presets import FRICTIONS, plausible_range
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.results.friction_band import Member, SlidBand, band_records
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.stats.statistics import reach_record
from deadwood_algorithms.tools import make_report

FRICTION, LOW, HIGH = 0.6, 0.5, 0.75
LOGS, SEED = 160, 3


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """Logs on a uniform slope of 35 degrees (0.7), most of which stop between the frictions of the range."""
    found = Case(tmp_path_factory.mktemp("band"))
    rng = np.random.default_rng(11)
    places = [(10.0 + 40.0 * a, 40.0 + 40.0 * b) for a, b in rng.random((LOGS, 2))]
    lies = {"orientation": ["lying"] * LOGS, "azimuth_deg": 360.0 * rng.random(LOGS)}
    found.releases = write_layer(found.folder / "many.gpkg", points(*places), log_id=np.arange(LOGS) * 7 + 2, **lies)
    return found


def values_of(case: Case, name: str, **changes) -> dict:
    return {"lines": case.lines, "trees": case.trees, "seed": SEED, "trajectories": "none", "time_limit_s": 30.0} | {
        "output": str(case.folder / name)} | changes  # fmt: skip


@pytest.fixture(scope="module")
def run(case):
    return case.run(**values_of(case, "run", friction=str(FRICTION), friction_range=f"{LOW}-{HIGH}"))


def reached(run, line: str, ids: np.ndarray) -> np.ndarray:
    there = {log for log, name in arrivals(run) if name == line}
    return np.array([each in there for each in ids])


def test_the_band_is_the_run_plus_the_difference_of_the_same_logs(case, run):
    """Recomputed from three runs of their own, of all logs."""
    ids = np.arange(LOGS) * 7 + 2
    ends = {each: case.run(**values_of(case, f"at_{each}", friction=str(each))) for each in (LOW, HIGH)}
    band = pd.DataFrame(summary(run)["friction_band"])
    assert set(band["line_id"]) == {"road", "house"}
    assert set(band["posture"]) == {"lying"}, "the layer has the posture, so it is not assumed"
    for line, mine in band.groupby("line_id"):
        rows = mine.set_index("friction")
        own = {each["line_id"]: each for each in summary(run)["reach"]}[line]
        assert rows.loc[FRICTION, ["p", "ci_low", "ci_high", "n"]].tolist() == [
            own["p"], own["ci_low"], own["ci_high"], LOGS]  # fmt: skip
        n = int(rows.loc[LOW, "n"])
        assert FEWEST <= n < LOGS / 2
        chosen = ids[hash_order(ids, SEED)[:n]]
        before = reached(run, line, chosen)
        for friction, other in ends.items():
            expected = own["p"] + reached(other, line, chosen).mean() - before.mean()
            assert rows.loc[friction, "p"] == pytest.approx(min(max(expected, 0.0), 1.0), abs=1e-12)
            assert rows.loc[friction, "ci_low"] <= rows.loc[friction, "p"] <= rows.loc[friction, "ci_high"]
    road = band[band["line_id"] == "road"].set_index("friction")["p"]
    assert road[LOW] > road[FRICTION] > road[HIGH]


def test_the_run_itself_is_as_without_the_range(case, run):
    plain = case.run(**values_of(case, "plain", friction=str(FRICTION)))
    assert arrivals(plain) == arrivals(run)
    assert summary(plain)["friction_band"] is None
    assert summary(plain)["reach"] == summary(run)["reach"]


def test_a_finer_run_is_compared_at_draft(case):
    """The pairs are of draft on both sides: the run at the same friction has no part in the difference."""
    fine = case.run(**values_of(case, "fine", friction=str(FRICTION), friction_range=f"{LOW}-0.6", fidelity="standard"))
    draft = {each: case.run(**values_of(case, f"draft_{each}", friction=str(each))) for each in (LOW, FRICTION)}
    band = pd.DataFrame(summary(fine)["friction_band"]).set_index(["line_id", "friction"])
    ids = np.arange(LOGS) * 7 + 2
    chosen = ids[hash_order(ids, SEED)[: int(band.loc[("road", LOW), "n"])]]
    shares = {each: reached(draft[each], "road", chosen).mean() for each in draft}
    expected = band.loc[("road", FRICTION), "p"] + shares[LOW] - shares[FRICTION]
    assert band.loc[("road", LOW), "p"] == pytest.approx(min(max(expected, 0.0), 1.0), abs=1e-12)


def test_an_assumed_posture_is_varied_too(case):
    bare = write_layer(case.folder / "bare.gpkg", points(*[(10.0 + 0.25 * k, 60.0) for k in range(LOGS)]))
    run = case.run(**values_of(case, "assumed", releases=bare, friction="0.6", friction_range="auto"))
    band = pd.DataFrame(summary(run)["friction_band"])
    assert set(zip(band["friction"], band["posture"], strict=True)) == {
        (0.6, "upright"), (0.48, "upright"), (0.72, "upright"), (0.6, "random-lying")}  # fmt: skip


def test_the_conclusion_of_the_report_begins_with_the_band(case, run):
    place = case.folder / "page.html"
    make_report.TOOL(runs=str(run), output=str(place))
    page = place.read_text(encoding="utf-8")
    conclusion = page[page.index('id="conclusion"') : page.index('id="numbers"')]
    said = Words("en").say(
        "answer_band", line="road", low="{low}", high="{high}", low_friction="0.5", high_friction="0.75",
        friction="0.6", share="",
    )  # fmt: skip
    before, between, after = said.replace("{high}", "{low}").split("{low}")
    assert 0 <= conclusion.index(before) < conclusion.index(between) < conclusion.index(after)
    assert 'class="answers answer"' in conclusion[: conclusion.index(before)]


def test_too_few_logs_are_said_and_give_no_band(case):
    run = case.run(**values_of(case, "few", releases=Case(case.folder / "small").releases, friction_range="auto"))
    assert summary(run)["friction_band"] is None
    (said,) = [each for each in summary(run)["warnings"] if each["code"] == "few-logs-for-band"]
    assert said["numbers"]["logs"] < said["numbers"]["needed"] == FEWEST


@pytest.mark.parametrize(
    ("given", "friction", "fault"),
    [
        ("0.3-0.2", 0.25, "LOW-HIGH"),
        ("wide", 0.25, "LOW-HIGH"),
        ("0.3-0.4", 0.25, "does not contain"),
        ("0.2-0.3", "friction.tif", "is a layer"),
    ],
)
def test_a_wrong_range_is_refused(given, friction, fault):
    with pytest.raises(UserError, match=fault):
        friction_ends(given, friction, None)


def test_the_default_range_is_that_of_the_preset_or_of_the_table():
    for name, each in FRICTIONS.items():
        low, high = plausible_range(each.values["friction"], name)
        assert low < each.values["friction"] < high
        assert each.span in (None, (low, high))
    assert friction_ends("auto", "0.25", None) == (0.2, 0.3)
    assert friction_ends("auto", 0.5, None) == pytest.approx((0.4, 0.6))


def test_without_lines_the_range_is_refused(case):
    with pytest.raises(UserError, match="--friction-range needs --lines"):
        case.run(**values_of(case, "no_lines", lines=None, friction_range="auto"))


def test_logs_are_compared_with_themselves_whatever_the_order_of_the_layer():
    """Logs 2 and 4 reach the road at both frictions, 9 and 7 do not and did not slide again: no difference."""
    reach = [{"line_id": "road", **reach_record(2, 4)}]
    again = Member(0.2, "upright", np.array([[True], [True]]))
    band = SlidBand(np.array([2, 4]), 0.25, "upright", None, (again,), 0.0)
    own, other = band_records(band, reach, np.array([9, 4, 7, 2]), np.array([[False], [True], [False], [True]]))
    assert other["p"] == own["p"] == 0.5
