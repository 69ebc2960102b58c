"""Compute design values for barriers and lines: percentiles of energy, speed, height and impulse, with intervals.

For each barrier of the run, and each line (a road, or a profile line across the slope where a barrier might stand): the
50, 90, 95 and 99 % percentiles, or others, over the logs that arrive there:

- `energy`: kinetic energy of translation and rotation together; `translation` and `rotation`: each separately;
- `speed`: of the centre of mass;
- `height_needed`: the height above the terrain of the log's upper edge in the plane of the barrier or line, which a
  barrier there must exceed.

These are of all logs that come there, whether the barrier stops them or not: what the place needs, and the same for a
barrier and for a line in its place. What the barrier of the chosen height receives is stated beside it, of the logs
that hit it, just before the hit, the largest of each log:

- `energy_hit`, `speed_hit`; `height_hit`: the height of the point that is hit, never more than the barrier's own, so it
  says nothing about the height that is needed;
- `impulse`: the momentum that the barrier takes up in a hit. A line has none, because nothing is hit there.

At a barrier all of them are stored in every run. At a line they come from stored trajectories. Energies of rotation are
within a few percent of the run's own, except those of hits, which are the run's own.

The interval of a percentile is exact, by order statistics: the binomial distribution gives the two sorted values that
enclose it with at least 95 % probability, whatever the distribution. A percentile without both ends is not shown: its
cells are empty, and `note` states how many more arrivals it needs, in total 6 for 50 %, 72 for 95 %, 368 for 99 %.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 --trajectories all \\
        --barriers 'sample_data/sample.gpkg|layername=barriers' --lines 'sample_data/sample.gpkg|layername=lines' \\
        --output run
    deadwood-tool design-values --run run --output design_values.csv

`--barrier-classes` names the weakest class of rockfall nets that holds each percentile of the energy and the upper end
of its interval.

The percentiles hold for the logs that were released: heavier logs or another friction give others. Barriers are rigid,
so impulses are those of a wall, not of a net that deforms. Percentiles include no safety factor: the factors of the
standard that applies (UNI 11211-4, ONR 24810) are the engineer's to apply.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from deadwood_algorithms.params import presets, tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run", help="Written by slide-logs.")
    lines: str | None = tool.vector(
        "Roads, railways, houses in place of those of the run",
        "line",
        "polygon",
        default=None,
        help="Or profile lines across the slope. They need stored trajectories. Without it, the lines of the run.",
    )
    percentiles: tuple[float, ...] = tool.numbers(
        "Percentiles",
        50.0,
        90.0,
        95.0,
        99.0,
        unit="%",
        minimum=0.0,
        maximum=100.0,
        exclusive=True,
        exclusive_maximum=True,
    )
    confidence: float = tool.number(
        "Probability with which an interval holds its percentile, at least",
        unit="%",
        default=95.0,
        minimum=50.0,
        maximum=99.9,
        advanced=True,
    )
    barrier_classes: str | None = tool.choice(
        "Classes of barriers, to find the weakest that holds the energies",
        *presets.BARRIERS,
        default=None,
        help=presets.choices_help(presets.BARRIERS)
        + " They were made for rocks; whether they suit wood is for an expert to decide.",
    )
    output: str = tool.output_table("Design values by barrier or line, quantity and percentile")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.evaluate.hazard.design_values import (
        class_lines,
        class_record,
        lines_of,
        lost_before,
    )
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.passages import barrier_passages, design_rows, passages_of_lines
    from deadwood_algorithms.results.run_folder import read_run
    from deadwood_algorithms.results.scenario import lines_of_run

    levels = [each / 100.0 for each in sorted(ask.percentiles)]
    with writing(TOOL, ask, feedback) as outputs:
        path = outputs.file("output", ".csv")
        source = read_run(ask.run, feedback=feedback)
        found = [*barrier_passages(source), *passages_of_lines(source, ask.lines, feedback)]
        if not found:
            raise UserError(f"{ask.run}: the run has neither barriers nor lines; give lines with --lines")
        rows = [row for each in found for row in design_rows(each, levels, ask.confidence / 100.0)]
        lost = lost_before(source, found, feedback)
        rows = [row | {"n_lost": lost[row["kind"], row["place_id"]]} for row in rows]
        classes = presets.BARRIERS[ask.barrier_classes] if ask.barrier_classes else None
        rows = [row | (class_record(classes, row) if classes else {}) for row in rows]
        write_csv(path, pandas.DataFrame(rows))
    shown = (*lines_of(found, rows), *class_lines(rows, classes), *lines_of_run(source))
    return Outcome({"output": Path(ask.output)}, {"rows": rows}, shown)


TOOL = Tool(
    "design-values",
    "Evaluate",
    "Compute percentiles of energy, speed, height and impulse at barriers and lines",
    Ask,
    run,
    then="deadwood-tool make-report {run} --output report.html",
)
