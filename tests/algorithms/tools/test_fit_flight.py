"""fit-flight, through its files: the textbook parabola, the log swept along it, and impossible flights."""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from scipy.integrate import solve_ivp
from shapely import LineString, Point

from deadwood_algorithms.evaluate.flights.parabola import GRAVITY_MS2, Flight, outline
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import fit_flight

ROOT = Path(__file__).parents[3]
EAST, NORTH, CELL = 2_752_000.0, 1_180_000.0, 0.5
NX, NY = 240, 240
MIDDLE = (60.25, 100.25)  # of the take-off, a cell's centre [m from the corner]


def write_dem(path: Path, profile, towards: float = 180.0, **facts) -> str:
    """A DEM whose height depends on the distance from MIDDLE towards an azimuth alone: ``profile(s)`` [m]."""
    x, y = (np.arange(NX) + 0.5) * CELL - MIDDLE[0], (np.arange(NY)[::-1, None] + 0.5) * CELL - MIDDLE[1]
    s = np.round(x * math.sin(math.radians(towards)) + y * math.cos(math.radians(towards)), 9)
    known = {"driver": "GTiff", "dtype": "float64", "count": 1, "nodata": -9999, "crs": "EPSG:2056"}
    known |= {"height": NY, "width": NX, "transform": from_origin(EAST, NORTH + NY * CELL, CELL, CELL)}
    with rasterio.open(path, "w", **(known | facts)) as made:
        made.write(1000.0 + np.broadcast_to(profile(s), (NY, NX)), 1)
    return str(path)


def at(s: float, towards: float = 180.0, aside: float = 0.0) -> tuple[float, float]:
    """Position at a distance in the direction of an azimuth, and to the left of it [m]."""
    u = np.array([math.sin(math.radians(towards)), math.cos(math.radians(towards))])
    x, y = np.array(MIDDLE) + s * u + aside * np.array([-u[1], u[0]])
    return EAST + float(x), NORTH + float(y)


def write_layer(path: Path, shapes, crs: str | None = "EPSG:2056", **columns) -> str:
    gpd.GeoDataFrame(columns, geometry=shapes, crs=crs).to_file(path, layer=path.stem, driver="GPKG")
    return str(path)


def wall(path: Path, *places: float, heights, towards: float = 180.0) -> str:
    lines = [LineString([at(s, towards, -5.0), at(s, towards, 5.0)]) for s in places]
    names = [f"b{k}" for k in range(len(places))]
    return write_layer(path, lines, barrier_id=names, height_m=list(heights))


def fitted(folder: Path, said=None, **values) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame | None]:
    values = {"output": str(folder / "out.gpkg"), "overwrite": True} | values
    fit_flight.TOOL(fit_flight.TOOL.ask_from(values), said)
    layers = [name for name, _ in pyogrio.list_layers(values["output"])]
    table = gpd.read_file(values["output"], layer="clearances") if "clearances" in layers else None
    return gpd.read_file(values["output"], layer="flights"), table


def path_of(speed: float, degrees: float, s: float) -> float:
    """Height of the textbook parabola."""
    angle = math.radians(degrees)
    return s * math.tan(angle) - GRAVITY_MS2 * s**2 / (2 * speed**2 * math.cos(angle) ** 2)


def terrace(speed: float, degrees: float, distance: float):
    """A straight approach at the angle, a drop, and ground that meets the parabola at the distance; a profile(s)."""
    landing = path_of(speed, degrees, distance)

    def profile(s):
        before = s * math.tan(math.radians(degrees))
        beyond = landing - (s - distance) * math.tan(math.radians(45.0))
        # a cliff of one cell, so that the surface between the cells equals this profile exactly where it is checked
        return np.where(s <= 0.0, before, np.where(s < distance, np.minimum(beyond, landing), beyond))

    return profile


FLIGHTS = [(24.0, -30.0, 40.0), (24.0, 0.0, 30.0), (15.0, 20.0, 25.0), (10.0, -45.0, 12.5)]


