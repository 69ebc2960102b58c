"""What the search of the site reads: the sections of its built pages, in a script that also loads from a file."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

SKIPPED = ("script", "style", "nav", "svg", "button")
HEADINGS = ("h1", "h2", "h3", "h4")
NOT_SEARCHED = ("search.html", "genindex.html", "changes.html")
SCRIPT = "_static/search_pages.js"
# What readers ask for that stands in no heading of the page.
SUBJECTS = {
    "faq": "rockfall rock boulder commercial hazard",
    "how-to/accuracy": "fidelity draft standard fine reference sample",
    "how-to/after-a-storm": "windthrow windfall snag deadwood lying storm damage",
    "how-to/dead-trees": "leave fell anchor remove decay age years",
    "how-to/design-values": "barrier height energy",
    "how-to/intensity": "hazard map return period",
    "how-to/log-solid": "point cloud mesh shape stl obj",
    "how-to/most-influential-input": "sensitivity uncertainty parameter",
    "how-to/repeat": "manifest reproducible reproduce",
    "how-to/site-a-barrier": "barrier position place",
    "how-to/slide-logs": "house building road railway line reach resume interrupted unfinished",
    "how-to/trees": "canopy height model lidar random forest stand import",
    "how-to/which-trees": "fell cut keep stop protection forest",
    "reference/messages": "exit status code error",
    "start/de": "Totholz",
    "start/first-run-qgis": "plugin",
    "start/fr": "bois mort",
    "start/it": "legno morto",
}


class Sections(HTMLParser):
    """The sections of a page: each [anchor, heading, text]."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[list[str]] = []
        self.anchor, self.depth, self.skipped, self.heading = "", 0, list[str](), False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "article":
            self.depth += 1
        elif tag in SKIPPED or "headerlink" in (given.get("class") or ""):
            self.skipped.append(tag)
        elif tag == "section":
            self.anchor = given.get("id") or ""
        elif tag in HEADINGS and self.depth:
            self.found.append([self.anchor, "", ""])
            self.heading = True

    def handle_endtag(self, tag: str) -> None:
        if tag == "article":
            self.depth -= 1
        elif self.skipped and tag == self.skipped[-1]:
            self.skipped.pop()
        elif tag in HEADINGS:
            self.heading = False

    def handle_data(self, data: str) -> None:
        if self.depth and not self.skipped and self.found:
            self.found[-1][1 if self.heading else 2] += data


def sections(html: str) -> list[list[str]]:
    found = Sections(html).found
    return [[anchor, *(re.sub(r"\s+", " ", text).strip() for text in texts)] for anchor, *texts in found]


def write(site: Path) -> None:
    """Write the script beside the built pages."""
    pages = []
    for path in sorted(site.rglob("*.html")):
        place = path.relative_to(site).as_posix()
        if place not in NOT_SEARCHED and (found := sections(path.read_text(encoding="utf-8"))):
            pages.append([place, SUBJECTS.get(place.removesuffix(".html"), ""), found])
    (site / SCRIPT).write_text(f"deadwoodSearch.load({json.dumps(pages, ensure_ascii=False)});\n", encoding="utf-8")
