"""How deep logs sink into rough ground while they slide and where they jam, on cells of every size: a stated part of
their diameter."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Logs, Scene, slide

# [-] of the diameter, what engine/README.md says
SINKS = {"draft": 1.0, "standard": 0.5}


@pytest.mark.parametrize("cell", [0.5, 1.0, 2.0, 5.0, 10.0])
@pytest.mark.parametrize("fidelity", SINKS)
def test_no_log_sinks_deeper_than_is_reported(at, fidelity, cell):
    """150 logs of 20 to 80 cm on 35 degrees with white noise of a tenth of a cell, which turns the ground by 11 degrees
    from cell to cell in the mean. 976 points of each log's surface, at every pose that the trace sees."""
    number, rng = 150, np.random.default_rng(5)
    side = max(60.0, 24.0 * cell)
    y, _ = np.mgrid[0 : round(side / cell) + 1, 0 : round(side / cell) + 1] * cell
    heights = np.tan(np.radians(35.0)) * y + 0.1 * cell * rng.standard_normal(y.shape)
    scene = Scene.prepare(heights, cell, 0.0, 0.0, friction=0.12, reference=0.0)
    logs = Logs(
        np.arange(number), rng.uniform(0.2 * side, 0.8 * side, number), rng.uniform(0.6 * side, 0.9 * side, number),
        rng.uniform(0.2, 0.8, number), rng.uniform(5.0, 20.0, number), np.full(number, 300.0),
        rng.integers(0, 2, number).astype(np.int8), np.zeros(number), rng.uniform(0.0, 2 * np.pi, number),
        np.zeros(number), np.zeros(number),
    )  # fmt: skip
    row = FIDELITIES[fidelity]._replace(trace_cells=1.0, trace_spacing=1.0)
    result = slide(scene, logs, row, time_limit=20.0, threads=2, keep_poses=np.ones(number, bool))
    poses, radius = result.poses, 0.5 * logs.diameter[result.poses.log_row]
    deep = at.sunk_each(scene, poses.base, poses.tip, radius, 0.5 * radius) / (2.0 * radius)
    assert result.speed_max.max() > 8.0
    assert deep.max() < SINKS[fidelity]


@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_no_log_sinks_while_it_jams(at, fidelity):
    """4000 logs of 20 m that come to rest on humps of 20 cm, many of them slowly, jammed between these: the deepest of
    976 points of each log's surface where it rests.

    Deeper than 20 cm lie, with four seeds, 12, 22, 15 and 15 logs at `draft` and 3, 3, 8 and 1 at `standard`, the
    deepest 33 and 29 cm. With one point a ring at every speed there were 35 with this seed. The bounds are three
    standard deviations above the mean of the four.
    """
    number, rng = 4000, np.random.default_rng(5)
    noise = rng.standard_normal((121, 121))
    humps = 0.5 * sum(np.roll(noise, shift, (0, 1)) for shift in ((0, 0), (0, 1), (1, 0), (1, 1)))
    heights = np.tan(np.radians(8.0)) * 0.5 * np.arange(121)[:, None] + 0.2 * humps
    scene = Scene.prepare(heights, 0.5, 0.0, 0.0, friction=0.2, reference=0.0)
    zeros = np.zeros(number)
    logs = Logs(
        np.arange(number), rng.uniform(18.0, 42.0, number), rng.uniform(25.0, 45.0, number), np.full(number, 0.75),
        np.full(number, 20.0), np.full(number, 300.0), np.ones(number, np.int8), zeros,
        rng.uniform(0.0, 2 * np.pi, number), zeros, zeros,
    )  # fmt: skip
    result = slide(scene, logs, FIDELITIES[fidelity], time_limit=120.0, threads=2, keep_poses=np.ones(number, bool))
    poses, last = result.poses, np.flatnonzero(np.diff(result.poses.log_row, append=-1))
    at_ends = np.full(len(last), 0.375), np.full(len(last), 0.1875)
    deep = at.sunk_each(scene, poses.base[last], poses.tip[last], *at_ends)
    assert np.mean(result.duration > 15.0) > 0.005  # some do jam; half of all rest within 3 s
    assert (deep > 0.2).sum() <= {"draft": 28, "standard": 10}[fidelity]
    assert deep.max() < 0.375
