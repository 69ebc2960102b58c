"""No part of a log sinks into any part of an obstacle: scans of 3000 poses over every kind of feature and their pairs.

The check is independent of the narrow phase. Two convex solids overlap by the least way that one must be moved to be
clear of the other: the least, over all directions, of how far they reach past one another. How far a truncated cone
reaches in a direction is that of its two rims, a round core that of its two end spheres, a plate that of its corners.
Directions are tried all over the sphere and then closer and closer to the best: what is found is no less than the
depth, so the check can only be too strict.
"""

from dataclasses import dataclass, field

import numpy as np
import pytest

from deadwood_engine import Barriers, Blocks, LyingLogs, Scene, Start, Trees
from deadwood_engine.cores import BARRIER
from deadwood_engine.log_body import cone_bodies
from deadwood_engine.rotation import quaternion_from_axis

NUMBER = 3000
SEEN = 0.005  # [m] overlaps beyond that are measured to the tenth of a millimetre
SINKS = {"draft": 0.15, "standard": 0.05, "fine": 0.05, "reference": 0.01}


def directions(number):
    """Evenly over the sphere, (number, 3)."""
    k = np.arange(number) + 0.5
    z, turn = 1.0 - 2.0 * k / number, np.pi * (1.0 + 5.0**0.5) * k
    return np.column_stack([np.cos(turn) * np.sqrt(1 - z * z), np.sin(turn) * np.sqrt(1 - z * z), z])


def past_one_another(n, base, tip, first, last, solid):
    """How far [m] a log, a cone (m, ...), reaches into a solid against the directions n, (m, k)."""
    d = (tip - base) / np.linalg.norm(tip - base, axis=1)[:, None]
    nd = (n @ d[:, :, None])[..., 0]
    off = np.sqrt(np.maximum(0.0, 1.0 - nd**2))
    rims = [(n @ end[:, :, None])[..., 0] - r[:, None] * off for end, r in ((base, first), (tip, last))]
    reach = np.max([n @ point + r for point, r in zip(*solid[:2], strict=True)], axis=0)
    reach = reach + solid[3] * np.hypot(n[..., 0], n[..., 1])
    reach = reach - np.minimum(*rims)
    # a plate goes down for ever: no way out leads there
    return np.where(n[..., 2] < -1e-12, np.inf, reach) if solid[2] else reach


def seeds(base, tip, taper, solid):
    """Directions that may be the way out of a solid, (m, k, 3): square to both axes, along and square to each, square
    to the log's side (along a log of 10 m its taper is 5 cm), level ones for a plate, all over the sphere."""
    d = (tip - base) / np.linalg.norm(tip - base, axis=1)[:, None]
    along = solid[0][-1] - solid[0][0]
    u = along / np.linalg.norm(along) if np.linalg.norm(along) > 0.0 else np.array([0.0, 0.0, 1.0])
    square = np.cross(d, u)
    square /= np.maximum(np.linalg.norm(square, axis=1), 1e-12)[:, None]
    turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)[None, :, None]
    other = np.cross(d, square)
    around = [np.cos(turn) * square[:, None] + np.sin(turn) * other[:, None]]
    around += [around[0] + sign * taper[:, None, None] * d[:, None] for sign in (1.0, -1.0)]
    around[1:] = [each / np.linalg.norm(each, axis=2, keepdims=True) for each in around[1:]]
    other = np.cross(u, square)
    around.append(np.cos(turn) * square[:, None] + np.sin(turn) * other[:, None])
    if solid[2]:  # square to a plate, to its posts
        level = np.cross(u, (0.0, 0.0, 1.0))
        level = np.stack([level, -level, u * (1, 1, 0), -u * (1, 1, 0)])
        around.append(np.broadcast_to(level / np.linalg.norm(level, axis=1)[:, None], (len(d), 4, 3)))
        turn = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
        level = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
        around.append(np.broadcast_to(level, (len(d), 720, 3)))
    return np.concatenate(
        [*around, d[:, None], -d[:, None], np.broadcast_to(directions(200), (len(d), 200, 3))], axis=1
    )


