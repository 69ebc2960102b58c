"""How far off each fidelity is, over a population of random slopes instead of a few that somebody made.

python -m benchmarks.population --minutes 20        as many slopes as that time allows, then the page
python -m benchmarks.population --seeds 0-299       these slopes, however long it takes
python -m benchmarks.population --page              page, tables and the tools' record from population.json

A slope's number is its seed (``slopes``). Its line, and whether it is of use at all, are decided by a pilot on other
logs than those measured, once: later engines are measured on the same slopes. The order is fixed, so that a shorter run
measures the first slopes of a longer one; what has been slid is kept (``.work``), so that the next call continues. One
third of the slopes is held out (``held_out``): nothing is fitted to them.

The last part of the time goes to the error of `reference` itself: on every seventh slope it slides, and again with half
its step, travel and rings.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import multiprocessing
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.scene.slope_kind import kind_of
from deadwood_engine import FIDELITIES, Logs, Result, slide

from . import slopes, study
from .settings import SETTINGS
from .slopes import Slope

JSON = study.HERE / "population.json"
SLID = ("draft", "standard", "fine")
HALVED = "reference halved"
FINEST = ("reference", HALVED)
PAIRS = (*((name, "fine") for name in SLID[:-1]), ("fine", "reference"), (HALVED, "reference"))
LOGS, LOGS_AT_FINEST = 400, 200
MEASURED, PILOT = 1, 2  # streams of logs
ATTEMPTS = 60
FEW, MANY = 60, 200  # logs of the pilot: whether any line may be of use, and which
OF_USE = (0.2, 0.8)  # share of the pilot's logs that reach the line
NEARLY = 0.36  # greatest distance of a line's reach from a half among the few
REFERENCE_SHARE = 0.25  # of the time
Row = dict[str, Any]


def held_out(seed: int) -> bool:
    """A third of the slopes, fixed here before any was measured, to which nothing is fitted."""
    return seed % 3 == 2


def at_finest(seed: int) -> bool:
    """Slopes on which `reference` and its halved steps slide, too."""
    return seed % 7 == 0


def slid(slope: Slope, logs: Logs, name: str) -> Result:
    """Results and cost of logs at a fidelity."""
    fidelity = SETTINGS[name].fidelity if name in SETTINGS else FIDELITIES[name]
    rolling = slope.made_of["rolling"]
    return slide(slope.scene, logs, fidelity, threads=1, time_limit=study.TIME_LIMIT, rolling_friction=rolling)


@functools.cache
def folder() -> Path:
    """Where results of this engine, these slopes and these fidelities are kept."""
    what = (study.measured_as(), Path(slopes.__file__).read_bytes(), tuple(SETTINGS[name].fidelity for name in FINEST))
    what += tuple(FIDELITIES[name] for name in SLID)
    return study.WORK / f"population-{hashlib.sha256(repr(what).encode()).hexdigest()[:12]}"


def chosen(seed: int, before: Row | None) -> tuple[Slope, int, float]:
    """The slope of a seed, which of its lines counts, and the share of the pilot's logs that reached it."""
    if before:
        return slopes.slope_of(seed, before["attempt"]), slopes.LINES_Y.index(before["line_y"]), before["pilot"]
    for attempt in range(ATTEMPTS):
        if not slopes.slides(seed, attempt):
            continue
        slope = slopes.slope_of(seed, attempt)
        few, many = slope.logs(PILOT, FEW), slope.logs(PILOT, MANY)
        if np.abs(slid(slope, few, "standard").reach.mean(axis=0) - 0.5).min() > NEARLY:
            continue
        share = slid(slope, many, "standard").reach.mean(axis=0)
        line = int(np.argmin(np.abs(share - 0.5)))
        if OF_USE[0] <= share[line] <= OF_USE[1]:
            return slope, line, float(share[line])
    raise RuntimeError(f"no attempt of slope {seed} is of use")


