"""Random forests: number, places, sizes, and what a tree keeps when the forest changes."""

from __future__ import annotations

from collections import Counter

import geopandas as gpd
import numpy as np
import pytest
import shapely
from scipy import stats
from shapely import Polygon, box

from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.prepare.trees.forest_sizes import Sizes, draw_sizes
from deadwood_algorithms.tools.generate_forest import TOOL

EAST, NORTH = 2_783_000.0, 1_190_000.0
# Of 100 x 80 heights, 2 m apart: the surface spans 198 m x 158 m.
DEM_HA = 198 * 158 / 1e4
KLOSTERS = {"stems_per_ha": 300.0, "dbh_mean_cm": 60.23, "dbh_sd_cm": 18.64}


@pytest.fixture
def forest(tmp_path, slope, said, outcome):
    """Runs the tool and gives its layer."""

    def run(**values) -> gpd.GeoDataFrame:
        values = {"dem": slope(), "output": str(tmp_path / "forest.gpkg"), "overwrite": True} | values
        outcome["last"] = TOOL(TOOL.ask_from(values), said)
        return gpd.read_file(tmp_path / "forest.gpkg")

    return run


def polygons(tmp_path, *shapes, name="stand.gpkg") -> str:
    gpd.GeoDataFrame(geometry=list(shapes), crs=2056).to_file(tmp_path / name)
    return str(tmp_path / name)


def local(x0, y0, x1, y1) -> Polygon:
    return box(EAST + x0, NORTH + y0, EAST + x1, NORTH + y1)


def test_the_number_of_trees_is_density_times_area(forest, outcome):
    frame = forest(**KLOSTERS)
    assert len(frame) == round(300 * DEM_HA) == 939
    assert outcome["last"].facts["area_ha"] == pytest.approx(DEM_HA)
    assert list(frame)[:3] == ["tree_id", "dbh_cm", "height_m"]
    assert frame["tree_id"].tolist() == list(range(1, 940))
    west, south, east, north = frame.total_bounds
    assert (west >= EAST + 1, east <= EAST + 199, south >= NORTH + 1, north <= NORTH + 159) == (True,) * 4


def test_nodata_counts_for_no_area_and_bears_no_tree(forest, slope, outcome):
    frame = forest(**KLOSTERS, dem=slope("holed.tif", nodata_rows=30))
    assert outcome["last"].facts["area_ha"] == pytest.approx(198 * 98 / 1e4)
    assert len(frame) == round(300 * 198 * 98 / 1e4)
    assert frame.geometry.y.max() <= NORTH + 99


def test_stand_hole_and_exclusion_are_kept(tmp_path, forest, outcome):
    stand = Polygon(local(20, 20, 120, 120).exterior, [local(40, 40, 60, 60).exterior])
    exclude = local(100, 0, 200, 200)
    frame = forest(
        stems_per_ha=2000.0,
        dbh_mean_cm=40.0,
        dbh_sd_cm=5.0,
        stand=polygons(tmp_path, stand),
        exclude=polygons(tmp_path, exclude, name="exclude.gpkg"),
    )
    rest = stand - exclude
    assert outcome["last"].facts["area_ha"] == pytest.approx(rest.area / 1e4)
    assert len(frame) == round(2000 * rest.area / 1e4)
    assert frame.within(rest).all()


def test_a_stand_partly_on_nodata_counts_for_what_lies_on_heights(tmp_path, forest, slope, outcome):
    # Heights up to 99 m north of the corner: of the stand from 59 to 119 m, two thirds.
    forest(**KLOSTERS, dem=slope("holed.tif", nodata_rows=30), stand=polygons(tmp_path, local(19, 59, 119, 119)))
    assert outcome["last"].facts["area_ha"] == pytest.approx(100 * 40 / 1e4)


