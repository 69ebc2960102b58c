"""What QGIS alone can do: layers of the map, models of several tools, Cancel."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from rasterio.windows import Window

from deadwood_algorithms.files.columns import ROW
from deadwood_algorithms.files.embedded import TAG, record_in
from deadwood_algorithms.files.kept_inputs import VARIABLE
from deadwood_toolbox import cli

HERE = Path(__file__).parent
PLUGIN = HERE.parents[1] / "deadwood_toolbox" / "qgis_plugin"
SAMPLE = HERE.parents[1] / "sample_data"
SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's QGIS has its modules there


def write_dem(path: Path, crs: str | None, west: float, north: float, cell: float) -> None:
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 300, "width": 300}
    with rasterio.open(path, "w", crs=crs, transform=from_origin(west, north, cell, cell), **facts) as made:
        made.write(np.repeat(np.linspace(1200, 1000, 300, dtype="float32")[:, None], 300, axis=1), 1)


def write_heights(folder: Path) -> None:
    """The sample's heights: unchanged, with two layers of nodata cells, with pits in their place, and in feet."""
    with rasterio.open(SAMPLE / "dem.tif") as sample:
        heights = (sample.read(1, masked=True) * sample.scales[0] + sample.offsets[0]).filled(1000.0)
        facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "crs": sample.crs, "transform": sample.transform}
    holes = ((heights >= 1150.0) & (heights <= 1180.0)) | ((heights >= 1300.0) & (heights <= 1301.0))
    pits = np.where(holes, -500.0, heights)
    kinds = np.where(holes & (heights < 1160.0), -600.0, np.where(holes & (heights > 1300.0), -700.0, pits))
    for name, values, nodata, unit in (
        ("heights", heights, None, "metre"),
        ("heights_with_holes", pits, -500.0, "metre"),
        ("heights_with_pits", pits, None, "metre"),
        ("heights_with_kinds_of_pits", kinds, -700.0, "metre"),
        ("heights_in_feet", heights, None, "ft"),
    ):
        size = {"height": heights.shape[0], "width": heights.shape[1]}
        with rasterio.open(folder / f"{name}.tif", "w", nodata=nodata, **facts, **size) as made:
            made.write(values.astype("float32"), 1)
            made.units = (unit,)


@pytest.fixture(scope="module")
def told(qgis, tmp_path_factory: pytest.TempPathFactory) -> dict:
    """The results of the cases of ``inside.py``."""
    work = tmp_path_factory.mktemp("inside")
    write_dem(work / "degrees.tif", "EPSG:4326", 9.43, 46.91, 1e-5)
    write_dem(work / "unnamed.tif", None, 2_786_000.0, 1_196_400.0, 1.0)
    write_heights(work)
    with rasterio.open(work / "heights.tif") as whole:
        window = Window(30, 20, whole.width - 45, whole.height - 20)  # type: ignore[call-arg]
        facts = whole.profile | {"width": window.width, "height": window.height}
        with rasterio.open(work / "window.tif", "w", **facts | {"transform": whole.window_transform(window)}) as made:
            made.write(whole.read(1, window=window), 1)
    words = [SYSTEM_PYTHON, HERE / "inside.py", SAMPLE, work, qgis.folder / "plugins"]
    ran = subprocess.run(words, env=qgis.environment, capture_output=True, text=True, timeout=400)
    line = next((each for each in ran.stdout.splitlines() if each.startswith("JSON")), None)
    assert line is not None, ran.stdout[-2000:] + ran.stderr[-3000:]
    return json.loads(line.removeprefix("JSON")) | {"work": work}


@pytest.mark.parametrize(
    ("case", "rows", "why"),
    [
        ("memory", {"area 0": 2, "area 1": 2, "area 2": 2}, "its source (memory)"),
        ("layer_id", {"area 0": 2, "area 1": 2, "area 2": 2}, "its source (memory)"),
        ("selected", {"area 1": 2}, "1 selected features"),
        ("filtered", {"area 2": 2}, "its filter"),
        ("unnamed_selected", {2: 2, 3: 2}, "2 selected features"),
        ("unnamed_filtered", {3: 2}, "its filter"),
        ("edited", {"area 0": 2, "area 1": 2, "area 2": 2, "drawn just now": 2}, "unsaved edits"),
    ],
)
def test_what_the_file_does_not_hold_is_saved_for_the_tool(told, case, rows, why):
    outcome = told[case]
    assert outcome["worked"], outcome["said"]
    assert outcome["rows"] == {str(name): number for name, number in rows.items()}  # as JSON has them
    assert outcome["crs"] == "EPSG:2056"
    assert any("saved for the tool" in line and why in line for line in outcome["said"])


