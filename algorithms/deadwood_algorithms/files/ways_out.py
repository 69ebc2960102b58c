"""What to do with an input of a format that is not read in its role: one command for each that people have."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.tool import UserError

CLOUDS = (".las", ".laz")
OF_TREES = ("trees", "single trees", "sample of trees")


def refuse_foreign(path: str | Path, what: str) -> None:
    """Reject what no library here reads: point clouds, Zarr stores, a part of a SAGA grid."""
    place = Path(path)
    ending = place.suffix.lower()
    if ending in CLOUDS and place.is_file():
        ground = quoted(f"{place.stem}_ground.tif")
        raise UserError(
            f"{path}: a point cloud, which is not read as {what}; heights of its ground points: pdal translate "
            f"{quoted(path)} {ground} filters.range {quoted('--filters.range.limits=Classification[2:2]')} "
            "--writers.gdal.resolution=1 --writers.gdal.output_type=idw --writers.gdal.window_size=3"
        )
    if ending == ".zarr" and place.is_dir():
        from deadwood_algorithms.files import remedies  # it needs numpy

        raise UserError(f"{path}: the {what} must be a file, not a Zarr store; write one: {remedies.converted(path)}")
    other = {".sgrd": ".sdat", ".mgrd": ".sdat", ".sdat": ".sgrd"}.get(ending) if place.is_file() else None
    if other and not (there := place.with_suffix(other)).exists():
        raise UserError(
            f"{path}: a part of a SAGA grid, whose part {there.name} is missing; copy all parts (.sgrd, .sdat, .prj) "
            "together"
        )
    if other == ".sdat":
        raise UserError(
            f"{path}: the header of a SAGA grid; give its values, {place.with_suffix(other)}, as the {what}"
        )


def of_raster(path: str | Path, what: str, geometry: Sequence[str]) -> str:
    """Why a raster is no layer in a role, and what takes it, or makes a layer of it."""
    from deadwood_algorithms.files import remedies  # it needs numpy

    kinds = " or ".join(f"{each}s" for each in geometry) or "features"
    said = f"{path}: a raster, but the {what} must be a layer of {kinds}"
    if what in OF_TREES:
        return f"{said}; find-trees makes trees of a canopy model: --chm {quoted(path)}"
    if what == "releases":
        said += f"; sample-releases draws them by the values of its cells: --weights {quoted(path)}"
    if what == "releases" or "polygon" in geometry:
        said += f"; polygons of its cells other than 0 (in QGIS: Polygonize): {remedies.polygons(path)}"
    return said
