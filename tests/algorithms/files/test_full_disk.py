"""Messages of C libraries about a full disk are suppressed: the failure is an exception, reported in one line."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from deadwood_algorithms.files.geotiff import libtiff_silent

# A limit on the size of files makes the library fail like a full disk.
WRITES = """
import resource, sys
import numpy, pyproj
from rasterio.windows import Window
from deadwood_algorithms.files.dem_windows import WindowWriter
from deadwood_algorithms.files.geotiff import geotiff_profile
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.params.tool import Quiet
from pathlib import Path

resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
side, how, path = int(sys.argv[1]), sys.argv[2], sys.argv[3]
values = numpy.random.default_rng(0).random((side, side)).astype("float32")
grid = Grid(values, 1.0, 2_600_000.0, 1_200_000.0, pyproj.CRS.from_epsg(2056))
try:
    if how == "whole":
        write_raster(path, values, grid, dtype="float32")
    else:
        profile = geotiff_profile(values.shape, grid.crs, grid.transform, "float32", None)
        with WindowWriter(Path(path), Quiet(), **profile) as writer:
            writer.write(values[None], Window(0, 0, side, side))
except Exception as error:
    print("failed:", error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a limit of a file's size, which Windows does not have")
@pytest.mark.parametrize("how", ["whole", "windows"])
@pytest.mark.parametrize("side", [256, 700])
def test_libtiff_reports_nothing_of_a_full_disk(tmp_path, how, side):
    asked = [sys.executable, "-c", WRITES, str(side), how, str(tmp_path / "x.tif")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    told = subprocess.run(asked, capture_output=True, text=True, env=environment, check=True)
    assert told.stdout.startswith("failed:")
    assert told.stderr == ""


def test_stderr_is_back_afterwards(capfd):
    with libtiff_silent():
        os.write(2, b"of a library\n")
    os.write(2, b"of ours\n")
    assert capfd.readouterr().err == "of ours\n"
    with pytest.raises(ValueError, match="a failure"), libtiff_silent():
        raise ValueError("a failure")
    os.write(2, b"again\n")
    assert capfd.readouterr().err == "again\n"
