"""Contacts with the terrain by themselves: whether what touches is found, and where."""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Logs, Scene, place_logs
from deadwood_engine.contacts import CONTACT, KEY_WIDTH, Ahead
from deadwood_engine.crests import Nodes, crest
from deadwood_engine.fidelity import station_spacing
from deadwood_engine.limits import SLOW
from deadwood_engine.log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS, cone_bodies
from deadwood_engine.logs import stations_for
from deadwood_engine.model import Log
from deadwood_engine.ring_look import LOOK_ROOM, ring_table
from deadwood_engine.rings import CANDIDATES, terrain_contacts
from deadwood_engine.rotation import VX
from deadwood_engine.surroundings import POSE
from deadwood_engine.terrain import prepare

pytestmark = pytest.mark.engine_alone

CELL = 0.5  # [m]
DEPTH = 0.005  # [m] of the deepest place of a log in the ground


class Settings(NamedTuple):
    """Of the engine's ``Settings``, what rings need; likewise the next two."""

    ring_points: int


class Model(NamedTuple):
    terrain: Any
    settings: Settings


class Scratch(NamedTuple):
    trial: Any
    rings: Any
    look: Any
    contacts: Any
    keys: Any


def gaps_of(heights, points):
    """Gap [m] along the ground's normal at places (n, 3) in the frame of node (0, 0); bilinear, in plain NumPy."""
    u, v = points[:, 0] / CELL, points[:, 1] / CELL
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    u, v = u - i, v - j
    h00, h10, h01, h11 = heights[j, i], heights[j, i + 1], heights[j + 1, i], heights[j + 1, i + 1]
    twist = h11 - h10 - h01 + h00
    gx, gy = (h10 - h00 + twist * v) / CELL, (h01 - h00 + twist * u) / CELL
    height = h00 + (h10 - h00) * u + (h01 - h00) * v + twist * u * v
    return (points[:, 2] - height) / np.sqrt(1.0 + gx**2 + gy**2)


def slope(waves=((2.0, 0.05), (5.0, 0.12), (14.0, 0.40)), side=240):
    """A rough slope of 35 degrees, cells of 0.5 m; waves of (length, standard deviation) [m]."""
    rng = np.random.default_rng(5)
    y, x = CELL * np.mgrid[0:side, 0:side]
    heights = 0.7 * y
    for length, size in waves:
        for turn, phase in zip(rng.uniform(0, np.pi, 12), rng.uniform(0, 2 * np.pi, 12), strict=True):
            way = 2 * np.pi / length * (np.cos(turn) * x + np.sin(turn) * y)
            heights = heights + size * math.sqrt(2 / 12) * np.sin(way + phase)
    return Scene.prepare(heights, CELL, 0.0, 0.0, friction=0.3)


