"""How often logs arrive at each line over the years: the starts of the stems times what their slides did.

A slide depends on what slides and from where, not on the year, so each stem slides in a few states, some times each,
and every year weights the same slides. Stems that lie hold others in proportion to their share of all stems: between
the slides without any of them, and those with all. Every draw of the processes' numbers also weights the slides anew
(a Bayesian bootstrap; with half a hit and half a miss added, as Jeffreys' interval), so that an interval contains both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.lifetime.life import Kinds, storm_chance
from deadwood_algorithms.evaluate.lifetime.treatments import Treatment, starts_of
from deadwood_algorithms.stats import draws

Array = NDArray[np.float64]
BARE = "bare"
CELLS = 1_000_000  # draws times years times kinds that are computed at once


@dataclass(frozen=True)
class Slides:
    """One row a slide: the kind of its stem, what slides, whether the stem is picked, and, by scene, whether it arrived
    with at least the energy of each column; shape (rows, columns).

    repeats : slides of each stem and state; less where a slide stands for several stems
    """

    kind: NDArray[np.int64]
    state: NDArray[np.int64]
    picked: NDArray[np.bool_]
    arrived: Mapping[str, NDArray[np.bool_]]
    repeats: float


@dataclass(frozen=True)
class Arrivals:
    """Arrivals a year, shape (draws, years, columns): without a storm, and more if there is one; ``storm`` : the
    probability of a storm, shape (draws, 1, 1).
    """

    calm: Array
    pulse: Array
    storm: Array

    @property
    def rate(self) -> Array:
        return self.calm + self.storm * self.pulse

    @property
    def chance(self) -> Array:
        """Probability that a year has at least one arrival."""
        return 1.0 - np.exp(-self.calm) * (1.0 - self.storm * -np.expm1(-self.pulse))


def weights_of(count: int, state: NDArray[np.int64], seed: int) -> tuple[Array, Array, Array]:
    """Weights of the slides in each draw, their mean 1 in each state, with those of a hit and a miss added to each
    state; shapes (count, rows), (count, states), (count, states).
    """
    rows = state.size
    turn = np.repeat(np.arange(count, dtype=np.uint64), rows)
    tile = np.tile(np.arange(rows, dtype=np.uint64), count)
    weight = -np.log1p(-draws.uniforms(seed, tile, draws.SLIDE_WEIGHT, turn)[0]).reshape(count, rows)
    states = np.arange(count * 3, dtype=np.uint64)
    hit, miss = (0.5 * (each.reshape(count, 3) ** 2) for each in draws.normals(seed, states, draws.PRIOR_WEIGHT))
    for each in range(3):
        mine = state == each
        if mine.any():
            scale = mine.sum() / (weight[:, mine].sum(axis=1) + hit[:, each] + miss[:, each])
            weight[:, mine] *= scale[:, None]
            hit[:, each] *= scale
            miss[:, each] *= scale
    return weight, hit, miss


def arrivals_of(
    treatments: Sequence[Treatment],
    numbers: Mapping[str, Array],
    kinds: Kinds,
    slides: Slides,
    trees_of_kind: tuple[Array, Array],
    years: int,
    seed: int,
) -> dict[str, Arrivals]:
    """Arrivals of each treatment. ``trees_of_kind`` : how many stems of each kind are picked, and how many are not."""
    count, size = len(numbers["start_share"]), kinds.speed.size
    weight, hit, _ = weights_of(count, slides.state, seed)
    columns = next(iter(slides.arrived.values())).shape[1]
    total = sum(each.sum() for each in trees_of_kind)
    found = {each.name: np.zeros((2, count, years, columns)) for each in treatments}
    step = max(1, CELLS // (years * size * 3))
    for first in range(0, count, step):
        block = slice(first, first + step)
        some = {name: each[block] for name, each in numbers.items()}
        hits = {
            (scene, part): _hits_of(slides, scene, part, weight[block], hit[block], size)
            for scene in slides.arrived
            for part in (True, False)
        }
        starts = {fate: starts_of(fate, some, kinds, years) for each in treatments for fate in each.fates}
        for each in treatments:
            held = {}  # share of all stems that lies and holds in each scene, shape (years, draws)
            for fate, trees in zip(each.fates, trees_of_kind, strict=True):
                for scene, holds in starts[fate].holds.items():
                    held[scene] = held.get(scene, 0.0) + holds @ trees / total
            for fate, part in zip(each.fates, (True, False), strict=True):
                for turn, rate in enumerate((starts[fate].calm, starts[fate].pulse)):
                    mixed = np.einsum("ybks,bksc->byc", rate, hits[BARE, part])
                    for scene, share in held.items():
                        if scene in slides.arrived:
                            less = hits[scene, part] - hits[BARE, part]
                            mixed = mixed + np.einsum("ybks,bksc->byc", rate * share[..., None, None], less)
                    found[each.name][turn, block] += mixed
    storm = storm_chance(numbers)[..., None]
    return {name: Arrivals(calm, pulse, storm) for name, (calm, pulse) in found.items()}


def _hits_of(slides: Slides, scene: str, part: bool, weight: Array, hit: Array, kinds: int) -> Array:
    """Weighted arrivals by kind and state of the picked stems, or of the others, for one start of each stem; shape
    (draws, kinds, states, columns).
    """
    arrived = slides.arrived[scene]
    out = np.zeros((weight.shape[0], kinds, 3, arrived.shape[1]))
    for state in range(3):
        of_state = slides.state == state
        for kind in range(kinds):
            rows = np.flatnonzero(of_state & (slides.kind == kind) & (slides.picked == part))
            if rows.size:
                prior = hit[:, state] * rows.size / of_state.sum()
                out[:, kind, state] = (weight[:, rows] @ arrived[rows] + prior[:, None]) / slides.repeats
    return out


def energy_of_period(chance: Array, energies: Array, period: float) -> Array:
    """The largest of these energies (ascending, the first 0) that arrives at least once in a period, by draw; 0 if only
    that of 0 does, NaN if nothing does. ``chance`` : of each energy or more in a year, shape (draws, energies).
    """
    often = chance >= 1.0 / period
    last = np.where(often.any(axis=1), often.shape[1] - 1 - often[:, ::-1].argmax(axis=1), 0)
    return np.where(often.any(axis=1), energies[last], np.nan)


def worst_trees(
    arrived: NDArray[np.bool_], tree: NDArray[np.int64], items: NDArray[np.uint64], part: float
) -> NDArray[np.bool_]:
    """The share of the stems from which most logs arrive at any line; of equal ones those with the smallest number."""
    score = np.bincount(tree, weights=arrived.any(axis=1), minlength=items.size)
    order = np.lexsort((items, -score))
    chosen = np.zeros(items.size, bool)
    chosen[order[: int(np.ceil(part * items.size))]] = True
    return chosen
