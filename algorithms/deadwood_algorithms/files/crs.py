"""Coordinate reference systems: what a user wrote, what a file says, and whether two are one."""

from __future__ import annotations

from collections.abc import Sequence

import pyproj
from pyproj.exceptions import CRSError, ProjError

from deadwood_algorithms.params.tool import UserError


def horizontal(crs: pyproj.CRS) -> pyproj.CRS:
    """The horizontal part of a CRS that may be compound or bound to a datum shift."""
    if crs.is_bound and crs.source_crs is not None:
        return horizontal(crs.source_crs)
    if crs.is_compound:
        return horizontal(crs.sub_crs_list[0])
    return crs


def parse_crs(name: str, where: str = "--crs") -> pyproj.CRS:
    """A CRS from what the user wrote, such as EPSG:2056 or EPSG:2056+5728."""
    try:
        return pyproj.CRS.from_user_input(name)
    except CRSError as error:
        raise UserError(f"{where} is '{name}', which names no CRS; write it as EPSG:2056") from error


def crs_name(crs: pyproj.CRS) -> str:
    """EPSG:2056 where the CRS has a code, else its name."""
    authority = crs.to_authority()
    if authority:
        return ":".join(authority)
    if crs.is_compound:
        return " + ".join(crs_name(part) for part in crs.sub_crs_list)
    return crs.name


def same_crs(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """Whether two CRS place a position alike, axis order and height apart."""
    one, other = horizontal(one), horizontal(other)
    if one.equals(other, ignore_axis_order=True):
        return True
    code = one.to_epsg()
    return code is not None and code == other.to_epsg()


def accuracy_words(source: pyproj.CRS, target: pyproj.CRS, bounds: Sequence[float]) -> str:
    """How well positions within ``bounds`` (of the source) are brought over: the accuracy that PROJ states.

    The operation that PROJ's default picks (and so geopandas) is the most accurate one whose grids are installed here.
    """
    source, target = horizontal(source), horizontal(target)
    west, south, east, north = bounds
    try:
        x, y = (west + east) / 2.0, (south + north) / 2.0
        used = pyproj.Transformer.from_crs(source, target, always_xy=True)
        used.transform(x, y)  # only now is one of several candidates chosen
        operation = used.get_last_used_operation()
        accuracy, name = operation.accuracy, operation.description
    except ProjError:
        return "accuracy unknown"
    if "ballpark" in name.lower():
        return "accuracy unknown, it may err by 100 m and more: PROJ knows no transformation between the two"
    if accuracy is None or accuracy < 0:
        return "accuracy unknown"
    return "accurate to the millimetre" if accuracy == 0 else f"accurate to about {accuracy:g} m"
