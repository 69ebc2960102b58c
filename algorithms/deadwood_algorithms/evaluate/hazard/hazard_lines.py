"""A hazard map in words: the area of each class, the lines, and warnings of too few or of lost logs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from deadwood_algorithms.evaluate.hazard.rates import ReleaseArea
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.lost import many, reach_phrases, warn_of_lost
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.stats.endings import left_dem
from deadwood_algorithms.stats.statistics import Z_95, lost_words, percent_with_interval


def lost_of_run(source: Run, rows: Sequence[dict[str, Any]], feedback: Feedback) -> int:
    """How many logs left the terrain model; warns if the maps or the lines depend on them."""
    n_lost = int(left_dem(source.deposits).sum())
    phrases = reach_phrases(row for row in rows if row["n_reach"] is not None and not row["at_least_kj"])
    phrases += ["classes, areas and the outline end where they left"] if many(n_lost, len(source.deposits)) else []
    warn_of_lost(n_lost, len(source.deposits), phrases, feedback, where=str(source.path))
    return n_lost


def warn_of_small_sample(
    facts: dict[str, Any], areas: Sequence[ReleaseArea], logs: int, periods: Sequence[float], feedback: Feedback
) -> None:
    """Warn if there are too few logs to distinguish the longest return period from no passage at all."""
    shortest = facts["no_hit"]["return_ci_low_years"]
    if shortest >= periods[-1]:
        return
    events = sum(each.events_per_year for each in areas)
    needed = Z_95**2 * (events * logs * periods[-1] - 1.0)
    feedback.warn(
        f"where no log passed the return period may still be {years_words(shortest)} years, shorter than "
        f"{periods[-1]:g}: {counted(facts['logs'], 'log is', 'logs are')} too few to decide; "
        f"about {significant(needed, 2)} are enough",
        code="few-logs",
        logs=facts["logs"],
        needed=needed,
    )


def lines_of(facts: dict[str, Any], rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """The area of each class, the lines, what an empty cell means, and the source of the rule."""
    shown = []
    for name in dict.fromkeys(each["map"] for each in facts["classes"]):
        mine = [each for each in facts["classes"] if each["map"] == name and each["cells"]]
        lines = [f"{each['meaning']}: {area_words(each)}" for each in mine]
        if len({each["n_needed"] for each in mine if each["area_m2"] is None}) == 1 == len({*map(area_words, mine)}):
            lines = [f"every class: {area_words(mine[0])}"]
        if name != "matrix":
            what = f"intensity, {facts['energy']}" if name == "intensity" else name.replace("_", " ")
            shown.append(f"{what}: {'; '.join(lines)}")
    for row in rows:
        if row["n_reach"] is not None:
            shown.append(line_words(row))
    shown += event_lines(facts)
    empty = (
        f"a cell that no log passed: passed by less than {significant(100 * facts['no_hit']['p_high'], 2)} % of "
        "the logs"
    )
    if "return_ci_low_years" in facts["no_hit"]:
        empty += f", return period over {years_words(facts['no_hit']['return_ci_low_years'])} years"
    return (*shown, f"{empty} (95 %)", facts["rule"], facts["decides"])


def area_words(record: dict[str, Any]) -> str:
    """The area of a class, or what it needs."""
    if record["area_m2"] is not None:
        return f"{significant(record['area_m2'] / 1e4, 3)} ha"
    needed = record["n_needed"]
    return f"its area needs {counted(needed, 'log')}" if needed else "its area grows with every log"


def event_lines(facts: dict[str, Any]) -> list[str]:
    """How often logs start, if known: stated for each release area, and added up over the areas."""
    areas = facts.get("areas")
    if not areas:
        return []
    rates = sorted({each["events_per_year"] for each in areas})
    rate = " to ".join(f"{significant(each, 3)}" for each in (rates[:1] + rates[-1:] if len(rates) > 1 else rates))
    each = f"{counted(facts['logs_per_event'], 'log')} each"
    if len(areas) == 1:
        return [f"events: {rate} a year, {each}"]
    total = sum(each["events_per_year"] for each in areas)
    return [
        f"events: {rate} a year in each of {len(areas)} release areas, {each}; together {significant(total, 3)} a year"
    ]


def years_words(years: float) -> str:
    """Years with three significant digits, never as 1e+03."""
    return f"{float(f'{years:.3g}'):.10g}"


def line_words(row: dict[str, Any]) -> str:
    """``road, 30 kJ and more: 12 % (9 to 16 %), every 83 years (62 to 111)``."""
    least = f", {row['at_least_kj']:g} kJ and more" if row["at_least_kj"] else ""
    text = f"{row['line_id']}{least}: {percent_with_interval(row)}"
    if "return_ci_low_years" not in row:
        return text + lost_words(row)
    if not row["n_reach"]:
        text += f", return period over {years_words(row['return_ci_low_years'])} years"
    else:
        ends = f"{years_words(row['return_ci_low_years'])} to {years_words(row['return_ci_high_years'])}"
        text += f", every {years_words(row['return_period_years'])} years ({ends})"
    lost = lost_words(row)
    return text + lost + (f", over {years_words(row['return_ci_low_years_if_lost'])} years" if lost else "")
