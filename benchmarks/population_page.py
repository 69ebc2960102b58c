"""The page of the population, its tables on other pages, and the record that the tools use, from population.json."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.scene.slope_kind import KINDS, NAMES, ROUGH
from deadwood_algorithms.simulate.promise import Between, together_of
from deadwood_algorithms.stats.statistics import to_decimals

from . import between, engines, study, verdicts
from .between import LARGE
from .population import HALVED, SLID, held_out, reached
from .slopes import in_gully
from .tables import table

Row = dict[str, Any]
Choice = Callable[[Row], bool]
PAGE = study.HERE / "population.md"
DOCS = study.HERE.parent / "docs" / "explanation"
TRADE = study.HERE.parent / "algorithms/deadwood_algorithms/simulate/fidelity_trade.py"
MARKS = re.compile(r"(<!-- measured: population (\w+)\b[^>]*-->\n).*?(<!-- end of measured: population -->)", re.S)
SLOPES = re.compile(r"(SLOPE_ERRORS: [^\n]*\{\n).*?(^\}\n)", re.S | re.M)
RECORD = re.compile(r"(BETWEEN_SLOPES: [^\n]*\{\n).*?(^\}\n)", re.S | re.M)
COARSER = SLID[:-1]
WORST = 6  # slopes listed for a fidelity
LEAST = 5  # slopes of a row
CLASSES: dict[str, Choice] = {
    "all": lambda r: not in_gully(r["seed"]),
    "... of these held out": lambda r: not in_gully(r["seed"]) and held_out(r["seed"]),
    **{name: (lambda r, name=name: r["kind"] == name and not in_gully(r["seed"])) for name in NAMES},
    f"noise over cell below {ROUGH:g}": lambda r: not in_gully(r["seed"]) and r["noise_over_cell"] < ROUGH,
    f"noise over cell from {ROUGH:g}": lambda r: not in_gully(r["seed"]) and r["noise_over_cell"] >= ROUGH,
    "with road benches": lambda r: not in_gully(r["seed"]) and r["made_of"]["benches"] > 0,
    "with cliffs": lambda r: not in_gully(r["seed"]) and r["made_of"]["cliffs"] > 0,
    "released in a channel, no obstacles": lambda r: in_gully(r["seed"]),
}
DRAWN = (
    "20 to 45 degrees steep above a flatter foot, cells of 0.25 to 2 m, the relief measured on real steep ground, up "
    "to 12 cm of noise from cell to cell, friction 0.2 to 0.5, logs of 8 to 35 m, upright, lying or tilted, and any of "
    "channels, road benches, cliffs, boulders, stumps, lying logs, a forest of 50 to 800 stems/ha, a barrier."
)
SHORT = tuple(each for each in CLASSES if not each.startswith("..."))


def differences(records: list[Row], ours: str, theirs: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Differences of reach [points] and their sampling variances, of slopes that slid at both."""
    rows = [between.paired(reached(r, ours), reached(r, theirs)) for r in records]
    d, v = np.array(rows).reshape(-1, 2).T
    return d, v


def with_both(records: list[Row], ours: str, theirs: str) -> list[Row]:
    return [r for r in records if {ours, theirs} <= r["reached"].keys()]


def kinds_of(records: list[Row]) -> NDArray[np.str_]:
    return np.array([r["kind"] + (", rough ground" if r["noise_over_cell"] >= ROUGH else "") for r in records])


def record_for_tools(records: list[Row]) -> dict[str, dict[str, Between]]:
    """Reach minus that of reference [points] by fidelity and kind, fitted to the slopes that are not held out.

    Few slopes slide at reference: what is between it and fine is the same for all kinds, and adds to the others.
    """
    known = [r for r in records if not held_out(r["seed"])]
    finest = with_both(known, "fine", "reference")
    coarser = differences(with_both(known, "standard", "fine"), "standard", "fine")  # not spread less than finer ones
    few, alike = differences(finest, "fine", "reference"), np.full(len(finest), "")
    last = between.fitted(*few, alike, ("",), coarser)[""] if finest else None
    found = {}
    for name in COARSER:
        rows = with_both(known, name, "fine")
        mine = between.fitted(*differences(rows, name, "fine"), kinds_of(rows), KINDS)
        found[name] = {kind: between.added(each, last or Between()) for kind, each in mine.items()}
    return found | ({"fine": dict.fromkeys(KINDS, last)} if last else {})


def kept(records: list[Row], record: dict[str, dict[str, Between]], name: str) -> tuple[int, int]:
    """On how many held-out slopes the measured difference from fine is within what the record promises for as many
    logs, at 95 %; and how many there are.
    """
    rows = [r for r in with_both(records, name, "fine") if held_out(r["seed"])]
    d, v = differences(rows, name, "fine")
    most = [
        together_of(record[name][kind], math.sqrt(each), risk=0.05)
        for kind, each in zip(kinds_of(rows), v, strict=True)
    ]
    return int((np.abs(d) <= most).sum()), len(rows)


def _points(value: float) -> str:
    return to_decimals(value, 1, sign=True)


