"""Whether two engines calculate the same bits: all results of logs in a fixed set of scenes, fidelities and laws.

    python -m benchmarks same-bits --engine PATH      this engine and that of another checkout

If all are equal and the other engine was measured, the results file records that this one is as good
as measured: a change of names or layout that keeps every bit does not invalidate a page. Few logs, but all of their
results, poses, hits, influences and rasters, in scenes that together have every kind of obstacle and every law.

The part that slides imports nothing but the scenes and the engine's public names, so that an older engine runs it, too.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import deadwood_engine
from deadwood_engine import FIDELITIES, Blocks, LyingLogs, Rasters, Scene, slide

from . import scenes

HERE = Path(__file__).parent
LOGS, TIME_LIMIT = 6, 60.0  # [s] of sliding
Combination = tuple[str, str, dict[str, float], int | None]  # scene, fidelity, options of slide, vertices of a ring


def combinations() -> Iterator[Combination]:
    """The combinations: every scene at two fidelities, and some at the others; every law in a scene where it
    matters.
    """
    every = (*scenes.CASES, "littered")
    yield from ((name, row, {}, None) for name in every for row in ("draft", "standard"))
    yield from ((name, row, {}, None) for name in ("rough", "barriers", "littered") for row in ("fine", "reference"))
    yield from (
        (name, row, {"restitution": e}, None)
        for name in ("barriers", "littered", "gully")
        for row in ("draft", "standard")
        for e in (0.2, 0.5)
    )
    laws = (
        {"rolling_friction": 0.0}, {"tree_restitution": 0.3, "tree_friction": 0.5},
        {"barrier_restitution": 0.3, "barrier_friction": 0.15}, {"rest_speed": 1e-9},
    )  # fmt: skip
    yield from (("barriers", "standard", law, None) for law in laws)
    yield from ((name, row, {}, 8) for name in ("rough", "littered") for row in ("draft", "standard"))
    yield from (("littered", row, {"restitution": 0.2}, 8) for row in ("draft", "standard"))


def name_of(each: Combination) -> str:
    """The name of a combination."""
    scene, row, options, vertices = each
    laws = [f"{name} {value:g}" for name, value in options.items()] + ([f"{vertices} vertices"] if vertices else [])
    return ", ".join([scene, row, *laws])


def _scene(name: str) -> Scene:
    """A scene of the study, or the forest with lying logs and boulders among its trees."""
    if name != "littered":
        return scenes.build(name).scene
    case, cell, rng = scenes.CASES["forest"], scenes.CELL, np.random.default_rng(scenes.SEED + 2)
    count, low, high = 120, (60.0, 120.0), (180.0, scenes.RELEASE[1] - scenes.CLEARING)
    start = rng.uniform(low, high, (count, 2))
    turn = rng.uniform(0.0, 2.0 * np.pi, count)
    ends = start + 8.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    place, size = rng.uniform(low, high, (count, 2)), rng.uniform(0.6, 2.5, count)
    return Scene.prepare(
        scenes.ground("forest", cell), cell, 0.5 * cell, 0.5 * cell, friction=case.friction,
        trees=scenes.forest(case.stems),
        lying_logs=LyingLogs(
            np.stack([start, ends], axis=1).reshape(-1, 2), 2 * np.arange(count + 1), np.full(count, 0.5),
            np.full(count, 0.25),
        ),
        blocks=Blocks(place[:, 0], place[:, 1], size, 0.7 * size),
    )  # fmt: skip


def _arrays(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """All arrays of a record, with their names; its costs are not included."""
    if isinstance(value, np.ndarray):
        yield name, value
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _arrays(getattr(value, field.name), f"{name}.{field.name}")
    elif isinstance(value, dict) and name != "result.cost":
        for key, each in value.items():
            yield from _arrays(each, f"{name}.{key}")


def _digest_of(array: np.ndarray) -> str:
    kind = repr((array.dtype.str, array.shape)).encode()
    return hashlib.sha256(kind + np.ascontiguousarray(array).tobytes()).hexdigest()


def fingerprint(each: Combination) -> dict[str, str]:
    """SHA-256 of every array of a combination's result."""
    name, row, options, vertices = each
    scene, logs = _scene(name), scenes.logs_of_block(0, LOGS)
    rasters = Rasters.allocate(scene, 1)
    more: dict[str, Any] = {"shape": scenes.rings(vertices)} if vertices else {}
    result = slide(
        scene, scenes.alike(logs) if vertices else logs, FIDELITIES[row], time_limit=TIME_LIMIT, rasters=rasters,
        keep_poses=np.ones(LOGS, np.bool_), influences=True, **options, **more,
    )  # fmt: skip
    found = [*_arrays(result, "result"), *_arrays(rasters.totals(), "rasters")]
    said = ((what, repr((array.dtype.str, array.shape)).encode(), array) for what, array in found)
    return {
        what: hashlib.sha256(kind + np.ascontiguousarray(array).tobytes()).hexdigest() for what, kind, array in said
    }


