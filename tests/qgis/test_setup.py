"""The plugin makes the toolbox's environment: in QGIS's profile, without stopping QGIS, and whole or not at all."""

from __future__ import annotations

import json
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import pytest

from deadwood_algorithms.params.tool import VERSION
from deadwood_toolbox import cli

HERE = Path(__file__).parent
SYSTEM_PYTHON = "/usr/bin/python3"
NAME = f"deadwood_toolbox-{VERSION}"
# Answers of the wheel's command, like the toolbox's.
ANSWERS = """
import sys, time
def main():
    if "warm-up" in sys.argv:
        print('{{"event": "progress", "done": 1, "total": 2, "what": "compiling"}}', flush=True)
        time.sleep({seconds})
        return 0
    print("deadwood-tool {version}")
    return {status}
"""


def wheel(folder: Path, *, status: int = 0, seconds: float = 0.0) -> Path:
    """A wheel of the toolbox's name with no dependency."""
    folder.mkdir()
    record = f"{NAME}.dist-info"
    files = {
        "deadwood_answers.py": ANSWERS.format(version=VERSION, status=status, seconds=seconds),
        f"{record}/METADATA": f"Metadata-Version: 2.1\nName: deadwood-toolbox\nVersion: {VERSION}\n",
        f"{record}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{record}/entry_points.txt": "[console_scripts]\ndeadwood-tool = deadwood_answers:main\n",
    }
    files[f"{record}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{record}/RECORD"])
    place = folder / f"{NAME}-py3-none-any.whl"
    with zipfile.ZipFile(place, "w") as target:
        for name, text in files.items():
            target.writestr(name, text)
    return place


@pytest.fixture(scope="module")
def told(qgis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    work, wheels = tmp_path_factory.mktemp("work"), tmp_path_factory.mktemp("wheels")
    wheel(wheels / "good")
    wheel(wheels / "bad", status=1)
    wheel(wheels / "slow", seconds=60.0)
    words = [SYSTEM_PYTHON, HERE / "setup_inside.py", work, qgis.folder / "plugins", wheels]
    environment = {name: value for name, value in qgis.environment.items() if name != "DEADWOOD_TOOL"}
    environment |= {"QGIS_CUSTOM_CONFIG_PATH": str(work / "profile"), "PATH": "/usr/bin:/bin"}
    ran = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=280)
    assert "JSON{" in ran.stdout, ran.stderr[-3000:]
    return json.loads(ran.stdout.partition("JSON")[2])


def test_the_environment_is_made_and_found(told):
    made = told["made"]
    assert made["worked"], made["message"]
    assert made["message"] == "The toolbox is installed and ready."
    assert made["found"] == "the plugin's own environment"
    assert made["left"] == ["deadwood-toolbox"]
    assert made["percents"] == sorted(made["percents"])
    assert max(made["percents"]) > 80


def test_each_python_is_tried_in_order_and_has_its_line(told):
    """The first is too old, the second has no venv, the environment of the third does not start."""
    first, *lines = told["none_works"]["message"].splitlines()
    assert "can make the environment. Install one" in first
    assert ["old_python" in lines[0], "bare_python" in lines[1], "crooked_python" in lines[2]] == [True] * 3
    assert len(lines) == 3
    assert lines[2].endswith("starts: broken bundle")
    assert told["none_works"]["left"] == []
    assert told["the_next_one_works"]["worked"], told["the_next_one_works"]["message"]
    assert told["the_next_one_works"]["found"] == "the plugin's own environment"


def test_pip_goes_through_the_proxy_of_qgis(told):
    assert told["none_works"]["proxy"] == "http://a%20b:p@proxy.office:3128"


def test_nothing_is_in_progress_when_the_end_is_reported(told):
    """The window then shows the new state; before, it kept *Cancel* and "no environment" after an installation."""
    assert [name for name, outcome in told.items() if outcome["busy_at_its_end"]] == []


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("no_python", "is not a Python of version 3.11 or newer"),
        ("no_venv", "install the package python3-venv"),
        ("no_network", "The package index could not be reached"),
        ("not_in_the_index", f"Your package index has no deadwood-toolbox=={VERSION}"),
        ("cancelled_while_installing", "Cancelled; nothing was left behind"),
    ],
)
def test_what_cannot_be_made_is_reported_in_plain_words_and_leaves_nothing(told, case, words):
    outcome = told[case]
    assert not outcome["worked"]
    assert words in outcome["message"]
    assert outcome["left"] == []
    assert outcome["found"] != "the plugin's own environment"


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("cancelled_repair", "Cancelled; nothing was left behind"),
        ("broken_repair", "does not work"),
    ],
)
def test_a_repair_that_fails_gives_back_what_was_there(told, case, words):
    outcome = told[case]
    assert not outcome["worked"]
    assert words in outcome["message"]
    assert outcome["message"].endswith("The previous environment has been restored.")
    assert outcome["left"] == ["deadwood-toolbox"]
    assert outcome["found"] == "the plugin's own environment"


def test_a_broken_environment_is_repaired(told):
    assert told["repaired"]["worked"], told["repaired"]["message"]
    assert told["repaired"]["found"] == "the plugin's own environment"


def test_it_is_removed_whole(told):
    assert told["removed"]["worked"]
    assert told["removed"]["left"] == []


def test_qgis_continues_meanwhile(told):
    """Between two rounds of its events; starting a process and renaming a folder take a few hundredths of a second."""
    assert max(each["blocked_s"] for each in told.values()) < 1.0


def test_a_zip_may_bring_the_wheel_along(tmp_path, capsys):
    good = wheel(tmp_path / "good")
    place = tmp_path / "deadwood.zip"
    assert cli.run(["qgis-plugin", "--output", str(place), "--wheel", str(good), "--quiet"]) == 0
    with zipfile.ZipFile(place) as packed:
        assert packed.read(f"deadwood/wheels/{good.name}") == good.read_bytes()
    other = good.with_name("another-1.0-py3-none-any.whl")
    good.rename(other)
    assert cli.run(["qgis-plugin", "--output", str(place), "--wheel", str(other), "--overwrite"]) == 2
    assert f"must be a file deadwood_toolbox-{VERSION}-*.whl" in capsys.readouterr().err