@pytest.mark.parametrize(("speed", "degrees", "distance"), FLIGHTS)
def test_a_flight_is_found_from_its_two_ends(tmp_path, speed, degrees, distance):
    dem = write_dem(tmp_path / "dem.tif", terrace(speed, degrees, distance))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(distance)])], flight_id=["jump"])
    flights, none = fitted(tmp_path, dem=dem, flights=lines, dbh_cm=30.0, length_m=15.0)
    row, angle = flights.iloc[0], math.radians(degrees)
    vx, vz = speed * math.cos(angle), speed * math.sin(angle)
    time = distance / vx
    assert none is None
    assert (row["flight_id"], row["verdict"], row["angle_from"]) == ("jump", "possible", "terrain")
    assert row["takeoff_deg"] == pytest.approx(degrees, abs=1e-6)
    assert row["takeoff_speed_ms"] == pytest.approx(speed, rel=1e-6)
    assert row["duration_s"] == pytest.approx(time, rel=1e-6)
    assert row["landing_speed_ms"] == pytest.approx(math.hypot(vx, vz - GRAVITY_MS2 * time), rel=1e-6)
    assert row["landing_deg"] == pytest.approx(math.degrees(math.atan2(vz - GRAVITY_MS2 * time, vx)), abs=1e-5)
    assert row["fall_m"] == pytest.approx(-path_of(speed, degrees, distance), abs=1e-6)
    up = max(vz, 0.0)
    assert row["apex_rise_m"] == pytest.approx(up**2 / (2 * GRAVITY_MS2), abs=1e-5)
    assert row["apex_distance_m"] == pytest.approx(vx * up / GRAVITY_MS2, abs=1e-4)
    # Energy is conserved: the speed at the end results from the height lost.
    assert row["landing_speed_ms"] ** 2 == pytest.approx(speed**2 + 2 * GRAVITY_MS2 * row["fall_m"], rel=1e-6)


@pytest.mark.parametrize("towards", [0.0, 37.0, 250.0])
def test_the_direction_makes_no_difference(tmp_path, towards):
    """Only planes, which are exact between cells in any direction: the approach is one, and determines the landing."""
    dem = write_dem(tmp_path / "dem.tif", lambda s: -0.4 * s, towards)
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0, towards), at(15.0, towards)])])
    slope = fitted(tmp_path, dem=dem, flights=lines)[0]["takeoff_deg"][0]
    assert slope == pytest.approx(-math.degrees(math.atan(0.4)), abs=1e-6)
    row = fitted(tmp_path, dem=dem, flights=lines, takeoff_deg=10.0)[0].iloc[0]
    angle = math.radians(10.0)
    expected = math.sqrt(GRAVITY_MS2 * 15.0**2 / (2 * math.cos(angle) ** 2 * (15.0 * math.tan(angle) + 0.4 * 15.0)))
    assert (row["flight_id"], row["angle_from"], row["verdict"]) == (1, "given", "possible")
    assert row["takeoff_speed_ms"] == pytest.approx(expected, rel=1e-9)


