"""Stems of a trees layer before and after a storm, and the layers of each scenario: for `windthrow`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import NO_TREE, account, count_of
from deadwood_algorithms.files.columns import number_column, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted, none_of
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees.throwing import LEAST_LOG_M, Lying, chosen_share, class_shares, item_numbers
from deadwood_algorithms.scene.items import extent_words, ids_of, plan_of, say_left_out, shared_words, why_left_out
from deadwood_algorithms.schemas import DBH_CM, TREES
from deadwood_algorithms.stats import draws

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks

STANDING, LYING, REMOVED = "standing", "lying", "removed"


@dataclass(frozen=True)
class Storm:
    """The parameters of the tool that determine which stems are thrown."""

    share: float | None
    dbh_classes: str | None
    windthrow_areas: str | None
    ids: str | None
    stump_m: float
    seed: int


@dataclass(frozen=True)
class Stems:
    """The trees on the terrain; ``frame`` has their columns, ``item`` is the number on which the draws of each
    depend.
    """

    frame: geopandas.GeoDataFrame
    ids: NDArray[Any]
    item: NDArray[np.uint64]
    dbh_cm: NDArray[np.float64]
    height_m: NDArray[np.float64]

    @property
    def place(self) -> NDArray[np.float64]:
        return np.column_stack(plan_of(self.frame))


def read_stems(path: str, grid: Grid | DemBlocks, crs: str | None, feedback: Feedback) -> Stems:
    """The trees that stand on the terrain; a duplicate id is rejected."""
    frame = read_vector(path, geometry=("point",), target_crs=grid.crs, crs=crs, what="trees", feedback=feedback)
    for name in ("dbh_cm", "height_m"):
        if name not in frame:
            raise UserError(
                f"{where_of(frame)}: the trees have no field '{name}'; "
                "deadwood-tool import-trees makes a trees layer of any table"
            )
    sizes = [schema_column(frame, TREES.column(name)) for name in ("dbh_cm", "height_m")]
    for name, values in zip(("dbh_cm", "height_m"), sizes, strict=True):
        warn_implausible(values, TREES.column(name), where_of(frame), feedback)
    ids = ids_of(frame, "tree_id")
    if twins := shared_words(frame, "tree_id", ids.tolist()):
        raise UserError(f"{twins}, so windthrow cannot distinguish them; deadwood-tool import-trees numbers them again")
    x, y = plan_of(frame)
    on = grid.contains(x, y)
    if not on.any():
        raise UserError(f"{path}: {none_of(len(frame), 'tree')} stands on the DEM{extent_words(x, y, grid)}")
    say_left_out(frame, ~on, "trees", feedback.note)
    account("trees", count_of(len(frame), on.sum(), why_left_out(grid, x[~on], y[~on])))
    kept: Any = frame[on].reset_index(drop=True)
    return Stems(kept, ids[on], item_numbers([str(each) for each in ids[on]]), sizes[0][on], sizes[1][on])


def thrown_stems(
    stems: Stems, storm: Storm, grid: Grid | DemBlocks, crs: str | None, feedback: Feedback
) -> NDArray[np.bool_]:
    """Which stems are thrown: those named by the user, and of the others the share of their area and class of DBH."""
    if storm.share is None and not (storm.dbh_classes or storm.windthrow_areas or storm.ids):
        raise UserError(
            "it is not specified which stems are thrown; give --share, --dbh-classes, --windthrow-areas or --ids"
        )
    share = np.full(stems.ids.size, np.nan if storm.share is None else storm.share)
    group = np.zeros(stems.ids.size, np.int64)
    if storm.dbh_classes:
        bounds, shares = class_shares(storm.dbh_classes, DBH_CM[1])
        group = np.searchsorted(bounds, stems.dbh_cm, side="right")
        share = np.where(group > 0, np.append(share[:1], shares)[group], share)
    if storm.windthrow_areas:
        area, own = _areas(stems, storm.windthrow_areas, grid, crs, feedback)
        share = np.where(area < 0, 0.0, np.where(np.isfinite(own), own, share))
        if np.isnan(share).any():
            raise UserError(
                f"{storm.windthrow_areas}: the areas have no field 'share', or gaps in it; fill it, or give --share or "
                "--dbh-classes"
            )
        # an area with its own share is one group, whatever the classes of its stems
        group = (area + 1) * 1000 + np.where(np.isfinite(own), 0, group)
    share = np.nan_to_num(share)
    named = _named(stems, storm.ids)
    short = stems.height_m - storm.stump_m < LEAST_LOG_M
    if (named & short).any():
        row = int(np.argmax(named & short))
        raise UserError(
            f"--ids: tree '{stems.ids[row]}' is {stems.height_m[row]:g} m high, of which a stump of "
            f"{storm.stump_m:g} m leaves no log; lower --stump-m"
        )
    may = ~named & ~short
    if short.any():
        feedback.note(
            f"{counted(int(short.sum()), 'tree leaves', 'trees leave')} no log above a stump of {storm.stump_m:g} m: "
            "left standing",
            code="no-log-above-stump",
            trees=int(short.sum()),
        )
    thrown = named.copy()
    thrown[may] = chosen_share(stems.item[may], share[may], group[may], storm.seed, draws.STEM_THROWN)
    if not thrown.any():
        raise UserError("no stem is thrown; raise the share, or check the areas and their CRS")
    return thrown


def _named(stems: Stems, ids: str | None) -> NDArray[np.bool_]:
    names = [each.strip() for each in (ids or "").split(",") if each.strip()]
    have = np.array([str(each) for each in stems.ids])
    unknown = np.setdiff1d(names, have)
    if unknown.size:
        more = f", nor are {unknown.size - 1} more" if unknown.size > 1 else ""
        raise UserError(f"--ids: tree '{unknown[0]}' is not among the trees on the DEM{more}")
    return np.isin(have, names)


def _areas(
    stems: Stems, path: str, grid: Grid | DemBlocks, crs: str | None, feedback: Feedback
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The row of the area in which each tree stands (the later one if areas overlap, -1 for none), and that row's
    share.
    """
    frame = read_vector(path, geometry=("polygon",), target_crs=grid.crs, crs=crs, what="areas", feedback=feedback)
    shares = np.full(len(frame), np.nan)
    if "share" in frame:
        shares = number_column(frame, "share", minimum=0.0, maximum=1.0, gaps=True)
    area = np.full(stems.ids.size, -1)
    x, y = stems.place.T
    for row, shape in enumerate(np.asarray(frame.geometry)):
        shapely.prepare(shape)
        area[shapely.intersects_xy(shape, x, y)] = row
    if (area < 0).all():
        raise UserError(f"{where_of(frame)}: no tree stands in an area; check the areas and their CRS")
    used = np.unique(area[area >= 0]).size
    if used < len(frame):
        feedback.note(
            f"{where_of(frame)}: no tree stands in {len(frame) - used} of {counted(len(frame), 'area')}, or it stands "
            "in a later one too: left out",
            code="rows-left-out",
            rows=len(frame) - used,
        )
    account("windthrow_areas", count_of(len(frame), used, {NO_TREE: len(frame) - used}))
    return area, np.where(area < 0, np.nan, shares[area])


