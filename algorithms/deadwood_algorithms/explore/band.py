"""The reach of a request's logs over the plausible friction, in the scene as it was read and as changed: paired logs at
`draft`, as of `slide-logs --friction-range`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from deadwood_algorithms.explore.answer import Answer, Batch, Stale
from deadwood_algorithms.explore.facts import paired_facts, reach_facts, reach_of
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.params.presets import plausible_range
from deadwood_algorithms.results.friction_band import Member, SlidBand, band_of_line, band_records

FRICTIONS = 5
MOST_LOGS = 300  # that slide at each friction


def can_have_band(answer: Answer) -> bool:
    """Whether all logs have slid, at a friction that is a number, and there is a line that they can reach."""
    slid = len(answer.base) == len(answer.parts) and (not answer.changes or len(answer.changed) == len(answer.parts))
    return slid and answer.question.friction is not None and len(answer.layers.lines.ids) > 0


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
    if at_draft:
        answer.at_friction |= {(edited, own): reach_of(batches)[:n] for edited, batches in scenes.items()}
    frictions, done = frictions_of(own, preset), []
    for friction in [own, *frictions]:
        for edited in scenes:
            answer.slide_at(friction, edited, n, stop)
        done.append(friction)
        yield band_frame(answer, scenes, done, number, final=len(done) == 1 + len(frictions))


def band_frame(
    answer: Answer, scenes: dict[bool, list[Batch]], done: list[float], number: Any, *, final: bool
) -> Frame:
    """The reach at the frictions done so far, the request's own first, and the effect of the changes at each."""
    ids, own = [str(each) for each in answer.layers.lines.ids], done[0]
    n, log_id = len(answer.at_friction[False, own]), np.asarray(answer.releases.logs.log_id)
    records, reach = {}, {}
    for edited, batches in scenes.items():
        members = tuple(Member(each, "", answer.at_friction[edited, each]) for each in done[1:])
        unchanged = None if answer.question.fidelity == "draft" else answer.at_friction[edited, own]
        band = SlidBand(log_id[:n], own, "", unchanged, members, 0.0)
        reach[edited] = [reach_of(batches), *(each.reach for each in members)]
        records[edited] = band_records(band, reach_facts(answer, batches), log_id, reach_of(batches))
    lines: dict[str, dict[str, Any]] = {each: {"line_id": each} for each in ids}
    for edited, found in records.items():
        for line in ids:
            lines[line]["after" if edited else "before"] = variant_facts(found, line)
    if True in scenes:
        effects = [paired_facts(ids, *both) for both in zip(reach[False], reach[True], strict=True)]
        for line, *each in zip(ids, *effects, strict=True):
            lines[line]["effect"] = effect_over(done, each)
    facts = {"op": "band", "id": number, "friction": own, "n": n, "lines": list(lines.values()), "final": final}
    return Frame(facts)


def variant_facts(records: list[dict[str, Any]], line_id: str) -> dict[str, Any]:
    """The band of a line in one scene: the points of its curve, and its range in percent, rounded as in a report."""
    band = band_of_line({"friction_band": records}, line_id)
    assert band is not None
    points = sorted((each for each in records if each["line_id"] == line_id), key=lambda each: each["friction"])
    low, high = band.shares()
    return {"points": points, "low": low, "high": high, "frictions": band.frictions}


def effect_over(frictions: list[float], effects: list[dict[str, Any]]) -> dict[str, list[float]]:
    """The frictions at which fewer or more logs reach a line after the changes, and at which chance explains both."""
    found: dict[str, list[float]] = {"less": [], "more": [], "chance": []}
    for friction, each in sorted(zip(frictions, effects, strict=True), key=lambda pair: pair[0]):
        found["more" if each["ci_low"] > 0.0 else "less" if each["ci_high"] < 0.0 else "chance"].append(friction)
    return found
