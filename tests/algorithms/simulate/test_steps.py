"""Saved steps: reused in their order, repeated from the first damaged one, refused if from another run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.simulate.steps import Steps

IDENTITY = {"version": "x", "engine": "y", "releases": "z"}


def steps_of(folder: Path, said, *, resume: bool = True, **more: object) -> Steps:
    return Steps(str(folder / "run"), {**IDENTITY, **more}, resume=resume, feedback=said)


def three(steps: Steps, stop: int | None = None) -> tuple[list[int], list[int]]:
    """The values of three steps, and which of them were calculated; one of them may be interrupted."""
    worked: list[int] = []

    def work(number: int) -> dict[str, np.ndarray]:
        if number == stop:
            raise Cancelled
        worked.append(number)
        return {"value": np.array([10 * number])}

    return [int(steps.take(7, lambda k=k: work(k))["value"][0]) for k in range(3)], worked


def test_what_was_done_is_taken_over(tmp_path, said):
    with pytest.raises(Cancelled):
        three(steps_of(tmp_path, said, resume=False), stop=2)
    assert any(note.startswith("what 14 logs did is kept") and "--resume" in note for note in said.notes)
    steps = steps_of(tmp_path, said)
    assert three(steps) == ([0, 10, 20], [2])
    steps.remove()
    assert list(tmp_path.iterdir()) == []


def test_from_the_first_damaged_step_all_is_done_again(tmp_path, said):
    three(steps_of(tmp_path, said, resume=False))
    place = tmp_path / ".run.part" / "logs_1.npz"
    content = bytearray(place.read_bytes())
    content[len(content) // 2] ^= 1
    place.write_bytes(bytes(content))
    assert three(steps_of(tmp_path, said)) == ([0, 10, 20], [1, 2])


def test_without_resume_or_of_another_question_nothing_is_taken_over(tmp_path, said):
    three(steps_of(tmp_path, said, resume=False))
    with pytest.raises(UserError, match="was begun with other releases"):
        steps_of(tmp_path, said, releases="another")
    assert three(steps_of(tmp_path, said, resume=False)) == ([0, 10, 20], [0, 1, 2])


def test_a_loss_that_is_the_users_to_fix_is_reported_as_it_is(tmp_path, said):
    def lost() -> dict[str, np.ndarray]:
        raise UserError("the scheduler is lost")

    steps = steps_of(tmp_path, said, resume=False)
    with pytest.raises(UserError, match="the scheduler is lost"):
        steps.take(7, lost)
    assert any(note.startswith("what 0 logs did is kept") for note in said.notes)
