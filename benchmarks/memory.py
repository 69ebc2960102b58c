"""Memory and disk of a run of slide-logs by the number of its logs, with and without trajectories.

python -m benchmarks.memory                          1000, 10 000 and 100 000 logs, then the page docs/memory.md
python -m benchmarks.memory --logs 1000000 --keep none    one more row; earlier rows are kept
python -m benchmarks.memory page                     the page and its figure from memory.json

Every run is a separate process, so that its peak is measured separately. Logs are short-lived (a small slope, friction
0.5, draft), because the question is what grows, not how long sliding takes.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
STORE, PAGE, FIGURE = HERE / "memory.json", HERE.parent / "docs" / "memory.md", "figures/memory.png"
EAST, NORTH, ROWS, COLUMNS, FOOT = 2_786_000.0, 1_196_000.0, 100, 60, 30
CRS = "EPSG:2056"
MARKS = re.compile(r"(<!-- measured: memory\b[^>]*-->\n).*?(<!-- end of measured: memory -->)", re.S)
MB, KB = 1e6, 1e3
FAR = 100_000  # number of logs from which growth is measured; below it, memory pools grow


def make_case(folder: Path, logs: int) -> dict[str, str]:
    """A slope of 35 degrees above flat ground, logs on it, and a line below them."""
    import geopandas
    import rasterio
    import shapely
    from rasterio.transform import from_origin

    up = np.maximum(np.arange(ROWS)[::-1, None] + 0.5 - FOOT, 0.0) * np.tan(np.radians(35.0))
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "crs": CRS, "height": ROWS, "width": COLUMNS}
    with rasterio.open(folder / "dem.tif", "w", transform=from_origin(EAST, NORTH + ROWS, 1.0, 1.0), **facts) as target:
        target.write(np.broadcast_to(1000.0 + up, (ROWS, COLUMNS)).astype("float32"), 1)
    rng = np.random.default_rng(4)
    x, y = EAST + 20.0 + 20.0 * rng.random(logs), NORTH + 70.0 + 10.0 * rng.random(logs)
    columns = {"log_id": np.arange(1, logs + 1), "release_id": np.arange(logs) % 10}
    columns |= {"dbh_cm": np.full(logs, 40.0), "length_m": np.full(logs, 10.0)}
    frame = geopandas.GeoDataFrame(columns, geometry=shapely.points(x, y), crs=CRS)
    frame.to_file(folder / "releases.gpkg", driver="GPKG")
    road = geopandas.GeoDataFrame(
        {"line_id": ["road"]},
        geometry=[shapely.LineString([(EAST + 0.5, NORTH + 25.0), (EAST + 59.5, NORTH + 25.0)])],
        crs=CRS,
    )
    road.to_file(folder / "lines.gpkg", driver="GPKG")
    return {name: str(folder / f"{name}.{'tif' if name == 'dem' else 'gpkg'}") for name in ("dem", "releases", "lines")}


def one(folder: Path, keep: str) -> dict[str, float]:
    """Slide in this process: its peak memory, CPU time, and the size of its files."""
    from deadwood_toolbox import cli

    inputs = {name: folder / f"{name}.{'tif' if name == 'dem' else 'gpkg'}" for name in ("dem", "releases", "lines")}
    flags = [f"--{name}={place}" for name, place in inputs.items()]
    flags += ["--friction=0.5", "--fidelity=draft", "--time-limit-s=60", f"--trajectories={keep}", "--threads=2"]
    if cli.run(["slide-logs", *flags, f"--output={folder / 'run'}", "--quiet"]) != 0:
        raise SystemExit(1)
    used = resource.getrusage(resource.RUSAGE_SELF)
    disk = sum(each.stat().st_size for each in (folder / "run").rglob("*") if each.is_file())
    return {"peak_bytes": used.ru_maxrss * 1024, "cpu_s": used.ru_utime + used.ru_stime, "disk_bytes": disk}


def measure(logs: int, keep: str) -> dict[str, Any]:
    """The same in a separate process, on files made for it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "benchmarks.memory"]
        subprocess.run([*command, "make", folder, str(logs)], check=True)
        done = subprocess.run([*command, "one", folder, keep], check=True, capture_output=True, text=True)
    return {"logs": logs, "keep": keep, **json.loads(done.stdout.splitlines()[-1])}


