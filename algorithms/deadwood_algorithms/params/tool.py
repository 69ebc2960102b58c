"""The vocabulary in which a tool declares itself: parameters, outcome, feedback, and the user's errors.

A tool's declaration is a frozen dataclass ``Ask`` whose fields are made by the functions below, one line per parameter.
Nothing about a parameter is written anywhere else: the command line, ``describe --json``, the catalogue, the QGIS
dialogs and the checks for Python callers are all rendered from it. `kinds` defines the kinds of parameters.
Standard library only.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Protocol, TypeVar

from deadwood_algorithms.params.kinds import KINDS, Parameter, UserError, check_value
from deadwood_algorithms.params.renamed import old_names_of, with_new_names

__all__ = ["Cancelled", "Feedback", "Outcome", "Parameter", "Tool", "UserError", "check_value"]
VERSION = "0.3.0"  # the one place: pyproject.toml, the QGIS plugin and every manifest take it from here

REQUIRED: Any = object()
Record = TypeVar("Record")  # a small dataclass of parameters


class Cancelled(Exception):
    """The user interrupted the tool; no output has its final name (exit 130)."""


class Feedback(Protocol):
    """The messages of a tool while it works; the caller decides where they go."""

    def progress(self, done: float, total: float, what: str) -> None: ...

    def note(self, message: str) -> None: ...

    def warn(self, message: str) -> None: ...

    def cancelled(self) -> bool: ...


class Quiet:
    """A feedback without output: the default for Python callers."""

    def progress(self, done: float, total: float, what: str) -> None:
        pass

    def note(self, message: str) -> None:
        pass

    def warn(self, message: str) -> None:
        pass

    def cancelled(self) -> bool:
        return False


class ProgressOnly(Quiet):
    """A feedback that passes on progress only, when the notes are already known or not needed."""

    def __init__(self, feedback: Feedback) -> None:
        self.progress, self.cancelled = feedback.progress, feedback.cancelled


class Stage(ProgressOnly):
    """The caller's feedback during one step of a longer task: its progress, and its warnings if it ``warns``,
    carry the step's name (progress that of its ``place``); its notes are dropped as repetition."""

    def __init__(self, feedback: Feedback, name: str, *, place: str = "", warns: bool = True) -> None:
        super().__init__(feedback)
        self.feedback, self.name, self.place, self.warns = feedback, name, place or name, warns
        self.progress = self._progress

    def _progress(self, done: float, total: float, what: str) -> None:
        self.feedback.progress(done, total, f"{self.place}: {what}")

    def warn(self, message: str) -> None:
        if self.warns:
            self.feedback.warn(f"{self.name}: {message}")


def ask(kind: str, label: str, *, default: Any = REQUIRED, **facts: Any) -> Any:
    """One parameter of a tool, of a kind of `KINDS`; a default of None makes it optional, none makes it required."""
    if kind not in KINDS:
        raise ValueError(f"{label}: no kind of parameter is called '{kind}'; known are {', '.join(KINDS)}")
    optional = default is None or bool(facts.pop("optional", False))
    shown = None if default is REQUIRED else default
    parameter = Parameter(kind=kind, label=label, optional=optional, default=shown, **facts)
    metadata = {"parameter": parameter}
    if default is REQUIRED:
        return field(metadata=metadata)
    return field(default=default, metadata=metadata)


def raster(label: str, **facts: Any) -> Any:
    """Path of a raster file."""
    return ask("raster", label, **facts)


def terrain(label: str, **facts: Any) -> Any:
    """Path of a terrain model: a raster file, a folder of tiles, or tiles separated by commas."""
    help_text = "A raster, a folder of tiles, or tiles separated by commas."
    return ask("raster", label, path_like=True, help=" ".join([facts.pop("help", ""), help_text]).strip(), **facts)


def vector(label: str, *geometry: str, **facts: Any) -> Any:
    """Path of a vector layer, ``file.gpkg|layername=trees`` names one of several; geometry: point, line, polygon."""
    return ask("vector", label, geometry=geometry, **facts)


def table(label: str, **facts: Any) -> Any:
    """Path of a table or vector layer (CSV, text, GeoPackage, shapefile)."""
    return ask("table", label, **facts)


def number(label: str, **facts: Any) -> Any:
    return ask("number", label, **facts)


def numbers(label: str, *default: float, **facts: Any) -> Any:
    """Several numbers, as a tuple; on the command line separated by commas, or from:to:step."""
    return ask("numbers", label, default=default, **facts)


