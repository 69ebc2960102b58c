"""A small slope as files, and runs on it: what the tests of slide-logs and of the tools behind it share.

30 m of flat ground, then 35 degrees up to the north; 60 x 100 cells of 1 m. Local (u, v) are metres from its corner.
"""

from __future__ import annotations

import difflib
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow.parquet as parquet
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.tools import map_intensity, map_origins, site_barriers, slide_logs, value_trees, vary

EAST, NORTH = 2_786_000.0, 1_196_000.0
WIDTH, LENGTH = 60, 100
FOOT = 30.0
RASTERS = ("hit_count", "reach_probability", "deposit_count", "speed_max", "energy_max", "jump_max")


class StopAfter(Quiet):
    """Requests a stop once a number of logs is done."""

    def __init__(self, logs: int) -> None:
        self.logs, self.done = logs, 0.0

    def progress(self, done: float, total: float, what: str) -> None:
        self.done = done if what == "sliding logs" else 0.0

    def cancelled(self) -> bool:
        return self.done >= self.logs


def write_dem(path: Path, *, cell: float = 1.0, crs: str | None = "EPSG:2056", flat: bool = False, **profile) -> str:
    rows, columns = round(LENGTH / cell), round(WIDTH / cell)
    v = (np.arange(rows)[::-1, None] + 0.5) * cell
    heights = 1000.0 + np.tan(np.radians(35.0)) * np.maximum(v - FOOT, 0.0) * (0.0 if flat else 1.0)
    values = np.broadcast_to(heights, (rows, columns)).astype("float32")
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "nodata": -9999.0}
    facts |= {"height": rows, "width": columns, "crs": crs, "transform": from_origin(EAST, NORTH + LENGTH, cell, cell)}
    with rasterio.open(path, "w", **(facts | profile)) as made:
        made.write(values, 1)
    return str(path)


def write_layer(path: Path, shapes: list[Any], crs: str | None = "EPSG:2056", to: str | None = None, **columns) -> str:
    """Shapes are in local coordinates; ``to`` reprojects them."""
    moved = [shapely.transform(shape, lambda xy: np.add(xy, (EAST, NORTH))) for shape in shapes]
    frame = gpd.GeoDataFrame(columns, geometry=moved, crs=crs)
    (frame.to_crs(to) if to else frame).to_file(path, layer=path.stem, driver="GPKG")
    return str(path)


def points(*places: tuple[float, float]) -> list[Any]:
    return [shapely.Point(*place) for place in places]


