"""The plugin's zip: what QGIS needs to install it, with the declarations of every tool, the same every time."""

from __future__ import annotations

import configparser
import gettext
import io
import json
import re
import sys
import zipfile
from email.message import Message
from pathlib import Path
from xml.etree import ElementTree

import pytest

from deadwood_algorithms.params.tool import VERSION
from deadwood_toolbox import cli, plugin_zip
from deadwood_toolbox.shelf import TOOLS


@pytest.fixture
def zipped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> zipfile.ZipFile:
    assert cli.run(["qgis-plugin", "--output", str(tmp_path / "deadwood.zip"), "--portable"]) == 0
    assert "Install from ZIP" in capsys.readouterr().out
    return zipfile.ZipFile(tmp_path / "deadwood.zip")


def test_the_zip_has_what_qgis_looks_for(zipped):
    assert {name.split("/")[0] for name in zipped.namelist()} == {"deadwood"}
    metadata = configparser.ConfigParser()
    metadata.read_file(io.TextIOWrapper(zipped.open("deadwood/metadata.txt"), encoding="utf-8"))
    general = metadata["general"]
    assert general["version"] == VERSION
    assert (general["qgisMinimumVersion"], general["qgisMaximumVersion"]) == ("3.22", "4.99")
    assert general["hasProcessingProvider"] == "yes"
    for name in ("name", "description", "about", "author", "license", "tags", "category"):
        assert general[name]
    assert not {"repository", "tracker", "homepage", "email"} & {name for name, value in general.items() if not value}
    assert zipped.read("deadwood/LICENSE").decode().startswith("BSD 3-Clause License")
    assert f"deadwood/{general['icon']}" in zipped.namelist()
    assert "def classFactory(" in zipped.read("deadwood/__init__.py").decode()
    for name in zipped.namelist():
        if name.endswith(".svg"):
            ElementTree.fromstring(zipped.read(name))


def test_the_zip_declares_every_tool_and_no_place_when_portable(zipped):
    manifest = json.loads(zipped.read("deadwood/manifest.json"))
    assert [each["name"] for each in manifest["tools"]] == [tool.name for tool in TOOLS]
    assert {f"{each['group'].lower()}.svg" for each in manifest["tools"]} <= {
        name.rpartition("/")[2] for name in zipped.namelist()
    }
    assert "packed_in" not in manifest
    assert {"words", "ramp", "stops", "colours", "friction"} <= set(manifest["explore"])


@pytest.mark.parametrize(("language", "group"), [("de", "Vorbereiten"), ("fr", "Préparer"), ("it", "Preparare")])
def test_the_zip_has_a_catalogue_of_each_language(zipped, language, group):
    """Read by the standard library, as the plugin does; what is not translated stays English."""
    packed = zipped.open(f"deadwood/locale/{language}/LC_MESSAGES/plugin.mo")
    texts = gettext.GNUTranslations(packed)
    assert texts.gettext("Prepare") == group
    assert texts.gettext("not in any catalogue") == "not in any catalogue"


def test_the_zip_is_the_same_every_time_and_knows_its_environment(tmp_path):
    for name in ("a.zip", "b.zip"):
        assert cli.run(["qgis-plugin", "--output", str(tmp_path / name), "--quiet"]) == 0
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.zip") as packed:
        assert json.loads(packed.read("deadwood/manifest.json"))["packed_in"] == sys.prefix


def test_a_zip_that_exists_is_not_replaced_unasked(tmp_path, capsys):
    place = tmp_path / "deadwood.zip"
    place.write_text("mine")
    assert cli.run(["qgis-plugin", "--output", str(place)]) == 2
    assert "--overwrite replaces it" in capsys.readouterr().err
    assert place.read_text() == "mine"
    assert cli.run(["qgis-plugin", "--output", str(tmp_path / "deadwood.gpkg")]) == 2


def test_versions_name_the_libraries_that_the_tools_load(capsys):
    assert cli.run(["--versions"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"deadwood-tool {VERSION}\n")
    for word in (sys.executable, "GDAL", "PROJ", "numba"):
        assert word in said


def test_what_plugins_qgis_org_asks_for_comes_from_the_package(tmp_path, monkeypatch, capsys):
    """Addresses are in pyproject.toml or nowhere."""
    told = Message()
    told["Author-email"] = "The Deadwood Toolbox authors <post@example.org>"
    told["Project-URL"] = "Repository, https://example.org/code"
    told["Project-URL"] = "Issues, https://example.org/issues"
    monkeypatch.setattr(plugin_zip.metadata, "metadata", lambda name: told)
    assert cli.run(["qgis-plugin", "--output", str(tmp_path / "full.zip")]) == 0
    assert "plugins.qgis.org" not in capsys.readouterr().err
    monkeypatch.setattr(plugin_zip.metadata, "metadata", lambda name: Message())
    assert cli.run(["qgis-plugin", "--output", str(tmp_path / "bare.zip")]) == 0
    said = capsys.readouterr().err
    assert "not ready for plugins.qgis.org: pyproject.toml names no email, repository, tracker" in said
    texts = []
    for name in ("full.zip", "bare.zip"):
        with zipfile.ZipFile(tmp_path / name) as packed:
            texts.append(packed.read("deadwood/metadata.txt").decode())
    lines = ["email=post@example.org", "repository=https://example.org/code", "tracker=https://example.org/issues"]
    assert texts[0].splitlines() == [*texts[1].splitlines(), *lines]


def test_what_the_panel_says_is_among_the_words_of_the_page():
    words = plugin_zip.declarations()["explore"]["words"]
    sources = "".join(each.read_text(encoding="utf-8") for each in plugin_zip.SOURCE.glob("explore_*.py"))
    said = set(re.findall(r"""\bsay\(["'](\w+)["']""", sources))
    said |= {
        "lost",
        "gained",
        *(f"verdict_{each}" for each in ("more", "less", "chance")),
        *(f"q_{each}" for each in ("dbh_cm", "length_m", "friction")),
    }
    assert len(said) > 20
    assert said <= set(words)
