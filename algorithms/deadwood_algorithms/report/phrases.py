"""The texts of the report, in English: the messages of its catalogues, by the names that the report uses.

The name is a message's context (``msgctxt``) in ``locale/LANGUAGE/LC_MESSAGES/report.po``. Messages contain no markup.
Placeholders in braces are filled in by `Words.say`, and escaped with the rest when inserted into the page (`markup`).
"""

from __future__ import annotations

from deadwood_algorithms.report.answer_phrases import ANSWER_PHRASES
from deadwood_algorithms.report.sheet_phrases import QGIS_PHRASES, SHEET_PHRASES
from deadwood_algorithms.results.modelled import CLAUSES
from deadwood_algorithms.schemas.results import STOPS

PHRASES = {
    "title": "Sliding deadwood: {names}",
    "subtitle": "Simulation of sliding logs, Deadwood Toolbox",
    "and": "and",
    "to": "to",
    "of_logs": "of the logs",
    "of_steps": "of {n} steps",
    "contents": "Contents",
    "annex": "Annex",
    "annex_hint": "The evidence: every figure and table, the 3-D view, the provenance. It is printed while it is open.",
    "question": "Question",
    "conclusion": "Conclusion",
    "limits": (
        "The 95 % intervals cover only the sampling error of this number of logs. They do not include the friction "
        "coefficient ({friction} assumed), the posture at the start ({posture}), the error of calculation ({error}), "
        "or the probability that a log starts at all."
    ),
    "limits_band": (
        "The range is that over the friction, from a part of the logs, at draft and in pairs. The 95 % intervals cover "
        "the sampling error of this number of logs. Neither includes the posture at the start ({posture}, unless "
        "another is given), the error of calculation ({error}), or the probability that a log starts at all. The "
        "friction assumed is {friction}."
    ),
    "numbers": "The result in numbers",
    "value": "value",
    "arriving_energy": "energy at {line}, {level} % of the arriving logs stay below",
    "arriving_height_needed": "height at {line}, {level} % stay below",
    "difference_points": "difference of the reach [points]",
    "scenario_column": "scenario",
    "fewer_share": "fewer reach it [%]",
    "runs_caption": "Share of the logs that pass each cell, and where they end; one scale for all runs.",
    "judgement": "What remains to be judged by an expert",
    "judge_start": (
        "The probability and frequency of a start, and how many logs start at once; all shares are of logs that start."
    ),
    "judge_friction": (
        "Whether friction ({friction}) and posture at the start ({posture}) fit this ground in the relevant state: "
        "wet, frozen, under snow or leaves, with or without undergrowth."
    ),
    "judge_trees": (
        "Whether the trees of the layer still stand and can hold the logs that they hold here: in the model they do "
        "not break, bend or rot."
    ),
    "judge_barriers": "Whether the barriers withstand these energies; no number includes a safety factor.",
    "judge_terrain": (
        "Whether the terrain model (cells of {cell} m) shows what matters: gullies, walls, boulders, stumps, recent "
        "construction."
    ),
    "judge_risk": "The consequences of an arrival; this is neither a hazard map nor a risk assessment.",
    "sign_place": "Place",
    "sign_date": "Date",
    "sign_name": "Name",
    "sign_signature": "Signature",
    "scenario_file_of": "file of {day}",
    "quoted": "“{name}”",
    "question_lines": "{n} logs are released in {where}. How many of them reach {lines}, and how do they arrive?",
    "question_none": (
        "{n} logs are released in {where}. Where do they come to rest? No roads, railways or houses were given."
    ),
    "release_areas": "{n} release areas",
    "release_area": "release area {name}",
    "answer": "{line}: reached by {share}",
    "answer_band": (
        "{line}: reached by between {low} and {high} % of the logs, over a friction of {low_friction} to "
        "{high_friction}; at {friction}: {share}"
    ),
    "answer_band_one": (
        "{line}: reached by about {low} % of the logs, over a friction of {low_friction} to {high_friction}; at "
        "{friction}: {share}"
    ),
    "answer_idle": "No log reaches a barrier ({n}), so they change nothing.",
    "answer_difference": "{name} compared with {reference}: {change} points at {line}",
    "answer_alike": "{name} compared with {reference}: these logs show no difference at {line}, {change} points",
    "answer_posture": "; {posture} at the start: {share} %",
    "no_reach": "No roads, railways or houses were given.",
    "run": "Run {name}",
    "runs": "Runs",
    "scenario": "Scenario",
    "scenario_posture": "posture at the start",
    "posture_upright": "upright",
    "posture_lying": "lying",
    "posture_random": "any direction",
    "posture_random-lying": "lying, any azimuth",
    "posture_tilted": "tilted",
    "scenario_dbh": "DBH",
    "scenario_length": "length",
    "scenario_capacity": "break above",
    "scenario_height": "height",
    "scenario_density": "density",
    "scenario_cells": "{nx} × {ny} cells of {cell} m",
    "scenario_fidelity": "fidelity",
    "scenario_seed": "seed",
    "scenario_made": "calculated (UTC)",
    "project": "project",
    "author": "author",
    "modelled": "What was modelled, and what was not",
    "modelled_note": (
        "Logs do not break, bend or collide with each other; trees and barriers do not give way. The model does not "
        "give "
        "the probability that a log starts to slide. Results are a basis for an expert's judgement, not a hazard map."
    ),
    "modelled_older": "Written by an older version, in English only.",
    "model_terrain": "terrain",
    "model_window": "part of the DEM",
    "model_friction": "friction",
    "model_restitution": "restitution",
    "model_rolling_friction": "rolling friction",
    "model_logs": "logs",
    "model_trees": "trees",
    "model_stumps": "stumps",
    "model_barriers": "barriers",
    "model_lying_logs": "lying logs",
    "model_blocks": "boulders",
    "model_lines": "roads, railways, houses",
    "model_outputs": "computed",
    "lacks": "What this report lacks",
    "lacks_input": "The {what} of the run, {path}, could no longer be read: {reason}",
    "input_changed": (
        "The {what} of the run, {path}, has changed since the logs slid. This page shows the file as it is now, and "
        "calculates with it; the results of the run are those of the earlier file."
    ),
    "warned_coarse_cells": (
        "Cells of {cell_m} m do not resolve the relief that holds logs, so too many slide, and too far. Use a "
        "terrain model with cells of 0.5 to {largest_m} m."
    ),
    "lacks_poses": "No trajectory was stored, so there are no arrivals, no profile and no moving logs.",
    "lacks_some_poses": (
        "Trajectories were stored for {stored} of {n} logs; arrivals, profile and moving logs are limited to these."
    ),
    "lacks_shape": "No energies of arrival: {reason}",
    "gone": "missing",
    "model_tree_capacity_kj": "capacity of trees [kJ]",
    "model_break_trees": "trees break",
    "model_log_capacity_kj": "capacity of logs [kJ]",
    "input_dem": "terrain model",
    "input_trees": "trees",
    "input_barriers": "barriers",
    "input_lying_logs": "lying logs",
    "input_blocks": "boulders",
    "input_releases": "releases",
    "input_friction": "friction",
    "map": "Map",
    "map_caption": ("Share of the logs that pass each cell, over the relief. Coordinates: {crs}, metres."),
    "map_moves": "Drag to move, wheel or buttons to zoom.",
    "danger_note": (
        "Danger of the lines: of the logs that passed a place, the share that reached a line afterwards; empty "
        "where too few passed."
    ),
    "map_some": "Drawn: {drawn} of {n} {what}.",
    "layers": "Layers",
    "layer_relief": "relief",
    "layer_hits": "share of logs",
    "layer_speed": "largest speed",
    "layer_energy": "largest energy",
    "layer_jump": "largest clearance",
    "layer_danger": "danger of the lines",
    "layer_trees": "trees",
    "layer_stumps": "stumps",
    "layer_barriers": "barriers",
    "layer_lying_logs": "lying logs",
    "layer_blocks": "boulders",
    "layer_lines": "roads, railways, houses",
    "layer_releases": "releases",
    "layer_trajectories": "trajectories",
    "layer_deposits": "deposits: {stop}",
    "hits_bar": "logs that pass [%]",
    "east": "East [m]",
    "north": "North [m]",
    "zoom_in": "Zoom in",
    "zoom_out": "Zoom out",
    "reset": "Reset",
    "reach": "Reach",
    "answer_lost": "; {bounds} if none or all of the {n} logs that left the terrain model before reach it",
    "n_lost": "left the terrain model before it",
    "if_lost": "share if none or all of them reach it (95 % interval)",
    "lost_note": "What logs do beyond the terrain model is unknown. The share above counts none of them as arrived.",
    "reach_note": (
        "Two kinds of error: sampling (95 % Wilson interval, shrinks with more logs) and calculation (what the "
        "time stepping of this fidelity adds; more logs do not reduce it). The inputs, above all the friction "
        "coefficient, usually cause a larger error, which neither includes."
    ),
    "calculation_known": (
        "{mean} points on average over five synthetic slopes, {worst} on the worst, against the finest preset"
    ),
    "calculation_slopes": (
        "{mean} points in the mean of random slopes, with a standard deviation between slopes of {sd}, against fine"
    ),
    "calculation_none": "is the reference: none by definition",
    "calculation_unknown": "unknown: the time step or spacing is not that of a preset (compare-fidelity measures it)",
    "calculation_bound": "within ±{bound} points on 95 of 100 slopes of this kind",
    "promise": (
        "The fidelity auto chose {chosen} and {n} logs: the reach of every line is within ±{together} points, at 95 "
        "%, of what the finest preset would give. For line {line}, where this is most: sampling ±{sampling}, "
        "calculation ±{calculation} ({source})."
    ),
    "promise_assumed": "assumed: as on the benchmark's slopes of this kind",
    "promise_measured": "measured on this slope against {against}",
    "calculation_measure": ("Measured on synthetic slopes; compare-fidelity measures it on this one."),
    "own_slope": "on this slope: {fidelity} minus {finer} [points, 95 %]",
    "own_slope_note": (
        "{n} logs of this run were slid at {finer} too and compared log by log. So few show a large error of the "
        "calculation, but not that there is none."
    ),
    "own_slope_flagged": (
        "On this slope the error of the calculation is larger than on any of the synthetic slopes (±{bound} points): "
        "slide the logs at {finer}."
    ),
    "line": "line",
    "logs": "logs",
    "n_reach": "reach it",
    "sampling": "95 % interval (sampling)",
    "calculation": "error of calculation",
    "until_ci": "The run was to end at ±{wanted} points: {state}.",
    "until_reached": "reached after {n} logs",
    "until_missed": "not reached with all {n} logs",
    "share_of_logs": "share of the logs [%]",
    "arrivals": "Arrivals",
    "arrivals_note": (
        "The first touch of each log and line, over the logs whose trajectory is stored. Energy is that of "
        "translation; height that of the centre of mass above the terrain; angle that between the direction of "
        "travel and the line (90° is perpendicular)."
    ),
    "design": "Design values",
    "design_note": (
        "Percentiles over all logs that come to a barrier or a line, whether the barrier stops them or not, with "
        "exact 95 % intervals from order statistics; those of hits are of the logs that hit the barrier (the largest "
        "of each log's hits, just before it). Needed height: that of the log's upper edge in the plane of the "
        "barrier or line, above the terrain; a hit is never higher than the barrier. No safety factor is included; "
        "deadwood-tool design-values writes them as a table."
    ),
    "design_more": "further arrivals needed",
    "more_hits": "needs {n} more arrivals",
    "few_logs": "n = {n}: needs {more} more",
    "more_logs": "needs {n} more logs",
    "design_energy": "energy",
    "design_translation": "of translation",
    "design_rotation": "of rotation",
    "design_speed": "speed",
    "design_height": "height needed",
    "design_energy_hit": "energy of hits",
    "design_speed_hit": "speed of hits",
    "design_height_hit": "height of hits",
    "design_impulse": "impulse",
    "arrivals_none": "No stored trajectory reaches a line.",
    "median": "median",
    "largest": "largest",
    "speed": "speed",
    "energy": "energy",
    "height": "height",
    "angle": "angle",
    "time": "time",
    "arrival_speed": "speed of arrival [m/s]",
    "arrival_energy": "energy of arrival [kJ]",
    "arrival_height": "height of the centre of mass [m]",
    "arrival_angle": "angle to the line [°]",
    "n_logs": "logs",
    "spread": "Lateral spread",
    "spread_note": (
        "Azimuths of the deposits seen from the centre of each release area, without those nearer than the minimum "
        "run-out, whose azimuth is meaningless. North is up."
    ),
    "release": "release",
    "counted": "deposits counted",
    "left_out": "left out",
    "spread_deg": "smallest angle that contains all [°]",
    "p05_p95_deg": "5 to 95 % [°]",
    "compass": "N,E,S,W",
    "spread_none": "Too few deposits are far enough from their release.",
    "ways": "Run-out, speed and jumps",
    "runout": "Run-out",
    "runout_axis": "run-out, horizontal [m]",
    "farther": "logs that travel farther [%]",
    "max_speed_axis": "largest speed of a log [m/s]",
    "jump": "jump height",
    "jump_axis": "largest clearance of a log [m]",
    "energy_max": "largest energy",
    "quantity": "quantity",
    "mean": "mean",
    "stops": "How the logs ended",
    "profile": "Profile along chosen trajectories",
    "profile_note": (
        "Left: the terrain under the centre of mass and its path, heights to the scale of the distances. Right: its "
        "speed and the clearance under the log, along the same path."
    ),
    "way": "horizontal path [m]",
    "elevation": "elevation [m]",
    "speed_axis": "speed [m/s]",
    "terrain": "terrain",
    "centre": "centre of mass",
    "clearance": "clearance",
    "clearance_axis": "clearance [m]",
    "chosen_farthest": "log {id}: farthest",
    "chosen_fastest": "log {id}: fastest",
    "chosen_median": "log {id}: median run-out",
    "ledgers": "Barriers, trees, lying logs, boulders",
    "ledgers_none": "The scene has none of them.",
    "barrier": "barrier",
    "n_reached": "reached",
    "n_stopped": "stopped",
    "n_overjumped": "overjumped",
    "n_passed_beside": "passed beside",
    "n_hits": "hits",
    "energy_needed": "largest energy of all that come [kJ]",
    "height_needed": "largest height needed for all that come [m]",
    "energy_hit": "largest energy of a hit [kJ]",
    "height_hit": "largest height of a hit [m]",
    "wood": "obstacles",
    "n_total": "in the scene",
    "n_hit": "hit",
    "n_stopping": "hold a log",
    "n_stops": "logs held",
    "impulse": "impulse taken [kN s]",
    "energy_taken": "energy taken [kJ]",
    "top_trees": "The trees that hold the most logs",
    "tree": "tree",
    "above_capacity": "Logs with a hit above the capacity of stems",
    "above_of_trees": "of the tree",
    "above_of_logs": "of the log itself",
    "all_logs": "all",
    "held_by_trees": "held by a tree",
    "above_note": (
        "Nothing breaks in the model. These logs had, anywhere on their path, a hit that took more energy than the "
        "given capacity: a measure of how much the result depends on stems that do not break."
    ),
    "three_d": "3-D view",
    "three_d_note": (
        "Trees, barriers and logs in their true sizes, as modelled (at least one pixel wide). Drag to turn, "
        "right button or two fingers to move, wheel to zoom; click a moving log to follow it. Terrain in steps of "
        "{cell} m (DEM: {dem_cell} m); {shown} of {stored} stored trajectories."
    ),
    "three_d_lacks": "Without the terrain model there is no 3-D view.",
    "three_d_webgl": "This browser does not support WebGL 2, so there is no 3-D view; everything else is complete.",
    "three_d_label": "3-D view of the slope with moving logs",
    "play": "Play",
    "pause": "Pause",
    "pace": "speed of replay",
    "which_logs": "logs",
    "group_all": "all shown here",
    "group_fast": "the fastest",
    "group_far": "the farthest",
    "group_reach": "those that reach a line",
    "group_random": "a random draw",
    "drape": "on the terrain",
    "trails": "trails",
    "deposits": "deposits",
    "moving": "moving logs",
    "follow": "Follow",
    "let_go": "Stop following",
    "picked": "log {id}: {speed} m/s",
    "pick_hint": "click a log to follow it",
    "home": "Whole slope",
    "accuracy": "Accuracy",
    "accuracy_note": "Measures of the numerical error, recorded in every run.",
    "fidelity": "fidelity",
    "time_step": "longest time step",
    "spacing": "spacing of the contact rings",
    "penetration": "deepest penetration",
    "energy_error": "largest energy added or lost by the time stepping",
    "residual": "largest residual of the contacts",
    "unconverged": "steps whose contacts did not converge",
    "failed_logs": "failed logs",
    "left_dem_logs": "logs that left the terrain model",
    "started_in_contact": "logs that started in contact with an obstacle",
    "not_run": "logs not run, because the interval was narrow enough",
    "left_dem_warning": (
        "Logs that left the terrain model: {n}. Their further movement is not known: spread and deposits "
        "include it only up to where they left; a quantile of run-outs counts them as farther than all others, and is "
        "– among them; the reach of a line that they had not reached before is given with bounds."
    ),
    "failed_warning": "Logs whose calculation failed: {n}. The others are not affected.",
    "time_limit_warning": (
        "Logs that still moved at the time limit: {n}. Their deposits are not final; a quantile of run-outs counts "
        "them as farther than all others."
    ),
    "provenance": "Provenance",
    "command": "Command that repeats the run",
    "versions": "Versions",
    "versions_run": "The run was made by deadwood-tool {version}; this page with {versions}.",
    "hashes": "Fingerprints of the inputs",
    "input": "input",
    "file": "file",
    "hash_scene": "scene as calculated",
    "hash_releases": "releases as calculated",
    "engine_digest": "engine",
    "cost": "Cost",
    "cost_words": (
        "{cpu} CPU s of sliding, {wall} s on the clock, {steps} steps, {rate} logs/s; this page was made on {machine}, "
        "{cores} cores."
    ),
    "parameters": "Parameters",
    "comparison": "Comparison",
    "comparison_note": (
        "The same logs in each run, so each log is its own control. Differences to {reference}, with 95 % "
        "intervals over the logs."
    ),
    "comparison_lacks": "The runs are not compared: {reason}",
    "comparison_map_lacks": "No map of the difference of {name}: {reason}",
    "difference": "difference",
    "comparison_whole": "Comparison in full",
    "difference_maps": "Share of the logs that pass, minus that of {reference}: red where more pass, blue where fewer",
    "difference_bar": "more or fewer logs [points]",
    "minus": "{name} minus {reference}",
    "quantity_reach": "reach {item}",
    "quantity_bari": "fewer reach {item} (BARI)",
    "quantity_miri": "lower 95 % energy at {item} (MIRI)",
    "quantity_orpi": "lower summed energy at {item} (ORPI)",
    "quantity_ended": "ended: {item}",
    "quantity_spread": "lateral spread, {item}",
    "quantity_spread_p05_p95": "lateral spread 5 to 95 %, {item}",
    "quantity_speed_mean": "mean speed, {item}",
    "quantity_speed_max": "largest speed, {item}",
    "quantity_energy_max": "largest energy, {item}",
    "quantity_jump_max": "jump height, {item}",
    "quantity_runout": "run-out, {item}",
    "quantity_deposit_moved": "deposits moved, {item}",
    "item_mean": "mean",
    "item_median": "median",
    "item_p95": "95th percentile",
    "item_largest": "largest",
    "parameters_differ": "Differences between the runs",
    "parameters_same": "The runs do not differ in any parameter (their layers may).",
    "none": "none",
    "yes": "yes",
    "no": "no",
    "made": "Made by deadwood-tool {version}",
}
MESSAGES = (
    PHRASES
    | ANSWER_PHRASES
    | SHEET_PHRASES
    | QGIS_PHRASES
    | {f"stop_{name}": stop for name, stop in STOPS.items()}
    | {f"clause_{name}": clause for name, clause in CLAUSES.items()}
)
