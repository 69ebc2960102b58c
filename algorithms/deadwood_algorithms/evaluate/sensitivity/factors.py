"""The factors that can be varied, their ranges, and how a user states them in a text or table.

A factor is a number that replaces one of the scene's (``friction``), a multiplier of values of the layers
(``log_dbh_factor``), or a choice of two (``fidelity``, ``orientation``). If the user gives no range, that of `OFFERED`
is used; each is a suggestion with its reason, and every run reports the ranges used.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deadwood_algorithms.params.presets import FRICTION_RANGE, FRICTIONS
from deadwood_algorithms.params.tool import UserError

# Factors that are a choice of two of these, not a range of numbers
CHOICES = {
    "fidelity": ("draft", "standard", "fine", "reference"),
    "orientation": ("upright", "random-lying", "random"),
}


@dataclass(frozen=True)
class Offer:
    """A factor that can be varied: its name in words, its unit, bounds, and default range."""

    words: str
    unit: str
    least: float
    most: float
    low: float | str
    high: float | str


OFFERED: Mapping[str, Offer] = {
    # The paper's range, found on 0.5 m cells
    "friction": Offer("friction", "", 0.0, 10.0, *FRICTION_RANGE),
    "friction_factor": Offer("friction of the map", "times", 0.0, 10.0, 0.8, 1.2),
    # No value measured for logs is known: a roller of 0.6 m that sinks in by 1 to 10 mm has 0.04 to 0.13
    "rolling_friction": Offer("rolling friction", "", 0.0, 0.5, 0.03, 0.15),
    "restitution": Offer("restitution of impacts", "", 0.0, 1.0, 0.0, 0.2),
    "tree_friction": Offer("friction of stems", "", 0.0, 10.0, 0.2, 0.6),
    "tree_restitution": Offer("restitution of stems", "", 0.0, 1.0, 0.0, 0.2),
    # Error of a height or diameter estimated from the air
    "log_dbh_factor": Offer("DBH of the logs", "times", 0.01, 100.0, 0.9, 1.1),
    "log_length_factor": Offer("length of the logs", "times", 0.01, 100.0, 0.9, 1.1),
    # Sound to well decayed wood of one species
    "log_density_factor": Offer("density of the logs", "times", 0.01, 100.0, 0.7, 1.3),
    "tree_dbh_factor": Offer("DBH of the trees", "times", 0.01, 100.0, 0.9, 1.1),
    # Airborne laser scanning under trees
    "dem_noise_m": Offer("error of the terrain model", "m", 0.0, 10.0, 0.0, 0.1),
    "fidelity": Offer("fidelity", "", 0.0, 0.0, "draft", "standard"),
    # Snags that topple, or windthrown wood that begins to slide where it lies
    "orientation": Offer("posture at the start", "", 0.0, 0.0, "upright", "random-lying"),
}
OF_LOGS = ("log_dbh_factor", "log_length_factor")
OF_TREES = ("tree_dbh_factor", "tree_friction", "tree_restitution")


@dataclass(frozen=True)
class Factor:
    """A factor and the two ends of its range; of a choice (`CHOICES`) the two are names."""

    name: str
    low: float | str
    high: float | str
    offered: bool = False  # the user gave no range, so it is the one of `OFFERED`

    @property
    def offer_words(self) -> str:
        """A note that the range is a suggestion, and its reason."""
        whose = FRICTIONS["wet-debarked"].source if self.name == "friction" else "a suggestion, nobody's measurement"
        return f"--vary {self.name} takes the range that is offered, {self.range_words}: {whose}"

    @property
    def words(self) -> str:
        return OFFERED[self.name].words

    def at(self, share: float) -> float | str:
        """The value at a share of the range, 0 to 1; of a choice, one for each half."""
        if isinstance(self.low, str) or isinstance(self.high, str):
            return self.low if share < 0.5 else self.high
        return self.low + share * (self.high - self.low)

    def shown(self, value: float | str) -> str:
        unit = OFFERED[self.name].unit
        if isinstance(value, str):
            return value
        return f"{value:g}" + (f" {unit}" if unit else "")

    @property
    def range_words(self) -> str:
        low, high = (f"{each:g}" if not isinstance(each, str) else each for each in (self.low, self.high))
        unit = OFFERED[self.name].unit
        return f"{low} to {high}" + (f" {unit}" if unit else "")


def factors_of(given: str) -> list[Factor]:
    """The factors of ``--vary``: a text, or the path of a JSON file or of a CSV table ``factor,low,high``.

    In the text, factors are separated by commas, ``friction=0.2:0.3, rolling_friction``; one without a range takes the
    default range.
    """
    path = Path(given.strip())
    if path.suffix.lower() in (".json", ".csv"):
        if not path.is_file():
            raise UserError(f"--vary: the file {path} does not exist")
        rows = _from_json(path) if path.suffix.lower() == ".json" else _from_csv(path)
    else:
        rows = [_from_words(part) for part in given.split(",") if part.strip()]
    factors = [_checked(name, ends, place) for name, ends, place in rows]
    if not factors:
        raise UserError("--vary names no factor; give for example friction_factor=0.8:1.2,rolling_friction")
    names = [each.name for each in factors]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise UserError(f"--vary: '{twice}' is named twice; give one range")
    if "friction" in names and "friction_factor" in names:
        raise UserError("--vary: friction and friction_factor are the same factor; leave out one of them")
    return factors


Ends = tuple[Any, Any] | None
Row = tuple[str, Ends, str]


def _from_words(part: str) -> Row:
    name, sign, ends = (each.strip() for each in part.partition("="))
    place = f"--vary: '{part.strip()}'"
    if not sign:
        return name, None, place
    low, colon, high = (each.strip() for each in ends.partition(":"))
    if not colon or not low or not high:
        raise UserError(f"{place} is not a range; write it as NAME=LOW:HIGH, such as friction=0.2:0.3")
    return name, (low, high), place


def _from_json(path: Path) -> list[Row]:
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, UnicodeDecodeError) as error:
        raise UserError(f'{path}: not JSON ({error}); write {{"friction": [0.2, 0.3]}}') from None
    if not isinstance(content, dict):
        raise UserError(f'{path}: must be an object by factor, such as {{"friction": [0.2, 0.3]}}')
    rows: list[Row] = []
    for name, ends in content.items():
        place = f"{path}: '{name}'"
        if ends is not None and not (isinstance(ends, list) and len(ends) == 2):
            raise UserError(f"{place} must be [LOW, HIGH], or null for the default range")
        rows.append((name, None if ends is None else (ends[0], ends[1]), place))
    return rows


def _from_csv(path: Path) -> list[Row]:
    import csv

    with path.open(encoding="utf-8-sig", newline="") as source:
        table = csv.DictReader(source)
        names = [str(each).strip().lower() for each in table.fieldnames or ()]
        missing = [each for each in ("factor", "low", "high") if each not in names]
        if missing:
            raise UserError(f"{path}: there is no column '{missing[0]}'; the table needs factor, low and high")
        rows: list[Row] = []
        for number, record in enumerate(table, 1):
            values = {str(key).strip().lower(): str(value or "").strip() for key, value in record.items() if key}
            ends = values["low"], values["high"]
            rows.append((values["factor"], ends if any(ends) else None, f"{path}, row {number}"))
    return rows


def _checked(name: str, ends: Ends, place: str) -> Factor:
    """The checked factor; an invalid one is rejected with one line."""
    key = name.strip().lower().replace("-", "_")
    if key not in OFFERED:
        raise UserError(f"{place}: no factor is called '{name}'; known are {', '.join(OFFERED)}")
    offer = OFFERED[key]
    if ends is None:
        return Factor(key, offer.low, offer.high, offered=True)
    if key in CHOICES:
        low, high = (str(each).strip().lower() for each in ends)
        for each in (low, high):
            if each not in CHOICES[key]:
                raise UserError(f"{place}: '{each}' is none of {', '.join(CHOICES[key])}")
        if low == high:
            raise UserError(f"{place}: both ends are {low}; name two of {', '.join(CHOICES[key])}")
        return Factor(key, low, high)
    try:
        low, high = (float(each) for each in ends)
    except (TypeError, ValueError):
        raise UserError(
            f"{place}: the range {ends[0]} to {ends[1]} is not two numbers (with a decimal point)"
        ) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise UserError(f"{place}: the range is {low:g} to {high:g}, but must go from a number to a larger one")
    if low < offer.least or high > offer.most:
        raise UserError(
            f"{place}: {low:g} to {high:g} is outside the permitted range of {key}, {offer.least:g} to {offer.most:g}"
        )
    return Factor(key, low, high)
