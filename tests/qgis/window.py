"""QGIS with its window on an invisible screen (Xvfb), for the test of a first run and for the page's pictures.

``python tests/qgis/window.py`` renews the pictures of the plugin's page, from a real first run.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PICTURES = ROOT / "deadwood_toolbox" / "qgis_plugin" / "pictures"
QGIS = shutil.which("qgis.bin") or shutil.which("qgis")
LIMIT_S = 900
LARGEST_BYTES = 150_000


@contextlib.contextmanager
def screen() -> Iterator[str]:
    """A separate screen; yields the value of DISPLAY."""
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1400x900x24", "-nolisten", "tcp"]
    server = subprocess.Popen(words, pass_fds=(write,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    manager = None
    try:
        with os.fdopen(read) as told:
            display = f":{told.readline().strip()}"
        if shutil.which("openbox"):  # without one, windows have no frame and dialogs no position
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            manager = subprocess.Popen(["openbox"], env={**os.environ, "DISPLAY": display}, **quiet)  # type: ignore[call-overload]
        yield display
    finally:
        for each in (manager, server):
            if each is not None:
                each.terminate()
                each.wait(20)


def first_run(environment: dict[str, str], sample: Path, work: Path, shots: Path, *, full: bool) -> dict[str, Any]:
    """Drive QGIS through a first run; what was seen, the pictures in ``shots``."""
    own = {"SAMPLE": str(sample), "WORK": str(work), "SHOTS": str(shots)} | ({"FULL": "1"} if full else {})
    return driven("first_run.py", environment | own, work)


def explored(environment: dict[str, str], sample: Path, work: Path, shots: Path | None = None) -> dict[str, Any]:
    """Drive QGIS through the panel Explore, on the sample with its trees as a layer."""
    import geopandas
    import pandas

    trees = pandas.read_csv(sample / "trees.csv")
    places = geopandas.points_from_xy(trees["x"], trees["y"])
    geopandas.GeoDataFrame(trees, geometry=places, crs=2056).to_file(work / "trees.gpkg", layer="trees")
    own = {"SAMPLE": str(sample), "WORK": str(work), "SHOTS": str(shots or "")}
    return driven("explore_drive.py", environment | own, work)


def driven(script: str, environment: dict[str, str], work: Path) -> dict[str, Any]:
    """The observations of a script that QGIS runs with its window."""
    assert QGIS is not None
    with screen() as display:
        environment = {name: value for name, value in environment.items() if name != "QT_QPA_PLATFORM"}
        environment |= {"GDAL_PAM_ENABLED": "NO", "DISPLAY": display}
        words = [QGIS, "--nologo", "--noversioncheck", "--code", str(HERE / script)]
        ran = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=LIMIT_S)
    told = work / "seen.json"
    assert told.exists(), ran.stderr[-3000:]
    return json.loads(told.read_text(encoding="utf-8"))


def small(source: Path, target: Path) -> None:
    """A picture that fits into the limit: fewer colours first, among them the rare ones, then fewer pixels."""
    from PIL import Image

    with Image.open(source) as taken:
        whole = taken.convert("RGB")
    for width in (1000, 900, 800, 700, 600):
        picture = whole
        if picture.width > width:
            size = (width, round(whole.height * width / whole.width))
            picture = whole.resize(size, Image.Resampling.LANCZOS)
        for colours in (128, 64):
            method = Image.Quantize.MAXCOVERAGE
            picture.quantize(colours, method=method, kmeans=10, dither=Image.Dither.NONE).save(target, optimize=True)
            if target.stat().st_size < LARGEST_BYTES:
                return
    raise SystemExit(f"{source} cannot be made small enough")


def main() -> None:
    sys.path.insert(0, str(HERE))
    sys.path[:0] = [str(ROOT / each) for each in ("", "engine", "algorithms")]
    from conftest import SAMPLE, Qgis, command_of_checkout

    # Not in /tmp, whose layers QGIS marks as temporary.
    with tempfile.TemporaryDirectory(dir="/var/tmp", prefix="deadwood-") as place:
        folder = Path(place)
        for name in ("work", "shots", "explored"):
            (folder / name).mkdir()
        qgis = Qgis(folder, command_of_checkout(folder))
        qgis.install()
        seen = first_run(qgis.environment, SAMPLE, folder / "work", folder / "shots", full=True)
        assert "error" not in seen, seen["error"]
        seen = explored(qgis.environment, SAMPLE, folder / "explored", folder / "explored")
        assert "error" not in seen, seen["error"]
        PICTURES.mkdir(exist_ok=True)
        page = (PICTURES.parent / "README.md").read_text(encoding="utf-8")
        shots = [*sorted((folder / "shots").glob("*.png")), folder / "explored" / "explore.png"]
        for shot in (each for each in shots if f"(pictures/{each.name})" in page):
            small(shot, PICTURES / shot.name)
            print(f"wrote {PICTURES / shot.name}")


if __name__ == "__main__":
    main()
