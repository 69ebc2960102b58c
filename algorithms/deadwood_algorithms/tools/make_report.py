"""Make one HTML page of a run, or of several side by side: maps, figures, tables and a 3-D view, for screen and print.

The page is self-contained: it needs no network, no server and no other file. Any browser opens it from the file system,
it prints on A4, and it can be sent as an annex. It states the question and the answer, what was modelled and what was
not, and shows the map with layers to switch, the reach of each line with both kinds of error, arrivals, lateral spread,
run-out, speeds and jumps, profiles along trajectories, the balances of barriers and trees, the measured accuracy, and
the provenance. The 3-D view replays logs: the fastest, the farthest, those that reach a line, and a random sample.

All that is not signed is in an annex, which the reader opens, and which is printed while it is open.

    deadwood-tool make-report my_case --output my_case.html
    deadwood-tool make-report my_case --results trees_value.gpkg,siting,intensity,origins,varied --output my_case.html
    deadwood-tool make-report run_none run_forest --output forest.html --language de --figures figures --gltf slope.glb

With --results the page also has the results of other tools: the effect of each tree, the best places for a barrier,
classes of intensity and return periods, the places from which lines are reached, and the most influential inputs.

For several runs of the same releases the page also has the paired differences of `compare-scenarios`, with maps. If an
input of a run (the terrain model, the trees) is no longer at its path, the page omits it and says so. Its figures
are rounded for reading: numbers for further work are in the run's own files.
"""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import pairwise
from os.path import isdir
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.report.languages import LANGUAGES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from deadwood_algorithms.report.compared import Comparison
    from deadwood_algorithms.report.sources import ReportedRun


@dataclass(frozen=True, kw_only=True)
class Ask:
    runs: str = tool.folders(
        "Folders of the runs",
        positional=True,
        help="Each a folder of slide-logs, separated by commas. On the command line they may also be given "
        "without the option.",
    )
    names: str | None = tool.text(
        "Names of the runs, separated by commas", default=None, help="Default: the names of the folders."
    )
    results: str | None = tool.results(
        "Results of other tools to be shown",
        default=None,
        help="Separated by commas: a layer of value-trees, folders of site-barriers, map-intensity, map-origins or "
        "vary; each with its run.",
    )
    baseline: str | None = tool.baseline()
    title: str | None = tool.text("Title of the page", default=None, help="Default: the names of the runs.")
    author: str | None = tool.text("Author responsible for the page", default=None, help="Shown in its scenario box.")
    project: str | None = tool.text("Project or order", default=None, help="Shown in its scenario box.")
    language: str = tool.choice("Language of the page", *LANGUAGES, default="en")
    annex: bool = tool.flag("The annex is open, and so is printed", help="Without it the reader opens it.")
    figures: str | None = tool.output_folder(
        "Folder for every figure as PNG, SVG and PDF", default=None, help="For other documents."
    )
    gltf: str | None = tool.output_file(
        "The first run's scene as binary glTF (.glb), for other viewers",
        ".glb",
        default=None,
        help="Terrain, trees, barriers, lying logs and boulders in true size, and the moving logs as an animation.",
    )
    output: str = tool.output_file("HTML page to write", ".html")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.scenarios.paired_runs import baseline_first
    from deadwood_algorithms.report.answers import read_answers
    from deadwood_algorithms.report.gltf import write_gltf
    from deadwood_algorithms.report.page import report_of
    from deadwood_algorithms.report.plan import span_of_reliefs
    from deadwood_algorithms.report.sources import read_reported_run
    from deadwood_algorithms.report.space import drapes, space_of
    from deadwood_algorithms.report.words import Words
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.schemas.looks import RUNS

    with ExitStack() as stack:
        made = stack.enter_context(writing(TOOL, ask, feedback))
        path, figures = made.file("output", ".html"), made.optional_folder("figures")
        gltf = made.optional_file("gltf", ".glb")
        folders = folders_of(ask.runs)
        names = names_of(folders, ask.names)
        sources = [read_reported_run(each, name, feedback) for each, name in zip(folders, names, strict=True)]
        if len(sources) > 1:
            order = baseline_first([each.summary for each in sources], names, ask.baseline, feedback)
            folders, sources = [folders[k] for k in order], [sources[k] for k in order]
        span = span_of_reliefs(sources)
        for k, source in enumerate(sources):
            source.colour, source.relief_span = RUNS[k % len(RUNS)], span
        if ask.results:
            read_answers(ask.results, sources)
        compared = compared_runs(folders, sources, feedback) if len(sources) > 1 else None
        feedback.progress(1, 3, "drawing the report")
        spaces = [space_of(each, len(sources)) for each in sources]
        if gltf and spaces[0] is None:
            raise UserError(f"{folders[0]}: its terrain model no longer exists, without which --gltf has no scene")
        report = report_of(
            sources, spaces, compared, Words(ask.language), ask.title, ask.author, ask.project, annex_open=ask.annex
        )
        path.write_text(report.page, encoding="utf-8")
        feedback.progress(2, 3, "drawing the report")
        for each in report.drawings if figures else ():
            assert figures is not None
            each.write(figures)
        if gltf and spaces[0] is not None:
            write_gltf(gltf, spaces[0], drapes(sources[0])["hits" if "hits" in sources[0].rasters else "relief"])
        feedback.progress(3, 3, "drawing the report")
    for source in sources:
        for phrase, filled in source.lacks:
            feedback.note(f"{source.name}: {Words('en').say(phrase, **filled)}", code="lacks")
    outputs = {"output": ask.output, "figures": ask.figures, "gltf": ask.gltf}
    facts = {"runs": [each.name for each in sources], "bytes": Path(ask.output).stat().st_size}
    made = f"a page of {facts['bytes'] / 1e6:.1f} MB, of {', '.join(facts['runs'])}"
    scenarios = [line for each in sources for line in lines_of_run(each.run, each.name if len(sources) > 1 else "")]
    return Outcome({name: Path(place) for name, place in outputs.items() if place}, facts, (made, *scenarios))


