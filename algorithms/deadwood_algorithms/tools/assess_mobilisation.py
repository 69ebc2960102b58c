"""Assess where a log could start to slide: susceptibility raster, candidate release areas, rated deadwood.

The susceptibility of a cell is the product of three factors between 0 and 1. All are taken at the scale of a log, from
a quadratic surface fitted to the heights in a window of ``--window-m`` around the cell (formulas in `relief.py`):

- drive, max(0, 1 - mu / tan(slope)): the share of the downslope pull of gravity that friction does not balance. It is 0
  where mu >= tan(slope), the paper's condition of sliding (section 6.1);
- steepness, from 0 at ``--slope-none-deg`` to 1 at ``--slope-full-deg``: the paper's logs all started on about 35° or
  more, however low the friction that reproduces them, because fine relief that friction does not represent holds logs;
- smoothness, from 1 on smooth ground to 0 at ``--roughness-limit-m``, the standard deviation of the heights about the
  fitted surface. That roughness holds logs is a finding of the paper; the limit is a judgement: set your own.

``--release-areas`` writes the connected ground above ``--threshold`` as polygons for ``sample-releases --areas``; the
raster serves as ``sample-releases --weights``. Gullies, the preferred tracks, are detected by the depth of the ground
across the slope (``gully_share`` of an area); they do not affect the susceptibility. ``--factors`` keeps slope,
roughness and depth.

``--assessed`` splits mapped ``--deadwood`` (points) into the layers ``candidates`` and ``others``. A candidate is on
susceptible ground and in the stage of decay in which wood is smooth but still strong, late stage II to early III (Maser
and Trappe). The stage is taken from a field ``decay_stage``, otherwise from ``years_dead`` and ``species`` (spruce: 2
to 5 years). Stages II and III without more detail, and unknown stages, count as candidates: the tool errs on the safe
side. A species is recognised by its scientific or common name (German, French, Italian, English). Downed beech and
Scots pine have ranges of years of their own, from rates of decay of downed wood; standing snags of these species (a
field ``standing``, 1 or 0) have none.

    deadwood-tool assess-mobilisation --dem sample_data/dem.tif --output susceptibility.tif \\
        --release-areas zones.gpkg --deadwood 'sample_data/sample.gpkg|layername=deadwood' --assessed deadwood.gpkg
    deadwood-tool sample-releases --areas zones.gpkg --dem sample_data/dem.tif --weights susceptibility.tif \\
        --logs-per-ha 30 --output releases.gpkg
    deadwood-tool sample-releases --areas 'deadwood.gpkg|layername=candidates' --dem sample_data/dem.tif \\
        --count 50 --output releases_mapped.gpkg

The tool does not model a trigger (storm, snow, felling), single boulders or stumps that hold a log, or a probability:
the numbers rank the ground. A DEM of any size is read in windows.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import following
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.results.identity import writing
from deadwood_algorithms.tools import sample_releases

MOST_WINDOW_CELLS = 1000


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = tool.terrain("Terrain (DEM)")
    friction: str | float = tool.number_or_layer(
        "Friction coefficient",
        default=0.25,
        minimum=0.0,
        help="A number, a raster, or polygons with a field 'friction' or 'mu'.",
    )
    window_m: float = tool.number(
        "Window of slope and roughness, about as long as a log bridges",
        unit="m",
        default=10.0,
        minimum=0.0,
        maximum=1000.0,
        exclusive=True,
    )
    slope_none_deg: float = tool.number(
        "Slope up to which the steepness factor is 0", unit="°", default=30.0, minimum=0.0, maximum=90.0
    )
    slope_full_deg: float = tool.number(
        "Slope from which the steepness factor is 1", unit="°", default=35.0, minimum=0.0, maximum=90.0
    )
    roughness_limit_m: float = tool.number(
        "Roughness at which no log starts", unit="m", default=1.0, minimum=0.0, exclusive=True
    )
    gully_window_m: float = tool.number(
        "Window of gullies", unit="m", default=20.0, minimum=0.0, maximum=1000.0, exclusive=True
    )
    gully_depth_m: float = tool.number(
        "Depth across the slope that makes a gully", unit="m", default=0.5, minimum=0.0, exclusive=True
    )
    threshold: float = tool.number(
        "Susceptibility of a release area", default=0.3, minimum=0.0, maximum=1.0, exclusive=True
    )
    min_area_m2: float = tool.number("Smallest release area", unit="m²", default=100.0, minimum=0.0)
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
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_raster("Susceptibility (.tif)")
    release_areas: str | None = tool.output_vector("Candidate release areas (.gpkg)", default=None)
    assessed: str | None = tool.output_vector(
        "Mapped deadwood, rated (.gpkg)", default=None, parts=("|layername=candidates", "|layername=others")
    )
    factors: str | None = tool.output_raster("Slope, roughness and gully depth (.tif)", default=None)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.dem_windows import open_windows
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.prepare.mobilisation.deadwood import DecayFields, read_deadwood
    from deadwood_algorithms.prepare.mobilisation.rasters import Limits, write_susceptibility
    from deadwood_algorithms.prepare.mobilisation.zones import zones
    from deadwood_algorithms.scene.friction import open_friction

    refuse_contradictions(ask)
    with ExitStack() as stack:
        outputs = stack.enter_context(writing(TOOL, ask, feedback))
        output, factors = outputs.file("output", ".tif"), outputs.optional_file("factors", ".tif")
        areas, assessed = outputs.optional_file("release_areas", ".gpkg"), outputs.optional_file("assessed", ".gpkg")
        dem = stack.enter_context(open_windows(ask.dem, crs=ask.crs, feedback=feedback))
        refuse_fine_cells(ask, dem.cell)
        friction = stack.enter_context(open_friction(ask.friction, dem, feedback))
        deadwood = read_deadwood(ask.deadwood, ask.crs, tool.taken(ask, DecayFields), dem, feedback)

        limits = tool.taken(ask, Limits)
        beside, mask = factors or output.with_name("factors.tif"), output.with_name("mask.tif")
        mean = write_susceptibility(
            output, beside, mask, dem, friction, deadwood, limits, feedback,
            keeps_factors=bool(factors), draws_areas=bool(areas),
        )  # fmt: skip
        lines = [f"susceptibility {mean:.3f} on average; {ask.threshold:g} and more counts as susceptible"]
        facts: dict[str, object] = {"susceptibility_mean": mean}
        judged = deadwood.split(ask.threshold) if deadwood else {}
        if areas:
            found = zones(mask, output, beside, dem.plan_crs, ask.min_area_m2, ask.gully_depth_m, feedback)
            if judged:
                points = np.asarray(judged["candidates"].geometry)
                owner = shapely.STRtree(np.asarray(found.geometry)).query(points, predicate="intersects")[1]
                found["n_candidates"] = np.bincount(owner, minlength=len(found))
            write_vector(areas, {"release_areas": found})
            hectares = float(found["area_m2"].to_numpy().sum()) / 1e4
            facts |= {"areas": len(found), "area_ha": hectares}
            lines.append(f"{counted(len(found), 'candidate release area')}, {hectares:.2f} ha")
        if assessed:
            write_vector(assessed, judged)
        if judged:
            counts = {name: len(frame) for name, frame in judged.items()}
            facts |= counts
            lines.append(f"{counts['candidates']} of {sum(counts.values())} mapped logs could start to slide")
        lines.append(limits.words(ask.friction))
        for each in (mask, beside):
            if each != factors:
                each.unlink(missing_ok=True)
    places = {name: getattr(ask, name) for name in ("output", "release_areas", "assessed", "factors")}
    starts = {"areas": ask.release_areas, "weights": None if areas else ask.output}
    then = following(sample_releases.TOOL, ask, **starts, deadwood=None, output="releases.gpkg")  # deadwood: no sizes
    return Outcome({name: Path(path) for name, path in places.items() if path}, facts, tuple(lines), then=then)


def refuse_contradictions(ask: Ask) -> None:
    if ask.slope_none_deg > ask.slope_full_deg:
        raise UserError(f"--slope-none-deg {ask.slope_none_deg:g} is above --slope-full-deg {ask.slope_full_deg:g}")
    if ask.years_from > ask.years_to:
        raise UserError(f"--years-from {ask.years_from:g} is above --years-to {ask.years_to:g}")
    if ask.assessed and not ask.deadwood:
        raise UserError("--assessed needs --deadwood, the mapped points that it rates")
    if ask.deadwood and not (ask.assessed or ask.release_areas):
        raise UserError("--deadwood needs --assessed, a file for its rating, or --release-areas")


def refuse_fine_cells(ask: Ask, cell: float) -> None:
    """Reject windows with too many cells: 10 m on cells of 1 mm would take days."""
    from deadwood_algorithms.files import remedies

    window = max(ask.window_m, ask.gully_window_m)
    if window / cell > MOST_WINDOW_CELLS:
        raise UserError(
            f"{ask.dem}: a window of {window:g} m spans {window / cell:.0f} cells, but must span at most "
            f"{MOST_WINDOW_CELLS}; fix: {remedies.coarser(ask.dem, window / MOST_WINDOW_CELLS * 2.0)}"
        )


TOOL = Tool(
    "assess-mobilisation",
    "Prepare",
    "Rate where a log could start to slide: raster, areas, deadwood",
    Ask,
    run,
)
