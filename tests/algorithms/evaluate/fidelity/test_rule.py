"""Which fidelity is recommended, on made-up numbers."""

from __future__ import annotations

import math

import pytest

from deadwood_algorithms.evaluate.fidelity.records import FidelityRow
from deadwood_algorithms.evaluate.fidelity.rule import (
    BEYOND,
    LEAST_LOGS,
    UNDECIDED,
    WITHIN,
    recommend,
    verdict_of_distance,
    verdict_of_interval,
)

NAMES = ["draft", "standard", "fine"]


def reach(name: str, difference: float, half: float, *, noise: float = 0.02, line: str = "road") -> FidelityRow:
    low, high = difference - half, difference + half
    verdict = "" if name == NAMES[-1] else verdict_of_interval(low, high, noise)
    return FidelityRow(name, "reach", line, "1", 0.3 + difference, 0.3, difference, low, high, noise, verdict)


def apart(
    name: str, distance: float, quantity: str = "deposit_distance", n_logs: int = 1000, halves: float = 2.0
) -> FidelityRow:
    verdict, noise = verdict_of_distance(distance, halves, n_logs, 1000)
    return FidelityRow(
        name, quantity, "", "m", 50.0, 50.0, distance, noise=noise, verdict="" if name == NAMES[-1] else verdict
    )


def costs() -> list[FidelityRow]:
    return [
        FidelityRow(name, "cpu_per_log", "", "ms", cost) for name, cost in zip(NAMES, (1.0, 4.0, 16.0), strict=True)
    ]


def advice(*rows: FidelityRow, n_logs: int = 1000, available: int = 1000, planned: int = 1000):
    return recommend([*costs(), *rows], NAMES, n_logs, available, planned)


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (-0.010, 0.018, WITHIN),
        (-0.020, 0.020, WITHIN),  # |difference| + half-width <= noise holds with equality
        (-0.021, 0.010, UNDECIDED),
        (0.010, 0.030, UNDECIDED),
        (0.019, 0.050, UNDECIDED),
        (0.021, 0.050, BEYOND),
        (-0.050, -0.021, BEYOND),
        (-1.0, 1.0, UNDECIDED),
    ],
)
def test_the_interval_of_a_difference_against_a_noise_of_two_points(low, high, verdict):
    assert verdict_of_interval(low, high, 0.02) == verdict


def test_a_distance_against_that_of_two_halves():
    """Halves of 1000 logs lie 2 m apart: a run of 1000 lies 1 m from the truth, two such runs 1.41 m apart."""
    assert verdict_of_distance(0.99, 2.0, 1000, 1000) == (WITHIN, 1.0)
    assert verdict_of_distance(1.01, 2.0, 1000, 1000)[0] == UNDECIDED
    assert verdict_of_distance(2.40, 2.0, 1000, 1000)[0] == UNDECIDED  # 1.41 m of it may be chance
    assert verdict_of_distance(2.42, 2.0, 1000, 1000)[0] == BEYOND
    assert verdict_of_distance(0.99, 2.0, 1000, 4000) == (UNDECIDED, 0.5)
    assert verdict_of_distance(0.0, 0.0, 1000, 1000) == (WITHIN, 0.0)
    assert verdict_of_distance(1.0, math.nan, 1, 1000)[0] == UNDECIDED


def test_the_cheapest_that_is_within_is_recommended():
    every = advice(reach("draft", 0.001, 0.01), reach("standard", 0.0, 0.01), reach("fine", 0.0, 0.0))
    assert every.fidelity == "draft"
    assert every.sentence.startswith("Recommended: draft, the cheapest")
    assert "+0.1 points (-0.9 to +1.1), noise ±2" in every.sentence
    assert "1 ms of CPU time per log against 16 ms at fine" in every.sentence
    second = advice(reach("draft", 0.015, 0.01), reach("standard", 0.005, 0.01), reach("fine", 0.0, 0.0))
    assert second.fidelity == "standard"
    assert second.verdicts == {"draft": UNDECIDED, "standard": WITHIN}


