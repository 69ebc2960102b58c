"""The plan of the page: which settings slide in which scenes with how many logs, the most important first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from . import extras, harsh, study
from .scenes import CASES
from .settings import SETTINGS

OPEN, FOREST = ("rough", "cliff", "gully"), ("forest", "barriers")
USUAL = (*FOREST, *OPEN)
EVERYWHERE = (*USUAL, "sensitive")
MAIN = ("draft", "standard", "reference")


@dataclass(frozen=True)
class Part:
    """Settings that slide the same number of logs in the same scenes; one block of each in turn.

    ratio : cost of a log, mean of the settings, over that of ``standard`` in the same scene: only for the estimate
    """

    what: str
    settings: tuple[str, ...]
    scenes: tuple[str, ...]
    logs: int
    ratio: float


def _of(*groups: str) -> tuple[str, ...]:
    return tuple(name for name, setting in SETTINGS.items() if setting.group in groups)


PLAN = (
    Part("the fidelities", (*MAIN, "fine"), USUAL, 2000, 2.8),
    Part("the sensitive case", (*MAIN, "fine"), ("sensitive",), 2000, 2.9),
    Part("the plane", (*MAIN, *_of("roll angle")), ("plane",), 1000, 5.5),
    Part("the plane, fine", ("fine",), ("plane",), 200, 7.0),
    Part("friction, the yardstick", _of("friction"), EVERYWHERE, 2000, 1.0),
    Part("friction of rolling", _of("rolling"), EVERYWHERE, 2000, 1.3),
    Part("stems", _of("tree restitution", "tree friction"), FOREST, 2000, 1.0),
    Part("barriers", _of("barrier restitution", "barrier friction"), ("barriers",), 2000, 1.0),
    Part("restitution of the ground", _of("ground restitution"), USUAL, 2000, 1.2),
    Part("posture of the released logs", _of("posture"), EVERYWHERE, 2000, 1.0),
    Part("the fidelities where things rebound", _of("impacts"), ("forest", "rough"), 2000, 3.3),
    Part("smooth cone or rings in a forest", _of("rings"), ("forest",), 2000, 3.0),
    Part("smooth cone or rings on open slopes", _of("rings"), ("rough", "sensitive"), 1000, 9.5),
    Part("the fidelities in forests, more logs", MAIN, FOREST, 40_000, 3.3),
    Part("longer steps", _of("longer"), USUAL, 9600, 0.75),
    Part("the yardstick in forests, more logs", _of("friction"), FOREST, 6000, 1.0),
    Part("cells of the terrain model", _of("cell", "smooth"), USUAL, 400, 1.7),
    Part("refined together", _of("refined"), USUAL, 1000, 6.2),
    Part("reference halved", _of("halved"), ("forest",), 3000, 18.0),
    Part(
        "single factors", _of("coarse", "obstacles", "flanks", "order", "time step", "travel", "roll angle", "spacing",
        "tolerance", "sweeps", "trace"), USUAL, 400, 1.0,
    ),
    Part("the fidelities on open slopes, more logs", MAIN, OPEN, 16_000, 3.3),
    Part("fine, more logs", ("fine",), USUAL, 8000, 4.4),
)  # fmt: skip
# CPU milliseconds per log at ``standard`` before anything has been slid: from pilots, accurate to a factor of two
PILOT_MS = {"plane": 16, "rough": 6, "forest": 4, "barriers": 3.5, "cliff": 7, "gully": 7.5, "sensitive": 8}
# Small studies, with the CPU seconds that they take
SECTIONS: dict[str, tuple[Callable[..., dict[str, Any]], float]] = {
    "restarts": (extras.all_restarts, 60.0),
    "crawls": (extras.crawls, 60.0),
    "plane": (extras.on_the_plane, 100.0),
    "speed": (extras.speed, 250.0),
    "switches": (extras.switches, 120.0),
    "rebounds": (harsh.rebounds, 80.0),
    "noise": (harsh.ground_of_noise, 30.0),
}


def outlook(parts: Sequence[Part] = PLAN) -> list[tuple[Part, int, float]]:
    """Each part with the number of logs still to be slid, over all its scenes and settings, and the CPU seconds for
    them.

    Estimated from the first blocks of the same if there are any, else from the results file of an earlier engine, else
    from the pilots.
    """
    found: list[tuple[Part, int, float]] = []
    there: dict[tuple[str, str], int] = {}
    measured = study.read_results()["entries"]
    for part in parts:
        logs, cpu = 0, 0.0
        for name in part.settings:
            for scene in part.scenes:
                setting = SETTINGS[name]
                before = there.get((scene, name), study.BLOCK * study.blocks_done(scene, setting))
                there[scene, name] = max(before, part.logs)
                if part.logs > before:
                    pilot = measured.get(scene, {}).get(name, {}).get("cpu_ms_per_log", PILOT_MS[scene] * part.ratio)
                    each = study.cost_of(scene, setting)
                    logs += part.logs - before
                    cpu += (part.logs - before) * (1e-3 * pilot if each is None else each)
        found.append((part, logs, cpu))
    return found


def sections_due() -> list[str]:
    """Small studies that are missing, or belong to another engine."""
    results, engine = study.read_results(), study.measured_as()
    return [name for name in SECTIONS if results.get(name, {}).get("source", {}).get("engine") != engine]


def do_sections(names: list[str], *, threads: int) -> None:
    """Run small studies; each result is stored immediately."""
    for name in names:
        print(f"small study: {name}")
        study.add_section(name, SECTIONS[name][0](threads=threads))


def chosen(names: Sequence[str]) -> tuple[list[Part], list[str]]:
    """Parts of the plan and small studies by name (the first words of a part); all if none is named."""
    if not names:
        return list(PLAN), list(SECTIONS)
    parts = [part for part in PLAN if any(part.what.startswith(name) for name in names)]
    studies = [study for study in SECTIONS if study in names]
    for name in names:
        if name not in studies and not any(part.what.startswith(name) for part in parts):
            known = "; ".join([part.what for part in PLAN] + list(SECTIONS))
            raise SystemExit(f"no part of the plan and no small study is called {name!r}; there are: {known}")
    return parts, studies


def whole(*, threads: int, until: float, only: Sequence[str] = (), dry: bool = False) -> None:
    """Slide and measure what the page still needs, or these parts of it; reports how long it takes."""
    parts, studies = chosen(only)
    due, left = [name for name in sections_due() if name in studies], outlook(parts)
    for part, logs, cpu in left:
        print(f"{part.what:45s} {logs:7d} logs to slide, about {cpu:6.0f} CPU s")
    cpu = sum(each for _, _, each in left) + sum(SECTIONS[name][1] for name in due)
    minutes = cpu / threads / 60.0
    print(f"small studies: {', '.join(due) or 'none'}; in all about {cpu:.0f} CPU s, {minutes:.0f} minutes", flush=True)
    if dry:
        return
    done = all(
        study.run(part.scenes, [SETTINGS[s] for s in part.settings], part.logs, threads=threads, until=until)
        for part in parts
    )
    study.summarise(list(CASES), list(SETTINGS.values()), threads=threads)
    if done:
        do_sections(due, threads=threads)
