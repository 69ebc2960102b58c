"""What became of the rows of a scene's layers: read, used, and left out and why."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import NO_TERRAIN, OFF_DEM, account, count_of
from deadwood_algorithms.scene.items import Items, count_of_items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.schemas.obstacles import STUMP_BELOW_M

BEYOND_WINDOW = "beyond_window"  # beyond the part of the terrain model that logs can reach
NOT_RUN = "not_run"  # a log that --until-ci or --error made needless, or that --logs did not draw
WHYS = (OFF_DEM, NO_TERRAIN, BEYOND_WINDOW, NOT_RUN)


def counts_of_scene(layers: SceneLayers) -> dict[str, dict[str, Any]]:
    """For each layer of a scene that was given: its rows, those that are in the scene, and why the others are not."""
    scene = layers.scene
    trees, blocks = layers.trees, layers.blocks.solid
    rows = np.arange(len(layers.tree_ids))
    low = np.asarray(trees.height) < STUMP_BELOW_M
    boulders = np.arange(len(layers.blocks.ids))
    counts = {
        "trees": _points(layers, trees, rows[~low], layers.trees_left_out, scene.trees_outside),
        "stumps": _points(layers, trees, rows[low], layers.stumps_left_out, scene.trees_outside),
        "barriers": count_of_rows(layers, layers.barriers, layers.engine_barriers, scene.barriers_outside),
        "lying_logs": count_of_rows(layers, layers.lying, layers.lying_logs, scene.lying_outside),
        "blocks": _points(layers, blocks, boulders, layers.blocks.left_out, scene.blocks_outside),
        "lines": count_of_items(layers.lines),
    }
    return {name: count for name, count in counts.items() if count["read"]}


def account_scene(layers: SceneLayers) -> None:
    for name, count in counts_of_scene(layers).items():
        account(name, count)


def in_scene(number: int, outside: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of n things are not among those outside."""
    used = np.ones(number, bool)
    used[outside] = False
    return used


def _left_out(layers: SceneLayers, shapes: NDArray[Any]) -> Counter[str]:
    """Why things have no terrain below them: it has no height there, or they lie beyond the window that was read."""
    here = shapely.intersects(shapes, shapely.box(*layers.dem.bounds))
    return Counter({NO_TERRAIN: int(here.sum()), BEYOND_WINDOW: int((~here).sum())})


def _points(
    layers: SceneLayers, of: Any, rows: NDArray[np.int64], off: Counter[str], outside: NDArray[np.int64]
) -> dict[str, Any]:
    """Of these rows of a layer of points, whose others are off the DEM (by why)."""
    gone = np.intersect1d(rows, outside)
    why = _left_out(layers, np.asarray(shapely.points(np.column_stack([of.x, of.y])[gone])))
    return count_of(rows.size + off.total(), rows.size - gone.size, _in_order(off + why))


def count_of_rows(layers: SceneLayers, items: Items, paths: Any, outside: NDArray[np.int64]) -> dict[str, Any]:
    """Of a layer of lines, whose rows may have several parts: a row is used if one of its parts is."""
    used = set(items.row[in_scene(len(items.row), outside)].tolist())
    lost = [np.flatnonzero(items.row == row)[0] for row in sorted(set(items.row.tolist()) - used)]
    shapes = np.array([shapely.linestrings(paths.vertices[slice(*paths.starts[k : k + 2])]) for k in lost], object)
    why = _left_out(layers, shapes) if lost else Counter[str]()
    return count_of(
        items.row_count, len(used), _in_order(why + Counter({OFF_DEM: items.row_count - np.unique(items.row).size}))
    )


def _in_order(left_out: Counter[str]) -> dict[str, int]:
    return {why: left_out[why] for why in WHYS}
