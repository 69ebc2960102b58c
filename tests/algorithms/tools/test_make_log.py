"""make-log, through its files: the closed formulas of a truncated cone, and solids that other programs can read."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import ConvexHull

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import make_log
from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, Scene, Shape, slide

KLOSTERS = {"dbh_cm": 75.0, "length_m": 30.0, "density_kg_m3": 300.0}


def made(folder: Path, **values) -> Path:
    make_log.TOOL(output=str(folder), **(KLOSTERS | values))
    return folder


def facts(folder: Path) -> dict:
    return json.loads((folder / "log.json").read_text(encoding="utf-8"))


def read_obj(path: Path) -> np.ndarray:
    """Corners of the triangles, shape (n, 3, 3)."""
    words = [line.split() for line in path.read_text().splitlines()]
    points = np.array([w[1:] for w in words if w[0] == "v"], float)
    return points[np.array([w[1:] for w in words if w[0] == "f"], int) - 1]


def read_stl(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Normals and corners of the facets."""
    words = [line.split() for line in path.read_text().splitlines()]
    corners = np.array([w[1:] for w in words if w[0] == "vertex"], float).reshape(-1, 3, 3)
    return np.array([w[2:] for w in words if w[0] == "facet"], float), corners


def by_divergence(corners: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centre and second moments of a closed surface by the divergence theorem, with Gauss points a triangle.

    Independent of the tetrahedra in the code: flux of x/3, of x_i^2/2 e_i and of x_i^2 x_k/3-like fields through each
    facet, with a quadrature that is exact for polynomials of degree 3 and below.
    """
    bary = np.array([[1 / 3, 1 / 3, 1 / 3], [0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]])
    weight = np.array([-27 / 48, 25 / 48, 25 / 48, 25 / 48])
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    at = np.einsum("qb,nbi->nqi", bary, corners)
    volume = np.einsum("q,nqi,ni->", weight, at, area) / 3
    centre = np.einsum("q,nqi,ni->i", weight, at**2, area) / 2 / volume
    second = np.einsum("q,nqi,ni->i", weight, at**3, area) / 3
    return float(volume), centre, second


def test_the_cone_has_the_mass_properties_of_its_slices(tmp_path):
    cone = facts(made(tmp_path / "log", taper=0.4))["cone"]

    def radius(z):
        return 0.375 * (1 - 0.6 * z / 30)

    volume = quad(lambda z: math.pi * radius(z) ** 2, 0, 30)[0]
    centre = quad(lambda z: z * math.pi * radius(z) ** 2, 0, 30)[0] / volume
    axial = 300 * quad(lambda z: math.pi * radius(z) ** 4 / 2, 0, 30)[0]
    across = 300 * quad(lambda z: math.pi * (radius(z) ** 4 / 4 + (z - centre) ** 2 * radius(z) ** 2), 0, 30)[0]
    # Quadrature of a polynomial: only rounding errors.
    assert cone["volume_m3"] == pytest.approx(volume, rel=1e-12)
    assert cone["mass_kg"] == pytest.approx(300 * volume, rel=1e-12)
    assert cone["centre_from_base_m"] == pytest.approx(centre, rel=1e-12)
    assert cone["inertia_axial_kg_m2"] == pytest.approx(axial, rel=1e-12)
    assert cone["inertia_transverse_kg_m2"] == pytest.approx(across, rel=1e-12)


def test_a_cylinder_is_the_one_of_the_textbook(tmp_path):
    cone = facts(made(tmp_path / "log", dbh_cm=200.0, length_m=6.0, taper=1.0, density_kg_m3=1.0))["cone"]
    mass = math.pi * 6
    expected = {"volume_m3": mass, "mass_kg": mass, "centre_from_base_m": 3.0}
    expected |= {"inertia_axial_kg_m2": mass / 2, "inertia_transverse_kg_m2": mass * (3 + 36) / 12}
    assert cone == pytest.approx(expected, rel=1e-14)


def test_the_solid_approaches_the_cone_with_the_square_of_its_vertices(tmp_path):
    counts = (8, 16, 32, 64, 128)
    told = [facts(made(tmp_path / str(n), vertices=n)) for n in counts]
    for name in ("volume_m3", "mass_kg", "inertia_axial_kg_m2", "inertia_transverse_kg_m2"):
        error = np.array([1 - each["solid"][name] / each["cone"][name] for each in told])
        assert (error > 0).all()
        # error = c / n^2 - d / n^4: halving divides it by 4 less a rest, and the rest by 4 (less d / n^2 again)
        gap = 4.0 - error[:-1] / error[1:]
        assert 0 < gap[-1] < 0.01
        assert gap[:-1] / gap[1:] == pytest.approx(4.0, rel=0.05)
    # The regular polygon's area over the circle's, whatever the ring: exact, and the centre does not move.
    for n, each in zip(counts, told, strict=True):
        share = n / (2 * math.pi) * math.sin(2 * math.pi / n)
        assert each["solid"]["volume_m3"] / each["cone"]["volume_m3"] == pytest.approx(share, rel=1e-12)
        assert each["solid"]["centre_from_base_m"] == pytest.approx(each["cone"]["centre_from_base_m"], rel=1e-12)


def test_more_rings_are_the_same_solid(tmp_path):
    two, many = (facts(made(tmp_path / str(n), rings=n))["solid"] for n in (2, 31))
    assert (two.pop("vertices"), many.pop("vertices")) == (32, 16 * 31)
    assert (two.pop("triangles"), many.pop("triangles")) == (60, 16 * 31 * 2 - 4)
    assert many == pytest.approx(two, rel=1e-12)


def ring_heights(folder: Path) -> np.ndarray:
    points = np.loadtxt(folder / "log.pts")
    return np.unique(points[:, 2].round(6))


@pytest.mark.parametrize(
    ("asked", "spacing"),
    [
        ({}, 0.5),  # the convention
        ({"length_m": 15.2}, 15.2 / 31),  # evenly, and no farther apart than requested
        ({"length_m": 0.3, "dbh_cm": 10.0, "ring_spacing_m": 0.1}, 0.1),
        ({"ring_spacing_m": 40.0}, 30.0),  # the ends alone
        ({"rings": 31}, 1.0),
        ({"rings": 7, "ring_spacing_m": 0.1}, 5.0),  # a number overrides a distance
    ],
)
def test_rings_stand_as_far_apart_as_requested(tmp_path, asked, spacing):
    assert np.diff(ring_heights(made(tmp_path / "log", **asked))) == pytest.approx(spacing, abs=1e-5)


def test_a_spacing_that_makes_too_many_rings_is_refused(tmp_path):
    for length, spacing in ((30.0, 0.01), (30.0, 1e-8)):
        with pytest.raises(UserError, match="--ring-spacing-m .* makes more than 1000 rings on a log of 30 m"):
            made(tmp_path / "log", length_m=length, ring_spacing_m=spacing)
    assert not (tmp_path / "log").exists()


def test_a_ring_every_half_metre_keeps_a_log_on_rough_ground(tmp_path):
    """Point cloud and mesh come to rest; the ground between the vertices, measured against the surface of the mesh,
    penetrates the solid by decimetres with the end rings alone, and by centimetres with the default rings.
    """
    rng = np.random.default_rng(3)
    scene = Scene.prepare(rng.normal(0.0, 0.15, (81, 81)), 1.0, -40.0, -40.0, friction=0.5)
    places = np.linspace(-20.0, 20.0, 12)
    depth = {}
    for name, rings in (("ends", {"rings": 2}), ("convention", {})):
        folder = made(tmp_path / name, dbh_cm=40.0, length_m=15.0, **rings)
        shape = Shape.of(np.loadtxt(folder / "log.pts"))
        logs = Logs.alike(places, places[::-1] / 4.0, orientation=1, azimuth=0.3, drop=0.2)
        rested = slide(scene, logs, FIDELITIES["standard"], shape=shape, time_limit=30.0)
        assert set(rested.stop_reason) == {STOP_REASONS.index("rest")}
        # The solid has 16 sides: what is deeper than its inscribed cone is deeper than a facet, whichever way it lies
        share = np.cos(np.pi / 16) if name == "ends" else 1.0
        depth[name] = np.array([
            ground_in_cone(scene, *ends, 0.2 * share) for ends in zip(rested.base_end, rested.tip_end, strict=True)
        ])  # fmt: skip
    # Of twelve such scenes the medians are 0.23 to 0.35 and 0.01 to 0.03 m, the deepest of the second 0.10 m
    assert np.median(depth["ends"]) > 0.20
    assert np.median(depth["convention"]) < 0.05
    assert depth["convention"].max() < 0.15


def ground_in_cone(scene: Scene, base: np.ndarray, tip: np.ndarray, radius: float) -> float:
    """How deep [m] the ground stands in a cone of half the radius at its tip, over a dense grid of its surface."""
    axis = (tip - base) / np.linalg.norm(tip - base)
    across = np.linalg.svd(axis[None])[2][1:]
    along, turn = np.linspace(0.0, 1.0, 151)[:, None, None], np.linspace(0.0, 2 * np.pi, 64)[None, :, None]
    rim = radius * (1.0 - 0.5 * along) * (np.cos(turn) * across[0] + np.sin(turn) * across[1])
    x, y, z = (base + along * (tip - base) + rim).reshape(-1, 3).T
    return float((scene.terrain_height(x, y) - z).max())


@pytest.mark.parametrize("shape", [{}, {"vertices": 3, "rings": 2}, {"vertices": 7, "rings": 4, "taper": 1.0}])
def test_the_points_are_the_solid_with_its_centre_at_the_origin(tmp_path, shape):
    folder = made(tmp_path / "log", **shape)
    text = (folder / "log.pts").read_text()
    assert all(len(line.split()) == 3 for line in text.splitlines())
    points, solid = np.loadtxt(folder / "log.pts"), facts(folder)["solid"]
    assert len(points) == solid["vertices"]
    assert np.ptp(points[:, 2]) == pytest.approx(30.0, abs=1e-7)
    assert points[0, 2] == pytest.approx(-solid["centre_from_base_m"], abs=1e-7)
    # Nine digits in the file: 1e-8 m of 30 m, relative to a radius of 0.2 to 0.4 m.
    assert ConvexHull(points).volume == pytest.approx(solid["volume_m3"], rel=1e-6)
    radius = np.linalg.norm(points[:, :2], axis=1)
    taper = shape.get("taper", 0.5)
    along = (points[:, 2] + solid["centre_from_base_m"]) / 30.0
    assert radius == pytest.approx(0.375 * (1 - (1 - taper) * along), abs=1e-7)


@pytest.mark.parametrize("shape", [{}, {"vertices": 3, "rings": 2}, {"vertices": 7, "rings": 4, "taper": 1.0}])
def test_obj_and_stl_are_closed_outward_and_have_the_reported_mass(tmp_path, shape):
    folder = made(tmp_path / "log", **shape)
    solid = facts(folder)["solid"]
    normals, corners = read_stl(folder / "log.stl")
    assert np.array_equal(read_obj(folder / "log.obj"), corners)
    assert len(corners) == solid["triangles"]
    edges = Counter()
    for triangle in corners:
        for one, other in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            edges[tuple(one), tuple(other)] += 1
    # closed and oriented: each edge once in each direction
    assert set(edges.values()) == {1}
    assert {(b, a) for a, b in edges} == set(edges)
    # a convex solid about its centre: outward is away from the origin
    assert (np.einsum("ni,ni->n", normals, corners.mean(axis=1)) > 0).all()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-8)

    volume, centre, second = by_divergence(corners)
    assert volume == pytest.approx(solid["volume_m3"], rel=1e-7)
    assert centre == pytest.approx([0, 0, 0], abs=1e-6)
    across = 300 * (0.5 * (second[0] + second[1]) + second[2])
    assert 300 * (second[0] + second[1]) == pytest.approx(solid["inertia_axial_kg_m2"], rel=1e-6)
    assert across == pytest.approx(solid["inertia_transverse_kg_m2"], rel=1e-6)


def test_the_manifest_makes_the_same_log_again(tmp_path):
    folder = made(tmp_path / "log", vertices=9)
    command = [sys.executable, "-m", "deadwood_toolbox", "make-log", "--config", str(folder / "manifest.json")]
    ran = subprocess.run([*command, "--output", str(tmp_path / "again")], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert "kg m²" in ran.stdout
    for name in ("log.pts", "log.obj", "log.stl", "log.json"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes()


def test_the_worked_examples_run(tmp_path):
    lines = [
        line.split()[2:] for line in make_log.TOOL.description.splitlines() if line.startswith("    deadwood-tool")
    ]
    assert len(lines) == 3
    for words in lines:
        command = [sys.executable, "-m", "deadwood_toolbox", "make-log", *words]
        assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0
    masses = [facts(tmp_path / name)["cone"]["mass_kg"] for name in ("log_klosters", "log_rothenbrunnen")]
    # pi/12 * 1.75 * rho * D^2 * L
    assert masses == pytest.approx([math.pi / 12 * 1.75 * 300 * d**2 * h for d, h in ((0.75, 30), (0.3, 15))])


@pytest.mark.parametrize(
    ("values", "said_of_it"),
    [
        ({"dbh_cm": 0.0}, "--dbh-cm is 0 cm, but must be greater than 0 cm"),
        ({"length_m": -1.0}, "--length-m is -1 m"),
        ({"taper": 0.0}, "--taper is 0, but must be greater than 0"),
        ({"taper": 1.5}, "--taper is 1.5, but must be at most 1"),
        ({"density_kg_m3": math.nan}, "--density-kg-m3 is nan, but must be finite"),
        ({"vertices": 2}, "--vertices is 2, but must be at least 3"),
        ({"rings": 1}, "--rings is 1, but must be at least 2"),
    ],
)
def test_what_makes_no_log_is_refused(tmp_path, values, said_of_it):
    with pytest.raises(UserError, match=said_of_it):
        made(tmp_path / "log", **values)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_exists_stays(tmp_path):
    folder = made(tmp_path / "log")
    before = (folder / "log.pts").read_bytes()
    with pytest.raises(UserError, match="the output exists; --overwrite replaces it"):
        made(folder, vertices=8)
    assert (folder / "log.pts").read_bytes() == before
    made(folder, vertices=8, overwrite=True)
    assert (folder / "log.pts").read_bytes() != before


def test_a_slice_is_made_with_a_warning(tmp_path, said):
    make_log.TOOL(make_log.Ask(dbh_cm=75.0, length_m=0.5, output=str(tmp_path / "log")), said)
    assert "less than the DBH" in said.warnings[0]


# --- rocks ------------------------------------------------------------------------------------------------------------

ROCK = {"length_m": 0.5, "width_m": 0.3, "height_m": 0.2, "density_kg_m3": 2700.0}


def test_a_rock_has_the_corners_volume_and_inertia_of_the_norm_body(tmp_path):
    """17/24 of its box: the box less 12 prisms along the edges and 8 corners; the moments by Gauss points on the faces
    of its surface."""
    folder = made(tmp_path / "rock", **ROCK)
    told = facts(folder)
    points = np.loadtxt(folder / "log.pts")
    shares = np.sort(np.abs(points / (0.5, 0.3, 0.2)), axis=1)
    assert len(np.unique(points, axis=0)) == 24
    assert shares == pytest.approx(np.tile([0.25, 0.25, 0.5], (24, 1)))
    assert ConvexHull(points).volume == pytest.approx(17.0 / 24.0 * 0.5 * 0.3 * 0.2)
    assert told["rock"]["volume_m3"] == pytest.approx(17.0 / 24.0 * 0.5 * 0.3 * 0.2)
    assert told["rock"]["mass_kg"] == pytest.approx(2700.0 * 17.0 / 24.0 * 0.03)
    corners = read_stl(folder / "log.stl")[1]
    assert len(corners) == told["solid"]["triangles"]
    volume, centre, (xx, yy, zz) = by_divergence(corners)
    assert volume == pytest.approx(told["rock"]["volume_m3"], rel=1e-7)
    assert centre == pytest.approx([0, 0, 0], abs=1e-8)
    expected = {"length": yy + zz, "width": xx + zz, "height": xx + yy}
    for axis, second in expected.items():
        assert told["rock"][f"inertia_{axis}_kg_m2"] == pytest.approx(2700.0 * second, rel=1e-6)


def test_the_engine_takes_the_rock_as_it_is(tmp_path):
    """Its mass from the density and the points' hull, and so the energy of a fall: m g h."""
    told = facts(made(tmp_path / "rock", **ROCK))["rock"]
    shape = Shape.of(np.loadtxt(tmp_path / "rock" / "log.pts"))
    assert shape.volume == pytest.approx(told["volume_m3"], rel=1e-6)


def test_densities_differ_unless_one_is_given(tmp_path):
    rock = facts(made(tmp_path / "rock", **(ROCK | {"density_kg_m3": None})))["rock"]
    log = facts(made(tmp_path / "log", density_kg_m3=None))["cone"]
    assert rock["mass_kg"] / rock["volume_m3"] == pytest.approx(2650.0)
    assert log["mass_kg"] / log["volume_m3"] == pytest.approx(300.0)


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"height_m": None}, "--width-m is that of a rock, which needs --height-m, too"),
        ({"width_m": None}, "--height-m is that of a rock, which needs --width-m, too"),
        ({"length_m": 30.0}, "--length-m is 30 m, more than 10 times the rock's smaller side, 0.2 m"),
        ({"width_m": 0.0}, "--width-m is 0 m, but must be greater than 0 m"),
    ],
)
def test_what_makes_no_rock_is_refused(tmp_path, values, line):
    with pytest.raises(UserError, match=line):
        made(tmp_path / "rock", **(ROCK | values))
    assert not list(tmp_path.iterdir())
