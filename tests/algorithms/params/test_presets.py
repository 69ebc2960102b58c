"""Presets: a name sets the values of its source, given values override it, and both are reported."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from slope_case import EAST, NORTH, Case, points, write_dem, write_layer

from deadwood_algorithms.paper import klosters, rothenbrunnen
from deadwood_algorithms.params import presets
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.mobilisation.decay import CRITICAL, OUTSIDE, of_years
from deadwood_algorithms.prepare.trees.allometry import NAMED_LAWS, SOURCES_OF_LAWS
from deadwood_algorithms.tools import (
    design_values,
    find_trees,
    generate_forest,
    import_trees,
    list_presets,
    sample_releases,
    slide_logs,
    vary,
    windthrow,
)


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def told(said: Any) -> str:
    return "\n".join((*said.notes, *said.warnings))


def area(folder: Path, name: str = "area.gpkg", **columns: Any) -> str:
    shapes = [shapely.box(EAST + 10, NORTH + 50, EAST + 50, NORTH + 90)] * len(next(iter(columns.values()), [0]))
    gpd.GeoDataFrame(columns, geometry=shapes, crs="EPSG:2056").to_file(folder / name)
    return str(folder / name)


def sampled(case: Case, folder: Path, feedback: Any = None, **values: Any) -> gpd.GeoDataFrame:
    given = {"areas": area(folder) if "areas" not in values else values.pop("areas"), "count": 4}
    output = str(folder / "releases.gpkg")
    sample_releases.TOOL(feedback=feedback, dem=case.dem, output=output, overwrite=True, **(given | values))
    return gpd.read_file(output, layer="releases")


@pytest.mark.parametrize("twin", [klosters, rothenbrunnen])
def test_the_papers_presets_are_the_numbers_of_its_twins(twin):
    """Both were taken from the paper independently."""
    known = {each.name: each.value for each in twin.NUMBERS}
    log, forest = presets.LOGS[twin.NAME], presets.FORESTS[twin.NAME]
    assert {name: known[name] for name in log.values} == dict(log.values)
    assert {name: known[name] for name in forest.values} == dict(forest.values)
    assert presets.FRICTIONS["wet-debarked"].values["friction"] == known["friction"]


@pytest.mark.parametrize("wood", presets.WOODS.values(), ids=lambda each: each.name)
def test_a_woods_density_is_that_of_its_critical_years(wood):
    """By hand: exp(-rate t), from sound wood; the years are those that assess-mobilisation calls critical."""
    low, high = presets.critical_years(wood)
    dense, light = (wood.density_kg_m3 * math.exp(-wood.rate * each) for each in (low, high))
    assert presets.LOGS[f"{wood.name}-critical"].values["density_kg_m3"] == pytest.approx((dense + light) / 2, abs=0.5)
    wet = presets.LOGS[f"{wood.name}-critical-wet"].values["density_kg_m3"]  # fibre saturation: 30 % of the dry mass
    assert wet == pytest.approx(1.3 * (dense + light) / 2, abs=0.5)
    # as far decayed as spruce after 2 and 5 years
    assert dense / wood.density_kg_m3 == pytest.approx(math.exp(-0.066))
    assert light / wood.density_kg_m3 == pytest.approx(math.exp(-0.165))
    window = presets.CRITICAL_YEARS
    inside, outside = (low + 1e-9, high - 1e-9), (low - 1e-6, high + 1e-6)
    assert {of_years(each, wood.name, window) for each in inside} == {CRITICAL}
    assert {of_years(each, wood.name, window) for each in outside} == {OUTSIDE}


def test_every_preset_has_a_source_and_every_law_exists():
    rows = list(presets.listed())
    assert all(each.source and each.values and each.about for each in rows)
    assert {each.law for each in presets.LOGS.values()} - {""} <= set(NAMED_LAWS)


def test_the_default_is_the_papers_log_and_is_reported(case, tmp_path, said):
    frame = sampled(case, tmp_path, said)
    assert frame[["dbh_cm", "length_m", "density_kg_m3"]].drop_duplicates().values.tolist() == [[75.0, 30.0, 300.0]]
    assert "--preset klosters sets dbh_cm 75, length_m 30, density_kg_m3 300 (the paper, 4" in told(said)
    before = len(said.notes)
    sampled(case, tmp_path, said, dbh_cm=30.0, length_m=15.0, density_kg_m3=310.0)
    assert not any("--preset" in each for each in said.notes[before:])  # it set nothing, and was not named


def test_what_is_given_overrides_and_both_are_reported(case, tmp_path, said):
    frame = sampled(case, tmp_path, said, preset="rothenbrunnen", dbh_cm=50.0)
    assert frame[["dbh_cm", "length_m", "density_kg_m3"]].drop_duplicates().values.tolist() == [[50.0, 15.0, 300.0]]
    assert "sets length_m 15, density_kg_m3 300" in told(said)
    assert "--dbh-cm 50.0 is given and overrides its 30" in told(said)


def test_columns_of_the_areas_go_before_a_preset(case, tmp_path):
    frame = sampled(case, tmp_path, areas=area(tmp_path, dbh_cm=[40.0, 60.0]), count=1)
    assert sorted(frame["dbh_cm"]) == [40.0, 60.0]
    assert set(frame["length_m"]) == {30.0}


def test_of_a_wood_one_size_follows_from_the_other(case, tmp_path, said):
    law = NAMED_LAWS["chablais-spruce"]
    nowhere = np.array(np.nan)
    frame = sampled(case, tmp_path, said, preset="spruce-critical", dbh_cm=50.0)
    assert set(frame["length_m"]) == {round(float(law.height(np.array(50.0), nowhere)), 2)}
    assert set(frame["density_kg_m3"]) == {357.0}
    assert "length_m 29.01 follows from dbh_cm by chablais-spruce" in told(said)
    frame = sampled(case, tmp_path, preset="spruce-critical", length_m=20.0)
    assert set(frame["dbh_cm"]) == {round(float(law.dbh(np.array(20.0), nowhere)), 2)}
    frame = sampled(case, tmp_path, preset="spruce-critical", dbh_cm=50.0, length_m=12.0)
    assert (set(frame["dbh_cm"]), set(frame["length_m"])) == ({50.0}, {12.0})
    # areas that give one of the two sizes: the other follows, area by area
    frame = sampled(case, tmp_path, preset="beech-critical", areas=area(tmp_path, dbh_cm=[20.0, 40.0]), count=1)
    heights = NAMED_LAWS["chablais-beech"].height(np.array([20.0, 40.0]), nowhere)
    assert sorted(frame["length_m"]) == pytest.approx(sorted(heights), abs=0.006)


def test_a_wood_without_any_size_is_refused(case, tmp_path):
    with pytest.raises(UserError, match=r"--preset spruce-critical does not set dbh_cm and length_m; give --dbh-cm or"):
        sampled(case, tmp_path, preset="spruce-critical")
    with pytest.raises(UserError, match=r"--preset pine-critical does not set length_m; give --length-m$"):
        sampled(case, tmp_path, preset="pine-critical", dbh_cm=40.0)
    with pytest.raises(UserError, match=r"--preset is 'oak', but must be one of klosters, rothenbrunnen, spruce-"):
        sampled(case, tmp_path, preset="oak")


def test_mapped_deadwood_brings_the_sizes_and_a_wood_the_density(case, tmp_path):
    rows = pd.DataFrame({"dbh_cm": [31.0, 47.0], "length_m": [11.0, 19.0]})
    rows.to_csv(tmp_path / "deadwood.csv", index=False)
    frame = sampled(case, tmp_path, preset="spruce-critical", deadwood=str(tmp_path / "deadwood.csv"), count=20)
    assert set(zip(frame["dbh_cm"], frame["length_m"], strict=True)) == {(31.0, 11.0), (47.0, 19.0)}
    assert set(frame["density_kg_m3"]) == {357.0}


def test_a_forest_by_name_is_that_of_its_numbers(case, tmp_path, said):
    given = {"dem": case.dem, "output": str(tmp_path / "trees.gpkg"), "overwrite": True}
    generate_forest.TOOL(feedback=said, preset="klosters", **given)
    by_name = gpd.read_file(tmp_path / "trees.gpkg", layer="trees")
    assert "--preset klosters sets stems_per_ha 300, dbh_mean_cm 60.23, dbh_sd_cm 18.64" in told(said)
    generate_forest.TOOL(stems_per_ha=300.0, dbh_mean_cm=60.23, dbh_sd_cm=18.64, **given)
    assert by_name.equals(gpd.read_file(tmp_path / "trees.gpkg", layer="trees"))
    generate_forest.TOOL(preset="klosters", stems_per_ha=100.0, **given)
    assert len(gpd.read_file(tmp_path / "trees.gpkg", layer="trees")) == round(len(by_name) / 3)
    with pytest.raises(UserError, match="--preset and --like both define the forest"):
        generate_forest.TOOL(preset="klosters", like=str(tmp_path / "trees.gpkg"), **given)


def test_a_run_with_friction_by_name_is_the_run_with_its_number(case, said):
    values = case.values(output=str(case.folder / "number"), friction="0.25", trajectories="none")
    case.run(**values)
    named = values | {"output": str(case.folder / "name"), "friction": None, "friction_preset": "wet-debarked"}
    case.run(feedback=said, **named)
    for file in ("hit_count.tif", "speed_max.tif"):
        assert (case.folder / "number" / file).read_bytes() == (case.folder / "name" / file).read_bytes()
    manifest = json.loads((case.folder / "name" / "manifest.json").read_text(encoding="utf-8"))
    (record,) = manifest["presets"]
    assert (record["option"], record["name"], record["sets"]) == (
        "--friction-preset",
        "wet-debarked",
        {"friction": 0.25},
    )
    assert "the paper, 5.1" in record["source"]
    assert "presets" not in json.loads((case.folder / "number" / "manifest.json").read_text(encoding="utf-8"))
    assert "--friction-preset wet-debarked sets friction 0.25 (the paper, 5.1 and 6.1" in told(said)
    assert "was found on cells of 0.5 m, and the terrain model has cells of 1 m" in told(said)
    # the manifest gives the same run again, with the source of the number
    again = manifest["parameters"] | {"output": str(case.folder / "again")}
    case.run(**again)
    assert json.loads((case.folder / "again" / "manifest.json").read_text(encoding="utf-8"))["presets"] == [record]


def test_a_given_friction_overrides_the_named_one(case, said):
    values = case.values(output=str(case.folder / "both"), friction="0.4", friction_preset="wet-debarked")
    case.run(feedback=said, **values)
    manifest = json.loads((case.folder / "both" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["parameters"]["friction"] == 0.4
    assert manifest["presets"][0]["given_instead"] == {"friction": 0.4}
    assert "sets nothing; --friction 0.4 is given and overrides its 0.25" in told(said)
    assert "was found on cells" not in told(said)


def test_without_any_friction_a_line_reports_it(case, tmp_path):
    with pytest.raises(UserError, match=r"--friction is missing \(Friction coefficient\); give it, or name one with"):
        case.run(output=str(tmp_path / "none"), friction=None)


def test_vary_says_whose_the_ranges_are_that_it_offers(case, tmp_path, said):
    values = case.values(output=str(tmp_path / "varied"), design="ends", vary="friction,rolling_friction=0.05:0.15")
    del values["trajectories"]
    vary.TOOL(feedback=said, **values)
    assert "--vary friction takes the range that is offered, 0.2 to 0.3: the paper, 5.1 and 6.1" in told(said)
    assert "--vary rolling_friction" not in told(said)  # the user's own range


def test_the_decay_of_a_wood_thins_lying_logs_by_its_mass(tmp_path, said):
    """Mass is diameter squared by length: what is left of it after 20 years is exp(-20 rate)."""
    dem = write_dem(tmp_path / "dem.tif")
    sizes = {"tree_id": range(4), "dbh_cm": [40.0] * 4, "height_m": [8.0] * 4}
    trees = write_layer(tmp_path / "trees.gpkg", points(*((15.0 + 9.0 * k, 60.0) for k in range(4))), **sizes)
    given = {"trees": trees, "dem": dem, "share": 1.0, "lost": 0.0, "fall_deg": 180.0, "overwrite": True}
    windthrow.TOOL(feedback=said, output=str(tmp_path / "s"), wood="beech", years=20.0, **given)
    after, later = (gpd.read_file(tmp_path / "s" / f"lying_{name}.gpkg")["diameter_cm"] for name in ("after", "later"))
    assert (later / after).to_numpy() ** 2 == pytest.approx(np.full(4, math.exp(-0.054 * 20)), rel=2e-3)
    assert "--wood beech sets thinner" in told(said)
    (record,) = json.loads((tmp_path / "s" / "manifest.json").read_text(encoding="utf-8"))["presets"]
    assert record["name"] == "beech"
    windthrow.TOOL(output=str(tmp_path / "s"), wood="beech", thinner=0.5, **given)
    later = gpd.read_file(tmp_path / "s" / "lying_later.gpkg")["diameter_cm"]
    assert (later / after).to_numpy() == pytest.approx(np.full(4, 0.5), rel=1e-3)


def test_the_class_of_a_barrier_is_the_weakest_that_holds():
    etag = presets.BARRIERS["etag-027"]
    held = [("0", 0.0), ("0", 100.0), ("1", 100.1), ("3", 1000.0), ("4", 1000.1), ("7", 4500.0), ("8", 4500.1)]
    for name, energy in held:
        assert etag.class_of(energy)[0] == name
    assert etag.record(90.0, math.nan) == {"barrier_class": "0", "barrier_class_high": ""}
    limits = [holds for _, holds in etag.rows]
    assert limits == sorted(limits)
    assert etag.words(etag.record(600.0, 5000.0)) == (
        "class 3 of etag-027 (1000 kJ), its upper end class 8 (over 4500 kJ)"
    )


def test_design_values_class_energies_alone(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), **case.everything())
    found = design_values.TOOL(run=str(run), output=str(tmp_path / "d.csv"), barrier_classes="etag-027")
    rows = pd.read_csv(tmp_path / "d.csv", encoding="utf-8-sig", dtype=str, keep_default_na=False)
    etag = presets.BARRIERS["etag-027"]
    energies = rows[rows["quantity"] == "energy"]
    told: Any = energies[energies["value"] != ""]
    assert len(told)
    for row in told.to_dict("records"):
        high = float(row["ci_high"] or "nan")
        assert row["barrier_class"] == etag.class_of(float(row["value"]))[0]
        assert row["barrier_class_high"] == etag.class_of(high)[0]
    assert set(rows.loc[rows["quantity"] != "energy", "barrier_class"]) == {""}
    assert found.lines[-2].startswith("--barrier-classes etag-027: ETAG 027 (EOTA 2008)")
    assert found.lines[-2].endswith("an expert must judge that")


def test_frictions_by_weather_and_bark_are_those_of_their_sources():
    """Debarking reduces friction by 20 % on wet ground; for chutes it is the grade, or the middle of its range."""
    friction = {name: each.values["friction"] for name, each in presets.FRICTIONS.items()}
    assert friction["wet-bark"] * 0.8 == pytest.approx(friction["wet-debarked"], abs=0.005)
    assert friction["chute-dry"] == 0.15
    assert friction["chute-watered"] == pytest.approx((0.03 + 0.08) / 2)
    assert friction["chute-iced"] == pytest.approx((0.03 + 0.12) / 2)
    assert all(each.cell_m == (0.0 if name.startswith("chute") else 0.5) for name, each in presets.FRICTIONS.items())


def test_a_measured_friction_is_not_bound_to_certain_cells(case, tmp_path, said):
    values = case.values(output=str(tmp_path / "run"), trajectories="none")
    slide_logs.TOOL(feedback=said, **(values | {"friction": None, "friction_preset": "chute-dry"}))
    assert "--friction-preset chute-dry sets friction 0.15 (Meyers" in told(said)
    assert "was found on cells" not in told(said)


def test_the_class_is_that_of_the_energy_of_all_that_come(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), **case.everything())
    design_values.TOOL(run=str(run), barrier_classes="etag-027", output=str(tmp_path / "d.csv"))
    rows: Any = pd.read_csv(tmp_path / "d.csv", encoding="utf-8-sig", dtype={"barrier_class": str})
    classed = rows[rows["barrier_class"].notna()]
    assert set(classed["quantity"]) == {"energy"}
    classes = presets.BARRIERS["etag-027"]
    assert [classes.class_of(each)[0] for each in classed["value"]] == classed["barrier_class"].tolist()


def test_nothing_from_memory_can_be_selected(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), barriers=case.barriers)
    for given in ({"rule": "onr-24810-cc2"}, {"barrier_classes": "swiss-2001"}):
        with pytest.raises(UserError):
            design_values.TOOL(run=str(run), output=str(tmp_path / "d.csv"), **given)
    assert not [each for each in presets.listed() if "memory" in each.source + each.mind]


def test_a_law_is_published_or_says_who_made_it():
    made = {name for name, source in SOURCES_OF_LAWS.items() if "made for this project" in source}
    assert made == {name for name in NAMED_LAWS if name.startswith(("chablais", "oregon"))}
    assert len(made) == 7
    for tool in (import_trees, find_trees, generate_forest):
        (law,) = (each for each in tool.TOOL.parameters() if each.name == "dbh_law")
        assert "made for this project" in law.help
        assert "ublished law" not in law.label + law.help


def test_the_list_has_every_name_that_a_tool_offers(tmp_path):
    from deadwood_toolbox.shelf import TOOLS

    list_presets.TOOL(output=str(tmp_path / "presets.csv"))
    rows = pd.read_csv(tmp_path / "presets.csv", encoding="utf-8-sig", dtype=str, keep_default_na=False)
    listed = {(tool, row.option, row.name) for row in rows.itertuples(index=False) for tool in row.tools.split(", ")}
    options = {option for _, option, _ in listed}
    offered = {
        (each.name, parameter.flag, name)
        for each in TOOLS
        for parameter in each.parameters()
        if parameter.flag in options and parameter.kind == "choice"
        for name in parameter.choices
    }
    assert offered == {each for each in listed if each in offered}
    laws = {each for each in listed if each[1] == "--dbh-law"}  # some need a crown, which generate-forest does not have
    assert {each for each in listed if each not in offered} <= laws
