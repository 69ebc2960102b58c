"""Numbers with their nouns: the helper, and that messages use it: an f-string with a number before a plural noun gives
"1 trees"."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from deadwood_algorithms.params.counts import counted, none_of, significant, two_digits

ROOT = Path(__file__).parents[3]
NOUNS = (
    "areas|blocks|candidates|cells|columns|deposits|factors|features|files|flights|geometries|heights|"
    "holes|layers|lines|logs|others|places|polygons|releases|rows|runs|sites|snags|stems|threads|tops|trees|workers|zones"
)
PLURAL = re.compile(rf"^ (?:[a-z]+ ){{0,2}}(?:{NOUNS})\b")
# Before a number: "3 of 12 logs", "40 x 60 cells"; a number that is not a count, or is never 1.
PART_OF_ALL = re.compile(r"(?:\b(?:of|of the|of up to|x|the|with the|than) )$")
OTHER_LANGUAGES = {"report/phrases.py", "explore/phrases.py"}  # templates of the report and of the page of `explore`
NEVER_ONE = {
    ("rule.py", "logs"),  # two digits, rounded up from what decides
    ("origins.py", "len(areas)"),  # more than MOST_AREAS
    ("paired_runs.py", "len(folders)"),  # two or more runs are compared
    ("findings.py", "speeds.size"),  # the paper's runs have thousands of logs
    ("friction_findings.py", "first['n']"),
    ("findings.py", "_moving(of, 'als')"),
    ("sensitivity.py", "logs"),
    ("areas.py", "counts.max()"),  # more than any area may get
    ("allometry.py", "self.count"),  # no law is fitted to fewer than LEAST_TO_FIT trees
    ("dbh_filling.py", "both.sum()"),
    ("passages.py", "text"),  # "3 of 12"
    ("ground.py", "several"),  # words
    ("breaking.py", "rigid"),
    ("paired_runs.py", "why"),
    ("factor_runs.py", "words"),
    ("places.py", "len(found)"),
    ("own_slope.py", "record['logs']"),
    ("files.py", "kind.meaning"),  # words
}


@pytest.mark.parametrize(("number", "words"), [(0, "0 trees"), (1, "1 tree"), (2, "2 trees"), (1000, "1000 trees")])
def test_a_number_and_its_noun(number: int, words: str) -> None:
    assert counted(number, "tree") == words


def test_a_phrase_follows() -> None:
    assert [counted(n, "row has", "rows have") for n in (1, 3)] == ["1 row has", "3 rows have"]
    assert [none_of(n, "tree") for n in (1, 3)] == ["no tree", "none of the 3 trees"]


def spoken(tree: ast.AST) -> list[tuple[int, str, str, str]]:
    """For each f-string of a file: line, the words before a value, the value, the words after it."""
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.JoinedStr):
            continue
        before = ""
        for part, after in zip(node.values, [*node.values[1:], None], strict=True):
            if isinstance(part, ast.FormattedValue):
                words = after.value if isinstance(after, ast.Constant) else ""
                if part.format_spec is None:
                    found.append((node.lineno, before, ast.unparse(part.value), str(words)))
                before = ""
            elif isinstance(part, ast.Constant):
                before = str(part.value)
    return found


def test_no_message_says_1_trees() -> None:
    wrong = []
    for path in sorted((ROOT / "algorithms" / "deadwood_algorithms").rglob("*.py")):
        if str(path.relative_to(ROOT / "algorithms" / "deadwood_algorithms")) in OTHER_LANGUAGES:
            continue
        for line, before, value, after in spoken(ast.parse(path.read_text())):
            known = value.startswith(("counted(", "none_of(", "significant(")) or (path.name, value) in NEVER_ONE
            if PLURAL.search(after) and not PART_OF_ALL.search(before) and not known:
                wrong.append(f"{path.name}:{line}: ...{before[-25:]}{{{value}}}{after[:30]}")
    assert not wrong, "\n".join(wrong)


def test_the_scan_sees_them() -> None:
    code = "f\"{n} trees dropped; {k} of {n} trees, {a} x {b} cells, {counted(n, 'tree')} read, {m} dead trees\""
    seen = [
        value
        for _, before, value, after in spoken(ast.parse(code))
        if PLURAL.search(after) and not PART_OF_ALL.search(before)
    ]
    assert seen == ["n", "m"]


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(2.5e-5, 2, "0.000025"), (1234.5, 3, "1230"), (171.0, 2, "170"), (0.25, 3, "0.25"), (0.0, 2, "0"),
     (99.96, 3, "100"), (-0.0449, 2, "-0.045")],
)  # fmt: skip
def test_so_many_digits_without_an_exponent(value: float, digits: int, text: str) -> None:
    """Before: "2.5e-05 ha", "about 1.1e+02 logs", "1.2e+03 kJ"."""
    assert significant(value, digits) == text


def test_two_digits():
    assert [two_digits(value) for value in (7.2, 31.0, 1432.0, 1400.0, 99_500.0)] == [8, 31, 1500, 1400, 100_000]
