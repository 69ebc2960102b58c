"""slide-logs as a program that a signal meets at a given moment: `killed_run.py NUMBER EVENT DELAY_S FOLDER ARGUMENTS`.

Moments are counted in what the program does to files in FOLDER, of which most is done while the results are written;
the signal comes so long after. The number of moments is printed at the end of a run that no signal has met.
"""

from __future__ import annotations

import os
import sys
import threading

EVENTS = ("open", "os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.truncate", "shutil.rmtree", "sqlite3.connect")
seen = 0


def watch(event: str, values: tuple) -> None:
    global seen
    if event not in EVENTS or not any(folder in str(each) for each in values):
        return
    seen += 1
    if seen == moment:
        if delay_s:
            timer = threading.Timer(delay_s, os.kill, (os.getpid(), number))
            timer.daemon = True
            timer.start()
        else:
            os.kill(os.getpid(), number)


if __name__ == "__main__":
    from deadwood_algorithms import slide_logs
    from deadwood_toolbox import cli

    number, moment, delay_s, folder = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    slide_logs.CHUNK, slide_logs.CHECKPOINT_S = 4, 0.0
    sys.argv = ["deadwood-tool", *sys.argv[5:]]
    sys.addaudithook(watch)
    try:
        cli.main()
    finally:
        print(f"moments: {seen}")
