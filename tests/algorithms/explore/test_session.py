"""A request slid in batches is one run; the effect of a change is that of sliding everything again."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import shapely
from explore_case import CIRCLE, COLUMNS, LOGS, ROWS, Asked, assert_same_answer, opened, whole_picture, write_case

from deadwood_algorithms.explore.answer import NOWHERE, Answer, Hits, parts_of
from deadwood_algorithms.explore.questions import MOST_LOGS
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats.statistics import paired_interval, wilson_interval
from deadwood_engine import Rasters, slide

CHANGES: list[dict[str, Any]] = [
    {"barriers": [{"points": [[60.0, 130.0], [120.0, 132.0]], "height_m": 3.0}]},
    {
        "plant": [
            {"x": 90.0, "y": 150.0, "dbh_cm": 60.0, "height_m": 25.0},
            {"x": 95.0, "y": 130.0, "dbh_cm": 15.0, "height_m": 0.8},
        ]
    },
    {"lying_logs": [{"points": [[70.0, 140.0], [88.0, 141.0]], "diameter_cm": 70.0}]},
    {
        "fell": list(range(0, 220, 9)),
        "plant": [{"x": 85.0, "y": 145.0, "dbh_cm": 45.0, "height_m": 20.0}],
        "barriers": [{"points": [[80.0, 100.0], [100.0, 104.0], [120.0, 103.0]], "height_m": 2.0}],
        "lying_logs": [{"points": [[60.0, 90.0], [70.0, 99.0]], "diameter_cm": 50.0}],
    },
]


@pytest.fixture(scope="module")
def layers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return write_case(tmp_path_factory.mktemp("explore"))


@pytest.fixture(scope="module")
def warm(layers: dict[str, str]) -> Iterator[Asked]:
    with opened(layers) as asked:
        yield asked


@pytest.fixture
def asked(warm: Asked) -> Asked:
    """The session, without changes and without a request."""
    warm.session.answer = None
    warm.edit()
    return warm


def test_batches_are_one_run_to_the_bit(asked: Asked):
    last = asked.release(n=420)
    assert [frame.facts["done"] for frame in asked.frames] == [30, 100, 300, 420]
    assert [frame.facts["final"] for frame in asked.frames] == [False, False, False, True]
    answer = asked.session.answer
    assert answer is not None
    rasters = Rasters.allocate(answer.layers.scene, 2)
    laws = answer.simulation.laws
    result = slide(answer.layers.scene, answer.start, answer.simulation.fidelity, **laws, threads=2, rasters=rasters)
    assert np.array_equal(whole_picture(last), rasters.totals()["hit_count"][::-1])
    west, south = asked.session.layers.dem.bounds[:2]
    assert np.array_equal(last.arrays["deposits_x"], (result.end_position[:, 0] - west).astype(np.float32))
    assert np.array_equal(last.arrays["deposits_y"], (result.end_position[:, 1] - south).astype(np.float32))
    assert np.array_equal(last.arrays["deposits_reason"], result.stop_reason)
    road = last.facts["reach"][0]
    assert road["n_reach"] == int(result.reach[:, 0].sum()) > 0
    assert (road["ci_low"], road["ci_high"]) == wilson_interval(road["n_reach"], 420)


def test_the_first_logs_of_many_are_those_of_few(asked: Asked):
    few = asked.release(n=100)
    many = asked.release(n=300)
    assert np.array_equal(many.arrays["deposits_x"][:100], few.arrays["deposits_x"])
    assert asked.frames[1].facts["done"] == 100
    assert_same_answer(type(few)({**few.facts, "n": 300, "final": False}, few.arrays), asked.frames[1])


def anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every log of a batch is slid again in the changed scene."""
    monkeypatch.setattr(Answer, "concerned", lambda self, base: np.arange(base.number))


def holders(asked: Asked, number: int) -> list[int]:
    asked.release()
    return [each["tree"] for each in asked.frames[-1].facts["holders"][:number]]


@pytest.mark.parametrize("trees", [1, 3, 12])
def test_felling_by_influences_is_sliding_all_again(asked: Asked, monkeypatch: pytest.MonkeyPatch, trees: int):
    fell = holders(asked, trees)
    some = asked.edit(fell=fell)
    assert 0 < some.facts["concerned"] <= 130
    assert some.facts["concerned"] < 130 or trees > 3
    anew(monkeypatch)
    assert_same_answer(some, asked.edit(fell=fell))


