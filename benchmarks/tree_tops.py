"""Tree tops of `find-trees` beside those of an independent program: `vwf` of ForestTools, on its open canopy models.

python -m benchmarks.tree_tops FOLDER    runs both and writes their table into docs/how-to/trees.md

FOLDER is a checkout of https://github.com/andrew-plowright/ForestTools (GPL-3); needs R with the packages terra and sf.
Neither its code nor its canopy models are part of this repository.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pandas
import rasterio
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.tools import find_trees

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "trees.md"
MARKS = re.compile(r"(<!-- measured: tree tops\b[^>]*-->\n).*?(<!-- end of measured: tree tops -->)", re.S)
CANOPIES = {"kootenayCHM": "Kootenay", "CHMdemo": "demo"}
LEAST_M = 2.0
# By name: the options of find-trees, and the radius [m] of a tree of height h [m] in R
WINDOWS: dict[str, tuple[dict[str, str | float], str]] = {
    "mixed": ({"window": "mixed"}, "(2.51503 + 0.00901 * h^2) / 2"),
    "deciduous": ({"window": "deciduous"}, "(3.09632 + 0.00895 * h^2) / 2"),
    "3 m": ({"window_m": 3.0}, "1.5 + 0 * h"),
    "5 m": ({"window_m": 5.0}, "2.5 + 0 * h"),
}
PROGRAM = """
library(terra); library(sf); source("{code}")
found <- vwf(rast("{canopy}"), function(h) {radius}, {least}, warnings = FALSE)
write.csv(data.frame(st_coordinates(found), height = found$height), "{output}", row.names = FALSE)
"""
SAID = """
The tops have been compared with those of an independent program, `vwf` of ForestTools (A. Plowright, GPL-3), on the
canopy models that come with it (drone surveys by Spire Aerobotics, British Columbia, 2016), for trees of at least 2 m.
`vwf` rounds the window's radius to whole cells, which a window of 3 m or 5 m does not need:
"""
Array = NDArray[np.float64]


def theirs(folder: Path, canopy: Path, radius: str, work: Path) -> Array:
    """x, y and height of the tops that ForestTools finds."""
    program, output = work / "tops.R", work / "tops.csv"
    program.write_text(
        PROGRAM.format(code=folder / "R" / "vwf.R", canopy=canopy, radius=radius, least=LEAST_M, output=output)
    )
    subprocess.run(["Rscript", "--vanilla", str(program)], check=True, capture_output=True)
    return pandas.read_csv(output).to_numpy(np.float64)


def ours(canopy: Path, options: dict[str, str | float], work: Path) -> Array:
    import geopandas

    place = work / "trees.gpkg"
    find_trees.TOOL(
        chm=str(canopy), min_height_m=LEAST_M, output=str(place), overwrite=True, feedback=Quiet(), **options
    )
    trees = geopandas.read_file(place, layer="trees")
    return np.column_stack([trees.geometry.x, trees.geometry.y, trees["height_m"]])


def compared(one: Array, other: Array, cell: float) -> dict[str, float]:
    """Numbers of tops with and without one of the other nearby, and the largest difference in height.

    one, other : x, y and height, shape (n, 3)
    """
    distance = np.hypot(*(one[:, None, k] - other[None, :, k] for k in (0, 1)))
    beside = np.sqrt(2.0) * cell * (1.0 + 1e-6)
    at = distance.min(axis=1) <= beside
    apart = np.abs(one[at, 2] - other[distance[at].argmin(axis=1), 2])
    return {
        "same": int((distance.min(axis=1) < 0.01 * cell).sum()),
        "near": int(at.sum()),
        "only_one": int((~at).sum()),
        "only_other": int((distance.min(axis=0) > beside).sum()),
        "height_m": float(apart.max(initial=0.0)),
    }


def table(folder: Path) -> str:
    rows = [
        "| Canopy model | Window | `find-trees` | `vwf` | in the same cell | within a cell | only `find-trees` | only "
        "`vwf` | heights differ by |",
        "|" + "---|" * 9,
    ]
    with tempfile.TemporaryDirectory() as made:
        for stem, name in CANOPIES.items():
            canopy = folder.resolve() / "data-raw" / f"{stem}.tif"
            with rasterio.open(canopy) as source:
                cell, size = source.transform.a, f"{source.width} x {source.height} cells of {source.transform.a:g} m"
            for window, (options, radius) in WINDOWS.items():
                mine, other = ours(canopy, options, Path(made)), theirs(folder.resolve(), canopy, radius, Path(made))
                found = compared(mine, other, cell)
                rows.append(
                    f"| {name}, {size} | {window} | {len(mine)} | {len(other)} | {found['same']} | {found['near']} "
                    f"| {found['only_one']} | {found['only_other']} | {found['height_m']:.3f} m |"
                )
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tree_tops", description=__doc__)
    parser.add_argument("folder", type=Path, help="a checkout of ForestTools")
    text = table(parser.parse_args().folder)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARKS.sub(lambda found: f"{found[1]}{SAID}\n{text}\n\n{found[2]}", page), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
