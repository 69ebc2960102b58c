"""The gain from more threads, processes and machines: measured here, and computed for larger numbers.

python -m benchmarks.efficiency                        measure, and write it into docs/many-machines.md
python -m benchmarks.efficiency --logs 500 --no-page   a quick check

The same logs of the study's forest slide on 1, 2, ... threads of one process, and on as many processes of
``--scheduler local``; each round uses each of them once, and the medians of the rounds are reported. If other work
keeps the cores busy, as the load shows, wall times reflect the share of the cores that a run got; the CPU seconds of
all its processes, compared with those of the logs alone, show the overhead. For many workers the rule by which pieces
are sent out (`simulate.workers.piece_size`) is simulated with the times of these logs and the measured cost of a piece
in addition to its logs.
"""

from __future__ import annotations

import argparse
import heapq
import math
import os
import re
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
import psutil
from numpy.typing import NDArray

from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.simulate import workers as spread_workers
from deadwood_algorithms.simulate.batch import Batch, Sliding
from deadwood_algorithms.simulate.crew import Carried
from deadwood_algorithms.simulate.scheduler import workers_of
from deadwood_engine import FIDELITIES, Rasters, Result, slide

from . import scenes, study

PAGE = Path(__file__).parents[1] / "docs" / "many-machines.md"
MARKS = re.compile(r"(<!-- measured: efficiency\b[^>]*-->\n).*?(<!-- end of measured: efficiency -->)", re.S)
MANY = (2, 8, 32, 128, 512)  # numbers of workers for the computation
RECKONED_LOGS = 100_000
BANDS = np.zeros(0, np.int64)
LONG, LONG_SHARE = 100.0, 1e-3  # logs that take this many times as long, and their share
SHORT_S = 0.02  # time limit of the logs by which the cost of a piece is found


@dataclass(frozen=True)
class Took:
    """Seconds by the clock, of CPU in all processes, in this one, and of the logs alone; and of each log."""

    wall: float
    cpu: float
    here: float
    logs: float
    by_log: NDArray[np.float64]


class Clock:
    """Time since it was created, for the work of this process and its children."""

    def __init__(self) -> None:
        self.wall, self.cpu, self.here = time.perf_counter(), self._cpu(), time.process_time()

    @staticmethod
    def _cpu() -> float:
        mine = psutil.Process()
        return sum(sum(each.cpu_times()[:2]) for each in (mine, *mine.children(recursive=True)))

    def took(self, result: Result) -> Took:
        logs = result.cost["cpu_s"]
        by_log = result.steps * (logs / result.steps.sum())
        here = time.process_time() - self.here
        return Took(time.perf_counter() - self.wall, self._cpu() - self.cpu, here, logs, by_log)


def on_threads(fidelity: str, number: int, threads: int) -> Took:
    """Slide this number of logs on threads of this process."""
    scene, logs = scenes.build("forest").scene, scenes.logs_of_block(0, number)
    rasters = study.fresh_rasters(scene, threads)
    clock = Clock()
    return clock.took(
        slide(scene, logs, FIDELITIES[fidelity], time_limit=study.TIME_LIMIT, threads=threads, rasters=rasters)
    )


def on_workers(found: spread_workers.Workers, fidelity: str, number: int, limit: float = study.TIME_LIMIT) -> Took:
    """The same on processes that already have the scene."""
    scene, logs = scenes.build("forest").scene, scenes.logs_of_block(0, number)
    laws = {"time_limit": limit}
    sliding = Sliding("efficiency", scene, None, FIDELITIES[fidelity], laws, BANDS)
    rasters = Rasters.allocate(scene, 1)
    clock = Clock()
    return clock.took(found.slide(sliding, Batch(logs, goal=number), (), rasters, lambda done: False))


def reckoned(took: NDArray[np.float64], workers: int, each_piece_s: float, long: float = 0.0) -> tuple[float, float]:
    """Efficiency of a number of workers of one thread: with our pieces, and with equal shares sent at once.

    took : what each log took [s]; they are drawn from as often as needed; long : share of logs that take LONG times
    as long
    """
    rng = np.random.default_rng(1)
    drawn = rng.choice(took, RECKONED_LOGS)
    drawn[rng.random(drawn.size) < long] *= LONG
    before = np.concatenate([[0.0], np.cumsum(drawn)])
    ideal = before[-1] / workers
    free = [0.0] * workers  # time at which each worker is free
    given, done_s, done = 0, 0.0, 0
    while given < drawn.size:
        start = heapq.heappop(free)
        size = spread_workers.piece_size(drawn.size - given, workers, done_s / done if done else None)
        last = min(given + size, drawn.size)
        seconds = before[last] - before[given]
        heapq.heappush(free, start + seconds + each_piece_s)
        given, done_s, done = last, done_s + seconds, done + last - given
    cuts = np.linspace(0, drawn.size, workers + 1).astype(int)
    return ideal / max(free), ideal / np.diff(before[cuts]).max()


