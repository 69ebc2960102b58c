"""The layers of the toolbox: what each column means, its unit and its bounds.

Tools check and describe layers from here, and the documentation is rendered from here. Standard library only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

ORIENTATIONS = ("upright", "lying", "tilted")
STRUCTURE_KINDS = ("embankment", "ditch")
STOP_REASONS = ("rest", "tree", "barrier", "left_dem", "time_limit", "failed", "lying_log")


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column; ``kind`` is int, number, text, or id (a whole number or text)."""

    name: str
    kind: str
    meaning: str
    unit: str = ""
    unit_in_name: str = ""
    minimum: float | None = None
    maximum: float | None = None
    exclusive: bool = False  # the minimum itself is not allowed
    required: bool = False
    choices: tuple[str, ...] = ()
    usual: tuple[float, float] | None = None  # a median below, or a value above, is more likely a mistaken unit
    default: float | str | None = None  # what a missing column takes, by the tool's option of that name


@dataclass(frozen=True, kw_only=True)
class Layer:
    """One layer; ``geometry`` lists what it may hold, as the file format calls it."""

    name: str
    geometry: tuple[str, ...]
    meaning: str
    columns: tuple[Column, ...]

    def column(self, name: str) -> Column:
        return next(each for each in self.columns if each.name == name)

    @property
    def required(self) -> tuple[str, ...]:
        return tuple(each.name for each in self.columns if each.required)


# Unit written after the last underscore of a name -> unit as shown. The contract's rule: units stand in the name.
UNITS = {
    "cm": "cm",
    "m": "m",
    "kg_m3": "kg/m³",
    "m2": "m²",
    "m3": "m³",
    "deg": "°",
    "ms": "m/s",
    "s": "s",
    "kj": "kJ",
    "kns": "kN s",
    "rel": "1",
    "rad_s": "rad/s",
}


def _number(name: str, meaning: str, low: float | None = None, high: float | None = None, **facts: object) -> Column:
    ending = next((each for each in sorted(UNITS, key=len, reverse=True) if name.endswith("_" + each)), "")
    unit = facts.pop("unit", UNITS.get(ending, ""))
    return Column(
        name=name,
        kind="number",
        meaning=meaning,
        unit=str(unit),
        unit_in_name=ending,
        minimum=low,
        maximum=high,
        **facts,  # type: ignore[arg-type]
    )


def _count(name: str, meaning: str, low: float | None = 0, **facts: object) -> Column:
    return Column(name=name, kind="int", meaning=meaning, minimum=low, **facts)  # type: ignore[arg-type]


def _id(name: str, meaning: str, **facts: object) -> Column:
    return Column(name=name, kind="id", meaning=meaning, **facts)  # type: ignore[arg-type]


def _text(name: str, meaning: str, **facts: object) -> Column:
    return Column(name=name, kind="text", meaning=meaning, **facts)  # type: ignore[arg-type]


_LOG = _count("log_id", "The log; unique. Missing: the row number, from 0")
_RELEASE = _id("release_id", "The release area, point or event that the log belongs to")
_AZIMUTH = 360.0

RELEASES = Layer(
    name="releases",
    geometry=("Point",),
    meaning="Where logs start: the plan position of each log's centre of mass",
    columns=(
        _LOG,
        _RELEASE,
        _number("dbh_cm", "Base diameter; the tip has half of it", 0, exclusive=True, usual=(3, 300), default=75.0),
        _number("length_m", "Length of the log", 0, exclusive=True, usual=(0.5, 80), default=30.0),
        _number("density_kg_m3", "Density of the wood", 0, exclusive=True, usual=(50, 1300), default=300.0),
        _text(
            "orientation",
            "upright (base down), lying (axis in the terrain's tangent plane, tip towards azimuth_deg) or tilted "
            "(axis tilt_deg from the vertical, tip towards azimuth_deg)",
            choices=ORIENTATIONS,
            default="upright",
        ),
        _number("tilt_deg", "Angle of the axis from the vertical, of a tilted log", 0, 180, default=0.0),
        _number("azimuth_deg", "Where tip and speed point, clockwise from grid north", 0, _AZIMUTH, default=0.0),
        _number("speed_ms", "Initial speed towards azimuth_deg, in the terrain's tangent plane", 0, default=0.0),
        _number("drop_m", "Clearance of the log's lowest point above the terrain at the start", 0, default=0.0),
    ),
)

