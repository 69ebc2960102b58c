"""A tool called from Python: data become files, the tool runs, its result is returned.

The checks, the messages and the results are those of the command line, with arguments in place of options; a wrong
input raises `UserError`.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

from deadwood_algorithms.files.in_memory import Raster, as_file, crs_text, is_in_memory
from deadwood_algorithms.files.kept_inputs import lasting_no_longer_than_this
from deadwood_algorithms.params.tool import Feedback, Parameter, Quiet, Tool, UserError
from deadwood_toolbox.environment import as_the_command, refuse_small_address_space
from deadwood_toolbox.result import Result, TemporaryFolder
from deadwood_toolbox.shelf import find

if TYPE_CHECKING:
    from collections.abc import Iterator

    from geopandas import GeoDataFrame
    from pandas import DataFrame

Made = TypeVar("Made", bound=Result)
# An option in a message, and a command, whose options stay
OPTION = re.compile(r"deadwood-tool [a-z][^;:()]*|--([a-z][a-z0-9]*(?:-[a-z0-9]+)*)")


class DataArray(Protocol):
    """An xarray.DataArray whose georeference rioxarray holds."""

    @property
    def dims(self) -> tuple[Any, ...]: ...

    @property
    def values(self) -> Any: ...


PathInput: TypeAlias = "str | os.PathLike[str]"
LayerInput: TypeAlias = "PathInput | GeoDataFrame"
TableInput: TypeAlias = "PathInput | DataFrame"
RasterInput: TypeAlias = "PathInput | Raster | DataArray"
TerrainInput: TypeAlias = "RasterInput | Sequence[PathInput]"
PathsInput: TypeAlias = "PathInput | Sequence[PathInput]"
NumbersInput: TypeAlias = "float | str | Sequence[float]"


def call(name: str, kind: type[Made], given: Mapping[str, Any]) -> Made:
    """Run the tool of that name with the given parameters, including ``progress`` and ``feedback``."""
    tool = find(name)
    assert tool is not None
    values = dict(given)
    feedback = _Told(values.pop("feedback"), shown=values.pop("progress"))
    parameters = {each.name: each for each in tool.parameters()}
    outputs = {each: values[each] for each in parameters if parameters[each].is_output}
    temporary = TemporaryFolder() if parameters.get("output") and values["output"] is None else None
    try:
        with as_the_command(os.environ), _removed_on_failure() as made, ExitStack() as open_until_done:
            refuse_small_address_space()
            folder_of_data = partial(_folder_of_inputs, parameters, temporary, open_until_done)
            places = {each: _place(tool, parameters[each], outputs, temporary) for each in outputs}
            typed = {}
            for each, value in values.items():
                if parameters[each].path_like or parameters[each].is_input:
                    if is_in_memory(value) or (temporary is None and _is_unsaved_file(value)):
                        value = _as_file(value, each, folder_of_data(places.get("output")), made)
                    typed[each] = _as_path(parameters[each], value)
                elif not parameters[each].is_output:
                    typed[each] = _as_setting(parameters[each], value)
            ask = tool.ask_from({**typed, **{each: str(place) for each, place in places.items() if place}})
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # warnings of libraries, as on the command line
                outcome = tool(ask, feedback)
    except UserError as error:
        error.args = (with_arguments(str(error)), *error.args[1:])
        raise
    finally:
        feedback.pass_on()
    kept = {name: place for name, place in places.items() if place is not None}
    kept = {**{name: Path(place) for name, place in outcome.outputs.items()}, **kept}
    folder = _folder_of_result(parameters, kept)
    text = "\n".join(outcome.lines)
    held = (temporary, *(each for value in values.values() for each in _results_in(value)))
    return kind(tool.name, kept, folder, outcome.facts, text, tuple(feedback.notes), tuple(feedback.warnings), held)


def with_arguments(message: str) -> str:
    """A message whose options are named as arguments of a function: ``--rest-speed-ms`` is ``rest_speed_ms``."""
    return OPTION.sub(lambda found: found[1].replace("-", "_") if found[1] else found[0], message)


def _place(
    tool: Tool, parameter: Parameter, outputs: Mapping[str, Any], temporary: TemporaryFolder | None
) -> Path | None:
    """The place of an output: as named, else under the tool's name; an optional one that is True goes beside the main
    one.
    """
    value, main = outputs[parameter.name], outputs.get("output")
    if isinstance(value, str | os.PathLike):
        return Path(value)
    if value is False or (value is None and parameter.name != "output"):
        return None
    if value not in (True, None):
        raise UserError(f"{parameter.flag} is '{value}', but must be a path, or True")
    ending = parameter.ending
    if parameter.name == "output":
        if temporary is None:
            raise UserError(f"{parameter.flag} is '{value}', but must be a path")
        return temporary.path / f"{tool.name.replace('-', '_')}{ending}"
    if temporary is not None:
        return temporary.path / f"{parameter.name}{ending}"
    beside = Path(main) if main is not None else Path(tool.name.replace("-", "_"))
    return beside.with_name(f"{beside.stem}_{parameter.name}{ending}")


def _folder_of_inputs(
    parameters: Mapping[str, Parameter], temporary: TemporaryFolder | None, stack: ExitStack, output: Path | None
) -> Path:
    """The folder in which given data become files: a folder of results saves them itself; a file's are kept beside it,
    because its record names them.
    """
    if temporary is not None:
        return temporary.path / "inputs"
    if output is None:
        raise UserError("this tool has no output beside which data could be kept; give paths")
    if parameters["output"].ending:
        return output.with_name(f"{output.stem}_inputs")
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="deadwood-")))
    stack.enter_context(lasting_no_longer_than_this(folder))
    return folder


def _as_file(value: Any, name: str, folder: Path, made: list[Path]) -> Path:
    """Data as a file, which is added to the files made for this call."""
    there = set(folder.iterdir()) if folder.is_dir() else set()
    place = as_file(value, name, folder)
    if place not in there:
        made.append(place)
    return place


def _as_path(parameter: Parameter, value: Any) -> Any:
    """A path as text, several with commas between; a number where one is accepted."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if parameter.path_like and isinstance(value, list | tuple):
        return ",".join(os.fspath(each) for each in value)
    if value is None or isinstance(value, str) or parameter.of_kind.number_or_text:
        return _one(parameter, value)
    raise UserError(f"{parameter.flag} has the type {type(value).__name__}, but must be {_welcome(parameter)}")


