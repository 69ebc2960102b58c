"""The layers of results."""

from __future__ import annotations

from deadwood_algorithms.schemas.brought import BARRIERS, LOG, RELEASE, STRUCTURE, TREES
from deadwood_algorithms.schemas.words import FULL_CIRCLE, Column, Layer, a_count, a_number, a_text, an_id

STOP_REASONS = ("rest", "tree", "barrier", "left_dem", "time_limit", "failed", "lying_log", "block")
STOPS = {  # in words, after the number of logs
    "rest": "at rest on the terrain",
    "tree": "held by a tree",
    "lying_log": "held by a lying log",
    "block": "held by a boulder",
    "barrier": "held by a barrier",
    "left_dem": "left the terrain model",
    "time_limit": "still moving at the time limit",
    "failed": "calculation failed",
}
VERDICTS = ("possible", "above_launch_line", "cuts_terrain", "hits_barrier")

IF_LOST = (
    a_count("n_lost", "Logs that left the terrain model without having reached it"),
    a_number("p_low_if_lost", "The share if none of the lost logs reaches it", 0, 1),
    a_number("p_high_if_lost", "The share if all of them do", 0, 1),
    a_number("ci_low_if_lost", "Lower end of the 95 % interval if none does", 0, 1),
    a_number("ci_high_if_lost", "Upper end if all do", 0, 1),
)
_LINE = an_id("line_id", "The line or polygon")
_SHARE = (
    a_count("n_total", "Logs whose trajectory is stored"),
    a_count("n_reach", "Of these, the logs that reach it"),
    a_number("p", "Their share", 0, 1),
    a_number("ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
    a_number("ci_high", "Upper end", 0, 1),
    *IF_LOST,
)
_STRENGTH = (
    a_number("speed_median_ms", "Median speed of the arriving logs", 0),
    a_number("speed_p95_ms", "95 % quantile of it", 0),
    a_number("energy_median_kj", "Median kinetic energy of translation of the arriving logs", 0),
    a_number("energy_p95_kj", "95 % quantile of it", 0),
    a_count("n_more", "Further arrivals needed to show all of these; 0 if none. A median needs 6, a 95 % quantile 72"),
)


def _outcome(name: str, does: str) -> tuple[Column, ...]:
    """The columns of assess-mobilisation."""
    return (
        a_number(name, f"Share of the logs released there that {does}, mean over the frictions", 0, 1),
        a_number(f"{name}_ci_low", "Lower end of its 95 % Wilson interval, for the number of logs", 0, 1),
        a_number(f"{name}_ci_high", "Upper end", 0, 1),
    )


_OUTCOMES = (
    *_outcome("starts", "move more than the stated distance"),
    *_outcome("goes_far", "move more than their length, or the stated distance"),
    *_outcome("reaches", "reach a line, where lines were given"),
)

ENDED = a_text("stop_reason", "How the log's run ended", choices=STOP_REASONS)
SIZE = (
    a_number("dbh_cm", "Diameter of the log's base", 0, exclusive=True),
    a_number("length_m", "Its length", 0, exclusive=True),
)

DEPOSITS = Layer(
    name="deposits",
    geometry=("Point Z",),
    meaning="Where each released log ended: its centre of mass; one row for every log",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        a_number("release_x", "Easting of the centre of mass at the start", unit="m"),
        a_number("release_y", "Northing of the centre of mass at the start", unit="m"),
        a_number("release_z", "Height of the centre of mass at the start", unit="m"),
        ENDED,
        an_id("stop_id", "The tree, barrier or, as lying:ID or block:ID, lying log or boulder that holds the log"),
        a_number("duration_s", "Time from start to end", 0),
        a_number("path_m", "Length of the path of the centre of mass", 0),
        a_number("runout_m", "Horizontal distance from start to end", 0),
        a_number("fall_m", "Height lost by the centre of mass"),
        a_number("bearing_deg", "From the release point to the deposit, clockwise from grid north", 0, FULL_CIRCLE),
        a_number(
            "heading_deg",
            "Azimuth of the log's axis at the end, from base to tip, clockwise from grid north",
            0,
            FULL_CIRCLE,
        ),
        a_number("tilt_deg", "Angle of the axis from the vertical at the end", 0, 180),
        a_number("speed_max_ms", "Largest speed of the centre of mass", 0),
        a_number(
            "speed_mean_ms",
            "Path divided by duration, which includes minutes of slow rolling for a log at its time limit",
            0,
        ),
        a_number("energy_max_kj", "Largest kinetic energy, of translation and rotation", 0),
        a_number("jump_max_m", "Largest clearance between the log and the terrain", 0),
        a_number("height_max_m", "Greatest height of the log's centre of mass above the terrain"),
        a_count("tree_hits", "Number of trees (standing or lying) and boulders that it hit"),
        a_count("barrier_hits", "Number of barriers that it hit"),
        a_count("tree_hits_above", "Hits that exceeded the capacity of a standing tree, or broke it (--break-trees)"),
        a_count("log_hits_above", "Hits that exceeded the capacity of the log; with --log-capacity-kj"),
        a_number("energy_error_rel", "Energy gained by numerical error, relative to the energy available"),
        a_number("penetration_max_m", "Deepest penetration of terrain, tree or barrier", 0),
        *SIZE,
        a_number("density_kg_m3", "Density of its wood", 0, exclusive=True),
    ),
)

