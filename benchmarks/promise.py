"""Does `slide-logs --fidelity auto --error` keep its promise, and what does it save? Many runs from one pool.

python -m benchmarks.promise                    from the stored logs of draft, standard, fine and reference
python -m benchmarks.promise --logs 4000        first slides this number of logs per scene and fidelity, if missing

The results of each stored log (``study``) form a pool. A run draws its logs from the pool with replacement, so the pool
is the population and its share at `reference` the true value, known exactly; the decisions are the product's own
(`keep_error`), with what it assumes on a slope of the pool's kind. That assumption is about many slopes
(``population`` shows on held-out ones whether it holds); each pool's own distance, with its sampling error, is given
beside it. Writes ``promise.json`` and ``promise.md``.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.scene.slope_kind import kind_of
from deadwood_algorithms.simulate.auto import Option, Slid, keep_error, needed, trusted_of
from deadwood_algorithms.simulate.fidelity_trade import COSTS, assumed_errors
from deadwood_algorithms.simulate.promise import Between
from deadwood_algorithms.stats.statistics import paired_interval

from . import engines, scenes, study
from .settings import SETTINGS

JSON, PAGE = study.HERE / "promise.json", study.HERE / "promise.md"
NAMES = ("draft", "standard", "fine", "reference")
RUNS, ERRORS, CAP, SEED = 200, (0.02, 0.03, 0.05, 0.07), 200_000, 20261124
APART = "{difference:+.1f} ({low:+.1f} to {high:+.1f}) | {differ:.0f} %"
SCENES = ["forest", "rough", "cliff", "gully"]
ASSUMED = ("standard", "none", "draft")


class Pool:
    """The stored logs of a scene: who reached its line at each fidelity, and the CPU seconds of a log."""

    def __init__(self, name: str) -> None:
        samples = {each: study.load(name, SETTINGS[each]) for each in NAMES}
        if any(sample is None for sample in samples.values()):
            raise SystemExit(f"{name}: nothing is stored; run with --logs")
        blocks = min(len(sample.cost) for sample in samples.values() if sample)
        row = scenes.CASES[name].line_row
        self.name, self.logs = name, blocks * study.BLOCK
        self.kind = kind_of(scenes.build(name).scene, scenes.logs_of_block(0, study.BLOCK)).words
        self.reach: dict[str, NDArray[np.bool_]] = {}
        self.cost: dict[str, float] = {}
        for each, sample in samples.items():
            assert sample is not None
            part = sample.head(blocks)
            self.reach[each] = part.fields["reach"][:, row].astype(bool)
            self.cost[each] = float(np.median(part.cost[:, 0])) / study.BLOCK

    def apart(self, name: str) -> dict[str, float]:
        """The share at a fidelity minus that at reference, in this pool, with the interval for the slope."""
        a, b = self.reach["reference"], self.reach[name]
        lost, gained = int((a & ~b).sum()), int((b & ~a).sum())
        low, high = paired_interval(lost, gained, self.logs)
        return {
            "difference": (gained - lost) / self.logs,
            "low": low,
            "high": high,
            "differ": (lost + gained) / self.logs,
        }


def one_run(
    pool: Pool, error: float, assumed: dict[str, Between], rng: np.random.Generator
) -> tuple[str, float, float, int]:
    """The chosen fidelity, the error of its share, total CPU seconds, and logs of the run."""
    drawn = rng.integers(0, pool.logs, CAP)
    slid: dict[str, int] = {}

    def slide(name: str, n: int) -> Slid:
        slid[name] = max(n, slid.get(name, 0))
        return Slid(pool.reach[name][drawn[:n], None])

    chosen = keep_error(error, CAP, ["line"], slide, assumed)
    name = chosen.option.fidelity
    off = abs(float(pool.reach[name][drawn[: chosen.logs]].mean()) - float(pool.reach["reference"].mean()))
    spent = sum(pool.cost[each] * n for each, n in slid.items())
    return name, off, spent, chosen.logs


def measure(pool: Pool, error: float, up_to: str) -> dict[str, Any]:
    assumed = assumed_errors(up_to, pool.kind)
    rng = np.random.default_rng((SEED, round(1e4 * error), ASSUMED.index(up_to)))
    runs = [one_run(pool, error, assumed, rng) for _ in range(RUNS)]
    chosen = [name for name, *_ in runs]
    # The same promise planned with the known share, and without knowing it
    share = float(pool.reach["reference"].mean())
    trusted = trusted_of(assumed)
    known, blind = (
        min(logs * pool.cost[each.fidelity] for each in trusted if (logs := needed(error, each, [p], 2**40)))
        for p in (share, 0.5)
    )
    alone = (needed(error, Option("standard", Between()), [share], 2**40) or 0) * pool.cost["standard"]
    spent = float(np.mean([cost for _, _, cost, _ in runs]))
    return {
        "scene": pool.name, "error": error, "assume": up_to, "runs": RUNS,
        "held": int(sum(off <= error for _, off, _, _ in runs)),
        "chosen": {name: chosen.count(name) for name in COSTS if name in chosen},
        "logs": float(np.mean([n for *_, n in runs])), "cpu_s": spent, "of_standard_alone": spent / alone,
        "saved_known": 1.0 - spent / known, "saved_blind": 1.0 - spent / blind,
    }  # fmt: skip


def write(pools: list[Pool], rows: list[dict[str, Any]]) -> None:
    facts = [
        {
            "scene": pool.name, "kind": pool.kind, "logs": pool.logs, "p": float(pool.reach["reference"].mean()),
            "assumed": {n: Option(n, each).calculation for n, each in assumed_errors("draft", pool.kind).items()},
            "cpu_ms": {name: 1e3 * pool.cost[name] for name in NAMES},
            "apart": {name: pool.apart(name) for name in NAMES[:-1]},
        }
        for pool in pools
    ]  # fmt: skip
    found = {"pools": facts, "rows": rows, "source": study.provenance()}
    JSON.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    write_page(found)


def write_page(found: dict[str, Any]) -> None:
    engines.write(PAGE, "\n".join(page(found)) + "\n")


def page(found: dict[str, Any]) -> list[str]:
    rows, source = found["rows"], found["source"]
    total, held = sum(row["runs"] for row in rows), sum(row["held"] for row in rows)
    worst = min(rows, key=lambda row: row["held"])
    below = sum(row["held"] < 0.95 * row["runs"] for row in rows)
    price = sorted(row["of_standard_alone"] for row in rows)
    r = sorted(p["apart"][name]["differ"] / (p["p"] * (1.0 - p["p"])) for p in found["pools"] for name in NAMES[:-1])
    lines = [
        "# Is the promised error kept, and what does it save?",
        "",
        "Written by `python -m benchmarks.promise`. Do not edit.",
        "",
        f"`slide-logs --fidelity auto --error E`: in {held} of {total} runs the reach was within E of the "
        f"true value; in "
        f"the worst row, in {worst['held']} of {worst['runs']} ({worst['scene']}, E {100 * worst['error']:g} points, "
        f"--assume {worst['assume']}). Engine of commit {source['commit']} (sources {source['engine']}), "
        f"{source['date']}.",
        "",
        f"{below} of {len(rows)} rows are below 95 %; {rows[0]['runs']} runs determine this share to ±3 points.",
        "",
        "Compared with a run at `standard` that promises nothing about the error of calculation, nothing is saved: the "
        f"promise costs {price[0]:.2g} to {price[-1]:.2g} times as much. It saves logs, because their number "
        f"is planned "
        "from the share observed on the slope instead of 50 %. To show that a cheaper fidelity is good enough by "
        "sliding the same logs at two fidelities would not pay, and is not done: r, the share of logs with different "
        f"outcomes divided by p (1 - p), is {r[0]:.1f} to {r[-1]:.1f} here (2 is pure chance). With q, the "
        f"ratio of the "
        "costs, it could pay only if sqrt(r) + sqrt(q) < 1, whatever E is.",
        "",
        "## The pools",
        "",
        "A run draws its logs with replacement from the stored logs of a scene, whose share at `reference` is the true "
        "value. *Assumed* is what the error of `standard` does not exceed on 95 of 100 slopes of the scene's kind "
        "([population](population.md)). The table shows the difference in each pool, with its interval for the slope "
        "of which the pool is a sample.",
        "",
        f"| scene | kind | logs | reach [%] | CPU ms per log, {' / '.join(NAMES)} | assumed [points] "
        "| standard - reference [points] | different outcome | draft - reference [points] | different outcome |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for pool in found["pools"]:
        apart = [
            "{difference:+.1f} ({low:+.1f} to {high:+.1f}) | {differ:.0f} %".format(
                **{k: 100 * v for k, v in a.items()}
            )
            for a in (pool["apart"]["standard"], pool["apart"]["draft"])
        ]
        cost = " / ".join(f"{pool['cpu_ms'][name]:.2g}" for name in NAMES)
        lines.append(
            f"| {pool['scene']} | {pool['kind']} | {pool['logs']} | {100 * pool['p']:.1f} | {cost} "
            f"| ±{100 * pool['assumed']['standard']:.1f} | {' | '.join(apart)} |"
        )
    lines += [
        "",
        "## The runs",
        "",
        "Saved: CPU time relative to the cheapest run with the same promise that is planned without a look at this "
        "slope: for a share of 50 %, because it is not known, or for the known share; the second shows the cost of "
        "looking. The last column is the CPU time relative to that of a run at `standard` with enough logs for a "
        "sampling error of E alone, which promises nothing about the error of calculation.",
        "",
        "| scene | E [points] | --assume | kept [%] | chosen | logs | saved, share unknown | saved, share known "
        "| times `standard` alone |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        chosen = ", ".join(f"`{name}`" + (f" {n}" if n < row["runs"] else "") for name, n in row["chosen"].items())
        kept = f"{100 * row['held'] / row['runs']:g}"
        lines.append(
            f"| {row['scene']} | {100 * row['error']:g} | {row['assume']} | {kept} | {chosen} "
            f"| {row['logs']:.0f} | {100 * row['saved_blind']:+.0f} % | {100 * row['saved_known']:+.0f} % "
            f"| {row['of_standard_alone']:.2g} |"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.promise", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--scenes", nargs="+", default=SCENES, choices=list(scenes.CASES))
    parser.add_argument("--logs", type=int, default=0, help="slide this number per scene and fidelity first")
    parser.add_argument("--page", action="store_true", help="the page again from promise.json")
    parser.add_argument("--threads", type=int, default=2)
    ask = parser.parse_args()
    if ask.page:
        write_page(json.loads(JSON.read_text(encoding="utf-8")))
        return
    if ask.logs:
        settings = [SETTINGS[name] for name in NAMES]
        study.run(ask.scenes, settings, ask.logs, threads=ask.threads, until=time.time() + 1e9)
    pools = [Pool(name) for name in ask.scenes]
    rows = [measure(pool, error, up_to) for up_to in ASSUMED for pool in pools for error in ERRORS]
    write(pools, rows)
    print(PAGE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
