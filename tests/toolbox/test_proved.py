"""Which tests a run of all leaves out: those of the engine alone, while it is the one that they passed with."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from deadwood_engine import engine_digest
from tests import conftest
from tests.conftest import HERE, OF_THE_ENGINE


def test_tests_of_the_engine_alone_import_nothing_else():
    for folder in OF_THE_ENGINE:
        for each in (HERE / folder).glob("*.py"):
            text = each.read_text(encoding="utf-8")
            assert "deadwood_algorithms" not in text, each
            assert "deadwood_toolbox" not in text, each


@pytest.mark.parametrize(
    ("arguments", "recorded", "left_out"),
    [
        ((), "this one", True),
        (("tests",), "this one", True),
        (("tests",), "another", False),
        (("tests/extremes",), "this one", False),
        (("tests/engine", "tests/physics/test_chute.py::test_x"), "this one", False),
    ],
)
def test_they_run_with_another_engine_or_where_they_are_named(arguments, recorded, left_out, tmp_path, monkeypatch):
    record = tmp_path / "proved.txt"
    record.write_text(f"{engine_digest() if recorded == 'this one' else 'f' * 16} 2026-02-03\n")
    monkeypatch.setattr(conftest, "PROVED", record)
    gone: list[Any] = []
    hook = SimpleNamespace(pytest_deselected=lambda items: gone.extend(items))
    config: Any = SimpleNamespace(args=list(arguments), invocation_params=SimpleNamespace(dir=HERE.parent), hook=hook)
    names = ("engine/test_step.py", "extremes/test_counts.py", "physics/test_chute.py", "algorithms/test_x.py")
    items: Any = [SimpleNamespace(path=HERE / each) for each in names]
    conftest.pytest_collection_modifyitems(config, items)
    kept = [each.path.relative_to(HERE).as_posix() for each in items]
    assert kept == ([names[0], names[3]] if left_out else list(names))
    assert len(gone) == (2 if left_out else 0)
