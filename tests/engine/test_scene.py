"""A scene prepared, changed and asked: what is taken away or exchanged is that alone, and what cannot be is refused.

Its parts have tests of their own (``test_terrain``, ``test_trees``, ``test_barriers``, ``test_cores``, ...).
"""

import numpy as np
import pytest

from deadwood_engine import Barriers, Blocks, Lines, LyingLogs, Scene, Trees
from deadwood_engine.cores import BARRIER, BLOCK, LYING, TREE, near

HEIGHTS = 0.5 * np.arange(40)[:, None] + np.zeros((40, 40)) + 700.0


def parts():
    """Three trees (one on no terrain), two barriers, two lying logs and a block, 100 m east and 200 m north."""
    return {
        "trees": Trees(np.array([105.0, 110.0, 199.0]), np.full(3, 205.0), np.full(3, 0.4), np.full(3, 20.0)),
        "barriers": Barriers(
            np.array([[103.0, 210], [108, 210], [112, 210], [118, 212]]), np.array([0, 2, 4]), np.array([2.0, 3.0])
        ),
        "lying_logs": LyingLogs(
            np.array([[103.0, 220], [108, 221], [112, 222], [117, 220]]), np.array([0, 2, 4]),
            np.array([0.4, 0.5]), np.array([0.3, 0.5]),
        ),
        "blocks": Blocks(np.array([115.0]), np.array([230.0]), np.array([1.5]), np.array([1.0])),
        "lines": Lines(np.array([[100.0, 203], [139, 203]]), np.array([0, 2])),
    }  # fmt: skip


def prepared(**more):
    return Scene.prepare(HEIGHTS, 1.0, 100.0, 200.0, friction=0.3, **(parts() | more))


def listed(scene, base=(0.0, 0.0), tip=(39.0, 39.0), reach=60.0):
    """(kind, owner) of all that a log would list, each once; by default of one over all of the scene."""
    cores = scene.arrays.cores
    number = len(cores.solid)
    rows, table = np.zeros(number + 1, np.int64), np.zeros(number + 1, cores.solid.dtype).view(np.recarray)
    count = near(cores, np.zeros(2, np.int64), 1.0, rows, table, (base, tip), reach)
    return {(int(cores.solid[row].kind), int(cores.solid[row].owner)) for row in rows[:count]}


def test_it_says_what_it_holds():
    scene = prepared()
    assert (scene.tree_count, scene.barrier_count, scene.line_count, scene.lying_count) == (3, 2, 1, 2)
    assert scene.trees_outside.tolist() == [2]
    assert [x.size for x in (scene.barriers_outside, scene.lying_outside, scene.blocks_outside)] == [0, 0, 0]
    # trees, then lying logs, then blocks are numbered on; barriers by themselves
    expected = {(TREE, 0), (TREE, 1), (BARRIER, 0), (BARRIER, 1), (LYING, 3), (LYING, 4), (BLOCK, 5)}
    assert listed(scene) == expected


def test_what_is_absent_is_empty():
    bare = Scene.prepare(HEIGHTS, 1.0, 100.0, 200.0, friction=0.3)
    assert len(bare.arrays.cores.solid) == bare.line_count == bare.tree_count == bare.barrier_count == 0
    assert bare.arrays.cloud is None
    assert len(bare.arrays.lines.ends) == len(bare.arrays.fences.ends) == 0
    assert listed(bare) == set()


@pytest.mark.parametrize(
    ("gone", "missing"),
    [
        ({"barriers": [1]}, {(BARRIER, 1)}),
        ({"others": [1]}, {(TREE, 1)}),
        ({"others": [0, 4, 5], "barriers": [0]}, {(TREE, 0), (LYING, 4), (BLOCK, 5), (BARRIER, 0)}),
        ({}, set()),
    ],
)
def test_without_some_the_others_are_numbered_as_before(gone, missing):
    scene = prepared()
    left = scene.without(**gone)
    assert listed(left) == listed(scene) - missing
    assert listed(scene) >= missing  # the scene itself is whole
    assert left.arrays.terrain is scene.arrays.terrain
    assert (left.tree_count, left.barrier_count) == (scene.tree_count, scene.barrier_count)


def test_without_all_there_is_no_core():
    scene = prepared()
    assert len(scene.without(barriers=[0, 1], others=range(6)).arrays.cores.solid) == 0


def test_other_lines_and_another_friction_share_the_rest():
    scene = prepared()
    two = Lines(np.array([[100.0, 203], [139, 203], [100, 209], [120, 209], [130, 209]]), np.array([0, 2, 5]))
    other = scene.with_lines(two)
    assert (other.line_count, len(other.arrays.lines.ends)) == (2, 3)
    assert scene.line_count == 1
    # in plan from the corner of the DEM
    assert other.arrays.lines.ends[0].tolist() == [0.0, 3.0, 39.0, 3.0]
    assert other.arrays.cores is scene.arrays.cores
    rough = scene.with_friction(0.7)
    assert rough.arrays.terrain.friction.tolist() == [[0.7]]
    assert rough.arrays.terrain.heights is scene.arrays.terrain.heights
    assert scene.arrays.terrain.friction.tolist() == [[0.3]]


def _parts_of(values):
    return values if isinstance(values, tuple) else (values,)


def everything(scene):
    """All of a scene's arrays and numbers, by their place."""
    arrays = scene.arrays
    for name, each in (("cores", arrays.cores), ("lines", arrays.lines), ("fences", arrays.fences)):
        for place, values in zip(each._fields, each, strict=True):
            yield from ((f"{name}.{place}.{k}", part) for k, part in enumerate(_parts_of(values)))
    yield from vars(scene).items()


