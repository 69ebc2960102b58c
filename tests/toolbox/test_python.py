"""The toolbox from Python: functions generated from the declarations; data in, results out, no temporary paths."""

from __future__ import annotations

import ast
import gc
import inspect
import json
import os
import subprocess
import sys
from pathlib import Path

import geopandas
import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

import deadwood_toolbox as dw
from deadwood_algorithms.files.in_memory import read_raster
from deadwood_algorithms.params.tool import VERSION
from deadwood_toolbox import calls, functions, functions_page
from deadwood_toolbox.shelf import TOOLS, python_names

ROOT = Path(__file__).parents[2]
HEAVY = {"geopandas", "pandas", "rasterio", "pyogrio", "pyproj", "pyarrow", "matplotlib", "numba", "numpy"}
CRS = "EPSG:2056"
WEST, NORTH = 2_600_000.0, 1_200_000.0


def slope() -> np.ndarray:
    """Heights of 140 x 40 cells of 1 m: a slope of 35 degrees, and a meadow of 100 m, row 0 northernmost [m]."""
    y = np.arange(140)[::-1, np.newaxis]
    return (1000.0 + 0.7 * np.maximum(y - 100.0, 0.0) + np.zeros((140, 40))).astype(np.float32)


@pytest.fixture(scope="module")
def dem() -> dw.Raster:
    return dw.Raster(slope(), from_origin(WEST, NORTH, 1.0, 1.0), CRS)


@pytest.fixture(scope="module")
def releases() -> geopandas.GeoDataFrame:
    places = [shapely.Point(WEST + 12.0 + 4.0 * k, NORTH - 20.0) for k in range(5)]
    known = {"log_id": range(1, 6), "dbh_cm": 40.0, "length_m": 8.0, "orientation": "lying", "azimuth_deg": 180.0}
    return geopandas.GeoDataFrame(known, geometry=places, crs=CRS)


@pytest.fixture(scope="module")
def line() -> geopandas.GeoDataFrame:
    foot = shapely.LineString([(WEST + 1.0, NORTH - 30.0), (WEST + 39.0, NORTH - 30.0)])
    return geopandas.GeoDataFrame({"line_id": ["road"]}, geometry=[foot], crs=CRS)


@pytest.fixture(scope="module")
def run(dem, releases, line) -> functions.SlideLogsResult:
    return dw.slide_logs(dem=dem, releases=releases, lines=line, friction=0.3, fidelity="draft", trajectories="all")


def test_editors_read_what_runs(tmp_path, monkeypatch):
    """The file for editors, as installing writes it, has the same signatures and docstrings as the functions."""
    monkeypatch.setattr(functions_page, "PLACE", tmp_path / "functions.pyi")
    functions_page.write()
    parsed = ast.parse((tmp_path / "functions.pyi").read_text(encoding="utf-8"))
    read = {each.name: each for each in parsed.body if isinstance(each, ast.FunctionDef | ast.ClassDef)}
    assert sorted(read) == sorted(functions.__all__)
    for name, each in read.items():
        made = getattr(dw, name)
        assert ast.get_docstring(each) == inspect.getdoc(made), name
        if isinstance(each, ast.FunctionDef):
            typed = {arg.arg: ast.unparse(arg.annotation) for arg in [*each.args.args, *each.args.kwonlyargs]}
            defaults = [*([None] * (len(typed) - len(each.args.kw_defaults))), *each.args.kw_defaults]
            values = [inspect.Parameter.empty if one is None else ast.literal_eval(one) for one in defaults]
            known = inspect.signature(made).parameters
            assert typed == {one.name: one.annotation for one in known.values()}, name
            assert values == [one.default for one in known.values()], name


def test_installing_writes_the_file_for_editors():
    """The hook of the build, which ``pip install --editable`` runs, too: here is what it wrote."""
    assert functions_page.PLACE.is_file(), "pip install --editable ."


def test_every_tool_is_a_function_with_its_parameters():
    for tool in TOOLS:
        known = inspect.signature(getattr(dw, python_names(tool.name)[0])).parameters
        declared = {each.name: each for each in tool.parameters()}
        assert set(known) == {*declared, "progress", "feedback"}, tool.name
        for name, each in declared.items():
            needed = each.default is None and not each.optional and not each.is_output
            assert (known[name].default is inspect.Parameter.empty) == needed, (tool.name, name)
            if not needed and not each.is_output:
                assert known[name].default == each.default, (tool.name, name)


def test_the_help_of_a_function_names_no_flag_of_its_own():
    text = inspect.getdoc(dw.count_hits)
    assert text is not None
    assert "danger_least" in text
    assert "--danger-least" not in text
    assert text.count("Parameters\n-----") == 1


