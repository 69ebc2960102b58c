"""Planted errors that the tests must catch: ``python -m tests.mutants [NAME ...]`` prints what became of each.

One error at a time is written into a copy of the checkout, and the tests that are responsible for that file run there.
Each is one that a reader would not see: a sign, an end of an interval, an unsorted id, half a cell. One that survives
shows a fixture that is too symmetric or an answer that nothing calculates a second time. Takes half an hour of two
cores; a test checks that each of the places below still exists (``tests/toolbox/test_mutants.py``).
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

ROOT = Path(__file__).parents[1]
ALGORITHMS, ENGINE, TESTS = "algorithms/deadwood_algorithms", "engine/deadwood_engine", "tests/algorithms"


@dataclass(frozen=True)
class Mutant:
    """An error: ``old`` becomes ``new`` in a file, once; ``tests``: files that must notice."""

    file: str
    old: str
    new: str
    tests: str

    @property
    def name(self) -> str:
        return f"{Path(self.file).stem}: {' '.join(self.old.split())} -> {' '.join(self.new.split())}"


def _of(room: str, *rows: tuple[str, str, str, str]) -> list[Mutant]:
    return [Mutant(f"{room}/{file}", old, new, tests) for file, old, new, tests in rows]


MUTANTS = [
    *_of(
        f"{ALGORITHMS}/stats",
        ("statistics.py", "weight / (4.0 * n_total)", "weight / (2.0 * n_total)", "stats/test_statistics.py"),
        ("statistics.py", "centre + half)", "centre + 0.9 * half)", "stats/test_statistics.py"),
        (
            "statistics.py",
            "difference = n_gained - n_lost",
            "difference = n_lost - n_gained",
            "stats/test_statistics.py",
        ),
        ("statistics.py", "term * (n - k) // (k + 1)", "term * (n - k) // (k + 2)", "stats/test_statistics.py"),
        (
            "statistics.py",
            "reach_record(n_reach + n_lost, n_total)",
            "reach_record(n_reach + n_lost, n_total + n_lost)",
            "stats/test_statistics.py results/test_lost.py",
        ),
        (
            "order_statistics.py",
            "float(ordered[high - 1])}",
            "float(ordered[min(high, n - 1)])}",
            "stats/test_order_statistics.py",
        ),
        ("order_statistics.py", "high = n + 1 - int", "high = n - int", "stats/test_order_statistics.py"),
        (
            "order_statistics.py",
            "- 2.0 * together * first * second",
            "- together * first * second",
            "stats/test_order_statistics.py",
        ),
        (
            "order_statistics.py",
            'reach(one["value"] - one["ci_low"], other["ci_high"] - other["value"])',
            'reach(one["value"] - one["ci_low"], other["value"] - other["ci_low"])',
            "stats/test_order_statistics.py",
        ),
        (
            "directions.py",
            "np.arctan2(np.asarray(dx, float), np.asarray(dy, float))",
            "np.arctan2(np.asarray(dy, float), np.asarray(dx, float))",
            "tools/test_lateral_spread.py",
        ),
        (
            "directions.py",
            "> np.asarray(min_runout, float)",
            ">= 0.5 * np.asarray(min_runout, float)",
            "tools/test_lateral_spread.py results/test_summary.py",
        ),
    ),
    *_of(
        f"{ALGORITHMS}/stats",
        (
            "endings.py",
            "np.where(at_rest(logs), np.asarray(runout, float), np.inf)",
            "np.asarray(runout, float)",
            "stats/test_endings.py tools/test_calibrate_friction.py",
        ),
    ),
    *_of(
        f"{ALGORITHMS}/results",
        ("arrivals.py", "len(mine) / per_line[line_id]", "len(mine) / len(released)", "tools/test_reach_lines.py"),
        (
            "arrivals.py",
            "np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])",
            "np.abs(a[:, 0] * b[:, 1] + a[:, 1] * b[:, 0])",
            "tools/test_reach_lines.py",
        ),
        ("arrivals.py", "return ends[::2]", "return ends[1::2]", "tools/test_reach_lines.py"),
        (
            "arrivals.py",
            "along * (tip_radius - base_radius)",
            "along * (base_radius - tip_radius)",
            "tools/test_reach_lines.py results/test_motion.py",
        ),
        (
            "arrivals.py",
            "thick * np.sqrt(np.maximum(1.0 - axis[:, 2:3] ** 2, 0.0))",
            "thick",
            "results/test_passages.py",
        ),
        (
            "arrivals.py",
            'quantiles(mine[f"{name}_{unit}"], [0.5, 0.95])',
            'quantiles(mine[f"{name}_{unit}"], [0.5, 0.9])',
            "tools/test_reach_lines.py",
        ),
        (
            "capacity.py",
            "capacity.of_logs(releases.dbh_cm[order])",
            "capacity.of_logs(releases.dbh_cm)",
            "results/test_capacity.py",
        ),
        (
            "capacity.py",
            "hits.item < len(layers.tree_ids)",
            "hits.item <= len(layers.tree_ids)",
            "results/test_capacity.py",
        ),
        (
            "capacity.py",
            "self.capacity.of_trees(100.0 * layers.trees.diameter)",
            "self.capacity.of_trees(50.0 * layers.trees.diameter)",
            "results/test_capacity.py",
        ),
        (
            "cell_quantiles.py",
            "at = level * (count[filled] - 1)",
            "at = level * count[filled]",
            "results/test_cell_quantiles.py",
        ),
        (
            "cell_quantiles.py",
            "south, north = y0 - 0.5 * grid.cell",
            "south, north = y0",
            "results/test_cell_quantiles.py",
        ),
        (
            "cell_quantiles.py",
            "ordered[peaks.start[1:][enough] - rank]",
            "ordered[peaks.start[:-1][enough] + rank - 1]",
            "results/test_cell_quantiles.py evaluate/hazard/test_least_passage.py",
        ),
        ("motion.py", "body[:, AXIAL] * (spin**2 - turn**2)", "body[:, AXIAL] * spin**2", "results/test_motion.py"),
        ("motion.py", "total / np.maximum(sides, 1)", "total / 2.0", "results/test_motion.py"),
        (
            "summary.py",
            'percentile_record(by_log["speed_max"], 0.95)',
            'percentile_record(by_log["speed_max"], 0.90)',
            "results/test_summary.py",
        ),
        ("summary.py", "over = crossed[:, column] & ~stopped", "over = crossed[:, column]", "results/test_summary.py"),
        (
            "summary.py",
            'by_log["speed_mean"][stopped].mean()',
            'by_log["speed_mean"].mean()',
            "results/test_summary.py",
        ),
        (
            "barrier_arrivals.py",
            "LEVEL = 0.95",
            "LEVEL = 0.9",
            "tools/test_site_barriers.py tools/test_design_values.py",
        ),
        ("lost.py", "int((left & ~reached).sum())", "int(left.sum())", "results/test_lost.py"),
        (
            "friction_band.py",
            "touched[order[np.searchsorted(log_id, band.log_id, sorter=order)]]",
            "touched[np.searchsorted(log_id[order], band.log_id)]",
            "evaluate/sensitivity/test_friction_band.py",
        ),
    ),
    *_of(
        f"{ALGORITHMS}/report",
        (
            "compared.py",
            "(row.difference, row.diff_ci_low, row.diff_ci_high, True)",
            "(row.difference, row.ci_low, row.ci_high, True)",
            "report/test_compared.py report/test_page.py",
        ),
        (
            "rounded.py",
            '(record["p_low_if_lost"], record["p_high_if_lost"], low, high)',
            '(record["p"], record["p_high_if_lost"], low, high)',
            "report/test_rounded.py report/test_answers.py results/test_lost.py",
        ),
        ("rounded.py", "half = (high - low) / 2.0", "half = high - low", "report/test_rounded.py"),
        (
            "plan.py",
            'values if name == "danger" else np.where',
            "np.where",
            "report/test_page.py report/test_legends.py",
        ),
        (
            "rounded.py",
            '100.0 * record["n_reach"] / record["n_total"]',
            '100.0 * record["p"]',
            "report/test_rounded.py report/test_answers.py",
        ),
    ),
    *_of(
        f"{ALGORITHMS}/evaluate",
        ("hazard/rates.py", "count * (1.0 - low)", "count", "evaluate/hazard/test_rates.py"),
        (
            "hazard/rates.py",
            'side="right") + 1\n    return np.where(np.isfinite(values)',
            'side="left") + 1\n    return np.where(np.isfinite(values)',
            "evaluate/hazard",
        ),
        (
            "hazard/rates.py",
            'side="left") + 1\n    return np.where(np.isfinite(years)',
            'side="right") + 1\n    return np.where(np.isfinite(years)',
            "evaluate/hazard",
        ),
        (
            "hazard/least_passage.py",
            "math.ceil(share * n_logs - 1e-9)",
            "math.floor(share * n_logs)",
            "evaluate/hazard/test_least_passage.py",
        ),
        (
            "hazard/least_passage.py",
            "* (1.0 - share) / (share * SUPPORTED**2)",
            "/ (share * SUPPORTED**2)",
            "evaluate/hazard/test_least_passage.py tools/test_map_intensity.py",
        ),
        (
            "scenarios/measures.py",
            "_paired(before.most, now.did), _paired(before.did, now.most)",
            "_paired(before.did, now.did), _paired(before.did, now.most)",
            "evaluate/scenarios/test_measures.py",
        ),
        (
            "scenarios/measures.py",
            "int((before & ~now).sum()), int((now & ~before).sum())\n    return",
            "int((now & ~before).sum()), int((before & ~now).sum())\n    return",
            "evaluate/scenarios/test_measures.py",
        ),
        ("scenarios/indices.py", "TAIL = 0.95", "TAIL = 0.9", "evaluate/scenarios"),
        (
            "scenarios/indices.py",
            "value, -high / before.mean(), min(-low / before.mean(), 1.0)",
            "value, low / before.mean(), min(high / before.mean(), 0.0)",
            "evaluate/scenarios",
        ),
        (
            "protection/siting_table.py",
            "beside = outcomes.met[:, number] & ~held & ~over",
            "beside = outcomes.met[:, number] & ~held",
            "evaluate/protection/test_siting.py tools/test_site_barriers.py",
        ),
        ("fidelity/measures.py", 'side="right") / a.size', 'side="left") / a.size', "evaluate/fidelity"),
    ),
    *_of(
        f"{ALGORITHMS}/explore",
        ("answer.py", "far + widest + logs)", "0.25 * far + widest + logs)", "explore/test_session.py"),
        (
            "answer.py",
            "Hits.summed([base.hits, more], less=[gone])",
            "Hits.summed([base.hits, more])",
            "explore/test_session.py",
        ),
        ("answer.py", "if 2 * rows.size > base.number", "if rows.size > base.number", "explore/test_session.py"),
    ),
    *_of(
        f"{ALGORITHMS}/scene",
        ("laws.py", "(dbh_cm / DBH_CM) ** power", "(dbh_cm / DBH_CM) ** (power - 0.1)", "results/test_capacity.py"),
        (
            "items.py",
            "of_row[np.searchsorted(rows, paths.item)]",
            "np.searchsorted(rows, paths.item)",
            "scene/test_layers.py tools/test_slide_logs.py",
        ),
    ),
    *_of(
        f"{ALGORITHMS}/prepare",
        (
            "trees/allometry.py",
            "return (dbh / self.a) ** (1 / self.b)",
            "return dbh ** (1 / self.b) / self.a",
            "prepare/trees/test_allometry.py",
        ),
        (
            "releases/weights.py",
            'sought, side="right"), self.ends.size',
            'sought, side="left"), self.ends.size',
            "prepare/releases tools/test_sample_releases.py",
        ),
    ),
    *(
        Mutant(f"{ENGINE}/{file}", old, new, f"../engine/{tests}")
        for file, old, new, tests in (
            ("rocking.py", "stayed and windows[0, PEAK] <= ROCKING_GROWTH * before", "stayed", "test_rocking.py"),
            ("rocking.py", "high - low <= ROCKING_RANGE", "high - low <= 4.0 * ROCKING_RANGE", "test_rocking.py"),
            ("log_body.py", "0.25", "0.24", "test_log_body.py"),
        )
    ),
]
CAUGHT, SURVIVES, BROKEN = "caught", "SURVIVES", "no such place"


def main() -> int:
    asked = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__.partition("\n")[0])
    asked.add_argument("names", nargs="*", help="only errors whose name contains one of these")
    asked.add_argument("--at-a-time", type=int, default=os.cpu_count() or 1, help="copies that are tested at a time")
    ask = asked.parse_args()
    chosen = [each for each in MUTANTS if not ask.names or any(name in each.name for name in ask.names)]
    copies: SimpleQueue[Path] = SimpleQueue()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(ask.at_a_time) as pool:
        for k in range(ask.at_a_time):
            copies.put(copy_to(Path(folder) / str(k)))

        plain = copies.get()
        if status := run(sorted({one for each in chosen for one in each.tests.split()}), plain):
            raise SystemExit(f"the tests do not pass without an error (status {status})")
        copies.put(plain)

        def tried(each: Mutant) -> str:
            copy, began = copies.get(), time.monotonic()
            found = fate(each, copy)
            copies.put(copy)
            print(f"{found:14} {time.monotonic() - began:5.0f} s  {each.name}", flush=True)
            return found

        found = list(pool.map(tried, chosen))
    print(f"{found.count(CAUGHT)} of {len(found)} caught")
    return int(set(found) != {CAUGHT})


def copy_to(folder: Path) -> Path:
    """The files of the checkout, with those that are not yet committed."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    for name in subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0"):
        if name and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, folder / name)
    return folder


def fate(mutant: Mutant, copy: Path) -> str:
    place = copy / mutant.file
    before = place.read_text(encoding="utf-8")
    if before.count(mutant.old) != 1:
        return BROKEN
    place.write_text(before.replace(mutant.old, mutant.new), encoding="utf-8")
    try:
        status = run(mutant.tests.split(), copy)
    finally:
        place.write_text(before, encoding="utf-8")
    return {0: SURVIVES, 1: CAUGHT}.get(status, f"status {status}")


def run(tests: Sequence[str], copy: Path) -> int:
    """The status of pytest in a copy."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    return subprocess.run([*command, *(f"{TESTS}/{each}" for each in tests)], cwd=copy, capture_output=True).returncode


if __name__ == "__main__":
    sys.exit(main())
