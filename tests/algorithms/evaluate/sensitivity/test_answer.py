"""The sentence, for outcomes made by hand: one factor, two that cannot be distinguished, none."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from deadwood_algorithms.evaluate.sensitivity.answer import Measured, most_influential, order_of_strength
from deadwood_algorithms.evaluate.sensitivity.factors import factors_of
from deadwood_algorithms.evaluate.sensitivity.indices import Indices, weights_of
from deadwood_algorithms.evaluate.sensitivity.tables import index_rows, lines_of, order_of_factors, tornado_rows
from deadwood_algorithms.evaluate.sensitivity.tornado import bars_of
from deadwood_algorithms.evaluate.sensitivity.tornado_figure import TOTAL, bars, indices
from deadwood_algorithms.files.pictures import show_ends
from deadwood_algorithms.stats.statistics import wilson_interval

FACTORS = factors_of("friction=0.2:0.3,rolling_friction,log_density_factor")
LOGS = 200
FACTS = {"runs": 7, "logs": LOGS, "logs_in_layer": 900, "fidelity": "draft", "sentence": ""}


def measured(*highs: int, share: bool = True) -> Measured:
    """100 of 200 logs reach with nothing varied and at low ends; at the high ends fewer by these numbers."""
    values = np.tile(np.arange(LOGS) < 100, (1 + 2 * len(FACTORS), 1)).astype(float)
    rng = np.random.default_rng(1)
    for k, less in enumerate(highs):
        values[2 + 2 * k, rng.permutation(100)[:less]] = 0.0
    bars = bars_of(FACTORS, values, weights_of(np.arange(LOGS), 0), share=share)
    return Measured("reach_road" if share else "runout_mean_m", "road" if share else "", bars, None)


def test_one_factor():
    told = most_influential(measured(60, 5, 0), LOGS)
    assert told.factors == ["friction"]
    assert told.decided
    assert told.sentence == (
        "The most influential input is friction: 0.2 to 0.3 takes the reach of road from 50.0 % to 20.0 %, "
        "-30.0 points (-36.7 to -24.1)."
    )


def test_two_that_cannot_be_distinguished():
    told = most_influential(measured(30, 32, 0), LOGS)
    assert set(told.factors) == {"friction", "rolling_friction"}
    assert not told.decided
    assert (
        "the number of logs (200) is too small to decide which of them changes the reach of road more" in told.sentence
    )


def test_none():
    told = most_influential(measured(1, 2, 0), LOGS)
    assert told.factors == []
    assert not told.decided
    assert told.sentence.startswith(
        "The number of logs (200) is too small to decide which input influences the reach of road most"
    )
    assert "The largest change is that of rolling friction, -1.0 points" in told.sentence


def test_a_mean_in_metres():
    one = measured(60, 5, 0, share=False)
    told = most_influential(one, LOGS)
    assert "takes the mean run-out from 0.500 m to 0.200 m, -0.300 m (-0.3" in told.sentence
    assert one.change(one.bars[2]) == "0 m (no log changes)"


def test_enough_factors_are_named_that_one_of_them_is_the_strongest():
    draws = np.array([[3.0, 1.0, 0.0]] * 90 + [[1.0, 2.0, 0.0]] * 7 + [[0.0, 1.0, 2.0]] * 3)
    assert order_of_strength([0, 1, 2], draws) == [0, 1]
    assert order_of_strength([0, 1, 2], draws[:90]) == [0]
    assert order_of_strength([1, 2], draws[:90]) == [1]
    assert order_of_strength([0, 1], np.full((4, 3), np.nan)) == [0, 1]


def indexed(total: list[float], low: list[float], high: list[float], scatter: float) -> Indices:
    """Indices by hand, with this scatter of their resamples."""
    ends, none = np.array([low, high]), np.full(3, np.nan)
    draws = np.array(total) + scatter * np.random.default_rng(2).standard_normal((400, 3))
    pair = np.full((2, 3), np.nan)
    return Indices(0.4, 0.01, 0.005, 0.02, none, pair, np.array(total), ends, draws, np.zeros(3, bool))


def test_the_indices_decide_where_there_are_some():
    """The swing of friction is larger, but over all ranges rolling friction has the larger part."""
    bars = measured(60, 40, 0).bars
    told = most_influential(
        Measured("reach_road", "road", bars, indexed([0.2, 0.8, 0.0], [0.1, 0.6, 0.0], [0.3, 1.0, 0.1], 0.05)), LOGS
    )
    assert (told.by, told.factors, told.decided) == ("total", ["rolling_friction"], True)
    assert told.sentence.endswith("; its total-effect index is 0.80 (0.60 to 1.00).")
    near = Measured("reach_road", "road", bars, indexed([0.5, 0.6, 0.0], [0.1, 0.2, 0.0], [0.9, 1.0, 0.1], 0.2))
    told = most_influential(near, LOGS)
    assert told.factors == ["rolling_friction", "friction"]
    assert "the number of logs and rows of the design (200) is too small" in told.sentence
    empty = Measured("reach_road", "road", bars, indexed([np.nan] * 3, [np.nan] * 3, [np.nan] * 3, 0.0))
    assert most_influential(empty, LOGS).by == "swing"


def with_indices(first: list[float], total: list[float], crossed: tuple[bool, ...] = (False,) * 3) -> Measured:
    """Friction alone has the largest swing; the indices disagree."""
    one, ends, draws = measured(60, 5, 0), np.array([[0.1] * 3, [1.0] * 3]), np.tile(total, (10, 1))
    known = np.array(first), ends, np.array(total), ends, draws, np.array(crossed)
    return replace(one, indices=Indices(0.4, 0.01, 0.005, 0.02, *known))


def test_every_table_has_the_factors_in_the_order_of_the_picture():
    """By the total index where there is one; before, tables by the swing, and the rows in the order they were asked."""
    one = with_indices([0.1, 0.3, 0.2], [0.2, 0.7, 0.4])
    names = ["rolling_friction", "log_density_factor", "friction"]
    assert [one.bars[k].factor.name for k in one.strongest_first] == names
    order = order_of_factors([one], [most_influential(one, LOGS)])
    assert [row["factor"] for row in tornado_rows([one], order)] == names
    assert [row["factor"] for row in index_rows([one], order)] == names
    assert [row["total"] for row in index_rows([one], order)] == [0.7, 0.4, 0.2]
    shown = lines_of([one], [most_influential(one, LOGS)], FACTS)
    assert [next(k for k, line in enumerate(shown) if line.startswith(f"  {each}")) for each in (
        "rolling friction", "density", "friction")] == [2, 3, 4]  # fmt: skip


def test_every_outcome_has_the_factors_in_one_order():
    """The order of the outcome whose sentence is given for all; before, each outcome had its own."""
    weak, strong = measured(30, 2, 0, share=False), measured(5, 60, 0)
    both, names = [weak, strong], ["rolling_friction", "friction", "log_density_factor"]
    answers = [most_influential(each, LOGS) for each in both]
    rows = tornado_rows(both, order_of_factors(both, answers))
    assert [row["factor"] for row in rows] == 2 * names
    assert weak.strongest_first != strong.strongest_first
    shown = [line.split(" 0.")[0].strip() for line in lines_of(both, answers, FACTS) if line.startswith("  ")]
    assert shown[:3] == shown[3:]
    assert shown[0] == "rolling friction"


def test_a_bar_never_hides_another():
    """Both ends of a range may change the outcome in the same direction, even by the same amount."""
    axes = Figure().subplots()
    show_ends(axes, 0.0, 10.0, 7.0, 7.0)
    show_ends(axes, 1.0, 10.0, 7.0, 12.0)
    boxes = [each.get_bbox() for each in axes.patches]
    assert len(boxes) == 4
    for one, other in combinations(boxes, 2):
        assert min(one.x1, other.x1) <= max(one.x0, other.x0) or min(one.y1, other.y1) <= max(one.y0, other.y0) + 1e-12


def test_the_picture_has_the_factors_in_the_same_order():
    """From the top: bars, and the indices beside them, each of its own factor."""
    one = with_indices([0.1, 0.3, 0.2], [0.2, 0.7, 0.4])
    left, right = Figure().subplots(1, 2)
    bars(left, one, one.strongest_first, most_influential(one, LOGS))
    indices(right, one, one.strongest_first)
    told = [each.get_text().partition("\n")[0] for each in left.get_yticklabels()]
    assert told == ["rolling friction", one.bars[one.strongest_first[1]].factor.words, "friction"]
    totals = [each.get_width() for each in right.patches if each.get_facecolor() == to_rgba(TOTAL)]
    assert totals == [0.7, 0.4, 0.2]
    assert left.get_ylim()[0] > left.get_ylim()[1]


def test_indices_that_were_crossed_are_said_to_be_one_mean():
    """Before: 1.00 beside 0.86 without a word."""
    one = with_indices([0.93, 0.3, 0.2], [0.93, 0.3, 0.4], (True, False, False))
    assert [row["crossed"] for row in index_rows([one], [0, 1, 2])] == [True, False, False]
    told = "\n".join(lines_of([one], [most_influential(one, LOGS)], FACTS))
    assert "total-effect index 0.93 (0.10 to 1.00) (with the first-order one, estimated above it by chance" in told
    assert told.count("above it") == 1


def test_as_it_is_says_of_which_logs_and_at_which_fidelity():
    told = lines_of([measured(60, 5, 0)], [most_influential(measured(60, 5, 0), LOGS)], FACTS)
    assert told[0].startswith("7 runs of the same 200 of 900 logs at draft; ")
    low, high = (100.0 * each for each in wilson_interval(100, 200))
    assert told[1] == f"the reach of road: 50.0 % ({low:.1f} to {high:.1f} %) as it is"


def test_a_change_beyond_chance_is_not_denied_where_no_index_is():
    """Before: "no factor changes it beyond chance ... friction, -27 points (-40 to -14)"; and the largest change was
    attributed to the factor with the largest index.
    """
    one = with_indices([0.0, 0.1, 0.0], [0.1, 0.3, 0.0])
    assert one.indices is not None
    unsure = replace(one, indices=replace(one.indices, total_interval=np.array([[0.0] * 3, [1.0] * 3])))
    told = most_influential(unsure, LOGS)
    assert (told.by, told.factors, told.decided) == ("total", [], False)
    assert told.sentence.endswith(
        "no total-effect index is beyond chance. The largest change is that of friction alone, which is beyond chance, "
        "-30.0 points (-36.7 to -24.1)."
    )
    still = replace(unsure, bars=measured(1, 2, 0).bars)
    assert "no factor changes it beyond chance. The largest change is that of rolling friction, -1.0" in (
        most_influential(still, LOGS).sentence
    )
