"""Tree tops of `find-trees`, compared with those that another program found on the same canopy model.

python -m benchmarks.tree_tops CHM TOPS --window-m 1.6 --window-growth 0.14

CHM is a raster, TOPS a layer of points, or the number of tops if only that was published. Both may also be `.rda`
files of R as they are in the repository of ForestTools (`pip install rdata`), and CHM a cloud of points that are
heights above the ground (`.laz`; `pip install laspy lazrs`), of which the canopy model is made as `p2r` of lidR makes
it. The law of the window is that of the other program, by its diameter. With ``--row NAME`` the result becomes a row of
the table in docs/how-to/trees.md. None of the data is part of this repository.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import rasterio
import shapely
from numpy.typing import NDArray
from rasterio.transform import from_origin

from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.prepare.trees.tops import Window, find_tops
from deadwood_algorithms.tools import find_trees

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "trees.md"
ROWS = Path(__file__).with_name("tree_tops.json")
MARKS = re.compile(r"(<!-- measured: tree tops\b[^>]*-->\n).*?(<!-- end of measured: tree tops -->)", re.S)
HIGHEST_M = 150.0
CLASS_M = 5.0
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Canopy:
    """Heights [m] by row from the south and column, NaN where unknown; the south-western corner; the cell [m]."""

    heights: Array
    x0: float
    y0: float
    cell: float

    def cells_of(self, x: Array, y: Array) -> NDArray[np.int64]:
        """Row and column of places, shape (n, 2)."""
        return np.floor(np.column_stack([(y - self.y0) / self.cell, (x - self.x0) / self.cell])).astype(np.int64)


@dataclass(frozen=True)
class WholeCells(Window):
    """A window whose radius is rounded to whole cells, at least one: that of ForestTools."""

    def reach(self, height: Array, cell: float) -> Array:
        rounded = np.maximum(np.rint(self.diameter(height) / (2.0 * cell)), 1.0)
        return np.maximum(rounded**2, 2.0)


def compared(published: NDArray[np.int64], ours: NDArray[np.int64], canopy: Canopy, window: Window) -> dict[str, Any]:
    """Counts of tops in the same cell, one cell away, and without a counterpart; heights of the latter.

    published, ours : rows and columns, shape (n, 2)
    """
    theirs, mine = set(map(tuple, published.tolist())), set(map(tuple, ours.tolist()))
    missed, extra = sorted(theirs - mine), sorted(mine - theirs)
    free, near = set(extra), 0
    for row, column in list(missed):
        beside = next((at for at in sorted(free) if max(abs(at[0] - row), abs(at[1] - column)) == 1), None)
        if beside:
            free.remove(beside)
            missed.remove((row, column))
            near += 1

    def equal(place: tuple[int, int]) -> bool:
        """Whether another of the published tops, of the same height, is in its circle."""
        height = canopy.heights[place]
        reach = float(window.reach(np.array([height]), canopy.cell)[0])
        far = int(np.sqrt(reach))
        around = ((j, i) for j in range(-far, far + 1) for i in range(-far, far + 1) if 0 < j * j + i * i <= reach)
        places = ((place[0] + j, place[1] + i) for j, i in around)
        return any(at in theirs and canopy.heights[at] == height for at in places)

    return {
        "published": len(published),
        "ours": len(ours),
        "same": len(theirs & mine),
        "near": near,
        "missed": len(missed),
        "equal": sum(map(equal, missed)),
        "extra": len(free),
        "missed_m": [float(canopy.heights[at]) for at in missed],
        "extra_m": [float(canopy.heights[at]) for at in sorted(free)],
    }


def by_height(found: dict[str, Any]) -> str:
    """What has no counterpart, by classes of height."""
    lines = []
    for words in ("missed", "extra"):
        classes = np.floor(np.array(found[f"{words}_m"]) / CLASS_M).astype(int)
        counts = [f"{n} of {CLASS_M * k:g} to {CLASS_M * (k + 1):g} m" for k, n in enumerate(np.bincount(classes)) if n]
        lines.append(f"{words}: {', '.join(counts) or 'none'}")
    return "; ".join(lines)


def from_r(path: Path) -> Any:
    import rdata  # pyright: ignore[reportMissingImports]

    return next(iter(rdata.conversion.convert(rdata.parser.parse_file(path)).values()))


def canopy_of(path: Path, resolution: float, radius: float) -> Canopy:
    if path.suffix == ".laz":
        return canopy_of_points(path, resolution, radius)
    if path.suffix == ".rda":
        packed = from_r(path)
        said = dict(re.findall(r"(\w+)=([-\d.]+)", str(packed.definition[0])))
        shape = int(said["nrows"]), int(said["ncols"])
        x0, y0, x1 = (float(said[each]) for each in ("xmin", "ymin", "xmax"))
        return Canopy(np.asarray(packed.values, float).reshape(shape)[::-1], x0, y0, (x1 - x0) / shape[1])
    with rasterio.open(path) as source:
        heights = source.read(1, masked=True).astype(np.float64).filled(np.nan)[::-1]
        return Canopy(heights, source.bounds.left, source.bounds.bottom, source.transform.a)


def canopy_of_points(path: Path, resolution: float, radius: float) -> Canopy:
    """The highest point in each cell, each point counting at eight places on a circle around it."""
    import laspy  # pyright: ignore[reportMissingImports]

    points = laspy.read(path)
    x, y, z = (np.asarray(points[each], np.float64) for each in "xyz")
    x0, y1 = (np.floor(x.min() / resolution) * resolution, np.ceil(y.max() / resolution) * resolution)
    columns = int(np.ceil((x.max() - x0) / resolution))
    rows = int(np.ceil((y1 - y.min()) / resolution))
    highest = np.full((rows, columns), -np.inf)
    for angle in np.arange(8) * np.pi / 4.0:
        i = np.floor(((x + radius * np.cos(angle)) - x0) / resolution).astype(int)
        j = np.floor((y1 - (y + radius * np.sin(angle))) / resolution).astype(int)  # the last digits as in lidR
        inside = (i >= 0) & (i < columns) & (j >= 0) & (j < rows) & (z >= 0.0)
        np.maximum.at(highest, (j[inside], i[inside]), z[inside])
    return Canopy(np.where(np.isfinite(highest), highest, np.nan)[::-1], x0, y1 - rows * resolution, resolution)


def published_tops(path: Path, window: Window) -> tuple[Array, Array]:
    """Easting and northing. A layer that says its windows' radii must have those of the law."""
    table = from_r(path) if path.suffix == ".rda" else geopandas.read_file(path)
    if "winRadius" in table:
        radius, height = table["winRadius"].to_numpy(float), table["height"].to_numpy(float)
        if np.abs(radius - window.diameter(height) / 2.0).max() > 1e-6:
            growth, base = np.polyfit(height, 2.0 * radius, 1)
            sys.exit(f"{path}: found with another window: --window-m {base:.4g} --window-growth {growth:.4g}")
    if path.suffix == ".rda":
        places = np.array([np.asarray(each, float).ravel()[:2] for each in table["geometry"]])
    else:
        places = shapely.get_coordinates(table.geometry.to_numpy())
    return places[:, 0], places[:, 1]


