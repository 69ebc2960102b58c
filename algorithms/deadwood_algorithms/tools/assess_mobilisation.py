"""Assess where a log could start to slide: logs slide from all ground; the share that starts, by cell, and areas.

Logs of one size and posture are released all over the terrain, --logs-per-cell in each cell of --cell-m, and slide at
`draft`, each with the lowest, the middle and the highest friction of --friction-range. --output has for each cell, with
95 % intervals for the number of its logs:

- starts: the share that moves more than --start-m (an upright log that only falls over has not started);
- goes_far: the share that moves more than its own length, or --min-runout-m;
- reaches: the share that reaches one of --lines.

The frictions count as equally likely. The printed lines and the facts give each share with each friction. Logs that
leave the terrain model before it is known count as gone far, but not as arrived; --within restricts the starts
to ground that is far enough from its edges. `--release-areas` are connected cells in which at least --threshold
of the logs do what --areas-by names, with the shares of all their logs.

    deadwood-tool assess-mobilisation --dem sample_data/dem.tif --trees sample_data/trees.csv --logs-per-cell 2 \\
        --cell-m 20 --output mobilisation.tif --release-areas zones.gpkg
    deadwood-tool sample-releases --areas zones.gpkg --dem sample_data/dem.tif --weights mobilisation.tif \\
        --logs-per-ha 30 --output releases.gpkg

What holds a log on less than a cell of the terrain model (stones, stumps, roots, a hollow) is not modelled: the
shares are those of logs that nothing of this kind holds. Give mapped stumps, boulders and lying wood as --trees,
--blocks and --lying-logs. Nor is a trigger modelled (storm, snow, felling): a share is no probability per year.

``--assessed`` splits mapped ``--deadwood`` (points) by the ground into the layers ``candidates`` and ``others``. Its
decay is rated beside, and changes no share and no split: in late stage II to early III (Maser and Trappe) wood is
smooth but still strong, ``critical``. The stage is taken from a field ``decay_stage``, otherwise from ``years_dead``
and ``species`` (spruce: 2 to 5 years; beech and Scots pine by their rates of decay on the ground, which do not hold
for snags: a field ``standing``, 1 or 0, tells them). Species are recognised by scientific or common name (German,
French, Italian, English).

    deadwood-tool assess-mobilisation --dem sample_data/dem.tif --logs-per-cell 2 --cell-m 20 \\
        --deadwood 'sample_data/sample.gpkg|layername=deadwood' --assessed deadwood.gpkg --output mobilisation.tif
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import following
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.prepare.releases.logs import ORIENTATIONS, in_posture
from deadwood_algorithms.results.identity import writing
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.items import digest_of
from deadwood_algorithms.scene.released_scene import OpenScene
from deadwood_algorithms.schemas import DBH_CM, DENSITY_KG_M3, TREE_M
from deadwood_algorithms.stats.statistics import percent_of
from deadwood_algorithms.tools import sample_releases

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_windows import DemWindows
    from deadwood_algorithms.prepare.mobilisation.cells import Cells, Places
    from deadwood_algorithms.prepare.mobilisation.slides import Frictions
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases
    from deadwood_algorithms.simulate.steps import Steps

OUTCOMES = ("starts", "goes_far", "reaches")


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, OpenScene):
    friction: str | float = tool.number_or_layer(
        "Friction coefficient",
        default=0.25,
        minimum=0.0,
        help="A number, a raster, or polygons with a field 'friction' or 'mu'.",
    )
    friction_range: str | None = tool.text(
        "Range of the friction",
        default=None,
        help="Such as 0.2-0.3. Logs slide with both ends and with --friction. Default: 0.8 to 1.2 times --friction.",
    )
    dbh_cm: float = tool.number(
        "DBH of the logs", unit="cm", default=75.0, minimum=0.0, maximum=DBH_CM[1], exclusive=True
    )
    length_m: float = tool.number(
        "Length of the logs", unit="m", default=30.0, minimum=0.0, maximum=TREE_M[1], exclusive=True
    )
    density_kg_m3: float = tool.number(
        "Density of the logs", unit="kg/m³", default=300.0, minimum=0.0, maximum=DENSITY_KG_M3, exclusive=True
    )
    orientation: str = tool.choice("Posture of the logs", *ORIENTATIONS, default="upright")
    cell_m: float = tool.number(
        "Cell size of the result",
        unit="m",
        default=10.0,
        minimum=0.0,
        exclusive=True,
        help="Rounded to whole cells of the terrain model.",
    )
    logs_per_cell: int = tool.integer("Logs released in each cell", default=5, minimum=1, maximum=10_000)
    logs: int | None = tool.integer(
        "Logs to slide in all, at most",
        default=None,
        minimum=1,
        help="A random subset; cells without a log have no value. Default: all.",
    )
    within: str | None = tool.vector("Ground on which logs start", "polygon", default=None, help="Default: all of it.")
    start_m: float = tool.number("Distance that a log moves which starts", unit="m", default=5.0, minimum=0.0)
    min_runout_m: float | None = tool.min_runout("Distance beyond which a log goes far")
    areas_by: str = tool.choice("Outcome by which release areas are drawn", *OUTCOMES, default="goes_far")
    threshold: float = tool.number(
        "Smallest share of a cell's logs in a release area", default=0.1, minimum=0.0, maximum=1.0, exclusive=True
    )
    min_area_m2: float = tool.number("Smallest release area", unit="m²", default=100.0, minimum=0.0)
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="draft")
    deadwood: str | None = tool.vector("Mapped deadwood", "point", default=None)
    stage_field: str | None = tool.field_of(
        "deadwood", "Field of the stage of decay", default=None, help="Without it: decay_stage."
    )
    years_field: str | None = tool.field_of(
        "deadwood", "Field of the years since death", default=None, help="Without it: years_dead."
    )
    species_field: str | None = tool.field_of(
        "deadwood", "Field of the species", default=None, help="Without it: species."
    )
    standing_field: str | None = tool.field_of(
        "deadwood", "Field that is 1 if it stands, 0 if it lies", default=None, help="Without it: standing."
    )
    years_from: float = tool.number("Years since death from which spruce is smooth", default=2.0, minimum=0.0)
    years_to: float = tool.number("Years since death up to which spruce is strong", default=5.0, minimum=0.0)
    output: str = tool.output_raster("Shares of the logs by cell (.tif)")
    release_areas: str | None = tool.output_vector("Release areas (.gpkg)", default=None)
    assessed: str | None = tool.output_vector(
        "Mapped deadwood, rated (.gpkg)", default=None, parts=("|layername=candidates", "|layername=others")
    )
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.prepare.mobilisation.slides import Frictions
    from deadwood_algorithms.results.plan import result_or_plan

    refuse_contradictions(ask)
    times = len(Frictions.of(ask.friction, ask.friction_range).values)
    asked = replace(ask, release_areas=None, assessed=None, deadwood=None) if ask.plan else ask  # the pilot's outputs
    return result_or_plan(assess, asked, feedback, times=times, logs_there=partial(logs_on, ask, feedback))


def logs_on(ask: Ask, feedback: Feedback) -> int:
    from deadwood_algorithms.files.dem_windows import open_windows

    with open_windows(ask.dem, crs=ask.crs, feedback=feedback, look_through=False) as dem:
        return sum(each[0].size for each in places_of(ask, cells_of(ask, dem), feedback))


def assess(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.rasters import write_bands
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.prepare.mobilisation.cells import outcome_columns
    from deadwood_algorithms.prepare.mobilisation.deadwood import DecayFields, read_deadwood
    from deadwood_algorithms.prepare.mobilisation.slides import Distances, Frictions, slide_all
    from deadwood_algorithms.prepare.mobilisation.zones import zones
    from deadwood_algorithms.results.lost import warn_of_lost
    from deadwood_algorithms.schemas.files import MOBILISATION
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.simulation import open_simulation
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_engine import FIDELITIES

    frictions, inputs = Frictions.of(ask.friction, ask.friction_range), ask.inputs()
    if not frictions.of_layer:  # with the lowest logs go farthest and need the largest window
        inputs = replace(inputs, friction=frictions.values[0])
    where = ask.where(f"{TOOL.name}-{Path(ask.output).stem}")
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        output = outputs.file("output", ".tif")
        areas, assessed = outputs.optional_file("release_areas", ".gpkg"), outputs.optional_file("assessed", ".gpkg")
        simulation = opened.enter_context(open_simulation(inputs, FIDELITIES[ask.fidelity], where, feedback))
        cells = cells_of(ask, simulation.dem)
        deadwood = read_deadwood(ask.deadwood, ask.crs, tool.taken(ask, DecayFields), cells, feedback)
        places = places_of(ask, cells, feedback)
        say_cost(cells, places, len(frictions.values), feedback)

        def steps_of(layers: SceneLayers, released: Releases) -> Steps:
            where_from = digest_of(*(part for each in places for part in each))
            decided_by = {
                "--cell-m, --logs-per-cell, --logs, --within or --seed": where_from,
                "--friction-range or --orientation": [*frictions.values, ask.orientation],
                "inputs": file_digests(ask) if len(places) > 1 else [],  # the scene's digest is that of one block
            }
            identity = identity_of(simulation, layers, released, **decided_by)
            return Steps(ask.output, identity, resume=ask.resume, feedback=feedback)

        posed = partial(in_posture, ask.orientation, seed=ask.seed)
        distances = Distances(ask.start_m, ask.min_runout_m)
        slid = slide_all(simulation, cells, places, frictions, distances, posed, steps_of, feedback)
        grid, slope, number = cells.grid, cells.slopes(), slid.shares.logs.size
        logs, found = slid.shares.of(np.arange(number), number)
        by_cell = dict(outcome_columns(found)) | {"slope_deg": slope.ravel(), "n_logs": logs.astype(float)}
        empty = np.full(number, np.nan)  # without lines
        bands = {each.name: by_cell.get(each.name, empty).reshape(grid.shape) for each in MOBILISATION.bands}
        units = [each.unit for each in MOBILISATION.bands]
        like = {"units": units, "style": MOBILISATION.look, "raster": MOBILISATION.name}
        write_bands(output, bands, grid, nodata=np.nan, dtype="float32", **like)
        chosen = np.nan_to_num(by_cell[ask.areas_by]) >= ask.threshold
        band = slid.records(frictions, ask.orientation)
        facts: dict[str, object] = {"logs": int(logs.sum()), "n_left_dem": slid.lost, "friction_band": band}
        lines = shares_said(band, ask, frictions)
        del by_cell["n_logs"]
        judged = deadwood.split(chosen, by_cell) if deadwood else {}
        if areas:
            zone = zones(chosen.reshape(grid.shape), slid.shares, slope, grid, ask.min_area_m2)
            if judged:
                points = np.asarray(judged["candidates"].geometry)
                owner = shapely.STRtree(np.asarray(zone.geometry)).query(points, predicate="intersects")[1]
                zone["n_candidates"] = np.bincount(owner, minlength=len(zone))
            write_vector(areas, {"release_areas": zone})
            facts |= {"areas": len(zone), "area_ha": float(zone["area_m2"].to_numpy().sum()) / 1e4}
            share = f"{100 * ask.threshold:g} % or more of the logs {does(ask)[ask.areas_by]}"
            lines.append(f"{counted(len(zone), 'release area')}, {facts['area_ha']:.2f} ha: cells in which {share}")
        if assessed:
            write_vector(assessed, judged)
        if judged:
            counts = {name: len(frame) for name, frame in judged.items()}
            facts |= counts
            lines.append(f"{counts['candidates']} of {sum(counts.values())} mapped logs lie in such cells")
        warn_of_lost(slid.lost, int(logs.sum()) * len(frictions.values), ["they count as gone far"], feedback)
    slid.remove()
    kind = f"{ask.orientation}, {ask.dbh_cm:g} cm, {ask.length_m:g} m, {ask.density_kg_m3:g} kg/m³"
    lines += [
        f"assumed: {counted(int(logs.sum()), 'log')}, {kind}; friction {frictions.words()}, all equally likely",
        "not modelled: what holds a log on less than a cell of the terrain model, and what sets it going",
    ]
    named = {name: getattr(ask, name) for name in ("output", "release_areas", "assessed")}
    starts = {"areas": ask.release_areas, "weights": None if ask.release_areas else ask.output}
    then = following(sample_releases.TOOL, ask, **starts, deadwood=None, output="releases.gpkg")  # deadwood: no sizes
    return Outcome({name: Path(path) for name, path in named.items() if path}, facts, tuple(lines), then=then)


def refuse_contradictions(ask: Ask) -> None:
    if ask.years_from > ask.years_to:
        raise UserError(f"--years-from {ask.years_from:g} is above --years-to {ask.years_to:g}")
    if ask.assessed and not ask.deadwood:
        raise UserError("--assessed needs --deadwood, the mapped points that it rates")
    if ask.deadwood and not (ask.assessed or ask.release_areas):
        raise UserError("--deadwood needs --assessed, a file for its rating, or --release-areas")
    if ask.areas_by == "reaches" and not ask.lines:
        raise UserError("--areas-by reaches needs --lines, which logs may reach")


def cells_of(ask: Ask, dem: DemWindows) -> Cells:
    from deadwood_algorithms.prepare.mobilisation.cells import Cells

    return Cells(dem, max(1, round(ask.cell_m / dem.cell)))


def places_of(ask: Ask, cells: Cells, feedback: Feedback) -> list[Places]:
    """Where logs are released, by block."""
    from deadwood_algorithms.files.accounts import account, count_of
    from deadwood_algorithms.files.vectors import read_vector
    from deadwood_algorithms.scene.memory import LOG_BYTES, refuse_too_many
    from deadwood_algorithms.simulate.log_order import keep_by_hash

    fix = "use a larger --cell-m, fewer --logs-per-cell, or name the ground with --within"
    number = cells.shape[0] * cells.shape[1] * ask.logs_per_cell
    within = None
    if ask.within:
        kinds = {"geometry": ("polygon",), "target_crs": cells.dem.crs, "crs": ask.crs, "what": "ground"}
        frame = read_vector(ask.within, feedback=feedback, **kinds)
        account("within", count_of(len(frame), len(frame), {}))
        within = shapely.union_all(frame.geometry)
        number = int(min(number, within.area / cells.grid.cell**2 * ask.logs_per_cell))
    refuse_too_many(number, "logs", ask.dem, each=LOG_BYTES, fix=fix)
    found = cells.all_places(ask.logs_per_cell, ask.seed, within, feedback)
    log_id = np.concatenate([each[0] for each in found])
    if not log_id.size:
        raise UserError(f"{ask.within or ask.dem}: no log can be released there; check the CRS, or use a larger DEM")
    if ask.logs is None:
        return found
    kept = np.sort(log_id[keep_by_hash(log_id, ask.logs, ask.seed)])
    return [tuple(part[np.isin(each[0], kept)] for part in each) for each in found]


def say_cost(cells: Cells, places: list[Places], times: int, feedback: Feedback) -> None:
    logs = sum(each[0].size for each in places)
    covered = np.unique(np.concatenate([cells.of_places(*each[1:]) for each in places])).size
    feedback.note(
        f"{counted(covered, 'cell')} of {cells.grid.cell:g} m with {counted(logs, 'log')}, each with "
        f"{counted(times, 'friction')}: {logs * times} to slide (--plan states time and memory)"
    )


def file_digests(ask: Ask) -> list[str]:
    """The digest of every file that the scene is read from."""
    from deadwood_algorithms.files.identity import of_input

    names = ("dem", "friction", "trees", "barriers", "lying_logs", "blocks", "lines")
    paths = [path for path in (getattr(ask, each) for each in names) if path and number_of(path) is None]
    return [of_input(path)["sha256"] for path in paths]


def does(ask: Ask) -> dict[str, str]:
    far = "its own length" if ask.min_runout_m is None else f"{ask.min_runout_m:g} m"
    return {
        "starts": f"start (move more than {ask.start_m:g} m)",
        "goes_far": f"go far (more than {far})",
        "reaches": "reach a line",
    }


def shares_said(band: list[dict[str, Any]], ask: Ask, frictions: Frictions) -> list[str]:
    """A line for each outcome and, if there are several, each line: the share with each friction."""
    lines, told = [], dict.fromkeys((each["outcome"], each["line_id"]) for each in band)
    for name, line in told:
        if line is not None and sum(other is not None for _, other in told) == 1:
            continue
        of_it = [each for each in band if (each["outcome"], each["line_id"]) == (name, line)]
        shares = ", ".join(
            f"{percent_of(each['n_reach'], each['n_total'])} at {frictions.name(each['friction'])}" for each in of_it
        )
        what = does(ask)[name] if line is None else f"reach line {line}"
        lines.append(f"{what}: {shares}")
    return lines


TOOL = Tool(
    "assess-mobilisation",
    "Prepare",
    "Assess where a log could start to slide: raster, areas, deadwood",
    Ask,
    run,
)
