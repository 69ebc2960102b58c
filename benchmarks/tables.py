"""The page's numbers, derived from the results file: pure functions from results to rows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from deadwood_algorithms.stats.statistics import Z_95, to_decimals

from . import measures
from .scenes import CASES
from .settings import SETTINGS

Row = dict[str, Any]
FIDELITIES = ("draft", "standard", "fine", "reference")
# Scenes that count in means over scenes: those of users. On a plane the number of rings decides, not the size of
# a step; the sensitive case has a section of its own
POOLED = ("rough", "forest", "barriers", "cliff", "gully")


def group_of(setting: str) -> str:
    """The factor that a setting varies; empty for one that the study no longer has."""
    return SETTINGS[setting].group if setting in SETTINGS else ""


def in_order(results: Row) -> list[tuple[str, Row]]:
    """(scene, its entries), in the order of the study."""
    return [(name, results["entries"][name]) for name in CASES if name in results["entries"]]


def fidelities_of(results: Row) -> list[tuple[str, str, Row]]:
    """(scene, fidelity, entry) for everything measured at one of the four fidelities."""
    rows = [(scene, entries) for scene, entries in in_order(results)]
    return [(scene, name, entries[name]) for scene, entries in rows for name in FIDELITIES if name in entries]


def penetration_falls(results: Row) -> dict[str, Row]:
    """Factor by which halving standard's step, travel and spacing reduces the median penetration, by scene."""
    found = {scene: mine.get("refined 0.25", {}) for scene, mine in in_order(results) if scene in POOLED}
    return {scene: entry["penetration_fall"] for scene, entry in found.items() if "penetration_fall" in entry}


def errors_of(results: Row, setting: str) -> list[tuple[str, Row]]:
    """(scene, error record) of a setting, in the scenes that count in means."""
    found = []
    for name in POOLED:
        entry = results["entries"].get(name, {}).get(setting, {})
        if "error" in entry:
            found.append((name, entry))
    return found


def raster_ratios(results: Row, setting: str) -> dict[str, float]:
    """Distance of the hit rasters over its noise, by scene."""
    found = {scene: entry["error"] for scene, entry in errors_of(results, setting)}
    return {s: e["hits_jaccard"] / e["hits_jaccard_floor"] for s, e in found.items() if "hits_jaccard_floor" in e}


def jump_errors(results: Row, setting: str) -> dict[str, float]:
    """Difference [%] of the jump height that 95 % of the logs stay below, by scene."""
    found = {scene: entry["error"]["jump_95_m"] for scene, entry in errors_of(results, setting)}
    return {s: 100.0 * e["difference"] / (e["value"] - e["difference"]) for s, e in found.items()}


def relative_costs(results: Row, setting: str, base: str = "standard") -> dict[str, float]:
    """Cost of a setting over that of another, by scene, in the scenes that count in means."""
    return {
        name: entries[setting]["cpu_ms_per_log"] / entries[base]["cpu_ms_per_log"]
        for name, entries in in_order(results)
        if name in POOLED and setting in entries and base in entries
    }


def relative_cost(results: Row, setting: str, base: str = "standard") -> float:
    """The same, geometric mean over these scenes."""
    ratios = list(relative_costs(results, setting, base).values())
    return math.exp(float(np.mean(np.log(ratios)))) if ratios else math.nan


def pooled(results: Row, setting: str) -> Row | None:
    """Mean difference in reach over the scenes, with its interval; the worst scene; the logs behind it."""
    found = errors_of(results, setting)
    if not found:
        return None
    records = {name: entry["error"]["reach"] for name, entry in found}
    worst = max(records, key=lambda n: abs(records[n]["delta"]))
    return {
        **measures.pooled_difference(list(records.values())),
        "worst_scene": worst,
        "worst": records[worst],
        "logs": min(entry["error"]["logs"] for _, entry in found),
        "scenes": tuple(records),
        "discordant": float(np.mean([r["discordant"] for r in records.values()])),
    }


def pooled_rows(results: Row) -> list[Row]:
    """One row for each setting, in the order of the settings."""
    rows = []
    for name, setting in SETTINGS.items():
        found = pooled(results, name)
        if found and name != setting.against:
            rows.append(
                {
                    "name": name,
                    "group": setting.group,
                    "against": setting.against,
                    **found,
                    "cost": relative_cost(results, name),
                }
            )
    return rows


