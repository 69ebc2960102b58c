"""The paths of the logs whose poses are kept: the file of poses, and the layer of trajectories."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, BinaryIO

import geopandas
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pyproj
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.streams import Stream
from deadwood_algorithms.results.run_folder import pose_schema
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.simulate.checkpoints import WorkFolder
from deadwood_engine import STOP_REASONS

# Path length between vertices of a trajectory line: at 30 m/s a flight deviates by 1.4 mm between two of them.
VERTEX_SPACING_M = 1.0
VERTEX_BYTES = 24
PATHS_PIECE = 2**11  # number of paths of the layer made at once


def pose_table(poses: Any, log_id: NDArray[np.int64], crs: pyproj.CRS) -> pa.Table:
    """The engine's poses under the names of ``poses.parquet``."""
    columns = {"log_id": log_id[poses.log_row], "t_s": poses.time}
    for ending, points in (("", poses.position), ("b", poses.base), ("t", poses.tip)):
        columns |= {axis + ending: points[:, k] for k, axis in enumerate("xyz")}
    columns |= {
        "speed_ms": poses.speed,
        "spin_rad_s": poses.spin,
        "clearance_m": poses.clearance,
        "height_m": poses.height,
    }
    schema = pose_schema(crs)
    return pa.table([pa.array(columns[each.name], each.type) for each in schema], schema=schema)


@dataclass
class KeptPaths:
    """The thinned paths of the logs that keep theirs, in an anonymous file, and the position of each in it."""

    spool: BinaryIO
    log_id: array[int] = field(default_factory=lambda: array("q"))
    starts: array[int] = field(default_factory=lambda: array("q", [0]))  # vertices

    def __len__(self) -> int:
        return len(self.log_id)

    def keep(self, log_id: int, points: NDArray[np.float64]) -> None:
        self.spool.write(np.ascontiguousarray(points, np.float64).tobytes())
        self.log_id.append(log_id)
        self.starts.append(self.starts[-1] + len(points))

    def line(self, number: int) -> NDArray[np.float64]:
        """Vertices of the path with this number in the file, shape (n, 3)."""
        start, stop = self.starts[number : number + 2]
        self.spool.seek(start * VERTEX_BYTES)
        return np.frombuffer(self.spool.read((stop - start) * VERTEX_BYTES)).reshape(-1, 3)


@contextmanager
def stream_poses(path: Path, work: WorkFolder, crs: pyproj.CRS) -> Iterator[KeptPaths]:
    """Copy the chunks' poses into one file, one row group each, and thin the paths of their logs at the same time."""
    with TemporaryFile(dir=work.path) as spool:
        paths = KeptPaths(spool)
        with parquet.ParquetWriter(path, pose_schema(crs), compression="zstd") as writer:
            for table in work.poses():
                if not table.num_rows:
                    continue
                writer.write_table(table, row_group_size=table.num_rows)
                log_id = table.column("log_id").to_numpy()
                points = np.stack([table.column(axis).to_numpy() for axis in "xyz"], axis=1)
                starts = np.flatnonzero(np.diff(log_id, prepend=log_id[0] - 1))
                for start, stop in zip(starts, [*starts[1:], log_id.size], strict=True):
                    paths.keep(int(log_id[start]), thinned(points[start:stop]))
        yield paths


def trajectories(paths: KeptPaths, layers: SceneLayers, releases: Releases, by_log: Mapping[str, NDArray]) -> Stream:
    """One row for each log that keeps its path, in the order of the releases."""
    sorter = np.argsort(releases.logs.log_id)
    row = sorter[np.searchsorted(releases.logs.log_id, paths.log_id, sorter=sorter)]
    order = np.argsort(row, kind="stable")
    duration, speed, reason = (by_log[name] for name in ("duration", "speed_max", "stop_reason"))

    def pieces() -> Iterator[geopandas.GeoDataFrame]:
        for start in range(0, order.size, PATHS_PIECE):
            chosen = order[start : start + PATHS_PIECE]
            rows = row[chosen]
            columns = {
                "log_id": releases.logs.log_id[rows],
                "release_id": releases.release_id[rows],
                "duration_s": duration[rows],
                "speed_max_ms": speed[rows],
                "stop_reason": np.array(STOP_REASONS, object)[reason[rows]],
            }
            lines = [paths.line(number) for number in chosen]
            owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
            shapes = shapely.linestrings(np.concatenate(lines), indices=owner)
            yield geopandas.GeoDataFrame(columns, geometry=shapes, crs=layers.dem.plan_crs)

    return Stream("LineString Z", pieces)


def thinned(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The first and last point, and the first one in each further metre of path; at least two points, shape (k, 3)."""
    if len(points) == 1:
        return np.repeat(points, 2, axis=0)
    path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    keep = np.diff(np.floor(path / VERTEX_SPACING_M), prepend=-1.0) > 0.0
    keep[-1] = True
    return points[keep]
