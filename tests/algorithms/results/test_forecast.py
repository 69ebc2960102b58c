"""The forecast of --plan compared with the cost of the run, and the refusals based on it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from slope_case import Case, layer, points, write_layer

from deadwood_algorithms.evaluate.sites import sites_plan
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results import forecast
from deadwood_algorithms.results.forecast import Pilot
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.tools import run_sites, slide_logs

LOGS = 6000
ROOT = Path(__file__).parents[3]
PILOT = Pilot(
    logs=400, kept=400, cpu_s=8.0, slide_s=5.0, other_s=3.0, memory=500_000_000, passed_cells=10_000, vertices=40_000,
    files={"poses.parquet": 4_000_000, "run.gpkg": 2_000_000, "hit_count.tif": 100_000, "summary.json": 5_000},
    spread=0.5,
)  # fmt: skip
PEAK = """
import resource, sys
from deadwood_toolbox import cli
status = cli.run(sys.argv[1:])
print("peak", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
sys.exit(status)
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """The slope with so many logs that a pilot is a small part of them."""
    case = Case(tmp_path_factory.mktemp("case"))
    places = np.random.default_rng(8).random((LOGS, 2)) * (40.0, 20.0) + (10.0, 65.0)
    case.releases = write_layer(
        case.folder / "many.gpkg", points(*places), log_id=np.arange(LOGS), release_id=["a", "b", "c"] * (LOGS // 3)
    )
    return case


def told(case: Case, **changes: object) -> dict:
    values = case.values(lines=case.lines, output=str(case.folder / "planned"), **changes)
    return dict(slide_logs.TOOL(**values, plan=True).facts)


def size_of(folder: Path) -> int:
    return sum(each.stat().st_size for each in folder.rglob("*") if each.is_file())


def test_what_is_reported_is_what_the_run_takes(case):
    """Memory and disk: the part beyond the pilot within a factor of 2, because logs differ in how long they slide
    (the pilot's mean is within a few percent) and files in how well they compress; the forecast should not be too low.

    Processor time is compared, because wall time on a shared machine is not reliable.
    """
    values = case.values(lines=case.lines, output=str(case.folder / "whole"))
    asked = case.folder / "ask.json"
    asked.write_text(json.dumps(values))
    paths = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))

    def peak(*words: str) -> tuple[int, str]:
        ran = subprocess.run(
            [sys.executable, "-c", PEAK, "slide-logs", "--config", str(asked), *words],
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=600,
        )
        assert ran.returncode == 0, ran.stderr
        return int(ran.stdout.rsplit("peak", 1)[1]), ran.stderr

    _, said = peak("--plan", "--progress", "json")
    facts = json.loads(said.strip().splitlines()[-1])["facts"]
    assert (facts["logs"], facts["pilot_logs"]) == (LOGS, 400)
    most = [0]
    done = threading.Event()

    def watch() -> None:
        while not done.wait(0.05):
            places = [each for each in case.folder.glob(".whole*") if each.is_dir()]
            try:
                most[0] = max(most[0], sum(size_of(each) for each in places))
            except OSError:  # removed between listing and counting
                continue

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        taken, _ = peak()
    finally:
        done.set()
        watcher.join()
    run = case.folder / "whole"
    # memory hardly grows with the logs (docs/memory.md), so all of it is compared: libraries, scene and logs
    assert 0.5 * facts["memory"] < taken < 1.1 * facts["memory"]
    assert 0.7 * size_of(run) < facts["disk_at_end"] < 1.4 * size_of(run)
    assert 0.8 * most[0] < facts["disk"] < 2.0 * most[0]
    cost = json.loads((run / "summary.json").read_text(encoding="utf-8"))["cost"]
    assert facts["cpu_s"] == pytest.approx(cost["cpu_s"], rel=0.5)  # threads that share a core cost some more