@pytest.mark.parametrize("changes", CHANGES, ids=lambda changes: "+".join(changes))
def test_what_is_added_concerns_only_who_came_near(asked: Asked, monkeypatch: pytest.MonkeyPatch, changes: dict):
    asked.release()
    before = asked.frames[-1]
    some = asked.edit(**changes)
    assert some.facts["concerned"] > 0
    assert not np.array_equal(whole_picture(some), whole_picture(before))
    anew(monkeypatch)
    assert_same_answer(some, asked.edit(**changes))


@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_where_a_first_obstacle_changes_the_rule_of_steps_all_are_slid_again(
    layers: dict[str, str], monkeypatch: pytest.MonkeyPatch, restitution: float
):
    """A scene without any obstacle has no margin to keep, and one without rebounds has longer steps."""
    with opened({name: layers[name] for name in ("dem", "lines")}, barrier_restitution=restitution) as asked:
        asked.release()
        far = {"barriers": [{"points": [[2.0, 20.0], [6.0, 20.0]], "height_m": 1.0}]}
        some = asked.edit(**far)
        assert (some.facts["concerned"] == 130) == (restitution > 0.0)
        anew(monkeypatch)
        assert_same_answer(some, asked.edit(**far))


def test_the_difference_is_paired_and_of_the_same_logs(asked: Asked):
    fell = holders(asked, 6)
    before = asked.session.answer
    assert before is not None
    told = asked.edit(fell=fell)
    base = np.concatenate([each.reach for each in before.base])
    changed = np.concatenate([each.reach for each in before.changed])
    for k, line in enumerate(told.facts["lines"]):
        lost, gained = (base[:, k] & ~changed[:, k]).sum(), (changed[:, k] & ~base[:, k]).sum()
        assert (line["lost"], line["gained"]) == (lost, gained)
        assert line["after"] - line["before"] == gained - lost
        assert (line["ci_low"], line["ci_high"]) == paired_interval(int(lost), int(gained), 130)
        assert line["ci_low"] <= line["difference"] <= line["ci_high"]


def test_undone_is_as_it_was(asked: Asked):
    before = asked.release()
    asked.edit(**CHANGES[3])
    after = asked.edit()
    assert after.facts["concerned"] == 0
    assert np.array_equal(whole_picture(after), whole_picture(before))
    assert after.facts["stopped"] == before.facts["stopped"]
    assert after.facts["holders"] == before.facts["holders"]
    assert all(line["lost"] == line["gained"] == 0 for line in after.facts["lines"])


def test_changes_stay_for_what_is_released_next(asked: Asked):
    asked.release()
    first = asked.edit(**CHANGES[0])
    again = asked.release()
    assert [frame.facts["op"] for frame in asked.frames] == ["hits", "difference"] * 3
    assert_same_answer(type(again)({**again.facts, "id": 2}, again.arrays), first)
    asked.session.answer = None
    assert asked.edit(**CHANGES[0]).facts == {}  # nothing to report yet
    assert_same_answer(asked.release(), again)


@pytest.mark.parametrize("fidelity", ["draft", "standard", "reference"])
@pytest.mark.parametrize("shape", ["cone", "points"])
def test_all_that_is_drawn_lies_where_it_is_looked_for(
    layers: dict[str, str], tmp_path, monkeypatch: pytest.MonkeyPatch, fidelity: str, shape: str
):
    """Of the rasters, which are as large as the terrain model, only a part is read."""
    if shape == "points":
        place = tmp_path / "rock.pts"
        place.write_text("\n".join(f"{x} {y} {z}" for x in (-1, 1) for y in (-0.5, 0.5) for z in (-2, 2)) + "\n")
        shape = str(place)
    seen = []
    taken = Hits.taken

    def looked(rasters: Rasters, part: Part) -> Hits:
        seen.append((rasters.totals()["hit_count"].sum(), part.cells))
        found = taken(rasters, part)
        assert not rasters.totals()["hit_count"].any()
        return found

    monkeypatch.setattr(Hits, "taken", staticmethod(looked))
    with opened(layers, shape=shape) as asked:
        told = asked.release(fidelity=fidelity, n=60)
        asked.edit(**CHANGES[3])
    cells = ROWS * COLUMNS
    assert sum(total for total, _ in seen[:2]) == whole_picture(told).sum() > 0
    assert all(number < cells for _, number in seen[:2])
    assert whole_picture(asked.frames[-1]).sum() > 0


