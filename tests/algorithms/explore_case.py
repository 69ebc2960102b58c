"""A session on a small rough slope with all layers, and what it answers: shared by the tests of `explore`."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import shapely
from rasterio.transform import from_origin
from slope_case import EAST, NORTH, points, write_layer

from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.explore.session import Session
from deadwood_algorithms.files.accounts import accounting
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.simulate.simulation import open_simulation
from deadwood_algorithms.simulate.windows import scene_on
from deadwood_algorithms.tools import explore
from deadwood_engine import FIDELITIES

COLUMNS, ROWS = 180, 260  # of 1 m: the foot is flat for 60 m, above it 34 degrees
LOGS = {"dbh_cm": [30, 60], "length_m": [6, 14], "orientation": "random-lying"}
CIRCLE = {"circle": [90.0, 190.0, 12.0]}


def write_slope(path: Path) -> str:
    rng = np.random.default_rng(3)
    y = np.arange(ROWS)[::-1, None] + 0.5
    x = np.arange(COLUMNS)[None, :] + 0.5
    heights = 800.0 + np.tan(np.radians(34.0)) * np.maximum(y - 60.0, 0.0) + 1.5 * np.sin(x / 11.0) * np.cos(y / 17.0)
    heights = heights + 0.1 * rng.standard_normal(heights.shape)
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "nodata": -9999.0, "crs": "EPSG:2056"}
    place = from_origin(EAST, NORTH + ROWS, 1.0, 1.0)
    with rasterio.open(path, "w", height=ROWS, width=COLUMNS, transform=place, **facts) as made:
        made.write(heights.astype("float32"), 1)
    return str(path)


def write_case(folder: Path) -> dict[str, str]:
    """The layers, by the name of their parameter."""
    rng = np.random.default_rng(8)
    stems = [(4.0 + 172.0 * a, 66.0 + 150.0 * b) for a, b in rng.random((220, 2))]
    return {
        "dem": write_slope(folder / "dem.tif"),
        "trees": write_layer(
            folder / "trees.gpkg",
            points(*stems),
            tree_id=np.arange(220) + 500,
            dbh_cm=rng.uniform(20.0, 60.0, 220),
            height_m=rng.uniform(12.0, 30.0, 220),
            species=["spruce", "beech"] * 110,
        ),
        "barriers": write_layer(
            folder / "barriers.gpkg",
            [shapely.LineString([(40.0, 90.0), (70.0, 92.0)])],
            barrier_id=[7],
            height_m=[1.5],
        ),
        "lying_logs": write_layer(
            folder / "lying_logs.gpkg",
            [shapely.LineString([(100.0, 120.0), (112.0, 118.0)])],
            lying_id=["a"],
            diameter_cm=[45.0],
        ),
        "blocks": write_layer(folder / "blocks.gpkg", points((80.0, 150.0), (120.0, 140.0)), diameter_m=[2.0, 1.4]),
        "lines": write_layer(
            folder / "lines.gpkg",
            [shapely.LineString([(0.5, 40.0), (179.5, 42.0)]), shapely.box(60.0, 45.0, 90.0, 55.0)],
            line_id=["road", "house"],
        ),
    }


@dataclass
class Asked:
    """A session, and the frames that it has answered with."""

    session: Session
    ask: explore.Ask
    accounts: dict[str, Any] = field(default_factory=dict)
    frames: list[Frame] = field(default_factory=list)

    def release(self, stale: Callable[[], bool] = lambda: False, **changes: Any) -> Frame:
        message = {"op": "release", "id": 1, "shape": CIRCLE, "n": 130, "logs": LOGS} | changes
        return self._told(lambda: self.session.release(message, self.frames.append, stale))

    def edit(self, stale: Callable[[], bool] = lambda: False, **changes: Any) -> Frame:
        message = {"op": "edit", "id": 2} | changes
        return self._told(lambda: self.session.edit(message, self.frames.append, stale))

    def keep(self, name: Any, slide: Any = None, *, run_too: bool = True) -> Frame:
        answer = self.session.answer
        assert answer is not None
        keeper = explore.keeper_of(self.ask, Quiet(), self.accounts)
        keeper = replace(keeper, slide=slide) if slide else keeper
        return keeper.keep(self.session.layers, answer.question, answer.changes, name, run_too)

    def _told(self, work: Callable[[], None]) -> Frame:
        self.frames.clear()
        work()
        return self.frames[-1] if self.frames else Frame({})


@contextlib.contextmanager
def opened(layers: dict[str, str], **values: Any) -> Iterator[Asked]:
    ask = explore.TOOL.ask_from({**layers, "time_limit_s": 60.0, **values})
    where = Where(2)
    with open_simulation(ask.inputs(), FIDELITIES[ask.fidelity], where, Quiet()) as simulation, accounting() as said:
        scene = scene_on(simulation, None, Quiet())
        yield Asked(Session(simulation, scene, explore.defaults_of(ask, scene.friction)), ask, said)


def whole_picture(frame: Frame, rows: int = ROWS, columns: int = COLUMNS) -> np.ndarray:
    """The hits of a frame on all cells, row 0 in the north."""
    grid = np.zeros((rows, columns), np.int64)
    hits = frame.arrays.get("hits", frame.arrays.get("hits_after"))
    assert hits is not None
    column, row = frame.facts["at"]
    grid[row : row + hits.shape[0], column : column + hits.shape[1]] = hits
    return grid


def assert_same_answer(one: Frame, other: Frame) -> None:
    """Everything in an answer, but for how many logs were slid again and how long that took."""
    apart = {"ms", "concerned"}
    assert {k: v for k, v in one.facts.items() if k not in apart} == {
        k: v for k, v in other.facts.items() if k not in apart
    }
    assert one.arrays.keys() == other.arrays.keys()
    for name, each in one.arrays.items():
        assert each.dtype == other.arrays[name].dtype
        assert np.array_equal(each, other.arrays[name]), name