def _interval(found: tuple[float, float, float], how: Callable[[float], str]) -> str:
    return f"{how(found[0])} ({how(found[1])} to {how(found[2])})"


def _row(what: str, name: str, records: list[Row]) -> list[str]:
    found = between.summary(*differences(records, name, "fine"))
    percent = [_interval(tuple(100 * each for each in found["beyond"]), "{:.0f}".format)]
    sd = _interval(found["sd"], "{:.1f}".format)
    return [what, f"`{name}`", str(found["slopes"]), _interval(found["mean"], _points), sd, *percent]


HEAD = ["slopes", "fidelity", "number", "mean [points]", "SD between slopes [points]", f"beyond {LARGE:g} points [%]"]


def class_table(records: list[Row], classes: tuple[str, ...] = tuple(CLASSES)) -> str:
    """Every class and fidelity."""
    rows = []
    for what in classes:
        for name in COARSER:
            mine = with_both([r for r in records if CLASSES[what](r)], name, "fine")
            if len(mine) >= LEAST:
                rows.append(_row(what, name, mine))
    return table(HEAD, rows)


def made_of(record: Row) -> str:
    """What a slope is made of, in words; what it lacks is left out."""
    p = record["made_of"]
    parts = [
        f"{p['slope_deg']:.0f} degrees, mu {p['friction']:.2f}, cells {p['cell_m']:g} m",
        f"noise {100 * p['noise_m']:.0f} cm",
        f"{p['posture']} logs {p['length_m']:.0f} m x {100 * p['diameter_m']:.0f} cm",
        *(f"channel ({each})" for each in p.get("channel", [])),
        *(f"{what} {p[name]}" for name, what in (("benches", "road benches"), ("cliffs", "cliffs")) if p[name]),
        *(
            f"{p[name]:.0f} {name.replace('_', ' ')}/ha"
            for name in ("stems", "stumps", "boulders", "lying_logs")
            if p[name]
        ),
        *([f"barrier {p['barrier_m']:.1f} m"] if p["barrier_m"] else []),
    ]
    return ", ".join(parts)


def worst_table(records: list[Row], name: str) -> str:
    """The slopes with the largest differences, with what they are made of."""
    rows = with_both(records, name, "fine")
    d, v = differences(rows, name, "fine")
    order = np.argsort(-np.abs(d))[:WORST]
    share = [100.0 * reached(r, "fine").mean() for r in rows]
    found = [
        [
            str(rows[i]["seed"]), f"{_points(float(d[i]))} ± {1.96 * math.sqrt(v[i]):.1f}", f"{share[i]:.0f}",
            rows[i]["kind"], made_of(rows[i]),
        ]
        for i in order
    ]  # fmt: skip
    return table(["seed", f"`{name}` minus `fine` [points]", "reach at `fine` [%]", "kind", "made of"], found)


def finest_rows(records: list[Row]) -> list[tuple[str, int, tuple[float, float, float], float]]:
    """(pair, slopes, mean with its interval, spread) of what says how good `reference` is."""
    found = []
    for ours, theirs in (("fine", "reference"), (HALVED, "reference")):
        rows = with_both(records, ours, theirs)
        if len(rows) > 1:
            d, v = differences(rows, ours, theirs)
            found.append((f"`{ours}` minus `{theirs}`", len(rows), between.mean_interval(d), between.spread(d, v)))
    return found


def finest_table(records: list[Row]) -> str:
    rows = [
        [what, str(n), _interval(mean, _points), f"{sd:.1f}", verdicts.within(mean[1], mean[2], verdicts.FINEST_POINTS)]
        for what, n, mean, sd in finest_rows(records)
    ]
    bound = f"mean within ±{verdicts.FINEST_POINTS:g} points"
    return table(["pair", "slopes", "mean [points]", "SD between slopes [points]", bound], rows)


def promise_table(records: list[Row], record: dict[str, dict[str, Between]]) -> str:
    """What auto assumes, by kind."""
    rows = [[kind, *(f"±{together_of(mine[kind], 0.0, risk=0.05):.1f}" for mine in record.values())] for kind in KINDS]
    count = kinds_of([r for r in records if not held_out(r["seed"])])
    rows = [[row[0], str(int((count == row[0]).sum())), *row[1:]] for row in rows]
    return table(["kind of slope", "slopes fitted", *(f"`{name}` [points]" for name in record)], rows)


def ordinary(records: list[Row]) -> dict[str, dict[str, Any]]:
    """What differs from fine on the slopes of all kinds, by fidelity."""
    rows = {name: with_both([r for r in records if CLASSES["all"](r)], name, "fine") for name in COARSER}
    return {
        name: between.summary(*differences(each, name, "fine")) for name, each in rows.items() if len(each) >= LEAST
    }