def measure(fidelity: str, number: int, rounds: int, most: int) -> str:
    """Measure, and return the text for the page."""
    counts = [2**k for k in range(most.bit_length()) if 2**k <= most]
    found: dict[tuple[str, int], list[Took]] = {}
    carried, piece_s, load = Carried(), [], []
    on_threads(fidelity, min(number, 50), 1)  # loads the kernels
    for _ in range(rounds):
        load.append(os.getloadavg()[0] if hasattr(os, "getloadavg") else math.nan)
        for count in counts:
            found.setdefault(("thread", count), []).append(on_threads(fidelity, number, count))
        for count in counts:
            with workers_of("local", count, count, Quiet()) as workers:
                assert workers is not None
                on_workers(workers, fidelity, 32 * count)  # loads kernels and scene
                workers.crew.carried = Carried()
                found.setdefault(("process", count), []).append(on_workers(workers, fidelity, number))
                carried = workers.carried
                if count == 1:
                    piece_s.append(cost_of_a_piece(workers, fidelity))
    alone = median(each.wall for each in found["thread", 1])
    rows = ["| | wall [s] | speed-up | CPU of all [s] | of it the logs [s] |", "|---|---|---|---|---|"]
    for (kind, count), each in found.items():
        wall, cpu, logs = (median(getattr(one, name) for one in each) for name in ("wall", "cpu", "logs"))
        what = kind if count == 1 else {"thread": "threads", "process": "processes"}[kind]
        rows.append(f"| {count} {what} | {wall:.2f} | {alone / wall:.2f} | {cpu:.2f} | {logs:.2f} |")
    each_piece_s, here_s = (median(each[k] for each in piece_s) for k in (0, 1))
    took = found["thread", 1][-1].by_log
    facts, block = study.provenance(), scene_bytes()
    lines = [
        f"{number} logs of the study's forest at `{fidelity}`, rasters included, median of {rounds} rounds; "
        f"{facts['machine']} (load {min(load):.0f} to {max(load):.0f}); {facts['versions']}; engine "
        f"{engine_digest()}, {facts['date']}.",
        "",
        *rows,
        "",
        f"The longest of these logs took {took.max() / np.median(took):.0f} times the median. A piece cost "
        f"{1000.0 * each_piece_s:.1f} ms of its worker beside its logs, and {1000.0 * here_s:.1f} ms of the scheduler "
        f"and of what sends it and takes it in: pieces of {spread_workers.PIECE_S:g} s keep about {1.0 / here_s:.0f} "
        f"threads busy. The network carried {carried.orders / carried.logs:.0f} bytes per log to the workers and "
        f"{carried.answers / carried.logs:.0f} back, without trajectories; the scene ({scene_cells() / 1e6:.2g} "
        f"million cells) is {block / 1e6:.2g} MB to each worker, once.",
        "",
        f"Reckoned from these logs, {RECKONED_LOGS} of them, for workers of one thread, each as fast as this one; "
        f"in the last two columns one log in {1 / LONG_SHARE:.0f} takes {LONG:.0f} times as long:",
        "",
        "| workers | our pieces | equal shares sent at once | our pieces, some logs long | equal shares, some long |",
        "|---|---|---|---|---|",
    ]
    for workers in MANY:
        plain, tail = (reckoned(took, workers, each_piece_s, long) for long in (0.0, LONG_SHARE))
        lines.append(f"| {workers} | {plain[0]:.0%} | {plain[1]:.0%} | {tail[0]:.0%} | {tail[1]:.0%} |")
    return "\n".join(lines)


def cost_of_a_piece(found: spread_workers.Workers, fidelity: str) -> tuple[float, float]:
    """CPU seconds of a piece in addition to its logs, on the worker and here: from pieces of one log that hardly
    slides.
    """
    number, before = 60, spread_workers.MOST_A_PIECE
    spread_workers.MOST_A_PIECE, least = 1, spread_workers.LEAST_PIECE_S
    spread_workers.LEAST_PIECE_S = 0.0
    try:
        took = on_workers(found, fidelity, number, SHORT_S)
    finally:
        spread_workers.MOST_A_PIECE, spread_workers.LEAST_PIECE_S = before, least
    return (took.cpu - took.here - took.logs) / number, took.here / number


def scene_cells() -> int:
    return scenes.build("forest").scene.arrays.terrain.heights.size


def scene_bytes() -> int:
    from deadwood_algorithms.simulate.piece import packed_scene

    block, large = packed_scene(scenes.build("forest").scene)
    return len(block) + sum(each.nbytes for each in large.values())


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.efficiency",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--logs", type=int, default=2000)
    parser.add_argument("--fidelity", default="standard", choices=list(FIDELITIES))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--most", type=int, default=2, help="threads and processes, at most")
    parser.add_argument("--no-page", action="store_true", help="print only")
    ask = parser.parse_args()
    text = measure(ask.fidelity, ask.logs, ask.rounds, ask.most)
    print(text)
    if not ask.no_page:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(MARKS.sub(lambda found: f"{found[1]}\n{text}\n\n{found[2]}", page), encoding="utf-8")


if __name__ == "__main__":
    main()
