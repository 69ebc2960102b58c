"""Pages that are made from the declarations: a page for each tool and each layer, the glossary, the events."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import deadwood_toolbox
from deadwood_algorithms.params.events import EVENTS, range_words
from deadwood_algorithms.params.tool import Tool
from deadwood_algorithms.schemas.brought import BROUGHT
from deadwood_algorithms.schemas.written import WRITTEN
from deadwood_toolbox import parameters
from deadwood_toolbox.plugin_zip import TOOL as QGIS_PLUGIN
from deadwood_toolbox.shelf import TOOLS

from . import layers, options

GLOSSARY = Path(__file__).with_name("glossary.csv")
LANGUAGES = {"de": "German", "fr": "French", "it": "Italian"}
CODE = re.compile(r"(^ {4}.*$|``[^`]+``|`[^`]+`)", re.MULTILINE)
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*\b(?: (?:auto\b|\d[\w.]*\w|\d\b))?")  # with a value if it is a word
# Files that descriptions name by their place in the repository.
LINKS = {
    "engine/README.md": "[the physics](../../explanation/physics.md)",
    "docs/indices.md": "[the indices](../../explanation/indices.md)",
}


def pages() -> dict[str, str]:
    """The generated pages: text by place on the site."""
    made = {"reference/tools/index.md": _tools_index(), "reference/layers/index.md": _layers_index()}
    made |= {f"reference/tools/{tool.name}.md": _tool(tool) for tool in (*TOOLS, QGIS_PLUGIN)}
    made |= {f"reference/layers/{slug(title)}.md": _layer(title, what) for title, what in _layers().items()}
    made["reference/glossary.md"] = _glossary()
    made["reference/events.md"] = _events()
    return made


def slug(title: str) -> str:
    """The name of a page: made like the anchor of a heading on GitHub, and not too long for a file's name."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")[:60].rstrip("-")


def terms() -> list[dict[str, str]]:
    """The rows of the glossary: term, de, fr, it, meaning."""
    with GLOSSARY.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _tools_index() -> str:
    groups = dict.fromkeys(tool.group for tool in TOOLS)
    parts = ["# Tools", "Every option of every tool, from the declarations that the command line and QGIS are made of."]
    for group in groups:
        rows = [f"| [{t.name}]({t.name}.md) | {options.cell(t.summary)} |" for t in TOOLS if t.group == group]
        parts.append("\n".join([f"## {group}", "", "| tool | purpose |", "|---|---|", *rows]))
    more = f"[{QGIS_PLUGIN.name}]({QGIS_PLUGIN.name}.md) packs the plugin for QGIS."
    return "\n\n".join([*parts, more, toctree([*(tool.name for tool in TOOLS), QGIS_PLUGIN.name])]) + "\n"


def _tool(tool: Tool) -> str:
    parts = [f"# {tool.name}", f"*{tool.summary}.*" if tool.summary else "", marked(tool.description)]
    parts += ["## Usage", f"```sh\n{options.usage(tool)}\n```"]
    for section, declared in parameters.by_section(tool).items():
        parts += [f"## {section}", marked("\n".join(options.rows(declared)))]
    parts += [_common()]
    written = [each for each in WRITTEN if each.tool == tool.name]
    if written:
        rows = [f"| `{each.place}` | {_linked(each.what)} |".replace("|layername", "\\|layername") for each in written]
        rows = [marked(row) for row in rows]
        parts += ["## Files written", "\n".join(["| file | content |", "|---|---|", *rows])]
    parts += _elsewhere(tool)
    return "\n\n".join(part for part in parts if part) + "\n"


def marked(text: str) -> str:
    """A text of the command line with options as code and pages as links, except where it is code already."""
    parts = CODE.split(text)  # every second one is code
    for k in range(0, len(parts), 2):
        parts[k] = FLAG.sub(r"`\g<0>`", parts[k])
        for name, link in LINKS.items():
            parts[k] = parts[k].replace(name, link)
    return "".join(parts)