@pytest.mark.parametrize("window", [False, True])
@pytest.mark.parametrize("name", ["trees", "barriers", "lying_logs"])
@pytest.mark.parametrize("number", [0, 2, 30])
def test_another_layer_on_the_same_terrain_is_a_scene_prepared_again(name, number, window):
    """Every bit of it, also in a window of a DEM far away whose cells are no power of two; the terrain is shared."""
    rng, cell, x0, y0 = np.random.default_rng(number), 0.7, 2_786_103.1, 1_196_011.3
    heights = rng.uniform(0.0, 0.3, (60, 60)) + 0.4 * np.arange(60)[:, None]
    options = {"first": (5, 3), "reference": 0.0} if window else {}

    def some(many, seed):
        draw = np.random.default_rng(seed)
        ends = draw.uniform(3.0, 40.0, (many, 2)) + np.array([x0, y0])
        ends = np.stack([ends, ends + draw.uniform(-6.0, 6.0, (many, 2))], axis=1).reshape(-1, 2)
        return {
            "trees": Trees(ends[::2, 0], ends[::2, 1], draw.uniform(0.1, 0.9, many), draw.choice([0.4, 20.0], many)),
            "barriers": Barriers(ends, 2 * np.arange(many + 1), draw.uniform(1.0, 4.0, many)),
            "lying_logs": LyingLogs(ends, 2 * np.arange(many + 1), np.full(many, 0.5), np.full(many, 0.3)),
        }

    blocks = Blocks(*(np.array([value]) for value in (x0 + 20.0, y0 + 20.0, 1.5, 1.0)))
    own, other = some(12, 99) | {"blocks": blocks}, some(number, 7)
    scene = Scene.prepare(heights, cell, x0, y0, friction=0.3, **options, **own)
    made = getattr(scene, f"with_{name}")(other[name])
    anew = Scene.prepare(heights, cell, x0, y0, friction=0.3, **options, **(own | {name: other[name]}))
    assert made.arrays.terrain is scene.arrays.terrain
    for (place, one), (_, two) in zip(everything(made), everything(anew), strict=True):
        if place != "arrays":
            assert np.array_equal(one, two), place


def test_what_was_left_out_stays_out_where_another_layer_is_put():
    scene = prepared().without(barriers=[0], others=[1, 5])
    made = scene.with_lying_logs(
        LyingLogs(np.array([[103.0, 225], [108, 226]]), np.array([0, 2]), *np.full((2, 1), 0.4))
    )
    assert listed(made) == {(TREE, 0), (BARRIER, 1), (LYING, 3)}


def test_a_layer_that_cannot_be_is_refused_there_too():
    with pytest.raises(ValueError, match="diameter"):
        prepared().with_trees(Trees(*np.full((4, 1), np.nan)))
    with pytest.raises(ValueError, match="finite place"):
        prepared().with_barriers(Barriers(np.full((2, 2), np.inf), np.array([0, 2]), np.ones(1)))


def test_heights_are_those_of_the_world():
    scene = prepared()
    found = scene.terrain_surface(np.array([110.2, 99.0]), np.array([207.5, 207.5]))
    assert found[0] == pytest.approx([700.0 + 0.5 * 7.5, 0.0, 0.5])
    assert np.isnan(found[1, 0])
    assert scene.terrain_height(110.2, 207.5) == pytest.approx([703.75])


def test_a_window_has_the_cores_where_they_are():
    """Cut off 8 columns and 3 rows: the same places in the world, and the same heights."""
    whole = prepared(reference=640.0)
    window = Scene.prepare(HEIGHTS[3:, 8:], 1.0, 100.0, 200.0, friction=0.3, first=(8, 3), reference=640.0, **parts())
    assert window.trees_outside.tolist() == [0, 2]  # the first tree stands west of it
    assert (TREE, 1) in listed(whole, (10.0, 5.0), (11.0, 5.0), 1.0)
    assert (TREE, 1) in listed(window, (2.0, 2.0), (3.0, 2.0), 1.0)
    assert (BLOCK, 5) in listed(whole, (15.0, 30.0), (15.5, 30.0), 1.0)
    assert (BLOCK, 5) in listed(window, (7.0, 27.0), (7.5, 27.0), 1.0)
    assert (TREE, 1) not in listed(window, (10.0, 5.0), (11.0, 5.0), 1.0)
    for name in ("x", "y", "z"):
        shift = {"x": (0, 8), "y": (1, 3)}.get(name)
        for kind in (TREE, BLOCK):
            places = []
            for scene, moved in ((whole, 0), (window, 1)):
                solid = scene.arrays.cores.solid
                row = np.flatnonzero(solid["kind"] == kind)[-1]
                node = 0 if shift is None else scene.arrays.cores.node[row, shift[0]] + moved * shift[1]
                places.append(solid[name][row] + node)
            assert places[0] == places[1]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"trees": Trees(np.array([105.0]), np.array([205.0]), np.array([-0.4]), np.array([9.0]))}, "diameter"),
        ({"barriers": Barriers(np.array([[103.0, 210], [108, 210]]), np.array([0, 2]), np.array([0.0]))}, "height"),
        ({"lines": Lines(np.array([[np.nan, 203], [139, 203]]), np.array([0, 2]))}, "a vertex of a line"),
        (
            {"barriers": Barriers(np.array([[np.inf, 210], [108, 210]]), np.array([0, 2]), np.array([1.0]))},
            "of a barrier",
        ),
    ],
)
def test_what_cannot_be_is_refused(change, says):
    with pytest.raises(ValueError, match=says):
        prepared(**change)