def test_hits_add_up_and_are_taken_away_wherever_their_boxes_lie():
    rng = np.random.default_rng(5)
    parts, grid = [], np.zeros((40, 50), np.int64)
    for _ in range(4):
        row, column = rng.integers(0, 20, 2)
        count = rng.integers(0, 9, rng.integers(1, 20, 2), dtype=np.uint32)
        parts.append(Hits((int(column), int(row)), count))
        grid[row : row + count.shape[0], column : column + count.shape[1]] += count
    less = Hits(parts[2].first, parts[2].count // 2)  # what is taken away was counted before
    row, column = less.first[::-1]
    grid[row : row + less.count.shape[0], column : column + less.count.shape[1]] -= less.count
    together = Hits.summed([*parts, NOWHERE], less=[less])
    rows, columns = np.flatnonzero(grid.any(axis=1)), np.flatnonzero(grid.any(axis=0))
    assert together.first == (columns[0], rows[0])
    assert np.array_equal(together.count, grid[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
    assert Hits.summed([parts[0]], less=[parts[0]]) is NOWHERE
    assert Hits.summed([]) is NOWHERE


def test_a_friction_by_cell_holds_and_gives_way_to_a_number(layers: dict[str, str], tmp_path):
    import rasterio

    with rasterio.open(layers["dem"]) as source:
        facts = source.profile
        values = np.full(source.shape, 0.4, np.float32)
    with rasterio.open(tmp_path / "friction.tif", "w", **facts) as made:
        made.write(values, 1)
    with opened(layers, friction=0.4) as asked:
        everywhere, other = asked.release(), asked.release(friction=0.2)
    with opened(layers, friction=str(tmp_path / "friction.tif")) as asked:
        assert asked.session.defaults.friction is None
        assert_same_answer(asked.release(), everywhere)
        assert_same_answer(asked.release(friction=0.2), other)


def test_what_holds_logs_behind_the_trees_is_no_tree(layers: dict[str, str]):
    """Lying logs are numbered after the trees, and so are planted ones."""
    only = {name: layers[name] for name in ("dem", "lying_logs", "lines")}
    with opened(only) as asked:
        told = asked.release(shape={"circle": [106.0, 135.0, 4.0]}, n=60)
        assert told.facts["stopped"]["lying_log"] > 0
        assert told.facts["holders"] == []
        told = asked.edit(plant=[{"x": 20.0, "y": 100.0, "dbh_cm": 30.0, "height_m": 9.0}])
        assert told.facts["stopped"]["lying_log"] > 0
        assert told.facts["holders"] == []


def test_the_first_batch_is_always_finished_and_no_other_begun_in_vain(asked: Asked):
    asked.release(stale=lambda: True)
    assert [frame.facts["done"] for frame in asked.frames] == [30]
    asked.edit(stale=lambda: True, fell=[0])
    assert [frame.facts["op"] for frame in asked.frames] == ["difference"]
    asked.edit(fell=[0])  # continues where the request was left
    assert [(frame.facts["op"], frame.facts["done"]) for frame in asked.frames] == [
        ("difference", 30),
        ("hits", 100),
        ("difference", 100),
        ("hits", 130),
        ("difference", 130),
    ]
    stopped = asked.frames[3]
    assert_same_answer(stopped, [frame for frame in released_again(asked) if frame.facts["op"] == "hits"][-1])


def released_again(asked: Asked) -> list:
    asked.release()
    return list(asked.frames)


def test_a_batch_that_is_stopped_leaves_nothing_behind(asked: Asked):
    whole = asked.release(n=300)
    calls = iter([False, False, True])  # the second batch is requested, begun, and stopped while it slides
    asked.release(n=300, stale=lambda: next(calls, True))
    assert [frame.facts["done"] for frame in asked.frames] in ([30], [30, 100])
    asked.edit()
    hits = [frame for frame in asked.frames if frame.facts["op"] == "hits"]
    assert_same_answer(hits[-1], whole)


def test_a_preview_has_few_logs(asked: Asked):
    told = asked.release(preview=True)
    assert (told.facts["n"], told.facts["done"], told.facts["final"]) == (30, 30, True)


def test_poses_are_those_of_the_logs(asked: Asked):
    asked.release()
    told: list = []
    asked.session.poses({"op": "poses", "max": 40}, told.append)
    arrays, answer = told[0].arrays, asked.session.answer
    assert answer is not None
    assert told[0].facts["logs"] == 40
    assert arrays["offsets"][0] == 0
    assert arrays["offsets"][-1] == len(arrays["t"])
    for k in (0, 29, 30, 39):
        rows = slice(arrays["offsets"][k], arrays["offsets"][k + 1])
        assert arrays["t"][rows][0] == 0.0
        assert (np.diff(arrays["t"][rows]) >= 0.0).all()
        middle = (arrays["base"][rows][-1] + arrays["tip"][rows][-1]) / 2
        end = [answer.base[k >= 30].end[k - 30 * (k >= 30)] - asked.session.layers.dem.bounds[:2]]
        assert np.hypot(*(middle[:2] - end[0])) < 0.5 * 14.0  # the centre of mass lies between the ends


def test_poses_in_the_changed_scene_differ_where_the_change_matters_alone(asked: Asked):
    def poses(variant: str) -> tuple[list[bytes], Any]:
        told: list = []
        asked.session.poses({"op": "poses", "max": 30, "variant": variant}, told.append)
        assert told[0].facts["variant"] == variant
        arrays = told[0].arrays
        ends = np.column_stack([arrays["t"], arrays["base"], arrays["tip"]])
        return [each.tobytes() for each in np.split(ends, arrays["offsets"][1:-1])], told[0]

    asked.release()
    plain = poses("before")[0]
    assert poses("after")[0] == plain
    told = asked.edit(barriers=[{"points": [[70.0, 165.0], [110.0, 165.0]], "height_m": 3.0}])
    answer = asked.session.answer
    assert answer is not None
    concerned = set(answer.concerned(answer.base[0]).tolist())
    changed, frame = poses("after")
    assert poses("before")[0] == plain
    differ = {k for k, (one, other) in enumerate(zip(plain, changed, strict=True)) if one != other}
    assert differ
    assert differ <= concerned
    for k in differ:
        last = frame.arrays["offsets"][k + 1] - 1
        middle = (frame.arrays["base"][last] + frame.arrays["tip"][last]) / 2
        end = told.arrays["deposits_x"][k], told.arrays["deposits_y"][k]
        assert np.hypot(*(middle[:2] - end)) < 0.5 * 14.0


def test_a_polygon_and_other_laws(asked: Asked):
    area = {"polygon": [[80.0, 180.0], [100.0, 180.0], [90.0, 200.0]]}
    plain = asked.release(shape=area)
    answer = asked.session.answer
    assert answer is not None
    assert shapely.contains_xy(answer.question.area, answer.releases.x, answer.releases.y).all()
    slippery = asked.release(shape=area, friction=0.1, rolling_friction=0.0)
    assert slippery.facts["reach"][0]["n_reach"] > plain.facts["reach"][0]["n_reach"]
    assert_same_answer(asked.release(shape=area, friction=0.25), plain)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"shape": {"circle": [90.0, 190.0, float("nan")]}}, "'circle' must be a number"),
    ({"shape": {"circle": [90.0, 190.0, -1.0]}}, "'circle' is -1"),
    ({"shape": {"circle": [90.0, 190.0]}}, "'circle' must be a number"),
    ({"shape": {"circle": [900.0, 190.0, 5.0]}}, "lies off the terrain model"),
    ({"shape": {"circle": [1.0, 190.0, 50.0]}}, "part of the area lies off the terrain model"),
    ({"shape": {"polygon": [[80.0, 180.0], [100.0, 180.0]]}}, "at least 3 points"),
    ({"shape": {"polygon": [[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0]]}}, "crosses itself"),
    ({"shape": {"polygon": [[0.0, 0.0]] * 2000}}, "at most 1000"),
    ({"shape": 5}, "'shape' must be an object"),
    ({"n": MOST_LOGS + 1}, f"must be 1 to {MOST_LOGS}"),
    ({"n": 2.5}, "whole number"),
    ({"n": True}, "whole number"),
    ({"seed": -1}, "'seed' is -1"),
    ({"fidelity": "best"}, "'fidelity' must be one of draft"),
    ({"friction": "0.2"}, "'friction' must be a number"),
    ({"friction": -0.1}, "'friction' is -0.1"),
    ({"logs": {"dbh_cm": [60, 30]}}, "give the smallest first"),
    ({"logs": {"dbh_cm": [1e9, 1e9]}}, "'dbh_cm' is 1e"),
    ({"logs": {"length_m": 5}}, "must be two numbers"),
    ({"logs": {"orientation": "sideways"}}, "'orientation' must be one of"),
    ({"logs": {"density_kg_m3": float("inf")}}, "must be a number"),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED, ids=lambda value: value if isinstance(value, str) else "")