DEPOSITED_LOGS = Layer(
    name="deposited_logs",
    geometry=("LineString Z",),
    meaning="The logs as they lie at the end: a line from base to tip",
    columns=(a_count("log_id", "The log"), RELEASE, ENDED, *SIZE),
)

TRAJECTORIES = Layer(
    name="trajectories",
    geometry=("LineString Z",),
    meaning="The path of the centre of mass of the logs with a stored trajectory",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        a_number("duration_s", "Time from start to end", 0),
        a_number("speed_max_ms", "Largest speed of the centre of mass", 0),
        ENDED,
    ),
)

POSES = Layer(
    name="poses",
    geometry=(),
    meaning="poses.parquet: one row for each stored pose, world coordinates; ordered by log, then time",
    columns=(
        a_count("log_id", "The log"),
        a_number("t_s", "Time since the start", 0),
        *(
            a_number(axis + end, f"{axis} of the {point}", unit="m")
            for end, point in (("", "centre of mass"), ("b", "centre of the base"), ("t", "centre of the tip"))
            for axis in "xyz"
        ),
        a_number("speed_ms", "Speed of the centre of mass", 0),
        a_number("spin_rad_s", "Rate of rotation", 0),
        a_number("clearance_m", "Lowest gap between log and terrain"),
        a_number("height_m", "Height of the centre of mass above the terrain"),
    ),
)

BARRIER_ARRIVALS = Layer(
    name="barrier_arrivals",
    geometry=("Point Z",),
    meaning="Every log that comes to a barrier, whether it hits it, jumps over it or passes beside it; at its "
    "centre of mass when it comes there",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        an_id("barrier_id", "The barrier"),
        a_number("t_s", "Time since the log's start", 0),
        a_number("speed_ms", "Speed of its centre of mass", 0),
        a_number("energy_kj", "Its kinetic energy, of translation and rotation", 0),
        a_number("rotation_kj", "Of this, the energy of rotation", 0),
        a_number(
            "height_needed_m",
            "Height above the terrain of its upper edge in the plane of the barrier, which a barrier there must exceed",
        ),
        a_count("hit", "1 if it hits the barrier, else 0"),
        a_count("stopped", "1 if the barrier holds it at the end, else 0"),
    ),
)

BARRIER_HITS = Layer(
    name="barrier_hits",
    geometry=("Point Z",),
    meaning="Every hit of a barrier, where the log first touched it; a hit lasts until 0.1 s pass without contact. "
    "Logs that jump over it are only in barrier_arrivals",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        an_id("barrier_id", "The barrier"),
        a_number("t_s", "Time of the first contact since the log's start", 0),
        a_number("duration_s", "From the first to the last contact of the hit", 0),
        a_number(
            "height_hit_m",
            "Height of the place above the terrain, never more than the barrier's: not the height that is needed there",
        ),
        a_number("speed_ms", "Speed of the log's centre of mass just before", 0),
        a_number("energy_kj", "Kinetic energy of the log just before, of translation and rotation", 0),
        a_number("energy_taken_kj", "Energy that the log lost to the barrier in this hit, by impact and friction"),
        a_number("impulse_kns", "Momentum that the barrier absorbed in impacts; steady load is left out", 0),
        a_number("angle_deg", "Between the log's velocity and the normal of the obstacle: 0 is head-on", 0, 180),
        a_count("stopped", "1 for the last hit of a log that the barrier holds at the end, else 0"),
    ),
)

