"""Induced rockfalls that were measured (Tschamut 2014), compared with the same rocks, simulated with friction laws for
rocks.

python -m benchmarks.tschamut FOLDER     slides, then the page docs/tschamut.md

FOLDER holds `terrain.asc`, `release_points.csv` and `observed_deposition.csv`: the data set EnviDat 34 (ODbL) as the
repository ofuhrer/rust_rockfall prepares it in `data/processed/tschamut2014`, and its `split.yaml` of
`calibration/data/tschamut`. None of it is part of this repository.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import geopandas
import numpy as np
import pandas
import rasterio
import yaml
from numpy.typing import NDArray
from rasterio.transform import from_origin
from scipy.spatial import ConvexHull

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.prepare.log_solid import norm_body
from deadwood_algorithms.tools import slide_logs

from . import study

PAGE = Path(__file__).parents[1] / "docs" / "tschamut.md"
EAST, NORTH, UP, CRS = 2_694_000.0, 1_168_000.0, 1600.0, "EPSG:2056"  # position of the local frame; any place will do
BLOCKS = {1: ("St. Leonard", (0.37, 0.32, 0.37), 69.0), 2: ("heaviest", (0.50, 0.30, 0.39), 79.0),
          4: ("plate", (0.46, 0.30, 0.20), 40.0)}  # fmt: skip
BODIES = ("box", "norm body")
TURNS = 10  # runs of each release, each turned at random, because its orientation is not in the data
SOFT = "the same, in soft ground of 15 MN/m², drag 1.5 (Chant Sura, Lu et al. 2019)"
SLIP = ("friction", "friction_max", "friction_kappa", "friction_beta")
LAWS: dict[str, dict[str, float]] = {
    "one coefficient, 0.5": {"friction": 0.5},
    "one coefficient, 0.4": {"friction": 0.4},
    "0.2 to 1.3, kappa 0.7/m, beta 20/s (example of Leine et al. 2014)": dict(
        zip(SLIP, (0.2, 1.3, 0.7, 20.0), strict=True)
    ),
    "0.35 to 2, kappa 2/m, beta 150/s": dict(zip(SLIP, (0.35, 2.0, 2.0, 150.0), strict=True)),
    "0.55 to 2, kappa 3/m, beta 185/s": dict(zip(SLIP, (0.55, 2.0, 3.0, 185.0), strict=True)),
    SOFT: dict(zip((*SLIP, "soil_strength_mn_m2", "scar_drag"), (0.55, 2.0, 3.0, 185.0, 15.0, 1.5), strict=True)),
    "one coefficient, 0.4, in the same soft ground": {"friction": 0.4, "soil_strength_mn_m2": 15.0, "scar_drag": 1.5},
}
FITTED = (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95)  # values of the one number that is fitted: the friction before slip
BAND = (0.05, 0.95)
HEAD = """# Rocks at Tschamut

The toolbox is made for logs. Bodies of other shapes slide too (`--shape`), and for rocks, friction can grow with
slip, and soft ground can slow what digs into it. This page compares the engine with measured rocks: 80 induced
rockfalls on a meadow at Tschamut, Switzerland, in 2014 (EnviDat 34, ODbL; not part of this repository), and the same
releases with this engine.

The terrain is a reconstruction from survey points with cells of 5 m, smoother than the meadow. Of the rocks, length,
width, height and mass are known, not the scanned shape. They slide as two bodies: as **boxes** of these sides, and as
**norm bodies** (`make-log --width-m --height-m`), which have the corners and edges of a box cut off. Each body has the
measured mass. The density that it then has shows how far its shape is off: of a box {box}, of a norm body
{norm} kg/m³, of granite about 2650.

**What it shows**: for rocks the shape decides more than the law. A box in soft ground stops where it lands on a face; a
norm body rolls on, and two of three blocks go about as far as measured with nothing fitted. The third, nearly a cube,
goes too far, and with some laws leaves the terrain model, so that its run-outs are lower bounds. One meadow, three
blocks.

## Nothing fitted

