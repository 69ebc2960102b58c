"""A command that slides one log takes little longer than the import of its libraries; help takes next to nothing.

CPU time, which other work on the machine hardly changes, as a ratio to a yardstick of the same machine; the better of
two.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import pytest
import shapely

SAMPLE = Path(__file__).parents[2] / "sample_data"
LIBRARIES = "import geopandas, numba, pyarrow.parquet, rasterio, scipy.linalg"


def cpu_seconds(arguments: list[str]) -> float:
    """Of a process, itself and in the kernel; the better of two, because the first may fill caches."""
    if not hasattr(os, "wait4"):
        pytest.skip("no CPU time of single processes here")
    found = []
    for _ in range(2):
        process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        assert status == 0
        found.append(used.ru_utime + used.ru_stime)
    return min(found)


@pytest.fixture(scope="module")
def libraries() -> float:
    return cpu_seconds(["-c", LIBRARIES])


def test_one_log_takes_little_more_than_its_libraries(tmp_path, libraries):
    """Measured 2.1 times (our own files not compiled beforehand); 2.6 before garbage collection was postponed."""
    layer = gpd.read_file(SAMPLE / "sample.gpkg", layer="release_area")
    place = shapely.centroid(layer.geometry.iloc[0])
    gpd.GeoDataFrame({"log_id": [1]}, geometry=[place], crs=layer.crs).to_file(tmp_path / "one.gpkg", driver="GPKG")
    inputs = [f"--dem={SAMPLE / 'dem.tif'}", f"--releases={tmp_path / 'one.gpkg'}", "--friction=0.9"]
    flags = ["--fidelity=draft", f"--output={tmp_path / 'run'}", "--overwrite", "--quiet"]
    assert cpu_seconds(["-m", "deadwood_toolbox", "slide-logs", *inputs, *flags]) < 3.0 * libraries


def test_help_loads_no_library(libraries):
    assert cpu_seconds(["-m", "deadwood_toolbox", "slide-logs", "--help"]) < 0.5 * libraries


def test_what_draws_nothing_loads_nothing_to_draw_with(tmp_path):
    """Matplotlib is half a second; of these tools only the page and the project of slide-logs need it."""
    commands = (
        f"sample-releases --areas {SAMPLE / 'sample.gpkg'}|layername=release_area --dem {SAMPLE / 'dem.tif'} --count 2"
        " --output releases.gpkg",
        f"import-trees --trees {SAMPLE / 'trees.csv'} --dem {SAMPLE / 'dem.tif'} --output trees.gpkg",
        f"slide-logs --dem {SAMPLE / 'dem.tif'} --releases releases.gpkg --friction 0.9 --fidelity draft"
        f" --lines {SAMPLE / 'sample.gpkg'}|layername=lines --output run",
        "count-hits --run run --output hits.tif",
        f"reach-lines --run run --lines {SAMPLE / 'sample.gpkg'}|layername=lines --output reach.gpkg",
        "check run",
    )
    program = (
        "import sys; from deadwood_toolbox import cli\n"
        f"for each in {[each.split() for each in commands]!r}: assert cli.run([*each, '--quiet']) == 0, each\n"
        "print(*sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert {"matplotlib", "PIL", "tornado", "distributed"} & set(ran.stdout.split()) == set()
