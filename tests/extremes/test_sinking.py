"""How deep logs sink into rough ground while they slide, on cells of every size: a stated part of their diameter."""

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
