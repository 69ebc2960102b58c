"""Slide the same logs in every setting, block by block, and measure how far each setting is from its reference.

The results of each log are stored in ``.work`` (not committed) under a digest of everything they depend on: the engine,
the scene, the setting. So a study can be done in pieces, resumed and extended, and nothing stale is ever compared.
The resulting figures, with their provenance, go to ``results.json``.
"""

from __future__ import annotations

import datetime
import functools
import hashlib
import json
import math
import multiprocessing
import os
import platform
import subprocess
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

import deadwood_engine
from deadwood_algorithms.stats.directions import quantile_arc
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_engine import Logs, Rasters, Result, Scene, slide, station_spacing
from deadwood_engine.digest import digest_of

from . import measures, scenes
from .settings import SETTINGS, Setting

HERE = Path(__file__).parent
RESULTS, WORK = HERE / "results.json", HERE / ".work"
BLOCK = 200  # logs in a block
FAILED = deadwood_engine.STOP_REASONS.index("failed")
TIME_LIMIT = 120.0  # [s] of sliding: on all slopes but the plane no log reaches another line after that
LEAST_RUNOUT = 5.0  # [m] the direction of closer deposits is meaningless
MOST_IN_ENERGY_DISTANCE = 4000  # logs; its work grows with their square
KEPT = (
    "reach", "end_position", "speed_max", "jump_max", "penetration_max", "overlap_max", "energy_error", "unconverged",
    "steps", "stop_reason", "duration",
)  # fmt: skip


@functools.cache
def _digest(folder: Path, barriers: bool = True) -> str:
    """Digest of an engine's code: results of another engine belong to another study.

    Without fidelity.py: a setting's numbers are in the digest of its runs, so a new row does not void the others. On
    request without barriers.py, which scenes without barriers do not run.
    """
    return digest_of(folder, without={"fidelity.py"} | (set() if barriers else {"barriers.py"}))


def engine_digest(*, barriers: bool = True) -> str:
    """Digest of this engine."""
    return _digest(Path(deadwood_engine.__file__).parent, barriers)


def certificates() -> list[dict[str, Any]]:
    """Engines that give the same bits as one that was measured (``same_bits``)."""
    return read_results().get("same_bits", [])


def measured_as(*, barriers: bool = True) -> str:
    """Digest of the engine whose results count for this one: itself, or the measured one that gives the same bits."""
    now = engine_digest()
    found = next((each for each in certificates() if each["engine"] == now), None)
    if found:
        return found["as" if barriers else "as_without_barriers"]
    return engine_digest(barriers=barriers)


def engines_of(results: dict[str, Any]) -> set[str]:
    """Digests of the engines with which the entries were measured."""
    return {entry["source"]["engine"] for mine in results["entries"].values() for entry in mine.values()}


def certify(folder: Path, *, combinations: int, logs: int) -> str:
    """Record that this engine gives the same bits as the one in a folder, if that counts as measured; returns a
    message.
    """
    results, now, other = read_results(), engine_digest(), _digest(folder)
    known = {each["engine"]: each for each in results.get("same_bits", [])}
    measured = engines_of(results)
    if now in measured:
        return "this engine is the measured one"
    found = {"as": other, "as_without_barriers": _digest(folder, False)}
    if other in known:
        found = {name: known[other][name] for name in found}
    if found["as"] not in measured:
        return f"nothing noted: that engine (sources {other}) is not the measured one"
    row = {"engine": now, **found, "combinations": combinations, "logs": logs}
    row |= {"date": datetime.date.today().isoformat()}
    write_results(results | {"same_bits": [*(each for name, each in known.items() if name != now), row]})
    return f"noted: sources {now} give the same bits as the measured {found['as']}"


def build_for(name: str, setting: Setting) -> scenes.Built:
    """The scene for a setting."""
    return scenes.build(name, cell=setting.cell, friction_change=setting.friction_change, smooth=setting.smooth)


def folder_of(name: str, setting: Setting) -> Path:
    """The folder of the blocks of a scene in a setting."""
    built = build_for(name, setting)
    spacing = station_spacing(setting.fidelity, built.cell)
    engine = measured_as(barriers=bool(built.case.fences))
    what = (
        engine,
        built.digest,
        tuple(setting.fidelity),
        spacing,
        BLOCK,
        TIME_LIMIT,
        setting.options,
        setting.vertices,
        setting.posture,
    )
    return WORK / f"{name}-{setting.name.replace(' ', '_')}-{hashlib.sha256(repr(what).encode()).hexdigest()[:12]}"


