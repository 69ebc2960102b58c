"""Every tool once, on the sample, with all that it can write switched on; and a look at what it wrote.

Few logs and the draft fidelity: what is written matters here, not how well it is calculated.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow.parquet as parquet
import pyogrio
import pytest
import rasterio
import shapely
from explore_case import opened
from matplotlib.figure import Figure

from deadwood_algorithms.files import styles
from deadwood_algorithms.params.tool import Tool
from deadwood_algorithms.tools import explore
from deadwood_toolbox.shelf import find

SAMPLE = Path(__file__).parents[2] / "sample_data"
DEM = str(SAMPLE / "dem.tif")
EDGE_IN = 0.02  # of a figure, over which a hair of a letter may reach


def sample(layer: str) -> str:
    return f"{SAMPLE / 'sample.gpkg'}|layername={layer}"


@dataclass(frozen=True)
class Found:
    """One thing that a tool wrote: where, as `schemas.written` names places, and the file and layer."""

    tool: str
    place: str
    path: Path
    layer: str = ""


@dataclass
class Pictures:
    """The figures that tools save: their names, and of those whose words reach over the edge what and how far."""

    seen: list[str] = field(default_factory=list)
    over: list[tuple[str, Any, Any]] = field(default_factory=list)

    @contextlib.contextmanager
    def watched(self) -> Iterator[None]:
        """While tools run: look at each figure before it is saved."""
        save = Figure.savefig

        def look(figure: Figure, place: Any, **more: Any) -> None:
            if isinstance(place, (str, Path)):
                name = "/".join(Path(place).parts[-2:])
                self.seen.append(name)
                figure.draw_without_rendering()
                box, size = figure.get_tightbbox(), figure.get_size_inches()
                cut = min(box.x0, box.y0) < -EDGE_IN or (box.max > size + EDGE_IN).any()
                if cut and more.get("bbox_inches") != "tight":
                    self.over.append((name, box.extents.round(2).tolist(), size.tolist()))
            save(figure, place, **more)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Figure, "savefig", look)
            yield


def run_every_tool(folder: Path) -> list[Found]:
    """Run the tools in ``folder``, each into a folder of its own name; gives what they wrote."""
    done: list[tuple[Tool, dict[str, Any]]] = []

    def run(name: str, **values: Any) -> Path:
        place = folder / name
        given = {key: str(value) if isinstance(value, Path) else value for key, value in values.items()}
        tool = find(name)
        assert tool is not None, name
        tool(**given)
        done.append((tool, given))
        return Path(str(given.get("output", place)))

    def at(name: str, file: str) -> str:
        (folder / name).mkdir(exist_ok=True)
        return str(folder / name / file)

    run(
        "assess-mobilisation",
        dem=DEM,
        deadwood=sample("deadwood"),
        lines=sample("lines"),
        cell_m=40.0,
        logs_per_cell=1,
        output=at("assess-mobilisation", "mobilisation.tif"),
        release_areas=at("assess-mobilisation", "areas.gpkg"),
        assessed=at("assess-mobilisation", "assessed.gpkg"),
    )
    releases = at("sample-releases", "releases.gpkg")
    run("sample-releases", dem=DEM, areas=sample("release_area"), count=40, azimuth_deg=180.0, output=releases)
    inventory = folder / "inventory.csv"
    rows = [line.split(",") for line in (SAMPLE / "trees.csv").read_text(encoding="utf-8").splitlines()]
    kinds = ["species,crown,status", *("spruce,4.5,dead" if k % 20 == 0 else "fir,5.0,living" for k in range(1, 200))]
    ids = [row if k == 0 else [str(k % 100), *row[1:]] for k, row in enumerate(rows[:200])]  # each id twice
    inventory.write_text("\n".join(",".join([*row, kind]) for row, kind in zip(ids, kinds, strict=True)) + "\n")
    run(
        "import-trees",
        trees=str(inventory),
        dem=DEM,
        crown_field="crown",
        status_field="status",
        output=at("import-trees", "trees.gpkg"),
        snags=at("import-trees", "snags.gpkg"),
    )
    run(
        "generate-forest",
        dem=DEM,
        stand=sample("forest"),
        stems_per_ha=300.0,
        dbh_mean_cm=60.0,
        dbh_sd_cm=18.0,
        output=at("generate-forest", "trees.gpkg"),
    )
    of_storm = {"share": 0.5, "fall_deg": 180.0, "wood": "spruce", "tree_capacity_kj": 40.0, "output": folder / "wind"}
    run("windthrow", trees=at("import-trees", "trees.gpkg"), dem=DEM, **of_storm)
    run(
        "add-structures",
        dem=DEM,
        structures=sample("dams"),
        output=at("add-structures", "dem.tif"),
        earthworks=at("add-structures", "earthworks.gpkg"),
    )
    # the dams are as good as trees
    run("find-trees", dsm=at("add-structures", "dem.tif"), dem=DEM, output=at("find-trees", "trees.gpkg"))
    run("make-log", output=folder / "make-log")
    run("make-log", length_m=0.9, width_m=0.6, height_m=0.4, output=folder / "make-log-rock")
    lying = folder / "lying.gpkg"
    frame = pyogrio.read_dataframe(SAMPLE / "sample.gpkg", layer="barriers")
    frame = (
        frame.rename(columns={"barrier_id": "lying_id"})
        .drop(columns="height_m")
        .assign(diameter_cm=80.0, capacity_kj=1.0)
    )
    frame.geometry = shapely.transform(frame.geometry.to_numpy(), lambda xy: np.add(xy, (0.0, 30.0)))
    frame.to_file(lying, layer="lying_logs", driver="GPKG")
    blocks = folder / "blocks.gpkg"
    line = shapely.line_merge(shapely.union_all(frame.geometry.to_numpy()))
    places = np.add(shapely.get_coordinates(shapely.segmentize(line, 4.0)), (0.0, 20.0))
    boulders = {"block_id": range(len(places)), "diameter_m": 3.0}
    gpd.GeoDataFrame(boulders, geometry=shapely.points(places), crs=frame.crs).to_file(blocks, layer="blocks")
    common = {
        "dem": DEM,
        "releases": releases,
        "friction_preset": "wet-debarked",
        "fidelity": "draft",
        "trajectories": "all",
    }
    common |= {"barriers": sample("barriers"), "lines": sample("lines"), "time_limit_s": 60.0}
    slid = run(
        "slide-logs",
        **common,
        trees=str(SAMPLE / "trees.csv"),
        lying_logs=str(lying),
        blocks=str(blocks),
        qgis_project=True,
        geoparquet=True,
        report=True,
        danger_counts=True,
        tree_capacity_kj=1.0,
        log_capacity_kj=1.0,
        output=folder / "slide-logs",
    )
    without = run("slide-logs", **common, until_ci=0.4, geoparquet=True, output=folder / "without")
    halves = folder / "halves.gpkg"
    frame = pyogrio.read_dataframe(releases, layer="releases")
    frame.assign(release_id=["west", "east"] * (len(frame) // 2)).to_file(halves, layer="releases", driver="GPKG")
    of_sites = common | {"releases": str(halves), "by": "release_id", "report": True}
    run("run-sites", **of_sites, output=folder / "run-sites")
    # two frictions, a stump, and a tree that is not on the terrain model
    west, south, east, north = frame.total_bounds + np.array([-5e3, -5e3, 5e3, 5e3])
    middle = 0.5 * (west + east)
    halves_of_ground = [shapely.box(west, south, middle, north), shapely.box(middle, south, east, north)]
    ground = gpd.GeoDataFrame({"friction": [0.3, 0.35]}, geometry=halves_of_ground, crs=frame.crs)
    ground.to_file(folder / "ground.gpkg", driver="GPKG")
    places = shapely.points([(middle, 0.5 * (south + north)), (middle + 2.0, 0.5 * (south + north)), (east, north)])
    stems = {"dbh_cm": [40.0, 50.0, 40.0], "height_m": [20.0, 0.5, 20.0]}
    stems = gpd.GeoDataFrame(stems, crs=frame.crs, geometry=places)
    stems.to_file(folder / "stems.gpkg", driver="GPKG")
    two = {
        "fidelity": "auto",
        "friction_preset": None,
        "friction": str(folder / "ground.gpkg"),
        "trees": str(folder / "stems.gpkg"),
        "tree_capacity_kj": 1.0,
        "break_trees": True,
    }
    run("slide-logs", **(common | two), error=0.4, output=folder / "chosen")
    slip = {"friction_max": 1.2, "friction_kappa": 0.5, "friction_beta": 1.0}
    soft = {"soil_strength_mn_m2": 15.0, "scar_drag": 1.5}
    rock = str(SAMPLE / "rock_cubic_1m3.pts")
    run("slide-logs", **common, shape=rock, **slip, **soft, output=folder / "rocks")
    many = str(folder / "many.gpkg")
    run("sample-releases", dem=DEM, areas=sample("release_area"), count=160, output=many)
    ranged = {"releases": many, "trajectories": "none", "friction_range": "auto"}
    run("slide-logs", **(common | ranged), output=folder / "band")
    run(
        "count-hits",
        run=slid,
        output=at("count-hits", "hits.tif"),
        speed=at("count-hits", "speed.tif"),
        energy=at("count-hits", "energy.tif"),
        jump=at("count-hits", "jump.tif"),
        danger=at("count-hits", "danger.tif"),
        quantiles="50,95",
    )
    run(
        "reach-lines",
        run=without,
        lines=sample("lines"),
        output=at("reach-lines", "reached.gpkg"),
    )
    run("design-values", run=slid, barrier_classes="etag-027", output=at("design-values", "design_values.csv"))
    candidates = {"tree_id": [1], "dbh_cm": [60.0], "height_m": [20.0]}
    spot = shapely.points(*np.mean(np.reshape(frame.total_bounds, (2, 2)), axis=0))
    gpd.GeoDataFrame(candidates, geometry=[spot], crs=frame.crs).to_file(folder / "plant.gpkg", driver="GPKG")
    run(
        "value-trees",
        run=slid,
        stands=sample("forest"),
        plant=str(folder / "plant.gpkg"),
        output=at("value-trees", "values.gpkg"),
    )
    run("break-trees", run=slid, tree_capacity_kj=1.0, output=at("break-trees", "breaking.gpkg"))
    above = {"above_m": "15", "length_m": "40", "height_m": "4", "places": 1, "barrier_classes": "etag-027"}
    run("site-barriers", run=without, **above, output=folder / "site-barriers")
    run("map-intensity", run=slid, events_per_year=0.1, output=folder / "map-intensity")
    run("map-origins", run=without, least=1, output=folder / "map-origins")
    dead = at("import-trees", "trees.gpkg")
    run("age", dead_trees=dead, storm_return_years="10,20", draws=50, output=folder / "age")
    few = {"most_trees": 3, "repeats": 2, "draws": 20, "fidelity": "draft", "friction": 0.3, "lines": sample("lines")}
    unknown = {"storm_return_years": "10,20", "start_share": "0.5", "mobilised_per_year": "0,0.01"}
    some = pyogrio.read_dataframe(dead, layer="trees").iloc[::9]
    some.to_file(folder / "dead.gpkg", layer="dead", driver="GPKG")
    scene = {"dead_trees": str(folder / "dead.gpkg"), "dem": DEM, "trees": dead}
    run("decide", **scene, **few, **unknown, output=folder / "decide")
    run("lateral-spread", deposits=str(slid), output=at("lateral-spread", "spread.gpkg"))
    jumps = pyogrio.read_dataframe(SAMPLE / "sample.gpkg", layer="flights")
    west, south, east, north = jumps.total_bounds
    net = shapely.LineString([(west - 5.0, (south + north) / 2.0), (east + 5.0, (south + north) / 2.0)])
    crossed = gpd.GeoDataFrame({"barrier_id": ["net"], "height_m": [3.0]}, geometry=[net], crs=jumps.crs)
    crossed.to_file(folder / "net.gpkg", layer="barriers", driver="GPKG")
    run(
        "fit-flight",
        dem=DEM,
        flights=sample("flights"),
        barriers=str(folder / "net.gpkg"),
        output=at("fit-flight", "flights.gpkg"),
        plots=at("fit-flight", "profiles"),
    )
    run("compare-scenarios", runs=f"{without},{slid}", output=folder / "compare-scenarios")
    run(
        "make-report",
        runs=f"{without},{slid}",
        figures=at("make-report", "figures"),
        gltf=at("make-report", "scene.glb"),
        output=at("make-report", "report.html"),
    )
    of_event = {key: common[key] for key in ("dem", "releases", "fidelity", "time_limit_s")}
    observed = str(slid / "run.gpkg") + "|layername=deposits"
    run(
        "calibrate-friction",
        **of_event,
        lines=sample("lines"),
        friction="0.3,0.4",
        logs=20,
        observed=observed,
        output=folder / "calibrate-friction",
    )
    scene = {key: common[key] for key in ("dem", "releases", "friction_preset", "lines", "time_limit_s")}
    of_lines = {"reached": sample("lines"), "event_logs": 4, "event_reached": 1, "friction": "0.3,0.4", "logs": 10}
    run("calibrate-friction", **of_event, **of_lines, output=folder / "calibrate-lines")
    run("compare-fidelity", **scene, fidelities="draft,standard", logs=20, output=folder / "compare-fidelity")
    few = {"vary": "dem_noise_m=0:0.2,friction", "logs": 8, "samples": 8}
    run("vary", **scene, **few, trees=str(SAMPLE / "trees.csv"), output=folder / "vary")
    run("reproduce-paper", quick=True, logs=8, output=folder / "reproduce-paper")
    run("demo", logs=20, fidelity="draft", output=folder / "demo")
    asked = {"dem": DEM, "trees": str(SAMPLE / "trees.csv"), "output": str(folder / "explore")}
    keep_one("here", **asked)
    done.append((explore.TOOL, asked))
    return [each for tool, given in done for each in written_by(tool, given)]


def keep_one(name: str, **values: str) -> None:
    """What a click, a felled tree, a barrier and a lying log leave when they are kept."""
    with opened({}, **values) as asked:
        west, south, east, north = asked.session.layers.dem.bounds
        x, y = 0.5 * (east - west), 0.5 * (north - south)
        asked.release(shape={"circle": [x, y, 5.0]}, n=10)
        line = [[x - 10.0, y - 30.0], [x + 10.0, y - 30.0]]
        asked.edit(
            fell=[0],
            barriers=[{"points": line, "height_m": 2.0}],
            lying_logs=[{"points": line, "diameter_cm": 40.0}],
        )
        asked.keep(name)


def written_by(tool: Tool, given: dict[str, Any]) -> Iterator[Found]:
    """What is there of a tool's outputs; a run in a folder of the demo is one of slide-logs."""
    for parameter in tool.parameters():
        if not parameter.is_output or parameter.name not in given:
            continue
        path = Path(given[parameter.name])
        if path.is_file():
            yield from _inside(tool.name, parameter.flag, path)
            continue
        for file in sorted(each for each in path.rglob("*") if each.is_file() and each.suffix != ".qml"):
            if file.parent == path and tool.name == "explore":  # whose folder is one of many runs, and has no manifest
                yield from _inside(tool.name, file.name.replace("here", "NAME"), file)
                continue
            home = next(each for each in file.parents if (each / "manifest.json").is_file())
            made_by = json.loads((home / "manifest.json").read_text(encoding="utf-8"))["tool"]
            maker = find(made_by)
            assert maker is not None, made_by
            flag = next(each.flag for each in maker.parameters() if each.kind == "output_folder")
            prefix = "" if flag == "--output" else f"{flag}/"
            yield from _inside(made_by, f"{prefix}{file.relative_to(home).as_posix()}", file)