def growth(rows: list[dict[str, Any]], what: str) -> float:
    """Bytes per log, from the two largest runs."""
    (low, high) = sorted(rows, key=lambda row: row["logs"])[-2:]
    return (high[what] - low[what]) / (high["logs"] - low["logs"])


def page(store: dict[str, Any]) -> str:
    rows, where = store["rows"], store["provenance"]
    lines = [
        "| logs | trajectories kept | peak memory [MB] | above one log [MB] | CPU time [s] | on the disk [MB] |",
        "|---|---|---|---|---|---|",
    ]
    base = {row["keep"]: row["peak_bytes"] for row in rows if row["logs"] == 1}
    for row in sorted(rows, key=lambda row: (row["keep"] == "all", row["logs"])):
        above = (row["peak_bytes"] - base[row["keep"]]) / MB
        lines.append(
            f"| {row['logs']} | {row['keep']} | {row['peak_bytes'] / MB:.0f} | {above:.0f} | {row['cpu_s']:.1f} | "
            f"{row['disk_bytes'] / MB:.1f} |"
        )
    notes = []
    for keep, words in (("none", "Without trajectories"), ("all", "With the trajectories of all")):
        own = [row for row in rows if row["keep"] == keep]
        if max((row["logs"] for row in own), default=0) >= FAR:
            most = max(row["logs"] for row in own)
            each = growth(own, "peak_bytes")
            at = max(own, key=lambda row: row["logs"])
            line = (
                f"{words}, memory grows by {each / KB:.2f} KB per log between the two largest runs, the result by "
                f"{growth(own, 'disk_bytes') / KB:.1f} KB"
            )
            if most < 1_000_000:
                far = (at["peak_bytes"] + each * (1_000_000 - most)) / MB
                line += f"; extrapolated, not measured, a million logs would take {far:.0f} MB"
            notes.append(line + ".")
    notes.append(f"{where['machine']}; {where['versions']}; engine {where['engine']}; {where['date']}.")
    return "\n" + "\n".join(lines) + "\n\n" + "\n".join(notes) + "\n\n"


def write_page(store: dict[str, Any]) -> None:
    from . import engines

    text = PAGE.read_text(encoding="utf-8")
    text = MARKS.sub(lambda found: found[1] + page(store) + found[2], text)
    engines.write(PAGE, text)
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
    for keep, colour in (("none", "#0072B2"), ("all", "#D55E00")):
        own = sorted((row["logs"], row["peak_bytes"] / MB) for row in store["rows"] if row["keep"] == keep)
        axes.plot(*zip(*own, strict=True), "o-", color=colour, label=f"trajectories: {keep}")
    axes.set(xscale="log", xlabel="logs", ylabel="peak memory [MB]")
    axes.set_ylim(bottom=0.0)
    axes.legend()
    figure.savefig(PAGE.parent / FIGURE, dpi=120)
    plt.close(figure)


def main() -> None:
    if sys.argv[1:2] == ["make"]:
        make_case(Path(sys.argv[2]), int(sys.argv[3]))
        return
    if sys.argv[1:2] == ["one"]:
        print(json.dumps(one(Path(sys.argv[2]), sys.argv[3])))
        return
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.memory", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("job", nargs="?", default="measure", choices=("measure", "page"))
    parser.add_argument("--logs", nargs="+", type=int, default=[1, 1000, 10_000, 100_000])
    parser.add_argument("--keep", nargs="+", default=["none", "all"], choices=("none", "all"))
    ask = parser.parse_args()
    store = json.loads(STORE.read_text()) if STORE.is_file() else {"rows": []}
    if ask.job == "measure":
        from . import study

        for logs in ask.logs:
            for keep in ask.keep:
                row = measure(logs, keep)
                print(row, flush=True)
                others = [each for each in store["rows"] if (each["logs"], each["keep"]) != (logs, keep)]
                store = {"provenance": study.provenance(), "rows": [*others, row]}
                STORE.write_text(json.dumps(store, indent=1) + "\n", encoding="utf-8")
    write_page(store)


if __name__ == "__main__":
    main()
