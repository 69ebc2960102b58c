"""--until-ci: which logs are run, when the run ends, that the interval has its coverage, that nothing else matters."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from slope_case import RASTERS, Case, StopAfter, assert_same_run, layer, raster, summary

from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Cancelled
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.simulate import queue as until_ci
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.queue import UntilNarrow, half_width, looks_of, parts_of, z_of_looks
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import sample_releases, slide_logs
from deadwood_toolbox import cli


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    return case.run(output=str(case.folder / "full"), **case.everything())


@pytest.fixture
def early(monkeypatch) -> None:
    """Checks after 8, 16 and 24 logs, so that a run of 24 has some."""
    monkeypatch.setattr(until_ci, "FIRST_LOOK", 8)


def test_looks_and_parts():
    assert looks_of(1) == (1,)
    assert looks_of(1000) == (1000,)
    assert looks_of(20_000) == (1000, 2000, 4000, 8000, 16_000, 20_000)
    assert parts_of(1200, 512) == [slice(0, 512), slice(512, 1024), slice(1024, 1200)]
    for chunk in (1, 7, 512, 5000):
        parts = parts_of(2500, chunk, looks_of(2500))
        assert [part.start for part in parts] == [0] + [part.stop for part in parts[:-1]]
        assert max(part.stop - part.start for part in parts) <= chunk
        assert {1000, 2000, 2500} <= {part.stop for part in parts}


def test_z_of_known_designs():
    assert z_of_looks(1) == pytest.approx(1.959964, abs=1e-6)
    assert z_of_looks(2) == pytest.approx(2.178, abs=5e-4)  # Pocock (1977): two checks, the second at twice the first
    rng = np.random.default_rng(1)
    steps = rng.standard_normal((200_000, 5)) * np.sqrt([1.0, 1.0, 2.0, 4.0, 8.0])
    standard = np.cumsum(steps, axis=1) / np.sqrt([1.0, 2.0, 4.0, 8.0, 16.0])
    inside = (np.abs(standard) < z_of_looks(5)).all(axis=1).mean()
    assert inside == pytest.approx(0.95, abs=0.002)


@pytest.mark.parametrize("p", [0.02, 0.1, 0.5])
def test_the_interval_at_the_end_contains_the_true_value(p):
    """Simulated runs of up to 16 000 logs with a known reach probability."""
    looks = looks_of(16_000)
    z = z_of_looks(len(looks))
    rng = np.random.default_rng(2)
    runs = 4000
    fresh = np.diff(looks, prepend=0)
    hits = np.cumsum(rng.binomial(fresh, p, size=(runs, len(looks))), axis=1)
    target = half_width(round(4000 * p), 4000, z)  # of the expected count, so that about half the runs end there

    def holds(hit: int, n: int, z: float) -> bool:
        low, high = wilson_interval(int(hit), n, z=z)
        return low <= p <= high

    ended, all_looks, narrow, plain = np.zeros(len(looks), int), 0, 0, 0
    for row in hits:
        widths = (half_width(int(hit), n, z) for hit, n in zip(row, looks, strict=True))
        last = next((k for k, half in enumerate(widths) if half <= target), len(looks) - 1)
        ended[last] += 1
        all_looks += all(holds(hit, n, z) for hit, n in zip(row, looks, strict=True))
        narrow += all(holds(hit, n, 1.96) for hit, n in zip(row, looks, strict=True))
        plain += holds(row[last], looks[last], 1.96)
    assert ended[2:4].sum() == runs
    assert 0.4 < ended[2] / runs < 0.6 or p == 0.5  # chance decides the end; at 0.5 the width hardly depends on it
    # For all checks at once, as promised; 3 standard errors of the simulation are 0.010, and 20 expected hits at the
    # first check are not yet normal.
    assert 0.93 < all_looks / runs < 0.97
    assert narrow / runs < 0.90  # the plain interval would not have this coverage
    assert plain / runs > 0.935  # the reported 95 % interval at the end, because the rule uses only widths


@pytest.mark.parametrize(
    ("p", "target", "low", "high"),
    [(0.001, 0.003, 0.04, 0.15), (0.004, 0.005, 0.04, 0.15), (0.05, 0.005, -0.01, 0.01), (0.2, 0.01, -0.01, 0.01)],
)
def test_a_stopped_run_tells_rare_reach_too_low_and_names_the_line(p, target, low, high):
    """5000 runs of up to 64 000 logs: the mean is too low by this fraction (4 standard errors are 0.4 % of 0.2 and
    4 % of 0.001), and lines below 2 % are named where the run stopped before its last log, as they never were."""
    rng = np.random.default_rng(3)
    looks, runs = looks_of(64_000), 5000
    told, named = np.zeros(runs), np.zeros(runs, bool)
    for run in range(runs):
        rule = UntilNarrow(target, looks[-1], ["road"])
        for before, look in zip((0, *looks), looks, strict=False):
            if rule.enough(look - before, rng.binomial(look - before, p, 1)):
                break
        record = rule.record()
        told[run] = rule._reached[0] / rule.slid
        named[run] = record["told_too_low"] == ["road"]
        assert record["told_too_low"] in ([], ["road"])
        assert not (named[run] and rule.slid == looks[-1])
    error = told.std() / np.sqrt(runs) / p
    assert low - 4 * error < 1.0 - told.mean() / p < high + 4 * error
    assert named.mean() > 0.99 if p < 0.01 else not named.any()


def test_the_rule_looks_at_its_looks_only_and_at_the_widest_line():
    rule = UntilNarrow(0.05, 5000, ["road", "house"])
    assert rule.looks == (1000, 2000, 4000, 5000)
    assert rule.goal == 1000
    assert rule.z == pytest.approx(2.4085, abs=1e-4)  # four checks
    assert not rule.enough(600, np.array([300, 0]))
    assert rule.records == []  # 0.049 wide, but there was no check
    assert rule.enough(400, np.array([200, 0]))
    assert rule.records == [{"n_logs": 1000, "half_width": half_width(500, 1000, rule.z), "line_id": "road"}]
    assert rule.record()["reached"] is True
    assert rule.record()["half_width"] == pytest.approx(rule.z * math.sqrt(0.25 / 1000), rel=0.01)

    strict = UntilNarrow(0.02, 5000, ["road", "house"])
    assert not strict.enough(1000, np.array([0, 500]))
    assert strict.goal == 4000  # 0.038 wide: (0.038 / 0.02)^2 * 1000 = 3600
    assert strict.records[0]["line_id"] == "house"
    assert not strict.enough(1000, np.array([0, 500]))
    assert strict.enough(2000, np.array([0, 1000]))


def test_the_first_logs_are_an_even_sample_of_what_sample_releases_drew(slope, tmp_path):
    """The hash of the order must be independent of the draws of the places, which come from the same seed and ids."""
    (tmp_path / "at.csv").write_text("x,y\n2783100,1190080\n")
    sample_releases.TOOL(areas=str(tmp_path / "at.csv"), dem=slope(), count=20_000, output=str(tmp_path / "r.gpkg"))
    frame = read_vector(tmp_path / "r.gpkg", target_crs=None, what="releases")
    first = hash_order(frame["log_id"].to_numpy(np.int64), 0)[:2000]
    x, y = frame.geometry.x.to_numpy() - 2_783_100.0, frame.geometry.y.to_numpy() - 1_190_080.0
    tolerance = 4.0 * 5.0 / math.sqrt(2000)  # uniform in a circle of 10 m: standard deviation 5 m
    assert abs(x[first].mean()) < tolerance
    assert abs(y[first].mean()) < tolerance
    assert np.hypot(x, y)[first].mean() == pytest.approx(20.0 / 3.0, abs=4.0 * 2.36 / math.sqrt(2000))


def test_the_logs_run_are_the_first_of_the_order_and_the_same_as_in_a_full_run(case, full, early, tmp_path, capsys):
    output = tmp_path / "run"
    outcome = slide_logs.TOOL(**case.values(output=str(output), until_ci=0.45, **case.everything()))
    told, every = summary(output), layer(full, "deposits")
    first = every["log_id"].to_numpy()[np.sort(hash_order(every["log_id"].to_numpy(), 0)[:8])]
    ours = layer(output, "deposits")
    assert ours["log_id"].tolist() == first.tolist()
    theirs = every[every["log_id"].isin(first)].reset_index(drop=True)
    assert ours.drop(columns="geometry").equals(theirs.drop(columns="geometry"))
    assert ours.geometry.to_wkb().equals(theirs.geometry.to_wkb())
    assert layer(output, "trajectories")["log_id"].tolist() == first.tolist()

    assert told["logs"]["released"] == sum(told["logs"]["by_stop_reason"].values()) == 8
    assert told["logs"]["not_run"] == 16
    assert {each["n_total"] for each in told["reach"]} == {8}
    assert raster(output / "reach_probability.tif") == pytest.approx(raster(output / "hit_count.tif") / np.float32(8))
    until = told["until_ci"]
    assert (until["reached"], until["logs"], until["logs_at_most"]) == (True, 8, 24)
    assert [look["n_logs"] for look in until["looks"]] == [8]
    widest = max(half_width(each["n_reach"], 8, until["z"]) for each in told["reach"])
    assert until["half_width"] == pytest.approx(widest)
    assert widest > max((each["ci_high"] - each["ci_low"]) / 2 for each in told["reach"])
    assert any(line.startswith("enough logs: after 8 of 24") for line in outcome.lines)


def test_a_target_out_of_reach_runs_all_logs_as_a_plain_run_does(case, full, early, tmp_path):
    output = tmp_path / "run"
    outcome = slide_logs.TOOL(**case.values(output=str(output), until_ci=0.001, **case.everything()))
    for name in ("deposits", "deposited_logs", "trajectories", "reach", "reached_by"):
        ours, theirs = layer(output, name), layer(full, name)
        assert ours.drop(columns="geometry").equals(theirs.drop(columns="geometry")), name
        assert ours.geometry.to_wkb().equals(theirs.geometry.to_wkb()), name
    for name in RASTERS:
        assert np.array_equal(raster(output / f"{name}.tif"), raster(full / f"{name}.tif"), equal_nan=True), name
    ours, theirs = (parquet.read_table(run / "poses.parquet").to_pandas() for run in (output, full))
    by = ["log_id", "t_s"]
    assert ours.sort_values(by, ignore_index=True).equals(theirs.sort_values(by, ignore_index=True))
    told = summary(output)
    assert {k: v for k, v in told.items() if k not in ("cost", "until_ci")} == {
        k: v for k, v in summary(full).items() if k not in ("cost", "until_ci")
    }
    assert told["until_ci"]["reached"] is False
    assert [look["n_logs"] for look in told["until_ci"]["looks"]] == [8, 16, 24]
    assert told["logs"]["not_run"] == 0
    assert any("not enough logs" in line for line in outcome.lines)


def test_threads_chunks_and_an_interruption_decide_nothing(case, early, tmp_path, monkeypatch):
    """A target met at the second check, so that the resumed run repeats the first."""
    values = {"until_ci": 0.255, **case.everything()}
    one = case.run(output=str(tmp_path / "one"), threads=1, **values)
    assert [look["n_logs"] for look in summary(one)["until_ci"]["looks"]] == [8, 16]
    monkeypatch.setattr(chunks, "CHUNK", 3)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    assert_same_run(one, case.run(output=str(tmp_path / "three"), threads=3, **values))
    with pytest.raises(Cancelled):
        case.run(StopAfter(12), output=str(tmp_path / "again"), **values)
    assert not (tmp_path / "again").exists()
    assert_same_run(one, case.run(output=str(tmp_path / "again"), resume=True, threads=2, **values))


def test_it_needs_lines(case, tmp_path, capsys):
    flags = ["--dem", case.dem, "--releases", case.releases, "--friction", "0.4", "--output", str(tmp_path / "run")]
    assert cli.run(["slide-logs", *flags, "--until-ci", "0.01"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--until-ci needs --lines" in said
    assert cli.run(["slide-logs", *flags, "--lines", case.lines, "--until-ci", "0"]) == 2
    assert "at least 0.0001" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
