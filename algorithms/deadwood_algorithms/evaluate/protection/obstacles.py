"""The objects of a scene whose effect is computed: trees, lying logs, barriers, stands of trees, and candidates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import NO_TERRAIN, NO_TREE, account, count_of
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import none_of
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.counts import count_of_rows, in_scene
from deadwood_algorithms.scene.items import Items, ids_of
from deadwood_algorithms.scene.layers import SceneLayers, read_trees
from deadwood_algorithms.scene.lying_logs import read_lying_logs, with_more
from deadwood_engine import LyingLogs, Trees

TREE, LYING, BARRIER, STAND = "tree", "lying_log", "barrier", "stand"


@dataclass(frozen=True)
class Obstacle:
    """One object and its numbers in the engine: those of `Influences`, barriers counted down from -1.

    x, y : where it is shown [m]; shape : that of a stand, lying log or barrier, otherwise its position
    """

    kind: str
    id: str
    x: float
    y: float
    owners: NDArray[np.int64]
    shape: Any


def obstacles_of(layers: SceneLayers) -> list[Obstacle]:
    """Every tree, lying log and barrier that is on the terrain, in the order of its layer."""
    scene = layers.scene
    there = np.ones(len(layers.tree_ids), bool)
    there[scene.trees_outside] = False
    x, y = layers.trees.x, layers.trees.y
    found = [
        Obstacle(TREE, layers.tree_ids[row], x[row], y[row], np.array([row]), shapely.Point(x[row], y[row]))
        for row in np.flatnonzero(there).tolist()
    ]
    lying = np.setdiff1d(np.arange(scene.lying_count), scene.lying_outside)
    found += _things(LYING, layers.lying, lying, scene.tree_count + np.arange(scene.lying_count))
    barriers = np.setdiff1d(np.arange(scene.barrier_count), scene.barriers_outside)
    found += _things(BARRIER, layers.barriers, barriers, -1 - np.arange(scene.barrier_count))
    return found


def _things(kind: str, items: Items, there: NDArray[np.int64], owners: NDArray[np.int64]) -> list[Obstacle]:
    found = []
    for number, name in enumerate(items.ids):
        rows = there[items.item[there] == number]
        if rows.size:
            shape = items.geometry[number]
            place = _on_it(shape)
            found.append(Obstacle(kind, str(name), place.x, place.y, owners[rows], shape))
    return found


def _on_it(shape: Any) -> Any:
    """A point on a line (its midpoint if the line is one piece) or within a polygon."""
    if shapely.get_dimensions(shape) == 1 and shape.geom_type == "LineString":
        return shapely.line_interpolate_point(shape, 0.5, normalized=True)
    return shapely.point_on_surface(shape)


def read_stand_areas(path: str, layers: SceneLayers, feedback: Feedback) -> list[tuple[str, Any]]:
    """Ids and polygons of stands; a stand without trees has no effect, and is reported."""
    frame = read_vector(path, geometry=("polygon",), target_crs=layers.dem.crs, what="stands", feedback=feedback)
    areas = list(zip(map(str, ids_of(frame, "stand_id", "name").tolist()), frame.geometry, strict=True))
    held = [shapely.contains_xy(shape, layers.trees.x, layers.trees.y).any() for _, shape in areas]
    empty = [name for (name, _), holds in zip(areas, held, strict=True) if not holds]
    account("stands", count_of(len(frame), len(areas) - len(empty), {NO_TREE: len(empty)}))
    if len(empty) == len(areas):
        raise UserError(f"{path}: {none_of(len(areas), 'stand')} holds a tree of the run; check the layer")
    if empty:
        feedback.note(
            f"{path}: no tree of the run stands in {', '.join(empty[:5])}{', ...' if empty[5:] else ''}",
            code="areas-without-trees",
            areas=len(empty),
        )
    return areas


def stands_of(areas: Sequence[tuple[str, Any]], layers: SceneLayers) -> list[Obstacle]:
    """Each stand with the trees on the terrain within it."""
    there = np.ones(len(layers.tree_ids), bool)
    there[layers.scene.trees_outside] = False
    found = []
    for name, shape in areas:
        place = shapely.point_on_surface(shape)
        rows = np.flatnonzero(there & shapely.contains_xy(shape, layers.trees.x, layers.trees.y))
        found.append(Obstacle(STAND, name, place.x, place.y, rows, shape))
    return found


@dataclass(frozen=True)
class Candidates:
    """Candidate objects in the engine's form: standing ones (trees, high stumps) and lying logs."""

    trees: Trees
    tree_ids: list[str]
    tree_dbh_cm: NDArray[np.float64]
    trees_left_out: Counter[str]  # by why
    lying: LyingLogs
    lying_items: Items

    def __len__(self) -> int:
        return len(self.tree_ids) + len(self.lying_items.ids)

    @property
    def widest_radius(self) -> float:
        """Largest radius [m] of any of them; below the ground a stem is up to 1.5 times as thick as its DBH."""
        standing = 0.75 * self.trees.diameter
        lying = (self.lying.diameter, self.lying.tip_diameter)
        return float(max(standing.max(initial=0.0), *(0.5 * each.max(initial=0.0) for each in lying)))


def read_candidates(
    standing: str | None, lying: str | None, layers: SceneLayers, default_cm: float, feedback: Feedback
) -> Candidates:
    found = read_trees(standing, layers.dem, feedback)
    logs, items = read_lying_logs(lying, layers.dem, default_cm, feedback)
    return Candidates(found.trees, found.ids, found.dbh_cm, found.left_out, logs, items)


def with_candidates(layers: SceneLayers, candidates: Candidates) -> tuple[SceneLayers, list[Obstacle]]:
    """The scene with all candidates appended to its own objects, and the candidates; those off the terrain are left
    out.
    """
    own = layers.lying_logs
    both = replace(
        layers,
        trees=layers.trees.then(candidates.trees),
        tree_ids=[*layers.tree_ids, *candidates.tree_ids],
        tree_dbh_cm=np.concatenate([layers.tree_dbh_cm, candidates.tree_dbh_cm]),
        lying_logs=with_more(own, candidates.lying),
        lying=layers.lying.then(candidates.lying_items),
    ).prepared_again()
    _account(both, candidates, len(layers.tree_ids), len(own.diameter))
    first = {TREE: len(layers.tree_ids), LYING: both.scene.tree_count + len(own.diameter)}
    return both, [each for each in obstacles_of(both) if each.kind in first and each.owners[0] >= first[each.kind]]


def _account(both: SceneLayers, candidates: Candidates, own_trees: int, own_lying: int) -> None:
    """What became of the rows of the candidates' layers, in the scene that has them all."""
    off = both.scene.trees_outside[both.scene.trees_outside >= own_trees] - own_trees
    used = int(in_scene(len(candidates.tree_ids), off).sum())
    why = {**candidates.trees_left_out, NO_TERRAIN: candidates.trees_left_out[NO_TERRAIN] + off.size}
    account("plant", count_of(len(candidates.tree_ids) + candidates.trees_left_out.total(), used, why))
    off = both.scene.lying_outside[both.scene.lying_outside >= own_lying] - own_lying
    account("plant_lying", count_of_rows(both, candidates.lying_items, candidates.lying, off))
