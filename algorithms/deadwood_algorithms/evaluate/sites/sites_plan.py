"""What the sites of a region will take, estimated from those that were looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.forecast import Forecast, Pilot, forecast


def forecast_like(plans: Mapping[int, Mapping[str, Any]], number: int, releases: str | None) -> Forecast | None:
    """A site's forecast, from its own pilot or that of the nearest site; None for one whose logs cannot be read."""
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
