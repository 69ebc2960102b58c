"""The usage of a tool and the table of its options, rendered from its declaration."""

from __future__ import annotations

from collections.abc import Iterator

from deadwood_algorithms.params.tool import Parameter, Tool
from deadwood_toolbox import parameters


def usage(tool: Tool) -> str:
    """The shortest command line: the required flags."""
    required = (p for p in tool.parameters() if p.default is None and not p.optional)
    return " ".join(["deadwood-tool", tool.name, *(parameters.help_line(p)[0] for p in required)])


def rows(declared: list[Parameter]) -> Iterator[str]:
    """The table of some parameters, line by line."""
    yield "| flag | meaning | unit | range | default |"
    yield "|---|---|---|---|---|"
    for p in declared:
        meaning = p.label + (f" ({' or '.join(p.geometry)})" if p.geometry else "")
        meaning += f". {p.help}" if p.help else ""
        scope = ", ".join(p.choices) or parameters.bounds(p)
        yield "| " + " | ".join(map(cell, (f"`{p.flag}`", meaning, p.unit, scope, _default(p)))) + " |"


def _default(parameter: Parameter) -> str:
    if parameter.is_switch:
        return "off"
    if parameter.default is None:
        return "" if parameter.optional else "**required**"
    return parameters.default_text(parameter)


def cell(text: str) -> str:
    """A text as a cell of a Markdown table."""
    return text.replace("|", "\\|").replace("\n", " ")