def test_the_written_path_is_the_one_of_the_equations_of_motion(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", terrace(24.0, -20.0, 40.0))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(40.0)])])
    row = fitted(tmp_path, dem=dem, flights=lines, dbh_cm=40.0)[0].iloc[0]
    path = shapely.get_coordinates(row.geometry, include_z=True)
    angle = math.radians(row["takeoff_deg"])
    start = [0.0, path[0, 2], row["takeoff_speed_ms"] * math.cos(angle), row["takeoff_speed_ms"] * math.sin(angle)]
    moved = solve_ivp(
        lambda _, state: [state[2], state[3], 0.0, -GRAVITY_MS2], (0, row["duration_s"]), start,
        t_eval=np.linspace(0, row["duration_s"], len(path)), rtol=1e-10, atol=1e-10,
    )  # fmt: skip
    assert at(0.0)[1] - path[:, 1] == pytest.approx(moved.y[0], abs=1e-6)
    assert path[:, 2] == pytest.approx(moved.y[1], abs=1e-6)
    # Half a DBH above the ground, perpendicular to it, so vertically divided by the cosine.
    assert path[0, 2] - 1000.0 == pytest.approx(0.2 / math.cos(math.radians(20.0)), abs=1e-9)


def test_the_underside_is_that_of_the_log_swept_along_its_path():
    """The lowest point of thousands of drawn logs over each place, by shapely."""
    flight, radius, length = Flight(40.0, -18.0, 0.3), 0.6, 15.0
    boxes = [shapely.Polygon(outline(flight, s, length, radius)) for s in np.arange(-10.0, 50.0, 0.01)]
    for place in (5.0, 14.0, 20.0, 33.0):
        stroke = LineString([(place, -100.0), (place, 100.0)])
        lowest = min(shapely.bounds(cut)[1] for cut in shapely.intersection(boxes, stroke) if not cut.is_empty)
        found = float(flight.underside(place, radius))
        # The drawn logs come every centimetre: by the path's curvature of 0.07/m their least is high by 0.07 * 0.005^2
        assert found <= lowest + 1e-12
        assert found == pytest.approx(lowest, abs=2e-6)


@pytest.mark.parametrize(("height", "verdict"), [(3.5, "possible"), (9.0, "hits_barrier")])
def test_the_papers_jump_over_the_barrier(tmp_path, height, verdict):
    """24 m/s from a terrace 20 m above a barrier of 3.5 m, a log of 30 cm and 15 m (sections 2.2, 4 and 5.2)."""
    speed, degrees, distance, place = 24.0, -15.0, 45.0, 24.0

    def ground(s):
        # steep below the terrace: 20 m lower where the barrier stands
        below = np.where(s < place, -20.0 * np.maximum(s, 0.0) / place, -20.0)
        landing = path_of(speed, degrees, distance)
        beyond = -20.0 + (landing + 20.0) * (s - place) / (distance - place)
        return np.where(s <= 0, s * math.tan(math.radians(degrees)), np.where(s < place, below, beyond))

    dem = write_dem(tmp_path / "dem.tif", ground)
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(distance)])], flight_id=[7])
    bars = wall(tmp_path / "bars.gpkg", place, heights=[height])
    values = {"dem": dem, "flights": lines, "barriers": bars, "dbh_cm": 30.0, "length_m": 15.0}
    flights, clearances = fitted(tmp_path, **values)
    assert clearances is not None
    row, over = flights.iloc[0], clearances.iloc[0]
    assert row["takeoff_speed_ms"] == pytest.approx(24.0, rel=1e-6)
    assert row["verdict"] == verdict
    assert (over["flight_id"], over["barrier_id"], over["height_m"], over["free"]) == (7, "b0", height, 1)
    assert over["distance_m"] == pytest.approx(place, abs=1e-6)
    # The tangent of the path at the barrier, half a DBH lower perpendicular to it: 3 mm from the envelope of tangents.
    slope = math.tan(math.radians(degrees)) - GRAVITY_MS2 * place / (speed * math.cos(math.radians(degrees))) ** 2
    path = path_of(speed, degrees, place) + 0.15 / math.cos(math.radians(degrees))
    assert over["clearance_m"] == pytest.approx(path - 0.15 * math.hypot(1, slope) - (-20.0 + height), abs=0.003)
    assert over["clearance_m"] == row["clearance_min_m"]
    top = over.geometry
    assert (top.x, top.y, top.z) == pytest.approx((*at(place), 1000.0 - 20.0 + height), abs=1e-6)
    assert over["speed_ms"] == pytest.approx(math.hypot(1, slope) * speed * math.cos(math.radians(degrees)), rel=1e-6)


