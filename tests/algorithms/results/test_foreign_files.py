"""The folder of a result holds its own files and those of others: only the former are replaced or removed."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from datetime import date
from pathlib import Path
from types import SimpleNamespace

import pytest
from hand_run import Track, write_run

from deadwood_algorithms.files import outputs
from deadwood_algorithms.results.identity import Making, writing
from deadwood_algorithms.tools import slide_logs
from deadwood_toolbox.cli import run as command

KEPT = "run.old-2026-02-03"
TOOL = slide_logs.TOOL


def asked(**values) -> SimpleNamespace:
    """The part of an ``Ask`` that is used here; everything else is empty."""
    return SimpleNamespace(**{each.name: None for each in TOOL.parameters()} | {"overwrite": True, **values})


@pytest.fixture(autouse=True)
def one_day(monkeypatch):
    """The names hold the date, and a run of all tests may pass midnight."""
    monkeypatch.setattr(outputs, "date", SimpleNamespace(today=lambda: date(2026, 2, 3)))


def digests(folder: Path) -> dict[str, str]:
    files = (each for each in folder.rglob("*") if each.is_file() and "link" not in each.parts)
    return {each.relative_to(folder).as_posix(): hashlib.sha256(each.read_bytes()).hexdigest() for each in files}


def made(place: Path, said, content: str = "first") -> Path:
    """A result of slide-logs of three files and a folder, of which one is how a layer is drawn."""
    with writing(TOOL, asked(output=str(place), resume=False, restart=False), said) as files:
        folder = files.folder()
        (folder / "summary.json").write_text(content)
        (folder / "hit_count.qml").write_text(f"<qgis>{content}</qgis>")
        (folder / "releases").mkdir()
        (folder / "releases" / "a.csv").write_text(content)
    return place


OTHERS: dict[str, Callable[[Path], object]] = {
    "a text": lambda run: (run / "thesis.txt").write_text("years of work"),
    "a file in a folder of the run": lambda run: (run / "releases" / "mine.csv").write_text("x"),
    "another run": lambda run: write_run(run / "deeper", [Track((5.0, 5.0), (9.0, 9.0))]),
    "a hidden file": lambda run: (run / ".notes").write_text("x"),
    "a link": lambda run: (run / "link").symlink_to(run.parent),
    "a style": lambda run: (run / "hit_count.qml").write_text("<qgis>mine</qgis>"),
    "an edited file": lambda run: (run / "summary.json").write_text("first, and a remark"),
}
LEFT: dict[str, Callable[[Path], object]] = {
    "nothing": lambda run: None,
    "statistics": lambda run: (run / "summary.json.aux.xml").write_text("<PAMDataset/>"),
    "of a desktop": lambda run: (run / "Thumbs.db").write_text("x"),
    "a file less": lambda run: (run / "releases" / "a.csv").unlink(),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_what_a_tool_did_not_write_is_kept(tmp_path, said, kind):
    run = made(tmp_path / "run", said)
    OTHERS[kind](run)
    before = digests(run)
    made(run, said, "second")
    assert (run / "summary.json").read_text() == "second"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run", KEPT]
    assert digests(tmp_path / KEPT) == before
    assert os.path.lexists(tmp_path / KEPT / "link") == (kind == "a link")
    assert len(said.warnings) == 1
    OTHERS[kind](run)
    made(run, said, "third")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run", KEPT, f"{KEPT}-2"]
    assert digests(tmp_path / KEPT) == before


@pytest.mark.parametrize("kind", LEFT)
def test_what_programs_leave_behind_is_replaced(tmp_path, said, kind):
    run = made(tmp_path / "run", said)
    LEFT[kind](run)
    made(run, said, "second")
    assert (run / "summary.json").read_text() == "second"
    assert [each.name for each in tmp_path.iterdir()] == ["run"]
    assert not said.warnings


def test_a_link_to_a_folder_stays_one(tmp_path, said):
    run = made(tmp_path / "disk" / "run", said)
    (tmp_path / "link").symlink_to(run)
    made(tmp_path / "link", said, "second")
    assert (tmp_path / "link").is_symlink()
    assert (run / "summary.json").read_text() == "second"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["disk", "link"]
    assert [each.name for each in run.parent.iterdir()] == ["run"]


def test_a_link_to_itself_is_refused(tmp_path, capsys):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    run = str(write_run(tmp_path / "run", [Track((5.0, 5.0), (9.0, 9.0))]))
    for line in (["make-report", run, "--output", f"{tmp_path}/loop"], ["make-report", f"{tmp_path}/loop"]):
        assert command([*line, *(() if "--output" in line else ("--output", f"{tmp_path}/page.html"))]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("ending", [".aux.xml", ".msk", ".ovr"])
def test_what_lies_beside_an_earlier_raster_is_not_read_with_the_new_one(tmp_path, ending, capsys):
    run, hits = str(write_run(tmp_path / "run", [Track((5.0, 5.0), (9.0, 9.0))])), tmp_path / "hits.tif"
    hits.with_name(f"hits.tif{ending}").write_text("<PAMDataset/>")
    line = ["count-hits", "--run", run, "--output", str(hits), "--quiet"]
    assert command(line) == 2
    assert command([*line, "--overwrite"]) == 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["hits.qml", "hits.tif", "run"]
    capsys.readouterr()


def test_a_manifest_that_was_edited_is_not_repeated(tmp_path, said, capsys):
    run = made(tmp_path / "run", said)
    told = json.loads((run / "manifest.json").read_text())
    told["parameters"]["friction"] = "0.5"
    (run / "manifest.json").write_text(json.dumps(told))
    assert command(["slide-logs", "--config", str(run / "manifest.json"), "--output", str(tmp_path / "again")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (tmp_path / "again").exists()


def test_a_folder_in_place_of_a_layer_is_not_walked_through(tmp_path, slope):
    (tmp_path / "many" / "deep").mkdir(parents=True)
    (tmp_path / "many" / "deep" / "x.gpkg").write_text("x")
    folder = str(tmp_path / "many")
    ask = asked(dem=folder, lines=folder, trees=slope(), friction=folder)
    assert list(Making(TOOL, ask).named) == ["trees"]