def _as_setting(parameter: Parameter, value: Any) -> Any:
    """A text with commas may also be given as a list, and a CRS as an object that represents one."""
    if parameter.of_kind.crs and value is not None:
        return crs_text(value)
    if parameter.of_kind.lists and isinstance(value, list | tuple):
        return ",".join(str(each) for each in value)
    return _one(parameter, value)


def _one(parameter: Parameter, value: Any) -> Any:
    """A single value; several are refused, with the tool that takes them."""
    value = _plain(value)
    kind = parameter.of_kind
    of_one = (kind.json_as_it_is or kind.number_or_text) and not kind.several and not kind.switch
    if of_one and isinstance(value, list | tuple | set | range):
        raise UserError(
            f"{parameter.flag} takes one value, but {len(value)} were given; call the function once for each, or use "
            "vary, which compares them with the same logs"
        )
    return value


def _plain(value: Any) -> Any:
    """A number of numpy, or an array of them, as Python's own."""
    return value.tolist() if hasattr(value, "tolist") else value


def _welcome(parameter: Parameter) -> str:
    other = {"raster": "a Raster", "vector": "a GeoDataFrame", "table": "a DataFrame"}.get(parameter.kind)
    return f"a path or {other}" if other else "a path"


def _results_in(value: Any) -> Iterator[Result]:
    """The results among the arguments: their folders must last as long as the result made from them."""
    if isinstance(value, Result):
        yield value
    elif isinstance(value, list | tuple):
        yield from (each for each in value if isinstance(each, Result))


def _is_unsaved_file(value: Any) -> bool:
    """Whether a value is a result of one file that vanishes with it, though a kept output would name it."""
    if not isinstance(value, Result):
        return False
    file = Path(value)
    folders = (each.path for each in value.held if isinstance(each, TemporaryFolder))
    return file.is_file() and any(file.is_relative_to(each) for each in folders)


def _folder_of_result(parameters: Mapping[str, Parameter], places: Mapping[str, Path]) -> Path:
    """The output folder, or the one that contains the output file."""
    output = places.get("output", Path.cwd() / "x")
    declared = parameters.get("output")
    return output if declared is not None and declared.ending == "" else output.parent


@contextmanager
def _removed_on_failure() -> Iterator[list[Path]]:
    """Remove the inputs that were made for a call if it fails."""
    made: list[Path] = []
    try:
        yield made
    except BaseException:
        for each in made:
            with suppress(OSError):
                each.unlink()
                each.parent.rmdir()
        raise


class _Told(Quiet):
    """Messages of a tool while it works: stored for its result, and shown or passed on at once if requested.

    Warnings become Python's own at the end of the call, unless something has received them by then.
    """

    def __init__(self, feedback: Feedback | None, *, shown: bool) -> None:
        self.notes: list[str] = []
        self.warnings: list[str] = []
        self.to, self.coded = feedback, feedback is None  # a caller's own takes the message alone, as it always did
        if feedback is None and shown:
            from deadwood_toolbox.feedback import Speaker

            self.to = Speaker("bar")
        if self.to is not None:
            self.progress, self.cancelled = self.to.progress, self.to.cancelled

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        message = with_arguments(message)
        self.notes.append(message)
        if self.to is not None:
            self._say(self.to.note, message, code, numbers)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        message = with_arguments(message)
        self.warnings.append(message)
        if self.to is not None:
            self._say(self.to.warn, message, code, numbers)

    def _say(self, say: Callable[..., None], message: str, code: str, numbers: dict[str, Any]) -> None:
        say(message, code, **numbers) if self.coded else say(message)

    def pass_on(self) -> None:
        """Pass them to Python's warnings, at the line of the caller of the tool's function."""
        close = getattr(self.to, "close", None)
        if close is not None:
            close()
        if self.to is None:
            for each in self.warnings:
                warnings.warn(each, UserWarning, stacklevel=4)
