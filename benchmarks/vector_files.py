"""Which library writes and reads vector layers: pyogrio, which the toolbox uses, compared with fiona.

python -m benchmarks.vector_files    measures alternately and writes vector_files.md (needs fiona, which is not a
dependency)

Each job runs in a separate process, so that its peak memory is measured separately. Deposits are points with 24
columns, as `slide-logs` writes them; trajectories are lines of 300 points with heights.
"""

from __future__ import annotations

import json
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

PAGE = Path(__file__).with_suffix(".md")
MARKS = re.compile(r"(<!-- measured: vector files\b[^>]*-->\n).*?(<!-- end of measured: vector files -->)", re.S)
DEPOSITS, TRAJECTORIES, VERTICES, PIECES, ROUNDS = 50_000, 1_000, 300, 50, 5
CRS = "EPSG:2056"
NUMBERS = [f"number_{k}" for k in range(20)]


def deposits() -> Any:
    import geopandas

    rng = np.random.default_rng(1)
    columns: dict[str, Any] = {"log_id": np.arange(1, DEPOSITS + 1), "reached": rng.random(DEPOSITS) < 0.3}
    columns |= {"stop_reason": rng.choice(["rest", "tree"], DEPOSITS), "release": rng.choice(["a", "b"], DEPOSITS)}
    columns |= {name: rng.random(DEPOSITS) for name in NUMBERS}
    x, y = 2.6e6 + 1000.0 * rng.random((2, DEPOSITS))
    return geopandas.GeoDataFrame(columns, geometry=geopandas.points_from_xy(x, y), crs=CRS)


def trajectories() -> Any:
    import geopandas
    import shapely

    rng = np.random.default_rng(2)
    ways = 2.6e6 + np.cumsum(rng.random((TRAJECTORIES, VERTICES, 3)), axis=1)
    return geopandas.GeoDataFrame(
        {"log_id": np.arange(1, TRAJECTORIES + 1)}, geometry=shapely.linestrings(ways), crs=CRS
    )


def records(frame: Any) -> Any:
    """The rows in fiona's form, one at a time."""
    import shapely

    names = [name for name in frame.columns if name != "geometry"]
    columns = [frame[name].tolist() for name in names]
    for shape, *values in zip(frame.geometry, *columns, strict=True):
        yield {"geometry": shapely.geometry.mapping(shape), "properties": dict(zip(names, values, strict=True))}


def schema(frame: Any, kind: str) -> dict[str, Any]:
    of = {"i": "int", "b": "bool", "f": "float", "O": "str", "U": "str"}
    return {"geometry": kind, "properties": {n: of[frame[n].dtype.kind] for n in frame.columns if n != "geometry"}}


def whole_pyogrio(frame: Any, path: Path) -> None:
    frame.to_file(path, engine="pyogrio", layer="layer")


def whole_fiona(frame: Any, path: Path) -> None:
    import fiona  # pyright: ignore[reportMissingImports]

    kind = "Point" if "reached" in frame else "3D LineString"
    with fiona.open(path, "w", driver="GPKG", layer="layer", crs=CRS, schema=schema(frame, kind)) as sink:
        sink.writerecords(records(frame))


def pieces_pyogrio(frame: Any, path: Path) -> None:
    for rows in np.array_split(np.arange(len(frame)), PIECES):
        frame.iloc[rows].to_file(path, engine="pyogrio", layer="layer", mode="a" if path.exists() else "w")


def pieces_fiona(frame: Any, path: Path) -> None:
    import fiona  # pyright: ignore[reportMissingImports]

    with fiona.open(path, "w", driver="GPKG", layer="layer", crs=CRS, schema=schema(frame, "Point")) as sink:
        for rows in np.array_split(np.arange(len(frame)), PIECES):
            sink.writerecords(records(frame.iloc[rows]))


def stream_pyogrio(_: Any, path: Path) -> int:
    import pyogrio

    with pyogrio.open_arrow(path, layer="layer", use_pyarrow=True, batch_size=2000) as (_facts, reader):
        return sum(batch.num_rows for batch in reader)


def stream_fiona(_: Any, path: Path) -> int:
    import fiona  # pyright: ignore[reportMissingImports]

    with fiona.open(path, layer="layer") as source:
        return sum(1 for _ in source)


def read_pyogrio(_: Any, path: Path) -> int:
    import geopandas

    return len(geopandas.read_file(path, engine="pyogrio"))


def read_fiona(_: Any, path: Path) -> int:
    import geopandas

    return len(geopandas.read_file(path, engine="fiona"))


# name: what it does, the layer, whether it reads, with pyogrio, with fiona
JOBS: dict[str, tuple[str, Callable[[], Any], bool, Callable[..., Any], Callable[..., Any]]] = {
    "whole": (f"{DEPOSITS} deposits written at once", deposits, False, whole_pyogrio, whole_fiona),
    "lines": (f"{TRAJECTORIES} trajectories of {VERTICES} points", trajectories, False, whole_pyogrio, whole_fiona),
    "pieces": (f"the deposits appended in {PIECES} pieces", deposits, False, pieces_pyogrio, pieces_fiona),
    "read": ("the deposits read", deposits, True, read_pyogrio, read_fiona),
    "stream": ("the deposits read in a stream", deposits, True, stream_pyogrio, stream_fiona),
}


def one(job: str, library: str) -> dict[str, float]:
    """Seconds and the growth of peak memory [MB] of one job in this process, without imports and the creation of the
    layer.
    """
    _, make, reads, *ways = JOBS[job]
    __import__(library)
    frame = make()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "layer.gpkg"
        if reads:
            whole_pyogrio(frame, path)
        before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
        ways[("pyogrio", "fiona").index(library)](frame, path)
        seconds = time.perf_counter() - start
    return {"seconds": seconds, "memory_mb": (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024}


def measured() -> str:
    """The table: each job alternately with both libraries, medians of the rounds."""
    lines = [
        "| job | pyogrio [s] | fiona [s] | fiona / pyogrio | more memory, pyogrio and fiona [MB] |",
        "| --- | --- | --- | --- | --- |",
    ]
    for job, (title, *_) in JOBS.items():
        found: dict[str, list[dict[str, float]]] = {"pyogrio": [], "fiona": []}
        for _ in range(ROUNDS):
            for library, rows in found.items():
                command = [sys.executable, "-m", "benchmarks.vector_files", job, library]
                rows.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
        seconds = {name: statistics.median(row["seconds"] for row in rows) for name, rows in found.items()}
        memory = [statistics.median(row["memory_mb"] for row in rows) for rows in found.values()]
        ratio = statistics.median(
            f["seconds"] / p["seconds"] for p, f in zip(found["pyogrio"], found["fiona"], strict=True)
        )
        lines.append(
            f"| {title} | {seconds['pyogrio']:.2g} | {seconds['fiona']:.2g} | {ratio:.1f} | "
            f"{memory[0]:.0f} and {memory[1]:.0f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    import fiona  # pyright: ignore[reportMissingImports]
    import pyogrio

    from . import study

    versions = f"pyogrio {pyogrio.__version__}, fiona {fiona.__version__}"
    text = f"{versions}, GeoPackage, medians of {ROUNDS} runs in turn; {study.provenance()['machine']}."
    table = f"\n{measured()}\n{text}\n\n"
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARKS.sub(lambda found: found[1] + table + found[2], page), encoding="utf-8")
    print(table)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        print(json.dumps(one(sys.argv[1], sys.argv[2])))
    else:
        main()
