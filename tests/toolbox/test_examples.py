"""The worked examples in the tools' descriptions: they are in the help as typed, and they run."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from deadwood_algorithms.params.tool import Tool
from deadwood_toolbox import cli
from deadwood_toolbox.shelf import TOOLS

ROOT = Path(__file__).parents[2]


def commands(description: str) -> list[list[str]]:
    """The indented commands of a description, continued lines joined, split as a shell does; without the name."""
    indented = "\n".join(line[4:] for line in description.splitlines() if line.startswith("    "))
    lines = [line for line in indented.replace("\\\n", " ").splitlines() if line.startswith("deadwood-tool ")]
    return [shlex.split(line)[1:] for line in lines]


# Examples that need only the sample data; the others are like commands of the guides.
FIRST = {tool.name: " ".join(commands(tool.description)[0]) for tool in TOOLS if commands(tool.description)}
WHOLE = [
    tool for tool in TOOLS if tool.name in FIRST and (tool.group == "Prepare" or "sample_data" in FIRST[tool.name])
]


@pytest.mark.parametrize(
    "tool",
    [pytest.param(tool, marks=[pytest.mark.slow] if tool.group != "Prepare" else []) for tool in WHOLE],
    ids=lambda tool: tool.name,
)
def test_the_examples_of_a_tool_run_in_an_empty_folder(tool: Tool, tmp_path: Path, monkeypatch, capsys):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    for command in commands(tool.description):
        assert cli.run(command) == 0, capsys.readouterr().err


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_the_help_keeps_examples_and_lists_within_80_columns(tool: Tool, capsys):
    assert cli.run([tool.name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert [line for line in shown.splitlines() if len(line) > 80] == []
    told = "\n".join(line.removeprefix("  ") for line in shown.splitlines())
    assert commands(told)[: len(commands(tool.description))] == commands(tool.description)
    items = [line for line in tool.description.splitlines() if line.startswith("- ")]
    assert [item for item in items if f"\n  {' '.join(item.split()[:4])}" not in shown] == []


def test_the_examples_use_flags_that_exist():
    """Including examples with names of the user's own files."""
    by_name = {tool.name: list(tool.parameters()) for tool in TOOLS}
    examples = {tool.name: commands(tool.description) for tool in TOOLS if commands(tool.description)}
    wrong: dict[str, object] = {
        tool: "no example of its own" for tool, found in examples.items() if tool not in [each[0] for each in found]
    }
    for tool, found in examples.items():
        for name, *words in found:
            given = {word for word in words if word.startswith("--")}
            if words and not words[0].startswith("--"):
                given |= {each.flag for each in by_name[name] if each.positional}
            needed = {each.flag for each in by_name[name] if each.default is None and not each.optional}
            if strange := (given - {each.flag for each in by_name[name]}) | (needed - given):
                wrong[f"{tool}: {name}"] = strange
    assert len(examples) > 10
    assert wrong == {}


def test_the_reading_of_examples():
    text = (
        "Does this.\n\n    deadwood-tool a --b 'c d' \\\n        --e f\n    deadwood-tool g\n\nNot: deadwood-tool h\n"
    )
    assert commands(text) == [["a", "--b", "c d", "--e", "f"], ["g"]]
