"""A tool for the tests of the user interfaces: it waits, fails in every requested way, writes one folder."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import shutil
import sys
import time
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from deadwood_algorithms.params import tool as declare
from deadwood_algorithms.params.manifest import manifest
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Tool, UserError

FAILURES = ("none", "user", "fault", "full", "denied", "many", "memory", "cancelled", "pipe")


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = declare.raster("Terrain")
    trees: str | None = declare.vector("Trees", "point", "line", default=None)
    friction: str = declare.number_or_layer("Friction coefficient", minimum=0, default="0.4")
    dbh_cm: float = declare.number(
        "Diameter of logs", unit="cm", minimum=0, exclusive=True, maximum=500, default=75.0, help="Of logs without one."
    )
    offset_m: float = declare.number("Offset", unit="m", default=0.0)
    trajectories: str = declare.text("Logs that keep their path", default="500", help="all, none or a number.")
    fail: str = declare.choice("How to fail", *FAILURES, default="none")
    wait_s: float = declare.number("Time to wait", unit="s", minimum=0, default=0.0)
    asks: bool = declare.flag("Ask whether the user has interrupted")
    stuck: bool = declare.flag("Wait in native code, which hears no signal", advanced=True)
    drops: bool = declare.flag("Wait in a callback from which Python drops exceptions", advanced=True)
    seed: int = declare.seed()
    output: Path = declare.output_folder("Result")
    overwrite: bool = declare.overwrite()


class _Thing:
    pass


@contextlib.contextmanager
def _folder(path: Path) -> Iterator[Path]:
    part = path.with_name(path.name + ".part")
    part.mkdir()
    try:
        yield part
        part.rename(path)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    with _folder(ask.output) as part:
        feedback.note("begun")
        (part / "manifest.json").write_text(json.dumps(manifest(TOOL, ask)), encoding="utf-8")
        (part / "proj.txt").write_text(os.environ.get("PROJ_LIB", "none"), encoding="utf-8")
        if ask.stuck:
            hashlib.pbkdf2_hmac("sha256", b"deadwood", b"toolbox", 150_000_000)  # half a minute of C
        if ask.drops:
            thing = _Thing()
            gone = weakref.ref(thing, lambda _: [time.sleep(0.05) for _ in range(round(ask.wait_s / 0.05))])
            del thing
            assert gone() is None
        naps = round(ask.wait_s / 0.05)
        for nap in range(naps):
            time.sleep(0.05)
            if ask.asks and feedback.cancelled():
                raise Cancelled
            feedback.progress(nap + 1, naps, "waiting")
        _fail(ask)
    outputs = {"output": ask.output, "manifest": ask.output / "manifest.json"}
    return Outcome(outputs=outputs, facts={"dbh_cm": ask.dbh_cm}, lines=("a table", "for a reader"))


def _fail(ask: Ask) -> None:
    errors = {
        "user": UserError(
            f"{ask.dem}, layer 'x', field 'dbh_cm', row 7: -3 is not a diameter;\ngive it in centimetres"
        ),
        "fault": ZeroDivisionError("division by zero"),
        "full": OSError(errno.ENOSPC, "No space left on device", "somewhere/deposits.gpkg"),
        "denied": PermissionError(errno.EACCES, "Permission denied", "somewhere"),
        "many": OSError(errno.EMFILE, "Too many open files", "somewhere"),
        "memory": MemoryError("Unable to allocate 9 GiB"),
        "cancelled": Cancelled(),
        "pipe": BrokenPipeError(errno.EPIPE, "Broken pipe"),
    }
    if ask.fail in errors:
        raise errors[ask.fail]


TOOL = Tool(name="toy-walk", group="Prepare", summary="Walk, wait and fail as told.", Ask=Ask, run=run)

if __name__ == "__main__":
    from deadwood_toolbox import cli, shelf

    shelf.TOOLS = (TOOL,)

    END_S = float(os.environ.get("TOY_END_S", "0"))

    class SlowEnd:
        """Takes time when Python exits, as large libraries do."""

        def __del__(self, sleep=time.sleep, seconds=END_S) -> None:
            sleep(seconds)

    slow_end = SlowEnd()
    sys.argv[0] = "deadwood-tool"
    cli.main()
