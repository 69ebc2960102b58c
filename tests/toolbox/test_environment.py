"""Environments that the command refuses with a message before anything starts."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from deadwood_algorithms.params.tool import UserError
from deadwood_toolbox.environment import CACHE_MB, keep_cache_small, refuse_no_threads, refuse_shared_cache


@pytest.mark.parametrize("given", ["0", "-2", " 0 "])
def test_no_thread_at_all_is_refused(given):
    """Before: an internal error, from the compiler's import."""
    with pytest.raises(UserError, match="NUMBA_NUM_THREADS is .*must be at least 1"):
        refuse_no_threads({"NUMBA_NUM_THREADS": given})


@pytest.mark.parametrize("given", ["1", "16", "", "x"])
def test_other_numbers_and_what_the_compiler_ignores_are_not(given):
    refuse_no_threads({"NUMBA_NUM_THREADS": given})
    refuse_no_threads({})


@pytest.mark.parametrize(("given", "megabytes"), [({}, CACHE_MB), ({"GDAL_CACHEMAX": "64"}, 64)])
def test_gdal_keeps_no_more_of_rasters_than_its_limit(given, megabytes, tmp_path):
    """By GDAL itself: 400 MB are read, and the process grows at most by the cache and 150 MB."""
    environ = {name: value for name, value in os.environ.items() if name != "GDAL_CACHEMAX"} | given
    keep_cache_small(environ)
    code = """
import sys
import numpy as np, psutil, rasterio
from rasterio.windows import Window
profile = dict(driver="GTiff", width=10240, height=10240, count=1, dtype="float32", tiled=True, sparse_ok=True)
rasterio.open(sys.argv[1], "w", **profile).close()
with rasterio.open(sys.argv[1]) as source:
    source.read(1, window=Window(0, 0, 256, 256))
    held = psutil.Process().memory_info
    before = held().rss  # not the peak, which a process takes over from the one that starts it
    for top in range(0, 10240, 256):
        source.read(1, window=Window(0, top, 10240, 256))
    print((held().rss - before) // 2**20)
"""
    command = [sys.executable, "-W", "ignore", "-c", code, str(tmp_path / "a.tif")]
    done = subprocess.run(command, env=environ, capture_output=True, text=True, timeout=120, check=True)
    assert megabytes - 64 < int(done.stdout) < megabytes + 150


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="modes of POSIX")
def test_a_cache_of_kernels_that_others_can_write_is_refused(tmp_path):
    refuse_shared_cache({"NUMBA_CACHE_DIR": str(tmp_path / "new")})
    (tmp_path / "kernels").mkdir(mode=0o700)
    tmp_path.chmod(0o700)
    refuse_shared_cache({"NUMBA_CACHE_DIR": str(tmp_path)})
    for shared in (tmp_path / "kernels", tmp_path):
        shared.chmod(0o777)
        with pytest.raises(UserError, match="NUMBA_CACHE_DIR"):
            refuse_shared_cache({"NUMBA_CACHE_DIR": str(tmp_path)})
        shared.chmod(0o700)
