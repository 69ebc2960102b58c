"""The page of `explore` as its server delivers it: with texts and colours filled in, and the files that it loads.

It imports neither the engine nor matplotlib, because the server process must be small and start quickly.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from importlib import resources
from itertools import pairwise
from typing import Any

from deadwood_algorithms import schemas
from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.schemas.looks import (
    BARRIER,
    ENDS,
    LESS_MORE,
    LOOKS,
    MOVING,
    RELEASE,
    ROAD,
    RUNS,
    SOLIDS,
    STONE,
    STUMP,
    TREE,
    WOOD,
    Look,
    rgb,
)
from deadwood_algorithms.schemas.obstacles import STUMP_BELOW_M

KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
PAGE = resources.files("deadwood_algorithms.explore") / "page"
SHARED = {"view3d.js": resources.files("deadwood_algorithms.report") / "view3d.js"}  # also used by reports
RAMP_STEPS = 4  # steps between two stops of the scale of shares
# Classes of slope, from [deg], in colours from light to dark that colour-blind readers can distinguish (YlOrBr).
SLOPE = ((20.0, "#ffffd4"), (30.0, "#fed98e"), (35.0, "#fe9929"), (40.0, "#d95f0e"), (45.0, "#993404"))
CHANGED, CHANCE = RUNS[1], "#dddddd"  # what the user changed; cells whose difference chance explains


def facts() -> dict[str, Any]:
    """Data for the page's scripts: texts, the report's colours, and the stop reasons by the engine's numbers."""
    return {
        "language": "en",
        "words": PHRASES,
        "ramp": ramp(LOOKS["shares"]),  # as on every other map of hits
        "stops": [
            dict(zip(("reason", "label", "colour", "shape"), (reason, *ENDS[reason]), strict=True))
            for reason in schemas.STOP_REASONS
        ],
        "stump_below_m": STUMP_BELOW_M,
        "slope": [{"from": bound, "colour": colour} for bound, colour in SLOPE],
        "colours": {
            "tree": TREE,
            "stump": STUMP,
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


def ramp(look: Look) -> list[dict[str, Any]]:
    """Colours from low to high, each with its share: the stops of a scale, and even steps between them."""
    stops = list(zip(look.stops, map(rgb, look.colours), strict=True))
    found = []
    for (low, dark), (high, bright) in pairwise(stops):
        for part in (k / RAMP_STEPS for k in range(RAMP_STEPS)):
            mixed = [a + (b - a) * part for a, b in zip(dark, bright, strict=True)]
            found.append({"share": low + (high - low) * part, "colour": hexed(mixed)})
    return [*found, {"share": stops[-1][0], "colour": hexed(stops[-1][1])}]


def hexed(colour: Sequence[float]) -> str:
    return "#" + "".join(f"{round(255.0 * each):02x}" for each in colour)


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