TREES = Layer(
    name="trees",
    geometry=("Point",),
    meaning="Standing trees: rigid truncated cones, base diameter DBH, top half of it",
    columns=(
        _id("tree_id", "The tree; unique. Missing: the row number, from 0"),
        _number("dbh_cm", "Diameter at breast height", 0, exclusive=True, usual=(3, 300), required=True),
        _number("height_m", "Height of the tree", 0, exclusive=True, usual=(1.3, 80), required=True),
        _text("species", "Species as the source names it"),
        _number("crown_diameter_m", "Diameter of the crown", 0),
        _text(
            "dbh_source",
            "measured, or modelled where it was computed from the height",
            choices=("measured", "modelled"),
        ),
    ),
)

BARRIERS = Layer(
    name="barriers",
    geometry=("LineString",),
    meaning="Protection works: thin rigid plates, vertical from the terrain up, infinitely strong",
    columns=(
        _id("barrier_id", "The barrier; unique. Missing: the row number, from 0"),
        _number("height_m", "Height of the plate above the terrain", 0, exclusive=True, required=True),
    ),
)

LYING_LOGS = Layer(
    name="lying_logs",
    geometry=("LineString",),
    meaning="Logs that lie in the way and hold others back: drawn from base to tip, rigid, at rest on the terrain",
    columns=(
        _id("lying_id", "The lying log; unique. Missing: tree_id, log_id or name, else the row number"),
        _number(
            "diameter_cm", "Diameter at the base. Missing: dbh_cm", 0, exclusive=True, usual=(3, 300), default=40.0
        ),
        _number("tip_diameter_cm", "Diameter at the tip. Missing: half of the base's", 0, exclusive=True),
    ),
)

LINES = Layer(
    name="lines",
    geometry=("LineString", "Polygon"),
    meaning="What must not be reached: roads, railways, or the outlines of houses",
    columns=(
        _id("line_id", "The line; unique. Missing: name, else the row number"),
        _text("name", "Its name, used where line_id is missing"),
    ),
)

DEPOSITS = Layer(
    name="deposits",
    geometry=("Point Z",),
    meaning="Where each released log ended: its centre of mass; every log has its row",
    columns=(
        _count("log_id", "The log"),
        _RELEASE,
        _number("release_x", "Easting of the centre of mass at the start", unit="m"),
        _number("release_y", "Northing of the centre of mass at the start", unit="m"),
        _number("release_z", "Height of the centre of mass at the start", unit="m"),
        _text("stop_reason", "How the run ended", choices=STOP_REASONS),
        _id("stop_id", "The tree, barrier or, as lying:ID, lying log that holds the log"),
        _number("duration_s", "Time from start to end", 0),
        _number("path_m", "Length of the path of the centre of mass", 0),
        _number("runout_m", "Horizontal distance from start to end", 0),
        _number("fall_m", "Height lost by the centre of mass"),
        _number("bearing_deg", "From the release point to the deposit, clockwise from grid north", 0, _AZIMUTH),
        _number("heading_deg", "Of the log's axis at the end, base to tip, clockwise from grid north", 0, _AZIMUTH),
        _number("tilt_deg", "Angle of the axis from the vertical at the end", 0, 180),
        _number("speed_max_ms", "Largest speed of the centre of mass", 0),
        _number("speed_mean_ms", "Path over duration", 0),
        _number("energy_max_kj", "Largest kinetic energy, of translation and rotation", 0),
        _number("jump_max_m", "Largest clearance between the log and the terrain", 0),
        _count("tree_hits", "How many trees, standing or lying, it hit"),
        _count("barrier_hits", "How many barriers it hit"),
        _number("energy_error_rel", "Energy gained by the numbers, relative to the energy turned over"),
        _number("penetration_max_m", "Deepest penetration of terrain, tree or barrier", 0),
    ),
)