def class_bounds(label: str, *default: float, **facts: Any) -> Any:
    """Bounds of classes: ascending, above 0, at most eight."""
    return numbers(label, *default, minimum=0.0, exclusive=True, ascending=True, most_count=8, **facts)


def integer(label: str, **facts: Any) -> Any:
    return ask("integer", label, **facts)


def number_or_layer(label: str, **facts: Any) -> Any:
    """A number, or the path of a raster or polygon layer that holds it (given as text)."""
    return ask("number_or_layer", label, **facts)


def choice(label: str, *choices: str, **facts: Any) -> Any:
    return ask("choice", label, choices=choices, **facts)


def flag(label: str, **facts: Any) -> Any:
    return ask("flag", label, default=False, **facts)


def text(label: str, **facts: Any) -> Any:
    return ask("text", label, **facts)


def folders(label: str, **facts: Any) -> Any:
    """Folders of runs, as one text separated by commas."""
    return ask("folders", label, path_like=True, **facts)


def results(label: str, **facts: Any) -> Any:
    """Folders and layers of results, as one text separated by commas."""
    return ask("results", label, path_like=True, **facts)


def field_of(parent: str, label: str, **facts: Any) -> Any:
    """The name of a field of the layer that the parameter ``parent`` takes."""
    return ask("field", label, parent=parent, **facts)


def folder(label: str, **facts: Any) -> Any:
    """Path of an existing folder that is read (a run)."""
    return ask("folder", label, **facts)


def file(label: str, **facts: Any) -> Any:
    return ask("file", label, **facts)


def output_raster(label: str, **facts: Any) -> Any:
    return ask("output_raster", label, **facts)


def output_vector(label: str, **facts: Any) -> Any:
    return ask("output_vector", label, **facts)


def output_table(label: str, **facts: Any) -> Any:
    return ask("output_table", label, **facts)


def output_folder(label: str, **facts: Any) -> Any:
    return ask("output_folder", label, **facts)


def output_file(label: str, **facts: Any) -> Any:
    return ask("output_file", label, **facts)


def overwrite() -> Any:
    return flag("Replace an output that exists")


def crs() -> Any:
    return ask(
        "crs",
        "CRS of inputs without one",
        default=None,
        advanced=True,
        help="An authority code such as EPSG:2056, for a DEM or layer whose file holds no CRS; local: metres on "
        "a local grid.",
    )


def other_lines(help: str = "Without it, the lines of the run.") -> Any:
    """Lines that replace those of the run that a tool reads."""
    label = "Roads, railways, houses in place of those of the run"
    return vector(label, "line", "polygon", default=None, help=help)


def baseline() -> Any:
    """The run with which the other runs are compared."""
    return text(
        "Name of the run that the others are compared with",
        default=None,
        help="Default: the run with the fewest obstacles (trees, barriers, lying logs, boulders); if several have, "
        "the first of them.",
    )


def min_runout(
    label: str = "Minimum run-out of deposits that count for the spread", help: str = "Default: one log length."
) -> Any:
    return number(label, unit="m", default=None, minimum=0.0, help=help)


def seed() -> Any:
    return integer("Seed of the random draws", default=0, minimum=0, maximum=2**63 - 1)


def scheduler() -> Any:
    return text(
        "Where to slide: local, or the address of a Dask scheduler",
        default=None,
        advanced=True,
        help="local starts processes on this machine, tcp://HOST:PORT names a running scheduler, whose workers then "
        "slide the logs; the results are identical, byte for byte. Default: threads of this process.",
    )


def workers() -> Any:
    return integer(
        "Workers started (local) or waited for, with a scheduler",
        default=None,
        minimum=1,
        advanced=True,
        help="Default: one for each core (local), or one.",
    )


@dataclass(frozen=True)
class Outcome:
    """The result of a tool: its outputs by parameter name, and the few facts worth a line on the terminal."""

    outputs: Mapping[str, Path]
    facts: Mapping[str, Any] = field(default_factory=dict)
    lines: tuple[str, ...] = ()  # printed after the run, for a reader
    status: int = 0  # exit status of the command
    then: str = ""  # the command that follows, if it depends on the run and replaces the tool's ``then``

    @classmethod
    def of_folder(
        cls, output: str, parts: Mapping[str, str], facts: Mapping[str, Any], lines: tuple[str, ...], then: str = ""
    ) -> Outcome:
        """For a tool that makes a folder: the folder itself, and the names of the files in it by meaning."""
        folder = Path(output)
        return cls({"output": folder} | {key: folder / name for key, name in parts.items()}, facts, lines, then=then)


