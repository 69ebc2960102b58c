"""The command line: what it prints, its exit status, and that a user's error is exactly one line."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from deadwood_algorithms.params.manifest import engine_digest, manifest
from deadwood_algorithms.params.tool import VERSION, Outcome
from deadwood_algorithms.tools import make_log
from deadwood_toolbox import cli, shelf
from deadwood_toolbox.commands import build, laid_out


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "result"


# --- list, describe, help -------------------------------------------------------------------------------------------


def test_version_and_help_need_no_tool(toy):
    assert toy("--version").out == f"deadwood-tool {VERSION}\n"
    for arguments in ([], ["--help"]):
        ran = toy(*arguments)
        assert ran.status == 0
        assert "toy-walk" in ran.out
        assert "describe" in ran.out
        assert ran.err == ""


def test_list_names_tool_and_summary(toy):
    assert toy("list").out == "toy-walk  Walk, wait and fail as told.\n"
    listed = json.loads(toy("list", "--json").out)
    assert listed["version"] == VERSION
    assert listed["tools"] == [
        {
            "name": "toy-walk",
            "label": "Toy walk",
            "group": "Prepare",
            "qgis_id": "deadwood:toywalk",
            "summary": "Walk, wait and fail as told.",
        }
    ]


def test_describe_gives_the_whole_declaration(toy):
    told = json.loads(toy("describe", "toy-walk", "--json").out)
    by_name = {each["name"]: each for each in told["parameters"]}
    assert list(by_name)[:3] == ["dem", "trees", "friction"]
    dbh = by_name["dbh_cm"]
    assert (dbh["flag"], dbh["unit"], dbh["minimum"], dbh["exclusive"], dbh["maximum"], dbh["default"]) == (
        "--dbh-cm",
        "cm",
        0,
        True,
        500,
        75.0,
    )
    assert by_name["trees"]["geometry"] == ["point", "line"]
    assert [name for name, each in by_name.items() if each["required"]] == ["dem", "output"]
    assert {name for name, each in by_name.items() if each["direction"] == "output"} == {"output"}
    everything = json.loads(toy("describe", "--json").out)
    assert everything["tools"] == [told]


def test_help_shows_groups_ranges_units_and_defaults(toy):
    text = toy("toy-walk", "--help").out
    sections = re.findall(r"^(\w[\w ]+):$", text, flags=re.MULTILINE)
    assert sections == ["Inputs", "Parameters", "Advanced", "Outputs", "On every tool"]
    flat = " ".join(text.split())
    assert "--dem RASTER Terrain [required]" in flat
    assert "--trees LAYER Trees [point or line]" in flat
    assert "Diameter of logs [cm, 0 < x <= 500, default 75]. Of logs without one." in flat
    assert "Seed of the random draws [>= 0, default 0]" in flat
    for flag in ("--config", "--quiet", "--verbose", "--progress"):
        assert flag in text
    assert toy("describe", "toy-walk").out == text


# --- exit status and the one line -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["toy-wlak"], "no tool is called 'toy-wlak'; did you mean 'toy-walk'?"),
        (["describe", "toy-wlak"], "no tool is called 'toy-wlak'; did you mean 'toy-walk'?"),
        (["xyz"], "the tools are toy-walk"),
        (["toy-walk", "--dbh-mc", "3"], "no such option: --dbh-mc; did you mean --dbh-cm?"),
        (["--vresion"], "no such option: --vresion; did you mean --version?"),
        (["toy-walk", "--dem"], "'--dem' requires an argument"),
        (["toy-walk", "more"], "more has no option before it; did you mean --dem more?"),
        (["toy-walk", "--dem", "a", "--output", "b", "a b", "c"], "'a b' c has no option before it"),
        (["toy-walk", "--output", "x"], "--dem is missing (Terrain)"),
        (["toy-walk", "--dem", "x"], "--output is missing (Result)"),
        (["toy-walk", "--dem", " "], "--dem is empty"),
        (["toy-walk", "--progress", "loud"], "'loud' is not one of"),
        (["toy-walk", "--dbh-cm", "3", "--dbh-cm", "4"], "--dbh-cm is given more than once; give it once"),
        (["toy-walk", "--config", "a", "--config", "b"], "--config is given more than once"),
        (["toy-walk", "--asks", "--no-asks"], "--asks is given more than once"),
    ],
)
def test_a_wrong_command_line_is_one_line_and_status_2(toy, arguments, said):
    ran = toy(*arguments)
    assert ran.status == 2
    assert said in ran.line
    assert ran.line.startswith("deadwood-tool: ")
    assert ran.out == ""


def test_several_values_given_one_by_one_are_sent_to_one_option(capsys):
    """Before, only the last counted, without a word."""
    assert cli.run(["import-trees", "--missing-value=-9", "--missing-value", "-1"]) == 2
    assert "--missing-value is given more than once; give it once, with commas" in capsys.readouterr().err


def test_an_old_name_and_its_new_one_are_the_same_option(capsys):
    assert cli.run(["slide-logs", "--time-limit", "60", "--time-limit-s", "90"]) == 2
    assert "--time-limit-s is given more than once; give it once" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flag", "value", "said"),
    [
        ("--dbh-cm", "abc", "--dbh-cm is 'abc', but must be a number"),
        ("--dbh-cm", "", "--dbh-cm is '', but must be a number"),
        ("--dbh-cm", "7,5", "must be a number"),
        ("--dbh-cm", "nan", "must be finite"),
        ("--dbh-cm", "inf", "must be finite"),
        ("--dbh-cm", "-inf", "must be finite"),
        ("--dbh-cm", "1e999", "must be finite"),
        ("--dbh-cm", "0", "must be greater than 0 cm"),
        ("--dbh-cm", "-3", "must be greater than 0 cm"),
        ("--dbh-cm", "501", "must be at most 500 cm"),
        ("--wait-s", "-0.5", "must be at least 0 s"),
        ("--seed", "1.5", "must be a whole number"),
        ("--seed", "-1", "must be at least 0"),
        ("--seed", "9" * 25, "must be below 2^63"),
        ("--seed", "9" * 5000, "must be a whole number"),
        ("--friction", "-0.1", "must be at least 0"),
        ("--friction", "nan", "must be finite"),
        ("--fail", "loudly", "--fail is 'loudly', but must be one of none, user"),
    ],
)
def test_a_wrong_value_is_refused_before_anything_runs(toy, out, flag, value, said):
    ran = toy("toy-walk", "--dem", "x", "--output", out, flag, value)
    assert ran.status == 2
    assert said in ran.line
    assert not out.exists()


def test_values_that_look_like_flags_or_paths_reach_the_tool(toy, out):
    given = ["--offset-m", "-2.5", "--friction", "mu.tif", "--trajectories", "all", "--trees", "f.gpkg|layername=trees"]
    assert toy("toy-walk", "--dem", "x", "--output", out, *given).status == 0
    values = json.loads((out / "manifest.json").read_text())["parameters"]
    wanted = {"offset_m": -2.5, "friction": os.path.abspath("mu.tif"), "trajectories": "all"}
    wanted |= {"trees": f"{os.path.abspath('f.gpkg')}|layername=trees"}
    assert {name: values[name] for name in wanted} == wanted


@pytest.mark.parametrize(
    ("fail", "status", "said"),
    [
        ("user", 2, "field 'dbh_cm', row 7: -3 is not a diameter; give it in centimetres"),
        ("full", 2, "somewhere/deposits.gpkg: the disk is full"),
        ("denied", 2, "somewhere: permission denied"),
        ("many", 2, "somewhere: too many files are open at once; raise the limit, for example with ulimit -n 1024"),
        ("memory", 2, "out of memory (Unable to allocate 9 GiB)"),
        ("pipe", 2, "a program that was written to has closed its end"),
        ("cancelled", 130, "interrupted"),
        ("fault", 1, "a bug in the toolbox"),
    ],
)
def test_a_failing_tool_ends_with_its_status_and_leaves_nothing(toy, out, tmp_path, fail, status, said):
    ran = toy("toy-walk", "--dem", "x", "--output", out, "--quiet", "--fail", fail)
    assert ran.status == status
    assert said in ran.line
    assert list(tmp_path.iterdir()) == []


def test_a_fault_of_ours_saves_its_traceback(toy, out):
    ran = toy("toy-walk", "--dem", "x", "--output", out, "--quiet", "--fail", "fault")
    saved = Path(re.search(r"traceback is in (\S+)\)", ran.line)[1])  # type: ignore[index]
    text = saved.read_text()
    saved.unlink()
    assert "Traceback" in text
    assert "ZeroDivisionError: division by zero" in text
    loud = toy("toy-walk", "--dem", "x", "--output", out, "--fail", "fault", "--verbose")
    assert loud.status == 1
    assert "Traceback" in loud.err
    Path(re.search(r"traceback is in (\S+)\)", loud.err)[1]).unlink()  # type: ignore[index]


@pytest.mark.parametrize("width", [80, 100])
def test_the_help_of_every_tool_fits_the_terminal(width):
    """Commands in it continue after a backslash, so that they can still be copied."""
    top = build(shelf.TOOLS, shelf.TOOLS)
    for name, command in top.commands.items():
        context = click.Context(command, info_name=f"deadwood-tool {name}", terminal_width=width)
        wide = [line for line in command.get_help(context).splitlines() if len(line) > width]
        assert wide == [], name


def test_a_command_is_broken_between_its_options():
    told = (
        "Words.\n\n    deadwood-tool a --one 1 \\\n        --two 'x y' --three 3\n\n"
        "- an item that\n  goes on\n- another"
    )
    shown = laid_out(told, 34)
    lines = [line for line in shown.splitlines() if line.startswith("    ")]
    assert all(len(line) <= 34 for line in lines)
    joined = re.sub(r" [\\`]\n\s+", " ", "\n".join(lines)).strip()
    assert joined == "deadwood-tool a --one 1 --two 'x y' --three 3"
    assert "- an item that goes on\n- another" in shown


# --- parameters from a file -----------------------------------------------------------------------------------------


def test_a_manifest_repeats_its_run_and_flags_override_it(toy, tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    given = ["--dbh-cm", "60", "--offset-m", "-1.25", "--seed", "7", "--friction", "0.45", "--fail", "none"]
    assert toy("toy-walk", "--dem", "x", "--output", first, *given).status == 0
    again = toy("toy-walk", "--config", first / "manifest.json", "--output", second, "--seed", "8")
    assert again.status == 0
    before, after = (json.loads((each / "manifest.json").read_text())["parameters"] for each in (first, second))
    assert after == {**before, "output": str(second), "seed": 8}


def test_a_manifest_works_from_any_folder(toy, tmp_path, monkeypatch):
    """Its paths are absolute; inputs that were moved together with it are found, with a note."""
    here = tmp_path / "here"
    (here / "maps").mkdir(parents=True)
    (here / "maps" / "trees.gpkg").write_text("")
    monkeypatch.chdir(here)
    given = ["--trees", "maps/trees.gpkg|layername=a", "--friction", "0.3"]
    assert toy("toy-walk", "--dem", "https://example.org/dem.tif", "--output", "runs", *given).status == 0
    told = json.loads((here / "runs" / "manifest.json").read_text())
    assert told["folder"] == told["parameters"]["output"] == str(here / "runs")
    assert told["parameters"]["trees"] == f"{here / 'maps' / 'trees.gpkg'}|layername=a"
    assert told["parameters"]["friction"] == 0.3
    assert told["parameters"]["dem"] == "https://example.org/dem.tif"

    monkeypatch.chdir(tmp_path)
    assert toy("toy-walk", "--config", here / "runs" / "manifest.json", "--output", tmp_path / "a").status == 0
    again = json.loads((tmp_path / "a" / "manifest.json").read_text())["parameters"]
    assert again == {**told["parameters"], "output": str(tmp_path / "a")}

    here.rename(tmp_path / "there")
    ran = toy("toy-walk", "--config", "there/runs/manifest.json", "--output", tmp_path / "b")
    moved = json.loads((tmp_path / "b" / "manifest.json").read_text())["parameters"]
    assert moved["trees"] == f"{tmp_path / 'there' / 'maps' / 'trees.gpkg'}|layername=a"
    assert "is read instead" in ran.err


def test_a_manifest_of_the_first_version_still_works(toy, tmp_path, monkeypatch):
    """Its paths are as they were given; from elsewhere they are looked for beside the run."""
    (tmp_path / "run").mkdir()
    (tmp_path / "trees.gpkg").write_text("")
    old = {"tool": "toy-walk", "version": "0.1.0"}
    values = {"dem": "x", "trees": "trees.gpkg", "output": "run", "seed": 3}
    (tmp_path / "run" / "manifest.json").write_text(json.dumps({**old, "parameters": values}))
    for folder, moved in ((tmp_path, False), (tmp_path / "run", True)):
        monkeypatch.chdir(folder)
        output = tmp_path / f"again_{moved}"
        ran = toy("toy-walk", "--config", tmp_path / "run" / "manifest.json", "--output", output)
        assert ran.status == 0
        told = json.loads((output / "manifest.json").read_text())["parameters"]
        assert (told["trees"], told["seed"]) == (str(tmp_path / "trees.gpkg"), 3)
        assert ("is read instead" in ran.err) == moved


def test_every_manifest_names_version_and_engine(toy, out):
    assert toy("toy-walk", "--dem", "x", "--output", out).status == 0
    told = json.loads((out / "manifest.json").read_text())
    assert (told["version"], told["engine"]) == (VERSION, engine_digest())


def test_the_engines_digest_is_that_of_its_cache_and_costs_no_import(checkout):
    look = (
        "import sys; from deadwood_algorithms.params.manifest import engine_digest; print(engine_digest());"
        "print('numba' in sys.modules);"
        "from deadwood_engine import compiled; print((getattr(compiled, 'engine_digest', None) or compiled._digest)())"
    )
    ran = subprocess.run([sys.executable, "-c", look], env=checkout, capture_output=True, text=True, check=True)
    ours, imported, theirs = ran.stdout.split()
    assert ours == theirs
    assert imported == "False"


def test_a_flag_switched_on_in_a_file_can_be_switched_off(toy, tmp_path, out):
    config = tmp_path / "ask.json"
    config.write_text(json.dumps({"dem": "x", "output": str(out), "overwrite": True, "friction": 0.5, "trees": None}))
    assert toy("toy-walk", "--config", config, "--no-overwrite").status == 0
    values = json.loads((out / "manifest.json").read_text())["parameters"]
    assert values["overwrite"] is False
    assert values["friction"] == 0.5


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "is not JSON"),
        ("[" * 100_000, "is nested too deep; it must hold a JSON object"),
        ("[1, 2]", "must hold a JSON object"),
        ('{"dbh_mc": 3}', "toy-walk has no parameter 'dbh_mc'; did you mean 'dbh_cm'?"),
        ('{"tool": "other", "parameters": {}}', "belongs to the tool 'other', not to 'toy-walk'"),
        ('{"dbh_cm": "75"}', "--dbh-cm is '75', but must be a number"),
        ('{"dbh_cm": NaN}', "must be finite"),
        ('{"dbh_cm": true}', "must be a number"),
        ('{"seed": 1.5}', "must be a whole number"),
        ('{"seed": 1' + "0" * 400 + "}", "must be below 2^63"),
        ('{"overwrite": "yes"}', "must be true or false"),
        ('{"dem": 5}', "'dem' is 5, but must be text"),
        ('{"seed": 1, "seed": 2}', "'seed' is given more than once; keep one"),
        ('{"fail": "loudly"}', "must be one of none, user"),
    ],
)
def test_a_wrong_file_of_parameters_is_one_line(toy, tmp_path, out, content, said):
    config = tmp_path / "ask.json"
    config.write_text(content)
    values = ["--output", out] if '"dem"' in content else ["--dem", "x", "--output", out]
    ran = toy("toy-walk", "--config", config, *values)
    assert ran.status == 2
    assert said in ran.line
    assert not out.exists()


def test_a_missing_file_of_parameters_is_one_line(toy, tmp_path):
    ran = toy("toy-walk", "--config", tmp_path / "nothing.json")
    assert ran.status == 2
    assert "nothing.json cannot be read: No such file" in ran.line


def test_a_python_caller_gets_the_same_manifest(tmp_path):
    import toy_tool

    ask = toy_tool.Ask(dem="x", output=tmp_path / "o")
    assert manifest(toy_tool.TOOL, ask)["parameters"]["output"] == str(tmp_path / "o")


# --- messages during a run ------------------------------------------------------------------------------------------


def test_no_next_command_is_shown_where_nothing_was_written():
    ask = make_log.Ask(output="a log")
    tool = dataclasses.replace(make_log.TOOL, then="deadwood-tool make-report {output}")
    assert cli._following(tool, ask, Outcome({})) == ""
    assert cli._following(tool, ask, Outcome({"output": Path("a log")})) == "deadwood-tool make-report 'a log'"


def test_results_go_to_stdout_and_messages_to_stderr(toy, out):
    ran = toy("toy-walk", "--dem", "x", "--output", out)
    assert ran.out == "a table\nfor a reader\n"
    assert ran.err.splitlines() == ["begun", f"output: {out}"]


def test_quiet_reports_nothing(toy, out):
    ran = toy("toy-walk", "--dem", "x", "--output", out, "--quiet", "--wait-s", "0.2", "--progress", "bar")
    assert (ran.status, ran.out, ran.err) == (0, "", "")


def test_progress_as_json_is_one_object_a_line(toy, out):
    ran = toy("toy-walk", "--dem", "x", "--output", out, "--wait-s", "0.6", "--progress", "json")
    kinds = [each["event"] for each in ran.events]
    assert kinds[0] == "note"
    assert kinds[-1] == "done"
    steps = [each for each in ran.events if each["event"] == "progress"]
    assert len(steps) >= 3
    assert all(set(each) == {"event", "what", "done", "total", "rate_per_s", "left_s"} for each in steps)
    assert [each["done"] for each in steps] == sorted(each["done"] for each in steps)
    last, middle = steps[-1], steps[1]
    assert (last["what"], last["done"], last["total"], last["left_s"]) == ("waiting", 12, 12, 0)
    left_by_rate = (middle["total"] - middle["done"]) / middle["rate_per_s"]
    assert middle["left_s"] == pytest.approx(left_by_rate, rel=1e-3)
    assert ran.events[-1]["outputs"] == {"output": str(out), "manifest": str(out / "manifest.json")}
    assert ran.events[-1]["facts"] == {"dbh_cm": 75.0}


@pytest.mark.parametrize("arguments", [["toy-walk", "--dbh-mc", "3"], ["toy-walk", "--dem", "x", "--fail", "user"]])
def test_with_progress_as_json_the_error_is_json_too(toy, out, arguments):
    ran = toy(*arguments, "--output", out, "--progress", "json")
    last = ran.events[-1]
    assert (last["event"], last["exit_status"], ran.status) == ("error", 2, 2)


# --- as a separate program ------------------------------------------------------------------------------------------


def test_foreign_gdal_paths_are_dropped_unless_ours_says_not(start_toy, tmp_path):
    for name, more, seen in (("a", {}, "none"), ("b", {"DEADWOOD_KEEP_GDAL_ENV": "1"}, "/foreign/proj")):
        out = tmp_path / name
        program = start_toy("toy-walk", "--dem", "x", "--output", out, PROJ_LIB="/foreign/proj", **more)
        _, said = program.communicate(timeout=30)
        assert program.returncode == 0, said
        assert (out / "proj.txt").read_text() == seen


@pytest.mark.skipif(sys.platform != "linux", reason="a limit that Linux keeps to")
def test_an_address_space_that_is_too_small_is_refused_at_the_start(start_toy, tmp_path):
    """With 1 GB the compiler aborted, or never ended and ignored signals."""
    import resource

    both = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (1_000_000 * 1024, both[1]))
    try:
        program = start_toy("toy-walk", "--dem", "x", "--output", tmp_path / "result")
    finally:
        resource.setrlimit(resource.RLIMIT_AS, both)
    _, said = program.communicate(timeout=30)
    assert program.returncode == 2
    assert "limited to 0.95 GB (ulimit -v)" in said
    assert said.count("\n") == 1


@pytest.mark.skipif(os.name == "nt", reason="a shell that closes streams")
@pytest.mark.parametrize(("command", "status"), [("list 2>&-", 0), ("list >&-", 0), ("list <&-", 0), ("lst 2>&-", 2)])
def test_a_closed_stream_is_not_taken_by_a_file(checkout, command, status):
    line = f"'{sys.executable}' -m deadwood_toolbox {command}"
    assert subprocess.run(["sh", "-c", line], env=checkout, capture_output=True, timeout=60).returncode == status


@pytest.mark.skipif(os.name == "nt", reason="a folder in use cannot be removed there")
def test_a_folder_that_no_longer_exists_is_one_line(checkout, tmp_path):
    line = f"cd '{tmp_path}' && rmdir '{tmp_path}' && '{sys.executable}' -m deadwood_toolbox list"
    done = subprocess.run(["sh", "-c", line], env=checkout, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)


def test_a_reader_that_stops_early_gets_no_complaint(start_toy):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as closed:
        program = start_toy("list", "--json", stdout=closed)
    _, said = program.communicate(timeout=30)
    assert (program.returncode, said) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is always full is needed")
def test_a_full_disk_behind_stdout_is_one_line(start_toy):
    with open("/dev/full", "w") as full:
        program = start_toy("list", stdout=full)
    _, said = program.communicate(timeout=30)
    assert (program.returncode, said) == (2, "deadwood-tool: the disk is full\n")
