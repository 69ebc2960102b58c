"""Every row of every input layer of every tool: read = used + left out, with reasons, in the record of the result.

The list of layers comes from the declarations: a new tool or a new layer has no account until it reports one, and no
case until one is written here. The expected numbers are those of the rows below.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from explore_case import opened
from slope_case import EAST, NORTH, Case, points, write_layer

from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.params.tool import UserError
from deadwood_toolbox.shelf import TOOLS, find

KINDS = ("vector", "table", "number_or_layer")
Count = tuple[int, int, dict[str, int]]  # read, used, left out by why

# Places: two on the slope, one beyond the DEM, one on its nodata, one on its last half cell
PLACES = points((10.0, 40.0), (20.0, 45.0), (900.0, 50.0), (55.0, 92.0), (0.2, 50.0))
OF_PLACES: Count = (5, 2, {"off_dem": 1, "no_terrain": 2})
OF_LINES: Count = (2, 1, {"off_dem": 1})
OF_WORKS: Count = (4, 2, {"off_dem": 1, "no_terrain": 1})


def line(x: float, y: float, width: float = 10.0) -> shapely.LineString:
    return shapely.LineString([(x, y), (x + width, y)])


WORKS = [line(10.0, 42.0), line(55.0, 45.0), line(900.0, 50.0), line(52.0, 92.0, 5.0)]  # the second leaves the DEM
FAR = shapely.box(900.0, 0.0, 910.0, 10.0)
ROAD = [line(0.5, 25.0, 59.0), line(900.0, 25.0, 59.0)]
SCENE: dict[str, Count] = {
    "trees": OF_PLACES,
    "barriers": OF_WORKS,
    "lying_logs": OF_WORKS,
    "blocks": OF_PLACES,
    "lines": OF_LINES,
    "friction": (3, 2, {"off_dem": 1}),
}


class Inputs:
    """The layers, in files, and where results go."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.case = folder, Case(folder)
        with rasterio.open(self.case.dem, "r+") as dem:
            heights = dem.read(1)
            heights[:15, 50:] = -9999.0
            dem.write(heights, 1)
        sizes = {"dbh_cm": [40.0] * 5, "height_m": [20.0] * 5}
        sides = [shapely.box(-1.0, -1.0, 30.0, 101.0), shapely.box(30.0, -1.0, 61.0, 101.0)]
        self.dem, self.releases = self.case.dem, self.case.releases
        self.trees = self.layer("trees", PLACES, tree_id=range(5), **sizes)
        self.blocks = self.layer("blocks", PLACES, diameter_m=[0.5] * 5)
        self.barriers = self.layer("barriers", WORKS, barrier_id=list("abcd"), height_m=[2.0] * 4)
        self.lying_logs = self.layer("lying", WORKS, lying_id=list("abcd"), diameter_cm=[40.0] * 4)
        self.lines = self.layer("lines", ROAD, line_id=["road", "away"])
        self.friction = self.layer("friction", [*sides, FAR], friction=[0.25, 0.3, 0.4])
        # whole places: which of these polygons hold a tree, and which lie on the DEM
        self.areas = self.layer(
            "areas", [shapely.box(5.0, 35.0, 15.0, 50.0), shapely.box(25.0, 35.0, 28.0, 50.0), FAR],
            share=[1.0] * 3, dbh_a=[2.5] * 3, dbh_b=[0.8] * 3, stand_id=list("abc"),
        )  # fmt: skip

    def layer(self, name: str, shapes: list[Any], **columns: Any) -> str:
        return write_layer(self.folder / f"{name}.gpkg", shapes, **{key: list(each) for key, each in columns.items()})

    def table(self, name: str, columns: Mapping[str, Any]) -> str:
        place = self.folder / f"{name}.csv"
        pd.DataFrame(columns).to_csv(place, index=False)
        return str(place)

    def scene(self, *without: str) -> dict[str, str]:
        return {name: getattr(self, name) for name in SCENE if name not in without}


def accounts_of(path: Path) -> dict[str, Any]:
    """By parameter what a result's record says of the rows."""
    whole = path / "manifest.json"
    record = json.loads(whole.read_text(encoding="utf-8")) if path.is_dir() else record_in(path)
    assert record is not None, path
    return {each["parameter"]: each["counted"] for each in record["inputs"] if "counted" in each}