class Case:
    """Files in a folder, and runs of slide-logs on them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.dem = write_dem(folder / "dem.tif")
        rng = np.random.default_rng(4)
        places = [(20.0 + 20.0 * a, 70.0 + 10.0 * b) for a, b in rng.random((24, 2))]
        self.releases = write_layer(
            folder / "releases.gpkg", points(*places), log_id=np.arange(24) * 3 + 5, release_id=["a", "b"] * 12
        )
        stems = [(60.0 * a, 35.0 + 60.0 * b) for a, b in rng.random((60, 2))]
        self.trees = write_layer(
            folder / "trees.gpkg", points(*stems), tree_id=np.arange(60) + 900, dbh_cm=[50.0] * 60, height_m=[20.0] * 60
        )
        self.lines = write_layer(
            folder / "lines.gpkg",
            [shapely.LineString([(0.5, 25.0), (59.5, 25.0)]), shapely.box(10.0, 5.0, 30.0, 15.0)],
            line_id=["road", "house"],
        )
        self.barriers = write_layer(
            folder / "barriers.gpkg",
            [shapely.LineString([(10.0, 45.0), (35.0, 45.0)]), shapely.LineString([(40.0, 40.0), (50.0, 42.0)])],
            barrier_id=["west", "east"],
            height_m=[1.5, 4.0],
        )

    def values(self, **changes: Any) -> dict[str, Any]:
        values = {"dem": self.dem, "releases": self.releases, "friction": "0.25", "output": str(self.folder / "run")}
        logs = {"dbh_cm": 40.0, "length_m": 10.0, "fidelity": "draft", "time_limit_s": 60.0, "trajectories": "all"}
        return {name: value for name, value in (values | logs | changes).items() if value is not None}

    def everything(self) -> dict[str, str]:
        return {"trees": self.trees, "lines": self.lines, "barriers": self.barriers}

    def run(self, feedback: Any = None, **changes: Any) -> Path:
        values = self.values(**changes)
        slide_logs.TOOL(feedback=feedback, **values)
        return Path(values["output"])


def answers(case: Case, run: Path) -> dict[str, Path]:
    """What each tool that ``make-report --results`` shows says of a run."""
    found = {name: case.folder / name for name in ("siting", "intensity", "origins", "varied")}
    found["tree_effect"] = case.folder / "tree_effect.gpkg"
    value_trees.TOOL(run=str(run), output=str(found["tree_effect"]))
    lines = [shapely.LineString([(10.0, 40.0), (50.0, 40.0)]), shapely.LineString([(20.0, 35.0), (40.0, 35.0)])]
    candidates = write_layer(case.folder / "candidates.gpkg", lines, barrier_id=["long", "short"])
    site = {"run": str(run), "candidates": candidates, "height_m": "2,4", "barrier_classes": "etag-027"}
    site_barriers.TOOL(**site, output=str(found["siting"]))
    map_intensity.TOOL(run=str(run), events_per_year=0.1, output=str(found["intensity"]))
    map_origins.TOOL(run=str(run), least=1, cell_m=10.0, output=str(found["origins"]))
    values = case.values(output=str(found["varied"]), design="ends", vary="rolling_friction,friction=0.2:0.6")
    vary.TOOL(**{name: value for name, value in values.items() if name != "trajectories"}, lines=case.lines)
    return found


def cut_above_the_road(case: Case) -> Case:
    """With a terrain model that ends 40 m from the south, the road being at 25 m: logs that no tree holds leave it."""
    with rasterio.open(case.dem, "r+") as dem:
        heights = dem.read(1)
        heights[60:] = -9999.0
        dem.write(heights, 1)
    return case


def edit_manifest(folder: Path, **parameters: Any) -> None:
    """A manifest as one of a version before 0.3, without a seal, with other parameters."""
    place = folder / "manifest.json"
    told = json.loads(place.read_text(encoding="utf-8"))
    for name in ("seal", "files", "run_id", "inputs"):
        told.pop(name, None)
    told["parameters"] |= parameters
    place.write_text(json.dumps(told), encoding="utf-8")


def layer(run: Path, name: str) -> gpd.GeoDataFrame:
    return gpd.read_file(run / "run.gpkg", layer=name)


def arrivals(run: Path) -> set[tuple[int, str]]:
    """Each log with each line that it reached."""
    try:
        table = layer(run, "reached_by")
    except Exception:  # no log reached a line
        return set()
    return set(zip(table["log_id"].tolist(), table["line_id"].tolist(), strict=True))


def summary(run: Path) -> dict[str, Any]:
    return json.loads((run / "summary.json").read_text(encoding="utf-8"))


def raster(path: Path) -> np.ndarray:
    with rasterio.open(path) as source:
        return source.read(1)


def bands(path: Path) -> dict[str, bytes]:
    """Every band by its description, as bytes; none of a raster that is not there."""
    if not path.is_file():
        return {}
    with rasterio.open(path) as source:
        return {str(source.descriptions[k]): source.read(k + 1).tobytes() for k in range(source.count)}


def assert_same_run(one: Path, other: Path) -> None:
    """Every value of every result the same, bit for bit; what a run cost, and what it was called, apart."""
    names = [set(gpd.list_layers(run / "run.gpkg")["name"]) for run in (one, other)]
    assert names[0] == names[1]
    for name in names[0] & {"deposits", "deposited_logs", "trajectories", "barrier_hits", "tree_hits"}:
        a, b = layer(one, name), layer(other, name)
        assert list(a.columns) == list(b.columns)
        assert a.geometry.to_wkb().equals(b.geometry.to_wkb())
        assert a.drop(columns="geometry").equals(b.drop(columns="geometry"))
    assert parquet.read_table(one / "poses.parquet").equals(parquet.read_table(other / "poses.parquet"))
    for name in RASTERS:
        assert np.array_equal(raster(one / f"{name}.tif"), raster(other / f"{name}.tif"), equal_nan=True), name
    assert bands(one / "danger.tif") == bands(other / "danger.tif")
    a, b = summary(one), summary(other)
    for each in (a, b):  # notes are about the form of the inputs
        each["warnings"] = [told for told in each["warnings"] if told["level"] != "note"]
    assert [k for k in a.keys() | b.keys() if k != "cost" and a.get(k) != b.get(k)] == []
    assert a["cost"]["steps"] == b["cost"]["steps"]


def assert_same_file(one: Path, other: Path) -> None:
    """Byte by byte; of a GeoPackage that differs the rows that do are shown, which its bytes do not tell."""
    if one.read_bytes() == other.read_bytes():
        return
    if one.suffix == ".gpkg":
        dumps = []
        for place in (one, other):
            with closing(sqlite3.connect(place)) as database:
                dumps.append(list(database.iterdump()))
        differing = [line[:2000] for line in difflib.unified_diff(*dumps, n=0, lineterm="")]
        pytest.fail(f"{one.name} and {other.name} differ:\n" + "\n".join(differing[:20] or ["in no row"]))
    pytest.fail(f"{one} and {other} differ")


def assert_same_bytes(one: Path, other: Path) -> None:
    """Layers value by value (a GeoPackage holds the time at which it was made), the other results byte by byte."""
    assert_same_run(one, other)
    assert sorted(each.name for each in one.iterdir()) == sorted(each.name for each in other.iterdir())
    for name in ("poses.parquet", *(f"{each}.tif" for each in RASTERS)):
        assert_same_file(one / name, other / name)
