"""compare-fidelity through files: a scene with a known answer, the same logs as slide-logs, irrelevant options."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from slope_case import Case, layer, points, summary, write_layer

from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.prepare.releases.logs import directed
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.tools import compare_fidelity
from deadwood_engine import FIDELITIES
from deadwood_toolbox import cli

LOGS = 60


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """60 logs, more than the rule's least."""
    made = Case(tmp_path_factory.mktemp("case"))
    places = [(20.0 + 20.0 * a, 45.0 + 15.0 * b) for a, b in np.random.default_rng(4).random((LOGS, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), release_id=["a", "b"] * (LOGS // 2))
    return made


def compare(case: Case, output: Path, feedback=None, **changes) -> dict:
    values = case.values(**({"output": str(output), "fidelities": "draft,standard"} | changes))
    for name in ("fidelity", "trajectories"):
        del values[name]
    outcome = compare_fidelity.TOOL(feedback=feedback, **values)
    told = json.loads((output / "comparison.json").read_text(encoding="utf-8"))
    assert told["recommendation"]["sentence"] == outcome.lines[-2]
    return told


def table(folder: Path) -> pd.DataFrame:
    """Everything but the time it took."""
    rows = pd.read_csv(folder / "comparison.csv", dtype={"item": str}).fillna({"item": "", "verdict": ""})
    return rows[rows["quantity"] != "cpu_per_log"].set_index(["fidelity", "quantity", "item"])


@pytest.fixture(scope="module")
def forest(case) -> Path:
    compare(case, case.folder / "forest", threads=1, **case.everything())
    return case.folder / "forest"


@pytest.mark.parametrize("lines", ["some reach", "silent"])
def test_on_a_plane_without_obstacles_draft_will_do(case, tmp_path, lines):
    """One contact law, one slope, no impact: every fidelity is exact, so the cheapest is recommended.

    The line reached by some is among the releases: those above it slide over it, those below do not.
    """
    across = {"all reach": 36.0, "some reach": 52.0, "none reach": 2.0}
    wanted = {name: v for name, v in across.items() if lines == "some reach" or name != "some reach"}
    shapes = [shapely.LineString([(0.5, v), (59.5, v)]) for v in wanted.values()]
    path = write_layer(tmp_path / "lines.gpkg", shapes, line_id=list(wanted))
    told = compare(case, tmp_path / "plane", lines=path, friction="0.6", fidelities="draft, FINE, standard")
    advice = told["recommendation"]
    assert advice["fidelity"] == "draft", advice["sentence"]
    assert advice["judged_by"] == ("reach of lines" if lines == "some reach" else "deposit distance and hit raster")
    assert advice["silent_lines"] == ["all reach", "none reach"]
    assert told["finest"] == "fine"
    assert list(told["settings"]) == ["draft", "standard", "fine"]
    costs = [each["value"] for each in told["rows"] if each["quantity"] == "cpu_per_log"]
    assert costs == sorted(costs)
    rows = table(tmp_path / "plane")
    apart = rows.loc[("draft", "deposit_distance", "")]
    assert 0.0 < apart["difference"] < apart["noise"]
    # speeds are those of the middle of a step, and a standing log that falls over lands within one: a step of g
    assert abs(rows.loc[("draft", "speed_max_mean", ""), "difference"]) < 9.81 * FIDELITIES["draft"].time_step


def test_the_table_agrees_with_slide_logs(case, forest, tmp_path):
    rows = table(forest)
    for fidelity in ("draft", "standard"):
        run = case.run(output=str(tmp_path / fidelity), fidelity=fidelity, trajectories="none", **case.everything())
        deposits, told = layer(run, "deposits"), summary(run)
        mine = rows.loc[fidelity]["value"]
        for record in told["reach"]:
            assert mine[("reach", record["line_id"])] == record["p"]
        for record in told["spread"]:
            named = ("spread_p05_p95", record["release_id"])
            assert (named in mine) == (record["p05_p95_deg"] is not None) == (record["p05_p95_n_more"] == 0)
            assert named not in mine or mine[named] == pytest.approx(record["p05_p95_deg"])
        assert mine[("deposit_distance", "")] == pytest.approx(deposits["runout_m"].mean())
        assert mine.get(("speed_max_p95", "")) == (
            None if told["speed"]["p95_ms"] is None else pytest.approx(told["speed"]["p95_ms"])
        )
        assert mine[("jump_max_mean", "")] == pytest.approx(deposits["jump_max_m"].mean())
        assert mine[("penetration_max", "")] == told["accuracy"]["penetration_max_m"]
        assert mine[("energy_error", "")] == told["accuracy"]["energy_error_rel_max"]
        assert mine[("steps_per_log", "")] * LOGS == pytest.approx(told["cost"]["steps"])
        assert mine[("unconverged_steps", "")] * told["cost"]["steps"] == pytest.approx(
            told["accuracy"]["unconverged_steps"]
        )
    reach = rows.xs("reach", level="quantity")
    assert (reach["difference"] == reach["value"] - reach["finest"]).all()


def test_the_folder(case, forest):
    assert sorted(each.name for each in forest.iterdir()) == [
        "comparison.csv", "comparison.json", "comparison.png", "manifest.json",
    ]  # fmt: skip
    width, height = struct.unpack(">II", (forest / "comparison.png").read_bytes()[16:24])
    assert width > 1000
    assert height > 600
    told = json.loads((forest / "comparison.json").read_text(encoding="utf-8"))
    assert told["logs"] == {"compared": LOGS, "in_layer": LOGS, "planned": LOGS}
    from_json = pd.DataFrame(told["rows"]).fillna({"item": "", "verdict": ""})
    from_json = from_json[from_json["quantity"] != "cpu_per_log"].set_index(["fidelity", "quantity", "item"])
    assert from_json["value"].to_dict() == pytest.approx(table(forest)["value"].to_dict())


def test_threads_and_the_order_of_the_releases_decide_nothing(case, forest, tmp_path):
    frame = gpd.read_file(case.releases)
    frame["log_id"] = np.arange(1, LOGS + 1)  # as rows are numbered
    frame.sample(frac=1.0, random_state=3).to_file(tmp_path / "shuffled.gpkg")
    compare(case, tmp_path / "again", threads=3, releases=str(tmp_path / "shuffled.gpkg"), **case.everything())
    assert table(tmp_path / "again").equals(table(forest))


def test_fewer_logs_are_the_first_of_the_hash_order(case, tmp_path):
    told = compare(case, tmp_path / "some", logs=12, seed=3, planned_logs=500)
    assert told["logs"] == {"compared": 12, "in_layer": LOGS, "planned": 500}
    assert told["recommendation"]["fidelity"] is None  # 12 logs prove nothing
    assert "12 were compared" in told["recommendation"]["sentence"]
    first = gpd.read_file(case.releases).iloc[hash_order(np.arange(1, LOGS + 1), 3)[:12]]
    first.to_file(tmp_path / "first.gpkg")
    run = case.run(releases=str(tmp_path / "first.gpkg"), output=str(tmp_path / "run"), trajectories="none")
    assert table(tmp_path / "some").loc[("draft", "deposit_distance", ""), "value"] == pytest.approx(
        layer(run, "deposits")["runout_m"].mean(), rel=1e-12
    )


def test_the_manifest_works_as_a_config(forest, tmp_path, capsys):
    output = tmp_path / "again"
    flags = ["--config", str(forest / "manifest.json"), "--output", str(output), "--quiet"]
    assert cli.run(["compare-fidelity", *flags]) == 0, capsys.readouterr().err
    assert table(output).equals(table(forest))


@pytest.mark.parametrize(
    ("fidelities", "words"), [("draft", "at least two"), ("draft,exact", "'exact' is none of"), (",", "at least two")]
)
def test_fidelities_that_cannot_be_compared(case, tmp_path, capsys, fidelities, words):
    flags = ["--dem", case.dem, "--releases", case.releases, "--friction", "0.4", "--output", str(tmp_path / "x")]
    assert cli.run(["compare-fidelity", *flags, "--fidelities", fidelities]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert words in said
    assert not (tmp_path / "x").exists()


class StopAt(Quiet):
    """Asks to stop as soon as the second fidelity is at work."""

    def __init__(self) -> None:
        self.stop = False

    def progress(self, done: float, total: float, what: str) -> None:
        self.stop = self.stop or what == "sliding at standard"

    def cancelled(self) -> bool:
        return self.stop


def test_an_interrupted_comparison_leaves_what_it_continues_with(case, tmp_path):
    with pytest.raises(Cancelled):
        compare(case, tmp_path / "x", StopAt())
    assert [each.name for each in tmp_path.iterdir()] == [".x.part"]


def test_an_existing_comparison_is_kept_unless_overwrite(case, forest):
    before = (forest / "comparison.csv").read_bytes()
    with pytest.raises(UserError, match="--overwrite"):
        compare(case, forest)
    assert (forest / "comparison.csv").read_bytes() == before


def test_posture_is_compared_with_separate_runs(case, forest, tmp_path):
    """The figures of a posture are what slide-logs finds for the layer that sample-releases would have written."""
    told = json.loads((forest / "comparison.json").read_text(encoding="utf-8"))
    rows = {(row["orientation"], row["quantity"], row["item"]): row for row in told["postures"]}
    assert {key[0] for key in rows} == {"random-lying"}  # they are released upright
    drawn = {
        "orientation": np.full(LOGS, "random-lying", object),
        "tilt_deg": np.zeros(LOGS),
        "azimuth_deg": np.zeros(LOGS),
    }
    directed(drawn, np.arange(1, LOGS + 1), 0)
    frame = gpd.read_file(case.releases).assign(orientation="lying", azimuth_deg=drawn["azimuth_deg"])
    frame.to_file(tmp_path / "lying.gpkg")
    for name, releases in (("value", str(tmp_path / "lying.gpkg")), ("as_released", case.releases)):
        run = case.run(
            output=str(tmp_path / name), fidelity="draft", trajectories="none", releases=releases, **case.everything()
        )
        for record in summary(run)["reach"]:
            assert rows["random-lying", "reach", record["line_id"]][name] == record["p"]
        runout = layer(run, "deposits")["runout_m"].mean()
        assert rows["random-lying", "runout_mean", ""][name] == pytest.approx(runout)
    for row in rows.values():
        assert row["difference"] == row["value"] - row["as_released"]
        assert row["ci_low"] <= row["difference"] <= row["ci_high"]


def test_logs_that_lie_already_are_compared_with_upright_ones(case, tmp_path):
    gpd.read_file(case.releases).assign(orientation="lying").to_file(tmp_path / "lying.gpkg")
    told = compare(case, tmp_path / "compared", releases=str(tmp_path / "lying.gpkg"))
    assert {row["orientation"] for row in told["postures"]} == {"upright"}