TREE_HITS = Layer(
    name="tree_hits",
    geometry=("Point",),
    meaning="Every tree that was hit, and the energy and impulse that it absorbed: its protective value",
    columns=(
        an_id("tree_id", "The tree"),
        a_number("dbh_cm", "Diameter at breast height", 0),
        a_number("height_m", "Height of the tree", 0),
        a_count("n_logs", "Logs that hit it"),
        a_count("n_hits", "Hits; a hit lasts until 0.1 s pass without contact"),
        a_count("n_stops", "Logs that it holds at the end"),
        a_number("impulse_sum_kns", "Momentum that it absorbed in impacts, the sum of all hits", 0),
        a_number("impulse_max_kns", "The same of its hardest hit", 0),
        a_number("energy_taken_kj", "Energy that logs lost to it, by impact and friction, the sum of all hits"),
        a_count("n_above", "Hits that exceeded its capacity, or broke it; it stands again for each log"),
    ),
)

LYING_HITS = Layer(
    name="lying_hits",
    geometry=("LineString",),
    meaning="Every lying log that was hit, and the energy and impulse that it absorbed",
    columns=(
        an_id("lying_id", "The lying log"),
        *TREE_HITS.columns[3:-1],
        a_count("n_broken", "Hits that broke it, or a straight piece of it; for each log it lies there again"),
    ),
)

BLOCK_HITS = Layer(
    name="block_hits",
    geometry=("Point",),
    meaning="Every boulder that was hit, and the energy and impulse that it absorbed",
    columns=(
        an_id("block_id", "The boulder"),
        a_number("diameter_m", "Its diameter", 0),
        a_number("height_m", "Height of its top above the terrain", 0),
        *TREE_HITS.columns[3:-1],
    ),
)

EARTHWORKS = Layer(
    name="earthworks",
    geometry=("LineString",),
    meaning="What add-structures built, and the earth that it moved",
    columns=(
        *STRUCTURE,
        a_number("length_m", "Length of the line", 0),
        a_number("height_min_m", "Smallest height of the crest above the ground under the line; depth of a ditch"),
        a_number("height_max_m", "Largest height of the crest above the ground under the line; depth of a ditch"),
        a_number("fill_m3", "Volume between the old ground and the new above it", 0),
        a_number("cut_m3", "Volume between the new ground and the old above it", 0),
        a_number("area_m2", "Plan area of the changed cells", 0),
    ),
)

REACH = Layer(
    name="reach",
    geometry=("LineString", "Polygon"),
    meaning="Each line or polygon: the probability that logs reach it, and with which speed and energy they arrive",
    columns=(_LINE, *_SHARE, *_STRENGTH, a_number("clearance_max_m", "Largest clearance below an arriving log")),
)

REACH_OF_RUN = Layer(
    name="reach",
    geometry=REACH.geometry,
    meaning="Each line or polygon: the probability that logs of the run reach it",
    columns=(
        _LINE,
        a_count("n_total", "Logs that were released"),
        *_SHARE[1:],
    ),
)

REACHED_BY = Layer(
    name="reached_by",
    geometry=("Point Z",),
    meaning="One row for each log and line that it reached, where the log was released: where do arrivals come from?",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        _LINE,
        a_number("t_s", "Time of the first touch since the log's start", 0),
    ),
)

ARRIVALS = Layer(
    name="arrivals",
    geometry=("Point Z",),
    meaning="One row for each log and line: the log's centre of mass when its outline first touches the line",
    columns=(
        LOG,
        RELEASE,
        _LINE,
        a_number("t_s", "Time since the start", 0),
        a_number("path_m", "Length of the path of the centre of mass until then", 0),
        a_number("speed_ms", "Speed of the centre of mass", 0),
        a_number("energy_kj", "Kinetic energy of translation", 0),
        a_number("rotation_kj", "Kinetic energy of rotation, from the stored poses", 0),
        a_number("clearance_m", "Lowest gap between log and terrain"),
        a_number("height_m", "Height of the centre of mass above the terrain; empty without the terrain model"),
        a_number("azimuth_deg", "Direction of travel, clockwise from grid north", 0, FULL_CIRCLE),
        a_number(
            "impact_deg", "Angle in plan between direction of travel and line: 0 parallel, 90 perpendicular", 0, 90
        ),
        a_number("axis_deg", "Angle in plan between direction of travel and log: 0 end first, 90 broadside", 0, 90),
        a_number("touch_x", "Easting of the line's place that is nearest to the log", unit="m"),
        a_number("touch_y", "Northing of it", unit="m"),
        a_number("release_x", "Easting of the centre of mass at the start", unit="m"),
        a_number("release_y", "Northing of it", unit="m"),
        ENDED,
    ),
)