def folders_of(runs: str) -> list[str]:
    """The folders of the runs; parts between commas that are no folder by themselves belong to the next."""
    folders, name = [], ""
    for part in runs.split(","):
        name = f"{name},{part}" if name else part
        if isdir(name.strip()):  # False also of names that no file can have
            folders.append(name.strip())
            name = ""
    folders += [name.strip()] if name.strip() else []
    if not folders:
        raise UserError("--runs names no folder; give that of a run of slide-logs")
    return folders


def names_of(folders: Sequence[str], given: str | None) -> list[str]:
    """Names of the runs: those of their folders, with the parent folder if two are equal."""
    if given is not None:
        called = [each.strip() for each in given.split(",")]
        if len(called) != len(folders) or len(set(called)) < len(called) or not all(called):
            raise UserError(f"--names is '{given}', but must hold a different name for each of the {len(folders)} runs")
        return called
    names = [Path(each).resolve().name for each in folders]
    if len(set(names)) < len(names):
        names = ["_".join(Path(each).resolve().parts[-2:]) for each in folders]
    if len(set(names)) < len(names):
        raise UserError("--runs names a folder twice; give each run once")
    return names


def compared_runs(folders: Sequence[str], sources: Sequence[ReportedRun], feedback: Feedback) -> Comparison:
    """The comparison of the runs; what cannot be compared is reported in the page."""
    from deadwood_algorithms.evaluate.scenarios.maps import difference_map
    from deadwood_algorithms.evaluate.scenarios.measures import Share, compared_rows, share_row
    from deadwood_algorithms.evaluate.scenarios.paired_runs import differing, read_compared
    from deadwood_algorithms.report.compared import Comparison
    from deadwood_algorithms.report.sources import read_over_runs

    found = Comparison()
    numbered = [f"run{k}" for k in range(len(sources))]  # of names, the comparison makes files
    try:
        compared = read_compared(",".join(folders), ",".join(numbered), None, feedback, ordered=True)
    except UserError as error:
        found.lacks.append(("comparison_lacks", {"reason": str(error)}))
        return found
    names = dict(zip(numbered, (each.name for each in sources), strict=True))
    found.rows = [replace(row, scenario=names[row.scenario]) for row in compared_rows(compared, None, 0, feedback)]
    for before, run in pairwise(compared.others):
        for column, line_id in enumerate(compared.line_ids):
            shares = (Share.of(each.reach[:, column], each.left_dem) for each in (run, before))
            found.steps.append((names[before.name], share_row(names[run.name], "reach", str(line_id), *shares)))
    found.differing = {
        parameter: {names[each]: value for each, value in values.items()}
        for parameter, values in differing(compared).items()
    }
    with tempfile.TemporaryDirectory() as folder:
        for k, other in enumerate(compared.others):
            place = Path(folder) / f"difference_{k}.tif"
            try:
                difference_map(compared.reference, other, place, feedback)
                found.maps[sources[k + 1].name] = read_over_runs(place, sources)
            except (UserError, ValueError) as error:
                found.lacks.append(("comparison_map_lacks", {"name": names[other.name], "reason": str(error)}))
    return found


TOOL = Tool(
    "make-report",
    "Evaluate",
    "Write a report: one page with maps, figures, tables and a 3-D view",
    Ask,
    run,
    then="deadwood-tool check {output}",
)
