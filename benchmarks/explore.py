"""Response times of `explore`: from a click to the first picture, to 300 logs, and to the effect of a felled tree.

python -m benchmarks.explore             both scenes, then the table of docs/reference/explore.md
python -m benchmarks.explore page        the table from explore.json

A program sends requests like the page: over the socket of a server started as by a user. The time is measured from the
request to the received frame, without its drawing in the browser. It is reported with the processor time of
the engine's process, because wall time depends on other work on the machine.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
STORE, PAGE = HERE / "explore.json", HERE.parent / "docs" / "reference" / "explore.md"
MARKS = re.compile(r"(<!-- measured: explore\b[^>]*-->\n).*?(<!-- end of measured: explore -->)", re.S)
CRS = "EPSG:2056"
CLICKS, LOGS = 9, 300
CELLS, TREES, CELL = 4000, 100_000, 0.5  # of the large scene
# Kinds of answers, by what is reported about them
WHAT = {
    "click": "a click nearby",
    "elsewhere": "a click elsewhere",
    "fell": "a tree felled that holds most logs",
}
MB = 1e6


def demo_slope(folder: Path) -> dict[str, str]:
    from deadwood_algorithms.prepare.demo_slope.demo_layers import write_sample

    write_sample(folder)
    named = {"dem": "dem.tif", "trees": "trees_mapped.gpkg", "lines": "road.gpkg"}
    return {name: str(folder / file) for name, file in named.items()}


def large_slope(folder: Path) -> dict[str, str]:
    """33 degrees over two kilometres, rough, with a forest of 250 stems a hectare and a road."""
    import geopandas
    import rasterio
    import shapely
    from rasterio.transform import from_origin

    rng = np.random.default_rng(1)
    y, x = (CELL * np.arange(CELLS)[::-1, None], CELL * np.arange(CELLS)[None, :])
    heights = 500.0 + 0.65 * y + 8.0 * np.sin(x / 60.0) * np.cos(y / 90.0) + 0.15 * rng.standard_normal((CELLS, CELLS))
    east, north, side = 2_600_000.0, 1_200_000.0, CELL * CELLS
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "crs": CRS, "height": CELLS, "width": CELLS}
    with rasterio.open(folder / "dem.tif", "w", transform=from_origin(east, north + side, CELL, CELL), **facts) as made:
        made.write(heights.astype("float32"), 1)
    places = shapely.points(east + rng.uniform(1.0, side - 2.0, TREES), north + rng.uniform(1.0, side - 2.0, TREES))
    sizes = {"dbh_cm": rng.uniform(15.0, 70.0, TREES), "height_m": rng.uniform(8.0, 32.0, TREES)}
    geopandas.GeoDataFrame(sizes, geometry=places, crs=CRS).to_file(folder / "trees.gpkg", driver="GPKG")
    road = shapely.LineString([(east + 0.5, north + 300.0), (east + side - 1.0, north + 300.0)])
    geopandas.GeoDataFrame({"line_id": ["road"]}, geometry=[road], crs=CRS).to_file(
        folder / "lines.gpkg", driver="GPKG"
    )
    return {name: str(folder / f"{name}.{'tif' if name == 'dem' else 'gpkg'}") for name in ("dem", "trees", "lines")}


SCENES = {"the demo's slope": demo_slope, f"{CELLS} x {CELLS} cells, {TREES} trees": large_slope}


class Asker:
    """Acts as the page, without a browser."""

    def __init__(self, address: str, server: int) -> None:
        import psutil
        import websocket

        base, token = address.split("/?token=")
        port = base.rsplit(":", 1)[1]
        where = base.replace("http", "ws") + "/socket"
        self.socket = websocket.create_connection(where, cookie=f"deadwood_{port}={token}", origin=base, timeout=600)
        self.server = psutil.Process(server)
        (self.engine,) = self.server.children()

    def ask(self, **message: Any) -> tuple[dict[str, Any], dict[str, float]]:
        """The facts of the last frame; ms to the first and the last one, and of the engine's processor time."""
        from deadwood_algorithms.explore.frames import Frame

        before, began, first = sum(self.engine.cpu_times()[:2]), time.perf_counter(), 0.0
        self.socket.send(json.dumps(message))
        while True:
            block = self.socket.recv()
            assert isinstance(block, bytes)
            facts = Frame.unpacked(block).facts
            now = 1e3 * (time.perf_counter() - began)
            first = first or now
            if facts["op"] == "refused":
                raise RuntimeError(facts["text"])
            if facts.get("final", True):
                cpu = 1e3 * (sum(self.engine.cpu_times()[:2]) - before)
                return dict(facts), {"first_ms": first, "all_ms": now, "cpu_ms": cpu}


