"""A ready QGIS project of a run, ``project.qgz``, written without QGIS: layers, groups, styles, temporal settings, and
a 3-D view.

A .qgz is a zip with one XML file. The layers are those of the run's folder, each with the style that is stored with it
(`styles`), and ``scene.gpkg``, which this writes beside them: the scene as it was modelled, the animated outlines of
the logs and the logs as solids. Only the terrain model is not copied.
"""

from __future__ import annotations

import os
import re
import sqlite3
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

import geopandas
import numpy as np
import shapely

from deadwood_algorithms.files import qml, styles
from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.files.tiles import mosaic_of
from deadwood_algorithms.files.vectors import read_vector, write_vector
from deadwood_algorithms.params.final_place import saved_place
from deadwood_algorithms.params.tool import Feedback, Quiet
from deadwood_algorithms.results import outlines as log_outlines
from deadwood_algorithms.results import qgis_layout
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, read_run

if TYPE_CHECKING:
    import pyproj

    from deadwood_algorithms.scene.inputs import SceneInputs
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases

PROJECT, SCENE, TERRAIN = "project.qgz", "scene.gpkg", "terrain.vrt"
DAY = (2000, 1, 1, 0, 0, 0)
# Title and layers of each group, from the top down; all other layers go to the first group.
GROUPS = (
    (
        "Results",
        (
            "reach",
            "reached_by",
            "barrier_arrivals",
            "barrier_hits",
            "tree_hits",
            "lying_hits",
            "block_hits",
            "deposits",
            "deposited_logs",
            "trajectories",
        ),
    ),
    ("Animation", ("log_outlines", "log_solids")),
    ("Scene", ("lines", "releases", "barriers", "lying_logs", "blocks", "trees")),
    ("Rasters", ("hit_count", "reach_probability", "danger", "deposit_count", "speed_max", "energy_max", "jump_max")),
)
SHOWN = (
    "reach",
    "deposits",
    "lines",
    "barriers",
    "lying_logs",
    "blocks",
    "trees",
    "hit_count",
    "log_outlines",
    "log_solids",
)
# For the 3-D view: objects standing on the terrain, and layers draped over it, which are a map theme. The animation is
# in neither: QGIS 3.22's 3-D view ignores the time, and would show all of it at once.
SOLID = ("trees", "barriers", "blocks", "log_solids")
DRAPED = ("reach", "lines", "hit_count", "terrain")
# Logs at rest: during an animation each is shown from the moment at which it came to rest.
AT_REST = ("deposits", "deposited_logs", "log_solids")
PRINTED = ("reach", "deposits", "lines", "barriers", "lying_logs", "blocks", "trees", "hit_count", "terrain")
THEME = "Draped over the terrain in 3D"
TITLES = {"log_outlines": "Logs in motion", "log_solids": "Logs at rest", "lines": "Roads, railways, houses"}
LEGEND_TITLES = {
    "reach": "Share of the logs that reach it",
    "deposits": "Logs at rest",
    "hit_count": "Logs that pass a cell",
}
Named = Callable[[qml.Label], str]  # translates a name in the project, or the label of a class
MARGIN = 0.1  # margin around the results, as a share of their extent


@dataclass(frozen=True)
class Entry:
    """A layer of the project: its place, relative to the project, and its style."""

    name: str
    source: str
    style: str
    labelled: bool = False
    geometry: str = ""  # Point, Line or Polygon; none for a raster

    @property
    def id(self) -> str:
        return f"deadwood_{self.name}"

    @property
    def title(self) -> str:
        return TITLES.get(self.name, self.name.replace("_", " ").capitalize())


