"""Draw the start positions of many logs inside release areas.

Gives the releases layer of ``slide-logs``: for every area the same number of logs, each at a place drawn uniformly by
area, inside the circle around a point (the paper: 10 m) or inside a polygon, holes left out. What the logs are like
comes from the options, or from columns of the areas layer of the same names, which go first.

Log k has the same id and place however many logs are drawn, for its draws come from the seed and its id alone; the ids
go round the areas (area 1, 2, ..., 1, 2, ...), so that a larger ``--count`` only adds logs.

It does not judge where wood could start to slide, and it draws no sizes: all logs of an area are alike.
Source: the paper, section 3.3 (small perturbations of the position are the statistical variable).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from deadwood_algorithms import draws, schemas, tool
from deadwood_algorithms.layers import (
    Grid,
    id_column,
    number_column,
    output_path,
    read_dem,
    read_vector,
    warn_implausible,
    where_of,
    write_vector,
)
from deadwood_algorithms.tool import Cancelled, Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    import geopandas

# Of the bounding box; below it the drawing would take for ever, and no release area is such a thread.
SLIMMEST_AREA = 1e-4
NUMBERS = ("dbh_cm", "length_m", "density_kg_m3", "tilt_deg", "azimuth_deg", "speed_ms", "drop_m")


@dataclass(frozen=True, kw_only=True)
class Ask:
    areas: str = tool.vector("Release points or polygons", "point", "polygon")
    dem: str = tool.raster("Terrain (DEM); its CRS is that of the output")
    count: int = tool.integer("Logs per area", default=2000, minimum=1, maximum=10**9)
    radius_m: float = tool.number("Radius of the circle around a point", unit="m", default=10.0, minimum=0.0)
    release_id_field: str | None = tool.text(
        "Field of the areas that names them", default=None, help="Without it: release_id, else the row number from 1."
    )
    dbh_cm: float = tool.number("DBH", unit="cm", default=75.0, minimum=0.0, exclusive=True)
    length_m: float = tool.number("Length", unit="m", default=30.0, minimum=0.0, exclusive=True)
    density_kg_m3: float = tool.number("Density", unit="kg/m³", default=300.0, minimum=0.0, exclusive=True)
    orientation: str = tool.choice("Orientation at the start", *schemas.ORIENTATIONS, default="upright")
    tilt_deg: float = tool.number("Tilt from the vertical", unit="°", default=0.0, minimum=0.0, maximum=180.0)
    azimuth_deg: float = tool.number(
        "Azimuth of tip and speed, from north", unit="°", default=0.0, minimum=0.0, maximum=360.0
    )
    speed_ms: float = tool.number("Initial speed", unit="m/s", default=0.0, minimum=0.0)
    drop_m: float = tool.number("Clearance above the terrain at the start", unit="m", default=0.0, minimum=0.0)
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Releases layer (.gpkg)")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    with output_path(ask.output, ask.overwrite, suffix=".gpkg", inputs=(ask.areas, ask.dem)) as temporary:
        grid = read_dem(ask.dem, crs=ask.crs, feedback=feedback)
        areas = read_vector(
            ask.areas,
            geometry=("point", "polygon"),
            target_crs=grid.crs,
            crs=ask.crs,
            what="releases",
            feedback=feedback,
        )
        names = release_ids(areas, ask.release_id_field)
        logs = log_columns(areas, ask, feedback)

        places = np.empty((len(areas), ask.count, 2))
        for row, shape in enumerate(areas.geometry):
            if feedback.cancelled():
                raise Cancelled
            log_id = row + len(areas) * np.arange(ask.count)
            places[row] = positions(shape, ask.radius_m, ask.seed, log_id, f"{where_of(areas)}, row {row + 1}")
            refuse_off_dem(places[row], grid, f"{where_of(areas)}, row {row + 1}")
            feedback.progress((row + 1) * ask.count, len(areas) * ask.count, "drawing release positions")

        x, y = places.transpose(2, 1, 0).reshape(2, -1)
        area_of = np.tile(np.arange(len(areas)), ask.count)
        columns = {"log_id": np.arange(x.size, dtype=np.int64), "release_id": names[area_of]}
        columns |= {name: values[area_of] for name, values in logs.items()}
        frame = geopandas.GeoDataFrame(columns, geometry=shapely.points(x, y), crs=grid.plan_crs)
        write_vector(temporary, {"releases": frame})
    return Outcome(
        {"output": Path(ask.output)},
        {"logs": x.size, "areas": len(areas)},
        (f"{x.size} logs in {len(areas)} release areas, {ask.count} each",),
    )


def positions(area: Any, radius: float, seed: int, log_id: np.ndarray, where: str) -> np.ndarray:
    """Places drawn uniformly in a point's circle or a polygon, for these logs [m], shape (n, 2).

    Each log draws from its own stream in the bounding box until it is inside: no other log has a say in it.
    """
    west, south, east, north = area.bounds
    circle = area.geom_type == "Point"
    if circle:
        west, south, east, north = west - radius, south - radius, east + radius, north + radius
    elif area.area <= SLIMMEST_AREA * (east - west) * (north - south):
        raise UserError(f"{where}: the polygon is too slim ({area.area:.3g} m2 in its extent); draw it wider")
    shapely.prepare(area)
    place = np.empty((log_id.size, 2))
    left, turn = np.arange(log_id.size), 0
    while left.size:
        u, v = draws.uniforms(seed, log_id[left], draws.LOG_PLACE, turn)
        x, y = west + u * (east - west), south + v * (north - south)
        if circle:
            inside = ((2 * u - 1) ** 2 + (2 * v - 1) ** 2 <= 1) | (radius == 0)
        else:
            inside = shapely.contains_xy(area, x, y)
        place[left[inside]] = np.column_stack((x, y))[inside]
        left, turn = left[~inside], turn + 1
    return place


def release_ids(areas: geopandas.GeoDataFrame, field: str | None) -> np.ndarray:
    """The name of each area: the field asked for, else ``release_id``, else the row number from 1."""
    if field and field not in areas:
        known = ", ".join(str(name) for name in areas.columns if name != "geometry") or "none"
        raise UserError(f"{where_of(areas)}: there is no field '{field}' (--release-id-field); the fields are {known}")
    field = field or ("release_id" if "release_id" in areas else None)
    return id_column(areas, field) if field else np.arange(1, len(areas) + 1)


def log_columns(areas: geopandas.GeoDataFrame, ask: Ask, feedback: Feedback) -> dict[str, np.ndarray]:
    """What the logs of each area are like: the areas' own columns, else the options."""
    columns: dict[str, np.ndarray] = {}
    for name in NUMBERS:
        column = schemas.RELEASES.column(name)
        columns[name] = number_column(
            areas,
            name,
            default=getattr(ask, name),
            minimum=column.minimum,
            exclusive=column.exclusive,
            maximum=column.maximum,
        )
        where = where_of(areas) if name in areas else "--" + name.replace("_", "-")
        warn_implausible(columns[name], column, where, feedback)
    columns["azimuth_deg"] %= 360.0
    words = np.full(len(areas), ask.orientation, object)
    if "orientation" in areas:
        words = np.array([str(word).strip().lower() for word in areas["orientation"]], object)
        for row, word in enumerate(words):
            fault = schemas.value_fault(schemas.RELEASES.column("orientation"), word)
            if fault:
                raise UserError(f"{where_of(areas)}, field 'orientation', row {row + 1}: {fault}")
    columns["orientation"] = words
    return {name: columns[name] for name in (c.name for c in schemas.RELEASES.columns) if name in columns}


def refuse_off_dem(place: np.ndarray, grid: Grid, where: str) -> None:
    on = grid.contains(place[:, 0], place[:, 1])
    if on.all():
        return
    x, y = place[np.argmin(on)]
    share = "every release position lies" if not on.any() else f"{(~on).sum()} of {on.size} release positions lie"
    raise UserError(
        f"{where}: {share} off the DEM or on its nodata (one at {x:.1f}, {y:.1f}; the DEM spans "
        "{:.1f} to {:.1f} east, {:.1f} to {:.1f} north)".format(*(grid.bounds[i] for i in (0, 2, 1, 3)))
        + "; check the area's CRS, clip it, or take a larger DEM"
    )


TOOL = Tool("sample-releases", "Prepare", "Draw release positions of logs in points or polygons", Ask, run)