def test_places_are_uniform(forest):
    frame = forest(stems_per_ha=4000.0, dbh_mean_cm=40.0, dbh_sd_cm=5.0)
    counts = np.histogram2d(
        frame.geometry.x - EAST, frame.geometry.y - NORTH, bins=(np.linspace(1, 199, 9), np.linspace(1, 159, 7))
    )[0].ravel()
    assert counts.sum() == len(frame)
    # Uniform draws exceed this once in 10 000 seeds; this seed is fixed.
    assert stats.chisquare(counts).statistic < stats.chi2.ppf(1 - 1e-4, counts.size - 1)


def test_a_tree_keeps_its_place_and_size_when_the_forest_grows_denser(forest):
    thin = forest(**KLOSTERS | {"stems_per_ha": 100.0})
    dense = forest(**KLOSTERS)
    assert dense.iloc[: len(thin)].equals(thin)
    spaced_thin = forest(**KLOSTERS | {"stems_per_ha": 100.0}, min_spacing_m=3.0)
    spaced_dense = forest(**KLOSTERS, min_spacing_m=3.0)
    assert spaced_dense.iloc[: len(spaced_thin)].equals(spaced_thin)


def test_the_same_seed_gives_the_same_file_and_another_another(tmp_path, forest):
    first = forest(**KLOSTERS, seed=5)
    raw = (tmp_path / "forest.gpkg").read_bytes()
    forest(**KLOSTERS, seed=5)
    assert (tmp_path / "forest.gpkg").read_bytes() == raw
    other = forest(**KLOSTERS, seed=6)
    assert not (first.geometry == other.geometry).any()
    assert (first["dbh_cm"] == other["dbh_cm"]).mean() < 0.01


def test_no_two_stems_stand_nearer_than_asked(forest):
    def nearest(frame) -> float:
        x = np.column_stack((frame.geometry.x, frame.geometry.y))
        distance = np.hypot(*(x[:, None] - x[None]).transpose(2, 0, 1))
        return float(distance[np.triu_indices(len(x), 1)].min())

    assert nearest(forest(**KLOSTERS)) < 1.0  # by chance some are
    spaced = forest(**KLOSTERS, min_spacing_m=3.0)
    assert nearest(spaced) >= 3.0
    assert len(spaced) == 939


def test_spacing_that_leaves_no_room_is_refused_at_once(forest):
    with pytest.raises(UserError, match="--min-spacing-m 5 leaves no room for 300 stems/ha, only for 255 at most"):
        forest(**KLOSTERS, min_spacing_m=5.0)


@pytest.mark.parametrize(("mean", "sd"), [(60.23, 18.64), (44.0, 22.0)])
def test_dbh_follows_the_papers_normal_cut_where_there_is_no_tree(mean, sd):
    dbh, height, redrawn = draw_sizes(Sizes(mean, sd, 200.0, 1.0, 0.0), np.arange(1, 20_000 + 1), 1)
    cut = stats.truncnorm((1.0 - mean) / sd, np.inf, mean, sd)
    # Rounding to 0.01 cm is far below what 20 000 draws can resolve.
    assert stats.kstest(dbh, cut.cdf).pvalue > 1e-4
    assert dbh.min() >= 1.0
    n = 20_000
    lost = stats.norm.cdf(1.0, mean, sd)  # a redraw may be lost again: n * lost / (1 - lost) in the mean
    expected = n * lost / (1 - lost)
    assert abs(redrawn - expected) < 4 * np.sqrt(expected) + 1
    assert stats.kstest(height, stats.norm(200, 1).cdf).pvalue > 1e-4


def test_no_tree_is_lower_than_breast_height():
    dbh, height, redrawn = draw_sizes(Sizes(40.0, 5.0, 3.0, 2.0, 0.0), np.arange(1, 20_000 + 1), 1)
    assert stats.kstest(height, stats.truncnorm((1.3 - 3) / 2, np.inf, 3, 2).cdf).pvalue > 1e-4
    assert redrawn > 0
    assert stats.kstest(dbh, stats.norm(40, 5).cdf).pvalue > 1e-4


