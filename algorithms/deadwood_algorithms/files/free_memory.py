"""How much memory this process may still take: asked before the work, not found out by a killed run."""

from __future__ import annotations

import os
from pathlib import Path

SHARE = 0.9  # of the free memory may be asked for
GIB = 2.0**30


def free_bytes() -> int | None:
    """Memory that this process may still take; None where the system does not tell."""
    known = [each for each in (_available(), _of_container()) if each is not None]
    return min(known) if known else None


def _available() -> int | None:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError):
        pass
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _of_container() -> int | None:
    """What a Linux container's own limit leaves; files that are merely cached can be dropped and do not count."""
    folder = Path("/sys/fs/cgroup")
    try:
        limit, used = (folder / "memory.max").read_text().strip(), int((folder / "memory.current").read_text())
        facts = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
        return None if limit == "max" else max(0, int(limit) - used + int(facts.get("inactive_file", 0)))
    except (OSError, ValueError):
        return None