@contextlib.contextmanager
def opened(layers: dict[str, str]) -> Iterator[tuple[Asker, float]]:
    """A server on these layers, and the time [s] until it was ready."""
    command = [sys.executable, "-m", "deadwood_toolbox", "explore", "--no-browser", "--quiet"]
    flags = [part for name, place in layers.items() for part in (f"--{name}", place)]
    paths = os.pathsep.join(each for each in sys.path if each)
    began = time.perf_counter()
    with subprocess.Popen(
        [*command, *flags], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": paths}
    ) as server:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        try:
            yield Asker(address, server.pid), time.perf_counter() - began
        finally:
            server.terminate()


def measure(layers: dict[str, str]) -> dict[str, Any]:
    """Medians of several answers of each kind."""
    rng = np.random.default_rng(2)
    logs = {"dbh_cm": [30, 80], "length_m": [15, 35], "orientation": "random-lying"}
    found: dict[str, list[dict[str, float]]] = {kind: [] for kind in WHAT}
    with opened(layers) as (asker, start_s):
        scene, _ = asker.ask(op="open")
        width, height = scene["extent"][2:]

        def click(x: float, y: float) -> tuple[dict[str, Any], dict[str, float]]:
            return asker.ask(op="release", shape={"circle": [x, y, 10.0]}, n=LOGS, logs=logs)

        x, y = 0.5 * width, 0.8 * height
        for _ in range(2):  # the first answer includes imports
            click(x, y)
        for _ in range(CLICKS):
            answer, times = click(x + rng.uniform(-10.0, 10.0), y + rng.uniform(-10.0, 10.0))
            found["click"].append(times)
            holder = answer["holders"][0]["tree"]
            found["fell"].append(asker.ask(op="edit", fell=[holder])[1])
            asker.ask(op="edit")
        for k in range(CLICKS):  # a large terrain model's window is prepared again
            away = 0.25 * width * (1.0 if k % 2 else -1.0)
            found["elsewhere"].append(click(x + away + rng.uniform(-10.0, 10.0), y)[1])
        memory = {who: getattr(asker, who).memory_info().rss for who in ("engine", "server")}
    return {
        "start_s": start_s,
        "memory_bytes": memory,
        "cells": [scene["columns"], scene["rows"]],
        **{
            kind: {name: statistics.median(each[name] for each in times) for name in times[0]}
            for kind, times in found.items()
        },
    }


def table(store: dict[str, Any]) -> str:
    """The figures, and the machine on which they were measured."""
    where = store["provenance"]
    lines = [
        f"| scene | what is asked | first picture [ms] | {LOGS} logs [ms] | processor time [ms] |",
        "|---|---|---|---|---|",
    ]
    for name, each in store["scenes"].items():
        for kind, words in WHAT.items():
            ms = (f"{each[kind][what]:.0f}" for what in ("first_ms", "all_ms", "cpu_ms"))
            lines.append(f"| {name} | {words} | {' | '.join(ms)} |")
    notes = [
        f"Medians of {CLICKS}; {LOGS} logs at `draft`, the first picture of 30. Where a tree is felled, the first "
        "picture is the difference on the first 30."
    ]
    for name, each in store["scenes"].items():
        memory = each["memory_bytes"]
        notes.append(
            f"On {name} the page is there after {each['start_s']:.1f} s; the engine's process holds "
            f"{memory['engine'] / MB:.0f} MB, the server's {memory['server'] / MB:.0f} MB."
        )
    if load := store.get("load"):
        notes.append(f"The machine's load before it began was {load:.1f}.")
    notes.append(f"{where['machine']}; {where['versions']}; engine {where['engine']}; {where['date']}.")
    return "\n" + "\n".join(lines) + "\n\n" + "\n".join(notes) + "\n\n"


def write_page(store: dict[str, Any]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARKS.sub(lambda found: found[1] + table(store) + found[2], text), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.explore", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("job", nargs="?", default="measure", choices=("measure", "page"))
    ask = parser.parse_args()
    if ask.job == "measure":
        from . import study

        load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
        scenes = {}
        for name, make in SCENES.items():
            with tempfile.TemporaryDirectory() as folder:
                scenes[name] = measure(make(Path(folder)))
            print(name, json.dumps(scenes[name]), flush=True)
        store = {"provenance": study.provenance(), "load": load, "scenes": scenes}
        STORE.write_text(json.dumps(store, indent=1) + "\n", encoding="utf-8")
    write_page(json.loads(STORE.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
