"""The result of a call from Python: its files, and their contents as tables and arrays, read on access.

The classes of the tools, with one attribute for each layer, raster and table, are in `functions`, which is written from
the declarations (`schemas.written`).
"""

from __future__ import annotations

import json
import os
import shutil
import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, overload

from deadwood_algorithms.files.in_memory import Raster, has_layer, read_layer, read_raster, read_table
from deadwood_algorithms.params.tool import Quiet, UserError

if TYPE_CHECKING:
    from geopandas import GeoDataFrame
    from matplotlib.axes import Axes
    from pandas import DataFrame

Content = TypeVar("Content")


class Part(Generic[Content]):
    """An attribute of a result that represents the content of one of its files.

    Parameters
    ----------
    place : str
        A file in the result's folder, or the flag of the output.
    layer : str
        Of a GeoPackage.
    """

    def __init__(self, place: str, layer: str = "") -> None:
        self.place, self.layer, self.name = place, layer, ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, result: None, owner: type) -> Self: ...

    @overload
    def __get__(self, result: Result, owner: type) -> Content: ...

    def __get__(self, result: Result | None, owner: type) -> Self | Content:
        if result is None:
            return self
        if self.name not in result._read:
            file = self.file_of(result)
            if not self.is_in(result) or file is None:
                raise UserError(
                    f"{result.folder}: {result.tool} did not make '{self.name}' in this run; see its options"
                )
            result._read[self.name] = self.read(file)
        return result._read[self.name]

    def file_of(self, result: Result) -> Path | None:
        """The place of the file; None for an output that was not requested."""
        if self.place.startswith("--"):
            return result.outputs.get(self.place.removeprefix("--").replace("-", "_"))
        return result.folder / self.place

    def is_in(self, result: Result) -> bool:
        """Whether the result contains this part."""
        file = self.file_of(result)
        return file is not None and file.is_file()

    def read(self, file: Path) -> Content:
        raise NotImplementedError


class LayerPart(Part["GeoDataFrame"]):
    """A layer of a GeoPackage."""

    def is_in(self, result: Result) -> bool:
        file = self.file_of(result)
        return file is not None and super().is_in(result) and has_layer(file, self.layer)

    def read(self, file: Path) -> GeoDataFrame:
        return read_layer(file, self.layer)


class RasterPart(Part[Raster]):
    """A GeoTIFF."""

    def read(self, file: Path) -> Raster:
        return read_raster(file)


class TablePart(Part["DataFrame"]):
    """A table: CSV, or Parquet."""

    def read(self, file: Path) -> DataFrame:
        return read_table(file)