ATTRIBUTION = Layer(
    name="attribution",
    geometry=("LineString",),
    meaning="One row for each release and line: which release reaches which object; drawn from the release to "
    "the place of contact",
    columns=(
        RELEASE,
        _LINE,
        *_SHARE,
        a_number("share_of_arrivals", "Share of the line's arrivals that come from this release", 0, 1),
        *_STRENGTH,
    ),
)

SOURCES = Layer(
    name="sources",
    geometry=("MultiPolygon",),
    meaning="One row for each line and minimum share: the cells from which at least this share of the logs reach it",
    columns=(
        a_text("line_id", "The line or polygon, or `any line`"),
        a_number("least_p", "The minimum share of a cell's logs that reach it", 0, 1),
        a_number("area_m2", "Ground of the cells", 0),
        a_count("n_total", "Logs that were released there"),
        a_count("n_reach", "Of these, the logs that reach the line"),
        a_number("p", "Their share", 0, 1),
        a_number("ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
        a_number("ci_high", "Upper end", 0, 1),
    ),
)

AFFECTED = Layer(
    name="affected",
    geometry=("MultiPolygon",),
    meaning="One row for each release area and minimum share: the cells that at least this share of its logs pass",
    columns=(
        RELEASE,
        a_number("least_p", "The minimum share of the area's logs that pass a cell", 0, 1),
        a_number("area_m2", "Ground of the cells", 0),
        a_count("n_logs", "Logs of the area that are counted"),
    ),
)

PROCESS_AREA = Layer(
    name="process_area",
    geometry=("MultiPolygon",),
    meaning="The outline of the ground that at least this share of the logs pass; an indication map",
    columns=(
        a_number("least_p", "The minimum share of the logs that pass a cell; 0: any log", 0, 1),
        a_number("area_m2", "Ground of the cells; empty with fewer logs than it needs", 0),
        a_count("n_logs", "Logs of the run"),
        a_count("n_needed", "Logs from which the area is stated; empty for any log: it grows with every one"),
    ),
)

ORIGINS = Layer(
    name="origins",
    geometry=("Point",),
    meaning="The arrivals, each where its log was released: from where are lines reached",
    columns=tuple(
        ARRIVALS.column(name) for name in ("log_id", "release_id", "line_id", "t_s", "speed_ms", "energy_kj")
    ),
)

SPREAD = Layer(
    name="spread",
    geometry=("Polygon",),
    meaning="Each release: the sector that contains its deposits",
    columns=(
        RELEASE,
        a_count("n", "Logs of the release"),
        a_count("n_left_out", "Of these, deposits nearer than the minimum run-out"),
        a_number(
            "spread_deg", "Smallest angle that contains the others; it grows with the number of logs", 0, FULL_CIRCLE
        ),
        a_number("p05_p95_deg", "Angle between the 5 % and the 95 % quantile of their azimuths", 0, FULL_CIRCLE),
        a_number("p05_p95_ci_low_deg", "Lower end of its 95 % interval, by order statistics", 0, FULL_CIRCLE),
        a_number("p05_p95_ci_high_deg", "Upper end", 0, FULL_CIRCLE),
        a_count("p05_p95_n_more", "Further deposits needed to show these; 0 if none"),
        a_number("spread_half_deg", "Mean of spread_deg over random halves of the logs", 0, FULL_CIRCLE),
        a_count("n_left_dem", "Logs that left the terrain model"),
        a_count("n_near_edge", "Other logs that ended near its edges"),
        a_number("from_deg", "Azimuth at which the angle begins, clockwise", 0, FULL_CIRCLE),
        a_number("runout_max_m", "Distance of the farthest deposit from the centre of the release", 0),
    ),
)

AZIMUTHS = Layer(
    name="azimuths",
    geometry=("Point Z",),
    meaning="Each deposit as seen from the centre of its release",
    columns=(
        LOG,
        RELEASE,
        a_number("azimuth_deg", "Direction of the deposit, clockwise from grid north", 0, FULL_CIRCLE),
        a_number("distance_m", "Horizontal distance", 0),
        a_count("counted", "Whether it counts for the spread"),
        a_count("near_edge", "Whether it lies near an edge of the terrain model"),
    ),
)

FLIGHTS = Layer(
    name="flights",
    geometry=("LineString Z",),
    meaning="The path of the centre of mass between take-off and landing; a straight line if no parabola joins them",
    columns=(
        an_id("flight_id", "The flight. Missing: name, else the row number, from 1"),
        a_text("verdict", "Whether such a flight is possible, and if not, why not", choices=VERDICTS),
        a_number("distance_m", "Horizontal distance of the two points", 0),
        a_number("fall_m", "Height of the take-off above the landing"),
        a_number("takeoff_deg", "Angle of the path at the take-off, upward positive", -90, 90),
        a_text("angle_from", "Where that angle comes from", choices=("terrain", "given")),
        a_number("takeoff_speed_ms", "Speed at the take-off", 0),
        a_number("duration_s", "Time in the air", 0),
        a_number("apex_distance_m", "Horizontal distance of the highest point from the take-off", 0),
        a_number("apex_rise_m", "Height of the highest point above the take-off", 0),
        a_number("landing_speed_ms", "Speed at the landing", 0),
        a_number("landing_deg", "Angle of the path at the landing, upward positive", -90, 90),
        a_number("height_max_m", "Largest vertical distance of the centre of mass from the terrain", 0),
        a_number("cut_m", "Depth to which the terrain protrudes into the flight", 0),
        a_number("clearance_min_m", "Smallest clearance over a barrier; empty without one"),
        a_number("dbh_cm", "Diameter of the log", 0, exclusive=True),
        a_number("length_m", "Length of the log", 0, exclusive=True),
    ),
)

CLEARANCES = Layer(
    name="clearances",
    geometry=("Point Z",),
    meaning="Where a flight crosses a barrier: a point on its top",
    columns=(
        an_id("flight_id", "The flight"),
        an_id("barrier_id", "The barrier"),
        a_number("distance_m", "Horizontal distance from the take-off", 0),
        a_number("height_m", "Height of the barrier above the terrain", 0),
        a_number("clearance_m", "Clearance of the log's underside above the top of the barrier; negative: it hits"),
        a_number("speed_ms", "Speed of the log there", 0),
        a_count("free", "1 if the whole log is in the air while it passes, else 0"),
    ),
)

CANDIDATES = Layer(
    name="candidates",
    geometry=("Point",),
    meaning="Mapped deadwood in cells from which enough logs start; its decay is rated beside",
    keeps_source=True,
    columns=(
        a_text("decay", "Rating of its decay", choices=("critical", "possible", "outside", "unknown")),
        *_OUTCOMES,
        a_number("slope_deg", "Slope of its cell", 0, 90),
    ),
)

OTHERS = Layer(
    name="others",
    geometry=("Point",),
    meaning="The other mapped deadwood",
    keeps_source=True,
    columns=(
        *CANDIDATES.columns,
        a_text("reason", "Why: no log was released there, or too few of them start", choices=("off_dem", "ground")),
    ),
)

RELEASE_AREAS = Layer(
    name="release_areas",
    geometry=("Polygon",),
    meaning="Connected cells in which enough logs start or go far, the largest first",
    columns=(
        a_count("release_id", "The area, from 1", 1),
        a_number("area_m2", "Plan area", 0),
        a_count("n_logs", "Logs released in it"),
        *_OUTCOMES,
        a_number("slope_mean_deg", "Mean slope of its cells", 0, 90),
        a_count("n_candidates", "Mapped logs in it, where deadwood was given"),
    ),
)

_SCENARIO = a_text("scenario", "Name of the scenario")

MOVED = Layer(
    name="moved",
    geometry=("LineString",),
    meaning="Displacement of each log's deposit, from the first scenario to another",
    columns=(
        _SCENARIO,
        a_count("log_id", "The log"),
        RELEASE,
        a_number("moved_m", "Horizontal distance of the two deposits", 0),
        a_number("runout_change_m", "Increase of the run-out over the first scenario"),
        a_text("stop_reason", "How the log's run ended in this scenario", choices=STOP_REASONS),
        a_text("stop_reason_reference", "How it ended in the first", choices=STOP_REASONS),
    ),
)

CHANGED = Layer(
    name="changed",
    geometry=("Point",),
    meaning="Logs that reach a line in one of two scenarios only, where they were released",
    columns=(
        _SCENARIO,
        _LINE,
        a_count("log_id", "The log"),
        RELEASE,
        a_text("reached_in", "The scenario in which it does: this one's name, or the first's"),
    ),
)

SIMULATED = Layer(
    name="deposits",
    geometry=("Point",),
    meaning="The simulated deposits of every coefficient of friction",
    columns=(
        a_number("friction", "The coefficient"),
        a_count("log_id", "The log"),
        RELEASE,
        a_number("runout_m", "Horizontal distance from start to end", 0),
        a_number("speed_max_ms", "Largest speed of the centre of mass", 0),
        ENDED,
    ),
)

NO_DEPOSIT = Layer(
    name="no_deposit",
    geometry=SIMULATED.geometry,
    meaning="The last places of logs that have no deposit: they left the terrain model, failed, or still moved",
    columns=SIMULATED.columns,
)

OBSERVED = Layer(
    name="observed",
    geometry=("Point", "Point Z", "Polygon"),
    meaning="The event's deposits, as they were given",
    columns=(a_text("name", "Row of the deposit, and its release where it names one"),),
)

LOG_SOLIDS = Layer(
    name="log_solids",
    geometry=("MultiPolygon Z",),
    meaning="The logs at rest as solids, for a 3-D view",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        ENDED,
        a_number("duration_s", "Time from start to end; from then the solid is shown", 0),
    ),
)

