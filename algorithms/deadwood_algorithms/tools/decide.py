"""Compare what can be done with dead trees: leave, fell across, fell, anchor, remove; events at each line over years.

Each dead tree slides `--repeats` times in each of its states: as a whole snag, as the upper part of one that breaks,
and as a stem that lies and begins to move; without any lying stem, and among those that a treatment leaves. How often
each happens in which year follows from the processes that `age` shows, drawn `--draws` times. Treatments:

- `leave`; `remove`; `fell` (all are felled and lie as they fall);
- `fell-across`: all are felled and lie across the slope, a share of them (`--anchored-share`) held by stumps or trees;
- `anchor`, `remove-part`: a share of the stems (`--part`), those from which most logs reach a line, is felled across
  the slope and anchored, or removed; the others are left. They are found with half of the slides, and all results are
  from the other half.

The folder holds `events.csv` (events a year at each line, by treatment, year and energy), `totals.csv` (over all years
by class of intensity: the table that a risk tool takes), `periods.csv` (the energy with return periods of 30, 100 and
300 years), `differences.csv` (treatments against each other, draw by draw; not decided where the range contains 0),
`influence.csv` (which number matters most), `processes.csv`, `decision.png`, `decision.json`, and `run`, the slides
without lying stems. An event is a log that arrives; ranges contain 95 % of the draws of all numbers and slides.

    deadwood-tool decide --dead-trees dead.gpkg --years-dead 1 --dem dem.tif --trees trees.gpkg --lines road.gpkg \\
        --friction 0.25 --storm-return-years 10,30 --start-share 0.05,0.5 --mobilised-per-year 0,0.01 --output decision

Published nowhere, and so your input, a number or a range: how often storms (or wet snow) break snags, what share of the
falling stems slides off in one piece, and how many loose lying stems begin to move a year. Outside their critical years
stems are taken not to slide far. Lying stems hold in proportion to their share of all stems, rigid but losing it with
the years; standing dead trees and new stumps hold nothing; rocks, and damage to living trees, are not modelled.
"""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.evaluate.lifetime.options import REPORT_YEARS, AgingOptions, process_rows, reported_years
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.final_place import moving_to
from deadwood_algorithms.params.snag_dynamics import PROCESSES as TABLE
from deadwood_algorithms.params.tool import Feedback, Outcome, ProgressOnly, Tool
from deadwood_algorithms.tools import slide_logs

if TYPE_CHECKING:  # help must be fast
    from deadwood_algorithms.evaluate.lifetime.state_slides import Slid

EVENTS, TOTALS, PERIODS, DIFFERENCES = "events.csv", "totals.csv", "periods.csv", "differences.csv"
LIVING = "living.gpkg"
INFLUENCE, PROCESSES, PICTURE, FACTS = "influence.csv", "processes.csv", "decision.png", "decision.json"


def input_range(name: str, *default: float) -> Any:
    """A number that the user must know, or its range."""
    process = TABLE[name]
    more: dict[str, Any] = {"maximum": 1.0} if process.unit == "1" else {}
    more |= {"default": default} if default else {}
    help_text = f"One number, or the two ends of a range. Known: {process.source}."
    return tool.ask("numbers", process.about, minimum=0.0, most_count=2, ascending=True, help=help_text, **more)


