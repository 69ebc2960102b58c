"""Data of a run for the report, read from its folder and, if they still exist, from its inputs.

A missing input is not an error: the page then lacks a layer, and states this (`ReportedRun.lacks`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pandas
import rasterio
import shapely
from numpy.typing import NDArray
from rasterio.errors import RasterioError
from rasterio.windows import Window

from deadwood_algorithms.files.dem_windows import open_windows
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.files.vectors import read_table, read_vector
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.results.arrivals import arrivals_frame, find_arrivals
from deadwood_algorithms.results.checked import WHOLE
from deadwood_algorithms.results.edges import Edges
from deadwood_algorithms.results.passages import Passages, barrier_passages, line_passages
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, input_paths, layers_in, read_run
from deadwood_algorithms.scene.items import ids_of
from deadwood_algorithms.scene.layers import read_lines
from deadwood_algorithms.schemas.looks import RUNS
from deadwood_algorithms.schemas.obstacles import STUMP_BELOW_M
from deadwood_algorithms.stats.endings import known_runouts

MARGIN = 0.06  # margin around the area covered by logs, as a share of its longer side
GROUND_CELLS = 800  # cells along the longer side of the terrain on the page
STRIP_CELLS = 4_000_000  # cells of the DEM read at once
HASHED_BYTES = 1 << 22  # bytes read at once
SHOWN_RASTERS = {
    "hits": "reach_probability",
    "speed": "speed_max",
    "energy": "energy_max",
    "jump": "jump_max",
    "danger": "danger",
}
Extent = tuple[float, float, float, float]  # west, south, east, north [m]


@dataclass
class Answers:
    """Results of other tools that the page shows for a run; empty if none were named.

    tree_effect : the rows of value-trees, by layer (values, planted)
    folders : by tool: the folder, its facts, and the tool's parameters
    varied_apart : inputs of vary that are not those of the run
    """

    tree_effect: dict[str, pandas.DataFrame] = field(default_factory=dict)
    folders: dict[str, tuple[Path, dict[str, Any], dict[str, Any]]] = field(default_factory=dict)
    varied_apart: list[str] = field(default_factory=list)


@dataclass
class ReportedRun:
    """A run with everything that the page shows of it.

    ground : the terrain around the logs, at reduced resolution; None if the DEM no longer exists
    dem_cell : cell size of the DEM in the run [m]
    scene : by input (trees, barriers, lying_logs, blocks), the layer in the run's CRS; absent if not given or missing
    rasters : by name in `SHOWN_RASTERS`, values at about the resolution of the ground, row 0 south, with their extent
    lacks : (phrase, its placeholders) for everything that could not be shown
    answers : results of other tools for the run, if any were named
    colour : the run's colour in every chart, by its place among the runs of the page
    relief_span : the light drawn black and white on its maps, of all runs of the page (`span_of_reliefs`)
    """

    name: str
    run: Run
    summary: dict[str, Any]
    extent: Extent
    ground: Grid | None
    scene: dict[str, geopandas.GeoDataFrame]
    rasters: dict[str, tuple[NDArray[np.float64], Extent]]
    lines: geopandas.GeoDataFrame | None
    reached_by: pandas.DataFrame
    arrivals: geopandas.GeoDataFrame | None
    tree_hits: pandas.DataFrame | None
    passages: list[Passages]
    inputs: list[tuple[str, str, str]]  # parameter, file, SHA-256
    lacks: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    answers: Answers = field(default_factory=Answers)
    colour: str = RUNS[0]
    relief_span: tuple[float, float] | None = None

    @property
    def dem_cell(self) -> float:
        return self.run.grid.cell

    @property
    def deposits(self) -> geopandas.GeoDataFrame:
        return self.run.deposits

    @property
    def runouts(self) -> NDArray[np.float64]:
        """Of all logs [m]; infinite without a deposit (`known_runouts`)."""
        return known_runouts(self.deposits["runout_m"].to_numpy(np.float64), self.deposits)

    def column(self, name: str) -> NDArray[np.float64]:
        """A column of the deposits as numbers, without missing values."""
        values = self.deposits[name].to_numpy(np.float64) if name in self.deposits else np.zeros(0)
        return values[np.isfinite(values)]

    def layer(self, name: str) -> geopandas.GeoDataFrame | None:
        """A layer of the run's GeoPackage, or None."""
        return _layer(self.run.path, name)


