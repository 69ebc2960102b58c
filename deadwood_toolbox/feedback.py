"""Where a tool's progress, notes and warnings go: a bar, sparse lines, JSON, or nowhere; always standard error."""

from __future__ import annotations

import io
import json
import math
import os
import sys
import threading
import time
from collections.abc import Mapping
from typing import Any, TextIO

from deadwood_toolbox import collector

PROGRESS = ("auto", "bar", "plain", "json", "none")
SECONDS_BETWEEN = {"json": 0.25, "plain": 10.0}
FIRST_AFTER_S = 2.0  # the first plain line of a stage: even short runs show that something is happening
YELLOW, RED = "33", "31"
BAR = "{desc}: {percentage:3.0f} %|{bar}| {n:,.0f} of {total:,.0f}"  # in tqdm's names


class Speaker:
    """The ``Feedback`` of the command line.

    Parameters
    ----------
    progress
        One of ``PROGRESS``; ``auto`` is a bar on a terminal, elsewhere a plain line after two seconds, then every ten.
    """

    def __init__(
        self, progress: str = "auto", *, quiet: bool = False, verbose: bool = False, stream: TextIO | None = None
    ) -> None:
        self.stream = stream if stream is not None else sys.stderr
        if progress == "auto":
            progress = "bar" if self.stream.isatty() else "plain"
        self.as_json = progress == "json"
        self.mode = "none" if quiet and not self.as_json else progress
        self.quiet, self.verbose = quiet, verbose
        plain_asked = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb" or os.name == "nt"
        self._in_colours = self.stream.isatty() and not plain_asked
        self.stop = threading.Event()
        self._stage = _Stage("", 0.0)
        self._bar: Any = None

    def progress(self, done: float, total: float, what: str) -> None:
        """Show the progress of a stage; ``what`` names the stage, and a new name starts a new one."""
        collector.begin()
        now = time.monotonic()
        if what != self._stage.what or done < self._stage.done:
            self.close()
            self._stage = _Stage(what, now, first_done=done)
        stage = self._stage
        if stage.shown is not None and done == stage.done:
            return  # nothing new to report
        stage.done = done
        if self.mode == "bar":
            self._show_bar(done, total, what)
        elif self.mode in SECONDS_BETWEEN and stage.is_due(now, done >= total, SECONDS_BETWEEN[self.mode], self.mode):
            rate, left = stage.pace(now, total)
            if self.as_json:
                known = {"done": done, "total": total, "rate_per_s": _tidy(rate), "left_s": _tidy(left)}
                self._event("progress", what=what, **known)
            else:
                pace = "" if rate is None or left is None else f", {rate:.3g}/s, {clock(left)} left"
                self._line(f"{what}: {done:,.0f} of {total:,.0f} ({share(done, total)}){pace}")

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        if not self.quiet:
            self._event("note", message=message, **_known(code, numbers)) if self.as_json else self._line(message)

    def detail(self, message: str) -> None:
        """A message shown only with ``--verbose``."""
        if self.verbose:
            self.note(message)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        if self.as_json:
            self._event("warning", message=message, **_known(code, numbers))
        else:
            self._line(message, ("warning", YELLOW))

    def error(self, message: str, status: int) -> None:
        """The last message of a run that failed: exactly one line."""
        self.close()
        line = " ".join(part.strip() for part in message.splitlines() if part.strip())
        if self.as_json:
            self._event("error", message=line, exit_status=status)
        else:
            self._line(line, ("deadwood-tool", RED))

    def done(self, **known: Any) -> None:
        """The last message of a successful run, for programs; a reader gets notes."""
        self.close()
        if self.as_json:
            self._event("done", **known)

    def cancelled(self) -> bool:
        return self.stop.is_set()

    def close(self) -> None:
        """End the bar, so that the next line starts on a line of its own."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def _show_bar(self, done: float, total: float, what: str) -> None:
        what = printable(what)
        if self._bar is None:
            from tqdm import tqdm

            self._bar = tqdm(
                total=total, initial=done, desc=what, file=self.stream, unit="", bar_format=BAR, dynamic_ncols=True
            )
        self._bar.total = total
        if done > self._bar.initial:  # until then the rate is unknown
            self._bar.bar_format = f"{BAR}, {{rate_fmt}}, {{remaining}} left"
        self._bar.update(done - self._bar.n)

    def _line(self, text: str, mark: tuple[str, str] | None = None) -> None:
        """Print a line, preceded by a coloured mark (a word and a colon) if it has one."""
        if self._bar is not None:
            self._bar.clear()
        word, colour = mark or ("", "")
        before = f"{word}: " if word else ""
        if word and self._in_colours:
            before = f"\x1b[{colour}m{word}:\x1b[0m "
        self._print(before + printable(text))

    def _event(self, event: str, **known: Any) -> None:
        self._print(json.dumps(plain({"event": event, **known})))

    def _print(self, text: str) -> None:
        """Print to the reader; the work continues if the reader is gone (``2>&1 | head``)."""
        try:
            print(text, file=self.stream, flush=True)
        except BrokenPipeError:
            self.stream, self.mode = io.StringIO(), "none"


class _Stage:
    """A named stage of work: when it began, and when it was last shown."""

    def __init__(self, what: str, began: float, first_done: float = 0.0) -> None:
        self.what, self.began, self.first_done = what, began, first_done
        self.done = first_done
        self.shown: float | None = None

    def is_due(self, now: float, ended: bool, every: float, mode: str) -> bool:
        """Whether to show now; a stage that ends before its first plain line is due is not shown."""
        if self.shown is None:
            due = mode == "json" or now - self.began >= FIRST_AFTER_S
        else:
            due = ended or now - self.shown >= every
        if not due:
            return False
        self.shown = now
        return True

    def pace(self, now: float, total: float) -> tuple[float | None, float | None]:
        """Rate since the stage began [1/s] and time left at that rate [s]; None until there is one."""
        spent, gained = now - self.began, self.done - self.first_done
        if spent <= 0.0 or gained <= 0.0:
            return None, None
        rate = gained / spent
        return rate, max(total - self.done, 0.0) / rate


def _known(code: str, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What programs can tell a message by, if it has that."""
    return {"code": code, "numbers": numbers} if code else {}


def clock(seconds: float) -> str:
    """A duration for a reader: 42 s, 3 min 05 s, 2 h 10 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def printable(text: str) -> str:
    """The text without control sequences: an id from a file must not clear the screen or change the terminal's title.

    Control characters except line ends and tabs, and those that change the writing direction, are shown as \\x1b.
    """
    return "".join(each if each in "\n\t" or not _is_obeyed(each) else ascii(each)[1:-1] for each in text)


def _is_obeyed(letter: str) -> bool:
    code = ord(letter)
    return code < 32 or 127 <= code < 160 or 0x202A <= code <= 0x202E or 0x2066 <= code <= 0x2069


def share(done: float, total: float) -> str:
    return f"{100.0 * done / total:.0f} %" if total > 0 else "100 %"


def plain(value: Any) -> Any:
    """The value as JSON: numpy's numbers as numbers, NaN and infinity as null, everything else as text."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if hasattr(value, "tolist"):  # numpy, which is not imported here
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, str | int) else str(value)


def _tidy(value: float | None) -> float | None:
    """Four significant digits, which are enough for a rate and keep the line short."""
    return None if value is None else float(f"{value:.4g}")
