"""The QGIS project of a run, as XML: every layer of the folder is in it, with a valid path. tests/qgis opens it."""

from __future__ import annotations

import sqlite3
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
import shapely
from slope_case import Case, points, write_layer

from deadwood_algorithms.results import qgis_layout


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = Case(tmp_path_factory.mktemp("project"))
    axis = shapely.LineString([(20.0, 60.0), (28.0, 61.0)])
    lying = write_layer(made.folder / "lying.gpkg", [axis], diameter_cm=[35.0])
    blocks = write_layer(made.folder / "b.gpkg", points((20.0, 58.0)), block_id=[4], diameter_m=[1.5], height_m=[1.0])
    return made.run(time_limit_s=10.0, qgis_project=True, lying_logs=lying, blocks=blocks, **made.everything())


def project(case: Path) -> ElementTree.Element:
    with zipfile.ZipFile(case / "project.qgz") as packed:
        assert packed.namelist() == ["project.qgs"]
        return ElementTree.fromstring(packed.read("project.qgs").decode().partition("\n")[2])


def test_every_layer_of_the_run_is_in_the_project_and_is_found_from_it(case):
    root = project(case)
    sources = {each.findtext("id"): each.findtext("datasource") or "" for each in root.iter("maplayer")}
    nodes = [each.get("id") for each in root.findall("layer-tree-group//layer-tree-layer")]
    assert sorted(nodes) == sorted(sources)
    assert len(set(nodes)) == len(nodes)
    expected = {f"./{path.name}" for path in case.glob("*.tif")}
    for name in ("run.gpkg", "scene.gpkg"):
        with sqlite3.connect(case / name) as database:
            layers = database.execute("select table_name from gpkg_geometry_columns").fetchall()
        expected |= {f"./{name}|layername={layer}" for (layer,) in layers}
    terrain = sources.pop("deadwood_terrain")
    assert set(sources.values()) == expected
    assert (case / terrain).resolve() == (case.parent / "dem.tif").resolve()
    groups = [each.get("name") for each in root.findall("layer-tree-group/layer-tree-group")]
    assert groups == ["Results", "Animation", "Scene", "Rasters"]


def test_the_project_is_in_the_runs_crs_and_knows_the_time(case):
    root = project(case)
    assert {each.text for each in root.iter("authid")} == {"EPSG:2056"}
    assert root.findtext("ProjectTimeSettings/TemporalRange/start") == "2000-01-01T00:00:00.000Z"
    assert root.find("ProjectTimeSettings").get("timeStep") == "0.25"  # type: ignore[union-attr]
    outlines = next(each for each in root.iter("maplayer") if each.findtext("id") == "deadwood_log_outlines")
    assert outlines.find("temporal").get("startField") == "t"  # type: ignore[union-attr]


def test_the_print_layouts_show_layers_that_there_are(case):
    root = project(case)
    layouts = root.findall("Layouts/Layout")
    assert [each.get("name") for each in layouts] == ["Map of the run, A4 landscape", "Map of the run, A4 portrait"]
    known = {each.findtext("id") for each in root.iter("maplayer")}
    theme = next(each for each in root.iter("visibility-preset") if each.get("name") == "Map of the run")
    themed = {each.get("id") for each in theme.iter("layer")}
    for layout in layouts:
        listed = {each.get("id") for each in layout.iter("layer-tree-layer")}
        assert listed < known
        assert themed == listed | {"deadwood_terrain"}


def test_what_is_on_a_sheet_is_on_the_page_and_nothing_lies_over_another(case):
    for layout in project(case).findall("Layouts/Layout"):
        boxes = []
        for each in layout.findall("LayoutItem"):
            left, top = (float(part) for part in (each.get("position") or "").split(",")[:2])
            width, height = (float(part) for part in (each.get("size") or "").split(",")[:2])
            boxes.append((each.get("type"), shapely.box(left, top, left + width, top + height)))
        page = layout.find("PageCollection/LayoutItem")
        assert page is not None
        width, height = (float(part) for part in (page.get("size") or "").split(",")[:2])
        assert all(shapely.box(9.9, 4.9, width - 9.9, height - 4.9).covers(box) for _, box in boxes)
        apart = [box for kind, box in boxes if kind not in (str(qgis_layout.BAR), str(qgis_layout.PICTURE))]
        assert all(
            one.intersection(other).area == 0.0 for k, one in enumerate(apart) for other in apart[:k]
        )  # scale bar and arrow lie on the map