def blocks_done(name: str, setting: Setting) -> int:
    """Number of consecutive blocks, from the first, that exist."""
    folder, number = folder_of(name, setting), 0
    while (folder / f"{number}.npz").exists():
        number += 1
    return number


def fresh_rasters(scene: Scene, threads: int) -> Rasters:
    """Rasters whose memory has been written to.

    The system allocates memory at the first write (here 10 us per page, 0.2 ms per log of a block), a cost that a run
    has once, and that should not be attributed to a block.
    """
    rasters = Rasters.allocate(scene, threads)
    for worker in rasters.workers:
        for array in worker:
            array.fill(0)
    return rasters


def slide_logs(name: str, setting: Setting, logs: Logs, **more: Any) -> Result:
    """Slide logs with a setting."""
    shape = scenes.rings(setting.vertices) if setting.vertices else None
    chosen = logs if setting.vertices is None else scenes.alike(logs)
    chosen = chosen if setting.posture is None else scenes.in_posture(chosen, setting.posture)
    options: dict[str, Any] = dict(setting.options) | more
    return slide(build_for(name, setting).scene, chosen, setting.fidelity, shape=shape, **options)


def slide_block(name: str, setting: Setting, block: int, threads: int) -> None:
    """Slide one block of logs and store the results."""
    built = build_for(name, setting)
    rasters = fresh_rasters(built.scene, threads)
    logs = scenes.logs_of_block(block, BLOCK)
    result = slide_logs(name, setting, logs, time_limit=TIME_LIMIT, threads=threads, rasters=rasters)
    hits = rasters.totals()["hit_count"].ravel()
    cells = np.flatnonzero(hits)
    kept: dict[str, Any] = {field: getattr(result, field) for field in KEPT}
    cost = [result.cost[key] for key in ("cpu_s", "contacts", "sweeps", "airborne_steps")]
    folder = folder_of(name, setting)
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / f".{block}.npz"  # complete or not at all
    np.savez_compressed(
        temporary, cells=cells.astype(np.uint32), hits=hits[cells].astype(np.uint16),
        shape=built.scene.arrays.terrain.heights.shape, cost=np.array(cost), **kept,
    )  # fmt: skip
    temporary.rename(folder / f"{block}.npz")


def cost_of(name: str, setting: Setting) -> float | None:
    """CPU seconds per log of the existing blocks; None if there are none."""
    if not blocks_done(name, setting):
        return None
    return float(np.load(folder_of(name, setting) / "0.npz")["cost"][0]) / BLOCK


def run(
    names: Iterable[str], settings: Iterable[Setting], logs: int, *, threads: int, until: float, say: Any = print
) -> bool:
    """Slide the missing ones of ``logs`` logs, a block of each in turn; False if ``until`` (clock time) is reached
    before.
    """
    wanted = -(-logs // BLOCK)
    for block in range(wanted):
        for setting in settings:
            for name in names:
                if blocks_done(name, setting) != block:
                    continue
                if time.time() > until:
                    say("out of time; run again to go on")
                    return False
                if block == 0:  # compile and warm up before anything is timed
                    slide_logs(name, setting, scenes.logs_of_block(0, 2), time_limit=1.0)
                began = time.time()
                slide_block(name, setting, block, threads)
                say(f"{name:9s} {setting.name:18s} logs {(block + 1) * BLOCK:6d}  {time.time() - began:6.1f} s")
    return True


@dataclass(frozen=True)
class Sample:
    """All logs of a scene in a setting; rows are logs, except for block_hits (blocks, cells) and cost (blocks, 4)."""

    fields: dict[str, NDArray]
    block_hits: NDArray[np.uint16]
    cost: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.fields["steps"])

    def head(self, blocks: int) -> Sample:
        """The first blocks of the sample."""
        rows = {field: values[: blocks * BLOCK] for field, values in self.fields.items()}
        return Sample(rows, self.block_hits[:blocks], self.cost[:blocks])


def load(name: str, setting: Setting) -> Sample | None:
    """The results so far; None if there are none."""
    folder, number = folder_of(name, setting), blocks_done(name, setting)
    if number == 0:
        return None
    parts = [dict(np.load(folder / f"{block}.npz")) for block in range(number)]
    hits = np.zeros((number, int(np.prod(parts[0]["shape"]))), np.uint16)
    for row, part in zip(hits, parts, strict=True):
        row[part["cells"]] = part["hits"]
    fields = {field: np.concatenate([part[field] for part in parts]) for field in KEPT}
    return Sample(fields, hits, np.array([part["cost"] for part in parts]))