def measure(seed: int, before: Row | None, names: Sequence[str], count: int) -> Row:
    """Slide what is missing on a slope, and return its record."""
    place = folder() / f"{seed}-{count}.json"
    record: Row = json.loads(place.read_text()) if place.is_file() else {}
    missing = [name for name in names if name not in record.get("reached", {})]
    if not missing:
        return record
    slope, line, pilot = chosen(seed, record or before)
    logs = slope.logs(MEASURED, count)
    if not record:
        kind = kind_of(slope.scene, logs)
        record = {
            "seed": seed, "attempt": slope.attempt, "line_y": slopes.LINES_Y[line], "pilot": pilot, "kind": kind.name,
            "noise_over_cell": kind.noise_over_cell, "beds": kind.beds, "made_of": slope.made_of, "reached": {},
            "cpu_ms": {}, "runout_m": {},
        }  # fmt: skip
    for name in missing:
        some = logs.take(slice(LOGS_AT_FINEST)) if name in FINEST else logs
        result = slid(slope, some, name)
        # as text: 400 logs are 100 letters, and every pair of fidelities can be compared later
        record["reached"][name] = np.packbits(result.reach[:, line]).tobytes().hex()
        record["cpu_ms"][name] = 1e3 * result.cost["cpu_s"] / len(some)
        record["runout_m"][name] = float(np.mean(slopes.RELEASE[1] - result.end_position[:, 1]))
    record["logs"] = {name: min(count, LOGS_AT_FINEST) if name in FINEST else count for name in record["reached"]}
    place.parent.mkdir(parents=True, exist_ok=True)
    temporary = place.with_suffix(".tmp")  # complete or not at all
    temporary.write_text(json.dumps(study.rounded(record)))
    temporary.rename(place)
    return json.loads(place.read_text())


def reached(record: Row, name: str) -> np.ndarray:
    """Whether each log reached the line."""
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(record["reached"][name]), np.uint8))
    return bits[: record["logs"][name]].astype(bool)


def measured(
    seeds: Sequence[int], names: Sequence[str], count: int, before: dict[int, Row], *, threads: int, until: float
) -> Iterator[Row]:
    """Records of slopes, each as soon as it is there; all that were begun by ``until`` (clock time) are finished."""
    warm = slopes.slope_of(0, 0)
    slid(warm, warm.logs(PILOT, 1), "draft")  # compiled once, for all processes
    waiting, running = iter(seeds), set[Future[Row]]()
    with ProcessPoolExecutor(threads, multiprocessing.get_context("spawn")) as pool:
        while True:
            while len(running) < threads and time.time() < until and (seed := next(waiting, None)) is not None:
                running.add(pool.submit(measure, seed, before.get(seed), names, count))
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            yield from (each.result() for each in done)


def read() -> Row:
    """The results file; without records if there is none."""
    return json.loads(JSON.read_text(encoding="utf-8")) if JSON.is_file() else {"records": []}


def write(records: dict[int, Row]) -> None:
    """The results file, a line for each slope."""
    head = json.dumps({"source": study.provenance()})[1:-1]
    lines = ",\n".join(json.dumps(study.rounded(records[seed]), sort_keys=True) for seed in sorted(records))
    JSON.write_text(f'{{{head},\n"records": [\n{lines}\n]}}\n', encoding="utf-8")


def _seeds(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.population",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no slope after so long")
    parser.add_argument("--seeds", type=_seeds, default=list(range(1000)), metavar="FIRST-LAST")
    parser.add_argument("--logs", type=int, default=LOGS, help="on each slope, at each fidelity")
    parser.add_argument("--fidelities", nargs="+", choices=SLID, default=list(SLID))
    parser.add_argument("--threads", type=int, default=2, help="slopes at a time")
    parser.add_argument("--no-reference", action="store_true", help="leave the error of reference itself out")
    parser.add_argument("--page", action="store_true", help="only the pages, from population.json")
    ask = parser.parse_args()
    if not ask.page:
        stored = read()
        before = {each["seed"]: each for each in stored["records"]}
        # slopes of another engine, or that were measured otherwise, are measured again
        began, seconds, found = time.time(), 60.0 * ask.minutes, dict[int, Row]()
        parts = [(ask.seeds, tuple(ask.fidelities), seconds * (1.0 if ask.no_reference else 1.0 - REFERENCE_SHARE))]
        if not ask.no_reference:
            parts.append(([each for each in ask.seeds if at_finest(each)], FINEST, seconds))
        for seeds, names, limit in parts:
            begun = [seed for seed in seeds if names is not FINEST or seed in found]
            for row in measured(begun, names, ask.logs, before, threads=ask.threads, until=began + limit):
                found[row["seed"]] = row
                print(
                    f"{row['seed']:4d} {row['kind']:10s} {', '.join(names)}: {time.time() - began:5.0f} s", flush=True
                )
                write(found)
    from . import population_page

    population_page.write(read())


if __name__ == "__main__":
    main()
