"""The rasters of `assess_mobilisation`, window by window: susceptibility, its factors, the mask of release areas."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing
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

BLOCK = (
    512  # side, in cells, of the squares worked on at once, ten arrays of 2 MiB; a multiple of the tiles of the files
)
MOST_THREADS = 4  # with more threads, reading and compressing take longer
SUSCEPTIBLE = {"susceptibility": "1"}
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

    def words(self, friction: float | str) -> str:
        """What the numbers rest on, and what they are not."""
        mu = f"{friction:g}" if isinstance(friction, (int, float)) else f"as {friction} says"
        return (
            f"assumed: friction {mu}; steepness from {self.slope_none_deg:g} to {self.slope_full_deg:g} degrees; no "
            f"start at a roughness of {self.roughness_limit_m:g} m; both in a window of {self.window_m:g} m; the "
            "numbers rank the ground and are not a probability"
        )


@dataclass(frozen=True)
class Judged:
    """A window: its rows (from the south) and columns; its susceptibility; slope [degrees], roughness and depth [m]."""

    rows: slice
    columns: slice
    value: NDArray[np.float32]
    factors: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def write_susceptibility(
    susceptible: Path, factors: Path, mask: Path, dem: DemWindows, friction: Friction,
    deadwood: Deadwood | None, limits: Limits, feedback: Feedback, *, keeps_factors: bool, draws_areas: bool,
) -> float:  # fmt: skip
    """Write the susceptibility and the other rasters needed, pass it to the rating of deadwood, and return its mean.

    The mask is used for the release areas only; so are the factors unless they are kept, and they then cover the areas'
    cells only.
    Windows without any height are not written, and read as nodata.
    """
    total, known = 0.0, 0
    windows = _windows(dem.shape)
    with ExitStack() as stack:
        rated = _writer(susceptible, dem, feedback, "float32", np.nan, SUSCEPTIBLE, "susceptibility")
        output = stack.enter_context(rated)
        beside = above = None
        if keeps_factors or draws_areas:
            writer = _writer(factors, dem, feedback, "float32", np.nan, dict(FACTORS), "factors", final=keeps_factors)
            beside = stack.enter_context(writer)
        if draws_areas:
            above = stack.enter_context(_writer(mask, dem, feedback, "uint8", None, {"susceptible": "1"}, final=False))
        judged = stack.enter_context(closing(_judged(windows, dem, friction, limits, feedback)))
        for done, (each, (rows, columns)) in enumerate(zip(judged, windows, strict=True)):
            if each is None:
                for writer in filter(None, (output, beside, above)):
                    writer.leave_out((rows.stop - rows.start) * (columns.stop - columns.start))
            else:
                size = columns.stop - columns.start, rows.stop - rows.start
                window = Window(columns.start, dem.shape[0] - rows.stop, *size)  # type: ignore[call-arg]
                chosen = np.nan_to_num(each.value) >= limits.threshold
                output.write(each.value[None, ::-1], window)
                if beside:
                    parts = np.stack(each.factors).astype(np.float32)
                    if not keeps_factors:
                        parts[:, ~chosen] = np.nan
                    beside.write(parts[:, ::-1], window)
                if above:
                    above.write(chosen.astype(np.uint8)[None, ::-1], window)
                if deadwood:
                    _show(deadwood, each, limits.gully_depth_m)
                total += float(np.nansum(each.value, dtype=float))
                known += int(np.isfinite(each.value).sum())
            feedback.progress(done + 1, len(windows), "assessing the terrain")
    if not known:
        raise UserError(
            f"{dem.path}: no cell has a whole window of {limits.window_m:g} m around it; "
            "use a larger DEM or a smaller --window-m"
        )
    styles.store_beside(susceptible, styles.of_raster(SUSCEPTIBILITY.look))
    return total / known


def _judged(
    windows: list[tuple[slice, slice]], dem: DemWindows, friction: Friction, limits: Limits, feedback: Feedback
) -> Generator[Judged | None]:
    """Each window in turn, None where the DEM has no height; read here, fitted in threads, a few windows ahead."""
    radius, wide = (_radius(name, getattr(limits, name), dem, feedback) for name in ("window_m", "gully_window_m"))
    halo = max(radius, wide)

    def fitted(rows: slice, columns: slice, heights: NDArray[np.float64], mu: float | NDArray[np.float64]) -> Judged:
        at_log = relief(_inner(heights, halo - radius), dem.cell, radius)
        hollow = relief(_inner(heights, halo - wide), dem.cell, wide).hollow
        value = susceptibility(at_log.slope, at_log.roughness, mu, limits).astype(np.float32)
        return Judged(rows, columns, value, (np.degrees(np.arctan(at_log.slope)), at_log.roughness, hollow))

    threads = min(MOST_THREADS, os.cpu_count() or 1)
    ahead: deque[Future[Judged] | None] = deque()
    with ThreadPoolExecutor(threads) as pool:
        for rows, columns in windows:
            if feedback.cancelled():
                raise Cancelled
            around = dem.grid(
                slice(rows.start - halo, rows.stop + halo), slice(columns.start - halo, columns.stop + halo)
            )
            here = np.isfinite(_inner(around.values, halo)).any()
            mu = friction(dem.grid(rows, columns)) if here else 0.0
            ahead.append(pool.submit(fitted, rows, columns, around.values, mu) if here else None)
            if len(ahead) > 2 * threads:
                yield _result(ahead.popleft())
        while ahead:
            yield _result(ahead.popleft())


def _result(future: Future[Judged] | None) -> Judged | None:
    return future.result() if future else None


def _show(deadwood: Deadwood, judged: Judged, gully_depth_m: float) -> None:
    slope, roughness, hollow = judged.factors
    gully = np.where(np.isfinite(judged.value), np.nan_to_num(hollow) >= gully_depth_m, np.nan)
    deadwood.look(
        judged.rows, judged.columns, susceptibility=judged.value, slope_deg=slope, roughness_m=roughness, gully=gully
    )


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
        feedback.warn(
            f"{flag} {window_m:g} is too small for cells of {dem.cell:g} m; {side:g} m is taken",
            code="window-too-small",
            window_m=window_m,
            taken_m=side,
        )
    return radius


def _windows(shape: tuple[int, int]) -> list[tuple[slice, slice]]:
    """Windows that cover a raster, from the north; they end at the tiles of the files."""
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
    feedback: Feedback,
    dtype: str,
    nodata: float | None,
    bands: Mapping[str, str],
    raster: str = "",
    *,
    final: bool = True,
) -> WindowWriter:
    """``bands``: unit by name."""
    profile = geotiff_profile(dem.shape, dem.crs, dem.transform, dtype, nodata, len(bands)) | {"SPARSE_OK": True}
    writer = WindowWriter(path, feedback, final=final, of_region=True, **profile)
    for band, (name, unit) in enumerate(bands.items(), start=1):
        describe_band(writer.target, band, name, raster=raster)
        writer.target.set_band_unit(band, unit)
    return writer