def headline(records: list[Row]) -> str:
    """A line for each of draft and standard."""
    lines = []
    for name, found in ordinary(records).items():
        d, _ = differences(with_both(records, name, "fine"), name, "fine")
        lines.append(
            f"- `{name}` differs from `fine` by {_interval(found['mean'], _points)} points in the mean of "
            f"{found['slopes']} random slopes, with a standard deviation of {_interval(found['sd'], '{:.1f}'.format)} "
            f"points from slope to slope; {100 * found['beyond'][0]:.0f} of 100 slopes are off by more than "
            f"{LARGE:g} points. The largest measured, channels included, is {_points(d[np.abs(d).argmax()])}."
        )
    return "\n".join(lines)


def page(found: Row) -> str:
    """The whole page."""
    records, source = found["records"], found["source"]
    record = record_for_tools(records)
    logs = sorted({r["logs"]["fine"] for r in records})
    cpu = {n: float(np.mean([r["cpu_ms"][n] for r in with_both(records, n, n)])) for n in SLID}
    costs = ", ".join(f"`{name}` {value:.1f} ms ({value / cpu['standard']:.2g})" for name, value in cpu.items())
    held = "; ".join("`{}` {} of {}".format(name, *kept(records, record, name)) for name in COARSER)
    return "\n\n".join(
        [
            "# How far off the calculation is, from slope to slope",
            "Written by `python -m benchmarks.population`. Do not edit.",
            headline(records),
            f"Engine of commit {source['commit']} (sources {source['engine']}), {source['date']}; {source['machine']}; "
            f"{source['versions']}. {len(records)} slopes, {' and '.join(map(str, logs))} paired logs on each.",
            "## How it is measured",
            f"A slope is drawn from its seed ([slopes.py](slopes.py)): {DRAWN} One slope in four has only "
            "the ground, and its logs are released in a channel. Each slope has one line, chosen by a pilot on other "
            "logs, which 20 to 80 % of these reached. The same logs slide at every fidelity, so that differences are "
            "paired. *SD between slopes* is the scatter of the slopes' differences without their sampling noise; "
            f"*beyond {LARGE:g} points* is the share of slopes in the distribution that explains the differences and "
            "their noise best. Intervals are 95 %, over slopes. CPU time per log, mean of the slopes (over that of "
            f"`standard`): {costs}.",
            "## By kind of slope",
            "The kind is what the scene shows before a log slides (`scene/slope_kind.py`): the first that applies of "
            "channels (of the terrain model), structures (barriers, boulders, lying logs), forest, open. Rows with "
            f"fewer than {LEAST} slopes are left out.",
            class_table(records),
            "## The worst slopes",
            *(worst_table(records, name) for name in COARSER),
            "## The error of the finest",
            "On every seventh slope `reference` slides, too, and once more with half its step, travel and rings.",
            finest_table(records),
            "## What `--fidelity auto` assumes",
            "The error of calculation against `reference` that is not exceeded on 95 of 100 slopes of a kind. It is "
            "fitted to two thirds of the slopes: normal, with one standard deviation on nine slopes in ten and a "
            "larger one on the tenth. A kind with few slopes takes more from the others.",
            promise_table(records, record),
            f"On the held-out third the measured difference is within what this promises for as many logs, at 95 %: "
            f"{held}.",
            "",
        ]
    )


def with_tables(text: str, records: list[Row]) -> str:
    """A page with its marked tables replaced."""
    bodies = {"headline": headline(records), "kinds": class_table(records, SHORT)}
    return MARKS.sub(lambda mark: f"{mark[1]}\n{bodies[mark[2]]}\n\n{mark[3]}", text)


def with_record(source: str, records: list[Row]) -> str:
    """The tools' source with its record replaced."""
    lines = []
    for name, mine in record_for_tools(records).items():
        rows = "".join(
            f'        "{kind}": Between({", ".join(f"{round(value, 2)}" for value in each)}),\n'
            for kind, each in mine.items()
        )
        lines.append(f'    "{name}": {{\n{rows}    }},\n')
    source = RECORD.sub(lambda found: found[1] + "".join(lines) + found[2], source)
    rows = []
    for name, each in ordinary(records).items():
        mean, sd = (f"Points({', '.join(str(round(value, 1)) for value in each[what])})" for what in ("mean", "sd"))
        rows.append(f'    "{name}": SlopesError(mean={mean}, sd={sd}),\n')
    return SLOPES.sub(lambda found: found[1] + "".join(rows) + found[2], source)


def places() -> list[Path]:
    """Pages with marked tables."""
    return [each for each in sorted(DOCS.glob("*.md")) if MARKS.search(each.read_text(encoding="utf-8"))]


def write(found: Row) -> None:
    """Write everything that follows from the results."""
    from . import page as study_page  # which takes its headline from here

    engines.write(PAGE, page(found))
    for place in places():
        place.write_text(with_tables(place.read_text(encoding="utf-8"), found["records"]), encoding="utf-8")
    TRADE.write_text(with_record(TRADE.read_text(encoding="utf-8"), found["records"]), encoding="utf-8")
    study_page.PAGE.write_text(study_page.page(study.read_results()), encoding="utf-8")  # its first lines
    print(f"wrote {PAGE}, the tables in {', '.join(each.name for each in places())}, and {TRADE}")
