"""The engine of each measured page, how far it is behind the present one, and the notice of this on the page.

python -m benchmarks.engines    after an edit of the engine: engines.txt and the pages' first lines

A measured page names the digest of the engine's sources with which it was measured. ``engines.txt`` lists those
engines in order, the present one last. A page is as many engines behind as lines follow its own (if it names several
engines, that of the oldest). An engine in between with which no page was measured is dropped from the list when the
next one comes: ten edits in a day count as one engine, measuring and editing again as two. A page that is
one behind states this in its first line; one that is two behind must be measured again, which a test requires.
"""

from __future__ import annotations

import datetime
import re
from pathlib import Path

from . import study

ROOT = Path(__file__).parents[1]
LIST = Path(__file__).with_name("engines.txt")
STUDY = "benchmarks/README.md"  # states it in its own first line (page.stale)
PAGES = (
    "docs/paper.md",
    "docs/memory.md",
    "docs/rare.md",
    "docs/region.md",
    "benchmarks/promise.md",
    "benchmarks/population.md",
    STUDY,
)
NAMED = re.compile(r"\b(?:engine|sources) ([0-9a-f]{16})\b")
ALIKE = re.compile(r"^- \*\*the engine of sources .*$", re.MULTILINE)  # as written by ``page``, from ``same_bits``
NOTICE = re.compile(r"\A(# [^\n]*\n)(?:\n> \*\*Measured with another engine\*\*[^\n]*\n)?")


def listed(text: str) -> list[str]:
    """Digests in their order."""
    return [line.split()[0] for line in text.splitlines() if line and not line.startswith("#")]


def named_by(page: str) -> set[str]:
    """Engines with which a page was measured, without those in the notice, or that give the same bits as one of
    these."""
    return set(NAMED.findall(ALIKE.sub("", NOTICE.sub(r"\1", page))))


def behind(page: str, engines: list[str]) -> int:
    """Number of engines by which a page is behind the last of the list."""
    unknown = named_by(page) - set(engines)
    if unknown or not named_by(page):
        names = ", ".join(sorted(unknown)) or "no engine"
        raise ValueError(f"a measured page names {names}; engines.txt does not: python -m benchmarks.engines")
    return len(engines) - 1 - min(engines.index(each) for each in named_by(page))


def noted(page: str, engines: list[str] | None = None) -> str:
    """The page with its notice, by the list of the repository unless another is given."""
    engines = engines or listed(LIST.read_text(encoding="utf-8"))
    how = behind(page, engines)
    oldest = min(named_by(page), key=engines.index)
    count = "the one before today's" if how == 1 else f"{how} before today's"
    said = f"\n> **Measured with another engine** (sources {oldest}, {count}): today's may give other figures.\n"
    return NOTICE.sub(lambda found: found[1] + (said if how else ""), page, count=1)


def with_today(text: str, today: str, pages: list[str], day: str) -> str:
    """The list with the present engine as the last; a former last one that no page names was never measured and is
    dropped.
    """
    lines = text.splitlines()
    if listed(text)[-1] == today:
        return text
    if listed(text)[-1] not in set().union(*map(named_by, pages)):
        lines.pop()
    return "\n".join([*(line for line in lines if not line.startswith(today)), f"{today} {day}"]) + "\n"


def update() -> dict[str, int]:
    """The list with the present engine, and every page with its notice; by page, how many engines it is behind."""
    places = {name: ROOT / name for name in PAGES}
    pages = {name: place.read_text(encoding="utf-8") for name, place in places.items()}
    before = LIST.read_text(encoding="utf-8")
    text = with_today(before, study.measured_as(), list(pages.values()), datetime.date.today().isoformat())
    if text != before:
        LIST.write_text(text, encoding="utf-8")
    for name, page in pages.items():
        now = noted(page, listed(text))
        if now != page and name != STUDY:
            places[name].write_text(now, encoding="utf-8")
    return {name: behind(page, listed(text)) for name, page in pages.items()}


def write(place: Path, page: str) -> None:
    """Write a page that was measured, and what follows for the list and the other pages."""
    place.write_text(page, encoding="utf-8")
    update()


def main() -> None:
    for name, how in update().items():
        print(f"{how} behind: {name}")


if __name__ == "__main__":
    main()
