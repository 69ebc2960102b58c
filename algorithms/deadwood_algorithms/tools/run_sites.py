"""Slide the logs of many sites, one run each, and summarise the results side by side.

The sites come from one of:

- `--sites TABLE`: one row for each site. The column `site` names it; the others are options of slide-logs by their
  names (`dem`, `releases`, `friction`, `time-limit-s` or `time_limit_s`, ...). An empty cell or a missing column takes
  the option given to run-sites, or the default of slide-logs. Relative paths are relative to the table;
- `--configs FOLDER`: a JSON file for each site (`NAME.json`, or `NAME/manifest.json`), as slide-logs --config reads it;
- `--by FIELD`: one layer of releases on one terrain model; each value of the field is a site. Of a large terrain model
  only the window that the logs of a site can reach is read, so releases may be scattered over a whole region.

The folder holds `sites/SITE`, the complete run of slide-logs for each site; `overview.csv`, one row for each site and
line; `overview.gpkg`, the same at the releases; `overview.png`; `summary.json`; and `merged/DEM`, the rasters of all
sites on one terrain model, as those of one run over all their logs. Sites that slide the same logs are scenarios and
are not added up (use compare-scenarios). `--report` adds a page of the first 12 sites.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 60 --output releases.gpkg
    deadwood-tool run-sites --dem sample_data/dem.tif --releases releases.gpkg --by release_id --friction 0.25 \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output region

If a site fails, one line gives the reason, and the others are finished; the exit status is then 2. `--resume`
continues an interrupted run, also in the middle of a site, and a run with failures once their causes are fixed: what
is finished and unchanged is not slid again. Each site is the run that slide-logs would make of it, bit for bit. With
--scheduler all sites share its workers, which are started once.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import command_line
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.final_place import moving_to
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, ProgressOnly, Stage, Tool
from deadwood_algorithms.tools import make_report, slide_logs

if TYPE_CHECKING:
    from deadwood_algorithms.evaluate.sites.overview import SiteFound
    from deadwood_algorithms.evaluate.sites.progress import SitesFolder
    from deadwood_algorithms.evaluate.sites.sites_table import SiteOptions

OVERVIEW, LAYER, PICTURE, REPORT = "overview.csv", "overview.gpkg", "overview.png", "report.html"
ON_PAGE = 12  # sites that the report shows
# Options of slide-logs that mean another thing here:
APART = ("output", "overwrite", "resume", "restart", "report", "plan", "plan_logs", "plan_workers")


@dataclass(frozen=True, kw_only=True)
class Ask(slide_logs.Ask):
    sites: str | None = tool.table("Table with one row for each site", default=None)
    configs: str | None = tool.folder("Folder with a JSON file of parameters for each site", default=None)
    by: str | None = tool.field_of(
        "releases", "Field of the releases that distinguishes the sites", default=None, parent_elsewhere=True
    )
    # Required for each site as usual; here they are the values for sites that have none.
    dem: str | None = tool.terrain(  # type: ignore[assignment]
        "Terrain model, where the sites name none", default=None
    )
    releases: str | None = tool.vector(  # type: ignore[assignment]
        "Released logs, where the sites name none", "point", default=None
    )
    friction: str | float | None = tool.number_or_layer(  # type: ignore[assignment]
        "Friction coefficient, where the sites name none",
        minimum=0.0,
        default=None,
        help="A number, a raster, or polygons with a field 'friction' or 'mu'.",
    )
    merge: bool = tool.ask("flag", "Merge the rasters of sites on one terrain model", default=True)
    report: bool = tool.flag("Add one page of the first 12 sites", help="report.html (make-report).")
    output: str = tool.output_folder("Folder of all runs")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.sites.sites_table import refuse_unclear
    from deadwood_algorithms.simulate.sliding import workers_for

    refuse_unclear(ask.sites, ask.configs, ask.by, ask.dem, ask.releases)
    with workers_for(ask.where(TOOL.name), feedback):
        return plan_of_sites(ask, feedback) if ask.plan else all_sites(ask, feedback)


def all_sites(ask: Ask, feedback: Feedback) -> Outcome:
    """The runs themselves."""
    from deadwood_algorithms.evaluate.sites.merging import write_merged
    from deadwood_algorithms.evaluate.sites.overview_files import (
        lines_of_outcome,
        refuse_failed,
        summary_of_sites,
        write_overview,
    )
    from deadwood_algorithms.evaluate.sites.progress import SitesFolder
    from deadwood_algorithms.evaluate.sites.site_runs import site_stage
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import write_json
    from deadwood_algorithms.simulate.checkpoints import part_path
    from deadwood_algorithms.simulate.crew import NobodySlides
    from deadwood_algorithms.simulate.warm_up import load_kernels

    final = Path(ask.output)
    with (
        result_folder(TOOL, ask, feedback, replaces=ask.resume and SitesFolder.is_of(ask.output)) as folder,
        moving_to(part_path(ask.output), final),
    ):
        work = SitesFolder(ask.output, resume=ask.resume, feedback=feedback)
        found: list[SiteFound] = []
        try:
            with work.removed_if_refused():
                sites = read_sites(ask, work.releases, feedback)
            load_kernels(None, feedback)
            for number, site in enumerate(sites, start=1):
                found.append(slide_site(ask, site, work, site_stage(feedback, site.name, number, len(sites))))
        except (Cancelled, KeyboardInterrupt, NobodySlides) as error:
            kept = counted(len(found), "finished site is", "finished sites are")
            feedback.note(f"{kept} kept in {work.path}; --resume continues from there")
            if isinstance(error, NobodySlides):  # no further site could be slid
                raise
            raise Cancelled from error
        work.bring_to(folder, [each.name for each in found if not each.failed])
        facts = summary_of_sites(found)
        facts["merged"] = write_merged(folder, found, ask.danger_least, feedback) if ask.merge else []
        write_overview(folder, found, [folder / "merged" / each["folder"] for each in facts["merged"]])
        if ask.report:
            add_page(ask, folder, found, feedback)
        write_json(folder / "summary.json", facts)
    refuse_failed(found, ask.output)
    work.remove()
    parts = {"overview": OVERVIEW, "layer": LAYER, "picture": PICTURE, "summary": "summary.json"}
    there = {key: name for key, name in parts.items() if (final / name).is_file()}
    first = final / "sites" / next(each.name for each in found if not each.failed)
    then = command_line("make-report", {"runs": first, "output": "report.html"})
    return Outcome.of_folder(ask.output, there, facts, lines_of_outcome(found, facts), then)


def read_sites(ask: Ask, releases: Path, feedback: Feedback) -> list[SiteOptions]:
    """The sites; layers of grouped releases are written into the folder ``releases``."""
    from deadwood_algorithms.evaluate.sites.groups import sites_of_groups
    from deadwood_algorithms.evaluate.sites.sites_table import sites_of_folder, sites_of_table

    if ask.sites is not None:
        return sites_of_table(ask.sites, slide_logs.TOOL, feedback)
    if ask.configs is not None:
        return sites_of_folder(ask.configs, slide_logs.TOOL, feedback)
    return sites_of_groups(str(ask.dem), str(ask.releases), str(ask.by), ask.crs, releases, feedback)


def values_of(ask: Ask, site: SiteOptions) -> dict[str, Any]:
    """The parameters of slide-logs for a site: its own values, then those for all sites, then defaults."""
    names = {each.name for each in fields(slide_logs.Ask)} - set(APART)
    common = {name: value for name in names if (value := getattr(ask, name)) is not None}
    asked = {name: value for name, value in site.values.items() if name not in APART or name == "report"}
    return common | {"danger_counts": ask.merge} | asked


def slide_site(ask: Ask, site: SiteOptions, work: SitesFolder, feedback: Stage) -> SiteFound:
    """The site's run, or its failure; an unchanged complete run is not slid again."""
    from deadwood_algorithms.evaluate.sites.site_runs import found_of_site

    values, place = values_of(ask, site), work.sites / site.name

    def slide() -> None:
        if not work.begin(site.name, slide_logs.TOOL, values, feedback.feedback):
            slide_logs.TOOL(feedback=feedback, **values, output=str(place), resume=True)

    return found_of_site(site, values, place, slide, feedback)