def _inside(tool: str, place: str, path: Path) -> Iterator[Found]:
    if path.suffix != ".gpkg":
        yield Found(tool, place, path)
        return
    for name, _ in pyogrio.list_layers(path):
        if name != styles.TABLE:
            yield Found(tool, f"{place}|layername={name}", path, str(name))


def layer_of(found: Found) -> tuple[str, set[str]]:
    """The geometry of a layer as its file says it, and its columns."""
    info = pyogrio.read_info(found.path, layer=found.layer)
    return str(info["geometry_type"]), set(info["fields"])


def bands_of(path: Path) -> list[tuple[str, str, str]]:
    """Description, unit and number type of each band."""
    with rasterio.open(path) as source:
        return [
            (str(source.descriptions[k] or ""), str(source.units[k] or ""), source.dtypes[k])
            for k in range(source.count)
        ]


def columns_of(path: Path) -> list[str]:
    if path.suffix == ".parquet":
        return parquet.read_schema(path).names
    return path.read_text(encoding="utf-8-sig").splitlines()[0].split(",")


def keys_of(path: Path) -> set[str]:
    return set(_keys(json.loads(path.read_text(encoding="utf-8")), ""))


def _keys(value: Any, place: str) -> Iterator[str]:
    """Dotted names of what is in a JSON value; ``[]`` stands for any element of a list."""
    if isinstance(value, dict):
        for key, inner in value.items():
            name = f"{place}.{key}" if place else key
            yield name
            yield from _keys(inner, name)
    elif isinstance(value, list):
        for inner in value:
            yield from _keys(inner, f"{place}[]")
