"""The skill of assess-mobilisation: measured on other logs, and written into docs/how-to/where-can-logs-start.md.

python -m benchmarks.mobilisation             slides what is missing in mobilisation.json, then writes the tables
python -m benchmarks.mobilisation --again     from the beginning

Slopes of 20 to 45 degrees with a relief as measured on real steep ground, bare and with a forest, logs upright and
lying. The tool assesses the ground, with its defaults. Other logs, from other random places, then slide by the engine
at `standard` with friction 0.25: their run-outs are compared with the share that the tool gave their cell, and with
what was used before: a product of friction, steepness and smoothness (until version 0.4, kept here only).
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import rasterio
import shapely
from numpy.typing import NDArray
from rasterio.transform import from_origin

from deadwood_algorithms.prepare.synthetic_slope import stem_sizes, stems_apart, waves
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import assess_mobilisation
from deadwood_engine import FIDELITIES, Logs, Scene, Trees, slide

from . import study

Array = NDArray[np.float64]
HERE = Path(__file__).parent
PAGE, MEASURED = HERE.parent / "docs" / "how-to" / "where-can-logs-start.md", HERE / "mobilisation.json"
SEED, TRUTH_SEED = 20261128, 7  # of the grounds; of the logs that are compared
SLOPES, COVERS, POSTURES = (20, 25, 30, 35, 40, 45), ("bare", "forest"), ("upright", "lying")
WIDTH, LENGTH, CELL = 180, 400, 1.0  # [m]
STARTS = (50.0, 250.0, 130.0, 370.0)  # [m] west, south, east, north of the ground that is assessed
# (wavelength, standard deviation) [m]: within the bands of two measured slopes, at 1 to 50 m
RELIEF = ((2.5, 0.07), (6.0, 0.15), (14.0, 0.25), (35.0, 0.6), (90.0, 3.5))
FRICTION, STEMS_PER_HA, LOGS, FAR_M = 0.25, 400.0, 480, 100.0
LOG = {"diameter": 0.75, "length": 30.0, "density": 300.0}  # the tool's default
EAST, NORTH = 2_600_000.0, 1_200_000.0
OLD_WINDOW_M, OLD_NONE_DEG, OLD_FULL_DEG, OLD_ROUGH_M, OLD_THRESHOLD = 10.0, 30.0, 35.0, 1.0, 0.3


def ground(slope: int) -> Array:
    """Heights [m], row 0 in the south; rougher in patches, as measured."""
    rng = np.random.default_rng((SEED, slope))
    shape = round(LENGTH / CELL), round(WIDTH / CELL)
    patches = np.clip(np.exp(0.6 * waves(rng, *shape, 60.0, CELL)), 0.4, 2.0)
    relief = sum(d * waves(rng, *shape, w, CELL) * (patches if w <= 20.0 else 1.0) for w, d in RELIEF)
    return 1000.0 + np.tan(np.radians(slope)) * ((np.arange(shape[0]) + 0.5) * CELL)[:, None] + relief


def forest(slope: int) -> Trees:
    rng = np.random.default_rng((SEED, slope, 1))
    place = stems_apart(rng, round(STEMS_PER_HA * WIDTH * LENGTH / 1e4), (0, WIDTH, 0, LENGTH), 1.5, lambda u, v: False)
    dbh, height = stem_sizes(rng, len(place), 35.0, 12.0, 10.0)
    return Trees(place[:, 0], place[:, 1], dbh / 100.0, height)


def assessed(folder: Path, heights: Array, trees: Trees | None, posture: str) -> tuple[Array, geopandas.GeoDataFrame]:
    """The share that goes far, by cell with row 0 in the south, and the release areas, in local coordinates."""
    place = from_origin(EAST, NORTH + LENGTH, CELL, CELL)
    facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "crs": "EPSG:2056", "transform": place}
    with rasterio.open(folder / "dem.tif", "w", height=heights.shape[0], width=heights.shape[1], **facts) as made:
        made.write(heights[::-1], 1)
    within = geopandas.GeoDataFrame(geometry=[shapely.transform(shapely.box(*STARTS), moved)], crs="EPSG:2056")
    within.to_file(folder / "within.gpkg")
    more = {}
    if trees is not None:
        points = shapely.points(trees.x + EAST, trees.y + NORTH)
        columns = {"dbh_cm": trees.diameter * 100.0, "height_m": trees.height}
        geopandas.GeoDataFrame(columns, geometry=points, crs="EPSG:2056").to_file(folder / "trees.gpkg")
        more["trees"] = str(folder / "trees.gpkg")
    output, areas = str(folder / "shares.tif"), str(folder / "areas.gpkg")
    orientation = "random-lying" if posture == "lying" else posture
    assess_mobilisation.TOOL(
        dem=str(folder / "dem.tif"), within=str(folder / "within.gpkg"), orientation=orientation, friction=FRICTION,
        output=output, release_areas=areas, overwrite=True, **more,
    )  # fmt: skip
    with rasterio.open(output) as made:
        share = made.read(made.descriptions.index("goes_far") + 1)[::-1]
    found = geopandas.read_file(areas, layer="release_areas")
    return share, found.set_geometry(found.geometry.translate(-EAST, -NORTH))


def moved(places: Array) -> Array:
    return np.add(places, (EAST, NORTH))


def other_logs(slope: int, posture: str) -> Logs:
    rng = np.random.default_rng((TRUTH_SEED, slope, POSTURES.index(posture)))
    x, y = (rng.uniform(STARTS[k], STARTS[k + 2], LOGS) for k in (0, 1))
    return Logs(
        log_id=np.arange(LOGS), x=x, y=y, orientation=np.full(LOGS, POSTURES.index(posture), np.int8),
        tilt=np.zeros(LOGS), azimuth=rng.uniform(0.0, 2.0 * np.pi, LOGS), speed=np.zeros(LOGS), drop=np.zeros(LOGS),
        **{name: np.full(LOGS, value) for name, value in LOG.items()},
    )  # fmt: skip


def runouts(heights: Array, trees: Trees | None, logs: Logs) -> Array:
    """Plan distance [m] from the release to the end, or to where a log left the ground: farther than FAR_M below."""
    scene = Scene.prepare(heights, CELL, CELL / 2, CELL / 2, friction=FRICTION, trees=trees or Trees.none())
    result = slide(scene, logs, FIDELITIES["standard"], time_limit=120.0, threads=2)
    return np.hypot(*(result.end_position - result.release_position)[:, :2].T)


def product_before(heights: Array, x: Array, y: Array) -> Array:
    """The susceptibility of version 0.4 and before, from a quadratic surface fitted to a window of heights."""
    radius = round((OLD_WINDOW_M / CELL - 1) / 2)
    u, v = (each.ravel() * CELL for each in np.meshgrid(*[np.arange(-radius, radius + 1.0)] * 2))
    terms = np.column_stack([np.ones_like(u), u, v, u**2, u * v, v**2])
    found = np.empty(len(x))
    for k, (row, column) in enumerate(zip((y / CELL).astype(int), (x / CELL).astype(int), strict=True)):
        z = heights[row - radius : row + radius + 1, column - radius : column + radius + 1].ravel()
        fitted, *_ = np.linalg.lstsq(terms, z, rcond=None)
        tangent, rough = np.hypot(fitted[1], fitted[2]), np.sqrt(np.mean((z - terms @ fitted) ** 2))
        steep = np.clip((np.degrees(np.arctan(tangent)) - OLD_NONE_DEG) / (OLD_FULL_DEG - OLD_NONE_DEG), 0.0, 1.0)
        found[k] = max(0.0, 1.0 - FRICTION / tangent) * steep * max(0.0, 1.0 - rough / OLD_ROUGH_M)
    return found


def rank_correlation(one: Array, other: Array) -> float:
    """Spearman's; ties have their mean rank; NaN if one of them is constant."""

    def ranks(values: Array) -> Array:
        _, place, count = np.unique(values, return_inverse=True, return_counts=True)
        return (np.cumsum(count) - 0.5 * (count - 1))[place]

    a, b = ranks(one), ranks(other)
    return float(np.corrcoef(a, b)[0, 1]) if np.ptp(a) and np.ptp(b) else float("nan")


