"""Every tool, run by QGIS on the sample, leaves what the command line leaves: the same bytes where that is promised."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import pytest

from deadwood_algorithms.params.tool import Parameter, Tool
from deadwood_toolbox import cli
from deadwood_toolbox.shelf import TOOLS, find

SAMPLE = Path(__file__).parents[2] / "sample_data"
DEM = SAMPLE / "dem.tif"
LAYERS = SAMPLE / "sample.gpkg"
# In the order of the workflow: the command line's output of one is the input of the next. {work} is its folder.
CASES: dict[str, dict[str, object]] = {
    "sample-releases": {"areas": f"{LAYERS}|layername=release_area", "dem": DEM, "count": 24},
    "import-trees": {"trees": SAMPLE / "trees.csv", "dem": DEM, "id_field": "tree_id"},
    "generate-forest": {"dem": DEM, "stand": f"{LAYERS}|layername=forest", "like": "{work}/import-trees.gpkg"},
    "windthrow": {"trees": "{work}/import-trees.gpkg", "dem": DEM, "share": 0.4, "fall_deg": 180.0},
    "add-structures": {"dem": DEM, "structures": f"{LAYERS}|layername=dams", "max_reach_m": 60.0},
    "find-trees": {"dsm": "{work}/add-structures.tif", "dem": DEM},
    "inspect": {"path": DEM},
    "assess-mobilisation": {"dem": DEM, "friction": 0.25, "cell_m": 40.0, "logs_per_cell": 1},
    "fit-flight": {"dem": DEM, "flights": f"{LAYERS}|layername=flights", "length_m": 15.0},
    "make-log": {"rings": 5},
    "slide-logs": {
        "dem": DEM,
        "releases": "{work}/sample-releases.gpkg",
        "trees": "{work}/import-trees.gpkg",
        "barriers": f"{LAYERS}|layername=barriers",
        "lines": f"{LAYERS}|layername=lines",
        "friction": 0.25,
        "fidelity": "draft",
        "qgis_project": True,
    },
    "run-sites": {
        "dem": DEM,
        "releases": "{work}/sample-releases.gpkg",
        "by": "orientation",
        "friction": 0.25,
        "fidelity": "draft",
        "lines": f"{LAYERS}|layername=lines",
    },
    "count-hits": {"run": "{work}/slide-logs", "cell_m": 2.0, "stop_reason": "tree"},
    "reach-lines": {"run": "{work}/slide-logs", "lines": f"{LAYERS}|layername=lines"},
    "design-values": {"run": "{work}/slide-logs", "percentiles": "50,95"},
    "value-trees": {"run": "{work}/slide-logs", "stands": f"{LAYERS}|layername=forest"},
    "break-trees": {"run": "{work}/slide-logs", "tree_capacity_kj": 10.0},
    "site-barriers": {
        "run": "{work}/run-sites/sites/upright",
        "above_m": "15",
        "length_m": "40",
        "height_m": "4",
        "places": 1,
    },
    "map-intensity": {"run": "{work}/slide-logs", "events_per_year": 0.1},
    "map-origins": {"run": "{work}/slide-logs-bare", "least": 1},
    "age": {"dead_trees": "{work}/import-trees.gpkg", "storm_return_years": "15", "draws": 50},
    "decide": {
        "dead_trees": "{work}/import-trees.gpkg",
        "dem": DEM,
        "lines": f"{LAYERS}|layername=lines",
        "friction": 0.3,
        "storm_return_years": "15",
        "start_share": "0.2,0.4",
        "mobilised_per_year": "0.01",
        "most_trees": 3,
        "repeats": 2,
        "draws": 20,
    },
    "lateral-spread": {"deposits": "{work}/slide-logs/run.gpkg|layername=deposits"},
    "compare-scenarios": {"runs": "{work}/slide-logs,{work}/slide-logs-bare"},
    "calibrate-friction": {
        "dem": DEM,
        "releases": "{work}/sample-releases.gpkg",
        "reached": f"{LAYERS}|layername=lines",
        "event_logs": 4,
        "event_reached": 1,
        "friction": "0.3:0.6:0.3",
        "fidelity": "draft",
        "time_limit_s": 10.0,
    },
    "compare-fidelity": {
        "dem": DEM,
        "releases": "{work}/sample-releases.gpkg",
        "friction": 0.25,
        "fidelities": "draft,standard",
        "logs": 8,
        "time_limit_s": 5.0,
    },
    "vary": {
        "dem": DEM,
        "releases": "{work}/sample-releases.gpkg",
        "lines": f"{LAYERS}|layername=lines",
        "friction": 0.25,
        "vary": "friction=0.2:0.4,rolling_friction",
        "design": "ends",
        "logs": 8,
        "time_limit_s": 5.0,
    },
    "make-report": {"runs": "{work}/slide-logs,{work}/slide-logs-bare", "names": "with,without"},
    "reproduce-paper": {"site": "rothenbrunnen", "quick": True, "logs": 8},
}
# The cost and place of a run, and files that contain these or a picture of them.
COSTS = {"made_utc", "modified_utc", "seal", "files", "cost", "output", "folder", "seconds"}
# Results of other results in the same folder: these inputs are identified by their bytes, which contain times.
OF_RESULTS = {"inputs", "run_id"}
NOT_COMPARED = {"comparison.csv", "comparison.json", "comparison.png", "overview.csv", "overview.gpkg"}


def test_every_tool_has_its_case():
    assert [tool.name for tool in TOOLS if tool.in_qgis and tool.name not in CASES] == []


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the command line for all cases."""
    folder = tmp_path_factory.mktemp("command")
    for name, values in CASES.items():
        case = filled(name, values, folder)
        assert cli.run([name, *words_of(case), "--quiet"]) == 0, name
        if name == "slide-logs":  # the same logs without the barriers, to compare with
            bare = {key: value for key, value in case.items() if key not in ("barriers", "qgis_project")}
            assert cli.run([name, *words_of(bare | {"output": f"{folder}/slide-logs-bare"}), "--quiet"]) == 0
    return folder