def test_the_import_brings_no_library_along(checkout):
    """A function is made from its tool's declaration, whose file may import what starts quickly (``shelf``)."""
    look = "import sys, deadwood_toolbox; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", look], env=checkout, capture_output=True, text=True, check=True)
    assert HEAVY & set(ran.stdout.split()) == set()


def test_the_names_are_those_that_there_are():
    assert {"slide_logs", "SlideLogsResult", "Raster", "UserError", "sample_data"} <= set(dir(dw))
    assert dw.__version__ == VERSION
    with pytest.raises(AttributeError, match="no attribute 'slide_log'"):
        dw.slide_log  # noqa: B018


def test_type_checkers_know_parameters_and_results(tmp_path: Path):
    """What editors see: pyright, on a file of a user."""
    pytest.importorskip("pyright")
    right = """\
        import deadwood_toolbox as dw
        sample = dw.sample_data()
        run = dw.slide_logs(dem=sample.dem, releases=sample.release_area, friction=0.25)
        reveal_type(run.deposits)
        reveal_type(run.hits)
        reveal_type(run.poses)
        dw.make_report([run, run], names=["a", "b"])
        """
    wrong = (
        "dw.slide_logs(demm='a', releases='b')",
        "dw.slide_logs(dem='a', releases='b', friction=0.25, fidelity='quick')",
        "dw.slide_logs(dem='a')",
        "dw.slide_logs(dem='a', releases='b', seed='many')",
        "run.deposit",
    )
    lines = [line.strip() for line in right.splitlines()]
    (tmp_path / "user.py").write_text("\n".join([*lines, *wrong, ""]), encoding="utf-8")
    settings = {"extraPaths": [str(ROOT), str(ROOT / "engine"), str(ROOT / "algorithms")], "include": ["user.py"]}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    ran = subprocess.run(
        [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(tmp_path)],
        capture_output=True,
        text=True,
    )
    if not ran.stdout.startswith("{"):
        pytest.skip(f"pyright does not run here: {ran.stdout[-200:]}{ran.stderr[-200:]}")
    found = json.loads(ran.stdout)["generalDiagnostics"]
    told = [each["message"] for each in found if each["severity"] == "information"]
    assert [text.split('"')[-2] for text in told] == ["GeoDataFrame", "Raster", "DataFrame"]
    faults = sorted({each["range"]["start"]["line"] - len(lines) for each in found if each["severity"] == "error"})
    assert faults == list(range(len(wrong))), found


def test_data_in_are_files_in(tmp_path: Path, dem, releases, line, run):
    """The same deposits, bit for bit, from GeoDataFrames and an array as from files of other programs."""
    releases.to_file(tmp_path / "releases.gpkg", driver="GPKG")
    line.to_file(tmp_path / "line.shp")
    profile = {"driver": "GTiff", "height": 140, "width": 40, "count": 1, "dtype": "float32", "crs": CRS}
    with rasterio.open(tmp_path / "dem.tif", "w", transform=dem.transform, **profile) as target:
        target.write(dem.array, 1)
    by_path = dw.slide_logs(
        dem=tmp_path / "dem.tif",
        releases=str(tmp_path / "releases.gpkg"),
        lines=tmp_path / "line.shp",
        friction=0.3,
        fidelity="draft",
        output=tmp_path / "run",
    )
    pd.testing.assert_frame_equal(pd.DataFrame(by_path.deposits), pd.DataFrame(run.deposits))
    assert (by_path.hits.array == run.hits.array).all()
    assert by_path.path == by_path.folder == tmp_path / "run"
    assert by_path.summary["reach"] == run.summary["reach"]


def test_a_run_tells_what_it_found(run):
    assert {"deposits", "trajectories", "reach", "poses", "hits", "danger"} <= set(run.parts)
    assert len(run.deposits) == 5
    assert run.reach["n_reach"].tolist() == [5]
    assert run.hits.array.shape == (140, 40)
    assert run.hits.extent == (WEST, WEST + 40.0, NORTH - 140.0, NORTH)
    assert run.jump_max.array.shape == (2, 140, 40)
    assert run.jump_max.names == ("jump_max", "height_max")
    assert run.hits.meanings[0].startswith("Number of logs that touched the cell")
    assert run.poses["log_id"].nunique() == 5
    assert run.summary["logs"]["released"] == 5
    assert "5 logs: " in run.text
    assert run.text in repr(run)
    with pytest.raises(dw.UserError, match="slide-logs did not make 'danger_count' in this run"):
        run.danger_count  # noqa: B018


