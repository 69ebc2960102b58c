"""Assessments in words: what is promised for the fidelities, and what the measurements show.

The numbers, not the author, select the sentences.
"""

from __future__ import annotations

from typing import Any

from deadwood_engine import FIDELITIES

from . import measures, tables
from .scenes import CELL
from .settings import ROLLING, SETTINGS
from .tables import table

Row = dict[str, Any]
STANDARD_POINTS, DRAFT_POINTS = 0.005, 0.025  # [-] promised difference in reach
FINEST_POINTS = 1.0  # [points] by which half the step and half the rings may move the reach of reference
DEEPEST = 0.15  # [m] of the logs at standard
KNOWN = 0.02  # [-] accuracy to which friction is known at best
HALVES = 1.8  # factor that counts as halving: 0.85 of the first order in the step


FINER = ("standard", "fine", "reference")


def yardstick(results: Row) -> str:
    """The effect of a hundredth of friction."""
    yard = tables.friction_slope(results)
    if not yard:
        return "*Not measured yet.*"
    return (
        f"One hundredth of mu moves reach by {yard[0]:+.2f} ± {tables.Z_95 * yard[1]:.2f} points in the mean of these "
        "scenes. The column *equivalent change of mu* is a setting's difference in these terms (with its interval): "
        "a difference "
        "of 0.01 is smaller than what any site's friction is known to."
    )


def restarts(results: Row) -> str:
    """The result of the short restarts."""
    if "restarts" not in results:
        return "*Not measured yet.*"
    scenes = results["restarts"]["scenes"]
    first = next(iter(scenes.values()))
    orders = ", ".join(f"{found['order']:.2f} ({name})" for name, found in scenes.items())
    return (
        f"Over a quarter of a second logs can be compared one by one. {first['points'][0]['logs']} moving logs start "
        f"from the same states and are calculated for {first['horizon_s']:g} s with constant steps, against a step of "
        f"{first['truth_ms']:.2g} ms. The slopes of the medians are {orders}; at 1 the error halves with the step."
    )


def crawls(results: Row) -> str:
    """The effect of the spacing of the rings on slow logs."""
    if "crawls" not in results:
        return "*Not measured yet.*"
    found = results["crawls"]
    rows = [
        [
            f"{r['spacing_m']:g}",
            str(r["logs"]),
            f"{r['way_m']:.2f}",
            f"{100 * r['share']:+.2f} ± {100 * r['half']:.2f}",
        ]
        for r in found["rows"]
    ]
    low, high = found["speeds_ms"]
    return (
        f"Logs of {low:g} to {high:g} m/s on the rough slope, let go for {found['seconds']:g} s with rings at several "
        f"distances, against rings {found['dense_m']:g} m apart:\n\n"
        + table(["rings [m]", "logs", "way down [m]", "more than with dense rings [%]"], rows)
    )


def _kept(shown: bool, undecided: bool = False) -> str:
    return "**shown**" if shown else "**not decided by this many logs**" if undecided else "**missed**"


def _within(record: Row) -> float:
    return max(abs(record["low"]), abs(record["high"]))


def _below(records: list[Row], bound: float) -> str:
    """Whether all differences are below a bound: shown if every interval is inside, however near to zero it is."""
    least = [0.0 if r["low"] <= 0.0 <= r["high"] else min(abs(r["low"]), abs(r["high"])) for r in records]
    return _kept(max(map(_within, records)) < bound, undecided=max(least) <= bound)


def within(low: float, high: float, bound: float) -> str:
    """Whether what an interval leaves possible is within ±bound."""
    return _below([{"low": low, "high": high}], bound)


def _judged(record: Row) -> str:
    return f"{tables.with_interval(record)} points from `reference`, at most {100 * _within(record):.1f}"


def _more(one: float, other: float) -> str:
    return "more" if abs(one) > abs(other) else "not more"


def _of_factor(results: Row, group: str) -> str:
    """``0.05: +0.4, 0.2: +1.9 points (the same as changing mu by -0.01 ± 0.00)``; empty if nothing is measured."""
    rows = tables.of_group(results, group)
    each = ", ".join(f"{tables.points(row['delta'])} at {SETTINGS[name].value:g}" for name, row in rows)
    if not rows:
        return ""
    most = max((row for _, row in rows), key=lambda row: abs(row["delta"]))
    known = tables.change_of_friction(results, most)
    as_mu = f" (the largest corresponds to mu {tables.in_friction(results, most)})" if known else ""
    return f"{each} points{as_mu}"


