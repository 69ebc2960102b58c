"""How far off a fidelity is in the effect of a change: the same logs with and without it, at each fidelity.

python -m benchmarks.what_if --minutes 15    as many slopes of the population as that time allows, then the pages
python -m benchmarks.what_if --minutes 0     pages and the tools' record from what_if.json

On a slope of the population (``population``) that has trees they are all felled; on another one a barrier 40 m long and
3 m high is built halfway between the releases and the line. The error is the difference of two paired differences: with
minus without the change at a fidelity, less the same at `fine`, of the same logs.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.simulate.piece import scene_without
from deadwood_engine import Barriers, Scene

from . import between, population, slopes, study

JSON = study.HERE / "what_if.json"
PAGE = study.HERE.parent / "docs" / "explanation" / "two-errors.md"
TRADE = study.HERE.parent / "algorithms/deadwood_algorithms/simulate/fidelity_trade.py"
RECORD = re.compile(r"(DIFFERENCE_ERRORS: [^\n]*\{\n).*?(^\}\n)", re.S | re.M)
MARKS = re.compile(r"(<!-- measured: what_if\b[^>]*-->\n).*?(<!-- end of measured: what_if -->)", re.S)
COARSER, FINE = ("draft", "standard"), "fine"
LONG, HIGH = 40.0, 3.0  # [m] of the barrier
Row = dict[str, Any]


def changed(slope: slopes.Slope, line_y: float) -> tuple[str, Scene]:
    """The change of a slope, in a word, and its scene with it."""
    scene = slope.scene
    if scene.tree_count:
        return "felled", scene_without(scene, np.arange(scene.tree_count))
    y, x = 0.5 * (slopes.RELEASE[1] + line_y), slopes.RELEASE[0]
    plate = np.array([(x - 0.5 * LONG, y), (x + 0.5 * LONG, y)])
    return "barrier", scene.with_barriers(Barriers(plate, np.array([0, 2]), np.array([HIGH])))


def measure(before: Row) -> Row:
    """Whether each log reached the line of a slope, without and with the change, at each fidelity."""
    slope = slopes.slope_of(before["seed"], before["attempt"])
    line = slopes.LINES_Y.index(before["line_y"])
    change, scene = changed(slope, before["line_y"])
    other = slopes.Slope(slope.number, slope.attempt, slope.made_of, scene)
    logs = slope.logs(population.MEASURED, population.LOGS)
    reached = {
        name: [np.packbits(population.slid(each, logs, name).reach[:, line]).tobytes().hex() for each in (slope, other)]
        for name in (*COARSER, FINE)
    }
    return {"seed": before["seed"], "change": change, "logs": len(logs), "reached": reached}


def effect(record: Row, name: str) -> NDArray[np.float64]:
    """What the change did to each log: 1 newly reaches the line, -1 no longer."""
    without, with_it = (
        np.unpackbits(np.frombuffer(bytes.fromhex(each), np.uint8))[: record["logs"]].astype(float)
        for each in record["reached"][name]
    )
    return with_it - without


def errors(records: list[Row], name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Errors of the effect [points] and their sampling variances, one a slope."""
    found = [100.0 * (effect(each, name) - effect(each, FINE)) for each in records]
    return np.array([each.mean() for each in found]), np.array([(each.var() + 50.0) / each.size for each in found])


def with_record(source: str, records: list[Row]) -> str:
    """The tools' source with these errors."""
    rows = ""
    for name in COARSER:
        mean = ", ".join(str(float(f"{each:.1f}")) for each in between.summary(*errors(records, name))["mean"])
        rows += f'    "{name}": Points({mean}),\n'
    return RECORD.sub(lambda found: found[1] + rows + found[2], source)


def said(found: Row) -> str:
    """The sentences of the page."""
    records, lines = found["records"], []
    for name in COARSER:
        row = between.summary(*errors(records, name))
        mean, low, high = row["mean"]
        sd, sd_low, sd_high = row["sd"]
        lines.append(
            f"- `{name}` is off by {mean:+.1f} ({low:+.1f} to {high:+.1f}) points in the effect of a change, in the "
            f"mean of {row['slopes']} random slopes, with a standard deviation of {sd:.1f} "
            f"({sd_low:.1f} to {sd_high:.1f}) points from slope to slope."
        )
    effects = [100.0 * effect(each, FINE).mean() for each in records]
    felled = sum(each["change"] == "felled" for each in records)
    lines.append(
        f"- The changes: all trees felled on {felled} slopes, a barrier built on {len(records) - felled}; at `fine` "
        f"they moved the reach by {min(effects):+.0f} to {max(effects):+.0f} points. "
        f"{records[0]['logs']} logs a slope; engine {found['source']['engine']}, {found['source']['date']}."
    )
    return "\n" + "\n".join(lines) + "\n\n"


def write(found: Row) -> None:
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARKS.sub(lambda marks: marks[1] + said(found) + marks[2], text), encoding="utf-8")
    TRADE.write_text(with_record(TRADE.read_text(encoding="utf-8"), found["records"]), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.what_if", description=__doc__)
    parser.add_argument("--minutes", type=float, default=15.0, help="begin no slope after so long")
    parser.add_argument("--threads", type=int, default=2, help="slopes at a time")
    ask = parser.parse_args()
    until = time.time() + 60.0 * ask.minutes
    old = json.loads(JSON.read_text(encoding="utf-8")) if JSON.is_file() else {"records": []}
    records = {each["seed"]: each for each in old["records"]}
    missing = [
        each
        for each in population.read()["records"]
        if each["seed"] not in records and (each["made_of"]["stems"] or not each["made_of"]["barrier_m"])
    ]
    with ProcessPoolExecutor(ask.threads) as pool:
        while time.time() < until and missing:
            some, missing = missing[: 2 * ask.threads], missing[2 * ask.threads :]
            for done in as_completed([pool.submit(measure, each) for each in some]):
                records[done.result()["seed"]] = done.result()
            rows = ",\n".join(json.dumps(records[seed]) for seed in sorted(records))
            head = json.dumps({"source": study.provenance()})[1:-1]
            JSON.write_text(f'{{{head},\n"records": [\n{rows}\n]}}\n', encoding="utf-8")
    write(json.loads(JSON.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
