"""A real QGIS for the tests: the packed plugin in a separate profile, with the toolbox's command.

Tests that need it are skipped where it is not installed (Debian: apt-get install qgis python3-qgis qgis-providers); set
DEADWOOD_QGIS=required to have its absence fail instead, as CI does.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shlex
import shutil
import stat
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from deadwood_toolbox import cli

ROOT = Path(__file__).parents[2]
SAMPLE = ROOT / "sample_data"
# Debian 12 wraps qgis_process in a shell script that 3.22 chokes on; the program itself is in the same folder.
PROGRAM = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
LIMIT_S = 240


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if PROGRAM or os.environ.get("DEADWOOD_QGIS") == "required":
        return
    for item in items:
        if Path(__file__).parent in item.path.parents and "qgis" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.skip(reason="QGIS is not installed"))


@pytest.fixture(scope="session")
def window() -> ModuleType:
    """``window.py``, which drives QGIS's window on a screen of its own."""
    if shutil.which("Xvfb") is None and os.environ.get("DEADWOOD_QGIS") != "required":
        pytest.skip("Xvfb is not installed")
    spec = importlib.util.spec_from_file_location("window", Path(__file__).with_name("window.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@dataclass(frozen=True)
class Ran:
    status: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """What ``qgis_process --json`` printed."""
        return json.loads(self.out)

    @property
    def results(self) -> dict[str, Any]:
        assert self.status == 0, self.err[-3000:]
        return self.document["results"]


class Qgis:
    """``qgis_process`` with the plugin, in a profile and a working folder of its own."""

    def __init__(self, folder: Path, tool: Path) -> None:
        self.folder, self.tool = folder, tool
        runtime = folder / "xdg"
        runtime.mkdir(mode=0o700)
        own = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "QGIS_PREFIX_PATH"}
        self.environment = {name: value for name, value in os.environ.items() if name not in own} | {
            "QT_QPA_PLATFORM": "offscreen",
            "GDAL_PAM_ENABLED": "NO",  # or GDAL leaves its statistics beside the sample
            "XDG_RUNTIME_DIR": str(runtime),
            "QGIS_CUSTOM_CONFIG_PATH": str(folder / "profile"),
            "QGIS_PLUGINPATH": str(folder / "plugins"),
            "DEADWOOD_TOOL": str(tool),
        }

    def install(self) -> None:
        """As a user does: pack the plugin with the command, unzip it among the plugins, switch it on."""
        package = self.folder / "deadwood.zip"
        assert cli.run(["qgis-plugin", "--output", str(package), "--quiet"]) == 0
        with zipfile.ZipFile(package) as packed:
            packed.extractall(self.folder / "plugins")
        settings = self.folder / "profile" / "profiles" / "default" / "QGIS" / "QGIS3.ini"
        settings.parent.mkdir(parents=True)
        settings.write_text("[PythonPlugins]\ndeadwood=true\nprocessing=true\n", encoding="utf-8")

    def __call__(self, *words: object, **more: str) -> Ran:
        assert PROGRAM is not None, "QGIS is not installed"
        ran = subprocess.run(
            [PROGRAM, *map(str, words)],
            env=self.environment | more,
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
        )
        return Ran(ran.returncode, ran.stdout, ran.stderr)

    def run(self, algorithm: str, parameters: Mapping[str, object]) -> Ran:
        return self("--json", "run", algorithm, "--", *(f"{name}={value}" for name, value in parameters.items()))


def command_of_checkout(folder: Path) -> Path:
    """A ``deadwood-tool`` that runs this checkout, like the script of an installed one."""
    script = folder / "deadwood-tool"
    paths = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))
    words = ["env", f"PYTHONPATH={paths}", sys.executable, "-m", "deadwood_toolbox"]
    script.write_text(f'#!/bin/sh\nexec {shlex.join(words)} "$@"\n', encoding="utf-8")
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    return script


@pytest.fixture(scope="session")
def tool(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return command_of_checkout(tmp_path_factory.mktemp("bin"))


@pytest.fixture(scope="session")
def qgis(tmp_path_factory: pytest.TempPathFactory, tool: Path) -> Qgis:
    made = Qgis(tmp_path_factory.mktemp("qgis"), tool)
    made.install()
    return made
