"""Tables of trees whose own data contradict how they would be read."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest

from deadwood_algorithms.params.messages import Hearing, warnings_among
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.tools import import_trees

DRAW = np.random.default_rng(1)
X, Y = 2_783_000 + DRAW.uniform(10, 190, 40).round(2), 1_190_000 + DRAW.uniform(10, 150, 40).round(2)
DBH = DRAW.uniform(15, 60, 40).round(1)
HEIGHT = (2.0 * DBH**0.7).round(1)


def table(**columns) -> str:
    return pd.DataFrame({"X": X, "Y": Y} | columns).to_csv(index=False)


@pytest.mark.parametrize(
    ("name", "values", "options"),
    [
        ("Radius", DBH / 200.0, {}),
        ("Radius", DBH / 200.0, {"dbh_field": "Radius"}),
        ("Radius", DBH / 200.0, {"dbh_field": "Radius", "dbh_unit": "m"}),
        ("stem", DBH / 200.0, {"dbh_field": "stem", "dbh_unit": "radius-m"}),
        ("stem", DBH / 2.0, {"dbh_field": "stem", "dbh_unit": "radius-cm"}),
        ("StemRadius", DBH / 2.0, {}),
        ("radius_mm", DBH * 5.0, {}),
        ("Rayon [cm]", DBH / 2.0, {}),
        ("Umfang", DBH * np.pi, {}),
        ("Umfang", DBH * np.pi, {"dbh_unit": "cm"}),
        ("Umfang", DBH * np.pi, {"dbh_field": "Umfang", "dbh_unit": "cm"}),
        ("Umfang", DBH * np.pi / 100.0, {"dbh_unit": "m"}),
        ("Umfang", DBH * np.pi, {"dbh_unit": "girth-cm"}),
        ("stem", DBH * np.pi, {"dbh_field": "stem", "dbh_unit": "girth-cm"}),
    ],
)
def test_a_radius_or_a_girth_gives_the_dbh(imported, name, values, options):
    frame = imported(table(**{name: values, "HT": HEIGHT}), **options)
    assert np.allclose(frame["dbh_cm"], DBH, atol=1e-6)
    assert np.allclose(frame["height_m"], HEIGHT)


@pytest.mark.parametrize(
    ("used", "columns", "reason"),
    [
        (1, {"X": np.where(np.arange(40), X + 5000.0, X)}, "39 trees dropped: off the DEM"),
        (4, {"Zustand": ["lebend"] * 4 + ["gefällt"] * 36}, "36 trees dropped: no longer standing"),
        (5, {"Zustand": ["lebend"] * 5 + ["gefällt"] * 35}, None),
    ],
)
def test_a_table_of_which_nearly_nothing_is_used_is_doubted(tmp_path, slope, used, columns, reason):
    """From nine tenths on; the record has the numbers."""
    (tmp_path / "a.csv").write_text(table(**{"BHD": DBH, "Hoehe": HEIGHT} | columns), encoding="utf-8")
    heard = Hearing(Quiet())
    import_trees.TOOL(trees=str(tmp_path / "a.csv"), dem=slope(), output=str(tmp_path / "out.gpkg"), feedback=heard)
    found = [each for each in warnings_among(heard.messages) if each.code == "most-dropped"]
    assert [dict(each.numbers) for each in found] == ([{"trees": 40, "used": used}] if reason else [])
    assert all(reason in each.text for each in found)


def test_a_radius_that_may_be_the_crowns_is_not_used(imported, said):
    frame = imported(table(radius=DBH / 20.0, height=HEIGHT))
    assert (frame["dbh_source"] == "modelled").all()
    assert any("radius" in each for each in said.warnings)


def test_an_empty_column_gives_way_to_a_filled_one(imported, said):
    frame = imported(table(dbh_cm=[""] * 40, BHD=DBH, Hoehe=HEIGHT))
    assert np.allclose(frame["dbh_cm"], DBH)
    assert any("'dbh_cm'" in each for each in said.warnings)
    with pytest.raises(UserError, match="'dbh_cm'"):
        imported(table(dbh_cm=[""] * 40, BHD=DBH, Hoehe=HEIGHT), dbh_field="dbh_cm")


def test_remarks_that_hold_the_status_are_counted(imported, said):
    remarks = ["abgestorben, steht noch"] * 12 + ["2021 gefällt"] * 24 + ["Spechtloch"] * 4
    imported(table(BHD=DBH, Hoehe=HEIGHT, Bemerkung=remarks))
    assert any("12 dead and 24 fallen" in each for each in said.warnings)
    frame = imported(table(BHD=DBH, Hoehe=HEIGHT, Bemerkung=remarks), status_field="Bemerkung")
    assert len(frame) == 4


def test_a_table_of_which_most_is_dropped_is_refused(imported):
    with pytest.raises(UserError, match="only 1 of 40"):
        imported(table(dbh_cm=DBH, height_m=[20.0] + [0.2] * 39))


def test_several_numbers_may_stand_for_a_missing_value(imported):
    values = np.where(np.arange(40) == 3, -1.0, np.where(np.arange(40) == 4, 999.0, DBH))
    frame = imported(table(dbh_cm=values, height_m=HEIGHT), missing_value=(-1.0, 999.0))
    assert (frame["dbh_source"] == "modelled").sum() == 2


def test_a_date_in_a_column_of_sizes_is_called_one(imported):
    values = [f"{each:g}" for each in DBH]
    values[3] = "2024-12-10"
    with pytest.raises(UserError, match="is a date"):
        imported(table(dbh_cm=values, height_m=HEIGHT))


def test_latitude_and_longitude_exchanged_are_called_so(imported):
    import geopandas
    import pyproj

    lon, lat = pyproj.Transformer.from_crs(2056, 4326, always_xy=True).transform(X, Y)
    frame = geopandas.GeoDataFrame({"dbh_cm": DBH, "height_m": HEIGHT}, geometry=geopandas.points_from_xy(lat, lon))
    from deadwood_algorithms.files.vectors import read_vector

    rows = frame.set_crs(4326)
    with pytest.raises(UserError, match="latitude and longitude"):
        read_vector("a.gpkg", target_crs=pyproj.CRS(2056), what="trees", rows=rows)


def heard_of(tmp_path, slope, **columns) -> tuple[set[str], pd.DataFrame]:
    """Codes of the warnings about a table, and the trees."""
    (tmp_path / "a.csv").write_text(pd.DataFrame({"X": X, "Y": Y} | columns).to_csv(index=False), encoding="utf-8")
    heard = Hearing(Quiet())
    output = str(tmp_path / "o.gpkg")
    import_trees.TOOL(trees=str(tmp_path / "a.csv"), dem=slope(), output=output, overwrite=True, feedback=heard)
    return {each.code for each in warnings_among(heard.messages)}, gpd.read_file(tmp_path / "o.gpkg")


@pytest.mark.parametrize("nothing", ["", "#NV", 0, "k.A."])
@pytest.mark.parametrize(("name", "values"), [("Umfang", DBH * np.pi), ("D", DBH), ("Radius", DBH / 200.0)])
def test_a_column_without_any_value_gives_way_to_a_usable_one(tmp_path, slope, nothing, name, values):
    """Also one of words for gaps, or of zeros: its DBH was computed from the height, without a word."""
    codes, frame = heard_of(tmp_path, slope, BHD=[nothing] * 40, **{name: values}, Hoehe=HEIGHT)
    assert "empty-field" in codes
    assert np.allclose(frame["dbh_cm"], DBH, atol=1e-6)


def test_a_column_with_few_values_beside_a_full_one_is_doubted(tmp_path, slope):
    few = [31.0, 32.0, *[""] * 38]
    codes, _ = heard_of(tmp_path, slope, BHD=few, Umfang=DBH * np.pi, Hoehe=HEIGHT)
    assert "fuller-field" in codes
    codes, _ = heard_of(tmp_path, slope, BHD=DBH, Umfang=[*[90.0] * 38, "", ""], Hoehe=HEIGHT)
    assert "fuller-field" not in codes


@pytest.mark.parametrize(
    "name", ["Fälldatum", "Faellungsjahr", "cut_year", "date_abattage", "data_taglio", "felled", "Abgang"]
)
def test_dates_of_felling_are_doubted(tmp_path, slope, name):
    """9 of 40 trees that were felled count as living."""
    codes, _ = heard_of(tmp_path, slope, BHD=DBH, Hoehe=HEIGHT, **{name: ["2020"] * 9 + [""] * 31})
    assert "status-not-read" in codes
    codes, _ = heard_of(tmp_path, slope, BHD=DBH, Hoehe=HEIGHT, **{name: [""] * 40})
    assert "status-not-read" not in codes


@pytest.mark.parametrize("date", ["2024-05-12", "12. Mai", "12.05.2024", "5-Dec"])
@pytest.mark.parametrize("name", ["X", "Y"])
def test_a_date_among_coordinates_is_called_a_date(tmp_path, slope, date, name):
    columns: dict = {"X": [f"{each:.2f}" for each in X], "Y": [f"{each:.2f}" for each in Y]}
    columns[name][3] = date
    with pytest.raises(UserError, match=rf"field '{name}', row 4: '{date}' is a date, not a finite number: .*format"):
        heard_of(tmp_path, slope, **columns, BHD=DBH, Hoehe=HEIGHT)