@pytest.mark.parametrize("rho", [-0.5, 0.0, 0.8, 1.0])
def test_height_and_dbh_are_correlated_as_requested(rho):
    dbh, height, _ = draw_sizes(Sizes(60.0, 8.0, 30.0, 4.0, rho), np.arange(1, 20_000 + 1), 1)
    # Standard error of a correlation: (1 - rho^2) / sqrt(n); four of them, and the rounding.
    assert np.corrcoef(dbh, height)[0, 1] == pytest.approx(rho, abs=4 * (1 - rho**2) / np.sqrt(20_000) + 1e-4)
    assert height.mean() == pytest.approx(30, abs=4 * 4 / np.sqrt(20_000))
    assert height.std() == pytest.approx(4, rel=0.03)


def test_redrawn_trees_are_reported(forest, outcome):
    forest(stems_per_ha=2000.0, dbh_mean_cm=44.0, dbh_sd_cm=22.0)
    redrawn = outcome["last"].facts["redrawn"]
    assert redrawn > 0
    assert f"{redrawn} draws were not a tree" in outcome["last"].lines[-2]


def test_heights_follow_from_the_dbh_unless_given(forest):
    by_law = forest(stems_per_ha=2000.0, dbh_mean_cm=40.0, dbh_sd_cm=4.0)
    mean = (40 / 2.52) ** (1 / 0.84)
    assert by_law["height_m"].mean() == pytest.approx(mean, rel=0.01)
    assert by_law["height_m"].std() == pytest.approx(0.5 * mean * 0.1, rel=0.05)
    given = forest(stems_per_ha=2000.0, dbh_mean_cm=40.0, dbh_sd_cm=4.0, height_mean_m=22.0, height_sd_m=3.0)
    assert given["height_m"].mean() == pytest.approx(22, rel=0.01)
    assert given["height_m"].std() == pytest.approx(3, rel=0.05)


def test_heights_may_follow_a_published_law(forest):
    numbers = {"stems_per_ha": 2000.0, "dbh_mean_cm": 40.0, "dbh_sd_cm": 4.0}
    mean = 40 ** (1 / 1.25)
    assert forest(**numbers, dbh_law="fint")["height_m"].mean() == pytest.approx(mean, rel=0.01)
    with pytest.raises(UserError, match="--dbh-law fint and --dbh-a 2, --dbh-b 0.84 are two laws"):
        forest(**numbers, dbh_law="fint", dbh_a=2.0)


def test_a_forest_like_another_has_its_density_sizes_and_correlation(tmp_path, forest, outcome):
    source = forest(stems_per_ha=500.0, dbh_mean_cm=50.0, dbh_sd_cm=8.0, height_mean_m=28.0, height_sd_m=4.0)
    source.to_file(tmp_path / "mapped.gpkg")
    copy = forest(like=str(tmp_path / "mapped.gpkg"), seed=9)
    assert len(copy) == len(source)
    n = len(source)
    for name, sd in (("dbh_cm", 8.0), ("height_m", 4.0)):
        assert copy[name].mean() == pytest.approx(source[name].mean(), abs=4 * sd / np.sqrt(n))
        assert copy[name].std() == pytest.approx(source[name].std(), rel=4 / np.sqrt(2 * n))
    rho = [float(np.corrcoef(each["dbh_cm"], each["height_m"])[0, 1]) for each in (source, copy)]
    assert rho[1] == pytest.approx(rho[0], abs=4 * (1 - rho[0] ** 2) / np.sqrt(n))
    thinner = forest(like=str(tmp_path / "mapped.gpkg"), stems_per_ha=100.0)
    assert len(thinner) == round(100 * DEM_HA)