def _arc(deposits: NDArray) -> float:
    away = np.hypot(deposits[:, 0] - scenes.RELEASE[0], deposits[:, 1] - scenes.RELEASE[1]) > LEAST_RUNOUT
    dx, dy = (deposits[away, :2] - scenes.RELEASE).T
    return quantile_arc(np.degrees(np.arctan2(dx, dy)))["value"]


def _top(values: NDArray) -> float:
    return float(np.quantile(values, 0.95))


def describe(name: str, sample: Sample) -> dict[str, Any]:
    """The results and cost of a setting, without a comparison."""
    f, n = sample.fields, len(sample)
    steps = float(f["steps"].sum())
    reached = int(f["reach"][:, scenes.CASES[name].line_row].sum())
    low, high = wilson_interval(reached, n)
    depth = f["penetration_max"]
    return {
        "logs": n,
        "cpu_ms_per_log": 1e3 * float(np.median(sample.cost[:, 0])) / BLOCK,
        "steps_per_log": steps / n,
        "us_per_step": 1e6 * float(np.sum(sample.cost[:, 0])) / steps,
        "contacts_per_step": float(sample.cost[:, 1].sum()) / steps,
        "sweeps_per_step": float(sample.cost[:, 2].sum()) / steps,
        "airborne_share": float(sample.cost[:, 3].sum()) / steps,
        "unconverged_share": float(f["unconverged"].sum()) / steps,
        "reach": {"p": reached / n, "low": low, "high": high},
        "penetration_m": {
            "median": float(np.median(depth)), "p99": float(np.quantile(depth, 0.99)), "max": float(depth.max()),
        },
        "overlap_m": {"max": float(f["overlap_max"].max())},
        "energy_error": {
            "median": float(np.median(f["energy_error"])), "p99": float(np.quantile(f["energy_error"], 0.99)),
            "max": float(f["energy_error"].max()),
        },
        "stop_reasons": {
            reason: int(np.sum(f["stop_reason"] == k)) for k, reason in enumerate(deadwood_engine.STOP_REASONS)
        },
    }  # fmt: skip


def compare(name: str, ours: Sample, theirs: Sample) -> dict[str, Any]:
    """The difference of a setting from its reference, on the logs that both have."""
    blocks = min(len(ours.cost), len(theirs.cost))
    ours, theirs = ours.head(blocks), theirs.head(blocks)
    a, b = ours.fields, theirs.fields
    row = scenes.CASES[name].line_row
    each = [measures.reach_difference(a["reach"][:, k], b["reach"][:, k]) for k in range(len(scenes.LINES_Y))]
    worst = max(range(len(each)), key=lambda k: abs(each[k]["delta"]))
    found: dict[str, Any] = {
        "logs": len(ours),
        "reach": each[row],
        "worst_line": {"y": scenes.LINES_Y[worst], **each[worst]},
        "spread_deg": measures.bootstrap_difference(_arc, a["end_position"], b["end_position"]),
        "speed_95_ms": measures.bootstrap_difference(_top, a["speed_max"], b["speed_max"]),
        "jump_95_m": measures.bootstrap_difference(_top, a["jump_max"], b["jump_max"]),
    }
    ours_at, theirs_at = a["end_position"][:, :2], b["end_position"][:, :2]
    found["runout_w1_m"] = measures.wasserstein(ours_at[:, 1], theirs_at[:, 1])
    found["runout_w1_floor_m"] = measures.noise_floor(
        lambda i, j: measures.wasserstein(theirs_at[i, 1], theirs_at[j, 1]), len(theirs_at), power=0.5
    )
    some, those = ours_at[:MOST_IN_ENERGY_DISTANCE], theirs_at[:MOST_IN_ENERGY_DISTANCE]
    found["deposit_energy_m"] = measures.energy_distance(some, those)
    found["deposit_energy_floor_m"] = measures.noise_floor(
        lambda i, j: measures.energy_distance(those[i], those[j]), len(those), power=1.0, splits=4
    )
    if ours.block_hits.shape[1] == theirs.block_hits.shape[1]:  # rasters on the same grid
        mine, other = (s.block_hits.sum(axis=0, dtype=np.int64) for s in (ours, theirs))
        found["hits_jaccard"] = measures.jaccard_distance(mine, other)
        if blocks > 1:
            found["hits_jaccard_floor"] = measures.noise_floor(
                lambda i, j: measures.jaccard_distance(
                    theirs.block_hits[i].sum(axis=0, dtype=np.int64), theirs.block_hits[j].sum(axis=0, dtype=np.int64)
                ),
                blocks,
                power=0.5,
            )
    return found


