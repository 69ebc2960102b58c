"""The columns of single-tree tables: found by their usual names, brought into the units of the trees layer.

For `import_trees`. What is missing is NaN here; what to do about it is that tool's business.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms.layers import id_column, number_column, where_of
from deadwood_algorithms.tool import Feedback, UserError

if TYPE_CHECKING:
    import geopandas

# Usual names in lower case, the most telling first; a name without a unit is in the unit that its source documents
# (lidR, ForestTools, pycrown, FINT-CH, cloud2trees, lidaRtRee, spBayes, TALLO, SORTIE), or as shapefiles cut it short.
ID_NAMES = ("tree_id", "treeid", "tree_no", "id", "dn", "baumnr", "baum_id", "individualid")
DBH_NAMES = ("dbh_cm", "dbh_m", "dbh_mm", "dbh", "bhd_cm", "bhd_m", "bhd", "dhp", "stem_diameter_cm", "stem_diame")
DBH_NAMES += ("stemdiameter", "diam", "d")
HEIGHT_NAMES = ("height_m", "tree_height_m", "tree_heigh", "height", "hoehe", "höhe", "th", "tth", "h_m", "h", "z")
SPECIES_NAMES = ("species", "spp", "baumart", "essence", "art", "s")
# ... and how many of them make a diameter.
CROWN_NAMES = {"crown_diameter_m": 1.0, "crown_diam": 1.0, "maxcrowndiameter": 1.0}
CROWN_NAMES |= {"mean_crown_radius": 2.0, "mean_crown": 2.0, "crown_radius_m": 2.0, "crown_radi": 2.0}
DBH_UNITS = {"cm": 1.0, "m": 100.0, "mm": 0.1}  # of a DBH, in cm
HEIGHT_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "ft": 0.3048}  # in m
# A Z of points or a column z whose median is above this is the height of the ground above the sea, not of a tree.
TALLEST_M = 80.0


def find(source: geopandas.GeoDataFrame, asked: str | None, option: str, names: Sequence[str]) -> str | None:
    """The column asked for, else the first of the usual names that is there, in any letter case."""
    there = {str(name).strip().lower(): str(name) for name in source.columns if name != "geometry"}
    if asked and asked.lower() not in there:
        raise UserError(f"{where_of(source)}: there is no field '{asked}' ({option}); it has {', '.join(there)}")
    return next((there[name] for name in ([asked.lower()] if asked else names) if name in there), None)


def sizes(source: geopandas.GeoDataFrame, name: str, missing_value: float | None) -> np.ndarray:
    """A column of sizes, NaN where it is empty or holds the missing value."""
    try:
        return number_column(source, name, minimum=0.0, exclusive=True, gaps=True, missing_value=missing_value)
    except UserError as error:
        raise UserError(f"{error}, or say --missing-value if the number means missing") from error


def dbh_column(
    source: geopandas.GeoDataFrame, asked: str | None, unit: str | None, missing_value: float | None
) -> np.ndarray:
    """DBH in cm, NaN where missing; without ``unit`` the field's name tells it (``_cm``, ``_m``, ``_mm``), else cm."""
    name = find(source, asked, "--dbh-field", DBH_NAMES)
    if name is None:
        return np.full(len(source), np.nan)
    return sizes(source, name, missing_value) * DBH_UNITS.get(unit or name.lower().rpartition("_")[2], 1.0)


def height_column(
    source: geopandas.GeoDataFrame, asked: str | None, unit: str, missing_value: float | None, feedback: Feedback
) -> np.ndarray:
    """Height in m, NaN where missing: a column, else the Z of the points where that can be the height of a tree."""
    where = where_of(source)
    name = find(source, asked, "--height-field", HEIGHT_NAMES)
    if name is None and not (shapely.get_type_id(source.geometry) != 0).any() and source.geometry.has_z.all():
        name = "the Z of the points"
        source = source.copy()
        source[name] = shapely.get_z(np.asarray(source.geometry.array))
    if name is None:
        return np.full(len(source), np.nan)
    if asked is None and name.lower() in ("z", "the z of the points"):
        middle = float(np.nanmedian(number_column(source, name, gaps=True))) * HEIGHT_UNITS[unit]
        if middle == 0:
            return np.full(len(source), np.nan)  # as some programs write a Z that they do not have
        if not middle <= TALLEST_M:
            feedback.warn(f"{where}: {name} (median {middle:.0f} m) is not the height of trees, and is not used")
            return np.full(len(source), np.nan)
        feedback.note(f"{where}: the height is taken from {name}")
    return sizes(source, name, missing_value) * HEIGHT_UNITS[unit]


def id_columns(
    source: geopandas.GeoDataFrame, kept: np.ndarray, asked: str | None, feedback: Feedback
) -> dict[str, np.ndarray]:
    """The ids as they are; where two trees share one, or one has none, new ones, and the old as ``source_id``."""
    name = find(source, asked, "--id-field", ID_NAMES)
    running = np.arange(1, int(kept.sum()) + 1)
    if name is None:
        return {"tree_id": running}
    empty = int(np.count_nonzero(source[name].isna()))
    ids = source[name].astype(str).to_numpy()[kept] if empty else id_column(source, name)[kept]
    repeated = ids.size - np.unique(ids.astype(str)).size
    if not (repeated or empty):
        return {"tree_id": ids}
    what = f"{empty} trees have no id" if empty else f"{repeated} trees have an id that another one has"
    feedback.warn(
        f"{where_of(source)}, field '{name}': {what}; all are numbered anew from 1, the old ids are kept as source_id"
    )
    return {"tree_id": running, "source_id": ids}


def further_columns(
    source: geopandas.GeoDataFrame, kept: np.ndarray, species_field: str | None, crown_field: str | None
) -> dict[str, np.ndarray]:
    """Species and crown diameter, where the source has them."""
    columns: dict[str, np.ndarray] = {}
    species = find(source, species_field, "--species-field", SPECIES_NAMES)
    if species is not None:
        words = [None if word is None or word != word else str(word) for word in source[species]]
        columns["species"] = np.array(words, object)[kept]
    crown = find(source, crown_field, "--crown-field", tuple(CROWN_NAMES))
    if crown is not None:
        diameter = number_column(source, crown, minimum=0.0, gaps=True) * CROWN_NAMES.get(crown.lower(), 1.0)
        columns["crown_diameter_m"] = diameter[kept]
    return columns
