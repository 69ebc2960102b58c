"""Dead trees as arrays: size, age, posture, and how fast their wood decays."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import schema_column, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.vectors import read_vector, write_vector
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.presets import OF_SPECIES, SPRUCE
from deadwood_algorithms.params.species import species_of
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.prepare.trees.throwing import item_numbers
from deadwood_algorithms.scene.items import extent_words, ids_of, plan_of, say_left_out, shared_words, why_left_out
from deadwood_algorithms.schemas import DEAD_TREES
from deadwood_algorithms.stats import draws

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks

Array = NDArray[np.float64]

SAME_PLACE_M = 0.5  # two stems closer than this are one tree of two layers


@dataclass(frozen=True)
class DeadTrees:
    """One row a tree; ``item`` is the number on which its draws depend, ``speed`` its decay relative to spruce."""

    frame: geopandas.GeoDataFrame
    ids: NDArray[Any]
    item: NDArray[np.uint64]
    dbh_cm: Array
    height_m: Array
    years_dead: Array
    standing: NDArray[np.bool_]
    speed: Array

    def __len__(self) -> int:
        return self.item.size

    def sample(self, most: int, seed: int) -> DeadTrees:
        """At most this many of the trees, drawn at random by their ids."""
        rows = np.sort(np.lexsort((self.item, draws.uniforms(seed, self.item, draws.SLID_TREE)[0]))[:most])
        arrays = {field.name: getattr(self, field.name)[rows] for field in fields(self) if field.name != "frame"}
        return DeadTrees(self.frame.iloc[rows].reset_index(drop=True), **arrays)  # type: ignore[arg-type]


def read_dead_trees(
    path: str, years_dead: float, ground: Grid | DemBlocks | None, crs: str | None, feedback: Feedback
) -> DeadTrees:
    """The trees of a layer, on the terrain if there is one; a duplicate id is rejected."""
    target = ground.crs if ground else None
    frame = read_vector(path, geometry=("point",), target_crs=target, crs=crs, what="dead_trees", feedback=feedback)
    sizes = [schema_column(frame, DEAD_TREES.column(name)) for name in ("dbh_cm", "height_m")]
    years = schema_column(frame, DEAD_TREES.column("years_dead"), years_dead)
    standing = schema_column(frame, DEAD_TREES.column("standing"), 1.0)
    if not np.isin(standing, (0.0, 1.0)).all():
        row = int(np.argmin(np.isin(standing, (0.0, 1.0))))
        raise UserError(f"{where_of(frame)}, field 'standing', row {row + 1}: {standing[row]:g} is not 1 or 0")
    ids = ids_of(frame, "tree_id")
    if twins := shared_words(frame, "tree_id", ids.tolist()):
        raise UserError(f"{twins}; deadwood-tool import-trees numbers them again")
    on = np.ones(len(frame), bool)
    if ground:
        x, y = plan_of(frame)
        on = ground.contains(x, y)
        if not on.any():
            raise UserError(f"{path}: no dead tree stands on the DEM{extent_words(x, y, ground)}")
        say_left_out(frame, ~on, "dead trees", feedback.note)
        account("dead_trees", count_of(len(frame), on.sum(), why_left_out(ground, x[~on], y[~on])))
    else:
        account("dead_trees", count_of(len(frame), len(frame), {}))
    kept: Any = frame[on].reset_index(drop=True)
    items = item_numbers([str(each) for each in ids[on]])
    speed = _speeds(kept, feedback)
    dbh, height, years = (each[on] for each in (*sizes, years))
    return DeadTrees(kept, ids[on], items, dbh, height, years, standing[on] == 1.0, speed)


def _speeds(frame: geopandas.GeoDataFrame, feedback: Feedback) -> Array:
    names = [str(each) for each in frame["species"].fillna("")] if "species" in frame else [""] * len(frame)
    found = {name: species_of(name) for name in dict.fromkeys(names)}
    woods = {name: OF_SPECIES.get(each.binomial) if each else None for name, each in found.items()}
    if strange := sorted(name for name, wood in woods.items() if wood is None and name.strip()):
        feedback.note(
            f"{where_of(frame)}: no rate of decay is known for {', '.join(strange)}; that of spruce is used",
            code="species-unknown",
        )
    return np.array([(woods[name] or SPRUCE).rate / SPRUCE.rate for name in names])


def living_of(path: str, dead: DeadTrees, crs: str | None, place: Path, feedback: Feedback) -> tuple[str | None, int]:
    """The layer of living trees without those that stand where a dead one stands, None if none is left; and how many
    were left out.

    One layer of a whole stand is what people have; a dead tree among the living would hold its own log. Written to
    ``place`` if any has to be left out.
    """
    target = dead.frame.crs
    frame = read_vector(path, geometry=("point",), target_crs=target, crs=crs, what="trees", feedback=Quiet())
    same = shapely.STRtree(frame.geometry.values).query(dead.frame.geometry.values, "dwithin", SAME_PLACE_M)[1]
    if not same.size:
        return path, 0
    living: Any = frame.drop(index=frame.index[np.unique(same)])
    fewer = len(frame) - len(living)
    feedback.note(
        f"{where_of(frame)}: {counted(fewer, 'tree')} of {len(frame)} stand where a dead tree stands, "
        "and are not counted among the living",
        code="dead-among-living",
        trees=fewer,
    )
    if not len(living):
        return None, fewer
    write_vector(place, {"trees": living})
    return f"{place}|layername=trees", fewer
