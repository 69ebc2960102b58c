"""Blocks of facts and arrays return unchanged, a scene bit for bit and with the types that kernels see."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of
from numba import typeof

from deadwood_algorithms.simulate import packed, piece
from deadwood_engine import Barriers, Lines, Scene, Shape, Trees

DTYPES = st.sampled_from(["<f8", "<f4", "<i8", "<u4", "|b1", "|i1"])
ARRAYS = arrays_of.arrays(DTYPES, arrays_of.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5))


@given(st.lists(ARRAYS, max_size=4), st.dictionaries(st.text(), st.integers() | st.floats(allow_nan=False) | st.none()))
def test_what_is_packed_comes_back(arrays, facts):
    block = packed.block_of(facts, arrays)
    assert block == packed.block_of(facts, arrays)
    found, back = packed.from_block(block)
    assert found == facts
    for one, other in zip(arrays, back, strict=True):
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
        assert other.flags.writeable
        assert other.flags.aligned


def test_objects_are_refused_both_ways():
    with pytest.raises(TypeError, match="objects cannot be packed"):
        packed.block_of({}, [np.array([{}], object)])
    with pytest.raises(TypeError, match="cannot be packed"):
        packed.taken_apart(object(), [])
    with pytest.raises(KeyError):
        packed.put_together({"record": "Popen", "fields": ["true"]}, [])


def scene_with_everything(friction) -> Scene:
    rng = np.random.default_rng(1)
    heights = np.add.outer(np.linspace(0.0, 60.0, 150), rng.random(120))
    trees = Trees(rng.uniform(5, 100, 40), rng.uniform(5, 100, 40), np.full(40, 0.4), np.full(40, 20.0))
    barriers = Barriers(np.array([[10.0, 20.0], [60.0, 21.0]]), np.array([0, 2]), np.array([2.0]))
    lines = Lines(np.array([[5.0, 5.0], [90.0, 6.0]]), np.array([0, 2]))
    return Scene.prepare(
        heights, 1.0, 3.0, 4.0, friction=friction, trees=trees, barriers=barriers, lines=lines, first=(2, 1)
    )


def leaves(record) -> list:
    arrays: list[np.ndarray] = []
    return [packed.taken_apart(record, arrays), *((each.dtype, each.shape, each.tobytes()) for each in arrays)]


@pytest.mark.parametrize("shaped", [False, True])
def test_a_scene_comes_back_to_the_bit_and_to_the_type(shaped):
    scene = scene_with_everything(np.full((150, 120), 0.3))
    if shaped:
        corners = [(x, y, z) for x in (-1.0, 1.0) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
        arrays = scene.arrays._replace(cloud=Shape.of(np.array(corners)).cloud)
        scene = Scene(arrays, *(getattr(scene, each) for each in list(scene.__dataclass_fields__)[1:]))
    block, large = piece.packed_scene(scene)
    assert large  # the terrain is sent separately
    digest, back = piece.scene_of(block, list(large.values()))
    assert digest == packed.digest_of_block(block)
    assert leaves(back) == leaves(scene)
    assert typeof(back.arrays) == typeof(scene.arrays)  # otherwise every kernel would be recompiled


def test_what_came_read_only_or_askew_is_fixed():
    """As arrays may be in a message; every digest depends on the values only."""
    scene = scene_with_everything(0.31)
    block, large = piece.packed_scene(scene)
    askew = []
    for array in large.values():
        room = np.zeros(array.nbytes + 1, np.uint8)
        room[1:] = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
        other = room[1:].view(array.dtype).reshape(array.shape)
        other.flags.writeable = False
        askew.append(other)
    _, back = piece.scene_of(block, askew)
    assert typeof(back.arrays) == typeof(scene.arrays)


def test_a_scene_shares_its_terrain_with_one_of_other_friction():
    scene = scene_with_everything(0.32)
    one, other = (piece.packed_scene(each) for each in (scene, scene.with_friction(0.4)))
    assert one[0] != other[0]
    assert list(one[1]) == list(other[1])


def test_another_array_than_the_one_sent_is_refused():
    block, large = piece.packed_scene(scene_with_everything(0.33))
    wrong = [each.copy() for each in large.values()]
    wrong[0].reshape(-1).view(np.uint8)[7] ^= 1
    with pytest.raises(piece.WrongScene, match="not those that were sent"):
        piece.scene_of(block, wrong)
