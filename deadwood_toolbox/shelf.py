"""The tools, one honest import each; a tool that is not named here does not exist for the command line.

``deadwood-tool TOOL --help`` imports every tool's file, so such a file imports at its top only what starts quickly:
the standard library, numpy, shapely, and siblings that keep the same rule. The engine (numba), geopandas, pandas,
pyarrow, rasterio, pyogrio, pyproj and matplotlib are imported where they are used: inside the functions of
``layers.py``, and inside a tool's ``run``. A test imports this file and looks at what came with it.
"""

from __future__ import annotations

from deadwood_algorithms.tool import Tool

TOOLS: tuple[Tool, ...] = ()


def find(name: str) -> Tool | None:
    """The tool of that name, or None."""
    return next((tool for tool in TOOLS if tool.name == name), None)
