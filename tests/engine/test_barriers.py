"""Plates: whether one goes through a log's axis, how its pieces follow the ground, where they stand."""

import numpy as np
import pytest

from deadwood_engine import Barriers, Scene
from deadwood_engine.barriers import Plate, deepest_below_edge, pierced
from deadwood_engine.cores import CORE
from deadwood_engine.log_body import CENTRE, LENGTH, cone_bodies


def plates(heights, *lines, height=2.0, cell=1.0):
    vertices = np.vstack([np.asarray(each, float) for each in lines])
    starts = np.append(0, np.cumsum([len(each) for each in lines]))
    barriers = Barriers(vertices, starts, np.full(len(lines), height))
    return Scene.prepare(heights, cell, 0.0, 0.0, friction=0.3, barriers=barriers)


def test_the_top_edge_follows_the_ground_at_its_height():
    rng = np.random.default_rng(4)
    scene = plates(rng.uniform(0.0, 3.0, (40, 40)), [(3.3, 5.1), (33.7, 28.2), (35.0, 10.0)])
    cores, reference = scene.arrays.cores, scene.arrays.terrain.reference
    for share in (0.0, 1.0):
        x, y = (cores.node + np.column_stack([cores.solid.x, cores.solid.y])).T
        x, y = x + share * cores.solid.long * cores.solid.ux, y + share * cores.solid.long * cores.solid.uy
        z = cores.solid.z + share * cores.solid.long * cores.solid.uz + reference
        assert z == pytest.approx(scene.terrain_height(x, y) + 2.0, abs=1e-5)
    assert cores.solid.long.max() < 2 * max(2.0, 4.0)


def test_posts_stand_at_ends_and_bends_and_not_within_a_straight_stretch():
    """20 m along x, then 8 m along y: pieces of 4 m, posts at both ends and at the bend alone."""
    solid = plates(np.zeros((40, 40)), [(5, 5), (25, 5), (25, 13)]).arrays.cores.solid
    assert len(solid) == 7
    assert solid.first_post.tolist() == [1, 0, 0, 0, 0, 1, 0]
    assert solid.last_post.tolist() == [0, 0, 0, 0, 1, 0, 1]
    assert solid.after.tolist() == [1, 1, 1, 1, 1, 1, 0]
    before = np.column_stack([solid.before_x, solid.before_y, solid.before_z])
    assert before[0].tolist() == [0, 0, 0]  # a free end
    assert before[5] == pytest.approx([-1, 0, 0])  # at the bend the piece before goes away to the west


def test_off_the_terrain_a_barrier_loses_a_part_or_is_none():
    heights = np.zeros((40, 40))
    heights[:, 20:] = np.nan
    scene = plates(heights, [(30, 5), (38, 5)], [(5, 5), (35, 5)])
    assert scene.barriers_outside.tolist() == [0]
    cores = scene.arrays.cores
    assert set(cores.solid.owner.tolist()) == {1}
    assert (cores.node[:, 0] + cores.solid.x + cores.solid.long).max() <= 19.0


def test_pierced_is_what_a_dense_search_finds():
    """A point of the axis on either side of the plate's plane, below the edge and between the plate's ends."""
    told = {True: 0, False: 0}
    for seed in range(400):
        rng = np.random.default_rng(seed)
        solid = cone_bodies(np.array([0.4]), np.array([10.0]), np.array([300.0]))[0]
        rise = rng.uniform(-0.5, 0.5)
        heading = rng.uniform(0, 2 * np.pi)
        unit = np.array([np.cos(heading), np.sin(heading), rise]) / np.hypot(1.0, rise)
        long, start = rng.uniform(1.0, 6.0), rng.uniform(-2.0, 2.0, 3)
        edge = np.zeros(1, CORE).view(np.recarray)[0]
        (edge.x, edge.y, edge.z), (edge.ux, edge.uy, edge.uz), edge.long = start, unit, long
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        state = np.zeros(16)
        state[0:3], state[13:16] = rng.uniform(-3, 3, 3), axis
        points = state[0:3] + np.linspace(-solid[CENTRE], solid[LENGTH] - solid[CENTRE], 20_001)[:, None] * axis
        level = unit[:2] / np.hypot(*unit[:2])
        along = (points[:, :2] - start[:2]) @ level
        off = (points[:, 1] - start[1]) * level[0] - (points[:, 0] - start[0]) * level[1]
        change = np.flatnonzero(off[:-1] * off[1:] <= 0.0)
        expected = False
        if change.size:
            k = change[0]
            margin = min(along[k], long * np.hypot(*unit[:2]) - along[k], start[2] + rise * along[k] - points[k, 2])
            if abs(margin) < 5e-3:
                continue  # too near to tell by points
            expected = margin > 0.0
        assert pierced(solid, state, edge) == expected
        told[expected] += 1
    assert min(told.values()) > 20


def test_deepest_point_of_a_face_below_the_top():
    """Of a dense disc's points below a level top, the one deepest against the plate; none of a face that hangs over it:
    its centre is on its own side, and it crosses the plate's plane above the top.
    """
    told = {True: 0, False: 0}
    for seed in range(400):
        rng = np.random.default_rng(seed)
        centre, axis, a = rng.uniform(-0.4, 0.4, 3), rng.standard_normal(3), 0.5
        axis /= np.linalg.norm(axis)
        turn = rng.uniform(0, 2 * np.pi)
        normal, along = np.array([np.cos(turn), np.sin(turn), 0.0]), (-np.sin(turn), np.cos(turn))
        side = np.cross(axis, normal)
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        angle = np.linspace(0, 2 * np.pi, 721)
        ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other
        disc = (centre + a * np.linspace(0, 1, 101)[:, None, None] * ring).reshape(-1, 3)
        below = disc[:, 2] <= 0.0
        plate = Plate(0.0, 0.0, 0.0, along[0], along[1], 0.0, np.inf)
        found, p = deepest_below_edge(tuple(centre), tuple(axis), a, tuple(normal[:2]), plate)
        off = centre @ normal
        in_plane = np.abs(disc @ normal) < 0.005
        if off >= 0.0 and in_plane.any():
            lowest = disc[in_plane, 2].min()
            if abs(lowest) < 0.02:
                continue  # too near to tell by points
            if lowest > 0.0:
                assert not found
                told[False] += 1
                continue
        if abs(disc[:, 2].min()) < 0.01:
            continue  # too near to tell by points
        assert found == below.any()
        if found:
            assert p[2] <= 1e-9
            assert np.array(p) @ normal == pytest.approx((disc[below] @ normal).min(), abs=0.01)
            assert np.linalg.norm(p - centre) == pytest.approx(a, abs=1e-9)
        told[bool(found)] += 1
    assert min(told.values()) > 20