def measure_case(slope: int, cover: str, posture: str) -> dict[str, Any]:
    """Of each of the other logs: its run-out, the share of its cell, whether it starts in an area, the old product."""
    heights, trees, logs = ground(slope), forest(slope) if cover == "forest" else None, other_logs(slope, posture)
    with tempfile.TemporaryDirectory() as folder:
        share, areas = assessed(Path(folder), heights, trees, posture)
    side = round(LENGTH / share.shape[0])
    return {
        "runout_m": np.ceil(runouts(heights, trees, logs)).astype(int).tolist(),
        "share_permille": np.rint(1000 * share[(logs.y // side).astype(int), (logs.x // side).astype(int)])
        .astype(int)
        .tolist(),
        "inside": shapely.contains_xy(areas.union_all(), logs.x, logs.y).astype(int).tolist(),
        "before_permille": np.floor(1000 * product_before(heights, logs.x, logs.y)).astype(int).tolist(),
    }


def row_of(name: str, cases: list[dict[str, Any]]) -> str:
    """A row of the table, of the logs of some cases."""
    keys = ("runout_m", "share_permille", "before_permille")
    runout, share, before = (np.concatenate([each[key] for each in cases]) for key in keys)
    inside = np.concatenate([each["inside"] for each in cases]).astype(bool)
    far, n = runout > FAR_M, runout.size

    def caught(within: NDArray[np.bool_]) -> str:
        if not far.any():
            return "-"
        low, high = wilson_interval(int((far & within).sum()), int(far.sum()))
        return f"{100 * (far & within).sum() / far.sum():.0f} ({100 * low:.0f} to {100 * high:.0f})"

    def ranks(values: Array) -> str:
        found = rank_correlation(values, runout)
        return f"{found:.2f}" if np.isfinite(found) else "-"

    drawn = before >= 1000 * OLD_THRESHOLD
    return (
        f"| {name} | {100 * far.mean():.0f} | {share.mean() / 10:.0f} | {ranks(share)} | {caught(inside)} | "
        f"{100 * inside.sum() / n:.0f} | {ranks(before)} | {caught(drawn)} | {100 * drawn.sum() / n:.0f} |"
    )


def table(known: dict[str, Any]) -> str:
    source = known["source"]
    lines = [
        f"Measured {source['date']} ({LOGS} logs a row and slope, run-outs at `standard`, friction {FRICTION:g}; "
        f"{source['machine']}; {source['versions']}).",
        "",
        f"| logs, cover, slope | run out beyond {FAR_M:g} m [%] | share that goes far by the tool [%] | rank "
        "correlation with the run-out | of these runs, start in an area [%] | ground in areas [%] | before: rank "
        "correlation | before: start in an area [%] | before: ground in areas [%] |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for posture in POSTURES:
        for cover in COVERS:
            cases = [known["cases"][f"{slope} {cover} {posture}"] for slope in SLOPES]
            lines += [
                row_of(f"{posture}, {cover}, {slope}°", [case]) for slope, case in zip(SLOPES, cases, strict=True)
            ]
            lines.append(row_of(f"**{posture}, {cover}, all**", cases))
    every = list(known["cases"].values())
    return "\n".join([*lines, row_of("**all**", every)])


def write(known: dict[str, Any]) -> None:
    """Write the table into the page, between its marks."""
    page = PAGE.read_text(encoding="utf-8")
    pattern, text = r"(?s)(<!-- skill -->\n).*?(<!-- end of skill -->)", table(known)
    PAGE.write_text(re.sub(pattern, lambda found: found[1] + text + "\n" + found[2], page), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.mobilisation",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--again", action="store_true", help="measure everything again")
    ask = parser.parse_args()
    known = json.loads(MEASURED.read_text()) if MEASURED.is_file() and not ask.again else {"cases": {}}
    for slope in SLOPES:
        for cover in COVERS:
            for posture in POSTURES:
                name = f"{slope} {cover} {posture}"
                if name not in known["cases"]:
                    known["cases"][name] = measure_case(slope, cover, posture)
                    known["source"] = study.provenance()
                    MEASURED.write_text(json.dumps(known, separators=(",", ":")).replace('},"', '},\n"') + "\n")
    write(known)


if __name__ == "__main__":
    main()
