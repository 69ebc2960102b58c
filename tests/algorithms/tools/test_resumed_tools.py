"""Every tool that slides logs, from one declaration: killed in the middle and resumed, or slid by the workers of a
scheduler, the same bytes as in one go; stopped, it leaves only files for resuming; a plan writes nothing; logs
that sink deep are warned about."""

from __future__ import annotations

import json
import signal
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

import pandas as pd
import pyogrio
import pytest
import shapely
from killed_run import met_run
from slope_case import Case, points, write_layer
from thread_workers import threads_for_workers

from deadwood_algorithms.ensemble.variants import Ensemble
from deadwood_algorithms.evaluate.protection import changed_scenes
from deadwood_algorithms.params.tool import Cancelled, Quiet, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.simulate import chunks, scheduler, sinking
from deadwood_toolbox.shelf import TOOLS

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
SLIDING = {tool.name: tool for tool in TOOLS if issubclass(tool.Ask, SlidingOptions)}
SPENT = {"cost", "cpu_s", "wall_s", "rows", "recommendation"}  # cost of a run, which is never the same twice


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def asked(case) -> dict[str, dict[str, Any]]:
    """Arguments of each tool; ends of the layers of one run of slide-logs."""
    every = case.everything() | {"time_limit_s": 20.0}
    scene = {name: value for name, value in case.values(**every).items() if name not in ("output", "trajectories")}
    run = case.run(output=str(case.folder / "slid"), **every)
    seen = write_layer(case.folder / "seen.gpkg", points((30.0, 45.0), (25.0, 40.0)))
    shapes = [shapely.LineString([(8.0 + x, 52.0), (24.0 + x, 51.0)]) for x in (0.0, 28.0)]
    could = write_layer(case.folder / "could.gpkg", shapes, barrier_id=["west", "east"])
    plain = {name: value for name, value in scene.items() if name != "fidelity"}
    ground = {name: scene[name] for name in ("dem", "trees", "lines", "friction", "length_m", "dbh_cm", "time_limit_s")}
    return {
        "assess-mobilisation": {**ground, "cell_m": 20.0, "logs_per_cell": 2},
        "slide-logs": {**scene, "trajectories": "all"},
        "run-sites": {**scene, "by": "release_id"},
        "calibrate-friction": {**scene, "friction": "0.2,0.3,0.4", "observed": seen},
        "compare-fidelity": {**plain, "fidelities": "draft,standard"},
        "vary": {**scene, "vary": "friction=0.2:0.4,log_dbh_factor", "design": "ends"},
        "value-trees": {"run": str(run)},
        "break-trees": {"run": str(run), "tree_capacity_kj": 0.2},
        "site-barriers": {"run": str(run), "candidates": could, "height_m": "1,3"},
    }


def test_these_are_all_the_tools_that_slide(asked):
    """From one declaration: no tool declares an option of the group itself."""
    assert set(asked) == set(SLIDING)
    names = {each.name for each in fields(SlidingOptions)}
    for tool in TOOLS:
        if tool.name != "reproduce-paper":  # slides through slide-logs, site by site
            assert (
                not names
                & {"scheduler", "workers", "plan"}
                & {each.name for each in fields(tool.Ask) if tool.name not in SLIDING}
            )
            assert tool.name not in SLIDING or names <= {each.name for each in fields(tool.Ask)}


def output_of(name: str) -> str:
    return {"value-trees": "run.gpkg", "break-trees": "run.gpkg", "assess-mobilisation": "run.tif"}.get(name, "run")


def made_in(folder: Path) -> list[str]:
    """The names of what lies in a folder, except the style beside a raster."""
    return [each.name for each in folder.iterdir() if each.suffix != ".qml"]