class Told:
    """What tools reported about their layers, and what they should have reported."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self.counts: list[tuple[str, str, Any, Count]] = []
        self.number = 0

    def run(
        self, name: str, expected: Mapping[str, Count], record: str = "", *, fails: bool = False, **values: Any
    ) -> Path:
        """Run a tool; ``record`` is the output that holds the record, if not the first; ``fails``: at the end."""
        tool = find(name)
        assert tool is not None
        self.number += 1
        kind = next(each for each in tool.parameters() if each.name == "output").kind
        ending = {"output_folder": "", "output_vector": ".gpkg", "output_raster": ".tif", "output_table": ".csv"}[kind]
        output = self.inputs.folder / f"{self.number}-{name}{ending}"
        with pytest.raises(UserError) if fails else nullcontext():
            tool(**values, output=str(output))
        self.take(name, expected, Path(values[record]) if record else output)
        return output

    def take(self, name: str, expected: Mapping[str, Count], record: Path) -> None:
        said = accounts_of(record)
        self.counts += [(name, parameter, said.get(parameter), count) for parameter, count in expected.items()]


@pytest.fixture(scope="module")
def told(tmp_path_factory) -> Told:
    told = Told(Inputs(tmp_path_factory.mktemp("counts")))
    for part in (prepared, slid, evaluated):
        part(told, told.inputs)
    return told


def prepared(told: Told, here: Inputs) -> None:
    rated = here.layer("deadwood", PLACES, decay_stage=[3] * 5)
    told.run(
        "assess-mobilisation", {**SCENE, "within": (3, 2, {"off_dem": 1})}, dem=here.dem, **here.scene(),
        within=here.areas, logs_per_cell=1, time_limit_s=30.0,
    )  # fmt: skip
    told.run(
        "assess-mobilisation", {"friction": SCENE["friction"], "deadwood": (5, 2, {"off_dem": 3})}, "assessed",
        dem=here.dem, friction=here.friction, deadwood=rated, assessed=str(here.folder / "assessed.gpkg"),
    )  # fmt: skip
    mapped = here.table("mapped", {"dbh_cm": [30.0, 40.0], "length_m": [10.0, 12.0]})
    small = [shapely.box(20.0, 70.0, 40.0, 80.0), shapely.box(20.0, 60.0, 20.01, 60.01)]
    told.run(
        "sample-releases", {"areas": (2, 1, {"no_log": 1}), "deadwood": (2, 2, {})},
        dem=here.dem, areas=here.layer("small", small), deadwood=mapped, logs_per_ha=500.0,
    )  # fmt: skip
    # a tree, one in the same place, a dead one, one that is gone, one without a size, a seedling, one off the DEM
    u, v = (np.array([10.0, 10.0, 20.0, 30.0, 40.0, 45.0, 900.0]), np.full(7, 40.0))
    rows = {"x": EAST + u, "y": NORTH + v, "height_m": [20.0, 18.0, 15.0, 12.0, np.nan, 0.5, 20.0]}
    rows |= {"status": ["living", "living", "dead", "gone", "living", "living", "living"]}
    why = {"gone": 1, "no_size": 1, "size": 1, "off_dem": 1, "same_place": 1, "dead": 1}
    heights = np.linspace(10.0, 30.0, 12)
    sample = {"dbh_cm": 1.2 * heights**1.1, "height_m": heights, "status": ["dead", *["living"] * 11]}
    sample["height_m"] = np.where(np.arange(12) == 5, np.nan, heights)
    status = {"dead_values": "dead", "gone_values": "gone", "status_field": "status"}
    told.run(
        "import-trees", {"trees": (7, 1, why), "dbh_sample": (12, 10, {"dead": 1, "no_size": 1})},
        dem=here.dem, trees=here.table("inventory", rows), merge_within_m=0.1, **status,
        dbh_sample=here.table("sample", sample),
    )  # fmt: skip
    told.run(
        "import-trees", {"trees": (7, 2, {**why, "dead": 0}), "dbh_zones": (3, 1, {"no_tree": 2})},
        dem=here.dem, trees=here.table("inventory", rows), merge_within_m=0.1, **status,
        dbh_zones=here.areas, snags=str(here.folder / "snags.gpkg"),
    )  # fmt: skip
    # NEON: a tree at two visits, a shrub, one without a position
    visits = {
        "individualID": ["a", "a", "b", "c"], "date": ["2020-01-01", "2021-01-01", "2021-01-01", "2021-01-01"],
        "growthForm": ["single bole tree", "single bole tree", "small shrub", "single bole tree"],
        "plantStatus": ["Live"] * 4, "stemDiameter": [20.0] * 4, "height": [15.0] * 4,
        "adjEasting": [EAST + 10.0] * 3 + [np.nan], "adjNorthing": [NORTH + 40.0] * 4,
    }  # fmt: skip
    told.run(
        "import-trees", {"trees": (4, 1, {"shrub": 1, "no_position": 1, "earlier_visit": 1})},
        dem=here.dem, trees=here.table("visits", visits), source="neon",
    )  # fmt: skip
    # like: two trees, one too thin, one off the DEM, one outside the stands
    stems = points((10.0, 40.0), (12.0, 45.0), (11.0, 42.0), (900.0, 50.0), (50.0, 40.0))
    like = here.layer("like", stems, dbh_cm=[40.0, 30.0, 0.5, 40.0, 40.0], height_m=[20.0, 18.0, 2.0, 20.0, 20.0])
    exclude = here.layer("exclude", [shapely.box(5.0, 35.0, 6.0, 36.0), FAR])
    both = {"like": (5, 2, {"outside": 2, "too_small": 1}), "exclude": (2, 1, {"off_dem": 1})}
    plain = here.layer("plain", [shapely.box(5.0, 35.0, 15.0, 50.0), FAR])
    told.run(
        "generate-forest", {**both, "stand": (2, 1, {"off_dem": 1})}, dem=here.dem, like=like, stand=plain,
        exclude=exclude, stems_per_ha=400.0,
    )  # fmt: skip
    own = [shapely.box(20.0, 40.0, 30.0, 50.0), shapely.box(15.0, 35.0, 35.0, 55.0), FAR]
    told.run(
        "generate-forest", {"stand": (3, 1, {"no_place": 2})}, dem=here.dem,
        stand=here.layer("own", own, stems_per_ha=[300.0] * 3), dbh_mean_cm=30.0, dbh_sd_cm=8.0,
    )  # fmt: skip
    told.run(
        "windthrow", {"trees": (5, 2, {"off_dem": 1, "no_terrain": 2}), "windthrow_areas": (3, 1, {"no_tree": 2})},
        dem=here.dem, trees=here.trees, windthrow_areas=here.areas, fall_deg=180.0,
    )  # fmt: skip
    dams = here.layer("dams", [line(10.0, 32.0), line(30.0, 34.0)], height_m=[2.0, 3.0])
    told.run("add-structures", {"structures": (2, 2, {})}, dem=here.dem, structures=dams)


def slid(told: Told, here: Inputs) -> None:
    logs = {"dbh_cm": 40.0, "length_m": 10.0, "time_limit_s": 30.0}
    common = {"dem": here.dem, "releases": here.releases, **logs}
    told.run("slide-logs", {**SCENE, "releases": (24, 24, {})}, **common, **here.scene(), fidelity="draft")
    missing = str(here.folder / "missing.gpkg")
    table = here.table("sites", {"site": ["one", "two"], "releases": [here.releases, missing]})
    by_site = {"dem": here.dem, **logs, **here.scene(), "fidelity": "draft"}
    folder = told.run("run-sites", {"sites": (2, 1, {"failed": 1})}, fails=True, **by_site, sites=table)
    # inputs shared by all sites are in the record of each site, which is a run of slide-logs
    told.take("run-sites", SCENE, folder / "sites" / "one")
    told.run("run-sites", {"releases": (24, 24, {})}, **by_site, releases=here.releases, by="release_id")
    few: dict[str, Count] = {"releases": (24, 6, {"not_run": 18})}
    told.run("compare-fidelity", {**SCENE, **few}, **common, **here.scene(), fidelities="draft,standard", logs=6)
    of_scene = {name: count for name, count in SCENE.items() if name != "friction"}
    told.run("vary", {**SCENE, **few}, **common, **here.scene(), fidelity="draft", vary="dem_noise_m=0:0.1", logs=6,
             samples=8)  # fmt: skip
    observed = here.layer("observed", points((30.0, 10.0), (35.0, 12.0)))
    beside = here.layer("beside", [line(0.5, 2.0, 59.0), line(900.0, 2.0)])
    told.run(
        "calibrate-friction", {**of_scene, **few, "observed": (2, 2, {})}, **common, **here.scene("friction"),
        friction="0.25,0.35", fidelity="draft", logs=6, observed=observed,
    )  # fmt: skip
    told.run(
        "calibrate-friction", {"reached": OF_LINES, "not_reached": OF_LINES}, **common, friction="0.25,0.35",
        fidelity="draft", logs=6, reached=here.lines, not_reached=beside, event_logs=4, event_reached=2,
    )  # fmt: skip
    place = here.folder / "explored"
    with opened({"dem": here.dem, **here.scene()}, output=str(place), **logs) as asked:
        asked.release(shape={"circle": [30.0, 75.0, 5.0]}, n=10)
        asked.keep("kept", run_too=False)
    told.take("explore", SCENE, place / "kept_layers.gpkg")


def evaluated(told: Told, here: Inputs) -> None:
    run = here.case.run(lines=here.case.lines, trees=here.case.trees, output=str(here.folder / "run"))
    lines: dict[str, Count] = {"lines": OF_LINES}
    other = {"run": str(run), "lines": here.lines}
    told.run("count-hits", {"reaching": OF_LINES}, run=str(run), reaching=here.lines,
             danger=str(here.folder / "danger.tif"))  # fmt: skip
    told.run("reach-lines", lines, **other)
    told.run("design-values", lines, **other)
    told.run("map-origins", lines, **other, least=1)
    events = here.layer("events", points((1.0, 1.0), (2.0, 2.0), (3.0, 3.0)), release_id=["a", "b", "else"],
                        events_per_year=[0.1, 0.2, 0.3])  # fmt: skip
    told.run("map-intensity", {**lines, "releases": (3, 2, {"not_in_run": 1})}, **other, releases=events)
    stands = here.layer(
        "stands", [shapely.box(0.0, 30.0, 60.0, 95.0), shapely.box(0.0, 0.0, 5.0, 5.0)], stand_id=[1, 2]
    )
    could: dict[str, Count] = {"plant": OF_PLACES, "plant_lying": OF_WORKS, "stands": (2, 1, {"no_tree": 1})}
    told.run("value-trees", {**lines, **could}, **other, stands=stands, plant=here.trees, plant_lying=here.lying_logs,
             logs=6)  # fmt: skip
    told.run("break-trees", lines, **other, logs=6, tree_capacity_kj=1.0)
    told.run("site-barriers", {**lines, "candidates": OF_WORKS}, **other, candidates=here.barriers, logs=6)
    told.run("compare-scenarios", lines, runs=f"{run},{run}", names="one,two", lines=here.lines)
    dead = here.layer("dead", points((10.2, 40.0), (30.0, 60.0), (900.0, 50.0)), dbh_cm=[40.0] * 3, height_m=[15.0] * 3)
    old: dict[str, Any] = {"storm_return_years": (20.0,), "draws": 20}
    told.run("age", {"dead_trees": (3, 3, {})}, dead_trees=dead, **old)
    of_living = (5, 1, {"off_dem": 1, "no_terrain": 2, "dead": 1})
    told.run(
        "decide", {"dead_trees": (3, 2, {"off_dem": 1}), **lines, "trees": of_living, "friction": SCENE["friction"]},
        **old, **here.scene("barriers", "lying_logs", "blocks"), dem=here.dem, dead_trees=dead, start_share=(0.5,),
        mobilised_per_year=(0.01,), treatments="leave,remove", repeats=2,
    )  # fmt: skip
    told.run("lateral-spread", {"deposits": (24, 0, {"near_release": 24})},
             deposits=f"{run / 'run.gpkg'}|layername=deposits", min_runout_m=500.0)  # fmt: skip
    told.run("lateral-spread", {"deposits": (24, 24, {})}, deposits=f"{run / 'run.gpkg'}|layername=deposits",
             min_runout_m=0.0)  # fmt: skip
    jump = [shapely.LineString([(30.0, 70.0), (30.0, 66.0)])]
    nets = here.layer("nets", [line(20.0, 68.0, 20.0), line(900.0, 68.0)], barrier_id=["a", "b"], height_m=[2.0] * 2)
    flights = {"flights": here.layer("jump", jump), "dbh_cm": 40.0, "length_m": 10.0}
    told.run("fit-flight", {"flights": (1, 1, {}), "barriers": (2, 1, {"off_dem": 1})}, dem=here.dem, **flights,
             barriers=nets)  # fmt: skip
    ends = points((30.0, 70.0), (30.0, 66.0), (40.0, 70.0), (40.0, 66.0))
    pairs = here.layer("ends", ends, flight_id=[1, 1, 2, 2], role=["takeoff", "landing"] * 2)
    told.run("fit-flight", {"flights": (4, 4, {})}, dem=here.dem, **(flights | {"flights": pairs}))


def test_every_layer_that_a_tool_reads_is_here(told):
    """A new tool or layer needs a case above."""
    declared = {(tool.name, each.name) for tool in TOOLS for each in tool.parameters() if each.kind in KINDS}
    assert declared == {(tool, parameter) for tool, parameter, _, _ in told.counts}


def test_read_is_used_and_left_out(told):
    for tool, parameter, said, _ in told.counts:
        assert said is not None, (tool, parameter)
        assert said["read"] == said["used"] + sum(each["n"] for each in said["left_out"]), (tool, parameter, said)


def test_the_counts_are_those_of_the_rows(told):
    for tool, parameter, said, (read, used, why) in told.counts:
        left_out = {each["why"]: each["n"] for each in said["left_out"]}
        assert (said["read"], said["used"]) == (read, used), (tool, parameter, said)
        assert left_out == {name: n for name, n in why.items() if n}, (tool, parameter, said)