def test_the_plugin_and_the_tool_have_one_name_for_the_row_of_a_part():
    text = (PLUGIN / "vector_copy.py").read_text(encoding="utf-8")
    assert f'ROW = "{ROW}"' in text
    assert f'TAG = "{TAG}"' in (PLUGIN / "layer_facts.py").read_text(encoding="utf-8")
    assert f'TEMPORARY = "{VARIABLE}"' in (PLUGIN / "finding.py").read_text(encoding="utf-8")


def test_a_large_layer_is_saved_outside_the_windows_thread(told):
    """Before, 200 000 points held the window for 18 s: only what is to be written is noted there."""
    many = told["many"]
    assert many["rows"] == 18_960
    assert many["prepared_s"] < 0.2 * many["written_s"]


def test_progress_is_in_qgis_language(told):
    """Before, "2 von 3, 0.0762/s": a stage in English, and a rate that nobody reads."""
    step = "road: conteggio dei passaggi"
    assert told["progress"] == [step, f"{step}: 2 di 3, 4,6 al minuto, ancora 13 s"]


def test_the_search_finds_the_tools_in_qgis_language(told):
    assert {"pericolo naturale", "natural hazard", "slide", "schianto da vento"} <= set(told["tags"])


def test_the_fields_of_a_saved_layer_come_along(told):
    assert told["memory"]["dbh_cm"] == [40.0, 41.0, 42.0]


def test_a_layer_that_is_its_file_is_not_copied(told):
    outcome = told["stored"]
    assert outcome["worked"]
    assert not any("saved for the tool" in line for line in outcome["said"])


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("nothing_selected", "Release points or polygons: 'Selected features only' is ticked, but in the layer 'Spots"),
        ("crs_of_the_map", "'Spots in another CRS' (EPSG:21781) lies entirely outside"),
        ("elsewhere", "'Spots in degrees' (EPSG:4326) lies entirely outside the terrain model 'terrain' (EPSG:2056)"),
        ("dem_in_degrees", "'terrain in degrees' is in EPSG:4326, whose unit is degrees"),
    ],
)
def test_what_cannot_work_is_refused_before_the_tool_starts(told, case, words):
    outcome = told[case]
    assert not outcome["worked"]
    assert any(words in line for line in outcome["said"]), outcome["said"]
    assert not any("sample-releases" in line for line in outcome["said"])


def test_a_crs_that_only_the_map_knows_is_passed_on(told):
    assert told["dem_named_in_the_map"]["worked"], told["dem_named_in_the_map"]["said"]
    assert told["dem_named_in_the_map"]["crs"] == "EPSG:2056"


@pytest.mark.parametrize(
    ("case", "like", "why"),
    [
        ("heights_with_holes_in_the_map", "heights_with_holes", "the cells without data that its properties name"),
        ("copied_in_a_thread", "heights_with_holes", "the cells without data that its properties name"),
        ("pits_named_in_the_map", "heights_with_holes", "the cells without data that its properties name"),
        ("kinds_of_pits_named_in_the_map", "heights_with_holes", "the cells without data that its properties name"),
        ("nodata_switched_off", "heights_with_pits", "the nodata value of the file, which its properties disable"),
    ],
)
def test_nodata_of_the_layers_properties_is_what_the_tool_gets(told, case, like, why):
    """The same raster, to the bit, as from a file with that nodata value, and a different one than without."""
    assert told[case]["worked"], told[case]["said"]
    assert any(why in line for line in told[case]["said"])
    made, of_file, other = (read(told["work"] / f"{name}.tif") for name in (case, f"{like}_in_the_file", OTHER[like]))
    for each in (of_file, made):
        assert (np.ma.getmaskarray(each) != np.ma.getmaskarray(other)).sum() > 20  # of the map's cells, of 10 m
    assert (np.ma.getmaskarray(made) == np.ma.getmaskarray(of_file)).all()
    assert (made.filled(0.0) == of_file.filled(0.0)).all()