TRAJECTORIES = Layer(
    name="trajectories",
    geometry=("LineString Z",),
    meaning="The path of the centre of mass of the logs that are kept",
    columns=(
        _count("log_id", "The log"),
        _RELEASE,
        _number("duration_s", "Time from start to end", 0),
        _number("speed_max_ms", "Largest speed of the centre of mass", 0),
    ),
)

POSES = Layer(
    name="poses",
    geometry=(),
    meaning="poses.parquet: one row a kept pose, world coordinates; ordered by log, then time",
    columns=(
        _count("log_id", "The log"),
        _number("t_s", "Time since the start", 0),
        *(
            _number(axis + end, f"{axis} of the {point}", unit="m")
            for end, point in (("", "centre of mass"), ("b", "centre of the base"), ("t", "centre of the tip"))
            for axis in "xyz"
        ),
        _number("speed_ms", "Speed of the centre of mass", 0),
        _number("spin_rad_s", "Rate of rotation", 0),
        _number("clearance_m", "Lowest gap between log and terrain"),
    ),
)

BARRIER_HITS = Layer(
    name="barrier_hits",
    geometry=("Point Z",),
    meaning="Every hit of a barrier, where the log first touched it; a hit lasts until 0.1 s pass without a push",
    columns=(
        _count("log_id", "The log"),
        _RELEASE,
        _id("barrier_id", "The barrier"),
        _number("t_s", "Time of the first push since the log's start", 0),
        _number("duration_s", "From the first to the last push of the hit", 0),
        _number("height_m", "Height of the place above the terrain"),
        _number("speed_ms", "Speed of the log's centre of mass just before", 0),
        _number("energy_kj", "Kinetic energy of the log just before, of translation and rotation", 0),
        _number("energy_taken_kj", "Energy that the log lost to the barrier in this hit, by impact and friction"),
        _number("impulse_kns", "Momentum that the barrier took up in blows; steady leaning is left out", 0),
        _number("angle_deg", "Between the log's velocity and the square on what it hit: 0 is head-on", 0, 180),
        _count("stopped", "1 for the last hit of a log that the barrier holds at the end, else 0"),
    ),
)

TREE_HITS = Layer(
    name="tree_hits",
    geometry=("Point",),
    meaning="Every tree that was hit, and what it took of the logs: its protective value",
    columns=(
        _id("tree_id", "The tree"),
        _number("dbh_cm", "Diameter at breast height", 0),
        _number("height_m", "Height of the tree", 0),
        _count("n_logs", "Logs that hit it"),
        _count("n_hits", "Hits; a hit lasts until 0.1 s pass without a push"),
        _count("n_stops", "Logs that it holds at the end"),
        _number("impulse_sum_kns", "Momentum that it took up in blows, the sum of all hits", 0),
        _number("impulse_max_kns", "The same of its hardest hit", 0),
        _number("energy_taken_kj", "Energy that logs lost to it, by impact and friction, the sum of all hits"),
    ),
)

LAYERS = {layer.name: layer for layer in (RELEASES, TREES, BARRIERS, LINES, DEPOSITS, TRAJECTORIES, POSES)}
LYING_HITS = Layer(
    name="lying_hits",
    geometry=("LineString",),
    meaning="Every lying log that was hit, and what it took of the sliding ones",
    columns=(_id("lying_id", "The lying log"), *TREE_HITS.columns[3:]),
)

LAYERS |= {layer.name: layer for layer in (LYING_LOGS, BARRIER_HITS, TREE_HITS, LYING_HITS)}

_STRUCTURE = (
    _id("structure_id", "The embankment or ditch. Missing: name, else the row number, from 0"),
    _text("kind", "embankment or ditch", choices=STRUCTURE_KINDS, default="embankment"),
)

