"""Release positions: uniform by area, inside, independent of the number of logs, and the layer as documented."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Point, Polygon, box

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.prepare.releases.places import positions
from deadwood_algorithms.tools.sample_releases import TOOL

EAST, NORTH = 2_783_000.0, 1_190_000.0
MIDDLE = Point(EAST + 100, NORTH + 80)
RING = Polygon(
    [(EAST + x, NORTH + y) for x, y in [(40, 40), (120, 40), (120, 120), (40, 120)]],
    [[(EAST + x, NORTH + y) for x, y in [(60, 60), (100, 60), (100, 100), (60, 100)]]],
)


def areas(tmp_path, shapes, name="areas.gpkg", crs="EPSG:2056", **columns) -> str:
    gpd.GeoDataFrame(columns, geometry=list(shapes), crs=crs).to_file(tmp_path / name)
    return str(tmp_path / name)


def in_rings_and_sectors(x, y, radius):
    """Counts in 5 rings of equal area times 8 sectors."""
    ring = np.minimum((x**2 + y**2) / radius**2 * 5, 4).astype(int)
    sector = ((np.arctan2(y, x) + np.pi) / (2 * np.pi) * 8).astype(int) % 8
    return np.bincount(ring * 8 + sector, minlength=40)


def test_a_circle_is_filled_uniformly_by_area(chi_square_excess):
    n, radius = 20_000, 10.0
    x, y = (positions(MIDDLE, radius, 7, np.arange(n), "") - [MIDDLE.x, MIDDLE.y]).T
    assert np.hypot(x, y).max() <= radius
    even = np.full(40, 1 / 40)
    assert chi_square_excess(in_rings_and_sectors(x, y, radius), even) < 1
    # The test can fail: the usual mistake, uniform in the radius, fails it by far.
    rng = np.random.default_rng(1)
    r, angle = radius * rng.random(n), 2 * np.pi * rng.random(n)
    assert chi_square_excess(in_rings_and_sectors(r * np.cos(angle), r * np.sin(angle), radius), even) > 50


@pytest.mark.parametrize(
    "area",
    [
        RING,
        MultiPolygon([shapely.box(0, 0, 30, 10), shapely.box(50, 50, 60, 100)]),
        Polygon([(0, 0), (100, 0), (0, 40)]),
    ],
)
def test_polygons_are_filled_uniformly_by_area_and_their_holes_left_out(area, chi_square_excess):
    place = positions(area, 10.0, 7, np.arange(20_000), "")
    assert shapely.contains_xy(area, *place.T).all()
    west, south, east, north = area.bounds
    edges_x, edges_y = np.linspace(west, east, 7), np.linspace(south, north, 7)
    cells = [shapely.box(edges_x[i], edges_y[j], edges_x[i + 1], edges_y[j + 1]) for i in range(6) for j in range(6)]
    shares = shapely.area(shapely.intersection(cells, area)) / area.area
    counts = np.histogram2d(*place.T, bins=(edges_x, edges_y))[0].ravel()
    assert counts[shares == 0].sum() == 0
    assert chi_square_excess(counts[shares > 0], shares[shares > 0]) < 1


def test_a_log_keeps_its_place_and_area_when_the_number_grows(tmp_path, sample):
    layer = areas(tmp_path, [MIDDLE, RING, Point(EAST + 50, NORTH + 30)])
    few, many = sample(layer, count=20), sample(layer, count=50)
    assert (len(few), len(many)) == (60, 150)
    assert many.iloc[:60].equals(few)
    assert few["log_id"].tolist() == list(range(1, 61))
    assert few["release_id"].value_counts().to_dict() == {1: 20, 2: 20, 3: 20}


def test_the_same_seed_gives_the_same_file_and_another_seed_other_places(tmp_path, sample):
    layer = areas(tmp_path, [MIDDLE])
    sample(layer, count=100, seed=3)
    first = (tmp_path / "releases.gpkg").read_bytes()
    one = sample(layer, count=100, seed=3)
    assert (tmp_path / "releases.gpkg").read_bytes() == first
    other = sample(layer, count=100, seed=4)
    assert not (one.geometry == other.geometry).any()


def test_the_layer_is_the_contracts(tmp_path, sample):
    frame = sample(areas(tmp_path, [MIDDLE]), count=5, dbh_cm=30.0, length_m=15.0, orientation="tilted", tilt_deg=10.0)
    assert list(frame)[:-1] == [column.name for column in schemas.RELEASES.columns]
    row = frame.iloc[0]
    assert (row["dbh_cm"], row["length_m"], row["density_kg_m3"], row["orientation"]) == (30, 15, 300, "tilted")
    assert frame.crs.to_epsg() == 2056
    assert (frame.geometry.geom_type == "Point").all()
    assert frame["log_id"].dtype == np.int64
    for column in schemas.RELEASES.columns:
        assert (
            schemas.value_fault(column, row[column.name].item() if column.kind == "int" else row[column.name]) is None
        )


def test_columns_of_the_areas_go_before_the_options(tmp_path, sample):
    layer = areas(
        tmp_path,
        [MIDDLE, RING],
        dbh_cm=[30.0, 75.0],
        azimuth_deg=[360.0, 90.0],
        orientation=["Lying", "upright"],
        event=["2019", "2022 b"],
    )
    frame = sample(layer, count=2, dbh_cm=50.0, length_m=15.0, release_id_field="event")
    assert frame["release_id"].tolist() == ["2019", "2022 b"] * 2
    assert frame["dbh_cm"].tolist() == [30, 75] * 2
    assert frame["azimuth_deg"].tolist() == [0, 90] * 2
    assert frame["orientation"].tolist() == ["lying", "upright"] * 2
    assert frame["length_m"].tolist() == [15] * 4


def test_shapefile_areas_keep_their_long_columns(tmp_path, sample):
    layer = areas(tmp_path, [MIDDLE], "areas.shp", density_kg=[450.0])
    assert sample(layer, count=2)["density_kg_m3"].tolist() == [450, 450]


def test_the_radius_is_in_metres_of_the_dem_whatever_the_crs_of_the_areas(tmp_path, sample):
    layer = areas(tmp_path, gpd.GeoSeries([MIDDLE], crs=2056).to_crs(4326), crs="EPSG:4326")
    distance = sample(layer, count=500).distance(MIDDLE)
    assert 9.5 < distance.max() < 10.01
    assert (sample(layer, count=3, radius_m=0.0).distance(MIDDLE) < 0.01).all()


def test_a_csv_of_points_will_do(tmp_path, sample):
    (tmp_path / "mapped.csv").write_text(f"release_id;x;y\nA;{MIDDLE.x};{MIDDLE.y}\n")
    assert sample(str(tmp_path / "mapped.csv"), count=3)["release_id"].tolist() == ["A"] * 3


def test_areas_off_the_dem_are_refused_with_row_and_number(tmp_path, sample):
    beyond = Point(EAST + 195, NORTH + 80)
    with pytest.raises(UserError, match=r"layer 'areas', row 2: \d+ of 100 release positions lie off the DEM"):
        sample(areas(tmp_path, [MIDDLE, beyond]), count=100)
    with pytest.raises(UserError, match="row 1: every release position lies off the DEM"):
        sample(areas(tmp_path, [Point(0, 0)]), count=100)
    assert not (tmp_path / "releases.gpkg").exists()


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((MIDDLE.y, MIDDLE.x), "x and y are exchanged"),
        ((MIDDLE.x - 2e6, MIDDLE.y - 1e6), "these are coordinates of EPSG:21781"),
        ((0.0, 0.0), "check the area's CRS"),
    ],
)
def test_areas_with_exchanged_axes_or_of_lv03_are_told_so(tmp_path, sample, place, words):
    with pytest.raises(UserError, match=f"every release position lies off the DEM .*{words}"):
        sample(areas(tmp_path, [Point(*place)]), count=10)


def test_nodata_is_off_the_dem(tmp_path, slope, sample):
    with pytest.raises(UserError, match=r"row 1: .* off the DEM or on its nodata"):
        sample(areas(tmp_path, [Point(EAST + 100, NORTH + 150)]), dem=slope("holed.tif", nodata_rows=5), count=100)


def test_wrong_ids_and_words_are_refused(tmp_path, sample):
    with pytest.raises(UserError, match=r"no field 'event' .*the fields are label"):
        sample(areas(tmp_path, [MIDDLE], label=["a"]), release_id_field="event")
    with pytest.raises(UserError, match="field 'orientation', row 1: 'sideways' is not one of upright, lying, tilted"):
        sample(areas(tmp_path, [MIDDLE], orientation=["sideways"]))


def test_a_dbh_in_metres_is_suspected(tmp_path, sample, said):
    sample(areas(tmp_path, [MIDDLE]), count=1, dbh_cm=0.75)
    assert "--dbh-cm: the median dbh_cm is 0.75 cm, which is too small; if these are metres" in said.warnings[0]


def test_an_interrupted_run_leaves_nothing(tmp_path, slope, said):
    said.cancelled = lambda: True
    ask = {"areas": areas(tmp_path, [MIDDLE]), "dem": slope(), "output": str(tmp_path / "releases.gpkg")}
    with pytest.raises(Cancelled):
        TOOL(TOOL.ask_from(ask), said)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["areas.gpkg", "dem.tif"]


@pytest.mark.parametrize(
    ("name", "hint"), [("windthrow_2020.gpkg", True), ("Windwurf.gpkg", True), ("areas.gpkg", False)]
)
def test_upright_logs_in_areas_of_lying_wood_are_questioned(tmp_path, sample, said, outcome, name, hint):
    layer = areas(tmp_path, [RING], name=name)
    sample(layer, count=5)
    assert any("--orientation random-lying releases it lying" in each for each in said.warnings) is hint
    assert outcome["last"].lines[-1] == "posture at the start: all upright"
    said.warnings.clear()
    sample(layer, count=5, orientation="random-lying")
    assert not any("--orientation" in each for each in said.warnings)
    assert outcome["last"].lines[-1] == "posture at the start: all lying"


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"release_id": ["Windwurf Nord"]}, "but 'Windwurf Nord' in the field 'release_id' suggests lying wood"),
        ({"chablis": [1]}, "but the field 'chablis' suggests lying wood"),
        ({"Zustand": ["liegend tot"]}, "but 'liegend tot' in the field 'Zustand' suggests lying wood"),
        ({"release_id": ["Bestand Nord"], "Zustand": ["stehend tot"]}, None),
        ({"release_id": ["Windwurf Nord"], "orientation": ["upright"]}, None),  # given by the layer itself
    ],
)
def test_columns_that_tell_of_lying_wood_bring_the_same_question(tmp_path, sample, said, columns, words):
    sample(areas(tmp_path, [RING], **columns), count=5)
    told = [each for each in said.warnings if "suggests lying wood" in each]
    assert [words in each for each in told] == ([True] if words else [])


def test_mapped_deadwood_that_lies_brings_it_too(tmp_path, sample, said):
    (tmp_path / "wood.csv").write_text("dbh_cm,length_m,Lage\n40,20,am Boden liegend\n50,25,stehend\n")
    sample(areas(tmp_path, [RING]), count=5, deadwood=str(tmp_path / "wood.csv"))
    assert any("'am Boden liegend' in the field 'Lage' suggests lying wood" in each for each in said.warnings)


def test_names_that_are_not_taken_are_said(tmp_path, sample, said):
    """As for lines: before, areas with a field of names were silently called 1 and 2."""
    layer = areas(tmp_path, [RING], Ort=["Hinterberg"])
    sample(layer, count=5)
    assert any("the areas are named by their rows, 1 to 1; --release-id-field 'Ort'" in each for each in said.notes)
    said.notes.clear()
    sample(layer, count=5, release_id_field="Ort", overwrite=True)
    assert not any("named by their rows" in each for each in said.notes)


def test_a_field_called_name_names_the_areas(tmp_path, sample, said):
    frame = sample(areas(tmp_path, [RING], Name=["Hinterberg"]), count=5)
    assert set(frame["release_id"]) == {"Hinterberg"}
    assert not any("named by their rows" in each for each in said.notes)


def test_that_a_small_area_counts_like_a_large_one_is_said(tmp_path, sample, said):
    both = areas(tmp_path, [RING, box(EAST + 130, NORTH + 40, EAST + 145, NORTH + 55)])
    sample(both, count=5)
    (told,) = [each for each in said.notes if "every area counts the same" in each]
    assert told.startswith("the areas have 225 to 4800 m2 and get the same number of logs each")
    said.notes.clear()
    sample(both, logs_per_ha=300.0, overwrite=True)
    sample(areas(tmp_path, [RING, RING], name="alike.gpkg"), count=5, overwrite=True)
    assert not any("every area counts the same" in each for each in said.notes)
