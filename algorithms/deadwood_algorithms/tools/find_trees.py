"""Find the trees of a canopy height model, or of a surface and a terrain model, and write them as a trees layer.

A cell is a tree top if none is higher within a circle around it whose diameter follows from its own height
(Popescu and Wynne 2004; as lidR's ``locate_trees`` with ``lmf`` does on a raster). ``--window`` names a published law
of the diameter D[m] from the height H[m]; ``--window-m`` gives a constant diameter instead, to which
``--window-growth`` adds metres per metre of height. The eight neighbours are always compared. Of equal tops beside each
other one is the tree: the southernmost, and of these the westernmost.

- ``mixed``: D = 2.51503 + 0.00901 H^2, deciduous trees and pines together
- ``deciduous``: D = 3.09632 + 0.00895 H^2

``--chm`` holds heights above the ground. Alternatively ``--dsm`` and ``--dem``, on the same cells, give the canopy
height by their difference. Cells without a value are not trees, nor are cells higher than 150 m (cranes, birds,
undeclared nodata), which are counted in a note. The tree stands at the centre of its cell and is as high as the cell.

The DBH follows from the height as in ``import-trees`` (``--dbh-law``, or ``--dbh-a`` and ``--dbh-b``), which lists the
laws and imports trees found by other programs. The method finds local maxima: small trees below others are not seen, a
wide crown may count twice, and a building counts as a tree. Fill the pits of a canopy model beforehand, and choose the
window by comparison with trees counted in the field.

With a canopy model: ``deadwood-tool find-trees --chm chm.tif --output trees.gpkg``; with a surface and a terrain model:
``deadwood-tool find-trees --dsm dsm.tif --dem dem.tif --window deciduous --output trees.gpkg``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms import schemas
from deadwood_algorithms.intake.doubts import say_all
from deadwood_algorithms.intake.values import CANOPY
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Tool, UserError
from deadwood_algorithms.prepare.trees.allometry import MADE_HERE, POWER_LAWS, with_name
from deadwood_algorithms.prepare.trees.dbh_filling import chosen_law, warn_of_another_region
from deadwood_algorithms.prepare.trees.tops import ROUNDED_M, WINDOWS, Tops, Window, find_tops, samples_of
from deadwood_algorithms.results.identity import writing
from deadwood_algorithms.schemas import TREE_M

if TYPE_CHECKING:
    import geopandas

    from deadwood_algorithms.files.dem_windows import DemWindows

PIECE_TREES = 100_000  # trees written at once


@dataclass(frozen=True, kw_only=True)
class Ask:
    chm: str | None = tool.terrain("Canopy height model (heights above the ground)", default=None)
    dsm: str | None = tool.terrain("Surface model, instead of the canopy model", default=None, help="Needs --dem.")
    dem: str | None = tool.terrain("Terrain (DEM) below the surface model", default=None, help="On the same cells.")
    window: str = tool.choice("Law of the window's diameter", *WINDOWS, default="mixed")
    window_m: float | None = tool.number(
        "Constant diameter of the window instead", unit="m", default=None, minimum=0.0, maximum=100.0, exclusive=True
    )
    window_growth: float = tool.number(
        "Growth of the constant diameter with the height",
        unit="m/m",
        default=0.0,
        minimum=0.0,
        maximum=10.0,
        help="D = --window-m + growth * H, as lidR and ForestTools often have it.",
    )
    min_height_m: float = tool.number(
        "Minimum height of a tree",
        unit="m",
        default=2.0,
        minimum=1.3,
        maximum=TREE_M[1],
        help="Below breast height there is no DBH.",
    )
    dbh_a: float = tool.number("a of DBH[cm] = a * H[m]^b", default=2.52, minimum=0.0, exclusive=True)
    dbh_b: float = tool.number("b of DBH[cm] = a * H[m]^b", default=0.84, minimum=0.0, exclusive=True)
    dbh_law: str | None = tool.choice(
        "Named law in place of a and b", *POWER_LAWS, default=None, help=f"{MADE_HERE} import-trees lists them."
    )
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Trees layer (.gpkg)")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.canopies import opened_rows, refuse_other_cells, rows_of
    from deadwood_algorithms.files.columns import warn_implausible
    from deadwood_algorithms.files.streams import Stream
    from deadwood_algorithms.files.vectors import write_vector

    if bool(ask.chm) == bool(ask.dsm) or bool(ask.dsm) != bool(ask.dem):
        raise UserError("give either --chm, or --dsm and --dem together")
    law = chosen_law(ask.dbh_law, ask.dbh_a, ask.dbh_b, None)
    if ask.window_growth and ask.window_m is None:
        raise UserError("--window-growth goes with --window-m, to whose diameter it is added")
    window = WINDOWS[ask.window] if ask.window_m is None else Window(ask.window_m, ask.window_growth)
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        temporary = outputs.file("output", ".gpkg")
        path = str(ask.chm or ask.dsm)
        canopy = opened.enter_context(opened_rows(path, ask.crs, feedback, "canopy" if ask.chm else "surface"))
        ground = opened.enter_context(opened_rows(ask.dem, ask.crs, feedback, "DEM")) if ask.dem else None
        if ground:
            refuse_other_cells(canopy, ground)

        def read(rows: slice) -> np.ndarray:
            heights = rows_of(canopy, rows)
            return heights - rows_of(ground, rows) if ground else heights

        say_all(CANOPY, np.concatenate(list(samples_of(read, canopy.shape))), path, feedback)

        def after_block(rows: int) -> None:
            if feedback.cancelled():
                raise Cancelled
            feedback.progress(rows, canopy.shape[0], "looking for tree tops")

        tops = find_tops(read, canopy.shape, canopy.cell, window, ask.min_height_m, TREE_M[1], after_block=after_block)
        if tops.too_high:
            feedback.warn(
                f"{path}: {counted(tops.too_high, 'cell stands', 'cells stand')} more than {TREE_M[1]:g} m above the "
                "ground, higher than any tree; is it a canopy model, in metres?",
                code="too-high",
                cells=tops.too_high,
            )
        if tops.rounded:
            feedback.note(
                f"{path}: the heights are rounded to {ROUNDED_M:g} m or more; of equal cells in one window the "
                "southernmost is taken for the highest",
                code="rounded-heights",
            )
        height = np.round(tops.height, 3)
        dbh = law.dbh(height, np.full(height.size, np.nan))
        column = schemas.TREES.column("dbh_cm")
        fit = (dbh >= (column.least or 0.0)) & (dbh <= (column.maximum or np.inf))
        if not fit.any():
            why = (
                f"{counted(fit.size, 'top has', 'tops have')} a DBH that no tree has ({law})"
                if fit.size
                else "no cell is that high"
            )
            raise UserError(f"{path}: no tree of {ask.min_height_m:g} m or more is found; {why}")
        found = replace(tops, row=tops.row[fit], column=tops.column[fit], height=height[fit])
        height, dbh = found.height, dbh[fit]
        middle = np.median(canopy.x0 + found.column * canopy.cell), np.median(canopy.y0 + found.row * canopy.cell)
        warn_implausible(height, schemas.TREES.column("height_m"), path, feedback)
        warn_implausible(dbh, column, f"{path}, computed DBH", feedback, fix="check the law (--dbh-law)")
        warn_of_another_region(law, np.array([shapely.Point(*map(float, middle))]), canopy.plan_crs, feedback)
        write_vector(temporary, {"trees": Stream("Point", lambda: trees_in_pieces(found, dbh, canopy))})
        hectares = tops.cells * canopy.cell**2 / 1e4
    dropped = int((~fit).sum())
    lines = [
        f"{counted(dbh.size, 'tree')} of {ask.min_height_m:g} m or more found on {significant(hectares, 4)} ha, window "
        f"{window}, heights "
        f"{height.min():.1f} to {height.max():.1f} m, median {np.median(height):.1f} m",
        f"DBH computed from the height: {with_name(law)}; median {np.median(dbh):.1f} cm",
    ]
    if dropped:
        lines.append(f"{counted(dropped, 'tree')} dropped: the law gives a DBH that no tree has")
    facts = {"trees": int(dbh.size), "dropped": dropped, "cells_too_high": tops.too_high}
    return Outcome({"output": Path(ask.output)}, facts, tuple(lines))


def trees_in_pieces(tops: Tops, dbh: np.ndarray, canopy: DemWindows) -> Iterator[geopandas.GeoDataFrame]:
    """The trees layer in pieces: its shapes take some forty times the memory of the numbers."""
    import geopandas

    for start in range(0, dbh.size, PIECE_TREES):
        piece = slice(start, min(dbh.size, start + PIECE_TREES))
        x, y = canopy.x0 + tops.column[piece] * canopy.cell, canopy.y0 + tops.row[piece] * canopy.cell
        columns = {"tree_id": np.arange(piece.start + 1, piece.stop + 1), "dbh_cm": dbh[piece]}
        columns |= {"height_m": tops.height[piece], "dbh_source": np.full(x.size, "modelled", object)}
        yield geopandas.GeoDataFrame(columns, geometry=shapely.points(x, y), crs=canopy.plan_crs)


TOOL = Tool(
    "find-trees",
    "Prepare",
    "Detect the trees in a canopy height model",
    Ask,
    run,
    then="deadwood-tool explore --dem {dem} --trees {output}",
)