def choice(results: Row) -> str:
    """Advice on the choice of a fidelity, with reasons, as far as measured; a list."""
    found, yard = [], tables.friction_slope(results)
    standard, draft = tables.pooled(results, "standard"), tables.pooled(results, "draft")
    if standard:
        cost = tables.relative_cost(results, "reference")
        kept = _below([standard], STANDARD_POINTS)
        word = "**Decide on `standard`**" if "shown" in kept else "**Check `standard` against `fine`**"
        found.append(f"{word}: in the mean of scenes its reach is {_judged(standard)}, at 1/{cost:.2g} of the cost.")
    if draft:
        gain = 1.0 / tables.relative_cost(results, "draft")
        moved, least = (KNOWN * abs(yard[0]), KNOWN * (abs(yard[0]) - tables.Z_95 * yard[1])) if yard else (0.0, 0.0)
        uses = "Explore, vary and calibrate" if least > _within(draft) else "Explore only,"
        more = _more(least, _within(draft))
        words = f"Friction known to ±{KNOWN:g} leaves ±{100 * moved:.1f} points, which is {more}." if yard else ""
        found.append(
            f"**{uses} with `draft`**: {gain:.1f} times as fast, with a mean error of {tables.with_interval(draft)} "
            f"points, at most by {tables.worst_of(draft)}. {words}".rstrip()
        )
    deep = {
        name: [e["penetration_m"]["max"] for s, f, e in tables.fidelities_of(results) if f == name] for name in FINER
    }
    if all(deep.values()):
        costs = " and ".join(f"{tables.relative_cost(results, name):.2g}" for name in FINER[1:])
        depths = ", ".join(f"{100 * max(deep[name]):.0f}" for name in FINER)
        found.append(
            f"**Check with `fine` or `reference`** ({costs} times the cost of `standard`) what depends on a few points "
            f"or on contacts' depth: the deepest is {depths} cm from `standard` on."
        )
    cells = [row for name, row in tables.of_group(results, "cell") if SETTINGS[name].value > CELL]
    if cells and draft:
        sizes = ", ".join(f"{tables.points(row['delta'])} at {SETTINGS[row['name']].value:g} m" for row in cells)
        largest = max(abs(row["delta"]) for row in cells)
        found.append(
            f"**Cells of the terrain model** instead of {CELL:g} m move reach by {sizes} (points, mean): "
            f"{_more(largest, draft['worst']['delta'])} than `draft` does where it is worst."
        )
    if words := _of_factor(results, "rolling"):
        found.append(
            f"**Rolling friction**, for which no measured value is known, changes it by {words} against {ROLLING:g}: "
            "vary it."
        )
    if words := _of_factor(results, "tree restitution"):
        found.append(f"**Restitution of stems** changes it by {words} against none, in forests.")
    if rows := tables.of_group(results, "posture"):
        name, most = max(rows, key=lambda row: abs(row[1]["delta"]))
        found.append(
            f"**The posture at the release** changes it by up to {tables.with_interval(most)} points ({name} instead "
            f"of upright), the same as changing mu by {tables.in_friction(results, most)}."
        )
    if records := _rebounds(results, "draft"):
        worst = max(records, key=lambda k: abs(records[k]["delta"]))
        off = f"{tables.with_interval(records[worst])} points, {worst}"
        kept = _below(list(records.values()), DRAFT_POINTS)
        word = "`draft`" if "shown" in kept else "Not `draft`"
        found.append(
            f"**{word} with restitution**: its difference is {off}, where it is largest; below "
            f"{100 * DRAFT_POINTS:g} points everywhere: {kept}."
        )
    near = tables.friction_slope(results, ("sensitive",))
    if near and yard:
        found.append(
            f"**If friction is close to the slope's tangent**, one hundredth more changes reach by {near[0]:+.1f} "
            "points, in "
            f"the usual scenes {yard[0]:+.1f}."
        )
    return "\n".join(f"- {line}" for line in found) if found else "*Not measured yet.*"


def sensitive(results: Row) -> str:
    """The result of the sensitive case."""
    name, yard = "sensitive", tables.friction_slope(results, ("sensitive",))
    mine = results["entries"].get(name, {})
    if not yard or "error" not in mine.get("standard", {}):
        return "*Not measured yet.*"
    each = ", ".join(
        f"`{f}` {tables.with_interval(mine[f]['error']['reach'])}"
        for f in tables.FIDELITIES
        if "error" in mine.get(f, {})
    )
    usual = tables.friction_slope(results)
    beside = f", in the usual scenes {usual[0]:+.1f}" if usual else ""
    return (
        f"One hundredth of mu moves reach by {yard[0]:+.1f} points here{beside}. From `reference` are: {each} points."
    )


