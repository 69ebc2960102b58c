"""Sentences that judge: what was promised of the fidelities, and what the measurements say of it.

Which of them is written is chosen by the numbers, not by a hand.
"""

from __future__ import annotations

from typing import Any

from . import measures, tables
from .tables import table

Row = dict[str, Any]
HALVES = 1.8  # what passes for halving: 0.85 of the first order in the step


def yardstick(results: Row) -> str:
    """What a hundredth of friction does."""
    yard = tables.friction_slope(results)
    if not yard:
        return "*Not measured yet.*"
    return (
        f"One hundredth of mu moves reach by {yard[0]:+.2f} ± {tables.Z_95 * yard[1]:.2f} points in the mean of these "
        "scenes. The column *as much as mu* is a setting's difference in these terms (with its interval): a difference "
        "of 0.01 is smaller than what any site's friction is known to."
    )


def restarts(results: Row) -> str:
    """What the short restarts show."""
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
    """What the distance of the rings does to slow logs."""
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


def verdicts(results: Row) -> str:
    """What was promised of the fidelities, and what the measurements say of it, as a list."""
    found = []
    for name, bound in (("standard", 0.01), ("draft", 0.025)):
        row = tables.pooled(results, name)
        if not row:
            continue
        within, least = max(abs(row["low"]), abs(row["high"])), min(abs(row["low"]), abs(row["high"]))
        if row["low"] <= 0.0 <= row["high"]:
            judged, least = f"indistinguishable from `reference` within ±{100 * within:.1f} points", 0.0
        else:
            judged = f"{tables.with_interval(row)} points from `reference`"
        kept = _kept(within < bound, undecided=least <= bound)
        found.append(
            f"`{name}`, difference in reach below {100 * bound:g} points: {kept}. In the mean of {row['scenes']} "
            f"scenes ({row['logs']} logs or more each) it is {judged}; the worst scene is {tables.worst_of(row)}."
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
    deep = {scene: e["penetration_m"] for scene, name, e in tables.fidelities_of(results) if name == "standard"}
    if deep:
        worst, deepest = max(deep, key=lambda n: deep[n]["median"]), max(deep, key=lambda n: deep[n]["max"])
        median, most = deep[worst]["median"], deep[deepest]["max"]
        found.append(
            f"Penetration at `standard`: median of the logs' deepest below 5 cm: {_kept(median < 0.05)}, at "
            f"most {100 * median:.1f} cm ({worst}); none deeper than 25 cm: {_kept(most < 0.25)}, "
            f"{100 * most:.0f} cm ({deepest})."
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
        moved = _kept(row["low"] <= 0.0 <= row["high"])
        found.append(
            f"`reference` with half its step, travel and spacing moves reach by less than its interval: {moved}, "
            f"{tables.with_interval(row)} points ({scene}, {logs} paired logs)."
        )
    return "\n".join(f"- {line}" for line in found)