def provenance() -> dict[str, str]:
    """Machine and versions with which figures were measured; the machine by its class only."""
    commit = os.environ.get("DEADWOOD_BENCH_COMMIT") or subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=HERE, capture_output=True, text=True, check=False
    ).stdout.strip()  # fmt: skip
    model = next(
        (line.split(":")[1].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")),
        platform.processor(),
    )
    return {
        "commit": commit[:12],
        "engine": measured_as(),
        "machine": f"{os.cpu_count()} cores, {model}, {platform.system()} {platform.machine()}, shared with other work",
        "versions": f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__}",
        "date": datetime.date.today().isoformat(),
    }


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text().splitlines()
    except OSError:
        return []


def read_results() -> dict[str, Any]:
    """The content of the results file; empty if it does not exist."""
    return json.loads(RESULTS.read_text()) if RESULTS.exists() else {"entries": {}}


def rounded(value: Any) -> Any:
    """Numbers with five digits: more are noise and make the file large."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def write_results(results: dict[str, Any]) -> None:
    """Write the results file, one entry on each line and keys in order, so that two of them can be compared."""

    def line(key: str, value: Any) -> str:
        return f"{json.dumps(key)}: {json.dumps(rounded(value), sort_keys=True, allow_nan=False)}"

    scenes_lines = []
    for name, mine in sorted(results["entries"].items()):
        entries = ",\n".join(line(setting, mine[setting]) for setting in sorted(mine))
        scenes_lines.append(f"{json.dumps(name)}: {{\n{entries}\n}}")
    rest = [line(key, value) for key, value in sorted(results.items()) if key != "entries"]
    entries = '"entries": {\n' + ",\n".join(scenes_lines) + "\n}"
    RESULTS.write_text("{\n" + ",\n".join([*rest, entries]) + "\n}\n")


def add_section(name: str, found: dict[str, Any]) -> None:
    """Add a small study to the results file."""
    write_results(read_results() | {name: found | {"source": provenance()}})


@functools.lru_cache(maxsize=2)  # the reference of the others in the scene
def _base(name: str, which: str) -> Sample | None:
    return load(name, SETTINGS[which])


def entry_of(name: str, which: str) -> dict[str, Any] | None:
    """All measures of a scene in a setting; None if nothing has been slid."""
    setting, sample = SETTINGS[which], load(name, SETTINGS[which])
    if sample is None:
        return None
    entry: dict[str, Any] = {"fidelity": setting.fidelity._asdict(), **describe(name, sample)}
    if setting.against != setting.name and (base := _base(name, setting.against)) is not None:
        entry["against"], entry["error"] = setting.against, compare(name, sample, base)
    if setting.group == "refined" and (coarse := _base(name, "standard")) is not None:
        blocks = min(len(coarse.cost), len(sample.cost))
        depth, finer = (each.head(blocks).fields["penetration_max"] for each in (coarse, sample))
        entry["penetration_fall"] = measures.fall_of_median(depth, finer, round(-math.log2(setting.value)))
    return entry


def summarise(names: list[str], settings: list[Setting], *, threads: int = 1, say: Any = print) -> None:
    """Measure everything that has been slid and merge it into the results file, entry by entry, in several
    processes.
    """
    results, source = read_results(), provenance()
    common = {
        "seed": scenes.SEED, "block": BLOCK, "time_limit_s": TIME_LIMIT,
        "scenes": {c.name: {"title": c.title, "friction": c.friction, "line_y": c.line} for c in scenes.CASES.values()},
    }  # fmt: skip
    results |= common
    slid = [(name, each.name) for name in names for each in settings if blocks_done(name, each)]
    with ProcessPoolExecutor(threads, multiprocessing.get_context("spawn")) as pool:
        for (name, which), entry in zip(
            slid, pool.map(entry_of, *zip(*slid, strict=True)) if slid else (), strict=True
        ):
            if entry is not None:
                results["entries"].setdefault(name, {})[which] = entry | {"source": source}
                say(f"measured {name} {which}: {entry['logs']} logs")
    for name in names:
        mine = results["entries"].get(name, {})
        # drop settings that the study no longer has, and results of earlier engines
        for gone in [n for n in mine if n not in SETTINGS or mine[n]["source"]["engine"] != source["engine"]]:
            del mine[gone]
    if "same_bits" in results:  # of engines whose results are here
        results["same_bits"] = [each for each in results["same_bits"] if each["as"] in engines_of(results)]
    write_results(results)
