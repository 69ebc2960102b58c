"""Conditions that the command corrects or rejects before it starts: foreign paths, and too little address space.

With the PROJ_LIB of a QGIS or conda shell rasterio silently loses every CRS (it logs one line and continues
with ``crs = None``), so this runs before any GIS library is imported.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Mapping, MutableMapping
from contextlib import contextmanager

from deadwood_algorithms.files.network import ALLOWED
from deadwood_algorithms.params.tool import UserError

FOREIGN = ("PROJ_LIB", "PROJ_DATA", "GDAL_DATA", "GDAL_DRIVER_PATH")
# Measured: below 2.2 GB the libraries' threads get no stacks, and the compiler aborts or hangs.
LEAST_ADDRESS_SPACE = int(2.5 * 2**30)
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
CACHE_MB = 256  # a row of tiles of 512 cells across 40 000 columns is 82 MB
KEEP = "DEADWOOD_KEEP_GDAL_ENV"  # set to anything but 0 by users who direct these variables to their own files


def drop_foreign_paths(environ: MutableMapping[str, str]) -> dict[str, str]:
    """Remove the variables and return their values; nothing is removed if ``KEEP`` is set."""
    if environ.get(KEEP, "0") not in ("", "0"):
        return {}
    return {name: environ.pop(name) for name in FOREIGN if name in environ}


def stay_offline(environ: MutableMapping[str, str]) -> None:
    """Forbid GDAL the network, unless the user has allowed it, for what `files.network` cannot detect in a file.

    An extension that no file has prevents /vsicurl/ and similar from opening anything; a proxy that does not exist
    stops the drivers that download by themselves.
    """
    if environ.get(ALLOWED, "0") in ("", "0"):
        environ["CPL_VSIL_CURL_ALLOWED_EXTENSIONS"] = "{none}"
        environ["GDAL_HTTP_PROXY"] = "http://127.0.0.1:1"


def keep_cache_small(environ: MutableMapping[str, str]) -> None:
    """Limit GDAL's raster cache, unless the user has: by default it takes a twentieth of the machine's memory.

    1.2 GB of 23 GB, with which a DEM that is read by blocks occupied 1.6 GB or more. The tools read and write
    in the order of the file's blocks, and need one row of these.
    """
    environ.setdefault("GDAL_CACHEMAX", str(CACHE_MB))


def refuse_no_threads(environ: Mapping[str, str]) -> None:
    """Reject a number of threads with which the compiler cannot start; it ignores what is not a number."""
    given = environ.get("NUMBA_NUM_THREADS", "").strip()
    if given.lstrip("+-").isdecimal() and int(given) < 1:
        raise UserError(
            f"the environment variable NUMBA_NUM_THREADS is {given}, but must be at least 1; unset it, and limit the "
            "threads with --threads"
        )


def refuse_shared_cache(environ: Mapping[str, str]) -> None:
    """Reject a folder of compiled kernels, which are executed, to which others can write."""
    named = environ.get("NUMBA_CACHE_DIR", "").strip()
    if not named or not hasattr(os, "getuid") or not os.path.isdir(named):
        return
    places = [named, *(each.path for each in os.scandir(named))]
    for each in places:
        state = os.stat(each, follow_symlinks=False)
        shared = state.st_mode & OTHERS_WRITE and not stat.S_ISLNK(state.st_mode)
        if shared or state.st_uid != os.getuid():
            raise UserError(
                f"the environment variable NUMBA_CACHE_DIR names {named}, where other users can write ({each}), and "
                f"what lies there is executed; unset it, or name a folder of your own (chmod 700)"
            )


@contextmanager
def as_the_command(environ: MutableMapping[str, str]) -> Iterator[None]:
    """The environment of the command within another program, whose own environment is restored at the end."""
    before = dict(environ)
    drop_foreign_paths(environ)
    stay_offline(environ)
    try:
        yield
    finally:
        for name in {*before, *environ}:
            if name in before and environ.get(name) != before[name]:
                environ[name] = before[name]
            elif name not in before:
                del environ[name]


def refuse_small_address_space() -> None:
    """Refuse to work under a limit (``ulimit -v``) with which the libraries would abort, or hang, without a message."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_ADDRESS_SPACE:
        raise UserError(
            f"the address space is limited to {limit / 2**30:.2g} GB (ulimit -v), but the libraries need "
            f"{LEAST_ADDRESS_SPACE / 2**30:.2g} GB; lift the limit: ulimit -v unlimited"
        )
