"""Slide every dead tree in each of its states, without lying stems and among those that a treatment leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.lifetime.dead_trees import DeadTrees
from deadwood_algorithms.evaluate.lifetime.events import BARE, Slides, worst_trees
from deadwood_algorithms.evaluate.lifetime.treatments import ACROSS_SCENE, BROKEN, MOVED, WHOLE, Treatment
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.prepare.trees.throwing import LEAST_LOG_M, TAPER, Lying, lying_stems
from deadwood_algorithms.results.passages import passages_of_lines
from deadwood_algorithms.results.run_folder import read_run
from deadwood_algorithms.stats import draws

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks

Array = NDArray[np.float64]
STATE_NAMES = ("whole", "broken", "moved")
STUMP_M = 0.5
BREAK_M = (2.0, 6.0)  # height at which snags break: a few metres (Ammann 2006)
TILT_DEG = 5.0  # of a falling snag, in a random direction: where it goes is not known
FOLDS = 5  # a stem slides among the lying stems of the other folds, for its own cannot hold it


@dataclass(frozen=True)
class States:
    """The slides, one row each: row of the tree, what slides, number of the repeat, fold of the tree; and their
    releases layer.
    """

    tree: NDArray[np.int64]
    state: NDArray[np.int64]
    repeat: NDArray[np.int64]
    fold: NDArray[np.int64]
    frame: geopandas.GeoDataFrame


@dataclass(frozen=True)
class Slid:
    """A stand whose dead trees, or some of them, slid: the lines, and by scene the energies (`energies_of`)."""

    stand: DeadTrees
    trees: DeadTrees
    states: States
    lines: list[str]
    energies: dict[str, Array]


def states_of(trees: DeadTrees, ground: Grid | DemBlocks, repeats: int, density: float, seed: int) -> States:
    """Every tree ``repeats`` times in every state: in random directions, broken at random heights."""
    place = np.column_stack([trees.frame.geometry.x, trees.frame.geometry.y])
    parts: list[dict[str, Any]] = []
    for repeat in range(repeats):
        turn = 360.0 * draws.uniforms(seed, trees.item, draws.FALL_WAY, repeat)[0]
        share = draws.uniforms(seed, trees.item, draws.BREAK_HEIGHT, repeat)[0]
        low = np.minimum(BREAK_M[0] + share * (BREAK_M[1] - BREAK_M[0]), 0.5 * trees.height_m)
        lying = lying_stems(place, trees.dbh_cm, trees.height_m, turn, STUMP_M, ground)
        middle = np.where(lying.off[:, None], place, 0.5 * (lying.base + lying.tip))
        thinner = trees.dbh_cm * (1.0 - (1.0 - TAPER) * low / trees.height_m)
        whole = trees.height_m - np.minimum(STUMP_M, 0.5 * trees.height_m)
        for state, at, dbh, length, drop in (
            (WHOLE, place, trees.dbh_cm, trees.height_m, 0.0),
            (BROKEN, place, thinner, trees.height_m - low, low),
            (MOVED, middle, lying.base_cm, whole, 0.0),
        ):
            falls = state != MOVED
            parts.append(
                {"tree": np.arange(len(trees)), "state": state, "repeat": repeat, "x": at[:, 0], "y": at[:, 1]}
                | {"dbh_cm": dbh, "length_m": np.maximum(length, LEAST_LOG_M), "drop_m": drop, "azimuth_deg": turn}
                | {"orientation": "tilted" if falls else "lying", "tilt_deg": TILT_DEG if falls else 0.0}
            )
    columns: dict[str, Any] = {
        name: np.concatenate([np.broadcast_to(np.asarray(each[name]), len(trees)) for each in parts])
        for name in parts[0]
    }
    tree, state, repeat = (columns.pop(name).astype(np.int64) for name in ("tree", "state", "repeat"))
    points = shapely.points(columns.pop("x"), columns.pop("y"))
    names = np.array(STATE_NAMES, object)
    columns |= {"log_id": np.arange(tree.size), "release_id": names[state], "density_kg_m3": density}
    columns |= {"orientation": columns["orientation"].astype(object)}
    fold = _folds(trees)[tree]
    return States(tree, state, repeat, fold, geopandas.GeoDataFrame(columns, geometry=points, crs=trees.frame.crs))


def lying_in(scene: str, trees: DeadTrees, ground: Grid | DemBlocks, seed: int) -> geopandas.GeoDataFrame:
    """All stems lying: in random directions, or across the slope; those off the terrain are missing."""
    place = np.column_stack([trees.frame.geometry.x, trees.frame.geometry.y])
    azimuth = 360.0 * draws.uniforms(seed, trees.item, draws.FALL_WAY, 2**31)[0]
    if scene == ACROSS_SCENE:
        azimuth = (fall_lines(place, ground) + np.where(azimuth < 180.0, 90.0, 270.0)) % 360.0
    lying: Lying = lying_stems(place, trees.dbh_cm, trees.height_m, azimuth, STUMP_M, ground)
    lines = shapely.linestrings(np.stack([lying.base, lying.tip], axis=1))
    columns = {"fold": _folds(trees), "lying_id": trees.ids}
    columns |= {"diameter_cm": lying.base_cm, "tip_diameter_cm": lying.tip_cm}
    frame = geopandas.GeoDataFrame(columns, geometry=lines, crs=trees.frame.crs)
    kept: Any = frame[~lying.off]
    return kept


def _folds(trees: DeadTrees) -> NDArray[np.int64]:
    return (trees.item % np.uint64(FOLDS)).astype(np.int64)


def fall_lines(place: Array, ground: Grid | DemBlocks, reach_m: float = 5.0) -> Array:
    """Azimuth of the steepest descent over a few metres [deg]; 180 where the ground is flat or ends."""
    east, north = (
        ground.height(*(place + step).T) - ground.height(*(place - step).T)
        for step in (np.array([reach_m, 0.0]), np.array([0.0, reach_m]))
    )
    return np.nan_to_num(np.degrees(np.arctan2(-east, -north)) % 360.0, nan=180.0)


def energies_of(
    states: States,
    laid: dict[str, geopandas.GeoDataFrame],
    place: Path,
    slide: Callable[[Path, Path, Path | None], None],
    feedback: Feedback,
) -> tuple[list[str], dict[str, Array]]:
    """The lines, and by scene the energy [kJ] with which each slide first touches each; NaN where it does not.

    slide : slides a releases layer among lying logs, or None, into a run
    """
    found: dict[str, Array] = {}
    write_vector(place / "states.gpkg", {"releases": states.frame})
    slide(place / "states.gpkg", place / "run", None)
    lines, found[BARE] = _energies(place / "run", states.tree.size, feedback)
    for scene, frame in laid.items():
        found[scene] = np.full_like(found[BARE], np.nan)
        for fold in range(FOLDS):
            rows = np.flatnonzero(states.fold == fold)
            others: Any = frame[frame["fold"] != fold].drop(columns="fold")
            if not rows.size:
                continue
            if not len(others):
                found[scene][rows] = found[BARE][rows]
                continue
            work = place / f"{scene}_{fold}"
            work.mkdir()
            write_vector(work / "states.gpkg", {"releases": states.frame.iloc[rows].reset_index(drop=True)})
            write_vector(work / "lying.gpkg", {"lying_logs": others.reset_index(drop=True)})
            slide(work / "states.gpkg", work / "run", work / "lying.gpkg")
            found[scene][rows] = _energies(work / "run", states.tree.size, feedback)[1][rows]
    return lines, found


def _energies(run: Path, count: int, feedback: Feedback) -> tuple[list[str], Array]:
    passages = passages_of_lines(read_run(str(run), feedback=feedback), None, feedback)
    found = np.full((count, len(passages)), np.nan)
    for column, each in enumerate(passages):
        found[each.log_id, column] = each.values["energy"]
    return [each.place_id for each in passages], found


def thresholds_of(energies: Sequence[Array], bounds: Sequence[float], most: int = 20) -> list[Array]:
    """For each line the energies at which arrivals are counted, ascending from 0: the bounds, and quantiles of all
    arrivals, so that the energy of a return period is found among them.
    """
    found = []
    for column in range(energies[0].shape[1]):
        values = np.concatenate([each[:, column] for each in energies])
        values = values[np.isfinite(values)]
        steps = np.quantile(values, np.linspace(0.0, 1.0, most)) if values.size else np.zeros(0)
        found.append(np.unique(np.concatenate([[0.0], bounds, steps])))
    return found


def slides_that_count(
    slid: Slid, of_tree: NDArray[np.int64], steps: Sequence[Array], treatments: Sequence[Treatment], part: float
) -> tuple[Slides, NDArray[np.bool_]]:
    """The slides with what arrived, and the stems that are picked.

    If a treatment picks stems, half of the slides finds them and only the other half counts: those that show most
    arrivals by chance would look worse than they are. ``of_tree`` : the kind of each tree; ``steps`` : thresholds of
    energy by line (`thresholds_of`); ``part`` : share of the stems that is picked
    """
    states, trees = slid.states, slid.trees
    repeats = int(states.repeat.max()) + 1
    picked, counts = np.zeros(len(trees), bool), np.ones(states.tree.size, bool)
    if any(each.picked for each in treatments):
        counts = states.repeat >= repeats // 2
        reach = np.isfinite(slid.energies[BARE][~counts])
        picked = worst_trees(reach, states.tree[~counts], trees.item, part)
        repeats -= repeats // 2
    arrived = {
        scene: np.concatenate([of[counts][:, [k]] >= each for k, each in enumerate(steps)], axis=1)
        for scene, of in slid.energies.items()
    }
    tree = states.tree[counts]
    weight = repeats * len(trees) / len(slid.stand)  # a slide stands for several stems if not all slid
    return Slides(of_tree[tree], states.state[counts], picked[tree], arrived, weight), picked