class Result:
    """The result of a tool.

    Attributes
    ----------
    tool : str
        Name of the tool.
    outputs : dict of str to Path
        Files and folders by the parameters that name them.
    folder : Path
        The output folder, or the one that contains the output file. Without an ``output`` it is a
        temporary one, which is removed with this object.
    facts : dict
        The content of the tool's summary.
    text : str
        The text that the command line would print.
    notes, warnings : tuple of str
        Messages during the run.
    """

    summary_file = ""  # for tools that write one

    def __init__(
        self,
        tool: str,
        outputs: Mapping[str, Path],
        folder: Path,
        facts: Mapping[str, Any],
        text: str,
        notes: tuple[str, ...],
        warnings: tuple[str, ...],
        held: tuple[object, ...] = (),
    ) -> None:
        self.tool, self.outputs, self.folder = tool, dict(outputs), folder
        self.facts, self.text, self.notes, self.warnings = dict(facts), text, notes, warnings
        self._read: dict[str, Any] = {}
        self.held = held  # temporary folders that the files of this result refer to

    @property
    def path(self) -> Path:
        """The main output, which other tools take as input."""
        if "output" not in self.outputs:
            raise UserError(f"{self.tool} makes no output that another tool could use")
        return self.outputs["output"]

    def __fspath__(self) -> str:
        return str(self.path)

    @property
    def parts(self) -> tuple[str, ...]:
        """The layers, rasters and tables that this result has: the names of its attributes."""
        return tuple(name for name, part in self._parts() if part.is_in(self))

    @property
    def summary(self) -> dict[str, Any]:
        """The content of the tool's JSON file, such as ``summary.json``; the facts of a tool that writes none."""
        if not self.summary_file or not (self.folder / self.summary_file).is_file():
            return self.facts
        return json.loads((self.folder / self.summary_file).read_text(encoding="utf-8"))

    @property
    def manifest(self) -> dict[str, Any]:
        """The record of its origin: ``run_id``, inputs with their SHA-256, the values used."""
        from deadwood_algorithms.files.embedded import record_in
        from deadwood_algorithms.files.input_files import made_from

        return made_from(self.path) if self.path.is_dir() else record_in(self.path) or {}

    def report(self) -> Path:
        """The page written by the tool, for a browser."""
        page = self.folder / "report.html"
        if not page.is_file():
            raise UserError(f"{self.folder}: {self.tool} has written no report here")
        return page

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the first raster and the first layer of the result as a map; returns matplotlib's axes."""
        from deadwood_algorithms.files import quick_map

        there = [(name, part) for name, part in self._parts() if part.is_in(self)]
        rasters = [name for name, part in there if isinstance(part, RasterPart)][:1]
        layers = [name for name, part in there if isinstance(part, LayerPart)][:1]
        if not rasters and not layers:
            raise UserError(f"{self.folder}: {self.tool} has no result that a map could show")
        ax = quick_map.map_axes() if ax is None else ax
        for name in rasters:
            quick_map.draw_raster(ax, getattr(self, name))
        for name in layers:
            quick_map.draw_layer(ax, getattr(self, name))
        quick_map.finish(ax)
        return ax

    def __repr__(self) -> str:
        return f"<{self.tool} in {self.folder}>" + (f"\n{self.text}" if self.text else "")

    def _parts(self) -> list[tuple[str, Part[Any]]]:
        known = {name: each for owner in reversed(type(self).__mro__) for name, each in vars(owner).items()}
        return [(name, each) for name, each in known.items() if isinstance(each, Part)]


class Run(Result):
    """A run of slide-logs."""

    hits = RasterPart("hit_count.tif")

    def report(self, language: str = "en") -> Path:
        """The page with maps, figures and the 3-D view, for a browser; made the first time, in the run's folder."""
        from deadwood_toolbox.shelf import find

        page = self.folder / ("report.html" if language == "en" else f"report_{language}.html")
        if not page.is_file():
            make_report = find("make-report")
            assert make_report is not None
            make_report(runs=str(self.folder), language=language, output=str(page))
        return page

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw how many logs touched each cell, the lines, and the deposits by stop reason, on the relief and the trees
        of the run as far as their files are still there."""
        from deadwood_algorithms.files import quick_map
        from deadwood_algorithms.results.relief import read_relief, tree_places
        from deadwood_algorithms.results.run_folder import read_run

        ax = quick_map.map_axes() if ax is None else ax
        run = read_run(str(self.folder), feedback=Quiet())
        frame = quick_map.frame_of(self.hits)
        quick_map.draw_ground(ax, read_relief(run, frame), tree_places(run))
        quick_map.draw_raster(ax, self.hits)
        if "reach" in self.parts:
            lines = getattr(self, "reach")  # noqa: B009 (an attribute of the class that is written)
            quick_map.draw_layer(ax, lines, label="roads, railways, houses")
        quick_map.draw_layer(ax, getattr(self, "deposits"), by="stop_reason")  # noqa: B009
        ax.set(xlim=frame[:2], ylim=frame[2:])
        quick_map.finish(ax)
        return ax


class TemporaryFolder:
    """A folder that is removed when this object is no longer referenced, at the latest when Python exits."""

    def __init__(self) -> None:
        import tempfile

        self.path = Path(tempfile.mkdtemp(prefix="deadwood-"))
        self.remove = weakref.finalize(self, shutil.rmtree, os.fspath(self.path), ignore_errors=True)
