"""The tool as a child process: started, listened to, and ended when the user cancels."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from qgis.core import QgsProcessingException, QgsProcessingFeedback, QgsSettings
from qgis.PyQt.QtCore import QProcess

from .finding import Missing, environment, find, how_to_install, read_manifest
from .language import _, signs

START_MS = 60_000  # the first start after an installation compiles Python's bytecode
LOOK_MS = 100  # between two checks of the Cancel button
VERSION_OF, VERSION_SEEN = "deadwood/version_of", "deadwood/version_seen"  # settings: a command, and its version
UNKNOWN = "no such option"  # as the command line says it (a test)
SUCCESS = (0, 3)  # exit status; 3: done, and something about an input is doubted
GRACE_MS = 5000  # for the child to clean up, before it is killed
BETWEEN_TEXTS_S = 10.0  # between two texts of the progress, each of which is a line in the log


@dataclass
class Said:
    """The output of the tool: the end of standard error, and the lines for a reader."""

    outputs: dict[str, str] = field(default_factory=dict)
    facts: dict[str, Any] = field(default_factory=dict)
    error: str = ""
    command: str = ""
    lines: list[str] = field(default_factory=list)


def command() -> tuple[str, ...]:
    """The words of the command; if it is missing, an exception that explains how to install it."""
    found = find()
    if isinstance(found, Missing):
        raise QgsProcessingException(f"{found.why}.\n{how_to_install()}")
    return found.command


def version_of(command: Sequence[str]) -> str:
    """The version of the toolbox that a command starts, asked once for each command as installed; empty if unknown."""
    try:
        key = f"{command}|{os.stat(command[0]).st_mtime_ns}"
    except OSError:
        return ""
    settings = QgsSettings()
    if settings.value(VERSION_OF, "") != key:
        child = QProcess()
        child.setProcessEnvironment(environment())
        child.start(command[0], [*command[1:], "--version"])
        started = child.waitForStarted(START_MS) and child.waitForFinished(START_MS)
        said = bytes(child.readAllStandardOutput()).decode("utf-8", "replace").split() if started else []
        if len(said) < 2 or said[0] != "deadwood-tool":
            return ""
        settings.setValue(VERSION_SEEN, said[1])
        settings.setValue(VERSION_OF, key)
    return str(settings.value(VERSION_SEEN, ""))


def drift(command: Sequence[str]) -> str:
    """The versions of the plugin and of the toolbox, if they differ, and what makes them the same; else empty."""
    own, other = read_manifest()["version"], version_of(command)
    return versions_of(own, other) if other and other != own else ""


def versions_of(own: str, other: str) -> str:
    message = _("The plugin has version {own}, the toolbox {other}; Plugins > Deadwood Toolbox > Set up… > Repair")
    return message.format(own=own, other=other or _("an unknown one"))


def run(
    arguments: Sequence[str], feedback: QgsProcessingFeedback, worded: Callable[[str], str] = lambda line: line
) -> Said:
    """Run one tool to its end; an exit status that is no success is an exception with the tool's own line.

    Messages of the tool about its inputs are converted to the user's names by ``worded``.
    """
    starter = command()
    words = [*starter, *arguments, "--progress=json"]
    said_command = " ".join(_quoted(word) for word in words)
    feedback.pushCommandInfo(said_command)
    own, other = read_manifest()["version"], version_of(starter)
    feedback.pushInfo(_("Plugin {own}, toolbox {other}").format(own=own, other=other or "?"))
    child = QProcess()
    child.setProcessEnvironment(environment())
    child.start(words[0], words[1:])
    if not child.waitForStarted(30_000):
        message = _("{program} could not be started: {why}")
        why = message.format(program=words[0], why=child.errorString())
        raise QgsProcessingException(f"{why}\n{versions_of(own, other)}")
    ears = Ears(feedback, worded)
    ears.said.command = said_command
    while child.state() != QProcess.ProcessState.NotRunning:
        child.waitForFinished(LOOK_MS)
        ears.hear(bytes(child.readAllStandardError()), bytes(child.readAllStandardOutput()))
        if feedback.isCanceled():
            end(child)
            raise QgsProcessingException(_("Canceled"))
    ears.hear(bytes(child.readAllStandardError()) + b"\n", bytes(child.readAllStandardOutput()) + b"\n")
    said = ears.said
    if child.exitStatus() != QProcess.ExitStatus.NormalExit or child.exitCode() not in SUCCESS:
        message = _("the tool ended unexpectedly (status {status}, {why})")
        why = said.error or message.format(status=child.exitCode(), why=child.errorString())
        raise QgsProcessingException(f"{why}\n{versions_of(own, other)}" if UNKNOWN in said.error else why)
    for line in said.lines:
        feedback.pushInfo(line)
    return said


def end(child: QProcess) -> None:
    """End the child: request it in two ways (a closed pipe, which also works on Windows, and SIGTERM), then kill it."""
    child.closeWriteChannel()
    child.terminate()
    if not child.waitForFinished(GRACE_MS):
        child.kill()
        child.waitForFinished(GRACE_MS)


class Ears:
    """Splits the child's output into lines, JSON or text."""

    def __init__(self, feedback: QgsProcessingFeedback, worded: Callable[[str], str] = lambda line: line) -> None:
        self.feedback, self.worded = feedback, worded
        self.said = Said()
        self.rest = [b"", b""]
        self.stage, self.spoke = "", 0.0

    def hear(self, errors: bytes, output: bytes) -> None:
        for line in self._lines(0, errors):
            self._event(line)
        self.said.lines += self._lines(1, output)

    def _lines(self, channel: int, more: bytes) -> list[str]:
        *whole, self.rest[channel] = (self.rest[channel] + more).split(b"\n")
        return [text for line in whole if (text := line.decode("utf-8", "replace").rstrip())]

    def _event(self, line: str) -> None:
        try:
            known = json.loads(line)
            event = known["event"]
        except (ValueError, TypeError, KeyError):
            self.feedback.pushConsoleInfo(line)
            return
        if event == "progress":
            self._progress(known)
        elif event == "note":
            self.feedback.pushInfo(self.worded(known["message"]))
        elif event == "warning":
            self.feedback.pushWarning(self.worded(known["message"]))
        elif event == "error":
            self.said.error = self.worded(known["message"])
        elif event == "done":
            self.said.outputs, self.said.facts = known["outputs"], known["facts"]

    def _progress(self, known: dict[str, Any]) -> None:
        done, total, what = known["done"] or 0, known["total"] or 0, known["what"]
        if total:
            self.feedback.setProgress(100.0 * done / total)
        now = time.monotonic()
        if what == self.stage and now - self.spoke < BETWEEN_TEXTS_S:
            return
        place, colon, stage = what.rpartition(": ")  # of a longer task: the step that is at this stage
        text = place + colon + _(stage)
        if what == self.stage and known.get("left_s") is not None:
            rate = known["rate_per_s"]
            state = _("{done} of {total}, {rate} per second, {left} left")
            if rate < 1.0:
                state, rate = _("{done} of {total}, {rate} per minute, {left} left"), 60.0 * rate
            counts = {"done": f"{done:.0f}", "total": f"{total:.0f}", "left": _clock(known["left_s"])}
            text += ": " + state.format(rate=signs(f"{rate:.2g}" if rate < 10.0 else f"{rate:.0f}"), **counts)
        self.stage, self.spoke = what, now
        self.feedback.setProgressText(text)


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"


def _quoted(word: str) -> str:
    return f'"{word}"' if any(each in word for each in " |()&;*?'") else word
