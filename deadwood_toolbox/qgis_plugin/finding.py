"""Where the ``deadwood-tool`` command is: the setting, the variable DEADWOOD_TOOL, the PATH, then the usual folders."""

from __future__ import annotations

import json
import os
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsProcessingUtils, QgsSettings
from qgis.PyQt.QtCore import QProcessEnvironment

from .language import _

HERE = Path(__file__).parent
DISTRIBUTION = "deadwood-toolbox"
SETTING = "deadwood/executable"
VARIABLE = "DEADWOOD_TOOL"
TEMPORARY = "DEADWOOD_TEMPORARY"  # what is in it is saved with a run (as in files/kept_inputs.py, a test)
WINDOWS = sys.platform == "win32"
SCRIPT = "deadwood-tool.exe" if WINDOWS else "deadwood-tool"
BIN = "Scripts" if WINDOWS else "bin"
COMMANDS = (
    "    py -m venv .venv\n    .venv\\Scripts\\pip install .\n"
    if WINDOWS
    else "    python3 -m venv .venv && .venv/bin/pip install .\n"
)


def how_to_install() -> str:
    first = _(
        "The tools live in a Python environment of their own (Python 3.11 or newer), outside QGIS. The plugin makes "
        "it: menu Plugins > Deadwood Toolbox > Set up. Or in a terminal, in the folder of the toolbox:"
    )
    then = _(
        "Then name {script} of that environment in Settings > Options > Deadwood Toolbox, or put it on the PATH, or "
        "set the variable {variable}."
    )
    return f"{first}\n{COMMANDS}{then.format(script=f'{BIN}{os.sep}{SCRIPT}', variable=VARIABLE)}"


@dataclass(frozen=True)
class Found:
    """The command's words, and where they were found."""

    command: tuple[str, ...]
    how: str


@dataclass(frozen=True)
class Missing:
    why: str


def read_manifest() -> dict[str, Any]:
    """The tools' declarations, as ``deadwood-tool describe --json`` gave them when the plugin was packed."""
    return json.loads((HERE / "manifest.json").read_text(encoding="utf-8"))


def own_folder() -> Path:
    """The folder of the environment that the plugin makes (`environment_setup`), in QGIS's profile."""
    return Path(QgsApplication.qgisSettingsDirPath()) / DISTRIBUTION


def script_in(environment: Path) -> Path:
    return environment / BIN / SCRIPT


def find() -> Found | Missing:
    """The command to start, in the order of the search; a place named by the user is never skipped silently."""
    for place, how in ((QgsSettings().value(SETTING, ""), _("the setting")), (os.environ.get(VARIABLE, ""), VARIABLE)):
        if place:
            command = _command(Path(str(place)).expanduser())
            if command:
                return Found(command, how)
            wrong = _("{source} names {place}, where there is no {script}")
            return Missing(wrong.format(source=how, place=place, script=SCRIPT))
    own = _command(own_folder())
    if own:
        return Found(own, _("the plugin's own environment"))
    on_path = shutil.which("deadwood-tool")
    if on_path:
        return Found((on_path,), _("the PATH"))
    for folder in _usual_folders():
        command = _command(folder)
        if command:
            return Found(command, _("the usual folders"))
    return Missing(_("{script} was not found on the PATH, nor in the usual folders").format(script=SCRIPT))


def _command(place: Path) -> tuple[str, ...] | None:
    """The command behind a path: the script, a Python, or a folder that contains the script."""
    if place.is_dir():
        inside = (place / SCRIPT, place / BIN / SCRIPT, place / ".venv" / BIN / SCRIPT)
        return next(((str(each),) for each in inside if each.is_file()), None)
    if not place.is_file():
        return None
    if place.name.lower().startswith("python"):
        return (str(place), "-I", "-m", "deadwood_toolbox")
    return (str(place),)


def _usual_folders() -> list[Path]:
    """Folders of pip, pipx and uv, and the environment that packed this plugin, if recorded."""
    home = Path.home()
    local = Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    roaming = Path(os.environ.get("APPDATA", home / "AppData" / "Roaming"))
    tool = DISTRIBUTION
    folders = [Path(noted)] if (noted := read_manifest().get("packed_in")) else []
    folders += [home / ".local" / "bin", home / tool, home / tool / ".venv", home / ".venv", home]
    folders += [home / ".local" / "pipx" / "venvs" / tool, home / ".local" / "share" / "pipx" / "venvs" / tool]
    folders += [home / ".local" / "share" / "uv" / "tools" / tool]
    if WINDOWS:
        folders += [home / "pipx" / "venvs" / tool, local / "pipx" / "pipx" / "venvs" / tool]
        folders += [roaming / "uv" / "tools" / tool, roaming / "Python" / "Scripts"]
    else:
        folders += [Path("/opt/homebrew/bin"), Path("/usr/local/bin"), Path("/opt") / tool]
    return folders


def environment() -> QProcessEnvironment:
    """QGIS's environment variables without those that would mislead another Python and another GDAL."""
    clean = QProcessEnvironment.systemEnvironment()
    foreign = ("PROJ_LIB", "PROJ_DATA", "GDAL_DATA", "GDAL_DRIVER_PATH")
    for name in clean.keys():  # noqa: SIM118 (no mapping)
        if name in foreign or name.startswith("PYTHON"):
            clean.remove(name)
    clean.insert("PYTHONUTF8", "1")
    clean.insert(TEMPORARY, QgsProcessingUtils.tempFolder())
    clean.insert("DEADWOOD_STOP_WITH_STDIN", "1")  # the child ends when QGIS releases it, or dies
    return clean
