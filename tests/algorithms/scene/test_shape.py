"""--shape through files: a cube with a known answer, rings of make-log beside the cone, and bad files one by one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
import shapely
from slope_case import RASTERS, Case, assert_same_run, layer, points, raster, summary, write_dem, write_layer

from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.run_folder import read_run
from deadwood_algorithms.scene.shape import longest_gap, read_points, read_shape
from deadwood_toolbox import cli

G = 9.81
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


def pts(path: Path, cloud: np.ndarray) -> str:
    np.savetxt(path, cloud, fmt="%.9g")
    return str(path)


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def cube(case) -> str:
    return pts(case.folder / "cube.pts", CORNERS + 7.0)


def test_a_cube_slides_as_a_cube_does(case, cube, tmp_path):
    """Lying on 35 degrees with mu = 0.5 its path is g (sin - mu cos) t^2 / 2; its mass is the density times 1 m3."""
    one = write_layer(tmp_path / "one.gpkg", points((30.25, 90.0)), orientation=["lying"], azimuth_deg=[180.0])
    run = case.run(
        releases=one, shape=cube, friction="0.5", density_kg_m3=2700.0, output=str(tmp_path / "run"), time_limit_s=3.0
    )
    deposit = layer(run, "deposits").iloc[0]
    fall = 0.5 * G * (np.sin(np.radians(35)) - 0.5 * np.cos(np.radians(35))) * deposit["duration_s"] ** 2
    assert deposit["path_m"] == pytest.approx(fall, rel=0.01)
    assert deposit["bearing_deg"] == pytest.approx(180.0, abs=0.1)
    assert deposit["energy_max_kj"] == pytest.approx(0.5 * 2.7 * deposit["speed_max_ms"] ** 2, rel=0.01)
    assert deposit["length_m"] == pytest.approx(1.0)
    assert deposit["dbh_cm"] == pytest.approx(100 * np.sqrt(2))
    told = summary(run)
    assert told["modelled"]["logs"].startswith("rigid convex bodies of 8 points, 1 m³")
    ends = parquet.read_table(run / "poses.parquet").to_pandas()
    span = ends[["xt", "yt", "zt"]].to_numpy() - ends[["xb", "yb", "zb"]].to_numpy()
    assert np.linalg.norm(span, axis=1) == pytest.approx(1.0)
    base, tip = read_run(str(run), feedback=Quiet()).radii()
    assert base == tip == pytest.approx(np.sqrt(0.5))


def test_rocks_among_trees_barriers_and_lying_logs(case, cube, tmp_path, said):
    """24 cubic metres of rock down the whole scene, on one and on four threads: the same bits; every rock ends."""
    lying = write_layer(tmp_path / "lying.gpkg", [shapely.LineString([(5, 38), (55, 38)])])
    logs = {"shape": cube, "density_kg_m3": 2700.0, "friction": "0.6", "lying_logs": lying}
    one = case.run(said, output=str(tmp_path / "one"), threads=1, **logs, **case.everything())
    assert_same_run(one, case.run(output=str(tmp_path / "four"), threads=4, **logs, **case.everything()))
    deposits = layer(one, "deposits")
    assert set(deposits["stop_reason"]) <= {"rest", "tree", "barrier", "lying_log", "left_dem"}
    assert (deposits["energy_error_rel"] < 0.01).all()
    assert deposits["tree_hits"].sum() + deposits["barrier_hits"].sum() > 0
    assert all(raster(one / f"{name}.tif").shape == (100, 60) for name in RASTERS)
    assert not said.warnings


def test_rings_of_make_log_go_about_as_far_as_the_cone(case, tmp_path):
    """A log of 32 vertices a ring, a ring a metre: the same case with the cone, means within chance."""
    log = tmp_path / "log"
    arguments = [
        "--dbh-cm",
        "40",
        "--length-m",
        "10",
        "--rings",
        "11",
        "--vertices",
        "32",
        "--output",
        str(log),
        "--quiet",
    ]
    assert cli.run(["make-log", *arguments]) == 0
    ways = {}
    for name, shape in (("cone", "cone"), ("rings", str(log / "log.pts"))):
        run = case.run(shape=shape, output=str(tmp_path / name), trees=case.trees, trajectories="none")
        ways[name] = layer(run, "deposits")
    cone, rings = ways["cone"], ways["rings"]
    assert rings["length_m"].to_numpy() == pytest.approx(10.0)
    assert rings["dbh_cm"].to_numpy() == pytest.approx(40.0, rel=1e-6)
    error = np.hypot(*(each["runout_m"].std() / np.sqrt(len(each)) for each in (cone, rings)))
    assert abs(cone["runout_m"].mean() - rings["runout_m"].mean()) < 3.0 * error


def test_another_shape_is_another_run(case, cube, tmp_path):
    """The points, not the name, decide whether a run may be resumed: they are in the digest of the scene."""
    runs = []
    for scale in (1.0, 1.1):
        path = pts(tmp_path / "rock.pts", scale * CORNERS)
        runs.append(case.run(shape=path, output=str(tmp_path / f"run_{scale}"), time_limit_s=0.5, trajectories="none"))
    digests = [json.loads((run / "manifest.json").read_text())["digests"]["scene"] for run in runs]
    assert digests[0] != digests[1]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("x y z\n0 0 0\n", "line 1: 'x y z' is not three numbers"),
        ("0 0 0\n1 0\n", "line 2: '1 0' is not three numbers"),
        ("0 0 0 7\n", "line 1: '0 0 0 7' is not three numbers"),
        ("0,5 1 2\n", "line 1: '0,5 1 2' is not three numbers"),
        ("0 0 nan\n", "line 1: '0 0 nan' is not three numbers"),
        ("0 0 0\n1 0 0\n0 1 0\n1 1 0\n", "no volume; give at least four points that span a body"),
        ("0 0 0\n1 0 0\n", "no volume"),
        ("\n\n", "no volume"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, content, message):
    path = tmp_path / "bad.pts"
    path.write_text(content)
    with pytest.raises(UserError, match=message) as error:
        read_shape(str(path), 1.0, Quiet())
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_a_missing_file_is_named(tmp_path, case, capsys):
    with pytest.raises(UserError, match="does not exist"):
        read_shape(str(tmp_path / "none.pts"), 1.0, Quiet())
    values = [f"--{name.replace('_', '-')}={value}" for name, value in case.values(shape="round").items()]
    assert cli.run(["slide-logs", *values]) == 2
    assert "round: the shape file does not exist" in capsys.readouterr().err


def test_what_is_odd_is_reported(tmp_path, said):
    assert read_shape("cone", 1.0, said) is None
    inside = np.vstack([CORNERS, [[0, 0, 0], [0.1, 0, 0]]])
    read_shape(pts(tmp_path / "a.pts", inside), 1.0, said)
    assert "2 of 10 points lie inside" in said.notes[-1]
    read_shape(pts(tmp_path / "b.pts", CORNERS * (1, 1, 6)), 0.5, said)
    assert "up to 6 m apart along an edge, the DEM's cells are 0.5 m" in said.notes[-1]
    read_shape(pts(tmp_path / "c.pts", CORNERS * 120), 1.0, said)
    assert "120 m long; the file must be in metres" in said.warnings[-1]
    for size in (1000.0, 1e-30):  # no log and no rock
        with pytest.raises(UserError, match=f"d.pts: the body is {size:g} m long, but must be 0.01 to 150 m"):
            read_shape(pts(tmp_path / "d.pts", CORNERS * size), 1.0, said)


def test_windows_line_ends_tabs_and_a_byte_order_mark_are_read(tmp_path):
    path = tmp_path / "a.pts"
    path.write_bytes(b"\xef\xbb\xbf0\t0 0\r\n1e0 0 0\r\n\r\n0 1 0\r\n 0 0 1\r\n")
    assert read_points(str(path)).tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    grid = np.array(np.meshgrid(*[np.linspace(0, 2, 5)] * 3)).reshape(3, -1).T
    shape = read_shape(pts(tmp_path / "grid.pts", grid), 1.0, Quiet())
    assert shape is not None
    assert longest_gap(shape) == pytest.approx(0.5)
    assert shape.inside == 27


def test_a_flat_dem_carries_a_cube(case, cube, tmp_path):
    """Upright it stands on its face and rests at once; the azimuth turns it."""
    flat = write_dem(tmp_path / "flat.tif", flat=True)
    one = write_layer(tmp_path / "one.gpkg", points((30.0, 50.0)))
    run = case.run(dem=flat, releases=one, shape=cube, output=str(tmp_path / "run"), azimuth_deg=30.0)
    deposit = layer(run, "deposits").iloc[0]
    assert deposit["stop_reason"] == "rest"
    assert deposit["path_m"] < 0.01
    assert deposit.geometry.z == pytest.approx(1000.5, abs=1e-3)
    assert deposit["tilt_deg"] == pytest.approx(0.0, abs=0.1)