def test_the_same_data_give_the_same_identity(dem, releases, line, run):
    """Whenever, and in whatever temporary folder; other data give another."""
    asked = {"dem": dem, "lines": line, "fidelity": "draft", "trajectories": "all"}
    again = dw.slide_logs(releases=releases.copy(), friction=0.3, **asked)
    other = dw.slide_logs(releases=releases.assign(dbh_cm=41.0), friction=0.3, **asked)
    assert again.folder != run.folder
    assert again.manifest["run_id"] == run.manifest["run_id"]
    assert other.manifest["run_id"] != run.manifest["run_id"]


def test_rows_from_the_south_are_the_same_raster(dem, releases, run):
    """A transform whose northings increase with the rows, as in many grids."""
    upward = rasterio.Affine(1.0, 0.0, WEST, 0.0, 1.0, NORTH - 140.0)
    turned = dw.Raster(dem.array[::-1], upward, CRS)
    assert turned.extent == (WEST, WEST + 40.0, NORTH, NORTH - 140.0)
    again = dw.slide_logs(dem=turned, releases=releases, friction=0.3, fidelity="draft")
    assert (again.hits.array == run.hits.array).all()


def test_an_xarray_brings_its_place_with_it(dem, releases, run):
    """Through the accessor of rioxarray, which need not be installed: only three of its attributes are used."""

    class Place:
        crs, nodata = CRS, None

        def transform(self):
            return dem.transform

    class DataArray:
        dims, values, rio = ("band", "y", "x"), dem.array[np.newaxis], Place()

    again = dw.slide_logs(dem=DataArray(), releases=releases, friction=0.3, fidelity="draft")
    assert (again.hits.array == run.hits.array).all()
    DataArray.rio = None
    with pytest.raises(dw.UserError, match=r"^dem: a DataArray gives its transform and CRS through rioxarray"):
        dw.slide_logs(dem=DataArray(), releases=releases, friction=0.3)


def test_friction_as_polygons_and_as_an_array(dem, releases, run):
    """A raster and a layer with 0.3 everywhere give the same as the number 0.3."""
    area = shapely.box(WEST - 5.0, NORTH - 145.0, WEST + 45.0, NORTH + 5.0)
    polygons = geopandas.GeoDataFrame({"friction": [0.3]}, geometry=[area], crs=CRS)
    raster = dw.Raster(np.full((140, 40), 0.3), dem.transform, CRS)
    for friction in (polygons, raster):
        again = dw.slide_logs(dem=dem, releases=releases, friction=friction, fidelity="draft")
        np.testing.assert_allclose(again.deposits["path_m"], run.deposits["path_m"], rtol=1e-6)  # 0.3 in float32


def test_results_are_inputs(run, line, tmp_path: Path):
    """One run, several, a layer of a result; and their files exist as long as something made from them."""
    hits = dw.count_hits(run=run)
    assert (hits.hits.array == run.hits.array).all()
    spread = dw.lateral_spread(deposits=run)
    assert len(spread.azimuths) == 5
    reached = dw.reach_lines(run=run, lines=line)
    assert reached.reach["n_reach"].tolist() == [5]
    compared = dw.compare_scenarios(runs=[run, run.path], names=["a", "b"], output=tmp_path / "compared")
    assert set(compared.comparison["scenario"]) == {"a", "b"}
    assert compared.summary == json.loads((tmp_path / "compared" / "comparison.json").read_text(encoding="utf-8"))


def test_a_temporary_result_lasts_as_long_as_what_needs_it(dem, releases):
    run = dw.slide_logs(dem=dem, releases=releases, friction=0.3, fidelity="draft", trajectories="all")
    folder = run.folder
    hits = dw.count_hits(run=run)
    del run
    gc.collect()
    assert folder.is_dir()
    own = hits.folder
    del hits
    gc.collect()
    assert not folder.exists()
    assert not own.exists()


def test_what_is_kept_keeps_its_inputs(dem, releases, tmp_path: Path):
    """The manifest names data as files, so they are kept in the run, and the run can be repeated."""
    asked = {"dem": dem, "releases": releases, "friction": 0.3, "fidelity": "draft", "output": tmp_path / "run"}
    first = dw.slide_logs(**asked)
    inputs = [tmp_path / "run" / name for name in ("inputs_dem.tif", "inputs.gpkg")]
    before = [each.read_bytes() for each in inputs]
    with pytest.raises(dw.UserError, match="the output exists; overwrite replaces it"):
        dw.slide_logs(**asked)
    again = dw.slide_logs(**asked, overwrite=True)
    assert [each.read_bytes() for each in inputs] == before
    assert again.manifest["run_id"] == first.manifest["run_id"]
    assert [each["path"] for each in again.manifest["inputs"]] == [f"{inputs[0]}", f"{inputs[1]}|layername=releases"]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run"]
    told = dw.check(tmp_path / "run").text
    assert "dem: same" in told
    assert "releases: same" in told