def test_a_question_that_cannot_be_is_refused_in_words(asked: Asked, changes: dict[str, Any], words: str):
    asked.release(n=30)
    with pytest.raises(UserError, match=words):
        asked.release(**changes)
    assert asked.edit(fell=[0]).facts["n"] == 30  # the previous request remains


REFUSED_EDITS: list[tuple[dict[str, Any], str]] = [
    ({"fell": [220]}, "'fell' must hold numbers of trees, 0 to 219"),
    ({"fell": [-1]}, "'fell' must hold numbers of trees"),
    ({"fell": 3}, "'fell' must be a list"),
    ({"plant": [{"x": 90.0, "y": 150.0, "dbh_cm": 0.0, "height_m": 5.0}]}, "'dbh_cm' is 0"),
    ({"plant": [{"x": 90.0, "y": 150.0, "dbh_cm": 30.0}]}, "'height_m' must be a number"),
    ({"plant": [{"x": None, "y": 150.0, "dbh_cm": 30.0, "height_m": 9.0}]}, "'plant' must be a number"),
    ({"plant": [{"x": 0.0, "y": 150.0, "dbh_cm": 30.0, "height_m": 9.0}]}, "has no height"),
    ({"barriers": [{"points": [[5.0, 5.0], [5.0, 5.0]], "height_m": 2.0}]}, "has no length"),
    ({"barriers": [{"points": [[5.0, 5.0], [5.0, 500.0]], "height_m": 2.0}]}, "lies off the terrain model"),
    ({"barriers": [{"points": [[5.0, 5.0], [9.0, 5.0]], "height_m": -2.0}]}, "'height_m' is -2"),
    ({"lying_logs": [{"points": [[5.0, 5.0], [165.0, 5.0]], "diameter_cm": 40.0}]}, "at most 150 m"),
    ({"barriers": ["x"]}, "'barriers' must be an object"),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED_EDITS, ids=lambda value: value if isinstance(value, str) else "")