def skewed(tmp_path, slope, name: str = "skewed.gpkg") -> gpd.GeoDataFrame:
    """939 trees whose DBH is log-normal, of mean 20 and standard deviation 18 cm, at uniform places."""
    rng = np.random.default_rng(11)
    n, log_sd = 939, np.sqrt(np.log1p((18.0 / 20.0) ** 2))
    dbh = np.maximum(np.exp(np.log(20.0) - 0.5 * log_sd**2 + log_sd * rng.standard_normal(n)), 1.0)
    places = [shapely.Point(EAST + 1 + 198 * a, NORTH + 1 + 158 * b) for a, b in rng.random((n, 2))]
    height = 1.3 + 3.0 * dbh**0.6 * np.exp(0.1 * rng.standard_normal(n))
    frame = gpd.GeoDataFrame(
        {"tree_id": range(n), "dbh_cm": dbh.round(2), "height_m": height.round(2)}, geometry=places, crs=2056
    )
    frame.to_file(tmp_path / name)
    return frame


def test_a_skewed_forest_keeps_its_moments_and_its_basal_area(tmp_path, forest, slope, outcome):
    """The same number of trees has the source's moments and relation of DBH and height. Before, with normal draws
    that are redrawn if they are not a tree: mean 25 instead of 20 cm, basal area 15 % more."""
    source = skewed(tmp_path, slope)
    copy = forest(like=str(tmp_path / "skewed.gpkg"), seed=4)
    assert len(copy) == len(source)
    pairs = [sorted(zip(each["dbh_cm"], each["height_m"], strict=True)) for each in (source, copy)]
    assert pairs[0] == pairs[1]
    assert copy["dbh_cm"].tolist() != source["dbh_cm"].tolist()
    area = np.pi / 4.0 * float((source["dbh_cm"] ** 2).sum()) / 1e4 / DEM_HA
    assert outcome["last"].facts["basal_area_m2_per_ha"] == pytest.approx(area)
    told = "\n".join(outcome["last"].lines)
    mean, sd = source["dbh_cm"].mean(), source["dbh_cm"].std()
    assert f"DBH of the layer {mean:.1f} +- {sd:.1f} cm, planted {mean:.1f} +- {sd:.1f} cm" in told
    assert f"basal area of the layer {area:.3g} m2/ha, planted {area:.3g} m2/ha" in told


def test_more_and_fewer_trees_than_the_source_are_dealt_from_it(tmp_path, forest, slope):
    """Every tree of the source as often as any other, by one at most; and a tree keeps its sizes in a denser forest."""
    source = skewed(tmp_path, slope)
    like = str(tmp_path / "skewed.gpkg")
    few, many = forest(like=like, stems_per_ha=100.0), forest(like=like, stems_per_ha=1000.0)
    assert many.iloc[: len(few)].equals(few)
    names = ["dbh_cm", "height_m"]
    there, here = (Counter(each[names].itertuples(index=False, name=None)) for each in (source, many))
    least, rest = divmod(len(many), len(source))
    assert rest > 0
    assert set(there) == set(here)
    assert all(least * there[each] <= times <= (least + 1) * there[each] for each, times in here.items())
    # of 100 trees per hectare the mean, within the scatter of a sample without replacement (four standard errors)
    scatter = source["dbh_cm"].std() / np.sqrt(len(few)) * np.sqrt(1.0 - len(few) / len(source))
    assert few["dbh_cm"].mean() == pytest.approx(source["dbh_cm"].mean(), abs=4 * scatter)
    other = forest(like=like, seed=1)
    assert (other["dbh_cm"] == many["dbh_cm"].iloc[: len(other)]).mean() < 0.05


def test_a_given_size_overrides_those_of_the_layer(tmp_path, forest, slope, outcome):
    """And then both are drawn from normal distributions."""
    skewed(tmp_path, slope)
    frame = forest(like=str(tmp_path / "skewed.gpkg"), dbh_mean_cm=40.0, dbh_sd_cm=4.0)
    n = len(frame)
    assert frame["dbh_cm"].mean() == pytest.approx(40.0, abs=4 * 4.0 / np.sqrt(n))
    told = "\n".join(outcome["last"].lines)
    expected = np.pi / 4.0 * (40.0**2 + 4.0**2) / 1e4 * n / DEM_HA
    assert f"basal area asked {expected:.3g} m2/ha, planted " in told
    planted = np.pi / 4.0 * float((frame["dbh_cm"] ** 2).sum()) / 1e4 / DEM_HA
    assert outcome["last"].facts["basal_area_m2_per_ha"] == pytest.approx(planted)


