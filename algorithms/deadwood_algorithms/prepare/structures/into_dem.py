"""A DEM copied strip by strip, with structures built in: same grid, CRS, number type and nodata.

For `add_structures`. Cells that no structure changes are kept bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio.enums import MaskFlags

from deadwood_algorithms.files import remedies, styles
from deadwood_algorithms.files.dem_windows import DemWindows, WindowWriter
from deadwood_algorithms.files.geotiff import geotiff_profile
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.prepare.structures.earthworks import build
from deadwood_algorithms.prepare.structures.from_layer import Plan
from deadwood_algorithms.schemas.files import DEM

WINDOW_CELLS = 2**17  # worked on at once: some twenty arrays of 1 MiB
COARSE_STEP_M = 0.1  # a DEM with height steps above this cannot represent a crest properly


def write_with_structures(path: Path, dem: DemWindows, plans: Sequence[Plan], feedback: Feedback) -> None:
    """Write the DEM with the structures, and record the volumes in each plan."""
    source = dem.source
    dtype, scale = np.dtype(source.dtypes[0]), abs(float(source.scales[0]))
    if dtype.kind in "iu" and scale > COARSE_STEP_M:
        feedback.warn(
            f"{dem.path}: the heights have steps of {scale:g} m, and so will the structures; for finer steps: "
            f"{remedies.unscaled(dem.path)}",
            code="stepped-heights",
            step_m=scale,
        )
    profile = geotiff_profile(source.shape, dem.crs, source.transform, dtype.name, source.nodata)
    masked = MaskFlags.per_dataset in source.mask_flag_enums[0]
    with (
        rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True),
        WindowWriter(path, feedback, with_statistics=not masked, **profile) as writer,
    ):
        writer.target.scales, writer.target.offsets = source.scales[:1], source.offsets[:1]
        if source.units[0]:
            writer.target.set_band_unit(1, source.units[0])
        strips = dem.strips()
        for done, rows in enumerate(strips):
            if feedback.cancelled():
                raise Cancelled
            window = dem.file_window(rows, slice(0, dem.shape[1]))
            raw = source.read(1, window=window)
            _build_into(raw[::-1] if dem.flipped else raw, rows, dem, plans)
            _refuse_open_sides(plans)
            writer.write(raw[None], window)
            if masked:
                writer.target.write_mask(source.read_masks(1, window=window), window=window)
            feedback.progress(done + 1, len(strips), "writing the DEM")
    styles.store_beside(path, styles.of_raster(DEM.look))


def _refuse_open_sides(plans: Sequence[Plan]) -> None:
    for plan in plans:
        if plan.work.open_at:
            raise UserError(
                f"{plan.at}: a side does not meet the ground within --max-reach-m (there is still a gap near "
                f"{plan.work.open_at[0]:.0f}, {plan.work.open_at[1]:.0f}); make the slope of the side steeper than "
                "that of the ground, or increase --max-reach-m"
            )


def _build_into(raw: NDArray[Any], rows: slice, dem: DemWindows, plans: Sequence[Plan]) -> None:
    """Build what touches a strip of the file's own numbers (row 0 south), in place and window by window."""
    for plan in plans:
        west, south, east, north = plan.structure.bounds
        first, last = max(0, int((west - dem.x0) / dem.cell)), min(dem.shape[1], int((east - dem.x0) / dem.cell) + 2)
        low, high = int((south - dem.y0) / dem.cell), int((north - dem.y0) / dem.cell) + 2
        near = slice(max(rows.start, low), min(rows.stop, high))
        if near.start >= near.stop:
            continue
        width = max(1, WINDOW_CELLS // (near.stop - near.start))
        for start in range(first, last, width):
            columns = slice(start, min(start + width, last))
            part = raw[near.start - rows.start : near.stop - rows.start, columns]
            original = dem.grid(near, columns)
            current = part * np.float64(dem.source.scales[0]) + dem.source.offsets[0]
            changed = build(plan.structure, original, current, plan.work, dem.around)
            part[changed] = _stored(current[changed], dem, plan.at)


def _stored(heights: NDArray[np.float64], dem: DemWindows, at: str) -> NDArray[Any]:
    """Heights as numbers of the file's type."""
    dtype = np.dtype(dem.source.dtypes[0])
    numbers = (heights - dem.source.offsets[0]) / dem.source.scales[0]
    if dtype.kind == "f":
        return numbers.astype(dtype)
    numbers, bounds = np.rint(numbers), np.iinfo(dtype)
    bad = (numbers < bounds.min) | (numbers > bounds.max) | (numbers == dem.source.nodata)
    if bad.any():
        raise UserError(
            f"{at}: the height {heights[bad][0]:.2f} m cannot be stored in the DEM's type ({dtype}); "
            f"fix: {remedies.unscaled(dem.path)}, and take that DEM"
        )
    return numbers.astype(dtype)