def read_reported_run(path: str, name: str, feedback: Feedback) -> ReportedRun:
    """Read a run's folder; missing inputs become a line of the report."""
    run = read_run(path, feedback=feedback)
    if not len(run.deposits):
        raise UserError(f"{path}: the run has no logs, so there is nothing to report")
    summary = run.summary(*WHOLE)
    lacks: list[tuple[str, dict[str, Any]]] = []
    lines = _layer(run.path, "reach")
    extent = shown_extent(run, lines)
    ground = _input(run, "dem", lacks, lambda place: read_ground(place, run, extent, feedback))
    scene = {}
    for each, kind in (("trees", "point"), ("barriers", "line"), ("lying_logs", "line"), ("blocks", "point")):
        found = _input(run, each, lacks, lambda place, kind=kind, each=each: _vector(place, kind, each, run))
        if found is not None:
            scene[each] = found
    if "trees" in scene and "height_m" in scene["trees"]:
        low = scene["trees"]["height_m"] < STUMP_BELOW_M
        kinds = {"trees": scene["trees"][~low], "stumps": scene.pop("trees")[low]}
        scene |= {kind: rows for kind, rows in kinds.items() if len(rows)}
    reached = _layer(run.path, "reached_by")
    if not run.stored_log_ids.size:
        lacks.append(("lacks_poses", {}))
    elif run.stored_log_ids.size < len(run.deposits):
        lacks.append(("lacks_some_poses", {"stored": run.stored_log_ids.size, "n": len(run.deposits)}))
    arrivals, passages = _arrivals(run, lines, lacks, feedback)
    return ReportedRun(
        name,
        run,
        summary,
        extent,
        ground,
        scene,
        read_rasters(run, extent),
        lines,
        pandas.DataFrame({"log_id": [], "line_id": []}) if reached is None else reached,
        arrivals,
        _layer(run.path, "tree_hits"),
        [*_barriers(run), *passages],
        hashed_inputs(run),
        lacks,
    )


def shown_extent(run: Run, lines: geopandas.GeoDataFrame | None) -> Extent:
    """Extent of the releases, the deposits, the stored trajectories and the nearest places of the lines, if those are
    no farther away than all this is long, with a margin, within the run's grid.
    """
    ends = shapely.get_coordinates(np.asarray(run.deposits.geometry))
    places = [run.deposits[["release_x", "release_y"]].to_numpy(np.float64), ends]
    if run.stored_log_ids.size:
        places.append(np.array(run.extent()).reshape(2, 2))
    everything = np.concatenate(places)
    everything = everything[np.isfinite(everything).all(axis=1)]
    if lines is not None and len(lines):
        everything = np.concatenate([everything, _near_places(lines, everything)])
    (west, south), (east, north) = everything.min(axis=0), everything.max(axis=0)
    room = MARGIN * max(east - west, north - south) + 20.0
    low, high = run.grid.bounds[:2], run.grid.bounds[2:]
    west, south = max(west - room, low[0]), max(south - room, low[1])
    return float(west), float(south), float(min(east + room, high[0])), float(min(north + room, high[1]))


