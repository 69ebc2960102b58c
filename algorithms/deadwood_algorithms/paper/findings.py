"""The paper's findings, statement by statement, assessed on runs: an order, a direction, the size of a ratio.

Every rule is defined here and was written before the runs; ``finding`` defines how an interval decides. Intervals are
over logs and do not cover another terrain or forest: for that there is the panel, the same finding with one chosen
number changed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from deadwood_algorithms.paper.finding import (
    QUICK,
    Evidence,
    Finding,
    Row,
    above,
    all_of,
    ratio_interval,
    tidy,
    within,
)
from deadwood_algorithms.paper.friction_findings import NOT_REACHED, friction_findings
from deadwood_algorithms.stats.endings import ended
from deadwood_algorithms.stats.statistics import Z_95, wilson_interval

FEWEST_MOVING = 0.5  # share of the bodies beyond the minimum run-out, below this, a spread is that of a selected few


def _percent(row: Row) -> str:
    return f"{100 * row['value']:.1f} % ({100 * row['ci_low']:.1f} to {100 * row['ci_high']:.1f})"


def findings_of(of: Evidence, *, quick: bool = False) -> list[Finding]:
    """Every finding that the evidence of a site can decide, in the paper's order."""
    found = [*forest_findings(of), *spread_findings(of)]
    if "protected" in of.summaries or "barriers" in of.summaries:
        found += protection_findings(of)
    found += motion_findings(of)
    found += friction_findings(of) if of.sweeps else []
    found += flight_findings(of)
    if quick:
        found = [each.unjudged(QUICK) for each in found]
    return [tidy(each) for each in found]


def forest_findings(of: Evidence) -> list[Finding]:
    """Reach without forest above mapped above random if gullies are free of trees; mapped about random without
    gullies.
    """
    at, klosters = of.site, of.site == "klosters"
    als, found = of.reach("als"), []
    if "none" in of.logs:
        none = of.reach("none")
        value, low, high = ratio_interval(none, als)
        found.append(
            Finding(
                f"{at}.none_far_above_mapped",
                "Without forest, many times more logs reach the road than with the mapped forest (ratio; holds above "
                "2)",
                "5.1, 6.2" if klosters else "6.2, A",
                "74.5 % against 9.1 %: 8.2 times" if klosters else "100 % against 23.3 %: 4.3 times",
                value,
                low,
                high,
                above(low, high, 2.0),
                f"runs none and als: {_percent(none)} against {_percent(als)}",
            )
        )
    names = of.randoms()
    if not names:
        return found
    rows = [of.reach(name) for name in names]
    text = "; ".join(f"{name} {_percent(row)}" for name, row in zip(names, rows, strict=True))
    mean = float(np.mean([row["difference"] for row in rows]))
    ends = min(row["diff_ci_low"] for row in rows), max(row["diff_ci_high"] for row in rows)
    if klosters:
        holds = all_of([above(-row["diff_ci_high"], -row["diff_ci_low"], 0.0) for row in rows])
        found.append(
            Finding(
                f"{at}.mapped_above_random",
                "If the mapped forest leaves gullies free of trees, more logs reach the road than in a random forest "
                "(points; holds if this is so for every random forest drawn)",
                "6.2",
                "9.1 - 7.0 = +2.1 points",
                -100 * mean,
                -100 * ends[1],
                -100 * ends[0],
                holds,
                f"run als {_percent(als)}; {text}; paired over the same logs (Tango)",
            )
        )
    else:
        bounds = [
            (row["diff_ci_low"] / als["value"], row["diff_ci_high"] / als["value"]) for row in rows if als["value"]
        ]
        holds = all_of([within(*each, -0.25, 0.25) for each in bounds])
        found.append(
            Finding(
                f"{at}.mapped_about_random",
                "Without gullies a random forest lets about as many logs through as the mapped one (relative "
                "difference; holds within 25 % for every random forest drawn)",
                "6.2, A",
                "23.8 against 23.3 %: +2 %",
                mean / als["value"] if als["value"] else math.nan,
                min((each[0] for each in bounds), default=math.nan),
                max((each[1] for each in bounds), default=math.nan),
                holds,
                f"run als {_percent(als)}; {text}; paired over the same logs (Tango)",
            )
        )
    return found