def add_project(
    folder: Path,
    final: Path,
    inputs: SceneInputs,
    layers: SceneLayers,
    releases: Releases,
    outline_every_s: float,
    words_of: Callable[[Run, str, pyproj.CRS], qgis_layout.SheetWords],
    feedback: Feedback,
) -> None:
    """Write the project and its scene into the otherwise complete folder of a run, whose final place is ``final``."""
    run = read_run(str(folder), feedback=feedback)
    frames = scene_frames(inputs, layers, releases, run)
    step = outline_every_s
    if run.stored_log_ids.size:
        frames["log_outlines"], step = log_outlines.outlines(run, outline_every_s, feedback)
    write_vector(folder / SCENE, frames)
    entries = [*_package(folder, GEOPACKAGE), *_package(folder, SCENE), *_rasters(folder)]
    terrain = Entry("terrain", _terrain(inputs.dem, folder, final), qml.relief_shading())
    last_s = float(run.deposits["duration_s"].to_numpy().max()) + log_outlines.STAYS_S
    words = words_of(run, final.name, layers.dem.plan_crs)
    text = project_xml(entries, terrain, layers.dem.plan_crs, _extent(run), _height(run), last_s, step, words)
    with zipfile.ZipFile(folder / PROJECT, "w", zipfile.ZIP_DEFLATED) as target:
        entry = zipfile.ZipInfo(Path(PROJECT).with_suffix(".qgs").name, DAY)
        entry.compress_type = zipfile.ZIP_DEFLATED
        target.writestr(entry, text)


def scene_frames(
    inputs: SceneInputs, layers: SceneLayers, releases: Releases, run: Run
) -> dict[str, geopandas.GeoDataFrame]:
    """The scene as it was modelled, in the run's CRS, and the logs at rest as solids."""

    def frame(columns: dict, shapes: object) -> geopandas.GeoDataFrame:
        return geopandas.GeoDataFrame(columns, geometry=shapes, crs=run.deposits.crs)

    released = {"log_id": releases.logs.log_id, "release_id": releases.release_id}
    frames = {"releases": frame(released, shapely.points(releases.x, releases.y))}
    trees = layers.trees
    if len(layers.tree_ids):
        columns = {"tree_id": layers.tree_ids, "dbh_cm": layers.tree_dbh_cm, "height_m": trees.height}
        frames["trees"] = frame(columns, shapely.points(trees.x, trees.y))
    blocks = layers.blocks.solid
    if layers.blocks.ids:
        columns = {"block_id": layers.blocks.ids, "diameter_m": blocks.diameter, "height_m": blocks.height}
        frames["blocks"] = frame(columns, shapely.points(blocks.x, blocks.y))
    for name, path in (("barriers", inputs.barriers), ("lying_logs", inputs.lying_logs)):
        if path:  # as in the file, with their heights and diameters
            frames[name] = read_vector(path, geometry=("line",), target_crs=layers.dem.crs, what=name, feedback=Quiet())
    if layers.lines.ids:
        frames["lines"] = frame({"line_id": layers.lines.ids}, layers.lines.geometry)
    frames["log_solids"] = _solids(run)
    return frames


def _solids(run: Run) -> geopandas.GeoDataFrame:
    axes = geopandas.read_file(run.path / GEOPACKAGE, layer="deposited_logs")
    ends = shapely.get_coordinates(np.asarray(axes.geometry), include_z=True).reshape(-1, 2, 3)
    nothing = np.zeros(len(axes))
    where = log_outlines.Ends(axes["log_id"].to_numpy(), nothing, nothing, ends[:, 0], ends[:, 1], *run.radii())
    columns = {name: axes[name] for name in ("log_id", "release_id", "stop_reason")}
    columns["duration_s"] = run.deposits.set_index("log_id")["duration_s"].reindex(axes["log_id"]).to_numpy()
    return geopandas.GeoDataFrame(columns, geometry=log_outlines.solids(where), crs=run.deposits.crs)


# --- content of the folder ----------------------------------------------------------------------------------------


def _package(folder: Path, name: str) -> Iterator[Entry]:
    """The layers of a GeoPackage with their stored styles."""
    with closing(sqlite3.connect(folder / name)) as database:
        kinds = dict(database.execute("SELECT table_name, geometry_type_name FROM gpkg_geometry_columns"))
        stored = dict(database.execute(f"SELECT f_table_name, styleQML FROM {styles.TABLE}"))
    for layer, kind in kinds.items():
        words = {"POINT": "Point", "LINE": "Line", "POLYGON": "Polygon"}
        geometry = next((word for part, word in words.items() if part in kind.upper()), "Point")
        style, labelled = _inner(stored.get(layer, ""))
        yield Entry(layer, f"./{name}|layername={layer}", style, labelled, geometry)


