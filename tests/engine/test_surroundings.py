"""What a log knows of its surroundings, and that none of it passes to the next one."""

import numpy as np
import pytest

from deadwood_engine.surroundings import NEAR, POSE, know_nothing


@pytest.mark.parametrize("kind", [NEAR, POSE])
def test_no_field_hides_behind_a_method(kind):
    assert not set(kind.names) & set(dir(np.record))


def test_all_is_forgotten_but_where_the_list_was_made_for():
    """Nothing is listed, nothing sleeps, and nothing is said to be clear; the ends are renewed with the list."""
    near = np.ones(1, NEAR).view(np.recarray)[0]
    know_nothing(near)
    told = {name: near[name].item() for name in NEAR.names or ()}
    assert {name for name, value in told.items() if value == 1} == {"base_x", "base_y", "tip_x", "tip_y"}
    assert told["thin"] == -1
    assert not told["listed"]
    assert {told[name] for name in ("cores", "beside", "obstacles_wake", "clear")} == {0}
