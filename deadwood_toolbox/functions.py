"""Each tool as a function, and what it leaves as a class.

Written by ``python -m deadwood_toolbox.catalogue`` from the tools' declarations; edit those, not this file.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Literal

from deadwood_algorithms.params.tool import Feedback
from deadwood_toolbox.calls import call
from deadwood_toolbox.result import LayerPart, RasterPart, Result, Run, TablePart

if TYPE_CHECKING:
    from deadwood_toolbox.calls import (
        LayerInput,
        NumbersInput,
        PathInput,
        PathsInput,
        RasterInput,
        TableInput,
        TerrainInput,
    )

__all__ = [
    "AddStructuresResult",
    "AssessMobilisationResult",
    "BreakTreesResult",
    "CalibrateFrictionResult",
    "CheckResult",
    "CompareFidelityResult",
    "CompareScenariosResult",
    "CountHitsResult",
    "DemoResult",
    "DesignValuesResult",
    "ExploreResult",
    "FindTreesResult",
    "FitFlightResult",
    "GenerateForestResult",
    "ImportTreesResult",
    "InspectResult",
    "LateralSpreadResult",
    "MakeLogResult",
    "MakeReportResult",
    "MapIntensityResult",
    "MapOriginsResult",
    "ReachLinesResult",
    "ReproducePaperResult",
    "RunSitesResult",
    "SampleReleasesResult",
    "SiteBarriersResult",
    "SlideLogsResult",
    "ValueTreesResult",
    "VaryResult",
    "ViewResult",
    "WarmUpResult",
    "WindthrowResult",
    "add_structures",
    "assess_mobilisation",
    "break_trees",
    "calibrate_friction",
    "check",
    "compare_fidelity",
    "compare_scenarios",
    "count_hits",
    "demo",
    "design_values",
    "explore",
    "find_trees",
    "fit_flight",
    "generate_forest",
    "import_trees",
    "inspect",
    "lateral_spread",
    "make_log",
    "make_report",
    "map_intensity",
    "map_origins",
    "reach_lines",
    "reproduce_paper",
    "run_sites",
    "sample_releases",
    "site_barriers",
    "slide_logs",
    "value_trees",
    "vary",
    "view",
    "warm_up",
    "windthrow",
]


class InspectResult(Result):
    """What `inspect` leaves."""


def inspect(
    path: PathInput,
    *,
    as_: Literal["dem", "chm", "friction", "trees", "releases", "lines", "areas", "barriers", None] = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> InspectResult:
    """Look at a file before it is used: what it is taken for and why, what becomes of each column, and what is
    doubted.

    The file is read as the tools read it in that role, with the same checks, and nothing is written. Without
    ``as_`` the role follows from the file: a raster is a terrain model, a canopy model or friction, lines are
    roads or barriers, points and polygons are trees, releases or release areas, by their columns. The report
    ends with the commands that use it.

    The exit status is 0 if the file can be used, 3 if something about it is doubted, and 2 if it cannot be used
    in that role.

    Parameters
    ----------
    path : required
        File to look at.
    as_ : one of dem, chm, friction, trees, releases, lines, areas, barriers
        Role in which it is to be used. Without it: what it looks like.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("inspect", InspectResult, locals())


class AssessMobilisationResult(Result):
    """What `assess_mobilisation` leaves."""

    mobilisation = RasterPart("--output")
    """What logs do that are released in the cell"""
    release_areas = LayerPart("--release-areas", "release_areas")
    """Connected cells in which enough logs start or go far, the largest first"""
    candidates = LayerPart("--assessed", "candidates")
    """Mapped deadwood in cells from which enough logs start; its decay is rated beside"""
    others = LayerPart("--assessed", "others")
    """The other mapped deadwood"""


