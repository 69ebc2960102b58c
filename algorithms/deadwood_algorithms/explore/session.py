"""A scene kept in memory for requests: where do logs from here go, and what if these trees were absent?

No files, no network: messages in, frames out. The logs of a request slide in batches of 30, 70, 200, ... into one count
of hits. Each batch is sent as soon as it is done, and together they are, bit for bit, one run of `slide-logs` on the
same releases.
"""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from deadwood_algorithms.explore.answer import Answer, Stale, changed_scene
from deadwood_algorithms.explore.band import band_frames, can_have_band, postures_of
from deadwood_algorithms.explore.facts import BEFORE, VARIANTS, difference_frame, hits_frame, poses_frame
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.explore.questions import (
    MOST_POSED,
    Changes,
    Defaults,
    Question,
    changes_of,
    one_of,
    question_of,
    whole_in,
)
from deadwood_algorithms.explore.released import releases_layer
from deadwood_algorithms.params.messages import Message
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, releases_of
from deadwood_algorithms.scene.shape import as_shape
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.sinking import Sinking
from deadwood_engine import FIDELITIES, Start, place_logs

Send = Callable[[Frame], None]
TRIED = 0.5, 0.25, 0.75, 0.1, 0.9  # shares of the terrain model's sides at which logs may be released for the warm-up


class Session:
    """One scene, the latest request, and the active changes.

    simulation, layers : the scene as it was read, whole; warnings : what makes every answer in it doubtful
    """

    def __init__(
        self, simulation: Simulation, layers: SceneLayers, defaults: Defaults, warnings: Sequence[Message] = ()
    ) -> None:
        self.simulation, self.layers, self.defaults, self.warnings = simulation, layers, defaults, warnings
        self.changes = Changes()
        self.answer: Answer | None = None

    def warm_up(self) -> None:
        """Answer a dummy request, so that the first click finds everything loaded."""
        west, south, east, north = self.layers.dem.bounds
        for x, y in itertools.product(TRIED, TRIED):
            place = [x * (east - west), y * (north - south), 0.0]
            with contextlib.suppress(UserError):  # no height there
                self.release({"shape": {"circle": place}, "n": 4, "fidelity": "draft"}, lambda _: None, _never)
                break
        self.answer = None

    def release(self, message: Mapping[str, Any], send: Send, stale: Stale) -> None:
        """Slide the logs of a request: first in the scene as it was read, then as changed."""
        began = time.perf_counter()
        question = question_of(message, self.defaults, self.layers.dem)
        self.answer = self._answer(question)
        self._go_on(Told(send, question.number, began, bool(self.changes)), stale)

    def edit(self, message: Mapping[str, Any], send: Send, stale: Stale) -> None:
        """Replace the active changes by these, and report their effect on the last request."""
        began = time.perf_counter()
        self.change(message)
        if self.answer:
            self._go_on(Told(send, message.get("id"), began, True), stale)

    def change(self, message: Mapping[str, Any]) -> None:
        """Replace the active changes by these, without reporting yet."""
        changes = changes_of(message, len(self.layers.trees.x), self.layers.dem)
        if self.answer:
            self.answer.with_changes(changes)
        else:
            changed_scene(self.layers, changes)  # what the engine rejects is rejected now
        self.changes = changes

    def band(self, message: Mapping[str, Any], send: Send, stale: Stale) -> bool:
        """Report the reach of the latest request over the plausible friction, friction by friction; whether nothing
        is missing. What has slid when it is interrupted is kept for the next time."""
        if self.answer is None or not can_have_band(self.answer):
            return True
        answer = self.answer
        for posture in postures_of(answer):
            if posture not in answer.postures:
                sizes = replace(answer.question.sizes, orientation=posture)
                answer.postures[posture] = self._placed(answer.layers, replace(answer.question, sizes=sizes))[1]
        try:
            for frame in band_frames(answer, self.defaults.preset, message.get("id"), stale):
                send(frame)
        except Cancelled:
            return False
        return True

    def poses(self, message: Mapping[str, Any], send: Send) -> None:
        """The trajectories of the first logs of the latest request."""
        most = whole_in(message, "max", 1, MOST_POSED, 100)
        if self.answer is None or not self.answer.base:
            raise UserError("no logs have been released yet; click on the map first")
        variant = one_of(message, "variant", VARIANTS, BEFORE)
        send(poses_frame(self.answer, most, variant, message.get("id"), self.layers.dem.bounds[:2]))

    def _answer(self, question: Question) -> Answer:
        """An empty answer to a request."""
        layers = self.layers
        laws = {"rolling_friction": question.rolling_friction, "restitution": question.restitution}
        simulation = replace(
            self.simulation,
            laws={**self.simulation.laws, **laws},
            fidelity=FIDELITIES[question.fidelity],
            sinking=Sinking(),
        )
        if question.friction is not None and question.friction != self.defaults.friction:
            layers = replace(layers, friction=question.friction, scene=layers.scene.with_friction(question.friction))
        releases, start = self._placed(layers, question)
        edited, postures = changed_scene(layers, self.changes), {question.sizes.orientation: start}
        return Answer(question, self.changes, simulation, layers, edited, releases, start, postures=postures)

    def _placed(self, layers: SceneLayers, question: Question) -> tuple[Releases, Start]:
        """The logs of a request, and these at their start in the scene as it was read."""
        defaults = self.simulation.inputs.defaults
        releases = releases_of(releases_layer(question, defaults, layers.dem), layers.dem, defaults, feedback=Quiet())
        if layers.shape:
            releases = as_shape(releases, layers.shape)
        return releases, place_logs(layers.scene, releases.logs, layers.shape, layers.threads)

    def _go_on(self, receiver: Told, stale: Stale) -> None:
        """Slide what is missing, batch by batch, and report it.

        The first batch is always finished: if every new request ended the previous one, none would be answered while
        the mouse moves.
        """
        answer, corner = self.answer, self.layers.dem.bounds[:2]
        assert answer is not None
        try:
            for number, part in enumerate(answer.parts):
                stop = stale if number else _never
                if stop():
                    return
                if number >= len(answer.base):
                    answer.slide_base(part, stop)
                    receiver.send(hits_frame(answer, receiver.began, corner))
                if receiver.changes:
                    if number >= len(answer.changed):
                        answer.slide_changed(part, stop)
                    receiver.send(difference_frame(answer, receiver.number, receiver.began, corner))
        except Cancelled:
            return


@dataclass
class Told:
    """Who gets an answer, of which kind, since when; changes : whether their effect is reported, too."""

    send: Send
    number: Any
    began: float
    changes: bool


def _never() -> bool:
    return False