@dataclass(frozen=True, kw_only=True)
class Ask(AgingOptions):
    start_share: tuple[float, ...] = input_range("start_share")
    mobilised_per_year: tuple[float, ...] = input_range("mobilised_per_year")
    dem: str = tool.terrain("Terrain model")
    trees: str | None = tool.vector(
        "Living trees",
        "point",
        default=None,
        help="Trees that stand where a dead one stands are left out; the others are then in living.gpkg.",
    )
    lines: str = tool.vector("Roads, railways, houses", "line", "polygon")
    friction: str | float = tool.number_or_layer(
        "Friction coefficient", minimum=0.0, help="A number, a raster, or polygons with a field 'friction' or 'mu'."
    )
    treatments: str = tool.text("Treatments to compare", default="leave,fell-across,fell,anchor,remove,remove-part")
    anchored_share: tuple[float, ...] = input_range("anchored_share", 0.7, 1.0)
    part: float = tool.number(
        "Share of the stems that anchor and remove-part pick", default=0.3, minimum=0.0, maximum=1.0, exclusive=True
    )
    density_kg_m3: float = tool.number(
        "Density of the wood", unit="kg/m³", default=300.0, minimum=1.0, maximum=25_000.0
    )
    years: int = tool.integer("Years to look ahead", default=30, minimum=1, maximum=200)
    report_years: tuple[float, ...] = tool.numbers("Years in events.csv", *REPORT_YEARS, minimum=0.0, ascending=True)
    energy_classes_kj: tuple[float, ...] = tool.class_bounds("Bounds of the classes of energy", 30.0, 300.0, unit="kJ")
    return_periods_years: tuple[float, ...] = tool.class_bounds("Return periods", 30.0, 100.0, 300.0, unit="years")
    most_trees: int = tool.integer(
        "Dead trees that slide, at most", default=200, minimum=2, help="Drawn at random, for all of them."
    )
    repeats: int = tool.integer("Slides of each tree in each state", default=4, minimum=2, maximum=1000)
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="draft")
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    output: str = tool.output_folder("Folder of the decision")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import numpy as np

    from deadwood_algorithms.evaluate.lifetime import decision, decision_figure, events, life, state_slides
    from deadwood_algorithms.evaluate.lifetime.treatments import scenes_of, treatments_of
    from deadwood_algorithms.params.snag_dynamics import spans_of
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import write_json

    treatments = treatments_of(ask.treatments)
    names = ("storm_return_years", "start_share", "mobilised_per_year", "anchored_share")
    spans = spans_of(ask.ranges, {name: getattr(ask, name) for name in names})
    reported = reported_years(ask.report_years, ask.years)
    bounds = ask.energy_classes_kj
    with result_folder(TOOL, ask, feedback) as folder:
        slid = slid_states(ask, scenes_of(treatments), folder, feedback)
        stand, trees, lines = slid.stand, slid.trees, slid.lines
        steps = state_slides.thresholds_of(list(slid.energies.values()), bounds)
        kinds, of_tree = life.kinds_of(trees.years_dead, trees.standing, trees.speed)
        slides, picked = state_slides.slides_that_count(slid, of_tree, steps, treatments, ask.part)
        numbers = life.drawn(spans, ask.draws, ask.seed)
        sizes = [np.bincount(of_tree[which], minlength=kinds.speed.size).astype(float) for which in (picked, ~picked)]
        found = events.arrivals_of(treatments, numbers, kinds, slides, (sizes[0], sizes[1]), ask.years + 1, ask.seed)
        answer = decision.Answer(found, lines, steps, ask.years)
        tables = {
            EVENTS: decision.year_rows(answer, reported, bounds),
            TOTALS: decision.total_rows(answer, bounds),
            PERIODS: decision.period_rows(answer, ask.return_periods_years),
            DIFFERENCES: decision.difference_rows(answer),
            INFLUENCE: decision.influence_rows(answer, numbers),
            PROCESSES: process_rows(spans),
        }
        told = {name: write_rows(folder / name, list(each)) for name, each in tables.items()}
        shares = np.array([life.critical_at(numbers, kinds, year)[:, of_tree].mean() for year in range(ask.years + 1)])
        years = np.flatnonzero(shares > 0.1)
        critical = (float(years[0]), float(years[-1] + 1)) if years.size else None
        sentences = [each for k in range(len(lines)) for each in decision.treatment_sentences(answer, k)]
        first_treatment = treatments[0].name
        differences = [each for each in told[DIFFERENCES] if each["against"] == first_treatment]
        compared = [decision.difference_sentence(each, ask.years) for each in differences]
        influences = [decision.influence_sentence(told[INFLUENCE], each) for each in lines]
        rates = {name: each.rate[..., [answer.column(k) for k in range(len(lines))]] for name, each in found.items()}
        decision_figure.draw(folder / PICTURE, rates, lines, critical, influences)
        facts = {
            "trees": len(stand),
            "trees_slid": len(trees),
            "slides": int(slid.states.tree.size),
            "picked": [str(each) for each in trees.ids[picked]],
            "critical_years": critical,
            "totals": told[TOTALS],
            "periods": told[PERIODS],
            "differences": told[DIFFERENCES],
            "sentences": [*sentences, *compared],
        }
        write_json(folder / FACTS, facts)
    parts = {"events": EVENTS, "totals": TOTALS, "periods": PERIODS, "differences": DIFFERENCES}
    parts |= {"influence": INFLUENCE, "processes": PROCESSES, "picture": PICTURE, "facts": FACTS}
    about = f"assumed: {counted(len(stand), 'dead tree')}, of which {len(trees)} slide; "
    about += f"{len(spans)} numbers, each drawn from its range ({PROCESSES})"
    return Outcome.of_folder(ask.output, parts, facts, (*sentences, *compared, *filter(None, influences), about))


