"""Files that are not what they look like: cells with formulas, virtual rasters, folders of results."""

from __future__ import annotations

import json
import re

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from deadwood_algorithms.files.identity import content_of
from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.files.rasters import open_raster
from deadwood_algorithms.files.tables import write_csv
from deadwood_algorithms.params.tool import UserError
from deadwood_toolbox import cli

SOURCE = "<SourceFilename>/vsicurl/http://example.org/a.tif</SourceFilename>"
VRT = f'<VRTDataset rasterXSize="2" rasterYSize="2"><VRTRasterBand band="1">{SOURCE}</VRTRasterBand></VRTDataset>'


def test_no_cell_of_a_table_is_calculated_by_a_spreadsheet(tmp_path):
    ids = ["=1+1", "+cmd|x", "-a", "@SUM(1)", "\t=1", "-5", "+1.5", "a=1", "", None]
    write_csv(tmp_path / "t.csv", pd.DataFrame({"id": ids, "value": np.arange(10.0) - 5.0}))
    read = pd.read_csv(tmp_path / "t.csv", dtype=str, keep_default_na=False)
    assert list(read["id"]) == ["'=1+1", "'+cmd|x", "'-a", "'@SUM(1)", "'\t=1", "-5", "+1.5", "a=1", "", ""]
    assert read["value"][0] == "-5.0"


@pytest.mark.parametrize("before", [" " * 200, "<!-- a -- b -->", "\n\n"])
def test_a_virtual_raster_that_cannot_be_looked_into_is_refused(tmp_path, before):
    (tmp_path / "a.vrt").write_text(before + VRT)
    with pytest.raises(UserError, match="points to the network|cannot be inspected"):
        open_raster(tmp_path / "a.vrt", "DEM")


def test_the_folder_of_a_result_is_no_folder_of_tiles(tmp_path):
    (tmp_path / "manifest.json").write_text(json.dumps({"tool": "slide-logs", "parameters": {}}))
    (tmp_path / "hit_count.tif").write_bytes(b"x")
    with pytest.raises(UserError, match="the folder of a result of slide-logs, not a terrain model"):
        tiles_of(tmp_path)


def test_a_field_needs_its_layer(capsys):
    line = ["assess-mobilisation", "--dem", "x.tif", "--output", "y.tif", "--stage-field", "stage"]
    assert cli.run(line) == 2
    assert "--stage-field names a field, but --deadwood" in capsys.readouterr().err


@pytest.mark.parametrize("damage", [b"\xbeREATE TABLE", b"CREATE \xbeABLE"])
def test_a_geopackage_with_damaged_names_has_no_content_and_raises_nothing(tmp_path, damage):
    """SQLite repeats the damaged bytes in its message, which is then no text; the hash of inputs ended with that."""
    path = tmp_path / "a.gpkg"
    place = gpd.GeoDataFrame({"n": [1]}, geometry=[shapely.Point(0, 0)], crs=2056)
    place.to_file(path, layer="trees")
    assert content_of(path) is not None
    whole = path.read_bytes()
    for at in [each.start() for each in re.finditer(b"CREATE TABLE", whole)]:
        path.write_bytes(whole[:at] + damage + whole[at + len(damage) :])
        assert content_of(path) is None