LOG_OUTLINES = Layer(
    name="log_outlines",
    geometry=("Polygon",),
    meaning="The logs in motion, as outlines in plan, for QGIS's Temporal Controller",
    columns=(
        a_count("log_id", "The log"),
        RELEASE,
        a_number("speed_ms", "Speed of the centre of mass", 0),
        a_number("time_s", "Time since the start", 0),
        a_text("t", "The same as a date, from 2000-01-01 on; from then the outline is shown"),
        a_text("t_end", "Until then"),
    ),
)

RELEASE_AREA = Layer(
    name="release_area",
    geometry=("Polygon",),
    meaning="The circle in which the logs of the demo start",
    columns=(RELEASE,),
)

FOREST = Layer(
    name="forest",
    geometry=("Polygon",),
    meaning="The outline of the forest of the demo",
    columns=(a_text("name", "Its name"),),
)

_STATE = ("standing", "lying", "removed")

_REACHED = (
    a_count("n_total", "Logs of the run"),
    a_count("n_reach", "Of these, the logs that reach the line in the unchanged scene"),
)
_SHARE_OF_GAIN = (
    a_number("gain_p", "The same as a share of all logs", -1, 1),
    a_number("ci_low", "Lower end of its 95 % interval, of paired logs", -1, 1),
    a_number("ci_high", "Upper end", -1, 1),
)
_GAIN_IF_LOST = (
    a_number("gain_p_low_if_lost", "The smallest such share, whatever the logs that left the terrain model did", -1, 1),
    a_number("gain_p_high_if_lost", "The largest", -1, 1),
)
_WORTH = (
    a_text("kind", "What it is", choices=("tree", "lying_log", "barrier", "stand")),
    an_id("id", "Its id in its layer"),
    an_id("line_id", "The line or polygon"),
    *_REACHED,
)
_HOLDS = (
    a_count("stopped", "Logs that it holds at the end"),
    a_number("energy_taken_kj", "Energy that logs lost to it, by impact and friction, the sum of all hits"),
    a_count("rank", "Its place among those of its kind at this line, from 1: by gain, then stopped, then energy"),
)

