"""What every test shares: the same examples on every run, no other program's GDAL and PROJ paths, and which tests have
nothing new to say.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import settings

from deadwood_toolbox.environment import drop_foreign_paths

drop_foreign_paths(os.environ)
settings.register_profile("house", deadline=None, derandomize=True)
settings.load_profile("house")

HERE = Path(__file__).parent
OF_THE_ENGINE = ("extremes", "physics")  # folders of tests that use the engine alone: their answers change only with it
PROVED = HERE / "proved.txt"  # the engine with which they passed last, written by ``python -m tests.proved``


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--kills", type=int, default=5, help="how often a run of slide-logs is killed and resumed")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of the engine alone that passed with this very engine, unless they are named."""
    alone = [each for each in items if folder_of(each.path) in OF_THE_ENGINE]
    if alone and not named(config.args, config.invocation_params.dir) and is_proved():
        items[:] = [each for each in items if folder_of(each.path) not in OF_THE_ENGINE]
        config.hook.pytest_deselected(items=alone)


def folder_of(path: Path) -> str:
    return next(iter(path.relative_to(HERE).parts), "") if path.is_relative_to(HERE) else ""


def named(arguments: Sequence[str], start: Path) -> bool:
    """Whether the command line names these folders, or what is in them."""
    return any(folder_of((start / each.partition("::")[0]).resolve()) in OF_THE_ENGINE for each in arguments)


def is_proved() -> bool:
    from deadwood_engine import engine_digest

    return PROVED.read_text(encoding="utf-8").split()[:1] == [engine_digest()]
