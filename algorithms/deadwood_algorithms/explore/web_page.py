"""The page of `explore` as its server hands it out: words and colours filled in, and the files that it loads.

Without the engine and without matplotlib: the server's process is to be small, and there at once.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Any

from deadwood_algorithms import schemas
from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.schemas.looks import (
    BARRIER,
    ENDS,
    HITS,
    LESS_MORE,
    MOVING,
    RELEASE,
    ROAD,
    RUNS,
    SOLIDS,
    STONE,
    TREE,
    WOOD,
)

KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
PAGE = resources.files("deadwood_algorithms.explore") / "page"
SHARED = {"view3d.js": resources.files("deadwood_algorithms.report") / "view3d.js"}  # what reports have, too
RAMP_STEPS = 29  # whole steps between two of the ramp's eight colours
# Classes of slope, from [deg], in colours from light to dark that colour-blind readers tell apart (YlOrBr).
SLOPE = ((20.0, "#ffffd4"), (30.0, "#fed98e"), (35.0, "#fe9929"), (40.0, "#d95f0e"), (45.0, "#993404"))
CHANGED, CHANCE = RUNS[1], "#dddddd"  # what the user changed; cells whose difference chance explains


def facts() -> dict[str, Any]:
    """What the page's scripts get: words, the report's colours, and how logs end, by the engine's own numbers."""
    return {
        "language": "en",
        "words": PHRASES,
        "ramp": ramp(HITS, RAMP_STEPS),  # as the report's map of hits
        "stops": [
            dict(zip(("reason", "label", "colour", "shape"), (reason, *ENDS[reason]), strict=True))
            for reason in schemas.STOP_REASONS
        ],
        "slope": [{"from": bound, "colour": colour} for bound, colour in SLOPE],
        "colours": {
            "tree": TREE,
            "barrier": BARRIER,
            "lying": WOOD,
            "block": STONE,
            "line": ROAD,
            "release": RELEASE,
            "moving": MOVING,
            "changed": CHANGED,
            "chance": CHANCE,
            "solids": SOLIDS,
            "less": [LESS_MORE[1], LESS_MORE[0]],
            "more": [LESS_MORE[-2], LESS_MORE[-1]],
        },
    }


def ramp(colours: tuple[str, ...], steps: int) -> list[str]:
    """So many colours, evenly between those given."""
    known = [[int(each[k : k + 2], 16) for k in (1, 3, 5)] for each in colours]
    found = []
    for step in range(steps):
        exact = step * (len(known) - 1) / (steps - 1)
        low = min(int(exact), len(known) - 2)
        mixed = [a + (b - a) * (exact - low) for a, b in zip(known[low], known[low + 1], strict=True)]
        found.append("#" + "".join(f"{round(each):02x}" for each in mixed))
    return found


@cache
def files() -> dict[str, tuple[str, bytes]]:
    """The page (``index.html``) and what it loads, by name: type and content."""
    sources = {each.name: each for each in PAGE.iterdir() if each.name.rsplit(".", 1)[-1] in KINDS} | SHARED
    found = {name: each.read_text(encoding="utf-8") for name, each in sources.items()}
    facts_json = json.dumps(facts(), ensure_ascii=False).replace("<", "\\u003c")
    found["index.html"] = found["index.html"].replace('id="config">{}<', f'id="config">{facts_json}<', 1)
    return {
        name: (f"{KINDS[name.rsplit('.', 1)[-1]]}; charset=utf-8", text.encode("utf-8")) for name, text in found.items()
    }
