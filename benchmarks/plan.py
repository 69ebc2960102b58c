"""What the page needs: which settings slide in which scenes with how many logs, what matters most first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from . import extras, study
from .scenes import CASES
from .settings import SETTINGS

OPEN, FOREST = ("rough", "cliff", "gully"), ("forest", "barriers")
USUAL = (*FOREST, *OPEN)
EVERYWHERE = (*USUAL, "sensitive")
MAIN = ("draft", "standard", "reference")


@dataclass(frozen=True)
class Part:
    """Settings that slide the same number of logs in the same scenes; a block of each in turn.

    ratio : cost of a log, mean of the settings, over that of ``standard`` in the same scene: for the estimate alone
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
    Part("the plane", (*MAIN, "fine"), ("plane",), 200, 5.5),
    Part("friction, the yardstick", _of("friction"), EVERYWHERE, 2000, 1.0),
    Part("friction of rolling", _of("rolling"), EVERYWHERE, 2000, 1.3),
    Part("stems", _of("tree restitution", "tree friction"), FOREST, 2000, 1.0),
    Part("barriers", _of("barrier restitution", "barrier friction"), ("barriers",), 2000, 1.0),
    Part("restitution of the ground", _of("ground restitution"), USUAL, 2000, 1.2),
    Part("the fidelities where things rebound", _of("impacts"), ("forest", "rough"), 3000, 3.3),
    Part("smooth cone or rings in a forest", _of("rings"), ("forest",), 2000, 3.0),
    Part("smooth cone or rings on open slopes", _of("rings"), ("rough", "sensitive"), 2000, 9.5),
    Part("the fidelities in forests, more logs", MAIN, FOREST, 20_000, 3.3),
    Part("the yardstick in forests, more logs", _of("friction"), FOREST, 6000, 1.0),
    Part("cells of the terrain model", _of("cell", "smooth"), USUAL, 400, 1.7),
    Part("refined together", _of("refined"), USUAL, 1000, 6.2),
    Part("reference halved", _of("halved"), ("forest",), 3000, 18.0),
    Part(
        "single factors", _of("coarse", "obstacles", "flanks", "order", "time step", "travel", "spacing", "tolerance",
        "sweeps", "trace"), USUAL, 400, 1.0,
    ),
    Part("the fidelities on open slopes, more logs", MAIN, OPEN, 9600, 3.3),
)  # fmt: skip
# CPU milliseconds a log at ``standard``, where nothing has been slid yet: pilots, good to a factor of two
PILOT_MS = {"plane": 16, "rough": 6, "forest": 4, "barriers": 3.5, "cliff": 7, "gully": 7.5, "sensitive": 8}
# Small studies, with the CPU seconds that they take
SECTIONS: dict[str, tuple[Callable[..., dict[str, Any]], float]] = {
    "restarts": (extras.all_restarts, 60.0),
    "crawls": (extras.crawls, 60.0),
    "plane": (extras.on_the_plane, 100.0),
    "speed": (extras.speed, 250.0),
    "switches": (extras.switches, 120.0),
}


def outlook() -> list[tuple[Part, int, float]]:
    """Each part with the logs that it has yet to slide, of all its scenes and settings, and the CPU seconds for them.

    By the first blocks of the same, where there are some, else by the pilots.
    """
    found: list[tuple[Part, int, float]] = []
    there: dict[tuple[str, str], int] = {}
    for part in PLAN:
        logs, cpu = 0, 0.0
        for name in part.settings:
            for scene in part.scenes:
                setting = SETTINGS[name]
                before = there.get((scene, name), study.BLOCK * study.blocks_done(scene, setting))
                there[scene, name] = max(before, part.logs)
                if part.logs > before:
                    each = study.cost_of(scene, setting)
                    logs += part.logs - before
                    cpu += (part.logs - before) * (1e-3 * PILOT_MS[scene] * part.ratio if each is None else each)
        found.append((part, logs, cpu))
    return found


def sections_due() -> list[str]:
    """Small studies that are not there, or of another engine."""
    results, engine = study.read_results(), study.engine_digest()
    return [name for name in SECTIONS if results.get(name, {}).get("source", {}).get("engine") != engine]


def do_sections(names: list[str], *, threads: int) -> None:
    """Do small studies; each is kept at once."""
    for name in names:
        print(f"small study: {name}")
        study.add_section(name, SECTIONS[name][0](threads=threads))


def whole(*, threads: int, until: float) -> None:
    """All that the page needs and is not there yet: says how long it takes, then slides and measures."""
    due, left = sections_due(), outlook()
    for part, logs, cpu in left:
        print(f"{part.what:45s} {logs:7d} logs to slide, about {cpu:6.0f} CPU s")
    cpu = sum(each for _, _, each in left) + sum(SECTIONS[name][1] for name in due)
    minutes = cpu / threads / 60.0
    print(f"small studies: {', '.join(due) or 'none'}; in all about {cpu:.0f} CPU s, {minutes:.0f} minutes", flush=True)
    done = all(
        study.run(part.scenes, [SETTINGS[s] for s in part.settings], part.logs, threads=threads, until=until)
        for part in PLAN
    )
    study.summarise(list(CASES), list(SETTINGS.values()))
    if done:
        do_sections(due, threads=threads)
