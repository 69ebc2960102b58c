"""Nothing passes a tree or a barrier, however fast, thin, oblique or spinning, at any fidelity.

Every scene leaves no way through: rows of stems whose gaps are thinner than the log's thin end, plates wider than the
log can come round in the time given. Flights without gravity, so that every shot arrives as it was aimed. Judged by
where the ends of the log ever were.
"""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Trees

EVERY = pytest.mark.parametrize("fidelity", list(FIDELITIES))
ROW = 20.0  # [m] east, where the obstacle stands


def shots(at, scene, solid, number, seed, *, speeds=(5.0, 100.0), aim=8.0, way="head"):
    """Logs on their way to x = ROW: tip first, base first, broadside or anyhow; the nearest end 1-3 m before it."""
    rng = np.random.default_rng(seed)
    back, front = solid[0, at.CENTRE], solid[0, at.LENGTH] - solid[0, at.CENTRE]
    starts = []
    for _ in range(number):
        turn = {"head": 0.0, "base": np.pi, "broadside": 0.5 * np.pi}.get(way, rng.uniform(-np.pi, np.pi))
        turn += rng.uniform(-0.3, 0.3)
        lean = rng.uniform(-0.3, 0.3)
        axis = np.array([np.cos(turn) * np.cos(lean), np.sin(turn) * np.cos(lean), np.sin(lean)])
        reach = max(front * axis[0], -back * axis[0]) + solid[0, at.BASE]
        centre = (ROW - reach - rng.uniform(1.0, 3.0), rng.uniform(-aim, aim), 20.0)
        heading = rng.uniform(-0.4, 0.4)
        speed = rng.uniform(*speeds)
        velocity = speed * np.array([np.cos(heading), np.sin(heading), 0.0])
        spin = rng.uniform(-3, 3) * np.array([0, 0, 1.0]) + rng.choice([0.0, 100.0]) * axis
        starts.append(at.start(scene, solid, axis, centre, velocity, spin))
    return at.together(starts)


def never_behind(at, scene, begin, fidelity, allowed, **options):
    number = len(begin.state)
    result = at.run(
        scene, begin, fidelity=fidelity, gravity=0.0, keep_poses=np.ones(number, bool),
        **({"time_limit": 0.4} | options),
    )  # fmt: skip
    at.healthy(scene, begin, result)
    behind = at.farthest(result) - ROW
    assert (behind < allowed).all(), f"{(behind >= allowed).sum()} of {number} got through, by {behind.max():.2f} m"
    return result


@EVERY
@pytest.mark.parametrize(("log", "tree"), [((0.75, 30), 0.1), ((3.0, 30), 0.1), ((0.4, 8), 0.05), ((0.05, 8), 0.05)])
def test_head_on_thin_tree(at, fidelity, log, tree):
    """An end face meets a stem thinner than itself: the log stops, it is not skewered.

    The stem stands within a fifth of the tip's radius of the axis. Off-centre by e the log keeps e^2/(k^2 + e^2) of its
    speed in the plane of the hit, at most 1e-4 here, and cannot turn aside in 0.3 s by more than that.
    """
    scene = at.flat(trees=at.trees(ROW, 0.0, tree, 1e4), size=100.0)
    solid = at.body(*log)
    front = solid[0, at.LENGTH] - solid[0, at.CENTRE]
    rng = np.random.default_rng(0)
    begin = at.together(
        [
            at.start(scene, solid, (1, 0, 0), (ROW - front - rng.uniform(2, 4), side, 20), velocity=(speed, 0, 0))
            for side in solid[0, at.TIP] * np.array([0.0, 0.1, 0.2])
            for speed in rng.uniform(20, 60, 12)
        ]
    )
    result = never_behind(at, scene, begin, fidelity, 0.5 * tree, time_limit=0.3)
    assert (result.tree_hits == 1).all()