def test_every_line_counts():
    rows = [reach(name, 0.0, 0.01) for name in NAMES]
    house = [reach("draft", 0.05, 0.01, line="house"), reach("standard", 0.0, 0.01, line="house")]
    assert advice(*rows).fidelity == "draft"
    assert advice(*rows, *house).fidelity == "standard"
    assert advice(*rows, *house).verdicts["draft"] == BEYOND


def test_with_lines_the_distances_do_not_decide():
    rows = [reach(name, 0.0, 0.01) for name in NAMES]
    assert advice(*rows, *(apart(name, 9.0) for name in NAMES[:2])).fidelity == "draft"
    assert advice(*rows).judged_by == "reach of lines"


def test_a_line_that_all_or_none_reach_is_left_out():
    silent = [FidelityRow(name, "reach", "far", "1", 0.0, 0.0, 0.0, -0.004, 0.004, 0.001, UNDECIDED) for name in NAMES]
    rows = [reach(name, 0.0, 0.01) for name in NAMES]
    assert advice(*rows, *silent).fidelity == "draft"
    assert advice(*rows, *silent).silent_lines == ["far"]
    alone = advice(*silent, apart("draft", 1.2), apart("standard", 0.5), apart("fine", 0.0))
    assert (alone.fidelity, alone.judged_by) == ("standard", "deposit distance and hit raster")
    once = [silent[0], *(reach(name, 0.0, 0.01, line="far") for name in NAMES[1:])]  # some logs reach it at standard
    assert advice(*rows, *once).silent_lines == []
    assert advice(*rows, *once).fidelity == "standard"


def test_without_lines_both_distances_count():
    deposits = [apart("draft", 0.5), apart("standard", 0.5), apart("fine", 0.0)]
    maps = [apart("draft", 5.0, "hit_raster_distance"), apart("standard", 0.9, "hit_raster_distance")]
    assert advice(*deposits).fidelity == "draft"
    assert advice(*deposits, *maps).fidelity == "standard"
    assert "hit rasters 0.9 apart" in advice(*deposits, *maps).sentence


def test_too_thin_to_recommend():
    """Half-width 4 points, noise 2 points, difference 0: four times the logs would do."""
    rows = [reach("draft", 0.01, 0.04), reach("standard", 0.0, 0.04), reach("fine", 0.0, 0.0)]
    thin = advice(*rows)
    assert thin.fidelity is None
    assert thin.logs_needed == 4000
    assert thin.sentence.startswith("Too few logs to recommend a fidelity: 1000 logs do not decide whether standard")
    assert (
        "Compare about 4000 logs (the layer has 1000: release more, and keep the reference with --planned-logs 1000)"
        in (thin.sentence)
    )
    assert "until then fine is the safe choice" in thin.sentence
    assert "release more" not in advice(*rows, available=20_000).sentence
    hopeless = advice(*(reach(name, 0.025, 0.04) for name in NAMES[:2]))  # no number of logs can show what is false
    assert (hopeless.fidelity, hopeless.logs_needed) == (None, None)
    assert "Compare more logs" in hopeless.sentence


def test_the_finest_when_all_others_are_shown_to_err():
    rows = [reach("draft", 0.08, 0.01), reach("standard", 0.04, 0.01), reach("fine", 0.0, 0.0)]
    assert advice(*rows).fidelity == "fine"
    assert "the finest compared: all others have an error larger" in advice(*rows).sentence
    open_one = [reach("draft", 0.08, 0.01), reach("standard", 0.01, 0.03), reach("fine", 0.0, 0.0)]
    assert advice(*open_one).fidelity is None
    assert "whether standard has an error" in advice(*open_one).sentence


def test_a_handful_of_logs_recommends_nothing():
    rows = [reach(name, 0.0, 0.0) for name in NAMES]
    few = advice(*rows, n_logs=LEAST_LOGS - 1)
    assert few.fidelity is None
    assert few.sentence.startswith("Too few logs")
    assert advice(*rows, n_logs=LEAST_LOGS).fidelity == "draft"
