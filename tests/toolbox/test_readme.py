"""The README is short, and its commands are the ones that are tested and that CI runs; those of all pages exist."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from deadwood_toolbox.measured import filled
from deadwood_toolbox.plugin_zip import TOOL as QGIS_PLUGIN
from deadwood_toolbox.shelf import TOOLS, find

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted(page for part in ("start", "tutorials", "how-to") for page in (ROOT / "docs" / part).glob("*.md"))


def marked(name: str) -> str:
    """The command in the fence behind a marker."""
    found = re.search(rf"<!-- command: {name} -->\n```\n(.+?)\n```\n", README, flags=re.DOTALL)
    assert found is not None, name
    return found[1]


def said_commands() -> list[str]:
    """Every ``deadwood-tool`` command line of the README and of the site's own pages, continued lines joined."""
    joined = "\n".join([README, *(page.read_text(encoding="utf-8") for page in PAGES)]).replace("\\\n", " ")
    return re.findall(r"^ *(deadwood-tool (?:[a-z]+-)*[a-z]+(?: [^`\n]*)?)$", joined, flags=re.MULTILINE)


def test_the_readme_is_short_and_has_its_pictures():
    assert README.count("\n") <= 120
    pictures = re.findall(r"!\[[^\]]+\]\((docs/pictures/[a-z0-9_]+\.webp)\)", README)
    assert len(pictures) == 2
    assert all(10_000 < (ROOT / each).stat().st_size < 400_000 for each in pictures)


def test_the_commands_for_powershell_are_the_same():
    """Other names of the same programs, and ``;`` for ``&&``, which Windows PowerShell 5 does not know."""
    for name in ("demo", "tests"):
        told = marked(name).replace("python3 -m venv", "py -m venv").replace(" && ", "; ")
        assert marked(f"{name} in PowerShell") == re.sub(r"\.venv/bin/(\w)", r".venv\\Scripts\\\1", told)


def test_the_two_commands_are_one_line_each_and_stay_in_the_checkout():
    for name in ("demo", "tests"):
        command = marked(name)
        assert "\n" not in command
        assert command.startswith("python3 -m venv .venv && .venv/bin/pip install ")


def test_ci_takes_the_test_command_from_the_readme():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    pipeline = next(line for line in script.splitlines() if line.startswith("tests=$("))
    ran = subprocess.run(["bash", "-c", f'{pipeline}\nprintf %s "$tests"'], cwd=ROOT, capture_output=True, text=True)
    assert ran.stdout == marked("tests")
    assert marked("tests").endswith("-m pytest -n auto --dist loadfile")


def wrong_with(command: str) -> set[str]:
    """Words of a command line that are not flags of the tool, and flags that are missing."""
    name, *words = shlex.split(command)[1:]
    given = {word for word in words if word.startswith("--")}
    if name == "list":
        return given - {"--json", "--presets", "--events"}
    tool = QGIS_PLUGIN if name == QGIS_PLUGIN.name else find(name)
    if tool is None:
        return {f"no tool {name}"}
    unknown = given - {p.flag for p in tool.parameters()} - {"--help", "--config"}
    if given & {"--help", "--config"}:
        return unknown
    required = {p.flag for p in tool.parameters() if p.default is None and not p.optional}
    if words and not words[0].startswith("--"):
        given |= {p.flag for p in tool.parameters() if p.positional}
    return unknown | (required - given)


def test_every_command_line_of_the_pages_is_understood():
    assert {command: wrong for command in said_commands() if (wrong := wrong_with(command))} == {}


def test_the_guides_name_every_tool():
    assert len(said_commands()) >= 60
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert [tool.name for tool in TOOLS if tool.name not in text] == []


def test_units_of_the_page_are_those_of_the_declarations():
    units = {p.unit for tool in TOOLS for p in tool.parameters() if p.name.endswith(("_cm", "_m", "_ms", "_kg_m3"))}
    page = (ROOT / "docs" / "reference" / "units.md").read_text(encoding="utf-8")
    assert [unit for unit in units if not re.search(rf"\| {re.escape(unit)} \|", page)] == []


def test_the_measured_table_has_its_place_and_is_replaced_whole():
    once = filled(README, "demo", "reach  9.1 %\nold")
    twice = filled(once, "demo", "reach  8.0 %\\1")
    assert "reach  8.0 %\\1\n```" in twice
    assert "9.1 %\nold" not in twice
    assert twice.partition("<!-- measured")[0] == README.partition("<!-- measured")[0]
    assert twice.partition("<!-- end of measured")[2] == README.partition("<!-- end of measured")[2]
    with pytest.raises(SystemExit):
        filled(README, "nothing", "x")
