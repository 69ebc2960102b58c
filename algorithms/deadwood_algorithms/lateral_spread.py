"""Measure how wide the deposits of each release fan out: their azimuths, and the smallest angle that holds them all.

The angle is seen from the centre of the release area (paper, equation 11), and counts across north: 350 and 10 degrees
span 20. Deposits nearer than the least run-out are left out, because the azimuth of a log that hardly moved means
nothing. The smallest angle grows with the number of logs, since one stray log decides it; to compare runs of different
size, take the range from the 5 % to the 95 % quantile beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from deadwood_algorithms import tool
from deadwood_algorithms.statistics import arc_start, spread_of_release
from deadwood_algorithms.tool import Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    import geopandas

NEEDED = ("release_x", "release_y")
ARC_STEP_DEG = 2.0


@dataclass(frozen=True, kw_only=True)
class Ask:
    deposits: str = tool.vector("Deposits of slide-logs, or the folder of its run", "point")
    min_runout: float | None = tool.number(
        "Deposits nearer than this do not count",
        unit="m",
        default=None,
        minimum=0.0,
        help="Default: one log length, from the field length_m.",
    )
    output: str = tool.output_vector("Spread of each release, and the azimuth of each deposit")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.layers import id_column, number_column, output_path, read_vector, where_of, write_vector

    with output_path(ask.output, ask.overwrite, suffix=".gpkg", inputs=[ask.deposits]) as path:
        source = layer_of(ask.deposits)
        deposits = read_vector(source, geometry=("point",), target_crs=None, what="deposits", feedback=feedback)
        release_x, release_y = (number_column(deposits, name) for name in NEEDED)
        if ask.min_runout is None and "length_m" not in deposits:
            raise UserError(f"{where_of(deposits)}: the deposits have no field 'length_m'; give --min-runout")
        if ask.min_runout is None:
            nearest = number_column(deposits, "length_m", minimum=0.0)
        else:
            nearest = np.full(len(deposits), ask.min_runout)
        release_id = id_column(deposits, "release_id") if "release_id" in deposits else np.zeros(len(deposits))

        records, azimuths = spreads(deposits, release_id, release_x, release_y, nearest)
        write_vector(path, {"spread": records, "azimuths": azimuths})
    facts = [{name: row[name] for name in row if name != "geometry"} for row in records.to_dict("records")]
    shown = tuple(
        f"release {row['release_id']}: spread {row['spread_deg']:.1f}° (5 to 95 %: {row['p05_p95_deg']:.1f}°), "
        f"{row['n'] - row['n_left_out']} of {row['n']} deposits"
        for row in facts
    )
    return Outcome({"output": Path(ask.output)}, {"spread": facts}, shown)


def layer_of(deposits: str) -> str:
    """The layer of deposits in a run's folder or its GeoPackage; any other layer as it was named."""
    path = Path(deposits)
    package = path / "run.gpkg" if path.is_dir() else path
    return f"{package}|layername=deposits" if package.name == "run.gpkg" else deposits


def spreads(
    deposits: geopandas.GeoDataFrame, release_id: Any, release_x: Any, release_y: Any, nearest: Any
) -> tuple[geopandas.GeoDataFrame, geopandas.GeoDataFrame]:
    """One sector a release, and one point a deposit."""
    import geopandas

    x, y = deposits.geometry.x.to_numpy(), deposits.geometry.y.to_numpy()
    rows: list[dict[str, Any]] = []
    angle, distance, used = np.zeros(x.size), np.zeros(x.size), np.zeros(x.size, bool)
    for each in dict.fromkeys(release_id.tolist()):
        member = release_id == each
        centre = float(release_x[member].mean()), float(release_y[member].mean())
        record, angle[member], used[member] = spread_of_release(centre, x[member], y[member], nearest[member])
        distance[member] = np.hypot(x[member] - centre[0], y[member] - centre[1])
        counted = member & used
        low = arc_start(angle[counted])
        far = float(distance[counted].max()) if counted.any() else 0.0
        shape = sector(centre, far, low, record["spread_deg"]) if counted.any() else shapely.Polygon()
        rows.append({"release_id": each, **record, "from_deg": low, "runout_max_m": far, "geometry": shape})
    points = geopandas.GeoDataFrame(
        {
            "log_id": deposits["log_id"] if "log_id" in deposits else np.arange(x.size),
            "release_id": release_id,
            "azimuth_deg": angle,
            "distance_m": distance,
            "counted": used,
        },
        geometry=np.asarray(deposits.geometry),
        crs=deposits.crs,
    )
    return geopandas.GeoDataFrame(rows, geometry="geometry", crs=deposits.crs), points


def sector(centre: tuple[float, float], radius: float, low: float, width: float) -> shapely.Polygon:
    """The sector of a circle from azimuth ``low`` over ``width`` degrees clockwise, for the map."""
    steps = max(2, int(np.ceil(width / ARC_STEP_DEG)) + 1)
    angles = np.radians(low + np.linspace(0.0, width, steps))
    arc = np.column_stack([centre[0] + radius * np.sin(angles), centre[1] + radius * np.cos(angles)])
    return shapely.Polygon(np.vstack([centre, arc, centre]))


TOOL = Tool("lateral-spread", "Evaluate", "Deposits: azimuths and lateral spread of each release", Ask, run)
