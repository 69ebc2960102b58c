"""What a tool says while it works; of its result as records: notes of what was assumed, warnings of what is doubtful.

A message with a code is about the result and is stored with it; one without is about the work (resuming, threads,
compilation), and two equal results may differ in it. Standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

from deadwood_algorithms.params.final_place import with_final_places

NOTE, WARNING = "note", "warning"


@dataclass(frozen=True)
class Message:
    """A note or a warning, as in ``warnings`` of a result's record.

    code : stable name of what is said, for programs; text : one line for a reader; numbers : what programs may compare
    """

    code: str
    text: str
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    level: str = WARNING

    def record(self) -> dict[str, Any]:
        return asdict(self)


def messages_in(record: Mapping[str, Any]) -> list[Message]:
    """The messages in the record or the summary of a result; none in those of older versions."""
    found = record.get("warnings")
    return [
        Message(str(each["code"]), str(each["text"]), _numbers(each.get("numbers")), str(each.get("level", WARNING)))
        for each in (found if isinstance(found, list) else ())
        if isinstance(each, Mapping) and {"code", "text"} <= each.keys()
    ]


def _numbers(found: Any) -> dict[str, float | None]:
    return dict(found) if isinstance(found, Mapping) else {}


def warnings_among(messages: Iterable[Message]) -> list[Message]:
    return [each for each in messages if each.level == WARNING]


class Feedback(Protocol):
    """The messages of a tool while it works; the caller decides where they go.

    A message about the result has a ``code`` and numbers, and is stored with it; one about the work has
    none.
    """

    def progress(self, done: float, total: float, what: str) -> None: ...

    def note(self, message: str, code: str = "", **numbers: Any) -> None: ...

    def warn(self, message: str, code: str = "", **numbers: Any) -> None: ...

    def cancelled(self) -> bool: ...


class Quiet:
    """A feedback without output: the default for Python callers."""

    def progress(self, done: float, total: float, what: str) -> None:
        pass

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        pass

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        pass

    def cancelled(self) -> bool:
        return False


class ProgressOnly(Quiet):
    """A feedback that passes on progress only, when the notes are already known or not needed."""

    def __init__(self, feedback: Feedback) -> None:
        self.progress, self.cancelled = feedback.progress, feedback.cancelled


class Stage(ProgressOnly):
    """The caller's feedback during one step of a longer task: its progress, and its warnings if it ``warns``,
    carry the step's name (progress that of its ``place``); its notes are dropped as repetition."""

    def __init__(self, feedback: Feedback, name: str, *, place: str = "", warns: bool = True) -> None:
        super().__init__(feedback)
        self.feedback, self.name, self.place, self.warns = feedback, name, place or name, warns
        self.progress = self._progress

    def _progress(self, done: float, total: float, what: str) -> None:
        self.feedback.progress(done, total, f"{self.place}: {what}")

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        if self.warns:
            self.feedback.warn(f"{self.name}: {message}", code, **numbers)


class Hearing:
    """The feedback that a tool gets: passes everything on, and keeps what is said about the result, each once."""

    def __init__(self, feedback: Feedback) -> None:
        self.feedback = feedback
        self.progress, self.cancelled = feedback.progress, feedback.cancelled
        self.messages: list[Message] = []

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        if self._is_new(message, code, numbers, NOTE):
            self.feedback.note(message, code, **numbers)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        if self._is_new(message, code, numbers, WARNING):
            self.feedback.warn(message, code, **numbers)

    def _is_new(self, text: str, code: str, numbers: Mapping[str, Any], level: str) -> bool:
        if not code:
            return True
        said = Message(code, with_final_places(text), {name: _plain(value) for name, value in numbers.items()}, level)
        if said in self.messages:
            return False
        self.messages.append(said)
        return True


def _plain(value: Any) -> float | None:
    """A number of numpy as Python's own; None if it is none, or not finite."""
    number = value.item() if hasattr(value, "item") else value
    return number if isinstance(number, int | float) and math.isfinite(number) else None
