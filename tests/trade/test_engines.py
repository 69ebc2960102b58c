"""Every measured page is of the present engine or of the previous one, and states it in the latter case."""

from __future__ import annotations

import pytest

from benchmarks import engines, study

OLD, BEFORE, TODAY = "a" * 16, "b" * 16, "c" * 16
KNOWN = [OLD, BEFORE, TODAY]


def page_of(*named: str) -> str:
    return "# A page\n\nWhat was measured.\n\n" + "".join(f"- machine; engine {each}; 2026-11-25\n" for each in named)


def test_a_page_is_as_far_behind_as_the_oldest_engine_that_it_names() -> None:
    assert [engines.behind(page_of(*named), KNOWN) for named in ([TODAY], [BEFORE], [TODAY, OLD])] == [0, 1, 2]
    for wrong in (page_of(), page_of("d" * 16)):
        with pytest.raises(ValueError, match=r"engines\.txt does not"):
            engines.behind(wrong, KNOWN)


def test_a_page_of_another_engine_reports_it_in_its_first_line_and_one_of_todays_does_not() -> None:
    late = engines.noted(page_of(BEFORE), KNOWN)
    assert late.splitlines()[2].startswith(f"> **Measured with another engine** (sources {BEFORE}, the one before")
    assert engines.noted(late, KNOWN) == late
    assert "2 before today's" in engines.noted(late, [*KNOWN, "e" * 16])
    assert engines.noted(page_of(TODAY), KNOWN) == page_of(TODAY)
    renewed = late.replace(f"engine {BEFORE}", f"engine {TODAY}")
    assert engines.noted(renewed, KNOWN) == page_of(TODAY)


def test_an_engine_of_the_same_bits_is_none_that_a_page_was_measured_with() -> None:
    """benchmarks/README.md names it beside the measured one; an edit that keeps every bit does not outdate a page."""
    alike = (
        page_of(TODAY) + f"- **the engine of sources {'d' * 16} gives the same bits** as the measured one ({TODAY})\n"
    )
    assert engines.named_by(alike) == {TODAY}
    assert engines.noted(alike, KNOWN) == alike


def test_engines_that_no_page_was_measured_with_are_not_counted() -> None:
    """Ten edits in a day count as one engine; with a measurement in between, as two."""
    text = "# the list\n" + "".join(f"{each} 2026-11-25\n" for each in KNOWN)
    pages = [page_of(BEFORE), page_of(OLD)]
    once = engines.with_today(text, "d" * 16, pages, "2026-11-26")
    assert engines.listed(once) == [OLD, BEFORE, "d" * 16]
    assert engines.with_today(once, "d" * 16, pages, "2026-11-27") == once
    measured = engines.with_today(once, "e" * 16, [*pages, page_of("d" * 16)], "2026-11-28")
    assert engines.listed(measured) == [OLD, BEFORE, "d" * 16, "e" * 16]


def test_todays_engine_is_the_last_of_the_list() -> None:
    known = engines.listed(engines.LIST.read_text(encoding="utf-8"))
    assert known[-1] == study.measured_as(), "run: python -m benchmarks.engines"
    assert len(set(known)) == len(known)


@pytest.mark.parametrize("name", engines.PAGES)
def test_no_measured_page_is_more_than_one_engine_behind(name: str) -> None:
    known = engines.listed(engines.LIST.read_text(encoding="utf-8"))
    page = (engines.ROOT / name).read_text(encoding="utf-8")
    if name != engines.STUDY:
        assert engines.noted(page, known) == page, "run: python -m benchmarks.engines"
    assert engines.behind(page, known) <= 1, f"{name}: measure it again"
