"""The logs of a question as rows of a releases layer, so that `slide-logs` reads the very same ones from the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from deadwood_algorithms.explore.questions import Question
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.releases.logs import directed
from deadwood_algorithms.prepare.releases.places import positions
from deadwood_algorithms.stats import draws

if TYPE_CHECKING:
    import geopandas

DECIMALS = 2  # of a drawn size, as `sample-releases` rounds
NAME = "explored"


def releases_layer(question: Question, defaults: Mapping[str, Any], grid: Grid) -> geopandas.GeoDataFrame:
    """One row for each log, numbered from 1: each draws from the seed and its own number, so the first of many logs are
    the same as of few. A thick log is long: one draw decides both sizes.

    defaults : of the columns that nothing draws (`DefaultLog`)
    """
    import geopandas

    row, sizes = np.arange(question.n), question.sizes
    places = positions(question.area, question.radius_m, question.seed, row, "the area that was drawn")
    if not grid.contains(*places.T).all():
        raise UserError("part of the area lies off the terrain model, or where it has no height; move it")
    share, _ = draws.uniforms(question.seed, row, draws.LOG_SIZE)
    columns = {
        "log_id": row + 1,
        "release_id": np.full(question.n, NAME, object),
        "dbh_cm": drawn(sizes.dbh_cm, share),
        "length_m": drawn(sizes.length_m, share),
        "density_kg_m3": np.full(question.n, sizes.density_kg_m3),
        "orientation": np.full(question.n, sizes.orientation, object),
        **{
            name: np.full(question.n, float(defaults[name]))
            for name in ("tilt_deg", "azimuth_deg", "speed_ms", "drop_m")
        },
    }
    directed(columns, row, question.seed)
    frame = geopandas.GeoDataFrame(columns, geometry=shapely.points(places), crs=grid.plan_crs)
    frame.attrs["where"] = "the logs that were released"
    return frame


def drawn(between: tuple[float, float], share: Any) -> Any:
    """Uniform draws between two numbers, rounded but never beyond them."""
    low, high = between
    return np.clip(np.round(low + share * (high - low), DECIMALS), low, high)
