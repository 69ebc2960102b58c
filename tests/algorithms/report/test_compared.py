"""The table of paired differences between runs."""

import re
from types import SimpleNamespace

import pytest

from deadwood_algorithms.report.compared import comparison_table
from deadwood_algorithms.report.words import Words

NONE = float("nan")


def row(scenario, value, difference=NONE, ends=(NONE, NONE), diff_ends=(NONE, NONE)):
    return SimpleNamespace(
        scenario=scenario, quantity="speed_max", item="", unit="m/s", value=value, difference=difference,
        ci_low=ends[0], ci_high=ends[1], diff_ci_low=diff_ends[0], diff_ci_high=diff_ends[1], n_more=0,
    )  # fmt: skip


def test_a_difference_has_its_own_interval():
    """Of paired runs it is far narrower than that of the value beside it."""
    rows = [row("a", 12.0, ends=(9.0, 14.0)), row("b", 15.5, 3.5, ends=(11.0, 19.0), diff_ends=(3.1, 4.2))]
    found = str(comparison_table(rows, ["a", "b"], Words("en")))
    assert re.findall(r"\(.*? to .*?\)", found) == ["(9.0 to 14.0)", "(11.0 to 19.0)", "(+3.10 to +4.20)"]


@pytest.mark.parametrize(
    ("values", "shown"),
    [((1053.21, 1026.18), ("1053", "1026", "−27")), ((12.345, 13.0), ("12.35", "13.00", "+0.65"))],
)
def test_values_without_intervals_and_their_difference_agree_to_the_last_digit_shown(values, shown):
    one, other = values
    found = str(comparison_table([row("a", one), row("b", other, other - one)], ["a", "b"], Words("en")))
    for each in shown:
        assert f">{each}<" in found