def _rasters(folder: Path) -> Iterator[Entry]:
    for path in sorted(folder.glob("*.tif")):
        beside = path.with_suffix(".qml")
        style, _ = _inner(beside.read_text(encoding="utf-8") if beside.exists() else "")
        yield Entry(path.stem, f"./{path.name}", style)


def _inner(document: str) -> tuple[str, bool]:
    """The content of a stored style's document, and whether its labels are on."""
    found = re.search(r"<qgis ([^>]*)>(.*)</qgis>", document, re.S)
    return (found[2], 'labelsEnabled="1"' in found[1]) if found else ("", False)


def _terrain(dem: str, folder: Path, final: Path) -> str:
    """The path of the terrain model in the project; for several tiles a virtual raster is written beside the
    project.
    """
    files = tiles_of(dem)
    if len(files) == 1:
        return _seen_from(Path(saved_place(dem) or files[0]), final)
    with mosaic_of(dem, files) as mosaic:
        (folder / TERRAIN).write_text(mosaic.vrt(beside=final), encoding="utf-8")
    return TERRAIN


def _seen_from(path: Path, folder: Path) -> str:
    """A path relative to the project's folder, as QGIS writes it; unchanged on another drive."""
    try:
        return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:
        return path.absolute().as_posix()


def _extent(run: Run) -> tuple[float, float, float, float]:
    """Extent of the releases and deposits, with a margin."""
    ends = shapely.get_coordinates(np.asarray(run.deposits.geometry))
    places = np.concatenate([run.deposits[["release_x", "release_y"]].to_numpy(np.float64), ends])
    (west, south), (east, north) = places.min(axis=0), places.max(axis=0)
    room = MARGIN * max(east - west, north - south) + 10.0
    return float(west - room), float(south - room), float(east + room), float(north + room)


def _height(run: Run) -> float:
    """Halfway between where the logs start and where they end [m]."""
    ends = shapely.get_z(np.asarray(run.deposits.geometry))
    return float(run.deposits["release_z"].to_numpy(np.float64).mean() + ends.mean()) / 2.0


# --- the project's XML -----------------------------------------------------------------------------------------------


def project_xml(
    entries: Sequence[Entry],
    terrain: Entry,
    crs: pyproj.CRS,
    extent: tuple[float, float, float, float],
    height: float,
    last_s: float,
    step_s: float,
    words: qgis_layout.SheetWords,
) -> str:
    """The whole project; ``height`` [m] is that of the 3-D view's centre, ``last_s`` the end of the animation."""
    grouped = [(title, [each for name in names for each in entries if each.name == name]) for title, names in GROUPS]
    known = {name for _, names in GROUPS for name in names}
    rest = [each for each in entries if each.name not in known]
    grouped[0][1].extend(each for each in rest if each.geometry)
    grouped[-1][1].extend(each for each in rest if not each.geometry)
    every = [*(each for _, members in grouped for each in members), terrain]
    system = _system(crs)
    of = words.of
    groups = "".join(_group(of(title), members, of) for title, members in grouped if members)
    tree = groups + _node(terrain, of, shown=True)
    layers = "".join(_maplayer(each, system, of) for each in every)
    printed = [_printed(each, of) for each in every if each.name in PRINTED and each is not terrain]
    name = escape(of("Deadwood run"))
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        f'<qgis projectname="{name}" version="{qml.VERSION}"><title>{name}</title>'
        f"<projectCrs>{system}</projectCrs>"
        f"<layer-tree-group><customproperties/>{tree}</layer-tree-group>"
        f"{_canvas(extent, system)}{_view_3d(extent, height, system, every, terrain, of)}"
        f"<projectlayers>{layers}</projectlayers>"
        f"<layerorder>{''.join(f'<layer id={quoteattr(each.id)}/>' for each in every)}</layerorder>"
        '<properties><Paths><Absolute type="bool">false</Absolute></Paths>'
        '<SpatialRefSys><ProjectionsEnabled type="int">1</ProjectionsEnabled></SpatialRefSys>'
        f"{_controller(last_s)}</properties>{_themes(every, of)}"
        f"{qgis_layout.layouts_xml(words, extent, of(qgis_layout.THEME), printed)}"
        f'<ElevationProperties><terrainProvider type="raster"><TerrainProvider layer="{terrain.id}" '
        'offset="0" scale="1"/></terrainProvider></ElevationProperties>'
        f'<ProjectViewSettings UseProjectScales="0"><Scales/><DefaultViewExtent {_corners(extent)}>{system}'
        f"</DefaultViewExtent></ProjectViewSettings>{_times(last_s, step_s)}</qgis>\n"
    )


