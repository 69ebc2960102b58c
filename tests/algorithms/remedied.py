"""Runs the commands that messages print."""

from __future__ import annotations

import contextlib
import re
import shlex
from pathlib import Path

from click.testing import CliRunner
from rasterio.rio.main import main_group


def carry_out(message: str, folder: Path) -> Path:
    """Run the command after ``fix`` in a message, in its folder; returns the last file that was made."""
    command = re.search(r"\b\S*rio'? .*", message, re.DOTALL)
    assert command, message
    text = re.split(r", (?:with|and) the?|, and take| \(if its| writes out", command[0])[0]
    last = folder
    for step in text.split(" && "):
        words = shlex.split(step.strip().rstrip(")") if step.count(")") > step.count("(") else step)
        assert Path(words[0]).name == "rio"
        with contextlib.chdir(folder):
            ran = CliRunner().invoke(main_group, words[1:])
        assert ran.exit_code == 0, (step, ran.output[-500:], ran.exception)
        last = folder / next(word for word in words[::-1] if word.endswith((".tif", ".geojson")))
    return last