def contents(output: Path) -> dict[str, Any]:
    """Everything that a tool wrote, except its cost, its command line and figures of its speed."""
    files = [output] if output.is_file() else sorted(each for each in output.rglob("*") if each.is_file())
    found: dict[str, Any] = {}
    for file in files:
        name = "" if file == output else file.relative_to(output).as_posix()
        if file.name in ("manifest.json", "comparison.png"):
            found[name] = None
        elif file.suffix == ".json":
            told = json.loads(file.read_text(encoding="utf-8"))
            found[name] = {key: value for key, value in told.items() if key not in SPENT}
        elif file.suffix == ".gpkg":
            for layer, _ in pyogrio.list_layers(file):
                frame = pyogrio.read_dataframe(file, layer=layer)
                frame = frame.drop(columns=[each for each in frame if each in SPENT])
                found[f"{name}|{layer}"] = frame.to_wkb().to_csv() if "geometry" in frame else None
        elif file.name == "comparison.csv":
            table = pd.read_csv(file)
            found[name] = table[table["quantity"] != "cpu_per_log"].to_csv()
        elif file.name == "overview.csv":
            table = pd.read_csv(file)
            found[name] = table.drop(columns=[each for each in table if each in SPENT]).to_csv()
        else:
            found[name] = file.read_bytes()
    return found


@pytest.mark.parametrize("name", sorted(SLIDING))
def test_killed_and_resumed_it_is_the_same(asked, tmp_path, monkeypatch, said, name):
    output = output_of(name)
    config, whole, killed = tmp_path / "ask.json", tmp_path / "whole", tmp_path / "killed"
    config.write_text(json.dumps(asked[name]))
    whole.mkdir()
    killed.mkdir()
    ran = met_run(name, config, whole, 0, 0, 0.0, output=output)
    assert ran.returncode == 0, ran.stderr
    assert not list(whole.glob(".*")), "nothing is left beside a result"
    kept: list[Path] = []
    moments = int(ran.stdout.split("moments: ")[1].split()[0])
    for share in (0.3, 0.5, 0.7, 0.8, 0.9, 0.2, 0.1):  # until one falls among the chunks
        ran = met_run(name, config, killed, signal.SIGKILL, int(share * moments), 0.0, output=output)
        kept = [*killed.rglob(".*.part/logs_*.npz"), *killed.glob(".*/sites/**/logs_*.npz")]
        if kept and ran.returncode == -signal.SIGKILL:
            break
    assert ran.returncode == -signal.SIGKILL, ran.stderr
    assert kept, [each.name for each in killed.iterdir()]
    assert not (killed / output).exists()

    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    monkeypatch.setattr(changed_scenes, "CHUNK", 20)
    tool: Tool = SLIDING[name]
    changed = {"time_limit_s": 21.0} if "dem" in asked[name] else {"seed": 1, "logs": 20}
    if name != "run-sites":  # whose sites are repeated if their inputs changed
        with pytest.raises(UserError, match="was begun with other"):
            tool(**{**asked[name], **changed}, output=str(killed / output), resume=True)
    tool(feedback=said, **asked[name], output=str(killed / output), resume=True)
    assert name == "run-sites" or any("finished chunks of logs are reused" in note for note in said.notes)
    assert contents(killed / output) == contents(whole / output)
    assert made_in(killed) == [output]


@pytest.mark.parametrize("name", sorted(SLIDING))
def test_on_the_workers_of_a_scheduler_it_is_the_same(asked, tmp_path, monkeypatch, name):
    monkeypatch.setattr(scheduler, "_local_cluster", threads_for_workers)
    monkeypatch.setattr(chunks, "CHUNK", 8)
    monkeypatch.setattr(changed_scenes, "CHUNK", 20)
    for folder, where in (("alone", {}), ("spread", {"scheduler": "local", "workers": 2})):
        (tmp_path / folder).mkdir()
        SLIDING[name](**asked[name], output=str(tmp_path / folder / output_of(name)), **where)
        assert made_in(tmp_path / folder) == [output_of(name)]
    found = contents(tmp_path / "spread" / output_of(name))
    assert found == contents(tmp_path / "alone" / output_of(name))
    assert len(found) > 0


