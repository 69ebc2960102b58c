"""``--plan``: a pilot with a few randomly drawn logs is slid and written to a temporary folder.

A tool that slides the same logs several times only needs `result_or_plan`.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import Field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import Feedback, Outcome, ProgressOnly, Quiet, UserError
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.results.checked import SUMMARY
from deadwood_algorithms.results.forecast import (
    Pilot,
    facts_of_forecast,
    forecast,
    most_held,
    refuse_too_large,
    words_of_forecast,
)
from deadwood_algorithms.results.run_folder import GEOPACKAGE, layers_in, read_run
from deadwood_algorithms.simulate.crew import NobodySlides
from deadwood_algorithms.simulate.sliding import metered
from deadwood_algorithms.simulate.warm_up import load_kernels


class SlidesSome(Protocol):
    """Options of a tool that slides some of the ``logs`` several times each: those of ``SlidingOptions``, and
    the number of logs (None: all)."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def logs(self) -> int | None: ...
    @property
    def output(self) -> str: ...
    @property
    def plan(self) -> bool: ...
    @property
    def plan_logs(self) -> int: ...
    @property
    def plan_workers(self) -> int: ...
    def where(self, name: str) -> Where: ...


class SlidesRunAgain(SlidesSome, Protocol):
    """The same for a tool that slides the logs of a run again."""

    @property
    def run(self) -> str: ...


Options = TypeVar("Options", bound=SlidesSome)
Again = TypeVar("Again", bound=SlidesRunAgain)
LEAST, LEAST_AGAIN = 2, 10  # logs of a pilot; of a pilot whose scenes each slide only some of them


def result_or_plan(
    run: Callable[[Options, Feedback], Outcome],
    options: Options,
    feedback: Feedback,
    *,
    times: int,
    logs_there: Callable[[], int],
    least: int = LEAST,
) -> Outcome:
    """For a tool that slides the same logs several times: its result or, with ``--plan``, the forecast of its cost.

    Parameters
    ----------
    run : makes the result
    times : how often each log slides, approximately; least : logs of the pilot
    logs_there : number of logs, of which ``--logs`` takes some
    """
    if not options.plan:
        return run(options, feedback)
    logs = min(options.logs or 2**40, logs_there())
    few = min(max(least, options.plan_logs // times), logs)

    def slide_few(place: Path) -> tuple[Pilot, int]:
        load_kernels(None, feedback)  # compilation is not part of the forecast
        place.mkdir()
        pilot = replace(options, output=str(place / Path(options.output).name), logs=few, plan=False, resume=False)
        began = time.perf_counter()
        with metered() as meter:
            try:
                run(pilot, ProgressOnly(feedback))
            except NobodySlides:
                raise
            except UserError as error:
                raise UserError(f"--plan, with a pilot of {few} logs: {error}") from error
        whole_s = time.perf_counter() - began
        files = [each for each in place.rglob("*") if each.is_file()]
        # the same logs repeatedly: repeating them adds no information
        spread = meter.spread * math.sqrt(meter.logs / few)
        took = Pilot(
            logs=meter.logs,
            kept=0,
            cpu_s=meter.cpu_s,
            slide_s=meter.wall_s,
            other_s=max(0.0, whole_s - meter.wall_s),
            memory=most_held(),
            files={each.name: each.stat().st_size for each in files},
            passed_cells=0,
            vertices=0,
            spread=spread,
        )
        return took, round(meter.logs * logs / few)

    return planned(slide_few, options.output, options.where(""), options.plan_workers)


def result_or_plan_of_run(
    slide: Callable[[Again, Feedback], Outcome], options: Again, feedback: Feedback, *, times: int
) -> Outcome:
    """The same for a tool that slides the logs of a run again."""
    return result_or_plan(
        slide, options, feedback, times=times, logs_there=lambda: logs_of_run(options.run), least=LEAST_AGAIN
    )


def logs_of_layer(releases: str) -> int:
    """Number of logs in a layer of releases."""
    return len(read_table(releases, what="releases"))


def logs_of_run(folder: str) -> int:
    """Number of logs that a run slid."""
    return len(read_run(folder, feedback=Quiet()).deposits)


def planned(
    slide_few: Callable[[Path], tuple[Pilot, int]], output: str, where: Where, workers: int, kept: int | None = 0
) -> Outcome:
    """The forecast of ``--plan``, from a pilot in a temporary folder.

    Parameters
    ----------
    slide_few : slides the pilot into a folder; returns its cost, and how many logs the run itself would slide
    workers : number for which the time is given as well; kept : logs whose trajectory is stored, None for all
    """
    with TemporaryDirectory(prefix="deadwood-plan-") as folder:
        took, logs = slide_few(Path(folder) / "pilot")
    found = forecast(took, logs, logs if kept is None else min(kept, logs), threads=where.cores, workers=workers)
    refuse_too_large(found, output)
    return Outcome({}, {**facts_of_forecast(found, output), "pilot": vars(took)}, words_of_forecast(found, output))


def pilot_from(folder: Path, whole_s: float) -> Pilot:
    """Read the results of a pilot and its total duration."""
    import pyogrio
    import rasterio
    import shapely

    summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    cost, logs = summary["cost"], summary["logs"]["released"]
    package = folder / GEOPACKAGE
    deposits = pyogrio.read_dataframe(package, layer="deposits", columns=["duration_s"], read_geometry=False)
    run = deposits["duration_s"].to_numpy(np.float64)
    kept, vertices = 0, 0
    if "trajectories" in layers_in(folder):
        shapes = pyogrio.read_dataframe(package, layer="trajectories", columns=[]).geometry.to_numpy()
        kept, vertices = len(shapes), int(shapely.get_num_coordinates(shapes).sum())
    with rasterio.open(folder / "hit_count.tif") as source:
        passed = int(np.count_nonzero(source.read(1))) if source.width * source.height <= 2**28 else 0
    return Pilot(
        logs=logs,
        kept=kept,
        cpu_s=cost["cpu_s"],
        slide_s=cost["wall_s"],
        other_s=max(0.0, whole_s - cost["wall_s"]),
        memory=most_held(),
        files={each.name: each.stat().st_size for each in folder.iterdir()},
        passed_cells=passed,
        vertices=vertices,
        spread=float(run.std() / run.mean()) if run.mean() > 0.0 else 0.0,
    )