def spread_findings(of: Evidence) -> list[Finding]:
    """Lateral spread: wider with forest than without; log above platy above cubic rock."""
    at, klosters = of.site, of.site == "klosters"
    releases = [item for name, what, item in of.rows if (name, what) == ("none", "spread_p05_p95")]
    found = []
    for other, factor, words, paper in (
        (
            "none",
            -1.0,
            "wider with the mapped forest than without",
            "40, 60, 60, 55 against 23, 31, 25, 18°" if klosters else "49 or 50 against 18°",
        ),
    ):
        rows = [of.rows[other, "spread_p05_p95", item] for item in releases]
        if not rows:
            continue
        sides = [sorted((factor * row["diff_ci_low"], factor * row["diff_ci_high"])) for row in rows]
        arcs = ", ".join(
            f"{of.rows['als', 'spread', item]['value']:.0f} against {of.rows[other, 'spread', item]['value']:.0f}°"
            for item in releases
        )
        found.append(
            Finding(
                f"{at}.spread_wider_with_forest",
                f"The lateral spread is {words} (difference of the 5-95 % range, mean of the releases [deg]; holds if "
                "this is so for each release)",
                "5.1, 6.2" if klosters else "6.2, A",
                paper,
                float(np.mean([factor * row["difference"] for row in rows])),
                float(np.mean([side[0] for side in sides])),
                float(np.mean([side[1] for side in sides])),
                all_of([above(side[0], side[1], 0.0) for side in sides]),
                f"the paper's measure, widest angle, by release: {arcs}; assessed by the 5-95 % range, because "
                f"single logs decide the widest angle; {_moving(of, 'als')} of the logs went farther than their own "
                f"length, without forest {_moving(of, other)}",
            )
        )
    for name, (wide, narrow), paper in (
        ("log_above_platy_rock", ("als", "platy"), "49 against 40°"),
        ("platy_above_cubic_rock", ("platy", "cubic"), "40 against 35°"),
    ):
        if {wide, narrow} <= set(of.spreads):
            a, b = of.spreads[wide], of.spreads[narrow]
            low, high = (
                a["p05_p95_ci_low_deg"] - b["p05_p95_ci_high_deg"],
                a["p05_p95_ci_high_deg"] - b["p05_p95_ci_low_deg"],
            )
            shares = {each: _share_counted(of.spreads[each]) for each in (wide, narrow)}
            text = ", ".join(f"{100 * share:.0f} % of the {each}" for each, share in shares.items())
            finding = Finding(
                f"{at}.{name}",
                f"The lateral spread of {wide.replace('als', 'logs')} is wider than that of {narrow} rocks "
                "(difference of the 5-95 % range [deg])",
                "6.3",
                paper,
                a["p05_p95_deg"] - b["p05_p95_deg"],
                low,
                high,
                above(low, high, 0.0),
                f"5-95 %: {a['p05_p95_deg']:.1f} against {b['p05_p95_deg']:.1f}°, widest angle: "
                f"{a['spread_deg']:.0f} against {b['spread_deg']:.0f}°; beyond the minimum run-out of "
                f"{of.facts['length_m']:g} m {text.replace('the als', 'the logs')}; rocks with "
                f"{_friction_of_rocks(of.facts)}, the paper's with ground parameters of RAMMS (not printed there)",
            )
            few = min(shares.values()) < FEWEST_MOVING
            found.append(finding.unjudged("most of the bodies hardly move: ") if few else finding)
    return found


def _friction_of_rocks(facts: Mapping[str, Any]) -> str:
    least = f"mu {facts.get('rock_friction', 0.5):g}"
    if not facts.get("rock_slip"):
        return least
    most, kappa, _ = facts["rock_slip"]
    return f"{least} that increases to {most:g} with slip (kappa {kappa:g}/m)"


def _share_counted(spread: Row) -> float:
    """The share of a release's bodies beyond the minimum run-out."""
    return 1.0 - spread["n_left_out"] / spread["n"] if spread["n"] else 0.0


def _moving(of: Evidence, scenario: str) -> str:
    return f"{100 * (of.logs[scenario]['runout_m'] > of.facts['length_m']).mean():.0f} %"


