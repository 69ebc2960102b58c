"""Idiom that readers stumbled over does not come back: in help, messages, dialogs, pages, docstrings and comments."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = ("algorithms", "benchmarks", "deadwood_toolbox", "docs", "engine", "packaging", "sample_data")
# What was written, and what is said instead; each stood in a text of this repository.
IDIOM = {
    r"\bhangs? on\b": "depends on; most influential input",
    r"\bmend(s|ed|ing)?\b": "fix",
    r"\bgoes before\b": "overrides",
    r"\bis told\b": "reported, warned",
    r"\bworth less than nothing\b": "negative effect",
    r"\bnames some\b": "give them with --OPTION",
    r"\bin a row before\b": "in an earlier row",
    r"\bnone in sight\b": "unknown",
    r"\bof equals the first\b": "if several have, the first of them",
    r"\bcalled by their rows\b": "named by their rows",
    r"\bas far as they were seen\b": "up to where they left",
    r"\bcannot be looked into\b": "cannot be inspected",
    r"\bmore than nothing\b": "positive",
    r"\bbrings? it along\b": "contains it",
    r"\bread whole;": "read completely",
    r"\bget it again\b": "get a new copy",
    r"\bnowhere on Earth\b": "not on Earth",
    r"\bnowhere near the area\b": "far outside the area of use",
    r"\bput (it|that) back\b": "restore it",
    r"\bis of the run\b": "belongs to the run",
}
# The engine's texts are part of its digest: changing one makes every measured page one of another engine.
LATER = {"engine/deadwood_engine/scene.py", "engine/deadwood_engine/slide.py"}


def texts() -> list[Path]:
    found = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    for folder in PLACES:
        found += [
            each for each in (ROOT / folder).rglob("*") if each.suffix in (".py", ".md", ".js", ".html", ".ipynb")
        ]
    return [each for each in found if not {"_build", "__pycache__"} & set(each.parts)]


@pytest.mark.parametrize("pattern", IDIOM)
def test_no_text_has_the_idiom(pattern):
    idiom = re.compile(pattern.replace(" ", r"\s+"))
    places = [
        f"{path.relative_to(ROOT)}: '{found[0]}' (say: {IDIOM[pattern]})"
        for path in texts()
        if path.relative_to(ROOT).as_posix() not in LATER
        for found in idiom.finditer(path.read_text(encoding="utf-8"))
    ]
    assert places == []


def test_no_docstring_has_the_seam_of_two_strings():
    """Six were once broken into two lines like an expression, quotation marks included."""
    seam = re.compile(r'^\s+f?"[^"]+"""$', re.M)
    places = [path for path in texts() if path.suffix == ".py" and seam.search(path.read_text(encoding="utf-8"))]
    assert places == []


def test_the_changelog_says_nothing_twice():
    """A merge once left two wordings of one entry: runs of words that stand in two entries are one entry twice."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    entries = [re.findall(r"[\w`.-]+", each) for each in re.split(r"\n- ", text)]
    first: dict[tuple[str, ...], int] = {}
    twice = set()
    for number, words in enumerate(entries):
        for k in range(len(words) - 11):
            run = tuple(words[k : k + 12])
            if first.setdefault(run, number) != number:
                twice.add(" ".join(run))
    assert twice == set()