def tops_of_the_tool(canopy: Canopy, window: Window, least: float) -> NDArray[np.int64]:
    with tempfile.TemporaryDirectory() as made:
        chm, trees = Path(made) / "chm.tif", Path(made) / "trees.gpkg"
        rows, columns = canopy.heights.shape
        place = from_origin(canopy.x0, canopy.y0 + rows * canopy.cell, canopy.cell, canopy.cell)
        facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "nodata": np.nan, "crs": "EPSG:32632"}
        with rasterio.open(chm, "w", height=rows, width=columns, transform=place, **facts) as file:
            file.write(canopy.heights[::-1], 1)
        asked = {"window_m": window.a, "window_growth": window.b, "min_height_m": least}
        find_trees.TOOL(chm=str(chm), output=str(trees), feedback=Quiet(), **asked)
        found = geopandas.read_file(trees, layer="trees").geometry
    return canopy.cells_of(found.x.to_numpy(), found.y.to_numpy())


def tops_of_whole_cells(canopy: Canopy, window: Window, least: float) -> NDArray[np.int64]:
    rounded = WholeCells(window.a, window.b)
    read = canopy.heights
    found = find_tops(lambda rows: read[rows].copy(), read.shape, canopy.cell, rounded, least, HIGHEST_M)
    return np.column_stack([found.row, found.column]).astype(np.int64)


def table() -> str:
    lines = [
        "| Canopy model | Other program, window | Radius | Its tops | `find-trees` | Same cell | One cell away "
        "| Missed | Of these, one of several equal ones | Extra |",
        "|" + "---|" * 10,
    ]
    for name, row in json.loads(ROWS.read_text(encoding="utf-8")).items():
        for radius, found in row["found"].items():
            counts = [found.get(each, "-") for each in ("same", "near", "missed", "equal", "extra")]
            cells = [name, row["by"], radius, found["published"], found["ours"], *counts]
            lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def written(row: str, by: str, found: dict[str, dict[str, Any]]) -> None:
    rows = json.loads(ROWS.read_text(encoding="utf-8")) if ROWS.exists() else {}
    short = {radius: {k: v for k, v in each.items() if not k.endswith("_m")} for radius, each in found.items()}
    rows[row] = {"by": by, "found": short}
    ROWS.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARKS.sub(lambda mark: f"{mark[1]}\n{table()}\n\n{mark[2]}", page), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tree_tops", description=__doc__)
    parser.add_argument("chm", type=Path)
    parser.add_argument("tops", help="a layer of points, or their number")
    parser.add_argument("--window-m", type=float, required=True, help="diameter of the window at height 0")
    parser.add_argument("--window-growth", type=float, default=0.0, help="growth of the diameter, m per m of height")
    parser.add_argument("--min-height-m", type=float, default=2.0)
    parser.add_argument("--whole-cells", action="store_true", help="also with the radius in whole cells (ForestTools)")
    parser.add_argument("--cell-m", type=float, default=1.0, help="of the canopy model that is made of points")
    parser.add_argument("--subcircle-m", type=float, default=0.15, help="radius of a point, as in p2r of lidR")
    parser.add_argument("--row", help="name of the canopy model in the table of docs/how-to/trees.md")
    parser.add_argument("--by", default="", help="name of the other program in the table")
    asked = parser.parse_args()
    window = Window(asked.window_m, asked.window_growth)
    canopy = canopy_of(asked.chm, asked.cell_m, asked.subcircle_m)
    searched = {"as given": tops_of_the_tool(canopy, window, asked.min_height_m)}
    if asked.whole_cells:
        searched["whole cells"] = tops_of_whole_cells(canopy, window, asked.min_height_m)
    if asked.tops.isdigit():
        found = {radius: {"published": int(asked.tops), "ours": len(ours)} for radius, ours in searched.items()}
    else:
        published = canopy.cells_of(*published_tops(Path(asked.tops), window))
        found = {radius: compared(published, ours, canopy, window) for radius, ours in searched.items()}
    for radius, each in found.items():
        print(f"radius {radius}: " + ", ".join(f"{k} {v}" for k, v in each.items() if not k.endswith("_m")))
        if "missed_m" in each:
            print(f"  {by_height(each)}")
    if asked.row:
        written(asked.row, f"{asked.by}, {window}", found)


if __name__ == "__main__":
    main()
