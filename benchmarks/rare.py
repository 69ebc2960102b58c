"""The saving by fixed-effort splitting for a rarely reached line: measured, and written into docs/rare.md.

python -m benchmarks.rare --minutes 20     more logs and repetitions into rare.json, then the page's figures again
python -m benchmarks.rare --minutes 0      the figures again from rare.json

A population of logs slides. From those that reach the next line, the original number of logs is drawn again (children).
Each starts from its parent's state there, perturbed by a tiny amount, and slides on. The product of the shares is the
probability; its interval is that of independent repetitions. Costs are counted in the engine's steps, which do not
depend on other work on the machine. Any moment after a line was first touched is suitable for a restart if it is
determined by the log's past; these are whole half seconds, and logs that restart at the same one slide in one call.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_engine import FIDELITIES, STOP_REASONS, Lines, Scene, Start, place_logs, slide
from deadwood_engine.limits import GRAVITY
from deadwood_engine.log_body import CENTRE, LENGTH

from . import engines, scenes, study

Array = NDArray[np.float64]

HERE = Path(__file__).parent
PAGE, MEASURED = HERE.parent / "docs" / "rare.md", HERE / "rare.json"
STEMS_PER_HA, CASE, DRAFT = 800.0, scenes.CASES["forest"], FIDELITIES["draft"]
LEVELS = (260.0, 235.0, 200.0, 170.0, 140.0, 120.0, 100.0, 90.0)  # [m] y of the lines; reached by 1 in 8 to 1 in 6000
NEAR_PERCENT = LEVELS.index(200.0)  # reached by 1 in 85
MANY_FAMILIES = (1, 2, 3)  # levels whose children have enough parents to determine how similar siblings are
LEAST_TOLD = 10  # repetitions from which their variance is reported
THREADS = 2  # the same bits with any number
MOMENT = 0.5  # [s] logs restart at whole multiples of it
# logs per level, relative change of velocities, repetitions in a round
KINDS = ((400, 1e-9, 3), (400, 1e-2, 1))
PLAIN_BLOCK, PLAIN_FIRST, SPLIT_FIRST = 8000, 1000, 200_000  # blocks of ``scenes.logs_of_block``
PLAIN_EACH = 1  # blocks of plain logs in a round
PROBABILITIES, WIDTHS = (1e-1, 1e-2, 1e-3, 1e-4), (0.1, 0.2, 0.5)  # of the table of the number of logs needed


class Population(Protocol):
    """Walkers on their way to rare places."""

    def __len__(self) -> int: ...

    def take(self, rows: NDArray[np.int64]) -> Self:
        """The members in these rows."""
        ...

    def advance(self, level: int) -> tuple[NDArray[np.int64], Self]:
        """Rows of the members that reach a level, and these members in their state at the entry."""
        ...

    def shaken(self, rng: np.random.Generator) -> Self:
        """The same, with the smallest change that distinguishes siblings."""
        ...


def fixed_effort(population: Population, levels: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Shares that reach each level from the previous one; (pairs of siblings, pairs that both reach) at each level.

    The mean of the product of the shares is the probability, whatever the siblings have in common. Every parent has
    as many children as any other, or one more.
    """
    number = len(population)
    shares, pairs, parent = np.zeros(levels), np.zeros((levels, 2)), np.arange(number)
    for level in range(levels):
        rows, entered = population.advance(level)
        shares[level] = len(rows) / number
        for column, family in enumerate((np.bincount(parent), np.bincount(parent[rows]))):
            pairs[level, column] = (family * (family - 1)).sum()
        if len(rows) == 0 or level == levels - 1:
            break
        extra = rng.permutation(len(rows))[: number % len(rows)]
        parent = np.concatenate([np.repeat(np.arange(len(rows)), number // len(rows)), extra])
        population = entered.take(parent).shaken(rng)
    return shares, pairs


@dataclass(frozen=True)
class Sliding:
    """Logs on their way down the slope; ``cost`` adds up the steps of all that descend from it.

    start : states; had : bool (n, levels), lines reached before; change : [-] of velocities
    """

    scene: Scene
    start: Start
    had: NDArray[np.bool_]
    change: float
    cost: dict[str, float]

    def __len__(self) -> int:
        return len(self.had)

    def take(self, rows: NDArray[np.int64]) -> Sliding:
        start = Start(self.start.frame[rows], self.start.state[rows], self.start.body[rows])
        return Sliding(self.scene, start, self.had[rows], self.change, self.cost)

    def shaken(self, rng: np.random.Generator) -> Sliding:
        state = self.start.state.copy()
        state[:, 7:13] *= 1.0 + self.change * rng.standard_normal((len(state), 6))
        return Sliding(self.scene, Start(self.start.frame, state, self.start.body), self.had, self.change, self.cost)

    def advance(self, level: int) -> tuple[NDArray[np.int64], Sliding]:
        """Slide to the end, then those that reach the line once more, up to there.

        ``needed`` counts the steps of an engine that stops at the line by itself.
        """
        result = slide(self.scene, self.start, DRAFT, time_limit=study.TIME_LIMIT, threads=THREADS)
        reach = self.had | result.reach
        rows = np.flatnonzero(reach[:, level])
        self.cost["steps"] += result.steps.sum()
        self.cost["needed"] += np.delete(result.steps, rows).sum()
        touched = np.where(self.had[rows, level], 0.0, result.reach_time[rows, level])
        if level == len(LEVELS) - 1:
            until = result.steps[rows] * touched / np.maximum(result.duration[rows], MOMENT)
            self.cost["needed"] += until.sum()
            return rows, self
        entered = self.take(rows)
        state, had = entered.start.state.copy(), entered.had.copy()
        moments = np.maximum(MOMENT, MOMENT * np.ceil(touched / MOMENT))
        for moment in np.unique(moments):
            these = np.flatnonzero(moments == moment)
            part = entered.take(these)
            there = slide(self.scene, part.start, DRAFT, time_limit=float(moment), threads=THREADS)
            state[these], had[these] = there.last_state, had[these] | there.reach
            moving = there.stop_reason == STOP_REASONS.index("time_limit")
            # a state's velocities are those of the middle of the previous step; those of a start belong to the node
            fall = 0.5 * GRAVITY * _last_step(self.scene, part.start.body, there.last_state)
            state[these, 9] -= np.where(moving, fall, 0.0)
            for name in ("steps", "needed"):
                self.cost[name] += there.steps.sum()
        return rows, Sliding(
            self.scene, Start(entered.start.frame, state, entered.start.body), had, self.change, self.cost
        )


def _last_step(scene: Scene, body: Array, state: Array) -> Array:
    """Length of the previous step [s], from the speed of the ends and the spin: that of a log in contact, as most
    are in a forest, without a tree beside it.
    """
    turn = np.cross(state[:, 10:13], state[:, 13:16])
    ends = (-body[:, CENTRE], body[:, LENGTH] - body[:, CENTRE])
    fastest = np.max([np.linalg.norm(state[:, 7:10] + arm[:, None] * turn, axis=1) for arm in ends], axis=0)
    travel = DRAFT.travel_cells * scene.arrays.terrain.cell
    step = np.minimum(DRAFT.time_step, travel / (0.5 * (fastest + np.sqrt(fastest**2 + 2.0 * GRAVITY * travel))))
    spin = np.abs((state[:, 10:13] * state[:, 13:16]).sum(axis=1))
    return np.minimum(step, DRAFT.roll_angle / np.maximum(spin, DRAFT.roll_angle / DRAFT.time_step))


def forest() -> Scene:
    """The page's forest, four times as dense, with a line for each level."""
    ends = [[(scenes.LINE_MARGIN, y), (scenes.WIDTH - scenes.LINE_MARGIN, y)] for y in LEVELS]
    lines = Lines(np.array(ends).reshape(-1, 2), 2 * np.arange(len(LEVELS) + 1))
    half = 0.5 * CASE.cell
    heights, trees = scenes.ground(CASE.name, CASE.cell), scenes.forest(STEMS_PER_HA)
    return Scene.prepare(heights, CASE.cell, half, half, friction=CASE.friction, trees=trees, lines=lines)


def measure(known: dict[str, Any], *, until: float) -> None:
    """Plain logs and repetitions of each kind in turn, until the time is up; each continues where it ended."""
    scene = forest()
    plain = known.setdefault("plain", {"logs": 0, "reach": [0] * len(LEVELS), "steps": 0, "cpu_s": 0.0})
    if time.time() < until:
        known["from"] = study.provenance()
    while time.time() < until:
        for _ in range(PLAIN_EACH):
            logs = scenes.logs_of_block(PLAIN_FIRST + plain["logs"] // PLAIN_BLOCK, PLAIN_BLOCK)
            result = slide(scene, logs, DRAFT, time_limit=study.TIME_LIMIT, threads=THREADS)
            plain["logs"] += PLAIN_BLOCK
            plain["reach"] = [int(n) for n in plain["reach"] + result.reach.sum(axis=0)]
            plain["steps"] += int(result.steps.sum())
            plain["cpu_s"] += result.cost["cpu_s"]
        for number, change in [(n, c) for n, c, often in KINDS for _ in range(often)]:
            kept = known.setdefault(f"{number} logs, {change:g}", [])
            kept.append(repetition(scene, number, change, len(kept)))
            MEASURED.write_text(json.dumps(known))
            if time.time() > until:
                break


def repetition(scene: Scene, number: int, change: float, which: int) -> dict[str, Any]:
    """Shares, pairs of siblings and steps of one separate population."""
    cost = {"steps": 0.0, "needed": 0.0}
    start = place_logs(scene, scenes.logs_of_block(SPLIT_FIRST + which, number))
    begin = Sliding(scene, start, np.zeros((number, len(LEVELS)), bool), change, cost)
    shares, pairs = fixed_effort(begin, len(LEVELS), np.random.default_rng((scenes.SEED, number, which)))
    return {"shares": shares.tolist(), "pairs": pairs.tolist()} | {name: float(n) for name, n in cost.items()}


def bootstrap(values: Array, number: int, draws: int = 4000) -> Array:
    """Draws of a number of the repetitions, (draws, number), with replacement."""
    return values[np.random.default_rng(scenes.SEED).integers(0, len(values), (draws, number))]


def products(kept: list[dict[str, Any]]) -> Array:
    """The probability of every line from each repetition, (repetitions, levels)."""
    return np.cumprod(np.array([one["shares"] for one in kept], float), axis=1).astype(float)


def kinship(kept: list[dict[str, Any]], level: int) -> float:
    """Correlation of reaching a level among children of one parent, over all repetitions."""
    share = np.array([one["shares"][level] for one in kept])
    pairs, both = np.array([one["pairs"][level] for one in kept]).T
    return float((both - pairs * share**2).sum() / (pairs * (share - share**2)).sum())


def gain_of(known: dict[str, Any], kept: list[dict[str, Any]], level: int, cost: str) -> tuple[float, float, float]:
    """Cost of plain logs divided by that of splitting, for the same interval of a line; with its 95 % bootstrap
    interval.

    Splitting pays for all levels, also those beyond that line.
    """
    plain = known["plain"]
    share = plain["reach"][level] / plain["logs"]
    logs = np.mean([one[cost] for one in kept]) / plain["steps"] * plain["logs"]  # that cost as much as one repetition
    values = products(kept)[:, level]
    worth = share * (1.0 - share) / logs
    spread = bootstrap(values, len(values)).var(axis=1, ddof=1)
    low, high = worth / np.maximum(np.quantile(spread, (0.975, 0.025)), 1e-300)
    return float(worth / values.var(ddof=1)), float(low), float(high)


def figures(known: dict[str, Any]) -> str:
    """The page's tables in Markdown."""
    plain, last, origin = known["plain"], len(LEVELS) - 1, known["from"]
    n, steps = plain["logs"], plain["steps"] / plain["logs"]

    def share(count: int) -> str:
        low, high = wilson_interval(count, n)
        return f"{count / n:.3g} ({low:.3g} to {high:.3g})"

    lines = [
        f"- machine: {origin['machine']}; {origin['versions']}; engine {origin['engine']}, {origin['date']}; "
        f"seed {scenes.SEED}",
        f"- {n:,} plain logs at `draft`: {1e3 * plain['cpu_s'] / n:.2f} ms and {steps:.0f} steps each; the line at y "
        f"{LEVELS[NEAR_PERCENT]:g} m is reached by {share(plain['reach'][NEAR_PERCENT])} of them, the one at "
        f"{LEVELS[last]:g} m by {share(plain['reach'][last])}, {plain['reach'][last]} logs".replace(",", " ", 1),
        f"- levels: lines at y {', '.join(f'{y:g}' for y in LEVELS)} m",
        "",
        "| logs per level | velocities perturbed by | repetitions | cost of one [plain logs] | p, last line | gain | "
        "gain if the engine stopped logs at lines | siblings' correlation, second to fourth level |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for number, change, _ in KINDS:
        kept = known.get(f"{number} logs, {change:g}", [])
        if len(kept) < 2:
            continue
        shown = "{:.2g} ({:.2g} to {:.2g})".format if len(kept) >= LEAST_TOLD else "too few".format
        values = products(kept)[:, -1]
        taken, needed = (f"{np.mean([one[c] for one in kept]) / steps:.0f}" for c in ("steps", "needed"))
        gains = [shown(*gain_of(known, kept, -1, cost)) for cost in ("steps", "needed")]
        alike = ", ".join(f"{kinship(kept, level):.2f}" for level in MANY_FAMILIES)
        error = values.std(ddof=1) / math.sqrt(len(values))
        lines.append(
            f"| {number} | {change:g} | {len(kept)} | {taken}, needed {needed} | {values.mean():.2g} ± {error:.1g} | "
            f"{gains[0]} | {gains[1]} | {alike} |"
        )
    number, change, _ = KINDS[0]
    kept = known[f"{number} logs, {change:g}"]
    lines += [
        "",
        f"| line at y [m] | plain share | {len(kept)} repetitions of {number} logs perturbed by {change:g}: mean ± "
        "standard error | apart [standard errors of both] | gain, all levels paid |",
        "| --- | --- | --- | --- | --- |",
    ]
    for level, place in enumerate(LEVELS):
        p = plain["reach"][level] / n
        values = products(kept)[:, level]
        error = values.std(ddof=1) / math.sqrt(len(values))
        lines.append(
            f"| {place:g} | {share(plain['reach'][level])} | {values.mean():.3g} ± {error:.1g} | "
            f"{(values.mean() - p) / math.hypot(error, math.sqrt(p * (1.0 - p) / n)):+.1f} | "
            + "{:.2g} ({:.2g} to {:.2g}) |".format(*gain_of(known, kept, level, "steps"))
        )
    return "\n".join(lines)


def logs_needed(probability: float, width: float) -> float:
    """Number of logs for which the 95 % interval of such a rare share has this relative half-width."""
    return 1.959964**2 * (1.0 - probability) / (probability * width**2)


def write(known: dict[str, Any]) -> None:
    """Write the figures into the page, between its marks."""
    page, parts = PAGE.read_text(encoding="utf-8"), {"figures": figures(known), "needed": needed()}
    for name, text in parts.items():
        pattern = rf"(?s)(<!-- {name} -->\n).*?(<!-- end of {name} -->)"
        page = re.sub(pattern, lambda found, text=text: found[1] + text + "\n" + found[2], page)
    engines.write(PAGE, page)


def needed() -> str:
    """The table of the number of plain logs for rare shares."""
    rows = ["| share | " + " | ".join(f"± {w:.0%} of it" for w in WIDTHS) + " |", "| --- |" + " --- |" * len(WIDTHS)]
    for p in PROBABILITIES:
        counts = [float(f"{logs_needed(p, w):.2g}") for w in WIDTHS]
        rows.append(f"| 1 in {1 / p:.0f} | " + " | ".join(f"{c:,.0f}".replace(",", " ") for c in counts) + " |")
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.rare", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=20.0, help="begin no new repetitions after so long")
    ask = parser.parse_args()
    known = json.loads(MEASURED.read_text()) if MEASURED.is_file() else {}
    if ask.minutes > 0.0 and known.get("from", {}).get("engine") != study.provenance()["engine"]:
        known = {}  # logs of two engines must not be added
    measure(known, until=time.time() + 60.0 * ask.minutes)
    write(known)


if __name__ == "__main__":
    main()
