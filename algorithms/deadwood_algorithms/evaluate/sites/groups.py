"""Scattered releases in groups, each written as a separate layer and run as a site with its own window of the DEM.

A log keeps its number in the whole layer, and with it its random draws: the groups together equal the whole, log by
log.
"""

from __future__ import annotations

from pathlib import Path

import geopandas
import pandas as pd

from deadwood_algorithms.evaluate.sites.sites_table import SiteOptions, folder_name
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import field_names, id_column, where_of
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.releases import read_numbered


def sites_of_groups(
    dem: str, releases: str, field: str, crs: str | None, folder: Path, feedback: Feedback
) -> list[SiteOptions]:
    """One site for each value of a field of the releases; their layers are written into ``folder``."""
    frame = read_numbered(dem, releases, crs, feedback)
    column = next((str(each) for each in frame.columns if str(each).lower() == field.lower()), None)
    if column is None or column == "geometry":
        raise UserError(f"{where_of(frame)}: --by {field}: there is no such field; the layer has {field_names(frame)}")
    keys = pd.Series([str(each) for each in id_column(frame, column)], index=frame.index)
    folder.mkdir(parents=True, exist_ok=True)
    sites: dict[str, SiteOptions] = {}
    grouped = 0
    for key, rows in frame.groupby(keys, sort=False):
        name = _unlike(folder_name(str(key)), set(sites))
        place = folder / f"{name}.gpkg"
        _write_once(place, geopandas.GeoDataFrame(rows.reset_index(drop=True)))
        grouped += len(rows)
        sites[name.lower()] = SiteOptions(name, {"releases": str(place.absolute())})
    account("releases", count_of(len(frame), grouped, {}))
    return list(sites.values())


def _unlike(name: str, taken: set[str]) -> str:
    number, found = 1, name
    while found.lower() in taken:
        number += 1
        found = f"{name}_{number}"
    return found


def _write_once(place: Path, frame: geopandas.GeoDataFrame) -> None:
    """Write a layer unless an identical file exists, which keeps its time stamp."""
    beside = place.with_name(f".{place.name}")
    new = beside.with_suffix(".new.gpkg")
    new.unlink(missing_ok=True)
    write_vector(new, {"releases": frame})
    if place.is_file() and place.read_bytes() == new.read_bytes():
        new.unlink()
    else:
        new.replace(place)
