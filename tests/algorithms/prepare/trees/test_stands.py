"""Stands with their own numbers: planted separately, not twice in overlaps, and each by its own distribution."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from scipy import stats
from shapely import Polygon, box

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools.generate_forest import TOOL

EAST, NORTH = 2_783_000.0, 1_190_000.0
LEVEL = 1e-4  # correct draws fail once in 10 000 seeds; the seeds are fixed


def local(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return box(EAST + x0, NORTH + y0, EAST + x1, NORTH + y1)


WEST, MIDDLE_EAST = local(10, 10, 60, 110), local(60, 10, 160, 110)  # half a hectare and a whole one


@pytest.fixture
def forest(tmp_path, slope, said, outcome):
    """Runs the tool on stands with these columns, and gives its layer."""

    def run(shapes, columns=None, name="stands.gpkg", **values) -> gpd.GeoDataFrame:
        gpd.GeoDataFrame(columns or {}, geometry=list(shapes), crs=2056).to_file(tmp_path / name)
        given = {"dem": slope(), "stand": str(tmp_path / name), "output": str(tmp_path / "forest.gpkg")}
        outcome["last"] = TOOL(TOOL.ask_from(given | {"overwrite": True} | values), said)
        return gpd.read_file(tmp_path / "forest.gpkg", layer="trees")

    return run


def test_each_stand_has_its_own_density_and_sizes(forest, outcome):
    columns = {"stems_per_ha": [4000.0, 1000.0], "dbh_mean_cm": [20.0, 50.0], "dbh_sd_cm": [3.0, 8.0]}
    columns |= {"height_mean_m": [15.0, 30.0], "height_sd_m": [2.0, 4.0], "correlation": [0.0, 0.9]}
    frame = forest([WEST, MIDDLE_EAST], columns)
    young, old = frame[frame.within(WEST)], frame[frame.within(MIDDLE_EAST)]
    assert (len(frame), len(young), len(old)) == (3000, 2000, 1000)
    assert frame["tree_id"].tolist() == list(range(1, 3001))
    for part, mean, sd, tall, spread, rho in ((young, 20, 3, 15, 2, 0.0), (old, 50, 8, 30, 4, 0.9)):
        assert stats.kstest(part["dbh_cm"], stats.norm(mean, sd).cdf).pvalue > LEVEL
        assert stats.kstest(part["height_m"], stats.norm(tall, spread).cdf).pvalue > LEVEL
        error = 4 * (1 - rho**2) / np.sqrt(len(part))
        assert np.corrcoef(part["dbh_cm"], part["height_m"])[0, 1] == pytest.approx(rho, abs=error)
    assert outcome["last"].facts["area_ha"] == pytest.approx(1.5)
    said = outcome["last"].lines
    assert said[0] == "3000 trees on 1.50 ha (2000 stems/ha)"
    assert said[-1] == "assumed: places at random, at any distance, seed 0; no clusters, gaps or species"
    assert said[1].startswith("stand of row 1: 2000 trees on 0.50 ha (4000 stems/ha), DBH 20.0 +- 3.0 cm, height 15.0")


def test_a_number_that_the_stands_do_not_tell_is_given_or_fitted(tmp_path, forest):
    frame = forest([WEST, MIDDLE_EAST], {"stems_per_ha": [2000.0, 1000.0]}, dbh_mean_cm=40.0, dbh_sd_cm=5.0)
    assert (len(frame), frame["dbh_cm"].mean()) == (2000, pytest.approx(40, abs=4 * 5 / np.sqrt(2000)))
    frame.to_file(tmp_path / "mapped.gpkg")
    like = forest([WEST, MIDDLE_EAST], {"dbh_mean_cm": [20.0, 50.0]}, like=str(tmp_path / "mapped.gpkg"))
    # The density is that of both stands together: 2000 trees on 1.5 ha.
    assert len(like) == pytest.approx(2000, abs=1)
    assert like[like.within(WEST)]["dbh_cm"].mean() == pytest.approx(20, abs=4 * 5 / np.sqrt(660))
    with pytest.raises(UserError, match="--dbh-mean-cm is missing; give it, or a trees layer with --like"):
        forest([WEST], {"stems_per_ha": [2000.0]})


def test_where_stands_overlap_the_later_one_counts(forest):
    inner = local(30, 30, 50, 60)
    columns = {"stems_per_ha": [1000.0, 0.0], "dbh_mean_cm": [40.0, 40.0], "dbh_sd_cm": [5.0, 5.0]}
    frame = forest([WEST, inner], columns)
    assert len(frame) == round((WEST.area - inner.area) / 10)
    assert not frame.within(inner).any()
    assert len(forest([inner, WEST], {**columns, "stems_per_ha": [0.0, 1000.0]})) == 500


def test_a_tree_keeps_its_place_when_another_stand_grows_denser(forest):
    columns = {"dbh_mean_cm": [40.0, 40.0], "dbh_sd_cm": [5.0, 5.0]}
    thin = forest([WEST, MIDDLE_EAST], columns | {"stems_per_ha": [200.0, 300.0]})
    dense = forest([WEST, MIDDLE_EAST], columns | {"stems_per_ha": [400.0, 300.0]})
    for name in ("geometry", "dbh_cm", "height_m"):
        assert (thin[name][:100].to_numpy() == dense[name][:100].to_numpy()).all()
        assert (thin[name][100:].to_numpy() == dense[name][200:].to_numpy()).all()


def test_stems_keep_their_distance_across_the_border_of_stands(forest):
    columns = {"stems_per_ha": [900.0, 900.0], "dbh_mean_cm": [40.0, 41.0], "dbh_sd_cm": [5.0, 5.0]}

    def nearest(frame) -> float:
        west, east = (np.asarray(frame[frame.within(each)].geometry.array) for each in (WEST, MIDDLE_EAST))
        return float(shapely.distance(west[:, None], east[None]).min())

    assert nearest(forest([WEST, MIDDLE_EAST], columns)) < 1.5  # by chance some are close together
    spaced = forest([WEST, MIDDLE_EAST], columns, min_spacing_m=2.0)
    assert nearest(spaced) >= 2.0
    assert len(spaced) == 1350


def test_the_names_of_platrock_and_of_shapefiles(forest):
    rows = {"trees_density": [1000.0], "trees_dhp_mean": [30.0], "trees_dhp_std": [4.0]}
    frame = forest([WEST], rows, "zones.geojson")
    assert (len(frame), frame["dbh_cm"].mean()) == (500, pytest.approx(30, abs=4 * 4 / np.sqrt(500)))
    cut = forest([WEST], {"stems_per_": [1000.0], "dbh_mean_c": [30.0], "dbh_sd_cm": [4.0]}, "stands.shp")
    assert (cut["dbh_cm"] == frame["dbh_cm"]).all()


def test_stands_off_the_dem_are_left_out_and_faulty_ones_refused(forest, said):
    columns = {"stems_per_ha": [1000.0] * 2, "dbh_mean_cm": [40.0] * 2, "dbh_sd_cm": [5.0] * 2}
    assert len(forest([WEST, local(900, 0, 950, 50)], columns)) == 500
    assert any("1 stand has no place on the DEM" in note for note in said.notes)
    with pytest.raises(UserError, match="no stand has a place for a tree on the DEM; check the polygons"):
        forest([local(900, 0, 950, 50)] * 2, columns)
    for name, value, words in (
        ("stems_per_ha", -1.0, "row 2: -1 is not a number at least 0"),
        ("dbh_mean_cm", 0.0, "row 2: 0 is not a number greater than 0"),
        ("correlation", 1.2, "row 2: 1.2 is not a number at least -1 and at most 1"),
        ("dbh_sd_cm", None, "row 2: the value is empty"),
    ):
        with pytest.raises(UserError, match=f"field '{name}', {words}"):
            forest([WEST, MIDDLE_EAST], columns | {name: [0.5, value]})


def test_a_stand_with_a_hole_is_planted_uniformly(forest, chi_square_excess):
    ring = Polygon(local(20, 20, 140, 140).exterior, [local(60, 60, 100, 100).exterior])
    frame = forest([ring], stems_per_ha=4000.0, dbh_mean_cm=40.0, dbh_sd_cm=5.0)
    blocks = [local(x, y, x + 20, y + 20) for x in range(20, 140, 20) for y in range(20, 140, 20)]
    blocks = [each for each in blocks if (each & ring).area > 0]
    counts = np.array([frame.within(each).sum() for each in blocks], float)
    assert counts.sum() == len(frame) == round(4000 * ring.area / 1e4)
    assert chi_square_excess(counts, np.full(len(blocks), 1 / len(blocks))) < 1


def test_the_papers_forests(forest):
    """Klosters: 300 stems/ha, N(60.23, 18.64) cm; Rothenbrunnen: 315 stems/ha, N(44, 22) cm; negative draws redrawn."""
    for density, mean, sd in ((300.0, 60.23, 18.64), (315.0, 44.0, 22.0)):
        frame = forest([local(10, 10, 190, 150)], stems_per_ha=density, dbh_mean_cm=mean, dbh_sd_cm=sd)
        assert len(frame) == round(density * 180 * 140 / 1e4)
        cut = stats.truncnorm((1.0 - mean) / sd, np.inf, mean, sd)
        assert stats.kstest(frame["dbh_cm"], cut.cdf).pvalue > LEVEL
        assert (frame["dbh_cm"] >= 1).all()
