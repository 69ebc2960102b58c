"""Which tests a run of all leaves out: of the engine alone and of the statistics, while nothing of theirs changed."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest

from tests import conftest, proofs
from tests.proofs import ENGINE_FOLDERS, HERE, MARKERS, STATISTICS

OURS = re.compile(r"^\s*(?:from|import) (deadwood_\w+(?:\.\w+)*)", re.MULTILINE)


def files_of(marker: str) -> list[Any]:
    folders = ENGINE_FOLDERS if marker == "engine_alone" else ()
    marked = [each for each in HERE.rglob("test_*.py") if f"mark.{marker}" in each.read_text(encoding="utf-8")]
    return [*marked, *(each for folder in folders for each in (HERE / folder).glob("*.py"))]


def test_tests_of_the_engine_alone_import_nothing_else():
    files = files_of("engine_alone")
    assert len(files) > 30
    for each in files:
        modules = OURS.findall(each.read_text(encoding="utf-8"))
        assert {name.partition(".")[0] for name in modules} <= {"deadwood_engine"}, each


def test_what_is_simulated_is_counted_in_the_digest():
    """Each name that a test with this marker calls is of a room whose sources are counted."""
    rooms = {each.removeprefix("algorithms/").replace("/", ".") for each in STATISTICS}
    files = files_of("statistics")
    assert len(files) >= 3
    for each in files:
        modules = [name for name in OURS.findall(each.read_text(encoding="utf-8")) if "deadwood_algorithms." in name]
        assert any(name.startswith(room) for name in modules for room in rooms), each


@pytest.fixture
def record(tmp_path, monkeypatch):
    """A record that says for each marker whether what passed is what is here."""
    place = tmp_path / "proved.txt"
    monkeypatch.setattr(proofs, "RECORD", place)

    def write(**same: bool) -> None:
        lines = [f"{name} {proofs.digest_of(name) if same[name] else 'f' * 16} 2026-02-03" for name in MARKERS]
        place.write_text("\n".join(lines) + "\n")

    return write


def item(path: str, marker: str = "") -> Any:
    marks = {marker}
    return SimpleNamespace(path=HERE / path, add_marker=marks.add, get_closest_marker=lambda name: name in marks)


@pytest.mark.parametrize(
    ("arguments", "markers", "engine", "statistics", "left_out"),
    [
        ((), "", True, True, {1, 2, 3}),
        (("tests",), "", True, False, {1, 2}),
        (("tests",), "", False, True, {3}),
        (("tests",), "", False, False, set()),
        (("tests",), "statistics", True, True, set()),
        (("tests/extremes",), "", True, True, set()),
        (("tests/engine", "tests/physics/test_chute.py::test_x"), "", True, True, set()),
    ],
)
def test_they_run_after_a_change_or_where_they_are_named(arguments, markers, engine, statistics, left_out, record):
    record(engine_alone=engine, statistics=statistics)
    gone: list[Any] = []
    config: Any = SimpleNamespace(
        args=list(arguments),
        option=SimpleNamespace(markexpr=markers),
        invocation_params=SimpleNamespace(dir=HERE.parent),
        hook=SimpleNamespace(pytest_deselected=lambda items: gone.extend(items)),
    )
    every: list[Any] = [
        item("engine/test_step.py"),
        item("extremes/test_counts.py"),
        item("engine/test_bounds.py", "engine_alone"),
        item("algorithms/test_x.py", "statistics"),
    ]
    items = list(every)
    conftest.pytest_collection_modifyitems(config, items)
    assert items == [each for k, each in enumerate(every) if k not in left_out]
    assert gone == [each for k, each in enumerate(every) if k in left_out]


def test_a_source_of_the_statistics_changes_their_digest_alone(monkeypatch):
    before = {name: proofs.digest_of(name) for name in MARKERS}
    monkeypatch.setattr(proofs, "STATISTICS", (*STATISTICS, "algorithms/deadwood_algorithms/params"))
    assert proofs.digest_of("statistics") != before["statistics"]
    assert proofs.digest_of("engine_alone") == before["engine_alone"]