def _elsewhere(tool: Tool) -> list[str]:
    """How to call the tool from QGIS and from Python."""
    function = tool.name.replace("-", "_")
    ways = [f"QGIS: `{tool.qgis_id}` in the Processing toolbox."] if tool.qgis_id else []
    if hasattr(deadwood_toolbox, function):
        ways.append(f"[Python](../python.md): `deadwood_toolbox.{function}(...)`, with the options as keywords.")
    return ["## In QGIS and Python", " ".join(ways)] if ways else []


def _common() -> str:
    return (
        "Every tool also takes `--config FILE` (options from a JSON file or a manifest), `--progress`, `--quiet` and "
        "`--verbose`."
    )


def _linked(what: Any) -> str:
    title = layers.title_of(what)
    return f"[{title}](../layers/{slug(title)}.md): {what.meaning}" if title in _layers() else what.meaning


def _layers() -> dict[str, Any]:
    """Everything with its own page, by title: all that has columns, bands or keys."""
    every = [*BROUGHT, *dict.fromkeys(each.what for each in WRITTEN if each.what not in BROUGHT)]
    return {layers.title_of(each): each for each in every if layers.section(each).count("\n|") > 1}


def _layers_index() -> str:
    found = _layers()
    brought = [title for title, what in found.items() if what in BROUGHT]
    parts = [
        "# Layers, rasters and tables",
        layers.INTRODUCTION,
        "## Input layers",
        _list(brought, found),
        "## Results",
        _list([title for title in found if title not in brought], found),
        toctree([slug(title) for title in found]),
    ]
    return "\n\n".join(parts) + "\n"


def _list(titles: Iterable[str], found: dict[str, Any]) -> str:
    rows = [f"| [{title}]({slug(title)}.md) | {options.cell(found[title].meaning)} |" for title in titles]
    return "\n".join(["| name | content |", "|---|---|", *rows])


def _layer(title: str, what: Any) -> str:
    text = layers.section(what).replace("### ", "# ", 1)
    writers = [each for each in WRITTEN if each.what is what]
    if writers:
        rows = [f"- [{each.tool}](../tools/{each.tool}.md): `{each.place}`" for each in writers]
        text += "\n\n## Written by\n\n" + "\n".join(rows)
    readers = [tool for tool in TOOLS if what in BROUGHT and what.name in {p.name for p in tool.parameters()}]
    if readers:
        text += "\n\n## Read by\n\n" + ", ".join(f"[{tool.name}](../tools/{tool.name}.md)" for tool in readers)
    return text + "\n"


EVENTS_INTRODUCTION = """# Slides of trunks that were reported

Trunks that slid and reached something, from the press; the same as `deadwood-tool list --events` and `dw.events()`.

**What they show**: how far trunks go on snow, ice, frost and steep ground, what they pass, and what holds them. A
model that cannot reach as far, or stops at such a fence, is wrong there. **What they do not show**: how often. Nobody
reports a trunk that stays where it is, nine of the ten were set in motion by forest work, and none has a terrain model,
a friction or a position with it. Where reports differ, ranges are given."""


def _events() -> str:
    head = ("place", "date", "log", "length [m]", "ground", "went [m]", "cause", "outcome", "source", "uncertain")
    rows = (
        (
            f"{each.place} ({each.country})",
            each.date,
            each.log,
            range_words(each.length_m),
            each.ground,
            range_words(each.travel_m),
            each.cause,
            each.outcome,
            each.source,
            each.uncertain,
        )
        for each in EVENTS
    )
    return f"{EVENTS_INTRODUCTION}\n\n{layers.table(head, rows)}\n"


def _glossary() -> str:
    return "\n".join(["# Glossary", "", *_glossary_lines()]) + "\n"


def _glossary_lines() -> Iterator[str]:
    yield "One word for each thing, in the tools, the files and these pages, with the usual term in German, French and"
    yield "Italian."
    yield ""
    yield ":::{glossary}"
    for row in sorted(terms(), key=lambda row: row["term"].casefold()):
        yield row["term"]
        yield f"  {row['meaning']}"
        yield ""
        yield "  " + "; ".join(f"{name}: *{row[code]}*" for code, name in LANGUAGES.items())
        yield ""
    yield ":::"


def toctree(names: Iterable[str]) -> str:
    """The hidden menu of a page, whose text replaces it."""
    return "\n".join(["```{toctree}", ":hidden:", ":maxdepth: 1", "", *names, "```"])