def words_of(case: Mapping[str, object]) -> list[str]:
    """The parameters as a command line."""
    words = []
    for name, value in case.items():
        words += ["--" + name.replace("_", "-")] + ([] if value is True else [str(value)])
    return words


def filled(name: str, values: Mapping[str, object], work: Path, out: Path | None = None) -> dict[str, object]:
    """The parameters of a case, with its input from the command line's folder and its output in another."""
    tool = find(name)
    assert tool is not None
    known = {key: value.format(work=work) if isinstance(value, str) else value for key, value in values.items()}
    return known | {each.name: f"{out or work}/{name}{each.ending}" for each in outputs_of(tool)}


def outputs_of(tool: Tool) -> list[Parameter]:
    return [each for each in tool.parameters() if each.is_output and not each.optional]


def one_of_each_kind() -> list[str]:
    """A tool for each kind of output: the first of them that is not slow."""
    tools = [
        tool for tool in TOOLS if tool.name in CASES and tool.name not in ("slide-logs", "windthrow", "find-trees")
    ]
    return list({each.kind: tool.name for tool in reversed(tools) for each in outputs_of(tool)}.values())


@pytest.mark.parametrize("name", CASES)
def test_a_tool_run_by_qgis_leaves_what_the_command_line_leaves(qgis, work, tmp_path, name):
    tool = find(name)
    assert tool is not None
    parameters = {key.upper(): value for key, value in filled(name, CASES[name], work, tmp_path).items()}
    results = qgis.run(tool.qgis_id, parameters).results
    for parameter in tool.parameters():
        if parameter.is_output and not parameter.optional:
            assert results[parameter.name.upper()] == str(parameters[parameter.name.upper()])
    made = sorted(each.relative_to(tmp_path) for each in tmp_path.rglob("*") if each.is_file())
    expected = {each.relative_to(work) for each in work.rglob("*") if each.is_file()}
    assert made == sorted(each for each in expected if each.parts[0].partition(".")[0] == name)
    for each in made:
        assert_same(tmp_path / each, work / each, (tmp_path, work))