VALUES = Layer(
    name="values",
    geometry=("Point",),
    meaning="One row for each tree, lying log, barrier or stand, and line: how many more logs would reach it without",
    columns=(
        *_WORTH,
        a_count("n_reach_without", "Logs that would reach the line without it"),
        a_number("gain_logs", "Additional logs that would reach the line without it; below 0: fewer"),
        *_SHARE_OF_GAIN,
        *_GAIN_IF_LOST,
        *_HOLDS,
    ),
)

REACH_BREAKING = Layer(
    name="reach_breaking",
    geometry=REACH.geometry,
    meaning="Each line or polygon: logs that reach it with rigid trees, and if those that would break absorb nothing",
    columns=(
        _LINE,
        *_REACHED,
        a_count("n_reach_breaking", "Logs that reach it if each continues without the trees that it breaks"),
        a_count("n_lost", "Others that left the terrain model before it, with rigid trees"),
        a_count("n_lost_breaking", "Others that left it before, each without the trees that it breaks"),
        a_number("gain_logs", "The second minus the first"),
        *_SHARE_OF_GAIN,
        *_GAIN_IF_LOST,
        a_number("ci_low_if_lost", "Lower end of the 95 % interval of the least", -1, 1),
        a_number("ci_high_if_lost", "Upper end of that of the largest", -1, 1),
    ),
)

