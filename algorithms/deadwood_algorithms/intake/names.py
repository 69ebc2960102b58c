"""What a band or a raster within a file holds, by the names that its writer gave it.

Stacks of terrain layers have the slope first as often as the elevation; GIS programs and NetCDF name each.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

WORDS = re.compile(r"[^\W\d_]+")
# Names of the ground's height; the second row is less specific, and counts if no band has one of the first.
GROUND = (
    {"dem", "dtm", "dgm", "dhm", "mnt", "mdt", "terrain", "gelände", "ground", "bare", "elevation", "elev"}
    | {"altitude", "altitud", "elevazione", "elevacion", "elevación", "geländehöhe", "gelaendehoehe", "topography"}
    | {"orography", "bathymetry", "terrainmodel", "heightmap"},
    {"height", "heights", "z", "höhe", "hoehe", "höhen", "hoehen", "hauteur", "quota", "quote", "altezza", "altura"}
    | {"hoogte", "alt", "topo", "zmean", "zmin"},
)
CANOPY = (
    {"chm", "ndsm", "ndom", "mnh", "vhm", "canopy", "vegetation", "kronenhöhe", "baumhöhe", "canopée"},
    {"height", "heights", "z", "höhe", "hoehe", "hauteur", "altezza"},
)
SURFACE = ({"dsm", "dom", "mns", "surface"}, CANOPY[1])
FRICTION = ({"friction", "mu", "reibung", "frottement", "attrito"}, set[str]())
WANTED = {"DEM": GROUND, "canopy": CANOPY, "surface": SURFACE, "friction": FRICTION}
# What is computed from heights, or are heights of something else than the ground.
OF_SLOPE = {"slope", "slopes", "gradient", "steepness", "neigung", "hangneigung", "pente", "pentes", "pendenza"}
OF_SLOPE |= {"pendiente", "inclination", "aspect", "exposition", "orientation", "esposizione", "orientación"}
OF_SLOPE |= {"hillshade", "shade", "shaded", "shading", "schummerung", "ombrage", "ombreggiatura"}
DERIVED = OF_SLOPE | {
    "curvature",
    "krümmung",
    "courbure",
    "curvatura",
    "roughness",
    "ruggedness",
    "rauigkeit",
    "rugosité",
    "tri",
    "tpi",
}
DERIVED |= {"twi", "wetness", "flow", "accumulation", "catchment", "openness", "svf", "visibility", "intensity"}
DERIVED |= {"red", "green", "blue", "nir", "ndvi", "alpha", "mask", "count", "density", "uncertainty", "error"}
DERIVED |= {"quality", "quelle", "source", "flag", "flags", "northness", "eastness", "convexity"}
NOT_GROUND = {
    "chm",
    "ndsm",
    "ndom",
    "mnh",
    "vhm",
    "canopy",
    "vegetation",
    "tree",
    "trees",
    "dsm",
    "dom",
    "mns",
    "crown",
}


def words_of(name: str) -> set[str]:
    """The words of a name, also of one in camel case: slopeDegrees, DTM_1m."""
    apart = re.sub(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])", " ", name)
    return {each.lower() for each in (*WORDS.findall(apart), *WORDS.findall(name))}


def is_derived(name: str, what: str = "DEM") -> bool:
    """Whether a name says that values are not what the role needs, but computed from it or something else."""
    words = words_of(name)
    return bool(words & (DERIVED | (NOT_GROUND if what == "DEM" else set())))


def chosen(names: Sequence[str], what: str) -> int | None:
    """The only one of several names that is that of the role's quantity, counted from 0; None if none or more are."""
    for wanted in WANTED.get(what, ()):
        found = [k for k, name in enumerate(names) if words_of(name) & wanted and not is_derived(name, what)]
        if found:
            return found[0] if len(found) == 1 else None
    return None
