"""slide-logs --fidelity auto: the run equals the plain one with the chosen fidelity and logs, reports it, and resumes
alike.
"""

from __future__ import annotations

import ast
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pyogrio
import pytest
from slope_case import RASTERS, Case, assert_same_run, bands, layer, raster, summary

from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.simulate import auto, auto_run, chunks
from deadwood_algorithms.simulate.fidelity_trade import BETWEEN_SLOPES, COSTS
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.promise import Between, together_of
from deadwood_algorithms.stats.statistics import Z_95
from deadwood_algorithms.tools import compare_scenarios, slide_logs
from deadwood_engine import FIDELITIES
from deadwood_toolbox import cli


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture
def early(monkeypatch) -> None:
    """The first check is after 8 logs, so that a layer of 24 has enough for a run."""
    monkeypatch.setattr(auto, "FIRST_LOOK", 8)


def values_of(case: Case, **changes: Any) -> dict[str, Any]:
    return {"fidelity": "auto", "error": 0.25, "report": True, **case.everything(), **changes}


def assert_plain(case: Case, run: Path, folder: Path, **more: Any) -> None:
    """The same bits as a plain run at the chosen fidelity of the chosen logs alone."""
    told = summary(run)
    n = told["logs"]["released"]
    frame = pyogrio.read_dataframe(case.releases)
    rows = np.sort(hash_order(frame["log_id"].to_numpy(np.int64), 0)[:n])
    some = folder / "some.gpkg"
    frame.iloc[rows].to_file(some, layer="some", driver="GPKG")
    fidelity = told["accuracy"]["fidelity"]
    values = {**case.everything(), **more}
    plain = case.run(output=str(folder / "plain"), fidelity=fidelity, releases=str(some), **values)
    for name in ("deposits", "deposited_logs", "trajectories", "reach"):
        ours, theirs = layer(run, name), layer(plain, name)
        assert ours.geometry.to_wkb().equals(theirs.geometry.to_wkb()), name
        assert ours.drop(columns="geometry").equals(theirs.drop(columns="geometry")), name
    for name in RASTERS:
        assert np.array_equal(raster(run / f"{name}.tif"), raster(plain / f"{name}.tif"), equal_nan=True), name
    assert bands(run / "danger.tif") == bands(plain / "danger.tif")
    poses = [parquet.read_table(each / "poses.parquet").to_pandas() for each in (run, plain)]
    ours, theirs = (each.sort_values(["log_id", "t_s"], ignore_index=True) for each in poses)
    assert ours.equals(theirs)
    other = summary(plain)
    assert told["reach"] == other["reach"]
    assert {k: v for k, v in told["accuracy"].items() if k != "auto"} == {
        k: v for k, v in other["accuracy"].items() if k != "auto"
    }
    assert other["accuracy"]["auto"] is None


def test_the_run_is_the_plain_one_and_tells_both_errors(case, early, tmp_path):
    run = tmp_path / "run"
    outcome = slide_logs.TOOL(**case.values(output=str(run), **values_of(case)))
    told = summary(run)
    found = told["accuracy"]["auto"]
    assert found["chosen"] == told["accuracy"]["fidelity"] == "standard"
    assert found["logs"] == told["logs"]["released"] == 24 - told["logs"]["not_run"] < 24
    between = Between(*(each / 100.0 for each in BETWEEN_SLOPES["standard"][found["kind"]]))
    assert found["calculation"] == together_of(between, 0.0, risk=0.05)
    widest = max(max(each["ci_high"] - each["p"], each["p"] - each["ci_low"]) for each in told["reach"])
    assert found["sampling"] == pytest.approx(widest)
    assert max(found["sampling"], found["calculation"]) < found["together"] <= 0.25
    assert found["together"] == together_of(between, widest / Z_95)
    assert found["reached"] is True
    assert any(f"{found['logs']} logs at standard: reach of lines within ±" in line for line in outcome.lines)
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "The fidelity auto chose standard" in page
    assert [each.name for each in tmp_path.iterdir()] == ["run"]  # no pilot is left behind
    assert_plain(case, run, tmp_path)


def test_draft_is_taken_where_the_user_assumes_that_it_does(case, early, tmp_path):
    run = case.run(output=str(tmp_path / "assumed"), **values_of(case, assume="draft", error=0.4))
    assert summary(run)["accuracy"]["auto"]["chosen"] == "draft"
    assert_plain(case, run, tmp_path)


class StopAfter(Quiet):
    """Requests a stop once a number of logs is done."""

    def __init__(self, logs: int) -> None:
        self.logs, self.done = logs, 0.0

    def progress(self, done: float, total: float, what: str) -> None:
        self.done = done if what == "sliding logs" else self.done

    def cancelled(self) -> bool:
        return self.done >= self.logs


def test_threads_chunks_and_an_interruption_decide_nothing(case, early, tmp_path, monkeypatch):
    one = case.run(output=str(tmp_path / "one"), threads=1, **values_of(case))
    assert_same_run(one, case.run(output=str(tmp_path / "two"), threads=2, **values_of(case)))
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    for logs in (1, 8, 12):  # before the first check, at it, after it
        again = tmp_path / f"again_{logs}"
        with pytest.raises(Cancelled):
            case.run(StopAfter(logs), output=str(again), **values_of(case))
        assert not again.exists()
        assert_same_run(one, case.run(output=str(again), resume=True, **values_of(case)))
    left = [each.name for each in tmp_path.iterdir() if each.name.endswith(".part")]
    assert left == []


