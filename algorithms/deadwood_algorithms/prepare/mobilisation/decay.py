"""When dead wood is smooth and still strong: the decay window in which a log can slide far.

For `assess_mobilisation`. The paper (section 6.1): logs that slid had lost bark and branches and did not yet break,
late stage II to early stage III of Maser and Trappe (1984), which in spruce is 2 to 5 years after death (Ammann 2006).
For beech and pine the years are those in which the wood has decayed as far, by the rates of Herrmann et al. (2015): an
inference of this toolbox, not of the paper.
"""

from __future__ import annotations

import re

from deadwood_algorithms.params.presets import SPRUCE, WOODS

CRITICAL, POSSIBLE, OUTSIDE, UNKNOWN = DECAYS = ("critical", "possible", "outside", "unknown")
NUMERALS = {"i": 1, "ii": 2, "iii": 3, "iv": 4, "v": 5}


def of_stage(text: str) -> str | None:
    """What a stage of Maser and Trappe says: ``II``, ``late II``, ``early 3``, ``2.5``; None if it is no stage.

    A whole stage II or III is possible, for it may be the late or the early part; 2.5 to 3.5 are critical.
    """
    found = re.fullmatch(r"(?:(early|late)\s+)?(?:stage\s+)?(i{1,3}|iv|v|[1-5](?:[.,]\d+)?)", text.strip().lower())
    if not found:
        return None
    part, word = found.groups()
    stage = float(NUMERALS[word]) if word in NUMERALS else float(word.replace(",", "."))
    if part and stage != int(stage):
        return None
    if part is None and stage in (2.0, 3.0):
        return POSSIBLE
    exact = stage + {"early": 0.25, "late": 0.75, None: 0.0}[part]
    return CRITICAL if 2.5 <= exact < 3.5 else OUTSIDE


def rate_of(species: str) -> float | None:
    """Rate of decay of a species [1/a], None if it is not known here."""
    name = species.strip().lower() + " "
    return next((wood.rate for wood in WOODS.values() if any(word in name for word in wood.words)), None)


def of_years(years: float, species: str, window: tuple[float, float]) -> str:
    """What the years since death say; ``window`` is that of spruce [a], which stands for species unknown here too."""
    scale = SPRUCE.rate / (rate_of(species) or SPRUCE.rate)
    return CRITICAL if window[0] * scale <= years <= window[1] * scale else OUTSIDE