@EVERY
@pytest.mark.parametrize("way", ["head", "base", "broadside", "anyhow"])
@pytest.mark.parametrize(
    ("log", "tree", "spacing"),
    [((0.4, 8.0), 0.1, 0.25), ((0.05, 6.0), 0.03, 0.05), ((1.2, 10.0), 0.05, 0.5), ((0.4, 8.0), 1.0, 1.1)],
)
def test_palisade(at, fidelity, way, log, tree, spacing):
    """Stems closer than the log's thin end; thick ones, and such as are thinner than a step is long.

    At ``draft`` an end gets in by a step's travel near obstacles at most: 0.3 of the radii of log and stem.
    """
    y = np.arange(-30.0, 30.0, spacing)
    scene = at.flat(trees=at.trees(np.full(len(y), ROW), y, tree, 1e4))
    solid = at.body(*log)
    assert spacing - tree < 2 * solid[0, at.TIP]
    allowed = 0.5 * tree + 0.02
    if fidelity == "draft":
        allowed = max(allowed, 0.3 * (solid[0, at.BASE] + 0.5 * tree))
    result = never_behind(at, scene, shots(at, scene, solid, 12, 1, way=way), fidelity, allowed)
    assert (result.tree_hits > 0).sum() > 8


@EVERY
@pytest.mark.parametrize("way", ["head", "base", "broadside", "anyhow"])
@pytest.mark.parametrize("log", [(0.75, 30.0), (0.4, 8.0), (0.02, 4.0)])
def test_long_plate(at, fidelity, way, log):
    """A plate of zero thickness, consisting of many pieces: every joint is as tight as the middle."""
    scene = at.flat(barriers=at.barrier((ROW, -50), (ROW, 50)), cell=0.5)
    begin = shots(at, scene, at.body(*log), 30, 2, way=way)
    result = never_behind(at, scene, begin, fidelity, 0.03)
    assert not result.barrier_crossed.any()
    assert (result.barrier_hits > 0).sum() > 20


@EVERY
def test_joint_of_a_plate(at, fidelity):
    """Tip first at a vertex of a straight barrier, within a radius of it: as tight as the plate beside it."""
    scene = at.flat(barriers=at.barrier((ROW, -20), (ROW, 0), (ROW, 20)))
    solid = at.body()
    front = solid[0, at.LENGTH] - solid[0, at.CENTRE]
    begin = at.together(
        [
            at.start(scene, solid, (1, 0, 0), (ROW - 3 - front, side, 5), velocity=(speed, 0, 0))
            for side in np.linspace(-0.3, 0.3, 13)
            for speed in (10, 30, 60)
        ]
    )
    result = never_behind(at, scene, begin, fidelity, 0.03)
    assert (result.barrier_hits == 1).all()


@EVERY
@pytest.mark.parametrize("spread", [1.76, 10.0])
@pytest.mark.parametrize("log", [(0.75, 30.0), (0.2, 8.0)])
def test_corner_of_a_barrier(at, fidelity, spread, log):
    """The corner points at the log, 160 and 90 degrees wide: its tip stops there, or slides along one side of it.

    Whatever it does, its axis never gets behind the two plates: x < ROW + |y| spread / 10.
    """
    scene = at.flat(barriers=at.barrier((ROW + spread, -10), (ROW, 0), (ROW + spread, 10)), size=80.0)
    solid = at.body(*log)
    front = solid[0, at.LENGTH] - solid[0, at.CENTRE]
    begin = at.together(
        [
            at.start(scene, solid, (1, 0, 0), (ROW - 3 - front, side, 5), velocity=(speed, 0, 0))
            for side in solid[0, at.TIP] * np.linspace(-0.9, 0.9, 10)
            for speed in (10, 40)
        ]
    )
    result = at.run(
        scene, begin, fidelity=fidelity, gravity=0.0, time_limit=0.5, keep_poses=np.ones(len(begin.state), bool)
    )
    at.healthy(scene, begin, result)
    tip = result.poses.tip
    behind = tip[:, 0] - ROW - np.abs(tip[:, 1]) * spread / 10
    assert behind[np.abs(tip[:, 1]) < 10].max() < 0.03


@EVERY
@pytest.mark.parametrize("plate", [((ROW, 0), (ROW, 20)), ((ROW, 0), (ROW + 20, 0))], ids=["square on", "edge on"])
def test_end_of_a_barrier(at, fidelity, plate):
    """An end face that meets a plate's vertical edge is held by it; the plate does not slice into the log.

    Off the axis by e <= a the log keeps e^2/(k^2 + e^2) < 1e-3 of its speed square to the face, whatever the friction.
    Nearer to the rim than a step's travel (0.3 radii) a hit is as well a graze of the side, and is not tested.
    """
    scene = at.flat(barriers=at.barrier(*plate), size=80.0)
    solid = at.body()
    front, radius = solid[0, at.LENGTH] - solid[0, at.CENTRE], solid[0, at.TIP]
    begin = at.together(
        [
            at.start(scene, solid, (1, 0, 0), (ROW - 3 - front, side * radius, 5), velocity=(speed, 0, 0))
            for side in (-0.7, -0.5, -0.2, 0.0)
            for speed in (10, 20, 40)
        ]
    )
    never_behind(at, scene, begin, fidelity, 0.03)


