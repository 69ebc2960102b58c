"""Induced rockfalls that were measured (Tschamut 2014), compared with the same rocks, simulated with friction laws for
rocks.

python -m benchmarks.tschamut FOLDER     slides, then the page docs/tschamut.md

FOLDER holds `terrain.asc`, `release_points.csv` and `observed_deposition.csv`: the data set EnviDat 34 (ODbL) as the
repository ofuhrer/rust_rockfall prepares it in `data/processed/tschamut2014`. None of it is part of this repository.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pandas
import rasterio
from rasterio.transform import from_origin

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.tools import slide_logs

from . import study

PAGE = Path(__file__).parents[1] / "docs" / "tschamut.md"
EAST, NORTH, UP, CRS = 2_694_000.0, 1_168_000.0, 1600.0, "EPSG:2056"  # position of the local frame; any place will do
BLOCKS = {1: ("St. Leonard", (0.37, 0.32, 0.37), 69.0), 2: ("heaviest", (0.50, 0.30, 0.39), 79.0),
          4: ("plate", (0.46, 0.30, 0.20), 40.0)}  # fmt: skip
TURNS = 10  # runs of each release, each turned at random, because its orientation is not in the data
SLIP = ("friction", "friction_max", "friction_kappa", "friction_beta")
LAWS: dict[str, dict[str, float]] = {
    "one coefficient, 0.5": {"friction": 0.5},
    "one coefficient, 0.4": {"friction": 0.4},
    "0.2 to 1.3, kappa 0.7/m, beta 20/s (example of Leine et al. 2014)": dict(
        zip(SLIP, (0.2, 1.3, 0.7, 20.0), strict=True)
    ),
    "0.35 to 2, kappa 2/m, beta 150/s": dict(zip(SLIP, (0.35, 2.0, 2.0, 150.0), strict=True)),
    "0.55 to 2, kappa 3/m, beta 185/s": dict(zip(SLIP, (0.55, 2.0, 3.0, 185.0), strict=True)),
    "the same, in soft ground of 15 MN/m², drag 1.5 (Chant Sura, Lu et al. 2019)": dict(
        zip((*SLIP, "soil_strength_mn_m2", "scar_drag"), (0.55, 2.0, 3.0, 185.0, 15.0, 1.5), strict=True)
    ),
    "one coefficient, 0.4, in the same soft ground": {"friction": 0.4, "soil_strength_mn_m2": 15.0, "scar_drag": 1.5},
}
HEAD = """# Rocks at Tschamut

The toolbox is made for logs. Bodies of other shapes slide too (`--shape`), and for rocks, friction can grow with
slip, and soft ground can slow what digs into it. This page compares the engine with measured rocks: 80 induced
rockfalls on a meadow at Tschamut, Switzerland, in 2014 (EnviDat 34, ODbL; not part of this repository), and the same
releases with this engine.

**The comparison shows little.** The terrain is a reconstruction from survey points with cells of 5 m, smoother than
the meadow. The rocks are boxes of the measured length, width and height, not the scanned shapes. Nothing was fitted:
the laws are one coefficient, the published example of friction that grows with slip, two sets of numbers of the kind
that its software uses (the last is the one that Lu et al. took at Chant Sura), and the soft ground of that meadow.

"""


def terrain_file(data: Path, folder: Path) -> str:
    heights = np.loadtxt(data / "terrain.asc", skiprows=6)
    head = dict(line.split() for line in (data / "terrain.asc").read_text(encoding="utf-8").splitlines()[:6])
    x0, y0, cell = (float(head[name]) for name in ("xllcorner", "yllcorner", "cellsize"))
    rows, columns = heights.shape
    path = str(folder / "dem.tif")
    made = from_origin(EAST + x0, NORTH + y0 + rows * cell, cell, cell)
    facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "crs": CRS, "height": rows, "width": columns}
    with rasterio.open(path, "w", transform=made, **facts) as target:
        target.write(heights + UP, 1)
    return path


def releases_file(rows: pandas.DataFrame, number: int, folder: Path) -> str:
    """Each release of a block ``TURNS`` times, with its velocity in plan, turned at random."""
    _, sides, mass = BLOCKS[number]
    many = rows.loc[rows.index.repeat(TURNS)].reset_index(drop=True)
    columns = {
        "log_id": np.arange(1, len(many) + 1),
        "release_id": many["trajectory_id"],
        "density_kg_m3": mass / np.prod(sides),
        "orientation": "tilted",
        "tilt_deg": np.random.default_rng(number).uniform(0.0, 180.0, len(many)),
        "azimuth_deg": np.degrees(np.arctan2(many["vx_mps"], many["vy_mps"])) % 360.0,
        "speed_ms": np.hypot(many["vx_mps"], many["vy_mps"]),
        "drop_m": 0.1,
    }
    at = geopandas.points_from_xy(EAST + many["x_m"], NORTH + many["y_m"])
    path = folder / f"releases_{number}.gpkg"
    geopandas.GeoDataFrame(columns, geometry=at, crs=CRS).to_file(path, driver="GPKG")
    return str(path)


def run_outs(number: int, dem: str, releases: str, law: dict[str, float], folder: Path) -> Any:
    """Column of the run-outs in plan [m] of a block's releases."""
    corners = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * BLOCKS[number][1]
    shape = folder / f"block_{number}.pts"
    np.savetxt(shape, corners, fmt="%.6g")
    asked = {"dem": dem, "releases": releases, "shape": str(shape), "trajectories": "none", "fidelity": "standard"}
    slide_logs.TOOL(feedback=Quiet(), **asked, **law, output=str(folder / "run"), overwrite=True)
    return read_table(str(folder / "run" / "run.gpkg") + "|layername=deposits", what="deposits")["runout_m"]


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.tschamut", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    data = parser.parse_args().folder
    released, observed = (pandas.read_csv(data / f"{name}.csv") for name in ("release_points", "observed_deposition"))
    lines = ["| run-out in plan [m], mean ± standard deviation | " + " | ".join(
        f"{name}, {(released['block_id'] == number).sum()} releases" for number, (name, _, _) in BLOCKS.items()) + " |",
        "|---|" + "---|" * len(BLOCKS)]  # fmt: skip
    of_block = [observed.loc[observed["block_id"] == number, "observed_runout_m"] for number in BLOCKS]
    lines.append("| measured | " + " | ".join(f"{each.mean():.0f} ± {each.std():.0f}" for each in of_block) + " |")
    with tempfile.TemporaryDirectory(prefix="tschamut-") as name:
        folder = Path(name)
        dem = terrain_file(data, folder)
        for words, law in LAWS.items():
            cells = []
            for number in BLOCKS:
                rows = released.loc[released["block_id"] == number]
                found = run_outs(number, dem, releases_file(rows, number, folder), law, folder)
                cells.append(f"{found.mean():.0f} ± {found.std():.0f}")
            lines.append(f"| {words} | " + " | ".join(cells) + " |")
            print(lines[-1], flush=True)
    where = study.provenance()
    made = (
        f"Made by `python -m benchmarks.tschamut FOLDER`, each release turned at random {TURNS} times, seed 0, "
        f"`standard`; {where['machine']}; {where['versions']}; engine {where['engine']}; {where['date']}."
    )
    PAGE.write_text(HEAD + "\n".join(lines) + "\n\n" + made + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