def test_what_is_too_small_for_a_tree_is_left_out_and_reported(tmp_path, forest, slope, said):
    source = skewed(tmp_path, slope)
    source.loc[:9, "dbh_cm"] = 0.7
    source.to_file(tmp_path / "small.gpkg")
    assert len(forest(like=str(tmp_path / "small.gpkg"))) == len(source) - 10
    assert any("10 of the 939 trees there left out (DBH < 1 cm or height < 1.3 m)" in each for each in said.notes)


def test_only_the_trees_of_the_stand_are_fitted(tmp_path, forest):
    mapped = forest(stems_per_ha=500.0, dbh_mean_cm=50.0, dbh_sd_cm=0.0)
    inside = mapped.within(local(20, 20, 80, 80))
    mapped.loc[inside, "dbh_cm"] = 20.0
    mapped.to_file(tmp_path / "mapped.gpkg")
    frame = forest(like=str(tmp_path / "mapped.gpkg"), stand=polygons(tmp_path, local(20, 20, 80, 80)))
    assert len(frame) == inside.sum()
    assert (frame["dbh_cm"] == 20).all()


@pytest.mark.parametrize(
    ("missing", "option"),
    [("stems_per_ha", "--stems-per-ha"), ("dbh_mean_cm", "--dbh-mean-cm"), ("dbh_sd_cm", "--dbh-sd-cm")],
)
def test_numbers_that_are_neither_given_nor_fitted_are_required(forest, missing, option):
    with pytest.raises(UserError, match=f"{option} is missing; give it, or a trees layer with --like"):
        forest(**{name: value for name, value in KLOSTERS.items() if name != missing})


def test_stands_without_room_or_trees_are_refused(tmp_path, forest, slope):
    with pytest.raises(UserError, match="leave no place on the DEM"):
        forest(**KLOSTERS, stand=polygons(tmp_path, local(500, 500, 600, 600)))
    with pytest.raises(UserError, match="entirely on nodata"):
        forest(**KLOSTERS, dem=slope("holed.tif", nodata_rows=30), stand=polygons(tmp_path, local(20, 110, 60, 150)))
    with pytest.raises(UserError, match="gives no tree"):
        forest(**KLOSTERS, stand=polygons(tmp_path, local(20, 20, 22, 22)))
    gpd.GeoDataFrame(
        {"dbh_cm": [30.0], "height_m": [20.0]}, geometry=[shapely.Point(EAST + 50, NORTH + 50)], crs=2056
    ).to_file(tmp_path / "one.gpkg")
    with pytest.raises(UserError, match="1 of its trees is standing on the DEM; a fit needs 2"):
        forest(like=str(tmp_path / "one.gpkg"))


def test_numbers_that_hardly_ever_give_a_tree_are_refused(forest):
    with pytest.raises(UserError, match=r"DBH 0\.6 .* hardly ever give a possible tree"):
        forest(stems_per_ha=300.0, dbh_mean_cm=0.6, dbh_sd_cm=0.18)  # in metres
    with pytest.raises(UserError, match="hardly ever give a possible tree; check the numbers and their units"):
        draw_sizes(Sizes(0.4, 0.1, 20.0, 1.0, 0.0), np.arange(1, 100 + 1), 1)


def test_an_interrupted_run_leaves_nothing(tmp_path, slope, said):
    said.cancelled = lambda: True
    with pytest.raises(Cancelled):
        TOOL(TOOL.ask_from({"dem": slope(), "output": str(tmp_path / "forest.gpkg")} | KLOSTERS), said)
    assert [each.name for each in tmp_path.iterdir()] == ["dem.tif"]