def protection_findings(of: Evidence) -> list[Finding]:
    at, klosters = of.site, of.site == "klosters"
    name = "protected" if "protected" in of.summaries else "barriers"
    with_it, als = of.reach(name), of.reach("als")
    value, low, high = ratio_interval(with_it, als)
    least = 0.05 if klosters else 0.5
    found = [
        Finding(
            f"{at}.protection_holds",
            f"The structures hold the logs back (remaining share of the reach; holds below {100 * least:g} %)",
            "5.1" if klosters else "5.2",
            "0 % reach the road" if klosters else "23.3 % without, at least 0.9 % with",
            value,
            low,
            high,
            above(-high, -low, -least),
            f"runs {name} and als: {_percent(with_it)} against {_percent(als)}",
        )
    ]
    barrier = next(
        (each for each in of.summaries[name]["barriers"] if each["barrier_id"] == of.facts.get("jumped_barrier")), None
    )
    if klosters or barrier is None:
        return found
    total = of.summaries[name]["logs"]["released"]
    over, met, held = barrier["n_overjumped"], barrier["n_reached"], barrier["n_stopped"]
    low, high = wilson_interval(over, total)
    named = f"run barriers, barrier {barrier['barrier_id']}"
    counted = f"{named}: {met} of {total} reach it, {held} held, {over} jump over it"
    found.append(
        Finding(
            f"{at}.one_in_a_hundred_jumps",
            "About one log in a hundred jumps the barrier below the terrace (share; holds from 0.3 to 3 %)",
            "5.2",
            "178 of 20 000: 0.9 %",
            over / total,
            low,
            high,
            within(low, high, 0.003, 0.03),
            counted,
        )
    )
    low, high = wilson_interval(held, met)
    found.append(
        Finding(
            f"{at}.barrier_stops_most",
            "The barrier stops most of the logs that reach it (share; holds above one half)",
            "5.2",
            "1264 of 1442: 88 %",
            held / met if met else math.nan,
            low,
            high,
            above(low, high, 0.5),
            counted,
        )
    )
    return found


def motion_findings(of: Evidence) -> list[Finding]:
    """Speeds, jumps, and the share that trees hold near the release."""
    at = of.site
    logs = of.logs["als"]
    far = logs["runout_m"] > of.facts["length_m"]
    speeds = logs["speed_mean_ms"][far]
    found = []
    if at == "klosters" and speeds.size > 1:
        mean, half = float(speeds.mean()), Z_95 * float(speeds.std(ddof=1)) / math.sqrt(speeds.size)
        cells = of.cell_speed.get("als", math.nan)
        bounds = 14 / 1.5, 14 * 1.5
        both = within(mean - half, mean + half, *bounds), within(cells, cells, *bounds)
        bare = (
            ""
            if "none" not in of.logs
            else (
                f"; without forest {of.logs['none']['speed_mean_ms'].mean():.1f} and "
                f"{of.cell_speed.get('none', math.nan):.1f} m/s"
            )
        )
        found.append(
            Finding(
                f"{at}.mean_speed",
                "Logs slide at about 14 m/s on average (m/s, mean of the logs' mean speeds; holds "
                "if within a factor of 1.5 for both meanings of the average)",
                "5.1",
                "14 m/s; the kind of average is not stated",
                mean,
                mean - half,
                mean + half,
                all_of(both),
                f"run als: {mean:.1f} m/s over the {speeds.size} logs that went farther than their length, "
                f"{cells:.1f} m/s over the cells that logs passed (of the largest speed in each); of all logs "
                f"{logs['speed_mean_ms'].mean():.1f} m/s{bare}",
            )
        )
        top = float(logs["speed_max_ms"].max())
        found.append(
            Finding(
                f"{at}.largest_speed",
                "The fastest logs reach about 30 m/s (m/s; holds within a factor of 1.5)",
                "5.1",
                "30 m/s",
                top,
                None,
                None,
                within(top, top, 20.0, 45.0),
                f"the largest of {far.size} logs of run als, so without interval",
            )
        )
    high, standing = logs["jump_max_m"] > 3.0, float(logs["height_max_m"].min())
    ends = wilson_interval(int(high.sum()), high.size)
    found.append(
        Finding(
            f"{at}.some_jump_metres",
            "Some logs, but only a few, jump several metres (share above 3 m; holds if some do, and fewer than half)",
            "B",
            "9.9 m at the terrace",
            float(high.mean()),
            *ends,
            within(*ends, 0.0, 0.5) if high.any() else None,
            f"run als, clearance between the log and the terrain, at most {logs['jump_max_m'].max():.1f} m; in the "
            "paper's measure, centre of mass above the terrain: at most "
            f"{logs['height_max_m'].max():.1f} m, {100 * (logs['height_max_m'] > standing + 3.0).mean():.1f} % of the "
            f"logs 3 m higher than the {standing:.1f} m at which they stand upright at the start",
        )
    )
    stopped = ended(logs, "tree") & ~far
    ends = wilson_interval(int(stopped.sum()), stopped.size)
    found.append(
        Finding(
            f"{at}.trees_hold_near_release",
            "Trees hold a considerable part of the logs within one log length of the release (share; holds above 10 %)",
            "4, 6.2",
            "stated without a number",
            float(stopped.mean()),
            *ends,
            above(*ends, 0.1),
            "run als",
        )
    )
    reach = of.reach("als")
    found.append(
        Finding(
            f"{at}.slides_to_the_road",
            f"A log of {of.facts['length_m']:g} m slides through the forest to the road "
            f"at mu {of.facts['friction']:g} (share; holds above 0)",
            "2, 5",
            "9.1 %" if at == "klosters" else "23.3 %",
            reach["value"],
            reach["ci_low"],
            reach["ci_high"],
            above(reach["ci_low"], reach["ci_high"], 0.0),
            "run als",
        )
    )
    return found