@dataclass(frozen=True)
class Tool:
    """One tool of the toolbox: ``run(ask, feedback)`` does the work that ``Ask`` declares."""

    name: str
    group: str  # Prepare, Simulate, Evaluate
    summary: str
    Ask: type
    run: Callable[[Any, Feedback], Outcome]
    in_qgis: bool = True
    then: str = (
        ""  # the command that usually follows, printed last: {dem}, {output} are replaced by what was given and made
    )

    @property
    def qgis_id(self) -> str:
        """Its name in QGIS's toolbox; empty for a tool that is not in QGIS."""
        return "deadwood:" + self.name.replace("-", "") if self.in_qgis else ""

    @property
    def label(self) -> str:
        return self.name.replace("-", " ").capitalize()

    @property
    def description(self) -> str:
        """The docstring of the tool's file."""
        import sys

        return (sys.modules[self.Ask.__module__].__doc__ or "").strip()

    def parameters(self) -> Iterator[Parameter]:
        for each in dataclasses.fields(self.Ask):
            old = old_names_of(self.name, each.name)
            yield dataclasses.replace(each.metadata["parameter"], name=each.name, old_names=old)

    def check(self, ask: Any) -> None:
        """Check everything for which no file must be opened: kinds, bounds and choices."""
        for parameter in self.parameters():
            check_value(parameter, getattr(ask, parameter.name))
            if parameter.kind != "field" or parameter.parent_elsewhere or getattr(ask, parameter.name) is None:
                continue
            if getattr(ask, parameter.parent, None) is None:
                flag = "--" + parameter.parent.replace("_", "-")
                raise UserError(f"{parameter.flag} names a field, but {flag}, whose field it is, is not given")

    def __call__(self, ask: Any = None, feedback: Feedback | None = None, **values: Any) -> Outcome:
        """Run from Python: ``TOOL(Ask(...))`` or ``TOOL(dem=..., output=...)``, with the same checks as a flag gets."""
        if ask is None:
            ask = self.ask_from(values)
        self.check(ask)
        return self.run(ask, feedback or Quiet())

    def ask_from(self, values: Mapping[str, Any]) -> Any:
        """Build the ``Ask`` from a mapping; an unknown or missing name is the user's error."""
        known = {parameter.name: parameter for parameter in self.parameters()}
        values = with_new_names(self.name, values)
        for name in values:
            if name not in known:
                raise UserError(f"{self.name}: no parameter is called '{name}'; known are {', '.join(known)}")
        required = (f.name for f in dataclasses.fields(self.Ask) if f.default is dataclasses.MISSING)
        for name in required:
            if values.get(name) is None:
                raise UserError(f"{self.name}: {known[name].flag} is missing ({known[name].label})")
        return self.Ask(**{name: known[name].of_kind.from_value(known[name], each) for name, each in values.items()})


def taken(ask: Any, record: type[Record]) -> Record:
    """The parameters named in a small record, for a helper that need not know the tool's ``Ask``."""
    return record(**{each.name: getattr(ask, each.name) for each in dataclasses.fields(record)})  # type: ignore[arg-type]


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


# (where something is being made, where it will stand): manifests contain the second
_moving: ContextVar[tuple[tuple[str, str], ...]] = ContextVar("_moving", default=())


@contextmanager
def moving_to(made_in: str | Path, final: str | Path) -> Iterator[None]:
    """In this context, manifests name files in the folder ``made_in`` by their final place."""
    token = _moving.set(((os.path.abspath(made_in), os.path.abspath(final)), *_moving.get()))
    try:
        yield
    finally:
        _moving.reset(token)


def final_place(path: str | Path) -> str:
    """The absolute path that a file or folder will have in the end."""
    named = os.path.abspath(path)
    for made_in, final in _moving.get():
        if named == made_in or named.startswith(made_in + os.sep):
            named = final + named[len(made_in) :]
    return named


class TakesPresets:
    """Base of an ``Ask`` whose options a preset may set by name."""

    def taken_presets(self) -> Sequence[Any]:
        """The presets taken by name (``presets.Taken``)."""
        raise NotImplementedError


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
    from importlib import util

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
