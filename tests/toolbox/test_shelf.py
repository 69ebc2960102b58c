"""Every installed tool: its declaration is complete, and the command line generated from it works."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import pytest

from deadwood_algorithms.params.kinds import KINDS
from deadwood_algorithms.params.manifest import manifest
from deadwood_algorithms.params.tool import Parameter, Tool, check_value
from deadwood_algorithms.scene.default_log import DEFAULTED
from deadwood_toolbox import cli, parameters
from deadwood_toolbox.shelf import TOOLS, declared, find

NAMES = [
    "inspect",
    "assess-mobilisation",
    "sample-releases",
    "import-trees",
    "find-trees",
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
    "break-trees",
    "site-barriers",
    "map-intensity",
    "map-origins",
    "age",
    "decide",
    "lateral-spread",
    "fit-flight",
    "compare-scenarios",
    "calibrate-friction",
    "compare-fidelity",
    "vary",
    "explore",
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
    "_years": {"years"},
}

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
    if parameter.unit in units_of_names and not named:
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


def incomplete(tool: Tool) -> list[str]:
    """What the declaration of a tool lacks."""
    declared = list(tool.parameters())
    names = {p.name for p in declared}
    layers = {p.name for p in declared if p.kind in ("vector", "table")}
    found = [f"{p.name}: {flaw}" for p in declared for flaw in flaws(p)]
    for holds, fault in (
        (tool.group in ("Prepare", "Simulate", "Evaluate"), f"group {tool.group}"),
        (tool.summary and "\n" not in tool.summary, "summary"),
        (len(tool.description) > 80, "description"),
        ({p.parent for p in declared if p.kind == "field"} <= layers, "a field of no layer"),
        (not names & {"config", "progress", "quiet", "verbose", "help", "version"}, "a name of the command line's own"),
        # one writes into the run that it shows, the second nothing, the third into the cache
        (tool.name in ("view", "check", "inspect", "warm-up") or any(p.is_output for p in declared), "no output"),
        (tool.name in ("view", "check", "inspect", "warm-up") or "overwrite" in names, "no overwrite"),
    ):
        if not holds:
            found.append(fault)
    return found


def test_every_declaration_is_complete():
    assert {tool.name: found for tool in TOOLS if (found := incomplete(tool))} == {}


def test_the_help_of_each_tool_shows_every_flag(capsys: pytest.CaptureFixture[str]):
    missing = {}
    for tool in TOOLS:
        assert cli.run([tool.name, "--help"]) == 0
        shown = capsys.readouterr()
        missing[tool.name] = [p.flag for p in tool.parameters() if p.flag not in shown.out] + shown.err.splitlines()
    assert {name: flags for name, flags in missing.items() if flags} == {}


def test_a_switch_that_says_no_is_undone_without_a_second_no(capsys: pytest.CaptureFixture[str]):
    """Before: ``--no-browser / --no-no-browser``."""
    assert [parameters.off(flag) for flag in ("--report", "--no-browser")] == ["--no-report", "--browser"]
    assert cli.run(["explore", "--help"]) == 0
    assert "--no-browser / --browser" in capsys.readouterr().out


def test_each_description_is_json_and_says_the_same(capsys: pytest.CaptureFixture[str]):
    other = []
    for tool in TOOLS:
        assert cli.run(["describe", tool.name, "--json"]) == 0
        told = json.loads(capsys.readouterr().out, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
        hidden = tool.name in ("explore", "view", "check", "warm-up", "demo")
        qgis_id = "" if hidden else "deadwood:" + tool.name.replace("-", "")
        if [each["name"] for each in told["parameters"]] != [p.name for p in tool.parameters()]:
            other.append((tool.name, "parameters"))
        if told["qgis_id"] != qgis_id:
            other.append((tool.name, told["qgis_id"]))
    assert other == []


@every_tool
def test_a_manifest_gives_the_same_ask_again(tool: Tool, tmp_path: Path):
    needed = {p.name: sample(p) for p in tool.parameters() if p.default is None and not p.optional}
    ask = parameters.ask_from(tool, needed)
    written = tmp_path / "manifest.json"
    written.write_text(json.dumps(manifest(tool, ask)))
    again = parameters.ask_from(tool, parameters.read_config(str(written), tool))
    assert manifest(tool, again) == manifest(tool, ask)  # with absolute paths, which mean the same from any folder


def test_without_its_required_flags_each_tool_says_which(capsys: pytest.CaptureFixture[str]):
    silent = {}
    for tool in TOOLS:
        needed = [p for p in tool.parameters() if p.default is None and not p.optional]
        if needed:
            status, said = cli.run([tool.name]), capsys.readouterr().err
            if status != 2 or said.count("\n") != 1 or needed[0].flag not in said:
                silent[tool.name] = said
    assert silent == {}


def sample(parameter: Parameter) -> object:
    """A value that passes the checks of a required parameter."""
    if parameter.kind in ("number", "integer"):
        low = parameter.minimum if parameter.minimum is not None else 0
        return int(low) + 1
    return parameter.choices[0] if parameter.kind == "choice" else "0.4"


def test_what_a_log_is_like_by_default_is_one_group_of_the_tools_that_slide():
    """Declared once: the same in each, one after the other, under a separate heading in the help."""
    groups = {}
    for tool in TOOLS:
        declared = list(tool.parameters())
        places = [k for k, p in enumerate(declared) if p.group]
        if places and tool.name != "assess-mobilisation":  # whose logs come from no layer
            assert places == list(range(places[0], places[0] + len(places)))
            groups[tool.name] = [dataclasses.replace(declared[k], old_names=()) for k in places]
    assert list(groups) == ["slide-logs", "run-sites", "calibrate-friction", "compare-fidelity", "vary", "explore"]
    first, *others = groups.values()
    assert [p.name for p in first] == list(DEFAULTED)
    assert all(each == first for each in others)


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


# These compose the command from the layers and results of the run (run by their own tests)
BY_THE_RUN = {
    "assess-mobilisation", "calibrate-friction", "compare-fidelity", "lateral-spread", "run-sites", "vary", "windthrow",
}  # fmt: skip


def test_the_command_that_follows_has_flags_that_exist_and_paths_that_the_tool_leaves():
    """The command that a tool prints last can be copied: its flags exist, all required ones, outputs by their names."""
    for tool in TOOLS:
        makes = any(each.is_output for each in tool.parameters()) and tool.name != "explore"  # its page tells
        known = makes and tool.name not in BY_THE_RUN
        assert bool(tool.then) == known, f"{tool.name}: each tool that leaves something says what mostly follows"
        if not known:
            continue
        program, name, *words = tool.then.format(**{each.name: "there" for each in tool.parameters()}).split()
        following = find(name)
        assert (program, following is not None) == ("deadwood-tool", True), tool.name
        assert following is not None
        flags = {each.flag: each for each in following.parameters()}
        given = {word for word in words if word.startswith("--")}
        assert given <= {*flags, "--help"}, tool.name
        required = {flag for flag, each in flags.items() if each.default is None and not each.optional}
        bare = {flag for flag, each in flags.items() if each.positional and not words[0].startswith("--")}
        assert given == {"--help"} or required - given - bare == set(), tool.name


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
