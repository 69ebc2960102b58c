"""What can be released: sizes of trees and rocks, finite numbers, tables of one length."""

import dataclasses

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Lines, Logs, Rasters, Scene, Shape, Start, place_logs, slide
from deadwood_engine.log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS


def scene(**parts) -> Scene:
    heights = 0.6 * np.arange(80)[:, None] + np.zeros(60)
    return Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3, **parts)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("diameter", 1000.0, "diameter of a log must be 0.001 to 15 m, and is 1000 in row 1"),
        ("diameter", 1e-4, "diameter"),
        ("diameter", np.nan, "diameter"),
        ("length", 1e9, "length of a log must be 0.01 to 150 m, and is 1e+09 in row 1"),
        ("length", np.inf, "length"),
        ("density", 0.3, "density of a log must be 1 to 25000 kg/m3, and is 0.3 in row 1"),
        ("density", 1e6, "density"),
        ("tilt", np.nan, "tilt of the log in row 1 is no finite number"),
        ("azimuth", np.inf, "azimuth"),
        ("speed", np.nan, "speed"),
        ("drop", -np.inf, "drop"),
        ("x", np.nan, "x of the log in row 1"),
    ],
)
def test_what_no_log_can_be_is_refused(field, value, words):
    logs = Logs.alike([20.0, 30.0], [40.0, 40.0])
    values = getattr(logs, field).astype(float)
    values[1] = value
    with pytest.raises(ValueError, match=words.replace("+", r"\+")):
        place_logs(scene(), dataclasses.replace(logs, **{field: values}))


def test_the_largest_and_the_smallest_slide():
    """The limits themselves are logs: none of them fails."""
    logs = Logs.alike([30.0] * 4, [40.0] * 4)
    logs = dataclasses.replace(
        logs,
        diameter=np.array([1e-3, 15.0, 0.4, 0.4]),
        length=np.array([4.0, 20.0, 1e-2, 30.0]),
        density=np.array([300.0, 300.0, 1.0, 25_000.0]),
    )
    result = slide(scene(), logs, FIDELITIES["standard"], time_limit=2.0)
    assert STOP_REASONS.index("failed") not in result.stop_reason


def test_shapes_of_no_size_are_refused():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    for size in (1e-30, 1e-4, 1e3, 1e200):
        with pytest.raises(ValueError, match="a body must be 0.001 to 150 m long"):
            Shape.of(size * corners)
    Shape.of(1e-3 * corners)
    Shape.of(150.0 * corners)


@pytest.mark.parametrize("column", [0, 2, 4, 7, 10])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [0, 20])
def test_a_pose_that_is_no_place_fails_alone(column, value, row):
    """A log without a finite pose ends as failed; it draws nothing, and what slides beside it is the same to the bit.

    Row 20 begins a window of the DEM: there the outline's row -2^63 became one beyond the raster's last.
    """
    heights = 0.6 * np.arange(80)[:, None] + np.zeros(60)
    road = Lines(np.array([[0.0, 30.0], [59.0, 30.0]]), np.array([0, 2]))
    window = Scene.prepare(heights[row:], 1.0, 0.0, 0.0, friction=0.3, lines=road, first=(0, row), reference=0.0)
    start = place_logs(window, Logs.alike([15.0, 30.0, 45.0], [60.0] * 3, length=8.0))
    alone = Start(*(np.delete(part, 1, axis=0) for part in (start.frame, start.state, start.body)))
    start.state[1, column] = value
    rasters, others = Rasters.allocate(window, 1), Rasters.allocate(window, 1)
    keep = np.ones(3, bool)
    result = slide(window, start, FIDELITIES["standard"], time_limit=3.0, rasters=rasters, keep_poses=keep)
    without = slide(window, alone, FIDELITIES["standard"], time_limit=3.0, rasters=others)
    assert STOP_REASONS[result.stop_reason[1]] == "failed"
    assert not result.reach[1].any()
    assert set(result.poses.log_row) == {0, 2}
    assert np.array_equal(result.last_state[[0, 2]], without.last_state)
    for name, total in rasters.totals().items():
        assert np.array_equal(total, others.totals()[name], equal_nan=True), name


def test_a_spin_that_is_no_number_fails_in_the_step_that_makes_it():
    """Velocities were looked at, spin was not: a log with a NaN axis flew on, drawing outlines, till the DEM's end."""
    start = place_logs(scene(), Logs.alike([30.0], [40.0], length=8.0, drop=5.0))
    start.state[0, 10] = 1e200  # its square overflows
    result = slide(scene(), start, FIDELITIES["standard"], time_limit=3.0)
    assert STOP_REASONS[result.stop_reason[0]] == "failed"
    assert result.steps[0] <= 1


def test_a_log_wider_than_its_dem_fails_and_harms_nothing():
    """No point of its base lies over terrain, so its height was -inf: one of 40 logs corrupted the heap."""
    place = scene()
    start = place_logs(place, Logs.alike(20.0 + np.arange(3.0), [40.0] * 3))
    start.body[1, [BASE_RADIUS, TIP_RADIUS, LENGTH, CENTRE]] = 500.0, 250.0, 30.0, 11.0
    start.state[1, 2] = -np.inf
    rasters = Rasters.allocate(place, 1)
    result = slide(place, start, FIDELITIES["standard"], time_limit=5.0, rasters=rasters)
    assert (result.stop_reason == STOP_REASONS.index("failed")).tolist() == [False, True, False]


def test_tables_of_another_length_or_scene_are_refused():
    logs = Logs.alike([20.0, 30.0], [40.0, 40.0])
    small = Scene.prepare(np.zeros((9, 9)), 1.0, 0.0, 0.0, friction=0.3)
    with pytest.raises(ValueError, match="keep_poses"):
        slide(scene(), logs, FIDELITIES["draft"], keep_poses=np.ones(1, bool))
    with pytest.raises(ValueError, match="not of this scene's grid"):
        slide(scene(), logs, FIDELITIES["draft"], rasters=Rasters.allocate(small, 1))
    start = place_logs(scene(), logs)
    with pytest.raises(ValueError, match="one row a log"):
        slide(scene(), Start(start.frame, start.state, start.body[:1]), FIDELITIES["draft"])


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_scenes_of_no_place_are_refused(value):
    """A road at infinity kept the index of lines busy for good."""
    far = Lines(np.array([[0.0, 1.0], [value, 2.0]]), np.array([0, 2]))
    if np.isfinite(value):
        slide(scene(lines=far), Logs.alike([20.0], [40.0]), FIDELITIES["draft"], time_limit=1.0)
        return
    with pytest.raises(ValueError, match="a vertex of a line is no finite place"):
        scene(lines=far)
    with pytest.raises(ValueError, match="friction must be a number wherever there is terrain"):
        Scene.prepare(np.zeros((9, 9)), 1.0, 0.0, 0.0, friction=value)
    heights = np.zeros((9, 9))
    heights[3, 3] = -value
    Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3)
    with pytest.raises(ValueError, match="corner must be a place"):
        Scene.prepare(heights, 1.0, value, 0.0, friction=0.3)
