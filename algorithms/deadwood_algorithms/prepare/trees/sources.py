"""Formats of single-tree tables: the columns of each known source, and the usual names if the source is unknown.

For `import_trees`. Layouts are data: a new source is one more row of ``LAYOUTS``. Names are in lower case, the most
specific first; a file without header has ``column_1``, ``column_2``, ... Every layout is from the source's own code or
manual, except that of Rockyfor3D, whose manual was not available: its third column is taken to be the DBH in cm.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.files.units import named
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import UserError

if TYPE_CHECKING:
    import pandas

# Words for a tree that is dead but stands, or that no longer stands, whatever the column's coding.
DEAD_WORDS = ("dead", "d", "standing dead", "dead, broken bole", "snag", "tot", "stehend tot", "dürr", "dürrständer")
DEAD_WORDS += ("mort", "mort sur pied", "chandelle", "morto", "muerto")
GONE_WORDS = ("gone", "lying", "missing", "downed", "fallen", "stump", "removed", "cut", "liegend", "gefällt")
GONE_WORDS += ("no longer qualifies", "lost, burned", "lost, herbivory", "lost, presumed dead", "lost, fate unknown")


@dataclass(frozen=True, kw_only=True)
class Layout:
    """One format of table; for each role the columns that may contain it, of which the first that exists counts."""

    source: str
    what: str
    sign: tuple[str, ...] = ()  # combination of columns that only this source has
    columns: tuple[int, ...] = ()  # for a file without header: possible numbers of columns
    files: str = ""  # and the beginning or end of its name
    xy: tuple[str, str] | None = None
    id: tuple[str, ...] = ()
    dbh: tuple[str, ...] = ()
    girth: tuple[str, ...] = ()  # circumference at breast height, if there is no dbh
    radius: tuple[str, ...] = ()  # of the stem at breast height, if there is neither
    height: tuple[str, ...] = ()
    height_in_z: bool = False  # the points' Z is the height, if no column has it
    species: tuple[str, ...] = ()
    crown: dict[str, str] = field(default_factory=dict)  # column -> diameter or radius [m], or area [m2]
    status: tuple[str, ...] = ()
    dead: tuple[str, ...] = DEAD_WORDS
    gone: tuple[str, ...] = GONE_WORDS
    missing_value: float | None = None
    dbh_modelled: bool = False  # the source computed it from the height
    repeated_by: str = ""  # rows of one tree (its id) at several dates in this column: the latest counts
    form: str = ""  # column that distinguishes trees from shrubs


USUAL_DBH = ("dbh_cm", "dbh_m", "dbh_mm", "dbh_in", "dbh", "bhd_cm", "bhd_m", "bhd", "dhp", "stem_diameter_cm")
USUAL_DBH += ("stem_diame", "stemdiameter", "brusthöhendurchmesser", "brusthoehendurchmesser", "stammdurchmesser")
USUAL_DBH += ("stammdurchm", "durchmesser", "diametre", "diamètre", "diametro", "diameter", "d130", "diam", "d")
USUAL_DBH += ("d13", "dbh13", "diamètre à 1,30 m", "diamètre à 1,3 m", "diametro a 1,30 m", "durchmesser in 1,3 m")
USUAL_DBH += ("durchmesserklasse", "bhd_klasse", "dbh_class", "diameter_class", "classe_de_diamètre", "classe_diametro")
# The circumference of the stem at breast height, for tables that have no diameter.
USUAL_GIRTH = ("girth", "gbh", "cbh", "circumference", "umfang", "stammumfang", "stamm_umfang", "stammumf", "st_umfang")
USUAL_GIRTH += ("st_umf", "brusthöhenumfang", "circonference", "circonférence", "circonfere", "circ", "c130")
USUAL_GIRTH += ("circonferenza", "circonf", "omtrek", "stamomtrek", "perimetro", "circunferencia")
USUAL_GIRTH += tuple(f"{name}_{unit}" for name in USUAL_GIRTH for unit in ("cm", "mm", "m"))
# Its radius, as programs that fit circles to point clouds give it (TreeLS, 3D Forest).
USUAL_RADIUS = ("radius", "stem_radius", "dbh_radius", "stammradius", "stamm_radius", "rayon", "raggio", "radio")
USUAL_RADIUS += tuple(f"{name}_{unit}" for name in USUAL_RADIUS for unit in ("cm", "mm", "m"))

# The tree's height takes precedence over a plain "height", which may be above sea level.
USUAL_HEIGHT = ("height_m", "tree_height_m", "tree_heigh", "tree_height", "treeheight", "baumhoehe", "baumhöhe")
USUAL_HEIGHT += ("baum_hoehe", "hauteur_arbre", "hauteur_totale", "haut_tot", "altezza_albero", "altezza_totale")
USUAL_HEIGHT += ("total_height", "gesamthöhe", "scheitelhöhe", "baumlänge")
USUAL_HEIGHT += ("h_tot", "htot", "height", "hoehe", "höhe", "hauteur", "altezza", "altura", "hoogte", "th", "tth")
USUAL_HEIGHT += ("h_m", "ht", "hgt", "tree_ht", "tot_ht", "total_ht", "h", "z")

USUAL_STATUS = ("live_dead", "plantstatus", "tree_status", "status", "zustand", "baumzustand", "lebend_tot")
USUAL_STATUS += ("tot_lebend", "lebendstatus", "etat", "état", "etat_arbre", "statut", "vivant_mort", "stato")
USUAL_STATUS += ("stato_albero", "vivo_morto", "estado", "condition", "tree_condition", "kondition", "condizione")
USUAL_STATUS += ("condizioni", "vitality", "vitalität", "vitalitaet", "vitalité", "vitalite", "vitalità", "vitalita")
USUAL_STATUS += ("état_sanitaire", "etat_sanitaire", "health", "gesundheitszustand", "mortality")

USUAL = Layout(
    source="table",
    what="columns found by their usual names",
    id=("tree_id", "treeid", "tree_no", "id", "dn", "baumnr", "baum_nr", "baumnummer", "baum_id", "individualid", "nr"),
    dbh=USUAL_DBH,
    girth=USUAL_GIRTH,
    radius=USUAL_RADIUS,
    height=USUAL_HEIGHT,
    height_in_z=True,
    species=("species", "spp", "baumart", "essence", "specie", "spezies", "especie", "gehoelzart", "art", "s"),
    crown={"crown_diameter_m": "diameter", "crown_diam": "diameter", "maxcrowndiameter": "diameter"}
    | {"mean_crown_radius": "radius", "mean_crown": "radius", "crown_radius_m": "radius", "crown_radi": "radius"}
    | {"crown_area_m2": "area", "crown_area": "area"}
    | {"kronendurchmesser": "diameter", "kronendurc": "diameter", "kr_durchm": "diameter"}
    | {"diametre_couronne": "diameter", "diametro_chioma": "diameter"},
    status=USUAL_STATUS,
)

LAYOUTS = (
    Layout(
        source="lidr",
        what="treeID, height in Z or in the Z of the points; crown_metrics with convhull_area",
        sign=("treeid", "z"),
        id=("treeid",),
        height=("z",),
        height_in_z=True,
        crown={"convhull_area": "area", "convhull_a": "area"},  # the second name as cut short in shapefiles
    ),
    Layout(
        source="foresttools",
        what="treeID, height, winRadius, crownArea",
        sign=("height", "winradius"),
        id=("treeid",),
        height=("height",),
        crown={"crownarea": "area"},
    ),
    Layout(
        source="itcsegment",
        what="crowns with X, Y, Height_m, CA_m2",
        sign=("x", "y", "height_m", "ca_m2"),
        xy=("x", "y"),
        id=("id",),
        height=("height_m",),
        crown={"ca_m2": "area"},
    ),
    Layout(
        source="lidartree",
        what="detected (id, h, dom_radius, s as the crown's area, v) or inventory (x, y, d, h, n, s, e)",
        sign=("h", "dom_radius"),
        id=("id",),
        height=("h",),
        crown={"s": "area"},
    ),
    Layout(
        source="lidartree",
        what="an inventory with the codes e: 3 dead, 4 snag, 0 missing or lying",
        sign=("x", "y", "d", "h", "s", "e"),
        xy=("x", "y"),
        id=("n",),
        dbh=("d",),
        height=("h",),
        species=("s",),
        status=("e",),
        dead=("3", "4"),
        gone=("0",),
    ),
    Layout(
        source="pycrown",
        what="DN, TH, COR; crowns with TTH, TCH (the Z of its points is the ground's, and not used)",
        sign=("dn", "th", "cor"),
        id=("dn",),
        height=("th",),
    ),
    Layout(source="pycrown", what="pycrown, crowns", sign=("dn", "tth", "tch"), id=("dn",), height=("tth",)),
    Layout(
        source="fint",
        what="FINT and pyFINT: Ind_trees.csv (5 or 6 columns), treefile.txt (3 or 4: x, y and heights)",
        columns=(6,),
        files="ind_trees",
        xy=("column_1", "column_2"),
        height=("column_3",),
        dbh=("column_5",),
        dbh_modelled=True,
        missing_value=-1.0,
    ),
    Layout(
        source="fint",
        what="pyFINT before the smoothed height was written, and FINT",
        columns=(5,),
        files="ind_trees",
        xy=("column_1", "column_2"),
        height=("column_3",),
        dbh=("column_4",),
        dbh_modelled=True,
        missing_value=-1.0,
    ),
    Layout(
        source="fint",
        what="treefile.txt",
        columns=(3, 4),
        xy=("column_1", "column_2"),
        height=("column_3",),
        missing_value=-1.0,
    ),
    Layout(
        source="fint-ch",
        what="hoehe, bhd, dominanz; -1 is missing",
        sign=("hoehe", "bhd", "dominanz"),
        height=("hoehe",),
        dbh=("bhd",),
        dbh_modelled=True,
        missing_value=-1.0,
    ),
    Layout(
        source="cloud2trees",
        what="treeID, tree_height_m, dbh_cm, tree_x, tree_y, crown_area_m2",
        sign=("treeid", "tree_height_m"),
        xy=("tree_x", "tree_y"),
        id=("treeid",),
        height=("tree_height_m",),
        dbh=("dbh_cm", "dbh_m"),
        dbh_modelled=True,
        crown={"crown_area_m2": "area"},
    ),
    Layout(
        source="rockyfor3d",
        what="Rockyfor3D tree file: x, y, DBH in cm, and a height where there is a fourth column",
        columns=(4,),
        xy=("column_1", "column_2"),
        dbh=("column_3",),
        height=("column_4",),
    ),
    Layout(source="rockyfor3d", what="the same", columns=(3,), xy=("column_1", "column_2"), dbh=("column_3",)),
    Layout(
        source="platrock",
        what="PlatRock's .xyd: x, y, diameter in cm",
        columns=(3,),
        files=".xyd",
        xy=("column_1", "column_2"),
        dbh=("column_3",),
    ),
    Layout(
        source="neon",
        what="NEON vst_apparentindividual joined to the positions (adjEasting, adjNorthing of geoNEON)",
        sign=("individualid", "plantstatus"),
        xy=("adjeasting", "adjnorthing"),
        id=("individualid",),
        dbh=("stemdiameter",),
        height=("height",),
        species=("taxonid", "scientificname"),
        crown={"maxcrowndiameter": "diameter"},
        status=("plantstatus",),
        repeated_by="date",
        form="growthform",
    ),
    Layout(
        source="sortie",
        what="tree map: X, Y, Species, Type (Snag), Diam, Height",
        sign=("x", "y", "species", "type", "diam", "height"),
        xy=("x", "y"),
        dbh=("diam",),
        height=("height",),
        species=("species",),
        status=("type",),
    ),
)
ROLES = ("id", "dbh", "girth", "radius", "height", "species", "crown", "status")
SOURCES = ("auto", USUAL.source, *dict.fromkeys(each.source for each in LAYOUTS))


def names_of(frame: pandas.DataFrame) -> dict[str, str]:
    """The columns in lower case -> original spelling; one with a unit, Höhe (m) or altezza_m, also without it."""
    names = {str(name).strip().lower(): str(name) for name in frame.columns if name != "geometry"}
    for joined in (False, True):  # height_ft counts if no column is called height
        for name in list(names.values()):
            names.setdefault(named(name, joined=joined).plain, name)
    return names


def plain_name(name: str) -> str:
    """A name without unit, blanks, points and lines, and the year of the survey: Hauteur totale (m), Hoehe_2024."""
    plain = re.sub(r"[\W_]+", "", named(name).plain)
    return re.sub(r"(?<=[^\W\d])(19|20)\d\d$", "", plain)


def plain_names_of(frame: pandas.DataFrame) -> dict[str, str]:
    """The columns by their plain names; if two have the same name, as from two surveys, neither is returned."""
    plain = [(plain_name(str(name)), str(name)) for name in frame.columns if name != "geometry"]
    count = Counter(each for each, _ in plain)
    return {each: name for each, name in plain if each and count[each] == 1}


def headerless(frame: pandas.DataFrame) -> bool:
    names = [str(name) for name in frame.columns if name != "geometry"]
    return bool(names) and all(re.fullmatch(r"column_\d+", name) for name in names)


def layout_of(frame: pandas.DataFrame, path: str, source: str, *, mapped: bool) -> Layout:
    """The requested layout or, with ``auto``, the one that the table's columns or the file's name indicate.

    ``mapped``: the user named the columns of the coordinates, so nothing is guessed for a file without header.
    A column that the source does not write, such as a DBH added to lidR's trees, is still found by its usual name.
    """
    return _completed(_own_layout(frame, path, source, mapped))


def _completed(layout: Layout) -> Layout:
    """The layout completed with the usual names, except names that mean something else in this source."""
    if layout is USUAL:
        return USUAL
    own = {role: tuple(getattr(layout, role)) for role in ROLES}
    claimed = {name for names in own.values() for name in names}
    more = {
        role: own[role] + tuple(name for name in getattr(USUAL, role) if name not in claimed)
        for role in ("id", "dbh", "girth", "radius", "species", "status")
    }
    crown = layout.crown | {name: kind for name, kind in USUAL.crown.items() if name not in claimed}
    return replace(layout, **more, crown=crown)


def _own_layout(frame: pandas.DataFrame, path: str, source: str, mapped: bool) -> Layout:
    names, bare = names_of(frame), headerless(frame)
    if source == USUAL.source:
        return USUAL
    if source == "auto":
        if bare:
            return USUAL if mapped else _by_file(frame, path)
        return next((each for each in LAYOUTS if each.sign and set(each.sign) <= set(names)), USUAL)
    own = [each for each in LAYOUTS if each.source == source]
    fitting = [each for each in own if (len(frame.columns) in each.columns if bare else bool(each.sign))]
    if not fitting:
        kind = (
            f"{counted(len(frame.columns), 'column')} without header"
            if bare
            else f"the columns {', '.join(dict.fromkeys(names.values()))}"
        )
        raise UserError(f"{path}: this is not {own[0].what} (--source {source}); the file has {kind}")
    return max(fitting, key=lambda each: len(set(each.sign) & set(names)) / max(len(each.sign), 1))


def xy_of(frame: pandas.DataFrame, layout: Layout) -> tuple[str, str] | None:
    """The columns of the coordinates in the layout; None if the layer's geometry, or the usual names, are used."""
    if layout.xy is None:
        return None
    names = names_of(frame)
    x, y = (names.get(each, each) for each in layout.xy)
    drawn = "geometry" in frame and not (x in frame and y in frame)
    return None if drawn else (x, y)


def _by_file(frame: pandas.DataFrame, path: str) -> Layout:
    name, count = Path(path).name.lower(), len(frame.columns)
    for each in LAYOUTS:
        if each.files and count in each.columns and (name.startswith(each.files) or name.endswith(each.files)):
            return each
    may_be = sorted({each.source for each in LAYOUTS if count in each.columns})
    sources = f"--source {' or '.join(may_be)}, or " if may_be else ""
    raise UserError(
        f"{path}: the table has no header and {counted(count, 'column')}; name the program that wrote it "
        f"({sources}--x-field column_1 --y-field column_2 --dbh-field column_3 or as they are)"
    )


def sources_described() -> str:
    """The sources as lines of a list, for the tool's description."""
    first = {each.source: each.what for each in reversed(LAYOUTS)}
    return "\n".join(f"- ``{name}``: {first[name]}" for name in SOURCES[2:])