BROKEN = Layer(
    name="broken",
    geometry=("Point",),
    meaning="Every tree that a log would break",
    columns=(
        *TREE_HITS.columns[:3],
        a_number("capacity_kj", "Energy that it absorbs before it breaks", 0),
        a_count("n_broken", "Logs that would break it, each meeting it again"),
    ),
)

PLANTED = Layer(
    name="planted",
    geometry=("Point",),
    meaning="One row for each candidate and line: how many fewer logs would reach the line with it",
    columns=(
        *_WORTH,
        a_count("n_reach_with", "Logs that would reach the line with it"),
        a_number("gain_logs", "Reduction of the logs that would reach the line with it; below 0: more"),
        *_SHARE_OF_GAIN,
        *_GAIN_IF_LOST,
        *_HOLDS,
    ),
)

BARRIER_CLASS = (
    a_text("barrier_class", "Weakest class that holds the energy; with --barrier-classes, for energies"),
    a_text("barrier_class_high", "The class that holds the upper end of its interval; empty if there is none"),
)
SITED_HITS = (
    a_number("n_stopped", "Logs that it holds", 0),
    a_number("n_overjumped", "Logs that pass above it", 0),
    a_number("n_passed_beside", "Logs that pass beside it", 0),
    a_number("n_come", "Logs that come to its place, taken without its plate: the same for all heights of a place", 0),
    a_number("energy_needed_p95_kj", "95 % percentile of their kinetic energy; empty without any", 0),
    a_number("energy_needed_ci_low_kj", "Lower end of its exact 95 % interval; empty where the logs are too few", 0),
    a_number("energy_needed_ci_high_kj", "Upper end", 0),
    a_number("height_needed_p95_m", "95 % percentile of the height of their upper edges there, above the terrain"),
    a_number("height_needed_ci_low_m", "Lower end of its exact 95 % interval"),
    a_number("height_needed_ci_high_m", "Upper end"),
    a_number("n_more", "Further logs needed to show these; 0 if none", 0),
    a_number("n_hit", "Logs that hit the barrier of this height; the percentiles are of the largest hit of each", 0),
    a_number("energy_hit_p95_kj", "95 % percentile of the kinetic energy of these just before; empty without a hit", 0),
    a_number("energy_hit_ci_low_kj", "Lower end of its exact 95 % interval; empty where the logs are too few", 0),
    a_number("energy_hit_ci_high_kj", "Upper end", 0),
    a_number("height_hit_p95_m", "95 % percentile of the height of the hits, never more than the barrier's own"),
    a_number("height_hit_ci_low_m", "Lower end of its exact 95 % interval"),
    a_number("height_hit_ci_high_m", "Upper end"),
    *BARRIER_CLASS,
)
SITED_GAIN = (
    a_number("gain_logs", "Reduction of the number of logs that reach a line by this barrier; below 0: an increase"),
    a_number("gain_p", "The same as a share of all logs", -1, 1),
    a_number("gain_ci_low", "Lower end of its 95 % interval, of paired logs", -1, 1),
    a_number("gain_ci_high", "Upper end", -1, 1),
)
SITED = Layer(
    name="barriers",
    geometry=BARRIERS.geometry,
    meaning="The run's own barriers and those chosen, with the effect of each when all stand; as slide-logs reads them",
    columns=(
        an_id("barrier_id", "The barrier"),
        BARRIERS.column("height_m"),
        a_count(
            "step", "Step in which it was chosen, from 1; 0: it is part of the run, and the further columns are empty"
        ),
        a_number("length_m", "Its length in plan", 0),
        a_number("above_m", "Height of its contour above the nearest place of a line; empty for a given line"),
        a_number("angle_deg", "Angle between it and the contours of the ground under it, in plan", 0, 90),
        a_number("n_flux", "Logs of the run that touch its line and a road, railway or house then or later", 0),
        *SITED_GAIN,
        *SITED_HITS,
    ),
)
STEMS = Layer(
    name="stems",
    geometry=("Point",),
    meaning="Every tree of windthrow, where it stood: the state of its stem in each scenario",
    columns=(
        an_id("tree_id", "The tree"),
        a_number("dbh_cm", "Diameter at breast height", 0),
        a_number("height_m", "Height of the tree before", 0),
        a_number("fall_deg", "Azimuth towards which it fell; empty where it stands", 0, FULL_CIRCLE),
        a_text("before", "Before the storm: it stands", choices=_STATE),
        a_text("after", "Right after it", choices=_STATE),
        a_text("later", "Years later", choices=_STATE),
        a_text("cleared", "State after all lying stems are removed", choices=_STATE),
    ),
)

