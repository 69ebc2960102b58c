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
        --deadwood 'sample_data/sample.gpkg|layername=deadwood' --assessed deadwood.gpkg --output starts.tif
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import following
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.prepare.mobilisation.options import DecayFields, StartOptions
from deadwood_algorithms.prepare.releases.logs import ORIENTATIONS, in_posture
from deadwood_algorithms.results.identity import writing
from deadwood_algorithms.scene.items import digest_of
from deadwood_algorithms.tools import sample_releases

if TYPE_CHECKING:
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases
    from deadwood_algorithms.simulate.steps import Steps

OUTCOMES = ("starts", "goes_far", "reaches")


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, DecayFields, StartOptions):
    orientation: str = tool.choice("Posture of the logs", *ORIENTATIONS, default="upright")
    areas_by: str = tool.choice("Outcome by which release areas are drawn", *OUTCOMES, default="goes_far")
    threshold: float = tool.number(
        "Smallest share of a cell's logs in a release area", default=0.1, minimum=0.0, maximum=1.0, exclusive=True
    )
    min_area_m2: float = tool.number("Smallest release area", unit="m²", default=100.0, minimum=0.0)
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="draft")
    deadwood: str | None = tool.vector("Mapped deadwood", "point", default=None)
    output: str = tool.output_raster("Shares of the logs by cell (.tif)")
    release_areas: str | None = tool.output_vector("Release areas (.gpkg)", default=None)
    assessed: str | None = tool.output_vector("Mapped deadwood, rated (.gpkg)", default=None)
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.prepare.mobilisation.slides import Frictions
    from deadwood_algorithms.prepare.mobilisation.starts import logs_on
    from deadwood_algorithms.results.plan import result_or_plan

    refuse_contradictions(ask)
    times = len(Frictions.of(ask.friction, ask.friction_range).values)
    asked = replace(ask, release_areas=None, assessed=None, deadwood=None) if ask.plan else ask  # the pilot's outputs
    return result_or_plan(assess, asked, feedback, times=times, logs_there=partial(logs_on, ask, feedback))


def assess(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.rasters import write_bands
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.prepare.mobilisation import starts
    from deadwood_algorithms.prepare.mobilisation.cells import outcome_columns
    from deadwood_algorithms.prepare.mobilisation.deadwood import read_deadwood
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
        cells = starts.cells_of(ask, simulation.dem)
        deadwood = read_deadwood(ask.deadwood, ask.crs, tool.taken(ask, DecayFields), cells, feedback)
        places = starts.places_of(ask, cells, feedback)
        starts.say_cost(cells, places, len(frictions.values), feedback)

        def steps_of(layers: SceneLayers, released: Releases) -> Steps:
            where_from = digest_of(*(part for each in places for part in each))
            decided_by = {
                "--cell-m, --logs-per-cell, --logs, --within or --seed": where_from,
                "--friction-range or --orientation": [*frictions.values, ask.orientation],
                "inputs": starts.file_digests(ask)
                if len(places) > 1
                else [],  # the scene's digest is that of one block
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
        lines = starts.shares_said(band, ask, frictions)
        del by_cell["n_logs"]
        judged = deadwood.split(chosen, by_cell) if deadwood else {}
        if areas:
            zone = zones(chosen.reshape(grid.shape), slid.shares, slope, grid, ask.min_area_m2, cells.surface)
            if judged:
                points = np.asarray(judged["candidates"].geometry)
                owner = shapely.STRtree(np.asarray(zone.geometry)).query(points, predicate="intersects")[1]
                zone["n_candidates"] = np.bincount(owner, minlength=len(zone))
            write_vector(areas, {"release_areas": zone})
            facts |= {"areas": len(zone), "area_ha": float(zone["area_m2"].to_numpy().sum()) / 1e4}
            share = f"{100 * ask.threshold:g} % or more of the logs {starts.does(ask)[ask.areas_by]}"
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
    drawn = {"areas": ask.release_areas, "weights": None if ask.release_areas else ask.output}
    then = following(sample_releases.TOOL, ask, **drawn, deadwood=None, output="releases.gpkg")  # deadwood: no sizes
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


TOOL = Tool(
    "assess-mobilisation",
    "Prepare",
    "Assess where a log could start to slide: raster, areas, deadwood",
    Ask,
    run,
)
