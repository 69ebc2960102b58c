"""Which engine each measured page is of, how far that one is behind today's, and the words that say so on the page.

python -m benchmarks.engines    after an edit of the engine, or a measurement: engines.txt and the pages' first lines

A measured page names the digest of the engine's sources that it was measured with. ``engines.txt`` has those engines in
their order, and today's as the last. So a page is as many engines behind as lines follow its own (of several engines
that it names, the oldest's). An engine in between that no page was measured with is dropped from the list when the next
one comes: to edit the engine ten times in a day is one engine more, to measure and to edit again is two. A page that is
one behind says so in its first line; one that is two behind is to be measured again, which a test asks for.
"""

from __future__ import annotations

import datetime
import re
from pathlib import Path

from . import study

ROOT = Path(__file__).parents[1]
LIST = Path(__file__).with_name("engines.txt")
STUDY = "benchmarks/README.md"  # says it in its own first line (page.stale)
PAGES = ("docs/paper.md", "docs/memory.md", "docs/rare.md", "docs/region.md", "benchmarks/promise.md", STUDY)
NAMED = re.compile(r"\b(?:engine|sources) ([0-9a-f]{16})\b")
ALIKE = re.compile(r"^- \*\*the engine of sources .*$", re.MULTILINE)  # as ``page`` says it, of ``same_bits``
NOTICE = re.compile(r"\A(# [^\n]*\n)(?:\n> \*\*Measured with another engine\*\*[^\n]*\n)?")


def listed(text: str) -> list[str]:
    """Digests in their order."""
    return [line.split()[0] for line in text.splitlines() if line and not line.startswith("#")]


def named_by(page: str) -> set[str]:
    """Engines that a page was measured with; not those that the notice names, or that give the same bits as one of
    these."""
    return set(NAMED.findall(ALIKE.sub("", NOTICE.sub(r"\1", page))))


def behind(page: str, engines: list[str]) -> int:
    """By how many engines a page is behind the last of the list."""
    unknown = named_by(page) - set(engines)
    if unknown or not named_by(page):
        raise ValueError(f"a measured page names {', '.join(sorted(unknown)) or 'no engine'}; engines.txt does not")
    return len(engines) - 1 - min(engines.index(each) for each in named_by(page))


def noted(page: str, engines: list[str] | None = None) -> str:
    """The page with what its first line has to say, by the list of the repository unless another is given."""
    engines = engines or listed(LIST.read_text(encoding="utf-8"))
    how = behind(page, engines)
    oldest = min(named_by(page), key=engines.index)
    count = "the one before today's" if how == 1 else f"{how} before today's"
    said = f"\n> **Measured with another engine** (sources {oldest}, {count}): today's may give other figures.\n"
    return NOTICE.sub(lambda found: found[1] + (said if how else ""), page, count=1)


def with_today(text: str, today: str, pages: list[str], day: str) -> str:
    """The list with today's engine as the last; one that was the last and that no page names was never measured."""
    lines = text.splitlines()
    if listed(text)[-1] == today:
        return text
    if listed(text)[-1] not in set().union(*map(named_by, pages)):
        lines.pop()
    return "\n".join([*(line for line in lines if not line.startswith(today)), f"{today} {day}"]) + "\n"


def main() -> None:
    places = [ROOT / each for each in PAGES]
    pages = [place.read_text(encoding="utf-8") for place in places]
    today = study.measured_as()
    text = with_today(LIST.read_text(encoding="utf-8"), today, pages, datetime.date.today().isoformat())
    LIST.write_text(text, encoding="utf-8")
    for place, page in zip(places, pages, strict=True):
        now = noted(page, listed(text))
        if now != page and place != ROOT / STUDY:
            place.write_text(now, encoding="utf-8")
        print(f"{behind(page, listed(text))} behind: {place.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
