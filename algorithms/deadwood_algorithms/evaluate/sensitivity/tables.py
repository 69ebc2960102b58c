"""The bars and indices of a variation as rows, and what a reader wants to see first."""

from __future__ import annotations

from typing import Any

import numpy as np

from deadwood_algorithms.evaluate.sensitivity.answer import Answer, Measured
from deadwood_algorithms.params.counts import counted

# A first-order index above the total index, which includes it, is an estimate from too few rows.
CROSSED = "with the first-order one, estimated above it by chance, their mean: raise --samples"


def headline(measured: list[Measured], answers: list[Answer]) -> int:
    """The outcome whose sentence represents all: the line that a factor changes most; decided ones come first."""
    lines = [k for k, each in enumerate(measured) if each.is_share] or [len(measured) - 1]
    return max(lines, key=lambda k: (bool(answers[k].factors), max(abs(bar.swing) for bar in measured[k].bars)))


def order_of_factors(measured: list[Measured], answers: list[Answer]) -> list[int]:
    """The order of the factors in every table and picture: the strongest for the headline's outcome first."""
    return measured[headline(measured, answers)].strongest_first


def tornado_rows(measured: list[Measured], order: list[int]) -> list[dict[str, Any]]:
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
        for bar in (each.bars[k] for k in order)
    ]


def index_rows(measured: list[Measured], order: list[int]) -> list[dict[str, Any]]:
    return [
        {
            "outcome": each.name,
            "factor": each.bars[k].factor.name,
            "first": found.first[k],
            "first_ci_low": found.first_interval[0, k],
            "first_ci_high": found.first_interval[1, k],
            "total": found.total[k],
            "total_ci_low": found.total_interval[0, k],
            "total_ci_high": found.total_interval[1, k],
            "crossed": bool(found.crossed[k]),
            "mean": found.mean,
            "variance": found.variance,
            "variance_ci_low": found.variance_ci_low,
            "variance_ci_high": found.variance_ci_high,
        }
        for each in measured
        if (found := each.indices) is not None
        for k in order
    ]


def lines_of(measured: list[Measured], answers: list[Answer], facts: dict[str, Any]) -> tuple[str, ...]:
    """What each factor does to each outcome, and the sentences."""
    shown, order = [], order_of_factors(measured, answers)
    for each in measured:
        shown.append(f"{each.words}: {each.as_it_is(facts['logs'])} as it is")
        for k in order:
            bar = each.bars[k]
            text = f"  {bar.factor.words} {bar.factor.range_words}: {each.change(bar)}"
            if each.indices is not None and np.isfinite(each.indices.total[k]):
                text += f", total-effect index {each.indices.total_words(k)}"
                if each.indices.crossed[k]:
                    text += f" ({CROSSED})"
            shown.append(text)
    others = [one.sentence for one in answers if one.sentence != facts["sentence"]]
    head = (
        f"{counted(facts['runs'], 'run')} of the same {facts['logs']} of {facts['logs_in_layer']} logs at "
        f"{facts['fidelity']}; with other logs, or at another fidelity, the unchanged case may differ by chance or by "
        "the calculation"
    )
    return (head, *shown, *others, facts["sentence"])