STRUCTURES = Layer(
    name="structures",
    geometry=("LineString",),
    meaning="Axes of embankments (their crests) and ditches (their bottoms); columns go before the options",
    columns=(
        *_STRUCTURE,
        _number(
            "height_m", "Height of the crest above the ground under the line, of a ditch its depth", 0, exclusive=True
        ),
        _number("elevation_m", "Elevation of the crest or bottom; goes before the height"),
        _number("crest_width_m", "Width of the flat crest or bottom", 0, default=2.0),
        _number("slope_deg", "Slope of both sides", 0, 90, exclusive=True, default=45.0),
        _number("slope_left_deg", "Slope of the side on the left of the line", 0, 90, exclusive=True),
        _number("slope_right_deg", "Slope of the side on its right", 0, 90, exclusive=True),
    ),
)

EARTHWORKS = Layer(
    name="earthworks",
    geometry=("LineString",),
    meaning="What add-structures built, and the earth that it moved",
    columns=(
        *_STRUCTURE,
        _number("length_m", "Length of the line", 0),
        _number("height_min_m", "Least height of the crest above the ground under the line, of a ditch depth"),
        _number("height_max_m", "Largest height of the crest above the ground under the line, of a ditch depth"),
        _number("fill_m3", "Volume between the old ground and the new above it", 0),
        _number("cut_m3", "Volume between the new ground and the old above it", 0),
        _number("area_m2", "Plan area of the changed cells", 0),
    ),
)

LAYERS |= {layer.name: layer for layer in (STRUCTURES, EARTHWORKS)}

