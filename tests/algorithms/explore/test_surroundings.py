"""Of a large terrain model, explore reads the surroundings of the layers; its answers there are those on the whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from explore_case import COLUMNS, LOGS, ROWS, write_case
from slope_case import NORTH

from deadwood_algorithms.explore import surroundings
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.explore.session import Session
from deadwood_algorithms.explore.surroundings import part_to_explore
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene import layers as scene_from_layers
from deadwood_algorithms.simulate.simulation import open_simulation
from deadwood_algorithms.simulate.windows import scene_on
from deadwood_algorithms.tools import explore
from deadwood_engine import FIDELITIES

AROUND = 60.0
# of (40..70, 90..92) m: 60 m to its sides, as far as there are cells, from the node before y = 30 m, at 29.5 m
NEAR_BARRIER = Part(0, 29, 131, 123)


@pytest.fixture
def layers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A slope that counts as large, of which two of the layers fill more than may be read."""
    monkeypatch.setattr(surroundings, "WHOLE_CELLS", NEAR_BARRIER.cells)
    monkeypatch.setattr(surroundings, "AROUND_M", AROUND)
    monkeypatch.setattr(scene_from_layers, "WHOLE_CELLS", 100)
    return write_case(tmp_path)


def part_of(given: dict[str, str], said: Any) -> Part | None:
    ask = explore.TOOL.ask_from(given)
    with open_simulation(ask.inputs(), FIDELITIES[ask.fidelity], Where(1), said) as simulation:
        return part_to_explore(simulation, said)


def test_the_part_is_around_the_layers_and_those_that_are_farther_apart_are_named(layers, said):
    only = {name: layers[name] for name in ("dem", "barriers")}
    found = part_of(only, said)
    assert found is not None
    assert (found.column, found.row) == (NEAR_BARRIER.column, NEAR_BARRIER.row)
    assert abs(found.columns - NEAR_BARRIER.columns) <= 1
    assert abs(found.rows - NEAR_BARRIER.rows) <= 1
    assert said.notes[-1].endswith("a log that leaves this part counts as having left the terrain model")
    assert part_of({name: layers[name] for name in ("dem", "barriers", "trees", "lines")}, said) == found
    assert said.notes[-1].endswith("; lines and trees extend farther, and are used only as far as they lie within")


def test_layers_that_fit_together_are_all_in_it(layers, said, monkeypatch):
    monkeypatch.setattr(surroundings, "WHOLE_CELLS", ROWS * COLUMNS - 1)
    monkeypatch.setattr(surroundings, "AROUND_M", 5.0)
    found = part_of({name: layers[name] for name in ("dem", "barriers", "lying_logs", "blocks")}, said)
    assert found is not None
    assert (found.column, found.row) == (34, 84)  # the nodes before the barrier's west and south, 35 and 85 m
    assert abs(found.column + found.columns - 125) <= 2  # a block's east and north
    assert abs(found.row + found.rows - 155) <= 2
    assert "farther apart" not in said.notes[-1]


def test_without_a_layer_or_on_a_small_one_all_of_it_is_read(layers, said, monkeypatch):
    assert part_of({"dem": layers["dem"]}, said) is None
    assert "is read completely; with --trees or --lines only 60 m around them are read" in said.notes[-1]
    monkeypatch.setattr(surroundings, "WHOLE_CELLS", ROWS * COLUMNS)
    said.notes.clear()
    assert part_of(layers, said) is None
    assert said.notes == []


def answers(session: Session) -> list[Frame]:
    """The logs of one place of the slope, then the same with trees felled and a barrier drawn."""
    south = session.layers.dem.bounds[1] - NORTH
    barrier = {"points": [[40.0, 120.0 - south], [80.0, 121.0 - south]], "height_m": 2.0}
    frames: list[Frame] = []
    circle = {"circle": [60.0, 130.0 - south, 8.0]}
    session.release({"op": "release", "id": 1, "shape": circle, "n": 130, "logs": LOGS}, frames.append, lambda: False)
    before = frames[-1]
    session.edit(
        {"op": "edit", "id": 2, "fell": [*range(0, 220, 5)], "barriers": [barrier]}, frames.append, lambda: False
    )
    return [
        replace(each, arrays={**each.arrays, "deposits_y": each.arrays["deposits_y"] + np.float32(south)})
        for each in (before, frames[-1])
    ]


def test_the_answer_there_is_that_on_the_whole(layers, said):
    """For logs that stay there: with trees, some of them outside, felled and a barrier drawn."""
    ask = explore.TOOL.ask_from({**layers, "friction": 0.6, "time_limit_s": 60.0})
    with open_simulation(ask.inputs(), FIDELITIES[ask.fidelity], Where(2), said) as simulation:
        part = part_to_explore(simulation, said)
        assert part is not None
        scenes = [scene_on(simulation, each, said) for each in (part, None)]
        assert scenes[0].dem.shape == (part.rows, part.columns)
        here, whole = (
            answers(Session(simulation, scene, explore.defaults_of(ask, scene.friction))) for scene in scenes
        )
    for one, other in zip(here, whole, strict=True):
        for name in ("reach", "lines", "holders", "stopped"):
            assert one.facts.get(name) == other.facts.get(name), name
        assert np.array_equal(one.arrays["deposits_reason"], other.arrays["deposits_reason"])
        for name in ("deposits_x", "deposits_y"):
            assert np.abs(one.arrays[name] - other.arrays[name]).max() < 1e-4  # m, in float32
    assert len(set(whole[0].arrays["deposits_reason"].tolist())) > 1
    assert not np.array_equal(whole[0].arrays["deposits_y"], whole[1].arrays["deposits_y"])