def assert_same(one: Path, other: Path, roots: tuple[Path, Path]) -> None:
    """The same bytes; of a JSON file the same facts, except the cost of the run and its root folder; of a
    GeoPackage the same rows, as its record may name inputs in the root, and the SHA-256 of a run with its times."""
    if one.name in NOT_COMPARED:
        return
    if one.suffix == ".gpkg" and one.read_bytes() != other.read_bytes():
        assert rows(one) == rows(other), one.name
        return
    if one.suffix == ".json":
        assert facts(one, roots) == facts(other, roots), one.name
    else:
        assert one.read_bytes() == other.read_bytes(), one.name


def rows(path: Path) -> list[str]:
    """Everything in a GeoPackage, as SQL, except its record."""
    with closing(sqlite3.connect(path)) as database:
        return [line for line in database.iterdump() if not line.startswith('INSERT INTO "gpkg_metadata"')]


def facts(path: Path, roots: tuple[Path, Path]) -> object:
    apart = COSTS | (OF_RESULTS if "reproduce-paper" in path.parts else set())

    def without(value: object) -> object:
        if isinstance(value, dict):
            return {key: without(each) for key, each in value.items() if key not in apart}
        return value

    text = path.read_text(encoding="utf-8")
    for root in roots:
        text = text.replace(str(root), "ROOT")
    return without(json.loads(text))


@pytest.mark.parametrize("name", one_of_each_kind())
@pytest.mark.parametrize("proposed", ["TEMPORARY_OUTPUT", "{folder}/without_ending"])
def test_the_proposed_outputs_do_for_every_kind_of_file(qgis, work, tmp_path, name, proposed):
    """A page, a layer, a table, a raster, a folder: where QGIS names them, and where the user gives no ending."""
    tool = find(name)
    assert tool is not None
    case = {key.upper(): value for key, value in filled(name, CASES[name], work, tmp_path).items()}
    case |= {each.name.upper(): proposed.format(folder=tmp_path) for each in outputs_of(tool)}
    results = qgis.run(tool.qgis_id, case).results
    for each in outputs_of(tool):
        assert results[each.name.upper()].endswith(each.ending)


def test_the_layers_of_a_run_are_results_that_models_can_chain_on(qgis, work, tmp_path):
    case = filled("reach-lines", CASES["reach-lines"], work, tmp_path)
    results = qgis.run("deadwood:reachlines", {key.upper(): value for key, value in case.items()}).results
    assert results["REACH"] == f"{tmp_path / 'reach-lines.gpkg'}|layername=reach"
    assert results["ARRIVALS"].endswith("|layername=arrivals")


# --- wrong input -----------------------------------------------------------------------------------------------------

