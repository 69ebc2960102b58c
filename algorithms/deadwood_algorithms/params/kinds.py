"""The kinds of parameters: one entry per kind, from which the command line, the checks and QGIS's dialogs are made.

A new kind is a new entry of `KINDS`: how its values look on a command line, how text becomes a value, what is checked
without opening a file, and which QGIS widget is used are defined there, and nowhere else. Standard library only.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any


class UserError(Exception):
    """The user's input is at fault: one line that names file, layer, field, row or option, and the fix (exit 2)."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """What is known of one parameter; ``name`` is the field's name, snake_case, with the unit in it."""

    kind: str
    label: str
    name: str = ""
    help: str = ""
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    exclusive: bool = False  # the minimum itself is not allowed (a length, a diameter)
    exclusive_maximum: bool = False
    least_count: int = 1  # of numbers
    most_count: int = 100
    ascending: bool = False  # of numbers: bounds of classes, each larger than the one before; otherwise all different
    choices: tuple[str, ...] = ()
    geometry: tuple[str, ...] = ()  # of a vector input: point, line, polygon
    parent: str = ""  # of a field: the parameter whose layer has it
    parent_elsewhere: bool = False  # of a field: its layer may also come from a run or a table, so none need be given
    path_like: bool = False  # of a text or a raster: it may be a path, or several with commas
    file_ending: str = ""  # of an output file, if its kind does not determine it: '.html'
    optional: bool = False
    unless: str = ""  # optional only because that parameter may stand for it
    advanced: bool = False
    group: str = ""  # a separate heading in the help, for parameters that belong together
    positional: bool = False  # on the command line it may stand without its flag; several with commas, or one by one
    old_names: tuple[str, ...] = ()  # under which it is known too, in this version (`renamed`)
    default: Any = None

    @property
    def flag(self) -> str:
        return "--" + self.name.rstrip("_").replace("_", "-")

    @property
    def old_flags(self) -> tuple[str, ...]:
        return tuple("--" + each.replace("_", "-") for each in self.old_names)

    @property
    def of_kind(self) -> Kind:
        return KINDS[self.kind]

    @property
    def is_input(self) -> bool:
        return self.of_kind.direction == "input"

    @property
    def is_output(self) -> bool:
        return self.of_kind.direction == "output"

    @property
    def is_switch(self) -> bool:
        return self.of_kind.switch

    @property
    def metavar(self) -> str:
        """The placeholder for the value in the help."""
        return (self.of_kind.metavar or "|".join(self.choices)) + self.file_ending

    @property
    def ending(self) -> str:
        """Of an output: that of its name; empty for a folder."""
        return self.file_ending or self.of_kind.ending

    @property
    def widget(self) -> str:
        """The plugin's widget for it in QGIS."""
        return self.of_kind.widget or self.kind


# --- how a text becomes a value -------------------------------------------------------------------------------------


def _words(parameter: Parameter, text: str) -> str:
    if not text.strip():
        raise UserError(f"{parameter.flag} is empty ({parameter.label})")
    return text