def test_a_raster_is_copied_only_where_it_must_be_and_not_in_the_windows_thread(told):
    """Single values without data are a virtual raster over the file, however large it is; ranges are a copy."""
    assert told["copied_in_a_thread"]["in_window"] == [False]
    for case, copied in (
        ("heights_with_holes_in_the_map", True),
        ("pits_named_in_the_map", False),
        ("kinds_of_pits_named_in_the_map", False),
        ("nodata_switched_off", False),
        ("crs_of_the_map_for_a_raster", False),
    ):
        assert any("being saved" in line for line in told[case]["said"]) == copied, case


OTHER = {"heights_with_holes": "heights_in_the_file", "heights_with_pits": "heights_with_holes_in_the_file"}


def test_the_unit_of_the_heights_comes_along_in_a_copy(told):
    outcome = told["feet_of_a_copy"]
    assert not outcome["worked"]
    assert any("Heights in feet" in line and "ft" in line for line in outcome["said"]), outcome["said"]


def test_a_raster_has_the_crs_that_the_map_has_set(told):
    outcome = told["crs_of_the_map_for_a_raster"]
    assert outcome["worked"], outcome["said"]
    assert any("its CRS, which the map has set" in line for line in outcome["said"])
    with rasterio.open(told["work"] / "crs_of_the_map_for_a_raster.tif") as made:
        assert made.crs.to_epsg() == 3034


def read(path: Path) -> np.ma.MaskedArray:
    with rasterio.open(path) as made:
        return made.read(1, masked=True)


def test_a_temporary_folder_and_the_layers_of_a_run(told):
    assert Path(told["temporary"]["results"]["OUTPUT"]).name == "OUTPUT"
    waiting = told["folder"]["waiting"]
    assert waiting["run.gpkg|layername=deposits"] == "Deposits"
    assert waiting["hit_count.tif"] == "Hit count"
    assert told["temporary"]["waiting"] == {}


def test_a_run_from_a_selection_can_be_followed_up_once_qgis_is_closed(told, tmp_path, capsys):
    """What the map held is in the run: the selected logs, and the recipe for the view of the terrain model."""
    run = told["work"] / "run"
    assert told["temporary"]["folder"].rpartition("/")[2].startswith("processing_")
    shutil.rmtree(told["temporary"]["folder"])
    inputs = {each["parameter"]: each["path"] for each in json.loads((run / "manifest.json").read_text())["inputs"]}
    assert inputs["dem"] == f"{run}/inputs_dem.vrt"
    assert inputs["releases"] == f"{run}/inputs.gpkg|layername=Spots_released"
    assert inputs["lines"] == f"{SAMPLE / 'sample.gpkg'}|layername=lines"
    for tool, output in (("value-trees", "values.gpkg"), ("map-origins", "origins")):
        words = [tool, f"--run={run}", f"--output={tmp_path / output}", "--quiet"]
        assert cli.run(words + (["--least=1"] if tool == "map-origins" else [])) == 0, capsys.readouterr().err
    capsys.readouterr()
    assert cli.run(["check", str(run)]) == 0
    assert "releases: same" in capsys.readouterr().out


def test_layers_of_a_run_that_is_repeated_show_the_new_run(told):
    """Rasters, too, whose old file QGIS keeps open; on another extent, and tables that are gone are removed."""
    again, run = told["again"], told["work"] / "again"
    assert again["worked"], again["said"]
    for name, before in again["first"].items():
        with rasterio.open(run / f"{name}.tif") as made:
            places = [(east, north) for east, north, _ in again["second"][name]]
            inside = [
                made.bounds.left < x < made.bounds.right and made.bounds.bottom < y < made.bounds.top for x, y in places
            ]
            true = [
                float(each[0]) if within and not np.ma.is_masked(each[0]) else None
                for each, within in zip(made.sample(places, masked=True), inside, strict=True)
            ]
            true = [None if each is None or np.isnan(each) else each for each in true]
            assert again["extent"] == [made.bounds.left, made.bounds.top]
        seen = [value for _, _, value in again["second"][name]]
        assert seen == pytest.approx(true)
        assert sum(one[2] != other for one, other in zip(before, seen, strict=True)) > 50
    with closing(sqlite3.connect(run / "run.gpkg")) as db:
        assert again["deposits"] == [each for (each,) in db.execute("SELECT runout_m FROM deposits ORDER BY rowid")]
    assert again["left"] == ["deposits", "hit_count", "jump_max"]