def friction_slope(results: Row, scenes: tuple[str, ...] = POOLED) -> tuple[float, float] | None:
    """Change of reach per unit of mu, mean over the scenes, with its standard error, as a scale for comparison."""
    slopes = []
    for name in scenes:
        entries = results["entries"].get(name, {})
        found = [
            (SETTINGS[s].friction_change, e["error"]["reach"])
            for s, e in entries.items()
            if group_of(s) == "friction" and "error" in e
        ]
        if found:
            slopes.append(
                measures.slope_through(
                    np.array([c for c, _ in found]),
                    np.array([r["delta"] for _, r in found]),
                    np.array([r["se"] for _, r in found]),
                )
            )
    if not slopes:
        return None
    return float(np.mean([s for s, _ in slopes])), math.sqrt(sum(e * e for _, e in slopes)) / len(slopes)


def change_of_friction(results: Row, record: Row) -> tuple[float, float] | None:
    """The change of mu that would have the effect of a difference in reach in the same scenes, and half of its 95 %
    interval; None if friction moves reach too little there to tell.
    """
    yard = friction_slope(results, record["scenes"])
    if yard is None or abs(yard[0]) < 2.0 * yard[1]:
        return None
    relative = math.hypot(record["se"] / yard[0], record["delta"] * yard[1] / yard[0] ** 2)
    return record["delta"] / yard[0], Z_95 * relative


def in_friction(results: Row, record: Row | None) -> str:
    """The same in words: estimate and interval."""
    change = change_of_friction(results, record) if record else None
    return f"{change[0]:+.3f} ± {change[1]:.3f}" if change else "-"


def of_group(results: Row, group: str) -> list[tuple[str, Row]]:
    """(setting, its mean effect over its scenes) of a factor, as far as measured."""
    return [(row["name"], row) for row in pooled_rows(results) if row["group"] == group]


def entries_of(results: Row, group: str) -> list[tuple[str, str, Row]]:
    """(scene, setting, entry) of a factor."""
    scenes = (scene for scene, _ in in_order(results))
    return [(s, name, entry) for s in scenes for name, entry in in_plan(results, s) if group_of(name) == group]


def in_plan(results: Row, scene: str) -> list[tuple[str, Row]]:
    """(setting, entry) of a scene, in the order of the settings."""
    mine = results["entries"].get(scene, {})
    return [(name, mine[name]) for name in SETTINGS if name in mine]


def cell_rows(results: Row) -> list[Row]:
    """Reach on other cell sizes of the same ground, compared with 0.5 m, and the friction that would compensate it."""
    rows = []
    for name in POOLED:
        entries = results["entries"].get(name, {})
        yard = friction_slope(results, (name,))
        for setting, entry in entries.items():
            if group_of(setting) != "cell" or "error" not in entry:
                continue
            reach = entry["error"]["reach"]
            undo = -reach["delta"] / yard[0] if yard and abs(yard[0]) > 2 * yard[1] else math.nan
            rows.append(
                {"scene": name, "cell": SETTINGS[setting].cell, **reach, "friction": undo, "p": entry["reach"]["p"]}
            )
    return sorted(rows, key=lambda r: (POOLED.index(r["scene"]), r["cell"]))


def points(value: float) -> str:
    """A difference of probabilities in percentage points."""
    return to_decimals(100 * value, 1, sign=True)


def with_interval(record: Row | None) -> str:
    """``+0.4 (-0.9 to +1.7)`` percentage points."""
    if record is None:
        return ""
    return f"{points(record['delta'])} ({points(record['low'])} to {points(record['high'])})"


def worst_of(row: Row | None) -> str:
    """The scene whose difference is the largest, in points."""
    return f"{with_interval(row['worst'])}, {row['worst_scene']}" if row else ""


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table, or a note if nothing has been measured."""
    if not rows:
        return "*Not measured yet.*"
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *rows])


def number(value: float) -> str:
    """Three digits, without trailing noise; whole numbers from a thousand on."""
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


def span(values: list[float]) -> str:
    """Smallest and largest of some values."""
    return f"{number(min(values))} to {number(max(values))}" if len(values) > 1 else number(values[0])
