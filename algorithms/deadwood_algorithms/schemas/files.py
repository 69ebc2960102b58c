"""The rasters, tables and JSON files that tools write.

A word in capitals stands for any text. Every raster has its style for QGIS beside it, in a file of the same name that
ends with ``.qml``.
"""

from __future__ import annotations

from collections.abc import Iterator

from deadwood_algorithms.schemas.brought import ORIENTATIONS
from deadwood_algorithms.schemas.obstacles import OBSTACLES, Obstacle
from deadwood_algorithms.schemas.results import BARRIER_CLASS, IF_LOST, SITE_COLUMNS, SITED_GAIN, SITED_HITS
from deadwood_algorithms.schemas.words import (
    Band,
    Column,
    JsonFile,
    Key,
    OtherFile,
    RasterFile,
    TableFile,
    a_number,
    a_text,
)

# --- rasters --------------------------------------------------------------------------------------------------------


def _one(name: str, meaning: str, unit: str, number: str = "float32", look: str = "") -> RasterFile:
    band = Band(name=name, meaning=meaning, unit=unit, number=number)
    return RasterFile(name=name, meaning=meaning, bands=(band,), look=look)


def _quantiles(name: str, what: str, unit: str) -> RasterFile:
    meaning = f"This quantile of {what}, over the logs that pass; empty where too few pass to show it"
    band = Band(name=f"{name}, PERCENT %", meaning=meaning, unit=unit)
    return RasterFile(
        name=name, meaning=f"Quantiles of {what} in each cell; one band for each", bands=(band,), look=name
    )


def _outcome(name: str, does: str) -> tuple[Band, ...]:
    return (
        Band(name=name, meaning=f"Share of the cell's logs that {does}, mean over the frictions", unit="1"),
        Band(name=f"{name}_ci_low", meaning="Lower end of its 95 % Wilson interval, for the number of logs", unit="1"),
        Band(name=f"{name}_ci_high", meaning="Upper end of it", unit="1"),
    )


MOBILISATION = RasterFile(
    name="mobilisation",
    look="danger",
    meaning="What logs do that are released in the cell",
    bands=(
        *_outcome("starts", "move more than the stated distance"),
        *_outcome("goes_far", "move more than their length, or the stated distance"),
        *_outcome("reaches", "reach a line; NaN without lines"),
        Band(name="slope_deg", meaning="Slope of the cell", unit="°"),
        Band(name="n_logs", meaning="Number of logs released in it", unit="logs"),
    ),
)
DEM = RasterFile(
    name="dem",
    look="terrain",
    meaning="A terrain model, with the number type of the original",
    bands=(Band(name="", meaning="Height of the ground", unit="m", number="NUMBER"),),
)
RUN_RASTERS = (
    _one(
        "hit_count",
        "Number of logs that touched the cell, in plan view, at any time; each log counts once",
        "logs",
        "uint32",
        "counts",
    ),
    _one(
        "reach_probability",
        "Share of all logs that touched the cell, in plan view, at any time",
        "1",
        look="shares",
    ),
    _one(
        "deposit_count",
        "Number of logs that come to rest on the cell",
        "logs",
        "uint32",
        "counts",
    ),
    _one("speed_max", "Largest speed of a log over the cell", "m/s", look="speed"),
    _one("energy_max", "Largest kinetic energy of a log over the cell", "kJ", look="energy"),
    RasterFile(
        name="jump_max",
        meaning="Heights of logs that pass the cell",
        look="jump",
        bands=(
            Band(
                name="jump_max",
                meaning="Largest clearance between a log over the cell and the terrain",
                unit="m",
            ),
            Band(
                name="height_max",
                meaning="Greatest height above the terrain of the centre of mass of a log that covers the cell",
                unit="m",
            ),
        ),
    ),
)
DANGER = RasterFile(
    name="danger",
    look="danger",
    meaning="Share of passing logs that later reach the line; NaN where fewer logs passed than --danger-least",
    bands=(
        Band(
            name="any_line",
            meaning="Share of the logs passing the cell that reached any line with the same outline or a later one",
            unit="1",
        ),
        Band(
            name="logs_passed",
            meaning="Number of logs that touched the cell, on which the shares are based",
            unit="logs",
        ),
        Band(name="LINE", meaning="Share that reached this line; one band for each line", unit="1"),
    ),
)
DANGER_COUNT = RasterFile(
    name="danger_count",
    look="counts",
    meaning="The counts behind danger.tif, with --danger-counts: those of several runs can be added",
    bands=(
        Band(
            name="any_line",
            meaning="Logs that touched the cell and reached any line then or later",
            unit="logs",
            number="uint32",
        ),
        Band(name="LINE", meaning="Logs that reached this line; one band for each line", unit="logs", number="uint32"),
    ),
)
HITS = _one("hits", "Number of the chosen logs that overlap the cell at any time", "logs", "uint32", "counts")
CELL_QUANTILES = (
    _quantiles("speed", "the largest speed of each log", "m/s"),
    _quantiles("energy", "the largest kinetic energy of each log", "kJ"),
    _quantiles("jump", "the largest clearance of each log above the terrain", "m"),
)
ORIGIN_REACH = RasterFile(
    name="origins",
    look="danger",
    meaning="Origin of the logs that reach the lines, by release cell",
    bands=(
        Band(name="any line", meaning="Share of the cell's logs that reach any line; NaN if too few", unit="1"),
        Band(name="any line: lower end", meaning="Lower end of its 95 % Wilson interval", unit="1"),
        Band(name="any line: upper end", meaning="Upper end of its 95 % Wilson interval", unit="1"),
        Band(name="any line: logs that reach", meaning="Number of the cell's logs that do", unit="logs"),
        Band(name="line LINE", meaning="Share that reaches this line; four bands for each line", unit="1"),
        Band(name="line LINE: lower end", meaning="Lower end of its 95 % Wilson interval", unit="1"),
        Band(name="line LINE: upper end", meaning="Upper end of its 95 % Wilson interval", unit="1"),
        Band(name="line LINE: logs that reach", meaning="Number of the cell's logs that do", unit="logs"),
        Band(name="logs released", meaning="Number of logs released in the cell", unit="logs"),
    ),
)
DIFFERENCE = RasterFile(
    name="difference_SCENARIO",
    look="difference of shares",
    meaning="Change of the probability that a log passes the cell, from the first scenario to this one",
    bands=(
        Band(
            name="difference",
            meaning="Share of the logs that pass, minus that of the first scenario",
            unit="1",
        ),
        Band(
            name="standard_errors",
            meaning="This difference in standard errors, as if different logs had been released in the two scenarios",
        ),
    ),
)


def _classes(name: str, what: str) -> RasterFile:
    return RasterFile(
        name=name,
        meaning=f"{what}, from 1; 0 where no log passed; classes.json has the meaning of each",
        bands=(Band(name=name, meaning=f"{what}; the colours of the classes are in the file", number="uint8"),),
    )


RETURN = RasterFile(
    name="return_period",
    look="return period",
    meaning="Mean time between events that reach the cell; NaN where no log passed",
    bands=(
        Band(name="return_period", meaning="Mean time between events", unit="a"),
        Band(name="ci_low", meaning="Lower end of its 95 % interval, for the number of logs", unit="a"),
        Band(name="ci_high", meaning="Upper end of its 95 % interval", unit="a"),
    ),
)
INTENSITY_MAPS = (
    _classes("intensity", "Class of the ENERGY"),
    _classes("passage", "Class of the share of the logs that pass"),
    _classes("return_class", "Class of the return period of any passage"),
    _classes("intensity_YEARS_years", "For each scenario: class of the energy that comes at least once in YEARS years"),
    _classes("matrix", "Highest class of intensity over the scenarios with the first scenario that has it"),
    RETURN,
)