def _rebounds(results: Row, fidelity: str) -> Row:
    """Differences from the reference if everything rebounds, by scene and restitution."""
    return {
        f"{scene}, e {SETTINGS[name].value:g}": entry["error"]["reach"]
        for scene, name, entry in tables.entries_of(results, "impacts")
        if SETTINGS[name].fidelity == FIDELITIES[fidelity] and "error" in entry
    }


def impacts(results: Row) -> str:
    """Whether the promises hold if everything rebounds."""
    found = []
    for fidelity, bound in (("standard", STANDARD_POINTS), ("draft", DRAFT_POINTS)):
        if records := _rebounds(results, fidelity):
            worst = max(records, key=lambda k: abs(records[k]["delta"]))
            found.append(
                f"`{fidelity}`, below {100 * bound:g} points in each: {_below(list(records.values()), bound)}; "
                f"the most is {tables.with_interval(records[worst])} ({worst})."
            )
    return "\n".join(f"- {line}" for line in found) if found else "*Not measured yet.*"


def posture(results: Row) -> str:
    """The effect of the posture of the released logs on reach, compared with friction."""
    rows = [
        f"{name} logs {tables.with_interval(row)} points, the same as changing mu by "
        f"{tables.in_friction(results, row)} (most in "
        f"{row['worst_scene']}: {tables.with_interval(row['worst'])})"
        for name, row in tables.of_group(results, "posture")
    ]
    if not rows:
        return "*Not measured yet.*"
    return f"Against all logs upright, from the same places, in the mean of scenes: {'; '.join(rows)}."


def rebounds(results: Row) -> str:
    """Whether rigid objects hold at any restitution."""
    found = results.get("rebounds")
    if not found:
        return "*Not measured yet.*"
    deepest = max(found["rows"], key=lambda r: max(r["overlap_m"], r["sampled_m"]["max"]))
    through, most = sum(r["through"] for r in found["rows"]), max(deepest["overlap_m"], deepest["sampled_m"]["max"])
    kept = _kept(through == 0 and most < found["radius_m"])
    radius, logs = f"{100 * found['radius_m']:.1f} cm", sum(r["logs"] for r in found["rows"])
    return (
        f"Lying logs slide against a rigid barrier of {found['height_m']:g} m on a slope of {found['degrees']:g} "
        f"degrees with {100 * found['noise_m']:g} cm of white noise (mu {found['friction']:g}); ground and barrier "
        f"rebound alike. Nothing passes what is rigid, nor lies deeper in anything than its radius ({radius}): {kept}; "
        f"{through} logs of {logs} were through the barrier, and the deepest is {100 * most:.1f} cm (restitution "
        f"{deepest['e']:g}, `{deepest['fidelity']}`). *Through* is an axis that cuts the barrier below its top in any "
        "pose; *past* may have jumped. *By sampling* is how deep points all over the log lay in the ground, in every "
        "pose kept, without asking the engine's contacts."
    )


def noise(results: Row) -> str:
    """How deep logs sink into ground of white noise."""
    found = results.get("noise")
    if not found:
        return "*Not measured yet.*"
    usual = {
        name: max(e["penetration_m"]["max"] for _, f, e in tables.fidelities_of(results) if f == name)
        for name in tables.FIDELITIES
    }
    deep = {r["fidelity"]: max(r["penetration_m"]["max"], r["sampled_m"]["max"]) for r in found["rows"]}
    each = ", ".join(f"`{name}` {100 * deep[name]:.0f} ({100 * usual[name]:.0f})" for name in deep)
    return (
        f"White noise of {100 * found['noise_m']:g} cm on cells of {found['cell_m']:g} m, on a slope of "
        f"{found['degrees']:g} degrees (mu {found['friction']:g}): every cell is a kink. The deepest there, and in all "
        f"scenes above (in brackets) [cm]: {each}."
    )


