"""Every option named in a text of the code belongs to a command, or to another program that is named there.

A message that names an option under an outdated name is worse than none.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from deadwood_toolbox.commands import build
from deadwood_toolbox.shelf import OLD_NAMES, TOOLS, find

ROOT = Path(__file__).parents[2]
FOLDERS = ("algorithms/deadwood_algorithms", "deadwood_toolbox")
# but no property of a style sheet, --name:value
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*[a-z0-9](?![\w-]|:(?:\S|$))")
FOREIGN = {
    "pdal": ("--filters", "--writers"),
    "rio": (
        "--bounds", "--collection", "--dst-crs", "--dst-nodata", "--dtype", "--nodata", "--not-masked", "--profile",
        "--res", "--resampling", "--src-nodata", "--transform",
    ),
    "venv": ("--clear",),
    "pip": (
        "--disable-pip-version-check", "--no-compile", "--no-deps", "--no-input", "--prefer-binary", "--progress-bar",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def ours() -> set[str]:
    """The options of all commands, including negated ones and old names that still work."""
    old = [tool for name in OLD_NAMES if (tool := find(name))]
    shelf = build([*TOOLS, *old], TOOLS)
    options = [each for command in (shelf, *shelf.commands.values()) for each in command.params]
    names = {name for each in options for name in (*each.opts, *each.secondary_opts) if isinstance(each, click.Option)}
    return names | {"--help"}


def unknown_options(source: str, ours: set[str]) -> Iterator[tuple[int, str]]:
    """Line and name of each option in a source's texts, except comments, that no command has."""
    foreign = {name for program, names in FOREIGN.items() if re.search(rf"\b{program}\b", source) for name in names}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            for name in OPTION.findall(node.value):
                if name not in ours | foreign:
                    yield node.lineno, name


def test_every_option_in_a_text_is_one_of_a_command(ours):
    found = [
        f"{place.relative_to(ROOT)}:{row}: {name}"
        for folder in FOLDERS
        for place in sorted((ROOT / folder).rglob("*.py"))
        for row, name in unknown_options(place.read_text(encoding="utf-8"), ours)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("--dbh-units names the unit", ["--dbh-units"]),
        ("{where}: --dbh-unit names the unit; --old-flag too", ["--old-flag"]),
        ("--dbh-unit, --no-overwrite, --time-limit-s and --help", []),
        ("write --resampling bilinear", ["--resampling"]),  # of which program?
        ("rio warp --resampling bilinear", []),
        ("a dash -- and --{name}", []),
        ("a style of --own:3pt", []),
    ],
)
def test_a_wrong_option_is_found(ours, text, found):
    assert [name for _, name in unknown_options(f'say(f"{text}")', ours)] == found