def assess_mobilisation(
    *,
    dem: TerrainInput,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: float | RasterInput | LayerInput = 0.25,
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted", "random", "random-lying"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    friction_range: str | list[str] | None = None,
    cell_m: float = 10.0,
    logs_per_cell: int = 5,
    logs: int | None = None,
    within: LayerInput | None = None,
    start_m: float = 5.0,
    stage_field: str | None = None,
    years_field: str | None = None,
    species_field: str | None = None,
    standing_field: str | None = None,
    years_from: float = 2.0,
    years_to: float = 5.0,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    areas_by: Literal["starts", "goes_far", "reaches"] = "goes_far",
    threshold: float = 0.1,
    min_area_m2: float = 100.0,
    fidelity: Literal["draft", "standard", "fine", "reference"] = "draft",
    deadwood: LayerInput | None = None,
    output: str | os.PathLike[str] | None = None,
    release_areas: str | os.PathLike[str] | bool | None = None,
    assessed: str | os.PathLike[str] | bool | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> AssessMobilisationResult:
    """Assess where a log could start to slide: logs slide from all ground; the share that starts, by cell, and
    areas.

    Logs of one size and posture are released all over the terrain, logs_per_cell in each cell of cell_m, and
    slide at `draft`, each with the lowest, the middle and the highest friction of friction_range. output has
    for each cell, with 95 % intervals for the number of its logs:

    - starts: the share that moves more than start_m (an upright log that only falls over has not started);
    - goes_far: the share that moves more than its own length, or min_runout_m;
    - reaches: the share that reaches one of lines.

    The frictions count as equally likely. The printed lines and the facts give each share with each friction.
    Logs that leave the terrain model before it is known count as gone far, but not as arrived; within restricts
    the starts to ground that is far enough from its edges. `release_areas` are connected cells in which at
    least threshold of the logs do what areas_by names, with the shares of all their logs.

    What holds a log on less than a cell of the terrain model (stones, stumps, roots, a hollow) is not modelled:
    the shares are those of logs that nothing of this kind holds. Give mapped stumps, boulders and lying wood as
    trees, blocks and lying_logs. Nor is a trigger modelled (storm, snow, felling): a share is no probability
    per year.

    ``assessed`` splits mapped ``deadwood`` (points) by the ground into the layers ``candidates`` and
    ``others``. Its decay is rated beside, and changes no share and no split: in late stage II to early III
    (Maser and Trappe) wood is smooth but still strong, ``critical``. The stage is taken from a field
    ``decay_stage``, otherwise from ``years_dead`` and ``species`` (spruce: 2 to 5 years; beech and Scots pine
    by their rates of decay on the ground, which do not hold for snags: a field ``standing``, 1 or 0, tells
    them). Species are recognised by scientific or common name (German, French, Italian, English).

    Parameters
    ----------
    dem : required
        Terrain model. A raster, a folder of tiles, or tiles separated by commas.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0, default 0.25
        Friction coefficient. A number, a raster, or polygons with a field 'friction' or 'mu'.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH of the logs.
    length_m : m, 0 < x <= 150, default 30
        Length of the logs.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density of the logs.
    orientation : one of upright, lying, tilted, random, random-lying, default upright
        Posture of the logs.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Distance beyond which a log goes far. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    friction_range : optional
        Range of the friction. A-B: logs slide with both ends and with friction. Default: 20 % below it to 20
        % above.
    cell_m : m, > 0, default 10
        Cell size of the result. Rounded to whole cells of the terrain model.
    logs_per_cell : 1 <= x <= 10000, default 5
        Logs released in each cell.
    logs : >= 1
        Logs to slide in all, at most. A random subset; cells without a log have no value. Default: all.
    within : polygon
        Ground on which logs start. Default: all of it.
    start_m : m, >= 0, default 5
        Distance that a log moves which starts.
    stage_field : optional
        Field of the stage of decay. Without it: decay_stage.
    years_field : optional
        Field of the years since death. Without it: years_dead.
    species_field : optional
        Field of the species. Without it: species.
    standing_field : optional
        Field that is 1 if it stands, 0 if it lies. Without it: standing.
    years_from : >= 0, default 2
        Years since death from which spruce is smooth.
    years_to : >= 0, default 5
        Years since death up to which spruce is strong.
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    areas_by : one of starts, goes_far, reaches, default goes_far
        Outcome by which release areas are drawn.
    threshold : 0 < x <= 1, default 0.1
        Smallest share of a cell's logs in a release area.
    min_area_m2 : m², >= 0, default 100
        Smallest release area.
    fidelity : one of draft, standard, fine, reference, default draft
        Speed against accuracy.
    deadwood : point
        Mapped deadwood.
    output : output, optional
        Shares of the logs by cell (.tif). Without it, in a temporary folder that lasts as long as the result.
    release_areas : output, optional
        Release areas (.gpkg). True: beside the main output.
    assessed : output, optional
        Mapped deadwood, rated (.gpkg). True: beside the main output.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("assess-mobilisation", AssessMobilisationResult, locals())


class SampleReleasesResult(Result):
    """What `sample_releases` leaves."""

    releases = LayerPart("--output", "releases")
    """Where logs start: the plan position of each log's centre of mass"""


def sample_releases(
    *,
    areas: LayerInput | None = None,
    dem: TerrainInput,
    weights: RasterInput | None = None,
    count: int = 2000,
    logs_per_ha: float | None = None,
    radius_m: float = 10.0,
    release_id_field: str | None = None,
    preset: Literal[
        "klosters",
        "rothenbrunnen",
        "spruce-critical",
        "spruce-critical-wet",
        "beech-critical",
        "beech-critical-wet",
        "pine-critical",
        "pine-critical-wet",
    ] = "klosters",
    dbh_cm: float | None = None,
    dbh_sd_cm: float = 0.0,
    length_m: float | None = None,
    length_sd_m: float = 0.0,
    correlation: float = 0.8,
    density_kg_m3: float | None = None,
    density_sd_kg_m3: float = 0.0,
    deadwood: TableInput | None = None,
    orientation: Literal["upright", "lying", "tilted", "random", "random-lying"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    seed: int = 0,
    crs: str | int | None = None,
    overwrite: bool = False,
    output: str | os.PathLike[str] | None = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> SampleReleasesResult:
    """Draw the start positions of logs inside release areas, and the properties of each log.

    The result is the releases layer of ``slide-logs``. Positions are uniform by area, inside a circle around
    each point (10 m in the paper) or inside a polygon or multipolygon without its holes. With a raster of
    ``weights``, such as the shares of ``assess-mobilisation``, their density follows its first band, inside the
    areas, or without areas wherever it is above 0. Every area gets ``count`` logs, or ``logs_per_ha`` times its
    area (without areas: times the area of the cells above 0).

    `preset` sets the properties of the logs by name, with the source (`deadwood-tool list --presets` lists
    all). Explicit options override it. A preset of a species has the density of its critical stage of decay,
    and a relation of DBH and length that gives one from the other.

    The logs of an area are equal unless their sizes are drawn: from normal distributions with ``dbh_sd_cm``,
    ``length_sd_m`` and ``density_sd_kg_m3`` around the means (impossible sizes are drawn again, and counted in
    a note), or from the rows of a table of mapped deadwood (``deadwood``, as ``import-trees --snags`` writes
    it). Columns of the areas override the options of the same names; columns of the mapped deadwood override
    both. The axis is upright, lying, tilted, ``random`` (any direction in space) or ``random-lying`` (on the
    ground, any azimuth).

    Log k has the same id, position and size however many logs are drawn, because its draws depend on the seed
    and its id alone. Ids start at 1 and alternate between the areas (area 1, 2, ..., 1, 2, ...), so a larger
    ``count`` only adds logs.

    The tool does not assess where wood could start to slide (``assess-mobilisation`` does). Source: the paper,
    section 3.3 (small perturbations of the position are the statistical variable).

    Parameters
    ----------
    areas : point or polygon
        Release points or polygons. May be left out with weights.
    dem : required
        Terrain (DEM); its CRS is that of the output. A raster, a folder of tiles, or tiles separated by commas.
    weights : optional
        Raster: relative density of starts. Any values of at least 0.
    count : 1 <= x <= 1000000000, default 2000
        Logs per area.
    logs_per_ha : 1/ha, > 0
        Logs per hectare of each area, in place of the count.
    radius_m : m, >= 0, default 10
        Radius of the circle around a point.
    release_id_field : optional
        Field with the names of the areas. Without it: release_id, else the row number from 1.
    preset : one of klosters, rothenbrunnen, spruce-critical, spruce-critical-wet, beech-critical,
      beech-critical-wet, pine-critical, pine-critical-wet, default klosters
        Properties of the logs, by name. klosters: the logs of Klosters 2022 (dbh_cm 75, length_m 30,
        density_kg_m3 300); rothenbrunnen: the log of Rothenbrunnen 2022 (dbh_cm 30, length_m 15, density_kg_m3
        300); spruce-critical: spruce without bark and branches that does not break yet, 2 to 5 years after
        death, moisture 0 % of the dry mass: 374 to 339 kg/m³ (density_kg_m3 357); spruce-critical-wet: spruce
        without bark and branches that does not break yet, 2 to 5 years after death, moisture 30 % of the dry
        mass: 487 to 441 kg/m³ (density_kg_m3 464); beech-critical: beech without bark and branches that does
        not break yet, 1.2 to 3.1 years after death, moisture 0 % of the dry mass: 543 to 492 kg/m³
        (density_kg_m3 517); beech-critical-wet: beech without bark and branches that does not break yet, 1.2 to
        3.1 years after death, moisture 30 % of the dry mass: 706 to 639 kg/m³ (density_kg_m3 673);
        pine-critical: pine without bark and branches that does not break yet, 2.1 to 5.2 years after death,
        moisture 0 % of the dry mass: 393 to 356 kg/m³ (density_kg_m3 375); pine-critical-wet: pine without bark
        and branches that does not break yet, 2.1 to 5.2 years after death, moisture 30 % of the dry mass: 511
        to 463 kg/m³ (density_kg_m3 487).
    dbh_cm : cm, 0 < x <= 1500
        DBH. Default: that of the preset.
    dbh_sd_cm : cm, >= 0, default 0
        Standard deviation of the DBH.
    length_m : m, 0 < x <= 150
        Length. Default: that of the preset.
    length_sd_m : m, >= 0, default 0
        Standard deviation of the length.
    correlation : -1 <= x <= 1, default 0.8
        Correlation of DBH and length.
    density_kg_m3 : kg/m³, 0 < x <= 25000
        Density. Default: that of the preset.
    density_sd_kg_m3 : kg/m³, >= 0, default 0
        Standard deviation of the density.
    deadwood : optional
        Mapped deadwood to draw the logs from. Fields dbh_cm and length_m, and any other of a log.
    orientation : one of upright, lying, tilted, random, random-lying, default upright
        Orientation at the start.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical.
    azimuth_deg : °, 0 <= x <= 360, default 0
        Azimuth of tip and speed, from north.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance above the terrain at the start.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    overwrite : optional
        Replace an output that exists.
    output : output, optional
        Releases layer (.gpkg). Without it, in a temporary folder that lasts as long as the result.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("sample-releases", SampleReleasesResult, locals())


class ImportTreesResult(Result):
    """What `import_trees` leaves."""

    trees = LayerPart("--output", "trees")
    """Standing trees: rigid truncated cones with the DBH as base diameter and half of it at the top"""
    releases = LayerPart("--snags", "releases")
    """Dead standing trees as releases: upright, where they stand"""


def import_trees(
    *,
    trees: TableInput,
    source: Literal[
        "auto",
        "table",
        "lidr",
        "foresttools",
        "itcsegment",
        "lidartree",
        "pycrown",
        "fint",
        "fint-ch",
        "cloud2trees",
        "rockyfor3d",
        "platrock",
        "neon",
        "sortie",
    ] = "auto",
    dem: TerrainInput | None = None,
    x_field: str | None = None,
    y_field: str | None = None,
    id_field: str | None = None,
    dbh_field: str | None = None,
    dbh_unit: Literal["cm", "m", "mm", "in", "girth-cm", "radius-cm", "radius-m", None] = None,
    height_field: str | None = None,
    height_unit: Literal["m", "dm", "cm", "ft", None] = None,
    species_field: str | None = None,
    crown_field: str | None = None,
    crown_measure: Literal["diameter", "radius", "area", None] = None,
    missing_value: NumbersInput | None = None,
    read_as: str | list[str] | None = None,
    status_field: str | None = None,
    dead_values: str | list[str] | None = None,
    gone_values: str | list[str] | None = None,
    keep_dead: bool = False,
    min_height_m: float = 1.3,
    dbh_a: float = 2.52,
    dbh_b: float = 0.84,
    dbh_law: Literal[
        "fint-ch",
        "fint",
        "chablais-spruce",
        "chablais-fir",
        "chablais-beech",
        "chablais-all",
        "oregon-silver-fir",
        "oregon-western-hemlock",
        "oregon-douglas-fir",
        "jucker-global",
        "jucker-conifer-forest-gymnosperm",
        "jucker-conifer-forest-angiosperm",
        "jucker-mixed-forest-gymnosperm",
        "jucker-mixed-forest-angiosperm",
        "jucker-boreal-gymnosperm",
        "jucker-boreal-angiosperm",
        None,
    ] = None,
    dbh_zones: LayerInput | None = None,
    dbh_sample: TableInput | None = None,
    replace_dbh: bool = False,
    merge_within_m: float = 0.0,
    tile_field: str | None = None,
    crs: str | int | None = None,
    overwrite: bool = False,
    snags: str | os.PathLike[str] | bool | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> ImportTreesResult:
    """Make the trees layer from a table or layer of single trees, and a releases layer of the dead trees in it.

    It reads the output of tree detection and inventories: GeoPackage, shapefile, CSV and other text tables in
    any common encoding, with decimal commas, with or without header. ``source`` names the program that wrote
    the table; ``auto`` recognises it by its columns or its name, and otherwise finds columns by their usual
    names. The ``--...-field`` and ``--...-unit`` options name any column and its unit, and take precedence. In
    a file without header the columns are ``column_1``, ``column_2`` and so on. Crown polygons give trees at
    their centroids (or at the named columns) and crown diameters from their area.

    A missing DBH is computed from the height by DBH[cm] = a * H[m]^b, a missing height from the DBH by the same
    law; a tree with neither is dropped. The law is that of ``dbh_a`` and ``dbh_b``, a named one (``dbh_law``),
    that of the zone polygon in which the tree stands, or one fitted to measured trees (``dbh_sample``; the
    logarithms are fitted, with the correction exp(s^2 / 2)). A single law misjudges stems by up to a factor of
    two: use a law of your region. ``dbh_source`` distinguishes ``measured`` from ``modelled``. What was filled
    in, dropped or merged is counted in notes.

    Dead standing trees and snags are kept out of the trees, because they are future logs: ``snags`` writes them
    as a releases layer (upright, where they stand, with their DBH and height). Lying or removed trees are
    dropped. If an id occurs twice (tiles often number their trees independently), all trees are renumbered and
    the old ids are kept as ``source_id``. ``merge_within_m`` merges trees found twice at the seams of tiles.
    The tool does not judge whether a tree is real.

    With an inventory: ``status_field Zustand dead_values "tot,Dürrständer" snags snags.gpkg``; with the output
    of FINT: ``trees Ind_trees.csv source fint``.

    Sources:

    - ``lidr``: treeID, height in Z or in the Z of the points; crown_metrics with convhull_area
    - ``foresttools``: treeID, height, winRadius, crownArea
    - ``itcsegment``: crowns with X, Y, Height_m, CA_m2
    - ``lidartree``: detected (id, h, dom_radius, s as the crown's area, v) or inventory (x, y, d, h, n, s, e)
    - ``pycrown``: DN, TH, COR; crowns with TTH, TCH (the Z of its points is the ground's, and not used)
    - ``fint``: FINT and pyFINT: Ind_trees.csv (5 or 6 columns), treefile.txt (3 or 4: x, y and heights)
    - ``fint-ch``: hoehe, bhd, dominanz; -1 is missing
    - ``cloud2trees``: treeID, tree_height_m, dbh_cm, tree_x, tree_y, crown_area_m2
    - ``rockyfor3d``: Rockyfor3D tree file: x, y, DBH in cm, and a height where there is a fourth column
    - ``platrock``: PlatRock's .xyd: x, y, diameter in cm
    - ``neon``: NEON vst_apparentindividual joined to the positions (adjEasting, adjNorthing of geoNEON)
    - ``sortie``: tree map: X, Y, Species, Type (Snag), Diam, Height

    Laws of DBH[cm] from the height H[m] (the module ``allometry`` names their sources):

    - ``fint-ch``: DBH[cm] = 2.52 * H[m]^0.84; FINT-CH, for all of Switzerland; the default
    - ``fint``: DBH[cm] = 1 * H[m]^1.25; pyFINT's default until March 2021; since then it is that of fint-ch (50
      cm instead of 85 for 35 m)
    - ``chablais-spruce``: DBH[cm] = 1.357 * H[m]^1.071; made for this project, a fit to the inventory Chablais
      3: spruce, 29 trees, rmse 6.4 cm
    - ``chablais-fir``: DBH[cm] = 0.786 * H[m]^1.256; the same, fir, 21 trees, 4.3 cm
    - ``chablais-beech``: DBH[cm] = 3.823 * H[m]^0.551; the same, beech, 47 trees, 3.8 cm
    - ``chablais-all``: DBH[cm] = 1.527 * H[m]^0.987; the same, all species, 110 trees, 6.5 cm
    - ``oregon-silver-fir``: DBH[cm] = 0.868 * H[m]^1.111; made for this project, a fit to the inventory WEF
      (Oregon): SF, 1.7 cm, heights modelled
    - ``oregon-western-hemlock``: DBH[cm] = 1.729 * H[m]^0.972; the same, WH, 7.0 cm
    - ``oregon-douglas-fir``: DBH[cm] = 0.82 * H[m]^1.244; the same, DF, 18.5 cm
    - ``jucker-global``: DBH[cm] = 0.5579 * (H[m] * crown diameter[m])^0.809; Jucker et al. 2017, with the
      crown: global
    - ``jucker-conifer-forest-gymnosperm``: DBH[cm] = 0.974 * (H[m] * crown diameter[m])^0.748; Palearctic
      temperate coniferous forests
    - ``jucker-conifer-forest-angiosperm``: DBH[cm] = 0.273 * (H[m] * crown diameter[m])^0.927; the same
    - ``jucker-mixed-forest-gymnosperm``: DBH[cm] = 1.004 * (H[m] * crown diameter[m])^0.73; Palearctic
      temperate mixed forests
    - ``jucker-mixed-forest-angiosperm``: DBH[cm] = 0.694 * (H[m] * crown diameter[m])^0.73; the same
    - ``jucker-boreal-gymnosperm``: DBH[cm] = 1.43 * (H[m] * crown diameter[m])^0.649; Palearctic boreal forests
    - ``jucker-boreal-angiosperm``: DBH[cm] = 0.467 * (H[m] * crown diameter[m])^0.839; the same

    Parameters
    ----------
    trees : point or polygon, required
        Table or layer of single trees.
    source : one of auto, table, lidr, foresttools, itcsegment, lidartree, pycrown, fint, fint-ch, cloud2trees,
      rockyfor3d, platrock, neon, sortie, default auto
        Program that wrote the table. table: usual names only.
    dem : optional
        Terrain (DEM). Gives the CRS of the output; trees off the DEM are dropped. A raster, a folder of tiles,
        or tiles separated by commas.
    x_field : optional
        Field of the easting.
    y_field : optional
        Field of the northing.
    id_field : optional
        Field of the tree's id.
    dbh_field : optional
        Field of the DBH.
    dbh_unit : one of cm, m, mm, in, girth-cm, radius-cm, radius-m
        Unit of the DBH. Without it: the unit in the field's name, else cm.
    height_field : optional
        Field of the height.
    height_unit : one of m, dm, cm, ft
        Unit of the height. Without it: the unit in the field's name, else m.
    species_field : optional
        Field of the species.
    crown_field : optional
        Field of the crown diameter in m.
    crown_measure : one of diameter, radius, area
        What the crown field holds, in m or m². Without it: from the source or the field's usual name, else the
        diameter.
    missing_value : optional
        Numbers that mark a missing value. Several with commas; FINT-CH writes -1.
    read_as : optional
        Words in the columns of DBH and height, and their numbers. For open classes and words: >60=65;
        Starkholz=55. Nothing after the = marks a missing value.
    status_field : optional
        Field that distinguishes dead trees from living ones.
    dead_values : optional
        Its values for dead standing trees. Separated by commas, or by semicolons where a value holds a comma.
        Without it: the usual words.
    gone_values : optional
        Its values for removed or fallen trees. As the dead values; these trees are dropped.
    keep_dead : optional
        Keep dead standing trees among the trees too.
    min_height_m : m, >= 0, default 1.3
        Minimum height of a tree. Lower ones are dropped and counted; below breast height there is no DBH.
    dbh_a : > 0, default 2.52
        a of DBH[cm] = a * H[m]^b.
    dbh_b : > 0, default 0.84
        b of DBH[cm] = a * H[m]^b.
    dbh_law : one of fint-ch, fint, chablais-spruce, chablais-fir, chablais-beech, chablais-all,
      oregon-silver-fir, oregon-western-hemlock, oregon-douglas-fir, jucker-global,
      jucker-conifer-forest-gymnosperm, jucker-conifer-forest-angiosperm, jucker-mixed-forest-gymnosperm,
      jucker-mixed-forest-angiosperm, jucker-boreal-gymnosperm, jucker-boreal-angiosperm
        Named law in place of a and b. fint* and jucker* are published; chablais* and oregon* were made for this
        project, as fits to inventories. The description lists them. With a law that needs the crown, a and b
        are used for trees whose crown is unknown.
    dbh_zones : polygon
        Zones with different laws. Fields dbh_a and dbh_b, or dbh_law.
    dbh_sample : optional
        Measured trees to fit the law to. Those with a DBH and a height; the table itself can be used.
    replace_dbh : optional
        Compute the DBH from the height also where the table has one.
    merge_within_m : m, >= 0, default 0
        Trees nearer than this are merged. The tallest stays; 0 merges none.
    tile_field : optional
        Field of the tile. Only trees of different tiles are then merged. QGIS's Merge Vector Layers calls it
        layer.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    overwrite : optional
        Replace an output that exists.
    snags : output, optional
        Releases layer of the dead standing trees (.gpkg). True: beside the main output.
    output : output, optional
        Trees layer (.gpkg). Without it, in a temporary folder that lasts as long as the result.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("import-trees", ImportTreesResult, locals())


class FindTreesResult(Result):
    """What `find_trees` leaves."""

    trees = LayerPart("--output", "trees")
    """Standing trees: rigid truncated cones with the DBH as base diameter and half of it at the top"""


def find_trees(
    *,
    chm: TerrainInput | None = None,
    dsm: TerrainInput | None = None,
    dem: TerrainInput | None = None,
    window: Literal["mixed", "deciduous"] = "mixed",
    window_m: float | None = None,
    window_growth: float = 0.0,
    min_height_m: float = 2.0,
    dbh_a: float = 2.52,
    dbh_b: float = 0.84,
    dbh_law: Literal[
        "fint-ch",
        "fint",
        "chablais-spruce",
        "chablais-fir",
        "chablais-beech",
        "chablais-all",
        "oregon-silver-fir",
        "oregon-western-hemlock",
        "oregon-douglas-fir",
        None,
    ] = None,
    crs: str | int | None = None,
    overwrite: bool = False,
    output: str | os.PathLike[str] | None = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> FindTreesResult:
    """Find the trees of a canopy height model, or of a surface and a terrain model, and write them as a trees
    layer.

    A cell is a tree top if none is higher within a circle around it whose diameter follows from its own height
    (Popescu and Wynne 2004; as lidR's ``locate_trees`` with ``lmf`` does on a raster). ``window`` names a
    published law of the diameter D[m] from the height H[m]; ``window_m`` gives a constant diameter instead, to
    which ``window_growth`` adds metres per metre of height. The eight neighbours are always compared. Of equal
    tops beside each other one is the tree: the southernmost, and of these the westernmost.

    - ``mixed``: D = 2.51503 + 0.00901 H^2, deciduous trees and pines together
    - ``deciduous``: D = 3.09632 + 0.00895 H^2

    ``chm`` holds heights above the ground. Alternatively ``dsm`` and ``dem``, on the same cells, give the
    canopy height by their difference. Cells without a value are not trees, nor are cells higher than 150 m
    (cranes, birds, undeclared nodata), which are counted in a note. The tree stands at the centre of its cell
    and is as high as the cell.

    The DBH follows from the height as in ``import-trees`` (``dbh_law``, or ``dbh_a`` and ``dbh_b``), which
    lists the laws and imports trees found by other programs. The method finds local maxima: small trees below
    others are not seen, a wide crown may count twice, and a building counts as a tree. Fill the pits of a
    canopy model beforehand, and choose the window by comparison with trees counted in the field.

    With a canopy model: ``deadwood-tool find-trees --chm chm.tif --output trees.gpkg``; with a surface and a
    terrain model: ``deadwood-tool find-trees --dsm dsm.tif --dem dem.tif --window deciduous --output
    trees.gpkg``.

    Parameters
    ----------
    chm : optional
        Canopy height model (heights above the ground). A raster, a folder of tiles, or tiles separated by
        commas.
    dsm : optional
        Surface model, instead of the canopy model. Needs dem. A raster, a folder of tiles, or tiles separated
        by commas.
    dem : optional
        Terrain (DEM) below the surface model. On the same cells. A raster, a folder of tiles, or tiles
        separated by commas.
    window : one of mixed, deciduous, default mixed
        Law of the window's diameter.
    window_m : m, 0 < x <= 100
        Constant diameter of the window instead.
    window_growth : m/m, 0 <= x <= 10, default 0
        Growth of the constant diameter with the height. D = window_m + growth * H, as lidR and ForestTools
        often have it.
    min_height_m : m, 1.3 <= x <= 150, default 2
        Minimum height of a tree. Below breast height there is no DBH.
    dbh_a : > 0, default 2.52
        a of DBH[cm] = a * H[m]^b.
    dbh_b : > 0, default 0.84
        b of DBH[cm] = a * H[m]^b.
    dbh_law : one of fint-ch, fint, chablais-spruce, chablais-fir, chablais-beech, chablais-all,
      oregon-silver-fir, oregon-western-hemlock, oregon-douglas-fir
        Named law in place of a and b. fint* and jucker* are published; chablais* and oregon* were made for this
        project, as fits to inventories. import-trees lists them.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    overwrite : optional
        Replace an output that exists.
    output : output, optional
        Trees layer (.gpkg). Without it, in a temporary folder that lasts as long as the result.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("find-trees", FindTreesResult, locals())


class GenerateForestResult(Result):
    """What `generate_forest` leaves."""

    trees = LayerPart("--output", "trees")
    """Standing trees: rigid truncated cones with the DBH as base diameter and half of it at the top"""


def generate_forest(
    *,
    dem: TerrainInput,
    preset: Literal["klosters", "rothenbrunnen", None] = None,
    stems_per_ha: float | None = None,
    dbh_mean_cm: float | None = None,
    dbh_sd_cm: float | None = None,
    height_mean_m: float | None = None,
    height_sd_m: float | None = None,
    correlation: float | None = None,
    like: LayerInput | None = None,
    stand: LayerInput | None = None,
    exclude: LayerInput | None = None,
    min_spacing_m: float = 0.0,
    dbh_a: float = 2.52,
    dbh_b: float = 0.84,
    dbh_law: Literal[
        "fint-ch",
        "fint",
        "chablais-spruce",
        "chablais-fir",
        "chablais-beech",
        "chablais-all",
        "oregon-silver-fir",
        "oregon-western-hemlock",
        "oregon-douglas-fir",
        None,
    ] = None,
    seed: int = 0,
    crs: str | int | None = None,
    overwrite: bool = False,
    output: str | os.PathLike[str] | None = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> GenerateForestResult:
    """Plant a random forest: stems per hectare at uniformly random places, with the sizes of given trees or
    from normal distributions.

    The result is a trees layer for ``slide-logs`` over the DEM, or within stand polygons minus excluded
    polygons. From a trees layer (``like``) it takes the density over the same area, and draws the DBH and
    height of each tree together from one of the layer's trees, each of which is used equally often: mean,
    standard deviation and basal area are kept, however skewed they are. A DBH or height given as an option
    overrides that of the layer; both sizes are then drawn from normal distributions with the means, standard
    deviations and correlation, as without a layer. The result is printed beside the request or the layer's
    values.

    Stands may differ: where the stand layer has columns named as the options (``stems_per_ha``,
    ``dbh_mean_cm``, ...; or PlatRock's ``trees_density``, ``trees_dhp_mean``, ``trees_dhp_std``), each row is
    planted with its own values; where rows overlap, the later one counts. A value of a row overrides an option,
    which overrides the layer's.

    ``preset klosters`` and ``rothenbrunnen`` are the forests of the paper; explicit options override them. As
    there, impossible trees (DBH below 1 cm, height below 1.3 m) are drawn again and counted in a note; this
    narrows the distribution a little. Such trees of a trees layer are left out.

    Without values for the height, the mean follows from the mean DBH by the law of ``import-trees``, with half
    the relative variation of the DBH. Tree k of a stand has the same place at every density, unless
    ``min_spacing_m`` moves it away from an earlier tree. Clusters, gaps and species are not modelled.

    Parameters
    ----------
    dem : required
        Terrain (DEM). A raster, a folder of tiles, or tiles separated by commas.
    preset : one of klosters, rothenbrunnen
        Density and DBH by name. klosters: the forest of Gruobenwald, Klosters (stems_per_ha 300, dbh_mean_cm
        60.23, dbh_sd_cm 18.64); rothenbrunnen: the forest of Plattawald, Rothenbrunnen (stems_per_ha 315,
        dbh_mean_cm 44, dbh_sd_cm 22). Instead of like.
    stems_per_ha : 1/ha, 0 < x <= 1000000
        Density.
    dbh_mean_cm : cm, 0 < x <= 1500
        Mean DBH.
    dbh_sd_cm : cm, >= 0
        Standard deviation of the DBH.
    height_mean_m : m, 0 < x <= 150
        Mean height.
    height_sd_m : m, >= 0
        Standard deviation of the height.
    correlation : -1 <= x <= 1
        Correlation of DBH and height. Without like: 0.8.
    like : point
        Trees layer to take density and sizes from.
    stand : polygon
        Stand polygons. Without them: the whole DEM. Columns may give each its numbers.
    exclude : polygon
        Polygons without trees.
    min_spacing_m : m, >= 0, default 0
        Smallest distance between two stems.
    dbh_a : > 0, default 2.52
        a of DBH[cm] = a * H[m]^b.
    dbh_b : > 0, default 0.84
        b of DBH[cm] = a * H[m]^b.
    dbh_law : one of fint-ch, fint, chablais-spruce, chablais-fir, chablais-beech, chablais-all,
      oregon-silver-fir, oregon-western-hemlock, oregon-douglas-fir
        Named law in place of a and b. For heights that are not given. fint* and jucker* are published;
        chablais* and oregon* were made for this project, as fits to inventories. import-trees lists the laws.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    overwrite : optional
        Replace an output that exists.
    output : output, optional
        Trees layer (.gpkg). Without it, in a temporary folder that lasts as long as the result.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("generate-forest", GenerateForestResult, locals())


class WindthrowResult(Result):
    """What `windthrow` leaves."""

    stems = LayerPart("stems.gpkg", "stems")
    """Every tree of windthrow, where it stood: the state of its stem in each scenario"""


def windthrow(
    *,
    trees: LayerInput,
    dem: TerrainInput,
    share: float | None = None,
    dbh_classes: str | list[str] | None = None,
    windthrow_areas: LayerInput | None = None,
    ids: str | list[str] | None = None,
    fall_deg: float,
    scatter_deg: float = 20.0,
    stump_m: float = 0.5,
    lost: float = 0.3,
    thinner: float | None = None,
    wood: Literal["spruce", "beech", "pine", None] = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    weaker: float | None = None,
    years: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> WindthrowResult:
    """Throw trees as a storm does, and write what stands and lies before, after, years later, and after
    clearing.

    A share of the stems is thrown: of all (`share`), of each class of DBH (`dbh_classes 0:0.1,40:0.7`: a tenth
    from 0 cm, seven tenths from 40 cm), within polygons (`windthrow_areas`, whose column `share` overrides
    these), and the trees named by `ids`. In each group the nearest whole number falls; which trees fall depends
    on the seed and each tree's id.

    A thrown stem lies from its stump towards `fall_deg`, the direction to which the wind blows, with a normal
    scatter. It is the part of the tree's truncated cone above the stump, and as long on the slope as it was
    high. The stump remains as a short tree (`stump_m 0`: uprooted, no stump). A stem that would extend beyond
    the terrain model ends at its edge; stems that fall off it completely are left out and counted. The folder
    holds layers for `slide-logs`:

    - `trees_before.gpkg`: the forest before the storm;
    - `trees_after.gpkg`, `lying_after.gpkg`: what stands, with stumps, and what lies right after the storm;
    - `trees_later.gpkg`, `lying_later.gpkg`: the same years later: a share of the lying logs is gone (`lost`),
      the others   are thinner (`thinner`). The defaults are assumptions, not measurements: use values of your
      climate and wood.   `wood spruce years 10` computes `thinner` from a published rate of decay;
    - `trees_cleared.gpkg`: all lying stems are removed, the stumps remain;
    - `stems.gpkg`: every tree, and whether it stands, lies or is removed in each scenario.

    With `tree_capacity_kj`, the energy that a fresh stem of 40 cm DBH absorbs in a hit before it breaks, lying
    logs have a `capacity_kj` by DBH, age and wood, above which they break; `lying_later_rigid.gpkg` has the
    same logs without it.

    The tool prints the commands that slide the same logs through all four scenarios and compare them. It does
    not predict which trees a storm throws: that is your input. Stems lie flat, not on one another or against
    standing trees; regrowth is not modelled.

    Parameters
    ----------
    trees : point, required
        Trees before the storm.
    dem : required
        Terrain (DEM). A raster, a folder of tiles, or tiles separated by commas.
    share : 0 <= x <= 1
        Share of the stems that is thrown.
    dbh_classes : optional
        Share by class of DBH. Minimum DBH [cm]:share, separated by commas: 0:0.1,20:0.3,40:0.7.
    windthrow_areas : polygon
        Areas of windthrow. Nothing falls outside. A column share overrides share and dbh_classes.
    ids : optional
        Trees that fall in any case. Values of tree_id, separated by commas.
    fall_deg : °, 0 <= x <= 360, required
        Azimuth towards which stems fall, where the wind blows to.
    scatter_deg : °, 0 <= x <= 180, default 20
        Standard deviation of that azimuth.
    stump_m : m, >= 0, default 0.5
        Height of the stumps. 0: none, the stems are uprooted.
    lost : 0 <= x <= 1, default 0.3
        Share of the lying logs that has disappeared years later.
    thinner : 0 <= x <= 0.95
        Share by which the diameter of the others has decreased by then. Default: by wood, else 0.2, an
        assumption.
    wood : one of spruce, beech, pine
        Wood whose rate of decay gives the decrease. spruce: its mass falls by 3.2 % a year, taken off from
        outside (rate 0.033); beech: its mass falls by 5.3 % a year, taken off from outside (rate 0.054); pine:
        its mass falls by 3.1 % a year, taken off from outside (rate 0.032).
    tree_capacity_kj : kJ, > 0
        Energy that a fresh stem of 40 cm DBH absorbs in a hit before it breaks. Lying logs then break above
        theirs, less by weaker years later. Without it they are rigid.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    weaker : 0 <= x <= 0.999
        Share of that energy which lying logs have lost by then. Default: by wood (else spruce) and years,
        0.89 for spruce after 9 years: the most that tests found.
    years : 0 <= x <= 100
        Years after the storm, with the wood's rate of decay. Default: 10.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    output : output, optional
        Folder of the scenarios' layers. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("windthrow", WindthrowResult, locals())


class AddStructuresResult(Result):
    """What `add_structures` leaves."""

    dem = RasterPart("--output")
    """A terrain model, with the number type of the original"""
    earthworks = LayerPart("--earthworks", "earthworks")
    """What add-structures built, and the earth that it moved"""


def add_structures(
    *,
    dem: TerrainInput,
    structures: LayerInput,
    kind: Literal["embankment", "ditch"] = "embankment",
    height_m: float | None = None,
    elevation_m: float | None = None,
    elevation_from_z: bool = False,
    crest_width_m: float = 2.0,
    slope_deg: float = 45.0,
    slope_left_deg: float | None = None,
    slope_right_deg: float | None = None,
    max_reach_m: float = 100.0,
    crs: str | int | None = None,
    overwrite: bool = False,
    output: str | os.PathLike[str] | None = None,
    earthworks: str | os.PathLike[str] | bool | None = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> AddStructuresResult:
    """Build embankments and ditches into a terrain model, and compute their volumes of earth.

    The result is the DEM with the structures, on the same grid, with the same CRS and number type, nodata
    unchanged, ready for ``slide-logs``. Each line is the axis of one structure; ``kind`` is its kind. The crest
    (of a ditch: the bottom) is flat over ``crest_width_m`` and lies ``height_m`` above (below) the ground under
    the line, or at ``elevation_m`` where that is given. From its edges the sides fall (rise) at ``slope_deg``
    until they first meet the ground. The columns ``slope_left_deg`` and ``slope_right_deg``, seen along the
    line, override it. At the ends of the line the sides are rounded. Columns of the lines override the options
    of the same names; an empty cell takes the option. A height follows every bump of the ground; for a crest of
    even grade give an elevation, or the Z of the line's vertices with ``elevation_from_z``.

    Structures are built in the order of their rows, with heights relative to the original ground: overlapping
    volume is counted once, with the first structure, and a ditch after an embankment cuts into it. Volumes are
    those between the old and the new heights of the cells. Ground higher than a crest is not changed. A DEM of
    any size is processed in strips.

    Model walls and nets thinner than the cells as barriers of ``slide-logs``. The paper's Klosters case
    (section 5.1) has both: two embankments and six barriers. The sample with two dams, which then are ground
    like any other:

    The stability of the structures, drainage and the thrust of a log are not checked.

    Parameters
    ----------
    dem : required
        Terrain (DEM). A raster, a folder of tiles, or tiles separated by commas.
    structures : line, required
        Crest lines of embankments, bottom lines of ditches.
    kind : one of embankment, ditch, default embankment
        Kind of structure, where the layer has none.
    height_m : m, > 0
        Height of the crest above the ground, or depth of a ditch, where the layer has none.
    elevation_m : m, -500 <= x <= 9000
        Elevation of the crest or bottom, where the layer has none. Overrides the height.
    elevation_from_z : optional
        Take the elevation from the Z of the lines' vertices.
    crest_width_m : m, >= 0, default 2
        Width of the crest or bottom, where the layer has none.
    slope_deg : °, 0 < x <= 90, default 45
        Slope of both sides, where the layer has none.
    slope_left_deg : °, 0 < x <= 90
        Slope of the left side, where the layer has none.
    slope_right_deg : °, 0 < x <= 90
        Slope of the right side, where the layer has none.
    max_reach_m : m, > 0, default 100
        Distance from the crest within which a side must meet the ground.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    overwrite : optional
        Replace an output that exists.
    output : output, optional
        DEM with the structures (.tif). Without it, in a temporary folder that lasts as long as the result.
    earthworks : output, optional
        Lines with their earthworks (.gpkg). True: beside the main output.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("add-structures", AddStructuresResult, locals())


class MakeLogResult(Result):
    """What `make_log` leaves."""

    summary_file = "log.json"


def make_log(
    *,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    taper: float = 0.5,
    density_kg_m3: float = 300.0,
    vertices: int = 16,
    ring_spacing_m: float = 0.5,
    rings: int | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> MakeLogResult:
    """Make the solid of one log, with its mass, centre of mass and inertia, as files for other programs.

    The folder holds ``log.pts`` (the custom shape of RAMMS::Rockfall: x y z on each line, no header),
    ``log.obj`` and ``log.stl`` (closed, outward oriented), and ``log.json`` with the mass properties. The
    origin is the centre of mass, z runs along the axis from the base to the tip, and all lengths are in metres.
    The log is the paper's truncated cone (section 3), as rings of vertices on the cone: the solid in the files
    is slightly slimmer than the cone, by 6.6 / vertices^2 of its volume (2.6 % with 16). ``log.json`` has both:
    ``cone`` exactly, and ``solid`` as in the files.

    Rings in between do not change the solid. But where only vertices are tested against the ground, as RAMMS
    does with a custom shape, a body has contact only at its rings. The paper slides its logs in this way, as a
    body-fixed cloud of vertices. The default is a ring every half metre (``ring_spacing_m``): on rough ground
    (cells of 1 m, heights scattered by 0.15 m) logs of 15 m with rings at their two ends only come to rest with
    the ground 29 cm deep inside them (median of 144; at most 59 cm), with a ring every half metre 2 cm (at most
    10). ``rings`` sets the number of rings instead. The logs of the paper, Klosters and Rothenbrunnen:

    ``slide-logs --shape log_klosters/log.pts`` slides that cloud instead of the smooth cone: the paper's method
    beside this toolbox's own. (``reproduce-paper`` has 31 rings on both logs, as when its table was measured.)
    Bark, branches, root plates, bends and rocks are not made; ``sample_data`` has point clouds of a cubic and a
    platy rock of 1 m3, as in the paper's comparison.

    Parameters
    ----------
    dbh_cm : cm, > 0, default 75
        DBH, the diameter of the base.
    length_m : m, > 0, default 30
        Length.
    taper : 0 < x <= 1, default 0.5
        Diameter of the tip over that of the base.
    density_kg_m3 : kg/m³, > 0, default 300
        Density.
    vertices : 3 <= x <= 1000, default 16
        Vertices of each ring.
    ring_spacing_m : m, > 0, default 0.5
        Largest distance of the rings.
    rings : 2 <= x <= 1000
        Rings, those of the two ends included, instead of a distance.
    output : output, optional
        Folder of the log. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("make-log", MakeLogResult, locals())


class SlideLogsResult(Run):
    """What `slide_logs` leaves."""

    summary_file = "summary.json"

    deposits = LayerPart("run.gpkg", "deposits")
    """Where each released log ended: its centre of mass; one row for every log"""
    deposited_logs = LayerPart("run.gpkg", "deposited_logs")
    """The logs as they lie at the end: a line from base to tip"""
    trajectories = LayerPart("run.gpkg", "trajectories")
    """The path of the centre of mass of the logs with a stored trajectory"""
    reach = LayerPart("run.gpkg", "reach")
    """Each line or polygon: the probability that logs of the run reach it"""
    reached_by = LayerPart("run.gpkg", "reached_by")
    """One row for each log and line that it reached, where the log was released: where do arrivals come
    from?"""
    barrier_arrivals = LayerPart("run.gpkg", "barrier_arrivals")
    """Every log that comes to a barrier, whether it hits it, jumps over it or passes beside it; at its centre
    of mass when it comes there"""
    barrier_hits = LayerPart("run.gpkg", "barrier_hits")
    """Every hit of a barrier, where the log first touched it; a hit lasts until 0.1 s pass without contact.
    Logs that jump over it are only in barrier_arrivals"""
    tree_hits = LayerPart("run.gpkg", "tree_hits")
    """Every tree that was hit, and the energy and impulse that it absorbed: its protective value"""
    lying_hits = LayerPart("run.gpkg", "lying_hits")
    """Every lying log that was hit, and the energy and impulse that it absorbed"""
    block_hits = LayerPart("run.gpkg", "block_hits")
    """Every boulder that was hit, and the energy and impulse that it absorbed"""
    poses = TablePart("poses.parquet")
    """poses.parquet: one row for each stored pose, world coordinates; ordered by log, then time"""
    hit_count = RasterPart("hit_count.tif")
    """Number of logs whose plan outline overlapped the cell at any time, each log once"""
    reach_probability = RasterPart("reach_probability.tif")
    """Share of all logs whose plan outline overlapped the cell at any time"""
    deposit_count = RasterPart("deposit_count.tif")
    """Number of logs that come to rest on the cell"""
    speed_max = RasterPart("speed_max.tif")
    """Largest speed of a log over the cell"""
    energy_max = RasterPart("energy_max.tif")
    """Largest kinetic energy of a log over the cell"""
    jump_max = RasterPart("jump_max.tif")
    """Heights of logs that pass the cell"""
    danger = RasterPart("danger.tif")
    """Share of passing logs that later reach the line; NaN where fewer logs passed than --danger-least"""
    danger_count = RasterPart("danger_count.tif")
    """The counts behind danger.tif, with --danger-counts: those of several runs can be added"""


def slide_logs(
    *,
    dem: TerrainInput,
    releases: LayerInput,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: float | RasterInput | LayerInput | None = None,
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    friction_preset: Literal["wet-debarked", "wet-bark", "chute-dry", "chute-watered", "chute-iced", None] = None,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    fidelity: Literal["draft", "standard", "fine", "reference", "auto"] = "standard",
    error: float | None = None,
    budget: str | list[str] | None = None,
    assume: Literal["none", "standard", "draft"] = "standard",
    time_step_s: float | None = None,
    station_spacing_m: float | None = None,
    own_slope: str | list[str] | None = None,
    friction_range: str | list[str] | None = None,
    trajectories: str | list[str] = "1000",
    until_ci: float | None = None,
    danger_least: int = 10,
    danger_counts: bool = False,
    log_capacity_kj: float | None = None,
    log_capacity_power: float = 2.0,
    qgis_project: bool = False,
    outline_every_s: float = 0.25,
    geoparquet: bool = False,
    report: bool = False,
    language: Literal["en", "de", "fr", "it"] = "en",
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> SlideLogsResult:
    """Slide the released logs down the terrain, among standing trees and barriers.

    Each log is a rigid truncated cone (or, with shape, any convex body) in hard frictional contact with
    terrain, trees, barriers, lying logs and boulders (see engine/README.md; it follows section 3 of the paper).
    The run's folder holds the deposits, the trajectories, the share of logs that reach each line, every hit of
    a barrier, impulse and energy taken by each tree that was hit, and rasters of how often, how fast and how
    high logs pass. With lines, danger.tif is the share of passing logs that later reach a line: one band for
    any line, and one for each. Every released log is accounted for.

    Logs neither break nor collide with each other; barriers and boulders do not give way, trees only with
    break_trees. resume continues an interrupted run and gives the same results, bit for bit, as a run that was
    never interrupted. With until_ci a run takes the logs in a random order and ends when the intervals are
    narrow enough; logs that were not run are counted separately. With friction_range the reach of lines is
    given over a range of friction, too.

    With fidelity auto error 0.02 the tool chooses fidelity and number of logs so that every line's reach is
    within 2 points, at 95 % confidence, of what `reference` would give; the error of the calculation is taken
    from random slopes of the same kind (assume). The run states both errors. With budget 60s the result is the
    most accurate in that time.

    With lines, 100 to 200 of the logs slide again at a finer fidelity (own_slope N|none): the interval of the
    paired difference shows how far each line's reach is off on this slope.

    Parameters
    ----------
    dem : required
        Terrain model. A raster, a folder of tiles, or tiles separated by commas.
    releases : point, required
        Released logs.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0
        Friction coefficient. A number, a raster, or polygons with a field 'friction' or 'mu'. Needed, unless
        friction_preset names one.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH, where the layer has none.
    length_m : m, 0 < x <= 150, default 30
        Length, where the layer has none.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density, where the layer has none.
    orientation : one of upright, lying, tilted, default upright
        Orientation, where the layer has none.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    friction_preset : one of wet-debarked, wet-bark, chute-dry, chute-watered, chute-iced
        Friction coefficient by name. wet-debarked: a wet log without bark and branches on wet ground, 0.2 to
        0.3 (friction 0.25); wet-bark: a wet log with its bark on wet ground, 0.25 to 0.38 (friction 0.31);
        chute-dry: a log in a dry timber chute, about 0.15 (friction 0.15); chute-watered: a log in a watered
        timber chute, 0.03 to 0.08 (friction 0.055); chute-iced: a log in an iced timber chute, 0.03 to 0.12
        (friction 0.075).
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    fidelity : one of draft, standard, fine, reference, auto, default standard
        Speed against accuracy. auto: the cheapest that keeps error, or the best within budget.
    error : 0 < x <= 0.5
        Permitted error of the reach of a line, with fidelity auto. 0.02 means ±2 points from what reference
        would give, at 95 %, by sampling and by calculation together. Needs lines.
    budget : optional
        Time for the run in place of that error, with fidelity auto. 60s, 5min or 1h: the most accurate fidelity
        and number of logs for that time on this machine, within about a tenth. report and qgis_project take
        additional time.
    assume : one of none, standard, draft, default standard
        Errors of calculation taken from the benchmark's slopes, with fidelity auto. none: nothing, so that
        reference is used. standard: the errors of standard and fine. draft: that of draft as well.
    time_step_s : s, 1e-05 <= x <= 1
        Longest time step, instead of the fidelity's.
    station_spacing_m : m, 0.001 <= x <= 100
        Spacing of the contact stations, instead of the fidelity's.
    own_slope : optional
        Logs of the run that slide again at a finer fidelity: how many, or none. Shows how far the reach of each
        line is off on this slope. If no number is given, 200, or down to 100 so that they take at most a fifth
        of the run's time; with budget none. Needs lines.
    friction_range : optional
        Friction over which the reach of lines is given, too: LOW-HIGH, or auto. 0.2-0.3, for example; auto
        takes the range of the preset or, without one, of the table (list --presets). A part of the logs slides
        again at draft, at both ends and, if the posture at the start is assumed, in another one: about a third
        more time. Needs lines and a friction that is a number.
    trajectories : default 1000
        Logs whose trajectory is kept: all, none, or how many. Chosen by seed and log_id alone.
    until_ci : 0.0001 <= x <= 0.5
        End when every line's reach interval is this narrow (half-width). 0.005 means ±0.5 points. Logs run in a
        random order, at most all. Checks after 1000, 2000, 4000, ... logs use intervals widened for the
        repetition; the reported 95 % intervals are narrower. Needs lines.
    danger_least : >= 1, default 10
        Minimum number of passing logs for which a cell has a value. In danger.tif, which lines brings, cells
        with fewer are transparent.
    danger_counts : optional
        Also keep the counts of danger.tif. danger_count.tif, from which those of several runs add up; run-sites
        asks for it.
    log_capacity_kj : kJ, > 0
        Energy that a log of 40 cm DBH can lose in a hit before it breaks, to count the hits above.
    log_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which that grows.
    qgis_project : optional
        Add a QGIS project to the run. With styled and grouped layers, animated logs and a 3-D view:
        project.qgz, and scene.gpkg beside it.
    outline_every_s : s, >= 0.02, default 0.25
        Time between two outlines of the animated logs. In the QGIS project, for the logs that keep their
        trajectory.
    geoparquet : optional
        Write the run's layers as GeoParquet too. deposits.parquet, trajectories.parquet and so on, for programs
        that work on very many rows.
    report : optional
        Add a report to the run. One page with maps, figures, tables and a 3-D view: report.html (make-report).
    language : one of en, de, fr, it, default en
        Language of report and QGIS project.
    output : output, optional
        Folder of the run. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("slide-logs", SlideLogsResult, locals())


class RunSitesResult(Result):
    """What `run_sites` leaves."""

    summary_file = "summary.json"

    overview = TablePart("overview.csv")
    """Many sites side by side: one row for each site and line, one row for a site that has no lines or that
    failed"""
    sites = LayerPart("overview.gpkg", "sites")
    """The sites, where their logs start: the rows of overview.csv"""


def run_sites(
    *,
    dem: TerrainInput | None = None,
    releases: LayerInput | None = None,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: float | RasterInput | LayerInput | None = None,
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    friction_preset: Literal["wet-debarked", "wet-bark", "chute-dry", "chute-watered", "chute-iced", None] = None,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    fidelity: Literal["draft", "standard", "fine", "reference", "auto"] = "standard",
    error: float | None = None,
    budget: str | list[str] | None = None,
    assume: Literal["none", "standard", "draft"] = "standard",
    time_step_s: float | None = None,
    station_spacing_m: float | None = None,
    own_slope: str | list[str] | None = None,
    friction_range: str | list[str] | None = None,
    trajectories: str | list[str] = "1000",
    until_ci: float | None = None,
    danger_least: int = 10,
    danger_counts: bool = False,
    log_capacity_kj: float | None = None,
    log_capacity_power: float = 2.0,
    qgis_project: bool = False,
    outline_every_s: float = 0.25,
    geoparquet: bool = False,
    report: bool = False,
    language: Literal["en", "de", "fr", "it"] = "en",
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    sites: TableInput | None = None,
    configs: PathInput | None = None,
    by: str | None = None,
    merge: bool = True,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> RunSitesResult:
    """Slide the logs of many sites, one run each, and summarise the results side by side.

    The sites come from one of:

    - `sites TABLE`: one row for each site. The column `site` names it; the others are options of slide-logs by
      their   names (`dem`, `releases`, `friction`, `time-limit-s` or `time_limit_s`, ...). An empty cell or a
      missing column takes   the option given to run-sites, or the default of slide-logs. Relative paths are
      relative to the table;
    - `configs FOLDER`: a JSON file for each site (`NAME.json`, or `NAME/manifest.json`), as slide-logs --config
      reads it;
    - `by FIELD`: one layer of releases on one terrain model; each value of the field is a site. Of a large
      terrain model   only the window that the logs of a site can reach is read, so releases may be scattered
      over a whole region.

    The folder holds `sites/SITE`, the complete run of slide-logs for each site; `overview.csv`, one row for
    each site and line; `overview.gpkg`, the same at the releases; `overview.png`; `summary.json`; and
    `merged/DEM`, the rasters of all sites on one terrain model, as those of one run over all their logs. Sites
    that slide the same logs are scenarios and are not added up (use compare-scenarios). `report` adds a page of
    the first 12 sites.

    If a site fails, one line gives the reason, and the others are finished; the exit status is then 2. `resume`
    continues an interrupted run, also in the middle of a site, and a run with failures once their causes are
    fixed: what is finished and unchanged is not slid again. Each site is the run that slide-logs would make of
    it, bit for bit. With scheduler all sites share its workers, which are started once.

    Parameters
    ----------
    dem : optional
        Terrain model, where the sites name none. A raster, a folder of tiles, or tiles separated by commas.
    releases : point
        Released logs, where the sites name none.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0
        Friction coefficient, where the sites name none. A number, a raster, or polygons with a field 'friction'
        or 'mu'.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH, where the layer has none.
    length_m : m, 0 < x <= 150, default 30
        Length, where the layer has none.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density, where the layer has none.
    orientation : one of upright, lying, tilted, default upright
        Orientation, where the layer has none.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    friction_preset : one of wet-debarked, wet-bark, chute-dry, chute-watered, chute-iced
        Friction coefficient by name. wet-debarked: a wet log without bark and branches on wet ground, 0.2 to
        0.3 (friction 0.25); wet-bark: a wet log with its bark on wet ground, 0.25 to 0.38 (friction 0.31);
        chute-dry: a log in a dry timber chute, about 0.15 (friction 0.15); chute-watered: a log in a watered
        timber chute, 0.03 to 0.08 (friction 0.055); chute-iced: a log in an iced timber chute, 0.03 to 0.12
        (friction 0.075).
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    fidelity : one of draft, standard, fine, reference, auto, default standard
        Speed against accuracy. auto: the cheapest that keeps error, or the best within budget.
    error : 0 < x <= 0.5
        Permitted error of the reach of a line, with fidelity auto. 0.02 means ±2 points from what reference
        would give, at 95 %, by sampling and by calculation together. Needs lines.
    budget : optional
        Time for the run in place of that error, with fidelity auto. 60s, 5min or 1h: the most accurate fidelity
        and number of logs for that time on this machine, within about a tenth. report and qgis_project take
        additional time.
    assume : one of none, standard, draft, default standard
        Errors of calculation taken from the benchmark's slopes, with fidelity auto. none: nothing, so that
        reference is used. standard: the errors of standard and fine. draft: that of draft as well.
    time_step_s : s, 1e-05 <= x <= 1
        Longest time step, instead of the fidelity's.
    station_spacing_m : m, 0.001 <= x <= 100
        Spacing of the contact stations, instead of the fidelity's.
    own_slope : optional
        Logs of the run that slide again at a finer fidelity: how many, or none. Shows how far the reach of each
        line is off on this slope. If no number is given, 200, or down to 100 so that they take at most a fifth
        of the run's time; with budget none. Needs lines.
    friction_range : optional
        Friction over which the reach of lines is given, too: LOW-HIGH, or auto. 0.2-0.3, for example; auto
        takes the range of the preset or, without one, of the table (list --presets). A part of the logs slides
        again at draft, at both ends and, if the posture at the start is assumed, in another one: about a third
        more time. Needs lines and a friction that is a number.
    trajectories : default 1000
        Logs whose trajectory is kept: all, none, or how many. Chosen by seed and log_id alone.
    until_ci : 0.0001 <= x <= 0.5
        End when every line's reach interval is this narrow (half-width). 0.005 means ±0.5 points. Logs run in a
        random order, at most all. Checks after 1000, 2000, 4000, ... logs use intervals widened for the
        repetition; the reported 95 % intervals are narrower. Needs lines.
    danger_least : >= 1, default 10
        Minimum number of passing logs for which a cell has a value. In danger.tif, which lines brings, cells
        with fewer are transparent.
    danger_counts : optional
        Also keep the counts of danger.tif. danger_count.tif, from which those of several runs add up; run-sites
        asks for it.
    log_capacity_kj : kJ, > 0
        Energy that a log of 40 cm DBH can lose in a hit before it breaks, to count the hits above.
    log_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which that grows.
    qgis_project : optional
        Add a QGIS project to the run. With styled and grouped layers, animated logs and a 3-D view:
        project.qgz, and scene.gpkg beside it.
    outline_every_s : s, >= 0.02, default 0.25
        Time between two outlines of the animated logs. In the QGIS project, for the logs that keep their
        trajectory.
    geoparquet : optional
        Write the run's layers as GeoParquet too. deposits.parquet, trajectories.parquet and so on, for programs
        that work on very many rows.
    report : optional
        Add one page of the first 12 sites. report.html (make-report).
    language : one of en, de, fr, it, default en
        Language of report and QGIS project.
    output : output, optional
        Folder of all runs. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    sites : optional
        Table with one row for each site.
    configs : optional
        Folder with a JSON file of parameters for each site.
    by : optional
        Field of the releases that distinguishes the sites.
    merge : optional
        Merge the rasters of sites on one terrain model.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("run-sites", RunSitesResult, locals())


class CountHitsResult(Result):
    """What `count_hits` leaves."""

    hits = RasterPart("--output")
    """Number of the chosen logs that overlap the cell at any time"""
    speed = RasterPart("--speed")
    """Quantiles of the largest speed of each log in each cell; one band for each"""
    energy = RasterPart("--energy")
    """Quantiles of the largest kinetic energy of each log in each cell; one band for each"""
    jump = RasterPart("--jump")
    """Quantiles of the largest clearance of each log above the terrain in each cell; one band for each"""
    danger = RasterPart("--danger")
    """Share of passing logs that later reach the line; NaN where fewer logs passed than --danger-least"""


def count_hits(
    *,
    run: PathInput,
    cell_m: float | None = None,
    release_id: str | list[str] | None = None,
    log_id: str | list[str] | None = None,
    stop_reason: str | list[str] | None = None,
    quantiles: NumbersInput = (50.0, 90.0, 95.0, 99.0),
    speed: str | os.PathLike[str] | bool | None = None,
    energy: str | os.PathLike[str] | bool | None = None,
    jump: str | os.PathLike[str] | bool | None = None,
    danger: str | os.PathLike[str] | bool | None = None,
    reaching: LayerInput | None = None,
    danger_least: int = 10,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> CountHitsResult:
    """Count from stored trajectories how many logs pass each cell, and how fast: any subset of logs, any cell
    size.

    The count is that of slide-logs: a log counts once in every cell that any part of its plan-view outline
    overlaps at any time (paper, section 4). With all trajectories stored, every log chosen and the run's own
    cell size it equals the run's hit_count.tif. Logs whose trajectory was not stored cannot be counted; the
    tool reports their number.

    speed, energy and jump write quantiles for each cell, one band each: of the largest value of each log in the
    cell, over the logs that pass it. Speed is that of the centre of mass; energy is the sum of translation and
    rotation, from the stored poses (within a few percent of the run's); jump is the clearance of the log. Cells
    that too few logs pass are empty: 50 % needs 6, 95 % 72, 99 % 368.

    danger writes the share of passing logs that later reach a line of reaching (default: the run's own lines),
    at that moment or later: band 1 for any line, band 2 the number that passed, then a band for each line.
    Cells that fewer than danger_least logs pass are transparent. With all trajectories stored and the run's own
    lines and cells it equals the run's danger.tif.

    Parameters
    ----------
    run : required
        Folder of a run. Written by slide-logs.
    cell_m : m, > 0
        Cell size. Default: the run's.
    release_id : optional
        Only logs of these releases. Comma-separated.
    log_id : optional
        Only these logs. Comma-separated.
    stop_reason : optional
        Only logs with these stop reasons. Comma-separated: rest, tree, barrier, left_dem, time_limit, failed.
    quantiles : %, 0 <= x <= 100, default 50,90,95,99
        Quantiles of the rasters below. A band each.
    speed : output, optional
        Quantiles of the logs' largest speed in each cell. True: beside the main output.
    energy : output, optional
        Quantiles of their largest kinetic energy. True: beside the main output.
    jump : output, optional
        Quantiles of their largest clearance above the terrain. True: beside the main output.
    danger : output, optional
        Share of the logs that reach lines after the cell. True: beside the main output. Bands: any line, number
        of logs that passed, each line.
    reaching : line or polygon
        Roads, railways, houses of that raster. Default: the lines of the run.
    danger_least : >= 1, default 10
        Minimum number of passing logs for which a cell has a value.
    output : output, optional
        Hit counts. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("count-hits", CountHitsResult, locals())


class ReachLinesResult(Result):
    """What `reach_lines` leaves."""

    reach = LayerPart("--output", "reach")
    """Each line or polygon: the probability that logs reach it, and with which speed and energy they arrive"""
    arrivals = LayerPart("--output", "arrivals")
    """One row for each log and line: the log's centre of mass when its outline first touches the line"""
    attribution = LayerPart("--output", "attribution")
    """One row for each release and line: which release reaches which object; drawn from the release to the
    place of contact"""
    origins = LayerPart("--output", "origins")
    """The arrivals, each where its log was released: from where are lines reached"""


def reach_lines(
    *,
    run: PathInput,
    lines: LayerInput,
    edge_m: float = 20.0,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> ReachLinesResult:
    """Find which stored trajectories reach roads, railways or houses (lines or polygons), with what energy, and
    from where.

    A log reaches a line when any part of its plan-view outline touches it at any time, and a polygon also when
    it starts inside (paper, equation 10). Each probability comes with its 95 % Wilson interval, over the logs
    whose trajectory was stored: with fewer than all of them stored it is an estimate from that sample.

    The layers of the output: `reach`, one row for each line; `arrivals`, one row for each log and line, with
    time, speed, energy of translation and of rotation, clearance below the log, height of its centre of mass
    above the terrain, direction of travel, and the angles to the line and to the log's own axis; `attribution`,
    one row for each release and line: which release reaches which object, with what probability; `origins`, the
    arrivals at the places where their logs were released. `map-origins` maps the share of logs that reach a
    line by release cell.

    Logs that left the terrain model would have moved on. The tool warns of them, and of logs that passed near
    its edge, where heights are least certain; `p_low_if_lost` and `p_high_if_lost` are the bounds if none or
    all of those that left before reaching the line had reached it. The shares are those of logs that have
    started; the probability of a start is not included.

    Parameters
    ----------
    run : required
        Folder of a run. Written by slide-logs.
    lines : line or polygon, required
        Roads, railways, houses.
    edge_m : m, >= 0, default 20
        Distance from the terrain model's edges within which logs cause a warning. Edges are its border and its
        nodata; more than half a log's length is recommended.
    output : output, optional
        Reach, arrivals, attribution and origins. Without it, in a temporary folder that lasts as long as the
        result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("reach-lines", ReachLinesResult, locals())


class DesignValuesResult(Result):
    """What `design_values` leaves."""

    design_values = TablePart("--output")
    """Percentiles at each barrier and line, over the logs that reach it"""


def design_values(
    *,
    run: PathInput,
    lines: LayerInput | None = None,
    percentiles: NumbersInput = (50.0, 90.0, 95.0, 99.0),
    confidence: float = 95.0,
    barrier_classes: Literal["etag-027", None] = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> DesignValuesResult:
    """Compute design values for barriers and lines: percentiles of energy, speed, height and impulse, with
    intervals.

    For each barrier of the run, and each line (a road, or a profile line across the slope where a barrier might
    stand): the 50, 90, 95 and 99 % percentiles, or others, over the logs that arrive there:

    - `energy`: kinetic energy of translation and rotation together; `translation` and `rotation`: each
      separately;
    - `speed`: of the centre of mass;
    - `height_needed`: the height above the terrain of the log's upper edge in the plane of the barrier or line,
      which a   barrier there must exceed.

    These are of all logs that come there, whether the barrier stops them or not: what the place needs, and the
    same for a barrier and for a line in its place. What the barrier of the chosen height receives is stated
    beside it, of the logs that hit it, just before the hit, the largest of each log:

    - `energy_hit`, `speed_hit`; `height_hit`: the height of the point that is hit, never more than the
      barrier's own, so it   says nothing about the height that is needed;
    - `impulse`: the momentum that the barrier takes up in a hit. A line has none, because nothing is hit there.

    At a barrier all of them are stored in every run. At a line they come from stored trajectories. Energies of
    rotation are within a few percent of the run's own, except those of hits, which are the run's own.

    The interval of a percentile is exact, by order statistics: the binomial distribution gives the two sorted
    values that enclose it with at least 95 % probability, whatever the distribution. A percentile without both
    ends is not shown: its cells are empty, and `note` states how many more arrivals it needs, in total 6 for 50
    %, 72 for 95 %, 368 for 99 %.

    `barrier_classes` names the weakest class of rockfall nets that holds each percentile of the energy and the
    upper end of its interval.

    The percentiles hold for the logs that were released: heavier logs or another friction give others. Barriers
    are rigid, so impulses are those of a wall, not of a net that deforms. Percentiles include no safety factor:
    the factors of the standard that applies (UNI 11211-4, ONR 24810) are the engineer's to apply.

    Parameters
    ----------
    run : required
        Folder of a run. Written by slide-logs.
    lines : line or polygon
        Roads, railways, houses in place of those of the run. Or profile lines across the slope. They need
        stored trajectories. Without it, the lines of the run.
    percentiles : %, 0 < x < 100, default 50,90,95,99
        Percentiles.
    confidence : %, 50 <= x <= 99.9, default 95
        Probability with which an interval holds its percentile, at least.
    barrier_classes : one of etag-027
        Classes of barriers, to find the weakest that holds the energies. etag-027: classes of rockfall
        protection kits by maximum energy level (MEL) (0: 100 kJ, 1: 250 kJ, 2: 500 kJ, 3: 1000 kJ, 4: 1500 kJ,
        5: 2000 kJ, 6: 3000 kJ, 7: 4500 kJ, 8: more). They were made for rocks; whether they suit wood is for an
        expert to decide.
    output : output, optional
        Design values by barrier or line, quantity and percentile. Without it, in a temporary folder that lasts
        as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("design-values", DesignValuesResult, locals())


class ValueTreesResult(Result):
    """What `value_trees` leaves."""

    values = LayerPart("--output", "values")
    """One row for each tree, lying log, barrier or stand, and line: how many more logs would reach it
    without"""
    planted = LayerPart("--output", "planted")
    """One row for each candidate and line: how many fewer logs would reach the line with it"""


def value_trees(
    *,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    run: PathInput,
    lines: LayerInput | None = None,
    stands: LayerInput | None = None,
    plant: LayerInput | None = None,
    plant_lying: LayerInput | None = None,
    logs: int | None = None,
    seed: int = 0,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> ValueTreesResult:
    """Compute the effect of each tree of a run: how many more logs would reach the road without it.

    For every standing tree, lying log and barrier of a run of slide-logs, for the stands of `stands` (polygons;
    a stand is all trees within), and for every line: the number of logs that reach the line, and that would
    without the object, with the interval of the difference (paired: the same logs); the logs that it holds at
    the end, the energy that it takes from all that hit it, and its rank.

    The result is exact for the logs of the run: the same, log by log, as a separate run without the object.
    Only logs that it affected are slid again; all others move in the same way without it. A tree that is hit
    often may have no effect, if the next one would hold the same logs; another has a negative effect: it
    deflects logs onto the road.

    `plant` does the opposite: points with `dbh_cm` and `height_m` (trees, or high stumps), each added alone,
    and how many fewer logs would then reach each line; `plant_lying` does so for lines of logs that would be
    left lying.

    The effect of several objects together is not the sum of their effects: two trees side by side may each have
    none, and together a large one. Name them as a stand, or compare two runs (compare-scenarios). The effect of
    a tree holds for these releases. Trees break only if they did in the run (`slide-logs --break-trees`).
    Damage to trees is not computed.

    Parameters
    ----------
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    run : required
        Folder of a run. Written by slide-logs.
    lines : line or polygon
        Roads, railways, houses in place of those of the run. Without it, the lines of the run.
    stands : polygon
        Stands whose trees are all removed together. Their id is stand_id, else name, else the row.
    plant : point
        Places where a tree or high stump could stand. With dbh_cm and height_m.
    plant_lying : line
        Places where a log could be left lying. From base to tip, with diameter_cm.
    logs : >= 1
        Logs to use (default: all of the run). A random subset, if all take too long: in a forest about seven
        times as long as the run.
    seed : >= 0, default 0
        Seed of the random draws.
    output : output, optional
        Effect of each tree, lying log, barrier and stand. Without it, in a temporary folder that lasts as long
        as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("value-trees", ValueTreesResult, locals())


class BreakTreesResult(Result):
    """What `break_trees` leaves."""

    reach_breaking = LayerPart("--output", "reach_breaking")
    """Each line or polygon: logs that reach it with rigid trees, and if those that would break absorb
    nothing"""
    broken = LayerPart("--output", "broken")
    """Every tree that a log would break"""


def break_trees(
    *,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    run: PathInput,
    tree_capacity_kj: float,
    tree_capacity_power: float = 2.0,
    lines: LayerInput | None = None,
    logs: int | None = None,
    seed: int = 0,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> BreakTreesResult:
    """Find how many more logs would reach the road if trees broke: each slides again without the trees it would
    break.

    In a run of slide-logs trees are rigid and unbreakable. `tree_capacity_kj` is the energy that a tree of 40
    cm DBH absorbs before it breaks (for others a power of the DBH). Every log whose hit exceeds it continues
    without that tree, and without the next that it would break, until it breaks none or has reached every line.
    A tree that breaks absorbs no energy here, whereas a real one absorbs some; so the true reach lies between
    that of the run and that of this tool.

    The layer `reach_breaking` has both bounds for each line, with the interval of their difference (paired: the
    same logs); `broken` has each tree that any log breaks, and how many do. There is no default capacity: use
    one that was measured for your species, and both ends of its range. Each log meets all trees: one that
    another log broke stands again. Logs and lying logs do not break.

    Parameters
    ----------
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    run : required
        Folder of a run. Written by slide-logs, with trees and with roads, railways or houses.
    tree_capacity_kj : kJ, > 0, required
        Energy that a tree of 40 cm DBH absorbs before it breaks.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    lines : line or polygon
        Roads, railways, houses in place of those of the run. Without it, the lines of the run.
    logs : >= 1
        Logs to use (default: all of the run). A random subset.
    seed : >= 0, default 0
        Seed of the random draws.
    output : output, optional
        Reach of each line with trees that break, and the trees. Without it, in a temporary folder that lasts as
        long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("break-trees", BreakTreesResult, locals())


class SiteBarriersResult(Result):
    """What `site_barriers` leaves."""

    summary_file = "summary.json"

    pareto = TablePart("pareto.csv")
    """One row for each single candidate, sorted by the remaining reach; then one for each chosen set of
    barriers"""
    barriers = LayerPart("barriers.gpkg", "barriers")
    """The run's own barriers and those chosen, with the effect of each when all stand; as slide-logs reads
    them"""


def site_barriers(
    *,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    run: PathInput,
    lines: LayerInput | None = None,
    candidates: LayerInput | None = None,
    above_m: NumbersInput = (10.0, 30.0),
    length_m: NumbersInput = (20.0, 40.0),
    height_m: NumbersInput = (2.0, 4.0),
    places: int = 2,
    count: int = 1,
    barrier_classes: Literal["etag-027", None] = None,
    logs: int | None = None,
    seed: int = 0,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> SiteBarriersResult:
    """Find where a barrier has most effect, and how long and high it must be, sliding only the affected logs
    again.

    Candidates are the lines of a layer (candidates), or straight pieces along contours above the lines of the
    run: for each height above them (above_m) and each length (length_m) the few places that most logs pass on
    their way to a line (places). Such a piece has both ends on the contour, has the requested length in plan
    from end to end, and deviates by at most 30 degrees from the contours of the ground under it (`angle_deg`).
    Each candidate is tested alone, with each height_m, and the logs that come near it slide again. Then the
    best is chosen, then the best one in addition, until there are count, or none has an effect beyond chance.

    The folder holds

    - `pareto.csv`: each candidate alone, and each chosen set: how many logs still reach a line, the interval of
      that and of   the gain (paired), how many it holds and how many jump over or pass beside it. What its
      place needs are the 95 %   percentiles of energy and height of all logs that come there, without its plate
      (`height_needed_p95_m`,   `energy_needed_p95_kj`, with exact intervals): the same for each height of a
      place. Those of the logs that hit the   barrier stand beside them (`height_hit_p95_m`, never more than its
      height). `pareto` marks the candidates that no   other of the same or smaller length and height
      outperforms; `barrier_classes` adds the weakest class of rockfall   nets that holds the energy needed;
    - `barriers.gpkg`: the run's own barriers and those chosen, for slide-logs --barriers, with the effect of
      each once all   stand; `barriers.png`: a map, and remaining reach against length and height;
      `summary.json`.

    The results are exact for the logs of the run: the same as a separate run with those barriers. But the best
    of many was selected on these logs and has a slightly smaller effect on others (another seed). Barriers are
    rigid and infinitely strong. Where one can be founded, and at what cost, is for an expert to decide.

    Parameters
    ----------
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    run : required
        Folder of a run. Written by slide-logs, with roads, railways or houses.
    lines : line or polygon
        Roads, railways, houses in place of those of the run. Without it, the lines of the run.
    candidates : line
        Lines where a barrier could stand. With barrier_id and, optionally, height_m; without that field each
        has every height_m. Without the layer, straight pieces along contours.
    above_m : m, > 0, default 10,30
        Heights of contours above the lines. Above the nearest place.
    length_m : m, > 0, default 20,40
        Lengths of pieces along contours.
    height_m : m, 0 < x < 350, default 2,4
        Heights of barriers.
    places : >= 1, default 2
        Places for each contour and length.
    count : >= 1, default 1
        Barriers to choose, at most.
    barrier_classes : one of etag-027
        Classes of barriers, to find the weakest that holds the energies. etag-027: classes of rockfall
        protection kits by maximum energy level (MEL) (0: 100 kJ, 1: 250 kJ, 2: 500 kJ, 3: 1000 kJ, 4: 1500 kJ,
        5: 2000 kJ, 6: 3000 kJ, 7: 4500 kJ, 8: more). They were made for rocks; whether they suit wood is for an
        expert to decide.
    logs : >= 1
        Logs to use (default: all of the run). A random subset.
    seed : >= 0, default 0
        Seed of the random draws.
    output : output, optional
        Folder of table, layer and map. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("site-barriers", SiteBarriersResult, locals())


class MapIntensityResult(Result):
    """What `map_intensity` leaves."""

    summary_file = "classes.json"

    intensity = RasterPart("intensity.tif")
    """Class of the ENERGY, from 1; 0 where no log passed; classes.json has the meaning of each"""
    passage = RasterPart("passage.tif")
    """Class of the share of the logs that pass, from 1; 0 where no log passed; classes.json has the meaning of
    each"""
    return_class = RasterPart("return_class.tif")
    """Class of the return period of any passage, from 1; 0 where no log passed; classes.json has the meaning of
    each"""
    matrix = RasterPart("matrix.tif")
    """Highest class of intensity over the scenarios with the first scenario that has it, from 1; 0 where no log
    passed; classes.json has the meaning of each"""
    return_period = RasterPart("return_period.tif")
    """Mean time between events that reach the cell; NaN where no log passed"""
    lines = TablePart("lines.csv")
    """Each line, by the minimum energy that reaches it; the columns of rates and return periods only with a
    frequency"""
    process_area = LayerPart("process_area.gpkg", "process_area")
    """The outline of the ground that at least this share of the logs pass; an indication map"""


def map_intensity(
    *,
    run: PathInput,
    energy_classes_kj: NumbersInput = (30.0, 300.0),
    energy_raster: RasterInput | None = None,
    least_passage: float = 1.0,
    probability_classes: NumbersInput = (0.1, 1.0, 10.0),
    events_per_year: float | None = None,
    releases: LayerInput | None = None,
    events_field: str | None = None,
    logs_per_event: int = 1,
    return_periods_years: NumbersInput = (30.0, 100.0, 300.0),
    lines: LayerInput | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> MapIntensityResult:
    """Map classes of intensity and probability of a run, with return periods if the frequency of starts is
    known.

    The folder holds, for the ground that any log passed:

    - `intensity.tif`: class of the energy that at least `least_passage` of the logs (1 %) bring to the cell,
      from   stored trajectories: 1 below 30 kJ, 2 from 30 to 300 kJ, 3 from 300 kJ; 0 where fewer pass. With
      few logs the areas   of rare classes come out too large, so an area is stated only from the number of logs
      that supports it (`n_needed`:   about 9500 for 1 %), before that only its interval;   `energy_raster`
      takes another energy, such as the 95 % quantile of `count-hits`, where enough logs pass;
    - `passage.tif`: class of the share of logs that passed: 1 below 0.1 %, 2 to 1 %, 3 to 10 %, 4 from 10 %;
    - `process_area.gpkg`: the outline of the ground that at least this share of the logs passes, an indication
      map;
    - with a frequency, `intensity_30_years.tif`, `intensity_100_years.tif`, `intensity_300_years.tif`: for each
      scenario   the class of the energy that comes to the cell at least once in its return period, as
      `lines.csv` has it for lines;
    - `matrix.tif`: with a frequency, of all scenarios the highest class of intensity with the shortest return
      period that   reaches it: 10 times that class, plus 1 for 30 years, 2 for 100, 3 for 300; without one, 10
      times the class of   intensity plus that of passage;
    - with a frequency, `return_period.tif` (of any passage: years, and the ends of the 95 % interval) and
      `return_class.tif`: 1 up to 30 years, 2 up to 100, 3 up to 300, 4 beyond;
    - `lines.csv`: for each line the number of logs that reach it with at least 0, 30, 300 kJ, their share and
      its return   period, each with its interval;
    - `classes.json`: the meaning and the area of every class.

    The frequency is that of events in each release area: `events_per_year`, or a column of the releases with
    the same number in all rows of an area (`events_field`). An event releases `logs_per_event` logs. Where
    areas differ in frequency, their hits are counted separately, from stored trajectories.

    The classes of 30 and 300 kJ and of 30, 100 and 300 years are those of the Swiss federal recommendations for
    rockfall (BRP, BWW and BUWAL 1997; BAFU 2016), as published by the canton of Valais (vs.ch). They were made
    for rock: whether they suit wood, and which hazard a field of the matrix stands for, is an expert's
    decision. A cell is classed by its estimate; `classes.json` has the 95 % interval of the area of each class
    of energy and those above it. A cell that no log passed is empty, which is not a guarantee: `classes.json`
    states how probable a passage there may still be, and how short its return period.

    Parameters
    ----------
    run : required
        Folder of a run. Written by slide-logs.
    energy_classes_kj : kJ, > 0, default 30,300
        Bounds of the classes of energy.
    energy_raster : optional
        Other energies to classify [kJ]. Band 1; such as that of deadwood-tool count-hits --energy FILE
        --quantiles 95.
    least_passage : %, 0 <= x <= 100, default 1
        Minimum share of the logs that bring the energy of a class. 0: the largest energy of all logs, which
        grows with their number, so that no area is stated.
    probability_classes : %, 0 < x < 100, default 0.1,1,10
        Bounds of the classes of passage. Of the logs.
    events_per_year : > 0
        Events per year in each release area.
    releases : point or polygon
        Releases or release areas with a column of events per year. With release_id; without it, the run's own
        releases.
    events_field : optional
        Column of events per year. Default, with releases: events_per_year.
    logs_per_event : 1 <= x <= 1000000, default 1
        Logs that start in an event.
    return_periods_years : years, > 0, default 30,100,300
        Bounds of the classes of return period.
    lines : line or polygon
        Roads, railways, houses in place of those of the run. Their reach is computed from stored trajectories.
    output : output, optional
        Folder of the maps. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("map-intensity", MapIntensityResult, locals())


class MapOriginsResult(Result):
    """What `map_origins` leaves."""

    summary_file = "origins.json"

    origins = RasterPart("origins.tif")
    """Origin of the logs that reach the lines, by release cell"""
    sources = LayerPart("origins.gpkg", "sources")
    """One row for each line and minimum share: the cells from which at least this share of the logs reach it"""
    affected = LayerPart("origins.gpkg", "affected")
    """One row for each release area and minimum share: the cells that at least this share of its logs pass"""


def map_origins(
    *,
    run: PathInput,
    lines: LayerInput | None = None,
    cell_m: float | None = None,
    least: int = 10,
    source_shares: NumbersInput = (1.0, 10.0, 50.0),
    affected_shares: NumbersInput = (1.0, 10.0),
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> MapOriginsResult:
    """Map the places from which a road is reached: the share of logs that reach it, by the place of release.

    The folder holds

    - `origins.tif`: four bands for any line and for each line, of the logs released in a cell: the share that
      reaches the   line, both ends of its 95 % Wilson interval, the number that reach it; the last band is the
      number released. Where   fewer than least logs were released the cell is transparent. The cell size is
      such that nine of ten logs lie in   cells with a share, or that of cell_m;
    - `origins.gpkg`, layer `sources`: for each line the ground from which at least a given share of the logs
      reach it   (source_shares), with their share and its interval; layer `affected`: for each release area the
      ground that at least   a given share of its logs pass (affected_shares), from stored trajectories (not
      needed with one release area);
    - `origins.png`: a map of the shares and of both ends of their intervals; `origins.json`: all in numbers.

    Releases over all ground on which logs start, with a density that follows the share that does:

    The shares are of all logs released, whether they start to slide or not. A place where no log was released
    is empty: nothing is known about it.

    Parameters
    ----------
    run : required
        Folder of a run. Written by slide-logs.
    lines : line or polygon
        Roads, railways, houses in place of those of the run. Their reach is computed from stored trajectories.
    cell_m : m, > 0
        Cell size of the raster. Default: the smallest of 1, 2, 3, 5, 10, ... m with which nine of ten logs lie
        in cells with a share.
    least : >= 1, default 10
        Minimum number of logs released in a cell for which it has a share.
    source_shares : %, 0 < x <= 100, default 1,10,50
        Minimum shares of the polygons of sources. Of the logs.
    affected_shares : %, 0 < x <= 100, default 1,10
        Minimum shares of the polygons of affected ground. Of a release area's logs.
    output : output, optional
        Folder of the maps. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("map-origins", MapOriginsResult, locals())


class LateralSpreadResult(Result):
    """What `lateral_spread` leaves."""

    spread = LayerPart("--output", "spread")
    """Each release: the sector that contains its deposits"""
    azimuths = LayerPart("--output", "azimuths")
    """Each deposit as seen from the centre of its release"""


def lateral_spread(
    *,
    deposits: LayerInput,
    min_runout_m: float | None = None,
    dem: TerrainInput | None = None,
    edge_m: float = 20.0,
    seed: int = 0,
    crs: str | int | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> LateralSpreadResult:
    """Measure how widely the deposits of each release spread: their azimuths, and the smallest angle around
    them.

    The angle is seen from the centre of the release area (paper, equation 11), and is counted across north: 350
    and 10 degrees span 20. Deposits nearer than the minimum run-out are left out: the azimuth of a log that
    hardly moved is meaningless. The smallest angle grows with the number of logs, because single outliers
    decide it: `spread_half_deg`, its mean over random halves of the logs, shows by how much, and it has no
    interval. To compare runs of different size, use the range from the 5 % to the 95 % quantile, which has a 95
    % interval by order statistics, from 72 deposits on.

    Logs that left the terrain model would have moved on: the tool warns of them, and of logs that ended near
    its edge, where heights are least certain. For a layer of deposits that belongs to no run it needs dem.

    Parameters
    ----------
    deposits : point, required
        Deposits, or the folder of their run. Written by slide-logs.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count. Default: one log length, from the field length_m.
    dem : optional
        Terrain model, for the distance to its edges. Default: the run's, if it still exists. A raster, a folder
        of tiles, or tiles separated by commas.
    edge_m : m, >= 0, default 20
        Distance from the terrain model's edges within which deposits cause a warning. Edges are its border and
        its nodata; more than half a log's length is recommended.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    output : output, optional
        Spread of each release, and the azimuth of each deposit. Without it, in a temporary folder that lasts as
        long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("lateral-spread", LateralSpreadResult, locals())


class FitFlightResult(Result):
    """What `fit_flight` leaves."""

    flights = LayerPart("--output", "flights")
    """The path of the centre of mass between take-off and landing; a straight line if no parabola joins them"""
    clearances = LayerPart("--output", "clearances")
    """Where a flight crosses a barrier: a point on its top"""


def fit_flight(
    *,
    dem: TerrainInput,
    flights: LayerInput,
    barriers: LayerInput | None = None,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    takeoff_deg: float | None = None,
    slope_over_m: float = 5.0,
    tolerance_m: float = 0.3,
    crs: str | int | None = None,
    overwrite: bool = False,
    output: str | os.PathLike[str] | None = None,
    plots: str | os.PathLike[str] | bool | None = None,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> FitFlightResult:
    """Fit the flight of a log between mapped take-off and landing points: did it jump, how fast, and over which
    barrier?

    The two points on the terrain and the take-off angle define one parabola (paper, section 5.2). The angle is
    that of the terrain before the take-off, in the direction of the flight, because a sliding log leaves the
    ground along it; or it is given. The layer ``flights`` holds the path of the centre of mass with take-off
    speed, duration, apex, landing speed and angle, the largest height above the terrain, and a ``verdict``.
    With barriers, the layer ``clearances`` gives how far the underside of the log, with its axis parallel to
    the velocity, passes above the top of each barrier that the flight crosses. ``plots`` draws a profile of
    each flight.

    Verdicts: ``above_launch_line`` (the landing point is not below the line along which the log takes off: no
    speed reaches it), ``cuts_terrain`` (the ground in between protrudes into the flight by more than
    ``tolerance_m``), ``hits_barrier``, or ``possible``. A flight is a line from take-off to landing, or two
    points that share a ``flight_id`` and have the ``role`` takeoff and landing (if there are only two points,
    neither is needed). The centre of mass is half a DBH above the ground at both ends. Columns ``takeoff_deg``,
    ``dbh_cm`` and ``length_m`` override the options.

    The speed depends on the angle: try a few degrees more and less. The paper's log flew at 24 m/s over a
    barrier of 3.5 m; this one, from the cliff band of the sample, at about the same speed:

    Air drag and spin are not modelled. As in the paper the centre of mass comes down at the landing point,
    although the front of a steeply falling log touches earlier; where ``free`` in ``clearances`` is 0, one end
    of the log is on the ground while it passes.

    Parameters
    ----------
    dem : required
        Terrain (DEM). A raster, a folder of tiles, or tiles separated by commas.
    flights : line or point, required
        Lines from take-off to landing, or points of both.
    barriers : line
        Barriers.
    dbh_cm : cm, > 0, default 75
        DBH, where the layer has none.
    length_m : m, > 0, default 30
        Length, where the layer has none.
    takeoff_deg : °, -85 <= x <= 85
        Take-off angle, upward positive, where the layer has none. Without it: the slope of the terrain in the
        direction of the flight.
    slope_over_m : m, > 0, default 5
        Distance before the take-off over which that slope is measured.
    tolerance_m : m, >= 0, default 0.3
        Depth to which the terrain may protrude into a flight.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    overwrite : optional
        Replace an output that exists.
    output : output, optional
        Flights and clearances (.gpkg). Without it, in a temporary folder that lasts as long as the result.
    plots : output, optional
        Folder of the profiles. True: beside the main output.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("fit-flight", FitFlightResult, locals())


class CompareScenariosResult(Result):
    """What `compare_scenarios` leaves."""

    summary_file = "comparison.json"

    table = TablePart("table.csv")
    """The same for a spreadsheet: shares in percent, rounded as far as the intervals allow"""
    comparison = TablePart("comparison.csv")
    """Every quantity of every scenario with its 95 % interval, and its difference from the first"""
    moved = LayerPart("changes.gpkg", "moved")
    """Displacement of each log's deposit, from the first scenario to another"""
    changed = LayerPart("changes.gpkg", "changed")
    """Logs that reach a line in one of two scenarios only, where they were released"""


def compare_scenarios(
    *,
    runs: PathsInput,
    names: str | list[str] | None = None,
    baseline: str | list[str] | None = None,
    lines: LayerInput | None = None,
    min_runout_m: float | None = None,
    seed: int = 0,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> CompareScenariosResult:
    """Compare runs of the same logs: with the forest and without, as mapped and random, with barriers or a dam.

    Every scenario is compared with the baseline log by log: each log is its own control, so a few hundred logs
    show what would take thousands in independent runs. The folder holds

    - `table.csv`: for a spreadsheet, one row for each quantity and scenario: reach, stop reasons, lateral
      spread, speed,   run-out, each with its 95 % interval and its difference to the baseline, rounded as these
      justify;
    - `comparison.csv`: the same in full precision; for shares also the number of logs that changed either way,
      the p-value   of McNemar's exact test, and the bounds where logs left the terrain model before
      (`..._if_lost`);
    - `difference_NAME.tif`: how much more probable the passage of each cell is, and that difference in standard
      errors;
    - `changes.gpkg`: the logs that reach a line in one of two scenarios only (`changed`, at their releases),
      and how each   deposit moved (`moved`);
    - `comparison.png`: reach, run-outs and the maps side by side;
    - `comparison.json`: all of it, and the parameters in which the runs differ.

    For each line it gives the indices of a protection forest used in practice (after Dupire et al. 2016),
    against the baseline, with a bootstrap interval that draws the same logs in both: `bari` = 1 - N / N0, for
    the logs that reach it; `miri` = 1 - E95 / E95_0, for the 95 % quantile of their energies there; `orpi` = 1
    - S / S0, for the sum of these. 1 is full protection, 0 none. Energies need stored trajectories (`slide-logs
    --trajectories all`); for details see docs/indices.md.

    Runs of other releases are refused. The intervals are over the logs: one random forest is one draw of many,
    and only further runs show how much another would differ.

    Parameters
    ----------
    runs : required
        Folders of the runs. Each a folder of slide-logs, of the same releases, separated by commas:
        run_none,run_forest,run_barriers.
    names : optional
        Names of the scenarios, separated by commas. Default: the names of the folders.
    baseline : optional
        Name of the run that the others are compared with. Default: the run with the fewest obstacles (trees,
        barriers, lying logs, boulders); if several have, the first of them.
    lines : line or polygon
        Roads, railways, houses in place of those of the runs. Their reach is computed from stored trajectories,
        of the logs that have one in every run.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    output : output, optional
        Folder of the comparison. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("compare-scenarios", CompareScenariosResult, locals())


class CalibrateFrictionResult(Result):
    """What `calibrate_friction` leaves."""

    summary_file = "calibration.json"

    calibration = TablePart("calibration.csv")
    """One row for each coefficient of friction"""
    deposits = LayerPart("calibration.gpkg", "deposits")
    """The simulated deposits of every coefficient of friction"""
    no_deposit = LayerPart("calibration.gpkg", "no_deposit")
    """The last places of logs that have no deposit: they left the terrain model, failed, or still moved"""
    observed = LayerPart("calibration.gpkg", "observed")
    """The event's deposits, as they were given"""


def calibrate_friction(
    *,
    dem: TerrainInput,
    releases: LayerInput,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: NumbersInput = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5),
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    observed: LayerInput | None = None,
    error_m: float = 10.0,
    search_complete: bool = False,
    reached: LayerInput | None = None,
    not_reached: LayerInput | None = None,
    event_logs: int = 1,
    event_reached: int | None = None,
    logs: int = 1000,
    fidelity: Literal["draft", "standard", "fine", "reference"] = "standard",
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> CalibrateFrictionResult:
    """Find the friction coefficients that reproduce an observed event: where logs came to rest, or what they
    reached.

    The same released logs slide with one coefficient after the other. Each coefficient is scored by the
    likelihood of the observation. The range of those that reproduce it contains the true one in 95 % of events,
    if everything else is right (the scores are defined in `calibration/score.py`). The observation is one of

    - observed: deposits, as points (with error_m, the error of the place and of what the model cannot
      represent) or as   areas in which logs came to rest (the width of a road). A field release_id gives the
      release of each. They   count as a sample of an unknown number of logs: each is compared with the
      simulated logs that came to rest on the   terrain model, and the number that leave it has no influence. If
      all logs of the event were found, set   search_complete; coefficients with which logs leave are then less
      likely, because none did in the event;
    - reached and not_reached: lines or areas that event_logs of the event's logs reached, or did not reach.
      Both   together define a stop line: with too little friction logs go beyond, with too much they do not get
      there.

    The folder holds `calibration.csv` (one row for each coefficient), `calibration.json`, `calibration.png`,
    and `calibration.gpkg` with the simulated deposits of every coefficient (`no_deposit`: the last positions of
    logs that have none) and the observed ones.

    The paper found 0.2 to 0.3 on cells of 0.5 m. A coefficient is valid for the cell size on which it was
    found: a coarser terrain model lacks roughness, for which friction compensates. It also compensates for any
    other error: the releases, the trees, the shape of the logs. Few observed logs give wide ranges.

    Parameters
    ----------
    dem : required
        Terrain model. A raster, a folder of tiles, or tiles separated by commas.
    releases : point, required
        Released logs.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0, default 0.1,0.15,0.2,0.25,0.3,0.35,0.4,0.45,0.5
        Friction coefficients to try. Separated by commas, or from:to:step, such as 0.1:0.5:0.05.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH, where the layer has none.
    length_m : m, 0 < x <= 150, default 30
        Length, where the layer has none.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density, where the layer has none.
    orientation : one of upright, lying, tilted, default upright
        Orientation, where the layer has none.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    observed : point or polygon
        Observed deposits: points, or areas in which logs came to rest. The centres of the logs; a field
        release_id gives the release of each.
    error_m : m, > 0, default 10
        Error of the observed points and of what the model cannot represent. Standard deviation in each
        direction.
    search_complete : optional
        All logs of the event were found. With observed: none came to rest elsewhere. Otherwise logs that
        leave the terrain model have no influence on the score.
    reached : line or polygon
        Line or area that the event reached.
    not_reached : line or polygon
        Line or area that it did not reach.
    event_logs : 1 <= x <= 1000, default 1
        Logs of the event, of which lines or areas were reached or not.
    event_reached : 0 <= x <= 1000
        Number of these that reached it. Default: all.
    logs : >= 2, default 1000
        Logs to slide with each coefficient. A random subset by seed and log_id; all if the layer has fewer.
    fidelity : one of draft, standard, fine, reference, default standard
        Speed against accuracy.
    output : output, optional
        Folder of the calibration. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("calibrate-friction", CalibrateFrictionResult, locals())


class CompareFidelityResult(Result):
    """What `compare_fidelity` leaves."""

    summary_file = "comparison.json"

    comparison = TablePart("comparison.csv")
    """Every quantity at every fidelity, and its difference from the finest"""


def compare_fidelity(
    *,
    dem: TerrainInput,
    releases: LayerInput,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: float | RasterInput | LayerInput | None = None,
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    friction_preset: Literal["wet-debarked", "wet-bark", "chute-dry", "chute-watered", "chute-iced", None] = None,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    fidelities: str | list[str] = "draft,standard,fine,reference",
    logs: int = 2000,
    planned_logs: int | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> CompareFidelityResult:
    """Measure on your own scene the cost and the error of each fidelity, and find the cheapest that is accurate
    enough.

    The same logs slide at every fidelity. The results are compared with those of the finest: the reach of every
    line, the spread and the distance of the deposits, the hit raster, top speeds and jumps, beside the CPU time
    of a log and the calculation's own measures (penetration, energy, unconverged steps). Differences have
    intervals over the logs, to separate errors from chance. The posture of the logs at the start is compared,
    too, at the cheapest fidelity: all of them upright, and all of them lying in random directions, because it
    can matter as much as friction.

    The recommendation is the cheapest fidelity whose error is shown to be below the sampling noise of a run of
    your number of logs: |difference of reach| + half-width of its paired interval <= half-width of the 95 %
    interval of such a run, for every line. Without lines, the deposit distance and the hit raster are compared
    with the distance between two halves of the logs. If too few logs were compared to show this, the tool says
    so and estimates how many are needed: among trees up to twice the number of the run.

    Errors beyond the finest fidelity compared, and errors of the inputs, are not included: friction and terrain
    model matter more.

    Parameters
    ----------
    dem : required
        Terrain model. A raster, a folder of tiles, or tiles separated by commas.
    releases : point, required
        Released logs.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0
        Friction coefficient. A number, a raster, or polygons with a field 'friction' or 'mu'. Needed, unless
        friction_preset names one.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH, where the layer has none.
    length_m : m, 0 < x <= 150, default 30
        Length, where the layer has none.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density, where the layer has none.
    orientation : one of upright, lying, tilted, default upright
        Orientation, where the layer has none.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    friction_preset : one of wet-debarked, wet-bark, chute-dry, chute-watered, chute-iced
        Friction coefficient by name. wet-debarked: a wet log without bark and branches on wet ground, 0.2 to
        0.3 (friction 0.25); wet-bark: a wet log with its bark on wet ground, 0.25 to 0.38 (friction 0.31);
        chute-dry: a log in a dry timber chute, about 0.15 (friction 0.15); chute-watered: a log in a watered
        timber chute, 0.03 to 0.08 (friction 0.055); chute-iced: a log in an iced timber chute, 0.03 to 0.12
        (friction 0.075).
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    fidelities : default draft,standard,fine,reference
        Fidelities to compare. At least two, separated by commas; the others are compared with the finest.
    logs : >= 1, default 2000
        Logs to compare. A random subset by seed and log_id; all if the layer has fewer.
    planned_logs : >= 1
        Logs of the planned run. Default: all of the layer.
    output : output, optional
        Folder of the comparison. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("compare-fidelity", CompareFidelityResult, locals())


class VaryResult(Result):
    """What `vary` leaves."""

    summary_file = "summary.json"

    runs = TablePart("runs.csv")
    """One row for each run of the same logs: the values of the factors, and the results"""
    tornado = TablePart("tornado.csv")
    """One row for each outcome and factor: its effect alone, between the ends of its range"""
    indices = TablePart("indices.csv")
    """One row for each outcome and factor: its share of the variance over all ranges; only with a design"""


def vary(
    *,
    dem: TerrainInput,
    releases: LayerInput,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: float | RasterInput | LayerInput | None = None,
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    friction_preset: Literal["wet-debarked", "wet-bark", "chute-dry", "chute-watered", "chute-iced", None] = None,
    threads: int | None = None,
    scheduler: str | list[str] | None = None,
    workers: int | None = None,
    plan: bool = False,
    plan_logs: int = 400,
    plan_workers: int = 16,
    resume: bool = False,
    restart: bool = False,
    vary: PathsInput = "friction_factor,rolling_friction,log_dbh_factor,log_length_factor",
    design: Literal["ends", "latin", "sobol"] = "latin",
    samples: int = 32,
    logs: int = 300,
    dem_noise_length_m: float = 5.0,
    fidelity: Literal["draft", "standard", "fine", "reference"] = "draft",
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> VaryResult:
    """Find the most influential inputs: friction, the sizes of logs and trees, the terrain model, and others.

    The same logs slide again and again, each time with other values of the factors of vary. Two results follow,
    for the reach of every line and for the mean run-out:

    - the tornado: every factor alone at both ends of its range, with the others unchanged. The swing between
      the ends has   the interval of a paired difference over the logs (Tango's; for run-outs a bootstrap);
    - the indices, with design latin or sobol: all factors at once, over all of their ranges. The first-order
      index is the   share of the variance that a factor accounts for alone, the total-effect index the share in
      which it has a part, alone   or with others (Saltelli et al. 2010, Jansen 1999). The chance contribution
      of a small number of logs is subtracted;   the intervals are by bootstrap over the design's rows and the
      logs. The design has (factors + 2) x samples runs.

    The folder holds `tornado.csv`, `tornado.png`, `indices.csv`, `runs.csv` (one row for each run) and
    `summary.json` with a sentence that names the most influential input, or states that there are too few logs
    to decide.

    You choose the ranges: a wide one makes its factor strong. The default ranges are suggestions (rolling
    friction 0.03 to 0.15, because no value has been measured for logs). Values in a range count as equally
    likely and factors as independent. Inputs that are not varied have no part in the result. The error of the
    terrain model is a random surface, the same for all logs: the tornado uses one of them, the design another
    in every row.

    Parameters
    ----------
    dem : required
        Terrain model. A raster, a folder of tiles, or tiles separated by commas.
    releases : point, required
        Released logs.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0
        Friction coefficient. A number, a raster, or polygons with a field 'friction' or 'mu'. Needed, unless
        friction_preset names one.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH, where the layer has none.
    length_m : m, 0 < x <= 150, default 30
        Length, where the layer has none.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density, where the layer has none.
    orientation : one of upright, lying, tilted, default upright
        Orientation, where the layer has none.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    friction_preset : one of wet-debarked, wet-bark, chute-dry, chute-watered, chute-iced
        Friction coefficient by name. wet-debarked: a wet log without bark and branches on wet ground, 0.2 to
        0.3 (friction 0.25); wet-bark: a wet log with its bark on wet ground, 0.25 to 0.38 (friction 0.31);
        chute-dry: a log in a dry timber chute, about 0.15 (friction 0.15); chute-watered: a log in a watered
        timber chute, 0.03 to 0.08 (friction 0.055); chute-iced: a log in an iced timber chute, 0.03 to 0.12
        (friction 0.075).
    threads : >= 1
        Threads (default: every core).
    scheduler : optional
        Where to slide: local, or the address of a Dask scheduler. local starts processes on this machine,
        tcp://HOST:PORT names a running scheduler, whose workers then slide the logs; the results are identical,
        byte for byte. Default: threads of this process.
    workers : >= 1
        Workers started (local) or waited for, with a scheduler. Default: one for each core (local), or one.
    plan : optional
        Only state what the run would take. From a pilot of plan_logs: logs, core-hours, memory, disk and
        time. Nothing is written.
    plan_logs : >= 10, default 400
        Logs of the plan's pilot, at most.
    plan_workers : 1 <= x <= 1000000, default 16
        Workers for which the plan also states the time.
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    vary : default friction_factor,rolling_friction,log_dbh_factor,log_length_factor
        Factors and their ranges. NAME=LOW:HIGH, separated by commas, or a JSON or CSV file of them. A name
        alone takes its default range: friction 0.2:0.3, friction_factor 0.8:1.2, rolling_friction 0.03:0.15,
        restitution 0:0.2, tree_friction 0.2:0.6, tree_restitution 0:0.2, log_dbh_factor and log_length_factor
        0.9:1.1, log_density_factor 0.7:1.3, tree_dbh_factor 0.9:1.1, dem_noise_m 0:0.1, fidelity
        draft:standard, orientation upright:random-lying (the logs' posture at the start; also random). Factors
        multiply the values of the layers.
    design : one of ends, latin, sobol, default latin
        How to vary: the ends of each range alone, or also all together. latin: a Latin hypercube; sobol:
        Sobol's sequence, which needs SciPy. Both give the indices.
    samples : 8 <= x <= 65536, default 32
        Rows of the design. The design has (factors + 2) times as many runs. For sobol a power of two.
    logs : >= 2, default 300
        Logs to slide in each run. A random subset by seed and log_id; all if the layer has fewer.
    dem_noise_length_m : m, > 0, default 5
        Distance over which errors of the terrain model are alike. At this distance their correlation is 0.37;
        at least one cell.
    fidelity : one of draft, standard, fine, reference, default draft
        Speed against accuracy. Differences depend less on it than single results; the factor 'fidelity' shows
        how much.
    output : output, optional
        Folder of the variation. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("vary", VaryResult, locals())


class ExploreResult(Result):
    """What `explore` leaves."""


def explore(
    *,
    dem: TerrainInput,
    trees: LayerInput | None = None,
    barriers: LayerInput | None = None,
    height_field: str | None = None,
    lying_logs: LayerInput | None = None,
    blocks: LayerInput | None = None,
    lines: LayerInput | None = None,
    friction: float | RasterInput | LayerInput | None = None,
    friction_column: str | list[str] | None = None,
    friction_elsewhere: float | None = None,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    tree_capacity_kj: float | None = None,
    tree_capacity_power: float = 2.0,
    break_trees: bool = False,
    shape: PathsInput = "cone",
    friction_max: float | None = None,
    friction_kappa: float | None = None,
    friction_beta: float | None = None,
    soil_strength_mn_m2: float | None = None,
    scar_drag: float | None = None,
    time_limit_s: float = 300.0,
    rest_speed_ms: float = 0.1,
    dbh_cm: float = 75.0,
    length_m: float = 30.0,
    density_kg_m3: float = 300.0,
    orientation: Literal["upright", "lying", "tilted"] = "upright",
    tilt_deg: float = 0.0,
    azimuth_deg: float = 0.0,
    speed_ms: float = 0.0,
    drop_m: float = 0.0,
    lying_diameter_cm: float = 40.0,
    min_runout_m: float | None = None,
    seed: int = 0,
    crs: str | int | None = None,
    friction_preset: Literal["wet-debarked", "wet-bark", "chute-dry", "chute-watered", "chute-iced", None] = None,
    fidelity: Literal["draft", "standard", "fine", "reference"] = "draft",
    threads: int | None = None,
    port: int = 0,
    no_browser: bool = False,
    stdio: bool = False,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> ExploreResult:
    """Try things on a slope: click to slide logs, fell a tree or draw a barrier, and see the effect within a
    second.

    Loads the scene once, keeps the engine in memory, and opens a page in the browser. Release logs with a
    click, and see the share that reaches each line with its interval; fell or plant trees, draw barriers and
    lying logs, and see the paired difference for the same logs. A result can be saved as a run of slide-logs,
    with the changed layers; it is the same as what slide-logs gives for them, byte for byte.

    The page is served on this machine's loopback address only, to whoever has the token in the printed address.
    Ctrl-C ends it. Logs move as in slide-logs, at draft unless another fidelity is chosen. With 300 logs a
    share is accurate to a few percentage points; its interval shows how many. If the terrain model has more
    than 25 million cells, only the extent of the layers and 500 m around it are read; a log that leaves this
    part counts as having left the terrain model.

    Parameters
    ----------
    dem : required
        Terrain model. A raster, a folder of tiles, or tiles separated by commas.
    trees : point
        Standing trees.
    barriers : line
        Barriers.
    height_field : optional
        Field of the barriers' height in m. Without it: by its usual name.
    lying_logs : line
        Lying logs that hold others back. Lines from base to tip with a field 'diameter_cm' (or 'dbh_cm') and,
        optionally, 'tip_diameter_cm'. They are rigid, rest on the terrain and do not move.
    blocks : point
        Boulders that hold logs back. Points with a field 'diameter_m' (or 'radius_m') and, optionally,
        'height_m', that of the top above the terrain. They are rigid spheres, do not move, and have the
        ground's friction and restitution.
    lines : line or polygon
        Roads, railways, houses.
    friction : >= 0
        Friction coefficient. A number, a raster, or polygons with a field 'friction' or 'mu'. Default: 0.25.
    friction_column : optional
        Column of the friction polygons. Default: 'friction', else 'mu'.
    friction_elsewhere : >= 0
        Friction where the raster or the polygons have none. Without it, a layer that does not cover the DEM is
        refused.
    restitution : 0 <= x <= 1, default 0
        Normal restitution of impacts.
    rolling_friction : 0 <= x <= 0.5, default 0.1
        Coefficient of rolling friction of the ground. The moment against rolling is at most this times the
        normal force times the log's radius. A roller of 0.6 m that sinks in by 1, 5, 10 mm has 0.04, 0.09,
        0.13; 0 is rigid ground. No value measured for logs is known.
    tree_friction : >= 0
        Friction of stems and lying logs. Default: that of the ground there.
    tree_restitution : 0 <= x <= 1
        Restitution of stems and lying logs. Default: that of the ground.
    barrier_friction : >= 0
        Friction of barriers. Default: that of the ground there.
    barrier_restitution : 0 <= x <= 1
        Restitution of barriers. Default: that of the ground.
    tree_capacity_kj : kJ, > 0
        Energy that a tree of 40 cm DBH absorbs in a hit before it breaks. slide-logs counts the hits in which a
        tree takes more, and the logs that had one; with break_trees the trees break.
    tree_capacity_power : 0 <= x <= 6, default 2
        Exponent of DBH / 40 cm with which it grows.
    break_trees : optional
        Trees break above their capacity. Such a tree absorbs just its capacity and then disappears, for this
        log only; for other logs it stands. Without it trees are rigid, as in the paper.
    shape : default cone
        Shape of what slides: cone, or a file of points. A .pts file (x y z on each line, metres, no header)
        slides the convex hull of its points instead of logs: rocks, or logs as rings of vertices. dbh_cm and
        length_m of the releases are then ignored, the density is used; its z axis replaces the axis of a log.
    friction_max : >= 0
        Friction coefficient after much slip, for a point cloud. Friction grows from friction to this while
        the body touches the ground: mu(s) = mu_min + (2/pi) (mu_max - mu_min) atan(kappa s), s the distance its
        centre has moved on the ground (Leine et al. 2014). Needs friction_kappa and friction_beta.
    friction_kappa : 1/m, > 0
        How fast friction grows with slip, for a point cloud. After a slip of 1/kappa it is halfway.
    friction_beta : 1/s, >= 0
        How fast slip decays in the air, for a point cloud. Off the ground the slip decays as exp(-beta t).
    soil_strength_mn_m2 : MN/m2, > 0
        Strength of soft ground, into which a point cloud digs. M_E of the scarring model of Lu et al. (2019),
        10 to 25 on the alpine meadow of its experiments: the deeper a body digs in, the longer the soil brakes
        it. Needs scar_drag. Without it the ground is hard.
    scar_drag : >= 0
        Drag coefficient of the soil that is compacted, for soft ground. C_s of the same model, 0.1 to 4 there;
        it adds to 1 for the soil that flows.
    time_limit_s : s, 0 < x <= 86400, default 300
        Longest simulated time of a log.
    rest_speed_ms : m/s, > 0, default 0.1
        Speed below which a log may be at rest.
    dbh_cm : cm, 0 < x <= 1500, default 75
        DBH, where the layer has none.
    length_m : m, 0 < x <= 150, default 30
        Length, where the layer has none.
    density_kg_m3 : kg/m³, 0 < x <= 25000, default 300
        Density, where the layer has none.
    orientation : one of upright, lying, tilted, default upright
        Orientation, where the layer has none.
    tilt_deg : °, 0 <= x <= 180, default 0
        Tilt from the vertical, likewise.
    azimuth_deg : °, default 0
        Azimuth of tip and speed, where the layer has none.
    speed_ms : m/s, 0 <= x <= 300, default 0
        Initial speed, likewise.
    drop_m : m, 0 <= x <= 1000, default 0
        Clearance at the start, where the layer has none.
    lying_diameter_cm : cm, 0 < x <= 1500, default 40
        Base diameter of lying logs, where the layer has none.
    min_runout_m : m, >= 0
        Minimum run-out of deposits that count for the spread. Default: one log length.
    seed : >= 0, default 0
        Seed of the random draws.
    crs : optional
        CRS of inputs without one. An authority code such as EPSG:2056, for a DEM or layer whose file holds no
        CRS; local: metres on a local grid.
    friction_preset : one of wet-debarked, wet-bark, chute-dry, chute-watered, chute-iced
        Friction coefficient by name. wet-debarked: a wet log without bark and branches on wet ground, 0.2 to
        0.3 (friction 0.25); wet-bark: a wet log with its bark on wet ground, 0.25 to 0.38 (friction 0.31);
        chute-dry: a log in a dry timber chute, about 0.15 (friction 0.15); chute-watered: a log in a watered
        timber chute, 0.03 to 0.08 (friction 0.055); chute-iced: a log in an iced timber chute, 0.03 to 0.12
        (friction 0.075).
    fidelity : one of draft, standard, fine, reference, default draft
        Fidelity at the start: speed against accuracy.
    threads : >= 1
        Threads (default: every core).
    port : 0 <= x <= 65535, default 0
        Port of the page. 0: any free one.
    no_browser : optional
        Only print the address of the page.
    stdio : optional
        Answer on standard input and output instead of a page. For programs, such as the panel in QGIS: one line
        of JSON for each message, binary frames as answers.
    output : output, optional
        Folder in which runs are kept. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("explore", ExploreResult, locals())


class MakeReportResult(Result):
    """What `make_report` leaves."""


def make_report(
    runs: PathsInput,
    *,
    names: str | list[str] | None = None,
    results: PathsInput | None = None,
    baseline: str | list[str] | None = None,
    title: str | list[str] | None = None,
    author: str | list[str] | None = None,
    project: str | list[str] | None = None,
    language: Literal["en", "de", "fr", "it"] = "en",
    annex: bool = False,
    figures: str | os.PathLike[str] | bool | None = None,
    gltf: str | os.PathLike[str] | bool | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> MakeReportResult:
    """Make one HTML page of a run, or of several side by side: maps, figures, tables and a 3-D view, for screen
    and print.

    The page is self-contained: it needs no network, no server and no other file. Any browser opens it from the
    file system, it prints on A4, and it can be sent as an annex. It states the question and the answer, what
    was modelled and what was not, and shows the map with layers to switch, the reach of each line with both
    kinds of error, arrivals, lateral spread, run-out, speeds and jumps, profiles along trajectories, the
    balances of barriers and trees, the measured accuracy, and the provenance. The 3-D view replays logs: the
    fastest, the farthest, those that reach a line, and a random sample.

    All that is not signed is in an annex, which the reader opens, and which is printed while it is open.

    With results the page also has the results of other tools: the effect of each tree, the best places for a
    barrier, classes of intensity and return periods, the places from which lines are reached, and the most
    influential inputs.

    For several runs of the same releases the page also has the paired differences of `compare-scenarios`, with
    maps. If an input of a run (the terrain model, the trees) is no longer at its path, the page omits it and
    says so. Its figures are rounded for reading: numbers for further work are in the run's own files.

    Parameters
    ----------
    runs : required
        Folders of the runs. Each a folder of slide-logs, separated by commas. On the command line they may also
        be given without the option.
    names : optional
        Names of the runs, separated by commas. Default: the names of the folders.
    results : optional
        Results of other tools to be shown. Separated by commas: a layer of value-trees, folders of
        site-barriers, map-intensity, map-origins or vary; each with its run.
    baseline : optional
        Name of the run that the others are compared with. Default: the run with the fewest obstacles (trees,
        barriers, lying logs, boulders); if several have, the first of them.
    title : optional
        Title of the page. Default: the names of the runs.
    author : optional
        Author responsible for the page. Shown in its scenario box.
    project : optional
        Project or order. Shown in its scenario box.
    language : one of en, de, fr, it, default en
        Language of the page.
    annex : optional
        The annex is open, and so is printed. Without it the reader opens it.
    figures : output, optional
        Folder for every figure as PNG, SVG and PDF. True: beside the main output. For other documents.
    gltf : output, optional
        The first run's scene as binary glTF (.glb), for other viewers. True: beside the main output. Terrain,
        trees, barriers, lying logs and boulders in true size, and the moving logs as an animation.
    output : output, optional
        HTML page to write. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("make-report", MakeReportResult, locals())


class ViewResult(Result):
    """What `view` leaves."""


def view(
    run: PathInput,
    *,
    language: Literal["en", "de", "fr", "it"] = "en",
    progress: bool = False,
    feedback: Feedback | None = None,
) -> ViewResult:
    """Open a run's report in the browser; if there is none yet, it is made and kept in the run's folder.

    The page is `report.html` in the folder, as `slide-logs --report` and `make-report` write it. It opens from
    the file system; nothing is sent anywhere. An existing report is opened unchanged: `make-report --overwrite`
    renews it.

    Parameters
    ----------
    run : required
        Folder of a run, or of a demo.
    language : one of en, de, fr, it, default en
        Language of a page that has to be made.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("view", ViewResult, locals())


class CheckResult(Result):
    """What `check` leaves."""


def check(
    path: PathsInput,
    *,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> CheckResult:
    """Verify a result: which run it belongs to, and whether its inputs and files are unchanged.

    For any result (a folder, a file in it, or a single file) the tool reports which tool made it, when, and in
    which run; whether this toolbox has the same engine, which gives the same bits; whether files, rows and
    pixels are as they were written; and which inputs are the same, have changed or are missing. Inputs that
    were moved together with the result are found. How a layer is drawn (a style, the QGIS project) may change.

    The exit status is 0 if nothing has changed, 3 if something has changed or is missing or if the result has
    no seal, so that this is unknown, and 2 for a file that is not a result.

    Parameters
    ----------
    path : required
        Result to check: a folder or a file.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("check", CheckResult, locals())


class ReproducePaperResult(Result):
    """What `reproduce_paper` leaves."""

    summary_file = "findings.json"

    findings = TablePart("findings.csv")
    """The same as a table"""
    sensitivity = TablePart("sensitivity.csv")
    """The findings with one chosen number of the twin changed"""


def reproduce_paper(
    *,
    site: Literal["klosters", "rothenbrunnen", "both"] = "both",
    logs: int = 20000,
    deciding_logs: int = 20000,
    fidelity: Literal["draft", "standard", "fine", "reference"] = "standard",
    quick: bool = False,
    site_data: PathInput | None = None,
    twin_version: Literal["1", "2"] = "2",
    no_panel: bool = False,
    seed: int = 0,
    threads: int | None = None,
    resume: bool = False,
    restart: bool = False,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> ReproducePaperResult:
    """Repeat sections 5, 6 and the appendices of the paper on two synthetic twins, and assess its findings one
    by one.

    The folder holds `findings.json` (statement, section, the paper's value, ours with its interval, whether it
    holds, why, and the verdict: holds, does not hold, not decided, cannot be judged here), the same as
    `findings.csv` and `findings.md`, `report.html` with the figures beside the paper's (3, 4, A1, B1), and
    every run. A finding is assessed (an order, a direction, the size of a ratio), not the value on another
    slope. The twins and the rules were fixed before the first run; the numbers of the twins, each with its
    source, are in `deadwood_algorithms/paper/README.md`; `twin_version 1` uses the twins of the versions before
    November 2026. Findings that fewer than 20 000 logs leave undecided are repeated with 20 000.

    Each finding has a sensitivity panel (`sensitivity.csv`): the same finding as it is, with the log as the
    paper's point cloud (`make-log`; also as findings of their own, whose ids end in `.cloud`), and, on the
    twins of version 2, with one assumed number of the twin changed (width of treeless strips, roughness, places
    of release, rolling friction, another draw of relief and forest, and others). The panel slides a tenth of
    the logs at `draft`, whose cost and error are in `benchmarks/README.md`. Its runs are not kept; `no_panel`
    leaves it out.

    `quick` takes a few hundred logs and a coarser set: it shows that everything works and assesses nothing.
    `resume` continues an interrupted run; what is finished is not slid again.

    With `site_data FOLDER` the data of the real sites replace the twins. FOLDER has a folder `klosters`,
    `rothenbrunnen` or both, each with

    - `dem.tif`, or a folder `dem` of tiles (swissALTI3D 0.5 m, as GeoTIFF);
    - `trees.gpkg` (`dbh_cm`, `height_m`), or `trees.csv`, any table that `import-trees` reads;
    - `releases.gpkg`: the mapped places as points with `release_id` (10 m around each), or polygons;
    - `lines.gpkg`: lines with `line_id`: `road`; Klosters also `beyond`, 20 m below the road, Rothenbrunnen
      `terrace`,   across the place of the take-off;
    - `barriers.gpkg` (`barrier_id`, `height_m`; the one that was jumped is `south`), `forest.gpkg` (the stand's
      outline);
    - if there are any, `dams.gpkg` (as for `add-structures`) and `flight.gpkg` (as for `fit-flight`);
    - `site.json`, if a number differs from the paper's: `friction`, `dbh_cm`, `length_m`, `density_kg_m3`,
      `release_radius_m`, and, of Rothenbrunnen, `rock_friction`, `rock_slip` (friction after much slip, kappa
      in   1/m, beta in 1/s, as `slide-logs` has them), `rock_density_kg_m3`.

    Parameters
    ----------
    site : one of klosters, rothenbrunnen, both, default both
        Which site.
    logs : 8 <= x <= 10000000, default 20000
        Logs of each scenario, over all releases. The sweeps of friction and cells use a fifth of them, each run
        of the sensitivity panel a tenth.
    deciding_logs : 0 <= x <= 10000000, default 20000
        Logs of each scenario for findings that fewer leave undecided. The paper's number. 0 leaves them open.
    fidelity : one of draft, standard, fine, reference, default standard
        Speed against accuracy.
    quick : optional
        At most 300 logs and a coarser set, in a minute or two; not assessed.
    site_data : optional
        Data of the real sites, instead of the twins.
    twin_version : one of 1, 2, default 2
        Which twins. 1: those until November 2026.
    no_panel : optional
        Leave out the sensitivity panel.
    seed : >= 0, default 0
        Seed of the random draws.
    threads : >= 1
        Threads (default: every core).
    resume : optional
        Continue an interrupted run.
    restart : optional
        Give up an interrupted run and start again.
    output : output, optional
        Folder of the findings. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("reproduce-paper", ReproducePaperResult, locals())


class WarmUpResult(Result):
    """What `warm_up` leaves."""


def warm_up(
    *,
    shapes: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> WarmUpResult:
    """Compile the engine for this machine before the first run: once after each installation or update.

    The compiled code is kept in the user's cache folder (`NUMBA_CACHE_DIR` names another one) and is used by
    every tool and QGIS; an engine is compiled only once. `shapes` also compiles the kernels of point clouds
    (`slide-logs --shape`), which otherwise happens with the first of them.

    Parameters
    ----------
    shapes : optional
        Also the kernels of point clouds.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("warm-up", WarmUpResult, locals())


class DemoResult(Result):
    """What `demo` leaves."""

    summary_file = "demo.json"

    dem = RasterPart("dem.tif")
    """A terrain model, with the number type of the original"""
    release_area = LayerPart("release_area.gpkg", "release_area")
    """The circle in which the logs of the demo start"""
    releases = LayerPart("releases.gpkg", "releases")
    """Where logs start: the plan position of each log's centre of mass"""
    forest = LayerPart("forest.gpkg", "forest")
    """The outline of the forest of the demo"""
    lines = LayerPart("road.gpkg", "lines")
    """Roads, railways, houses and other objects that must not be reached, as lines or outlines"""
    barriers = LayerPart("barriers.gpkg", "barriers")
    """Protection works: thin rigid plates, vertical from the terrain up, infinitely strong"""


def demo(
    *,
    logs: int = 2000,
    fidelity: Literal["draft", "standard", "fine", "reference"] = "standard",
    seed: int = 0,
    threads: int | None = None,
    output: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool = False,
    feedback: Feedback | None = None,
) -> DemoResult:
    """Make a complete case without any input: the paper's Klosters case in small, with three forests and a
    picture.

    It writes a synthetic slope (nothing of it is measured) with a road at its foot, releases in a circle of 10
    m, a forest, as if mapped, that leaves a gully free, and a random forest of the same density. The same logs
    then slide through the mapped forest, through the random one and without forest, and `report.html` shows the
    three side by side. Every step is done by the tools themselves, and the folder holds their inputs and
    outputs: its manifests are enough to repeat each step.

    The paper found for its own slope that by far the most logs reach the road without forest, that a random
    forest lets no more through than the mapped one, and that the deposits spread wider with a forest than
    without.

    Parameters
    ----------
    logs : 1 <= x <= 1000000, default 2000
        Logs released in each forest.
    fidelity : one of draft, standard, fine, reference, default standard
        Speed against accuracy.
    seed : >= 0, default 0
        Seed of the random draws.
    threads : >= 1
        Threads (default: every core).
    output : output, optional
        Folder of the demo. Without it, in a temporary folder that lasts as long as the result.
    overwrite : optional
        Replace an output that exists.
    progress : bool
        Show on standard error what is done, and what the tool notes and warns of.
    feedback : Feedback, optional
        An object of your own that hears all that; see docs/python.md.
    """
    return call("demo", DemoResult, locals())
