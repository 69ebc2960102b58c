"""What every test shares: the same examples on every run, no other program's GDAL and PROJ paths, and which tests have
nothing new to say.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

from deadwood_toolbox.environment import drop_foreign_paths
from tests import proofs

drop_foreign_paths(os.environ)
settings.register_profile("house", deadline=None, derandomize=True)
settings.load_profile("house")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--kills", type=int, default=5, help="how often a run of slide-logs is killed and resumed")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests of the engine alone, and leave out of a run of all tests those that are proved (``proofs``)."""
    for each in items:
        if folder_of(each.path) in proofs.ENGINE_FOLDERS:
            each.add_marker("engine_alone")
    if any(folder_of(argument(config, each)) for each in config.args) or config.option.markexpr:
        return
    proved = proofs.proved()
    gone = [each for each in items if any(each.get_closest_marker(marker) for marker in proved)]
    if gone:
        items[:] = [each for each in items if each not in gone]
        config.hook.pytest_deselected(items=gone)


def argument(config: pytest.Config, text: str) -> Path:
    return (config.invocation_params.dir / text.partition("::")[0]).resolve()


def folder_of(path: Path) -> str:
    """The folder or file below ``tests`` that a path leads into; empty for ``tests`` itself and elsewhere."""
    return next(iter(path.relative_to(proofs.HERE).parts), "") if path.is_relative_to(proofs.HERE) else ""