def test_a_project_in_german_has_no_english_name(case):
    """Names of layers, groups, sheets, and classes; names that are typed, such as those of files, are unchanged."""
    german = Case(case.parent / "german")
    (case.parent / "german").mkdir(exist_ok=True)
    root = project(german.run(time_limit_s=10.0, qgis_project=True, language="de", **german.everything()))
    english = project(case)

    def named(root: ElementTree.Element) -> set[str]:
        found = {each.get("name") or "" for each in root.iter("layer-tree-group")} - {""}
        found |= {each.findtext("layername") or "" for each in root.iter("maplayer")}
        found |= {each.get("name") or "" for path in ("Layout", "visibility-preset") for each in root.iter(path)}
        classes = (each.get("label") or "" for kind in ("category", "range", "item") for each in root.iter(kind))
        return found | {each for each in classes if any(letter.isalpha() for letter in each)}

    units = ("m", "m/s", "kJ", "%")
    alike = {"Animation"} | {each for each in named(root) if each.rpartition(" ")[2] in units and " bis " not in each}
    assert named(root) & named(english) <= alike
    texts = [each.get("labelText") or "" for each in root.iter("LayoutItem")]
    assert any(each.startswith("Rutschende Stämme: ") for each in texts)
    assert any(each.startswith("Massstab 1:[%") for each in texts)
    assert any("Reibung 0,25" in each for each in texts), texts


@pytest.mark.parametrize("sheet", qgis_layout.SHEETS, ids=lambda each: each.name[-9:].strip())
@pytest.mark.parametrize("width", [3.0, 41.0, 205.0, 206.0, 999.0, 30_000.0])
@pytest.mark.parametrize("height", [3.0, 160.0, 5_000.0])
def test_the_scale_is_the_largest_round_one_that_shows_the_extent(width, height, sheet):
    scale = qgis_layout.nice_scale((0.0, 0.0, width, height), sheet)
    needed = max(width / sheet.map[2], height / sheet.map[3]) * 1000.0
    round_ones = sorted(part * 10.0**power for part in (1.0, 2.0, 2.5, 5.0) for power in range(8))
    assert scale == min(each for each in round_ones if each >= needed * (1.0 - 1e-9))
    bar = qgis_layout.bar_length(scale, sheet) / scale * 1000.0
    assert 0.08 * sheet.map[2] < bar <= 0.22 * sheet.map[2] * (1.0 + 1e-9)


def test_the_scene_is_as_it_was_modelled(case):
    with sqlite3.connect(case / "scene.gpkg") as database:
        heights = dict(database.execute("select barrier_id, height_m from barriers").fetchall())
        trees = database.execute("select count(*), avg(dbh_cm) from trees").fetchone()
        lying = database.execute("select diameter_cm from lying_logs").fetchall()
        blocks = database.execute("select block_id, diameter_m, height_m from blocks").fetchall()
    assert heights == {"west": 1.5, "east": 4.0}
    assert lying == [(35.0,)]
    assert blocks == [("4", 1.5, 1.0)]
    assert trees == (59, pytest.approx(50.0))  # one of the 60 is off the DEM, where no log can meet it


def test_a_bare_run_without_trajectories_has_its_project_too(tmp_path):
    made = Case(tmp_path)
    run = made.run(time_limit_s=5.0, trajectories="none", qgis_project=True)
    with sqlite3.connect(run / "scene.gpkg") as database:
        layers = {name for (name,) in database.execute("select table_name from gpkg_geometry_columns")}
    assert layers == {"releases", "log_solids"}
    assert project(run) is not None


def test_without_the_request_there_is_no_project(tmp_path):
    made = Case(tmp_path)
    run = made.run(time_limit_s=2.0)
    assert not (run / "project.qgz").exists()
    assert not (run / "scene.gpkg").exists()
