"""Inputs as users gave them, which stand outside the repository: what `inspect` says of each, and the values read.

Siblings of every class are built by the other tests of this folder.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import inspect

CASES = Path(__file__).parents[4] / "shared" / "cases"
pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the cases stand beside the repository")
# File: its role, the codes of what is doubted, and the beginning of what is counted.
SEEN = {
    "04_axis_order/y_east_x_north.csv": ("trees", set(), "60 trees, of which 0 dead, median DBH 37.35 cm"),
    "05_nodata_mismatch/dem_bled_wide.tif": ("dem", {"undeclared-nodata"}, "160 x 240 cells of 1 m"),
    "08_dbh_ranges/range.csv": ("trees", {"classes-read"}, "60 trees, of which 0 dead, median DBH 37.50 cm"),
    "10_girth/baumkataster.shp": ("trees", {"girth"}, "60 trees, of which 0 dead, median DBH 37.40 cm"),
    "10_girth/circonference.csv": ("trees", {"girth"}, "60 trees, of which 0 dead, median DBH 37.40 cm"),
    "12_osm_roads/export_nopoints.geojson": ("lines", set(), ""),
    "19_barriers/hoehe.shp": ("barriers", set(), "2 rows"),
    "22_release_polygons/unclosed.shp": ("areas", set(), "1 row, 0.12 ha"),
    "23_lidr_not_normalised/crowns_collection.gpkg": ("trees", set(), "3 trees"),
    "30_low_trees/tiges.geojson": ("trees", set(), "2 trees"),
    "33_feet_int16/dem_feet_int16.tif": (
        "dem",
        {"named-in-feet", "stepped-heights", "steep"},
        "160 x 240 cells of 1 m",
    ),
    "34_status_words/de1.csv": ("trees", set(), "45 trees, of which 30 dead"),
    "34_status_words/fr1.csv": ("trees", set(), "30 trees, of which 15 dead"),
    "34_status_words/it1.csv": ("trees", set(), "30 trees, of which 15 dead"),
    "36_hoehe_above_sea/hoehe_ueber_meer.csv": ("trees", set(), "60 trees"),
    "39_steps/whole_metres_int16.tif": ("dem", {"stepped-heights"}, "160 x 240 cells of 1 m"),
    "43_same_place/multistem_rows.csv": ("trees", {"same-position"}, "180 trees"),
    "45_text_tables/gap_kA_107.csv": ("trees", set(), "30 trees"),
    "50_truncated_download/a.geojson": ("trees", {"one-page"}, "10 trees"),
    "50_truncated_download/b.geojson": ("trees", {"one-page"}, "10 trees"),
    "50_truncated_download/c.geojson": ("trees", {"one-page"}, "10 trees"),
    "51_surface_model/a.tif": ("dem", {"surface-model"}, "160 x 240 cells of 1 m"),
    "52_band_order/a.tif": ("dem", set(), "160 x 240 cells of 1 m"),
    "55_netcdf_two_variables/a.nc": ("dem", set(), "160 x 240 cells of 1 m"),
    "57_stem_radius/a.csv": ("trees", {"radius"}, "40 trees, of which 0 dead, median DBH 33.35 cm"),
}


@pytest.mark.parametrize("name", SEEN)
def test_what_is_said_of_a_case(name):
    facts = inspect.TOOL(path=str(CASES / name)).facts
    role, codes, counted = SEEN[name]
    assert (facts["role"], {each["code"] for each in facts["doubts"]}) == (role, codes)
    assert facts["counted"].startswith(counted)


@pytest.mark.parametrize("name", ["52_band_order/a.tif", "55_netcdf_two_variables/a.nc"])
def test_the_heights_of_a_stack_are_read(name):
    heights = read_dem(CASES / name).values
    assert (np.nanmin(heights), np.nanmax(heights)) == pytest.approx((799.7, 926.0), abs=0.1)


@pytest.mark.parametrize(
    ("name", "way_out"),
    [("11_xlsx_ulm/title_and_sum.xlsx", "|layername=Aufnahme"), ("20_zip/road.gpx", "|layername=routes")],
)
def test_a_file_of_several_layers_names_one_that_can_be_read(name, way_out):
    with pytest.raises(UserError) as refused:
        inspect.TOOL(path=str(CASES / name))
    assert way_out in str(refused.value)
    assert inspect.TOOL(path=str(CASES / name) + way_out).facts["commands"]


def test_every_case_is_named_here():
    beside = (".md", ".py", ".dbf", ".shx", ".prj", ".cpg")
    files = {f"{each.parent.name}/{each.name}" for each in CASES.glob("*_*/*.*") if each.suffix not in beside}
    others = {"10_girth/italiano.csv", "21_lv03/lv03_no_crs.csv", "22_release_polygons/sliver.gpkg"}
    others |= {"11_xlsx_ulm/title_and_sum.xlsx", "20_zip/road.gpx"}
    assert files == set(SEEN) | others
