"""Repeat sections 5, 6 and the appendices of the paper on two synthetic twins, and assess its findings one by one.

The folder holds `findings.json` (statement, section, the paper's value, ours with its interval, whether it holds, why,
and the verdict: holds, does not hold, not decided, cannot be judged here), the same as `findings.csv` and
`findings.md`, `report.html` with the figures beside the paper's (3, 4, A1, B1), and every run. A finding is assessed
(an order, a direction, the size of a ratio), not the value on another slope. The twins and the rules were fixed before
the first run;
`--twin-version 1` uses the twins of the versions before November 2026. Findings that fewer than 20 000 logs leave
undecided are repeated with 20 000.

Each finding has a sensitivity panel (`sensitivity.csv`): the same finding as it is, with the log as the paper's point
cloud (`make-log`; also as findings of their own, whose ids end in `.cloud`), and, on the twins of version 2, with one
assumed number of the twin changed (width of treeless strips, roughness, places of release, rolling friction, another
draw of relief and forest, and others). The panel slides a tenth of the logs at `draft`. Its runs are not
kept; `--no-panel` leaves it out.

`--quick` takes a few hundred logs and a coarser set: it shows that everything works and assesses nothing. `--resume`
continues an interrupted run; what is finished is not slid again.

With `--site-data FOLDER` the data of the real sites replace the twins. FOLDER has a folder `klosters`, `rothenbrunnen`
or both, each with

- `dem.tif`, or a folder `dem` of tiles (swissALTI3D 0.5 m, as GeoTIFF);
- `trees.gpkg` (`dbh_cm`, `height_m`), or `trees.csv`, any table that `import-trees` reads;
- `releases.gpkg`: the mapped places as points with `release_id` (10 m around each), or polygons;
- `lines.gpkg`: lines with `line_id`: `road`; Klosters also `beyond`, 20 m below the road, Rothenbrunnen `terrace`,
  across the place of the take-off;
- `barriers.gpkg` (`barrier_id`, `height_m`; the one that was jumped is `south`), `forest.gpkg` (the stand's outline);
- if there are any, `dams.gpkg` (as for `add-structures`) and `flight.gpkg` (as for `fit-flight`);
- `site.json`, if a number differs from the paper's: `friction`, `dbh_cm`, `length_m`, `density_kg_m3`,
  `release_radius_m`, and, of Rothenbrunnen, `rock_friction`, `rock_slip` (friction after much slip, kappa in
  1/m, beta in 1/s, as `slide-logs` has them), `rock_density_kg_m3`.

    deadwood-tool reproduce-paper --quick --output paper
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.final_place import moving_to
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Tool
from deadwood_algorithms.tools import (
    add_structures,
    calibrate_friction,
    compare_scenarios,
    fit_flight,
    generate_forest,
    import_trees,
    lateral_spread,
    make_log,
    reach_lines,
    sample_releases,
    slide_logs,
)

if TYPE_CHECKING:
    from deadwood_algorithms.paper.finding import Finding
    from deadwood_algorithms.paper.site import Site
    from deadwood_algorithms.paper.site_runs import Wanted

SITES = ("klosters", "rothenbrunnen")
QUICK_LOGS = 300
DECIDE = ("site", "fidelity", "logs", "quick", "site_data", "twin_version", "seed")  # what decides the results
CALLED = (
    add_structures,
    calibrate_friction,
    compare_scenarios,
    fit_flight,
    generate_forest,
    import_trees,
    lateral_spread,
    make_log,
    reach_lines,
    sample_releases,
    slide_logs,
)


@dataclass(frozen=True, kw_only=True)
class Ask:
    site: str = tool.choice("Which site", *SITES, "both", default="both")
    logs: int = tool.integer(
        "Logs of each scenario, over all releases",
        default=20_000,
        minimum=8,
        maximum=10_000_000,
        help="The sweeps of friction and cells use a fifth of them, each run of the sensitivity panel a tenth.",
    )
    deciding_logs: int = tool.integer(
        "Logs of each scenario for findings that fewer leave undecided",
        default=20_000,
        minimum=0,
        maximum=10_000_000,
        advanced=True,
        help="The paper's number. 0 leaves them open.",
    )
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="standard")
    quick: bool = tool.flag("At most 300 logs and a coarser set, in a minute or two; not assessed")
    site_data: str | None = tool.folder("Data of the real sites, instead of the twins", default=None)
    twin_version: str = tool.choice("Which twins", "1", "2", default="2", help="1: those until November 2026.")
    no_panel: bool = tool.flag("Leave out the sensitivity panel")
    seed: int = tool.seed()
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    resume: bool = tool.flag("Continue an interrupted run")
    restart: bool = tool.flag("Give up an interrupted run and start again")
    output: str = tool.output_folder("Folder of the findings")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.paper.evidence import evidence_of
    from deadwood_algorithms.paper.finding import with_panel
    from deadwood_algorithms.paper.findings import findings_of
    from deadwood_algorithms.paper.report import write_report
    from deadwood_algorithms.paper.sensitivity import decided_findings, findings_by_change, findings_with_cloud
    from deadwood_algorithms.paper.site import read_site, write_twin
    from deadwood_algorithms.paper.site_figures import figures_of
    from deadwood_algorithms.paper.site_runs import SiteRuns
    from deadwood_algorithms.paper.unfinished import open_work
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import link_or_copy
    from deadwood_algorithms.simulate.checkpoints import working_folder
    from deadwood_algorithms.simulate.warm_up import load_kernels

    final, wanted, tools = Path(ask.output), wanted_of(ask), {each.TOOL.name: each.TOOL for each in CALLED}
    names = SITES if ask.site == "both" else (ask.site,)
    with result_folder(TOOL, ask, feedback) as folder, moving_to(working_folder(ask.output), final):
        begun_with = {name: getattr(ask, name) for name in DECIDE}
        work = open_work(working_folder(ask.output), begun_with, resume=ask.resume)
        found: dict[str, list[Finding]] = {}
        sites: dict[str, Site] = {}
        figures: list[tuple[str, Path]] = []
        try:
            for name in names:
                place = work / name
                source = Path(ask.site_data) / name if ask.site_data else place / "data"
                if not ask.site_data:  # also of a run that is resumed: nobody knows what happened to it meanwhile
                    shutil.rmtree(source, ignore_errors=True)
                    write_twin(name, source, int(ask.twin_version))
                site = read_site(name, source, place / "prepared")
                if name == names[0]:  # reported here, because the notes of the steps are dropped (``Stage``)
                    load_kernels(None, feedback)
                runs = SiteRuns(site, place, wanted, tools, feedback)
                evidence = evidence_of(runs)
                sites[name], found[name] = site, findings_of(evidence, quick=ask.quick)
                figures += figures_of(runs, evidence)
            judged = not ask.quick
            for name, site in sites.items():
                place, cloud, panel = work / name, [], []
                if judged and not ask.no_panel:
                    cloud = findings_with_cloud(site, place, wanted, tools, feedback)
                if not (ask.site_data or ask.no_panel or ask.twin_version != "2"):
                    panel = findings_by_change(name, place, wanted, tools, feedback)
                if cloud:
                    panel.insert(1, ("the log as the paper's point cloud", cloud))
                if judged:
                    found[name] = decided_findings(site, place, found[name], ask.deciding_logs, wanted, tools, feedback)
                found[name] = [with_panel(each, panel) for each in found[name]]
                found[name] += [replace(each, id=f"{each.id}.cloud") for each in cloud]
        except (Cancelled, KeyboardInterrupt) as error:
            feedback.note(f"what is finished is kept in {work}; --resume continues from there")
            raise Cancelled from error
        hidden = shutil.ignore_patterns(".*")
        shutil.copytree(work, folder, dirs_exist_ok=True, ignore=hidden, copy_function=link_or_copy)
        head = words(ask, wanted)
        every = [each for name in names for each in found[name]]
        write_report(folder, every, head, [(title, folder / path.relative_to(work)) for title, path in figures])
    shutil.rmtree(work)
    lines = [f"{each.verdict:21} {each.id}" for each in every]
    outputs = {"output": final, "findings": final / "findings.json", "report": final / "report.html"}
    return Outcome(
        outputs,
        {"findings": len(every), "hold": sum(each.holds is True for each in every)},
        (*lines, f"scenario: {head}"),
    )


def wanted_of(ask: Ask) -> Wanted:
    from deadwood_algorithms.paper.site_runs import Wanted

    return Wanted(
        logs=min(ask.logs, QUICK_LOGS) if ask.quick else ask.logs,
        fidelity="draft" if ask.quick else ask.fidelity,
        seed=ask.seed,
        threads=ask.threads,
        quick=ask.quick,
        twin=ask.site_data is None,
        draws=1 if ask.quick else 3,
    )


def words(ask: Ask, wanted: Wanted) -> str:
    """The scenario and the inputs of the findings."""
    twins = f"two synthetic twins (version {ask.twin_version}), not the paper's slopes"
    where = f"the data in {ask.site_data}" if ask.site_data else twins
    text = f"{counted(wanted.logs, 'log')} a scenario, {wanted.fidelity}, seed {ask.seed}, on {where}; "
    text += f"deadwood-tool {tool.VERSION}."
    return text + (" A --quick run: nothing is assessed." if ask.quick else " Intervals are 95 %, over logs.")


TOOL = Tool(
    "reproduce-paper",
    "Evaluate",
    "Test the paper's findings on two synthetic twins or the real sites",
    Ask,
    run,
    then="deadwood-tool check {output}",
)
