"""Runs of slide-logs written by hand: straight tracks whose every number is known, for the tools that read runs.

Local (u, v) are metres from the corner of `slope_case`; the grid has 1 m cells, 60 x 100 of them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pyproj
import shapely
from slope_case import EAST, LENGTH, NORTH, WIDTH

from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.results.run_folder import pose_schema


@dataclass
class Track:
    """A log that moves in a straight line at one height, its axis turned by ``broadside_deg`` from its way."""

    start: tuple[float, float]
    end: tuple[float, float]
    speed: float = 10.0
    release_id: Any = 1
    broadside_deg: float = 0.0
    z: float = 1000.5
    clearance: float = 0.25
    spin: float = 0.0
    stop_reason: str = "rest"
    spacing: float = 0.5
    more: dict[str, Any] = field(default_factory=dict)

    def poses(self, length: float) -> dict[str, np.ndarray]:
        start, end = np.add(self.start, (EAST, NORTH)), np.add(self.end, (EAST, NORTH))
        way = end - start
        far = float(np.hypot(*way))
        n = max(2, round(far / self.spacing) + 1)
        x, y = (start + np.linspace(0.0, 1.0, n)[:, None] * way).T
        turn = np.radians(self.broadside_deg)
        direction = way / far
        axis = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ direction
        half, flat = 0.5 * length * axis, np.full(n, self.z)
        return {
            "t_s": np.linspace(0.0, far / self.speed, n),
            "x": x, "y": y, "z": flat,
            "xb": x - half[0], "yb": y - half[1], "zb": flat, "xt": x + half[0], "yt": y + half[1], "zt": flat,
            "speed_ms": np.full(n, self.speed), "spin_rad_s": np.full(n, self.spin),
            "clearance_m": np.full(n, self.clearance),
            "height_m": np.full(n, self.clearance + 0.2),
        }  # fmt: skip


def write_run(
    folder: Path,
    tracks: list[Track],
    *,
    dbh_cm: float = 40.0,
    length_m: float = 4.0,
    dem: str = "",
    lines: dict[str, tuple[Any, list[int]]] | None = None,
    digest: str = "",
    parameters: dict[str, Any] | None = None,
    rasters: dict[str, np.ndarray] | None = None,
    grid: dict[str, Any] | None = None,
) -> Path:
    """A run's folder; log_id is the row. ``lines``: id -> (shape in local coordinates, the logs that reach it)."""
    folder.mkdir(parents=True, exist_ok=True)
    crs = pyproj.CRS.from_epsg(2056)
    tables = []
    for log_id, track in enumerate(tracks):
        poses = track.poses(length_m) | {"log_id": None}
        poses["log_id"] = np.full(poses["t_s"].size, log_id)
        tables.append(pa.table([pa.array(poses[each.name], each.type) for each in pose_schema()], schema=pose_schema()))
    parquet.write_table(pa.concat_tables(tables), folder / "poses.parquet")
    starts, ends = (np.add([getattr(each, name) for each in tracks], (EAST, NORTH)) for name in ("start", "end"))
    columns = {
        "log_id": np.arange(len(tracks)),
        "release_id": [each.release_id for each in tracks],
        "release_x": starts[:, 0],
        "release_y": starts[:, 1],
        "release_z": [each.z for each in tracks],
        "stop_reason": [each.stop_reason for each in tracks],
        "runout_m": np.hypot(*(ends - starts).T),
        "speed_max_ms": [each.speed for each in tracks],
        "speed_mean_ms": [each.speed for each in tracks],
        "energy_max_kj": [0.5 * each.speed**2 for each in tracks],
        "jump_max_m": [each.clearance for each in tracks],
        "height_max_m": [each.clearance + 0.2 for each in tracks],
        "dbh_cm": dbh_cm,
        "length_m": length_m,
        "density_kg_m3": 300.0,
    }
    for name in tracks[0].more:
        columns[name] = [each.more[name] for each in tracks]
    deposits = gpd.GeoDataFrame(
        columns, geometry=shapely.points(np.column_stack([ends, columns["release_z"]])), crs=crs
    )
    layers = {"deposits": deposits}
    if lines:
        ids, shapes = (
            list(lines),
            [shapely.transform(each[0], lambda xy: np.add(xy, (EAST, NORTH))) for each in lines.values()],
        )
        layers["reach"] = gpd.GeoDataFrame({"line_id": ids}, geometry=shapes, crs=crs)
        pairs = [(log, line_id) for line_id, (_, logs) in lines.items() for log in logs]
        if pairs:
            rows = [log for log, _ in pairs]
            facts = {"log_id": rows, "line_id": [line_id for _, line_id in pairs], "t_s": 1.0}
            layers["reached_by"] = gpd.GeoDataFrame(facts, geometry=shapely.points(starts[rows]), crs=crs)
    write_vector(folder / "run.gpkg", layers)
    facts = grid or {"nx": WIDTH, "ny": LENGTH, "cell": 1.0, "x0": EAST + 0.5, "y0": NORTH + 0.5, "crs": "EPSG:2056"}
    manifest = {
        "tool": "slide-logs",
        "parameters": {"dem": dem, "fidelity": "standard", **(parameters or {})},
        "grid": facts,
        "digests": {"scene": "", "releases": digest},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    for name, values in (rasters or {}).items():
        write_values(folder / f"{name}.tif", values, facts)
    return folder


def write_values(path: Path, values: np.ndarray, grid: dict[str, Any], **profile: Any) -> None:
    """A raster on a run's grid; row 0 of ``values`` is the southernmost."""
    import rasterio
    from rasterio.transform import from_origin

    cell = grid["cell"]
    place = from_origin(grid["x0"] - cell / 2, grid["y0"] + (values.shape[0] - 0.5) * cell, cell, cell)
    facts = {"driver": "GTiff", "count": 1, "dtype": values.dtype, "crs": grid["crs"], "transform": place}
    with rasterio.open(path, "w", height=values.shape[0], width=values.shape[1], **(facts | profile)) as made:
        made.write(values[::-1], 1)
