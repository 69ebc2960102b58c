"""windthrow: no stem is lost or doubled, the right ones fall, and they lie as long and as thick as they were."""

from __future__ import annotations

import itertools
import shlex
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from slope_case import EAST, NORTH, Case, points, summary, write_dem, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.throwing import chosen_share, fall_directions, item_numbers, plan_lengths
from deadwood_algorithms.tools import windthrow
from deadwood_toolbox.shelf import find

COUNT = 120


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A slope, a flat, and 120 trees of 10 to 70 cm and 2 to 14 m, 15 m and more from the edges."""
    folder = tmp_path_factory.mktemp("storm")
    write_dem(folder / "slope.tif")
    write_dem(folder / "flat.tif", flat=True)
    rng = np.random.default_rng(6)
    at = np.column_stack([15.0 + 30.0 * rng.random(COUNT), 35.0 + 30.0 * rng.random(COUNT)])
    write_layer(
        folder / "trees.gpkg",
        points(*at),
        tree_id=[f"t{k}" for k in range(COUNT)],
        dbh_cm=rng.uniform(10.0, 70.0, COUNT),
        height_m=rng.uniform(2.0, 14.0, COUNT),
        species=["spruce", "fir"] * (COUNT // 2),
    )
    return folder


def throw(place: Path, folder: Path, feedback: Any = None, dem: str = "slope.tif", **values: Any) -> dict[str, Any]:
    given = {"trees": str(place / "trees.gpkg"), "dem": str(place / dem), "fall_deg": 180.0} | values
    outcome = windthrow.TOOL(feedback=feedback, output=str(folder), overwrite=True, **given)
    found: dict[str, Any] = {"outcome": outcome}
    for each in folder.glob("*.gpkg"):
        found[each.stem] = gpd.read_file(each, layer=gpd.list_layers(each)["name"][0])
    return found


@pytest.mark.parametrize(
    ("share", "stump", "lost"), list(itertools.product((0.001, 0.4, 1.0), (0.0, 0.5, 1.3), (0.0, 0.35, 1.0)))
)
def test_every_tree_stands_lies_or_is_removed_exactly_once(place, tmp_path, share, stump, lost):
    if share < 0.01:
        with pytest.raises(UserError, match="no stem is thrown"):
            throw(place, tmp_path / "s", share=share, stump_m=stump, lost=lost)
        return
    found = throw(place, tmp_path / "s", share=share, stump_m=stump, lost=lost)
    before = found["trees_before"].set_index("tree_id")
    everyone = set(before.index)
    assert len(before) == COUNT == len(found["stems"])
    states = found["stems"].set_index("tree_id")
    for name in ("before", "after", "later", "cleared"):
        trees: Any = found.get(f"trees_{name}", before[:0].reset_index())
        trees = trees.set_index("tree_id")
        high = before.loc[trees.index, "height_m"]
        standing = set(trees.index[trees["height_m"] == high])
        stumps = set(trees.index) - standing
        lying = set(found[f"lying_{name}"]["lying_id"]) if f"lying_{name}" in found else set()
        removed = everyone - standing - lying
        assert not standing & lying
        assert standing == set(states.index[states[name] == "standing"])
        assert lying == set(states.index[states[name] == "lying"])
        assert removed == set(states.index[states[name] == "removed"])
        assert len(standing) + len(lying) + len(removed) == COUNT
        assert stumps == (set() if not stump else lying | removed)
        assert trees.index.is_unique
        assert (trees.loc[list(stumps), "height_m"] == stump).all()
        assert (trees["dbh_cm"] == before.loc[trees.index, "dbh_cm"]).all()
    told = found["outcome"].facts
    assert told["before"] == {"standing": COUNT, "lying": 0, "removed": 0}
    assert told["cleared"] == {"standing": told["after"]["standing"], "lying": 0, "removed": told["after"]["lying"]}
    assert told["later"]["removed"] == int(np.floor(lost * told["after"]["lying"] + 0.5))


def test_the_share_is_exact_and_a_larger_one_throws_the_same_and_more(place, tmp_path):
    sets = []
    for share in (0.2, 0.5, 0.9):
        found = throw(place, tmp_path / "s", share=share)
        assert len(found["lying_after"]) == round(share * COUNT)
        sets.append(set(found["lying_after"]["lying_id"]))
    assert sets[0] < sets[1] < sets[2]
    assert set(throw(place, tmp_path / "s", share=0.2, seed=1)["lying_after"]["lying_id"]) != sets[0]


def test_what_a_tree_does_depends_on_its_id_not_on_its_row(place, tmp_path):
    trees: Any = gpd.read_file(place / "trees.gpkg")
    trees[::-1].to_file(tmp_path / "turned.gpkg", layer="trees", driver="GPKG")
    one = throw(place, tmp_path / "a", share=0.3)["lying_after"].set_index("lying_id").sort_index()
    other = throw(place, tmp_path / "b", share=0.3, trees=str(tmp_path / "turned.gpkg"))["lying_after"]
    other = other.set_index("lying_id").sort_index()
    assert one.index.equals(other.index)
    assert (one.geometry == other.geometry).all()


def test_a_stem_lies_as_long_and_as_thick_as_it_stood(place, tmp_path):
    found = throw(place, tmp_path / "s", dem="flat.tif", share=0.5, stump_m=1.0, scatter_deg=0.0, fall_deg=90.0)
    before = found["trees_before"].set_index("tree_id")
    for row in found["lying_after"].itertuples():
        tree = before.loc[row.lying_id]
        (x0, y0), (x1, y1) = row.geometry.coords
        assert (x1 - x0, y1 - y0) == pytest.approx((tree.height_m - 1.0, 0.0), abs=1e-6)
        assert x0 - tree.geometry.x == pytest.approx(tree.dbh_cm / 200.0)
        assert y0 == pytest.approx(tree.geometry.y)
        assert row.diameter_cm == pytest.approx(tree.dbh_cm * (1.0 - 0.5 / tree.height_m))
        assert row.tip_diameter_cm == pytest.approx(0.5 * tree.dbh_cm)


def test_on_a_slope_it_is_as_long_along_the_ground(place, tmp_path):
    found = throw(place, tmp_path / "s", share=0.5, stump_m=0.0, scatter_deg=60.0)
    before = found["trees_before"].set_index("tree_id")
    lengths, plans = [], []
    for row in found["lying_after"].itertuples():
        ends = np.array(row.geometry.coords) - (EAST, NORTH)
        # the ground is bilinear between cell centres: tan 35 above the foot
        heights = np.tan(np.radians(35.0)) * np.maximum(ends[:, 1] - 30.0, 0.0)
        plans.append(np.hypot(*(ends[1] - ends[0])))
        lengths.append(np.hypot(plans[-1], heights[1] - heights[0]) - before.loc[row.lying_id].height_m)
    assert np.abs(lengths).max() < 0.2  # at the kink of the foot, where the surface is rounded by half a cell
    assert np.median(np.abs(lengths)) < 1e-3
    assert min(np.array(plans) / before.loc[found["lying_after"]["lying_id"], "height_m"]) < 0.9


def test_directions_scatter_about_the_wind(place):
    azimuth = fall_directions(item_numbers([f"tree {k}" for k in range(20_000)]), 350.0, 25.0, 3)
    turned = (azimuth - 350.0 + 180.0) % 360.0 - 180.0
    assert abs(turned.mean()) < 4.0 * 25.0 / np.sqrt(20_000)
    assert turned.std() == pytest.approx(25.0, rel=0.02)
    assert ((azimuth >= 0.0) & (azimuth < 360.0)).all()


def test_the_choice_favours_no_tree():
    items = item_numbers([str(k) for k in range(400)])
    times = sum(
        chosen_share(items, np.full(400, 0.25), np.zeros(400, int), seed, 32).astype(int) for seed in range(400)
    )
    assert abs(times.mean() - 100.0) < 1e-9
    assert np.abs(times - 100.0).max() < 5.0 * np.sqrt(400 * 0.25 * 0.75)


def test_classes_areas_and_names_together(place, tmp_path):
    trees = gpd.read_file(place / "trees.gpkg")
    v = trees.geometry.y - NORTH
    south, north = shapely.box(0.0, 0.0, 60.0, 45.0), shapely.box(0.0, 55.0, 60.0, 99.0)
    areas = write_layer(tmp_path / "a.gpkg", [south, north], share=[None, 0.5])
    named = str(trees["tree_id"][int(np.argmin(np.abs(v - 50.0)))])
    found = throw(place, tmp_path / "s", dbh_classes="0:0,40:1", windthrow_areas=areas, ids=named)
    lying = set(found["lying_after"]["lying_id"])
    tall = trees["height_m"] - 0.5 >= 0.5
    in_south = set(trees["tree_id"][(v <= 45.0) & (trees["dbh_cm"] >= 40.0) & tall])
    in_north = set(trees["tree_id"][(v >= 55.0) & tall])
    assert {each for each in lying if each in set(trees["tree_id"][v <= 45.0])} == in_south
    assert len(lying & in_north) == round(0.5 * len(in_north))
    assert lying - in_south - in_north == {named}


def test_where_areas_overlap_the_later_one_counts(place, tmp_path):
    """Nothing falls in the first, all in the second, which covers its northern half."""
    first, second = shapely.box(0.0, 0.0, 60.0, 60.0), shapely.box(0.0, 30.0, 60.0, 60.0)
    areas = write_layer(tmp_path / "a.gpkg", [first, second], share=[0.0, 1.0])
    lying = set(throw(place, tmp_path / "s", windthrow_areas=areas)["lying_after"]["lying_id"])
    trees = gpd.read_file(place / "trees.gpkg")
    v = trees.geometry.y - NORTH
    tall = trees["height_m"] - 0.5 >= 0.5
    assert lying == set(trees["tree_id"][(v >= 30.0) & (v <= 60.0) & tall])


def test_later_some_are_gone_and_the_rest_is_thinner(place, tmp_path):
    found = throw(place, tmp_path / "s", share=0.5, lost=0.25, thinner=0.1)
    after, later = (found[f"lying_{name}"].set_index("lying_id") for name in ("after", "later"))
    assert len(later) == len(after) - 15
    for name in ("diameter_cm", "tip_diameter_cm"):
        assert np.allclose(later[name], 0.9 * after.loc[later.index, name])
    assert (later.geometry == after.geometry.loc[later.index]).all()
    assert found["trees_later"].equals(found["trees_after"])
    assert "lying_cleared" not in found
    assert list(found["trees_after"]["species"]) == list(found["trees_before"]["species"])


def test_what_is_assumed_is_said(place, tmp_path):
    done = windthrow.TOOL(
        trees=str(place / "trees.gpkg"), dem=str(place / "slope.tif"), fall_deg=90.0, share=0.5, thinner=0.1,
        stump_m=0.0, lost=0.3, output=str(tmp_path / "s"),
    )  # fmt: skip
    assert any(each == (
        "assumed: stems fall towards 90 degrees, with a standard deviation of 20; no stumps, the stems are uprooted; "
        "later 18 of 60 lying logs have disappeared (--lost), and the others are 10 % thinner"
    ) for each in done.lines)  # fmt: skip


def test_lying_logs_disappear_and_settle_with_the_years(place, tmp_path):
    """By class of DBH the nearest whole number of the published law; the height falls by its own."""
    for years in (1.0, 20.0, 100.0):
        found = throw(place, tmp_path / "s", share=0.8, years=years, height_m=2.1)
        thrown = found["trees_before"].set_index("tree_id").loc[found["lying_after"]["lying_id"], "dbh_cm"].to_numpy()
        left = 0
        for low, high, mean in ((0.0, 23.0, 71.0), (23.0, 35.0, 90.0), (35.0, 999.0, 113.0)):
            of_class = int(((thrown >= low) & (thrown < high)).sum())
            left += of_class - int(np.floor(of_class * (1.0 - np.exp(-years / mean)) + 0.5))
        assert len(found["lying_later"]) == left
        assert (found["lying_after"]["height_m"] == 2.1).all()
        assert found["lying_later"]["height_m"].to_numpy() == pytest.approx(2.1 * np.exp(-0.048 * years))
    assert "height_m" not in throw(place, tmp_path / "s", share=0.8)["lying_later"]


def test_at_the_edge_of_the_terrain_stems_are_cut_or_left_out_and_counted(tmp_path, said):
    """Of two that fall towards the edge one ends there; the other has no room, and before fell the other way."""
    dem = write_dem(tmp_path / "flat.tif", flat=True)
    trees = write_layer(
        tmp_path / "trees.gpkg", points((20.0, 10.0), (30.0, 0.52), (40.0, 50.0)), tree_id=[1, 2, 3],
        dbh_cm=[40.0, 40.0, 40.0], height_m=[25.0, 20.0, 20.0],
    )  # fmt: skip
    outcome = windthrow.TOOL(
        feedback=said, trees=trees, dem=dem, share=1.0, fall_deg=180.0, scatter_deg=0.0, stump_m=0.5, lost=0.5,
        output=str(tmp_path / "s"),
    )  # fmt: skip
    lying: Any = gpd.read_file(tmp_path / "s" / "lying_after.gpkg").set_index("lying_id")
    assert sorted(lying.index) == [1, 3]
    (_, y0), (_, y1) = lying.geometry[1].coords
    assert y0 - NORTH == pytest.approx(9.8)
    assert y1 - NORTH == pytest.approx(0.5, abs=1e-3)  # the outermost cell centres
    assert any("1 stem would reach beyond the terrain: cut at its edge" in each for each in said.notes)
    assert any("1 of 3 thrown stems would fall off the terrain model" in each for each in said.notes)
    assert outcome.facts["off_terrain"] == 1
    assert outcome.facts["after"] == {"standing": 0, "lying": 2, "removed": 1}
    assert outcome.facts["later"] == {"standing": 0, "lying": 1, "removed": 2}  # half of those that lie
    stems: Any = gpd.read_file(tmp_path / "s" / "stems.gpkg").set_index("tree_id")
    assert stems.loc[2, ["fall_deg", "before", "after", "cleared"]].tolist() == [
        180.0,
        "standing",
        "removed",
        "removed",
    ]
    after: Any = gpd.read_file(tmp_path / "s" / "trees_after.gpkg").set_index("tree_id")
    assert (after["height_m"] == 0.5).all(), "all three left a stump"
    assert len(after) == 3


def test_directions_keep_their_scatter_at_the_terrains_edge(tmp_path):
    """A forest to the very edges: 20 degrees, to 4 standard errors; with the stems at the edge reversed, 21.9 and
    more, because a reversed one is 180 degrees off."""
    dem = write_dem(tmp_path / "flat.tif", flat=True)
    rng = np.random.default_rng(9)
    count = 4000
    at = np.column_stack([0.6 + 58.8 * rng.random(count), 0.6 + 98.8 * rng.random(count)])
    at[:150, 1] = 0.6 + 0.2 * rng.random(150)  # at the edge that they fall to
    trees = write_layer(
        tmp_path / "trees.gpkg", points(*at), tree_id=np.arange(count), dbh_cm=[30.0] * count, height_m=[20.0] * count
    )
    outcome = windthrow.TOOL(trees=trees, dem=dem, share=1.0, fall_deg=180.0, output=str(tmp_path / "s"))
    lying: Any = gpd.read_file(tmp_path / "s" / "lying_after.gpkg")
    assert len(lying) + outcome.facts["off_terrain"] == count
    assert outcome.facts["off_terrain"] >= 100
    ends = np.array([each.coords for each in lying.geometry])
    east, north = (ends[:, 1] - ends[:, 0]).T
    off = (np.degrees(np.arctan2(east, north)) - 180.0 + 180.0) % 360.0 - 180.0
    assert np.abs(off).max() < 90.0
    assert off.std() == pytest.approx(20.0, abs=4 * 20.0 / np.sqrt(2 * len(off)))


def test_plan_lengths_on_a_plane_are_the_cosine():
    from deadwood_algorithms.files.crs import parse_crs
    from deadwood_algorithms.files.grid import Grid

    v = np.arange(80.0)[:, None] * np.ones(80)
    grid = Grid(np.tan(np.radians(40.0)) * v, 1.0, 0.0, 0.0, parse_crs("EPSG:2056"))
    way = np.array([[0.0, -1.0], [1.0, 0.0]])
    far, cut = plan_lengths(np.full((2, 2), 40.0), way, np.array([30.0, 30.0]), grid)
    assert far == pytest.approx([30.0 * np.cos(np.radians(40.0)), 30.0], abs=1e-6)
    assert not cut.any()


def test_slide_logs_takes_the_layers_and_the_commands_are_understood(tmp_path):
    case = Case(tmp_path / "case")
    outcome = windthrow.TOOL(trees=case.trees, dem=case.dem, share=0.5, fall_deg=90.0, output=str(tmp_path / "storm"))
    run = case.run(
        trees=str(tmp_path / "storm" / "trees_after.gpkg"), lying_logs=str(tmp_path / "storm" / "lying_after.gpkg")
    )
    told = summary(run)
    assert told["trees"]["n_total"] == len(gpd.read_file(tmp_path / "storm" / "trees_after.gpkg")) == 59  # 1 is off it
    assert told["lying_logs"]["n_total"] == 30
    assert told["logs"]["by_stop_reason"]["failed"] == 0
    commands = [shlex.split(each) for each in outcome.lines if each.startswith("  deadwood-tool")]
    assert [each[1] for each in commands] == ["slide-logs"] * 4 + ["compare-scenarios"]
    for words in commands:
        tool = find(words[1])
        assert tool is not None
        given = {word for word in words if word.startswith("--")}
        known = {each.flag: each for each in tool.parameters()}
        assert given <= set(known)
        assert {flag for flag, each in known.items() if each.default is None and not each.optional} <= given
    assert all(Path(words[words.index("--trees") + 1]).is_file() for words in commands[:4])
    assert sum("--lying-logs" in words for words in commands) == 2


REFUSED: dict[str, dict[str, Any]] = {
    "it is not specified which stems are thrown; give --share, --dbh-classes, --windthrow-areas or --ids": {},
    "--share is 1.5, but must be at most 1": {"share": 1.5},
    "--dbh-classes is '20:0.5,10:0.3', but must be": {"dbh_classes": "20:0.5,10:0.3"},
    "--dbh-classes is '20', but must be": {"dbh_classes": "20"},
    "--dbh-classes is '0:2', but must be": {"dbh_classes": "0:2"},
    "--ids: tree 'x' is not among the trees on the DEM, nor are 1 more": {"ids": "x,y,t1"},
    "--stump-m is 0.01 m, but must be 0": {"share": 0.5, "stump_m": 0.01},
    "leaves no log; lower --stump-m": {"ids": "t1", "stump_m": 40.0},
    "no stem is thrown": {"share": 0.0},
}


@pytest.mark.parametrize("line", REFUSED)
def test_wrong_options_are_refused_in_a_line(place, tmp_path, line):
    with pytest.raises(UserError, match=line):
        throw(place, tmp_path / "s", **REFUSED[line])
    assert not (tmp_path / "s").exists()


def test_wrong_layers_are_refused_in_a_line(place, tmp_path):
    twins = write_layer(
        tmp_path / "twins.gpkg", points((20.0, 50.0), (30.0, 50.0)), tree_id=[1, 1], dbh_cm=[30.0] * 2,
        height_m=[20.0] * 2,
    )  # fmt: skip
    with pytest.raises(
        UserError, match="rows 1, 2 are called '1', so windthrow cannot distinguish them; .*import-trees"
    ):
        throw(place, tmp_path / "s", trees=twins, share=0.5)
    bare = write_layer(tmp_path / "bare.gpkg", points((20.0, 50.0)), tree_id=[1])
    with pytest.raises(UserError, match="the trees have no field 'dbh_cm'"):
        throw(place, tmp_path / "s", trees=bare, share=0.5)
    far = write_layer(tmp_path / "far.gpkg", [shapely.box(1000.0, 0.0, 1001.0, 1.0)])
    with pytest.raises(UserError, match="no tree stands in an area; check the areas and their CRS"):
        throw(place, tmp_path / "s", windthrow_areas=far, share=0.5)
    empty = write_layer(tmp_path / "empty.gpkg", [shapely.box(0.0, 0.0, 60.0, 100.0)])
    with pytest.raises(UserError, match="the areas have no field 'share', or gaps in it"):
        throw(place, tmp_path / "s", windthrow_areas=empty)
    wrong = write_layer(tmp_path / "wrong.gpkg", [shapely.box(0.0, 0.0, 60.0, 100.0)], share=[40.0])
    with pytest.raises(UserError, match="field 'share', row 1: 40 is not a number at least 0 and at most 1"):
        throw(place, tmp_path / "s", windthrow_areas=wrong)


@pytest.mark.parametrize(("more", "left"), [
    ({"years": 9.0}, 0.11),  # Ammann 2006: up to 89 % less after 8 to 10 years
    ({"years": 8.0}, 0.11 ** (8.0 / 9.0)),
    ({"years": 0.0}, 1.0),
    ({"years": 9.0, "wood": "beech"}, 0.11 ** (0.054 / 0.033)),  # as much faster as its mass decays
    ({"weaker": 0.4}, 0.6),
])  # fmt: skip
def test_old_logs_break_at_less(place, tmp_path, more, left):
    """The capacity of each log, from the DBH of its tree, the power and the source's share; the same logs rigid."""
    found = throw(place, tmp_path / "s", share=0.5, tree_capacity_kj=100.0, lost=0.2, **more)
    dbh = found["trees_before"].set_index("tree_id")["dbh_cm"]
    for name, kept in (("after", 1.0), ("later", left)):
        logs = found[f"lying_{name}"]
        expected = kept * 100.0 * (dbh.loc[logs["lying_id"]].to_numpy() / 40.0) ** 2
        assert logs["capacity_kj"].to_numpy() == pytest.approx(expected, rel=1e-9), name
    rigid = found["lying_later_rigid"]
    assert "capacity_kj" not in rigid
    assert rigid.equals(found["lying_later"].drop(columns="capacity_kj"))
    lines = " ".join(found["outcome"].lines)
    assert f"later {100.0 * left:.2g} % of it are left" in lines
    assert ("up to 89 % less" in lines) == ("weaker" not in more)
    assert "lying_later_rigid.gpkg" in lines
    assert "run_later,run_cleared,run_later_rigid" in lines


def test_without_a_capacity_logs_are_rigid_and_that_is_said(place, tmp_path):
    found = throw(place, tmp_path / "s", share=0.5)
    assert "capacity_kj" not in found["lying_later"]
    assert "lying_later_rigid" not in found
    assert any("lying logs never break, however old" in each for each in found["outcome"].lines)
    with pytest.raises(UserError, match="--weaker needs --tree-capacity-kj"):
        throw(place, tmp_path / "t", share=0.5, weaker=0.5)
