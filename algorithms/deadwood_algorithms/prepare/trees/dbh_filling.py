"""DBH and height where only one is known: by the user's law: given, by zones, or fitted to measured trees.

For `import_trees`; the laws themselves are in `allometry`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms.files.accounts import NO_TREE, account, count_of
from deadwood_algorithms.files.columns import field_names, number_column, where_of
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees import allometry
from deadwood_algorithms.prepare.trees.allometry import (
    FEW_TO_FIT,
    FEWEST_TO_FIT,
    NAMED_LAWS,
    FittedLaw,
    Law,
    LawsByTree,
    PowerLaw,
)

if TYPE_CHECKING:
    import geopandas
    import pyproj

DEFAULT = NAMED_LAWS["fint-ch"]


@dataclass(frozen=True)
class Filled:
    """DBH [cm] and height [m] of each tree, which of them were computed, and the report about it."""

    dbh: np.ndarray
    height: np.ndarray
    from_height: np.ndarray
    from_dbh: np.ndarray
    said: tuple[str, ...]


def fill_sizes(
    dbh: np.ndarray, height: np.ndarray, law: Law, crown: np.ndarray | None = None, otherwise: Law | None = None
) -> Filled:
    """Fill DBH and height by ``law`` where only the other is known; ``otherwise`` serves where the crown is missing."""
    crown = np.full(dbh.size, np.nan) if crown is None else crown
    from_height = np.isnan(dbh) & np.isfinite(height)
    from_dbh = np.isnan(height) & np.isfinite(dbh)
    thick, tall = law.dbh(height, crown), law.height(dbh, crown)
    said = []
    if otherwise is not None:
        lacking = (from_height & np.isnan(thick)) | (from_dbh & np.isnan(tall))
        thick = np.where(np.isnan(thick), otherwise.dbh(height, crown), thick)
        tall = np.where(np.isnan(tall), otherwise.height(dbh, crown), tall)
        if lacking.any():
            said.append(f"{lacking.sum()} of these have no crown diameter; for them {otherwise} is used")
    return Filled(
        np.where(from_height, thick, dbh), np.where(from_dbh, tall, height), from_height, from_dbh, tuple(said)
    )


def chosen_law(name: str | None, a: float, b: float, sample: FittedLaw | None) -> Law:
    """The layer's law: fitted, named, or a and b; more than one of them is rejected."""
    if sample is not None and (name or PowerLaw(a, b) != DEFAULT):
        raise UserError("--dbh-sample fits the law that --dbh-law or --dbh-a and --dbh-b would name; give one of them")
    refuse_two_laws(name, a, b)
    return sample or (NAMED_LAWS[name] if name else PowerLaw(a, b))


def refuse_two_laws(name: str | None, a: float, b: float) -> None:
    """Reject a and b beside a named power law; beside a law with the crown they are for trees without a known crown."""
    if name and isinstance(NAMED_LAWS[name], PowerLaw) and PowerLaw(a, b) not in (DEFAULT, NAMED_LAWS[name]):
        raise UserError(f"--dbh-law {name} and --dbh-a {a:g}, --dbh-b {b:g} are two laws; give one of them")


def fitted_law(
    path: str,
    dbh: np.ndarray,
    height: np.ndarray,
    feedback: Feedback,
) -> FittedLaw:
    """The law of the trees of a sample that have both sizes."""
    both = np.isfinite(dbh) & np.isfinite(height)
    if both.sum() < FEWEST_TO_FIT:
        complete = counted(int(both.sum()), "has", "have")
        raise UserError(
            f"{path}: of the sample's {counted(both.size, 'tree')}, {complete} both a DBH and a height; a fit needs "
            f"at least {FEWEST_TO_FIT}, better {FEW_TO_FIT}"
        )
    if np.ptp(height[both]) == 0 or np.ptp(dbh[both]) == 0:
        raise UserError(f"{path}: all trees of the sample have the same height or DBH, so no law can be fitted")
    law = allometry.fit(dbh[both], height[both])
    if law.dbh_law.b <= 0 or law.b_height <= 0:
        raise UserError(f"{path}: in the sample the DBH decreases with the height ({law}); check the columns")
    if both.sum() < FEW_TO_FIT:
        feedback.warn(
            f"{path}: a law fitted to {both.sum()} trees only is uncertain; use {FEW_TO_FIT} or more",
            code="few-trees",
            trees=int(both.sum()),
        )
    return law


def zoned(
    law: Law, path: str, places: np.ndarray, crs: pyproj.CRS | None, given: str | None, feedback: Feedback
) -> tuple[Law, str]:
    """The laws of zone polygons (``dbh_a`` and ``dbh_b``, or ``dbh_law``), elsewhere ``law``; and a line about them.

    Where zones overlap, the later row counts, as in the friction polygons.
    """
    from deadwood_algorithms.files.vectors import read_vector

    zones = read_vector(path, geometry=("polygon",), target_crs=crs, crs=given, what="DBH zones", feedback=feedback)
    laws = zone_laws(zones)
    inside, row = shapely.STRtree(np.asarray(zones.geometry.array)).query(places, predicate="intersects")
    zone = np.zeros(places.size, np.int64)
    np.maximum.at(zone, inside, row + 1)
    there = np.unique(zone[zone > 0]).size
    account("dbh_zones", count_of(len(zones), there, {NO_TREE: len(zones) - there}))
    if not zone.any():
        raise UserError(f"{where_of(zones)}: no tree stands in a zone; check the CRS of both")
    outside = int((zone == 0).sum())
    said = (
        f"DBH by the laws of {counted(there, 'zone')}"
        + (
            f"; no tree stands in {len(zones) - there} of {len(zones)}, or under later ones"
            if there < len(zones)
            else ""
        )
        + (f"; {counted(outside, 'tree stands', 'trees stand')} in none, there {law}" if outside else "")
    )
    return LawsByTree((law, *laws), zone), said


def warn_of_another_region(law: Law, places: np.ndarray, crs: pyproj.CRS | None, feedback: Feedback) -> None:
    """Warn if a named law is used far from the trees from which it was derived."""
    import pyproj

    from deadwood_algorithms.files.crs import is_local

    laws = law.laws if isinstance(law, LawsByTree) else (law,)
    if crs is None or is_local(crs):
        return
    x, y = np.median(shapely.get_coordinates(places), axis=0)
    to_degrees = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    longitude, latitude = to_degrees.transform(x, y)
    if np.isfinite(longitude + latitude):
        for words in dict.fromkeys(allometry.outside_region(each, longitude, latitude) for each in laws):
            if words:
                feedback.warn(words, code="law-of-another-region")


def zone_laws(zones: geopandas.GeoDataFrame) -> list[Law]:
    if "dbh_law" in zones:
        words = [str(word).strip().lower() for word in zones["dbh_law"]]
        for row, word in enumerate(words):
            if word not in NAMED_LAWS:
                raise UserError(
                    f"{where_of(zones)}, field 'dbh_law', row {row + 1}: '{word}' is none of {', '.join(NAMED_LAWS)}"
                )
        return [NAMED_LAWS[word] for word in words]
    if "dbh_a" not in zones or "dbh_b" not in zones:
        raise UserError(
            f"{where_of(zones)}: zones need the fields dbh_a and dbh_b, or dbh_law; it has {field_names(zones)}"
        )
    a, b = (number_column(zones, name, minimum=0.0, exclusive=True) for name in ("dbh_a", "dbh_b"))
    return [PowerLaw(float(each), float(power)) for each, power in zip(a, b, strict=True)]
