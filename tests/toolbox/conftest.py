"""The toy tool at the command line: in this process, and as a separate program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))  # importlib mode does not find siblings

import toy_tool  # noqa: E402

from deadwood_toolbox import cli  # noqa: E402


@dataclass(frozen=True)
class Ran:
    status: int
    out: str
    err: str

    @property
    def line(self) -> str:
        """The only line on standard error; fails unless there is exactly one."""
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        assert "Traceback" not in self.err
        return lines[0]

    @property
    def events(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.err.splitlines()]


@pytest.fixture
def toy(capsys: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    """Run a command line with the toy tool installed."""

    def run(*arguments: object) -> Ran:
        capsys.readouterr()
        status = cli.run([str(each) for each in arguments], tools=(toy_tool.TOOL,))
        captured = capsys.readouterr()
        return Ran(status, captured.out, captured.err)

    return run


@pytest.fixture(scope="session")
def checkout() -> dict[str, str]:
    """The environment of a program that is to find the packages of this checkout."""
    paths = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))
    return {**os.environ, "PYTHONPATH": paths}


@pytest.fixture
def start_toy(checkout: dict[str, str]) -> Callable[..., subprocess.Popen[str]]:
    """Start a command line with the toy tool installed, as a separate program."""

    def start(*arguments: object, stdout: Any = subprocess.PIPE, **more: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, str(HERE / "toy_tool.py"), *map(str, arguments)],
            env={**checkout, **more},
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=subprocess.PIPE,
            text=True,
        )

    return start
