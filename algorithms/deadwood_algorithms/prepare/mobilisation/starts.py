"""The places of all logs of `assess_mobilisation`, from its options, and what is said of them before and after."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from deadwood_algorithms.files.accounts import account_on_dem
from deadwood_algorithms.files.dem_windows import DemWindows, open_windows
from deadwood_algorithms.files.identity import of_input
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.mobilisation.cells import Cells, Places
from deadwood_algorithms.prepare.mobilisation.options import StartOptions
from deadwood_algorithms.prepare.mobilisation.slides import Frictions
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.memory import LOG_BYTES, refuse_too_many
from deadwood_algorithms.simulate.log_order import keep_by_hash
from deadwood_algorithms.stats.statistics import percent_of


def logs_on(options: StartOptions, feedback: Feedback) -> int:
    with open_windows(options.dem, crs=options.crs, feedback=feedback, look_through=False) as dem:
        return sum(each[0].size for each in places_of(options, cells_of(options, dem), feedback))


def cells_of(options: StartOptions, dem: DemWindows) -> Cells:
    return Cells(dem, max(1, round(options.cell_m / dem.cell)))


def places_of(options: StartOptions, cells: Cells, feedback: Feedback) -> list[Places]:
    """Where logs are released, by block."""
    fix = "use a larger --cell-m, fewer --logs-per-cell, or name the ground with --within"
    number = cells.shape[0] * cells.shape[1] * options.logs_per_cell
    within = None
    if options.within:
        kinds = {"geometry": ("polygon",), "target_crs": cells.dem.crs, "crs": options.crs, "what": "ground"}
        frame = read_vector(options.within, feedback=feedback, **kinds)
        there = shapely.intersects(np.asarray(frame.geometry), shapely.box(*cells.surface))
        account_on_dem("within", there)
        within = shapely.union_all(frame.geometry)
        number = int(min(number, within.area / cells.grid.cell**2 * options.logs_per_cell))
    refuse_too_many(number, "logs", options.dem, each=LOG_BYTES, fix=fix)
    found = cells.all_places(options.logs_per_cell, options.seed, within, feedback)
    log_id = np.concatenate([each[0] for each in found])
    if not log_id.size:
        raise UserError(
            f"{options.within or options.dem}: no log can be released there; check the CRS, or use a larger DEM"
        )
    if options.logs is None:
        return found
    kept = np.sort(log_id[keep_by_hash(log_id, options.logs, options.seed)])
    mine = [np.isin(log_id, kept) for log_id, _, _ in found]
    return [(log_id[on], x[on], y[on]) for (log_id, x, y), on in zip(found, mine, strict=True)]


def say_cost(cells: Cells, places: list[Places], times: int, feedback: Feedback) -> None:
    logs = sum(each[0].size for each in places)
    covered = np.unique(np.concatenate([cells.of_places(*each[1:]) for each in places])).size
    feedback.note(
        f"{counted(covered, 'cell')} of {cells.grid.cell:g} m with {counted(logs, 'log')}, each with "
        f"{counted(times, 'friction')}: {logs * times} to slide (--plan states time and memory)"
    )


def file_digests(options: StartOptions) -> list[str]:
    """The digest of every file that the scene is read from."""
    names = ("dem", "friction", "trees", "barriers", "lying_logs", "blocks", "lines")
    paths = [path for path in (getattr(options, each) for each in names) if path and number_of(path) is None]
    return [of_input(path)["sha256"] for path in paths]


def does(options: StartOptions) -> dict[str, str]:
    far = "its own length" if options.min_runout_m is None else f"{options.min_runout_m:g} m"
    return {
        "starts": f"start (move more than {options.start_m:g} m)",
        "goes_far": f"go far (more than {far})",
        "reaches": "reach a line",
    }


def shares_said(band: list[dict[str, Any]], options: StartOptions, frictions: Frictions) -> list[str]:
    """A line for each outcome and, if there are several, each line: the share with each friction."""
    lines, told = [], dict.fromkeys((each["outcome"], each["line_id"]) for each in band)
    for name, line in told:
        if line is not None and sum(other is not None for _, other in told) == 1:
            continue
        of_it = [each for each in band if (each["outcome"], each["line_id"]) == (name, line)]
        shares = ", ".join(
            f"{percent_of(each['n_reach'], each['n_total'])} at {frictions.name(each['friction'])}" for each in of_it
        )
        what = does(options)[name] if line is None else f"reach line {line}"
        lines.append(f"{what}: {shares}")
    return lines
