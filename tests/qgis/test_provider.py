"""The provider in a real QGIS: every tool is there, with the parameters that its declaration promises."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from deadwood_algorithms.params.tool import VERSION
from deadwood_toolbox import parameters
from deadwood_toolbox.qgis_plugin.help_text import output_names
from deadwood_toolbox.shelf import TOOLS, find

IN_QGIS = [tool for tool in TOOLS if tool.in_qgis]


def numbered(group: str) -> str:
    """QGIS sorts the groups by name: in the order in which the command lists them, after the entries to begin with."""
    order = list(dict.fromkeys(tool.group for tool in TOOLS))
    return f"{order.index(group) + 2} · {group}"


@pytest.fixture(scope="module")
def listed(qgis) -> dict:
    ran = qgis("--json", "list")
    assert ran.status == 0, ran.err[-3000:]
    return ran.document["providers"]["deadwood"]


def test_every_tool_of_the_shelf_is_listed_in_its_group(listed):
    algorithms = listed["algorithms"]
    start = {"checkinstallation": "Check installation", "slopetoreport": "Slope to report"}
    start["starthere"] = "Begin: the demo slope"
    expected = {tool.qgis_id: (tool.label, numbered(tool.group)) for tool in IN_QGIS}
    expected |= {f"deadwood:{name}": (label, "1 · Start here") for name, label in start.items()}
    assert {name: (each["name"], each["group"]) for name, each in algorithms.items()} == expected
    assert listed["version"] == VERSION


# One start of QGIS for each; the tool with the most parameters, one with fields, one with several layers in its output.
@pytest.mark.parametrize("name", ["slide-logs", "import-trees", "reach-lines"])
def test_parameters_are_those_of_the_declaration(qgis, name):
    tool = find(name)
    assert tool is not None
    ran = qgis("--json", "help", tool.qgis_id)
    assert ran.status == 0, ran.err[-3000:]
    shown = ran.document["parameters"]
    folder = any(p.kind == "output_folder" and not p.optional for p in tool.parameters())
    for parameter in tool.parameters():
        if parameter.name == "overwrite" and not folder:
            assert "OVERWRITE" not in shown  # QGIS asks itself
            continue
        one = shown[parameter.name.upper()]
        assert one["description"].startswith(parameter.label)
        raw = one["raw_definition"]
        assert (parameter.unit in one["description"]) or not parameter.unit
        assert bool(int(raw["flags"]) & 2) == parameter.advanced
        assert bool(int(raw["flags"]) & 8) == (parameter.optional or parameter.kind == "number_or_layer")
        if parameter.unless:  # one of the two, so that neither is marked as optional
            assert raw["metadata"]["widget_wrapper"]["class"].endswith(".NumberOrLayer")
        if parameter.kind in ("number", "integer") and parameter.minimum is not None:
            assert float(raw["min"]) == parameter.minimum
        if parameter.kind == "choice":
            options = one["available_options"]  # by their numbers as text, so that 10 stands before 2
            assert [options[key] for key in sorted(options, key=int)] == list(parameter.choices)
        if parameter.kind == "field":
            assert raw["parent_layer"] == parameter.parent.upper()
    if name == "slide-logs":  # what a person asks first; the rest can be unfolded
        basic = [key for key, each in shown.items() if not int(each["raw_definition"]["flags"]) & 2]
        assert len(basic) <= 15
        assert {"DEM", "RELEASES", "TREES", "BARRIERS", "LINES", "FRICTION", "FIDELITY", "OUTPUT"} <= set(basic)
    assert set(output_names(parameters.describe(tool)).values()) <= set(ran.document["outputs"])


def test_the_dialog_explains(qgis):
    shown = " ".join(qgis("help", "deadwood:counthits").out.split())
    assert "Count from stored trajectories how many logs pass each cell" in shown
    assert "Default: the run's." in html.unescape(shown)


def test_the_check_tells_where_the_tool_is_and_what_it_works_with(qgis, tool):
    said = qgis.run("deadwood:checkinstallation", {}).results["REPORT"]
    assert str(tool) in said
    assert "numba" in said
    assert "All is well" in said


@pytest.mark.parametrize(
    ("place", "words"),
    [("nowhere/deadwood-tool", "DEADWOOD_TOOL names nowhere/deadwood-tool"), ("/bin/false", "not the toolbox")],
)
def test_a_missing_tool_is_reported_with_the_way_to_install_it(qgis, place, words):
    ran = qgis("run", "deadwood:checkinstallation", DEADWOOD_TOOL=place)
    assert ran.status == 1
    assert words in ran.err
    assert "-m venv .venv" in ran.err


def test_without_the_tool_the_algorithms_are_still_there_and_say_why_they_do_not_run(qgis, tmp_path: Path):
    out = tmp_path / "log"
    ran = qgis("run", "deadwood:makelog", "--", f"OUTPUT={out}", DEADWOOD_TOOL="nowhere")
    assert ran.status == 1
    assert "where there is no deadwood-tool" in ran.err
    assert not out.exists()


def test_a_toolbox_of_another_version_is_named_where_it_does_not_know_an_option(qgis, tmp_path: Path):
    """With both versions, and the way to make them the same; its version is asked once as long as it is the same."""
    other = tmp_path / "deadwood-tool"
    event = json.dumps({"event": "error", "message": "no such option: --new"})
    other.write_text(
        f'#!/bin/sh\ncase "$*" in --version*) echo asked >> {tmp_path}/asked; echo "deadwood-tool 9.9";; '
        f"*) echo '{event}' >&2; exit 2;; esac\n"
    )
    other.chmod(0o755)
    for _ in range(2):
        ran = qgis("run", "deadwood:makelog", "--", f"OUTPUT={tmp_path / 'log'}", DEADWOOD_TOOL=str(other))
        assert ran.status == 1
        assert f"Plugin {VERSION}, toolbox 9.9" in ran.out
        assert "no such option: --new" in ran.err
        assert f"The plugin has version {VERSION}, the toolbox 9.9; Plugins > Deadwood Toolbox > Set up" in ran.err
        assert "> Repair" in ran.err
    assert (tmp_path / "asked").read_text().split() == ["asked"]
    other.chmod(0o644)
    ran = qgis("run", "deadwood:makelog", "--", f"OUTPUT={tmp_path / 'log'}", DEADWOOD_TOOL=str(other))
    assert "could not be started" in ran.err
    assert "> Repair" in ran.err


def test_the_setting_overrides_the_variable(qgis, tool, tmp_path: Path):
    with settings(qgis, f"[deadwood]\nexecutable={tool.parent}\n"):
        ran = qgis("run", "deadwood:makelog", "--", f"OUTPUT={tmp_path / 'log'}", DEADWOOD_TOOL="nowhere")
    assert ran.status == 0, ran.err[-3000:]
    assert (tmp_path / "log" / "log.pts").exists()


@contextmanager
def settings(qgis, more: str) -> Iterator[None]:
    """The profile with more in its settings."""
    file = qgis.folder / "profile" / "profiles" / "default" / "QGIS" / "QGIS3.ini"
    before = file.read_text(encoding="utf-8")
    file.write_text(f"{before}\n{more}", encoding="utf-8")
    try:
        yield
    finally:
        file.write_text(before, encoding="utf-8")


def test_qgis_in_german_shows_the_tools_in_german(qgis):
    """By the name of Switzerland's German; what is typed stays, and what is wrong is reported in German, too."""
    with settings(qgis, "[locale]\noverrideFlag=true\nuserLocale=de_CH\n"):
        shown = qgis("--json", "help", "deadwood:slidelogs")
        panel = qgis("help", "deadwood:slidelogs")
        model = qgis("--json", "help", "deadwood:slopetoreport")
        wrong = qgis("run", "deadwood:makelog", "--", "OUTPUT=log", DEADWOOD_TOOL="nowhere")
    assert shown.status == 0, shown.err[-3000:]
    told = shown.document["algorithm_details"]
    assert (told["name"], told["group"]) == ("Stämme rutschen lassen", "3 · Simulieren")
    assert shown.document["parameters"]["FRICTION"]["description"] == "Reibungskoeffizient"
    labels = {name: each["description"] for name, each in model.document["parameters"].items()}
    assert (labels["slide:run"], labels["report:report"]) == ("Ordner des Laufs", "Bericht")
    assert "Eine Zahl, ein Raster oder Polygone mit einem Feld" in " ".join(html.unescape(panel.out).split())
    assert "DEADWOOD_TOOL nennt nowhere, doch dort ist kein deadwood-tool" in wrong.err
