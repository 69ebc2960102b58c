"""``docs/tests.md``: every number names existing tests or the reason for having none, and tests name its numbers."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "tests.md").read_text(encoding="utf-8")
ROWS = {found[1]: found[0] for found in re.finditer(r"^\| (T\d\d[a-g]?) \|.*$", PAGE, flags=re.MULTILINE)}


def functions_of(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def test_each_number_names_tests_that_exist_or_says_why_not():
    functions = {path: functions_of(ROOT / path) for path in re.findall(r"`(tests/[\w/]+\.py)::\w+`", PAGE)}
    wrong = {}
    for number, row in ROWS.items():
        named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", row)
        missing = [each for each in named if each[1] not in functions[each[0]]]
        if missing or not (named or re.search(r"\| not (tested|a test)", row)):
            wrong[number] = missing or "names no test, and does not say why"
    assert wrong == {}


def test_no_number_is_left_out():
    assert {number[:3] for number in ROWS} == {f"T{k:02}" for k in range(1, 81)}


def test_tests_name_numbers_of_the_page_and_only_what_is_in_the_repository():
    strange = []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        strange += [f"{path}: {each}" for each in re.findall(r"\bT\d\d[a-g]?\b", text) if each not in ROWS]
    assert strange == []