def test_a_file_that_is_to_be_opened_is_loaded_when_the_tool_ran_in_a_separate_thread(told):
    """As from a dialog: what is registered while preparing is lost on the way from that thread's context."""
    outcome = told["in_a_thread"]
    assert outcome["worked"], outcome["said"]
    assert list(outcome["waiting"].values()) == ["Releases"]
    assert next(iter(outcome["waiting"])).startswith("in_a_thread.gpkg")


def test_a_raster_that_is_loaded_has_its_style(told):
    """Before, it came in shades of grey: what was to be called on its arrival was attached to a copy."""
    assert told["copied_in_a_thread"]["looks"] == {"copied_in_a_thread.tif": "singlebandpseudocolor"}


def test_all_layers_of_a_file_that_is_to_be_opened_are_loaded_with_their_styles(told):
    outcome = told["layers_in_a_thread"]
    assert outcome["worked"], outcome["said"]
    assert sorted(outcome["waiting"].values()) == ["Azimuths", "Spread"]
    assert len(outcome["looks"]) == 2
    assert all(each.startswith("spread_in_a_thread.gpkg|layername=") for each in outcome["waiting"])


def test_a_layer_says_what_it_is_and_what_made_it(told):
    """Titles in words, fields with units, a map tip, the meaning, the command and the run_id."""
    azimuths = told["about"]["spread_in_a_thread.gpkg|layername=azimuths"]
    assert azimuths["name"] == "Azimuths"
    assert azimuths["aliases"]["azimuth_deg"] == "Azimuth [°]"
    assert azimuths["aliases"]["log_id"] == "Log id"
    assert '<td>Azimuth [°]</td><td>[% "azimuth_deg" %]</td>' in azimuths["tip"]
    assert "lateral-spread" in azimuths["history"][0]
    assert azimuths["abstract"]
    raster = told["about"]["copied_in_a_thread.tif"]
    assert raster["name"] == "Shares of the logs by cell"
    assert raster["abstract"]
    for name, file in (("copied_in_a_thread.tif",) * 2, ("run.gpkg|layername=deposits", "again")):
        history = told["about"][name]["history"]
        assert "deadwood-tool" in history[0]
        assert history[1] == f"run_id {run_id_of(told['work'] / file)}"


def run_id_of(place: Path) -> str:
    if place.is_dir():
        return json.loads((place / "manifest.json").read_text(encoding="utf-8"))["run_id"]
    return (record_in(place) or {})["run_id"]


def test_legends_and_titles_are_in_qgis_language(told):
    """Of ranges, classes and layers without any; the values are the same ones."""
    english, italian = told["legends"]["en"], told["legends"]["it"]
    assert english[0][:2] == ["up to 0.1 %", "0.1 to 0.3 %"]
    assert italian[0][:2] == ["fino a 0,1 %", "da 0,1 a 0,3 %"]
    assert (english[1][0], italian[1][0]) == ("at rest", "a riposo")
    assert [len(each) for each in italian] == [len(each) for each in english]
    assert english[2:] == italian[2:]
    assert told["titles"] == ["Urti contro gli alberi", "Altezza di salto massima"]


@pytest.fixture(scope="module")
def models(qgis, tmp_path_factory) -> tuple[Path, Path]:
    found = tuple(tmp_path_factory.mktemp("models") / f"{name}.model3" for name in ("fan", "storm"))
    words = [SYSTEM_PYTHON, HERE / "make_model.py", qgis.folder / "plugins", *found]
    made = subprocess.run(words, env=qgis.environment, capture_output=True, text=True, timeout=100)
    assert found[1].exists(), made.stderr[-3000:]
    return found


def run_model(qgis, model: Path, output: str, place: Path, **given: str) -> None:
    names = {"dem": SAMPLE / "dem.tif", "areas": f"{SAMPLE / 'sample.gpkg'}|layername=release_area", **given}
    outputs = {output: place, output.partition(":")[2]: place}  # in 3.22, and later
    ran = qgis("run", model, "--", *(f"{name}={value}" for name, value in (names | outputs).items()))
    assert ran.status == 0, ran.err[-3000:]


