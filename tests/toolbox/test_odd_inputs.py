"""Odd inputs to every tool, drawn from the declarations: one line and exit 2, no internal error, no endless run."""

from __future__ import annotations

import os
import random
import re
import time
from pathlib import Path

import pytest

from deadwood_algorithms.params.kinds import LARGEST, SMALLEST, Parameter
from deadwood_algorithms.params.tool import Tool, UserError, check_value
from deadwood_toolbox import cli, shelf

SEED = int(os.environ.get("DEADWOOD_ODD_SEED", "20261125"))
SECONDS = 40.0  # for all draws; each tool gets its share
LEFT_OUT = ("warm-up", "view", "explore", "list-presets")  # which read and write nothing, or start a browser
TOOLS = [tool for each in shelf.TOOLS if (tool := shelf.find(each.name)) and each.name not in LEFT_OUT]
NUMBERS = [(tool, each) for tool in TOOLS for each in tool.parameters() if each.kind == "number"]
SAMPLE = Path(__file__).parents[2] / "sample_data"
LAYERS = {"point": "deadwood", "line": "lines", "polygon": "release_area"}
NAMES = (
    "/",
    ".",
    "..",
    "a;b",
    "a|b",
    "a\nb",
    "a\tb",
    "a\0b",
    "\udcff",
    "\x1b[31m",
    "x" * 300,
    "http://x/y",
    "/vsimem/a",
)


def named(value: object) -> str:
    return f"{value.name}" if isinstance(value, Tool) else value.name if isinstance(value, Parameter) else str(value)


@pytest.mark.parametrize(("tool", "parameter"), NUMBERS, ids=named)
def test_numbers_that_nothing_has_are_refused(tool, parameter):
    for value in (5e-324, 1e-300, SMALLEST / 2.0, LARGEST * 2.0, 1e308, -1e308, float("inf"), float("nan")):
        with pytest.raises(UserError) as refused:
            check_value(parameter, value)
        assert parameter.flag in str(refused.value)
    if parameter.default is not None:
        check_value(parameter, parameter.default)


@pytest.mark.parametrize("tool", TOOLS, ids=named)
def test_names_that_no_output_can_have_are_refused(tool):
    for parameter in tool.parameters():
        for name in NAMES if parameter.is_output else ():
            with pytest.raises(UserError) as refused:
                check_value(parameter, name)
            assert str(refused.value).isprintable()
        if parameter.is_output:
            for name in ("a b", "ä/ö.tif", "..a", "a,b", "run/", "x" * 180):
                check_value(parameter, name)


@pytest.fixture(scope="module")
def odd_files(tmp_path_factory) -> list[str]:
    """Files that are not what their names suggest, and things that are not files."""
    folder = tmp_path_factory.mktemp("odd")
    noise = random.Random(SEED).randbytes(500)
    heads = {"tif": b"II*\0", "gpkg": b"SQLite format 3\0", "csv": b"x,y\n", "shp": b"\0\0\x27\x0a", "json": b"{"}
    heads |= {
        "vrt": b" " * 200 + b"<VRTDataset ",
        "asc": b"ncols 3\n",
        "parquet": b"PAR1",
        "pts": b"1 2",
        "geojson": b"[",
    }
    for ending, head in heads.items():
        (folder / f"noise.{ending}").write_bytes(head + noise)
        (folder / f"empty.{ending}").write_bytes(b"")
        (folder / f"folder.{ending}").mkdir()
    (folder / "run").mkdir()
    (folder / "run" / "manifest.json").write_text('{"tool": 3, "parameters": [], "files": {}}')
    os.mkfifo(folder / "pipe.tif")
    fifo = f'<VRTDataset rasterXSize="2" rasterYSize="2"><SourceFilename>{folder / "pipe.tif"}</SourceFilename>'
    (folder / "pipe.vrt").write_text(f"{fifo}</VRTDataset>")
    (folder / "comment.vrt").write_text(f"<!-- a -- b -->{fifo}</VRTDataset>")
    found = [str(each) for each in sorted(folder.iterdir())]
    return [
        *found,
        str(folder / "nowhere.gpkg"),
        "",
        " ",
        "a\0b",
        "x" * 300,
        "/dev/null",
        str(folder / "noise.csv") + "|a=b",
    ]