def _near_places(lines: geopandas.GeoDataFrame, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each line the place nearest to these places, unless it is farther away than they are long."""
    (west, south), (east, north) = places.min(axis=0), places.max(axis=0)
    ways = shapely.shortest_line(lines.geometry.to_numpy(), shapely.box(west, south, east, north))
    near = ways[shapely.length(ways) <= max(east - west, north - south)]
    return shapely.get_coordinates(shapely.get_point(near, 0))


def read_ground(path: str, run: Run, extent: Extent, feedback: Feedback) -> Grid:
    """The terrain of an extent, averaged to few enough cells for a page."""
    with open_windows(path, crs=run.grid.crs.to_string(), feedback=Quiet(), look_through=False) as dem:
        columns = slice(*_cells(extent[0], extent[2], dem.x0, dem.cell, dem.shape[1]))
        rows = slice(*_cells(extent[1], extent[3], dem.y0, dem.cell, dem.shape[0]))
        ny, nx = rows.stop - rows.start, columns.stop - columns.start
        if ny < 2 or nx < 2:
            raise UserError(f"{path}: the terrain model does not cover the run")
        step = max(1, -(-max(nx, ny) // GROUND_CELLS))
        nx, ny = max(nx // step, 2), max(ny // step, 2)
        values = np.empty((ny, nx))
        at_once = max(1, STRIP_CELLS // (nx * step * step))
        for start in range(0, ny, at_once):
            stop = min(start + at_once, ny)
            part = slice(rows.start + start * step, rows.start + stop * step)
            fine = dem.grid(part, slice(columns.start, columns.start + nx * step)).values
            values[start:stop] = mean_of_blocks(fine, step)
            feedback.progress(stop, ny, "reading the terrain")
        shift = (step - 1) / 2.0
        x0, y0 = dem.x0 + (columns.start + shift) * dem.cell, dem.y0 + (rows.start + shift) * dem.cell
        return Grid(values, dem.cell * step, x0, y0, run.grid.crs, path)


def _cells(low: float, high: float, first: float, cell: float, number: int) -> tuple[int, int]:
    """The first cell of a row in an interval, and the first one after it."""
    start, stop = round((low - first) / cell + 0.5), round((high - first) / cell + 0.5)
    return max(0, min(start, number)), max(0, min(stop, number))


def mean_of_blocks(values: NDArray[np.float64], step: int) -> NDArray[np.float64]:
    """Mean of each block of step x step cells; over its finite values, NaN without any."""
    blocks = values.reshape(values.shape[0] // step, step, values.shape[1] // step, step)
    known = np.isfinite(blocks)
    count = known.sum(axis=(1, 3))
    total = np.where(known, blocks, 0.0).sum(axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def read_rasters(run: Run, extent: Extent) -> dict[str, tuple[NDArray[np.float64], Extent]]:
    """The run's rasters over an extent, at the resolution of the ground; shares by the mean, the others by the
    maximum.
    """
    found = {}
    for name, stem in SHOWN_RASTERS.items():
        path = run.path / f"{stem}.tif"
        if not path.is_file() and path.name not in run.manifest.get("files", {}):
            continue  # was never written; one that is gone is refused
        try:
            with rasterio.open(run.part(path.name)) as source:
                found[name] = thinned_raster(source, extent, np.nanmean if name in ("hits", "danger") else np.nanmax)
        except (RasterioError, ValueError):
            continue
    return found


def thinned_raster(source: Any, extent: Extent, gather: Callable) -> tuple[NDArray[np.float64], Extent]:
    import warnings

    cell, west, north = source.transform.a, source.transform.c, source.transform.f
    left, right = (min(max(round((at - west) / cell), 0), source.width) for at in (extent[0], extent[2]))
    top, bottom = (min(max(round((north - at) / cell), 0), source.height) for at in (extent[3], extent[1]))
    step = max(1, -(-max(right - left, bottom - top) // GROUND_CELLS))
    nx, ny = (right - left) // step, (bottom - top) // step
    if nx < 1 or ny < 1:
        raise ValueError("the raster does not cover the run")
    out = np.empty((ny, nx))
    at_once = max(1, STRIP_CELLS // (nx * step * step))
    for start in range(0, ny, at_once):
        stop = min(start + at_once, ny)
        window = Window(left, top + start * step, nx * step, (stop - start) * step)  # type: ignore[call-arg]
        fine = source.read(1, window=window, masked=True).astype(np.float64).filled(np.nan)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # for blocks without any value
            out[start:stop] = gather(fine.reshape(stop - start, step, nx, step), axis=(1, 3))
    x, y = west + left * cell, north - top * cell
    return out[::-1], (x, y - ny * step * cell, x + nx * step * cell, y)


def _input(run: Run, parameter: str, lacks: list, read: Callable[[str], Any]) -> Any:
    """An input of the run if it still exists; otherwise None, and a line in the report."""
    named = str(run.manifest.get("parameters", {}).get(parameter) or "")
    if not named:
        if parameter == "dem":
            lacks.append(("lacks_input", {"what": parameter, "path": "-", "reason": ""}))
        return None
    reason = ""
    for place in dict.fromkeys(str(each) for each in input_paths(run.path, run.manifest, parameter)):
        if not _stands(place):
            continue
        try:
            return read(place)
        except UserError as error:
            reason = str(error)
    lacks.append(("lacks_input", {"what": parameter, "path": named, "reason": reason}))
    return None


def _stands(place: str) -> bool:
    """Whether an input exists, with all the tiles that its path may name."""
    return Path(place.split("|")[0]).exists() or all(Path(each).exists() for each in place.split(","))


def _vector(place: str, kind: str, what: str, run: Run) -> geopandas.GeoDataFrame:
    """A layer of the scene, with the ids by which the run identifies its rows."""
    frame = read_vector(place, geometry=(kind,), target_crs=run.grid.crs, what=what, feedback=Quiet())
    names = {
        "trees": ("tree_id",),
        "barriers": ("barrier_id", "name"),
        "lying_logs": ("lying_id", "tree_id", "log_id"),
        "blocks": ("block_id", "name"),
    }
    frame["shown_id"] = [str(each) for each in ids_of(frame, *names[what])]
    return frame


def _layer(folder: Path, name: str) -> Any:
    if name not in layers_in(folder):
        return None
    return read_table(f"{folder / GEOPACKAGE}|layername={name}", what=name)


def _barriers(run: Run) -> list[Passages]:
    """How the logs arrive at the barriers; none if the file of the shape is missing, which `_arrivals` reports."""
    try:
        return list(barrier_passages(run))
    except UserError:
        return []


def _arrivals(
    run: Run, lines: Any, lacks: list, feedback: Feedback
) -> tuple[geopandas.GeoDataFrame | None, list[Passages]]:
    """How the logs arrive at the lines of the run; nothing without lines or trajectories."""
    if lines is None or not run.stored_log_ids.size:
        return None, []
    marks, items = read_lines(f"{run.path / GEOPACKAGE}|layername=reach", run.grid, Quiet())
    with Edges(run.grid, input_paths(run.path, run.manifest, "dem"), Quiet()) as edges:
        try:
            arrived = find_arrivals(run, marks, items, None, 0.0, feedback)
        except UserError as error:  # the file of the shape no longer exists
            lacks.append(("lacks_shape", {"reason": str(error)}))
            return None, []
        return arrivals_frame(run, arrived, items, edges), list(line_passages(run, arrived, items, edges))


def hashed_inputs(run: Run) -> list[tuple[str, str, str]]:
    """Name, file and SHA-256 of each input of the run as it was read then; for runs from before version 0.3, which did
    not record it, as it is now."""
    if "inputs" in run.manifest:
        return [
            (each["parameter"], one.get("name", each["path"]), str(one["sha256"]))
            for each in run.manifest["inputs"]
            for one in each.get("files", [each])
        ]
    rows = []
    for parameter in ("dem", "releases", "trees", "barriers", "lying_logs", "blocks", "lines", "friction", "shape"):
        for place in input_paths(run.path, run.manifest, parameter):
            if _stands(str(place)):
                named = str(run.manifest["parameters"][parameter])
                rows += [(parameter, *each) for each in _hashed(named, str(place), tiled=parameter == "dem")]
                break
    return rows


def _hashed(named: str, place: str, *, tiled: bool) -> list[tuple[str, str]]:
    """File and SHA-256 of an input, for a terrain model in tiles, of each tile; empty for any other folder."""
    files = tiles_of(place) if tiled else [place.split("|")[0]]
    if len(files) > 1:
        return [(each, sha256_of(Path(each))) for each in files]
    return [(named, sha256_of(Path(files[0])))] if Path(files[0]).is_file() else []


def sha256_of(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as source:
        while block := source.read(HASHED_BYTES):
            digest.update(block)
    return digest.hexdigest()


def paths_by_log(run: Run, wanted: NDArray[np.int64]) -> Mapping[int, dict[str, NDArray]]:
    """The kept poses of some logs, by log_id."""
    found: dict[int, dict[str, NDArray]] = {}
    for piece in run.poses(wanted):
        ids, starts = np.unique(piece["log_id"], return_index=True)
        order = np.argsort(starts)
        ends = np.append(starts[order][1:], piece["log_id"].size)
        for log, start, stop in zip(ids[order], starts[order], ends, strict=True):
            found[int(log)] = {name: values[start:stop] for name, values in piece.items()}
    return found


def read_over_runs(path: Path, sources: Any) -> tuple[NDArray[np.float64], Extent]:
    """A raster over the extent of all runs, averaged to fewer cells; row 0 south."""
    sides = np.array([each.extent for each in sources])
    (west, south), (east, north) = sides[:, :2].min(axis=0), sides[:, 2:].max(axis=0)
    with rasterio.open(path) as source:
        return thinned_raster(source, (west, south, east, north), np.nanmean)


def lying_radii(source: ReportedRun) -> NDArray[np.float64]:
    """Radii of the lying logs at the base and at the tip [m], shape (n, 2)."""
    frame = source.scene["lying_logs"]
    default = float(source.run.manifest.get("parameters", {}).get("lying_diameter_cm") or 40.0)
    named = next((each for each in ("diameter_cm", "dbh_cm") if each in frame), None)
    base = frame[named].fillna(default).to_numpy(np.float64) if named else np.full(len(frame), default)
    tip = frame["tip_diameter_cm"].to_numpy(np.float64) if "tip_diameter_cm" in frame else 0.5 * base
    return np.column_stack([base, tip]) / 200.0