def test_every_barrier_that_is_crossed_is_reported_and_no_other(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", terrace(24.0, 0.0, 40.0))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(40.0)])], length_m=[12.0])
    beside = LineString([at(20.0, aside=3.0), at(20.0, aside=9.0)])
    twice = LineString([at(30.0, aside=-2.0), at(30.0, aside=2.0), at(35.0, aside=2.0), at(36.0, aside=-2.0)])
    near = LineString([at(2.0, aside=-2.0), at(2.0, aside=2.0)])
    bars = write_layer(
        tmp_path / "bars.gpkg", [twice, beside, near], barrier_id=["twice", "beside", "near"], height_m=[1.0, 1.0, 1.0]
    )
    clearances = fitted(tmp_path, dem=dem, flights=lines, barriers=bars)[1]
    assert clearances is not None
    assert clearances["barrier_id"].tolist() == ["near", "twice", "twice"]
    assert clearances["distance_m"].to_numpy() == pytest.approx([2.0, 30.0, 35.5], abs=1e-6)
    assert clearances["free"].tolist() == [0, 1, 0]
    far = wall(tmp_path / "far.gpkg", 80.0, heights=[2.0])
    flights, none = fitted(tmp_path, dem=dem, flights=lines, barriers=far)
    assert none is None
    assert np.isnan(flights["clearance_min_m"][0])


def test_no_speed_leads_to_a_landing_above_the_launch_line(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", lambda s: np.where(s <= 0.0, -0.7 * s, -0.3 * s))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(30.0)])] * 2, takeoff_deg=[None, -16.0])
    plots = tmp_path / "plots"
    flights, _ = fitted(tmp_path, dem=dem, flights=lines, plots=str(plots))
    assert flights["verdict"].tolist() == ["above_launch_line", "possible"]
    row = flights.iloc[0]
    assert row[["takeoff_speed_ms", "duration_s", "apex_rise_m", "landing_deg", "height_max_m"]].isna().all()
    assert row["takeoff_deg"] == pytest.approx(-math.degrees(math.atan(0.7)), abs=1e-6)
    ends = shapely.get_coordinates(row.geometry, include_z=True)[[0, -1], :2]
    assert ends == pytest.approx(np.array([at(0.0), at(30.0)]))
    assert sorted(each.name for each in plots.iterdir()) == ["flight_1.png", "flight_2.png", "manifest.json"]


def test_a_slope_that_continues_is_not_a_take_off(tmp_path):
    """On one plane the launch line is the ground: the two ends and any between lie on it."""
    dem = write_dem(tmp_path / "dem.tif", lambda s: -0.7 * s)
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(30.0)])])
    speeds = fitted(tmp_path, dem=dem, flights=lines)[0]["takeoff_speed_ms"]
    # exactly on the line the speed is infinite; rounding may leave it merely huge
    assert np.isnan(speeds[0]) or speeds[0] > 1e4


@pytest.mark.parametrize(("hump", "verdict"), [(0.2, "possible"), (2.0, "cuts_terrain")])
def test_ground_that_stands_into_the_flight_is_found(tmp_path, hump, verdict):
    """A ridge of one row of cells whose top exceeds the parabola between the two points by this height."""
    speed, degrees, distance, place = 20.0, -10.0, 30.0, 18.0
    top, plain = path_of(speed, degrees, place) + hump, terrace(speed, degrees, distance)
    dem = write_dem(tmp_path / "dem.tif", lambda s: np.where(np.abs(s - place) < 1e-6, top, plain(s)))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(distance)])])
    row = fitted(tmp_path, dem=dem, flights=lines, dbh_cm=40.0)[0].iloc[0]
    assert row["verdict"] == verdict
    assert row["cut_m"] == pytest.approx(hump, abs=1e-6)


def test_the_height_over_the_terrain_is_that_of_the_centre_of_mass(tmp_path):
    dem = write_dem(tmp_path / "dem.tif", lambda s: np.where(s <= 0.0, 0.0, np.where(s < 20.0, -30.0, -12.0)))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(25.0)])])
    row = fitted(tmp_path, dem=dem, flights=lines, dbh_cm=100.0)[0].iloc[0]
    # deepest at the near edge of the pit, one cell on: the path has fallen by bend * 0.5^2 there
    assert row["height_max_m"] == pytest.approx(30.0 + 0.5 - 12.0 / 25.0**2 * 0.5**2, abs=1e-6)


def test_points_with_roles_are_flights_too(tmp_path, said):
    dem = write_dem(tmp_path / "dem.tif", terrace(24.0, -30.0, 40.0))
    shapes = [Point(at(40.0)), Point(at(0.0)), Point(at(0.0, aside=3.0)), Point(at(40.0, aside=3.0))]
    flights = write_layer(
        tmp_path / "flights.gpkg", shapes, flight_id=["a", "a", "b", "b"],
        role=["Landing", "take-off", "takeoff", "landing"], dbh_cm=[1.0, 20.0, 40.0, 1.0],
    )  # fmt: skip
    flights, _ = fitted(tmp_path, said, dem=dem, flights=flights)
    assert flights["flight_id"].tolist() == ["a", "b"]
    assert flights["takeoff_speed_ms"].to_numpy() == pytest.approx([24.0, 24.0], rel=1e-6)
    assert flights["dbh_cm"].tolist() == [20.0, 40.0]  # of the take-off's row
    two = write_layer(tmp_path / "two.gpkg", shapes[2:])
    assert fitted(tmp_path, dem=dem, flights=two)[0]["takeoff_speed_ms"][0] == pytest.approx(24.0, rel=1e-6)


