"""Random scenes, searched by hypothesis for one that breaks what every scene must keep.

Small DEMs with noise, cliffs, ridges and holes; stems, plates, lying logs and boulders anywhere, in one another and in
the log; logs of all sizes, thrown and spinning. Each failure that hypothesis finds it also shrinks, and prints as a
call to repeat.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from deadwood_engine import (
    FIDELITIES,
    Barriers,
    Blocks,
    Logs,
    LyingLogs,
    Rasters,
    Scene,
    Start,
    Trees,
    place_logs,
    slide,
)


def reals(low: float, high: float):
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


# A scene and its logs as a few numbers, which is what hypothesis varies, shrinks and prints.
RECIPES = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "cell": st.sampled_from([1.0, 0.5, 0.1, 5.0, 25.0]),
        "degrees": reals(0, 80),
        "noise": st.sampled_from([0.0, 0.1, 0.5, 2.0]),
        "shapes": st.lists(st.sampled_from(["cliff", "ridge", "gully", "spikes", "hole", "holes"]), max_size=3),
        "size": st.sampled_from([0.5, 5.0, 100.0]),
        "stems": st.sampled_from([0, 1, 5, 40]),
        "plates": st.sampled_from([0, 1, 3]),
        "lying": st.sampled_from([0, 1, 3]),
        "boulders": st.sampled_from([0, 1, 20]),
        "friction": st.sampled_from([0.25, 0.0, 0.1, 0.8, 2.0, 100.0]),
        "logs": st.integers(1, 3),
        "length": reals(0.5, 60.0),
        "slenderness": st.sampled_from([20.0, 0.3, 2.0, 100.0, 1000.0]),
        "drop": st.sampled_from([0.0, 3.0]),
        "speed": st.sampled_from([0.0, 1.0, 30.0]),
        "turn": st.sampled_from([0.0, 0.1, 1.0]),
        "spin": st.sampled_from([0.0, 30.0, 1000.0]),
    }
)


def heights_of(recipe: dict, rng: np.random.Generator) -> np.ndarray:
    """24 x 24 heights: a tilted plane with noise, and cliffs, ridges, gullies, spikes and holes."""
    number, cell = 24, recipe["cell"]
    heights = np.tan(np.radians(recipe["degrees"])) * cell * np.arange(number)[:, None] * np.ones(number)
    heights += recipe["noise"] * cell * rng.random((number, number))
    for shape in recipe["shapes"]:
        at, size = int(rng.integers(2, number - 2)), cell * recipe["size"]
        if shape == "cliff":
            heights[at:] += size
        elif shape == "ridge":
            heights[:, at] += size
        elif shape == "gully":
            heights[:, at] -= size
        elif shape == "spikes":
            heights[tuple(rng.integers(0, number, (2, 5)))] += size
        elif shape == "hole":
            heights[at : at + 3, at - 2 : at + 2] = np.nan
        else:
            heights[tuple(rng.integers(0, number, (2, 20)))] = np.nan
    return heights


def build(recipe: dict) -> tuple[Scene, Start]:
    """The scene of a recipe, and its logs in any attitude and motion (none where there is no ground for them)."""
    rng = np.random.default_rng(recipe["seed"])
    cell, stems, plates = recipe["cell"], recipe["stems"], recipe["plates"]
    size = 23 * cell
    trees = Trees(
        rng.uniform(-0.1, 1.1, stems) * size, rng.uniform(-0.1, 1.1, stems) * size,
        10 ** rng.uniform(-2, 0.3, stems), 10 ** rng.uniform(-0.5, 1.6, stems),
    )  # fmt: skip
    barriers = Barriers(
        rng.uniform(-0.1, 1.1, (3 * plates, 2)) * size, 3 * np.arange(plates + 1), 10 ** rng.uniform(-0.5, 1, plates)
    )
    heights = heights_of(recipe, rng)
    things = np.random.default_rng(recipe["seed"] + 1)
    lying, boulders = recipe["lying"], recipe["boulders"]
    thick = 10 ** things.uniform(-1.5, 0.2, lying)
    logs_in_the_way = LyingLogs(
        things.uniform(-0.1, 1.1, (3 * lying, 2)) * size, 3 * np.arange(lying + 1), thick,
        thick * things.uniform(0.1, 1.0, lying),
    )  # fmt: skip
    east, north = things.uniform(-0.1, 1.1, (2, boulders)) * size
    wide = 10 ** things.uniform(-1, 1, boulders)
    blocks = Blocks(east, north, wide, wide * things.uniform(0.1, 1.0, boulders))
    scene = Scene.prepare(
        heights, cell, 0.0, 0.0, friction=recipe["friction"], trees=trees, barriers=barriers,
        lying_logs=logs_in_the_way, blocks=blocks,
    )  # fmt: skip
    places = rng.uniform(0.05, 0.95, (64, 2)) * size
    places = places[np.isfinite(scene.terrain_height(places[:, 0], places[:, 1]))][: recipe["logs"]]
    length = recipe["length"]
    diameter = min(3.0, max(0.01, length / recipe["slenderness"]))
    number = len(places)
    motion = rng.standard_normal((2, number, 3))
    logs = Logs(
        np.arange(number), places[:, 0], places[:, 1], np.full(number, diameter), np.full(number, length),
        np.full(number, 300.0), rng.integers(0, 3, number).astype(np.int8), rng.uniform(0, np.pi, number),
        rng.uniform(0, 2 * np.pi, number), np.zeros(number), np.full(number, recipe["drop"]),
    )  # fmt: skip
    begin = place_logs(scene, logs)
    begin.state[:, 7:10] = recipe["speed"] * motion[0]
    begin.state[:, 10:13] = recipe["turn"] * motion[1] + recipe["spin"] * begin.state[:, 13:16]
    return scene, begin


SEARCH = settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])


@SEARCH
@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@given(recipe=RECIPES)
def test_nothing_breaks(at, fidelity, recipe):
    """Finite, unit, ended for a reason, no energy gained beyond the scheme's bound, whatever the scene."""
    scene, begin = build(recipe)
    step = FIDELITIES[fidelity].time_step
    result = at.run(scene, begin, fidelity=fidelity, time_limit=0.5 if fidelity == "reference" else 4.0, threads=1)
    at.healthy(scene, begin, result, longest=step)
    assert (result.duration <= 4.0 + 2 * step).all()
    assert ((result.stop_item >= 0) == np.isin(result.stop_reason, (1, 2, 6, 7))).all()