def slid_states(ask: Ask, scenes: list[str], folder: Path, feedback: Feedback) -> Slid:
    """Slide the dead trees, or ``--most-trees`` of them, in every state and scene; what is kept goes to ``folder``."""
    from deadwood_algorithms.evaluate.lifetime import state_slides
    from deadwood_algorithms.evaluate.lifetime.dead_trees import living_of, read_dead_trees
    from deadwood_algorithms.files.dem_blocks import open_ground

    quiet = ProgressOnly(feedback)
    with tempfile.TemporaryDirectory(dir=folder.parent) as made:
        work, living, dead = Path(made), None, 0
        with open_ground(ask.dem, crs=ask.crs, feedback=feedback) as ground:
            stand = read_dead_trees(ask.dead_trees, ask.years_dead, ground, ask.crs, feedback)
            if ask.trees:
                living, dead = living_of(ask.trees, stand, ask.crs, work / LIVING, feedback)
            trees = stand.sample(ask.most_trees, ask.seed)
            states = state_slides.states_of(trees, ground, ask.repeats, ask.density_kg_m3, ask.seed)
            laid = {each: state_slides.lying_in(each, stand, ground, ask.seed) for each in scenes}

        def slide(releases: Path, output: Path, lying: Path | None) -> None:
            values = {name: getattr(ask, name) for name in ("dem", "lines", "friction", "fidelity", "crs", "threads")}
            values |= {"trees": living, "seed": ask.seed, "trajectories": "all", "own_slope": "none"}
            values |= {"releases": str(releases), "lying_logs": lying and str(lying), "output": str(output)}
            given = {name: each for name, each in values.items() if each is not None}
            slide_logs.TOOL(feedback=quiet if lying else feedback, **given)

        with moving_to(made, ask.output):
            lines, energies = state_slides.energies_of(states, laid, work, slide, quiet)
        for each in ("run", "states.gpkg", LIVING):
            if (work / each).exists():
                shutil.move(work / each, folder / each)
    account_inputs(folder / "run", dead if ask.trees else None, quiet)
    return state_slides.Slid(stand, trees, states, lines, energies)


def account_inputs(run: Path, dead: int | None, feedback: Feedback) -> None:
    """Hand on what the run says of its layers; ``dead`` : trees left out of it before, None without trees."""
    from deadwood_algorithms.files.accounts import account, count_of
    from deadwood_algorithms.results.run_folder import read_run

    read = read_run(str(run), feedback=feedback).manifest["inputs"]
    counts = {each["parameter"]: each["counted"] for each in read if "counted" in each}
    if dead is not None:
        alive = counts.get("trees", count_of(0, 0, {}))
        left_out = {each["why"]: each["n"] for each in alive["left_out"]} | {"dead": dead}
        counts |= {"trees": count_of(alive["read"] + dead, alive["used"], left_out)}
    for name in ("trees", "lines", "friction"):
        if name in counts:
            account(name, counts[name])


def write_rows(path: Path, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Write the records as a table, and hand them on."""
    import pandas

    from deadwood_algorithms.files.tables import write_csv

    write_csv(path, pandas.DataFrame(rows))
    return rows


TOOL = Tool(
    "decide",
    "Evaluate",
    "Compare leaving, felling, anchoring and removing dead trees: events at each line over the years",
    Ask,
    run,
    then="deadwood-tool make-report {output}/run --output report.html",
)
