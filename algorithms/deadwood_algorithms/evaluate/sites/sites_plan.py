"""What the sites of a region will take, estimated from pilots of some of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from deadwood_algorithms.evaluate.sites.site_runs import site_stage
from deadwood_algorithms.evaluate.sites.sites_table import SiteOptions
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import Feedback, Stage, UserError
from deadwood_algorithms.results.forecast import Forecast, Pilot, forecast, refuse_too_large, together
from deadwood_algorithms.simulate.crew import NobodySlides

PILOTS = 8  # sites of which a part is slid; the others are assumed to behave like the nearest of these
LEAST_PILOT = 10  # logs of a site


def plan_sites(
    sites: Sequence[SiteOptions],
    releases: Sequence[str | None],
    pilot: Callable[[SiteOptions, int, Stage], Mapping[str, Any]],
    logs: int,
    output: str,
    feedback: Feedback,
) -> tuple[Forecast, int]:
    """The forecast of all sites together, and the number of pilots, evenly spread, that it rests on.

    releases : the layer of each site
    pilot : slides a given number of logs of a site and returns the facts of its ``--plan``
    logs : of all pilots together
    """
    spaced = min(PILOTS, len(sites))
    chosen = sorted({k * len(sites) // spaced for k in range(spaced)})
    plans: dict[int, Mapping[str, Any]] = {}
    for k in chosen:
        stage = site_stage(feedback, sites[k].name, k + 1, len(sites))
        try:
            if sites[k].fault:
                raise UserError(sites[k].fault)
            plans[k] = pilot(sites[k], max(LEAST_PILOT, logs // len(chosen)), stage)
        except NobodySlides:
            raise
        except UserError as error:
            stage.warn(str(error))
    if not plans:
        raise UserError("--plan: none of the sites can be slid; the lines above give the reasons")
    parts = [forecast_like(plans, k, layer) for k, layer in enumerate(releases)]
    found = together([each for each in parts if each is not None])
    refuse_too_large(found, output)
    return found, len(plans)


def forecast_like(plans: Mapping[int, Mapping[str, Any]], number: int, releases: str | None) -> Forecast | None:
    """A site's forecast, from its own pilot or that of the nearest site; None for a site whose logs cannot be read."""
    near = plans[min(plans, key=lambda k: abs(k - number))]
    own = {each.name: near[each.name] for each in fields(Forecast)}
    if number in plans:
        return Forecast(**own)
    if releases is None:
        return None
    try:
        logs = len(read_table(releases, what="releases"))
    except UserError:
        return None
    kept = round(near["kept"] * logs / near["logs"])
    like = forecast(Pilot(**near["pilot"]), logs, kept, threads=near["threads"], workers=near["workers"])
    return replace(like, pilot_logs=0)