@SEARCH
@given(recipe=RECIPES, restitution=reals(0.0, 1.0))
def test_restitution_breaks_nothing(at, recipe, restitution):
    scene, begin = build(recipe)
    result = at.run(scene, begin, restitution=restitution, time_limit=3.0, threads=1)
    at.healthy(scene, begin, result, gained=0.05)


@SEARCH
@given(recipe=RECIPES)
def test_the_same_bits_again(recipe):
    """Threads, rasters, poses and the order of the logs change nothing; nor does a worker's memory of earlier logs."""
    scene, begin = build(recipe)
    fidelity = FIDELITIES["draft"]
    once = slide(scene, begin, fidelity, time_limit=2.0)
    turned = Start(begin.frame[::-1].copy(), begin.state[::-1].copy(), begin.body[::-1].copy())
    number = len(begin.state)
    again = slide(
        scene, turned, fidelity, time_limit=2.0, threads=3, rasters=Rasters.allocate(scene, 3),
        keep_poses=np.ones(number, bool),
    )  # fmt: skip
    assert np.array_equal(once.last_state, again.last_state[::-1], equal_nan=True)
    assert np.array_equal(once.stop_reason, again.stop_reason[::-1])


# A log in a cage: its size, its room to each side, and any attitude and motion.
SHOTS = st.fixed_dictionaries(
    {
        "length": reals(0.5, 20.0),
        "slenderness": st.sampled_from([20.0, 1.0, 5.0, 100.0, 500.0]),
        "room": reals(1.0, 5.0),
        "tilt": reals(0.3, 1.57),
        "heading": reals(0.0, 6.28),
        "course": reals(0.0, 6.28),
        "speed": st.sampled_from([1.0, 10.0, 100.0]),
        "spin": st.sampled_from([0.0, 50.0]),
        "turn": reals(-5.0, 5.0),
        "friction": st.sampled_from([0.25, 0.0, 1.0]),
    }
)


def caged(at, scene: Scene, shot: dict, fidelity: str):
    """Shoot the log from the middle of its cage, 200 m up and without gravity; returns its poses."""
    solid = at.body(max(0.01, shot["length"] / shot["slenderness"]), shot["length"])
    axis = np.array(
        [
            np.sin(shot["tilt"]) * np.cos(shot["heading"]),
            np.sin(shot["tilt"]) * np.sin(shot["heading"]),
            np.cos(shot["tilt"]),
        ]
    )
    centre = (solid[0, at.CENTRE] - 0.5 * solid[0, at.LENGTH]) * axis + (0, 0, 200.0)
    velocity = shot["speed"] * np.array([np.cos(shot["course"]), np.sin(shot["course"]), 0.0])
    spin = shot["spin"] * axis + np.array([0.0, 0.0, shot["turn"]])
    begin = at.start(scene, solid, axis, centre, velocity, spin)
    keep = np.ones(1, bool)
    result = at.run(scene, begin, fidelity=fidelity, gravity=0.0, time_limit=1.0, threads=1, keep_poses=keep)
    at.healthy(scene, begin, result)
    return result.poses


