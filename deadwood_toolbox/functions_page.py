"""The tools as Python functions and their results as classes: the source text, rendered from the declarations.

``functions`` runs it when a function is first used. Editors and type checkers, which run nothing, read it in
``functions.pyi``: signatures, types, defaults and docstrings. Installing the package writes that file, an
editable install of a checkout too, and so does ``python -m deadwood_toolbox.functions_page``.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from deadwood_algorithms.params.tool import Parameter, Tool
from deadwood_algorithms.schemas.words import JsonFile, Layer, Output, RasterFile, TableFile
from deadwood_algorithms.schemas.written import WRITTEN, has_place
from deadwood_toolbox import parameters
from deadwood_toolbox.shelf import python_names

PLACE = Path(__file__).with_name("functions.pyi")
LINE, WIDTH = 120, 112  # line lengths of the code, and of the text in it
OUTPUT, OPTIONAL_OUTPUT = "str | os.PathLike[str] | None", "str | os.PathLike[str] | bool | None"
HEAD = """\
import os
from typing import Literal

from deadwood_algorithms.params.tool import Feedback
from deadwood_toolbox.calls import (
    LayerInput,
    NumbersInput,
    PathInput,
    PathsInput,
    RasterInput,
    TableInput,
    TerrainInput,
    call,
)
from deadwood_toolbox.result import LayerPart, RasterPart, Result, Run, TablePart
"""
TYPES = {
    "raster": "RasterInput",
    "vector": "LayerInput",
    "table": "TableInput",
    "folder": "PathInput",
    "file": "PathInput",
    "number_or_layer": "float | RasterInput | LayerInput",
    "number": "float",
    "integer": "int",
    "numbers": "NumbersInput",
    "flag": "bool",
    "text": "str | list[str]",
    "folders": "str | list[str]",
    "results": "str | list[str]",
    "field": "str",
    "crs": "str | int",
}
OF_PATHS = {"raster": "TerrainInput"}  # types of parameters that take several paths; PathsInput for other kinds
OF_EVERY_TOOL = (
    ("progress", "bool", "Show on standard error what is done, and what the tool notes and warns of."),
    ("feedback", "Feedback, optional", "An object of your own that hears all that; see docs/python.md."),
)


def stub() -> str:
    """The content of ``functions.pyi``."""
    from deadwood_toolbox.shelf import PYTHON_NAMES, TOOLS

    listed = f"__all__ = {sorted(PYTHON_NAMES)}\n"
    return "\n".join([HEAD, listed, *map(source, TOOLS)])


def source(tool: Tool) -> str:
    """The class of a tool's result and its function."""
    return f"{_class(tool)}\n\n{_function(tool)}"


def _class(tool: Tool) -> str:
    """The result of one tool: an attribute for every layer, raster and table whose place is fixed."""
    base = "Run" if tool.name == "slide-logs" else "Result"
    parts, summary = {}, ""
    for each in WRITTEN:
        if each.tool != tool.name or not has_place(each):
            continue
        if isinstance(each.what, JsonFile):
            summary = summary or each.place
        elif (found := _part(each)) is not None:
            name, part = found
            if name in parts:  # a layer of this name in another file
                name = each.place.partition(".")[0]
            parts[name] = part
    lines = [f"class {_names(tool)[1]}({base}):", f'    """What `{_names(tool)[0]}` leaves."""', ""]
    if summary:
        lines += [f'    summary_file = "{summary}"', ""]
    for name, (value, meaning) in parts.items():
        lines += [f"    {name} = {value}", *_wrapped(f'"""{meaning}"""', "    ", "    ")]
    return "\n".join(lines).rstrip() + "\n"


def _names(tool: Tool) -> tuple[str, str]:
    return python_names(tool.name)


def _part(output: Output) -> tuple[str, tuple[str, str]] | None:
    file, _, layer = output.place.partition("|layername=")
    what = output.what
    if isinstance(what, Layer) and layer:
        return layer, (f'LayerPart("{file}", "{layer}")', what.meaning)
    if isinstance(what, RasterFile):
        return what.name, (f'RasterPart("{file}")', what.meaning)
    if isinstance(what, TableFile) or (isinstance(what, Layer) and file.endswith(".parquet")):
        return what.name.removesuffix(".csv"), (f'TablePart("{file}")', what.meaning)
    return None


