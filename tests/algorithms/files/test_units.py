"""Units in the names of fields, in every tool that reads columns; and the notes on fields that are not understood."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from shapely import LineString, box
from slope_case import EAST, NORTH, points, write_dem, write_layer

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.units import Named, factor, named, scaled
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.default_log import DEFAULTED
from deadwood_algorithms.scene.layers import read_barriers, read_trees
from deadwood_algorithms.scene.lying_logs import read_lying_logs
from deadwood_algorithms.scene.releases import read_releases
from deadwood_algorithms.tools import generate_forest, import_trees, sample_releases

NAMES = {
    "Höhe (m)": ("höhe", "m"),
    "BHD [cm]": ("bhd", "cm"),
    "BHD_[mm]": ("bhd", "mm"),
    "Höhe / m": ("höhe", "m"),
    "Höhe in Fuss": ("höhe in fuss", ""),
    "height (feet)": ("height", "ft"),
    "DBH (Zoll)": ("dbh", "in"),
    "height, ft": ("height", "ft"),
    "BHD in cm": ("bhd", "cm"),
    "height_ft": ("height", "ft"),
    "Dichte [g/cm³]": ("dichte", "g/cm³"),
    "Neigung (°)": ("neigung", "°"),
    "height (lidar)": ("height", ""),
    "(m)": ("(m)", ""),
    "species": ("species", ""),
}


@pytest.mark.parametrize("name", NAMES)
def test_a_name_tells_what_and_in_which_unit(name):
    told = named(name)
    assert (told.plain, told.unit) == NAMES[name]


def test_what_one_unit_is_in_another():
    assert factor("ft", "m") == 0.3048
    assert factor("mm", "cm") == pytest.approx(0.1)
    assert factor("g/cm³", "kg/m³") == 1000.0
    assert factor("km/h", "m/s") == pytest.approx(1 / 3.6)
    assert factor("cm", "kg/m³") is None
    assert named("height_ft", joined=False) == Named("height_ft")
    cells = scaled(pd.Series([1.5, "2", "x", None], dtype=object), 2.0).tolist()
    assert cells[:3] == [3.0, 4.0, "x"]
    assert pd.isna(cells[3])


def table(folder: Path, **columns: list[Any]) -> str:
    frame = {"x": [EAST + 10.0, EAST + 20.0, EAST + 30.0], "y": [NORTH + 50.0] * 3} | columns
    pd.DataFrame(frame).to_csv(folder / "t.csv", index=False)
    return str(folder / "t.csv")


def imported(folder: Path, said, trees: str, **values) -> gpd.GeoDataFrame:
    given = {"trees": trees, "dem": write_dem(folder / "dem.tif"), "output": str(folder / "out.gpkg")}
    import_trees.TOOL(feedback=said, overwrite=True, **given, **values)
    return gpd.read_file(folder / "out.gpkg", layer="trees")


@pytest.mark.parametrize(
    ("dbh", "height", "diameters", "heights"),
    [
        ("BHD [cm]", "Höhe (m)", [30.0, 40.0, 50.0], [21.0, 22.0, 23.0]),
        ("BHD [mm]", "Höhe (dm)", [300.0, 400.0, 500.0], [210.0, 220.0, 230.0]),
        ("DBH (in)", "height_ft", [30 / 2.54, 40 / 2.54, 50 / 2.54], [21 / 0.3048, 22 / 0.3048, 23 / 0.3048]),
        ("dhp (Meter)", "hauteur", [0.3, 0.4, 0.5], [21.0, 22.0, 23.0]),
    ],
)
def test_import_trees_reads_bracketed_units(tmp_path, said, dbh, height, diameters, heights):
    options = {"height_field": height} if height in ("hauteur", "height_ft") else {}
    frame = imported(tmp_path, said, table(tmp_path, **{dbh: diameters, height: heights}), **options)
    assert frame["dbh_cm"].tolist() == pytest.approx([30.0, 40.0, 50.0])
    assert frame["height_m"].tolist() == pytest.approx([21.0, 22.0, 23.0])
    assert not said.warnings


def test_sizes_are_not_made_up_in_silence(tmp_path, said):
    """If every height comes from the DBH, a field that may be the height is named."""
    imported(tmp_path, said, table(tmp_path, dbh=[30.0, 40.0, 50.0], wysokosc=[21.0, 22.0, 23.0]))
    assert len(said.warnings) == 1
    assert "no field is understood as the height, so that each is computed from the DBH" in said.warnings[0]
    assert "if it is one of wysokosc, name it with --height-field" in said.warnings[0]


def test_a_unit_that_is_unknown_is_reported(tmp_path, said):
    imported(tmp_path, said, table(tmp_path, dbh=[30.0, 40.0, 50.0], **{"Höhe (Ellen)": [21.0, 22.0, 23.0]}))
    assert "the unit 'ellen' of the field 'Höhe (Ellen)' is not known, m is taken" in said.warnings[0]


DEFAULTS: dict[str, Any] = dict.fromkeys(DEFAULTED, 0.0) | {"orientation": "upright"}
DEFAULTS |= {"dbh_cm": 75.0, "length_m": 30.0, "density_kg_m3": 300.0}
PLACES = points((30, 80), (31, 80))


def test_layers_of_a_run_read_them_too(tmp_path, said):
    grid = read_dem(write_dem(tmp_path / "dem.tif"))
    columns = {"BHD [cm]": [40.0, 50.0], "Länge (dm)": [100.0, 120.0], "Dichte (g/cm3)": [0.4, 0.5]}
    logs = read_releases(write_layer(tmp_path / "r.gpkg", PLACES, **columns), grid, DEFAULTS, feedback=said).logs
    assert logs.diameter.tolist() == [0.4, 0.5]
    assert logs.length.tolist() == [10.0, 12.0]
    assert logs.density.tolist() == [400.0, 500.0]
    trees = write_layer(tmp_path / "t.gpkg", PLACES, **{"dbh (mm)": [400, 500], "Höhe [ft]": [100.0, 120.0]})
    standing = read_trees(trees, grid, said).trees
    assert standing.diameter.tolist() == [0.4, 0.5]
    assert standing.height.tolist() == pytest.approx([30.48, 36.576])
    across = [LineString([(20, 50), (40, 50)])]
    fences, _ = read_barriers(write_layer(tmp_path / "b.gpkg", across, **{"Höhe (cm)": [250]}), grid, said)
    assert fences.height.tolist() == [2.5]
    lying, _ = read_lying_logs(write_layer(tmp_path / "l.gpkg", across, **{"BHD (mm)": [450]}), grid, 40.0, said)
    assert lying.diameter.tolist() == [0.45]
    assert not said.warnings
    assert any("'BHD [cm]' is read as dbh_cm" in note for note in said.notes)


def test_a_default_that_stands_for_a_field_not_understood_is_reported(tmp_path, said):
    grid = read_dem(write_dem(tmp_path / "dem.tif"))
    path = write_layer(tmp_path / "r.gpkg", PLACES, bhd=[40.0, 50.0], umfang=[126.0, 157.0])
    read_releases(path, grid, DEFAULTS, feedback=said)
    assert "the field 'bhd' is not used; rename it to dbh_cm if that is what it holds" in said.warnings[0]
    assert "bhd, umfang are not used; the options supply what is missing: dbh_cm 75, length_m 30" in said.notes[0]


def test_two_fields_for_one_size_are_reported(tmp_path, said):
    grid = read_dem(write_dem(tmp_path / "dem.tif"))
    path = write_layer(tmp_path / "r.gpkg", PLACES, **{"dbh_cm": [40.0, 50.0], "dbh (mm)": [410.0, 510.0]})
    logs = read_releases(path, grid, DEFAULTS, feedback=said).logs
    assert logs.diameter.tolist() == [0.4, 0.5]
    assert "the field 'dbh (mm)' is not used beside 'dbh_cm'" in said.warnings[0]


def test_mapped_deadwood_and_stands(tmp_path, said):
    dem = write_dem(tmp_path / "dem.tif")
    wood = tmp_path / "wood.csv"
    wood.write_text("BHD [mm];Höhe (m)\n300;20\n")
    areas = write_layer(tmp_path / "a.gpkg", points((30, 80)))
    given = {"dem": dem, "areas": areas, "deadwood": str(wood), "radius_m": 2.0, "count": 3}
    sample_releases.TOOL(feedback=said, output=str(tmp_path / "r.gpkg"), **given)
    logs = gpd.read_file(tmp_path / "r.gpkg", layer="releases")
    assert logs["dbh_cm"].tolist() == [30.0] * 3
    assert logs["length_m"].tolist() == [20.0] * 3

    stand = write_layer(
        tmp_path / "s.gpkg", [box(5, 5, 55, 95)], stems_per_ha=[400], **{"dbh_mean (mm)": [300.0], "dbh_sd (mm)": [0.0]}
    )
    generate_forest.TOOL(feedback=said, dem=dem, stand=stand, output=str(tmp_path / "f.gpkg"))
    assert np.unique(gpd.read_file(tmp_path / "f.gpkg", layer="trees")["dbh_cm"]).tolist() == [30.0]
    twice = write_layer(tmp_path / "p.gpkg", [box(5, 5, 55, 95)], stems_per_ha=[400], trees_density=[300])
    with pytest.raises(UserError, match="'stems_per_ha' and 'trees_density' both hold stems_per_ha; delete one"):
        generate_forest.TOOL(dem=dem, stand=twice, dbh_mean_cm=30.0, dbh_sd_cm=3.0, output=str(tmp_path / "g.gpkg"))
