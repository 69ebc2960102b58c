"""Energies and directions from poses: closed forms, and the energies of a real run."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hand_run import Track, write_run
from slope_case import Case

from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.motion import axis_rate, bodies_of, energies_kj, path_so_far, travel
from deadwood_algorithms.results.run_folder import read_run
from deadwood_engine.log_body import AXIAL, MASS


def test_the_mass_is_that_of_a_truncated_cone(tmp_path):
    """pi L / 12 (D^2 + D d + d^2), d = D / 2: by a fine sum over discs."""
    s = (np.arange(100_000) + 0.5) / 100_000
    discs = np.pi * (0.2 * (1.0 - 0.5 * s)) ** 2 * 10.0 / 100_000
    run = read_run(str(write_run(tmp_path / "run", [Track((1, 1), (9, 9))], length_m=10.0)), feedback=Quiet())
    assert bodies_of(run)[0, MASS] == pytest.approx(300.0 * discs.sum(), rel=1e-8)


def test_the_mass_of_another_shape_is_that_of_its_body(tmp_path):
    """A block of 1 x 2 x 3 m beside the run's folder; without its file the mass is unknown."""
    corners = np.array(list(product((0.0, 1.0), (0.0, 2.0), (0.0, 3.0))))
    np.savetxt(tmp_path / "block.pts", corners)
    parameters = {"shape": "elsewhere/block.pts"}
    folder = write_run(tmp_path / "run", [Track((1, 1), (9, 9))], parameters=parameters)
    run = read_run(str(folder), feedback=Quiet())
    assert bodies_of(run)[0, MASS] == pytest.approx(6.0 * 300.0)
    assert bodies_of(run)[0, AXIAL] == pytest.approx((1.0 + 4.0) / 12.0)
    (tmp_path / "block.pts").unlink()
    with pytest.raises(UserError, match="elsewhere/block.pts, no longer exists"):
        bodies_of(run)


def turning(rate: float, spin: float, speed: float = 3.0) -> dict[str, np.ndarray]:
    """A log of 10 m whose axis turns in plan at a steady rate, sampled every 10 ms, as two logs of 50 poses."""
    t = np.tile(np.arange(50) * 0.01, 2)
    axis = np.stack([np.cos(rate * t), np.sin(rate * t), np.zeros(100)])
    ends = {f"{name}{end}": sign * 5.0 * axis[k] for end, sign in (("b", -1), ("t", 1)) for k, name in enumerate("xyz")}
    facts = {"speed_ms": np.full(100, speed), "spin_rad_s": np.full(100, spin), "t_s": t}
    return ends | facts | {"log_row": np.repeat([0, 1], 50), "x": speed * t, "y": 0.0 * t, "z": 0.0 * t}


def test_a_turning_axis_and_a_spin_about_it_are_distinguished():
    """Rates of 2 rad/s across and sqrt(5) along make 3 in all; energies by the principal moments."""
    piece = turning(2.0, 3.0)
    assert axis_rate(piece) == pytest.approx(np.full(100, 2.0), rel=1e-9)
    body = np.array([[0.4, 0.2, 10.0, 4.0, 8.0, 0.05, 500.0]] * 2)
    moving, turned = energies_kj(piece, body)
    assert moving == pytest.approx(np.full(100, 0.5 * 500.0 * 9.0 / 1000.0))
    assert turned == pytest.approx(np.full(100, 0.5 * 500.0 * (8.0 * 4.0 + 0.05 * 5.0) / 1000.0), rel=1e-8)


def test_the_energy_is_the_runs_own(tmp_path):
    """The run monitors every step, poses are a cell apart: the maximum of each log is mostly within 5 % and hardly ever
    exceeds that of the poses by more than the fall over that cell."""
    case = Case(tmp_path)
    run = read_run(str(case.run(trees=case.trees, friction="0.3", fidelity="standard")), feedback=Quiet())
    largest = np.zeros(len(run.deposits))
    for piece in run.poses(run.stored_log_ids):
        np.maximum.at(largest, piece["log_row"], sum(energies_kj(piece, bodies_of(run))))
    told, mass = run.deposits["energy_max_kj"].to_numpy(), bodies_of(run)[:, MASS]
    assert abs(np.median(largest / told) - 1.0) < 0.05
    missed = 1000.0 * (told - largest) / mass
    assert np.quantile(missed, 0.95) < 9.81 * 1.0
    assert missed.min() > -0.05 * 1000.0 * (told / mass).max()


def test_paths_and_directions_start_again_with_each_log():
    piece = turning(0.0, 0.0) | {"y": np.repeat([0.0, 7.0], 50)}
    path = path_so_far(piece)
    assert path[[0, 50]].tolist() == [0.0, 0.0]
    assert path[[49, 99]] == pytest.approx([1.47, 1.47])
    ways = travel(piece, np.array([0, 1, 49, 50, 99]))
    assert ways == pytest.approx(np.array([[0.03, 0.0]] * 5))
    alone = {name: values[[0, 60]] for name, values in piece.items()}
    assert travel(alone, np.array([0, 1])).tolist() == [[0.0, 0.0], [0.0, 0.0]]