def test_a_plan_writes_nothing(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    outcome = slide_logs.TOOL(
        feedback=said, **case.values(output=str(case.folder / "planned")), plan=True, plan_logs=20
    )
    assert outcome.outputs == {}
    assert outcome.lines[0] == f"logs:          {LOGS}, of which {LOGS} keep their trajectory"
    assert outcome.lines[-1] == "from a pilot of 20 logs, drawn at random; nothing was written"
    assert any(each.startswith("16 workers:") for each in outcome.lines)
    assert not list(case.folder.glob("*planned*"))
    assert not list(tmp_path.iterdir())


def test_the_pilot_is_an_even_draw_of_the_very_logs(case, tmp_path):
    frame = gpd.read_file(case.releases)
    ask = slide_logs.Ask(**case.values(output=str(tmp_path / "few"), seed=3, time_limit_s=0.1, overwrite=True))
    wanted = frame["log_id"].to_numpy()[hash_order(frame["log_id"].to_numpy(), 3)[:40]]
    _, logs = slide_logs.slid_run(ask, None, Quiet(), at_most=40)
    assert logs == len(frame)
    assert layer(tmp_path / "few", "deposits")["log_id"].tolist() == sorted(wanted)


def test_the_arithmetic_by_hand():
    same = forecast.forecast(PILOT, 400, 400, threads=2, workers=5)
    assert (same.cpu_s, same.wall_s, same.memory, same.off) == (8.0, 8.0, 500_000_000, 0.0)
    assert same.workers_s == 5.0 / 5 + 3.0
    assert same.disk_at_end == sum(PILOT.files.values())
    many = forecast.forecast(PILOT, 40_000, 1_000, threads=2, workers=10)
    assert many.cpu_s == 800.0
    assert many.wall_s == pytest.approx(500.0 + 3.0 + 39_600 * forecast.WRITE_S)
    assert many.workers_s == pytest.approx(many.wall_s - 450.0)
    assert many.off == pytest.approx(1.96 * 0.5 / 20.0)
    log, kept, vertex = forecast.LOG_MEMORY, forecast.KEPT_MEMORY, forecast.VERTEX_MEMORY
    assert many.memory == 500_000_000 + 39_600 * log + 600 * (kept + 100 * vertex)
    lines = 40_000 * 24 + 400 * forecast.TRAJECTORY_ROW
    rows = 2_000_000 - forecast.EMPTY_LAYERS - lines
    files = (
        10_000_000
        + forecast.EMPTY_LAYERS
        + 100 * rows
        + 2.5 * lines
        + 5_000
        + 100_000 * (1.0 + 2.0 * forecast.RASTER_DECADE)
    )
    assert many.disk_at_end == pytest.approx(files, abs=1.0)


def test_sites_one_after_the_other_add_up():
    one, other = (forecast.forecast(PILOT, n, 0, threads=2, workers=4) for n in (4_000, 40_000))
    both = forecast.together([one, other])
    assert both.logs == 44_000
    assert both.cpu_s == one.cpu_s + other.cpu_s
    assert both.wall_s == one.wall_s + other.wall_s
    assert both.memory == other.memory
    assert both.disk_at_end == one.disk_at_end + other.disk_at_end
    assert both.disk - both.disk_at_end == other.disk - other.disk_at_end


def test_too_little_memory_or_disk_is_refused_in_time(monkeypatch):
    found = forecast.forecast(PILOT, 10**7, 10**7, threads=2, workers=4)
    monkeypatch.setattr(forecast, "free_bytes", lambda: 2 * found.memory)
    monkeypatch.setattr(forecast, "free_disk", lambda output: found.disk - 1)
    with pytest.raises(UserError, match=r"run: 10000000 logs would take \d+ GB of disk, .* --trajectories"):
        forecast.refuse_too_large(found, "run")
    monkeypatch.setattr(forecast, "free_disk", lambda output: found.disk)
    forecast.refuse_too_large(found, "run")
    monkeypatch.setattr(forecast, "free_bytes", lambda: found.memory // 2)
    with pytest.raises(UserError, match=r"run: 10000000 logs would take \d+ GB of memory, .* --until-ci"):
        forecast.refuse_too_large(found, "run")
    monkeypatch.setattr(forecast, "free_bytes", lambda: None)
    forecast.refuse_too_large(replace(found, disk=1), "run")


def test_a_run_that_cannot_fit_the_disk_is_refused_before_the_first_log(case, monkeypatch):
    monkeypatch.setattr(forecast, "free_disk", lambda output: 1_000_000)
    with pytest.raises(
        UserError, match=rf"{LOGS} logs, of which {LOGS} keep their trajectory, take about 0.18 GB of disk, 0.95 MB"
    ):
        case.run(output=str(case.folder / "full"))
    assert not list(case.folder.glob("*full*"))


@pytest.mark.parametrize(
    ("logs", "kept", "length"),
    [(1, "none", 240), (1, "all", 240), (40, "none", 240), (40, "all", 240), (40, "all", 1400)],
)
def test_a_disk_that_a_small_run_would_fill_is_warned_of(tmp_path, said, monkeypatch, logs, kept, length):
    """On a slope of 35 degrees, 150 m down: never too small, and at most 2.2 times what the folders hold at their peak.

    A log alone hardly moves the rasters, which the constant allows for; 1.0 to 2.0 measured. On paths of 1.8 km the
    forecast was 0.42 of the finished folder.
    """
    case = Case(tmp_path)
    heights = np.repeat(1000.0 + 0.7 * np.maximum(np.arange(float(length))[::-1, None] - 60.0, 0.0), 60, axis=1)
    with rasterio.open(case.dem) as short:
        west, south = short.bounds[:2]
        profile = short.profile | {"height": length, "transform": from_origin(west, south + length, 1.0, 1.0)}
    with rasterio.open(case.dem, "w", **profile) as made:
        made.write(heights.astype("float32"), 1)
    places = np.random.default_rng(8).random((logs, 2)) * (30.0, 20.0) + (15.0, length - 40.0)
    case.releases = write_layer(tmp_path / "some.gpkg", points(*places), log_id=np.arange(logs))
    reach = float(np.hypot(*np.maximum(places, (60.0, length) - places).T).max())
    usual = forecast.usual_disk(logs, logs if kept == "all" else 0, reach)
    monkeypatch.setattr(forecast, "free_disk", lambda output: usual - 1)
    most, done = [0], threading.Event()

    def watch() -> None:
        while not done.wait(0.003):
            try:
                most[0] = max(most[0], sum(size_of(each) for each in tmp_path.glob(".run*")))
            except OSError:  # removed between listing and counting
                continue

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        run = case.run(said, friction="0.3", trajectories=kept)
    finally:
        done.set()
        watcher.join()
    assert max(most[0], size_of(run)) <= usual <= 2.2 * max(most[0], size_of(run))
    assert sum("take about" in each and "--plan measures" in each for each in said.warnings) == 1
    monkeypatch.undo()
    said.warnings.clear()
    case.run(said, friction="0.3", output=str(tmp_path / "again"), trajectories=kept)
    assert not any("of disk" in each for each in said.warnings)


def test_the_plan_of_sites_counts_all_their_logs(case, tmp_path, monkeypatch):
    monkeypatch.setattr(sites_plan, "PILOTS", 2)
    values = {key: value for key, value in case.values().items() if key != "output"}
    outcome = run_sites.TOOL(**values, by="release_id", output=str(case.folder / "sites"), plan=True, plan_logs=40)
    assert (outcome.facts["sites"], outcome.facts["logs"], outcome.facts["pilot_logs"]) == (3, LOGS, 40)
    alone = dict(slide_logs.TOOL(**case.values(), plan=True, plan_logs=40).facts)
    # two pilots of forty logs, of which one may slide a hundred times longer than others
    assert outcome.facts["cpu_s"] == pytest.approx(alone["cpu_s"], rel=0.8)
    assert outcome.lines[0] == "sites:         3, of which 2 were looked at"
    assert not list(case.folder.glob("*sites*"))


def test_a_plan_of_sites_of_which_none_can_be_slid_is_refused(case, said, tmp_path):
    (tmp_path / "sites.csv").write_text("site,releases\na,none.gpkg\nb,none.gpkg\n")
    values = {key: value for key, value in case.values().items() if key not in ("output", "releases")}
    with pytest.raises(UserError, match="none of the sites can be slid"):
        run_sites.TOOL(
            feedback=said, **values, sites=str(tmp_path / "sites.csv"), output=str(tmp_path / "sites"), plan=True
        )
    assert [each.partition(":")[0] for each in said.warnings] == ["a", "b"]