SITE_COLUMNS = (
    a_text("site", "Its name"),
    a_text("status", "Whether its run exists", choices=("done", "failed")),
    a_text("message", "Why it failed"),
    a_text("line_id", "The line, of the run of the site; empty without lines"),
    a_count("released", "Logs that were run"),
    a_count("n_reach", "Of these, the logs that reach the line"),
    a_number("p", "Their share", 0, 1),
    a_number("ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
    a_number("ci_high", "Upper end", 0, 1),
    *IF_LOST,
    a_number("spread_deg", "Lateral spread; the widest of several releases", 0, FULL_CIRCLE),
    a_number("speed_max_ms", "Largest speed of any log", 0),
    a_number("energy_max_kj", "Largest kinetic energy of any log", 0),
    a_number("penetration_max_m", "Deepest penetration of a log into the ground or an obstacle (accuracy)", 0),
    a_number("wall_s", "Time that its logs took to slide", 0),
)
SITES = Layer(
    name="sites",
    geometry=("Polygon",),
    meaning="The sites, where their logs start: the rows of overview.csv",
    columns=SITE_COLUMNS,
)

# By name; layers that share the name of another (the reach of a run, the simulated deposits) are only in `written`.
RESULTS = (
    DEPOSITS,
    DEPOSITED_LOGS,
    TRAJECTORIES,
    POSES,
    BARRIER_ARRIVALS,
    BARRIER_HITS,
    TREE_HITS,
    LYING_HITS,
    BLOCK_HITS,
    REACHED_BY,
    LOG_SOLIDS,
    LOG_OUTLINES,
    EARTHWORKS,
    REACH,
    ARRIVALS,
    ATTRIBUTION,
    ORIGINS,
    SPREAD,
    AZIMUTHS,
    FLIGHTS,
    CLEARANCES,
    CANDIDATES,
    OTHERS,
    RELEASE_AREAS,
    MOVED,
    CHANGED,
    OBSERVED,
    RELEASE_AREA,
    FOREST,
    STEMS,
    SITES,
)

MAPPED_RELEASES = Layer(
    name="releases",
    geometry=("Point",),
    meaning="The mapped places of a site where logs start",
    columns=(RELEASE,),
)

MAPPED_FLIGHT = Layer(
    name="flight",
    geometry=("LineString",),
    meaning="The mapped flight of a site, from take-off to landing",
    columns=(
        a_text("flight_id", "Its name"),
        a_number("dbh_cm", "Diameter of the log", 0),
        a_number("length_m", "Its length", 0),
    ),
)

AGED = Layer(
    name="aged",
    geometry=TREES.geometry,
    meaning="Dead trees, one row for each reported year: the share of the draws in which each is in a state",
    columns=(
        TREES.column("tree_id"),
        a_count("year", "Years from now"),
        a_number("p_standing", "Probability that it stands", 0, 1),
        a_number("p_broken", "That it is broken: its upper part lies beside the snag", 0, 1),
        a_number("p_lying", "That it lies whole", 0, 1),
        a_number("p_gone", "That it has disappeared", 0, 1),
        a_number("p_critical", "That it is smooth and still strong, standing or lying", 0, 1),
    ),
)
