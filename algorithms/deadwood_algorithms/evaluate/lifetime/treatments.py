"""What can be done with dead trees, as records: the fate of the stems that a treatment picks, and of the others.

A fate gives how often stems start to slide, and what lies across the slope or as it fell and holds others back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.lifetime.life import Kinds, lives, storm_chance
from deadwood_algorithms.params.tool import UserError

Array = NDArray[np.float64]
LEFT, FELLED, ACROSS, ANCHORED, REMOVED = "left", "felled", "across", "anchored", "removed"
WHOLE, BROKEN, MOVED = range(3)  # what slides: a whole snag, the upper part of a broken one, a lying stem
FALLEN_SCENE, ACROSS_SCENE = "fallen", "across"


@dataclass(frozen=True)
class Treatment:
    """``picked`` : the fate of the stems from which most logs reach a line, None if all are treated alike."""

    name: str
    about: str
    rest: str
    picked: str | None = None

    @property
    def fates(self) -> tuple[str, str]:
        """Of the picked stems and of the others."""
        return self.picked or self.rest, self.rest


TREATMENTS = {
    each.name: each
    for each in (
        Treatment("leave", "everything is left as it is", LEFT),
        Treatment("fell-across", "all are felled and left across the slope, a share anchored", ACROSS),
        Treatment("fell", "all are felled and left as they fall", FELLED),
        Treatment("anchor", "the worst are felled across the slope and anchored, the others left", LEFT, ANCHORED),
        Treatment("remove", "all are removed", REMOVED),
        Treatment("remove-part", "the worst are removed, the others left", LEFT, REMOVED),
    )
}


def treatments_of(text: str) -> list[Treatment]:
    names = [each.strip() for each in text.split(",") if each.strip()]
    for name in names:
        if name not in TREATMENTS:
            raise UserError(f"--treatments: '{name}' is not one of {', '.join(TREATMENTS)}")
    if not names or len(set(names)) < len(names):
        raise UserError(f"--treatments is '{text}', but must name each treatment once: {', '.join(TREATMENTS)}")
    return [TREATMENTS[each] for each in names]


def scenes_of(treatments: list[Treatment]) -> list[str]:
    """The scenes with lying stems that these treatments need."""
    fates = {fate for each in treatments for fate in each.fates}
    needs = {FALLEN_SCENE: {LEFT, FELLED}, ACROSS_SCENE: {ACROSS, ANCHORED}}
    return [scene for scene, of in needs.items() if fates & of]


@dataclass(frozen=True)
class Starts:
    """Of the stems of a fate: starts a year of each, shape (years, draws, kinds, states), without a storm, and more if
    there is one; and the share of them that lies and holds in each scene, shape (years, draws, kinds).
    """

    calm: Array
    pulse: Array
    holds: Mapping[str, Array]


def starts_of(fate: str, numbers: Mapping[str, Array], kinds: Kinds, years: int) -> Starts:
    """How often the stems of a fate start to slide, and what they hold."""
    count = len(numbers["start_share"])
    calm, pulse = np.zeros((2, years, count, kinds.speed.size, 3))
    if fate == REMOVED:
        return Starts(calm, pulse, {})
    if fate != LEFT:
        kinds = Kinds(kinds.years_dead, np.zeros(kinds.speed.size, bool), kinds.speed)
    storm = np.broadcast_to(storm_chance(numbers), (count, years))
    loose = {ACROSS: 1.0 - numbers["anchored_share"], ANCHORED: 0.0}.get(fate, 1.0)
    sound, broken = numbers["hold_loss_per_year"], numbers["broken_share"]
    down = np.zeros((years, count, kinds.speed.size))
    for at, year in enumerate(lives(numbers, kinds, storm)):
        slides = year.critical * numbers["start_share"]
        for out, falls in ((calm, year.calm), (pulse, year.pulse)):
            out[at, ..., WHOLE] = falls * (1.0 - broken) * slides
            out[at, ..., BROKEN] = falls * broken * slides
        lies = year.broken + year.lying
        calm[at, ..., MOVED] = lies * -np.expm1(-numbers["mobilised_per_year"] * year.critical) * loose
        down[at] = lies * np.exp(-sound * at)
    if fate in (ACROSS, ANCHORED):
        return Starts(calm, pulse, {ACROSS_SCENE: down * (1.0 - loose)})
    return Starts(calm, pulse, {FALLEN_SCENE: down})
