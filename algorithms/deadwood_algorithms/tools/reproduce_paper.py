"""Repeat sections 5, 6 and the appendices of the paper on two synthetic twins, and assess its findings one by one.

The folder holds `findings.json` (statement, section, the paper's value, ours with its interval, whether it holds, why,
and the verdict: holds, does not hold, not decided, cannot be judged here), the same as `findings.csv` and
`findings.md`, `report.html` with the figures beside the paper's (3, 4, A1, B1), and every run. A finding is assessed
(an order, a direction, the size of a ratio), not the value on another slope. The twins and the rules were fixed before
the first run; the numbers of the twins, each with its source, are in `deadwood_algorithms/paper/README.md`;
`--twin-version 1` uses the twins of before November 2026. Findings that fewer than 20 000 logs leave undecided are
repeated with 20 000.

Each finding has a sensitivity panel (`sensitivity.csv`): the same finding as it is, with the log as the paper's point
cloud (`make-log`; also as findings of their own, whose ids end in `.cloud`), and, on the twins of version 2, with one
assumed number of the twin changed (width of treeless strips, roughness, places of release, rolling friction, another
draw of relief and forest, and others). The panel slides a tenth of the logs at `draft`, whose cost and error are in
`benchmarks/README.md`. Its runs are not kept; `--no-panel` leaves it out.

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
  `release_radius_m`, and, of Rothenbrunnen, `rock_friction`, `rock_density_kg_m3`.

    deadwood-tool reproduce-paper --quick --output paper
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Stage, Tool, UserError
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
    from deadwood_algorithms.files.grid import Grid
    from deadwood_algorithms.paper.findings import Evidence, Finding
    from deadwood_algorithms.paper.site import Site

SITES = ("klosters", "rothenbrunnen")
FRICTIONS = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
ROCKS = {"platy": (1.6, 1.25, 0.5), "cubic": (1.0, 1.0, 1.0)}  # sides of 1 m3 [m]
QUICK_LOGS = 300
DECIDED_BY = {  # by finding, the scenarios that it needs beside the mapped forest
    "none_far_above_mapped": ("none",),
    "mapped_above_random": ("random",),
    "mapped_about_random": ("random",),
    "protection_holds": ("barriers",),
    "one_in_a_hundred_jumps": ("barriers",),
    "barrier_stops_most": ("barriers",),
    "high_friction_does_not_reach": ("friction",),
    "trees_hold_near_release": (),
    "some_jump_metres": (),
}
HIGH_FRICTION = 0.35  # the least of the sweep beyond the paper's range
ANY_SHAPE = ("point", "line", "polygon")


@dataclass(frozen=True, kw_only=True)
class Ask:
    site: str = tool.choice("Which site", *SITES, "both", default="both")
    logs: int = tool.integer(
        "Logs of each scenario, over all releases", default=20_000, minimum=8, maximum=10_000_000,
        help="The sweeps of friction and cells use a fifth of them, each run of the sensitivity panel a tenth.",
    )  # fmt: skip
    deciding_logs: int = tool.integer(
        "Logs of each scenario for findings that fewer leave undecided", default=20_000, minimum=0,
        maximum=10_000_000, advanced=True, help="The paper's number. 0 leaves them open.",
    )  # fmt: skip
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="standard")
    quick: bool = tool.flag("At most 300 logs and a coarser set, in a minute or two; not assessed")
    site_data: str | None = tool.folder("Data of the real sites, instead of the twins", default=None)
    twin_version: str = tool.choice("Which twins", "1", "2", default="2", help="1: those until November 2026.")
    no_panel: bool = tool.flag("Leave out the sensitivity panel")
    seed: int = tool.seed()
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    resume: bool = tool.flag("Continue an interrupted run")
    output: str = tool.output_folder("Folder of the findings", parts=("findings.json", "report.html"))
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.paper.findings import findings_of, with_panel
    from deadwood_algorithms.paper.report import write_report
    from deadwood_algorithms.paper.site import read_site, write_twin
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import link_or_copy
    from deadwood_algorithms.simulate.warm_up import load_kernels

    final = Path(ask.output)
    names = SITES if ask.site == "both" else (ask.site,)
    with result_folder(TOOL, ask, feedback) as folder, tool.moving_to(place_of_work(ask), final):
        work = work_folder(ask, feedback)
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
                if name == names[0]:  # said here: what the steps note is not (``Stage``)
                    load_kernels(None, feedback)
                slide = Steps(ask, site, place, feedback)
                sites[name], found[name] = site, findings_of(slide.evidence(), quick=ask.quick)
                figures += slide.figures()
            for name, site in sites.items():
                place = work / name
                cloud, panel = clouds(ask, site, place, feedback), varied(ask, name, place, feedback)
                if cloud:
                    panel.insert(1, ("the log as the paper's point cloud", cloud))
                found[name] = [with_panel(each, panel) for each in decided(ask, site, place, found[name], feedback)]
                found[name] += [replace(each, id=f"{each.id}.cloud") for each in cloud]
        except (Cancelled, KeyboardInterrupt) as error:
            feedback.note(f"what is finished is kept in {work}; --resume continues from there")
            raise Cancelled from error
        hidden = shutil.ignore_patterns(".*")
        shutil.copytree(work, folder, dirs_exist_ok=True, ignore=hidden, copy_function=link_or_copy)
        head = words(ask)
        every = [each for name in names for each in found[name]]
        write_report(folder, every, head, [(title, folder / path.relative_to(work)) for title, path in figures])
    shutil.rmtree(work)
    lines = [f"{each.verdict:21} {each.id}" for each in every]
    outputs = {"output": final, "findings": final / "findings.json", "report": final / "report.html"}
    return Outcome(outputs, {"findings": len(every), "hold": sum(each.holds is True for each in every)}, (*lines, head))


def clouds(ask: Ask, site: Site, place: Path, feedback: Feedback) -> list[Finding]:
    """The findings of the panel's logs as the paper's point cloud, which takes ten times as long."""
    from deadwood_algorithms.paper.findings import findings_of

    if ask.quick or ask.no_panel:
        return []
    needed = {"none", "random", "barriers", "friction"}
    steps = Steps(ask, site, place / ".cloud", feedback, logs=panel_logs(ask), needed=needed, fidelity="draft")
    return findings_of(steps.evidence_of_needed("cloud"))


def decided(ask: Ask, site: Site, place: Path, found: list[Finding], feedback: Feedback) -> list[Finding]:
    """The findings; those that so many logs leave open are judged again by more, in the scenarios that they need."""
    from deadwood_algorithms.paper.findings import findings_of

    open_ = {each.id for each in found if each.verdict == "not decided"}
    needed = {name for each in open_ for name in DECIDED_BY.get(each.partition(".")[2], ())}
    if ask.quick or logs_of(ask) >= ask.deciding_logs or not needed:
        return found
    steps = Steps(ask, site, place / ".more", feedback, logs=ask.deciding_logs, needed=needed)
    again = {each.id: each for each in findings_of(steps.evidence_of_needed()) if each.id in open_}
    told = f"{ask.deciding_logs} logs a scenario, for {logs_of(ask)} left it open: "
    return [replace(again[each.id], why=told + again[each.id].why) if each.id in again else each for each in found]


def panel_logs(ask: Ask) -> int:
    return max(8, logs_of(ask) // 10)


def varied(ask: Ask, name: str, place: Path, feedback: Feedback) -> list[tuple[str, list[Finding]]]:
    """The findings with each chosen number of the twin moved."""
    from deadwood_algorithms.paper.findings import findings_of
    from deadwood_algorithms.paper.site import read_site, write_twin
    from deadwood_algorithms.paper.variations import VARIATIONS

    if ask.site_data or ask.no_panel or ask.twin_version != "2":
        return []
    found = []
    for each in VARIATIONS[name][: 1 if ask.quick else None]:
        folder = place / ".panel" / each.name
        shutil.rmtree(folder / "data", ignore_errors=True)
        write_twin(name, folder / "data", each.version, **each.changes)
        site = read_site(name, folder / "data", folder / "prepared")
        needed = {"none", "random", "friction" if name == SITES[0] else "barriers"} | (
            {"rocks"} if each.rocks else set()
        )
        steps = Steps(
            ask, site, folder, feedback, logs=panel_logs(ask), needed=needed, options=each.options, draws=1,
            fidelity="draft",
        )  # fmt: skip
        found.append((each.words, findings_of(steps.evidence_of_needed(), quick=ask.quick)))
    return found


def words(ask: Ask) -> str:
    """What the findings come from."""
    twins = f"two synthetic twins (version {ask.twin_version}), not the paper's slopes"
    where = f"the data in {ask.site_data}" if ask.site_data else twins
    told = f"{logs_of(ask)} logs a scenario, {fidelity_of(ask)}, seed {ask.seed}, on {where}; "
    told += f"deadwood-tool {tool.VERSION}."
    return told + (" A --quick run: nothing is assessed." if ask.quick else " Intervals are 95 %, over logs.")


def rows_of(path: Path, layer: str) -> list[dict[str, Any]]:
    """The columns of a layer that a tool has just written; its shapes may be empty, such as a sector of one deposit."""
    import geopandas

    return geopandas.read_file(path, layer=layer, ignore_geometry=True).to_dict("records")


def logs_of(ask: Ask) -> int:
    return min(ask.logs, QUICK_LOGS) if ask.quick else ask.logs


def fidelity_of(ask: Ask) -> str:
    return "draft" if ask.quick else ask.fidelity


def place_of_work(ask: Ask) -> Path:
    from deadwood_algorithms.simulate.checkpoints import working_folder

    return working_folder(ask.output)


def work_folder(ask: Ask, feedback: Feedback) -> Path:
    """The hidden folder of finished scenarios; dropped unless it is resumed, refused if it was begun otherwise."""
    work = place_of_work(ask)
    names = ("site", "fidelity", "logs", "quick", "site_data", "twin_version", "seed")
    identity = {"version": tool.VERSION, "engine": tool.engine_digest()} | {name: getattr(ask, name) for name in names}
    note = work / ".identity.json"
    if work.is_dir() and ask.resume:
        before = _begun(note)
        changed = [name for name in identity if before.get(name) != identity[name]]
        if changed:
            raise UserError(
                f"--resume: the unfinished work in {work} was begun with other {', '.join(changed)}; give the same, "
                "or leave out --resume to start again"
            )
        return work
    if work.is_dir():
        feedback.note(f"{work}: the unfinished work of an earlier run is discarded (--resume continues it)")
        shutil.rmtree(work)
    work.mkdir(parents=True)
    note.write_text(json.dumps(identity), encoding="utf-8")
    return work


def _begun(note: Path) -> dict[str, Any]:
    """What a hidden note says; empty where there is none, or it is damaged."""
    try:
        told = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return told if isinstance(told, dict) else {}


class Steps:
    """The tools' calls for one site; what is there already is not made again."""

    def __init__(
        self, ask: Ask, site: Site, place: Path, feedback: Feedback, *, logs: int | None = None,
        needed: set[str] | None = None, options: Mapping[str, Any] | None = None, draws: int | None = None,
        fidelity: str | None = None,
    ) -> None:  # fmt: skip
        self.ask, self.site, self.place, self.feedback = ask, site, place, feedback
        self.fidelity = fidelity or fidelity_of(ask)
        self.logs, self.needed, self.options = logs or logs_of(ask), needed or set(), dict(options or {})
        self._known: set[Path] = set()  # what was made, or found to stand, by this process
        self.prepared, self.runs, self.results = (place / name for name in ("prepared", "runs", "results"))
        for folder in (self.prepared, self.runs, self.results):
            folder.mkdir(parents=True, exist_ok=True)
        self.klosters = site.name == SITES[0]
        self.draws = draws or (1 if ask.quick else 3)
        self.trees: dict[str, str | None] = {"none": None, "als": self.mapped_trees()}
        for draw in range(self.draws):
            self.trees["random" + (f"_{draw + 1}" if draw else "")] = self.random_trees(draw)
        self.terrains: dict[str, str] = {}
        self._evidence: Evidence | None = None

    @cached_property
    def ground(self) -> Grid:
        """The site's terrain model."""
        from deadwood_algorithms.files.dem_windows import read_dem

        return read_dem(self.site.dem)

    def step(self, path: Path, called: Tool, what: str, **values: Any) -> Path:
        """One call of a tool; what is there, whole and of the same inputs, parameters and engine is not made again."""
        from deadwood_algorithms.results.checked import stands
        from deadwood_algorithms.results.identity import Making, sealed

        if path in self._known:
            return path
        note = path.with_name(f".{path.name}.json")
        if path.exists() and not stands(called, values, path, _begun(note)):
            self.feedback.note(f"{path}: damaged, or of other inputs; it is made again")
            for each in (
                path,
                *(Path(values[p.name]) for p in called.parameters() if p.is_output and p.name in values),
            ):
                shutil.rmtree(each) if each.is_dir() else each.unlink(missing_ok=True)
        if not path.exists():
            given = values | ({"resume": True} if "resume" in {each.name for each in called.parameters()} else {})
            called(feedback=Stage(self.feedback, f"{self.site.name}, {what}", warns=False), output=str(path), **given)
            if path.is_file():
                made = Making(called, called.ask_from({**values, "output": str(path)}))
                note.write_text(json.dumps({"run_id": made.run_id, **sealed(path)}), encoding="utf-8")
        self._known.add(path)
        return path

    def mapped_trees(self) -> str:
        if self.site.trees.endswith(".gpkg"):
            return self.site.trees
        path = self.prepared / "trees.gpkg"
        return str(self.step(path, import_trees.TOOL, "trees", trees=self.site.trees, dem=self.site.dem))

    def random_trees(self, draw: int) -> str:
        return str(
            self.step(
                self.prepared / f"trees_random_{draw + 1}.gpkg", generate_forest.TOOL, "random forest",
                dem=self.site.dem, like=self.mapped_trees(), stand=self.site.layers["forest"],
                seed=self.ask.seed + draw,
            )
        )  # fmt: skip

    def releases(self, kind: str = "logs") -> str:
        facts, areas = self.site.facts, self.site.layers["releases"]
        from deadwood_algorithms.files.vectors import read_vector

        count = -(-self.logs // len(read_vector(str(areas), geometry=ANY_SHAPE, target_crs=None, what="releases")))
        rock = {"density_kg_m3": facts.get("rock_density_kg_m3", 2700.0), "orientation": "random"}
        log = {"density_kg_m3": facts["density_kg_m3"]}
        return str(
            self.step(
                self.prepared / f"releases_{kind}.gpkg", sample_releases.TOOL, "releases", areas=areas,
                dem=self.site.dem, count=count, radius_m=facts["release_radius_m"], dbh_cm=facts["dbh_cm"],
                length_m=facts["length_m"], seed=self.ask.seed, **(log if kind == "logs" else rock),
            )
        )  # fmt: skip

    def protected_dem(self) -> str:
        if self.site.layers["dams"] is None:
            return self.site.dem
        path = self.prepared / "dem_with_dams.tif"
        return str(self.step(path, add_structures.TOOL, "dams", dem=self.site.dem, structures=self.site.layers["dams"]))

    def shape(self, kind: str) -> str:
        """The point cloud of the site's log, or of a rock."""
        if kind in ROCKS:
            path = self.prepared / f"{kind}.pts"
            corners = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * ROCKS[kind]
            np.savetxt(path, corners, fmt="%.6g")
            return str(path)
        facts = self.site.facts
        sizes = {name: facts[name] for name in ("dbh_cm", "length_m", "density_kg_m3")}
        return str(self.step(self.prepared / "log", make_log.TOOL, "point cloud", rings=31, **sizes) / "log.pts")

    def slide(self, scenario: str, convention: str = "", friction: float | None = None, logs: str = "logs") -> Path:
        """One run of `slide-logs`."""
        facts = self.site.facts
        protects = scenario in ("protected", "barriers")
        forest = "als" if protects or scenario in ROCKS else scenario
        mu = facts["friction"] if friction is None else friction
        self.terrains[scenario] = self.protected_dem() if scenario == "protected" else self.site.dem
        name = scenario + (f"_{convention}" if convention else "") + (f"_{friction:g}" if friction is not None else "")
        if scenario in ROCKS:
            mu, logs = facts.get("rock_friction", 0.5), "rocks"
        keeps = "all" if scenario == "barriers" or logs == "fewer" else "none"
        return self.step(
            self.runs / name, slide_logs.TOOL, name, dem=self.terrains[scenario], releases=self.releases(logs),
            trees=self.trees[forest], barriers=self.site.layers["barriers"] if protects else None,
            lines=self.site.layers["lines"], friction=float(mu), fidelity=self.fidelity, seed=self.ask.seed,
            threads=self.ask.threads, trajectories=keeps, **self.options,
            shape=self.shape(scenario if scenario in ROCKS else "log") if convention or scenario in ROCKS else "cone",
        )  # fmt: skip

    def scenarios(self) -> list[str]:
        """Those whose logs are compared one by one; the first is the baseline."""
        randoms = [name for name in self.trees if name.startswith("random")]
        names = ["als", "protected" if self.klosters else "barriers", *randoms, "none"]
        kinds = {"protected": "barriers"} | dict.fromkeys(randoms, "random")
        return [name for name in names if not self.needed or name == "als" or kinds.get(name, name) in self.needed]

    def compared(self, convention: str) -> dict[tuple[str, str, str], Any]:
        """Rows of `compare-scenarios`, by scenario, quantity and item."""
        names = self.scenarios()
        runs = [str(self.slide(name, convention)) for name in names]
        place = self.step(
            self.results / ("comparison" + (f"_{convention}" if convention else "")), compare_scenarios.TOOL,
            "comparing", runs=",".join(runs), names=",".join(names), baseline="als", seed=self.ask.seed,
        )  # fmt: skip
        rows = json.loads((place / "comparison.json").read_text(encoding="utf-8"))["rows"]
        plain = [{key: float("nan") if value is None else value for key, value in row.items()} for row in rows]
        return {(str(row["scenario"]), str(row["quantity"]), str(row["item"])): row for row in plain}

    def evidence(self) -> Evidence:
        """All that the findings of the site are judged by."""
        of = self.evidence_of_scenarios()
        self._evidence = of
        if self.klosters:
            of.sweeps = {cell: self.sweep(cell) for cell in self.cells()}
        else:
            of.spreads = {name: self.spread(name) for name in ("als", *ROCKS)}
            of.flight = self.flight()
            if self.site.facts["takeoff_line"]:
                of.takeoffs = {mu: self.takeoffs(mu) for mu in self.frictions()}
                of.jumped = [(row["speed_ms"], row["jump_m"], row["height_m"]) for row in self.jumps()]
        return of

    def evidence_of_scenarios(self, convention: str = "") -> Evidence:
        """What the scenarios came to."""
        from deadwood_algorithms.files.vectors import read_table
        from deadwood_algorithms.paper.findings import Evidence

        logs, summaries, cells = {}, {}, {}
        for name in self.scenarios():
            place = self.slide(name, convention)
            frame = read_table(f"{place / 'run.gpkg'}|layername=deposits", what="deposits")
            logs[name] = {str(column): frame[column].to_numpy() for column in frame.columns if column != "geometry"}
            summaries[name] = json.loads((place / "summary.json").read_text(encoding="utf-8"))
            cells[name] = self.cell_speed(place)
        rows = self.compared(convention)
        twin = self.ask.site_data is None
        return Evidence(self.site.name, self.site.facts, rows, logs, summaries, cell_speed=cells, twin=twin)

    def evidence_of_needed(self, convention: str = "") -> Evidence:
        """What the needed scenarios came to, the rocks and the high friction among them."""
        of = self.evidence_of_scenarios(convention)
        if self.klosters and "friction" in self.needed:
            of.sweeps = self.high_friction(convention)
        if "rocks" in self.needed and not self.klosters:
            of.spreads = {name: self.spread(name) for name in ("als", *ROCKS)}
        if "barriers" in of.logs and self.site.facts["takeoff_line"] and not convention:
            self._evidence = of
            of.jumped = [(row["speed_ms"], row["jump_m"], row["height_m"]) for row in self.jumps()]
        return of

    def cell_speed(self, run_folder: Path) -> float:
        """Mean over the cells that logs passed of the largest speed there [m/s]."""
        from deadwood_algorithms.files.rasters import read_raster_on

        speeds = read_raster_on(run_folder / "speed_max.tif", self.ground, what="speed")
        return float(np.nanmean(speeds[speeds > 0.0]))

    def high_friction(self, convention: str) -> dict[float, list[dict[str, Any]]]:
        """Reach of the lines with a friction beyond the paper's range, as a row of a sweep."""
        told = json.loads(
            (self.slide("als", convention, friction=HIGH_FRICTION) / "summary.json").read_text(encoding="utf-8")
        )
        row = {"friction": HIGH_FRICTION, "n": told["logs"]["released"]}
        row |= {f"reach_{each['line_id']}": each["p"] for each in told["reach"]}
        return {self.ground.cell: [row]}

    def frictions(self) -> Sequence[float]:
        return (0.15, 0.25, 0.4) if self.ask.quick else FRICTIONS

    def cells(self) -> Sequence[float]:
        """Cell sizes of the sweeps [m]: the terrain model's, and coarser ones."""
        finest = self.ground.cell
        return [finest * times for times in ((1, 4) if self.ask.quick else (1, 2, 4))]

    def sweep(self, cell: float) -> list[dict[str, Any]]:
        """Rows of `calibrate-friction` on cells of this size, the event being a log that stops on the road."""
        from deadwood_algorithms.paper.site import write_coarser

        times = round(cell / self.ground.cell)
        dem = Path(self.site.dem)
        if times > 1:
            dem = self.prepared / f"dem_{cell:g}m.tif"
            if dem not in self._known:
                self._known.add(dem)
                write_coarser(self.site.dem, times, dem)
        count = self.fifth()
        place = self.step(
            self.results / f"friction_{cell:g}m", calibrate_friction.TOOL, f"friction on {cell:g} m", dem=str(dem),
            releases=self.releases(), trees=self.trees["als"], lines=self.site.layers["lines"],
            reached=self.line("road"), not_reached=self.line("beyond"), seed=self.ask.seed, logs=count,
            friction=",".join(f"{mu:g}" for mu in self.frictions()), fidelity=self.fidelity,
            threads=self.ask.threads,
        )  # fmt: skip
        told = json.loads((place / "calibration.json").read_text(encoding="utf-8"))
        return [row | {"n": told["logs"]} for row in told["rows"]]

    def fifth(self) -> int:
        return max(self.logs // 5, min(self.logs, 200))

    def line(self, fact: str) -> str | None:
        """A file with one of the site's lines alone."""
        from deadwood_algorithms.files.vectors import read_vector, write_vector

        name = self.site.facts[fact]
        if name is None:
            return None
        path = self.prepared / f"line_{fact}.gpkg"
        if path not in self._known:
            path.unlink(missing_ok=True)
            self._known.add(path)
            frame = read_vector(str(self.site.layers["lines"]), geometry=ANY_SHAPE, target_crs=None, what="lines")
            write_vector(path, {"lines": frame.loc[frame["line_id"] == name]})
        return str(path)

    def spread(self, scenario: str) -> dict[str, Any]:
        """`lateral-spread` of one run, seen past the same least run-out for logs and rocks."""
        path = self.step(
            self.results / f"spread_{scenario}.gpkg", lateral_spread.TOOL, "spread", deposits=str(self.slide(scenario)),
            min_runout_m=float(self.site.facts["length_m"]), seed=self.ask.seed,
        )  # fmt: skip
        return rows_of(path, "spread")[0]

    def flight(self) -> dict[str, Any] | None:
        if self.site.layers["flight"] is None:
            return None
        path = self.step(
            self.results / "flight.gpkg", fit_flight.TOOL, "flight", dem=self.site.dem,
            flights=self.site.layers["flight"], barriers=self.site.layers["barriers"],
            plots=str(self.results / "flight"), dbh_cm=self.site.facts["dbh_cm"], length_m=self.site.facts["length_m"],
        )  # fmt: skip
        return rows_of(path, "flights")[0]

    def arrivals(self, run_folder: Path) -> Any:
        from deadwood_algorithms.files.vectors import read_table

        path = self.step(
            self.results / f"arrivals_{run_folder.name}.gpkg", reach_lines.TOOL, "arrivals", run=str(run_folder),
            lines=str(self.site.layers["lines"]),
        )  # fmt: skip
        return read_table(f"{path}|layername=arrivals", what="arrivals")

    def takeoffs(self, mu: float) -> tuple[np.ndarray, int]:
        """Speeds at the take-off line with this friction, in the mapped forest without barriers; and the logs slid."""
        import geopandas

        fewer = self.prepared / "releases_fewer.gpkg"
        if fewer not in self._known:
            from deadwood_algorithms.files.vectors import write_vector

            fewer.unlink(missing_ok=True)
            self._known.add(fewer)
            write_vector(fewer, {"releases": geopandas.read_file(self.releases()).iloc[: self.fifth()]})
        rows = self.arrivals(self.slide("als", friction=mu, logs="fewer"))
        return rows.loc[rows["line_id"] == self.site.facts["takeoff_line"], "speed_ms"].to_numpy(float), self.fifth()

    def jumps(self) -> list[dict[str, Any]]:
        """The logs that fly over the terrace's barrier to the road: take-off speed and jump, the slowest first."""
        rows = self.arrivals(self.slide("barriers"))
        lip = rows[rows["line_id"] == self.site.facts["takeoff_line"]].set_index("log_id")
        road = rows[rows["line_id"] == self.site.facts["road"]].set_index("log_id")
        assert self._evidence is not None
        logs = self._evidence.logs["barriers"]
        jump = dict(zip(logs["log_id"].tolist(), logs["jump_max_m"].tolist(), strict=True))
        both = [each for each in lip.index if each in road.index and road["t_s"][each] > lip["t_s"][each]]
        heights = self.heights({int(each): float(lip["t_s"][each]) for each in both})
        told = [
            {
                "log_id": int(each),
                "t_s": float(lip["t_s"][each]),
                "speed_ms": float(lip["speed_ms"][each]),
                "jump_m": jump[each],
                "height_m": heights[int(each)],
            }
            for each in both
        ]
        return sorted(told, key=lambda row: row["speed_ms"])

    def heights(self, since_s: Mapping[int, float]) -> dict[int, float]:
        """Greatest height of the centre of mass above the terrain after a moment of each log's slide [m]."""
        from deadwood_algorithms.results.run_folder import read_run

        if not since_s:
            return {}
        ground, found = self.ground, dict.fromkeys(since_s, 0.0)
        for piece in read_run(str(self.slide("barriers")), feedback=tool.Quiet()).poses(np.array(sorted(since_s))):
            above = piece["z"] - ground.height(piece["x"], piece["y"])
            for each in np.unique(piece["log_id"]).tolist():
                late = (piece["log_id"] == each) & (piece["t_s"] >= since_s[each])
                found[each] = max(found[each], float(np.nanmax(above[late], initial=0.0)))
        return found

    def figures(self) -> list[tuple[str, Path]]:
        """The pictures beside the paper's."""
        from deadwood_algorithms.paper.pictures import draw_hits, draw_jump, draw_sweeps
        from deadwood_algorithms.results.run_folder import read_run

        assert self._evidence is not None
        of, layers, made = self._evidence, self.site.layers, []

        def panels(names: Sequence[str]) -> list[Any]:
            out = []
            for name in names:
                forest = "als" if name in ("protected", "barriers") else name
                over = {"trees": self.trees[forest], "lines": layers["lines"], "releases": layers["releases"]}
                over |= {"barriers": layers["barriers"]} if name in ("protected", "barriers") else {}
                over |= {"dams": layers["dams"]} if name == "protected" else {}
                p = of.reach(name)
                low, high = 100 * p["ci_low"], 100 * p["ci_high"]
                title = f"{name}: {100 * p['value']:.1f} % ({low:.1f} to {high:.1f}) reach the road"
                out.append((title, self.slide(name), self.terrains[name], over))
            return out

        sets = {"Fig. 3": ("als", "protected", "random", "none")} if self.klosters else {
            "Fig. 4a-b": ("barriers", "als"), "Fig. A1": ("none", "random"),
        }  # fmt: skip
        for title, names in sets.items():
            path = self.results / f"{title.replace('. ', '_').replace(' ', '').lower()}.png"
            draw_hits(path, f"As the paper's {title}, {self.site.name}", panels(names))
            made.append((f"{self.site.name}: as the paper's {title}", path))
        if of.sweeps:
            path = self.results / "friction.png"
            draw_sweeps(path, of.sweeps, self.site.facts["road"])
            made.append((f"{self.site.name}: friction and cells (5.1, 6.1)", path))
        for path in sorted((self.results / "flight").glob("*.png")):
            made.append((f"{self.site.name}: as the paper's Fig. 4c, the flight", path))
        jumps = self.jumps() if of.jumped else []
        if jumps:
            row = jumps[len(jumps) // 2]
            poses = next(
                iter(read_run(str(self.slide("barriers")), feedback=tool.Quiet()).poses(np.array([row["log_id"]])))
            )
            path = self.results / "fig_b1.png"
            said = f"log {row['log_id']}: {row['speed_ms']:.1f} m/s at the terrace, jump {row['jump_m']:.1f} m"
            draw_jump(path, poses, self.site.dem, said, row["t_s"])
            made.append((f"{self.site.name}: as the paper's Fig. B1", path))
        return made


TOOL = Tool(
    "reproduce-paper",
    "Evaluate",
    "Test the paper's findings on two synthetic twins or the real sites",
    Ask,
    run,
)