# --- tables ---------------------------------------------------------------------------------------------------------

COMPARISON = TableFile(
    name="comparison.csv",
    meaning="Every quantity of every scenario with its 95 % interval, and its difference from the first",
    columns=(
        a_text("scenario", "Name of the scenario"),
        a_text("quantity", "What was measured"),
        a_text("item", "Subject: a line, a release, a stop reason; empty for all logs"),
        a_text("unit", "Unit of the value"),
        a_number("n", "Logs, or releases, behind it", 0),
        a_number("value", "The value"),
        a_number("ci_low", "Lower end of its 95 % interval"),
        a_number("ci_high", "Upper end"),
        a_number("difference", "The value minus that of the baseline"),
        a_number("diff_ci_low", "Lower end of the difference's 95 % interval, over the same logs"),
        a_number("diff_ci_high", "Upper end"),
        a_number("n_only_reference", "For a share: logs that do so in the baseline only", 0),
        a_number("n_only_scenario", "For a share: logs that do so in this scenario only", 0),
        a_number("p_mcnemar", "Probability of at least such a change by chance alone (McNemar's exact test)", 0, 1),
        a_number("n_lost", "Logs that left the terrain model before the outcome was known", 0),
        a_number("value_low_if_lost", "The value if none of these had done it"),
        a_number("value_high_if_lost", "The value if all had"),
        a_number("difference_low_if_lost", "The smallest difference, whatever they did"),
        a_number("difference_high_if_lost", "The largest"),
        a_number("diff_ci_low_if_lost", "Lower end of the 95 % interval of the least"),
        a_number("diff_ci_high_if_lost", "Upper end of that of the largest"),
        a_number("n_more", "Arrivals or logs missing to show the value; 0 if none", 0),
    ),
)