# What `reach-lines` and `lateral-spread` leave.
_LINE = _id("line_id", "The line or polygon")
_SHARE = (
    _count("n_total", "Logs whose trajectory is stored"),
    _count("n_reach", "Of these, the logs that reach it"),
    _number("p", "Their share", 0, 1),
    _number("ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
    _number("ci_high", "Upper end", 0, 1),
)
_STRENGTH = (
    _number("speed_median_ms", "Median speed of the arriving logs", 0),
    _number("speed_p95_ms", "95 % quantile of it", 0),
    _number("energy_median_kj", "Median kinetic energy of translation of the arriving logs", 0),
    _number("energy_p95_kj", "95 % quantile of it", 0),
)

REACH = Layer(
    name="reach",
    geometry=("LineString", "Polygon"),
    meaning="Each line or polygon: how probably logs reach it, and how fast and hard they arrive",
    columns=(_LINE, *_SHARE, *_STRENGTH, _number("clearance_max_m", "Largest clearance below an arriving log")),
)

ARRIVALS = Layer(
    name="arrivals",
    geometry=("Point Z",),
    meaning="One row a log and line: the log's centre of mass when its outline first touches the line",
    columns=(
        _LOG,
        _RELEASE,
        _LINE,
        _number("t_s", "Time since the start", 0),
        _number("path_m", "Length of the path of the centre of mass until then", 0),
        _number("speed_ms", "Speed of the centre of mass", 0),
        _number("energy_kj", "Kinetic energy of translation", 0),
        _number("rotation_kj", "Kinetic energy of rotation, as poses tell it", 0),
        _number("clearance_m", "Lowest gap between log and terrain"),
        _number("height_m", "Height of the centre of mass above the terrain; empty without the terrain model"),
        _number("azimuth_deg", "Direction of travel, clockwise from grid north", 0, _AZIMUTH),
        _number("impact_deg", "Angle in plan between direction of travel and line: 0 along it, 90 square on", 0, 90),
        _number("axis_deg", "Angle in plan between direction of travel and log: 0 end first, 90 broadside", 0, 90),
        _number("touch_x", "Easting of the line's place that is nearest to the log", unit="m"),
        _number("touch_y", "Northing of it", unit="m"),
        _number("release_x", "Easting of the centre of mass at the start", unit="m"),
        _number("release_y", "Northing of it", unit="m"),
        _text("stop_reason", "How the log's run ended", choices=STOP_REASONS),
    ),
)

ATTRIBUTION = Layer(
    name="attribution",
    geometry=("LineString",),
    meaning="One row a release and line: which release hits what; drawn from the release to where its logs touch",
    columns=(
        _RELEASE,
        _LINE,
        *_SHARE,
        _number("share_of_arrivals", "Share of the line's arrivals that come from this release", 0, 1),
        *_STRENGTH,
    ),
)

ORIGINS = Layer(
    name="origins",
    geometry=("Point",),
    meaning="The arrivals, each where its log was released: from where is a line hit",
    columns=tuple(
        ARRIVALS.column(name) for name in ("log_id", "release_id", "line_id", "t_s", "speed_ms", "energy_kj")
    ),
)

SPREAD = Layer(
    name="spread",
    geometry=("Polygon",),
    meaning="Each release: the sector that holds its deposits",
    columns=(
        _RELEASE,
        _count("n", "Logs of the release"),
        _count("n_left_out", "Of these, deposits nearer than the least run-out"),
        _number("spread_deg", "Smallest angle that holds the others; it grows with the number of logs", 0, _AZIMUTH),
        _number("p05_p95_deg", "Angle between the 5 % and the 95 % quantile of their azimuths", 0, _AZIMUTH),
        _number("p05_p95_low_deg", "Lower end of its 95 % interval, by bootstrap over the logs", 0, _AZIMUTH),
        _number("p05_p95_high_deg", "Upper end", 0, _AZIMUTH),
        _number("spread_half_deg", "Mean of spread_deg over random halves of the logs", 0, _AZIMUTH),
        _count("n_left_dem", "Logs that left the terrain model"),
        _count("n_near_edge", "Other logs that ended near its edges"),
        _number("from_deg", "Azimuth at which the angle begins, clockwise", 0, _AZIMUTH),
        _number("runout_max_m", "Distance of the farthest deposit from the centre of the release", 0),
    ),
)

AZIMUTHS = Layer(
    name="azimuths",
    geometry=("Point Z",),
    meaning="Each deposit as seen from the centre of its release",
    columns=(
        _LOG,
        _RELEASE,
        _number("azimuth_deg", "Direction of the deposit, clockwise from grid north", 0, _AZIMUTH),
        _number("distance_m", "Horizontal distance", 0),
        _count("counted", "Whether it counts for the spread"),
        _count("near_edge", "Whether it lies near an edge of the terrain model"),
    ),
)

LAYERS |= {layer.name: layer for layer in (REACH, ARRIVALS, ATTRIBUTION, ORIGINS, SPREAD, AZIMUTHS)}

VERDICTS = ("possible", "above_launch_line", "cuts_terrain", "hits_barrier")

FLIGHTS = Layer(
    name="flights",
    geometry=("LineString Z",),
    meaning="The path of the centre of mass between take-off and landing; a straight line where no parabola joins them",
    columns=(
        _id("flight_id", "The flight. Missing: name, else the row number, from 0"),
        _text("verdict", "Whether the log can have flown so, and if not, why not", choices=VERDICTS),
        _number("distance_m", "Horizontal distance of the two points", 0),
        _number("fall_m", "Height of the take-off above the landing"),
        _number("takeoff_deg", "Angle of the path at the take-off, upward positive", -90, 90),
        _text("angle_from", "Where that angle comes from", choices=("terrain", "given")),
        _number("takeoff_speed_ms", "Speed at the take-off", 0),
        _number("duration_s", "Time in the air", 0),
        _number("apex_distance_m", "Horizontal distance of the highest point from the take-off", 0),
        _number("apex_rise_m", "Height of the highest point above the take-off", 0),
        _number("landing_speed_ms", "Speed at the landing", 0),
        _number("landing_deg", "Angle of the path at the landing, upward positive", -90, 90),
        _number("height_max_m", "Largest vertical distance of the centre of mass from the terrain", 0),
        _number("cut_m", "Depth to which the terrain stands into the flight", 0),
        _number("clearance_min_m", "Least clearance over a barrier; empty without one"),
        _number("dbh_cm", "Diameter of the log", 0, exclusive=True),
        _number("length_m", "Length of the log", 0, exclusive=True),
    ),
)

CLEARANCES = Layer(
    name="clearances",
    geometry=("Point Z",),
    meaning="Where a flight crosses a barrier: a point on its top",
    columns=(
        _id("flight_id", "The flight"),
        _id("barrier_id", "The barrier"),
        _number("distance_m", "Horizontal distance from the take-off", 0),
        _number("height_m", "Height of the barrier above the terrain", 0),
        _number("clearance_m", "Of the log's underside above the top of the barrier; negative: it hits"),
        _number("speed_ms", "Speed of the log there", 0),
        _count("free", "1 if the whole log is in the air while it passes, else 0"),
    ),
)

LAYERS |= {layer.name: layer for layer in (FLIGHTS, CLEARANCES)}

_GROUND = (
    _number("susceptibility", "How easily a log starts there, 0 to 1 (assess-mobilisation says how)", 0, 1),
    _number("slope_deg", "Slope of the terrain at the scale of a log", 0, 90),
    _number("roughness_m", "Standard deviation of the heights about the fitted surface", 0),
    _count("gully", "1 in a gully, else 0"),
)

DEADWOOD = Layer(
    name="deadwood",
    geometry=("Point",),
    meaning="Mapped dead trees, standing or lying, as assess-mobilisation judges them",
    columns=(
        _text("decay_stage", "Stage of Maser and Trappe, I to V or 1 to 5, with early or late before it where known"),
        _number("years_dead", "Years since death, where the stage is not known", 0),
        _text("species", "Latin, English, German, French or Italian; for the years"),
    ),
)

CANDIDATES = Layer(
    name="candidates",
    geometry=("Point",),
    meaning="Mapped deadwood that could start to slide; all columns of the source, and these",
    columns=(_text("decay", "What its decay says", choices=("critical", "possible", "outside", "unknown")), *_GROUND),
)

OTHERS = Layer(
    name="others",
    geometry=("Point",),
    meaning="Mapped deadwood that could not; all columns of the source, and these",
    columns=(
        *CANDIDATES.columns,
        _text("reason", "Why not", choices=("off_dem", "ground", "decay", "decay and ground")),
    ),
)

RELEASE_AREAS = Layer(
    name="release_areas",
    geometry=("Polygon",),
    meaning="Connected ground on which a log could start to slide, the largest first",
    columns=(
        _count("release_id", "The area, from 1", 1),
        _number("area_m2", "Plan area", 0),
        _number("susceptibility_mean", "Mean of its cells", 0, 1),
        _number("susceptibility_max", "Largest of its cells", 0, 1),
        _number("slope_mean_deg", "Mean slope at the scale of a log", 0, 90),
        _number("gully_share", "Share of its cells in a gully", 0, 1),
        _count("n_candidates", "Mapped logs in it that could start, where deadwood was given"),
    ),
)

LAYERS |= {layer.name: layer for layer in (DEADWOOD, CANDIDATES, OTHERS, RELEASE_AREAS)}


def columns_of(name: str) -> tuple[Column, ...]:
    """The columns of a layer, none for a name that is not in the table."""
    return LAYERS[name].columns if name in LAYERS else ()


def value_fault(column: Column, value: object) -> str | None:
    """What is wrong with one value, or None; a number is checked against its bounds, a text against its choices."""
    if column.choices and value not in column.choices:
        return f"'{value}' is not one of {', '.join(column.choices)}"
    if column.kind not in ("number", "int"):
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return f"'{value}' is not a finite number"
    if column.kind == "int" and value != int(value):
        return f"{value:g} is not a whole number"
    if column.minimum is not None and (value < column.minimum or (column.exclusive and value == column.minimum)):
        return f"{value:g} is not {'greater than' if column.exclusive else 'at least'} {column.minimum:g}"
    if column.maximum is not None and value > column.maximum:
        return f"{value:g} is not at most {column.maximum:g}"
    return None
