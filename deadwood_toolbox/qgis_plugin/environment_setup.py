"""The toolbox's own environment created, verified, repaired and removed, step by step, while QGIS stays responsive.

Each step is a child process that Qt monitors; nothing here waits. Unfinished parts are removed, and if a repair fails
the previous environment is restored.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsTask
from qgis.PyQt.QtCore import QObject, QProcess, QTimer, pyqtSignal

from . import own_python
from .finding import environment, own_folder, read_manifest, script_in
from .language import _

GRACE_MS = 3000
LIBRARIES = 45  # approximate number of libraries that pip names
PIP = ("-I", "-m", "pip", "--disable-pip-version-check", "--no-input")
# Wheels, so that no library is compiled from its sources here if an older version has a wheel; and no bytecode for ten
# thousand files, of which the tools use a third: Python compiles those when it first loads them.
INSTALL = ("install", "--progress-bar=off", "--prefer-binary", "--no-compile")
# Percentage at which each step begins.
MAKING, INSTALLING, UNPACKING, VERIFYING, COMPILING = 3, 10, 45, 80, 82
TICK_MS = 2000  # while pip unpacks, which it does without output
TICK_SHARE = 0.04  # of the remainder of that stage, for each tick

Steps = Generator[list[str], tuple[int, str], None]


class Failed(Exception):
    """A step has failed; the message is for the user."""


class Setup(QObject):
    """One environment; ``moved`` reports percent and activity, ``said`` a line of a step's output, ``ended`` the
    outcome.
    """

    moved = pyqtSignal(int, str)
    said = pyqtSignal(str)
    ended = pyqtSignal(bool, str)

    def __init__(self, place: Path | None = None) -> None:
        super().__init__()
        self.place = place or own_folder()
        self.before = self.place.with_name(f"{self.place.name}.before")
        self.child: QProcess | None = None
        self.steps: Steps | None = None
        self.output, self.rest, self.percent, self.libraries = "", "", 0.0, 0
        self.stopped = False
        self.tasks: list[QgsTask] = []
        self.clock = QTimer(self)
        self.clock.setInterval(TICK_MS)
        self.clock.timeout.connect(self._tick)

    def busy(self) -> bool:
        return self.steps is not None or bool(self.tasks)

    def installed(self) -> bool:
        return script_in(self.place).is_file()

    def make(self, python: str = "", source: str = "") -> None:
        """Create the environment; ``python`` and ``source`` are what the user names, if anything."""
        self.stopped, self.libraries = False, 0
        if self.place.exists():
            self._discard(self.before)
            self.place.rename(self.before)
        self.steps = self._steps(python, source)
        self._go(None)

    def cancel(self) -> None:
        if self.steps is not None and not self.stopped:
            self.stopped = True
            self._move(self.percent, _("Stopping …"))
            if self.child is not None:
                self.child.closeWriteChannel()
                self.child.terminate()
                QTimer.singleShot(GRACE_MS, self._kill)

    def _kill(self) -> None:
        if self.stopped and self.child is not None:
            self.child.kill()

    def remove(self) -> None:
        self._move(0, _("Removing …"))
        self._discard(self.place, lambda: self.ended.emit(True, _("The environment was removed.")))

    def _steps(self, named: str, source: str) -> Steps:
        """The steps, as the command line of one process after the other; each returns its exit status and output."""
        yield from self._environment(named)
        self._move(INSTALLING, _("Installing libraries …"))
        words = [*PIP, *INSTALL, *own_python.what_to_install(source)]
        status, said = yield [str(own_python.python_of(self.place)), *words]
        if status != 0:
            raise Failed(own_python.no_packages(said))
        self._move(VERIFYING, _("Verifying …"))
        tool = str(script_in(self.place))
        status, said = yield [tool, "--version"]
        own = read_manifest()["version"]
        if status != 0 or not said.startswith("deadwood-tool "):
            raise Failed(own_python.not_working(said))
        if own not in said.split():
            message = _("The installed toolbox has version {other}, the plugin {own}; use the same version of both.")
            raise Failed(message.format(other=said.split()[1], own=own))
        self._move(COMPILING, _("Compiling the engine for this machine, one to two minutes …"))
        status, said = yield [tool, "warm-up", "--progress=json"]
        if status != 0:
            raise Failed(own_python.not_working(said))

    def _environment(self, named: str) -> Steps:
        """An environment of the first Python, in the order of the list, with which one can be made and starts."""
        self._move(0, _("Looking for a Python …"))
        failures: dict[str, str] = {}
        for program in own_python.candidates(named):
            status, said = yield [program, "-I", "-c", own_python.VERSION_LINE]
            python = own_python.suitable(said) if status == 0 else ""
            if not python:
                failures[program] = own_python.too_old(program)
            elif python not in failures:
                self._move(MAKING, _("Making the environment …"))
                status, said = yield [python, "-I", "-m", "venv", "--clear", str(self.place)]
                if status == 0:
                    status, said = yield [str(own_python.python_of(self.place)), "-I", "-c", own_python.STARTS]
                if status == 0:
                    return
                failures[python] = own_python.no_environment(python, said)
        raise Failed(own_python.no_python(named, list(failures.values())))

    # --- one step after the other ----------------------------------------------------------------------------------

    def _go(self, answer: tuple[int, str] | None) -> None:
        if self.steps is None:
            return
        if self.stopped:
            self._end(False, _("Cancelled; nothing was left behind."))
            return
        try:
            words = next(self.steps) if answer is None else self.steps.send(answer)
        except StopIteration:
            self._end(True, _("The toolbox is installed and ready."))
        except Failed as failure:
            self._end(False, str(failure))
        else:
            self._start(words)

    def _start(self, words: list[str]) -> None:
        self.output = self.rest = ""
        self.said.emit("> " + " ".join(words))
        self.child = child = QProcess(self)
        variables = environment()
        if proxy := own_python.proxy():  # in a variable, because command lines are seen by others
            variables.insert("PIP_PROXY", proxy)
        child.setProcessEnvironment(variables)
        child.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        child.readyRead.connect(self._hear)
        child.finished.connect(self._stopped)
        child.errorOccurred.connect(self._failed)
        child.start(words[0], words[1:])

    def _stopped(self, status: int, how: QProcess.ExitStatus) -> None:
        self._finished(status if how == QProcess.ExitStatus.NormalExit else -1)

    def _failed(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart and self.child is not None:
            self.output += self.child.errorString()
            self._finished(-1)

    def _finished(self, status: int) -> None:
        self._hear()
        self.clock.stop()
        if self.child is not None:
            self.child.deleteLater()
            self.child = None
        self._go((status, self.output))

    def _hear(self) -> None:
        if self.child is None:
            return
        more = bytes(self.child.readAll()).decode("utf-8", "replace")
        self.output += more
        *lines, self.rest = (self.rest + more).split("\n")
        for line in filter(str.strip, lines):
            self._line(line.rstrip())

    def _line(self, line: str) -> None:
        library = own_python.library_of(line)
        if line.startswith("Installing collected packages"):
            self._move(UNPACKING, _("Unpacking the libraries, one to two minutes …"))
            self.clock.start()
        elif library and self.percent < UNPACKING:
            self.libraries += 1
            share = min(0.95, self.libraries / LIBRARIES)
            at = INSTALLING + round(share * (UNPACKING - INSTALLING))
            self._move(at, _("Installing libraries: {name} …").format(name=library))
        if line.startswith('{"'):
            self._event(json.loads(line))
        else:
            self.said.emit(line)

    def _tick(self) -> None:
        at = self.percent + TICK_SHARE * (VERIFYING - self.percent)
        self._move(at, _("Unpacking the libraries, one to two minutes …"))

    def _event(self, event: dict[str, Any]) -> None:
        """Progress and messages of the tool itself, during the compilation."""
        if event["event"] == "progress" and event["total"]:
            self._move(COMPILING + round((100 - COMPILING) * event["done"] / event["total"]), event["what"])
        elif "message" in event:
            self.said.emit(event["message"])

    def _move(self, percent: float, what: str) -> None:
        self.percent = percent
        self.moved.emit(round(percent), what)

    def _end(self, worked: bool, message: str) -> None:
        self.steps = None
        if worked:
            self._discard(self.before, lambda: self.ended.emit(True, message))  # then no longer busy
            return
        self._discard(self.place, lambda: self._back(message))

    def _back(self, message: str) -> None:
        if self.before.exists():
            self.before.rename(self.place)
            message += " " + _("The previous environment has been restored.")
        self.ended.emit(False, message)

    def _discard(self, place: Path, then: Callable[[], None] | None = None) -> None:
        """Remove a folder of thousands of files in a background task of QGIS; first rename it, to make room."""
        gone = place.with_name(f"{place.name}.gone")
        if place.exists():
            own_python.remove(gone)
            place.rename(gone)

        def done(error: object, result: object = None) -> None:
            self.tasks.remove(task)
            if then is not None:
                then()

        task = QgsTask.fromFunction(_("Deadwood Toolbox"), lambda running: own_python.remove(gone), on_finished=done)
        self.tasks.append(task)
        QgsApplication.taskManager().addTask(task)
