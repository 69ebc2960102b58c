"""When dead wood is smooth and still strong: the decay window in which a log can slide far.

For `assess_mobilisation`. The paper (section 6.1): logs that slid had lost bark and branches but did not yet break:
late stage II to early stage III of Maser and Trappe (1984), which in spruce is 2 to 5 years after death (Ammann 2006).
For downed beech and pine the years are those in which the wood has decayed as far, by the rates of Herrmann et al.
(2015): an inference of this toolbox, not of the paper. Those rates are for downed wood; for snags of species other than
spruce, and for all other species, no rates are known here.
"""

from __future__ import annotations

import re

from deadwood_algorithms.params.presets import OF_SPECIES, SPRUCE
from deadwood_algorithms.params.species import species_of

CRITICAL, POSSIBLE, OUTSIDE, UNKNOWN = DECAYS = ("critical", "possible", "outside", "unknown")
NUMERALS = {"i": 1, "ii": 2, "iii": 3, "iv": 4, "v": 5}


def of_stage(text: str) -> str | None:
    """The stage of Maser and Trappe in a text: ``II``, ``late II``, ``early 3``, ``2.5``; None if it is not a stage.

    A whole stage II or III counts, because it may be the late or the early part; 2.5 to 3.5 are critical.
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
    """Rate of decay of a species' downed wood [1/a], None if it is not known here."""
    found = species_of(species)
    wood = OF_SPECIES.get(found.binomial) if found else None
    return wood.rate if wood else None


def of_years(years: float, species: str, window: tuple[float, float], *, standing: bool = False) -> str:
    """The decay from the years since death; ``window`` is that of spruce [a], which is also used for unknown species.

    It is unknown for a snag of another species with a known rate, because the rates are for downed wood.
    """
    rate = rate_of(species) or SPRUCE.rate
    if standing and rate != SPRUCE.rate:
        return UNKNOWN
    scale = SPRUCE.rate / rate
    return CRITICAL if window[0] * scale <= years <= window[1] * scale else OUTSIDE
