"""What becomes of dead trees over the years: expected shares in closed form, and drawn fates of the same law.

A standing tree breaks or falls in a year with probability ``1 - exp(-rate)`` after the lag and, if there is a storm,
with the storm's share besides. It then lies broken (its upper part; a snag remains) or whole, until it has disappeared,
at a constant rate. It is critical while bark and branches are gone and the wood is still strong.

Arrays have the shape (draws, years, trees); trees that are alike need only be there once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.presets import WEAKEST
from deadwood_algorithms.params.snag_dynamics import PROCESSES, Spans
from deadwood_algorithms.stats import draws

Array = NDArray[np.float64]
STATES = ("standing", "broken", "lying", "gone")
BLOCK = 500_000  # trees times draws whose fates are drawn at once


@dataclass(frozen=True)
class Kinds:
    """Dead trees by what matters for their fate: years since death, whether they stand, decay relative to spruce."""

    years_dead: Array
    standing: NDArray[np.bool_]
    speed: Array


def drawn(spans: Spans, count: int, seed: int) -> dict[str, Array]:
    """Numbers of the processes, uniform in their ranges and independent; shape (count, 1) each."""
    items = np.arange(count, dtype=np.uint64)
    return {
        name: (spans[name][0] + np.ptp(spans[name]) * draws.uniforms(seed, items, draws.PROCESS, turn)[0])[:, None]
        for turn, name in enumerate(PROCESSES)
        if name in spans
    }


def storm_chance(numbers: Mapping[str, Array]) -> Array:
    """Probability that a year has at least one storm; shape (draws, 1)."""
    return -np.expm1(-1.0 / numbers["storm_return_years"])


def storm_years(numbers: Mapping[str, Array], years: int, seed: int) -> Array:
    """Drawn years with a storm, 1 or 0; shape (draws, years)."""
    chance = storm_chance(numbers)
    cell = np.arange(chance.size * years, dtype=np.uint64)
    return (draws.uniforms(seed, cell, draws.STORM_YEAR)[0].reshape(-1, years) < chance).astype(float)


def critical_span(numbers: Mapping[str, Array], speed: Array) -> tuple[Array, Array]:
    """Years after death between which a tree is smooth and strong; an empty span ends before it begins."""
    end = numbers["weak_years"] * np.log(numbers["strength_needed"]) / np.log(WEAKEST)
    return numbers["bark_off_years"] / speed, end / speed


def critical_at(numbers: Mapping[str, Array], kinds: Kinds, year: float) -> NDArray[np.bool_]:
    begin, end = critical_span(numbers, kinds.speed)
    age = kinds.years_dead + year
    return (age >= begin) & (age < end)


@dataclass(frozen=True)
class Year:
    """One year of trees, shape (draws, kinds): shares at its beginning, and what happens in it.

    calm : share that breaks or falls without a storm; pulse : share that a storm throws besides, if there is one
    critical : share of the year during which a tree is critical
    """

    standing: Array
    broken: Array
    lying: Array
    calm: Array
    pulse: Array
    critical: Array


def lives(numbers: Mapping[str, Array], kinds: Kinds, storm: Array) -> Iterator[Year]:
    """Year after year; ``storm`` : probability of a storm, or whether there was one, shape (draws, years)."""
    standing = np.broadcast_to(kinds.standing.astype(float), (storm.shape[0], kinds.speed.size))
    broken, lying = np.zeros_like(standing), 1.0 - standing
    keep = np.exp(-kinds.speed / numbers["residence_years"])
    begin, end = critical_span(numbers, kinds.speed)
    for year in range(storm.shape[1]):
        age = kinds.years_dead + year
        exposed = np.clip(age + 1.0 - numbers["lag_years"], 0.0, 1.0)
        calm = -standing * np.expm1(-numbers["fall_per_year"] * exposed)
        pulse = (standing - calm) * numbers["storm_share"]
        critical = np.clip(np.minimum(end, age + 1.0) - np.maximum(begin, age), 0.0, 1.0)
        yield Year(standing, broken, lying, calm, pulse, critical)
        falls = calm + storm[:, year, None] * pulse
        standing = standing - falls
        broken = broken * keep + falls * numbers["broken_share"]
        lying = lying * keep + falls * (1.0 - numbers["broken_share"])


def kinds_of(years_dead: Array, standing: NDArray[np.bool_], speed: Array) -> tuple[Kinds, NDArray[np.int64]]:
    """The kinds of trees, and of each tree its kind."""
    table, of_tree = np.unique(
        np.column_stack([years_dead, standing.astype(float), speed]), axis=0, return_inverse=True
    )
    return Kinds(table[:, 0], table[:, 1] == 1.0, table[:, 2]), of_tree.reshape(-1)


@dataclass(frozen=True)
class Ages:
    """Drawn states of the stand: shares by draw, year and state, of all trees and of the critical ones; and for every
    tree the share of the draws in which it is in each state.
    """

    shares: Array  # (draws, years + 1, states)
    critical: Array  # (draws, years + 1, 2): standing, down
    of_trees: Array  # (trees, years + 1, states)
    critical_of_trees: Array  # (trees, years + 1)


def aged(
    numbers: Mapping[str, Array],
    kinds: Kinds,
    of_tree: NDArray[np.int64],
    items: NDArray[np.uint64],
    storms: Array,
    seed: int,
) -> Ages:
    """Draw what becomes of every tree in every draw of the numbers, with the storms of that draw."""
    count, years = storms.shape
    shares, critical = np.zeros((count, years + 1, len(STATES))), np.zeros((count, years + 1, 2))
    of_trees, critical_of_trees = np.zeros((items.size, years + 1, len(STATES))), np.zeros((items.size, years + 1))
    none = np.zeros((count, 1))
    survival = np.stack([each.standing for each in lives(numbers, kinds, np.hstack([storms, none]))])
    step = max(1, BLOCK // items.size)
    for first in range(0, count, step):
        rows = np.arange(first, min(first + step, count))
        shape = rows.size, items.size
        turn = np.repeat(rows, items.size).astype(np.uint64)
        pairs = [
            draws.uniforms(seed, np.tile(items, rows.size), each, turn) for each in (draws.STEM_FATE, draws.STEM_REST)
        ]
        fate, how, rest = (each.reshape(shape) for each in (*pairs[0], pairs[1][0]))
        some = {name: each[rows] for name, each in numbers.items()}
        broken = (how < some["broken_share"]) & kinds.standing[of_tree]
        lasts = -np.log1p(-rest) * some["residence_years"] / kinds.speed[of_tree]
        down = np.where(kinds.standing[of_tree], 0, 1) * np.ones(shape, int)  # years that it has been down, from 1
        for year in range(years + 1):
            stands = kinds.standing[of_tree] & (fate < survival[year][rows][:, of_tree])
            if year:
                down += ~stands
            gone = ~stands & (down - 1 >= lasts)
            state = np.select([stands, gone, broken], [0, 3, 1], 2)
            crisis = critical_at(some, kinds, float(year))[:, of_tree] & ~gone
            for k in range(len(STATES)):
                shares[rows, year, k] = (state == k).mean(axis=1)
                of_trees[:, year, k] += (state == k).sum(axis=0) / count
            critical[rows, year] = np.stack([(crisis & stands).mean(axis=1), (crisis & ~stands).mean(axis=1)], axis=1)
            critical_of_trees[:, year] += crisis.sum(axis=0) / count
    return Ages(shares, critical, of_trees, critical_of_trees)
