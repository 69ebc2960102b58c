"""The layers that users provide, and that some tools make for others."""

from __future__ import annotations

from deadwood_algorithms.schemas.words import FULL_CIRCLE, Layer, a_count, a_number, a_text, an_id

ORIENTATIONS = ("upright", "lying", "tilted")
STRUCTURE_KINDS = ("embankment", "ditch")
# Beyond these limits a size is an error, not a log, tree or structure; computing such a scene would be pointless, or
# hang. The stoutest trunk is 14 m across (Tule), the tallest tree 116 m (Hyperion), the highest dam 305 m (Jinping);
# the densest matter that may stand for a body (--shape) weighs 22 600 kg/m³; a log falls through air at 100 m/s or
# less.
DBH_CM = (0.1, 1500.0)
TREE_M = (0.05, 150.0)
BARRIER_M = 350.0
BLOCK_M = 100.0  # no boulder is larger
DENSITY_KG_M3 = 25_000.0
SPEED_MS = 300.0
DROP_M = 1000.0

LOG = a_count("log_id", "The log; unique. Missing: the row number, from 1")
RELEASE = an_id("release_id", "The release area, point or event that the log belongs to")
STRUCTURE = (
    an_id("structure_id", "The embankment or ditch. Missing: name, else the row number, from 1"),
    a_text("kind", "embankment or ditch", choices=STRUCTURE_KINDS, default="embankment"),
)

RELEASES = Layer(
    name="releases",
    geometry=("Point",),
    meaning="Where logs start: the plan position of each log's centre of mass",
    columns=(
        LOG,
        RELEASE,
        a_number(
            "dbh_cm",
            "Base diameter; the tip has half of it",
            0,
            DBH_CM[1],
            exclusive=True,
            least=DBH_CM[0],
            usual=(3, 300),
            default=75.0,
        ),
        a_number(
            "length_m",
            "Length of the log",
            0,
            TREE_M[1],
            exclusive=True,
            least=TREE_M[0],
            usual=(0.5, 80),
            default=30.0,
        ),
        a_number(
            "density_kg_m3",
            "Density of the wood",
            0,
            DENSITY_KG_M3,
            exclusive=True,
            least=1.0,
            usual=(50, 1300),
            default=300.0,
        ),
        a_text(
            "orientation",
            "upright (base down), lying (on its side, tip towards azimuth_deg) or tilted "
            "(axis tilt_deg from the vertical, tip towards azimuth_deg)",
            choices=ORIENTATIONS,
            default="upright",
        ),
        a_number("tilt_deg", "Angle of the axis of a tilted log from the vertical", 0, 180, default=0.0),
        a_number("azimuth_deg", "Where tip and speed point, clockwise from grid north", 0, FULL_CIRCLE, default=0.0),
        a_number(
            "speed_ms",
            "Initial speed towards azimuth_deg, in the terrain's tangent plane",
            0,
            SPEED_MS,
            default=0.0,
        ),
        a_number(
            "drop_m",
            "Clearance of the log's lowest point above the terrain at the start",
            0,
            DROP_M,
            default=0.0,
        ),
    ),
)

TREES = Layer(
    name="trees",
    geometry=("Point",),
    meaning="Standing trees: rigid truncated cones with the DBH as base diameter and half of it at the top",
    columns=(
        an_id("tree_id", "The tree; unique. Missing: the row number, from 1"),
        a_number(
            "dbh_cm",
            "Diameter at breast height",
            0,
            DBH_CM[1],
            exclusive=True,
            least=DBH_CM[0],
            usual=(3, 300),
            required=True,
        ),
        a_number(
            "height_m",
            "Height of the tree",
            0,
            TREE_M[1],
            exclusive=True,
            least=TREE_M[0],
            usual=(1.3, 80),
            required=True,
        ),
        a_text("species", "Species as named in the source"),
        a_number("crown_diameter_m", "Diameter of the crown", 0),
        a_text(
            "dbh_source",
            "measured, or modelled where it was computed from the height",
            choices=("measured", "modelled"),
        ),
        an_id("source_id", "The id in the source, if new ids were assigned"),
    ),
)

SNAGS = Layer(
    name="releases",
    geometry=RELEASES.geometry,
    meaning="Dead standing trees as releases: upright, where they stand",
    columns=(
        *(RELEASES.column(name) for name in ("log_id", "release_id", "dbh_cm", "length_m", "orientation")),
        *(TREES.column(name) for name in ("species", "dbh_source")),
    ),
)

