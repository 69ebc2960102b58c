"""The catalogue of the tools, ``algorithms/README.md``, written from their declarations.

``python -m deadwood_toolbox.catalogue`` in a checkout writes it, ``docs/layers.md``, and the Python functions
(``functions.py``); a test fails when one is stale.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from deadwood_algorithms.params.tool import Parameter, Tool
from deadwood_toolbox import functions_page, layers_page, parameters

PLACE = Path(__file__).parents[1] / "algorithms" / "README.md"
HEAD = """\
# The tools

One file per tool: `deadwood_algorithms/tools/<name>.py` declares its parameters once, and the command line, this page,
the checks and `deadwood-tool describe TOOL --json` are rendered from that. Every tool also takes `--config FILE`,
`--progress`, `--quiet` and `--verbose`. Layers and their columns: [docs/layers.md](../docs/layers.md).

*Written by `python -m deadwood_toolbox.catalogue`; edit the declarations, not this page.*
"""


def page(tools: Sequence[Tool]) -> str:
    """The whole page, Markdown."""
    lines = [f"| [`{tool.name}`](#{tool.name}) | {tool.group} | {cell(tool.summary)} |" for tool in tools]
    overview = "\n".join(["| tool | group | does |", "|---|---|---|", *lines])
    return "\n\n".join([HEAD.rstrip(), overview, *(_chapter(tool) for tool in tools)]) + "\n"


def _chapter(tool: Tool) -> str:
    table = "\n".join(rows(list(tool.parameters())))
    return f"## {tool.name}\n\n{tool.description}\n\n`{usage(tool)}`\n\n{table}"


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


def main() -> None:
    from deadwood_toolbox.shelf import TOOLS

    made = (
        (PLACE, page(TOOLS)),
        (layers_page.PLACE, layers_page.page()),
        (functions_page.PLACE, functions_page.source(TOOLS)),
    )
    for place, text in made:
        place.write_text(text, encoding="utf-8")
        print(f"wrote {place}")


if __name__ == "__main__":
    main()
