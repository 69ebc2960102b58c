"""Ctrl-C and SIGTERM end a run within two seconds, whatever it is doing, in three steps of increasing force.

Immediately ``Feedback.cancelled`` returns true, and a tool that checks it (the engine does, several times a second)
ends in an orderly way. After ``ASKED_S`` follows ``KeyboardInterrupt`` in the main thread, so that every ``with``
removes what it had begun; if it is raised in a callback from which Python drops exceptions (of a weak reference, of
``ctypes``), it is repeated. Python runs a handler only between two bytecodes of the main thread, so a long native call
delays that too; after ``GRACE_S`` the watchdog thread, which the C side notifies of a signal through the wake-up
socket, removes the temporary files and ends the process: results get their names at the very end.

A program that starts the tool (such as QGIS) may set ``DEADWOOD_STOP_WITH_STDIN``: the end of standard input then
counts as Ctrl-C. That works on Windows too, which has no SIGTERM, and ends the tool when the program itself dies.
"""

from __future__ import annotations

import _thread
import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

INTERRUPTED = 130
MESSAGE = "interrupted; nothing was left under a final name"
LATE = "interrupted after the work was done; the results are whole"
ASKED_S = 0.6
STOP_WITH_STDIN = "DEADWOOD_STOP_WITH_STDIN"
GRACE_S = 1.5  # of the two seconds promised; the rest is for the process to end
LOOK_S = 0.05  # how soon an interrupt that was dropped is raised again


@contextlib.contextmanager
def interruptible(stop: threading.Event) -> Iterator[None]:
    """Inside the block, the first signal sets ``stop`` and the second raises ``KeyboardInterrupt``; others are
    ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers; otherwise signals are up to the caller
        return

    raised = False

    def handle(signum: int, frame: FrameType | None) -> None:
        nonlocal raised
        if not stop.is_set():
            stop.set()
        elif not raised:  # a further signal must not interrupt the cleanup
            raised = True
            raise KeyboardInterrupt

    dropped = threading.Event()
    before_hook = sys.unraisablehook

    def unraisable(what: sys.UnraisableHookArgs) -> None:
        nonlocal raised
        if raised and issubclass(what.exc_type, KeyboardInterrupt):
            raised = False
            dropped.set()
        else:
            before_hook(what)

    ears, mouth = socket.socketpair()
    mouth.setblocking(False)
    finished = threading.Event()
    watchdog = threading.Thread(target=_watch, args=(ears, finished, dropped), name="watchdog", daemon=True)
    watchdog.start()
    sys.unraisablehook = unraisable
    before_wakeup = signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    if os.environ.get(STOP_WITH_STDIN, "0") not in ("", "0"):
        threading.Thread(target=_wait_for_end, args=(finished,), name="stdin", daemon=True).start()
    try:
        yield
    finally:
        finished.set()  # before the handlers are removed, or the watchdog's interrupt could reach the default one
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(before_wakeup)
        sys.unraisablehook = before_hook
        mouth.close()
        watchdog.join()
        ears.close()


def deaf() -> None:
    """Ignore signals from now on: the work is done, and Python's own exit must not become -15."""
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(AttributeError, ValueError):
            signal.signal(number, signal.SIG_IGN)


def _watch(ears: socket.socket, finished: threading.Event, dropped: threading.Event) -> None:
    while heard := ears.recv(64):
        if not {signal.SIGINT, signal.SIGTERM} & set(heard) or finished.wait(ASKED_S):
            continue
        end = time.monotonic() + GRACE_S - ASKED_S
        _thread.interrupt_main()  # calls the handler again
        while not finished.wait(LOOK_S):
            if time.monotonic() > end:
                left = "".join(f"; {each} is left, the next run to this output removes it" for each in _tidied())
                with contextlib.suppress(OSError):
                    os.write(2, f"deadwood-tool: {MESSAGE}{left}\n".encode())
                os._exit(INTERRUPTED)
            if dropped.is_set():
                dropped.clear()
                _thread.interrupt_main()


def _tidied() -> list[Path]:
    """Remove temporary outputs in the place of the main thread, which hears nothing; gives what is left of them."""
    outputs = sys.modules.get("deadwood_algorithms.files.outputs")  # an import could wait for the main thread's
    return outputs.remove_unfinished() if outputs else []


def _wait_for_end(finished: threading.Event) -> None:
    """Read standard input to its end, then interrupt like Ctrl-C."""
    with contextlib.suppress(OSError):
        while os.read(0, 4096):
            pass
    if not finished.is_set():
        signal.raise_signal(signal.SIGINT)