def flight_findings(of: Evidence) -> list[Finding]:
    """The parabola of 5.2, the friction that its speed needs, and the trajectory of Fig. B1."""
    at, found = of.site, []
    needed = math.nan
    if of.flight is not None:
        needed = float(of.flight["takeoff_speed_ms"])
        fine = of.flight["verdict"] == "possible"
        finding = Finding(
            f"{at}.parabola_clears_barrier",
            "A flight from the terrace to the wall passes over the barrier "
            "(take-off speed [m/s]; holds if possible and within a factor of 1.5 of 24)",
            "5.2",
            "24 m/s, possible",
            needed,
            None,
            None,
            fine and 16.0 <= needed <= 36.0,
            f"fit-flight: {of.flight['verdict']}, clearance {of.flight['clearance_min_m']:.1f} m",
        )
        built = "the twin's terrace and wall are placed so that 24 m/s fits, which only tests the calculation: "
        found.append(finding.unjudged(built) if of.twin else finding)
    if of.takeoffs and math.isfinite(needed):
        found += takeoff_findings(of, needed)
    if of.jumped is None:
        return found
    statement = (
        "A simulated log jumps from the terrace to the road at about the event's speed (median take-off speed [m/s]; "
        "holds if one does within a factor of 1.5 of 27.8, as the paper shows one)"
    )
    named = f"{at}.a_log_jumps_to_the_road", statement, "B", "27.8 m/s, 9.9 m high"
    if not of.jumped:
        none = "run barriers: no log passes the terrace and then reaches the road"
        return [*found, Finding(*named, None, None, None, False, none)]
    speeds, jumps, heights = np.array(of.jumped, float).T
    alike = (speeds >= 27.8 / 1.5) & (speeds <= 27.8 * 1.5)
    found.append(
        Finding(
            *named,
            float(np.median(speeds)),
            float(speeds.min()),
            float(speeds.max()),
            bool(alike.any()),
            f"run barriers: {speeds.size} logs pass the terrace and reach the road, {int(alike.sum())} of them at "
            f"{27.8 / 1.5:.1f} to {27.8 * 1.5:.1f} m/s; clearance {jumps.min():.1f} to {jumps.max():.1f} m, centre of "
            f"mass above the terrain after the take-off {heights.min():.1f} to {heights.max():.1f} m; low and high are "
            "the slowest and fastest of them",
        )
    )
    return found


def takeoff_findings(of: Evidence, needed: float) -> list[Finding]:
    """The friction that the parabola's speed needs."""
    fast = {mu: (int((speeds >= needed).sum()), n) for mu, (speeds, n) in sorted(of.takeoffs.items())}
    text = "; ".join(
        f"{mu:g}: {count} of {n}, fastest {of.takeoffs[mu][0].max(initial=0.0):.1f} m/s"
        for mu, (count, n) in fast.items()
    )
    verdicts: list[bool | None] = [True if count else None for mu, (count, _) in fast.items() if mu < 0.3 - 1e-9]
    rest = [wilson_interval(*fast[mu]) for mu in fast if mu >= 0.3 - 1e-9]
    if not verdicts or not rest:
        return []
    beyond = [above(-high, -low, -NOT_REACHED) for low, high in rest]
    most = max((mu for mu in fast if fast[mu][0] > 0), default=math.nan)
    return [
        Finding(
            f"{of.site}.takeoff_speed_needs_low_friction",
            "Logs reach the take-off speed of the parabola only with mu "
            "below 0.3 (largest mu of the sweep at which one does; holds if some do at each mu below 0.3, and fewer "
            "than 0.5 % of the logs at each from 0.3 up)",
            "5.2",
            "mu < 0.3",
            most,
            None,
            None,
            False if False in beyond else all_of([*verdicts, *beyond]),
            f"logs at least as fast as {needed:.1f} m/s at the terrace, by mu: {text}",
        )
    ]