def ask(checkout: Path, most: int | None = None) -> dict[str, dict[str, str]]:
    """The fingerprints of the engine of a checkout, by combination; slid in a separate process.

    Scenes and logs are made by this checkout for both.
    """
    path = os.pathsep.join(map(str, (checkout / "engine", HERE.parent, HERE.parent / "algorithms")))
    code = f"from benchmarks import same_bits; same_bits.tell({most!r})"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=HERE.parent, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE,
        text=True, check=True,
    )  # fmt: skip
    answer = json.loads(done.stdout)
    if Path(answer["engine"]).resolve() != (checkout / "engine/deadwood_engine").resolve():
        raise SystemExit(f"asked for the engine of {checkout}, got that of {answer['engine']}")
    return answer["fingerprints"]


def tell(most: int | None = None) -> None:
    """Slide all and print the fingerprints, in the requested process."""
    found = {name_of(each): fingerprint(each) for each in list(combinations())[:most]}
    print(json.dumps({"engine": str(Path(deadwood_engine.__file__).parent), "fingerprints": found}))


def different(ours: dict[str, dict[str, str]], theirs: dict[str, dict[str, str]]) -> list[str]:
    """Combinations that differ, each with the first arrays that do; an array that only one engine has is no difference
    of what both calculate, and is named apart (``only_one_has``)."""
    found = []
    for name, mine in ours.items():
        apart = [what for what in mine if what in theirs[name] and mine[what] != theirs[name][what]]
        if apart:
            found.append(f"{name}: {len(apart)} of {len(mine)} arrays, {', '.join(apart[:4])}")
    return found


def only_one_has(ours: dict[str, dict[str, str]], theirs: dict[str, dict[str, str]]) -> list[str]:
    """Arrays that one of the engines does not return."""
    return sorted({what for name in ours for what in ours[name].keys() ^ theirs[name].keys()})


def compare(checkout: Path, *, most: int | None = None, say: Any = print) -> bool:
    """Compare this engine with that of a checkout; if every bit is the same, and that one was measured, record it."""
    from . import study  # not importable with an older engine

    began = time.time()
    ours, theirs = ask(HERE.parent, most), ask(checkout, most)
    apart, news = different(ours, theirs), only_one_has(ours, theirs)
    for line in apart:
        say(line)
    if news:
        say(f"in one of them only: {', '.join(news)}")
    arrays = sum(len(mine) for mine in ours.values())
    say(f"{len(ours) - len(apart)} of {len(ours)} combinations give the same bits ({arrays} arrays, {LOGS} logs each; "
        f"{time.time() - began:.0f} s)")  # fmt: skip
    if apart or most is not None:
        return not apart
    say(study.certify(checkout / "engine/deadwood_engine", combinations=len(ours), logs=LOGS))
    return True
