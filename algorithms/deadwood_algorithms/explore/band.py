"""The reach of a request's logs over the plausible friction, and in another posture, in the scene as it was read and as
changed: paired logs at `draft`, as of `slide-logs --friction-range`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from deadwood_algorithms.explore.answer import Answer, Batch, Stale
from deadwood_algorithms.explore.facts import paired_facts, reach_facts, reach_of
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.params.presets import plausible_range
from deadwood_algorithms.results.friction_band import OTHER_POSTURE, Member, SlidBand, band_of_line, band_records

Place = tuple[float, str]  # friction and posture
FRICTIONS = 5
MOST_LOGS = 300  # that slide at each friction


def can_have_band(answer: Answer) -> bool:
    """Whether all logs have slid, at a friction that is a number, and there is a line that they can reach."""
    slid = len(answer.base) == len(answer.parts) and (not answer.changes or len(answer.changed) == len(answer.parts))
    return slid and answer.question.friction is not None and len(answer.layers.lines.ids) > 0


def postures_of(answer: Answer) -> list[str]:
    """The posture of a request's logs, and the other one of the band; logs of a shape that was measured have one."""
    own = answer.question.sizes.orientation
    return [own] if answer.layers.shape else [own, OTHER_POSTURE.get(own, "upright")]


def frictions_of(own: float, preset: str | None) -> list[float]:
    """Those to slide at beside a request's own, the farthest first, so that the range is known early."""
    low, high = plausible_range(own, preset)
    if not low < high:
        return []
    found = np.linspace(low, high, FRICTIONS).round(4).tolist()
    found.remove(own if own in found else min(found[1:-1], key=lambda each: abs(each - own)))
    return sorted(found, key=lambda each: -abs(each - own))


def band_frames(answer: Answer, preset: str | None, number: Any, stop: Stale) -> Iterator[Frame]:
    """One frame for each friction as it is done, with all so far.

    Raises
    ------
    Cancelled
        if it was stopped
    """
    own = answer.question.friction
    assert own is not None  # `can_have_band`
    n, at_draft = min(MOST_LOGS, len(answer.releases)), answer.question.fidelity == "draft"
    scenes: dict[bool, list[Batch]] = {False: [*answer.base]}
    if answer.changes:
        scenes[True] = [*answer.changed]
    posture, *others = postures_of(answer)
    if at_draft:
        answer.at |= {(edited, own, posture): reach_of(batches)[:n] for edited, batches in scenes.items()}
    places, done = [(own, posture), *((each, posture) for each in frictions_of(own, preset))], []
    places += [(own, each) for each in others if len(places) > 1]
    for place in places:
        for edited in scenes:
            answer.slide_at(*place, edited, n, stop)
        done.append(place)
        yield band_frame(answer, scenes, done, number, final=len(done) == len(places))


def band_frame(
    answer: Answer, scenes: dict[bool, list[Batch]], done: list[Place], number: Any, *, final: bool
) -> Frame:
    """The reach at the places done so far, the request's own first, and the effect of the changes at each."""
    ids, (own, posture) = [str(each) for each in answer.layers.lines.ids], done[0]
    n, log_id = len(answer.at[False, own, posture]), np.asarray(answer.releases.logs.log_id)
    records, reach = {}, {}
    for edited, batches in scenes.items():
        members = tuple(Member(*each, answer.at[edited, *each]) for each in done[1:])
        unchanged = None if answer.question.fidelity == "draft" else answer.at[edited, own, posture]
        band = SlidBand(log_id[:n], own, posture, unchanged, members, 0.0)
        reach[edited] = [reach_of(batches), *(each.reach for each in members)]
        records[edited] = band_records(band, reach_facts(answer, batches), log_id, reach_of(batches))
    lines: dict[str, dict[str, Any]] = {each: {"line_id": each} for each in ids}
    for edited, found in records.items():
        for line in ids:
            lines[line]["after" if edited else "before"] = variant_facts(found, line)
    if True in scenes:
        effects = [paired_facts(ids, *both) for both in zip(reach[False], reach[True], strict=True)]
        for line, *each in zip(ids, *effects, strict=True):
            alike = [k for k, place in enumerate(done) if place[1] == posture]
            lines[line]["effect"] = effect_over([done[k][0] for k in alike], [each[k] for k in alike])
            lines[line]["effect_in_posture"] = [
                {"posture": place[1], "effect": verdict_of(effect)}
                for place, effect in zip(done, each, strict=True)
                if place[1] != posture
            ]
    facts = {"op": "band", "id": number, "friction": own, "n": n, "lines": list(lines.values()), "final": final}
    return Frame(facts)


def variant_facts(records: list[dict[str, Any]], line_id: str) -> dict[str, Any]:
    """The band of a line in one scene: the points of its curve, and its range in percent, rounded as in a report."""
    band = band_of_line({"friction_band": records}, line_id)
    assert band is not None
    points = [each for each in records if each["line_id"] == line_id and each["posture"] == band.own["posture"]]
    low, high = band.shares()
    return {
        "points": sorted(points, key=lambda each: each["friction"]),
        "low": low,
        "high": high,
        "frictions": band.frictions,
        "postures": band.postures,
    }


def effect_over(frictions: list[float], effects: list[dict[str, Any]]) -> dict[str, list[float]]:
    """The frictions at which fewer or more logs reach a line after the changes, and at which chance explains both."""
    found: dict[str, list[float]] = {"less": [], "more": [], "chance": []}
    for friction, each in sorted(zip(frictions, effects, strict=True), key=lambda pair: pair[0]):
        found[verdict_of(each)].append(friction)
    return found


def verdict_of(effect: dict[str, Any]) -> str:
    return "more" if effect["ci_low"] > 0.0 else "less" if effect["ci_high"] < 0.0 else "chance"