def verdicts(results: Row) -> str:
    """What is promised for the fidelities, and what the measurements show, as a list."""
    found = []
    if row := tables.pooled(results, "standard"):
        found.append(
            f"`standard`, difference in reach below {100 * STANDARD_POINTS:g} points in the mean of scenes: "
            f"{_below([row], STANDARD_POINTS)}. In {len(row['scenes'])} scenes ({row['logs']} logs or more each) it is "
            f"{_judged(row)}; the worst scene is {tables.worst_of(row)}."
        )
    if row := tables.pooled(results, "draft"):
        each = {scene: entry["error"]["reach"] for scene, entry in tables.errors_of(results, "draft")}
        found.append(
            f"`draft`, difference in reach below {100 * DRAFT_POINTS:g} points in every scene: "
            f"{_below(list(each.values()), DRAFT_POINTS)}. "
            + ", ".join(f"{tables.with_interval(record)} {scene}" for scene, record in each.items())
            + f" ({row['logs']} logs or more each); in the mean {tables.with_interval(row)}."
        )
    gains = {scene: 1.0 / cost for scene, cost in tables.relative_costs(results, "draft").items()}
    slow, mean = min(gains, key=lambda scene: gains[scene]), 1.0 / tables.relative_cost(results, "draft")
    found.append(
        f"`draft` at least 4 times as fast as `standard`: {_kept(gains[slow] >= 4.0)}, {gains[slow]:.1f} times "
        f"where it gains least ({slow}), {mean:.1f} times in the mean of scenes."
    )
    hits = tables.raster_ratios(results, "standard")
    if hits:
        logs = {scene: results["entries"][scene]["standard"]["error"]["logs"] for scene in hits}
        each = ", ".join(f"{ratio:.2f} of it ({scene}, {logs[scene]} logs)" for scene, ratio in hits.items())
        kept = _kept(max(hits.values()) < 1.0)
        found.append(f"Hit raster of `standard` nearer to the reference's than other logs' would be: {kept}, {each}.")
    for row in results.get("speed", {}).get("rows", []):
        aim = {"standard": 45.0, "draft": 10.0}[row["fidelity"]]
        found.append(
            f"{row['logs']} logs in the forest at `{row['fidelity']}` within {aim:g} s: {_kept(row['wall_s'] < aim)}, "
            f"{row['wall_s']:.1f} s of wall time in {row['threads']} threads (median of {row['runs']} runs), rasters "
            f"included; deepest of them {100 * row['deepest_m']:.0f} cm."
        )
    deep = {scene: mine["standard"] for scene, mine in tables.in_order(results) if "standard" in mine}
    deep = {scene: entry["penetration_m"] | {"logs": entry["logs"]} for scene, entry in deep.items()}
    if deep:
        worst, deepest = max(deep, key=lambda n: deep[n]["median"]), max(deep, key=lambda n: deep[n]["max"])
        median, most = deep[worst]["median"], deep[deepest]["max"]
        found.append(
            f"Penetration at `standard`: median of the logs' deepest below 5 cm: {_kept(median < 0.05)}, at "
            f"most {100 * median:.1f} cm ({worst}); none deeper than {100 * DEEPEST:g} cm: {_kept(most < DEEPEST)}, "
            f"{100 * most:.0f} cm ({deepest}, {deep[deepest]['logs']} logs)."
        )
    falls = tables.penetration_falls(results)
    if falls:
        row, last = measures.pooled_fall(list(falls.values())), min(falls, key=lambda scene: falls[scene]["factor"])
        kept = _kept(row["low"] > HALVES, undecided=row["high"] >= HALVES)
        worst, number = falls[last], results["entries"][last]["refined 0.25"]["logs"]
        found.append(
            f"Penetration halves with the step (divided by more than {HALVES:g}): {kept}. Each halving of standard's "
            f"step, travel and spacing together divides the median of the same logs by {row['factor']:.2f} "
            f"({row['low']:.2f} to {row['high']:.2f}), mean of {len(falls)} scenes, two halvings, {number} logs each; "
            f"the least is {worst['factor']:.2f} ({worst['low']:.2f} to {worst['high']:.2f}), {last}."
        )
    halves = [
        (mine["reference halved"]["logs"], scene, mine["reference halved"]["error"]["reach"])
        for scene, mine in tables.in_order(results)
        if "error" in mine.get("reference halved", {})
    ]
    if halves:
        logs, scene, row = max(halves, key=lambda half: half[0])
        moved = _below([row], FINEST_POINTS / 100.0)
        found.append(
            f"`reference` with half its step, travel and spacing moves reach by less than {FINEST_POINTS:g} point: "
            f"{moved}, {tables.with_interval(row)} points ({scene}, {logs} paired logs)."
        )
    return "\n".join(f"- {line}" for line in found)