@EVERY
def test_spinning_log_stays_out_of_stems(at, fidelity):
    """Fast spin about the own axis: the contact's speed is that of the log's surface, not of a point beside the log.

    A contact sought at the pose a step ahead, with the spin of the present one, would err by spin * turn * dt * lever:
    metres a second. The tip then sank 0.6 m into a stem. Allowed: a step's travel (0.3 of radius + radius = 0.18 m).
    """
    y = np.arange(-30.0, 30.0, 1.1)
    scene = at.flat(trees=at.trees(np.full(len(y), ROW), y, 1.0, 1e4))
    begin = shots(at, scene, at.body(0.4, 8.0), 24, 1, way="head")
    begin.state[:, 10:13] = 100.0 * begin.state[:, 13:16] + np.array([0.0, 0.5, 1.0])
    result = at.run(scene, begin, fidelity=fidelity, gravity=0.0, time_limit=0.4)
    assert (result.tree_hits > 0).all()
    assert result.overlap_max.max() < 0.18


@EVERY
def test_falling_on_the_top_edge(at, fidelity):
    """Broadside from above: caught by the edge at speed, not cut in two."""
    scene = at.flat(barriers=at.barrier((0, -30), (0, 30), height=5.0), friction=0.8)
    solid = at.body(0.2, 10.0)
    begin = at.together(
        [at.start(scene, solid, (1, 0, 0), (0, side, 7), velocity=(0, 0, -v)) for side in (0, 0.7) for v in (5, 30, 90)]
    )
    result = at.run(scene, begin, fidelity=fidelity, gravity=0.0, time_limit=0.5)
    at.healthy(scene, begin, result)
    assert (result.barrier_hits == 1).all()
    assert (result.end_position[:, 2] > 5.0).all()


@EVERY
def test_upright_log_falls_on_the_top_edge(at, fidelity):
    """Base face on a plate's top edge at 10 m/s: the plate does not slice upwards into the log."""
    scene = at.flat(barriers=at.barrier((0, -30), (0, 30), height=5.0))
    solid = at.body()
    begin = at.start(scene, solid, (0, 0, 1), (0, 0, 6 + solid[0, at.CENTRE]), velocity=(0, 0, -10))
    result = at.run(scene, begin, fidelity=fidelity, gravity=0.0, time_limit=0.3)
    assert result.base_end[0, 2] > 4.9


@EVERY
def test_upright_log_falls_on_a_stump(at, fidelity):
    """Base face on the top of a stump thinner than the log: it stands on it, and is not pierced."""
    scene = at.flat(trees=Trees(np.zeros(1), np.zeros(1), np.full(1, 0.3), np.full(1, 2.0)))
    solid = at.body()
    begin = at.start(scene, solid, (0, 0, 1), (0.05, 0, 3 + solid[0, at.CENTRE]), velocity=(0, 0, -10))
    result = at.run(scene, begin, fidelity=fidelity, gravity=0.0, time_limit=0.3)
    assert result.base_end[0, 2] > 1.9


@EVERY
def test_one_tree_never_changes_sides(at, fidelity):
    """Broadside at one thin stem, 30-100 m/s, spinning: while it is abreast of the log it stays on its side."""
    tree = (ROW, 0.0)
    scene = at.flat(trees=at.trees(*tree, 0.05, 1e5), size=100.0)
    begin = shots(at, scene, at.body(0.1, 12.0), 30, 7, speeds=(30.0, 100.0), aim=4.0, way="broadside")
    result = at.run(
        scene, begin, fidelity=fidelity, gravity=0.0, time_limit=0.4, keep_poses=np.ones(30, bool), trace_cells=0.05
    )
    at.healthy(scene, begin, result)
    assert (result.tree_hits > 0).sum() > 15
    for row in range(30):
        mine = result.poses.log_row == row
        base, tip = result.poses.base[mine, :2], result.poses.tip[mine, :2]
        along = tip - base
        offset = np.array(tree) - base
        share = (offset * along).sum(axis=1) / (along * along).sum(axis=1)
        side = np.sign(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0])
        abreast = (share > 0.03) & (share < 0.97)
        both = abreast[1:] & abreast[:-1]
        assert (side[1:] == side[:-1])[both].all(), f"the stem went through log {row}"