class Patient(Quiet):
    """Times out, so that a run that waits for nothing fails instead of hanging."""

    def __init__(self, seconds: float) -> None:
        self.until = time.monotonic() + seconds

    def cancelled(self) -> bool:
        return time.monotonic() > self.until


def test_work_started_ahead_on_a_scene_that_is_made_again_is_repeated(asked, tmp_path, monkeypatch):
    """Each chunk of a coefficient has a scene of its own here: work started ahead is dropped, and no worker waits."""
    monkeypatch.setattr(scheduler, "_local_cluster", threads_for_workers)
    monkeypatch.setattr(chunks, "CHUNK", 8)
    monkeypatch.setattr(Ensemble, "_scene_of", lambda self, variant, on: variant.scene(on) if variant.scene else on)
    tool, values = SLIDING["calibrate-friction"], asked["calibrate-friction"]
    for folder, where in (("alone", {}), ("spread", {"scheduler": "local", "workers": 2})):
        (tmp_path / folder).mkdir()
        tool(feedback=Patient(200.0), **values, output=str(tmp_path / folder / "found"), **where)
    assert contents(tmp_path / "spread" / "found") == contents(tmp_path / "alone" / "found")


class Stops(Quiet):
    """A user who watches the progress, and interrupts once logs are slid."""

    def __init__(self) -> None:
        self.shares: dict[str, list[float]] = {}
        self.notes: list[str] = []
        self.stopped = False

    def progress(self, done: float, total: float, what: str) -> None:
        self.shares.setdefault(what, []).append(done / max(total, 1e-9))
        self.stopped = self.stopped or ("slid" in what and done > 4)

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.notes.append(message)

    def cancelled(self) -> bool:
        return self.stopped


@pytest.mark.parametrize("name", sorted(SLIDING))
def test_stopped_it_says_how_far_it_was_and_leaves_nothing_that_looks_like_a_result(asked, tmp_path, monkeypatch, name):
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    monkeypatch.setattr(changed_scenes, "CHUNK", 20)
    user, output = Stops(), tmp_path / output_of(name)
    with pytest.raises(Cancelled):
        SLIDING[name](feedback=user, **asked[name], output=str(output))
    assert not output.exists()
    assert all(each.name.startswith(".") for each in tmp_path.iterdir())
    # before the first chunk there is nothing to continue from, and after the last one the tool may be in its evaluation
    if list(tmp_path.rglob("logs_*.npz")) and "slid" in list(user.shares)[-1]:
        assert any("--resume continues from there" in each for each in user.notes)
    seen = [shares for what, shares in user.shares.items() if "slid" in what]
    assert seen
    assert all(0.0 <= each <= 1.0 for shares in seen for each in shares)


@pytest.mark.parametrize("name", sorted(SLIDING))
def test_a_plan_writes_nothing(asked, tmp_path, name):
    output = tmp_path / (output_of(name))
    outcome = SLIDING[name](**asked[name], output=str(output), plan=True, plan_logs=20)
    assert outcome.facts["logs"] >= outcome.facts["pilot_logs"] > 0
    assert outcome.facts["core_hours"] > 0.0
    assert any(line.startswith("16 workers:") for line in outcome.lines)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", sorted(SLIDING))
def test_logs_that_sink_deep_are_warned_about(asked, tmp_path, monkeypatch, said, name):
    """Here none sinks deeper than half its diameter, but many by a thousandth. Before, no tool reported it."""
    output = tmp_path / (output_of(name))
    SLIDING[name](feedback=said, **asked[name], output=str(output))
    assert not any("sank deeper" in each for each in said.warnings)
    monkeypatch.setattr(sinking, "TOO_DEEP", 1e-3)
    SLIDING[name](feedback=said, **asked[name], output=str(output), overwrite=True)
    found = [each for each in said.warnings if "sank deeper than 0.001 of their diameter" in each]
    assert len(found) == (2 if name == "run-sites" else 1), "once, but once a site"
