"""Write the page (README.md here), its figures and the short table of the site, from the results file.

Every number comes from ``results.json``; the tables are in ``page_tables``, the assessments in ``verdicts``.
"""

from __future__ import annotations

import re
from pathlib import Path
from string import Template
from typing import Any

from . import figures, page_tables, population, population_page, study, tables, verdicts
from .scenes import CASES
from .settings import ROLLING

HERE = Path(__file__).parent
PAGE, TEMPLATE = HERE / "README.md", HERE / "page_template.md"
SHORT = HERE.parent / "docs" / "explanation" / "two-errors.md"  # the page with the short table
TRADE = HERE.parent / "algorithms/deadwood_algorithms/simulate/fidelity_trade.py"  # the part that the tools use
MARKS = re.compile(r"(<!-- measured: benchmarks\b[^>]*-->\n).*?(<!-- end of measured: benchmarks -->)", re.S)
TABLES = re.compile(r"((COSTS|REACH_ERRORS): [^\n]*\{\n).*?(\}\n)", re.S)
Row = dict[str, Any]


def _sources(results: Row, what: str) -> str:
    """The provenance of the entries: usually the same for all."""
    return "; ".join(sorted({e["source"][what] for _, mine in tables.in_order(results) for e in mine.values()}))


def provenance(results: Row) -> str:
    """The provenance of the numbers, as a list."""
    entries = [e for _, mine in tables.in_order(results) for e in mine.values()]
    lines = [f"- {what}: {_sources(results, what)}" for what in ("machine", "versions")]
    engines: dict[tuple[str, str, str], set[str]] = {}
    for _, mine in tables.in_order(results):
        for name, entry in mine.items():
            source = entry["source"]
            what = tables.group_of(name) or name
            engines.setdefault((source["date"], source["commit"], source["engine"]), set()).add(what)
    for (date, commit, engine), what in sorted(engines.items(), key=lambda item: len(item[1])):
        lines.append(f"- engine of commit {commit} (sources {engine}), {date}: {', '.join(sorted(what))}")
    certified = [each for each in results.get("same_bits", []) if each["as"] in study.engines_of(results)]
    for each in certified:
        lines.append(
            f"- **the engine of sources {each['engine']} gives the same bits** as the measured one ({each['as']}): "
            f"every array of {each['combinations']} combinations of scene, fidelity and law with {each['logs']} logs "
            f"each, compared on {each['date']}. Statements about one are valid for the other"
        )
    if len(engines) > 1:
        lines.append("- **several engines**: rows are comparable within a line above; `python -m benchmarks` fixes it")
    of = {name: found["source"]["engine"] for name, found in results.items() if _sourced(found)}
    if older := sorted(name for name, engine in of.items() if engine not in {engine for _, _, engine in engines}):
        lines.append(f"- **measured with an earlier engine**: {', '.join(older)}")
    if any(results["scenes"].get(c.name, {}).get("friction") != c.friction for c in CASES.values()):
        lines.append("- **the scenes have changed since**: the text tells of the new ones, the numbers are of the old")
    logs = [e["logs"] for e in entries]
    hours = sum(e["logs"] * e["cpu_ms_per_log"] for e in entries) / 3.6e6
    lines.append(f"- seed {results['seed']}; {min(logs)} to {max(logs)} logs per scene and setting")
    lines.append(f"- each log at most {results['time_limit_s']:g} s; CPU time of all runs: {hours:.1f} hours")
    return "\n".join(lines)


def stale(results: Row) -> str:
    """The page's first line if another engine than the present one was measured; otherwise empty."""
    now = study.engine_digest()
    certified = {each["engine"] for each in results.get("same_bits", []) if each["as"] in study.engines_of(results)}
    if now in study.engines_of(results) | certified:
        return ""
    return (
        f"- **the engine has changed since** these numbers were measured (sources now {now}): they are of the one "
        "before; `python -m benchmarks` measures again\n"
    )


def _sourced(found: Any) -> bool:
    return isinstance(found, dict) and "source" in found