The laws are one coefficient, the published example of friction that grows with slip, two sets of numbers of the kind
that its software uses (the last is the one that Lu et al. took at Chant Sura), and the soft ground of that meadow.
Logs that left the terrain model count with the distance to its edge; their share stands behind the run-outs.

"""

FIT = """## One number fitted on one half, judged on the other

The public split of these rockfalls (seed 70314) has 18 of the 80 for calibration and 18 others, held out. One number,
the friction before slip of the last law with soft ground, is fitted to the calibration half (the mean continuous ranked
probability score of the three blocks; 0 is a perfect forecast), and judged on the other."""


def corners_of(body: str, sides: tuple[float, float, float]) -> NDArray[np.float64]:
    """The corners [m] of a block as a box or as a norm body."""
    if body == "norm body":
        return norm_body(*sides)[0]
    return (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * np.asarray(sides, np.float64)


def density_of(body: str, number: int) -> float:
    """The density [kg/m3] with which a body has the measured mass."""
    _, sides, mass = BLOCKS[number]
    return mass / ConvexHull(corners_of(body, sides)).volume


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


def releases_file(rows: pandas.DataFrame, number: int, body: str, folder: Path) -> str:
    """Each release of a block ``TURNS`` times, with its velocity in plan, turned at random."""
    many = rows.loc[rows.index.repeat(TURNS)].reset_index(drop=True)
    columns = {
        "log_id": np.arange(1, len(many) + 1),
        "release_id": many["trajectory_id"],
        "density_kg_m3": density_of(body, number),
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


@dataclass(frozen=True)
class Outcomes:
    """Run-outs in plan [m] of a block's releases, each ``TURNS`` times, and which of them left the terrain model."""

    trajectory: NDArray[np.str_]
    runout: NDArray[np.float64]
    left: NDArray[np.bool_]

    def of(self, trajectories: Collection[str]) -> Outcomes:
        chosen = np.isin(self.trajectory, list(trajectories))
        return Outcomes(self.trajectory[chosen], self.runout[chosen], self.left[chosen])

    def words(self) -> str:
        left = f", {100.0 * self.left.mean():.0f} % left" if self.left.any() else ""
        return f"{self.runout.mean():.0f} ± {self.runout.std():.0f}{left}"

    def band(self) -> tuple[float, float]:
        """What 90 of 100 measured run-outs should lie in; without an upper end where more than 5 % left."""
        low, high = np.quantile(self.runout, BAND)
        return float(low), float("inf") if self.left.mean() > 1.0 - BAND[1] else float(high)

    def score(self, measured: NDArray[np.float64]) -> float:
        """Continuous ranked probability score [m], the mean over the measured run-outs: 0 is a perfect forecast."""
        spread = np.abs(self.runout[:, None] - self.runout).mean()
        return float(np.abs(self.runout[:, None] - measured).mean() - 0.5 * spread)


class Meadow:
    """The data, and slides on it."""

    def __init__(self, data: Path, folder: Path) -> None:
        self.folder = folder
        self.released, self.observed = (
            pandas.read_csv(data / f"{name}.csv") for name in ("release_points", "observed_deposition")
        )
        self.split = yaml.safe_load((data / "split.yaml").read_text(encoding="utf-8"))
        self.dem = terrain_file(data, folder)

    def measured(self, number: int, trajectories: Collection[str] | None = None) -> NDArray[np.float64]:
        """Measured run-outs [m] of a block."""
        rows = self.observed.loc[self.observed["block_id"] == number]
        if trajectories is not None:
            rows = rows.loc[rows["trajectory_id"].isin(trajectories)]
        return rows["observed_runout_m"].to_numpy()

    def slid(self, number: int, body: str, law: dict[str, float]) -> Outcomes:
        rows = self.released.loc[self.released["block_id"] == number]
        shape = self.folder / "block.pts"
        np.savetxt(shape, corners_of(body, BLOCKS[number][1]), fmt="%.6g")
        releases = releases_file(rows, number, body, self.folder)
        asked = {"releases": releases, "shape": str(shape), "trajectories": "none", "fidelity": "standard"}
        run = self.folder / "run"
        slide_logs.TOOL(feedback=Quiet(), dem=self.dem, **asked, **law, output=str(run), overwrite=True)
        found = read_table(f"{run / 'run.gpkg'}|layername=deposits", what="deposits").sort_values("log_id")
        trajectory = rows["trajectory_id"].repeat(TURNS).to_numpy(str)
        return Outcomes(trajectory, found["runout_m"].to_numpy(), (found["stop_reason"] == "left_dem").to_numpy())


