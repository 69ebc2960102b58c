"""The report for users: made with a run, from the command line, and opened by `view`."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from slope_case import Case

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import make_report, slide_logs, view
from deadwood_toolbox import cli

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("front"))


@pytest.fixture(scope="module")
def run(case) -> Path:
    return case.run(output=str(case.folder / "bare"))


def test_slide_logs_adds_a_report(case):
    outcome = slide_logs.TOOL(**case.values(output=str(case.folder / "my case"), lines=case.lines, report=True))
    page = case.folder / "my case" / "report.html"
    assert outcome.outputs["report"] == page
    text = page.read_text(encoding="utf-8")
    assert "Sliding deadwood: my case" in text
    assert ".partial-" not in text
    assert not (page.parent / ".report.html.lock").exists()


def test_runs_stand_without_a_flag(run, tmp_path, capsys):
    assert cli.run(["make-report", str(run), "--output", str(tmp_path / "p.html"), "--quiet"]) == 0
    assert (tmp_path / "p.html").stat().st_size > 100_000
    assert cli.run(["make-report", str(run), "--output", str(tmp_path / "p.html")]) == 2
    assert "--overwrite replaces it" in capsys.readouterr().err
    assert cli.run(["make-report", str(run), "--runs", str(run), "--output", str(tmp_path / "q.html")]) == 2
    assert "--runs is given twice" in capsys.readouterr().err
    assert cli.run(["make-report", "--output", str(tmp_path / "q.html")]) == 2
    assert "--runs is missing" in capsys.readouterr().err
    assert cli.run(["make-report", str(tmp_path), "--output", str(tmp_path / "q.html")]) == 2
    assert "not a folder of slide-logs" in capsys.readouterr().err
    assert cli.run(["make-report", "--help"]) == 0
    assert "[RUN]..." in capsys.readouterr().out


def test_view_makes_a_page_once_and_opens_it(run, monkeypatch):
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    page = run / "report.html"
    page.unlink(missing_ok=True)
    view.TOOL(run=str(run))
    made = page.stat().st_mtime_ns
    view.TOOL(run=str(run))
    assert page.stat().st_mtime_ns == made
    assert opened == [page.resolve().as_uri()] * 2


def test_view_tells_the_address_where_no_browser_starts(run, monkeypatch, said):
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    view.TOOL(view.Ask(run=str(run)), said)
    assert any("file://" in note for note in said.notes)


def test_the_wheel_holds_scripts_and_styles(tmp_path):
    """Built as pip builds it; without the network, so the build's own requirements must be there."""
    pytest.importorskip("hatchling")
    environment = os.environ | {"PIP_NO_INDEX": "1"}
    build = "import hatchling.build as b; print(b.build_wheel(__import__('sys').argv[1]))"
    made = subprocess.run(
        [sys.executable, "-c", build, str(tmp_path)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    with zipfile.ZipFile(tmp_path / made.stdout.split()[-1]) as wheel:
        names = set(wheel.namelist())
    assert {f"deadwood_algorithms/report/{name}" for name in ("page.css", "page.js", "view3d.js")} <= names
    assert "deadwood_toolbox/functions.pyi" in names


def test_a_view_is_not_offered_in_qgis():
    assert view.TOOL.qgis_id == ""
    assert make_report.TOOL.qgis_id == "deadwood:makereport"


@pytest.mark.parametrize("runs", ["x" * 300, "x" * 4000, "a,b," + "y" * 300])
def test_a_name_that_no_folder_can_have_is_refused(tmp_path, runs):
    with pytest.raises(UserError):
        make_report.TOOL(runs=runs, output=str(tmp_path / "a.html"))