def _system(crs: pyproj.CRS) -> str:
    authority = crs.to_authority()
    name = f"<authid>{escape(':'.join(authority))}</authid>" if authority else ""
    return f'<spatialrefsys nativeFormat="Wkt"><wkt>{escape(crs.to_wkt())}</wkt>{name}</spatialrefsys>'


def _group(title: str, members: Sequence[Entry], of: Named) -> str:
    nodes = "".join(_node(each, of, shown=each.name in SHOWN) for each in members)
    return f'<layer-tree-group name={quoteattr(title)} checked="Qt::Checked" expanded="1">{nodes}</layer-tree-group>'


def _node(entry: Entry, of: Named, *, shown: bool) -> str:
    provider = "ogr" if entry.geometry else "gdal"
    unfolded = shown and entry.name in ("deposits", "hit_count")
    return (
        f'<layer-tree-layer id={quoteattr(entry.id)} name={quoteattr(of(entry.title))} providerKey="{provider}" '
        f'source={quoteattr(entry.source)} checked="Qt::{"Checked" if shown else "Unchecked"}" '
        f'expanded="{int(unfolded)}"/>'
    )


def _printed(entry: Entry, of: Named) -> str:
    """A layer in the legend of the print layout, named for a reader who has only the printed page.

    For a raster QGIS lists the name of its band and the class of no log, which is transparent; both are omitted.
    """
    values = {"legend/title-label": of(LEGEND_TITLES.get(entry.name, entry.title))}
    if not entry.geometry:
        values["legend/node-order"] = ",".join(map(str, range(2, entry.style.count("<item ") + 1)))
    options = "".join(
        f'<Option type="QString" name="{name}" value={quoteattr(value)}/>' for name, value in values.items()
    )
    properties = f'<customproperties><Option type="Map">{options}</Option></customproperties>'
    return _node(entry, of, shown=True).removesuffix("/>") + f">{properties}</layer-tree-layer>"


def _maplayer(entry: Entry, system: str, of: Named) -> str:
    kind = f'type="vector" geometry="{entry.geometry}"' if entry.geometry else 'type="raster"'
    provider = '<provider encoding="UTF-8">ogr</provider>' if entry.geometry else "<provider>gdal</provider>"
    style = entry.style.replace("<renderer-3d ", f"<renderer-3d layer={quoteattr(entry.id)} ")
    style = qml.relabelled(style, of)
    style += qml.appears(log_outlines.START.item().timetuple()[:3], "duration_s") if entry.name in AT_REST else ""
    return (
        f'<maplayer {kind} hasScaleBasedVisibilityFlag="0" labelsEnabled="{int(entry.labelled)}" '
        f'styleCategories="AllStyleCategories"><id>{escape(entry.id)}</id>'
        f"<datasource>{escape(entry.source)}</datasource><layername>{escape(of(entry.title))}</layername>"
        f"<srs>{system}</srs>{provider}{style}</maplayer>"
    )


def _corners(extent: tuple[float, float, float, float]) -> str:
    west, south, east, north = extent
    return f'xmin="{west:.3f}" ymin="{south:.3f}" xmax="{east:.3f}" ymax="{north:.3f}"'


