"""Coordinate reference systems: as written by a user, as stored in a file, and whether two are the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyproj
from pyproj.exceptions import CRSError, ProjError

from deadwood_algorithms.params.tool import UserError

# A CRS is often used beyond its area: UTM zone 32 for all of Germany, which extends 3 degrees farther.
AREA_MARGIN_DEG = 3.5
EXCHANGED = (
    "x and y are exchanged (in Swiss and Austrian surveys Y is the easting): name the fields, --x-field for the "
    "easting and --y-field for the northing, or exchange them in the layer"
)
LV03_TO_LV95 = (2_000_000.0, 1_000_000.0)  # offset of LV95 from LV03 [m]; accurate to 2 m


def horizontal(crs: pyproj.CRS) -> pyproj.CRS:
    """The horizontal part of a CRS that may be compound or bound to a datum shift."""
    if crs.is_bound and crs.source_crs is not None:
        return horizontal(crs.source_crs)
    if crs.is_compound:
        return horizontal(crs.sub_crs_list[0])
    return crs


LOCAL = "local"  # denotes metric coordinates on a local grid, without a position on the globe
LOCAL_CRS = pyproj.CRS.from_wkt(
    'ENGCRS["local metres",EDATUM["local site"],CS[Cartesian,2],AXIS["easting (X)",east,ORDER[1]],'
    'AXIS["northing (Y)",north,ORDER[2]],LENGTHUNIT["metre",1]]'
)


def is_local(crs: pyproj.CRS) -> bool:
    """Whether a CRS is a local grid, which cannot be converted to any other."""
    return horizontal(crs).is_engineering


def refuse_local(own: pyproj.CRS, target: pyproj.CRS, where: str) -> None:
    """Refuse to convert a place on the globe to local coordinates, or vice versa; ``where`` names the file in
    messages.
    """
    if is_local(own) == is_local(target):
        return
    one, other = ("local" if is_local(each) else crs_name(each) for each in (own, target))
    raise UserError(
        f"{where} is in {one} coordinates, but the terrain model's are {other}, and nothing converts one to the other; "
        "give both in the same (--crs local takes coordinates that name no CRS as they are)"
    )


def parse_crs(name: str, where: str = "--crs") -> pyproj.CRS:
    """A CRS from what the user wrote, such as EPSG:2056, EPSG:2056+5728, or ``local``."""
    if name.strip().lower() == LOCAL:
        return LOCAL_CRS
    try:
        return pyproj.CRS.from_user_input(name)
    except CRSError as error:
        raise UserError(f"{where} is '{name}', which is not a known CRS; name it like EPSG:2056") from error


def crs_name(crs: pyproj.CRS) -> str:
    """EPSG:2056 if the CRS has a code, otherwise its name."""
    authority = crs.to_authority()
    if authority:
        return ":".join(authority)
    if crs.is_compound:
        return " + ".join(crs_name(part) for part in crs.sub_crs_list)
    return crs.name


def same_crs(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """Whether two CRS give the same position, apart from axis order and height."""
    one, other = horizontal(one), horizontal(other)
    if is_local(one) or is_local(other):
        return is_local(one) and is_local(other)
    if one.equals(other, ignore_axis_order=True):
        return True
    code = one.to_epsg()
    return code is not None and code == other.to_epsg()


def accuracy_words(source: pyproj.CRS, target: pyproj.CRS, bounds: Sequence[float]) -> str:
    """How accurately positions within ``bounds`` (of the source) are transformed, as stated by PROJ.

    PROJ (and therefore geopandas) selects by default the most accurate operation whose grids are installed here.
    """
    source, target = horizontal(source), horizontal(target)
    west, south, east, north = bounds
    try:
        x, y = (west + east) / 2.0, (south + north) / 2.0
        used = pyproj.Transformer.from_crs(source, target, always_xy=True)
        used.transform(x, y)  # only this selects one of several candidates
        operation = used.get_last_used_operation()
        accuracy, name = operation.accuracy, operation.description
    except ProjError:
        return "accuracy unknown"
    if "ballpark" in name.lower():
        return "accuracy unknown, the error may be 100 m and more: PROJ knows no transformation between the two"
    if accuracy is None or accuracy < 0:
        return "accuracy unknown"
    return "accurate to the millimetre" if accuracy == 0 else f"accurate to about {accuracy:g} m"


def is_ballpark(words: str) -> bool:
    """Whether the words of `accuracy_words` say that nothing is known about a transformation."""
    return "100 m" in words


def near_its_area(crs: pyproj.CRS, x: float, y: float) -> bool:
    """Whether a place [m] is in the area of use of its CRS, or not far beyond; true if no area is known."""
    code = crs.to_epsg()
    area = crs.area_of_use or (pyproj.CRS.from_epsg(code).area_of_use if code else None)
    if area is None:
        return True
    longitude, latitude = pyproj.Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True).transform(x, y)
    width, beyond = (area.east - area.west) % 360.0, AREA_MARGIN_DEG  # some areas contain the date line
    east_of_west = (longitude - area.west + beyond) % 360.0 if math.isfinite(longitude) else math.inf
    within = math.isfinite(latitude) and area.south - beyond <= latitude <= area.north + beyond
    return within and (width == 0.0 or east_of_west <= width + 2.0 * beyond)


class FarOff(NamedTuple):
    """Why a place is not near the area of its CRS: x and y exchanged, numbers of another CRS, or unknown."""

    exchanged: bool
    likely: str


def far_off(crs: pyproj.CRS, x: float, y: float) -> FarOff | None:
    """What is probably wrong with a place [m]; None if it is near the area of its CRS."""
    if near_its_area(crs, x, y):
        return None
    likely = swiss_code(x, y)
    return FarOff(near_its_area(crs, y, x), "" if likely == crs_name(crs) else likely)


def swiss_code(x: float, y: float) -> str:
    """The Swiss CRS, new or old, to which these numbers probably belong; otherwise empty."""
    for code, (east, north) in (("EPSG:2056", LV03_TO_LV95), ("EPSG:21781", (0.0, 0.0))):
        if 480_000 < x - east < 840_000 and 70_000 < y - north < 300_000:
            return code
    return ""


def misplacement(
    x: np.ndarray, y: np.ndarray, bounds: tuple[float, float, float, float], crs: pyproj.CRS | None = None
) -> str:
    """The usual mistake, and its fix, that explains why places [m] are outside ``bounds`` (west, south, east, north);
    or empty.

    In Swiss and Austrian surveys Y is the easting and X the northing; LV03 lacks the leading digits of LV95. Numbers
    may also be kilometres, or degrees, which can only be detected with ``crs`` (that of the bounds).
    """
    west, south, east, north = bounds

    def lie(e: np.ndarray, n: np.ndarray) -> bool:
        return float(np.mean((e >= west) & (e <= east) & (n >= south) & (n <= north))) > 0.5

    easting, northing = LV03_TO_LV95
    for e, n, exchanged in ((x, y, False), (y, x, True)):
        for shift, code in ((0.0, ""), (1.0, "EPSG:21781"), (-1.0, "EPSG:2056")):
            if (exchanged or shift) and lie(e + shift * easting, n + shift * northing):
                mistakes = (EXCHANGED if exchanged else "", _of_another(code) if code else "")
                return "; ".join(each for each in mistakes if each)
    if lie(1000.0 * x, 1000.0 * y):
        return "these are kilometres: multiply them by 1000, or write [km] behind the names of their fields"
    if crs is not None and not is_local(crs) and np.abs(x).max() <= 180.0 and np.abs(y).max() <= 180.0:
        moved = pyproj.Transformer.from_crs("EPSG:4326", horizontal(crs), always_xy=True)
        if lie(*moved.transform(x, y)):
            return _of_another("EPSG:4326")
        if lie(*moved.transform(y, x)):
            return f"{EXCHANGED}; {_of_another('EPSG:4326')}"
    return ""


def misnamed(crs: pyproj.CRS, x: np.ndarray, y: np.ndarray) -> str:
    """The same without a DEM: the mistake that explains why places [m] are far from the area of their CRS; or empty."""
    east, north = float(np.nanmedian(x)), float(np.nanmedian(y))
    far = far_off(crs, east, north)
    if far is None:
        return ""
    fix = _of_another(far.likely) if far.likely else "name the CRS that its supplier states"
    why = EXCHANGED if far.exchanged else fix
    return f"{east:.0f}, {north:.0f} is far outside the area of use of {crs_name(crs)}; {why}"


def _of_another(code: str) -> str:
    return f"these are coordinates of {code}: --crs {code}, if the layer holds no CRS; else define it again"
