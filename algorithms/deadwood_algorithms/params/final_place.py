"""Where a result will stand in the end: it is made beside that place, and its record names only the place.

Standard library only.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType

# (where something is being made, where it will stand): manifests contain the second
_moving: ContextVar[tuple[tuple[str, str], ...]] = ContextVar("_moving", default=())
# an input as it was named -> where it is saved with the result: manifests name it there
_saved: ContextVar[Mapping[str, str]] = ContextVar("_saved", default=MappingProxyType({}))


@contextmanager
def moving_to(made_in: str | Path, final: str | Path) -> Iterator[None]:
    """In this context, manifests name files in the folder ``made_in`` by their final place."""
    token = _moving.set(((os.path.abspath(made_in), os.path.abspath(final)), *_moving.get()))
    try:
        yield
    finally:
        _moving.reset(token)


@contextmanager
def saved_at(places: Mapping[str, str]) -> Iterator[None]:
    """In this context, manifests name these inputs where they are saved."""
    token = _saved.set({**_saved.get(), **places})
    try:
        yield
    finally:
        _saved.reset(token)


def saved_place(named: object) -> str | None:
    """Where an input is saved with the result that is being made, with its layer; None if it is not."""
    return _saved.get().get(str(named))


def final_place(path: str | Path) -> str:
    """The absolute path that a file or folder will have in the end."""
    named = os.path.abspath(path)
    for made_in, final in _moving.get():
        if named == made_in or named.startswith(made_in + os.sep):
            named = final + named[len(made_in) :]
    return named


def with_final_places(text: str) -> str:
    """A text in which the files of a result that is being made are named by their final place."""
    for made_in, final in _moving.get():
        text = text.replace(made_in + os.sep, final + os.sep)
    return text
