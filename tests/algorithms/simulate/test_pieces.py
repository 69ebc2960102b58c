"""Pieces add up to the whole: results and rasters of any split are those of one call of the engine."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.simulate import piece
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.joined import joined_results, rows_of_result
from deadwood_algorithms.simulate.packed import block_of, digest_of_block, from_block, taken_apart
from deadwood_algorithms.simulate.sparse import add_sparse
from deadwood_algorithms.simulate.workers import missing_in
from deadwood_engine import FIDELITIES, Barriers, Lines, Logs, Rasters, Scene, Start, Trees, place_logs, slide

LAWS = {"restitution": 0.1, "rolling_friction": 0.05, "time_limit": 20.0, "rest_speed": 0.1}
NUMBER = 14


def scene_and_logs() -> tuple[Scene, Logs]:
    rng = np.random.default_rng(3)
    heights = np.add.outer(np.arange(90.0) * 0.7, rng.random(60) * 0.6)
    trees = Trees(rng.uniform(5, 55, 25), rng.uniform(5, 60, 25), np.full(25, 0.4), np.full(25, 20.0))
    barriers = Barriers(np.array([[10.0, 20.0], [40.0, 21.0]]), np.array([0, 2]), np.array([2.0]))
    lines = Lines(np.array([[1.0, 12.0], [58.0, 13.0]]), np.array([0, 2]))
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3, trees=trees, barriers=barriers, lines=lines)
    x, y = rng.uniform(12, 48, NUMBER), rng.uniform(62, 80, NUMBER)
    return scene, Logs.alike(x, y, diameter=0.4, length=9.0)


def answer(
    world: Scene, start: Start, rows: slice, bands: np.ndarray, keep: np.ndarray, **changes
) -> tuple[bytes, str]:
    """A worker's answer for these rows, and the digest of the order."""
    block, large = piece.packed_scene(world)
    facts = {
        "version": VERSION,
        "engine": engine_digest(),
        "scene": digest_of_block(block),
        "fidelity": list(FIDELITIES["draft"]),
        "laws": LAWS,
        "rasters": True,
        "influences": True,
        "missing": [],
    }
    tables = [start.frame[rows], start.state[rows], start.body[rows], keep[rows]]
    order = block_of({**facts, **changes}, [*tables, np.zeros((rows.stop - rows.start, 1), bool), bands])
    return piece.slide_piece(order, block, list(large.values())), digest_of_block(order)


@pytest.mark.parametrize("cut", [[0, NUMBER], [0, 1, 6, 13, NUMBER], list(range(NUMBER + 1))])
def test_pieces_come_to_the_whole(cut):
    scene, logs = scene_and_logs()
    bands, keep = np.array([1]), np.arange(NUMBER) % 3 == 0
    whole = Rasters.allocate(scene, 2, bands)
    result = slide(scene, logs, FIDELITIES["draft"], **LAWS, threads=2, keep_poses=keep, rasters=whole, influences=True)
    assert len(result.hits.item) > 5
    assert len(result.influences.item) > 5
    assert result.reach.any()

    start, found, pieces = place_logs(scene, logs), Rasters.allocate(scene, 2, bands), []
    for first, last in pairwise(cut):
        block, order = answer(scene, start, slice(first, last), bands, keep)
        part, cells = piece.answer_of(block, order)
        pieces.append(part)
        add_sparse(found, cells)

    for name, values in whole.totals().items():
        assert values.tobytes() == found.totals()[name].tobytes(), name
    one: list[np.ndarray] = []
    other: list[np.ndarray] = []
    again = joined_results([rows_of_result(result, first, last) for first, last in pairwise(cut)])
    assert again.influences.log_row.tolist() == result.influences.log_row.tolist()
    assert again.poses.position.tobytes() == result.poses.position.tobytes()
    joined = joined_results(pieces)
    said = [taken_apart(each, arrays) for each, arrays in ((result, one), (joined, other))]
    for facts in said:
        del facts["fields"][-1]["words"]["cpu_s"]
    assert said[0] == said[1]
    for a, b in zip(one, other, strict=True):
        assert (a.dtype, a.shape, np.ascontiguousarray(a).tobytes()) == (b.dtype, b.shape, b.tobytes())


def test_logs_that_miss_obstacles_slide_without_them():
    """Sequences of logs in separate scenes, however they are split: each log as in a run in that scene."""
    scene, logs = scene_and_logs()
    none, runs = np.zeros(NUMBER, bool), [(5, [0, 3, -1]), (1, [7]), (8, [-1])]
    start = place_logs(scene, logs)
    wanted, first = [], 0
    for number, missing in runs:
        some = Start(start.frame[first:], start.state[first:], start.body[first:])
        fewer = piece.scene_without(scene, np.array(missing))
        wanted.append(slide(fewer, some, FIDELITIES["draft"], **LAWS, threads=1))
        first += number
    for rows in (slice(0, NUMBER), slice(3, 7), slice(5, 6)):
        cut = missing_in(Batch(start, missing=[(n, np.array(each)) for n, each in runs]), rows)
        assert sum(n for n, _ in cut) == rows.stop - rows.start
        block, order = answer(scene, start, rows, np.zeros(0, np.int64), none, rasters=False, missing=cut)
        found, _ = piece.answer_of(block, order)
        for k, row in enumerate(range(rows.start, rows.stop)):
            own = 0 if row < 5 else 1 if row < 6 else 2
            before = sum(n for n, _ in runs[:own])
            assert (found.last_state[k] == wanted[own].last_state[row - before]).all()
    plain = slide(scene, logs, FIDELITIES["draft"], **LAWS, threads=1)
    assert (plain.last_state[:5] != wanted[0].last_state[:5]).any()


def test_a_worker_refuses_the_order_of_another_engine_or_scene():
    scene, logs = scene_and_logs()
    start, rows, none = place_logs(scene, logs), slice(0, 2), np.zeros(NUMBER, bool)
    with pytest.raises(piece.WrongEngine, match=engine_digest()):
        answer(scene, start, rows, np.array([1]), none, engine="another")
    with pytest.raises(piece.WrongScene, match="the piece is of the scene another"):
        answer(scene, start, rows, np.array([1]), none, scene="another")
    block, order = answer(scene, start, rows, np.array([1]), none)
    piece.answer_of(block, order)
    with pytest.raises(piece.WrongScene, match="another order"):
        piece.answer_of(block, "another")


def test_a_worker_that_computes_other_bits_is_distinguished_from_one_that_does_not(monkeypatch):
    """By its results for a few logs; one with another engine does not even compile."""
    facts = from_block(piece.look(VERSION, engine_digest()))[0]
    assert facts == from_block(piece.look(VERSION, engine_digest()))[0]
    assert set(from_block(piece.look(VERSION, "another"))[0]) == {"version", "engine"}
    plain = place_logs
    monkeypatch.setattr(piece, "place_logs", lambda *words: _nudged(plain(*words)))
    assert from_block(piece.look(VERSION, engine_digest()))[0]["bits"] != facts["bits"]


def _nudged(start: Start) -> Start:
    """One bit of one number."""
    start.state[3, 2] = np.nextafter(start.state[3, 2], 1e9)
    return start
