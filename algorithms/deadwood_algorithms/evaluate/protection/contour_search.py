"""Where a barrier could stand: pieces along contours above the lines, where most logs of the run pass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from deadwood_algorithms.evaluate.protection.candidate_barriers import Candidate, contour_candidates
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.evaluate.protection.siting import passed_to_lines
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.simulate.steps import Steps


def contours_of(
    run: str,
    rerun: Rerun,
    layers: SceneLayers,
    steps: Steps,
    feedback: Feedback,
    *,
    above_m: Sequence[float],
    length_m: Sequence[float],
    height_m: Sequence[float],
    places: int,
) -> tuple[list[Candidate], SceneLayers]:
    """Pieces along contours where most logs pass; and the scene on a sufficiently large window.

    above_m : heights of the contours above the lines [m]
    length_m, height_m : of the pieces and of the barriers on them [m]
    places : pieces for each contour and length
    """
    if layers.dem.whole is not None:  # contours are computed on all ground that logs reach
        _, layers = passed_to_lines(rerun, layers, list(layers.lines.geometry), steps, feedback)

    def passed(shapes: Sequence[Any]) -> Any:
        return passed_to_lines(rerun, layers, shapes, steps, feedback)[0]

    found = contour_candidates(layers, above_m, length_m, height_m, places, passed)
    if not found:
        above, long = (",".join(f"{each:g}" for each in many) for many in (above_m, length_m))
        raise UserError(
            f"{run}: no log that reaches a line passes a straight piece of {long} m along a contour {above} m above "
            "it; use other values, or give --candidates"
        )
    return found, layers
