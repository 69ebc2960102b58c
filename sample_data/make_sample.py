"""Make the committed sample again: ``python sample_data/make_sample.py`` with the toolbox installed.

The same script gives the same terrain (to the centimetre, the resolution of the file) and the same layers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rasterio

from deadwood_algorithms.files import styles
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.prepare.demo_slope import slope as sample_slope
from deadwood_algorithms.prepare.demo_slope.demo_layers import layers_to_try, sample_layers
from deadwood_algorithms.prepare.log_solid import norm_body, properties_of_rock

HERE = Path(__file__).parent


def main() -> None:
    write_terrain(HERE / "dem.tif", sample_slope.terrain())
    layers = {layer: frame for _, layer, frame in sample_layers()}
    trees = layers.pop("trees")
    table = trees.drop(columns="geometry")
    table.insert(1, "x", trees.geometry.x.round(2))
    table.insert(2, "y", trees.geometry.y.round(2))
    table.to_csv(HERE / "trees.csv", index=False, lineterminator="\n")
    (HERE / "sample.gpkg").unlink(missing_ok=True)
    write_vector(HERE / "sample.gpkg", layers | layers_to_try())
    write_rock(HERE / "rock_cubic_1m3.pts", 1.0, 1.0, 1.0)
    write_rock(HERE / "rock_platy_1m3.pts", 1.6, 1.25, 0.5)


def write_terrain(path: Path, grid: Grid) -> None:
    """Centimetres above 1040 m as 16-bit numbers, with scale and offset: a quarter of the size of floats."""
    base = 1040.0
    centimetres = np.round((grid.values[::-1].astype(np.float64) - base) * 100.0).astype(np.uint16)
    rows, columns = grid.shape
    profile = {"driver": "GTiff", "height": rows, "width": columns, "count": 1, "dtype": "uint16", "nodata": 65535}
    packing = {"compress": "deflate", "predictor": 2, "zlevel": 9, "tiled": True}
    place = {"crs": sample_slope.CRS_NAME, "transform": grid.transform}
    with rasterio.open(path, "w", **profile, **packing, **place) as target:
        target.write(centimetres, 1)
        target.scales, target.offsets = (0.01,), (base,)
        target.set_band_unit(1, "m")
    styles.store_beside(path, styles.of_raster("terrain"))


def write_rock(path: Path, *sides: float) -> None:
    """A norm body of 1 m3 whose sides are in this ratio, as a custom shape: x y z on each line."""
    points, triangles = norm_body(*sides)
    scale = properties_of_rock(points, triangles, 1.0).volume_m3 ** (-1.0 / 3.0)
    path.write_text("".join("{:.6g} {:.6g} {:.6g}\n".format(*each) for each in scale * points), encoding="ascii")


if __name__ == "__main__":
    main()
