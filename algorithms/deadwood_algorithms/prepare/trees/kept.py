"""Which of the trees that were read are written: those that stand, have a size, lie on the DEM and are found once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms import schemas
from deadwood_algorithms.files.accounts import OFF_DEM
from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees import columns as tree_columns
from deadwood_algorithms.prepare.trees import status as tree_status
from deadwood_algorithms.prepare.trees.dbh_filling import Filled
from deadwood_algorithms.prepare.trees.merging import duplicates
from deadwood_algorithms.prepare.trees.table import Source

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks
    from deadwood_algorithms.files.grid import Grid

# Height / DBH [-] of the median tree of a stand: solitary oaks to dense spruce. With a girth taken as DBH it is a
# third of that.
SLENDERNESS = (25, 150)
MOST_DROPPED, FEWEST_JUDGED = 0.9, 10  # share of trees without a possible size; of how many
IN_MM = 12  # below this the DBH is more likely in millimetres (a tenth of 25 to 150) than a girth (a third)


def trees_kept(
    source: Source,
    filled: Filled,
    status: np.ndarray,
    ground: Grid | DemBlocks | None,
    *,
    min_height_m: float,
    merge_within_m: float,
    tile_field: str | None,
) -> tuple[np.ndarray, list[str]]:
    """Which trees are written to one of the layers, and why the others are not, in words."""
    from deadwood_algorithms.scene.items import extent_words

    said: list[str] = []
    kept = status != tree_status.GONE
    if not kept.all():
        said.append(f"{counted((~kept).sum(), 'tree')} dropped: no longer standing")
        source.left_out["gone"] = int((~kept).sum())
    sized = np.isfinite(filled.dbh) & np.isfinite(filled.height)
    if (kept & ~sized).any():
        said.append(f"{counted((kept & ~sized).sum(), 'tree')} dropped: neither DBH nor height")
        source.left_out["no_size"] = int((kept & ~sized).sum())
    kept &= sized
    for column, values, least in (
        ("height_m", filled.height, min_height_m),
        ("dbh_cm", filled.dbh, schemas.TREES.column("dbh_cm").least or 0.0),
    ):
        schema = schemas.TREES.column(column)
        low, high = max(least, schema.least or 0.0), schema.maximum or np.inf
        for wrong, words in ((values < low, f"below {low:g}"), (values > high, f"above {high:g}")):
            if (kept & wrong).any():
                said.append(f"{counted((kept & wrong).sum(), 'tree')} dropped: {column} {words} {schema.unit}")
                source.left_out["size"] += int((kept & wrong).sum())
                kept &= ~wrong
    refuse_most_dropped(source, status, kept, said)
    if ground:
        x, y = shapely.get_x(source.places), shapely.get_y(source.places)
        on = ground.contains(x, y)
        if (kept & ~on).any():
            nowhere = extent_words(x, y, ground) if not on.any() else ""
            said.append(f"{counted((kept & ~on).sum(), 'tree')} dropped: off the DEM or on its nodata{nowhere}")
            source.left_out[OFF_DEM] = int((kept & ~on).sum())
        kept &= on
    if merge_within_m and kept.any():
        name = tree_columns.find(source.frame, tile_field, "--tile-field", ())
        tile = source.frame[name].astype(str).to_numpy()[kept] if name else None
        goes = duplicates(source.places[kept], filled.height[kept], filled.dbh[kept], merge_within_m, tile)
        if goes.any():
            said.append(f"{counted(goes.sum(), 'tree')} dropped: a taller one stands within {merge_within_m:g} m")
        source.left_out["same_place"] = int(goes.sum())
        kept[np.flatnonzero(kept)[goes]] = False
    return kept, said


def refuse_most_dropped(source: Source, status: np.ndarray, kept: np.ndarray, said: list[str]) -> None:
    """Reject a table of whose standing trees few have a possible size: it was not understood."""
    standing = int((status != tree_status.GONE).sum())
    lost = standing - int(kept.sum())
    if standing >= FEWEST_JUDGED and lost >= MOST_DROPPED * standing and kept.any():
        raise UserError(
            f"{where_of(source.frame)}: only {int(kept.sum())} of {standing} trees have a possible size "
            f"({'; '.join(said)}); name the fields and their units (--dbh-field, --dbh-unit, --height-field, "
            "--height-unit), lower --min-height-m, or delete the rows that are no trees"
        )


def warn_of_doubts(source: Source, filled: Filled, kept: np.ndarray, why: Sequence[str], feedback: Feedback) -> None:
    """Warn of few trees that are left (``why``), of trees at the same place, and of combinations of measured sizes that
    no stand has: girth or inches taken as DBH.
    """
    where = where_of(source.frame)
    _warn_of_most_dropped(where, kept, why, feedback)
    places = np.round(shapely.get_coordinates(source.places[kept]), 2)
    double = int(kept.sum()) - len(np.unique(places, axis=0))
    if double:
        feedback.warn(
            f"{where}: {counted(double, 'tree has', 'trees have')} exactly the position of another one (stems of one "
            "tree? rows twice?); --merge-within-m 0.1 keeps the tallest of each",
            code="same-position",
            trees=double,
        )
    measured = kept & ~filled.from_height & ~filled.from_dbh
    if measured.any():
        slender = float(np.median(100.0 * filled.height[measured] / filled.dbh[measured]))
        low, high = SLENDERNESS
        if not low <= slender <= high:
            fix = "a girth is divided by pi with --dbh-unit girth-cm" if slender < low else "inches: --dbh-unit in"
            fix = "millimetres: --dbh-unit mm" if slender < IN_MM else fix
            feedback.warn(
                f"{where}: the median of height / DBH is {slender:.0f}, stands have {low} to {high}; check the units "
                f"of both ({fix})",
                code="implausible-size",
                median=slender,
            )


def _warn_of_most_dropped(where: str, kept: np.ndarray, why: Sequence[str], feedback: Feedback) -> None:
    """Warn if few trees are left, for whatever reason: another area, most of them felled, a wrong filter."""
    used, lost = int(kept.sum()), int((~kept).sum())
    if used and kept.size >= FEWEST_JUDGED and lost >= MOST_DROPPED * kept.size:
        feedback.warn(
            f"{where}: only {used} of {kept.size} trees are used ({'; '.join(why)}); is it the table of this area, and "
            "are its columns understood?",
            code="most-dropped",
            trees=kept.size,
            used=used,
        )


def releases_columns(columns: dict[str, np.ndarray], dead: np.ndarray) -> dict[str, np.ndarray]:
    """The columns of the releases layer for all kept trees: each dead one is a log that stands upright at its place."""
    made = {"log_id": np.cumsum(dead), "release_id": columns["tree_id"], "dbh_cm": columns["dbh_cm"]}
    made |= {"length_m": columns["height_m"], "orientation": np.full(dead.size, "upright", object)}
    return made | {name: columns[name] for name in ("species", "dbh_source") if name in columns}


def write_trees(
    path: Path, layer: str, columns: dict[str, np.ndarray], points: np.ndarray, chosen: np.ndarray, source: Source
) -> None:
    import geopandas

    from deadwood_algorithms.files.vectors import write_vector

    of_chosen = {name: values[chosen] for name, values in columns.items()}
    write_vector(path, {layer: geopandas.GeoDataFrame(of_chosen, geometry=points[chosen], crs=source.frame.crs)})
