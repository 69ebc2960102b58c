"""Each tool as a function, and what it leaves as a class, made from the tools' declarations on first use.

``functions_page`` renders them; editors and type checkers read the same text in ``functions.pyi``.
"""

from __future__ import annotations

from typing import Any

from deadwood_toolbox import calls, result, shelf

__all__ = list(shelf.PYTHON_NAMES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    tool = shelf.find(shelf.PYTHON_NAMES.get(name, ""))
    if tool is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from deadwood_toolbox.functions_page import source

    made = {**vars(calls), **vars(result), "__name__": __name__}
    flags = annotations.compiler_flag  # the types are names for readers: nothing is loaded for them
    exec(compile(source(tool), f"<deadwood-tool {tool.name}>", "exec", flags, dont_inherit=True), made)
    globals().update({each: made[each] for each in shelf.python_names(tool.name)})
    return globals()[name]
