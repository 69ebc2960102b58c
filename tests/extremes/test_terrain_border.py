"""Where the terrain ends: nothing rests in the ground into which it came from beyond the border; depths are given."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, Scene, slide
from deadwood_engine.limits import BURIED

CELL, SIDE, SLOPE = 1.0, 40, np.tan(np.radians(35.0))


def heights():
    """35 degrees down to the south and slightly rough; a stripe of 3 m without data across the middle."""
    y, _ = np.mgrid[0 : SIDE + 1, 0 : SIDE + 1] * CELL
    found = SLOPE * y + np.random.default_rng(1).normal(0.0, 0.05, y.shape)
    found[18:21] = np.nan
    return found


def at_the_border(at, fidelity):
    """400 logs that tumble about the DEM's edges and a stripe without data, let fall upright and tilted from up to 6 m.

    Of those that stay: how deep points of their surface lie in the ground [m], how deep the engine says that they were
    at most, and their radius. The check looks at other points than the contacts do: they differ by a centimetre here.
    """
    number, rng = 400, np.random.default_rng(3)
    grid = heights()
    scene = Scene.prepare(grid, CELL, 0.0, 0.0, friction=0.8)
    x, y = rng.uniform(1.0, SIDE - 1.0, (2, number))
    at_edge = np.arange(number) % 2 == 0
    x[at_edge] = rng.choice([0.0, SIDE], at_edge.sum()) + rng.uniform(-1.0, 1.0, at_edge.sum())
    x = np.clip(x, 0.3, SIDE - 0.3)
    ground = np.isfinite(scene.terrain_height(x, y))
    x, y = x[ground], y[ground]
    number = len(x)
    logs = Logs(
        np.arange(number), x, y, rng.uniform(0.2, 0.7, number), rng.uniform(6.0, 25.0, number), np.full(number, 300.0),
        np.zeros(number, np.int8), rng.uniform(0.0, 0.6, number), rng.uniform(0.0, 2 * np.pi, number),
        rng.uniform(0.0, 5.0, number), rng.uniform(0.0, 6.0, number),
    )  # fmt: skip
    result = slide(scene, logs, FIDELITIES[fidelity], time_limit=40.0, threads=2)
    stays = result.stop_reason != STOP_REASONS.index("left_dem")
    assert 20 < stays.sum() < number - 50
    radius = 0.5 * logs.diameter
    deep = at.sunk_each(scene, result.base_end, result.tip_end, radius, 0.5 * radius)
    return deep[stays], result.penetration_max[stays], radius[stays]


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
def test_no_log_rests_buried_at_the_border(at, fidelity):
    """Before, of logs that tipped over the edge some came to rest with an end up to 16 m below the surface."""
    deep, _, radius = at_the_border(at, fidelity)
    assert (deep <= BURIED * radius + 0.02).all()


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
def test_depths_at_the_border_are_reported(at, fidelity):
    """Before, those that came to rest 16 m deep were told to be 2 cm deep; and a log that hung over the border sank in
    between two rings, one beyond and one on this side of it, neither of which took the border for a crest.
    """
    deep, told, _ = at_the_border(at, fidelity)
    assert (deep <= told + 0.02).all()
