"""The record of what made a result: tool, version, engine and parameters, with paths that hold in any folder.

Standard library only.
"""

from __future__ import annotations

import os
import sys
from functools import cache
from importlib import util
from pathlib import Path
from typing import Any

from deadwood_algorithms.params.final_place import final_place, saved_place
from deadwood_algorithms.params.kinds import Parameter
from deadwood_algorithms.params.tool import VERSION, TakesPresets, Tool


def inputs_of(tool: Tool, ask: Any) -> dict[str, str]:
    """The paths of all inputs of a tool, by parameter; for a text that may be a path, if something exists there."""
    found = {}
    for each in tool.parameters():
        value = getattr(ask, each.name)
        if each.is_output or not is_path(each, value):
            continue
        if each.is_input or any(os.path.exists(part.strip()) for part in (str(value), *str(value).split(","))):
            found[each.name] = str(value)
    return found


def manifest(tool: Tool, ask: Any, **facts: Any) -> dict[str, Any]:
    """The record of a result: tool, version, engine, parameters; the file works as ``--config`` of the same tool.

    Paths are absolute, so it works from any folder. ``folder`` is the folder of the manifest, so that inputs are
    found again if everything is moved together.
    """
    values = {each.name: anywhere(each, getattr(ask, each.name)) for each in tool.parameters()}
    places = [values[each.name] for each in tool.parameters() if each.kind == "output_folder" and values[each.name]]
    where = {"folder": places[0]} if places else {}
    said = {"tool": tool.name, "version": VERSION, "engine": engine_digest(), **where}
    presets = [each.record for each in ask.taken_presets()] if isinstance(ask, TakesPresets) else []
    by_name = {"presets": presets} if presets else {}
    return {**said, "parameters": values, **by_name, **facts}


@cache
def engine_digest() -> str:
    """Digest of the engine's sources and its compiler: two runs with the same one are identical, bit for bit.

    The same digest names the engine's cache of kernels; it is computed by the engine's own file, without importing its
    compiler, once per process: later edits have no effect on the process.
    """
    if loaded := sys.modules.get("deadwood_engine.digest"):
        return loaded.engine_digest()
    found = util.find_spec("deadwood_engine")
    assert found is not None
    assert found.origin is not None
    alone = util.spec_from_file_location("deadwood_engine_digest", Path(found.origin).with_name("digest.py"))
    assert alone is not None
    assert alone.loader is not None
    module = util.module_from_spec(alone)
    alone.loader.exec_module(module)
    return module.engine_digest()


def is_path(parameter: Parameter, value: Any) -> bool:
    """Whether a value names a file or folder of this machine: not a number, not a network address."""
    if not isinstance(value, str | Path) or not (parameter.is_input or parameter.is_output or parameter.path_like):
        return False
    if parameter.kind == "number_or_layer":
        try:
            float(str(value))
        except ValueError:
            pass
        else:
            return False
    return "://" not in str(value) and value != parameter.default


def anywhere(parameter: Parameter, value: Any) -> Any:
    """A value that has the same meaning in any folder: paths become absolute, everything else is unchanged."""
    if not is_path(parameter, value):
        return str(value) if isinstance(value, Path) else value
    if saved := saved_place(value):
        return saved
    if parameter.path_like and not os.path.exists(value):
        parts = str(value).split(",")
        return ",".join(final_place(part.strip()) if os.path.exists(part.strip()) else part for part in parts)
    file, bar, layer = str(value).partition("|")
    return final_place(file) + bar + layer


def moved_paths(named: str, now: Path, then: str | None) -> list[Path]:
    """Where a path that a manifest names may lie, if the manifest is no longer in its original folder.

    Parameters
    ----------
    now, then
        The manifest's folder, and the one that it names; manifests of version 0.1.0 name none, and their relative
        paths were usually relative to the parent of the run's folder.
    """
    if not os.path.isabs(named):
        return [now.parent / named]
    try:
        moved = [Path(os.path.normpath(now / os.path.relpath(named, then)))] if then else []
    except ValueError:  # another drive
        return []
    return [each for each in moved if each.name == Path(named).name]
