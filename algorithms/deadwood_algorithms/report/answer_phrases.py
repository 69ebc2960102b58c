"""The phrases of the results of other tools: effect of trees, barriers, classes, origins, most influential inputs."""

from __future__ import annotations

ANSWER_PHRASES = {
    "tree_effect": "Effect of each tree",
    "tree_effect_note": (
        "How many more logs would reach the line without the object: the same, log by log, as in a run without it. "
        "The effects of several objects do not add up."
    ),
    "tree_effect_counts": "{line}, {what}: {n} in all; logs are kept away by {keep}, brought by {bring}.",
    "tree_effect_none": "None of them changes how many logs reach {line}.",
    "tree_effect_of_some": "Computed with {n} of the run's {all} logs.",
    "planted": "Effect of a tree or log added there",
    "kind_tree": "trees",
    "kind_lying_log": "lying logs",
    "kind_barrier": "barriers",
    "kind_stand": "stands",
    "thing": "id",
    "gain_logs": "logs kept away",
    "gain_points": "points (95 %)",
    "keeps": "keeps logs away (size: how many)",
    "brings": "brings logs",
    "no_tree_effect": "other trees",
    "siting": "Best places for a barrier",
    "siting_now": "{share} of the logs reach a line in the run. Candidates tested, each alone: {n}.",
    "siting_note": (
        "First the chosen barriers, each together with those chosen before it; then the single candidates that no"
        " candidate of the same or smaller length and height outperforms. The best of many was selected on these logs"
        " and has a slightly smaller effect on others. Barriers are rigid here; where a barrier can be founded, and "
        "at what cost, an expert must judge."
    ),
    "siting_none": "None was chosen: no candidate has an effect beyond chance.",
    "candidate_place": "{above} m above, no. {k}",
    "tested_how": "tested",
    "alone": "alone",
    "chosen": "chosen: {step}",
    "length_height": "length × height [m]",
    "still_reach": "still reach a line",
    "kept_away": "kept away [points]",
    "energy_needed_p95": "energy of all that come, 95 % [kJ]",
    "height_needed_p95": "height needed for 95 % [m]",
    "barrier_class": "class",
    "class_note": (
        "Class: the weakest of {name} that holds that energy, and the upper end of its interval ({source}). The "
        "classes are tested with compact blocks; a slender log may pass through rings or load a net differently: an "
        "expert must judge this."
    ),
    "chosen_barrier": "barrier that is chosen",
    "intensity": "Classes of intensity and probability",
    "intensity_rule": (
        "The classes of 30 and 300 kJ and of 30, 100 and 300 years are those of the Swiss federal recommendations "
        "for rockfall (BRP, BWW, BUWAL 1997; BAFU 2016); other bounds are the user's. Which hazard "
        "follows, and whether they suit wood, is for an expert to decide."
    ),
    "intensity_map": "Energy of the logs",
    "class_and_above": "this class and above",
    "least_passage": "Where at least {share} % of the logs bring that energy.",
    "area_needs": "With fewer than {n} logs the areas of the rarest classes come out too large, so they are not given.",
    "from_to": "{low} to {high}",
    "largest_energy": (
        "The largest energy of all logs, which grows with their number, and with it the area of each class."
    ),
    "passage_map": "Share of the logs that pass",
    "return_map": "Return period of a passage",
    "class_ground": "ground",
    "at_least": "at least [kJ]",
    "return_period": "return period [years]",
    "longer_than": "over {years}",
    "no_hit": "Where no log passed, up to {share} of the logs may still pass (95 %).",
    "from_where": "Places from which lines are reached",
    "from_where_map": "logs released in a cell that reach any line [%]",
    "from_where_note": "Of {n} logs, in cells of {cell} m; a cell with fewer than {least} is empty.",
    "at_least_share": "at least",
    "any_line": "any line",
    "reach_it": "of their logs reach it",
    "affected": "Ground that the logs of a release area pass",
    "varied": "Most influential inputs",
    "varied_note": (
        "The same {n} logs in {runs} runs, each factor alone at both ends of its range; the difference between the "
        "high and the low end has a 95 % interval. Inputs that were not varied are not assessed. As it is: these "
        "logs at"
        " {fidelity}; all logs of the run, or another fidelity, may differ by chance or by the calculation."
    ),
    "varied_apart": (
        "The run that was varied differs from this one in its {names}: its “as it is” is not the run described in "
        "the rest of this part."
    ),
    "most_influential": "{outcome} depends most on {factors}.",
    "influence_undecided": "{outcome}: the number of logs is too small to decide which of {factors} matters most.",
    "no_influence": "{outcome}: with this number of logs, no factor changes it beyond chance.",
    "no_index": (
        "{outcome}: with this number of logs and rows of the design, no total-effect index is beyond chance; the "
        "effect of each factor alone is given below."
    ),
    "outcome_reach": "reach of {line} [%]",
    "outcome_runout": "mean run-out [m]",
    "factor": "factor",
    "range": "range",
    "low_end": "low end",
    "high_end": "high end",
    "as_it_is": "as it is",
    "swing": "high minus low",
    "total_effect": "total-effect index",
    "factor_friction": "friction",
    "factor_orientation": "posture of the logs at the start",
    "factor_friction_factor": "friction of the map (times)",
    "factor_rolling_friction": "rolling friction",
    "factor_restitution": "restitution",
    "factor_tree_friction": "friction of stems",
    "factor_tree_restitution": "restitution of stems",
    "factor_log_dbh_factor": "DBH of the logs (times)",
    "factor_log_length_factor": "length of the logs (times)",
    "factor_log_density_factor": "density of the logs (times)",
    "factor_tree_dbh_factor": "DBH of the trees (times)",
    "factor_dem_noise_m": "error of the terrain model [m]",
    "factor_fidelity": "fidelity",
    # The names of classes: of an energy or a share, then of a return period
    "class_below": "below {high} {unit}",
    "class_between": "{low} to {high} {unit}",
    "class_from": "{low} {unit} and more",
    "class_up_to": "up to {high} {unit}",
    "class_over": "over {low} {unit}",
    "unit_kj": "kJ",
    "unit_percent": "% of the logs",
    "unit_years": "years",
}
