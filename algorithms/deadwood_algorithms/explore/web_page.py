"""The page of `explore` as its server hands it out: words and colours filled in, and the files that it loads."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Any

import matplotlib
from matplotlib.colors import to_hex

from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.files.styles import DIFFERENCE, ENDS
from deadwood_algorithms.report import plan
from deadwood_algorithms.report.words import Words
from deadwood_engine import STOP_REASONS

KINDS = {"css": "text/css; charset=utf-8", "js": "text/javascript; charset=utf-8"}
SCRIPTS = (
    "explore.css", "explore.js", "answers.js", "layers.js", "link.js", "map.js", "motion.js", "terrain.js", "tools.js",
    "words.js",
)  # fmt: skip
RAMP_STEPS = 32
# Classes of slope, from [deg], in colours from light to dark that colour-blind readers tell apart (YlOrBr).
SLOPE = ((20.0, "#ffffd4"), (30.0, "#fed98e"), (35.0, "#fe9929"), (40.0, "#d95f0e"), (45.0, "#993404"))
CHANGED, CHANCE = "#d55e00", "#8c8c8c"  # what the user changed; cells whose difference chance explains


def facts(language: str = "en") -> dict[str, Any]:
    """What the page's scripts are told: words, the report's colours, and how logs end, by the engine's own numbers."""
    words = Words(language)
    ramp = matplotlib.colormaps["viridis"].resampled(RAMP_STEPS)
    return {
        "language": language,
        "words": PHRASES,
        "ramp": [to_hex(ramp(k)) for k in range(RAMP_STEPS)],
        "stops": [
            {"reason": reason, "label": words.stop(reason), "colour": ENDS[reason][1], "shape": ENDS[reason][2]}
            for reason in STOP_REASONS
        ],
        "slope": [{"from": bound, "colour": colour} for bound, colour in SLOPE],
        "colours": {
            "tree": plan.TREE, "barrier": plan.BARRIER, "lying": plan.LYING, "block": plan.BLOCK, "line": plan.LINE,
            "release": plan.RELEASE, "moving": CHANGED, "changed": CHANGED, "chance": CHANCE,
            "less": [DIFFERENCE[1], DIFFERENCE[0]], "more": [DIFFERENCE[5], DIFFERENCE[6]],
        },
    }  # fmt: skip


@cache
def document(language: str = "en") -> str:
    """The page itself."""
    text = _read("explore", "page/index.html")
    told = json.dumps(facts(language), ensure_ascii=False).replace("<", "\\u003c")
    return text.replace('id="told">{}<', f'id="told">{told}<', 1)


@cache
def assets() -> dict[str, tuple[str, bytes]]:
    """What the page loads from ``page/``, by name: type and content; the 3-D view is the report's."""
    found = {name: _read("explore", f"page/{name}") for name in SCRIPTS}
    found["view3d.js"] = _read("report", "view3d.js")
    return {name: (KINDS[name.rsplit(".", 1)[1]], text.encode("utf-8")) for name, text in found.items()}


def _read(room: str, name: str) -> str:
    return (resources.files(f"deadwood_algorithms.{room}") / name).read_text(encoding="utf-8")
