"""What a file is taken for: its role in a simulation, by its kind, its names and its values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms.files.bands import name_of_band
from deadwood_algorithms.files.rasters import open_raster, read_values
from deadwood_algorithms.files.units import ALSO, named
from deadwood_algorithms.intake import names
from deadwood_algorithms.prepare.trees import columns as tree_columns
from deadwood_algorithms.prepare.trees.sources import layout_of

if TYPE_CHECKING:
    import pandas

SAMPLE_SIDE = 1024  # cells of a raster read at once, from its middle
OF_LOGS = ("log_id", "length_m", "orientation", "tilt_deg", "density_kg_m3", "speed_ms")
LARGEST_FRICTION, TALLEST_M, LOW_M, LOW_SHARE = 2.0, 80.0, 1.0, 0.05


def of_raster(path: str) -> tuple[str, str]:
    """The role of a raster, and why."""
    with open_raster(path, "DEM") as source:
        if source.count >= 3 and source.dtypes[0] == "uint8":
            return "dem", "a picture, which may hold heights as colours"
        name = name_of_band(source, 1)
        values = middle_of(source)
    if names.words_of(f"{name} {Path(path).stem}") & names.OF_SLOPE:
        return "dem", "no height by its name, and no other role"
    for role, what in (("friction", "friction"), ("chm", "canopy")):
        if names.words_of(name) & names.WANTED[what][0]:
            return role, f"its band is named '{name}'"
    known = values[np.isfinite(values)]
    low, high = (float(each) for each in (known.min(), known.max())) if known.size else (0.0, 0.0)
    span = f"its values are {low:.4g} to {high:.4g}"
    if known.size and low >= 0.0 and high <= LARGEST_FRICTION:
        return "friction", span
    if known.size and low > -LOW_M and high <= TALLEST_M and (known < LOW_M).mean() > LOW_SHARE:
        return "chm", f"{span}, {100.0 * (known < LOW_M).mean():.0f} % of them below {LOW_M:g} m"
    return "dem", span


def middle_of(source: object) -> np.ndarray:
    """Values of the middle of a raster, NaN where it has none."""
    from rasterio.windows import Window

    ny, nx = source.shape  # type: ignore[attr-defined]
    rows, columns = min(ny, SAMPLE_SIDE), min(nx, SAMPLE_SIDE)
    window = Window((nx - columns) // 2, (ny - rows) // 2, columns, rows)  # type: ignore[call-arg]
    return read_values(source, window, np.float64)


def of_rows(rows: pandas.DataFrame, path: str) -> tuple[str, str]:
    """The role of a layer or table, and why."""
    there = {str(name).lower() for name in rows.columns}
    kinds = set(shapely.get_dimensions(np.asarray(rows.geometry))) if "geometry" in rows else set()
    if 1 in kinds:  # also roads among houses
        heights = [name for name in rows.columns if named(name).plain in ("height", *ALSO["height"])]
        return ("barriers", f"lines with the field '{heights[0]}'") if heights else ("lines", "lines")
    if {"friction", "mu"} & there:
        return "friction", "polygons with a coefficient"
    logs = [name for name in OF_LOGS if name in there]
    if 2 not in kinds and logs:
        return "releases", f"points with the field '{logs[0]}'"
    layout = layout_of(rows, path, "auto", mapped=True)
    sized = [tree_columns.find(rows, None, "", each) for each in (layout.dbh, layout.girth, layout.height)]
    if any(sized):
        return "trees", f"{'polygons' if 2 in kinds else 'points'} with the field '{next(filter(None, sized))}'"
    return "areas", "polygons" if 2 in kinds else "points without sizes of trees"
