"""Tests with nothing new to say: of the engine alone, and of the statistics, while what they test is what passed last.

Thousands of poses, logs and samples take a third of the time of all tests, and their answers change only with what they
test: the engine and its compiler, or the code that makes intervals of samples. ``python -m tests.proved`` runs them and
records what passed.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

HERE = Path(__file__).parent
RECORD = HERE / "proved.txt"  # a line a group: its name, the digest of what passed, the day
ENGINE_FOLDERS = ("extremes", "physics")
# What a marked test of the statistics may import of ours beside the engine; the files of the tests are counted too.
STATISTICS = tuple(f"algorithms/deadwood_algorithms/{each}" for each in ("stats", "evaluate"))
MARKERS = ("engine_alone", "statistics")


def digest_of(marker: str) -> str:
    """What the tests with a marker depend on, in 16 hexadecimal digits."""
    from deadwood_engine import engine_digest

    if marker == "engine_alone":
        return engine_digest()
    made = hashlib.sha256(engine_digest().encode())
    tests = [each for each in HERE.rglob("test_*.py") if f"mark.{marker}" in each.read_text(encoding="utf-8")]
    sources = [each for folder in STATISTICS for each in (HERE.parent / folder).rglob("*.py")]
    for each in sorted((*tests, *sources), key=lambda path: path.relative_to(HERE.parent).as_posix()):
        made.update(each.relative_to(HERE.parent).as_posix().encode() + b"\0" + each.read_bytes())
    return made.hexdigest()[:16]


def recorded() -> dict[str, str]:
    """The digest with which the tests of each marker passed last."""
    lines = RECORD.read_text(encoding="utf-8").splitlines()
    return {name: digest for name, digest, _ in (line.split() for line in lines)}


def proved() -> set[str]:
    """The markers whose tests have nothing new to say."""
    return {marker for marker, digest in recorded().items() if digest == digest_of(marker)}
