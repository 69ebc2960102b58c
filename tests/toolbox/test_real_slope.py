"""docs/real-slope.md, word by word, where the terrain that it names is present."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

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
