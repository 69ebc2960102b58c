"""Commands as they are typed: what is said last can be pasted as it stands."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from deadwood_algorithms.params.tool import Tool

NEVER = ("resume", "overwrite", "plan")  # of how a command is run, not of what it does


def command_line(name: str, values: Mapping[str, Any]) -> str:
    """The command of the tool ``name`` with these values by parameter; what is None or not switched on goes unsaid."""
    words = ["deadwood-tool", name]
    for parameter, value in values.items():
        if value is None or value is False or parameter in NEVER:
            continue
        flag = "--" + parameter.replace("_", "-")
        words += [flag] if value is True else [flag, _typed(value)]
    return " ".join(shlex.quote(each) for each in words)


def following(tool: Tool, ask: Any, **values: Any) -> str:
    """The command of ``tool`` with what ``ask``, of another tool, was given of the same, unless that is the default.

    ``values`` stand in place of what was given.
    """
    given = {}
    for each in tool.parameters():
        value = values[each.name] if each.name in values else getattr(ask, each.name, None)
        if each.name in values or (value != each.default and not each.is_output):
            given[each.name] = value
    return command_line(tool.name, given)


def _typed(value: Any) -> str:
    return ",".join(map(_typed, value)) if isinstance(value, (tuple, list)) else str(value)