def test_a_model_of_three_tools_runs(qgis, models, tmp_path):
    run_model(qgis, models[0], "spread:fan", tmp_path / "fan.gpkg")
    with sqlite3.connect(tmp_path / "fan.gpkg") as database:
        assert database.execute("select n from spread").fetchall() == [(12,)]


def test_a_model_compares_runs_before_and_after_a_storm(qgis, models, tmp_path):
    """The forests of windthrow are outputs of its own in models; what they held is in the runs."""
    trees = tmp_path / "trees.gpkg"
    words = ["import-trees", f"--trees={SAMPLE / 'trees.csv'}", f"--dem={SAMPLE / 'dem.tif'}", f"--output={trees}"]
    assert cli.run([*words, "--quiet"]) == 0
    run_model(qgis, models[1], "compare:answer", tmp_path / "answer", trees=str(trees))
    with (tmp_path / "answer" / "comparison.csv").open(encoding="utf-8-sig") as table:
        found = {(row["scenario"], row["item"]) for row in csv.DictReader(table)}
    assert {name for name, _ in found} == {"before", "after"}
    assert ("after", "lying_log") in found  # a stop reason that only lying stems give


# --- cancel ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def started(qgis, tool, tmp_path, request) -> Iterator[tuple[subprocess.Popen, Path]]:
    """QGIS with a long run of slide-logs in it, which has begun to slide; ``param``: additional arguments."""
    releases = tmp_path / "releases.gpkg"
    made = qgis.run(
        "deadwood:samplereleases",
        {"AREAS": f"{SAMPLE / 'sample.gpkg'}|layername=release_area", "DEM": SAMPLE / "dem.tif", "COUNT": 4000}
        | {"OUTPUT": releases},
    )
    assert made.status == 0, made.err[-2000:]
    out = tmp_path / "out"
    out.mkdir()
    program = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
    words = [program, "run", "deadwood:slidelogs", "--", f"DEM={SAMPLE / 'dem.tif'}", f"RELEASES={releases}"]
    words += ["FRICTION=0.25", f"OUTPUT={out / 'run'}", *getattr(request, "param", ())]
    process = subprocess.Popen(
        words, env=qgis.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    until = time.monotonic() + 60.0
    while not (list(out.iterdir()) and children(process.pid)):
        assert time.monotonic() < until
        assert process.poll() is None, process.communicate()[1][-2000:]
        time.sleep(0.1)
    time.sleep(1.0)
    yield process, out
    if process.poll() is None:
        process.kill()
    process.communicate()


def children(parent: int) -> list[int]:
    """The processes that a process has started, and theirs."""
    found = []
    for place in Path("/proc").iterdir():
        if not place.name.isdigit():
            continue
        try:
            fields = (place / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == parent and fields[0] != "Z":
            found += [int(place.name), *children(int(place.name))]
    return found


def wait_until_gone(pids: list[int]) -> None:
    until = time.monotonic() + 15.0
    while any(alive(pid) for pid in pids):
        assert time.monotonic() < until, "the tool still runs"
        time.sleep(0.1)


def alive(pid: int) -> bool:
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


LINES = f"LINES={SAMPLE / 'sample.gpkg'}|layername=lines"


@pytest.mark.parametrize("started", [(), ("FIDELITY=auto", "ERROR=0.02", LINES)], ids=["once", "auto"], indirect=True)
def test_a_cancelled_run_leaves_nothing_behind(started):
    """If the fidelity is chosen automatically, the work of each has a separate folder."""
    process, out = started
    tools = children(process.pid)
    assert tools
    process.send_signal(signal.SIGINT)  # what qgis_process takes as Cancel
    said = process.communicate(timeout=30)
    assert process.returncode != 0
    assert "Canceled; nothing was left behind" in said[1]
    wait_until_gone(tools)
    assert list(out.iterdir()) == []


def test_the_tool_ends_when_qgis_dies(started):
    process, out = started
    tools = children(process.pid)
    os.kill(process.pid, signal.SIGKILL)
    process.wait(20)
    wait_until_gone(tools)
    assert not (out / "run").exists()
