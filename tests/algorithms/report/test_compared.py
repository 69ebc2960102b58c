"""The table of paired differences between runs."""

from types import SimpleNamespace

import pytest

from deadwood_algorithms.report.compared import comparison_table
from deadwood_algorithms.report.words import Words

NONE = float("nan")


def row(scenario, value, difference=NONE):
    return SimpleNamespace(
        scenario=scenario, quantity="speed_max", item="", unit="m/s", value=value, difference=difference,
        ci_low=NONE, ci_high=NONE, diff_ci_low=NONE, diff_ci_high=NONE, n_more=0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("values", "shown"),
    [((1053.21, 1026.18), ("1053", "1026", "−27")), ((12.345, 13.0), ("12.35", "13.00", "+0.65"))],
)
def test_values_without_intervals_and_their_difference_agree_to_the_last_digit_shown(values, shown):
    one, other = values
    found = str(comparison_table([row("a", one), row("b", other, other - one)], ["a", "b"], Words("en")))
    for each in shown:
        assert f">{each}<" in found