def states_of(thrown: NDArray[np.bool_], lost: NDArray[np.bool_], off: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """Where each stem is in each scenario: standing, lying or removed; stems that fell off the terrain are removed at
    once.
    """
    fallen = np.where(thrown, LYING, STANDING)
    fallen[off] = REMOVED
    return {
        "before": np.full(thrown.size, STANDING),
        "after": fallen,
        "later": np.where(lost, REMOVED, fallen),
        "cleared": np.where(thrown, REMOVED, STANDING),
    }


def trees_with_stumps(stems: Stems, thrown: NDArray[np.bool_], stump_m: float) -> geopandas.GeoDataFrame:
    """The trees layer after the storm: thrown stems are as high as their stumps, or missing if the stumps have no
    height.
    """
    frame: Any = stems.frame.copy()
    columns = [each.name for each in TREES.columns if each.name in frame]
    frame["tree_id"] = stems.ids
    frame["height_m"] = np.where(thrown, stump_m, stems.height_m)
    if "crown_diameter_m" in frame:
        frame.loc[thrown, "crown_diameter_m"] = np.nan
    columns = ["tree_id", *(name for name in columns if name != "tree_id"), "geometry"]
    return frame[columns] if stump_m > 0.0 else frame.loc[~thrown, columns].reset_index(drop=True)


def lying_frame(
    stems: Stems,
    lying: Lying,
    rows: NDArray[np.intp],
    kept: NDArray[np.bool_],
    thickness: float,
    capacity_kj: NDArray[np.float64] | None = None,
) -> geopandas.GeoDataFrame:
    """The remaining lying logs, thinner by a factor; ``rows`` are those of the stems. ``capacity_kj`` : of each stem,
    before it breaks; None: they are rigid.
    """
    lines = shapely.linestrings(np.stack([lying.base, lying.tip], axis=1)[kept])
    columns = {
        "lying_id": stems.ids[rows][kept],
        "diameter_cm": thickness * lying.base_cm[kept],
        "tip_diameter_cm": thickness * lying.tip_cm[kept],
        **({} if capacity_kj is None else {"capacity_kj": capacity_kj[rows][kept]}),
    }
    return geopandas.GeoDataFrame(columns, geometry=lines, crs=stems.frame.crs)


def stems_frame(
    stems: Stems, thrown: NDArray[np.bool_], azimuth_deg: NDArray[np.float64], states: dict[str, NDArray[Any]]
) -> geopandas.GeoDataFrame:
    """One row for each tree: its state in each scenario."""
    towards = np.full(thrown.size, np.nan)
    towards[thrown] = azimuth_deg
    columns = {"tree_id": stems.ids, "dbh_cm": stems.dbh_cm, "height_m": stems.height_m, "fall_deg": towards}
    points = np.asarray(stems.frame.geometry)
    return geopandas.GeoDataFrame(columns | states, geometry=points, crs=stems.frame.crs)
