"""The engine behind the panel: `deadwood-tool explore --stdio`, a persistent process that takes requests as lines of
JSON.

Its answers are frames: the length of the frame, the length of a header, the header as JSON, and arrays. Nothing here
waits: Qt signals when something has arrived.
"""

from __future__ import annotations

import json
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from qgis.core import QgsApplication, QgsProcessingFeedback
from qgis.PyQt.QtCore import QObject, QProcess, QTimer, pyqtSignal

from .child import GRACE_MS, Ears, command
from .finding import environment
from .language import _

LENGTH_BYTES = 4  # of the length before a frame, and of the one before its header
ALIGNED = 8  # alignment of arrays [bytes]
KINDS = {"<f4": "f", "<f8": "d", "<u2": "H", "<u4": "I", "<i4": "i", "<i8": "q", "|u1": "B"}


@dataclass(frozen=True)
class Frame:
    """An answer: facts, and flat arrays by name with their shapes."""

    facts: dict[str, Any]
    arrays: dict[str, array[Any]]
    shapes: dict[str, tuple[int, ...]]

    @staticmethod
    def of(block: bytes) -> Frame:
        first = LENGTH_BYTES + int.from_bytes(block[:LENGTH_BYTES], "little")
        facts = json.loads(block[LENGTH_BYTES:first])
        arrays, shapes = {}, {}
        for declared in facts.pop("arrays"):
            made, shape = array(KINDS[declared["dtype"]]), tuple(declared["shape"])
            size = int(declared["dtype"][2:])
            for each in shape:
                size *= each
            made.frombytes(block[first : first + size])
            arrays[declared["name"]], shapes[declared["name"]] = made, shape
            first += size + -size % ALIGNED
        return Frame(facts, arrays, shapes)


class Frames:
    """Assembles frames from pieces of the stream."""

    def __init__(self) -> None:
        self.rest = bytearray()

    def taken(self, more: bytes) -> list[Frame]:
        self.rest += more
        found = []
        while len(self.rest) >= LENGTH_BYTES:
            end = LENGTH_BYTES + int.from_bytes(self.rest[:LENGTH_BYTES], "little")
            if len(self.rest) < end:
                break
            found.append(Frame.of(bytes(self.rest[LENGTH_BYTES:end])))
            del self.rest[:end]
        return found


class Heard(QgsProcessingFeedback):
    """The tool's standard error while it loads: the last text, and the warnings."""

    def __init__(self, tell: Any) -> None:
        super().__init__(False)
        self.tell = tell
        self.warnings: list[str] = []

    def setProgressText(self, text: str) -> None:
        self.tell(text)

    def pushInfo(self, info: str) -> None:
        pass

    def pushConsoleInfo(self, info: str) -> None:
        pass

    def pushWarning(self, warning: str) -> None:
        self.warnings.append(warning)


class Engine(QObject):
    """One process, from its start to its end."""

    answered = pyqtSignal(object)  # a Frame
    loading = pyqtSignal(str)
    died = pyqtSignal(str)  # its last output; only if nobody requested its end

    def __init__(self) -> None:
        super().__init__()
        self.frames, self.heard = Frames(), Heard(self.loading.emit)
        self.ears = Ears(self.heard)
        self.process: QProcess | None = None

    def start(self, arguments: Sequence[str]) -> None:
        """Start it; if the toolbox is missing, the exception explains how to install it."""
        words = [*command(), "explore", *arguments, "--stdio", "--progress=json"]
        surroundings = environment()
        surroundings.remove("DEADWOOD_STOP_WITH_STDIN")  # messages come on standard input, and it ends with that anyway
        self.process = process = QProcess(QgsApplication.instance())
        process.setProcessEnvironment(surroundings)
        process.readyReadStandardOutput.connect(self._read)
        process.readyReadStandardError.connect(self._hear)
        process.errorOccurred.connect(self._failed)
        process.finished.connect(self._finished)
        process.start(words[0], words[1:])

    def ask(self, message: dict[str, Any]) -> None:
        if self.process is not None:
            self.process.write((json.dumps(message) + "\n").encode())

    def end(self) -> None:
        """End it: close its input, which ends the process; kill it if that takes too long."""
        process, self.process = self.process, None
        if process is None:
            return
        for signal in (
            process.readyReadStandardOutput,
            process.readyReadStandardError,
            process.errorOccurred,
            process.finished,
        ):
            signal.disconnect()
        if process.state() == QProcess.ProcessState.NotRunning:
            process.deleteLater()
            return
        process.finished.connect(process.deleteLater)
        force = QTimer(process)
        force.setSingleShot(True)
        force.timeout.connect(process.kill)
        force.start(GRACE_MS)
        process.closeWriteChannel()

    def _read(self) -> None:
        if self.process is not None:
            for each in self.frames.taken(bytes(self.process.readAllStandardOutput())):
                self.answered.emit(each)

    def _hear(self) -> None:
        if self.process is not None:
            self.ears.hear(bytes(self.process.readAllStandardError()), b"")

    def _failed(self, error: QProcess.ProcessError) -> None:
        """Only needed for a process that never started; other failures also end the process."""
        if error == QProcess.ProcessError.FailedToStart and self.process is not None:
            why = self.process.errorString()
            self.end()
            message = _("{program} could not be started: {why}")
            self.died.emit(message.format(program="deadwood-tool", why=why))

    def _finished(self, *_signal: Any) -> None:
        self._read()
        self._hear()
        self.end()
        self.died.emit(self.ears.said.error)
