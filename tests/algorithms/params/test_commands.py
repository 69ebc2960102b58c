"""Commands as they are typed."""

from __future__ import annotations

import shlex
import subprocess

import pytest

from deadwood_algorithms.params.commands import command_line, following, quoted
from deadwood_algorithms.scene.default_log import DEFAULTED
from deadwood_algorithms.tools import sample_releases, slide_logs, vary


def test_a_command_says_what_was_given_as_a_shell_reads_it():
    said = command_line("vary", {"dem": "my dem.tif", "trees": None, "friction": 0.25, "break_trees": True, "plan": 1})
    assert shlex.split(said) == [
        "deadwood-tool", "vary", "--dem", "my dem.tif", "--friction", "0.25", "--break-trees"
    ]  # fmt: skip
    assert command_line("site-barriers", {"above_m": (10.0, 20.5)}) == "deadwood-tool site-barriers --above-m 10.0,20.5"
    assert command_line("slide-logs", {"overwrite": True, "resume": True}) == "deadwood-tool slide-logs"


def test_what_two_tools_share_goes_on_but_no_default_and_no_output():
    ask = vary.Ask(
        dem="d.tif", releases="r.gpkg", friction="0.3", rolling_friction=0.05, trees="t.csv", output="varied"
    )
    said = shlex.split(following(slide_logs.TOOL, ask, fidelity=None, output="run"))
    assert said == [
        "deadwood-tool", "slide-logs", "--dem", "d.tif", "--releases", "r.gpkg", "--trees", "t.csv",
        "--friction", "0.3", "--rolling-friction", "0.05", "--output", "run",
    ]  # fmt: skip


def test_values_stand_in_place_of_what_was_given():
    ask = vary.Ask(dem="d.tif", releases="r.gpkg", friction=0.3, seed=4, output="varied")
    assert following(sample_releases.TOOL, ask, **dict.fromkeys(DEFAULTED), areas="a.gpkg", output="r.gpkg") == (
        "deadwood-tool sample-releases --areas a.gpkg --dem d.tif --seed 4 --output r.gpkg"
    )


@pytest.mark.parametrize(
    "word",
    ["my dem.tif", r"C:\my slopes\dem.tif", "C:\\my slopes\\", 'a "b" c', r'a b\\"c', "two  blanks", 'x \\\\" y'],
)
def test_a_word_with_blanks_is_quoted_on_windows_as_programs_there_read_it(word):
    """`subprocess` writes command lines by the same rules."""
    assert quoted(word, windows=True) == subprocess.list2cmdline([word])


def test_what_cmd_would_take_as_its_own_is_in_double_quotes():
    assert quoted("sample.gpkg|layername=dams", windows=True) == '"sample.gpkg|layername=dams"'
    assert quoted("(* 0.3048 (read 1))", windows=True) == '"(* 0.3048 (read 1))"'
    assert quoted("0.2,0.3", windows=True) == '"0.2,0.3"'  # PowerShell would make two words of it
    assert quoted("", windows=True) == '""'
    assert quoted(r"C:\slopes\dem_1.tif", windows=True) == r"C:\slopes\dem_1.tif"
    assert quoted("sample.gpkg|layername=dams", windows=False) == "'sample.gpkg|layername=dams'"
