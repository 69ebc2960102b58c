"""Every tool on the shelf: its declaration is complete, and the command line made of it works."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from deadwood_algorithms.params.kinds import KINDS
from deadwood_algorithms.params.tool import Parameter, Tool, check_value, manifest
from deadwood_toolbox import cli, parameters
from deadwood_toolbox.catalogue import PLACE, page
from deadwood_toolbox.shelf import TOOLS, declared, find

NAMES = [
    "list-presets",
    "assess-mobilisation",
    "sample-releases",
    "import-trees",
    "generate-forest",
    "windthrow",
    "add-structures",
    "make-log",
    "slide-logs",
    "run-sites",
    "count-hits",
    "reach-lines",
    "design-values",
    "value-trees",
    "site-barriers",
    "map-intensity",
    "map-origins",
    "lateral-spread",
    "fit-flight",
    "compare-scenarios",
    "calibrate-friction",
    "compare-fidelity",
    "vary",
    "make-report",
    "view",
    "check",
    "reproduce-paper",
    "warm-up",
    "demo",
]
UNITS = {
    "_kg_m3": {"kg/m³"},
    "_per_ha": {"1/ha"},
    "_cm": {"cm"},
    "_ms": {"m/s"},
    "_deg": {"°"},
    "_kj": {"kJ"},
    "_m": {"m"},
    "_s": {"s"},
}
# Flags that the contract (section 4) names without their unit.
UNIT_LEFT_OUT = {"time_step", "time_limit", "station_spacing", "rest_speed", "min_runout"}
every_tool = pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)


def unit_of_name(name: str) -> set[str]:
    """The unit that a parameter's name ends with, in the spellings that may be declared; empty without one."""
    return next((spelt for ending, spelt in UNITS.items() if name.endswith(ending)), set())


def flaws(parameter: Parameter) -> list[str]:
    """What is wrong with the declaration of one parameter."""
    found = []
    if parameter.kind not in KINDS:
        found.append(f"unknown kind {parameter.kind}")
    if not parameter.label or parameter.label != parameter.label.strip() or parameter.label.endswith("."):
        found.append(f"label '{parameter.label}'")
    if parameter.help and not parameter.help.endswith((".", "!", "?")):
        found.append("help is not a sentence")
    named = unit_of_name(parameter.name)
    if named and parameter.kind in ("number", "integer") and parameter.unit not in named:
        found.append(f"unit '{parameter.unit}' but the name says {sorted(named)}")
    units_of_names = set().union(*UNITS.values())
    if parameter.unit in units_of_names and not named and parameter.name not in UNIT_LEFT_OUT:
        found.append(f"unit '{parameter.unit}' is missing in the name")
    if parameter.kind == "choice" and len(parameter.choices) < 1:
        found.append("no choices")
    if parameter.kind == "vector" and not set(parameter.geometry) <= {"point", "line", "polygon"}:
        found.append(f"geometry {parameter.geometry}")
    if (parameter.kind == "field") != (parameter.name.endswith("_field") or parameter.name == "by"):
        found.append("a field of a layer is declared by tool.field_of and has a name that ends with _field")
    if parameter.default is not None:
        try:
            check_value(parameter, parameter.default)
        except Exception as error:
            found.append(f"default: {error}")
    return found


def test_the_shelf_holds_the_tools_of_the_contract():
    assert [tool.name for tool in TOOLS] == NAMES
    assert find("slide-logs") in TOOLS
    assert find("slide-log") is None


@every_tool
def test_the_declaration_is_complete(tool: Tool):
    assert tool.group in ("Prepare", "Simulate", "Evaluate")
    assert tool.summary
    assert "\n" not in tool.summary
    assert len(tool.description) > 80
    assert {p.name: flaws(p) for p in tool.parameters() if flaws(p)} == {}
    names = {p.name for p in tool.parameters()}
    layers = {p.name for p in tool.parameters() if p.kind in ("vector", "table")}
    assert {p.parent for p in tool.parameters() if p.kind == "field"} <= layers
    # One writes into the run that it shows, the second nothing, the third into the cache.
    if tool.name not in ("view", "check", "warm-up"):
        assert any(p.is_output for p in tool.parameters())
        assert "overwrite" in names
    assert not names & {"config", "progress", "quiet", "verbose", "help", "version"}


@every_tool
def test_the_help_shows_every_flag(tool: Tool, capsys: pytest.CaptureFixture[str]):
    assert cli.run([tool.name, "--help"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert [p.flag for p in tool.parameters() if p.flag not in shown.out] == []


@every_tool
def test_the_description_is_json_and_says_the_same(tool: Tool, capsys: pytest.CaptureFixture[str]):
    assert cli.run(["describe", tool.name, "--json"]) == 0
    told = json.loads(capsys.readouterr().out, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
    assert [each["name"] for each in told["parameters"]] == [p.name for p in tool.parameters()]
    assert told["qgis_id"] == (
        "" if tool.name in ("view", "check", "warm-up", "demo") else "deadwood:" + tool.name.replace("-", "")
    )


@every_tool
def test_a_manifest_gives_the_same_ask_again(tool: Tool, tmp_path: Path):
    needed = {p.name: sample(p) for p in tool.parameters() if p.default is None and not p.optional}
    ask = parameters.ask_from(tool, needed)
    written = tmp_path / "manifest.json"
    written.write_text(json.dumps(manifest(tool, ask)))
    again = parameters.ask_from(tool, parameters.read_config(str(written), tool))
    assert manifest(tool, again) == manifest(tool, ask)  # with absolute paths, which mean the same from any folder


@every_tool
def test_without_its_required_flags_a_tool_says_which(tool: Tool, capsys: pytest.CaptureFixture[str]):
    needed = [p for p in tool.parameters() if p.default is None and not p.optional]
    if not needed:
        return
    assert cli.run([tool.name]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert needed[0].flag in said


def sample(parameter: Parameter) -> object:
    """A value that passes the checks of a required parameter."""
    if parameter.kind in ("number", "integer"):
        low = parameter.minimum if parameter.minimum is not None else 0
        return int(low) + 1
    return parameter.choices[0] if parameter.kind == "choice" else "0.4"


def test_the_flaws_above_are_found():
    good = Parameter(kind="number", label="Diameter", name="dbh_cm", unit="cm", minimum=0, default=75.0)
    assert flaws(good) == []
    for change in (
        {"unit": "m"},
        {"name": "dbh"},
        {"label": ""},
        {"default": -1.0},
        {"kind": "numbre"},
        {"help": "no sentence"},
        {"name": "dbh_field", "kind": "text", "unit": ""},
    ):
        assert flaws(Parameter(**{**vars(good), **change})) != []


def test_the_catalogue_is_fresh():
    assert PLACE.read_text(encoding="utf-8") == page(TOOLS), "run: python -m deadwood_toolbox.catalogue"


def test_the_list_says_what_the_tools_say_without_importing_them():
    """``--help``, ``--version`` and ``list`` answer in 0.2 s; with numpy and every tool it was 0.6."""
    assert [(each.name, each.group, each.summary) for each in declared()] == [
        (tool.name, tool.group, tool.summary) for tool in TOOLS
    ]
    look = (
        "import sys; from deadwood_toolbox import cli; assert cli.run(sys.argv[1:]) == 0; "
        "assert 'numpy' not in sys.modules"
    )
    for words in (["--help"], ["--version"], ["list"], []):
        done = subprocess.run([sys.executable, "-c", look, *words], capture_output=True, text=True, check=True)
        assert done.stdout
