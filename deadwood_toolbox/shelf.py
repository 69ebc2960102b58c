"""The tools by name; a tool that is not named here does not exist for the command line.

``deadwood-tool TOOL --help`` imports only that tool's file, and ``deadwood-tool --help`` none: it reads their last
lines (``declared``). Such a file imports at its top only what starts quickly: the standard library, numpy, shapely, and
sibling modules that follow the same rule.
The engine (numba), geopandas, pandas, pyarrow, rasterio, pyogrio, pyproj and matplotlib are imported where they are
used: inside functions, such as a tool's ``run``. A test imports this file with all its tools and checks what else was
imported.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from deadwood_algorithms.params.tool import Tool

# In the order of the work; make-log is TOOL of deadwood_algorithms/tools/make_log.py, and so on.
NAMES = (
    "inspect",
    "assess-mobilisation",
    "sample-releases",
    "import-trees",
    "find-trees",
    "generate-forest",
    "windthrow",
    "add-structures",
    "make-log",
    "slide-logs",
    "run-sites",
    "count-hits",
    "reach-lines",
    "design-values",
    "value-trees",
    "break-trees",
    "site-barriers",
    "map-intensity",
    "map-origins",
    "age",
    "decide",
    "lateral-spread",
    "fit-flight",
    "compare-scenarios",
    "calibrate-friction",
    "compare-fidelity",
    "vary",
    "explore",
    "make-report",
    "view",
    "check",
    "reproduce-paper",
    "warm-up",
    "demo",
)
OLD_NAMES = ("list-presets",)  # still work in this version, but are not shown: use list --presets
TOOLS: tuple[Tool, ...]


def find(name: str) -> Tool | None:
    """The tool of that name, or None; no other tool is imported."""
    return import_module(_module(name)).TOOL if name in (*NAMES, *OLD_NAMES) else None


def python_names(tool: str) -> tuple[str, str]:
    """The function of a tool, and the class of its result: slide-logs is slide_logs, and leaves a SlideLogsResult."""
    return tool.replace("-", "_"), "".join(map(str.capitalize, tool.split("-"))) + "Result"


PYTHON_NAMES = {each: name for name in NAMES for each in python_names(name)}  # of functions and classes: their tools


@dataclass(frozen=True)
class Declared:
    """The entry of a tool in the list of tools."""

    name: str
    group: str
    summary: str


def declared() -> tuple[Declared, ...]:
    """All tools, from the last lines of their files, which are parsed and not imported: numpy alone takes 0.2 s."""
    return tuple(_declared(name) for name in NAMES)


def _declared(name: str) -> Declared:
    found = find_spec(_module(name))
    origin = found.origin if found else None
    if origin is None:
        raise ModuleNotFoundError(_module(name))
    source = Path(origin).read_text(encoding="utf-8")
    call: Any = ast.parse(source[source.rindex("\nTOOL = ") + len("\nTOOL = ") :], mode="eval").body
    return Declared(*(ast.literal_eval(word) for word in call.args[:3]))


def _module(name: str) -> str:
    return f"deadwood_algorithms.tools.{name.replace('-', '_')}"


def __getattr__(name: str) -> Any:
    if name != "TOOLS":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = tuple(tool for each in NAMES if (tool := find(each)) is not None)
    globals()[name] = found
    return found