def poses(number):
    """The slope, and logs on it, tilted at random, whose side or end is DEPTH deep in it."""
    rng = np.random.default_rng(5)
    scene = slope()
    logs = Logs.alike(
        rng.uniform(40, 80, number), rng.uniform(40, 80, number), orientation=1,
        azimuth=rng.uniform(0, 2 * np.pi, number), diameter=rng.uniform(0.3, 0.8, number),
        length=rng.uniform(8, 30, number),
    )  # fmt: skip
    start = place_logs(scene, logs)
    terrain = scene.arrays.terrain
    angle = np.linspace(0.0, 2 * np.pi, 96, endpoint=False)
    found = []
    for frame, state, body in zip(start.frame, start.state, start.body, strict=True):
        axis = state[13:16] + rng.normal(0, 0.05, 3)
        state[13:16] = axis = axis / np.linalg.norm(axis)
        lateral = np.cross(axis, [0.0, 0.0, 1.0])
        lateral /= np.linalg.norm(lateral)
        along = np.linspace(0.0, body[LENGTH], int(body[LENGTH] / 0.02))
        radius = body[BASE_RADIUS] + (body[TIP_RADIUS] - body[BASE_RADIUS]) * along / body[LENGTH]
        ring = np.cos(angle)[:, None] * lateral + np.sin(angle)[:, None] * np.cross(axis, lateral)
        points = (along - body[CENTRE])[:, None, None] * axis + radius[:, None, None] * ring
        points = points.reshape(-1, 3)
        window = terrain.heights.astype(float)[frame[1] - 70 : frame[1] + 72, frame[0] - 70 : frame[0] + 72]
        shift = np.array([70 * CELL, 70 * CELL, 0.0])
        gaps = gaps_of(window, points + state[:3] + shift)
        while abs(gaps.min() + DEPTH) > 1e-4:
            state[2] -= 1.05 * (gaps.min() + DEPTH)
            gaps = gaps_of(window, points + state[:3] + shift)
        where = along[gaps.argmin() // len(angle)]
        found.append((frame, state, body, 0.0 < where < body[LENGTH]))
    return terrain, found


def found_in(terrain, frame, state, body, fidelity, speed=2.0 * SLOW):
    """Contacts that rings and crests find where the log is, at a speed [m/s], and the depth of the deepest [m]."""
    state = state.copy()
    state[VX] = speed
    stations = int(stations_for(body[LENGTH : LENGTH + 1], station_spacing(fidelity, terrain.cell))[0])
    table = np.zeros(2 * CANDIDATES * stations, CONTACT).view(np.recarray)
    keys = np.zeros((2 * CANDIDATES * stations, KEY_WIDTH), np.int64)
    step = Ahead(1e-9, 9.81, 1e-9, 0.0, -1.0, 0.0)
    pose = np.array([(*state[13:16], *state[:3])], POSE).view(np.recarray)
    scratch = Scratch(pose, ring_table(stations), np.zeros(LOOK_ROOM), table, keys)
    model = Model(terrain, Settings(fidelity.ring_points))
    count, _ = terrain_contacts(model, Log(frame, body, stations), state, scratch, step)
    return count, -table[:count]["gap"].min() if count else 0.0


@pytest.fixture(scope="module")
def rough():
    return poses(1000)


@pytest.mark.parametrize(
    ("name", "speed", "missed_most", "shallow_most"),
    [("standard", 2.0 * SLOW, 0.02, 0.04), ("draft", 2.0 * SLOW, 0.08, 0.1), ("draft", 0.5 * SLOW, 0.02, 0.04)],
)
def test_what_is_in_the_ground_is_found(rough, name, speed, missed_most, shallow_most):
    """Every place of the log, 2 cm by 4 degrees apart, against what the rings and crests find.

    A side between two rings may still be missed: a second crest of the same stretch, a twisted cell without a grid
    line that shows it. Measured with three times the poses: not found at all at standard 1.5 %, found less than half as
    deep 3 %; at draft 7 and 9 %, of slow logs as at standard. Before rings that are passed over took into account how
    far their stretch of a tilted side comes down, and crests were sought between grid lines, it was 8 and 13 %, and 38
    and 42 %.
    """
    fidelity = FIDELITIES[name]
    terrain, found = rough
    sides, missed, shallow, ends = 0, 0, 0, 0
    for frame, state, body, side in found:
        count, depth = found_in(terrain, frame, state, body, fidelity, speed)
        assert depth < DEPTH + 2e-3  # a crest with flanks of 0.2 may lie 1 cm from the places searched
        sides += side
        missed += side and count == 0
        shallow += side and depth < 0.5 * DEPTH
        ends += not side and count == 0
    assert 350 < sides < 550
    assert ends <= 2  # between the points of a rim
    assert missed / sides <= missed_most
    assert shallow / sides <= shallow_most


@pytest.mark.parametrize("name", list(FIDELITIES))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_rim_on_two_cells_touches_both(name, side):
    """The end of a steep log over a kink: 1 mm deep in level ground, and 5 mm in the slope of 0.2 beside it.

    The rim's deepest points against both planes are 0.23 radii apart. Taken for one contact, the first was kept.
    """
    x = CELL * np.arange(40)
    heights = np.maximum(0.0, 0.2 * side * (x - 10.0))[None, :] * np.ones((40, 1))
    terrain = prepare(heights, CELL, 0.0, 0.0, 0.3, reference=0.0)
    tilt, radius = np.radians(30.0), 0.3
    body = cone_bodies(np.array([2 * radius]), np.array([12.0]), np.array([300.0]))[0]
    axis = np.array([0.0, np.cos(tilt), np.sin(tilt)])
    normal = np.array([-0.2 * side, 0.0, 1.0]) / np.sqrt(1.04)
    high = radius * np.cos(tilt) - 0.001
    deep = radius * np.sqrt(1.0 - (normal @ axis) ** 2) - 0.005
    end = np.array([10.0 + (deep - normal[2] * high) / normal[0], 10.1, high])
    state = np.zeros(16)
    state[:3], state[13:16] = end + body[CENTRE] * axis, axis
    count, depth = found_in(terrain, np.zeros(2, np.int64), state, body, FIDELITIES[name])
    assert count == 2
    assert depth == pytest.approx(0.005, abs=1e-6)


def test_crest_of_a_twisted_cell():
    """Over the diagonal of a cell with corners 0, b, b, 0 the ground is 2 b t (1 - t): highest in the middle."""
    heights = np.zeros((12, 12))
    heights[5, 6] = heights[6, 5] = 0.2
    heights[4, 4], heights[4, 5], heights[5, 4] = -1.0, -0.5, -0.5  # before it the ground falls away
    terrain = prepare(heights, 1.0, 0.0, 0.0, 0.3, reference=0.0)
    way = math.sqrt(0.5)
    nodes = Nodes(terrain.heights, 1.0, 1.0, 0, 0)
    found, t, ex, ey, ez, gap, sx, sy = crest(
        nodes, (4.9, 4.9, 0.38), (way, way, 0.0), (0.0, 0.0, -0.3), (0.3, 0.0), (-1.0, 1.0), 0.18
    )
    assert found
    assert t == pytest.approx(0.6 / way, abs=1e-7)  # heights are float32
    assert gap == pytest.approx(0.38 - 0.3 - 0.1, abs=1e-7)
    assert (ex, ey, ez) == pytest.approx((0.0, 0.0, -0.3))
    assert (sx, sy) == pytest.approx((0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("turn", [0.2, 0.5, 1.1])
def test_crest_is_a_peak(turn):
    """A side over a peak touches it there, not the flank that one of its grid lines makes."""
    heights = np.zeros((12, 12))
    heights[5, 5] = 0.5
    terrain = prepare(heights, 1.0, 0.0, 0.0, 0.3, reference=0.0)
    qx, qy = math.cos(turn), math.sin(turn)
    nodes, c = Nodes(terrain.heights, 1.0, 1.0, 0, 0), (5.0 - 0.3 * qx, 5.0 - 0.3 * qy, 0.78)
    found, t, *_, gap, _, _ = crest(nodes, c, (qx, qy, 0.0), (0.0, 0.0, -0.3), (0.3, 0.0), (-0.5, 0.5), 0.2)
    assert found
    assert t == pytest.approx(0.3, abs=0.01)
    assert gap <= -0.02 + 1e-7
