"""Run the tests of the engine alone, and record the engine if all pass: ``python -m tests.proved``.

Thousands of poses and logs take a sixth of the time of all tests, and their answers change only with the engine and its
compiler. A run of all tests leaves them out while the engine is the recorded one (``conftest``); it runs them with any
other.
"""

from __future__ import annotations

import datetime
import subprocess
import sys

from deadwood_engine import engine_digest
from tests.conftest import HERE, OF_THE_ENGINE, PROVED


def main() -> int:
    folders = [str(HERE / each) for each in OF_THE_ENGINE]
    status = subprocess.run([sys.executable, "-m", "pytest", "-n", "auto", *folders], cwd=HERE.parent).returncode
    if status == 0:
        PROVED.write_text(f"{engine_digest()} {datetime.date.today().isoformat()}\n", encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main())
