"""Python's search for cycles of garbage, put off while a command starts: what libraries make on import stays anyway.

To look through it again and again, and once more at the end, took a quarter of the time of a run of one log (1.2 CPU
seconds in place of 1.7). For the command line alone, whose process is its own.
"""

from __future__ import annotations

import gc

_STARTING = 500_000  # new objects between two searches until the work begins: the libraries make about this number
_usual: tuple[int, int, int] | None = None


def put_off() -> None:
    """As the process starts."""
    global _usual
    _usual = gc.get_threshold()
    gc.set_threshold(_STARTING)


def begin() -> None:
    """When the work starts (a second call has no effect): existing objects are never scanned again."""
    global _usual
    if _usual is not None:
        gc.freeze()
        gc.set_threshold(*_usual)
        _usual = None