def _number(parameter: Parameter, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        pointed = text.strip().replace(",", ".")
        hint = f"; write it with a point, {pointed}" if re.fullmatch(r"[+-]?\d*\.\d+", pointed) else ""
        raise UserError(f"{parameter.flag} is '{text}', but must be a number{hint}") from None


def _number_or_layer(parameter: Parameter, text: str) -> float | str:
    """The number, if the text is one, otherwise the path of a layer."""
    try:
        return float(_words(parameter, text))
    except ValueError:
        return text


def _whole(parameter: Parameter, text: str) -> int:
    if not re.fullmatch(r"[+-]?[0-9]{1,30}", text.strip()):
        raise UserError(f"{parameter.flag} is '{text}', but must be a whole number")
    return int(text)


def _numbers(parameter: Parameter, text: str) -> tuple[float, ...]:
    """``0.1,0.2`` or ``0.1:0.5:0.05``, from, to and step."""
    if text.count(":") == 2:
        low, high, step = (_number(parameter, part) for part in text.split(":"))
        if math.isfinite(low) and low < high < math.inf and step > 0.0 and (high - low) / step < parameter.most_count:
            return tuple(round(low + k * step, 10) for k in range(math.floor((high - low) / step + 1e-9) + 1))
        raise UserError(
            f"{parameter.flag} is '{text}', but from:to:step must rise, in at most {parameter.most_count} numbers"
        )
    try:
        return tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        raise UserError(
            f"{parameter.flag} is '{text}', but must be numbers separated by commas, or from:to:step"
        ) from None


# --- a value from Python or JSON as a flag would give it ---


def _as_it_is(parameter: Parameter, value: Any) -> Any:
    return value


def _as_number_or_layer(parameter: Parameter, value: Any) -> Any:
    return _number_or_layer(parameter, value) if isinstance(value, str) else value


def _as_numbers(parameter: Parameter, value: Any) -> Any:
    if isinstance(value, str):
        return _numbers(parameter, value)
    return tuple(value) if isinstance(value, Iterable) else None if value is None else (value,)


# Numbers beyond these are errors in any unit used here, and calculations with them over- or underflow.
SMALLEST, LARGEST = 1e-9, 1e12
# Of a file's name, in bytes: file systems permit 255, and files written beside it have longer names.
LONGEST_NAME, LONGEST_OF_ALL = 200, 255

# --- checks of a value --------------------------------------------------------------------------------------------


def _check_nothing(parameter: Parameter, value: Any) -> None:
    """Only the tool itself can check a path or a text."""


def _check_number(parameter: Parameter, value: Any, *, whole: bool = False) -> None:
    if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
        raise UserError(f"{parameter.flag} is '{value}', but must be a {'whole ' if whole else ''}number")
    try:
        finite = math.isfinite(value)
    except OverflowError:  # a Python int beyond 1.8e308
        finite = False
    if not finite:
        shown = value if isinstance(value, float) else "a number too large to calculate with"
        raise UserError(f"{parameter.flag} is {shown}, but must be finite")
    unit = f" {parameter.unit}" if parameter.unit else ""
    if value and not whole and not SMALLEST <= abs(value) <= LARGEST:
        raise UserError(f"{parameter.flag} is {value:g}{unit}, which is not a possible size; check it")
    low, high = parameter.minimum, parameter.maximum
    if low is not None and (value < low or (parameter.exclusive and value <= low)):
        word = "greater than" if parameter.exclusive else "at least"
        raise UserError(f"{parameter.flag} is {value:g}{unit}, but must be {word} {low:g}{unit}")
    if high is not None and (value > high or (parameter.exclusive_maximum and value >= high)):
        word = "less than" if parameter.exclusive_maximum else "at most"
        raise UserError(f"{parameter.flag} is {value:g}{unit}, but must be {word} {high:g}{unit}")


def _check_input(parameter: Parameter, value: Any) -> None:
    """Reject a name that no file can have; its tool checks whether the file exists."""
    longest = max(len(each.encode("utf-8", "surrogatepass")) for each in re.split(r"[/|,]", str(value)))
    if longest > LONGEST_OF_ALL:
        named = str(value)
        raise UserError(
            f"{parameter.flag} is {named[:40]} ... {named[-40:]}: no file has a name of {longest} bytes "
            "(File name too long)"
        )


def _check_output(parameter: Parameter, value: Any) -> None:
    """Reject names that no file system, or no library that writes there, accepts, before the work starts."""
    named = str(value)
    shown = named if len(named) <= 100 else f"{named[:40]}...{named[-40:]}"
    shown = shown.encode("unicode_escape").decode() if not named.isprintable() else shown
    last = re.split(r"[/\\]" if os.name == "nt" else "/", named.rstrip("/"))[-1].strip()
    if last in ("", ".", ".."):
        raise UserError(f"{parameter.flag} is '{shown}', which names no file or folder; add a name")
    if not named.isprintable():
        raise UserError(f"{parameter.flag} is '{shown}', with a character that cannot be printed; write it again")
    if any(each in last for each in ";|"):
        raise UserError(f"{parameter.flag} is '{shown}', but its name must be without ; and |")
    if len(last.encode()) > LONGEST_NAME:
        raise UserError(f"{parameter.flag} is '{shown}', {len(last.encode())} bytes; take at most {LONGEST_NAME}")
    if "://" in named or named.startswith("/vsi"):
        raise UserError(f"{parameter.flag} is '{shown}', but must be a place on this computer")


def _check_whole(parameter: Parameter, value: Any) -> None:
    _check_number(parameter, value, whole=True)


def _check_numbers(parameter: Parameter, value: Any) -> None:
    for each in value:
        _check_number(parameter, each)
    shown = ",".join(f"{each:g}" for each in value)
    least, most = parameter.least_count, parameter.most_count
    if not least <= len(value) <= most:
        raise UserError(f"{parameter.flag} is '{shown}', but must be {least} to {most} numbers, separated by commas")
    if parameter.ascending and not all(low < high for low, high in pairwise(value)):
        raise UserError(f"{parameter.flag} is '{shown}', but each number must be larger than the one before")
    if len(set(value)) < len(value):
        raise UserError(f"{parameter.flag} is '{shown}', but must be different numbers")


def _check_number_or_layer(parameter: Parameter, value: Any) -> None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return
    except OverflowError:
        number = math.inf
    _check_number(parameter, number)


def _check_choice(parameter: Parameter, value: Any) -> None:
    if value not in parameter.choices:
        raise UserError(f"{parameter.flag} is '{value}', but must be one of {', '.join(parameter.choices)}")


def _check_flag(parameter: Parameter, value: Any) -> None:
    if not isinstance(value, bool):
        raise UserError(f"{parameter.flag} is '{value}', but must be true or false")


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of parameter.

    Attributes
    ----------
    metavar : str
        Placeholder of a value in the help; empty: the choices.
    direction : str
        ``input``: the path of something that is read, ``output``: of something that is written, else ``setting``.
    from_text : callable
        Convert the text of a flag to a value.
    from_value : callable
        Convert what is in a file of parameters, or comes from Python, to the value that a flag would give.
    check : callable
        Raises `UserError` if a value does not fit.
    json_as_it_is : bool
        In a file of parameters the value has its JSON type (a number, true); otherwise it must be a text there.
    number_as_text : bool
        A number is accepted for its text, as typed.
    number_or_text : bool
        A number if it is one, otherwise a text; a text that reads as a number is that number.
    whole, several : bool
        A whole number; several numbers.
    lists, crs : bool
        Python also accepts a list of words; also an object that represents a CRS.
    ending : str
        Of an output's name; empty: it is a folder, or the parameter decides.
    switch : bool
        The flag takes no value: ``--overwrite``, ``--no-overwrite``.
    widget : str
        The widget of the QGIS plugin, by the name of the kind for which it is made; empty: this kind's.
        A widget that the plugin does not have is a line of text.
    """

    metavar: str
    direction: str = "setting"
    from_text: Callable[[Parameter, str], Any] = _words
    from_value: Callable[[Parameter, Any], Any] = _as_it_is
    check: Callable[[Parameter, Any], None] = _check_nothing
    json_as_it_is: bool = False
    number_as_text: bool = False
    number_or_text: bool = False
    whole: bool = False
    several: bool = False
    lists: bool = False
    crs: bool = False
    ending: str = ""
    switch: bool = False
    widget: str = ""


KINDS = {
    "raster": Kind(metavar="RASTER", direction="input", check=_check_input),
    "vector": Kind(metavar="LAYER", direction="input", check=_check_input),
    "table": Kind(metavar="TABLE", direction="input", check=_check_input),
    "folder": Kind(metavar="FOLDER", direction="input", check=_check_input),
    "file": Kind(metavar="FILE", direction="input", check=_check_input),
    "number_or_layer": Kind(
        metavar="NUMBER|LAYER",
        direction="input",
        from_text=_number_or_layer,
        from_value=_as_number_or_layer,
        check=_check_number_or_layer,
        number_or_text=True,
    ),
    "number": Kind(metavar="NUMBER", from_text=_number, check=_check_number, json_as_it_is=True),
    "integer": Kind(metavar="WHOLE", from_text=_whole, check=_check_whole, json_as_it_is=True, whole=True),
    "numbers": Kind(
        metavar="NUMBER,...",
        from_text=_numbers,
        from_value=_as_numbers,
        check=_check_numbers,
        json_as_it_is=True,
        several=True,
    ),
    "choice": Kind(metavar="", check=_check_choice),
    "flag": Kind(metavar="", check=_check_flag, json_as_it_is=True, switch=True),
    "text": Kind(metavar="TEXT", number_as_text=True, lists=True),
    "folders": Kind(metavar="FOLDER,...", number_as_text=True, lists=True),
    "results": Kind(metavar="RESULT,...", number_as_text=True, lists=True),
    "field": Kind(metavar="FIELD"),
    "crs": Kind(metavar="CRS", crs=True),
    "output_raster": Kind(metavar="FILE.tif", direction="output", check=_check_output, ending=".tif"),
    "output_vector": Kind(metavar="FILE.gpkg", direction="output", check=_check_output, ending=".gpkg"),
    "output_table": Kind(metavar="FILE.csv", direction="output", check=_check_output, ending=".csv"),
    "output_folder": Kind(metavar="FOLDER", direction="output", check=_check_output, ending=""),
    "output_file": Kind(metavar="FILE", direction="output", check=_check_output),
}


def check_value(parameter: Parameter, value: Any) -> None:
    """Raise ``UserError`` when a value does not fit its parameter."""
    if value is not None:
        parameter.of_kind.check(parameter, value)
    elif not parameter.optional:
        raise UserError(f"{parameter.flag} is missing ({parameter.label})")
