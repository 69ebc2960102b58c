"""Results of single files are sealed: a change of any row, pixel or of the record is noticed, and nothing else is."""

from __future__ import annotations

import json
import random
import re
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from hand_run import Track, write_run

from deadwood_algorithms.files.embedded import embed, record_in
from deadwood_algorithms.files.identity import CHANGED, SAME, compared, of_input
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.identity import verify_inputs, writing
from deadwood_algorithms.tools import count_hits, make_report, map_intensity, slide_logs
from deadwood_toolbox.cli import run as command

TRACKS = [Track((10.0 + 3 * k, 90.0), (12.0 + 5 * k, 20.0 + k), speed=5.0 + k, release_id=k % 3) for k in range(8)]
ROAD = {"road": (shapely.LineString([(0, 40), (60, 43)]), [0, 1, 2, 4])}
DAMAGED, NOT_OURS = 3, 2
FLIPS = 54


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A run, and one result of each format that carries its record."""
    folder = tmp_path_factory.mktemp("sealed")
    write_run(folder / "run", TRACKS, lines=ROAD)
    run = str(folder / "run")
    lines = {
        "reached.gpkg": ["reach-lines", "--run", run, "--lines", f"{run}/run.gpkg|layername=reach"],
        "hits.tif": ["count-hits", "--run", run, "--energy", str(folder / "energy.tif")],
    }
    for name, line in lines.items():
        assert command([*line, "--output", str(folder / name), "--quiet"]) == 0
    (folder / "values.csv").write_text("line_id,energy_kj\nroad,12.5\n", encoding="utf-8")
    embed(folder / "values.csv", {"tool": "design-values", "run_id": "0123456789abcdef", "inputs": []})
    return folder


@pytest.fixture
def own(made, tmp_path) -> Path:
    shutil.copytree(made, tmp_path / "own")
    return tmp_path / "own"


def sql(path: Path, *lines: str) -> None:
    with sqlite3.connect(path) as db:
        for name in ("ST_IsEmpty", "ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY"):  # of the triggers of the index
            db.create_function(name, 1, lambda _: 1)
        for line in lines:
            db.execute(line)


def tripled(path: Path, band: int = 1) -> None:
    with rasterio.open(path, "r+") as target:
        target.write((3 * np.nan_to_num(target.read(band)) + 1).astype(target.dtypes[band - 1]), band)


def aux(path: Path, inside: str) -> None:
    text = f'<PAMDataset><PAMRasterBand band="1">{inside}</PAMRasterBand></PAMDataset>'
    path.with_name(path.name + ".aux.xml").write_text(text)


def mask_out(path: Path) -> None:
    with rasterio.open(path) as source:
        shape = source.shape
    profile = {"driver": "GTiff", "height": shape[0], "width": shape[1], "count": 1, "dtype": "uint8"}
    with rasterio.open(path.with_name(path.name + ".msk"), "w", **profile) as mask:
        mask.write(np.zeros((1, *shape), np.uint8))
        mask.update_tags(INTERNAL_MASK_FLAGS_1=2)


def without_seal(path: Path) -> None:
    with sqlite3.connect(path) as db:
        (text,) = db.execute("SELECT metadata FROM gpkg_metadata").fetchone()
        told = {key: value for key, value in json.loads(text).items() if key not in ("seal", "content")}
        db.execute("UPDATE gpkg_metadata SET metadata = ?", (json.dumps(told),))


STATISTICS = '<Metadata><MDI key="STATISTICS_MAXIMUM">7</MDI><MDI key="STATISTICS_MEAN">1.5</MDI></Metadata>'
DAMAGES: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a number": ("reached.gpkg", lambda path: sql(path, "UPDATE reach SET n_reach = 1 WHERE fid = 1")),
    "a tiny number": ("reached.gpkg", lambda path: sql(path, "UPDATE reach SET p = p + 1e-12")),
    "a name": ("reached.gpkg", lambda path: sql(path, "UPDATE reach SET line_id = 'rail'")),
    "an integer for a real": ("reached.gpkg", lambda path: sql(path, "UPDATE arrivals SET log_id = log_id + 1")),
    "a row less": ("reached.gpkg", lambda path: sql(path, "DELETE FROM arrivals WHERE fid = 1")),
    "a column": ("reached.gpkg", lambda path: sql(path, "ALTER TABLE reach ADD COLUMN more REAL")),
    "another CRS": ("reached.gpkg", lambda path: sql(path, "UPDATE gpkg_geometry_columns SET srs_id = 4326")),
    "the record": (
        "reached.gpkg",
        lambda path: sql(path, "UPDATE gpkg_metadata SET metadata = replace(metadata, '20.0', '25.0')"),
    ),
    "no seal": ("reached.gpkg", without_seal),
    "pixels": ("hits.tif", tripled),
    "the second band": ("energy.tif", lambda path: tripled(path, 2)),
    "scale beside": ("hits.tif", lambda path: aux(path, "<Scale>100</Scale>")),
    "offset beside": ("hits.tif", lambda path: aux(path, "<Offset>2</Offset>")),
    "nodata beside": ("hits.tif", lambda path: aux(path, "<NoDataValue>1</NoDataValue>")),
    "a mask beside": ("hits.tif", mask_out),
    "a cell of a table": ("values.csv", lambda path: path.write_text(path.read_text("utf-8").replace("road", "rail"))),
}
HARMLESS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "nothing": ("reached.gpkg", lambda path: None),
    "a style in it": ("reached.gpkg", lambda path: sql(path, "UPDATE layer_styles SET styleQML = '<qgis/>'")),
    "a style beside": ("hits.tif", lambda path: path.with_suffix(".qml").write_text("<qgis/>")),
    "vacuum": ("reached.gpkg", lambda path: sqlite3.connect(path, isolation_level=None).execute("VACUUM")),
    "statistics beside": ("hits.tif", lambda path: aux(path, STATISTICS)),
    "nothing of a table": ("values.csv", lambda path: None),
    "nothing of several bands": ("energy.tif", lambda path: None),
}


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_change_is_noticed(own, kind, capsys):
    name, change = DAMAGES[kind]
    assert command(["check", str(own / name)]) == 0
    change(own / name)
    assert command(["check", str(own / name)]) == DAMAGED
    capsys.readouterr()


@pytest.mark.parametrize("kind", HARMLESS)
def test_what_is_not_read_changes_nothing(own, kind):
    name, change = HARMLESS[kind]
    before = of_input(str(own / name))
    change(own / name)
    assert command(["check", str(own / name)]) == 0
    assert compared({"path": str(own / name), **before})[0] == SAME


def decoded(path: Path):
    """All that another reader finds in a file; None if it cannot be read."""
    try:
        if path.suffix == ".tif":
            with rasterio.open(path) as source:
                return source.read().tobytes(), repr([source.transform, source.crs, source.nodata])
        if path.suffix == ".gpkg":
            names = ("reach", "arrivals", "attribution", "origins")
            frames = [gpd.read_file(path, layer=each) for each in names]
            return tuple(each.to_wkb().to_csv() + str(each.crs) for each in frames)
        return path.read_bytes()
    except Exception:
        return None


@pytest.mark.parametrize("name", ["reached.gpkg", "hits.tif", "energy.tif", "values.csv"])
def test_no_flipped_bit_that_another_reader_sees_passes(own, name):
    path, rng = own / name, random.Random(20261128)
    whole, raw = decoded(path), path.read_bytes()
    seen = passed = 0
    for _ in range(FLIPS):
        flipped = bytearray(raw)
        flipped[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
        path.write_bytes(flipped)
        differs = decoded(path) != whole
        seen += differs
        passed += differs and command(["check", str(path), "--quiet"]) == 0
    assert seen > 2
    assert passed == 0


def test_a_result_that_was_edited_is_not_read_as_one(own, said):
    """The energies of a map, and the layers of a report: refused; a layer that users edit: reported."""
    tripled(own / "energy.tif")
    with pytest.raises(UserError, match=re.escape(str(own / "energy.tif"))):
        verify_inputs(map_intensity.TOOL, asked(own, map_intensity, energy_raster=own / "energy.tif"), said)
    sql(own / "reached.gpkg", *DAMAGE)
    with pytest.raises(UserError, match=re.escape(str(own / "reached.gpkg"))):
        verify_inputs(make_report.TOOL, asked(own, make_report, results=own / "reached.gpkg"), said)
    assert not said.warnings
    lines = f"{own / 'reached.gpkg'}|layername=reach"
    verify_inputs(map_intensity.TOOL, asked(own, map_intensity, lines=lines), said)
    assert str(own / "reached.gpkg") in said.warnings[0]


DAMAGE = ("UPDATE reach SET n_reach = 1",)


def asked(folder: Path, tool, **values):
    runs = "runs" if tool is make_report else "run"
    values = {runs: str(folder / "run"), "output": str(folder / "out.html")} | {k: str(v) for k, v in values.items()}
    return tool.TOOL.ask_from(values)


@pytest.mark.parametrize("side", [99, 700])
def test_a_raster_is_sealed_whatever_its_layout(tmp_path, said, side):
    """Also one in the layout of a COG (from 512 x 512 cells), which the seal does not break."""
    rng = np.random.default_rng(side)
    tracks = [Track((5.0, 5.0), (40.0, side - 9.0 - k)) for k in range(3)]
    grid = {"nx": side, "ny": side, "cell": 1.0, "x0": 2783000.5, "y0": 1190000.5, "crs": "EPSG:2056"}
    write_run(tmp_path / "run", tracks, grid=grid)
    ask = count_hits.TOOL.ask_from({"run": str(tmp_path / "run"), "output": str(tmp_path / "hits.tif")})
    count_hits.TOOL(ask)
    with rasterio.open(tmp_path / "hits.tif") as source:
        assert (source.tags(ns="IMAGE_STRUCTURE").get("LAYOUT") == "COG") == (side > 512)
    assert command(["check", str(tmp_path / "hits.tif"), "--quiet"]) == 0
    raw = bytearray((tmp_path / "hits.tif").read_bytes())
    with rasterio.open(tmp_path / "hits.tif", "r+", IGNORE_COG_LAYOUT_BREAK="YES") as target:
        values = target.read(1)
        values[side - 3, int(rng.integers(side))] += 1
        target.write(values, 1)
    assert bytes(raw) != (tmp_path / "hits.tif").read_bytes()
    assert command(["check", str(tmp_path / "hits.tif"), "--quiet"]) == DAMAGED


# --- what is read of an input -----------------------------------------------------------------------------------------


def write_dem(path: Path, **profile) -> None:
    z = 1000.0 + np.add.outer(0.5 * np.arange(40.0), 0.25 * np.arange(30.0) ** 1.1)
    facts = {"driver": "GTiff", "count": 1, "dtype": "float32", "height": 40, "width": 30, "crs": "EPSG:2056"}
    facts |= {"transform": rasterio.transform.from_origin(2_783_000.0, 1_190_040.0, 1.0, 1.0), "nodata": -9999.0}
    with rasterio.open(path, "w", **(facts | profile)) as made:
        made.write(z.astype(np.float32), 1)


SIDES: dict[str, tuple[str, Callable[[Path], object], bool]] = {
    "scale": ("dem.tif", lambda path: aux(path, "<Scale>0.9</Scale>"), True),
    "offset": ("dem.tif", lambda path: aux(path, "<Offset>5</Offset>"), True),
    "nodata": ("dem.tif", lambda path: aux(path, "<NoDataValue>1000</NoDataValue>"), True),
    "unit": ("dem.tif", lambda path: aux(path, "<UnitType>ft</UnitType>"), True),
    "mask": ("dem.tif", mask_out, True),
    "CRS": ("dem.tif", lambda path: path.with_name("dem.tif.aux.xml").write_text(OTHER_CRS), True),
    "statistics": ("dem.tif", lambda path: aux(path, STATISTICS), False),
    "another compression": ("dem.tif", lambda path: write_dem(path, compress="deflate", tiled=True), False),
    "overviews": ("dem.tif", lambda path: overviews(path), False),
    "a scale of an ASCII grid": ("dem.asc", lambda path: aux(path, "<Scale>0.9</Scale>"), True),
    "statistics of an ASCII grid": ("dem.asc", lambda path: aux(path, STATISTICS), False),
    "a scale beside the source of a VRT": ("dem.vrt", lambda path: aux(path.with_name("dem.tif"), SCALE), False),
}
SCALE = "<Scale>0.9</Scale>"
OTHER_CRS = "<PAMDataset><SRS>EPSG:21781</SRS></PAMDataset>"


def overviews(path: Path) -> None:
    with rasterio.open(path, "r+") as target:
        target.build_overviews([2, 4])


@pytest.mark.parametrize("kind", SIDES)
def test_an_input_is_what_is_read_of_it(tmp_path, kind):
    name, change, differs = SIDES[kind]
    write_dem(tmp_path / "dem.tif")
    rasterio.shutil.copy(tmp_path / "dem.tif", tmp_path / "dem.asc", driver="AAIGrid", strict=False)
    rasterio.shutil.copy(tmp_path / "dem.tif", tmp_path / "dem.vrt", driver="VRT")
    for each in tmp_path.glob("*.aux.xml"):
        each.unlink()
    before = of_input(str(tmp_path / name))
    change(tmp_path / name)
    after = of_input(str(tmp_path / name))
    assert (after["content"] != before["content"]) == differs
    assert compared({"path": str(tmp_path / name), **before})[0] == (CHANGED if differs else SAME)


@pytest.mark.parametrize("beside", ["hit_count.tif.aux.xml", "hit_count.tif.msk"])
def test_nothing_beside_a_raster_of_a_run_changes_it_unseen(tmp_path, said, beside):
    ask = slide_logs.TOOL.ask_from({"dem": "none.tif", "releases": "none.gpkg", "friction": "0.3", "output": "out"})
    ask = type(ask)(**{**vars(ask), "output": str(tmp_path / "run")})
    with writing(slide_logs.TOOL, ask, said) as outputs:
        folder = outputs.folder()
        write_dem(folder / "hit_count.tif")
        write_vector(folder / "run.gpkg", {"reach": gpd.GeoDataFrame({"a": [1]}, geometry=[shapely.Point(1, 2)])})
        (folder / "hit_count.qml").write_text("<qgis/>")
    raster = tmp_path / "run" / "hit_count.tif"
    aux(raster, STATISTICS)
    (tmp_path / "run" / "hit_count.qml").write_text("<qgis>another</qgis>")
    assert facts_of(tmp_path / "run")["damaged"] == []
    aux(raster, "<Scale>100</Scale>") if beside.endswith("xml") else mask_out(raster)
    assert facts_of(tmp_path / "run")["damaged"] == ["hit_count.tif"]
    assert facts_of(raster)["damaged"] == ["hit_count.tif"]


def facts_of(path: Path) -> dict:
    from deadwood_algorithms.tools import check

    return dict(check.TOOL(check.Ask(path=str(path))).facts)["files"]


def test_a_page_is_not_made_of_a_run_whose_map_is_gone(tmp_path, slope):
    """Neither silently without the map, nor as if the file were damaged."""
    points = gpd.GeoDataFrame(geometry=gpd.points_from_xy([2_783_100.0], [1_190_100.0]), crs=2056)
    points.to_file(tmp_path / "releases.gpkg")
    values = {"dem": slope(), "releases": str(tmp_path / "releases.gpkg"), "fidelity": "draft", "time_limit_s": 1.0}
    slide_logs.TOOL(**values, friction="0.3", output=str(tmp_path / "run"))
    (tmp_path / "run" / "energy_max.tif").unlink()
    with pytest.raises(UserError, match=r"energy_max\.tif: the file is gone that slide-logs wrote"):
        make_report.TOOL(runs=str(tmp_path / "run"), output=str(tmp_path / "page.html"))
    assert not (tmp_path / "page.html").exists()
    assert command(["check", str(tmp_path / "run"), "--quiet"]) == DAMAGED


def test_a_folder_without_a_seal_is_not_called_whole(own, capsys):
    told = json.loads((own / "run" / "manifest.json").read_text()) | {"run_id": "0123456789abcdef"}
    (own / "run" / "manifest.json").write_text(json.dumps(told))
    for place in (own / "run", own / "run" / "manifest.json"):
        assert command(["check", str(place)]) == DAMAGED
    assert "unsealed" in capsys.readouterr().out
    assert record_in(own / "run" / "run.gpkg") is None
    assert command(["check", str(own / "run" / "run.gpkg")]) == NOT_OURS