def _function(tool: Tool) -> str:
    declared = list(tool.parameters())
    first = [each for each in declared if each.positional]
    rest = [each for each in declared if not each.positional]
    lines = [f"def {_names(tool)[0]}("]
    lines += [f"    {_argument(each)}," for each in first]
    lines += ["    *,", *(f"    {_argument(each)}," for each in rest)]
    lines += ["    progress: bool = False,", "    feedback: Feedback | None = None,"]
    lines += [f") -> {_names(tool)[1]}:", *_docstring(tool, [*first, *rest])]
    lines += [f'    return call("{tool.name}", {_names(tool)[1]}, locals())']
    return "\n".join(lines) + "\n"


def _argument(parameter: Parameter) -> str:
    if parameter.is_output:
        return f"{parameter.name}: {OUTPUT if parameter.name == 'output' else OPTIONAL_OUTPUT} = None"
    may_be_none = parameter.default is None and parameter.optional
    default = f" = {_literal(parameter.default)}" if may_be_none or parameter.default is not None else ""
    if parameter.choices:
        words = [_literal(each) for each in parameter.choices] + ["None"] * may_be_none
        whole = f"{parameter.name}: Literal[{', '.join(words)}]{default}"
        if len(whole) + 5 <= LINE:
            return whole
        listed = "".join(f"        {each},\n" for each in words)
        return f"{parameter.name}: Literal[\n{listed}    ]{default}"
    annotation = TYPES[parameter.kind]
    if parameter.path_like:
        annotation = OF_PATHS.get(parameter.kind, "PathsInput")
    return f"{parameter.name}: {annotation}{' | None' if may_be_none else ''}{default}"


def _literal(value: object) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(value)


def _docstring(tool: Tool, declared: Sequence[Parameter]) -> Iterator[str]:
    """numpydoc: the tool's description without its command lines, and each parameter."""
    first, *rest = _description(tool.description).split("\n\n")
    yield from _wrapped('"""' + _in_python(tool, first), "    ", "    ")
    for part in rest:
        yield ""
        for item in re.split(r"\n(?=- )", part):
            yield from _wrapped(_in_python(tool, item), "    ", "      " if item.startswith("- ") else "    ")
    yield ""
    yield "    Parameters"
    yield "    ----------"
    for each in declared:
        yield from (_in_python(tool, line) for line in _entry(each))
    for name, kind, meaning in OF_EVERY_TOOL:
        yield f"    {name} : {kind}"
        yield f"        {meaning}"
    yield '    """'


def _description(text: str) -> str:
    """The description without the indented examples, which are for the command line."""
    kept = [part for part in text.split("\n\n") if not part.lstrip("\n").startswith("    ")]
    return "\n\n".join(kept)


def _in_python(tool: Tool, text: str) -> str:
    """Replace the flags of the tool by the names of its parameters in Python."""
    names = {each.flag: each.name for each in tool.parameters()}
    return re.sub(
        r"`+deadwood-tool[^`]*`+|--[a-z][a-z0-9-]*[a-z0-9]", lambda found: names.get(found[0], found[0]), text
    )


def _entry(parameter: Parameter) -> Iterator[str]:
    facts = parameters.facts(parameter)
    if parameter.is_output:
        facts = "output, optional"
    elif parameter.choices:
        shown = f"one of {', '.join(parameter.choices)}"
        facts = f"{shown}, {facts}" if facts else shown
    elif not facts:
        facts = "optional"
    yield from _wrapped(f"{parameter.name} : {facts}", "    ", "      ")
    meaning = parameter.label.rstrip(".") + "."
    if parameter.is_output and parameter.name == "output":
        meaning += " Without it, in a temporary folder that lasts as long as the result."
    elif parameter.is_output:
        meaning += " True: beside the main output."
    yield from _wrapped(f"{meaning} {parameter.help}".strip(), "        ", "        ")


def _wrapped(text: str, first: str, rest: str) -> list[str]:
    text = text.replace("\\", "\\\\")
    return textwrap.wrap(
        text, WIDTH, initial_indent=first, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False
    )


def write() -> None:
    """Write ``functions.pyi`` beside this file."""
    PLACE.write_text(stub(), encoding="utf-8")


if __name__ == "__main__":
    write()
