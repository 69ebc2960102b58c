"""The steps of a computation in order; an interrupted one reuses the stored steps, bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.simulate.checkpoints import WorkFolder


class Unkept:
    """Steps that are not stored, of a computation so short that an interrupted one starts again."""

    def take(self, logs: int, slide: Callable[[], Mapping[str, NDArray]]) -> dict[str, NDArray]:
        return dict(slide())


class Steps(Unkept):
    """The results of each step are kept beside the output until it is complete; steps are always run in one order."""

    def __init__(self, output: str, identity: Mapping[str, Any], *, resume: bool, feedback: Feedback) -> None:
        self.feedback = feedback
        self._work = WorkFolder(output, identity, resume=resume, feedback=feedback, draws=False)
        self._number = self._logs = 0
        self._interrupted = False

    def __enter__(self) -> Steps:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Delete what was stored if its result was refused: only interrupted work can be continued."""
        if isinstance(error, UserError) and not self._interrupted:
            self.remove()

    def take(self, logs: int, slide: Callable[[], Mapping[str, NDArray]]) -> dict[str, NDArray]:
        """The arrays of the next step, which slides ``logs`` logs unless they are stored."""
        if self._number >= self._work.finished:
            try:
                self._work.save(self._number, slide())
            except (Cancelled, KeyboardInterrupt, UserError) as error:
                self._interrupted = True
                self.feedback.note(
                    f"what {counted(self._logs, 'log')} did is kept in {self._work.path}; --resume continues from there"
                )
                if isinstance(error, UserError):  # the workers are lost
                    raise
                raise Cancelled from error
        self._number, self._logs = self._number + 1, self._logs + logs
        return self._work.chunk(self._number - 1)

    def remove(self) -> None:
        """Delete what was stored, once the results are written."""
        self._work.remove()
