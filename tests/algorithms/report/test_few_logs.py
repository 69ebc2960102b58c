"""A run of 24 logs: no table, readout or map tip shows a percentile that so few logs cannot show."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest
from browser import Browser
from slope_case import Case, summary

from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.stats.order_statistics import values_needed
from deadwood_algorithms.tools import make_report

QUANTILE = re.compile(r"p05|p50|p95|p99|median|quantile|percentile", re.IGNORECASE)
TABLES = """[...document.querySelectorAll('table')].map((table) => ({
    caption: table.querySelector('caption')?.innerText ?? '',
    rows: [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent.trim())) }))"""


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    case = Case(tmp_path_factory.mktemp("few"))
    return case.run(**case.everything(), qgis_project=True)


def test_every_percentile_of_the_page_has_enough_logs(run, tmp_path):
    """Each column headed by a percentile, against the number of logs in its row or caption."""
    make_report.TOOL(runs=str(run), output=str(tmp_path / "page.html"))
    browser = Browser()
    try:
        browser.open(tmp_path / "page.html")
        tables = browser.ask(TABLES)
        titles = browser.ask(
            "[...document.querySelectorAll('svg title, [title]')].map((e) => e.textContent || e.title)"
        )
    finally:
        browser.close()
    shown = hidden = 0
    for each in tables:
        head = each["rows"][0]
        levels = {k: float(cell.split()[0]) / 100.0 for k, cell in enumerate(head) if re.fullmatch(r"\d+\s%", cell)}
        for row in each["rows"][1:] if levels else []:
            counted = re.search(r"logs: (\d+)", each["caption"])
            n = int(counted[1]) if counted else int(row[1]) if row[1].isdigit() else None
            for k, level in levels.items():
                if n is None or row[0].startswith("further arrivals"):
                    continue
                known = bool(re.match(r"[-−]?\d", row[k]))
                assert not (known and n < values_needed(level)), (each["caption"], row)
                shown, hidden = shown + known, hidden + (not known)
    assert shown
    assert hidden
    assert not any(QUANTILE.search(each) for each in titles)


def test_nothing_in_the_summary_has_too_few(run):
    """Only the medians of what was put in: sizes of logs, trees and barriers."""
    told = summary(run)
    assert told["speed"]["p95_ms"] is None
    assert all(each["p05_p95_deg"] is None and each["p05_p95_n_more"] > 0 for each in told["spread"])
    assert all(each["height_needed_p95_m"] is None for each in told["barriers"])


def test_no_map_tip_of_qgis_has_one(run):
    """A layer's tip is its name or id: no template is set, and the columns that are shown are no quantiles."""
    with zipfile.ZipFile(run / "project.qgz") as packed:
        project = next(packed.read(name).decode() for name in packed.namelist() if name.endswith(".qgs"))
    for text in (project, *(each.read_text(encoding="utf-8") for each in run.glob("*.qml"))):
        assert not re.findall(r"<mapTip[^>]*>[^<\s]", text)
        assert not any(QUANTILE.search(each) for each in re.findall(r"<previewExpression>([^<]*)", text))


def test_explore_has_no_word_for_a_quantile():
    assert not [name for name, text in PHRASES.items() if QUANTILE.search(text)]