def _canvas(extent: tuple[float, float, float, float], system: str) -> str:
    names = ("xmin", "ymin", "xmax", "ymax")
    sides = "".join(f"<{name}>{value:.3f}</{name}>" for name, value in zip(names, extent, strict=True))
    return (
        f'<mapcanvas name="theMapCanvas" annotationsVisible="1"><units>meters</units><extent>{sides}</extent>'
        f"<rotation>0</rotation><destinationsrs>{system}</destinationsrs></mapcanvas>"
    )


def _times(last_s: float, step_s: float) -> str:
    return (
        f'<ProjectTimeSettings timeStepUnit="s" timeStep="{step_s:g}" frameRate="{1.0 / step_s:g}" '
        f'cumulativeTemporalRange="0"><TemporalRange><start>{log_outlines.stamp(0.0)}Z</start>'
        f"<end>{log_outlines.stamp(last_s)}Z</end></TemporalRange></ProjectTimeSettings>"
    )


def _themes(every: Sequence[Entry], of: Named) -> str:
    """The layers that the 3-D view drapes over the terrain, and those of the print layout."""
    presets = ""
    for name, members in ((THEME, DRAPED), (qgis_layout.THEME, PRINTED)):
        layers = "".join(
            f'<layer id={quoteattr(each.id)} visible="1" style="default" expanded="0"/>'
            for each in every
            if each.name in members
        )
        presets += f'<visibility-preset name={quoteattr(of(name))} has-expanded-info="0">{layers}</visibility-preset>'
    return f"<visibility-presets>{presets}</visibility-presets>"


def _controller(last_s: float) -> str:
    """The Temporal Controller, switched on (1: animated), so that the map shows one moment instead of all at once."""
    return (
        '<TemporalControllerWidget><NavigationMode type="int">1</NavigationMode>'
        f'<StartDateTime type="QString">{log_outlines.stamp(0.0)}Z</StartDateTime>'
        f'<EndDateTime type="QString">{log_outlines.stamp(last_s)}Z</EndDateTime></TemporalControllerWidget>'
    )


def _view_3d(
    extent: tuple[float, float, float, float],
    height: float,
    system: str,
    every: Sequence[Entry],
    terrain: Entry,
    of: Named,
) -> str:
    """A 3-D view over the terrain, seen from the south; from QGIS 3.24 on it waits closed in View > 3D Map Views."""
    west, south, east, north = extent
    far = 1.8 * max(east - west, north - south)
    listed = (each for each in every if each.name in SOLID or each.name in DRAPED)
    layers = "".join(f"<layer id={quoteattr(each.id)}/>" for each in listed)
    return (
        f'<mapViewDocks3D><view name={quoteattr(of("Logs in 3D"))} isOpen="0" floating="0" area="2" x="0" y="0" '
        f'width="480" height="640"><qgis3d><origin x="{(west + east) / 2:.3f}" y="{(south + north) / 2:.3f}" z="0"/>'
        f"<crs>{system}</crs>"
        '<camera field-of-view="45" projection-type="1" camera-navigation-mode="terrain-based-navigation" '
        'camera-movement-speed="5"/><color background="235,240,245,255" selection="255,255,0,255"/>'
        '<directional-lights><directional-light x="-0.4" y="-0.8" z="-0.45" intensity="1" color="255,255,255,255"/>'
        '</directional-lights><terrain terrain-rendering-enabled="1" exaggeration="1" texture-size="1024" '
        'max-terrain-error="2" max-ground-error="1" shading-enabled="0" show-labels="0" '
        f"map-theme={quoteattr(of(THEME))} "
        f'elevation-offset="0"><layers>{layers}</layers><generator type="dem" layer="{terrain.id}" resolution="64" '
        'skirt-height="10"/></terrain><skybox skybox-enabled="0"/><shadow-rendering shadow-rendering-enabled="0"/>'
        f'</qgis3d><camera x="0" y="0" elev="{height:.1f}" dist="{far:.1f}" pitch="68" yaw="0"/>'
        "<animation3d><keyframes/></animation3d></view></mapViewDocks3D>"
    )
