"""Nothing passes a lying log: fast, thin, oblique, spinning, at its ends or over its side, at any fidelity.

The check looks at poses only: how deep points of one log's surface lie in the other cone, and whether their axes ever
pass through each other while they cross within both lengths.
"""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, LyingLogs, Scene

EVERY = pytest.mark.parametrize("fidelity", list(FIDELITIES))


def lying(*logs):
    """Lying logs, each ((x, y), (x, y), ..., diameter, tip diameter)."""
    lines = [np.array(log[:-2], float) for log in logs]
    starts = np.cumsum([0, *(len(line) for line in lines)])
    return LyingLogs(np.vstack(lines), starts, *np.array([log[-2:] for log in logs], float).T)


def pieces_of(scene):
    """(start, end, radius, radius) of each piece in the world."""
    terrain, pieces = scene.arrays.terrain, scene.arrays.lying
    plan = pieces.node * terrain.cell + pieces.offset + (terrain.x0, terrain.y0)
    start = np.column_stack([plan, pieces.solid[:, 0] + terrain.reference])
    long, wide = pieces.solid[:, 4], pieces.solid[:, 5]
    return list(
        zip(start, start + long[:, None] * pieces.solid[:, 1:4], wide, wide + pieces.solid[:, 6] * long, strict=True)
    )


def depth_in(points, base, tip, first, last):
    """How deep points lie in cones, (m, k, 3) in (m, 3) to (m, 3): the distance to the nearest way out, at most 0."""
    axis = tip - base
    length = np.linalg.norm(axis, axis=-1, keepdims=True)
    u = axis / length
    r = points - base[:, None]
    z = np.einsum("mkj,mj->mk", r, u)
    aside = np.linalg.norm(r - z[..., None] * u[:, None], axis=-1)
    inside = np.minimum(np.minimum(z, length - z), first + (last - first) * z / length - aside)
    return inside.max(axis=1)