def test_an_error_that_cannot_be_promised_is_refused_with_what_can(case, tmp_path):
    with pytest.raises(UserError, match="cannot be promised with the 24 logs.*allow --error 0.2.* takes about") as told:
        case.run(output=str(tmp_path / "run"), **values_of(case, error=0.01))
    assert "\n" not in str(told.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--fidelity", "auto"], "--fidelity auto needs one of --error"),
        (["--fidelity", "auto", "--error", "0.02", "--budget", "60s"], "--fidelity auto needs one of --error"),
        (["--budget", "60s"], "--budget needs --fidelity auto"),
        (["--fidelity", "auto", "--budget", "soon"], "--budget is 'soon', but must be a time such as 60s"),
        (["--fidelity", "auto", "--budget", "0s"], "--budget is '0s', but must be a time such as 60s"),
        (["--error", "0.02"], "--error needs --fidelity auto"),
        (["--fidelity", "auto", "--error", "0.02"], "--fidelity auto needs --lines"),
        (["--fidelity", "auto", "--error", "0.6"], "--error"),
        (["--fidelity", "auto", "--error", "0.02", "--lines", "L", "--until-ci", "0.1"], "--until-ci conflicts with"),
        (
            ["--fidelity", "auto", "--error", "0.02", "--lines", "L", "--time-step-s", "0.1"],
            "--time-step-s conflicts",
        ),
    ],
)
def test_options_that_do_not_go_together_are_one_line(case, tmp_path, capsys, flags, said):
    base = ["slide-logs", "--dem", case.dem, "--releases", case.releases, "--friction", "0.4"]
    flags = [case.lines if flag == "L" else flag for flag in flags]
    assert cli.run([*base, *flags, "--output", str(tmp_path / "run")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert said in err


def test_a_budget_takes_what_fits_and_a_resumed_run_continues_with_its_choice(case, early, tmp_path, monkeypatch):
    """With time for all logs at any fidelity, reference; a choice once made is kept, although its time is over."""
    values = values_of(case, error=None, report=False)
    run = case.run(output=str(tmp_path / "long"), **values, budget="1h")
    found = summary(run)["accuracy"]["auto"]
    assert (found["chosen"], found["logs"], found["calculation"]) == ("reference", 24, 0.0)
    assert "error" not in found or found["error"] is None
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "FIRST_CHUNKS", ())
    monkeypatch.setattr(auto, "PROBE", 4)
    with pytest.raises(Cancelled):
        case.run(StopAfter(15), output=str(tmp_path / "again"), **values, budget="1h")
    monkeypatch.setattr(auto_run, "spend_budget", None)  # nothing is decided again
    again = case.run(output=str(tmp_path / "again"), resume=True, **values, budget="1h")
    assert summary(again)["accuracy"]["auto"] == found
    assert layer(again, "deposits").drop(columns="geometry").equals(layer(run, "deposits").drop(columns="geometry"))
    assert [each.name for each in tmp_path.iterdir() if each.name.endswith(".part")] == []


def test_a_short_budget_is_kept_to(case, tmp_path):
    """Many logs and little time: the run ends in time, and reports its accuracy. A fast machine slides some 1000 of
    these logs a second, so the layer has many times those of the budget."""
    frame = pyogrio.read_dataframe(case.releases)
    many = frame.loc[np.repeat(frame.index, 2000)].reset_index(drop=True)
    many["log_id"] = np.arange(len(many))
    many.to_file(tmp_path / "many.gpkg", layer="many", driver="GPKG")
    values = values_of(case, error=None, report=False, releases=str(tmp_path / "many.gpkg"), trajectories="none")
    began = time.perf_counter()
    run = case.run(output=str(tmp_path / "run"), **values, budget="4s")
    assert time.perf_counter() - began < 12.0  # on a machine that does other work as well
    told = summary(run)
    assert 0 < told["logs"]["released"] < 48_000
    found = told["accuracy"]["auto"]
    assert max(found["sampling"], found["calculation"]) <= found["together"] < 0.5


def test_scenarios_are_compared_by_the_fidelity_that_was_chosen(case, early, tmp_path):
    one = case.run(output=str(tmp_path / "one"), **values_of(case, report=False))
    other = case.run(output=str(tmp_path / "other"), fidelity="standard", **case.everything())
    outcome = compare_scenarios.TOOL(runs=f"{one},{other}", output=str(tmp_path / "compared"))
    assert outcome.facts["parameters_that_differ"] == {}


def test_what_such_a_run_asked_can_be_asked_again(case, tmp_path):
    """With the fidelity that was chosen, and here: where it slid is not one of its parameters."""
    from deadwood_algorithms.files.embedded import seal_of_record
    from deadwood_algorithms.results.replay import fidelity_of, question_of
    from deadwood_algorithms.results.run_folder import MANIFEST, read_run

    run = case.run(output=str(tmp_path / "run"), **values_of(case))
    told = json.loads((run / MANIFEST).read_text(encoding="utf-8"))
    told["parameters"]["scheduler"] = "tcp://127.0.0.1:1"
    told["seal"] = seal_of_record(told)
    (run / MANIFEST).write_text(json.dumps(told), encoding="utf-8")
    source = read_run(str(run), feedback=Quiet())
    assert source.fidelity == summary(run)["accuracy"]["fidelity"] != "auto"
    assert fidelity_of(source) == FIDELITIES[source.fidelity]
    assert not hasattr(question_of(source), "scheduler")


def test_the_plugin_knows_every_folder_that_a_run_works_in():
    """After Cancel it removes them, and cannot ask the toolbox, which runs in another Python."""
    source = (Path(cli.__file__).parent / "qgis_plugin" / "inputs.py").read_text(encoding="utf-8")
    (named,) = [
        ast.literal_eval(each.value)
        for each in ast.parse(source).body
        if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "AUTO_KEEPS"
    ]
    assert set(named) == {f".{auto_run.AUTO}", *(f".{auto_run.AUTO}-{each}" for each in COSTS)}
