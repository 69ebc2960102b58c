"""The kind of a slope is found from the scene alone, on ground whose ingredients are known."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.scene.slope_kind import KINDS, kind_of
from deadwood_engine import Barriers, Logs, Scene, Trees

RNG = np.random.default_rng(1)
CELL, NX, NY = 0.5, 240, 400
X, Y = np.meshgrid((np.arange(NX) + 0.5) * CELL, (np.arange(NY) + 0.5) * CELL)


def scene_of(heights=None, *, cell=CELL, angle=0.0, **layers) -> Scene:
    """A plane of 35 degrees that falls to the south, turned by an angle, plus heights."""
    y, x = np.indices((NY, NX)) * cell
    plane = 0.7 * (y * np.cos(angle) + x * np.sin(angle))
    return Scene.prepare(plane + (0.0 if heights is None else heights), cell, 0.25, 0.25, friction=0.3, **layers)


def logs_at(x: float = 60.0, y: float = 150.0) -> Logs:
    return Logs.alike(np.full(3, x), np.full(3, y))


def trees_of(count: int) -> Trees:
    return Trees(RNG.uniform(5, 115, count), RNG.uniform(5, 195, count), np.full(count, 0.3), np.full(count, 20.0))


@pytest.mark.parametrize("cell", [0.25, 0.5, 2.0])
@pytest.mark.parametrize("noise", [0.0, 0.03, 0.12])
def test_noise_over_cell_is_that_of_the_heights(noise, cell):
    found = kind_of(scene_of(noise * RNG.standard_normal((NY, NX)), cell=cell), logs_at(30.0, 60.0))
    assert found.noise_over_cell == pytest.approx(noise / cell, rel=0.03, abs=1e-4)
    assert found.words.endswith("rough ground") == (noise / cell >= 0.15)
    assert found.words in KINDS


def test_waves_of_some_metres_are_not_noise():
    waves = 0.3 * np.sin(2 * np.pi * X / 9.0) * np.sin(2 * np.pi * Y / 11.0)
    assert kind_of(scene_of(waves), logs_at()).noise_over_cell < 0.02


@pytest.mark.parametrize("angle", [0.0, 0.4, 0.8])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_channel_down_the_slope_is_found_in_any_direction_and_one_across_is_none(angle, noise):
    x, y = X - 60.0, Y - 100.0
    across = x * np.cos(angle) - y * np.sin(angle)  # distance from the fall line through the middle
    rough = noise * RNG.standard_normal((NY, NX))
    channel = -np.maximum(0.0, 2.0 - 0.6 * np.abs(across))
    assert kind_of(scene_of(channel + rough, angle=angle), logs_at()).name == "channels"
    assert kind_of(scene_of(rough, angle=angle), logs_at()).name == "open"
    along = x * np.sin(angle) + y * np.cos(angle)
    bench = -np.maximum(0.0, 2.0 - 0.6 * np.abs(along))
    assert kind_of(scene_of(bench + rough, angle=angle), logs_at()).name == "open"


def test_obstacles_and_stems_count_and_a_channel_comes_first():
    fence = Barriers(np.array([[40.0, 80.0], [80.0, 80.0]]), np.array([0, 2]), np.array([2.0]))
    channel = -np.maximum(0.0, 2.0 - 0.6 * np.abs(X - 60.0))
    assert kind_of(scene_of(trees=trees_of(240)), logs_at()).name == "forest"  # 100/ha
    assert kind_of(scene_of(trees=trees_of(24)), logs_at()).name == "open"
    assert kind_of(scene_of(trees=trees_of(240), barriers=fence), logs_at()).name == "structures"
    assert kind_of(scene_of(channel, trees=trees_of(240), barriers=fence), logs_at()).name == "channels"


def test_ground_far_from_the_releases_does_not_count():
    far = np.where(Y < 40.0, 0.1 * RNG.standard_normal((NY, NX)) - np.maximum(0.0, 2.0 - 0.6 * np.abs(X - 60.0)), 0.0)
    near, below = kind_of(scene_of(far), logs_at(60.0, 190.0)), kind_of(scene_of(far), logs_at(60.0, 20.0))
    assert (near.words, near.noise_over_cell) == ("open", 0.0)
    assert below.name == "channels"


def test_a_scene_without_steep_ground_is_open():
    flat = Scene.prepare(np.zeros((50, 50)), 1.0, 0.5, 0.5, friction=0.3)
    assert kind_of(flat, logs_at(25.0, 25.0)).words == "open"