BARRIERS = Layer(
    name="barriers",
    geometry=("LineString",),
    meaning="Protection works: thin rigid plates, vertical from the terrain up, infinitely strong",
    columns=(
        an_id("barrier_id", "The barrier; unique. Missing: the row number, from 1"),
        a_number(
            "height_m",
            "Height of the plate above the terrain",
            0,
            BARRIER_M,
            exclusive=True,
            usual=(0.2, 30),
            required=True,
        ),
    ),
)

LYING_LOGS = Layer(
    name="lying_logs",
    geometry=("LineString",),
    meaning="Lying logs that hold others back: drawn from base to tip, at rest on the terrain",
    columns=(
        an_id("lying_id", "The lying log; unique. Missing: tree_id, log_id or name, else the row number"),
        a_number(
            "diameter_cm",
            "Diameter at the base. Missing: dbh_cm",
            *DBH_CM,
            exclusive=True,
            usual=(3, 300),
            default=40.0,
        ),
        a_number("tip_diameter_cm", "Diameter at the tip. Missing: half of the base's", 0, DBH_CM[1], exclusive=True),
        a_number(
            "capacity_kj",
            "Energy that it absorbs in a hit before it breaks and disappears for that log. Missing or empty: rigid",
            0,
            exclusive=True,
        ),
        a_number("height_m", "Height above ground at which it lies, from windthrow; logs are slid as if it were 0", 0),
    ),
)

BLOCKS = Layer(
    name="blocks",
    geometry=("Point",),
    meaning="Boulders that hold logs back: rigid spheres, on the terrain or partly embedded in it",
    columns=(
        an_id("block_id", "The block; unique. Missing: name, else the row number"),
        a_number(
            "diameter_m",
            "Diameter of the sphere. Missing: twice radius_m",
            0,
            BLOCK_M,
            exclusive=True,
            usual=(0.2, 15),
        ),
        a_number("radius_m", "Its radius, used where diameter_m is missing", 0, 0.5 * BLOCK_M, exclusive=True),
        a_number(
            "height_m",
            "Height of its top above the terrain, at most the diameter; less if it is partly embedded. Missing "
            "or empty: the diameter",
            0,
            BLOCK_M,
            exclusive=True,
        ),
    ),
)

LINES = Layer(
    name="lines",
    geometry=("LineString", "Polygon"),
    meaning="Roads, railways, houses and other objects that must not be reached, as lines or outlines",
    columns=(
        an_id("line_id", "The line; unique. Missing: name, else the row number"),
        a_text("name", "Its name, used where line_id is missing"),
    ),
)

STRUCTURES = Layer(
    name="structures",
    geometry=("LineString",),
    meaning="Axes of embankments (their crests) and ditches (their bottoms); columns override the options",
    columns=(
        *STRUCTURE,
        a_number(
            "height_m",
            "Height of the crest above the ground under the line; depth of a ditch",
            0,
            exclusive=True,
        ),
        a_number("elevation_m", "Elevation of the crest or bottom; overrides the height", -500, 9000),
        a_number("crest_width_m", "Width of the flat crest or bottom", 0, default=2.0),
        a_number("slope_deg", "Slope of both sides", 0, 90, exclusive=True, default=45.0),
        a_number("slope_left_deg", "Slope of the side on the left of the line", 0, 90, exclusive=True),
        a_number("slope_right_deg", "Slope of the side on its right", 0, 90, exclusive=True),
    ),
)

DEADWOOD = Layer(
    name="deadwood",
    geometry=("Point",),
    meaning="Mapped dead trees, standing or lying, for assess-mobilisation to rate",
    columns=(
        a_text("decay_stage", "Stage of Maser and Trappe, I to V or 1 to 5, with early or late before it where known"),
        a_number("years_dead", "Years since death, where the stage is not known", 0),
        a_text("species", "Binomial, or common name in German, French, Italian or English; for the years"),
        a_number(
            "standing",
            "1 if it stands, 0 if it lies; the years of species other than spruce are those of downed wood",
            0,
            1,
        ),
    ),
)

DEAD_TREES = Layer(
    name="dead_trees",
    geometry=TREES.geometry,
    meaning="Dead trees whose future age and decide estimate",
    columns=(
        *(TREES.column(name) for name in ("tree_id", "dbh_cm", "height_m", "species")),
        a_number("years_dead", "Years since death. Missing: the option of that name", 0, 200.0, default=0.0),
        a_number("standing", "1 if it stands, 0 if it lies. Missing: it stands", 0, 1, default=1.0),
    ),
)

BROUGHT = (RELEASES, TREES, BARRIERS, LYING_LOGS, BLOCKS, LINES, STRUCTURES, DEADWOOD, DEAD_TREES)
