"""A tool as a program that a signal meets: `killed_run.py NUMBER MOMENT DELAY_S VICTIM FOLDER ARGUMENTS`.

VICTIM is the process that is met, 0 the program itself; it may be a worker that slides the program's logs.

Moments are counted in what the program does to files in FOLDER, of which most is done while the results are written;
the signal comes so long after. The number of moments is printed at the end of a run that no signal has met.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

EVENTS = ("open", "os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.truncate", "shutil.rmtree", "sqlite3.connect")
ROOT = Path(__file__).parents[2]
seen = 0


def met_run(
    tool: str,
    config: Path,
    folder: Path,
    number: int,
    moment: int,
    delay_s: float,
    *more: str,
    victim: int = 0,
    output: str = "run",
) -> subprocess.CompletedProcess[str]:
    """Run a tool with this configuration, into ``folder / output``, until the signal meets it; 0: none does."""
    words = [sys.executable, __file__, int(number), moment, delay_s, victim, folder, tool, "--config", config]
    return subprocess.run(
        [str(each) for each in [*words, "--output", folder / output, *more]],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))},
        capture_output=True,
        text=True,
        timeout=300,
    )


def watch(event: str, values: tuple) -> None:
    global seen
    if event not in EVENTS or not any(folder in str(each) for each in values):
        return
    seen += 1
    if seen == moment:
        if delay_s:
            timer = threading.Timer(delay_s, os.kill, (victim, number))
            timer.daemon = True
            timer.start()
        else:
            os.kill(victim, number)


if __name__ == "__main__":
    from deadwood_algorithms.evaluate.protection import changed_scenes
    from deadwood_algorithms.simulate import chunks
    from deadwood_toolbox import cli

    number, moment, delay_s, folder = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[5]
    victim = int(sys.argv[4]) or os.getpid()
    chunks.CHUNK, chunks.CHECKPOINT_S = 4, 0.0
    changed_scenes.CHUNK = 20
    sys.argv = ["deadwood-tool", *sys.argv[6:]]
    sys.addaudithook(watch)
    try:
        cli.main()
    finally:
        print(f"moments: {seen}")
