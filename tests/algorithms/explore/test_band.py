"""The reach over the plausible friction: each point is a request of its own, and it gives way to other messages."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from explore_case import LOGS as LOGS_OF_CASE
from explore_case import Asked, opened, write_case

from deadwood_algorithms.explore import answer
from deadwood_algorithms.explore.band import effect_over, frictions_of
from deadwood_algorithms.explore.facts import VARIANTS
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.explore.stdio import Front
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.stats.statistics import paired_interval, wilson_interval
from deadwood_algorithms.tools import explore

LOGS, OWN, ENDS = 130, 0.25, (0.2, 0.3)
BARRIER = {"barriers": [{"points": [[84.0, 120.0], [120.0, 123.0]], "height_m": 4.0}]}


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Asked]:
    with opened(write_case(tmp_path_factory.mktemp("band")), output=str(tmp_path_factory.mktemp("kept"))) as asked:
        yield asked


@pytest.fixture
def asked(warm: Asked) -> Asked:
    warm.session.answer = None
    warm.edit()
    return warm


def band_of(asked: Asked, stop=lambda: False) -> list[Frame]:
    frames: list[Frame] = []
    assert asked.session.band({"op": "band", "id": 3}, frames.append, stop)
    return frames


def points_of(frame: Frame, variant: str) -> dict[tuple[str, float], dict[str, Any]]:
    return {
        (each["line_id"], point["friction"]): point
        for each in frame.facts["lines"]
        for point in each[variant]["points"]
    }


def test_each_point_is_the_answer_at_that_friction(asked: Asked):
    asked.release()
    frames = band_of(asked)
    assert [len(each.facts["lines"][0]["before"]["points"]) for each in frames] == [1, 2, 3, 4, 5, 5]
    assert [each.facts["final"] for each in frames] == [False, False, False, False, False, True]
    found = points_of(frames[-1], "before")
    assert sorted({friction for _, friction in found}) == [0.2, 0.225, 0.25, 0.275, 0.3]
    for friction in (0.2, 0.25, 0.275, 0.3):
        for each in asked.release(friction=friction).facts["reach"]:
            point = found[each["line_id"], friction]
            assert point["p"] == each["p"] == each["n_reach"] / LOGS
            assert (point["ci_low"], point["ci_high"]) == pytest.approx(wilson_interval(each["n_reach"], LOGS))
    shares = {friction: found["road", friction]["p"] for friction in (0.2, 0.225, 0.25, 0.275, 0.3)}
    assert len(set(shares.values())) > 2
    (road,) = (each for each in frames[-1].facts["lines"] if each["line_id"] == "road")
    ends = float(road["before"]["low"]), float(road["before"]["high"])
    assert ends == pytest.approx((100 * min(shares.values()), 100 * max(shares.values())), abs=0.5)


def test_the_band_is_that_of_slide_logs(asked: Asked):
    """`slide-logs --friction-range` on the kept logs slides a part of them again: what the same part did here."""
    asked.release(n=300)
    band_of(asked)
    answered, runs = asked.session.answer, []
    assert answered is not None
    keeper = explore.keeper_of(asked.ask, Quiet(), asked.accounts)

    def slide(changes: Mapping[str, Any]) -> None:
        runs.append(Path(changes["output"]))
        keeper.slide({**changes, "friction_range": f"{ENDS[0]}-{ENDS[1]}"})

    asked.keep("with_range", slide)
    found = json.loads((runs[0] / "summary.json").read_text())["friction_band"]
    n = next(each["n"] for each in found if each["friction"] == ENDS[0])
    assert 20 <= n < 300
    own_posture = answered.question.sizes.orientation
    part = hash_order(answered.releases.logs.log_id, asked.ask.seed)[:n]
    names = [str(each) for each in answered.layers.lines.ids]
    for each in found:
        k = names.index(each["line_id"])
        own, there = (answered.at[False, friction, own_posture][:, k] for friction in (OWN, each["friction"]))
        moved = 0.0 if each["friction"] == OWN else there[part].mean() - own[part].mean()
        assert each["p"] == pytest.approx(own.mean() + moved, abs=1e-12)


def test_the_effect_of_a_change_over_the_range(asked: Asked):
    asked.release()
    band_of(asked)
    asked.edit(**BARRIER)
    last = band_of(asked)[-1]
    before, after = points_of(last, "before"), points_of(last, "after")
    shown: dict[str, dict[str, list[float]]] = {each["line_id"]: each["effect"] for each in last.facts["lines"]}
    for friction in (0.2, 0.225, 0.25, 0.275, 0.3):
        asked.session.answer = None
        asked.edit(**BARRIER)
        for each in asked.release(friction=friction).facts["lines"]:
            line = each["line_id"]
            assert before[line, friction]["p"] == each["before"] / LOGS
            assert after[line, friction]["p"] == each["after"] / LOGS
            low, high = paired_interval(each["lost"], each["gained"], LOGS)
            verdict = "less" if high < 0 else "more" if low > 0 else "chance"
            assert friction in shown[line][verdict]
    assert shown["road"]["less"], "a barrier across the way stops some"


def test_the_other_posture_is_the_answer_to_that_question(asked: Asked):
    """The same places and sizes, upright instead of lying: its reach, and the effect of the change in it."""
    asked.release()
    asked.edit(**BARRIER)
    lines = {each["line_id"]: each for each in band_of(asked)[-1].facts["lines"]}
    asked.session.answer = None
    asked.edit(**BARRIER)
    for each in asked.release(logs={**LOGS_OF_CASE, "orientation": "upright"}).facts["lines"]:
        line = lines[each["line_id"]]
        shares = [[(one["posture"], one["friction"], one["p"]) for one in line[name]["postures"]] for name in VARIANTS]
        assert shares == [[("upright", OWN, each[name] / LOGS)] for name in VARIANTS]
        low, high = paired_interval(each["lost"], each["gained"], LOGS)
        verdict = "less" if high < 0 else "more" if low > 0 else "chance"
        assert line["effect_in_posture"] == [{"posture": "upright", "effect": verdict}]


def test_without_the_change_nothing_slides_again(asked: Asked, monkeypatch: pytest.MonkeyPatch):
    """An edit keeps the curve of the scene as it was read; at its own friction all have slid anyway."""
    slid: list[int] = []
    once = answer.slide_once
    monkeypatch.setattr(
        answer, "slide_once", lambda *given, **more: (slid.append(len(given[1].state)), once(*given, **more))[1]
    )
    asked.release()
    slid.clear()
    band_of(asked)
    assert sum(slid) == 5 * LOGS
    assert max(slid) <= 10, "in pieces, between which a newer request ends it"
    asked.edit(**BARRIER)
    slid.clear()
    band_of(asked)
    assert sum(slid) == 5 * LOGS
    asked.edit()
    slid.clear()
    assert not any("effect" in each for each in band_of(asked)[-1].facts["lines"])
    assert not slid


def test_an_interrupted_band_goes_on_where_it_was(asked: Asked):
    asked.release()
    whole = band_of(asked)[-1]
    asked.session.answer.at.clear()  # type: ignore[union-attr]
    frames: list[Frame] = []
    assert not asked.session.band({"id": 3}, frames.append, lambda: len(frames) >= 2)
    assert len(frames) == 2
    assert band_of(asked)[-1].facts == whole.facts


@pytest.mark.parametrize(
    ("own", "preset", "expected"),
    [
        (0.25, None, [0.2, 0.225, 0.275, 0.3]),
        (0.2, "wet-debarked", [0.225, 0.25, 0.275, 0.3]),
        (0.21, None, [0.2, 0.25, 0.275, 0.3]),
        (0.31, "wet-bark", [0.25, 0.2825, 0.3475, 0.38]),
        (0.6, None, [0.48, 0.54, 0.66, 0.72]),
        (0.0, None, []),
    ],
)
def test_the_frictions_span_the_plausible_range(own: float, preset: str | None, expected: list[float]):
    found = frictions_of(own, preset)
    assert sorted(found) == pytest.approx(expected)
    assert found == sorted(found, key=lambda each: -abs(each - own)), "the ends come first"


def test_a_change_helps_where_the_interval_excludes_nothing():
    effects = [{"ci_low": -0.2, "ci_high": -0.1}, {"ci_low": 0.1, "ci_high": 0.3}, {"ci_low": -0.1, "ci_high": 0.05}]
    assert effect_over([0.3, 0.2, 0.25], effects) == {"less": [0.3], "more": [0.2], "chance": [0.25]}


def test_the_band_gives_way_to_other_messages(asked: Asked):
    """A message that comes while the band slides is answered before the band is complete, and the band is completed."""
    told: list[Frame] = []
    came = threading.Event()

    class Out:
        def send(self, frame: Frame) -> None:
            told.append(frame)
            if frame.facts["op"] == "band" and not came.is_set():
                came.set()
                front.waiting.put({"op": "poses", "id": 9, "max": 3, "turn": dict(front.newest)})

    front = Front(asked.session, None, Out(), None)  # type: ignore[arg-type]
    asked.release()
    front.band = {"op": "band", "id": 3, "turn": dict(front.newest)}
    front.waiting.put(front.band)
    while not front.waiting.empty():
        front._answer(front.waiting.get())
    names = [each.facts["op"] for each in told]
    assert names.index("poses") < len(names) - 1
    assert told[-1].facts["final"]
    told.clear()
    old, front.band = front.band, {"op": "band", "id": 4, "turn": dict(front.newest)}
    front._answer(old)
    assert not told, "a newer message asks for it"
    front.newest["release"] += 1
    front._answer(front.band)
    assert not told, "other logs were released"


def test_a_band_needs_a_line_and_a_number(tmp_path):
    layers = write_case(tmp_path)
    del layers["lines"]
    with opened(layers) as asked:
        assert band_of(asked) == []
        asked.release(n=30)
        assert band_of(asked) == []
