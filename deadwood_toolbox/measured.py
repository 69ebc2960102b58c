"""Insert the output of a command into the README, so that no measured number is typed by hand.

In a checkout: ``deadwood-tool demo --output demo | python -m deadwood_toolbox.measured demo``.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"


def filled(page: str, name: str, printed: str) -> str:
    """The page with the printed text, as a block, between the two marks of that name."""
    marks = re.compile(
        rf"(<!-- measured: {re.escape(name)}\b[^>]*-->\n).*?(<!-- end of measured: {re.escape(name)} -->)", re.S
    )
    if not marks.search(page):
        raise SystemExit(f"no place is marked '{name}'")
    block = f"\n```\n{printed.strip()}\n```\n\n"
    return marks.sub(lambda found: found[1] + block + found[2], page)


def main() -> None:
    printed = sys.stdin.read()
    if not printed.strip():
        raise SystemExit("nothing was printed, so nothing is written")
    README.write_text(filled(README.read_text(encoding="utf-8"), sys.argv[1], printed), encoding="utf-8")
    print(f"wrote {README}")


if __name__ == "__main__":
    main()
