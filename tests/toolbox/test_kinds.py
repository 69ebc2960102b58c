"""A new kind of parameter is one entry of one table; everything rendered from declarations then supports it."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, fields
from pathlib import Path

import pytest

from deadwood_algorithms.params import kinds, tool
from deadwood_algorithms.params.kinds import KINDS, Kind
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_toolbox import cli, parameters
from docs import options

ROOT = Path(__file__).parents[2]
WORDS = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


def from_text(parameter: kinds.Parameter, text: str) -> float:
    if text not in WORDS:
        raise UserError(f"{parameter.flag} is '{text}', but must be one of {', '.join(WORDS)}")
    return WORDS[text]


@pytest.fixture
def compass(monkeypatch: pytest.MonkeyPatch) -> Tool:
    """A tool with a parameter of a kind that the toolbox does not have."""
    monkeypatch.setitem(KINDS, "compass", Kind(metavar="WIND", from_text=from_text, json_as_it_is=True, widget="text"))

    @dataclass(frozen=True, kw_only=True)
    class Ask:
        towards: float = tool.ask("compass", "Where it points", default=0.0)
        output: str = tool.output_folder("Result")
        overwrite: bool = tool.overwrite()

    def run(ask: Ask, feedback: Feedback) -> Outcome:
        return Outcome({}, {}, (f"towards {ask.towards:g}",))

    return Tool("point", "Prepare", "Point", Ask, run)


def test_a_new_kind_is_one_entry(compass, capsys, tmp_path):
    assert cli.run(["point", "--help"], tools=(compass,)) == 0
    assert re.search(r"--towards WIND +Where it points \[default 0\]", capsys.readouterr().out)
    assert cli.run(["point", "--towards", "south", "--output", "x"], tools=(compass,)) == 0
    assert capsys.readouterr().out == "towards 180\n"
    assert cli.run(["point", "--towards", "up", "--output", "x"], tools=(compass,)) == 2
    assert "--towards is 'up', but must be one of north" in capsys.readouterr().err
    (tmp_path / "config.json").write_text(json.dumps({"towards": 90.0, "output": "x"}))
    assert cli.run(["point", "--config", str(tmp_path / "config.json")], tools=(compass,)) == 0
    assert capsys.readouterr().out == "towards 90\n"
    told = parameters.describe(compass)["parameters"][0]
    assert (told["kind"], told["widget"], told["direction"], told["section"]) == (
        "compass",
        "text",
        "setting",
        "Parameters",
    )
    assert any("| `--towards` | Where it points |" in row for row in options.rows([*compass.parameters()]))


def test_a_kind_that_is_invalid_is_refused_where_it_is_declared():
    with pytest.raises(ValueError, match="no kind of parameter is called 'numbre'"):
        tool.ask("numbre", "Diameter")


def test_the_kinds_stand_in_their_table_alone():
    """Except for QGIS's widgets, which are named after the kinds that they are made for, no file names a kind."""
    functions = set(
        re.findall(r'ask\(\s*"(\w+)"', (ROOT / "algorithms/deadwood_algorithms/params/tool.py").read_text())
    )
    assert functions <= set(KINDS)
    for path in sorted((ROOT / "deadwood_toolbox").rglob("*.py")):
        assert not re.search(r"""\bkind("\])? *(==|!=|in) """, path.read_text(encoding="utf-8")), path


def test_the_plugin_has_a_widget_for_every_kind():
    source = (ROOT / "deadwood_toolbox/qgis_plugin/definitions.py").read_text(encoding="utf-8")
    table = source[source.index("WIDGETS: ") :]
    widgets = set(re.findall(r'^    "(\w+)":', table, flags=re.MULTILINE))
    assert {each.widget or name for name, each in KINDS.items()} == widgets
    assert {field.name for field in fields(Kind)} >= {"metavar", "from_text", "check", "widget"}
