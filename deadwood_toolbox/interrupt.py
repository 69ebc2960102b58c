"""Ctrl-C and SIGTERM end a run within two seconds, whatever it is doing.

The handler tells the tool through ``Feedback.cancelled`` and raises ``KeyboardInterrupt`` in the main thread, so that
every ``with`` removes what it had begun. Python runs a handler only between two bytecodes of the main thread, so a long
native call would hold it back; the watchdog thread hears of the signal at once (by the wake-up socket, which the C side
writes) and ends the process when the tidy way takes too long. Even then only temporary files stay: results get their
names at the very end.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Iterator
from types import FrameType

INTERRUPTED = 130
GRACE_S = 1.7  # of the two seconds promised; the rest is for the process to end


@contextlib.contextmanager
def interruptible(stop: threading.Event) -> Iterator[None]:
    """Within it a signal sets ``stop`` and raises ``KeyboardInterrupt`` once; later signals are not heard."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers; its own signals are its caller's business
        return

    def handle(signum: int, frame: FrameType | None) -> None:
        if not stop.is_set():  # a second Ctrl-C must not interrupt the tidying up
            stop.set()
            raise KeyboardInterrupt

    ears, mouth = socket.socketpair()
    mouth.setblocking(False)
    finished = threading.Event()
    watchdog = threading.Thread(target=_watch, args=(ears, finished), name="watchdog", daemon=True)
    watchdog.start()
    before_wakeup = signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(before_wakeup)
        finished.set()
        mouth.close()
        watchdog.join()
        ears.close()


def _watch(ears: socket.socket, finished: threading.Event) -> None:
    while heard := ears.recv(64):
        if {signal.SIGINT, signal.SIGTERM} & set(heard) and not finished.wait(GRACE_S):
            with contextlib.suppress(OSError):
                os.write(2, b"deadwood-tool: interrupted; nothing was left under a final name\n")
            os._exit(INTERRUPTED)