def page(results: Row) -> str:
    """The whole page."""
    scenes_found = {name: results["scenes"][name] for name, _ in tables.in_order(results)}
    titles = (
        f"*{n}*, {c['title']} (mu {c['friction']:g}, line at y {c['line_y']:g} m)" for n, c in scenes_found.items()
    )
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        choice=stale(results) + verdicts.choice(results),
        population=population_page.headline(population.read()["records"]) or "*Not measured yet.*",
        provenance=provenance(results),
        scenes="; ".join(titles),
        block=results["block"],
        fidelity_table=page_tables.fidelity_table(results),
        verdicts=verdicts.verdicts(results),
        scene_table=page_tables.scene_table(results),
        field_table=page_tables.field_table(results),
        health_table=page_tables.health_table(results),
        yardstick=verdicts.yardstick(results),
        factor_table=page_tables.factor_table(results),
        cell_table=page_tables.cell_table(results),
        restarts=verdicts.restarts(results),
        crawls=verdicts.crawls(results),
        plane_table=page_tables.plane_table(results),
        roll_table=page_tables.roll_table(results),
        ring_table=page_tables.ring_table(results),
        rolling=f"{ROLLING:g}",
        impacts=verdicts.impacts(results),
        impact_table=page_tables.impact_table(results),
        rebounds=verdicts.rebounds(results),
        rebound_table=page_tables.rebound_table(results),
        noise=verdicts.noise(results),
        noise_table=page_tables.noise_table(results),
        posture=verdicts.posture(results),
        sensitive=verdicts.sensitive(results),
        sensitive_table=page_tables.sensitive_table(results),
        switch_table=page_tables.switch_table(results),
        peers=results.get("peers", {}).get("what", "*Not measured yet.*"),
        peer_table=page_tables.peer_table(results),
    )


def snippet(results: Row) -> str:
    """The short table."""
    found = [row for row in (tables.pooled(results, name) for name in figures.FIDELITIES) if row]
    numbers = sorted(row["logs"] for row in found)
    logs = f"{numbers[0]} to {numbers[-1]}" if numbers else "no"
    return (
        f"\n{page_tables.fidelity_table(results)}\n\n"
        f"Five synthetic scenes, {logs} paired logs or more each, by row; cost: `standard` is 1; intervals are 95 %. "
        f"Engine of commit {_sources(results, 'commit')}, {_sources(results, 'date')}; "
        f"{_sources(results, 'machine')}. [benchmarks/README.md](../../benchmarks/README.md) says how, and what "
        "else was measured.\n\n"
    )


def with_snippet(text: str, results: Row) -> str:
    """A page with the short table replaced; unchanged if no place is marked."""
    return MARKS.sub(lambda found: found[1] + snippet(results) + found[2], text)


def with_trade(source: str, results: Row) -> str:
    """The tools' source with its tables of costs and errors replaced by the numbers of the short table."""
    found = {name: tables.pooled(results, name) for name in figures.FIDELITIES}
    rows = {
        "COSTS": [f'"{name}": {float(f"{tables.relative_cost(results, name):.2g}")}' for name in figures.FIDELITIES],
        "REACH_ERRORS": [
            f'"{name}": ReachError(mean={_in_points(row)}, worst={_in_points(row["worst"])})'
            for name, row in found.items()
            if row
        ],
    }
    bodies = {name: "".join(f"    {row},\n" for row in mine) for name, mine in rows.items()}
    return TABLES.sub(lambda found: found[1] + bodies[found[2]] + found[3], source)


def _in_points(record: Row) -> str:
    """A difference and its interval as the source of a record, to a tenth of a point, as in the tables."""
    return f"Points({', '.join(str(float(tables.points(record[name]))) for name in ('delta', 'low', 'high'))})"


def write() -> None:
    """Write the page, the figures, the short table, and the costs and errors that the tools use."""
    results = study.read_results()
    figures.draw(results)
    PAGE.write_text(page(results), encoding="utf-8")
    SHORT.write_text(with_snippet(SHORT.read_text(encoding="utf-8"), results), encoding="utf-8")
    TRADE.write_text(with_trade(TRADE.read_text(encoding="utf-8"), results), encoding="utf-8")
    print(f"wrote {PAGE}, the table in {SHORT}, and {TRADE}")
