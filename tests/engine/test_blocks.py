"""A boulder: the smallest kind of obstacle, one file and two lines of ``scene``."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Blocks, LyingLogs, Scene, Start, Trees, slide
from deadwood_engine.log_body import CENTRE, LENGTH, cone_bodies
from deadwood_engine.rotation import quaternion_from_axis


def blocks(x, y, diameter, height):
    return Blocks(*(np.atleast_1d(np.asarray(v, float)) for v in (x, y, diameter, height)))


def shot(scene, solid, axis, centre, velocity):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    terrain = scene.arrays.terrain
    frame = np.floor((np.array([centre[:2]]) - (terrain.x0, terrain.y0)) / terrain.cell).astype(np.int64)
    state = np.zeros((1, 16))
    state[0, :2] = np.array(centre[:2]) - (terrain.x0, terrain.y0) - frame[0] * terrain.cell
    state[0, 2] = centre[2] - terrain.reference
    state[0, 3:7] = quaternion_from_axis(axis[None])[0]
    state[0, 7:10], state[0, 13:16] = velocity, axis
    return Start(frame, state, solid)


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
def test_a_boulder_stops_what_comes_head_on(fidelity):
    """A flat end meets a boulder of 2 m, its middle on the axis: stopped there, a hit like a tree's, counted after
    trees and lying logs."""
    trees = Trees(np.array([40.0]), np.array([40.0]), np.array([0.4]), np.array([20.0]))
    lying = LyingLogs(np.array([[40.0, -40.0], [45.0, -40.0]]), np.array([0, 2]), np.array([0.4]), np.array([0.4]))
    scene = Scene.prepare(
        np.zeros((121, 121)), 1.0, -60, -60, friction=0.0, trees=trees, lying_logs=lying,
        blocks=blocks(10.0, 0.0, 2.0, 2.0),
    )  # fmt: skip
    solid = cone_bodies(np.array([0.75]), np.array([10.0]), np.array([300.0]))
    front = solid[0, LENGTH] - solid[0, CENTRE]
    begin = shot(scene, solid, (1, 0, 0), (5.0 - front, 0.0, 1.0), (20, 0, 0))
    result = slide(scene, begin, FIDELITIES[fidelity], time_limit=0.4, gravity=0.0)
    assert result.tip_end[0, 0] == pytest.approx(9.0, abs=0.01)
    assert abs(result.last_state[0, 7]) < 0.01
    assert result.overlap_max[0] < 0.01
    assert result.hits.item.tolist() == [2]


def test_a_log_rests_on_the_slope_against_a_boulder():
    """35 degrees, mu 0.25: held by two boulders, and the reason says by which."""
    tangent = np.tan(np.radians(35))
    heights = tangent * np.arange(-60.0, 61.0)[:, None] * np.ones(121)
    scene = Scene.prepare(
        heights, 1.0, -60, -60, friction=0.25, blocks=blocks([-3.0, 3.0], [-10.0, -10.0], [1.0, 1.5], [0.8, 1.0])
    )
    solid = cone_bodies(np.array([0.4]), np.array([10.0]), np.array([300.0]))
    begin = shot(scene, solid, (1, 0, 0), (0.0, -5.0, -5.0 * tangent + 0.3), (0, 0, 0))
    result = slide(scene, begin, FIDELITIES["standard"], time_limit=60.0)
    assert STOP_REASONS[result.stop_reason[0]] == "block"
    assert result.stop_item[0] in (0, 1)
    assert result.tree_hits[0] == 2
    assert result.overlap_max[0] < 0.01


def test_a_boulder_must_be_one_and_lie_on_terrain():
    heights = np.zeros((21, 21))
    gone = Scene.prepare(heights, 1.0, 0, 0, friction=0.3, blocks=blocks([5.0, 50.0], [5.0, 5.0], 1.0, 0.5)._replace(
        diameter=np.ones(2), height=np.full(2, 0.5)
    ))  # fmt: skip
    assert gone.blocks_outside.tolist() == [1]
    with pytest.raises(ValueError, match="block's diameter"):
        Scene.prepare(heights, 1.0, 0, 0, friction=0.3, blocks=blocks(5.0, 5.0, -1.0, 0.5))
