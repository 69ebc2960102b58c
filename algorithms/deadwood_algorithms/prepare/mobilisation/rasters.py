"""The rasters of `assess_mobilisation`, window by window: susceptibility, its factors, the mask of release areas."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rasterio.windows import Window

from deadwood_algorithms.files import styles
from deadwood_algorithms.files.dem_windows import DemWindows, WindowWriter
from deadwood_algorithms.files.geotiff import geotiff_profile
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import describe_band
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.prepare.mobilisation.deadwood import Deadwood
from deadwood_algorithms.prepare.mobilisation.relief import radius_of, relief
from deadwood_algorithms.schemas.files import SUSCEPTIBILITY

BLOCK = 512  # cells a side worked on at once, some 25 arrays of 2 MiB; a multiple of the tiles of the files
FACTORS = (("slope", "°"), ("roughness", "m"), ("depth across the slope", "m"))
Friction = Callable[[Grid], float | NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What makes ground susceptible: windows [m], slopes [degrees], roughness and gully depth [m], threshold."""

    window_m: float
    slope_none_deg: float
    slope_full_deg: float
    roughness_limit_m: float
    gully_window_m: float
    gully_depth_m: float
    threshold: float


def write_susceptibility(
    susceptible: Path, factors: Path, mask: Path, dem: DemWindows, friction: Friction,
    deadwood: Deadwood | None, limits: Limits, feedback: Feedback, *, keeps_factors: bool,
) -> float:  # fmt: skip
    """Write the three rasters, let the deadwood look at them, and give the mean susceptibility.

    The mask, and the factors unless they are kept, serve the release areas alone.
    """
    radius, wide = (_radius(name, getattr(limits, name), dem, feedback) for name in ("window_m", "gully_window_m"))
    halo = max(radius, wide)
    total, known = 0.0, 0
    windows = _windows(dem.shape)
    with (
        _writer(susceptible, dem, "float32", np.nan, {"susceptibility": "1"}, "susceptibility") as output,
        _writer(factors, dem, "float32", np.nan, dict(FACTORS), "factors", final=keeps_factors) as beside,
        _writer(mask, dem, "uint8", None, {"susceptible": "1"}, final=False) as above,
    ):
        for done, (rows, columns) in enumerate(windows):
            if feedback.cancelled():
                raise Cancelled
            around = dem.grid(
                slice(rows.start - halo, rows.stop + halo), slice(columns.start - halo, columns.stop + halo)
            )
            at_log = relief(_inner(around.values, halo - radius), dem.cell, radius)
            at_gully = relief(_inner(around.values, halo - wide), dem.cell, wide)
            mu = friction(dem.grid(rows, columns))
            value = susceptibility(at_log.slope, at_log.roughness, mu, limits).astype(np.float32)
            parts = (np.degrees(np.arctan(at_log.slope)), at_log.roughness, at_gully.hollow)
            size = columns.stop - columns.start, rows.stop - rows.start
            window = Window(columns.start, dem.shape[0] - rows.stop, *size)  # type: ignore[call-arg]
            output.write(value[None, ::-1], window)
            beside.write(np.stack(parts).astype(np.float32)[:, ::-1], window)
            chosen = np.nan_to_num(value) >= limits.threshold
            above.write(chosen.astype(np.uint8)[None, ::-1], window)
            if deadwood:
                gully = np.where(np.isfinite(value), np.nan_to_num(at_gully.hollow) >= limits.gully_depth_m, np.nan)
                deadwood.look(
                    rows, columns, susceptibility=value, slope_deg=parts[0], roughness_m=parts[1], gully=gully
                )
            total, known = total + float(np.nansum(value, dtype=float)), known + int(np.isfinite(value).sum())
            feedback.progress(done + 1, len(windows), "assessing the terrain")
    if not known:
        raise UserError(
            f"{dem.path}: no cell has a whole window of {limits.window_m:g} m around it; "
            "take a larger DEM or a smaller --window-m"
        )
    styles.store_beside(susceptible, styles.of_raster(SUSCEPTIBILITY.look))
    return total / known


def susceptibility(
    slope: NDArray[np.float64], roughness: NDArray[np.float64], friction: float | NDArray[np.float64], limits: Limits
) -> NDArray[np.float64]:
    """The susceptibility of cells, 0 to 1, from the tangent of the slope, roughness [m] and friction coefficient."""
    with np.errstate(divide="ignore", invalid="ignore"):
        drive = np.where(slope > 0.0, np.maximum(0.0, 1.0 - friction / slope), slope)
    degrees = np.degrees(np.arctan(slope))
    none, full = limits.slope_none_deg, limits.slope_full_deg
    ramp = (degrees - none) / (full - none) if full > none else (degrees >= full).astype(float)
    smooth = 1.0 - roughness / limits.roughness_limit_m
    return drive * np.clip(ramp, 0.0, 1.0) * np.clip(smooth, 0.0, 1.0)


def _radius(name: str, window_m: float, dem: DemWindows, feedback: Feedback) -> int:
    radius = radius_of(window_m, dem.cell)
    side = (2 * radius + 1) * dem.cell
    if side > 1.5 * window_m:
        flag = "--" + name.replace("_", "-")
        feedback.warn(f"{flag} {window_m:g} is too small for cells of {dem.cell:g} m; {side:g} m is taken")
    return radius


def _windows(shape: tuple[int, int]) -> list[tuple[slice, slice]]:
    """All of a raster, from the north; they end where the tiles of the files do."""
    ny, nx = shape
    return [
        (slice(ny - min(top + BLOCK, ny), ny - top), slice(left, min(left + BLOCK, nx)))
        for top in range(0, ny, BLOCK)
        for left in range(0, nx, BLOCK)
    ]


def _inner(values: NDArray[np.float64], rim: int) -> NDArray[np.float64]:
    return values[rim : values.shape[0] - rim, rim : values.shape[1] - rim]


def _writer(
    path: Path,
    dem: DemWindows,
    dtype: str,
    nodata: float | None,
    bands: Mapping[str, str],
    raster: str = "",
    *,
    final: bool = True,
) -> WindowWriter:
    """``bands``: unit by name."""
    profile = geotiff_profile(dem.shape, dem.crs, dem.transform, dtype, nodata, len(bands))
    writer = WindowWriter(path, final=final, **profile)
    for band, (name, unit) in enumerate(bands.items(), start=1):
        describe_band(writer.target, band, name, raster=raster)
        writer.target.set_band_unit(band, unit)
    return writer