OVERVIEW = TableFile(
    name="table.csv",
    meaning="The same for a spreadsheet: shares in percent, rounded as far as the intervals allow",
    columns=(
        a_text("quantity", "What was measured"),
        a_text("of", "Subject: a line, a release, a stop reason; empty for all logs"),
        a_text("scenario", "Name of the scenario"),
        a_text("unit", "Unit of the values"),
        a_number("logs", "Logs, or releases, behind it", 0),
        a_number("value", "The value"),
        a_number("from", "Lower end of its 95 % interval"),
        a_number("to", "Upper end"),
        a_number("difference", "The value minus that of the first scenario"),
        a_number("difference_from", "Lower end of the difference's 95 % interval, over the same logs"),
        a_number("difference_to", "Upper end"),
        a_number("logs_lost", "Logs that left the terrain model before the outcome was known", 0),
        a_number("if_lost_from", "The value if none of these had done it"),
        a_number("if_lost_to", "The value if all had"),
        a_number("difference_if_lost_from", "The smallest difference, whatever they did"),
        a_number("difference_if_lost_to", "The largest"),
        a_number("needs_more", "Arrivals or logs missing to show the value; 0 if none", 0),
    ),
)
SITES_TABLE = TableFile(
    name="overview.csv",
    meaning="Many sites side by side: one row for each site and line, one row for a site that has no lines or "
    "that failed",
    columns=SITE_COLUMNS,
)
DESIGN_VALUES = TableFile(
    name="design_values.csv",
    meaning="Percentiles at each barrier and line, over the logs that reach it",
    columns=(
        a_text("kind", "Kind of the place", choices=("barrier", "line")),
        a_text("place_id", "The barrier or line"),
        a_text(
            "quantity",
            "Of all logs that come there: energy (translation and rotation together), each separately, speed, and "
            "height_needed, that of the upper edge in the plane of the place; of those that hit a barrier: energy_hit, "
            "speed_hit, height_hit, impulse",
            choices=(
                "energy",
                "translation",
                "rotation",
                "speed",
                "height_needed",
                "energy_hit",
                "speed_hit",
                "height_hit",
                "impulse",
            ),
        ),
        a_text("unit", "Unit of the values"),
        a_number("percentile", "Which percentile", 0, 100, unit="%"),
        a_number("n", "Logs behind it", 0),
        a_number("value", "The percentile; empty without any log"),
        a_number("ci_low", "Lower end of its exact interval; empty where the logs are too few for one"),
        a_number("ci_high", "Upper end"),
        a_number("n_more", "Further arrivals needed to show the percentile; 0 if none", 0),
        a_text("note", "The same in words, or why the quantity is missing"),
        a_number("n_lost", "Logs that left the terrain model and had not reached the place", 0),
        *BARRIER_CLASS,
    ),
)
SITED_TABLE = TableFile(
    name="pareto.csv",
    meaning="One row for each single candidate, sorted by the remaining reach; then one for each chosen set of "
    "barriers",
    columns=(
        a_number("step", "0: a candidate alone; from 1: the set chosen after that number of steps", 0),
        a_text("barriers", "The barriers of the set, with plus signs"),
        a_text("barrier_id", "The barrier added last, to which the following columns refer"),
        a_number("length_m", "Its length in plan", 0),
        a_number("height_m", "Its height", 0),
        a_number("above_m", "Height of its contour above the nearest place of a line; empty for a given line"),
        a_number("place", "Its place on that contour, from 1, the one that most logs pass; 0: a given line", 0),
        a_number("angle_deg", "Angle between it and the contours of the ground under it, in plan", 0, 90),
        a_number(
            "n_flux", "Logs that touch its line without the barrier, and then or later a road, railway or house", 0
        ),
        a_number("n_near", "Logs that come near it and were slid again", 0),
        a_number("n_total", "Logs that were slid", 0),
        a_number("n_reach", "Of these, the logs that reach a line with the barriers of the set", 0),
        a_number("p", "Their share", 0, 1),
        a_number("ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
        a_number("ci_high", "Upper end", 0, 1),
        *IF_LOST,
        *SITED_GAIN,
        *SITED_HITS,
        a_text("pareto", "yes: no candidate that is neither longer nor higher leaves a smaller reach; empty for a set"),
    ),
)
INTENSITY_LINES = TableFile(
    name="lines.csv",
    meaning="Each line, by the minimum energy that reaches it; the columns of rates and return periods only "
    "with a frequency",
    columns=(
        a_text("line_id", "The line or polygon"),
        a_number("at_least_kj", "Minimum energy of the logs that count; 0: all that reach it", 0),
        a_number("n_total", "Logs whose reach is known", 0),
        a_number("n_reach", "Of these, the logs that reach the line with this energy", 0),
        a_number("p", "Their share", 0, 1),
        a_number("ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
        a_number("ci_high", "Upper end", 0, 1),
        *IF_LOST,
        a_number("rate_per_year", "Events a year that reach the line with this energy", 0, unit="1/a"),
        a_number("rate_ci_low_per_year", "Lower end of its 95 % interval, for the number of logs", 0, unit="1/a"),
        a_number("rate_ci_high_per_year", "Upper end", 0, unit="1/a"),
        a_number("return_period_years", "Mean time between them; empty where no log reaches", 0, unit="a"),
        a_number("return_ci_low_years", "Lower end of its 95 % interval", 0, unit="a"),
        a_number("return_ci_high_years", "Upper end; empty where there is none", 0, unit="a"),
        a_number("return_ci_low_years_if_lost", "Lower end if all logs that left before reach it", 0, unit="a"),
        a_number("return_class", "Class of the return period, from 1, the shortest; 0 where no log reaches", 0),
        a_text("note", "Remark"),
    ),
)
CALIBRATION = TableFile(
    name="calibration.csv",
    meaning="One row for each coefficient of friction",
    columns=(
        a_number("friction", "The coefficient", 0),
        a_text("in_range", "Whether it is among those that reproduce the event (95 %)"),
        a_number("p_range", "Probability of an event as likely or less, if it were the true one", 0, 1),
        a_number("p_fit", "Share of the model's own events that are no more likely than the observed one", 0, 1),
        a_number("log_likelihood", "Logarithm of the likelihood of the event"),
        a_number("relative_likelihood", "Likelihood over that of the most likely coefficient", 0, 1),
        a_number("relative_ci_low", "Lower end of its 95 % interval, for the number of logs that were slid", 0),
        a_number("relative_ci_high", "Upper end", 0),
        a_number("energy_score_m", "Mean distance score of observed points and simulated deposits; smaller is better"),
        a_number(
            "runout_p05_m",
            "5 % quantile of the run-outs; a log without a deposit counts as farther; empty: among such logs",
            0,
        ),
        a_number("runout_median_m", "Their median", 0),
        a_number("runout_p95_m", "Their 95 % quantile", 0),
        a_number("speed_max_ms", "Largest speed of all logs", 0),
        a_number("without_deposit", "Logs that left the terrain model, failed, or still moved at the time limit", 0),
        a_number(
            "share", "Share of the logs that behave as observed, if the event is described by lines or areas", 0, 1
        ),
        a_number("share_ci_low", "Lower end of its 95 % Wilson interval", 0, 1),
        a_number("share_ci_high", "Upper end", 0, 1),
        a_number("n_lost", "Logs that left the terrain model before this was known", 0),
        a_number("share_low_if_lost", "The share if none of these did", 0, 1),
        a_number("share_high_if_lost", "The share if all did", 0, 1),
        a_number("reach_LINE", "Share of the logs that reach this line", 0, 1),
    ),
)
VARIED_RUNS = TableFile(
    name="runs.csv",
    meaning="One row for each run of the same logs: the values of the factors, and the results",
    columns=(
        a_number("run", "Its number", 1),
        a_text("label", "The unchanged scene, an end of a range, or a row of the design"),
        a_text("value_FACTOR", "The factor's value; empty where it is that of the scene"),
        a_number("dem_surface", "Which of the random surfaces was the terrain model's error", 0),
        a_number("logs", "Logs that were slid", 0),
        a_number("reach_LINE", "Share of the logs that reach this line", 0, 1),
        a_number("runout_mean_m", "Mean run-out", 0),
        a_number("left_dem", "Logs that left the terrain model", 0),
        a_number("time_limit", "Logs that still moved at the time limit", 0),
        a_number("failed", "Logs that failed", 0),
    ),
)
TORNADO = TableFile(
    name="tornado.csv",
    meaning="One row for each outcome and factor: its effect alone, between the ends of its range",
    columns=(
        a_text("outcome", "`runout_mean_m`, or `reach_` and a line"),
        a_text("factor", "The factor"),
        a_text("low", "Low end of its range"),
        a_text("high", "High end"),
        a_number("as_it_is", "The outcome with nothing varied"),
        a_number("at_low", "The outcome at the low end, the other factors as they are"),
        a_number("at_high", "The same at the high end"),
        a_number("swing", "The latter minus the former"),
        a_number("ci_low", "Lower end of its 95 % interval, over the same logs"),
        a_number("ci_high", "Upper end"),
        a_number("n_changed", "Logs whose outcome differs between the ends", 0),
        a_text("beyond_chance", "Whether the interval excludes 0"),
    ),
)
SENSITIVITY = TableFile(
    name="indices.csv",
    meaning="One row for each outcome and factor: its share of the variance over all ranges; only with a design",
    columns=(
        a_text("outcome", "`runout_mean_m`, or `reach_` and a line"),
        a_text("factor", "The factor"),
        a_number("first", "First-order index: its share of the variance alone; empty where nothing varies"),
        a_number("first_ci_low", "Lower end of its 95 % interval, over the rows of the design and the logs", 0, 1),
        a_number("first_ci_high", "Upper end", 0, 1),
        a_number("total", "Total-effect index: the share in which it is involved"),
        a_number("total_ci_low", "Lower end of its 95 % interval", 0, 1),
        a_number("total_ci_high", "Upper end", 0, 1),
        a_text(
            "crossed",
            "Whether the first-order index was estimated above the total one, by chance: both are then their mean",
        ),
        a_number("mean", "The outcome's mean over the ranges"),
        a_number("variance", "Its variance over the ranges, without the contribution of the finite number of logs"),
        a_number("variance_ci_low", "Lower end of the variance's 95 % interval; if it is 0, there are no indices"),
        a_number("variance_ci_high", "Upper end"),
    ),
)
FIDELITIES = TableFile(
    name="comparison.csv",
    meaning="Every quantity at every fidelity, and its difference from the finest",
    columns=(
        a_text("fidelity", "Name of the fidelity"),
        a_text("quantity", "What was measured"),
        a_text("item", "Subject: a line; empty for all logs"),
        a_text("unit", "Unit of the value"),
        a_number("value", "The value"),
        a_number("finest", "The value of the finest fidelity"),
        a_number("difference", "Value minus that of the finest fidelity, or a distance"),
        a_number("ci_low", "Lower end of the difference's 95 % interval, over the same logs"),
        a_number("ci_high", "Upper end"),
        a_number("noise", "Sampling noise of this quantity in a run with the planned number of logs", 0),
        a_text("verdict", "Whether the error is shown to be below this"),
    ),
)

# --- JSON -----------------------------------------------------------------------------------------------------------


def _key(name: str, meaning: str) -> Key:
    return Key(name=name, meaning=meaning)


def _whole(name: str, meaning: str) -> Key:
    return Key(name=name, meaning=meaning, whole=True)


_SHARE_KEYS = (
    _key("reach", "One per line, as layer `reach`"),
    _key("reach[].line_id", "The line"),
    _key("reach[].n_total", "Logs that were run"),
    _key("reach[].n_reach", "Of these, the logs that reach it"),
    _key("reach[].p", "Their share"),
    _key("reach[].ci_low", "Lower end of its 95 % Wilson interval"),
    _key("reach[].ci_high", "Upper end"),
    _key("reach[].n_lost", "Logs that left the terrain model without having reached it"),
    _key("reach[].p_low_if_lost", "The share if none of the lost logs reaches it"),
    _key("reach[].p_high_if_lost", "The share if all of them do"),
    _key("reach[].ci_low_if_lost", "Lower end of the 95 % interval if none does"),
    _key("reach[].ci_high_if_lost", "Upper end if all do"),
)


def _wood(name: str, what: str) -> tuple[Key, ...]:
    return (
        _key(name, f"Effect of all {what} together; null without them"),
        _key(f"{name}.n_total", f"How many {what} there are"),
        _key(f"{name}.n_hit", "How many of them were hit"),
        _key(f"{name}.n_hits", "Hits of all of them"),
        _key(f"{name}.n_stops", "Logs that they hold at the end"),
        _key(f"{name}.n_stopping", "Number of them that hold a log"),
        _key(f"{name}.impulse_sum_kns", "Momentum that they absorbed in impacts [kN s]"),
        _key(f"{name}.energy_taken_kj", "Energy that logs lost to them [kJ]"),
    )


def _range(name: str, what: str) -> tuple[Key, ...]:
    return (
        _key(name, what),
        _key(f"{name}.median", "Median"),
        _key(f"{name}.low", "Smallest"),
        _key(f"{name}.high", "Largest"),
    )


SIZES = {
    "dbh_cm": "Their DBH [cm]",
    "height_m": "Their heights [m]",
    "capacity_kj": "The energy that those that break absorb before [kJ]; missing: none breaks",
}


def _obstacle_keys(kind: Obstacle) -> Iterator[Key]:
    yield _key(f"scenario.{kind.key}", f"The {kind.meaning} that logs can meet")
    yield _key(f"scenario.{kind.key}.n", "How many")
    for size in kind.sizes:
        yield from _range(f"scenario.{kind.key}.{size}", SIZES[size])


_SCENARIO_KEYS = (
    _key("scenario", "The scenario as it was simulated: logs, laws of contact and scene"),
    _key("scenario.logs", "The logs that were run"),
    _key("scenario.logs.n", "How many"),
    *_range("scenario.logs.length_m", "Their lengths [m]"),
    *_range("scenario.logs.dbh_cm", "Their DBH [cm]"),
    *_range("scenario.logs.density_kg_m3", "Their densities [kg/m³]"),
    _key("scenario.logs.posture", "How they were released"),
    *(_key(f"scenario.logs.posture.{each}", f"Share of them that was {each}") for each in ORIENTATIONS),
    *_range("scenario.friction", "The ground's coefficient of friction: a number, or by cell its range"),
    _key("scenario.rolling_friction", "Coefficient of rolling friction; null for a shape of points"),
    _key("scenario.restitution", "Normal restitution of the ground"),
    _key("scenario.slip_friction", "How friction grows with slip; null where it does not"),
    _key("scenario.slip_friction.friction_max", "The coefficient after much slip"),
    _key("scenario.slip_friction.kappa_per_m", "After a slip of one over this it is halfway [1/m]"),
    _key("scenario.slip_friction.beta_per_s", "How fast slip decays in the air [1/s]"),
    _key("scenario.soft_ground", "The ground that a shape of points digs into; null where it is hard"),
    _key("scenario.soft_ground.strength_mn_m2", "Its strength M_E [MN/m²]"),
    _key("scenario.soft_ground.drag", "Drag coefficient of the soil that compacts"),
    _key("scenario.breaking", "Energy at which trees break; null if they do not"),
    _key("scenario.breaking.capacity_kj", "Energy that a tree of 40 cm DBH absorbs [kJ]"),
    _key("scenario.breaking.power", "Exponent of DBH / 40 cm with which it grows"),
    *(key for each in OBSTACLES for key in _obstacle_keys(each)),
    _key("scenario.lines", "The lines whose reach is counted"),
    _key("scenario.lines.n", "How many"),
    _key("scenario.dem", "The terrain model"),
    _key("scenario.dem.nx", "Its columns"),
    _key("scenario.dem.ny", "Its rows"),
    _key("scenario.dem.cell_m", "Side of its cells [m]"),
    _key("scenario.fidelity", "Name of the fidelity"),
    _key("scenario.seed", "Seed of the draws"),
)


def _above_keys(name: str, what: str) -> Iterator[Key]:
    yield _key(f"above_capacity.{name}", f"Hits above the capacity of {what}; null where it is not given")
    yield _key(f"above_capacity.{name}.n_hits", "How many")
    groups = {"all": "all logs", "held_by_trees": "logs that standing trees hold", "reach[]": "logs that reach a line"}
    for group, whose in groups.items():
        at = f"above_capacity.{name}.{group}"
        yield _key(at.removesuffix("[]"), f"Of {whose}")
        if group == "reach[]":
            yield _key(f"{at}.line_id", "The line")
        yield _key(f"{at}.n_logs", "Number of these logs")
        yield _key(f"{at}.n_above", "Those of them that had such a hit, anywhere on their path")
        yield _key(f"{at}.p", "Their share; null where there is none")
        yield _key(f"{at}.ci_low", "Lower end of its 95 % Wilson interval")
        yield _key(f"{at}.ci_high", "Upper end")


_ABOVE_KEYS = (
    _key(
        "above_capacity",
        "Hits above the capacity of trees or logs; null without --tree-capacity-kj and --log-capacity-kj",
    ),
    _key("above_capacity.tree_capacity_kj", "Energy that a tree of 40 cm DBH absorbs [kJ]"),
    _key("above_capacity.tree_capacity_power", "Exponent of DBH / 40 cm with which it grows"),
    _key(
        "above_capacity.break_trees",
        "Whether trees break above their capacity: hits above are then those that broke one",
    ),
    _key("above_capacity.log_capacity_kj", "Energy that a log of 40 cm DBH can lose in a hit [kJ]"),
    _key("above_capacity.log_capacity_power", "Exponent of DBH / 40 cm with which that grows"),
    *_above_keys("of_trees", "a standing tree"),
    *_above_keys("of_logs", "a log"),
)
_WARNING_KEYS = (
    _key("warnings", "What was said about the result, and what the records of its inputs warn of"),
    _key("warnings[].code", "Stable name of what is said"),
    _key("warnings[].text", "One line for a reader"),
    _whole("warnings[].numbers", "Its numbers by name"),
    _key("warnings[].level", "`warning`, what makes the result doubtful, or `note`, what was assumed"),
)
SUMMARY = JsonFile(
    name="summary.json",
    meaning="Summary of a run",
    keys=(
        _key("logs", "How many logs, and how they ended"),
        _key("logs.released", "Logs that were run"),
        _key("logs.not_run", "Logs of the layer that --until-ci or --error made unnecessary"),
        _key("logs.by_stop_reason", "Logs by stop reason"),
        _key("logs.by_stop_reason.REASON", "Number for each stop_reason of the deposits"),
        _key("logs.started_in_contact", "Logs that overlapped a tree, barrier, lying log or boulder at the start"),
        *_SHARE_KEYS,
        _key("friction_band", "With --friction-range: the reach at other frictions and postures; null without it"),
        _key("friction_band[].line_id", "The line"),
        _key("friction_band[].friction", "Friction; the first record of a line is that of the run"),
        _key("friction_band[].posture", "Posture of the logs at the start"),
        _key("friction_band[].p", "Share of the logs that reach it: the run's plus the difference of pairs at draft"),
        _key("friction_band[].ci_low", "Lower end of its 95 % interval"),
        _key("friction_band[].ci_high", "Upper end"),
        _key("friction_band[].n", "Logs that slid there"),
        _key(
            "held",
            "How firmly single trees hold logs, which depends on the friction there; null without trees",
        ),
        _key("held.n_by_one_tree", "Logs that one standing tree alone holds, beside the ground"),
        _key(
            "held.near_edge_deg",
            "Angle of its contact force to the edge of the friction cone that counts as near",
        ),
        _key("held.n_near_edge", "Logs closer to the edge than that, which would slip off with a little less friction"),
        _key("held.p_near_edge", "Their share of these logs; null where there is none"),
        _key("held.ci_low", "Lower end of its 95 % Wilson interval"),
        _key("held.ci_high", "Upper end"),
        *_ABOVE_KEYS,
        _key(
            "own_slope",
            "A sample of the run's logs, slid at a finer fidelity too; absent without lines",
        ),
        _key("own_slope.logs", "Logs of this sample"),
        _key("own_slope.fidelity", "Fidelity of the run"),
        _key("own_slope.finer", "The finer one"),
        _key("own_slope.by_line", "By line_id: the reach of the sample in the run minus that at the finer fidelity"),
        _key("own_slope.by_line.LINE", "The line"),
        _key("own_slope.by_line.LINE.difference", "Difference of the shares, of the same logs"),
        _key("own_slope.by_line.LINE.ci_low", "Lower end of its 95 % interval for paired shares (Tango)"),
        _key("own_slope.by_line.LINE.ci_high", "Upper end"),
        _key("own_slope.promised", "Largest error of the run's fidelity that the benchmark's slopes do not exclude"),
        _key("own_slope.flagged", "Whether the interval of any line lies outside that, on either side"),
        _key("until_ci", "How --until-ci ended the run; null without it"),
        _key("until_ci.target_half_width", "Half-width that was requested"),
        _key("until_ci.reached", "Whether every line's interval is that narrow"),
        _key("until_ci.half_width", "Half-width of the widest, widened for the repeated checks"),
        _key("until_ci.line_id", "Its line"),
        _key("until_ci.logs", "Logs that were run"),
        _key("until_ci.logs_at_most", "Logs that could have been"),
        _key(
            "until_ci.told_too_low",
            "Lines that less than 2 % of the logs reach, if the run stopped by itself: their share is underestimated "
            "on average, by up to a seventh; the interval remains valid",
        ),
        _key("until_ci.z", "Standard errors to either side of a widened interval"),
        _whole("until_ci.looks", "Half-width and line at each check"),
        _key("spread", "One for each release, as in layer `spread`"),
        _key("spread[].release_id", "The release"),
        _key("spread[].n", "Its logs"),
        _key("spread[].n_left_out", "Of these, deposits nearer than --min-runout-m"),
        _key("spread[].n_left_dem", "Logs that left the terrain model: their last positions count as deposits"),
        _key("spread[].spread_without_lost_deg", "spread_deg of the others alone [°]"),
        _key("spread[].p05_p95_without_lost_deg", "p05_p95_deg of the others alone [°]"),
        _key("spread[].spread_deg", "Smallest angle that contains the others [°]"),
        _key("spread[].p05_p95_deg", "Angle between the 5 % and the 95 % quantile of their azimuths [°]"),
        _key("spread[].p05_p95_ci_low_deg", "Lower end of its 95 % interval [°]"),
        _key("spread[].p05_p95_ci_high_deg", "Upper end [°]"),
        _key("spread[].p05_p95_n_more", "Further deposits needed to show these; 0 if none"),
        _key("barriers", "One a barrier"),
        _key("barriers[].barrier_id", "The barrier"),
        _key("barriers[].n_reached", "Logs that came to it: the sum of the next three"),
        _key("barriers[].n_stopped", "Logs that it holds"),
        _key("barriers[].n_overjumped", "Logs that passed above it"),
        _key("barriers[].n_passed_beside", "Logs that passed beside it"),
        _key("barriers[].n_hits", "Hits; a hit lasts until 0.1 s pass without contact"),
        _key("barriers[].energy_hit_max_kj", "Largest kinetic energy of a log just before a hit [kJ]"),
        _key(
            "barriers[].height_hit_max_m",
            "Largest height of a hit above the terrain, never more than the barrier's [m]",
        ),
        _key("barriers[].energy_needed_max_kj", "Largest kinetic energy of a log that comes there [kJ]"),
        _key("barriers[].height_needed_max_m", "Largest height of the upper edge of a log that comes there [m]"),
        _key("barriers[].height_needed_p95_m", "95 % percentile of these heights [m]"),
        _key("barriers[].height_needed_ci_low_m", "Lower end of its exact 95 % interval; null where logs are too few"),
        _key("barriers[].height_needed_ci_high_m", "Upper end"),
        *_wood("trees", "trees"),
        *_wood("lying_logs", "lying logs"),
        _key("lying_logs.n_broken", "Hits that broke one; for each log all lie there again"),
        *_wood("blocks", "boulders"),
        _key("speed", "Speeds of the logs' centres of mass"),
        _key("speed.mean_ms", "Mean over the logs that ended before the time limit of their mean speed [m/s]"),
        _key("speed.n_mean", "Number of logs in that mean"),
        _key("speed.p95_ms", "95 % quantile of their largest speeds [m/s]"),
        _key("speed.max_ms", "Largest of all [m/s]"),
        _key("accuracy", "Measures of the error of the calculation"),
        _key("accuracy.fidelity", "Name of the fidelity"),
        _key("accuracy.time_step_s", "Longest time step [s]"),
        _key("accuracy.station_spacing_m", "Distance of the contact rings [m]"),
        _key("accuracy.penetration_max_m", "Deepest penetration of all logs [m]"),
        _key("accuracy.energy_error_rel_max", "Largest energy error, relative to the energy available"),
        _key("accuracy.contact_residual_max", "Largest residual of the contact problem"),
        _key("accuracy.unconverged_steps", "Steps whose contact solver did not converge"),
        _key("accuracy.auto", "The promise of --fidelity auto, for the line with the largest error; null without it"),
        _key("accuracy.auto.chosen", "The fidelity that made the run"),
        _key("accuracy.auto.why", "Why this one, in words"),
        _key("accuracy.auto.sampling", "Sampling error of the share, at 95 %"),
        _key(
            "accuracy.auto.calculation",
            "What the error of the calculation, against reference, does not exceed on 95 of 100 slopes of the kind",
        ),
        _key("accuracy.auto.kind", "The kind of the slope: open, forest, channels or structures, and rough ground"),
        _key(
            "accuracy.auto.together",
            "Both together, at 95 % with a margin for the number of logs, which the logs themselves determine",
        ),
        _key("accuracy.auto.line_id", "The line"),
        _key("accuracy.auto.error", "The error requested with --error; absent with --budget"),
        _key("accuracy.auto.reached", "Whether that is kept, for each line"),
        _key("accuracy.auto.logs", "Logs that were run"),
        _key("accuracy.auto.logs_at_most", "Logs that could have been"),
        *_SCENARIO_KEYS,
        _key("counted", "Use of the rows of each layer that was given: read = used + left out"),
        _key("counted.LAYER", "The layer, by the parameter that named it"),
        _key("counted.LAYER.read", "Its rows"),
        _key("counted.LAYER.used", "Those that had a part in the run"),
        _key("counted.LAYER.left_out", "Number of the others, by reason"),
        _key(
            "counted.LAYER.left_out[].why",
            "`off_dem`, beyond the terrain model; `no_terrain`, on its last half cell or on nodata; `beyond_window`, "
            "where no log comes; `not_run`, a log that --until-ci or --error made unnecessary",
        ),
        _key("counted.LAYER.left_out[].n", "How many rows"),
        _whole("modelled", "What was modelled of the scene, and what was not and why, in words"),
        _whole("modelled_facts", "The same as records: the name of each clause, and the numbers in it"),
        *_WARNING_KEYS,
        _key("cost", "Cost of the run"),
        _key("cost.cpu_s", "Time of all cores [s]"),
        _key("cost.wall_s", "Time of sliding, the sum over the logs [s]"),
        _key("cost.pilot_cpu_s", "Time of all cores for logs at another fidelity that --fidelity auto slid [s]"),
        _key("cost.own_slope_cpu_s", "Time of all cores for the logs of own_slope at the finer fidelity [s]"),
        _key("cost.friction_band_cpu_s", "Time of all cores for the logs of --friction-range [s]"),
        _key("cost.steps", "Time steps of all logs"),
        _key("cost.logs_per_s", "Logs a second"),
    ),
)
SITES_FACTS = JsonFile(
    name="summary.json",
    meaning="Summary of the runs of all sites",
    keys=(
        _key("sites", "How many sites"),
        _key("sites.asked", "That were requested"),
        _key("sites.done", "Sites with a complete run"),
        _key("sites.failed", "That failed"),
        _key("logs", "How many logs"),
        _key("logs.released", "Logs that were run, at all sites"),
        _key("reach", "One per line: the logs of all sites that watch a line of this name"),
        _key("reach[].line_id", "The line"),
        _key("reach[].sites", "Sites that watch it"),
        _key("reach[].n_total", "Their logs"),
        _key("reach[].n_reach", "Of these, the logs that reach it"),
        _key("reach[].p", "Their share"),
        _key("reach[].ci_low", "Lower end of its 95 % Wilson interval"),
        _key("reach[].ci_high", "Upper end"),
        *(_key(f"reach[].{each.name}", each.meaning) for each in IF_LOST),
        _whole("failures", "The sites that failed, and the reason in one line"),
        _key("merged", "The merged rasters, one set for each terrain model that several sites share"),
        _key("merged[].folder", "Where, in merged/"),
        _key("merged[].sites", "Of which sites"),
        _key("merged[].logs", "Logs of these"),
        _key("merged[].rasters", "The files"),
    ),
)
MANIFEST = JsonFile(
    name="manifest.json",
    meaning="What made the folder; works as `--config` of the same tool",
    keys=(
        _key("tool", "Name of the tool"),
        _key("version", "Version of the toolbox"),
        _key("engine", "Digest of the engine's sources and compiler: the same engine, the same bits"),
        _key(
            "run_id",
            "Digest of everything that determines the bits: tool, version, engine, parameters and the inputs' content",
        ),
        _key("made_utc", "When the run began"),
        _whole("modified_utc", "When the file of each input was last written to, by the clock of its disk"),
        _whole("platform", "System, machine, cores and Python"),
        _whole("libraries", "Versions of the numerical libraries, and of GDAL, PROJ and GEOS"),
        _whole(
            "inputs",
            "Each input as it was read: path, layer, SHA-256, bytes, rows, CRS, use of the rows; of several files each",
        ),
        *_WARNING_KEYS,
        _whole("files", "SHA-256 and bytes of every file of the folder, which seal the result"),
        _key("seal", "SHA-256 of the content of this file"),
        _key(
            "folder",
            "Folder in which the manifest was written; inputs that moved together with it are found from there",
        ),
        _whole("parameters", "Every parameter, as it was given or by default"),
        _whole("presets", "What a preset set, its source, and the options that overrode it; only with a preset"),
    ),
)
MANIFEST_OF_SCENE = JsonFile(
    name="manifest.json",
    meaning=MANIFEST.meaning,
    keys=(*MANIFEST.keys, _whole("digests", "Digests of the scene and of the releases, which identify them")),
)
MANIFEST_OF_RUN = JsonFile(
    name="manifest.json",
    meaning=MANIFEST.meaning,
    keys=(
        *MANIFEST_OF_SCENE.keys,
        _whole(
            "effective",
            "Minimum, median and maximum of the logs' values, from their columns or the options; shares for "
            "the orientation",
        ),
        _whole("chosen", "With --fidelity auto the fidelity and the number of logs"),
        _key("grid", "Grid of the terrain model"),
        _key("grid.nx", "Its columns"),
        _key("grid.ny", "Its rows"),
        _key("grid.cell", "Side of a cell [m]"),
        _key("grid.x0", "Easting of the south-western corner [m]"),
        _key("grid.y0", "Northing of it [m]"),
        _key("grid.crs", "CRS of everything in the run"),
    ),
)
_SIDES = ("length", "width", "height")
_SOLID = tuple(
    _key(f"{of}.{name}", meaning)
    for of in ("cone", "solid")
    for name, meaning in (
        ("mass_kg", "Mass [kg]"),
        ("volume_m3", "Volume [m³]"),
        ("centre_from_base_m", "Distance of the centre of mass from the base [m]"),
        ("inertia_axial_kg_m2", "Moment of inertia about the axis [kg m²]"),
        ("inertia_transverse_kg_m2", "Moment of inertia about a transverse axis through the centre of mass [kg m²]"),
    )
)
LOG = JsonFile(
    name="log.json",
    meaning="Mass properties of the log or rock",
    keys=(
        _key("frame", "Origin and axes of the files, in words"),
        _key("cone", "Properties of the exact cone"),
        _key("solid", "Properties of the solid in the files"),
        *_SOLID,
        _key("solid.vertices", "Vertices of the solid"),
        _key("solid.triangles", "Triangles of its surface"),
        _key("rock", "Properties of a rock"),
        _key("rock.mass_kg", "Mass [kg]"),
        _key("rock.volume_m3", "Volume [m³]"),
        *(
            _key(f"rock.inertia_{axis}_kg_m2", f"Moment of inertia about the axis of the {axis} [kg m²]")
            for axis in _SIDES
        ),
    ),
)
COMPARISON_FACTS = JsonFile(
    name="comparison.json",
    meaning="All of the comparison, for programs",
    keys=(
        _key("reference", "The scenario with which the others are compared"),
        _key("logs", "Logs that are compared"),
        _whole("parameters_that_differ", "By parameter: the value in each scenario"),
        _whole("rows", "The rows of comparison.csv"),
    ),
)
INTENSITY_FACTS = JsonFile(
    name="classes.json",
    meaning="The classes: meaning, area of ground, source of the rule",
    keys=(
        _key("rule", "Source of the classes"),
        _key("decides", "What an expert must judge"),
        _key("energy", "Which energy of a cell is classed"),
        _key("least_passage", "How many logs must bring the energy of a cell"),
        _key("least_passage.share", "Their minimum share of the logs; 0: the largest energy of all logs is classed"),
        _key("least_passage.n_logs", "Logs on which it is based: those with a stored trajectory"),
        _key("least_passage.logs", "How many of them that share is"),
        _key("least_passage.logs_sure", "From this number the 95 % interval of their share lies above the minimum"),
        _key("least_passage.logs_possible", "From this number it is not below it"),
        _key("logs", "Logs of the run"),
        _key("n_left_dem", "Of these, those that left the terrain model"),
        _key("logs_per_event", "Logs that start in an event; with a frequency"),
        _key("areas", "Release areas; with a frequency"),
        _key("areas[].release_id", "The area"),
        _key("areas[].events_per_year", "Its events a year"),
        _key("areas[].n_logs", "Logs of the run that started there"),
        _key("no_hit", "Bounds where no log passed (95 %)"),
        _key("no_hit.p_high", "Upper end of the interval of the share of logs that pass"),
        _key("no_hit.return_ci_low_years", "Lower end of that of the return period; with a frequency"),
        _key("classes", "One per raster and class"),
        _key("classes[].map", "The raster"),
        _key("classes[].class", "The class"),
        _key("classes[].meaning", "What it is"),
        _key("classes[].low", "Its lower bound; null without one; missing for the matrix, like the next two"),
        _key("classes[].high", "Its upper bound; likewise"),
        _key("classes[].unit", "Their unit: kJ, % of the logs, or years"),
        _key("classes[].cells", "Cells that have it"),
        _key("classes[].area_m2", "Their area [m²]; null where the logs are fewer than it needs"),
        _key("classes[].n_needed", "The number of logs from which the area is stated; null: it grows with every log"),
        _key("classes[].at_least_m2", "For intensity: area of this class and those above it [m²]; likewise null"),
        _key(
            "classes[].at_least_ci_low_m2",
            "Lower end of its 95 % interval: cells whose own intervals lie in these classes; null for the "
            "largest energy",
        ),
        _key("classes[].at_least_ci_high_m2", "Upper end: cells whose own intervals reach these classes"),
        _whole("lines", "The rows of lines.csv"),
    ),
)
ORIGIN_FACTS = JsonFile(
    name="origins.json",
    meaning="The same in numbers",
    keys=(
        _key("cell_m", "Side of the raster's cells [m]"),
        _key("least", "Minimum number of logs for which a cell has a share"),
        _key("logs", "Logs that are counted"),
        _key("told", "Share of them that were released in cells with at least this number"),
        _key("n_left_dem", "Of these, those that left the terrain model"),
        _whole("reach", "By line, and for any line: how many logs reach it, their share and its 95 % interval"),
        _whole("sources", "The rows of the layer sources"),
        _whole("affected", "The rows of the layer affected; null where it is left out"),
    ),
)
CALIBRATION_FACTS = JsonFile(
    name="calibration.json",
    meaning="All of the calibration, for programs",
    keys=(
        _key("range", "Coefficients that reproduce the event (95 %); null where none does"),
        _key("range.low", "Smallest"),
        _key("range.high", "Largest"),
        _key("range.best", "Likeliest"),
        _key("range.open_low", "Whether the sweep's first belongs to them, so that the range may continue below"),
        _key("range.open_high", "The same of its last, above"),
        _key("range.gaps", "Whether some coefficients in between do not belong to them"),
        _key("range.one", "Whether only one coefficient of the sweep reproduces it, so that the ends are interpolated"),
        _key("best", "Most likely coefficient of the sweep"),
        _key("fits", "Whether any coefficient produces such an event in more than 1 of 20 cases"),
        _key("logs", "Logs that were slid with each coefficient"),
        _key("event", "What was observed"),
        _key("event.deposits", "Number of deposits, where deposits were observed"),
        _key(
            "event.search_complete",
            "Whether all logs of the event were found, not only those that stayed on the terrain model",
        ),
        _key("event.logs", "Logs of the event, where lines or areas were"),
        _key("event.did", "Number of these that reached it"),
        _key("cell_m", "Cells of the terrain model, for which the range holds [m]"),
        _whole("rows", "The rows of calibration.csv"),
    ),
)
FIDELITY_FACTS = JsonFile(
    name="comparison.json",
    meaning="All of the comparison, for programs",
    keys=(
        _key("finest", "The fidelity with which the others are compared"),
        _key("logs", "How many logs"),
        _key("logs.compared", "Logs that were slid at each fidelity"),
        _key("logs.in_layer", "In the layer"),
        _key("logs.planned", "Logs of the planned run"),
        _key("recommendation", "The cheapest fidelity that is accurate enough"),
        _key("recommendation.fidelity", "Its name; null if none is shown to be"),
        _key("recommendation.sentence", "The same in words"),
        _key("recommendation.judged_by", "The criterion"),
        _key("recommendation.logs_needed", "About how many logs would be needed to decide"),
        _key("recommendation.silent_lines", "Lines that all logs reach or none, which cannot decide anything"),
        _whole("recommendation.verdicts", "By fidelity: whether its error is shown to be small enough"),
        _whole("settings", "By fidelity: its numbers, as in the engine"),
        _key("postures", "One per quantity with all logs in another posture at the start, at the cheapest fidelity"),
        _key("postures[].orientation", "The posture, a value of `--orientation`: `upright` or `random-lying`"),
        _key("postures[].fidelity", "The fidelity"),
        _key("postures[].quantity", "`reach`, or `runout_mean`"),
        _key("postures[].item", "The line of a reach"),
        _key("postures[].unit", "Unit of the values"),
        _key("postures[].value", "With all logs in this posture"),
        _key("postures[].as_released", "With the same logs in the posture that they were released in"),
        _key("postures[].difference", "The former minus the latter"),
        _key("postures[].ci_low", "Lower end of its 95 % interval, over the same logs"),
        _key("postures[].ci_high", "Upper end"),
        _whole("rows", "The rows of comparison.csv"),
    ),
)
VARIED_FACTS = JsonFile(
    name="summary.json",
    meaning="The most influential inputs",
    keys=(
        _key("sentence", "In one sentence, of the line that the factors move most"),
        _key("answers", "One an outcome"),
        _key("answers[].outcome", "`runout_mean_m`, or `reach_` and a line"),
        _key("answers[].by", "What factors were ranked by: `total`, the index, or `swing`"),
        _key(
            "answers[].factors",
            "The factors that may be the strongest (95 %), most likely first; empty if none is beyond chance",
        ),
        _key("answers[].decided", "Whether there is exactly one"),
        _key("answers[].sentence", "The same in words"),
        _key("logs", "Logs that were slid in each run"),
        _key("logs_in_layer", "Logs of the layer, of which these were drawn"),
        _key("fidelity", "Fidelity at which they were slid, if it was not varied"),
        _key("runs", "How many runs"),
        _key("design", "How the factors were varied"),
        _key("samples", "Rows of the design; 0 without"),
        _key("factors", "One a factor"),
        _key("factors[].factor", "Its name"),
        _key("factors[].low", "Low end of its range"),
        _key("factors[].high", "High end"),
        _whole("tornado", "The rows of tornado.csv"),
        _whole("indices", "The rows of indices.csv"),
    ),
)
SITED_FACTS = JsonFile(
    name="summary.json",
    meaning="The choice, and all numbers",
    keys=(
        _key("logs", "Logs that were slid"),
        _key("slid_again", "How often a log was slid again with a barrier"),
        _key("candidates", "How many candidates"),
        _whole("reach", "Logs that reach any line in the run, their share and its 95 % interval"),
        _whole("reach_by_line", "The same by line"),
        _whole("reach_by_line_after", "By line, with all barriers that were chosen"),
        _whole("chosen", "The rows of pareto.csv of the chosen sets"),
        _key("stopped_because", "Why no more barriers were chosen"),
        _whole("rows", "All rows of pareto.csv"),
    ),
)
DEMO = JsonFile(
    name="demo.json",
    meaning="Results of the demo",
    keys=(
        _key("forests", "By forest: the results of its run"),
        _whole("forests.FOREST", "The run's summary.json, and `speed.mean_to_road_ms` of the logs that arrive"),
        _key("paper", "Where the findings of the paper are"),
    ),
)
FAILED = JsonFile(
    name="failed.json",
    meaning="The last states of failed logs, if any, from which the engine can continue; please report them",
    keys=(
        _key("logs", "One per log that failed"),
        _key("logs[].log_id", "The log"),
        _key("logs[].t_s", "Time since the start [s]"),
        _key("logs[].position_m", "Centre of mass [m]"),
        _key("logs[].quaternion_wxyz", "Rotation from the body to the world"),
        _key("logs[].velocity_ms", "Velocity [m/s]"),
        _key("logs[].angular_velocity_rad_s", "Angular velocity [rad/s]"),
        _key("logs[].dbh_cm", "Its DBH [cm]"),
        _key("logs[].length_m", "Its length [m]"),
        _key("logs[].density_kg_m3", "Its density [kg/m³]"),
    ),
)

# --- others ---------------------------------------------------------------------------------------------------------

POINTS = OtherFile(name="log.pts", meaning="The vertices, x y z on each line [m]: the custom shape of RAMMS::Rockfall")
OBJ = OtherFile(name="log.obj", meaning="The closed solid, for 3-D programs")
STL = OtherFile(name="log.stl", meaning="The same")
PROFILE = OtherFile(name="flight_FLIGHT.png", meaning="The profile of one flight")
GEOPARQUET = OtherFile(
    name="LAYER.parquet",
    meaning="With --geoparquet: the layer of run.gpkg once more, with the same columns, as GeoParquet",
)
TERRAIN_TILES = OtherFile(
    name="terrain.vrt", meaning="For a terrain model in tiles: a GDAL virtual raster of these, for the QGIS project"
)
PROJECT = OtherFile(name="project.qgz", meaning="A QGIS project: styled layers, the logs in motion, a 3-D view")
_FINDING = (
    ("id", "Site and finding; .cloud: of the log as the paper's point cloud"),
    ("statement", "The statement assessed, and the rule"),
    ("section", "Section of the paper"),
    ("paper", "The paper's figure"),
    ("ours", "The figure of these runs"),
    ("ci_low", "Lower end of its 95 % interval"),
    ("ci_high", "Upper end"),
    ("holds", "Whether the finding holds; empty where it is not decided or cannot be assessed"),
    ("why", "The runs and figures that show it"),
    ("verdict", "holds, does not hold, not decided, or cannot be judged here"),
)
_VARIATION = (
    ("what", "Which chosen number of the twin is changed"),
    ("ours", "The figure with it"),
    ("ci_low", "Lower end of its 95 % interval"),
    ("ci_high", "Upper end"),
    ("verdict", "The finding's verdict with this change"),
)
FINDINGS = JsonFile(
    name="findings.json",
    meaning="The findings of the paper, one by one",
    keys=(
        *(_key(f"[].{name}", meaning) for name, meaning in _FINDING),
        _key("[].panel", "The same finding with one choice of the twin changed; one for each choice"),
        *(_key(f"[].panel[].{name}", meaning) for name, meaning in _VARIATION),
    ),
)
FINDINGS_PANEL = TableFile(
    name="sensitivity.csv",
    meaning="The findings with one chosen number of the twin changed",
    columns=(
        a_text("id", "Name of the finding"),
        *(
            (a_number if name in ("ours", "ci_low", "ci_high") else a_text)(name, meaning)
            for name, meaning in _VARIATION
        ),
    ),
)
FINDINGS_TABLE = TableFile(
    name="findings.csv",
    meaning="The same as a table",
    columns=tuple(
        (a_number if name in ("ours", "ci_low", "ci_high") else a_text)(name, meaning) for name, meaning in _FINDING
    ),
)
FINDINGS_PAGE = OtherFile(name="findings.md", meaning="The same as a document")
FINDINGS_REPORT = OtherFile(name="report.html", meaning="The same with the figures beside the paper's")
FINDINGS_FIGURE = OtherFile(name="FIGURE.png", meaning="A figure of the same kind as the paper's")
REPORT = OtherFile(
    name="report.html", meaning="One page to read: maps, figures, tables and a 3-D view; needs no other file"
)
REPORT_FIGURES = tuple(
    OtherFile(name=f"FIGURE.{ending}", meaning="A figure of the report") for ending in ("png", "svg", "pdf")
)
REPORT_SCENE = OtherFile(name="scene.glb", meaning="The scene and its moving logs as binary glTF")
SITE_FACTS = JsonFile(
    name="site.json",
    meaning="The numbers of a site: friction, size and density of its logs, its circles of release",
    keys=(_key("NAME", "A number by its name"),),
)
SITES_PICTURE = OtherFile(name="overview.png", meaning="Where the sites are, and what share reaches a line")
COMPARISON_PICTURE = OtherFile(name="comparison.png", meaning="Reach, run-outs and maps of the scenarios side by side")
CALIBRATION_PICTURE = OtherFile(
    name="calibration.png", meaning="Likelihood by coefficient, and a map of the most likely"
)
FIDELITY_PICTURE = OtherFile(name="comparison.png", meaning="Error against cost")
TORNADO_PICTURE = OtherFile(name="tornado.png", meaning="Effect of each factor on each outcome, and its indices")
SITED_PICTURE = OtherFile(
    name="barriers.png", meaning="A map of candidates and chosen barriers, and what is left by length and height"
)
ORIGIN_PICTURE = OtherFile(name="origins.png", meaning="A map of the shares and of the ends of their intervals")
DEMO_PICTURE = OtherFile(name="demo.png", meaning="The three forests, where logs passed and where they ended")
AGED_STATES = TableFile(
    name="states.csv",
    meaning="One row for each year and state of dead trees",
    columns=(
        a_number("year", "Years from now", 0),
        a_text("state", "standing, broken, lying, gone; critical (of any of these), critical_standing"),
        a_number("share", "Mean share of the trees", 0, 1),
        a_number("ci_low", "Lower end of the range that contains it in 95 % of the draws", 0, 1),
        a_number("ci_high", "Upper end", 0, 1),
    ),
)
PROCESSES = TableFile(
    name="processes.csv",
    meaning="One row for each number of the life of dead trees, with the range from which it was drawn",
    columns=(
        a_text("name", "Its name, for --ranges"),
        a_text("about", "What it is"),
        a_text("unit", "Its unit"),
        a_number("low", "Low end of its range", 0),
        a_number("high", "High end", 0),
        a_number("given_by_user", "1 if the range is yours, 0 if it is that of the source", 0, 1),
        a_text("species", "The species that was observed"),
        a_text("source", "Who published it"),
        a_text("known", "How well it was observed"),
    ),
)
AGED_PICTURE = OtherFile(name="shares.png", meaning="Shares of the states and of the critical trees over the years")


def _treated(name: str, meaning: str, *columns: Column) -> TableFile:
    head = (a_text("treatment", "The treatment"), a_text("line_id", "The line or polygon"))
    return TableFile(name=name, meaning=meaning, columns=(*head, *columns))


_DRAWN = (
    a_number("ci_low", "Lower end of the range that contains 95 % of the draws"),
    a_number("ci_high", "Upper end"),
)
DECIDE_TABLES = (
    _treated(
        "events.csv",
        "One row for each treatment, line, energy and year",
        a_number("at_least_kj", "Logs with at least this energy at their first touch", 0),
        a_number("year", "The year that begins so many years from now", 0),
        a_number("events_per_year", "Logs that arrive in that year, mean of the draws", 0, unit="1/a"),
        *_DRAWN,
    ),
    _treated(
        "totals.csv",
        "One row for each treatment, line and class of intensity, over all years",
        a_text("intensity", "Class of energy, from 1; any: all together"),
        a_number("from_kj", "Lower bound of the class, which belongs to it", 0),
        a_number("events", "Logs that arrive in all years, mean of the draws", 0),
        *_DRAWN,
        a_number("events_per_year", "The same in a mean year", 0, unit="1/a"),
        a_number("rate_ci_low_per_year", "Lower end of its range", 0, unit="1/a"),
        a_number("rate_ci_high_per_year", "Upper end", 0, unit="1/a"),
    ),
    _treated(
        "periods.csv",
        "One row for each treatment, line and return period",
        a_number("return_period_years", "The return period, in the mean of all years", 0),
        a_number("energy_kj", "Energy that arrives at least once in it, median of the draws; 0: none does", 0),
        *_DRAWN,
    ),
    _treated(
        "differences.csv",
        "One row for each line and pair of treatments",
        a_text("against", "The treatment with which it is compared"),
        a_number("difference", "Events over all years, minus those of the other, mean of the draws"),
        *_DRAWN,
        a_text(
            "verdict",
            "What the range decides; not more, not fewer: in some draws neither has events",
            choices=("fewer", "not more", "not decided", "not fewer", "more"),
        ),
    ),
    TableFile(
        name="influence.csv",
        meaning="One row for each line and number, the most influential first",
        columns=(
            a_text("line_id", "The line or polygon"),
            a_text("process", "The number, as in processes.csv"),
            a_number("rank_correlation", "Its rank correlation with the events of the first treatment", -1, 1),
        ),
    ),
)
DECISION_PICTURE = OtherFile(name="decision.png", meaning="Events a year over the years, one band for each treatment")
DECISION_FACTS = JsonFile(
    name="decision.json",
    meaning="The comparison, in numbers and sentences",
    keys=(
        _key("trees", "Dead trees"),
        _key("trees_slid", "Of these, the trees that slid"),
        _key("slides", "Slides without lying stems"),
        _whole("picked", "The trees that anchor and remove-part pick"),
        _whole("critical_years", "Years between which more than a tenth of the trees are critical; null: never"),
        _whole("totals", "The rows of totals.csv"),
        _whole("periods", "The rows of periods.csv"),
        _whole("differences", "The rows of differences.csv"),
        _whole("sentences", "The conclusions"),
    ),
)
