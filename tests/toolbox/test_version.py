"""One version, in one place: packages, citation and messages agree."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from deadwood_algorithms.params.tool import VERSION

ROOT = Path(__file__).parents[2]


def test_the_package_takes_its_version_from_the_vocabulary():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in project["project"]
    assert project["project"]["dynamic"] == ["version"]
    source = ROOT / project["tool"]["hatch"]["version"]["path"]
    assert re.findall(r'^VERSION = "([^"]+)"', source.read_text(encoding="utf-8"), re.MULTILINE) == [VERSION]


def test_the_changelog_begins_with_this_version():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (\d\S*)", text, re.MULTILINE)[0] == VERSION


def test_the_plugin_is_packed_with_this_version():
    text = (ROOT / "deadwood_toolbox" / "qgis_plugin" / "metadata.txt").read_text(encoding="utf-8")
    assert "\nversion=VERSION\n" in text  # plugin_zip fills it in, which its own test checks


@pytest.mark.skipif(not (ROOT / "CITATION.cff").exists(), reason="nothing is cited yet")
def test_what_is_cited_is_this_version():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: \"?([^\"\n]+)", text, re.MULTILINE) == [VERSION]
