"""What each tool writes, and where. A test runs every tool and compares this list with its output."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from typing import Any

from deadwood_algorithms.schemas import brought, files, results
from deadwood_algorithms.schemas.words import Band, Column, JsonFile, Layer, OtherFile, Output, RasterFile, TableFile

# Belong to the QGIS project, whose layers are the inputs, or to the toolbox itself.
NOT_PARTS = ("scene.gpkg", "terrain.vrt", "manifest.json", "failed.json")
Named = RasterFile | TableFile | JsonFile | OtherFile


def _by_flag(tool: str, flag: str, what: Any) -> Output:
    return Output(tool=tool, place=flag, what=what)


def _layers(tool: str, place: str, layers: Iterable[Layer]) -> Iterator[Output]:
    for each in layers:
        yield Output(tool=tool, place=f"{place}|layername={each.name}", what=each)


def _in_folder(tool: str, *found: Named, folder: str = "") -> Iterator[Output]:
    for each in found:
        name = f"{each.name}.tif" if isinstance(each, RasterFile) else each.name
        yield Output(tool=tool, place=folder + name, what=each)


def parts_of(tool: str) -> dict[str, list[str]]:
    """The parts of each output of a tool whose place is fixed, by the output's flag: its layers if it is a file with
    several, the files and layers in it if it is the folder, layers and rasters first. Some runs lack one, such as the
    layer reach without lines.
    """
    found: dict[str, list[str]] = {}
    for each in sorted(WRITTEN, key=lambda each: not isinstance(each.what, Layer | RasterFile)):
        flag, bar, layer = each.place.partition("|layername=") if each.place.startswith("--") else ("", "", each.place)
        if each.tool == tool and (bar or not flag) and has_place(each) and each.what is not files.GEOPARQUET:
            found.setdefault(flag or "--output", []).append(f"{bar}{layer}")
    return {flag: parts for flag, parts in found.items() if len(parts) > 1 or not parts[0].startswith("|")}


def has_place(output: Output) -> bool:
    """Whether one name can stand for it: no word in capitals in its place, no folder within the folder."""
    file, _bar, layer = output.place.partition("|layername=")
    return not ("/" in file or file in NOT_PARTS or re.search(r"[A-Z]{2}", file + layer))


def geometry_named(layer: str) -> str:
    """The one geometry that layers of this name have, for a layer without rows; ``Unknown`` if it may be another."""
    kinds = {
        kind
        for each in WRITTEN
        if isinstance(each.what, Layer) and each.what.name == layer
        for kind in each.what.geometry
    }
    return kinds.pop() if len(kinds) == 1 else "Unknown"


def layer_with(name: str, columns: Collection[str]) -> Layer | None:
    """The layer of this name with these columns: among several, the one that declares most of them."""
    named = {id(each.what): each.what for each in WRITTEN if isinstance(each.what, Layer) and each.what.name == name}
    known = [(sum(column_named(each, one) is not None for one in columns), each) for each in named.values()]
    return max(known, key=lambda each: each[0])[1] if known else None


def column_named(layer: Layer, name: str) -> Column | None:
    """The column of a layer for a name in a file; in the declared name, a word in capitals stands for any text."""
    return next((each for each in layer.columns if fits(each.name, name)), None)


def band_named(raster: str, name: str) -> Band | None:
    """The band of that name of a raster, by the name of its file without the ending."""
    found = {id(each.what): each.what for each in WRITTEN if isinstance(each.what, RasterFile)}
    bands = (band for each in found.values() if fits(each.name, raster) for band in each.bands)
    # ``line LINE: lower end`` before ``line LINE``, which also matches
    return max((band for band in bands if fits(band.name, name)), key=lambda band: len(band.name), default=None)


def fits(declared: str, name: str) -> bool:
    """Whether a name matches a declared one, in which a word in capitals stands for any text."""
    plain = re.split(r"(?<![A-Za-z0-9])[A-Z]{2,}(?![A-Za-z0-9])", declared)
    return re.fullmatch(".+".join(map(re.escape, plain)), name) is not None


OF_RUN = (
    results.DEPOSITS,
    results.DEPOSITED_LOGS,
    results.TRAJECTORIES,
    results.REACH_OF_RUN,
    results.REACHED_BY,
    results.BARRIER_ARRIVALS,
    results.BARRIER_HITS,
    results.TREE_HITS,
    results.LYING_HITS,
    results.BLOCK_HITS,
)
WRITTEN = (
    _by_flag("assess-mobilisation", "--output", files.MOBILISATION),
    *_layers("assess-mobilisation", "--release-areas", [results.RELEASE_AREAS]),
    *_layers("assess-mobilisation", "--assessed", [results.CANDIDATES, results.OTHERS]),
    *_layers("sample-releases", "--output", [brought.RELEASES]),
    *_layers("import-trees", "--output", [brought.TREES]),
    *_layers("import-trees", "--snags", [brought.SNAGS]),
    *_layers("find-trees", "--output", [brought.TREES]),
    *_layers("generate-forest", "--output", [brought.TREES]),
    *(
        output
        for scenario in ("before", "after", "later", "cleared")
        for output in _layers("windthrow", f"trees_{scenario}.gpkg", [brought.TREES])
    ),
    *(
        output
        for scenario in ("after", "later", "later_rigid")
        for output in _layers("windthrow", f"lying_{scenario}.gpkg", [brought.LYING_LOGS])
    ),
    *_layers("windthrow", "stems.gpkg", [results.STEMS]),
    *_in_folder("windthrow", files.MANIFEST),
    _by_flag("add-structures", "--output", files.DEM),
    *_layers("add-structures", "--earthworks", [results.EARTHWORKS]),
    *_in_folder("make-log", files.POINTS, files.OBJ, files.STL, files.LOG, files.MANIFEST),
    *_layers(
        "slide-logs",
        "run.gpkg",
        OF_RUN,
    ),
    Output(tool="slide-logs", place="poses.parquet", what=results.POSES),
    *(Output(tool="slide-logs", place=f"{each.name}.parquet", what=files.GEOPARQUET) for each in OF_RUN),
    *_in_folder(
        "slide-logs",
        *files.RUN_RASTERS,
        files.DANGER,
        files.DANGER_COUNT,
        files.SUMMARY,
        files.MANIFEST_OF_RUN,
        files.FAILED,
        files.PROJECT,
        files.TERRAIN_TILES,
        files.REPORT,
    ),
    *_layers(
        "slide-logs",
        "scene.gpkg",
        [
            brought.RELEASES,
            brought.TREES,
            brought.BARRIERS,
            brought.LYING_LOGS,
            brought.BLOCKS,
            brought.LINES,
            results.LOG_SOLIDS,
            results.LOG_OUTLINES,
        ],
    ),
    *_in_folder("run-sites", files.SITES_TABLE, files.SITES_PICTURE, files.SITES_FACTS, files.MANIFEST, files.REPORT),
    *_layers("run-sites", "overview.gpkg", [results.SITES]),
    *_layers("run-sites", "releases/SITE.gpkg", [brought.RELEASES]),
    *_in_folder("run-sites", *files.RUN_RASTERS, files.DANGER, folder="merged/DEM/"),
    _by_flag("count-hits", "--output", files.HITS),
    *(_by_flag("count-hits", f"--{each.name}", each) for each in files.CELL_QUANTILES),
    _by_flag("count-hits", "--danger", files.DANGER),
    *_layers("reach-lines", "--output", [results.REACH, results.ARRIVALS, results.ATTRIBUTION, results.ORIGINS]),
    _by_flag("design-values", "--output", files.DESIGN_VALUES),
    *_layers("value-trees", "--output", [results.VALUES, results.PLANTED]),
    *_layers("break-trees", "--output", [results.REACH_BREAKING, results.BROKEN]),
    *_in_folder("site-barriers", files.SITED_TABLE, files.SITED_FACTS, files.SITED_PICTURE, files.MANIFEST),
    *_layers("site-barriers", "barriers.gpkg", [results.SITED]),
    *_in_folder("map-intensity", *files.INTENSITY_MAPS, files.INTENSITY_LINES, files.INTENSITY_FACTS, files.MANIFEST),
    *_layers("map-intensity", "process_area.gpkg", [results.PROCESS_AREA]),
    *_in_folder("map-origins", files.ORIGIN_REACH, files.ORIGIN_FACTS, files.ORIGIN_PICTURE, files.MANIFEST),
    *_layers("map-origins", "origins.gpkg", [results.SOURCES, results.AFFECTED]),
    *_in_folder("age", files.AGED_STATES, files.PROCESSES, files.AGED_PICTURE, files.MANIFEST),
    *_layers("age", "aged.gpkg", [results.AGED]),
    *_in_folder(
        "decide",
        *files.DECIDE_TABLES,
        files.PROCESSES,
        files.DECISION_PICTURE,
        files.DECISION_FACTS,
        files.MANIFEST,
    ),
    *_layers("decide", "states.gpkg", [brought.RELEASES]),
    *_layers("decide", "living.gpkg", [brought.TREES]),
    *_layers("lateral-spread", "--output", [results.SPREAD, results.AZIMUTHS]),
    *_layers("fit-flight", "--output", [results.FLIGHTS, results.CLEARANCES]),
    *_in_folder("fit-flight", files.PROFILE, files.MANIFEST, folder="--plots/"),
    *_in_folder(
        "compare-scenarios",
        files.OVERVIEW,
        files.COMPARISON,
        files.DIFFERENCE,
        files.COMPARISON_FACTS,
        files.COMPARISON_PICTURE,
        files.MANIFEST,
    ),
    *_layers("compare-scenarios", "changes.gpkg", [results.MOVED, results.CHANGED]),
    *_in_folder(
        "calibrate-friction", files.CALIBRATION, files.CALIBRATION_FACTS, files.CALIBRATION_PICTURE, files.MANIFEST
    ),
    *_layers("calibrate-friction", "calibration.gpkg", [results.SIMULATED, results.NO_DEPOSIT, results.OBSERVED]),
    *_in_folder(
        "compare-fidelity",
        files.FIDELITIES,
        files.FIDELITY_FACTS,
        files.FIDELITY_PICTURE,
        files.MANIFEST_OF_SCENE,
    ),
    *_in_folder(
        "vary",
        files.VARIED_RUNS,
        files.TORNADO,
        files.SENSITIVITY,
        files.VARIED_FACTS,
        files.TORNADO_PICTURE,
        files.MANIFEST,
    ),
    *_layers("explore", "NAME_layers.gpkg", [brought.RELEASES, brought.TREES, brought.BARRIERS, brought.LYING_LOGS]),
    _by_flag("make-report", "--output", files.REPORT),
    *_in_folder("make-report", *files.REPORT_FIGURES, files.MANIFEST, folder="--figures/"),
    _by_flag("make-report", "--gltf", files.REPORT_SCENE),
    *_in_folder("demo", files.DEM, files.DEMO, files.DEMO_PICTURE, files.REPORT, files.MANIFEST),
    *_layers("demo", "release_area.gpkg", [results.RELEASE_AREA]),
    *_layers("demo", "releases.gpkg", [brought.RELEASES]),
    *_layers("demo", "forest.gpkg", [results.FOREST]),
    *_layers("demo", "road.gpkg", [brought.LINES]),
    *_layers("demo", "barriers.gpkg", [brought.BARRIERS]),
    *_layers("demo", "trees_FOREST.gpkg", [brought.TREES]),
    *_layers("demo", "spread_FOREST.gpkg", [results.SPREAD, results.AZIMUTHS]),
    *_layers(
        "demo",
        "arrivals_FOREST.gpkg",
        [results.REACH, results.ARRIVALS, results.ATTRIBUTION, results.ORIGINS],
    ),
    *_in_folder(
        "reproduce-paper",
        files.FINDINGS,
        files.FINDINGS_TABLE,
        files.FINDINGS_PANEL,
        files.FINDINGS_PAGE,
        files.FINDINGS_REPORT,
        files.MANIFEST,
    ),
    *_in_folder("reproduce-paper", files.DEM, files.SITE_FACTS, folder="SITE/data/"),
    *_layers("reproduce-paper", "SITE/data/releases.gpkg", [results.MAPPED_RELEASES]),
    *_layers("reproduce-paper", "SITE/data/trees.gpkg", [brought.TREES]),
    *_layers("reproduce-paper", "SITE/data/barriers.gpkg", [brought.BARRIERS]),
    *_layers("reproduce-paper", "SITE/data/lines.gpkg", [brought.LINES]),
    *_layers("reproduce-paper", "SITE/data/forest.gpkg", [results.FOREST]),
    *_layers("reproduce-paper", "SITE/data/flight.gpkg", [results.MAPPED_FLIGHT]),
    _by_flag("reproduce-paper", "SITE/data/dams.gpkg|layername=dams", brought.STRUCTURES),
    _by_flag("reproduce-paper", "SITE/prepared/dem_CHANGE.tif", files.DEM),
    _by_flag("reproduce-paper", "SITE/prepared/ROCK.pts", files.POINTS),
    *_layers("reproduce-paper", "SITE/prepared/releases_PART.gpkg", [brought.RELEASES]),
    *_layers("reproduce-paper", "SITE/prepared/trees_random_NUMBER.gpkg", [brought.TREES]),
    *_layers("reproduce-paper", "SITE/prepared/line_LINE.gpkg", [brought.LINES]),
    _by_flag("reproduce-paper", "SITE/results/FIGURE.png", files.FINDINGS_FIGURE),
    *_layers(
        "reproduce-paper",
        "SITE/results/arrivals_RUN.gpkg",
        [results.REACH, results.ARRIVALS, results.ATTRIBUTION, results.ORIGINS],
    ),
    *_layers("reproduce-paper", "SITE/results/spread_RUN.gpkg", [results.SPREAD, results.AZIMUTHS]),
    *_layers("reproduce-paper", "SITE/results/flight.gpkg", [results.FLIGHTS, results.CLEARANCES]),
)