def plan_of_sites(ask: Ask, feedback: Feedback) -> Outcome:
    """The forecast for all sites, from pilots of some of them."""
    from deadwood_algorithms.evaluate.sites.sites_plan import plan_sites
    from deadwood_algorithms.results.forecast import facts_of_forecast, words_of_forecast

    def pilot(site: SiteOptions, logs: int, said: Stage) -> dict[str, Any]:
        given = values_of(ask, site) | {"plan": True, "plan_logs": logs, "plan_workers": ask.plan_workers}
        return dict(slide_logs.TOOL(feedback=said, **given, output=ask.output).facts)

    with tempfile.TemporaryDirectory(prefix="deadwood-plan-") as folder:
        sites = read_sites(ask, Path(folder) / "releases", feedback)
        releases = [values_of(ask, site).get("releases") for site in sites]
        found, looked_at = plan_sites(sites, releases, pilot, ask.plan_logs, ask.output, feedback)
    head = f"{'sites:':<14} {len(sites)}, of which {looked_at} were looked at"
    facts = {"sites": len(sites), **facts_of_forecast(found, ask.output)}
    return Outcome({}, facts, (head, *words_of_forecast(found, ask.output)))


def add_page(ask: Ask, folder: Path, found: list[SiteFound], feedback: Feedback) -> None:
    """One page of the first sites; if it cannot be made, the runs are kept."""
    runs = [str(folder / "sites" / each.name) for each in found if not each.failed][:ON_PAGE]
    if runs:
        page = make_report.Ask(runs=",".join(runs), title=Path(ask.output).name, output=str(folder / REPORT))
        make_report.run(page, ProgressOnly(feedback))  # the sites have said their warnings


TOOL = Tool(
    "run-sites",
    "Simulate",
    "Run many sites, or scattered releases, with one overview",
    Ask,
    run,
)