WRONG = {
    "out of bounds": ("slide-logs", {"friction": -1}),
    "no number": ("sample-releases", {"count": "many"}),
    "no such file": ("sample-releases", {"dem": "{work}/nowhere.tif"}),
    "a layer that is not there": ("slide-logs", {"trees": f"{LAYERS}|layername=tree"}),
    "several layers and none named": ("slide-logs", {"trees": str(LAYERS)}),
    "a field that is missing": ("slide-logs", {"trees": f"{LAYERS}|layername=release_area"}),
    "no choice": ("slide-logs", {"fidelity": "best"}),
    "no run": ("count-hits", {"run": str(SAMPLE)}),
    "a wrong ending": ("count-hits", {"output": "{work}/hits.asc"}),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_input_gives_the_line_of_the_command_line_with_labels_for_flags(qgis, work, tmp_path, capsys, what):
    name, changes = WRONG[what]
    tool = find(name)
    assert tool is not None
    case = filled(name, CASES[name] | changes, work, tmp_path)
    if "output" in changes:
        case["output"] = str(tmp_path / "hits.asc")
    capsys.readouterr()
    assert cli.run([name, *words_of(case), "--quiet"]) == 2
    line = capsys.readouterr().err.strip().removeprefix("deadwood-tool: ")
    assert "\n" not in line
    ran = qgis("run", tool.qgis_id, "--", *(f"{key.upper()}={value}" for key, value in case.items()))
    assert ran.status == 1
    for each in sorted(tool.parameters(), key=lambda each: -len(each.flag)):
        line = line.replace(each.flag, f"'{each.label}'")
    line = line.replace("slide-logs", "'Slide logs'")  # tools have their names of the toolbox, too
    assert line in ran.err.splitlines()
    assert what != "out of bounds" or line == "'Friction coefficient' is -1, but must be at least 0"
    assert "Traceback" not in ran.err
    assert list(tmp_path.iterdir()) == []


def test_what_is_doubted_is_said_and_no_failure(qgis, tmp_path):
    """The command's exit status is 3; in QGIS the algorithm ends well, and its log holds the doubt."""
    page = tmp_path / "page.geojson"
    tree = {"type": "Feature", "properties": {"dbh_cm": 30}, "geometry": {"type": "Point", "coordinates": [8.3, 46.9]}}
    page.write_text(json.dumps({"type": "FeatureCollection", "features": [tree] * 7, "numberMatched": 40}))
    assert cli.run(["inspect", str(page), "--quiet"]) == 3
    ran = qgis.run("deadwood:inspect", {"PATH": page})
    assert ran.results == {}
    assert any("doubted (one-page): " in line and "7 of 40 features" in line for line in ran.document["log"]["info"])


def test_a_friction_that_is_missing_is_named(qgis, work, tmp_path):
    """QGIS itself names any other parameter; this one is a number or a layer, so that it may leave out either."""
    case = filled("slide-logs", CASES["slide-logs"], work, tmp_path)
    words = (f"{key.upper()}={value}" for key, value in case.items() if key != "friction")
    ran = qgis("run", "deadwood:slidelogs", "--", *words)
    assert ran.status == 1
    assert "'Friction coefficient' is missing: a number, a layer, or 'Friction coefficient by name'" in ran.err


def test_friction_may_be_a_layer_but_not_both(qgis, work, tmp_path):
    case = filled("slide-logs", CASES["slide-logs"], work, tmp_path)
    words = [f"{key.upper()}={value}" for key, value in case.items()]
    both = qgis("run", "deadwood:slidelogs", "--", *words, f"FRICTION_LAYER={work / 'count-hits.tif'}")
    assert both.status == 1
    assert "a number (0.25) and a layer are given; clear one of them" in both.err
    layer = f"{LAYERS}|layername=forest"
    alone = [word for word in words if not word.startswith("FRICTION=")]
    one = qgis("run", "deadwood:slidelogs", "--", *alone, f"FRICTION_LAYER={layer}")
    assert one.status == 1  # the forest has no field of friction: the tool has read it and reports this
    assert "friction" in one.err
    assert "forest" in one.err


def test_a_folder_is_only_replaced_if_the_user_says_so(qgis, work, tmp_path):
    (tmp_path / "log").mkdir()
    (tmp_path / "log" / "mine.txt").write_text("mine")
    for replace in ("false", "true"):
        ran = qgis("run", "deadwood:makelog", "--", f"OUTPUT={tmp_path / 'log'}", f"OVERWRITE={replace}")
        assert ran.status == 1
        assert "the output exists" in ran.err
    assert [each.name for each in (tmp_path / "log").iterdir()] == ["mine.txt"]