@SEARCH
@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
@given(shot=SHOTS, stem=reals(0.02, 1.0))
def test_a_ring_of_stems_keeps_its_log(at, fidelity, shot, stem):
    """Stems whose gaps are a tenth of the log's diameter, its thin end being half of it, keep the log inside.

    Its centre never passes the ring; an end stays in it up to a step's travel, 0.3 of the radii of log and stem; with
    draft's long steps up to that along the log's own axis, both radii (``trees.time_beside``).
    """
    diameter = max(0.01, shot["length"] / shot["slenderness"])
    ring = 0.5 * shot["length"] + shot["room"] + stem + diameter
    number = int(np.ceil(2 * np.pi * ring / (stem + 0.1 * diameter)))
    turn = 2 * np.pi * np.arange(number) / number
    trees = at.trees(ring * np.cos(turn), ring * np.sin(turn), stem, 1e5)
    poses = caged(at, at.flat(trees=trees, friction=shot["friction"], size=60.0), shot, fidelity)
    assert np.hypot(poses.position[:, 0], poses.position[:, 1]).max() < ring
    for ends in (poses.base, poses.tip):
        share = 1.0 if fidelity == "draft" else 0.3
        assert np.hypot(ends[:, 0], ends[:, 1]).max() < ring + share * 0.5 * (stem + diameter)


@SEARCH
@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
@given(shot=SHOTS, turn=reals(0.0, 0.78), cell=st.sampled_from([2.0, 0.5, 20.0]))
def test_a_box_of_plates_keeps_its_log(at, fidelity, shot, turn, cell):
    """A closed box of high plates, with corners and joints: no end gets out by more than a step's travel.

    That is 0.3 of the tip's radius beside a plate, a thirteenth of the diameter; 3 cm for thin logs.
    """
    diameter = max(0.01, shot["length"] / shot["slenderness"])
    half = 0.5 * shot["length"] + shot["room"] + diameter
    angle = turn + 0.5 * np.pi * np.arange(5)
    corners = half * np.sqrt(2) * np.column_stack([np.cos(angle), np.sin(angle)])
    scene = at.flat(barriers=at.barrier(*corners, height=1e4), size=60.0, cell=cell, friction=shot["friction"])
    poses = caged(at, scene, shot, fidelity)
    angle = angle[:4] + 0.25 * np.pi
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    for points in (poses.base, poses.tip, poses.position):
        assert (points[:, :2] @ outward.T).max() < half + max(0.03, 0.3 * 0.25 * diameter)


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("kind", ["plates", "stems"])
def test_none_escapes_at_150_metres_a_second(at, fidelity, kind):
    """A hundred logs of 4 to 12 m in a closed box of plates, or a ring of stems with gaps thinner than a log."""
    rng = np.random.default_rng(7)
    half, number, stem = 15.0, 100, 0.5
    if kind == "plates":
        corners = half * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)])
        scene = at.flat(size=40.0, friction=0.3, barriers=at.barrier(*corners, height=1e4))
    else:
        stems = int(np.ceil(2 * np.pi * half / (stem + 0.04)))
        turn = 2 * np.pi * np.arange(stems) / stems
        ring = at.trees(half * np.cos(turn), half * np.sin(turn), stem, 1e5)
        scene = at.flat(size=40.0, friction=0.3, trees=ring)
    starts = []
    for _ in range(number):
        axis = rng.standard_normal(3) * (1.0, 1.0, 0.2)
        course, place = rng.uniform(0, 2 * np.pi), (*rng.uniform(-2, 2, 2), 60.0)
        velocity, spin = (150 * np.cos(course), 150 * np.sin(course), 0.0), 3.0 * rng.standard_normal(3)
        starts.append(at.start(scene, at.body(0.4, rng.uniform(4, 12)), axis, place, velocity, spin))
    begin = at.together(starts)
    options = {"gravity": 0.0, "time_limit": 1.0, "keep_poses": np.ones(number, bool)}
    result = at.run(scene, begin, fidelity=fidelity, **options)
    at.healthy(scene, begin, result, longest=FIDELITIES[fidelity].time_step, gravity=0.0)
    poses = result.poses
    far = [np.abs(each[:, :2]).max() if kind == "plates" else np.hypot(each[:, 0], each[:, 1]).max()
           for each in (poses.position, poses.base, poses.tip)]  # fmt: skip
    assert far[0] > half - 1.0, "no log came to the wall"
    assert far[0] < half
    assert max(far[1:]) < half + 0.05
