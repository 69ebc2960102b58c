"""The paper's findings about friction, assessed on sweeps: the range that reproduces, and coarser cells."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.paper.finding import Evidence, Finding, Row, above, all_of
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.stats.statistics import wilson_interval

NOT_REACHED = 0.005  # share below which the paper's "is not reached" holds


def friction_findings(of: Evidence) -> list[Finding]:
    """The friction range that reproduces, the friction above which nothing is reached, and coarser cells."""
    at, road, beyond = of.site, of.facts["road"], of.facts.get("beyond")
    finest = min(of.sweeps)
    rows = sorted(of.sweeps[finest], key=lambda row: row["friction"])
    shares = ", ".join(f"{row['friction']:g}: {100 * row[f'reach_{road}']:.1f} %" for row in rows)
    found = []
    high = [row for row in rows if row["friction"] >= 0.35 - 1e-9]
    inside = [row for row in rows if 0.2 - 1e-9 <= row["friction"] <= 0.3 + 1e-9]
    if high:
        first = high[0]
        ends = _interval(first, f"reach_{road}")
        found.append(
            Finding(
                f"{at}.high_friction_does_not_reach",
                f"With mu {first['friction']:g} the road is not reached (share; holds below 0.5 %)",
                "5.1, 7",
                "not reached above 0.3",
                first[f"reach_{road}"],
                *ends,
                above(-ends[1], -ends[0], -NOT_REACHED),
                f"reach of {road} by mu, {first['n']} logs each: {shares}",
            )
        )
    if inside and beyond:
        share = [float(row[f"reach_{road}"] - row[f"reach_{beyond}"]) for row in inside]
        ends = [wilson_interval(round(part * row["n"]), row["n"]) for part, row in zip(share, inside, strict=True)]
        found.append(
            Finding(
                f"{at}.range_reproduces",
                "With mu 0.2 to 0.3 logs come to rest on the road (smallest share over the range; holds above 0)",
                "5.1, 7",
                "0.2 to 0.3",
                min(share),
                min(e[0] for e in ends),
                max(e[1] for e in ends),
                all_of([above(*each, 0.0) for each in ends]),
                "; ".join(
                    f"{row['friction']:g}: {100 * part:.1f} % reach {road} and not {beyond}"
                    for row, part in zip(inside, share, strict=True)
                ),
            )
        )
    if beyond and rows[0]["friction"] < 0.2 - 1e-9:
        passing = [row[f"reach_{beyond}"] / row[f"reach_{road}"] if row[f"reach_{road}"] else math.nan for row in rows]
        n = round(rows[0][f"reach_{road}"] * rows[0]["n"])
        ends_low = wilson_interval(round(rows[0][f"reach_{beyond}"] * rows[0]["n"]), n)
        found.append(
            Finding(
                f"{at}.low_friction_passes",
                f"With mu {rows[0]['friction']:g} the logs do not stop on the road (share "
                "of the logs reaching it that go beyond; holds above one half)",
                "5.1",
                "below 0.2 they slide on",
                passing[0],
                *ends_low,
                above(*ends_low, 0.5),
                "; ".join(f"{row['friction']:g}: {100 * part:.0f} %" for row, part in zip(rows, passing, strict=True)),
            )
        )
    base = next((row for row in rows if abs(row["friction"] - of.facts["friction"]) < 1e-9), None)
    coarse = sorted(cell for cell in of.sweeps if cell > finest)
    if coarse and base:
        target = float(base[f"reach_{road}"])
        mus, intervals = [], []
        for cell in coarse:
            mu, low, high_mu = friction_for(of.sweeps[cell], f"reach_{road}", base)
            shown = ("beyond the sweep" if math.isnan(each) else f"{each:.3f}" for each in (mu, low, high_mu))
            mus.append("{:g} m cells: {} ({} to {})".format(cell, *shown))
            intervals.append((mu, low, high_mu))
        mu, low, high_mu = intervals[-1]
        found.append(
            Finding(
                f"{at}.coarser_cells_need_more",
                f"The friction that gives the same reach increases with the cell size "
                f"(mu at {coarse[-1]:g} m; holds above {of.facts['friction']:g} at every size)",
                "6.1",
                "should be increased with lower resolution",
                mu,
                low,
                high_mu,
                all_of([above(each[1], each[2], of.facts["friction"]) for each in intervals]),
                f"{counted(base['n'], 'log')} each, for a reach of {100 * target:.1f} % at {finest:g} m and "
                f"{of.facts['friction']:g}: " + "; ".join(mus),
            )
        )
    return found


def _interval(row: Row, key: str) -> tuple[float, float]:
    """95 % interval of a share of a sweep's row."""
    return wilson_interval(round(row[key] * row["n"]), row["n"])


def friction_for(rows: Sequence[Row], key: str, target: Row) -> tuple[float, float, float]:
    """The coefficient at which a falling share meets that of ``target``, a row of another sweep, with a 95 % interval;
    NaN if the sweep does not meet it.

    The target and the sweep are counted from different runs, so what each of them contributes to the interval is added
    in squares (MOVER; Zou and Donner 2008).
    """
    rows = sorted(rows, key=lambda row: row["friction"])
    mu = np.array([row["friction"] for row in rows], float)
    ends = [_interval(row, key) for row in rows]
    shares = np.array([row[key] for row in rows], float)
    low, high = (np.array([end[side] for end in ends], float) for side in (0, 1))
    share, (least, most) = target[key], _interval(target, key)
    found = _crossing(mu, shares, share)
    below = math.hypot(found - _crossing(mu, low, share), found - _crossing(mu, shares, most))
    above_it = math.hypot(found - _crossing(mu, high, share), found - _crossing(mu, shares, least))
    return found, found - below, found + above_it


def _crossing(mu: NDArray, share: NDArray, target: float) -> float:
    for k in range(mu.size - 1):
        if share[k] >= target >= share[k + 1] and share[k] > share[k + 1]:
            return float(mu[k] + (mu[k + 1] - mu[k]) * (share[k] - target) / (share[k] - share[k + 1]))
    return math.nan
