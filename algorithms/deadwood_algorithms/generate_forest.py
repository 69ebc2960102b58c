"""Plant a random forest: stems per hectare at uniform places, with normally distributed DBH and height.

Gives a trees layer for ``slide-logs`` over the DEM, or over the stand polygons on it less the excluded ones. The
numbers are given, or fitted to a trees layer (``--like``): its density over the same area, the means and standard
deviations of its DBH and height, and their correlation; a number that is given goes before the fitted one.

Presets of the paper: Klosters ``--stems-per-ha 300 --dbh-mean-cm 60.23 --dbh-sd-cm 18.64``, Rothenbrunnen
``--stems-per-ha 315 --dbh-mean-cm 44 --dbh-sd-cm 22``. As there, a draw that is no tree (DBH below 1 cm, height below
1.3 m) is drawn again, and the number of these is said: it narrows the distribution a little.

Heights without numbers of their own: the mean follows from the mean DBH by the law of ``import-trees``, and they vary
half as much, relatively, as the DBH. Tree k stands at the same place whatever the density, unless ``--min-spacing-m``
moves it away from a tree before it. It knows no clusters, gaps or species.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from deadwood_algorithms import draws, schemas, tool
from deadwood_algorithms.drawn_sizes import draw_pair
from deadwood_algorithms.layers import (
    Grid,
    number_column,
    output_path,
    read_dem,
    read_vector,
    warn_implausible,
    where_of,
    write_vector,
)
from deadwood_algorithms.planting import Ground, ground_of, plant
from deadwood_algorithms.tool import Feedback, Outcome, Tool, UserError

LEAST_DBH_CM = 1.0
LEAST_HEIGHT_M = 1.3  # below it there is no breast height


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = tool.raster("Terrain (DEM)")
    stems_per_ha: float | None = tool.number("Density", unit="1/ha", default=None, minimum=0.0, exclusive=True)
    dbh_mean_cm: float | None = tool.number("Mean DBH", unit="cm", default=None, minimum=0.0, exclusive=True)
    dbh_sd_cm: float | None = tool.number("Standard deviation of the DBH", unit="cm", default=None, minimum=0.0)
    height_mean_m: float | None = tool.number("Mean height", unit="m", default=None, minimum=0.0, exclusive=True)
    height_sd_m: float | None = tool.number("Standard deviation of the height", unit="m", default=None, minimum=0.0)
    correlation: float | None = tool.number(
        "Correlation of DBH and height", default=None, minimum=-1.0, maximum=1.0, help="Without --like: 0.8."
    )
    like: str | None = tool.vector("Trees layer to fit the numbers to", "point", default=None)
    stand: str | None = tool.vector("Stand polygons", "polygon", default=None, help="Without them: the whole DEM.")
    exclude: str | None = tool.vector("Polygons without trees", "polygon", default=None)
    min_spacing_m: float = tool.number("Smallest distance of two stems", unit="m", default=0.0, minimum=0.0)
    dbh_a: float = tool.number("a of DBH[cm] = a * H[m]^b", default=2.52, minimum=0.0, exclusive=True, advanced=True)
    dbh_b: float = tool.number("b of DBH[cm] = a * H[m]^b", default=0.84, minimum=0.0, exclusive=True, advanced=True)
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Trees layer (.gpkg)")


@dataclass(frozen=True)
class Sizes:
    """Normal distributions of DBH [cm] and height [m], and their correlation."""

    dbh_mean: float
    dbh_sd: float
    height_mean: float
    height_sd: float
    correlation: float


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    inputs = (ask.dem, ask.like, ask.stand, ask.exclude)
    with output_path(ask.output, ask.overwrite, suffix=".gpkg", inputs=inputs) as temporary:
        grid = read_dem(ask.dem, crs=ask.crs, feedback=feedback)
        ground = ground_of(grid, polygons(ask.stand, grid, ask, feedback), polygons(ask.exclude, grid, ask, feedback))
        fitted = fit(ask, ground, feedback) if ask.like else {}
        density = given(ask, "stems_per_ha", fitted)
        sizes = sizes_of(ask, fitted)
        count = round(density * ground.area / 1e4)
        if not count:
            raise UserError(f"{density:g} stems/ha on {ground.area / 1e4:.4g} ha is no tree at all; enlarge the stand")

        x, y = plant(ground, count, ask.min_spacing_m, ask.seed, feedback)
        dbh, height, redrawn = draw_sizes(sizes, count, ask.seed)
        columns = {"tree_id": np.arange(1, count + 1), "dbh_cm": dbh, "height_m": height}
        frame = geopandas.GeoDataFrame(columns, geometry=shapely.points(x, y), crs=grid.plan_crs)
        write_vector(temporary, {"trees": frame})
    lines = [
        f"{count} trees on {ground.area / 1e4:.2f} ha ({density:.4g} stems/ha)",
        f"DBH asked {sizes.dbh_mean:.1f} +- {sizes.dbh_sd:.1f} cm, planted {dbh.mean():.1f} +- {dbh.std():.1f} cm",
        f"height asked {sizes.height_mean:.1f} +- {sizes.height_sd:.1f} m, "
        f"planted {height.mean():.1f} +- {height.std():.1f} m, correlation {sizes.correlation:.2f}",
    ]
    if redrawn:
        lines.append(
            f"{redrawn} draws were no tree (DBH < {LEAST_DBH_CM:g} cm or height < {LEAST_HEIGHT_M:g} m), redrawn"
        )
    facts = {"trees": count, "area_ha": ground.area / 1e4, "stems_per_ha": density, "redrawn": redrawn}
    return Outcome({"output": Path(ask.output)}, facts, tuple(lines))


def polygons(path: str | None, grid: Grid, ask: Ask, feedback: Feedback) -> Any:
    """The union of a polygon layer, or None."""
    if path is None:
        return None
    frame = read_vector(
        path, geometry=("polygon",), target_crs=grid.crs, crs=ask.crs, what="stand polygons", feedback=feedback
    )
    return shapely.force_2d(shapely.union_all(np.asarray(frame.geometry.array)))


def fit(ask: Ask, ground: Ground, feedback: Feedback) -> dict[str, float]:
    """Density and size distribution of the trees of a layer that stand on this ground."""
    path = str(ask.like)
    frame = read_vector(
        path, geometry=("point",), target_crs=ground.grid.crs, crs=ask.crs, what="trees", feedback=feedback
    )
    points = np.asarray(frame.geometry.array)
    here = ground.holds(shapely.get_x(points), shapely.get_y(points))
    if here.sum() < 2:
        raise UserError(f"{where_of(frame)}: {here.sum()} of its trees stand on the DEM and stand; a fit needs 2")
    dbh = number_column(frame, "dbh_cm", minimum=0.0, exclusive=True)[here]
    height = number_column(frame, "height_m", minimum=0.0, exclusive=True)[here]
    warn_implausible(dbh, schemas.TREES.column("dbh_cm"), where_of(frame), feedback)
    warn_implausible(height, schemas.TREES.column("height_m"), where_of(frame), feedback)
    alike = dbh.std() == 0 or height.std() == 0
    return {
        "stems_per_ha": here.sum() / ground.area * 1e4,
        "dbh_mean_cm": float(dbh.mean()),
        "dbh_sd_cm": float(dbh.std(ddof=1)),
        "height_mean_m": float(height.mean()),
        "height_sd_m": float(height.std(ddof=1)),
        "correlation": 0.0 if alike else float(np.corrcoef(dbh, height)[0, 1]),
    }


def given(ask: Ask, name: str, fitted: dict[str, float]) -> float:
    value = getattr(ask, name)
    if value is None and name not in fitted:
        raise UserError(f"--{name.replace('_', '-')} is missing; give it, or a trees layer with --like")
    return float(fitted[name] if value is None else value)


def sizes_of(ask: Ask, fitted: dict[str, float]) -> Sizes:
    """The five numbers: given, else fitted, else (height only) derived from the DBH."""
    dbh_mean, dbh_sd = given(ask, "dbh_mean_cm", fitted), given(ask, "dbh_sd_cm", fitted)
    height_mean = (dbh_mean / ask.dbh_a) ** (1 / ask.dbh_b)
    if ask.height_mean_m is not None or "height_mean_m" in fitted:
        height_mean = given(ask, "height_mean_m", fitted)
    derived = {"height_sd_m": 0.5 * height_mean * dbh_sd / dbh_mean, "correlation": 0.8} | fitted
    return Sizes(dbh_mean, dbh_sd, height_mean, given(ask, "height_sd_m", derived), given(ask, "correlation", derived))


def draw_sizes(sizes: Sizes, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, int]:
    """DBH [cm] and height [m] of each tree, to 0.01, and how many draws were no tree."""
    return draw_pair(
        (sizes.dbh_mean, sizes.height_mean),
        (sizes.dbh_sd, sizes.height_sd),
        sizes.correlation,
        (LEAST_DBH_CM, LEAST_HEIGHT_M),
        seed,
        np.arange(1, count + 1),
        draws.TREE_SIZE,
        f"DBH {sizes.dbh_mean:g} +- {sizes.dbh_sd:g} cm and height {sizes.height_mean:g} +- {sizes.height_sd:g} m "
        "give hardly a tree; check the numbers and their units",
    )


TOOL = Tool("generate-forest", "Prepare", "Plant a random forest of given density and sizes", Ask, run)
