"""Compare runs of the same logs: with the forest and without, as mapped and random, with barriers or a dam.

Every scenario is compared with the first, log by log: each log is its own control, so a few hundred logs show what
independent runs would need thousands for. The folder holds

- `table.csv`: one row a scenario, as in the paper's section 5: reach, its difference to the first, lateral spread,
  speed, what held the logs;
- `comparison.csv`: every quantity with its 95 % interval, its difference and the interval of that; shares with the
  number of logs that changed either way and the p-value of McNemar's exact test;
- `difference_NAME.tif`: how much likelier each cell is passed, and that in standard errors;
- `changes.gpkg`: the logs that reach a line in one of two scenarios only (`changed`, at their releases), and from
  where to where each deposit moved (`moved`);
- `comparison.png`: reach, run-outs and the maps side by side;
- `comparison.json`: all of it, and in which parameters the runs differ.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --trees sample_data/trees.csv \\
        --lines 'sample_data/sample.gpkg|layername=lines' --friction 0.25 --output with_forest
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg \\
        --lines 'sample_data/sample.gpkg|layername=lines' --friction 0.25 --output without
    deadwood-tool compare-scenarios --runs without,with_forest --output forest_effect

Runs of other releases are refused. The intervals are over the logs: one random forest is one draw of many, and how
much another would differ, only other runs can tell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms import tool
from deadwood_algorithms.tool import Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    from deadwood_algorithms.scenario_measures import Row

TABLE, ROWS, FACTS, CHANGES = "table.csv", "comparison.csv", "comparison.json", "changes.gpkg"
PICTURE = "comparison.png"
SHOWN = 4  # lines and releases in the printed table; the files have them all


@dataclass(frozen=True, kw_only=True)
class Ask:
    runs: str = tool.text(
        "Folders of the runs, with commas; the first is what the others are compared with",
        help="Each a folder of slide-logs, of the same releases: run_none,run_forest,run_barriers.",
    )
    names: str | None = tool.text(
        "Names of the scenarios, with commas", default=None, help="Default: the names of the folders."
    )
    lines: str | None = tool.vector(
        "Other lines or houses than those of the runs",
        "line",
        "polygon",
        default=None,
        help="Their reach is found from stored trajectories, of the logs that have one in every run.",
    )
    min_runout: float | None = tool.min_runout()
    seed: int = tool.seed()
    output: str = tool.output_folder("Folder of the comparison")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.compare_scenarios_picture import draw
    from deadwood_algorithms.layers import output_folder, write_vector
    from deadwood_algorithms.run_folder import MANIFEST, write_json
    from deadwood_algorithms.scenario_maps import changed_frame, difference_map, moved_frame
    from deadwood_algorithms.scenario_measures import rows_of
    from deadwood_algorithms.scenario_runs import differing, read_compared

    final = Path(ask.output)
    with output_folder(ask.output, ask.overwrite) as folder:
        compared = read_compared(ask.runs, ask.names, ask.lines, feedback)
        rows = rows_of(compared, ask.min_runout, ask.seed, feedback)
        names = [each.name for each in compared.scenarios]
        differences = differing(compared)

        parts = {"table": TABLE, "rows": ROWS, "facts": FACTS, "changes": CHANGES, "picture": PICTURE}
        parts |= {"manifest": MANIFEST}
        maps: dict[str, Path] = {}
        outputs = {"output": final} | {key: final / name for key, name in parts.items()}
        for other in compared.others:
            path = folder / f"difference_{other.name}.tif"
            try:
                difference_map(compared.reference, other, path, feedback)
            except UserError as error:  # of grids that do not fit; all else can be compared
                path.unlink(missing_ok=True)
                feedback.warn(f"no map of {other.name}: {error}")
            else:
                maps[other.name] = path
                outputs[path.stem] = final / path.name
        draw(folder / PICTURE, rows, compared, maps)
        pandas.DataFrame([asdict(row) for row in rows]).to_csv(folder / ROWS, index=False)
        pandas.DataFrame(wide(rows, names)).to_csv(folder / TABLE, index=False)
        layers = {"moved": moved_frame(compared)}
        changed = changed_frame(compared)
        write_vector(folder / CHANGES, layers | ({"changed": changed} if len(changed) else {}))
        facts = {"reference": names[0], "logs": compared.log_id.size, "parameters_that_differ": differences}
        write_json(folder / FACTS, {**facts, "rows": [asdict(row) for row in rows]})
        write_json(folder / MANIFEST, tool.manifest(TOOL, ask))
    return Outcome(outputs, facts, lines_of(rows, names, differences, compared.log_id.size))


def wide(rows: Sequence[Row], names: Sequence[str]) -> list[dict[str, Any]]:
    """One record a scenario: reach, spread, speeds and what held the logs, as the paper tells them."""
    records = []
    for name in names:
        record: dict[str, Any] = {"scenario": name}
        for row in (row for row in rows if row.scenario == name):
            key = "_".join(part for part in (row.quantity, row.item) if part).replace(" ", "_")
            scale, unit = (100.0, "percent") if row.unit == "1" else (1.0, row.unit.replace("/", "").lower())
            record.setdefault("logs", row.n)
            record[f"{key}_{unit}"] = scale * row.value
            if row.quantity == "reach" or row.quantity == "spread_p05_p95":
                word = "points" if row.unit == "1" else unit
                record |= {f"{key}_low_{unit}": scale * row.low, f"{key}_high_{unit}": scale * row.high}
                for part in ("difference", "diff_low", "diff_high"):
                    record[f"{key}_{part}_{word}"] = scale * getattr(row, part)
        records.append(record)
    return records


def lines_of(
    rows: Sequence[Row], names: Sequence[str], differences: dict[str, dict[str, Any]], n_logs: int
) -> tuple[str, ...]:
    """A table with a line a scenario, and what makes the scenarios differ."""
    of = {(row.scenario, row.quantity, row.item): row for row in rows}
    lines = list(dict.fromkeys(row.item for row in rows if row.quantity == "reach"))
    releases = list(dict.fromkeys(row.item for row in rows if row.quantity == "spread"))
    head = ["scenario"]
    for line in lines[:SHOWN]:
        head += [f"reach {line}", f"minus {names[0]} [points]"]
    head += [f"spread {release} (5-95 %)" for release in releases[:SHOWN]]
    head += ["mean speed", "max speed", "held by trees", "by lying logs", "by barriers"]
    table = [head]
    for name in names:
        cells = [name]
        for line in lines[:SHOWN]:
            row = of[name, "reach", line]
            cells += [percent(row), points(row) if name != names[0] else "-"]
        for release in releases[:SHOWN]:
            row, middle = of[name, "spread", release], of.get((name, "spread_p05_p95", release))
            cells.append(f"{degrees(row.value)} ({degrees(middle.value if middle else math.nan)})")
        cells += [
            f"{of[name, 'speed_mean', 'mean'].value:.1f} m/s",
            f"{of[name, 'speed_max', 'largest'].value:.1f} m/s",
        ]
        cells += [f"{100 * of[name, 'ended', each].value:.1f} %" for each in ("tree", "lying_log", "barrier")]
        table.append(cells)
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    shown = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    for parameter, values in differences.items():
        told = ", ".join(f"{name}: {Path(str(value)).name if value else 'none'}" for name, value in values.items())
        shown.append(f"--{parameter.replace('_', '-')} differs: {told}")
    if not differences:
        shown.append("the runs differ in no parameter of slide-logs (their layers may)")
    hidden = max(len(lines) - SHOWN, 0) + max(len(releases) - SHOWN, 0)
    more = f"; {hidden} more lines or releases in {TABLE}" if hidden else ""
    return (f"{n_logs} logs in each scenario, intervals 95 %{more}:", *shown)


def percent(row: Row) -> str:
    return f"{100 * row.value:.1f} % ({100 * row.low:.1f} to {100 * row.high:.1f})"


def points(row: Row) -> str:
    return f"{100 * row.difference:+.1f} ({100 * row.diff_low:+.1f} to {100 * row.diff_high:+.1f})"


def degrees(angle: float) -> str:
    return f"{angle:.0f}°" if math.isfinite(angle) else "-"


TOOL = Tool(
    "compare-scenarios", "Evaluate", "Runs of the same logs: paired differences of reach, maps, table", Ask, run
)
