"""Commands as they are typed, so that the last printed line can be pasted unchanged."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Mapping
from typing import Any

from deadwood_algorithms.params.tool import Tool

PLAIN = re.compile(r"[\w.:/\\+=-]+")  # a word that no shell of Windows changes
NEVER = ("resume", "restart", "overwrite", "plan")  # about how a command is run, not about what it does


def command_line(name: str, values: Mapping[str, Any]) -> str:
    """The command of the tool ``name`` with these values by parameter; those that are None or not switched on are
    omitted.
    """
    words = ["deadwood-tool", name]
    for parameter, value in values.items():
        if value is None or value is False or parameter in NEVER:
            continue
        flag = "--" + parameter.rstrip("_").replace("_", "-")
        words += [flag] if value is True else [flag, _typed(value)]
    return " ".join(map(quoted, words))


def quoted(word: object, *, windows: bool = os.name == "nt") -> str:
    """A word of a command as it is typed: on Windows in double quotes, which cmd and PowerShell both know."""
    text = str(word)
    if not windows:
        return shlex.quote(text)
    if PLAIN.fullmatch(text):
        return text
    inside = re.sub(r'(\\*)"', r'\1\1\\"', text)  # backslashes count double before a quote, by the rules of Windows
    return '"' + re.sub(r"(\\+)$", r"\1\1", inside) + '"'


def following(tool: Tool, ask: Any, **values: Any) -> str:
    """The command of ``tool`` with the values of ``ask``, of another tool, for the parameters of both, except defaults.

    ``values`` replace those that were given.
    """
    given = {}
    for each in tool.parameters():
        value = values[each.name] if each.name in values else getattr(ask, each.name, None)
        if each.name in values or (value != each.default and not each.is_output):
            given[each.name] = value
    return command_line(tool.name, given)


def _typed(value: Any) -> str:
    return ",".join(map(_typed, value)) if isinstance(value, (tuple, list)) else str(value)