def table_of_laws(meadow: Meadow) -> list[str]:
    """A row a body and law, with a column a block."""
    names = (f"{name}, {len(meadow.measured(number))} releases" for number, (name, _, _) in BLOCKS.items())
    lines = ["| run-out in plan [m], mean ± standard deviation | " + " | ".join(names) + " |"]
    lines.append("|---|" + "---|" * len(BLOCKS))
    every = [meadow.measured(number) for number in BLOCKS]
    lines.append("| **measured** | " + " | ".join(f"{each.mean():.0f} ± {each.std():.0f}" for each in every) + " |")
    for body in BODIES:
        for words, law in LAWS.items():
            found = (meadow.slid(number, body, law).words() for number in BLOCKS)
            lines.append(f"| {body}: {words} | " + " | ".join(found) + " |")
            print(lines[-1], flush=True)
    return lines


def fitted(meadow: Meadow) -> list[str]:
    """One number fitted on the calibration half of the public split, and judged on the other half."""
    halves = {half: meadow.split[f"{half}_ids"] for half in ("calibration", "holdout")}
    slid = {
        (body, mu): {number: meadow.slid(number, body, LAWS[SOFT] | {"friction": mu}) for number in BLOCKS}
        for body in BODIES
        for mu in FITTED
    }

    def score(body: str, mu: float, half: str) -> float:
        ids = halves[half]
        return float(np.mean([slid[body, mu][k].of(ids).score(meadow.measured(k, ids)) for k in BLOCKS]))

    lines = [
        "| body | friction before slip | score, calibration [m] | score, hold-out [m] | hold-out: simulated minus "
        "measured mean [m], by block | hold-out: measured within the simulated 90 % |",
        "|---|---|---|---|---|---|",
    ]
    for body in BODIES:
        best = min(FITTED, key=lambda mu: score(body, mu, "calibration"))
        for mu, words in ((LAWS[SOFT]["friction"], "as published"), (best, "fitted")):
            found = {k: slid[body, mu][k].of(halves["holdout"]) for k in BLOCKS}
            measured = {k: meadow.measured(k, halves["holdout"]) for k in BLOCKS}
            off = (f"{found[k].runout.mean() - measured[k].mean():+.0f}" for k in BLOCKS)
            ends = {k: found[k].band() for k in BLOCKS}
            held = sum(int(((ends[k][0] <= measured[k]) & (measured[k] <= ends[k][1])).sum()) for k in BLOCKS)
            lines.append(
                f"| {body} | {mu:g} ({words}) | {score(body, mu, 'calibration'):.1f} | "
                f"{score(body, mu, 'holdout'):.1f} | {', '.join(off)} | {held} of {sum(map(len, measured.values()))} |"
            )
            print(lines[-1], flush=True)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.tschamut", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    with tempfile.TemporaryDirectory(prefix="tschamut-") as name:
        meadow = Meadow(parser.parse_args().folder, Path(name))
        tables = table_of_laws(meadow), fitted(meadow)
    sizes = (sorted(density_of(body, number) for number in BLOCKS) for body in BODIES)
    box, norm = (f"{each[0]:.0f} to {each[-1]:.0f}" for each in sizes)
    where = study.provenance()
    made = (
        f"Made by `python -m benchmarks.tschamut FOLDER`, each release turned at random {TURNS} times, seed 0, "
        f"`standard`; {where['machine']}; {where['versions']}; engine {where['engine']}; {where['date']}."
    )
    parts = [HEAD.format(box=box, norm=norm), "\n".join(tables[0]), FIT, "\n".join(tables[1]), made]
    PAGE.write_text("\n\n".join(part.strip() for part in parts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