def test_a_change_that_cannot_be_is_refused_and_those_in_force_stay(asked: Asked, changes: dict[str, Any], words: str):
    asked.release(n=30)
    before = asked.edit(fell=[3])
    with pytest.raises(UserError, match=words):
        asked.edit(**changes)
    assert list(asked.session.changes.fell) == [3]
    told = asked.release(n=30)
    assert np.array_equal(whole_picture(told), whole_picture(before))


def test_a_thousand_random_actions_leave_the_memory_flat(asked: Asked):
    rng = np.random.default_rng(0)

    def act() -> None:
        x, y = rng.uniform((40.0, 150.0), (140.0, 230.0))
        match rng.integers(5):
            case 0:
                asked.release(shape={"circle": [x, y, 5.0]}, n=6, logs=LOGS, seed=int(rng.integers(99)))
            case 1:
                asked.edit(fell=rng.integers(0, 220, 5).tolist())
            case 2:
                asked.edit(barriers=[{"points": [[x, y - 30.0], [x + 9.0, y - 30.0]], "height_m": 2.0}])
            case 3:
                asked.edit(plant=[{"x": x, "y": y - 20.0, "dbh_cm": 40.0, "height_m": 20.0}])
            case _:
                asked.session.poses({"max": 5}, asked.frames.append)

    asked.release(n=6, shape=CIRCLE)
    for _ in range(200):
        act()
    tracemalloc.start()
    try:
        for _ in range(100):
            act()
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(700):
            act()
        after = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    # an answer of six logs holds half a megabyte at most, and one more or less may be alive
    assert after - before < 2_000_000


def test_warming_up_leaves_no_question_and_needs_no_ground_in_the_middle(layers: dict[str, str], tmp_path):
    import rasterio

    with rasterio.open(layers["dem"]) as source:
        facts, values = source.profile, source.read(1)
    values[:200, 40:] = -9999.0
    with rasterio.open(tmp_path / "dem.tif", "w", **facts) as made:
        made.write(values, 1)
    with opened({"dem": str(tmp_path / "dem.tif")}) as asked:
        asked.session.warm_up()
        assert asked.session.answer is None
        assert asked.release(shape={"circle": [20.0, 190.0, 5.0]}, n=5).facts["done"] == 5


def test_the_batches_of_many_logs():
    assert [(part.start, part.stop) for part in parts_of(700)] == [
        (0, 30),
        (30, 100),
        (100, 300),
        (300, 600),
        (600, 700),
    ]
    assert parts_of(5) == [slice(0, 5)]