def test_what_is_kept_keeps_the_results_that_were_not_saved(dem, tmp_path: Path):
    """Before, the manifest named the temporary file of the releases, and check said that they were gone."""
    area = geopandas.GeoDataFrame(geometry=[shapely.box(WEST + 5.0, NORTH - 22.0, WEST + 35.0, NORTH - 18.0)], crs=CRS)
    drawn = dw.sample_releases(areas=area, dem=dem, count=3, length_m=8.0)
    dw.slide_logs(dem=dem, releases=drawn, friction=0.3, fidelity="draft", output=tmp_path / "run")
    del drawn
    gc.collect()
    told = dw.check(tmp_path / "run")
    assert "releases: same" in told.text
    assert geopandas.read_file(tmp_path / "run" / "inputs.gpkg", layer="releases").shape[0] == 3
    saved = dw.sample_releases(areas=area, dem=dem, count=3, length_m=8.0, output=tmp_path / "saved.gpkg")
    dw.slide_logs(dem=dem, releases=saved, friction=0.3, fidelity="draft", output=tmp_path / "other")
    assert not (tmp_path / "other" / "inputs.gpkg").exists()


def test_a_call_that_fails_leaves_nothing(dem, releases, tmp_path: Path):
    with pytest.raises(dw.UserError, match="^friction is -1, but must be at least 0"):
        dw.slide_logs(dem=dem, releases=releases, friction=-1.0, output=tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_optional_outputs_stand_where_they_are_named_or_beside(run, tmp_path: Path):
    made = dw.count_hits(run=run, speed=True, energy=tmp_path / "e.tif", output=tmp_path / "hits.tif")
    assert sorted(each.name for each in tmp_path.iterdir() if each.suffix == ".tif") == [
        "e.tif",
        "hits.tif",
        "hits_speed.tif",
    ]
    assert set(made.parts) == {"hits", "speed", "energy"}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"releases": "no_crs"}, r"^releases: the GeoDataFrame has no CRS; name it, for example releases\.set_crs\("),
        ({"dem": dw.Raster(slope(), from_origin(0, 0, 1, 1), None)}, r"^dem: the array has no CRS; give one"),
        ({"dem": dw.Raster(slope(), from_origin(0, 0, 1, 1), "EPSG:0")}, r"^dem: 'EPSG:0' is not a known CRS"),
        ({"dem": dw.Raster(slope(), (1, 2), CRS)}, r"^dem: the transform '\(1, 2\)' is not six numbers"),
        ({"dem": dw.Raster(slope()[0], from_origin(0, 0, 1, 1), CRS)}, r"^dem: an array of shape \(40,\)"),
        ({"dem": 3}, "^dem has the type int, but must be a path or a Raster$"),
        ({"output": True}, "^output is 'True', but must be a path$"),
        ({"friction": "none.tif"}, "none.tif"),
        ({"friction": [0.2, 0.3]}, "^friction takes one value, but 2 were given; .* or use vary,"),
        ({"rolling_friction": (0.1, 0.2, 0.3)}, "^rolling_friction takes one value, but 3 were given"),
        ({"rest_speed_ms": -1.0}, "^rest_speed_ms is -1 m/s, but must be greater than 0"),
    ],
)
def test_wrong_inputs_are_one_clear_line(dem, releases, wrong, message):
    if wrong.get("releases"):
        wrong = {"releases": releases.set_crs(None, allow_override=True)}
    with pytest.raises(dw.UserError, match=message) as caught:
        dw.slide_logs(**{"dem": dem, "releases": releases, "friction": 0.3, "fidelity": "draft", **wrong})
    assert "\n" not in str(caught.value)
    assert "--" not in str(caught.value)


def test_messages_name_arguments_and_commands_keep_their_options():
    told = calls.with_arguments(
        "--rest-speed-ms is 3; try --crs EPSG:2056, or run deadwood-tool vary --vary friction; so --n"
    )
    assert told == "rest_speed_ms is 3; try crs EPSG:2056, or run deadwood-tool vary --vary friction; so n"


def test_the_surroundings_are_put_back(dem, releases, monkeypatch):
    """PROJ_DATA of another program hides every CRS from rasterio, so the command drops it; here only during a call."""
    monkeypatch.setenv("PROJ_DATA", "/nowhere")
    before = dict(os.environ)
    dw.slide_logs(dem=dem, releases=releases, friction=0.3, fidelity="draft")
    assert dict(os.environ) == before


