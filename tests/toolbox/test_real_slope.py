"""The commands of docs/real-slope.md, if the terrain that it names is present."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import rasterio
from rasterio.transform import from_origin

ROOT = Path(__file__).parents[2]
TERRAIN = ROOT.parent / "shared" / "data" / "tyrol_5m" / "terrain.asc"


@pytest.mark.slow
@pytest.mark.skipif(not TERRAIN.is_file(), reason="the terrain of docs/real-slope.md is not part of the repository")
def test_the_page_runs_from_the_terrain_to_the_report(tmp_path: Path, checkout: dict[str, str]):
    page = (ROOT / "docs" / "real-slope.md").read_text(encoding="utf-8")
    script = "set -eu\n" + "".join(re.findall(r"```sh\n(.*?)```", page, flags=re.DOTALL))
    (tmp_path / "terrain.asc").symlink_to(TERRAIN)
    path = os.pathsep.join((str(Path(sys.executable).parent), checkout.get("PATH", os.environ["PATH"])))
    ran = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env={**checkout, "PATH": path}, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr[-3000:]
    assert "cells of 4.99768 m do not resolve the relief that holds logs" in ran.stderr
    rows = pd.read_csv(tmp_path / "comparison" / "table.csv").set_index(["quantity", "of", "scenario"])
    assert rows.loc[("reach", "road", "with_forest"), "difference_to"] < -20.0  # the forest holds most of them
    html = (tmp_path / "slope.html").read_text(encoding="utf-8")
    assert "A slope in Tyrol" in html
    assert len(html) < 6e6


def test_the_tiles_of_switzerland_are_requested_and_joined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """An answer of the catalogue in its public format: two years of a tile, its neighbour, other cells, formats."""
    asked: list[str] = []
    names = {"swissalti3d_2019_2785-1195": 1.0, "swissalti3d_2024_2785-1195": 2.0, "swissalti3d_2019_2786-1195": 3.0}
    base = "https://data.geo.admin.ch/ch.swisstopo.swissalti3d"
    ends = ("_2_2056_5728.tif", "_0.5_2056_5728.tif", "_0.5_2056_5728.xyz.zip")
    items = [
        {"id": name, "assets": {f"{name}{end}": {"href": f"{base}/{name}/{name}{end}"} for end in ends}}
        for name in names
    ]

    def answer(address: str) -> io.BytesIO:
        asked.append(address)
        return io.BytesIO(json.dumps({"features": items}).encode())

    def download(address: str, path: str) -> tuple[str, None]:
        asked.append(address)
        name = address.split("/")[-2]
        east, north = (1000 * int(part) for part in name.split("_")[-1].split("-"))
        profile = {
            "driver": "GTiff", "width": 20, "height": 20, "count": 1, "dtype": "float32", "crs": "EPSG:2056",
            "transform": from_origin(east, north + 1000, 50.0, 50.0),
        }  # fmt: skip
        with rasterio.open(path, "w", **profile) as tile:
            tile.write(np.full((20, 20), names[name], np.float32), 1)
        return path, None

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("urllib.request.urlopen", answer)
    monkeypatch.setattr("urllib.request.urlretrieve", download)
    page = (ROOT / "docs" / "real-slope.md").read_text(encoding="utf-8")
    [code] = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    exec(compile(code, "docs/real-slope.md", "exec"), {})
    assert asked[0].startswith("https://data.geo.admin.ch/api/stac/v1/collections/ch.swisstopo.swissalti3d/items?bbox=")
    with rasterio.open(tmp_path / "tiles.tif") as joined:
        assert joined.bounds == (2785000.0, 1195000.0, 2787000.0, 1196000.0)
        assert np.unique(joined.read(1)[:, :20]).tolist() == [2.0]  # the newer year
        assert np.unique(joined.read(1)[:, 20:]).tolist() == [3.0]
