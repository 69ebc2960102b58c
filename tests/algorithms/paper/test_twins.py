"""The paper's twins are what their tables say, before anything slides on them."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.paper import klosters, page, rothenbrunnen
from deadwood_algorithms.paper.twin import Twin


@pytest.fixture(scope="module")
def k() -> Twin:
    return klosters.klosters()


@pytest.fixture(scope="module")
def r() -> Twin:
    return rothenbrunnen.rothenbrunnen()


def slope_deg(twin: Twin, low: float, high: float) -> float:
    """Mean slope between two v."""
    v = (np.arange(twin.dem.shape[0]) + 0.5) * twin.dem.cell
    rows = (v > low) & (v < high)
    return float(np.degrees(np.arctan(np.polyfit(v[rows], twin.dem.values.mean(axis=1)[rows], 1)[0])))


def height_at(twin: Twin, places) -> np.ndarray:
    return twin.dem.height(places.x.to_numpy(), places.y.to_numpy())


@pytest.mark.parametrize("name", ["k", "r"])
def test_everything_lies_on_the_terrain(name, request):
    twin = request.getfixturevalue(name)
    assert np.isfinite(twin.dem.values).all()
    assert twin.dem.cell == 0.5
    assert twin.dem.values.size < 1_500_000
    for layer in twin.layers.values():
        shapes = layer.geometry if set(layer.geom_type) != {"Polygon"} else layer.geometry.centroid
        for shape in shapes:
            assert twin.dem.contains(*np.array(shape.coords.xy)).all()
    for release in twin.layers["releases"].geometry:
        assert twin.dem.contains(*np.array(release.buffer(40.0).exterior.xy)).all()


def test_klosters_has_the_papers_heights_and_slope(k):
    assert slope_deg(k, 120.0, 515.0) == pytest.approx(35.0, abs=1.5)
    v = (np.arange(k.dem.shape[0]) + 0.5) * 0.5
    road = k.dem.values[np.abs(v - 80.0) < 3.0]
    assert road.mean() == pytest.approx(1050.0, abs=0.05)
    assert road.std() < 0.1
    assert k.dem.values[-1].min() > 1300.0


def test_event_1_slid_about_120_m_and_the_others_farther(k):
    points = k.layers["releases"].geometry
    road = k.layers["lines"].geometry[0]
    plan = points.distance(road).to_numpy()
    path = np.hypot(plan, height_at(k, points) - 1050.0)
    assert path[0] == pytest.approx(120.0, abs=6.0)
    assert (np.diff(path) > 30.0).all()
    assert (height_at(k, points) < 1300.0).all()


@pytest.mark.parametrize(("name", "stems", "mean", "sd"), [("k", 300.0, 60.23, 18.64), ("r", 315.0, 44.0, 22.0)])
def test_the_forests_have_the_papers_density_and_diameters(name, stems, mean, sd, request):
    twin = request.getfixturevalue(name)
    trees, area = twin.layers["trees"], twin.layers["forest"].area.sum() / 1e4
    assert len(trees) / area == pytest.approx(stems, rel=0.002)
    # Draws below 1 cm are drawn again: of N(44, 22) that is one in forty, which moves the mean by 1.1 cm.
    assert trees["dbh_cm"].mean() == pytest.approx(mean, abs=2.5)
    assert trees["dbh_cm"].std() == pytest.approx(sd, abs=2.5)
    assert trees["dbh_cm"].min() >= 1.0
    x, y = trees.geometry.x.to_numpy(), trees.geometry.y.to_numpy()
    for row in range(0, len(trees), 97):
        distance = np.hypot(x - x[row], y - y[row])
        assert np.sort(distance)[1] > 1.97


def test_klosters_gullies_are_channels_without_trees(k):
    trees = k.layers["trees"].geometry
    u, v = trees.x - klosters.FRAME.east, trees.y - klosters.FRAME.north
    rows = (np.arange(k.dem.shape[0]) + 0.5) * 0.5
    steep = (rows > 125.0) & (rows < 500.0)
    for bed, at in zip(klosters.gully_beds(v), klosters.gully_beds(rows), strict=True):
        assert np.abs(u - bed).min() > 8.98
        middle, west, east = (
            np.array([k.dem.values[j, round((a + off) / 0.5)] for j, a in enumerate(at) if steep[j]])
            for off in (0.0, -18.0, 18.0)
        )
        assert (0.5 * (west + east) - middle).mean() > 0.6


def test_klosters_cliff_bands_are_steep(k):
    dz = np.diff(k.dem.values, axis=0) / 0.5
    v = np.arange(1, k.dem.shape[0]) * 0.5
    for foot in klosters.K["cliff_v_m"]:
        band = (v > foot - 3.0) & (v < foot + 8.0)
        assert np.degrees(np.arctan(dz[band].max(axis=0))).mean() > 55.0


def test_klosters_protection_stands_between_releases_and_road(k):
    assert len(k.layers["barriers"]) == 6
    assert len(k.layers["dams"]) == 2
    assert k.layers["barriers"].length.sum() == pytest.approx(400.0, abs=5.0)
    road = k.layers["lines"].total_bounds[3]
    lowest = k.layers["releases"].total_bounds[1]
    for name in ("barriers", "dams"):
        _, south, _, north = k.layers[name].total_bounds
        assert road < south
        assert north < lowest - 20.0


def test_rothenbrunnen_has_the_papers_heights_and_slope(r):
    assert 35.0 < slope_deg(r, 130.0, 390.0) < 40.0
    v = (np.arange(r.dem.shape[0]) + 0.5) * 0.5
    assert r.dem.values[(v > 60.5) & (v < 66.5)].mean() == pytest.approx(600.0, abs=0.05)
    assert height_at(r, r.layers["releases"].geometry)[0] - 600.0 == pytest.approx(200.0, abs=5.0)
    assert rothenbrunnen.K["gullies"] == 0


def test_rothenbrunnens_terrace_lies_20_m_above_its_barrier(r):
    flight = np.array(r.layers["flight"].geometry[0].coords)
    barrier = r.layers["barriers"].set_index("barrier_id").geometry["south"]
    assert flight[0, 1] - barrier.bounds[1] == pytest.approx(20.0)
    assert r.layers["barriers"]["height_m"].unique() == [3.5]
    x, y = flight[0]
    over = np.array([y + 5.5, y + 0.5, y - 3.0])
    z = r.dem.height(np.full(3, x), over)
    bench, edge = np.degrees(np.arctan(-np.diff(z) / np.array([5.0, 3.5])))
    assert bench < 25.0
    assert edge > 38.0
    _, south, _, north = barrier.bounds
    assert r.layers["lines"].set_index("line_id").geometry["road"].bounds[3] < south
    assert north < y


def test_the_page_of_numbers_is_fresh():
    said = "run: python -m deadwood_algorithms.paper.page"
    assert page.PLACE.read_text(encoding="utf-8") == page.page(), said
