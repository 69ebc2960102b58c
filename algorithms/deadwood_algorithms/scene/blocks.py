"""Boulders as obstacles, from a layer of points: positions, sizes, and heights above the ground."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from deadwood_algorithms.files.columns import filled_column, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import none_of, rows_named
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import (
    extent_words,
    ids_of,
    plan_of,
    points_on,
    say_left_out,
    shared_words,
    why_left_out,
)
from deadwood_algorithms.schemas import BLOCKS
from deadwood_engine import Blocks

DIAMETER, RADIUS, HEIGHT = "diameter_m", "radius_m", "height_m"


@dataclass(frozen=True)
class Boulders:
    """Boulders on the DEM in the engine's form, their ids as text, and how many lie off the DEM."""

    solid: Blocks
    ids: list[str]
    left_out: Counter[str]  # by reason

    @staticmethod
    def none() -> Boulders:
        return Boulders(Blocks.none(), [], Counter())


def read_blocks(path: str | None, grid: Grid, feedback: Feedback) -> Boulders:
    """Boulders with their diameters, from ``diameter_m``, otherwise twice ``radius_m``; those off the DEM are left out.

    The top is ``height_m`` above the terrain, or one diameter if the field is missing or empty.
    """
    if path is None:
        return Boulders.none()
    frame = read_vector(path, geometry=("point",), target_crs=grid.crs, what="blocks", feedback=feedback)
    if DIAMETER in frame:
        diameter = schema_column(frame, BLOCKS.column(DIAMETER))
    elif RADIUS in frame:
        diameter = 2.0 * schema_column(frame, BLOCKS.column(RADIUS))
    else:
        raise UserError(f"{where_of(frame)}: the blocks have neither a field '{DIAMETER}' nor '{RADIUS}'; add one")
    warn_implausible(diameter, BLOCKS.column(DIAMETER), where_of(frame), feedback)
    height = filled_column(frame, HEIGHT, None, minimum=0.0, exclusive=True)
    height = np.where(np.isnan(height), diameter, height)
    floating = np.flatnonzero(height > diameter * (1.0 + 1e-9))
    if floating.size:
        raise UserError(
            f"{where_of(frame)}, field '{HEIGHT}', {rows_named(floating)}: the top is higher above the terrain than "
            "the block is thick, so it would float; correct the field, or leave it empty"
        )
    x, y = plan_of(frame)
    on = points_on(grid, x, y)
    if not on.any():
        raise UserError(f"{path}: {none_of(len(frame), 'block')} lies on the DEM{extent_words(x, y, grid)}")
    beyond = why_left_out(grid, x[~on], y[~on])
    say_left_out(frame, ~on, "blocks", feedback.note)
    ids = ids_of(frame, "block_id", "name")
    field = next((name for name in ("block_id", "name") if name in frame), "")
    twins = shared_words(frame, field, ids.tolist())
    if twins:
        feedback.warn(f"{twins}; no result can distinguish them. Give each its own block_id", code="same-id")
    return Boulders(Blocks(x[on], y[on], diameter[on], height[on]), [str(each) for each in ids[on]], beyond)