def odd_value(parameter: Parameter, files: list[str], draw: random.Random, place: Path) -> str:
    if parameter.is_output:
        return draw.choice([*NAMES, str(place / f"out{draw.randrange(9)}.gpkg"), str(place / "out")])
    if parameter.kind in ("number", "integer"):
        return draw.choice(["1e-300", "1e308", "nan", "inf", "-1e9", "", "1e99999", "9" * 400, "x", "0x10", "1,5"])
    if parameter.kind in ("numbers", "number_or_layer") and draw.random() < 0.5:
        return draw.choice(["0:1e300:1e-300", ",", "1,1", "nan", "1:2", "-1,-2", "0.2:0.1:0.1"])
    return draw.choice(files)


def right_value(parameter: Parameter, place: Path) -> str | None:
    """A value that the tool accepts, or None if the sample has none (a run)."""
    if parameter.kind == "output_folder":
        return str(place / parameter.name)
    if parameter.is_output:
        return str(place / f"{parameter.name}{'.tif' if parameter.kind == 'output_raster' else '.gpkg'}")
    if parameter.kind == "raster":
        return str(SAMPLE / "dem.tif")
    if parameter.kind == "table":
        return str(SAMPLE / "trees.csv")
    if parameter.kind == "vector":
        return f"{SAMPLE / 'sample.gpkg'}|layername={LAYERS[parameter.geometry[0]]}"
    return {"number": "1.0", "integer": "1", "numbers": "0.2,0.3", "number_or_layer": "0.3"}.get(parameter.kind)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
@pytest.mark.parametrize("tool", TOOLS, ids=named)
def test_odd_inputs_end_in_one_line(tool, odd_files, tmp_path, monkeypatch, capfd):
    """One input of each tool is odd, mostly a required one; in every third draw all required ones are."""
    monkeypatch.chdir(tmp_path)
    draw, begun = random.Random(f"{SEED} {tool.name}"), time.monotonic()
    parameters = [each for each in tool.parameters() if not each.is_switch]
    needed = [each for each in parameters if each.default is None and not each.optional]
    slides = any(each.name == "scheduler" for each in parameters) or tool.name in (
        "demo",
        "reproduce-paper",
    )  # for minutes, if nothing is odd
    for number in range(200):
        if time.monotonic() - begun > SECONDS / len(TOOLS):
            break
        odd = (
            needed
            if slides or number % 3 == 0
            else [draw.choice(needed if needed and draw.random() < 0.6 else parameters)]
        )
        odd = odd or [draw.choice(parameters)]
        line = [tool.name, "--quiet"]
        for each in dict.fromkeys([*needed, *odd]):
            value = None if each in odd else right_value(each, tmp_path)
            value = odd_value(each, odd_files, draw, tmp_path) if value is None else value
            line += [each.flag, draw.choice(NAMES) if slides and each.is_output else value]
        if all(each not in needed and each.kind in ("text", "choice", "crs", "field") for each in odd):
            continue  # a name among these may happen to be valid
        capfd.readouterr()
        status = cli.run(line)
        told = capfd.readouterr().err
        assert status in (0, 2) if all(each.is_output or each.kind == "table" for each in odd) else status == 2, (
            SEED,
            line,
            status,
            told,
        )
        assert status == 0 or len(told.strip().splitlines()) == 1, (SEED, line, told)
        assert not options_of_others(told, tool), (SEED, line, told)


def options_of_others(told: str, tool: Tool) -> set[str]:
    """Options named in a message that neither the tool has nor another tool that is named there."""
    named_there = [tool, *(each for each in TOOLS if each.name in told)]
    own = {flag for each in named_there for one in each.parameters() for flag in (one.flag, *one.old_flags)}
    foreign = re.findall(r"rio [^;]*", told)  # a printed command of another program
    theirs = set(re.findall(r"--[a-z0-9-]+", " ".join(foreign)))
    return set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]+", told)) - own - theirs


def test_an_option_of_another_tool_is_found():
    tool = shelf.find("lateral-spread")
    assert tool is not None
    assert options_of_others("--min-runout-m is -1; --dbh-cm is not", tool) == {"--dbh-cm"}
    make_log = shelf.find("make-log")
    assert make_log is not None
    assert not options_of_others("--density-kg-m3 is '0x10'", make_log)
    assert options_of_others("--density-kg-m3 is '0x10'", tool) == {"--density-kg-m3"}
    assert not options_of_others("run slide-logs with --trajectories all", tool)