BAD = {
    "off the DEM": (LineString([at(0.0), at(900.0)]), {}, {}, "row 1: the landing lies off the DEM or on its nodata"),
    "on nodata": (LineString([at(-17.0), at(0.0)]), {}, {}, "row 1: the take-off lies off the DEM"),
    "no terrain before": (
        LineString([at(-8.0), at(0.0)]), {}, {"slope_over_m": 20.0}, "on part of the 20 m before the take-off",
    ),
    "no length": (LineString([at(0.0), at(9.0), at(0.0)]), {}, {}, "row 1: take-off and landing are the same place"),
    "a polygon": (shapely.box(*at(9.0), *at(0.0, aside=5.0)), {}, {}, "row 1: a Polygon"),
    "one point": (Point(at(0.0)), {}, {}, "1 point needs a field 'role'"),
    "a lonely role": (Point(at(0.0)), {"role": ["takeoff"]}, {}, "flight '1' has 0 points of the role landing"),
    "a foreign role": (Point(at(0.0)), {"role": ["start"]}, {}, "field 'role', row 1: 'start' is neither"),
    "a bad DBH": (LineString([at(0.0), at(9.0)]), {"dbh_cm": [0.0]}, {}, "field 'dbh_cm', row 1: 0 is not"),
    "a steep angle": (LineString([at(0.0), at(9.0)]), {"takeoff_deg": [90.0]}, {}, "field 'takeoff_deg', row 1: 90"),
    "a steep option": (LineString([at(0.0), at(9.0)]), {}, {"takeoff_deg": -89.0}, "--takeoff-deg is -89 °"),
    "no height": (LineString([at(0.0), at(9.0)]), {}, {"barriers": {}}, "the field 'height_m' is missing"),
    "a low barrier": (
        LineString([at(0.0), at(9.0)]), {}, {"barriers": {"height_m": [-1.0]}}, "field 'height_m', row 1: -1 is not",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_reported_in_one_line_and_leaves_nothing(tmp_path, name):
    shape, columns, values, said_of_it = BAD[name]
    values = dict(values)
    dem = write_dem(
        tmp_path / "dem.tif", lambda s: np.where(s < -15.0, np.nan, -0.3 * s - 0.01 * np.maximum(s, 0) ** 2)
    )
    flights = write_layer(tmp_path / "flights.gpkg", [shape], **columns)
    if "barriers" in values:
        across = LineString([at(5.0, aside=-1.0), at(5.0, aside=1.0)])
        values["barriers"] = write_layer(tmp_path / "bars.gpkg", [across], **values["barriers"])
    before = sorted(tmp_path.iterdir())
    with pytest.raises(UserError) as raised:
        fitted(tmp_path, dem=dem, flights=flights, plots=str(tmp_path / "plots"), **values)
    assert said_of_it in str(raised.value)
    assert "\n" not in str(raised.value)
    assert sorted(tmp_path.iterdir()) == before


def test_lines_with_more_vertices_are_taken_by_their_ends(tmp_path, said):
    dem = write_dem(tmp_path / "dem.tif", terrace(24.0, -30.0, 40.0))
    lines = write_layer(tmp_path / "lines.gpkg", [LineString([at(0.0), at(20.0, aside=4.0), at(40.0)])])
    assert fitted(tmp_path, said, dem=dem, flights=lines)[0]["takeoff_speed_ms"][0] == pytest.approx(24.0, rel=1e-6)
    assert any("only the first and the last count" in note for note in said.notes)


def test_the_worked_example_runs(tmp_path):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    text = fit_flight.TOOL.description.replace("\\\n", " ")
    (line,) = [line for line in text.splitlines() if line.startswith("    deadwood-tool ")]
    command = [sys.executable, "-m", "deadwood_toolbox", *shlex.split(line)[1:]]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert "cliff: possible; take-off at 24" in ran.stdout
    assert (tmp_path / "profiles" / "flight_cliff.png").stat().st_size > 10_000
    again = [*command[:4], "--config", "profiles/manifest.json", "--overwrite"]
    assert subprocess.run(again, cwd=tmp_path, capture_output=True).returncode == 0
