"""A doubt: what others' data themselves say against their use, with a code and numbers; and the checks that find it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.params.messages import Feedback
from deadwood_algorithms.params.messages import Message as Doubt

__all__ = ["Check", "Doubt", "say", "say_all"]


@dataclass(frozen=True)
class Check:
    """One check of a role: what it doubts, and the function that finds it in what was read."""

    code: str
    doubts: str  # what is doubted, as a table of the checks says it
    find: Callable[..., Doubt | None]


def say(doubt: Doubt | None, where: str, feedback: Feedback) -> None:
    """Warn of a doubt about a file, if there is one; its text begins after the file's name."""
    if doubt is not None:
        feedback.warn(f"{where}: {doubt.text}", code=doubt.code, **doubt.numbers)


def say_all(checks: Iterable[Check], seen: Any, where: str, feedback: Feedback) -> None:
    """Warn of every doubt that the checks find in what was read."""
    for check in checks:
        say(check.find(seen), where, feedback)
