"""Release areas, the number of logs in each, and their places: points with a circle, polygons, or cells of a raster."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from deadwood_algorithms.files.columns import id_column, note_unnamed, row_numbers, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.counts import rows_named, significant
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.prepare.releases.places import area_m2, positions, weighted_positions
from deadwood_algorithms.prepare.releases.weights import Weights, read_weights
from deadwood_algorithms.scene.items import named_by

if TYPE_CHECKING:
    import pandas

    from deadwood_algorithms.files.dem_blocks import DemBlocks

MOST_LOGS = 10**9
UNEQUAL = 2.0  # times the smallest area: from here it is said that all count alike
SLIVER_M2 = 0.1  # less ground than a single stem stands on


@dataclass(frozen=True)
class ReleaseAreas:
    """Columns and shapes of the areas; without a layer there is one area: all cells with a weight (shape None).

    radius_m : radius of the circle around a point; named : whether there is a layer, so that messages name rows
    """

    frame: pandas.DataFrame
    shapes: list[Any]
    radius_m: float
    weights: Weights | None
    named: bool

    @property
    def size(self) -> int:
        return len(self.shapes)

    def release_ids(self, field: str | None, feedback: Feedback) -> np.ndarray:
        """The name of each area: the field asked for, else ``release_id``, else ``name`` if each area has its own, else
        the row number from 1, which is said where a field may hold names.
        """
        if field and field not in self.frame:
            known = ", ".join(str(name) for name in self.frame.columns if name != "geometry") or "none"
            where = where_of(self.frame)
            raise UserError(f"{where}: there is no field '{field}' (--release-id-field); the fields are {known}")
        field = field or named_by(self.frame, ("release_id",))
        called = named_by(self.frame, ("name",)) if not field else None
        if called and bool(self.frame[called].notna().all() and self.frame[called].is_unique):
            field = called
        if not field and self.named:
            note_unnamed(self.frame, ("release_id",), "areas", "--release-id-field", feedback)
        return id_column(self.frame, field) if field else row_numbers(self.frame)

    def logs_by_area(self, count: int, logs_per_ha: float | None) -> np.ndarray:
        """How many logs each area gets."""
        if logs_per_ha is None:
            return np.full(len(self.shapes), count)
        area = np.array([area_m2(shape, self.radius_m, self.weights) for shape in self.shapes])
        counts = np.rint(area * logs_per_ha / 1e4).astype(np.int64)
        if not counts.any():
            raise UserError(
                f"--logs-per-ha {logs_per_ha:g} on {significant(area.sum() / 1e4, 4)} ha gives no log; raise "
                f"it, or give --count"
            )
        if counts.max() > MOST_LOGS:
            raise UserError(f"--logs-per-ha {logs_per_ha:g} is {counts.max()} logs in one area; lower it")
        return counts

    def say_unequal(self, counts: np.ndarray, feedback: Feedback) -> None:
        """Say where areas of other sizes get as many logs: a share of all logs then weighs a small one like a large."""
        area = np.array([area_m2(shape, self.radius_m, self.weights) for shape in self.shapes])
        if counts.min() == counts.max() and area.max() > UNEQUAL * area.min():
            feedback.note(
                f"the areas have {significant(area.min(), 3)} to {significant(area.max(), 3)} m2 and get the same "
                "number of logs each: in a share of all logs every area counts the same, whatever its size; with "
                "--logs-per-ha every hectare does",
                code="areas-count-alike",
                smallest_m2=float(area.min()),
                largest_m2=float(area.max()),
            )

    def place_logs(
        self, counts: np.ndarray, seed: int, ground: Grid | DemBlocks, feedback: Feedback
    ) -> tuple[np.ndarray, np.ndarray]:
        """Numbers, from 0, and places [m] of all logs, in order; area ``k`` of n has k, k + n, k + 2 n, ..."""
        ids, places = [], []
        for row, shape in enumerate(self.shapes):
            if feedback.cancelled():
                raise Cancelled
            where = f"{where_of(self.frame)}, row {row + 1}" if self.named else where_of(self.frame)
            log_id = row + len(self.shapes) * np.arange(counts[row])
            if self.weights is None:
                place = positions(shape, self.radius_m, seed, log_id, where)
                refuse_off_dem(place, ground, where)
            else:
                place = weighted_positions(shape, self.radius_m, self.weights, seed, log_id, where)
            ids.append(log_id)
            places.append(place)
            feedback.progress(int(counts[: row + 1].sum()), int(counts.sum()), "drawing release positions")
        order = np.argsort(np.concatenate(ids), kind="stable")
        return np.concatenate(ids)[order], np.concatenate(places)[order]


def read_release_areas(
    path: str | None,
    weights: str | None,
    radius_m: float,
    crs: str | None,
    ground: Grid | DemBlocks,
    feedback: Feedback,
) -> ReleaseAreas:
    """Read the areas of a layer, the weights of a raster, or both."""
    import pandas

    from deadwood_algorithms.files.vectors import read_vector

    if path is None:
        frame = pandas.DataFrame(index=[0])
        frame.attrs["where"] = str(weights)
        drawn_by = read_weights(str(weights), ground, feedback, everywhere=True)
        return ReleaseAreas(frame, [None], radius_m, drawn_by, named=False)
    frame = read_vector(
        path, geometry=("point", "polygon"), target_crs=ground.crs, crs=crs, what="releases", feedback=feedback
    )
    shapes = np.asarray(frame.geometry)
    slivers = np.flatnonzero((shapely.get_dimensions(shapes) == 2) & (shapely.area(shapes) < SLIVER_M2))
    if slivers.size:
        feedback.warn(
            f"{where_of(frame)}, {rows_named(slivers)}: an area of {shapely.area(shapes[slivers[0]]):.2g} m2 is too "
            "small for a tree (a sliver left by cutting polygons?), but gets as many logs as the others; delete it",
            code="sliver",
            areas=len(slivers),
        )
    drawn_by = read_weights(weights, ground, feedback, everywhere=False) if weights else None
    return ReleaseAreas(frame, list(shapes), radius_m, drawn_by, named=True)


def refuse_off_dem(place: np.ndarray, ground: Grid | DemBlocks, where: str) -> None:
    on = ground.contains(place[:, 0], place[:, 1])
    if on.all():
        return
    x, y = place[np.argmin(on)]
    fix = "check the area's CRS, clip it, or use a larger DEM"
    if not on.any():
        from deadwood_algorithms.files.crs import misplacement

        fix = misplacement(place[:, 0], place[:, 1], ground.bounds, ground.crs) or fix
    share = "every release position lies" if not on.any() else f"{(~on).sum()} of {on.size} release positions lie"
    raise UserError(
        f"{where}: {share} off the DEM or on its nodata (one at {x:.1f}, {y:.1f}; the DEM spans "
        "{:.1f} to {:.1f} east, {:.1f} to {:.1f} north)".format(*(ground.bounds[i] for i in (0, 2, 1, 3)))
        + f"; {fix}"
    )
