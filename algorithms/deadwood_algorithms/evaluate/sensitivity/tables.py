"""The bars and indices of a variation as rows, and what a reader wants to see first."""

from __future__ import annotations

from typing import Any

import numpy as np

from deadwood_algorithms.evaluate.sensitivity.answer import Answer, Measured


def headline(measured: list[Measured], answers: list[Answer]) -> int:
    """The outcome whose sentence stands for all: the line that a factor moves most, a decided one first."""
    lines = [k for k, each in enumerate(measured) if each.is_share] or [len(measured) - 1]
    return max(lines, key=lambda k: (bool(answers[k].factors), max(abs(bar.swing) for bar in measured[k].bars)))


def tornado_rows(measured: list[Measured]) -> list[dict[str, Any]]:
    return [
        {
            "outcome": each.name,
            "factor": bar.factor.name,
            "low": bar.factor.low,
            "high": bar.factor.high,
            "as_it_is": bar.base,
            "at_low": bar.at_low,
            "at_high": bar.at_high,
            "swing": bar.swing,
            "ci_low": bar.ci_low,
            "ci_high": bar.ci_high,
            "n_changed": bar.n_changed,
            "beyond_chance": bar.beyond_chance,
        }
        for each in measured
        for bar in each.bars
    ]


def index_rows(measured: list[Measured]) -> list[dict[str, Any]]:
    return [
        {
            "outcome": each.name,
            "factor": bar.factor.name,
            "first": found.first[k],
            "first_low": found.first_interval[0, k],
            "first_high": found.first_interval[1, k],
            "total": found.total[k],
            "total_low": found.total_interval[0, k],
            "total_high": found.total_interval[1, k],
            "mean": found.mean,
            "variance": found.variance,
            "variance_low": found.variance_low,
            "variance_high": found.variance_high,
        }
        for each in measured
        if (found := each.indices) is not None
        for k, bar in enumerate(each.bars)
    ]


def lines_of(measured: list[Measured], answers: list[Answer], facts: dict[str, Any]) -> tuple[str, ...]:
    """What each factor does to each outcome, and the sentences."""
    shown = []
    for each in measured:
        shown.append(f"{each.words}:")
        for k, bar in sorted(enumerate(each.bars), key=lambda pair: -abs(pair[1].swing)):
            text = f"  {bar.factor.words} {bar.factor.range_words}: {each.change(bar)}"
            if each.indices is not None and np.isfinite(each.indices.total[k]):
                text += f", total-effect index {each.indices.total_words(k)}"
            shown.append(text)
    others = [one.sentence for one in answers if one.sentence != facts["sentence"]]
    return (f"{facts['runs']} runs of the same {facts['logs']} logs", *shown, *others, facts["sentence"])
