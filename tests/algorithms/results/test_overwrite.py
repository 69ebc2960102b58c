"""--overwrite never costs an input: one check, to which every tool passes the inputs of its declaration."""

from __future__ import annotations

import ast
import hashlib
import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from slope_case import Case

from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.identity import writing
from deadwood_toolbox.cli import run as command
from deadwood_toolbox.shelf import NAMES, TOOLS, find

PAIRS = [
    pytest.param(tool, read, written, id=f"{tool.name} {read.flag} {written.flag}")
    for tool in TOOLS
    for read in tool.parameters()
    for written in tool.parameters()
    if (read.is_input or read.path_like) and written.is_output
]


def asked(tool, **values):
    """The part of an ``Ask`` that the check uses: the paths; everything else is empty."""
    empty = {each.name: None for each in tool.parameters()}
    return SimpleNamespace(**{**empty, "overwrite": True, **values})


def leave(tool, ask, written):
    with writing(tool, ask, Quiet()) as outputs:
        place = outputs.folder(written.name) if written.kind == "output_folder" else outputs.file(written.name)
        place.joinpath("new").write_text("new") if place.is_dir() else place.write_text("new")


def digests(folder: Path) -> dict[str, str]:
    return {
        each.relative_to(folder).as_posix(): hashlib.sha256(each.read_bytes()).hexdigest()
        for each in folder.rglob("*")
        if each.is_file()
    }


@pytest.mark.parametrize(("tool", "read", "written"), PAIRS)
def test_no_tool_replaces_what_it_reads(tmp_path, tool, read, written):
    """The input itself, a tile of it, a file of a run and a folder that holds it, each named as the output."""
    run = tmp_path / "made"
    run.mkdir()
    (run / "manifest.json").write_text(json.dumps({"tool": tool.name, "parameters": {}}))
    (run / "run.gpkg").write_text("rows")
    (tmp_path / "one.gpkg").write_text("rows")
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    (tiles / "a.tif").write_text("heights")
    (tiles / "b.tif").write_text("heights")
    before = digests(tmp_path)
    folder = written.kind == "output_folder"
    if folder:  # of the same tool, so that only the check prevents it
        tries = [(run, run), (run / "run.gpkg", run)]
    else:
        tries = [
            (tmp_path / "one.gpkg", tmp_path / "one.gpkg"),
            (tiles, tiles / "b.tif"),
            (run, run / "run.gpkg"),
            (run, run / "manifest.json"),
        ]
        tries += [(f"{tiles / 'a.tif'},{tiles / 'b.tif'}", tiles / "b.tif")] if read.path_like else []
    for given, output in tries:
        with pytest.raises(UserError, match="input"):
            leave(tool, asked(tool, **{read.name: str(given), written.name: str(output)}), written)
        assert digests(tmp_path) == before


FOLDERS = [
    pytest.param(tool, each, id=f"{tool.name} {each.flag}")
    for tool in TOOLS
    for each in tool.parameters()
    if each.kind == "output_folder"
]


@pytest.mark.parametrize(("tool", "written"), FOLDERS)
def test_a_folder_is_replaced_only_by_the_tool_that_made_it(tmp_path, tool, written):
    output = tmp_path / "made"
    output.mkdir()
    for content in ('{"tool": "another"}', "{}", "[]", "no JSON"):
        (output / "manifest.json").write_text(content)
        with pytest.raises(UserError, match="does not replace"):
            leave(tool, asked(tool, **{written.name: str(output)}), written)
        assert (output / "manifest.json").read_text() == content
    (output / "manifest.json").write_text(json.dumps({"tool": tool.name}))
    leave(tool, asked(tool, **{written.name: str(output)}), written)
    assert (output / "new").is_file()


@pytest.mark.parametrize("name", NAMES)
def test_no_tool_writes_past_the_guard(name):
    """The results of a tool go through `results.identity`, which passes on the inputs."""
    tool = find(name)
    assert tool is not None
    source = Path(str(__import__(tool.Ask.__module__, fromlist=["x"]).__file__)).read_text(encoding="utf-8")
    modules = {each.module for each in ast.walk(ast.parse(source)) if isinstance(each, ast.ImportFrom)}
    assert "deadwood_algorithms.files.outputs" not in modules
    own = any(each.is_output for each in tool.parameters())
    assert not own or "deadwood_algorithms.results.identity" in modules


@pytest.fixture(scope="module")
def slid(tmp_path_factory):
    case = Case(tmp_path_factory.mktemp("guard"))
    case.run(**case.everything())
    return case


def test_the_commands_that_lost_data(slid, capsys):
    """Each ended with exit 0, and a run, one of its layers or a raster was lost."""
    run, trees = str(slid.folder / "run"), slid.trees
    other = str(slid.run(trees=slid.trees, lines=slid.lines, output=str(slid.folder / "other")))
    lines = ["--lines", slid.lines]
    before = digests(slid.folder)
    for line in (
        ["map-origins", "--run", run, "--output", run],
        ["map-intensity", "--run", run, "--output", run],
        ["site-barriers", "--run", run, "--output", run, "--above-m", "10", "--length-m", "10", "--height-m", "3"],
        ["compare-scenarios", "--runs", f"{run},{other}", "--output", run],
        ["compare-scenarios", "--runs", f"{run},{other}", "--output", other],
        ["make-report", run, "--output", str(slid.folder / "page.html"), "--figures", run],
        ["value-trees", "--run", run, "--output", f"{run}/run.gpkg"],
        ["value-trees", "--run", run, "--output", trees],  # with which the run was slid, and is slid again
        ["reach-lines", "--run", run, *lines, "--output", f"{run}/run.gpkg"],
        ["count-hits", "--run", run, "--output", f"{run}/hit_count.tif"],
        ["lateral-spread", "--deposits", f"{run}/run.gpkg|layername=deposits", "--output", f"{run}/run.gpkg"],
        ["generate-forest", "--dem", slid.dem, "--like", trees, "--output", f"{run}/run.gpkg"],
        ["map-intensity", "--run", other, "--output", run],
    ):
        assert command([*line, "--overwrite", "--quiet"]) == 2, line
        said = capsys.readouterr().err
        assert "never replaced" in said or "does not replace" in said or "a part of the result" in said, said
        assert digests(slid.folder) == before, line


def test_what_a_tool_made_in_a_run_it_may_make_again(slid):
    own = slid.folder / "run" / "again.tif"
    line = ["count-hits", "--run", str(slid.folder / "run"), "--output", str(own), "--quiet"]
    assert command(line) == 0
    assert command([*line, "--overwrite"]) == 0
    own.unlink()
