"""The vocabulary in which a tool declares itself: parameters, outcome, feedback, and the user's errors.

A tool's declaration is a frozen dataclass ``Ask`` whose fields are made by the functions below, one line per parameter.
Nothing about a parameter is written anywhere else: the command line, ``describe --json``, the catalogue, the QGIS
dialogs and the checks for Python callers are all rendered from it. `kinds` defines the kinds of parameters.
Standard library only.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from deadwood_algorithms.params.kinds import KINDS, Parameter, UserError, check_value
from deadwood_algorithms.params.messages import Feedback, Hearing, ProgressOnly, Quiet, Stage
from deadwood_algorithms.params.renamed import old_names_of, why_removed, with_new_names

__all__ = ["Cancelled", "Feedback", "Outcome", "Parameter", "Tool", "UserError", "check_value"]
__all__ += ["ProgressOnly", "Quiet", "Stage"]
VERSION = "0.3.0"  # the one place: pyproject.toml, the QGIS plugin and every manifest take it from here

REQUIRED: Any = object()
Record = TypeVar("Record")  # a small dataclass of parameters


class Cancelled(Exception):
    """The user interrupted the tool; no output has its final name (exit 130)."""


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


def output_file(label: str, ending: str, **facts: Any) -> Any:
    return ask("output_file", label, file_ending=ending, **facts)


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
    label: str = "Minimum run-out of deposits that count for the spread",
    help: str = "Default: one log length.",
    **facts: Any,
) -> Any:
    return number(label, unit="m", default=None, minimum=0.0, help=help, **facts)


def capacity_power() -> Any:
    """How the capacity of a tree or a stem depends on its diameter."""
    return number("Exponent of DBH / 40 cm with which it grows", default=2.0, minimum=0.0, maximum=6.0, advanced=True)


def seed() -> Any:
    return integer("Seed of the random draws", default=0, minimum=0, maximum=2**63 - 1, advanced=True)


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
        return self.run(ask, Hearing(feedback or Quiet()))

    def ask_from(self, values: Mapping[str, Any]) -> Any:
        """Build the ``Ask`` from a mapping; an unknown or missing name is the user's error."""
        known = {parameter.name: parameter for parameter in self.parameters()}
        values = with_new_names(self.name, values)
        for name in values:
            if name not in known:
                if gone := why_removed(self.name, name):
                    raise UserError(gone)
                raise UserError(f"{self.name}: no parameter is called '{name}'; known are {', '.join(known)}")
        required = (f.name for f in dataclasses.fields(self.Ask) if f.default is dataclasses.MISSING)
        for name in required:
            if values.get(name) is None:
                raise UserError(f"{self.name}: {known[name].flag} is missing ({known[name].label})")
        return self.Ask(**{name: known[name].of_kind.from_value(known[name], each) for name, each in values.items()})


def taken(ask: Any, record: type[Record]) -> Record:
    """The parameters named in a small record, for a helper that need not know the tool's ``Ask``."""
    return record(**{each.name: getattr(ask, each.name) for each in dataclasses.fields(record)})  # type: ignore[arg-type]


class TakesPresets:
    """Base of an ``Ask`` whose options a preset may set by name."""

    def taken_presets(self) -> Sequence[Any]:
        """The presets taken by name (``presets.Taken``)."""
        raise NotImplementedError
