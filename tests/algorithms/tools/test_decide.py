"""decide on a small slope: its tables against its own slides, its treatments against each other, wrong inputs."""

from __future__ import annotations

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from slope_case import Case, points, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import decide

# A stem slides from its first year on, and nothing else is uncertain
SURE = (
    "lag_years=0,fall_per_year=0.2,storm_share=0,broken_share=0,bark_off_years=0,weak_years=10,strength_needed=0.2,"
    "residence_years=1000,hold_loss_per_year=0"
)


@pytest.fixture(scope="module")
def slope(tmp_path_factory) -> tuple[Case, str]:
    """Five dead trees on the slope above a road, and one below it, whose logs cannot reach it."""
    case = Case(tmp_path_factory.mktemp("slope"))
    places = [(12.0, 70.0), (22.0, 60.0), (30.0, 75.0), (38.0, 55.0), (47.0, 65.0), (30.0, 6.0)]
    sizes = {"dbh_cm": [40.0] * 6, "height_m": [14.0] * 6}
    return case, write_layer(case.folder / "dead.gpkg", points(*places), tree_id=list("abcdef"), **sizes)


def given(case: Case, dead: str, **more) -> dict:
    asked = {"storm_return_years": (20.0,), "start_share": (0.5,), "mobilised_per_year": (0.05,)}
    scene = {"dead_trees": dead, "dem": case.dem, "lines": case.lines, "friction": 0.2}
    return scene | asked | {"ranges": SURE, "draws": 60, "repeats": 4} | more


def test_the_answer_of_a_slope_is_that_of_its_slides(slope, tmp_path):
    case, dead = slope
    outcome = decide.TOOL(**given(case, dead), output=str(tmp_path / "decision"))
    folder = tmp_path / "decision"
    facts = json.loads((folder / "decision.json").read_text(encoding="utf-8"))
    totals = pd.read_csv(folder / "totals.csv").set_index(["treatment", "line_id", "intensity"])
    line = totals.index[0][1]
    states = gpd.read_file(folder / "states.gpkg", layer="releases")
    reached = gpd.read_file(folder / "run" / "run.gpkg", layer="reached_by")
    whole = states["release_id"] == "whole"
    second = (states["log_id"] // 18) >= 2  # half of the repeats picks the worst, and is not counted
    share = np.isin(states["log_id"][whole & second], reached["log_id"][reached["line_id"] == line]).mean()
    assert 0.2 < share < 1.0  # the tree below the road never reaches it
    # all fall within the critical years (0 to 7.3), a fifth of those that stand in each year; lying stems hold nothing
    bare = decide.TOOL(
        **given(case, dead, treatments="remove,leave", mobilised_per_year=(0.0,)), output=str(tmp_path / "b")
    )
    events = {(each["treatment"], each["intensity"]): each["events"] for each in bare.facts["totals"]}
    end = 10.0 * np.log(0.2) / np.log(0.11)
    falls = (1.0 - np.exp(-0.2 * 7)) + np.exp(-0.2 * 7) * (1.0 - np.exp(-0.2)) * (end - 7.0)
    assert events["leave", "any"] <= 6 * falls * 0.5 * share * 1.35  # among lying stems fewer arrive
    assert events["remove", "any"] == 0.0
    assert totals.loc[("remove", line, "any"), "events"] == 0.0
    order = [totals.loc[(name, line, "any"), "events"] for name in ("remove", "remove-part", "leave")]
    assert order == sorted(order)
    assert totals.loc[("anchor", line, "any"), "events"] <= totals.loc[("leave", line, "any"), "events"]
    classes = totals.loc["leave"].loc[line]["events"]
    assert classes.drop("any").sum() == pytest.approx(classes["any"])
    assert "f" not in facts["picked"]
    assert len(facts["picked"]) == 2
    verdicts = {(each["treatment"], each["against"]): each["verdict"] for each in facts["differences"]}
    assert verdicts["remove", "leave"] == "fewer"
    assert any("leave" in each and "events in 30 years" in each for each in outcome.lines)
    for name in ("events.csv", "periods.csv", "influence.csv", "processes.csv", "decision.png"):
        assert (folder / name).is_file()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"treatments": "leave,burn"}, "'burn' is not one of leave, fell-across"),
        ({"treatments": "leave,leave"}, "must name each treatment once"),
        ({"report_years": (0.5,)}, "--report-years names no whole year"),
        ({"ranges": "start_share=0.1:0.2"}, "'start_share' is not one of"),
    ],
)
def test_wrong_inputs_are_refused(slope, tmp_path, changes, words):
    with pytest.raises(UserError, match=words):
        decide.TOOL(**given(*slope, **changes), output=str(tmp_path / "d"))


def test_a_dead_tree_among_the_living_does_not_hold_its_own_log(slope, tmp_path, said):
    """The stand as one layer gives what the living alone give; the dead ones are 0.3 m off, as two surveys are."""
    case, dead = slope
    living = {"dbh_cm": [50.0, 45.0], "height_m": [20.0, 19.0]}
    alone = write_layer(case.folder / "alone.gpkg", points((25.0, 40.0), (41.0, 33.0)), tree_id=["u", "v"], **living)
    both = {name: [*values, 40.0, 40.0] for name, values in living.items()}
    places = points((25.0, 40.0), (41.0, 33.0), (12.3, 70.0), (22.0, 60.0))
    stand = write_layer(case.folder / "stand.gpkg", places, tree_id=["u", "v", "a", "b"], **both)
    few = {"treatments": "leave,remove", "repeats": 2, "draws": 20}
    totals = {}
    for name, trees in (("alone", alone), ("stand", stand)):
        asked = decide.Ask(**given(case, dead, trees=trees, **few), output=str(tmp_path / name))
        decide.TOOL(asked, said)
        totals[name] = pd.read_csv(tmp_path / name / "totals.csv")
    pd.testing.assert_frame_equal(totals["alone"], totals["stand"])
    assert gpd.read_file(tmp_path / "stand" / "living.gpkg")["tree_id"].tolist() == ["u", "v"]
    assert not (tmp_path / "alone" / "living.gpkg").exists()
    assert sum("2 trees of 4 stand where a dead tree stands" in line for line in said.notes) == 1
