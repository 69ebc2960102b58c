"""Run the tests that a run of all leaves out, and record what passed: ``python -m tests.proved [MARKER]``.

Without a marker (``engine_alone``, ``statistics``) those of both; ``tests/proofs.py`` says what they are.
"""

from __future__ import annotations

import argparse
import datetime
import subprocess
import sys

from tests.proofs import HERE, MARKERS, RECORD, digest_of


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("marker", nargs="?", choices=MARKERS)
    chosen = [only] if (only := parser.parse_args().marker) else list(MARKERS)
    command = [sys.executable, "-m", "pytest", "-n", "auto", "-m", " or ".join(chosen), str(HERE)]
    status = subprocess.run(command, cwd=HERE.parent).returncode
    if status == 0:
        lines = [line for line in RECORD.read_text(encoding="utf-8").splitlines() if line.split()[0] not in chosen]
        lines += [f"{each} {digest_of(each)} {datetime.date.today().isoformat()}" for each in chosen]
        RECORD.write_text("\n".join(sorted(lines)) + "\n", encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main())