def skin(base, tip, first, last, rings=33, around=12):
    """Points all over cones' sides and ends, (m, k, 3)."""
    axis = (tip - base) / np.linalg.norm(tip - base, axis=-1, keepdims=True)
    side = np.cross(axis, np.where(np.abs(axis[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    other = np.cross(axis, side)
    turn, share = np.linspace(0, 2 * np.pi, around, endpoint=False), np.linspace(0, 1, rings)
    ring = np.cos(turn)[None, :, None] * side[:, None] + np.sin(turn)[None, :, None] * other[:, None]
    centre = base[:, None] + share[None, :, None] * (tip - base)[:, None]
    radius = first + (last - first) * share
    points = [centre[:, :, None] + radius[None, :, None, None] * ring[:, None]]
    points += [centre[:, [k], None] + s * radius[k] * ring[:, None] for k in (0, -1) for s in (0.0, 0.5, 0.8)]
    return np.concatenate([p.reshape(len(base), -1, 3) for p in points], axis=1)


def overlap(scene, begin, result, row, at):
    """Deepest overlap [m] of a log with any piece over its poses."""
    mine = result.poses.log_row == row
    base, tip = result.poses.base[mine], result.poses.tip[mine]
    radii = begin.body[row, at.BASE], begin.body[row, at.TIP]
    worst = 0.0
    for start, end, first, last in pieces_of(scene):
        there = np.repeat([start], len(base), axis=0), np.repeat([end], len(base), axis=0)
        worst = max(worst, depth_in(skin(base, tip, *radii), *there, first, last).max())
        worst = max(worst, depth_in(skin(*there, first, last), base, tip, *radii).max())
    return worst


def changed_sides(scene, begin, result, row):
    """Whether the axes of a log and a piece passed through each other while both nearest points were within."""
    mine = result.poses.log_row == row
    base, tip = result.poses.base[mine], result.poses.tip[mine]
    for start, end, _, _ in pieces_of(scene):
        d, u, g = tip - base, end - start, base - start
        normal = np.cross(d, u)
        square = (normal**2).sum(axis=1)
        side = np.sign((g * normal).sum(axis=1))
        s = -np.einsum("mj,mj->m", np.cross(g, np.broadcast_to(u, g.shape)), normal) / square
        z = -np.einsum("mj,mj->m", np.cross(g, d), normal) / square
        within = (s > 0.03) & (s < 0.97) & (z > 0.03) & (z < 0.97)
        both = within[1:] & within[:-1]
        if (side[1:] != side[:-1])[both].any():
            return True
    return False


def shots(at, scene, solid, number, seed, *, way, height, speeds=(5.0, 80.0), aim=3.0):
    """Logs on their way to x = 0 from the west, at heights up to that of the lying log."""
    rng = np.random.default_rng(seed)
    back, front = solid[0, at.CENTRE], solid[0, at.LENGTH] - solid[0, at.CENTRE]
    starts = []
    for _ in range(number):
        turn = {"head": 0.0, "base": np.pi, "broadside": 0.5 * np.pi}.get(way, rng.uniform(-np.pi, np.pi))
        turn += rng.uniform(-0.3, 0.3)
        lean = rng.uniform(-0.1, 0.1)
        axis = np.array([np.cos(turn) * np.cos(lean), np.sin(turn) * np.cos(lean), np.sin(lean)])
        reach = max(front * axis[0], -back * axis[0]) + solid[0, at.BASE]
        centre = (
            -reach - rng.uniform(1.0, 3.0),
            rng.uniform(-aim, aim),
            solid[0, at.BASE] + rng.uniform(-0.2, 0.8) * height,
        )
        velocity = rng.uniform(*speeds) * np.array([1.0, rng.uniform(-0.4, 0.4), 0.0])
        spin = rng.uniform(-3, 3) * np.array([0, 0, 1.0]) + rng.choice([0.0, 100.0]) * axis
        starts.append(at.start(scene, solid, axis, centre, velocity, spin))
    return at.together(starts)


def run(at, scene, begin, fidelity, **options):
    number = len(begin.state)
    result = at.run(
        scene, begin, fidelity=fidelity, gravity=0.0, keep_poses=np.ones(number, bool),
        **({"time_limit": 0.4, "trace_cells": 0.05} | options),
    )  # fmt: skip
    at.healthy(scene, begin, result, gravity=0.0)
    return result


@EVERY
@pytest.mark.parametrize("way", ["head", "base", "broadside", "anyhow"])
@pytest.mark.parametrize(
    ("log", "thick"),
    [((0.4, 8.0), 0.4), ((0.05, 6.0), 0.03), ((1.2, 10.0), 0.05), ((0.4, 8.0), 2.0), ((0.1, 12.0), 0.1)],
)
def test_a_lying_log_is_not_passed(at, fidelity, way, log, thick):
    """Across the way, thick and thin, hit at any height: over it, or not at all, and never more than a few cm in it."""
    cell = 0.5
    count = 241
    heights = np.full((count, count), -50.0)
    heights[:, 118:123] = 0.0  # a ridge under the lying log, so that shots may come from below too
    scene = Scene.prepare(
        heights, cell, -60, -60, friction=0.25, lying_logs=lying(((0, -12), (0, 12), thick, 0.6 * thick))
    )
    begin = shots(at, scene, at.body(*log), 20, 5, way=way, height=thick)
    result = run(at, scene, begin, fidelity)
    assert (result.tree_hits > 0).sum() >= 5
    thin = min(log[0], thick)
    for row in range(20):
        assert not changed_sides(scene, begin, result, row)
        assert overlap(scene, begin, result, row, at) < 0.01 + 0.15 * thin


@EVERY
@pytest.mark.parametrize("aside", [0.0, 0.1, 0.25, 0.35])
@pytest.mark.parametrize("turned", [0.0, 5.0, 40.0])
def test_end_against_end(at, fidelity, aside, turned):
    """Head-on at a lying log's end, flush, offset and at an angle: flat faces stop each other, no nose glides in."""
    scene = at.flat(lying_logs=lying(((0, 0), (20, 0), 0.4, 0.3)))
    turn = np.radians(turned)
    axis = np.array([np.cos(turn), np.sin(turn), 0.0])
    begin = at.together(
        [
            at.start(
                scene, solid, axis, np.array([-0.5, aside, 0.2]) - (solid[0, at.LENGTH] - solid[0, at.CENTRE]) * axis,
                velocity=speed * axis,
            )
            for speed in (2.0, 10.0, 60.0)
            for solid in (at.body(0.6, 8.0), at.body(0.2, 8.0), at.body(2.0, 12.0))
        ]
    )  # fmt: skip
    begin.state[:, 2] += np.maximum(0.0, begin.body[:, at.BASE] - 0.2) * 0.5
    result = run(at, scene, begin, fidelity)
    for row in range(len(begin.state)):
        assert overlap(scene, begin, result, row, at) < (0.04 if turned < 10.0 else 0.10)  # two rims askew sink most
    if aside == 0.0 and turned == 0.0:
        assert (result.tree_hits == 1).all()
        assert (result.tip_end[:, 0] < 0.01).all()


@EVERY
def test_a_corner_of_two_pieces_is_tight(at, fidelity):
    """A bent lying log: shots into its bend from the inside and from the outside."""
    scene = at.flat(lying_logs=lying(((-6, -6), (0, 0), (-6, 6), 0.6, 0.6), ((9, -6), (3, 0), (9, 6), 0.6, 0.6)))
    solid = at.body(0.4, 6.0)
    begin = at.together(
        [
            at.start(scene, solid, (1, 0.01 * k, 0), (-9.0, 0.2 * k, 0.3), velocity=(speed, 0, 0))
            for k in range(-3, 4)
            for speed in (15.0, 25.0, 60.0)
        ]
    )
    result = run(at, scene, begin, fidelity)
    assert (result.tree_hits >= 1).all()
    for row in range(len(begin.state)):
        assert overlap(scene, begin, result, row, at) < 0.08


@EVERY
def test_falling_on_a_lying_log(at, fidelity):
    """Dropped across it, along it, on end and askew, fast: caught, not cut in two."""
    scene = at.flat(lying_logs=lying(((-8, 0), (8, 0), 0.3, 0.3)), friction=0.8)
    solid = at.body(0.4, 10.0)
    axes = ((0, 1, 0), (1, 0, 0), (0, 0, 1), (1, 1, 0), (1, 1e-4, 0), (0.3, 0.2, 1))
    begin = at.together(
        [
            at.start(scene, solid, axis, (0, side, 9), velocity=(0, 0, -v))
            for axis in axes
            for side in (0.0, 0.15)
            for v in (5, 40)
        ]
    )
    result = run(at, scene, begin, fidelity, time_limit=2.0)
    assert (result.tree_hits[:20] == 1).all()  # the last falls askew beside it
    for row in range(len(begin.state)):
        assert overlap(scene, begin, result, row, at) < 0.08