def straight_out(base, tip, solid):
    """From the nearest point of a solid's axis to that of a log's, nearly: the way out of a side, (m, 1, 3).

    By turns the nearest point of the one axis to that of the other; and level ways square to a plate.
    """

    def on(point, start, end):
        along = end - start
        square = np.maximum((along * along).sum(axis=1), 1e-300)
        share = np.clip(((point - start) * along).sum(axis=1) / square, 0.0, 1.0)
        return start + share[:, None] * along

    start, end = (np.broadcast_to(each, base.shape) for each in (solid[0][0], solid[0][-1]))
    p, q = base, 0.5 * (start + end)
    for _ in range(20):
        p = on(q, base, tip)
        q = on(p, start, end)
    ways = [p - q]
    if solid[2]:
        square = np.broadcast_to(np.cross(solid[0][-1] - solid[0][0], (0.0, 0.0, 1.0)), base.shape)
        ways += [square, -square]
    ways = np.stack(ways, axis=1)
    return ways / np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-300)


def depths(base, tip, first, last, solid, allowed=0.0, rounds=400):
    """Overlap [m] of logs (m, ...) with one convex solid; negative where they are clear by that at least.

    What is not deeper than ``allowed`` [m] is not measured any closer: its depth is said to be that at most. rounds :
    of looking for a better direction
    """
    depth = np.empty(len(base))
    for chunk in np.array_split(np.arange(len(base)), 1 + len(base) // 2000):
        everywhere = np.broadcast_to(directions(60), (len(chunk), 60, 3))
        everywhere = np.concatenate([everywhere, straight_out(base[chunk], tip[chunk], solid)], axis=1)
        depth[chunk] = past_one_another(everywhere, base[chunk], tip[chunk], first[chunk], last[chunk], solid).min(1)
    near = np.flatnonzero(depth >= allowed)
    for chunk in np.array_split(near, 1 + len(near) // 400):
        depth[chunk] = _depths(base[chunk], tip[chunk], first[chunk], last[chunk], solid, allowed, rounds)
    return depth


def _depths(base, tip, first, last, solid, allowed, rounds):
    n = seeds(base, tip, (first - last) / np.linalg.norm(tip - base, axis=1), solid)
    rows = np.arange(len(base))
    reach = past_one_another(n, base, tip, first, last, solid)
    best = reach.argmin(axis=1)
    depth, n = reach[rows, best], n[rows, best]
    rng = np.random.default_rng(0)
    for round_ in range(rounds):
        # what overlaps so far needs a closer look
        near = np.flatnonzero(depth > max(allowed, 0.0 if round_ < 30 else SEEN))
        if not len(near):
            break
        tried = n[near, None] + 10.0 ** rng.uniform(-5, -0.5, (48, 1)) * rng.standard_normal((48, 3))
        if solid[2]:
            tried[:, ::2, 2] = 0.0  # a plate goes down for ever: the least of tilts costs its depth below the edge
        tried /= np.linalg.norm(tried, axis=2, keepdims=True)
        reach = past_one_another(tried, base[near], tip[near], first[near], last[near], solid)
        k = reach.argmin(axis=1)
        least = reach[np.arange(len(near)), k]
        better = least < depth[near]
        depth[near[better]], n[near[better]] = least[better], tried[np.arange(len(near)), k][better]
    return depth


def solids(scene):
    """The convex solids of a scene as they stand, (points, radii, goes down for ever, radius of their discs); straight
    stretches are one."""
    terrain, cores = scene.arrays.terrain, scene.arrays.cores
    found = []
    for node, core in zip(cores.node, cores.solid, strict=True):
        plan = node * terrain.cell + (core["x"] + terrain.x0, core["y"] + terrain.y0)
        start = np.array([*plan, core["z"] + terrain.reference])
        end = start + core["long"] * np.array([core["ux"], core["uy"], core["uz"]])
        radii = [core["wide"], core["wide"] + core["long"] * core["slope"]]
        down = core["kind"] == BARRIER
        if down and not core["first_post"] and core["before_x"] ** 2 + core["before_y"] ** 2 > 0.0:
            points, *_ = found.pop()
            start = points[0]
        disc = core["disc"]  # of a stump: its spheres' middles are all over an upright cylinder of that radius
        found.append(([start, end], [each - disc for each in radii], down, disc))
    return found


def test_the_ruler_measures_what_is_known():
    """A cylinder in a sphere, on a stem, over a plate: depths that a pencil gives."""
    r = np.array([0.3])
    base, tip = np.array([[0.0, 0.0, 1.0]]), np.array([[4.0, 0.0, 1.0]])
    ball = ([np.array([2.0, 0.4, 1.0])] * 2, [0.2, 0.2], False, 0.0)
    assert depths(base, tip, r, r, ball)[0] == pytest.approx(0.1, abs=1e-5)
    stem = ([np.array([-0.1, 0.0, 0.0]), np.array([-0.1, 0.0, 9.0])], [0.15, 0.15], False, 0.0)
    assert depths(base, tip, r, r, stem)[0] == pytest.approx(0.05, abs=1e-5)
    plate = ([np.array([2.0, -5.0, 0.73]), np.array([2.0, 5.0, 0.73])], [0.0, 0.0], True, 0.0)
    assert depths(base, tip, r, r, plate)[0] == pytest.approx(0.03, abs=1e-5)
    stump = ([np.array([2.0, 0.0, -3.0]), np.array([2.0, 0.0, 0.7])], [0.05, 0.05], False, 0.2)
    assert depths(base, tip, r, r, stump)[0] == pytest.approx(0.05, abs=1e-5)
    up = np.array([0.0, 0.0, 0.031])
    assert depths(base + up, tip + up, r, r, plate)[0] < 0.0


@dataclass
class Feature:
    """What is scanned: the obstacles, and the box (x, y, z) in which a point of the log meets them."""

    box: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    parts: dict = field(default_factory=dict)


def stems(*rows):
    return Trees(*(np.array(column, float) for column in zip(*rows, strict=True)))


def fence(*points, height=1.2):
    return Barriers(np.array(points, float), np.array([0, len(points)]), np.array([height]))


def lying(*points, diameter=0.5, tip=0.4):
    return LyingLogs(np.array(points, float), np.array([0, len(points)]), np.array([diameter]), np.array([tip]))


def boulder(*rows):
    return Blocks(*(np.array(column, float) for column in zip(*rows, strict=True)))


STUMP, STEM = stems((0.1, 0.1, 0.7, 0.8)), stems((0.1, 0.1, 0.6, 30.0))
FEATURES = {
    "stem": Feature(((-0.8, 0.8), (-0.8, 0.8), (2.0, 6.0)), {"trees": STEM}),
    "stump": Feature(((-0.7, 0.8), (-0.7, 0.8), (1.0, 1.6)), {"trees": STUMP}),
    "low stump": Feature(((-0.9, 1.0), (-0.9, 1.0), (0.2, 0.7)), {"trees": stems((0.1, 0.1, 1.0, 0.3))}),
    "thin stump": Feature(((-0.4, 0.6), (-0.4, 0.6), (1.5, 2.0)), {"trees": stems((0.1, 0.1, 0.12, 1.3))}),
    "top edge": Feature(((-1.0, 1.0), (-0.5, 0.5), (1.3, 1.8)), {"barriers": fence((-9, 0.1), (9, 0.2))}),
    "joint": Feature(((-0.6, 0.6), (-0.5, 0.5), (1.3, 1.8)), {"barriers": fence((-8, 0.1), (8, 0.1))}),
    "free end": Feature(((-0.5, 0.7), (-0.5, 0.7), (1.3, 1.8)), {"barriers": fence((0.1, 0.1), (9, 0.4))}),
    "free end, from beside": Feature(((-0.7, 0.3), (-0.5, 0.7), (0.3, 1.4)), {"barriers": fence((0.1, 0.1), (9, 0.4))}),
    "bend": Feature(((-0.6, 0.6), (-0.6, 0.6), (1.3, 1.8)), {"barriers": fence((-7, 4.1), (0.1, 0.1), (7.0, 3.0))}),
    "slight bend": Feature(
        ((-0.6, 0.6), (-0.6, 0.6), (1.3, 1.8)), {"barriers": fence((-7, 0.4), (0.1, 0.1), (7.0, 0.3))}
    ),
    "lying log's side": Feature(((-1, 1), (-0.6, 0.6), (0.6, 1.2)), {"lying_logs": lying((-6, 0.1), (6, 0.3))}),
    "lying log's end": Feature(((-0.7, 0.6), (-0.6, 0.6), (0.3, 1.1)), {"lying_logs": lying((0.1, 0.1), (9, 0.3))}),
    "broken line": Feature(
        ((-0.6, 0.6), (-0.6, 0.6), (0.6, 1.2)), {"lying_logs": lying((-6, 3.1), (0.1, 0.1), (6, 2.0))}
    ),
    "boulder": Feature(((-0.9, 1.1), (-0.9, 1.1), (0.9, 1.7)), {"blocks": boulder((0.1, 0.1, 1.2, 0.9))}),
    "stump and edge": Feature(
        ((-0.7, 0.8), (-0.7, 0.7), (1.3, 1.8)),
        {"trees": stems((0.1, 0.25, 0.5, 1.25)), "barriers": fence((-9, 0.1), (9, 0.2))},
    ),
    "two stumps": Feature(
        ((-0.9, 0.9), (-0.7, 0.7), (0.9, 1.6)), {"trees": stems((-0.4, 0.1, 0.6, 0.9), (0.4, 0.0, 0.5, 0.8))}
    ),
    "stem and lying log": Feature(
        ((-0.8, 0.9), (-0.8, 0.8), (0.6, 1.4)), {"trees": STEM, "lying_logs": lying((-6, 0.7), (6, 0.8))}
    ),
    "free end and stem": Feature(
        ((-0.7, 0.8), (-0.7, 0.7), (1.3, 1.8)),
        {"trees": stems((-0.3, 0.0, 0.3, 20.0)), "barriers": fence((0.1, 0.1), (9, 0.4))},
    ),
    "lying log over an edge": Feature(
        ((-0.6, 0.6), (-0.6, 0.6), (0.8, 1.4)),
        {"lying_logs": lying((-6, 0.1), (6, 0.3)), "barriers": fence((0.2, -6), (0.1, 6), height=0.7)},
    ),
    "boulder and stump": Feature(
        ((-0.8, 0.9), (-0.8, 0.8), (0.9, 1.6)),
        {"trees": stems((0.5, 0.0, 0.5, 0.7)), "blocks": boulder((-0.3, 0.1, 1.0, 0.9))},
    ),
}


def thrown(at, scene, feature, number, seed, *, askew=False):
    """Logs of all sizes and directions, some place of each (an end's rim, its face, its side) on the way into the box.

    Three times as many, of which those that begin clear of everything, the ground included, are taken. askew : 1 to 18
    degrees from the direction of the feature's first solid.
    """
    rng, many = np.random.default_rng(seed), 3 * number
    diameter, length = rng.uniform(0.2, 0.9, many), rng.uniform(3.0, 14.0, many)
    solid = cone_bodies(diameter, length, np.full(many, 300.0))
    d = rng.standard_normal((many, 3)) * np.column_stack([np.ones((many, 2)), rng.choice([0.1, 0.5, 1.0], many)])
    d /= np.linalg.norm(d, axis=1)[:, None]
    if askew:
        first, last = solids(scene)[0][0]
        d = rng.choice([-1.0, 1.0], (many, 1)) * (last - first) / np.linalg.norm(last - first) + (
            rng.uniform(0.02, 0.33, (many, 1)) * d
        )
        d /= np.linalg.norm(d, axis=1)[:, None]
    side = np.cross(d, rng.standard_normal((many, 3)))
    side /= np.linalg.norm(side, axis=1)[:, None]
    share = np.where(rng.random(many) < 0.7, rng.choice([0.0, 1.0], many), rng.random(many))
    radius = solid[:, at.BASE] + share * (solid[:, at.TIP] - solid[:, at.BASE])
    aside = radius * np.where(rng.random(many) < 0.5, 1.0, rng.random(many))
    skin = (share * length - solid[:, at.CENTRE])[:, None] * d + aside[:, None] * side
    low, high = np.array(feature.box).T
    place = rng.uniform(low, high, (many, 3))
    velocity = rng.choice([0.5, 2.0, 8.0], (many, 1)) * rng.uniform((-1, -1, -1), (1, 1, 0.2), (many, 3))
    spin = rng.choice([0.0, 1.0], (many, 1)) * rng.uniform(-1.5, 1.5, (many, 3))
    centre = place - skin - rng.uniform(0.02, 0.12, (many, 1)) * velocity
    base = centre - solid[:, at.CENTRE, None] * d
    tip = base + length[:, None] * d
    first, last = solid[:, at.BASE], solid[:, at.TIP]
    clear = np.minimum(base[:, 2] - first, tip[:, 2] - last) > 0.0
    for each in solids(scene):
        clear &= depths(base, tip, first, last, each, rounds=20) < 0.0
    clear = np.flatnonzero(clear)[:number]
    terrain = scene.arrays.terrain
    plan = centre[clear, :2] - (terrain.x0, terrain.y0)
    frame = np.floor(plan / terrain.cell).astype(np.int64)
    state = np.zeros((len(clear), 16))
    state[:, :2], state[:, 2] = plan - frame * terrain.cell, centre[clear, 2] - terrain.reference
    state[:, 3:7], state[:, 13:16] = quaternion_from_axis(d[clear]), d[clear]
    state[:, 7:10], state[:, 10:13] = velocity[clear], spin[clear]
    return Start(frame, state, solid[clear])


def deepest_of(at, scene, begin, fidelity, *, time_limit, allowed=0.0, **options):
    """(deepest overlap [m] of each log over all its poses, how many logs hit); ``allowed`` as ``depths``."""
    result = at.run(
        scene, begin, fidelity=fidelity, time_limit=time_limit, keep_poses=np.ones(len(begin.state), bool),
        trace_cells=0.05, **options,
    )  # fmt: skip
    poses = result.poses
    first, last = begin.body[poses.log_row, at.BASE], begin.body[poses.log_row, at.TIP]
    deepest = np.zeros(len(begin.state))
    for solid in solids(scene):
        np.maximum.at(deepest, poses.log_row, depths(poses.base, poses.tip, first, last, solid, allowed))
    return deepest, int((result.tree_hits + result.barrier_hits > 0).sum()), result


@pytest.mark.parametrize("fidelity", ["standard", "reference"])
@pytest.mark.parametrize("name", FEATURES)
def test_nothing_sinks_into_it(at, name, fidelity):
    """3000 logs that meet a feature with an end's rim or face or their side, slowly and fast, and slide on."""
    feature = FEATURES[name]
    scene = Scene.prepare(np.zeros((121, 121)), 1.0, -60, -60, friction=0.25, **feature.parts)
    begin = thrown(at, scene, feature, NUMBER, 7)
    assert len(begin.state) > 0.9 * NUMBER
    deepest, hits, _ = deepest_of(at, scene, begin, fidelity, time_limit=0.5, allowed=0.9 * SINKS[fidelity])
    assert hits > 0.2 * len(begin.state)
    assert deepest.max() < SINKS[fidelity]


@pytest.mark.parametrize("fidelity", ["standard", "reference"])
@pytest.mark.parametrize("name", ["stem", "top edge", "lying log's side", "lying log's end", "stem and lying log"])
def test_nothing_sinks_into_what_it_crosses_at_a_few_degrees(at, name, fidelity):
    """Nearly parallel, two contacts at the ends of what log and obstacle share stand for a whole line: between them the
    one sank through the other, 23 cm and going on; and the end that touched first was pushed in by a blow at the other.
    """
    feature = FEATURES[name]
    scene = Scene.prepare(np.zeros((121, 121)), 1.0, -60, -60, friction=0.25, **feature.parts)
    begin = thrown(at, scene, feature, NUMBER, 7, askew=True)
    assert len(begin.state) > 0.5 * NUMBER
    deepest, hits, _ = deepest_of(at, scene, begin, fidelity, time_limit=0.5, allowed=0.9 * SINKS[fidelity])
    assert hits > 0.2 * len(begin.state)
    assert deepest.max() < SINKS[fidelity]
