"""The layer of effects, row by row against what was counted, and which logs a candidate could matter to."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely

from deadwood_algorithms.evaluate.protection.effect import Effect
from deadwood_algorithms.evaluate.protection.effect_layer import frame_of
from deadwood_algorithms.evaluate.protection.near_candidates import farthest_listed
from deadwood_algorithms.evaluate.protection.obstacles import BARRIER, TREE, Obstacle
from deadwood_engine import FIDELITIES
from deadwood_engine.fidelity import longest_travel, trace_step
from deadwood_engine.limits import NEAR_MARGIN

TOTAL = 40


def effects(seed: int) -> list[Effect]:
    """Random possible counts of three obstacles at two lines."""
    rng = np.random.default_rng(seed)
    found = []
    for number, kind in enumerate((TREE, TREE, BARRIER)):
        thing = Obstacle(kind, f"{kind} {number}", float(number), 0.0, np.array([number]), shapely.Point(number, 0))
        for line in ("road", "rail"):
            lost, gained, unseen, unseen_now, held = (int(each) for each in rng.integers(0, 6, 5))
            found.append(Effect(thing, line, TOTAL, 20, lost, gained, unseen, unseen_now, held, float(number)))
    return found


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("seed", range(3))
def test_a_gain_is_of_the_logs_that_the_obstacle_keeps_away(seed, sign):
    """If it is removed (1), its effect is the logs that reach more; if added (-1), those that reach less. An interval's
    ends change places with the sign, and the bounds from lost logs enclose the gain."""
    found = effects(seed)
    layers: Any = SimpleNamespace(dem=SimpleNamespace(plan_crs=pyproj.CRS("EPSG:2056")))
    frame = frame_of(found, layers, "n_reach_changed", sign)
    by_key = {(each.obstacle.id, each.line_id): each for each in found}
    assert len(frame) == len(found)
    for _, row in frame.iterrows():
        one = by_key[row["id"], row["line_id"]]
        assert row["n_reach_changed"] == one.n_reach - one.lost + one.gained
        assert row["gain_logs"] == sign * (row["n_reach_changed"] - row["n_reach"])
        assert row["gain_p"] == pytest.approx(row["gain_logs"] / TOTAL)
        assert row["ci_low"] <= row["gain_p"] <= row["ci_high"]
        ends = sorted(sign * each for each in one.gain()[1:])
        assert [row["ci_low"], row["ci_high"]] == ends
        more, less = one.unseen_now, one.unseen  # of the lost logs, those that may reach only in the one scene
        outer = [gain / TOTAL for gain in (one.gained - one.lost - less, one.gained - one.lost + more)]
        assert [row["gain_p_low_if_lost"], row["gain_p_high_if_lost"]] == sorted(sign * each for each in outer)
        assert (row["geometry"].x, row["stopped"]) == (one.obstacle.x, one.stopped)
    for _, rows in frame.groupby(["line_id", "kind"]):
        assert rows["rank"].tolist() == list(range(1, len(rows) + 1))
        assert rows["gain_logs"].is_monotonic_decreasing


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("cell", [0.25, 0.5, 2.0])
def test_what_the_engine_lists_is_near_a_kept_pose(fidelity, cell):
    """A random walk in steps of the longest travel: a pose is stored as soon as the point is a trace step away
    from the last one, and an object is listed from any pose and from the predicted one.
    """
    row, rng = FIDELITIES[fidelity], np.random.default_rng(4)
    step, apart, far = longest_travel(row, cell), trace_step(row, cell), farthest_listed(row, cell)
    turn = np.cumsum(rng.normal(0.0, 0.3, (200, 60)), axis=1)
    walk = np.cumsum(step * np.stack([np.cos(turn), np.sin(turn)], axis=2), axis=1)
    worst = 0.0
    for way in walk:
        kept = [0]
        for k in range(1, len(way) - 1):
            if np.hypot(*(way[k + 1] - way[kept[-1]])) > apart:  # the next would be too far from the last kept one
                kept.append(k)
        here, ahead = way[:-1], way[1:]
        side = (ahead - here) / np.hypot(*(ahead - here).T)[:, None]
        for reach in (side, side @ np.array([[0.0, 1.0], [-1.0, 0.0]])):  # things straight ahead, and abreast
            things = ahead + NEAR_MARGIN * reach
            distance = np.hypot(*(things[:, None] - way[kept][None]).transpose(2, 0, 1)).min(axis=1)
            worst = max(worst, float(distance.max()))
    assert NEAR_MARGIN < worst <= far
    assert far - worst < apart + 3.0 * step + 0.05, "no margin beside what a step and a trace step may be"
