"""Reading of single-tree tables: the rows that are trees by their source's layout, with places, crowns, DBH and height.

For `import_trees`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import field_names, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees import columns as tree_columns
from deadwood_algorithms.prepare.trees import sources as tree_sources
from deadwood_algorithms.prepare.trees import status as tree_status
from deadwood_algorithms.prepare.trees.sources import Layout

if TYPE_CHECKING:
    import geopandas
    import pandas

    from deadwood_algorithms.files.dem_blocks import DemBlocks

SHRUBS = ("shrub", "liana")


@dataclass(frozen=True)
class Source:
    """The rows that are trees, in the output's CRS; ``outlines`` are their crowns if these are polygons."""

    frame: geopandas.GeoDataFrame
    layout: Layout
    outlines: np.ndarray | None
    places: np.ndarray
    said: list[str]
    read: int  # rows of the table
    left_out: Counter[str]  # of these, rows that are not written, by why


def read_source(
    path: str,
    source: str,
    xy: tuple[str, str] | None,
    ground: Grid | DemBlocks | None,
    *,
    crs: str | None,
    feedback: Feedback,
) -> Source:
    """Read a table by its layout: which rows are trees, where they stand, and their crowns.

    ``source`` is a name of `sources.SOURCES`, ``xy`` the user's own columns of the coordinates.
    """
    from deadwood_algorithms.files.crs import misnamed
    from deadwood_algorithms.files.vectors import read_table, read_vector

    rows = read_table(path, what="single trees")
    count = len(rows)
    layout = tree_sources.layout_of(rows, path, source, mapped=bool(xy))
    if source == "auto" and layout is not tree_sources.USUAL:
        feedback.note(
            f"{where_of(rows)}: read as {layout.source} ({layout.what}); --source names another",
            code="source-recognised",
        )
    xy = xy or tree_sources.xy_of(rows, layout)
    rows, said, left_out = rows_of_trees(rows, layout, xy)
    frame = read_vector(
        path,
        geometry=("point", "polygon"),
        target_crs=ground.crs if ground else None,
        crs=crs,
        what="single trees",
        feedback=feedback,
        x_field=xy[0] if xy else None,
        y_field=xy[1] if xy else None,
        rows=rows,
    )
    shapes = np.asarray(frame.geometry.array)
    if not ground:
        refuse_not_metric(frame)
        places = shapely.centroid(shapes)
        if frame.crs and (wrong := misnamed(frame.crs, shapely.get_x(places), shapely.get_y(places))):
            feedback.warn(f"{where_of(frame)}: the middle of the trees, {wrong}", code="crs-doubtful")
    crowns = shapely.get_type_id(shapes) != 0
    if crowns.any():
        feedback.note(
            f"{where_of(frame)}: {counted(crowns.sum(), 'crown polygon')}; the tree stands at each one's centroid",
            code="crowns-to-points",
            crowns=int(crowns.sum()),
        )
    said = [f"{counted(count, 'tree')} read from {where_of(frame)}", *said]
    return Source(frame, layout, shapes if crowns.all() else None, shapely.centroid(shapes), said, count, left_out)


def rows_of_trees(
    frame: pandas.DataFrame, layout: Layout, xy: tuple[str, str] | None
) -> tuple[pandas.DataFrame, list[str], Counter[str]]:
    """The rows that are trees with a position, the latest of each tree; and what was left out, in words and by why.

    Only for layouts that require it: tables joined from field campaigns have one row per visit, shrubs, and unmapped
    stems.
    """
    said: list[str] = []
    left_out: Counter[str] = Counter()
    keep = np.ones(len(frame), bool)
    if layout.form and (form := tree_columns.find(frame, None, "", (layout.form,))):
        shrub = np.array([any(word in str(value).lower() for word in SHRUBS) for value in frame[form]])
        said += (
            [f"{counted(shrub.sum(), 'row')} left out, shrubs and lianas by the field '{form}'"] if shrub.any() else []
        )
        left_out["shrub"] = int(shrub.sum())
        keep &= ~shrub
    if layout.repeated_by and xy and set(xy) <= set(frame.columns):
        placed = np.asarray(frame[xy[0]].notna() & frame[xy[1]].notna())
        lost = int((keep & ~placed).sum())
        said += [f"{counted(lost, 'row')} left out: no position ({xy[0]}, {xy[1]})"] if lost else []
        left_out["no_position"] = lost
        keep &= placed
    tree = tree_columns.find(frame, None, "", layout.id)
    if layout.repeated_by and tree:
        earlier = keep & earlier_visits(frame, tree, layout.repeated_by, keep)
        said += [f"{counted(earlier.sum(), 'row')} left out, earlier visits of the same trees"] if earlier.any() else []
        left_out["earlier_visit"] = int(earlier.sum())
        keep &= ~earlier
    if len(frame) and not keep.any():
        raise UserError(f"{where_of(frame)}: no row is left; {'; '.join(said)}")
    return (frame if keep.all() else frame.iloc[np.flatnonzero(keep)]), said, left_out


