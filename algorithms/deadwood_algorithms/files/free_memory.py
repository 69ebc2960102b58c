"""How much memory this process may still use: checked before the work, to avoid being killed during it."""

from __future__ import annotations

from pathlib import Path

SHARE = 0.9  # of the free memory may be used
GIB = 2.0**30
MEMINFO, CGROUP = Path("/proc/meminfo"), Path("/sys/fs/cgroup")  # of Linux


def free_bytes() -> int | None:
    """Memory that is still available to this process; None if the system does not report it."""
    known = [each for each in (_available(), _of_container()) if each is not None]
    return min(known) if known else None


def _available() -> int | None:
    """Memory available on the system: Linux reports it in a file, psutil on Windows and macOS."""
    try:
        for line in MEMINFO.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError):
        pass
    import psutil

    try:
        return int(psutil.virtual_memory().available)
    except (psutil.Error, OSError, RuntimeError, NotImplementedError):
        return None


def _of_container() -> int | None:
    """Memory left within a Linux container's own limit; cached files can be dropped and do not count."""
    try:
        limit, used = (CGROUP / "memory.max").read_text().strip(), int((CGROUP / "memory.current").read_text())
        facts = dict(line.split() for line in (CGROUP / "memory.stat").read_text().splitlines())
        return None if limit == "max" else max(0, int(limit) - used + int(facts.get("inactive_file", 0)))
    except (OSError, ValueError):
        return None
