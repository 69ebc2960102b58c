"""Requests to a session: messages become records; invalid ones are rejected with a text for the page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.releases.logs import ORIENTATIONS
from deadwood_algorithms.schemas import BARRIERS, DBH_CM, DENSITY_KG_M3, LYING_LOGS, RELEASES, TREES, Column
from deadwood_engine import FIDELITIES
from deadwood_engine.limits import DENSITY, DIAMETER, LENGTH

MOST_LOGS = 10_000
MOST_RADIUS_M = 500.0
MOST_VERTICES = 1_000  # of a polygon or a barrier
MOST_DRAWN = 500  # trees planted, barriers, lying logs
MOST_FELLED = 100_000
LONGEST_LYING_M = 150.0  # of a log that is drawn: no tree is longer
MOST_POSED = 200  # logs whose poses are sent
PREVIEW = 30  # logs while the mouse moves
MOST_FRICTION, MOST_ROLLING = 5.0, 0.5
LIKELY_FRICTION = 1.0  # above it, the page asks whether it is meant: no source has so much for wood

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sizes:
    """Sizes of the released logs: each is drawn uniformly between two values."""

    dbh_cm: tuple[float, float]
    length_m: tuple[float, float]
    density_kg_m3: float
    orientation: str


@dataclass(frozen=True)
class Question:
    """Logs to be released: around a point or in a polygon, in world coordinates [m], and how they slide.

    friction : None for that of the layers; number : the request's number, as given by the front end
    """

    area: Any
    radius_m: float
    n: int
    seed: int
    fidelity: str
    friction: float | None
    rolling_friction: float
    restitution: float
    sizes: Sizes
    number: Any = None


@dataclass(frozen=True)
class Drawn:
    """A line that was drawn, in world coordinates [m], shape (n, 2), and its size: a height [m] or a diameter [cm]."""

    points: Array
    size: float


@dataclass(frozen=True)
class Changes:
    """What differs from the scene as it was read.

    fell : rows of its trees, ascending; plant : x, y [m], DBH [cm], height [m], shape (n, 4)
    """

    fell: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    plant: Array = field(default_factory=lambda: np.zeros((0, 4)))
    barriers: tuple[Drawn, ...] = ()
    lying_logs: tuple[Drawn, ...] = ()

    def __bool__(self) -> bool:
        return bool(len(self.fell) or len(self.plant) or self.barriers or self.lying_logs)

    @property
    def adds(self) -> bool:
        return bool(len(self.plant) or self.barriers or self.lying_logs)


@dataclass(frozen=True)
class Defaults:
    """Values that apply where a message gives none.

    friction : None if it comes from a layer, which then cannot be replaced by a single number
    preset : the name of the friction, if it was chosen by name
    """

    sizes: Sizes
    seed: int
    fidelity: str
    friction: float | None
    rolling_friction: float
    restitution: float
    preset: str | None = None


def number_in(message: Mapping[str, Any], name: str, low: float, high: float, default: float | None = None) -> float:
    """A finite number within bounds; ``default`` where the message has none."""
    value = message.get(name, default)
    if value is None and default is not None:
        value = default
    return checked(value, name, low, high)


def checked(value: Any, name: str, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UserError(f"'{name}' must be a number")
    if not low <= value <= high:
        raise UserError(f"'{name}' is {value:g}, but must be {low:g} to {high:g}")
    return float(value)


def whole_in(message: Mapping[str, Any], name: str, low: int, high: int, default: int) -> int:
    value = message.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise UserError(f"'{name}' must be a whole number")
    if not low <= value <= high:
        raise UserError(f"'{name}' is {value}, but must be {low} to {high}")
    return value


def one_of(message: Mapping[str, Any], name: str, choices: Sequence[str], default: str) -> str:
    value = message.get(name, default)
    if not isinstance(value, str) or value not in choices:
        raise UserError(f"'{name}' must be one of {', '.join(choices)}")
    return value


def entries(message: Mapping[str, Any], name: str, most: int) -> list[Any]:
    value = message.get(name) or []
    if not isinstance(value, list):
        raise UserError(f"'{name}' must be a list")
    if len(value) > most:
        raise UserError(f"'{name}' has {len(value)} entries, but at most {most} are allowed")
    return value


def record(value: Any, name: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise UserError(f"'{name}' must be an object")
    return value


def points_of(message: Mapping[str, Any], name: str, least: int, grid: Grid) -> Array:
    """Places on the terrain model, converted from metres from its south-west corner to world coordinates; shape (n,
    2).
    """
    pairs = entries(message, name, MOST_VERTICES)
    west, south, east, north = grid.bounds
    if len(pairs) < least:
        raise UserError(f"'{name}' needs at least {least} points")
    found = []
    for pair in pairs:
        if not isinstance(pair, list) or len(pair) != 2:
            raise UserError(f"'{name}' must be a list of points, each of two numbers")
        x, y = checked(pair[0], name, -1e7, 1e7), checked(pair[1], name, -1e7, 1e7)
        if not (0.0 <= x <= east - west and 0.0 <= y <= north - south):
            raise UserError(f"a point of '{name}' lies off the terrain model")
        found.append((west + x, south + y))
    return np.array(found)


def question_of(message: Mapping[str, Any], defaults: Defaults, grid: Grid) -> Question:
    """The request in a message to release logs."""
    shape = record(message.get("shape"), "shape")
    radius = 0.0
    if "circle" in shape:
        x, y, radius = (*entries(shape, "circle", 3), None, None, None)[:3]
        radius = checked(radius, "circle", 0.0, MOST_RADIUS_M)
        area: Any = shapely.Point(points_of({"circle": [[x, y]]}, "circle", 1, grid)[0])
    elif "polygon" in shape:
        area = shapely.Polygon(points_of(shape, "polygon", 3, grid))
        if not area.is_valid or area.area <= 0.0:
            raise UserError("the polygon crosses itself or has no area; draw it again")
    else:
        raise UserError("'shape' must be a circle or a polygon")
    friction = message.get("friction")
    n = whole_in(message, "n", 1, MOST_LOGS, 300)
    return Question(
        area=area,
        radius_m=radius,
        n=min(n, PREVIEW) if message.get("preview") else n,
        seed=whole_in(message, "seed", 0, 2**53, defaults.seed),
        fidelity=one_of(message, "fidelity", tuple(FIDELITIES), defaults.fidelity),
        friction=defaults.friction if friction is None else checked(friction, "friction", 0.0, MOST_FRICTION),
        rolling_friction=number_in(message, "rolling_friction", 0.0, MOST_ROLLING, defaults.rolling_friction),
        restitution=number_in(message, "restitution", 0.0, 1.0, defaults.restitution),
        sizes=sizes_of(record(message.get("logs") or {}, "logs"), defaults.sizes),
        number=message.get("id"),
    )


def sizes_of(message: Mapping[str, Any], defaults: Sizes) -> Sizes:
    def between(name: str, limits: tuple[float, float], unit: float) -> tuple[float, float]:
        pair = message.get(name, list(getattr(defaults, name)))
        if not isinstance(pair, list) or len(pair) != 2:
            raise UserError(f"'{name}' must be two numbers, the smallest and the largest")
        column = RELEASES.column(name)
        low, high = max(column.least or 0.0, unit * limits[0]), min(column.maximum or math.inf, unit * limits[1])
        least, most = (checked(each, name, low, high) for each in pair)
        if least > most:
            raise UserError(f"'{name}' goes from {least:g} down to {most:g}; give the smallest first")
        return least, most

    return Sizes(
        between("dbh_cm", DIAMETER, 100.0),
        between("length_m", LENGTH, 1.0),
        number_in(message, "density_kg_m3", DENSITY[0], min(DENSITY[1], DENSITY_KG_M3), defaults.density_kg_m3),
        one_of(message, "orientation", ORIENTATIONS, defaults.orientation),
    )


def changes_of(message: Mapping[str, Any], trees: int, grid: Grid) -> Changes:
    """The complete set of changes; an empty one means the scene as it was read."""
    fell = entries(message, "fell", MOST_FELLED)
    if any(isinstance(each, bool) or not isinstance(each, int) or not 0 <= each < trees for each in fell):
        raise UserError(
            f"'fell' must hold numbers of trees, 0 to {trees - 1}" if trees else "there are no trees to fell"
        )
    planted = [planted_of(record(each, "plant"), grid) for each in entries(message, "plant", MOST_DRAWN)]
    return Changes(
        np.unique(np.array(fell, np.int64)),
        np.array(planted, np.float64).reshape(-1, 4),
        tuple(drawn_of(each, "barriers", BARRIERS.column("height_m"), grid) for each in drawn_in(message, "barriers")),
        tuple(
            drawn_of(each, "lying_logs", LYING_LOGS.column("diameter_cm"), grid)
            for each in drawn_in(message, "lying_logs")
        ),
    )


def drawn_in(message: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    return [record(each, name) for each in entries(message, name, MOST_DRAWN)]


def planted_of(tree: Mapping[str, Any], grid: Grid) -> tuple[float, float, float, float]:
    x, y = points_of({"plant": [[tree.get("x"), tree.get("y")]]}, "plant", 1, grid)[0]
    if not grid.contains(x, y):
        raise UserError("a planted tree stands where the terrain model has no height; plant it elsewhere")
    height = TREES.column("height_m")
    return x, y, size_of(tree, TREES.column("dbh_cm")), size_of(tree, height)


def drawn_of(thing: Mapping[str, Any], what: str, column: Column, grid: Grid) -> Drawn:
    points = points_of(thing, "points", 2, grid)
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    if length <= 0.0:
        raise UserError(f"a line of '{what}' has no length; draw it again")
    if what == "lying_logs" and length > LONGEST_LYING_M:
        raise UserError(f"a lying log is {length:.0f} m long, but at most {LONGEST_LYING_M:g} m are allowed")
    return Drawn(points, size_of(thing, column))


def size_of(thing: Mapping[str, Any], column: Column) -> float:
    """A size within the bounds of its layer's column."""
    low = column.least if column.least is not None else max(column.minimum or 0.0, DBH_CM[0] / 100.0)
    return number_in(thing, column.name, low, column.maximum or math.inf)
