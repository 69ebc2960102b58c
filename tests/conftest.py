"""What every test shares: the same examples on every run, and no other program's GDAL and PROJ paths."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

from deadwood_toolbox.environment import drop_foreign_paths

drop_foreign_paths(os.environ)
settings.register_profile("house", deadline=None, derandomize=True)
settings.load_profile("house")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--kills", type=int, default=5, help="how often a run of slide-logs is killed and resumed")
