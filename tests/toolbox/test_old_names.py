"""Old names of parameters: they mean the new ones wherever a parameter is given, and are named where they must be."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

import pytest
import toy_tool

from deadwood_algorithms.evaluate.sites.sites_table import sites_of_table
from deadwood_algorithms.params import renamed
from deadwood_algorithms.params.kinds import Parameter
from deadwood_algorithms.params.renamed import with_new_names
from deadwood_algorithms.params.tool import Quiet, Tool
from deadwood_toolbox import cli, parameters
from deadwood_toolbox.commands import build
from deadwood_toolbox.shelf import TOOLS, find
from docs import options

ROOT = Path(__file__).parents[2]
OLD = [(tool, each, old) for tool in TOOLS for each in tool.parameters() for old in each.old_names]


def example(parameter: Parameter) -> str:
    return "7" if parameter.kind in ("number", "numbers") else "some.gpkg"


def needed(tool: Tool) -> list[str]:
    required = (each for each in tool.parameters() if each.default is None and not each.optional)
    return [f"{each.flag}={'7' if each.kind in ('number', 'integer') else 'x.gpkg'}" for each in required]


def job(tool: Tool, words: list[str]):
    return build((tool,), (tool,)).main([tool.name, *words], standalone_mode=False)


def test_every_row_of_the_table_is_of_a_parameter():
    found = defaultdict(set)
    for tool, each, old in OLD:
        found[tool.name].add((each.name, old))
    for name, rows in renamed.OF_ONE_TOOL.items():
        assert set(rows.items()) <= found[name]
    assert set(renamed.OF_ALL_TOOLS.items()) <= set().union(*found.values())


def test_an_old_name_is_no_parameter_of_its_own():
    wrong = [(tool.name, old) for tool, _, old in OLD if old in {each.name for each in tool.parameters()}]
    assert wrong == []


def test_flags_files_of_parameters_and_keywords_take_them_unsaid(tmp_path, capsys):
    wrong = []
    for tool, each, old in OLD:
        new = job(tool, [f"{each.flag}={example(each)}", *needed(tool)])
        same = job(tool, [f"--{old.replace('_', '-')}={example(each)}", *needed(tool)])
        value = new.values[each.name]
        config = tmp_path / "config.json"
        config.write_text(json.dumps({"tool": tool.name, "parameters": {old: value}}))
        if same.values != new.values or parameters.read_config(str(config), tool) != {each.name: value}:
            wrong.append((tool.name, old))
        given = {name: value for name, value in new.values.items() if name != each.name} | {old: value}
        if tool.ask_from(given) != tool.ask_from(new.values):
            wrong.append((tool.name, old, "keyword"))
    assert wrong == []
    assert capsys.readouterr().err == ""


def test_the_new_name_overrides_the_old_one():
    assert with_new_names("slide-logs", {"time_limit": 3.0, "time_limit_s": 5.0}) == {"time_limit_s": 5.0}
    assert with_new_names("slide-logs", {"time_limit_s": 5.0, "time_limit": 3.0}) == {"time_limit_s": 5.0}
    assert with_new_names("slide-logs", {"time_limit_s": None, "time_limit": 3.0}) == {"time_limit_s": 3.0}
    assert with_new_names("sample-releases", {"areas": "a"}) == {"areas": "a"}


def test_flags_go_before_an_old_manifest(tmp_path):
    tool = find("lateral-spread")
    assert tool is not None
    config = tmp_path / "manifest.json"
    config.write_text(json.dumps({"tool": tool.name, "parameters": {"deposits": "d.gpkg", "min_runout": 3.0}}))
    from_file = parameters.read_config(str(config), tool)
    assert from_file["min_runout_m"] == 3.0
    flags = job(tool, ["--min-runout=8"]).values
    assert (from_file | flags)["min_runout_m"] == 8.0


def test_columns_of_a_sites_table_take_them(tmp_path):
    tool = find("slide-logs")
    assert tool is not None
    (tmp_path / "sites.csv").write_text("site,time-limit,rest speed\na,30,0.2\n")
    (site,) = sites_of_table(str(tmp_path / "sites.csv"), tool, Quiet())
    assert site.values == {"time_limit_s": 30.0, "rest_speed_ms": 0.2}


def test_help_and_catalogue_are_silent_and_the_description_names_them(capsys):
    """A word of help may be an old name of another tool's option, so whole lines of options are looked at."""
    assert cli.run(["slide-logs", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "--time-limit-s NUMBER" in shown
    assert "--time-limit NUMBER" not in shown
    assert "`--time-limit`" not in "\n".join(line for tool in TOOLS for line in options.rows([*tool.parameters()]))
    assert cli.run(["describe", "slide-logs", "--json"]) == 0
    told = {each["name"]: each["old_names"] for each in json.loads(capsys.readouterr().out)["parameters"]}
    assert told["time_limit_s"] == ["time_limit"]
    assert told["dem"] == []


def test_they_are_listed_among_the_changes():
    text = " ".join((ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split())
    missing = [
        (each.flag, old) for _, each, old in OLD if each.flag not in text or f"`--{old.replace('_', '-')}`" not in text
    ]
    assert missing == []


def test_a_switch_has_them_too(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(renamed.OF_ONE_TOOL, toy_tool.TOOL.name, {"overwrite": "replace"})
    assert job(toy_tool.TOOL, ["--replace"]).values == {"overwrite": True}
    assert job(toy_tool.TOOL, ["--no-replace"]).values == {"overwrite": False}


def test_one_name_means_one_thing_over_all_tools():
    """An output of one tool is no input of another."""
    meanings = defaultdict(set)
    for tool in TOOLS:
        for each in tool.parameters():
            meanings[each.name].add(each.is_output)
    assert {name: found for name, found in meanings.items() if len(found) > 1} == {}


def test_a_tools_old_name_still_runs_and_is_shown_nowhere(tmp_path, capsys):
    assert cli.run(["list", "--presets"]) == 0
    shown = capsys.readouterr().out
    assert cli.run(["list-presets", "--output", str(tmp_path / "presets.csv")]) == 0
    assert capsys.readouterr().out == shown
    assert (tmp_path / "presets.csv").is_file()
    assert "source: " in shown
    for words in (["--help"], ["list"]):
        assert cli.run(words) == 0
        assert "list-presets" not in capsys.readouterr().out
    assert cli.run(["list", "--presets", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["presets"]
    assert {"option", "name", "values", "source"} < set(rows[0])
    assert all(each["name"] in shown for each in rows)