def earlier_visits(frame: pandas.DataFrame, tree: str, date: str, among: np.ndarray) -> np.ndarray:
    """Rows of a tree (and stem) that has a later row; of several date columns (joined tables) the latest day counts."""
    days = frame[[str(name) for name in frame.columns if str(name).lower().startswith(date)]]
    if not days.shape[1]:
        return np.zeros(len(frame), bool)
    latest: dict[tuple[str, ...], int] = {}
    stems = [tree, *(str(name) for name in frame.columns if str(name).lower() == "tempstemid")]
    owner = list(zip(*(frame[name].astype(str) for name in stems), strict=True))
    day = [max((str(each) for each in row if each == each and each is not None), default="") for row in days.to_numpy()]
    for row in np.flatnonzero(among):
        best = latest.get(owner[row])
        if best is None or day[row] >= day[best]:
            latest[owner[row]] = int(row)
    return ~np.isin(np.arange(len(frame)), list(latest.values()))


def measured_trees(path: str, feedback: Feedback) -> tuple[np.ndarray, np.ndarray]:
    """DBH [cm] and height [m] of the living trees of a sample."""
    from deadwood_algorithms.files.vectors import read_table, say_of_rows

    rows = read_table(path, what="sample of trees")
    say_of_rows(rows, feedback)
    layout = tree_sources.layout_of(rows, path, "auto", mapped=False)
    living = tree_status.status_of(rows, layout, None, None, None, feedback) == tree_status.LIVE
    dbh = tree_columns.dbh_column(rows, layout, None, None, layout.missing_value, feedback)
    height = tree_columns.height_column(rows, layout, None, None, layout.missing_value, feedback)
    account_sample(dbh, height, living, where_of(rows), feedback)
    return dbh[living], height[living]


def account_sample(dbh: np.ndarray, height: np.ndarray, living: np.ndarray, where: str, feedback: Feedback) -> None:
    """Say which rows of a sample have no part in the fit of its law."""
    sized = np.isfinite(dbh) & np.isfinite(height)
    dead, gaps = int((~living).sum()), int((living & ~sized).sum())
    if dead or gaps:
        feedback.note(
            f"{where}: of the sample's {counted(dbh.size, 'tree')}, left out: {dead} dead, {gaps} without a size",
            code="rows-left-out",
            rows=dead + gaps,
        )
    account("dbh_sample", count_of(dbh.size, (living & sized).sum(), {"dead": dead, "no_size": gaps}))


def refuse_nothing_known(source: geopandas.GeoDataFrame, dbh: np.ndarray, height: np.ndarray) -> None:
    if np.isnan(dbh).all() and np.isnan(height).all():
        raise UserError(
            f"{where_of(source)}: neither a DBH nor a height is found; name its field: --dbh-field, --height-field "
            f"(it has {field_names(source)})"
        )


def warn_of_idle_fields(
    source: geopandas.GeoDataFrame,
    layout: Layout,
    what: str,
    other: str,
    asked: Iterable[str | None],
    feedback: Feedback,
) -> None:
    """Warn if all values of a size are about to be computed although some numeric field was not recognised."""
    idle = tree_columns.not_understood(source, layout, asked)
    if idle:
        feedback.warn(
            f"{where_of(source)}: no field is understood as the {what}, so that each is computed from the {other}; "
            f"if it is one of {', '.join(idle)}, name it with --{what.lower()}-field",
            code="sizes-computed",
        )


def refuse_not_metric(source: geopandas.GeoDataFrame) -> None:
    """Without a DEM the layer keeps its own CRS; reject one that is not in metres, which a run could not use."""
    from deadwood_algorithms.files.crs import is_local

    own = source.crs
    if own is not None and is_local(own):
        return
    if own is None or not own.is_projected or abs(own.axis_info[0].unit_conversion_factor - 1) > 1e-9:
        raise UserError(
            f"{where_of(source)}: its CRS {own.name if own else 'is unknown and'} is not projected in metres; "
            "give --dem, whose CRS the trees then get"
        )