def test_warnings_are_python_warnings_where_nobody_hears_them(dem, releases):
    """At the line of the caller; with the caller's own feedback, there."""
    doubtful = releases.assign(dbh_cm=releases["dbh_cm"] * 20.0)
    with pytest.warns(UserWarning, match="dbh_cm") as caught:
        found = dw.slide_logs(dem=dem, releases=doubtful, friction=0.3, fidelity="draft")
    assert caught[0].filename == __file__
    assert str(caught[0].message) in found.warnings


def test_numbers_of_numpy_are_numbers(dem, releases, run):
    again = dw.slide_logs(dem=dem, releases=releases, friction=np.float64(0.3), fidelity="draft", seed=np.int64(0))
    assert (again.hits.array == run.hits.array).all()


def test_the_report_and_the_plot(run, dem, releases, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    page = run.report()
    assert page.parent == run.folder
    assert "<html" in page.read_text(encoding="utf-8")[:200].lower()
    axes = run.plot()
    words = [each.get_text() for each in axes.get_legend().get_texts()]
    reasons = run.deposits["stop_reason"].value_counts()
    assert words == ["roads, railways, houses", *(f"{name} ({n})" for name, n in reasons.items())]
    relief, hits = axes.images
    assert np.ptp(relief.get_array()) > 0.0
    touched = np.argwhere(run.hits.array > 0)
    west, _, south, north = run.hits.extent
    assert axes.get_xlim()[0] < west + touched[:, 1].min()
    assert axes.get_ylim()[0] < north - touched[:, 0].max() - 1.0
    assert tuple(hits.get_extent()) == run.hits.extent
    trees = geopandas.GeoDataFrame(
        {"dbh_cm": [40.0, 30.0], "height_m": [20.0, 15.0]},
        geometry=shapely.points([(west + 5.0, south + 8.0), (west + 30.0, south + 9.0)]),
        crs=CRS,
    )
    axes = dw.slide_logs(dem=dem, releases=releases, trees=trees, friction=0.3, fidelity="draft").plot()
    assert axes.get_legend().get_texts()[0].get_text() == "trees"
    stems = next(each for each in axes.collections if each.get_label() == "trees")
    assert stems.get_offsets().tolist() == [[each.x, each.y] for each in trees.geometry]
    assert run.hits.plot().images


def test_the_sample_data_are_there():
    sample = dw.sample_data()
    assert Path(sample.dem).is_file()
    for name in ("release_area", "lines", "barriers", "forest", "dams", "flights", "deadwood"):
        file, layer = getattr(sample, name).split("|layername=")
        assert len(geopandas.read_file(file, layer=layer)) > 0
    assert read_raster(Path(sample.dem)).array.shape == (1000, 600)


def test_scaled_integers_are_the_numbers_that_they_stand_for(tmp_path: Path, dem):
    """Heights in centimetres above 900 m, as the sample has them: metres in the array, NaN where there is no height."""
    profile = {"driver": "GTiff", "height": 140, "width": 40, "dtype": "uint16", "nodata": 65535, "crs": CRS}
    stored = np.round((dem.array - 900.0) * 100.0).astype(np.uint16)
    stored[0, 0] = 65535
    for count in (1, 2):
        with rasterio.open(tmp_path / "scaled.tif", "w", transform=dem.transform, count=count, **profile) as target:
            for k in target.indexes:
                target.write(stored, k)
            target.scales, target.offsets = (0.01,) * count, (900.0,) * count
        found = read_raster(tmp_path / "scaled.tif")
        assert found.array.shape == (140, 40) if count == 1 else (2, 140, 40)
        assert np.isnan(found.band[0, 0])
        np.testing.assert_allclose(found.band.ravel()[1:], dem.array.ravel()[1:], atol=0.006)
        assert (found.nodata, found.extent) == (None, dem.extent)


def test_tables_go_in_as_data_frames(tmp_path: Path):
    """Columns of a DataFrame with and without a named index are those of the file."""
    sample = dw.sample_data()
    trees = pd.read_csv(sample.trees)
    by_path = dw.import_trees(trees=sample.trees, dem=sample.dem)
    by_frame = dw.import_trees(trees=trees, dem=sample.dem)
    by_index = dw.import_trees(trees=trees.set_index("tree_id"), dem=sample.dem)
    for each in (by_frame, by_index):
        pd.testing.assert_frame_equal(pd.DataFrame(each.trees), pd.DataFrame(by_path.trees))
