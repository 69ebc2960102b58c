"""age: its tables and layer from trees of two ages, and wrong inputs."""

from __future__ import annotations

import geopandas as gpd
import pandas as pd
import pytest
from slope_case import points, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import age


def dead(folder, **columns):
    given = {"tree_id": ["a", "b", "c"], "dbh_cm": [30.0, 40.0, 50.0], "height_m": [20.0, 25.0, 30.0]}
    return write_layer(folder / "dead.gpkg", points((10, 50), (20, 60), (30, 70)), **(given | columns))


def test_tables_agree_and_a_lying_tree_never_stands(tmp_path):
    layer = dead(tmp_path, years_dead=[0.0, 6.0, 3.0], standing=[1, 1, 0], species=["spruce", "beech", "Fichte"])
    given = {"storm_return_years": (15.0,), "draws": 200, "output": str(tmp_path / "aged")}
    outcome = age.TOOL(dead_trees=layer, ranges="storm_share=0.2", **given)
    table = pd.read_csv(tmp_path / "aged" / "states.csv").set_index(["year", "state"])["share"]
    stems = gpd.read_file(tmp_path / "aged" / "aged.gpkg", layer="aged")
    assert set(stems["year"]) == {0, 2, 5, 10, 20, 30}
    for year, of_year in stems.groupby("year"):
        assert of_year["p_standing"].mean() == pytest.approx(table[year, "standing"])
        assert of_year["p_critical"].mean() == pytest.approx(table[year, "critical"])
    assert (stems.loc[stems["tree_id"] == "c", "p_standing"] == 0.0).all()
    assert table[0, "standing"] == pytest.approx(2 / 3)
    processes = pd.read_csv(tmp_path / "aged" / "processes.csv").set_index("name")
    assert processes.loc["storm_share", ["low", "high", "given_by_user"]].tolist() == [0.2, 0.2, 1]
    assert processes.loc["storm_return_years", "low"] == 15.0
    assert outcome.facts["trees"] == 3
    assert (tmp_path / "aged" / "shares.png").is_file()
    again = age.TOOL(dead_trees=layer, ranges="storm_share=0.2", **given | {"output": str(tmp_path / "again")})
    assert again.facts == outcome.facts


def test_wrong_inputs_are_refused(tmp_path):
    given = {"storm_return_years": (15.0,), "output": str(tmp_path / "aged")}
    with pytest.raises(UserError, match="field 'standing', row 2: 0.5 is not 1 or 0"):
        age.TOOL(dead_trees=dead(tmp_path, standing=[1, 0.5, 1]), **given)
    with pytest.raises(UserError, match="rows 1, 2 are called 'a'"):
        age.TOOL(dead_trees=dead(tmp_path, tree_id=["a", "a", "b"]), **given)
    with pytest.raises(UserError, match="--report-years names no whole year"):
        age.TOOL(dead_trees=dead(tmp_path), report_years=(40.0,), **given)
