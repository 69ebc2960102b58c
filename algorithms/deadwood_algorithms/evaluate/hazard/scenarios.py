"""The intensity of a scenario: the class of the energy that comes to a cell at least once in its return period.

A cell's class is the highest whose lower bound is exceeded with a return period of at most that of the scenario, as
for the lines (`line_passages`); not the energy that a share of the logs bring, beside the frequency of any passage,
because a cell that is passed often by slow logs and rarely by a fast one would then count as passed often by fast
ones. Of all scenarios the highest class of intensity counts, with the shortest return period that reaches it: in the
national matrices a higher intensity is never the lower danger.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard.frequencies import stored_areas
from deadwood_algorithms.evaluate.hazard.least_passage import needed_for
from deadwood_algorithms.evaluate.hazard.rates import ReleaseArea, pooled, rate_with_interval, return_period
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.cell_quantiles import counts_above
from deadwood_algorithms.results.hit_counts import count_of
from deadwood_algorithms.results.run_folder import Run


def periods_of_energies(
    source: Run, areas: Sequence[ReleaseArea], logs: int, grid: Grid, bounds: Sequence[float], feedback: Feedback
) -> list[NDArray[np.float64]]:
    """Return period [years] of each energy [kJ] or more in each cell, from stored trajectories; NaN without any."""
    stored = stored_areas(source, list(areas))
    rates = pooled(stored, logs) or stored
    ids = source.stored_log_ids
    of_log = source.deposits.set_index("log_id")["release_id"].loc[ids].to_numpy()
    counts: list[Any] = []
    for area in rates:
        chosen = ids if len(rates) == 1 else ids[of_log == area.release_id]
        hits = count_of(source, chosen, grid, feedback)
        counts.append(counts_above(source, chosen, hits, grid, "energy", bounds, feedback))
    return [return_period(rate_with_interval([each[k] for each in counts], rates, logs)[0]) for k in range(len(bounds))]


def logs_needed(areas: Sequence[ReleaseArea], logs_per_event: int, scenario: float) -> int:
    """Logs of the run from which an area of this scenario [years] is supported, as if all areas were one."""
    share = min(1.0, 1.0 / (scenario * sum(each.events_per_year for each in areas)))
    return needed_for(1.0 - (1.0 - share) ** (1.0 / logs_per_event))


def intensities(
    any_passage: NDArray[np.float64], of_energies: Sequence[NDArray[np.float64]], scenarios: Sequence[float]
) -> list[NDArray[np.uint8]]:
    """For each scenario [years] the class of intensity of each cell, from 1; 0 where no log comes as often."""
    return [
        np.sum([years <= scenario for years in (any_passage, *of_energies)], axis=0).astype(np.uint8)
        for scenario in scenarios
    ]


def joint(by_scenario: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """10 times the highest class of intensity over the scenarios, plus the number of the first, from 1, that has it."""
    stack = np.stack(list(by_scenario))
    highest = stack.max(axis=0)
    return np.where(highest > 0, 10 * highest + stack.argmax(axis=0) + 1, 0).astype(np.uint8)
