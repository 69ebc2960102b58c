"""Count from stored trajectories how many logs pass each cell, and how fast: any subset of logs, any cell size.

The count is that of slide-logs: a log counts once in every cell that any part of its plan-view outline overlaps at any
time (paper, section 4). With all trajectories stored, every log chosen and the run's own cell size it equals the run's
hit_count.tif. Logs whose trajectory was not stored cannot be counted; the tool reports their number.

--speed, --energy and --jump write quantiles for each cell, one band each: of the largest value of each log in the cell,
over the logs that pass it. Speed is that of the centre of mass; energy is the sum of translation and rotation, from the
stored poses (within a few percent of the run's); jump is the clearance of the log. Cells that too few logs pass are
empty: 50 % needs 6, 95 % 72, 99 % 368.

--danger writes the share of passing logs that later reach a line of --reaching (default: the run's own lines), at that
moment or later: band 1 for any line, band 2 the number that passed, then a band for each line. Cells that fewer than
--danger-least logs pass are transparent. With all trajectories stored and the run's own lines and cells it equals the
run's danger.tif.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 --trajectories all \\
        --output run
    deadwood-tool count-hits --run run --cell-m 2 --output hits.tif --energy energy.tif --quantiles 50,95
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from deadwood_algorithms.results.run_folder import Run
    from deadwood_algorithms.scene.items import Items
    from deadwood_engine import Lines

CELLS_MOST = 4_000_000_000 // 4  # a raster of 4 GB; a larger one is due to a misplaced decimal point
CELLS_HELD = 25_000_000  # of a larger raster only the window with the run's logs is held in memory


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run", help="Written by slide-logs.")
    cell_m: float | None = tool.number(
        "Cell size", unit="m", default=None, minimum=0.0, exclusive=True, help="Default: the run's."
    )
    release_id: str | None = tool.text("Only logs of these releases", default=None, help="Comma-separated.")
    log_id: str | None = tool.text("Only these logs", default=None, help="Comma-separated.")
    stop_reason: str | None = tool.text(
        "Only logs with these stop reasons",
        default=None,
        help="Comma-separated: rest, tree, barrier, left_dem, time_limit, failed.",
    )
    quantiles: tuple[float, ...] = tool.numbers(
        "Quantiles of the rasters below",
        50.0,
        90.0,
        95.0,
        99.0,
        unit="%",
        minimum=0.0,
        maximum=100.0,
        help="A band each.",
    )
    speed: str | None = tool.output_raster("Quantiles of the logs' largest speed in each cell", default=None)
    energy: str | None = tool.output_raster("Quantiles of their largest kinetic energy", default=None)
    jump: str | None = tool.output_raster("Quantiles of their largest clearance above the terrain", default=None)
    danger: str | None = tool.output_raster(
        "Share of the logs that reach lines after the cell",
        default=None,
        help="Bands: any line, number of logs that passed, each line.",
    )
    reaching: str | None = tool.vector(
        "Roads, railways, houses of that raster", "line", "polygon", default=None, help="Default: the lines of the run."
    )
    danger_least: int = tool.integer(
        "Minimum number of passing logs for which a cell has a value", default=10, minimum=1, advanced=True
    )
    output: str = tool.output_raster("Hit counts")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.rasters import write_bands, write_raster
    from deadwood_algorithms.results.cell_quantiles import QUANTITIES, cell_quantiles
    from deadwood_algorithms.results.hit_counts import count_of
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.run_folder import chosen_logs, read_run
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.schemas.files import HITS

    if ask.reaching and not ask.danger:
        raise UserError("--reaching sets the lines of --danger; add --danger FILE.tif")
    levels = [each / 100.0 for each in ask.quantiles]
    given = {name: getattr(ask, name) for name in QUANTITIES if getattr(ask, name)}
    with ExitStack() as stack:
        made = stack.enter_context(writing(TOOL, ask, feedback))
        path = made.file("output", ".tif")
        more = {name: made.file(name, ".tif") for name in given}
        end = made.optional_file("danger", ".tif")
        source = read_run(ask.run, feedback=feedback)
        reach_of = lines_to_reach(ask, source, feedback) if end else None
        grid = visited(with_cell(source.grid, ask.cell_m), source)
        chosen = chosen_logs(source, release_id=ask.release_id, log_id=ask.log_id, stop_reason=ask.stop_reason)

        stored = np.intersect1d(chosen, source.stored_log_ids)
        if not stored.size:
            raise UserError(
                f"{ask.run}: of the {chosen.size} chosen logs none has a stored trajectory; "
                "run slide-logs with --trajectories all"
            )
        if stored.size < chosen.size:
            words = f"only {stored.size} of the {chosen.size} chosen logs have a stored trajectory and are counted"
            feedback.warn(words, code="some-trajectories", stored=stored.size, logs=chosen.size)

        counts = count_of(source, stored, grid, feedback)
        write_raster(
            path, counts, grid, dtype="uint32", units="logs", description="hits", style=HITS.look, raster=HITS.name
        )
        found = cell_quantiles(source, stored, counts, grid, list(more), levels, feedback) if more else {}
        for name, place in more.items():
            bands = {f"{name}, {100 * level:g} %": band for level, band in zip(levels, found[name], strict=True)}
            units = [QUANTITIES[name]] * len(bands)
            write_bands(place, bands, grid, nodata=np.nan, dtype="float32", units=units, style=name, raster=name)
        if end and reach_of:
            write_danger(end, source, stored, grid, *reach_of, ask.danger_least, feedback)
    facts = {"n_chosen": int(chosen.size), "n_counted": int(stored.size), "hit_count_max": int(counts.max())}
    line = f"{counted(stored.size, 'log')} counted; the most in one cell of {grid.cell:g} m: {counts.max()}"
    outputs = {"output": Path(ask.output)} | {name: Path(place) for name, place in given.items()}
    outputs |= {"danger": Path(ask.danger)} if ask.danger else {}
    return Outcome(outputs, facts, (line, *lines_of_run(source)))


def lines_to_reach(ask: Ask, source: Run, feedback: Feedback) -> tuple[Lines, Items]:
    """The requested lines, or those of the run."""
    from deadwood_algorithms.results.run_folder import GEOPACKAGE, layers_in
    from deadwood_algorithms.scene.layers import read_lines

    if not ask.reaching and "reach" not in layers_in(source.path):
        raise UserError(f"{ask.run}: the run has no roads, railways or houses; name them with --reaching LAYER")
    return read_lines(
        ask.reaching or f"{source.path / GEOPACKAGE}|layername=reach", source.grid, feedback, parameter="reaching"
    )


def write_danger(
    path: Path,
    source: Run,
    stored: NDArray[np.int64],
    grid: Grid,
    lines: Lines,
    items: Items,
    least: int,
    feedback: Feedback,
) -> None:
    from deadwood_algorithms.files.rasters import write_bands
    from deadwood_algorithms.results.danger import bands_by_rows, danger_of, units_of
    from deadwood_algorithms.schemas.files import DANGER

    passed, danger = danger_of(source, stored, grid, lines, items, feedback)
    bands = bands_by_rows(passed, danger, items.ids, least)
    units = units_of(list(bands))
    write_bands(path, bands, grid, nodata=np.nan, dtype="float32", units=units, style=DANGER.look, raster=DANGER.name)


def with_cell(grid: Grid, cell: float | None) -> Grid:
    """A grid with another cell size over the same area, with the same south-west corner."""
    if cell is None or cell == grid.cell:
        return grid
    west, south, east, north = grid.bounds
    nx, ny = (max(1, math.ceil((high - low) / cell - 1e-9)) for low, high in ((west, east), (south, north)))
    return Grid.empty((ny, nx), cell, west + 0.5 * cell, south + 0.5 * cell, grid.crs, grid.path)


def visited(grid: Grid, source: Run) -> Grid:
    """The window of a large grid in which any stored log ever was; a small grid unchanged."""
    part = grid.part
    if part.cells > CELLS_HELD:
        west, south, east, north = source.extent()
        column, row = int((west - grid.x0) // grid.cell) - 1, int((south - grid.y0) // grid.cell) - 1
        columns, rows = int((east - grid.x0) // grid.cell) + 3 - column, int((north - grid.y0) // grid.cell) + 3 - row
        part = Part(column, row, columns, rows).cut_to(grid.shape)
    if part.cells > CELLS_MOST:
        raise UserError(
            f"--cell-m {grid.cell:g} makes a raster of {part.columns} x {part.rows} cells; use a larger cell"
        )
    return grid if part == grid.part else grid.window(part)


TOOL = Tool(
    "count-hits",
    "Evaluate",
    "Count the logs that pass each cell, how fast and how high",
    Ask,
    run,
    then="deadwood-tool map-intensity --run {run} --output intensity",
)
