"""Map classes of intensity and probability of a run, with return periods if the frequency of starts is known.

The folder holds, for the ground that any log passed:

- `intensity.tif`: class of the energy that at least `--least-passage` of the logs (1 %) bring to the cell, from
  stored trajectories: 1 below 30 kJ, 2 from 30 to 300 kJ, 3 from 300 kJ; 0 where fewer pass. With few logs the areas
  of rare classes come out too large, so an area is stated only from the number of logs that supports it (`n_needed`:
  about 9500 for 1 %), before that only its interval;
  `--energy-raster` takes another energy, such as the 95 % quantile of `count-hits`, where enough logs pass;
- `passage.tif`: class of the share of logs that passed: 1 below 0.1 %, 2 to 1 %, 3 to 10 %, 4 from 10 %;
- `process_area.gpkg`: the outline of the ground that at least this share of the logs passes, an indication map;
- with a frequency, `intensity_30_years.tif`, `intensity_100_years.tif`, `intensity_300_years.tif`: for each scenario
  the class of the energy that comes to the cell at least once in its return period, as `lines.csv` has it for lines;
- `matrix.tif`: with a frequency, of all scenarios the highest class of intensity with the shortest return period that
  reaches it: 10 times that class, plus 1 for 30 years, 2 for 100, 3 for 300; without one, 10 times the class of
  intensity plus that of passage;
- with a frequency, `return_period.tif` (of any passage: years, and the ends of the 95 % interval) and
  `return_class.tif`: 1 up to 30 years, 2 up to 100, 3 up to 300, 4 beyond;
- `lines.csv`: for each line the number of logs that reach it with at least 0, 30, 300 kJ, their share and its return
  period, each with its interval;
- `classes.json`: the meaning and the area of every class.

The frequency is that of events in each release area: `--events-per-year`, or a column of the releases with the same
number in all rows of an area (`--events-field`). An event releases `--logs-per-event` logs. Where areas differ in
frequency, their hits are counted separately, from stored trajectories.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 --trajectories all \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output run
    deadwood-tool map-intensity --run run --events-per-year 0.1 --output intensity

The classes of 30 and 300 kJ and of 30, 100 and 300 years are those of the Swiss federal recommendations for rockfall
(BRP, BWW and BUWAL 1997; BAFU 2016), as published by the canton of Valais (vs.ch). They were made for rock: whether
they suit wood, and which hazard a field of the matrix stands for, is an expert's decision. A cell is classed by its
estimate; `classes.json` has the 95 % interval of the area of each class of energy and those above it. A cell that no
log passed is empty, which is not a guarantee: `classes.json` states how probable a passage there may still be, and
how short its return period.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool

RULE = (
    "30 and 300 kJ, and 30, 100 and 300 years, are the classes of the Swiss federal recommendations for rockfall "
    "(BRP, BWW, BUWAL 1997; BAFU 2016; canton of Valais, vs.ch); other bounds are the user's"
)
DECIDES = "an expert decides which hazard a field of the matrix stands for, and whether these classes suit wood"
LINES, FACTS, OUTLINE = "lines.csv", "classes.json", "process_area.gpkg"


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run", help="Written by slide-logs.")
    energy_classes_kj: tuple[float, ...] = tool.class_bounds("Bounds of the classes of energy", 30.0, 300.0, unit="kJ")
    energy_raster: str | None = tool.raster(
        "Other energies to classify [kJ]",
        default=None,
        help="Band 1; such as that of deadwood-tool count-hits --energy FILE --quantiles 95.",
    )
    least_passage: float = tool.number(
        "Minimum share of the logs that bring the energy of a class",
        unit="%",
        default=1.0,
        minimum=0.0,
        maximum=100.0,
        help="0: the largest energy of all logs, which grows with their number, so that no area is stated.",
    )
    probability_classes: tuple[float, ...] = tool.class_bounds(
        "Bounds of the classes of passage",
        0.1,
        1.0,
        10.0,
        unit="%",
        maximum=100.0,
        exclusive_maximum=True,
        help="Of the logs.",
    )
    events_per_year: float | None = tool.number(
        "Events per year in each release area", default=None, minimum=0.0, exclusive=True
    )
    releases: str | None = tool.vector(
        "Releases or release areas with a column of events per year",
        "point",
        "polygon",
        default=None,
        help="With release_id; without it, the run's own releases.",
    )
    events_field: str | None = tool.field_of(
        "releases",
        "Column of events per year",
        default=None,
        parent_elsewhere=True,
        help="Default, with releases: events_per_year.",
    )
    logs_per_event: int = tool.integer("Logs that start in an event", default=1, minimum=1, maximum=1_000_000)
    return_periods_years: tuple[float, ...] = tool.class_bounds(
        "Bounds of the classes of return period", 30.0, 100.0, 300.0, unit="years"
    )
    lines: str | None = tool.other_lines("Their reach is computed from stored trajectories.")
    output: str = tool.output_folder("Folder of the maps")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.evaluate.hazard import cells, legend
    from deadwood_algorithms.evaluate.hazard.class_maps import ClassMaps, write_years, years_of
    from deadwood_algorithms.evaluate.hazard.frequencies import release_areas
    from deadwood_algorithms.evaluate.hazard.hazard_lines import lines_of, lost_of_run, warn_of_small_sample
    from deadwood_algorithms.evaluate.hazard.least_passage import (
        areas_of,
        energies_of_share,
        needed_for,
        process_area,
        supported_from,
    )
    from deadwood_algorithms.evaluate.hazard.line_passages import line_rows
    from deadwood_algorithms.evaluate.hazard.rates import period_class, rising_class
    from deadwood_algorithms.evaluate.hazard.scenarios import intensities, joint, logs_needed, periods_of_energies
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.passages import passages_of_lines
    from deadwood_algorithms.results.run_folder import read_run, write_json
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.stats.statistics import wilson_interval

    strong, shares, periods = ask.energy_classes_kj, ask.probability_classes, ask.return_periods_years
    final = Path(ask.output)
    with result_folder(TOOL, ask, feedback) as folder:
        source = read_run(ask.run, feedback=feedback)
        areas = release_areas(source, ask.events_per_year, ask.releases, ask.events_field, feedback)
        grid = cells.passed_window(source)
        hits = cells.values_on(cells.run_raster(source, cells.HITS), grid, "hits")
        passed, n_logs = hits > 0.0, len(source.deposits)
        energies = energies_of_share(source, ask.least_passage / 100.0, ask.energy_raster, grid, hits, feedback)
        maps = ClassMaps(folder, grid)
        names = legend.rising_labels(strong, "kJ")
        weights = rising_class(np.where(passed, energies.estimate, np.nan), strong)
        warm = legend.class_rows(names, legend.WARM)
        enough = supported_from(ask.least_passage / 100.0)
        known = energies.facts["n_logs"], [enough] * len(warm)
        maps.write("intensity", weights, warm, f"Class of the {energies.what}", (strong, "kJ"), logs=known)
        for row, area_facts in zip(maps.classes, areas_of(energies, strong, grid.cell), strict=True):
            row.update(area_facts)
        passages = rising_class(np.where(passed, 100.0 * hits / n_logs, np.nan), shares)
        often = legend.rising_labels(shares, "% of the logs")
        about = "Class of the share of the logs that pass"
        needed = [None, *(needed_for(each / 100.0) for each in shares)]
        maps.write(
            "passage", passages, legend.class_rows(often, legend.COLD), about, (shares, "%"), logs=(n_logs, needed)
        )
        outline = process_area(hits, ask.least_passage / 100.0, n_logs, grid)
        write_vector(folder / OUTLINE, {"process_area": outline})
        facts: dict[str, Any] = {"rule": RULE, "decides": DECIDES, "energy": energies.what}
        facts["least_passage"] = energies.facts
        facts["logs"] = n_logs
        facts["no_hit"] = {"p_high": wilson_interval(0, n_logs)[1]}
        both = np.where(weights > 0, 10 * weights + passages, 0).astype(np.uint8)
        rows = legend.matrix_rows(names, often, rarest_first=True)
        matrix = both, rows, (n_logs, [each and enough and max(each, enough) for _ in names for each in needed])
        if areas:
            years, shortest = years_of(source, areas, ask.logs_per_event, grid, hits, feedback)
            facts["areas"] = [vars(each) for each in areas]
            facts["logs_per_event"] = ask.logs_per_event
            facts["no_hit"]["return_ci_low_years"] = shortest
            write_years(folder / "return_period.tif", years, grid)
            often = legend.period_labels(periods)
            about, rows = "Class of the return period of any passage", legend.class_rows(often, legend.COLD[::-1])
            needed = [logs_needed(areas, ask.logs_per_event, each) for each in periods]
            every = n_logs, [*needed, None]
            maps.write("return_class", period_class(years[0], periods), rows, about, (periods, "years"), logs=every)
            warn_of_small_sample(facts, areas, ask.logs_per_event, periods, feedback)
            if source.stored_log_ids.size:
                energetic = periods_of_energies(source, areas, ask.logs_per_event, grid, strong, feedback)
                by_scenario = intensities(years[0], energetic, periods)
                stored = source.stored_log_ids.size
                for scenario, classes, each in zip(periods, by_scenario, needed, strict=True):
                    about = f"Class of the energy that comes at least once in {scenario:g} years"
                    known = stored, [each] * len(warm)
                    maps.write(f"intensity_{scenario:g}_years", classes, warm, about, (strong, "kJ"), logs=known)
                rows = legend.matrix_rows(names, [f"once in {each:g} years" for each in periods], rarest_first=False)
                matrix = joint(by_scenario), rows, (stored, [max(needed)] * len(rows))  # of all scenarios
            else:
                matrix = None
                feedback.warn(
                    f"{source.path}: no trajectory is stored, so there are no intensities of scenarios and no matrix; "
                    "run slide-logs with --trajectories all",
                    code="no-trajectories",
                )
        if matrix:
            values, rows, known = matrix
            maps.write("matrix", values, rows, "Class of both", logs=known)
        facts["classes"] = maps.classes
        found = passages_of_lines(source, ask.lines, feedback)
        rows = line_rows(source, found, areas, ask.logs_per_event, strong, periods, of_run=ask.lines is None)
        if rows:
            write_csv(folder / LINES, pandas.DataFrame(rows))
        facts["lines"] = rows
        facts["n_left_dem"] = lost_of_run(source, rows, feedback)
        write_json(folder / FACTS, facts)
        outputs = {each.stem: final / each.name for each in sorted(folder.iterdir()) if each.suffix != ".qml"}
    return Outcome({"output": final} | outputs, facts, (*lines_of(facts, rows), *lines_of_run(source)))


TOOL = Tool(
    "map-intensity",
    "Evaluate",
    "Map classes of energy and probability, return periods, and the matrix",
    Ask,
    run,
    then="deadwood-tool make-report {run} --results {output} --output report.html",
)
