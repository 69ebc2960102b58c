"""A worker's part: it slides a piece of the work (some logs) on a scene that was sent to it before.

A piece names the engine and the digests of everything that it needs; a worker with another engine or another
scene rejects it. All data are exchanged as blocks of `packed`, so a worker does not unpickle them; only the
reference to these functions is what Dask itself sends.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.simulate.joined import joined_results
from deadwood_algorithms.simulate.packed import (
    block_of,
    digest_of_array,
    digest_of_block,
    from_block,
    put_together,
    taken_apart,
)
from deadwood_algorithms.simulate.sparse import take_sparse
from deadwood_engine import FIDELITIES, Fidelity, Logs, Rasters, Result, Scene, Start, Trees, place_logs, slide

# Arrays larger than this [bytes] are sent separately: for another friction or line the terrain is not sent again.
LARGE = 1 << 15
_KEPT_SCENES = 3
_scenes: OrderedDict[str, Scene] = OrderedDict()
_lock = threading.Lock()
_mine = threading.local()


class WrongScene(Exception):
    """A piece has arrived with other arrays than those that it names."""


class WrongEngine(Exception):
    """A piece has been sent to a worker with another engine."""


def packed_scene(scene: Scene) -> tuple[bytes, dict[str, NDArray]]:
    """A scene as a block, and its large arrays by their digests."""
    arrays: list[NDArray] = []
    said = taken_apart(scene, arrays)
    large = {k: digest_of_array(each) for k, each in enumerate(arrays) if each.nbytes >= LARGE}
    small = [each for k, each in enumerate(arrays) if k not in large]
    block = block_of({"scene": said, "large": {str(k): digest for k, digest in large.items()}}, small)
    return block, {digest: arrays[k] for k, digest in large.items()}


def scene_of(block: bytes, large: Sequence[NDArray]) -> tuple[str, Scene]:
    """The digest of a scene's block, and the scene; ``large`` are its large arrays, in the order of their places."""
    digest = digest_of_block(block)
    with _lock:
        if digest not in _scenes:
            facts, small = from_block(block)
            wanted = {int(k): name for k, name in facts["large"].items()}
            if [digest_of_array(each) for each in large] != list(dict.fromkeys(wanted.values())):
                raise WrongScene("the arrays of a scene are not those that were sent")
            by_name = dict(zip(dict.fromkeys(wanted.values()), (_for_kernels(each) for each in large), strict=True))
            rest = iter(small)
            total = len(wanted) + len(small)
            arrays = [by_name[wanted[k]] if k in wanted else next(rest) for k in range(total)]
            _scenes[digest] = put_together(facts["scene"], arrays)
            while len(_scenes) > _KEPT_SCENES:
                _scenes.popitem(last=False)
        _scenes.move_to_end(digest)
        return digest, _scenes[digest]


def _for_kernels(array: NDArray) -> NDArray:
    """Arrays from the network may be read-only or unaligned, for which the kernels would be compiled again."""
    return np.require(array, requirements=["C", "A", "W"])


def slide_piece(order: bytes, block: bytes, large: Sequence[NDArray]) -> bytes:
    """Slide the logs of a piece, on one thread; their results, and the cells that they passed."""
    facts, (frame, state, body, keep, inside, bands) = from_block(order)
    if (facts["version"], facts["engine"]) != (VERSION, engine_digest()):
        raise WrongEngine(f"version {VERSION}, engine {engine_digest()}")
    digest, scene = scene_of(block, large)
    if digest != facts["scene"]:
        raise WrongScene(f"the piece is of the scene {facts['scene']}, the worker was handed {digest}")
    rasters = _empty_rasters(digest, scene, bands) if facts["rasters"] else None
    found, first = [], 0
    for number, missing in facts["missing"] or [[len(state), []]]:
        rows = slice(first, first + number)
        found.append(
            slide(
                scene_without(scene, np.array(missing, np.int64)) if missing else scene,
                Start(frame[rows], state[rows], body[rows]),
                Fidelity(*facts["fidelity"]),
                **facts["laws"],
                threads=1,
                keep_poses=keep[rows],
                rasters=rasters,
                inside=inside[rows],
                influences=facts["influences"],
            )
        )
        first = rows.stop
    result = joined_results(found)
    arrays: list[NDArray] = []
    said = taken_apart(result, arrays)
    cells: dict[str, NDArray] = {}
    if rasters:
        cells = take_sparse(rasters)
        _mine.rasters = digest, bands.tobytes(), rasters
    return block_of({"of": digest_of_block(order), "result": said, "cells": list(cells)}, [*arrays, *cells.values()])


def scene_without(scene: Scene, missing: Any) -> Scene:
    """The scene without some obstacles; barrier b counts as -1 - b, others as numbered by ``Scene.without``."""
    return scene.without(barriers=-1 - missing[missing < 0], others=missing[missing >= 0])


def _empty_rasters(digest: str, scene: Scene, bands: NDArray[np.int64]) -> Rasters:
    """Lend out this thread's rasters of the scene, which are returned empty or not at all."""
    kept = getattr(_mine, "rasters", None)
    _mine.rasters = None
    if kept and kept[:2] == (digest, bands.tobytes()):
        return kept[2]
    return Rasters.allocate(scene, 1, bands)


def answer_of(block: bytes, order: str) -> tuple[Result, dict[str, NDArray]]:
    """The result and the cells in a worker's answer to the order of this digest."""
    facts, arrays = from_block(block)
    if facts["of"] != order:
        raise WrongScene("a worker has answered another order than it was given")
    first = len(arrays) - len(facts["cells"])
    return put_together(facts["result"], arrays[:first]), dict(zip(facts["cells"], arrays[first:], strict=True))


def look(version: str, engine: str) -> bytes:
    """Version and engine of this process and, if they are these, the digest of its results for a few logs.

    The same engine gives other bits on another processor or with another library of sines and cosines: only a
    worker with the same digest as the requesting machine can give the same bytes.
    """
    facts = {"version": VERSION, "engine": engine_digest()}
    if facts != {"version": version, "engine": engine}:
        return block_of(facts, [])
    scene, logs = _trial()
    start = place_logs(scene, logs)
    rasters = Rasters.allocate(scene, 1)
    every = np.ones(len(logs), bool)
    result = slide(scene, start, FIDELITIES["draft"], time_limit=8.0, keep_poses=every, rasters=rasters)
    arrays: list[NDArray] = []
    said = taken_apart(replace(result, cost={}), arrays)
    bits = digest_of_block(block_of({"result": said}, [*arrays, *take_sparse(rasters).values()]))
    return block_of({**facts, "bits": bits}, [])


def _trial() -> tuple[Scene, Logs]:
    """Eight logs on a rough slope with trees."""
    along, across = np.mgrid[0.0:80.0, 0.0:40.0]
    heights = 0.7 * along + 0.35 * np.abs((7.0 * across + 3.0 * along) % 5.0 - 2.5)
    trees = np.array([(4.0 + 5.5 * k % 33.0, 5.0 + 7.0 * k % 50.0) for k in range(20)])
    standing = Trees(trees[:, 0], trees[:, 1], np.full(20, 0.4), np.full(20, 20.0))
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3, trees=standing)
    logs = Logs.alike(6.0 + 3.5 * np.arange(8.0), np.full(8, 65.0), diameter=0.4, length=8.0, tilt=0.3, orientation=2)
    return scene, logs
