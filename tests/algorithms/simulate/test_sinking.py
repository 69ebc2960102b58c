"""Logs that sink deep: which ones are counted, and what is reported."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import rasterio
from slope_case import Case, layer

from deadwood_algorithms.simulate.sinking import TOO_DEEP, Sinking
from deadwood_engine import Logs, Start


def add(to: Sinking, logs: Logs | Start, depth: list[float]) -> None:
    to.add(logs, None, np.array(depth))


def logs_of(diameter: list[float]) -> Logs:
    number = len(diameter)
    return Logs.alike(np.zeros(number), np.zeros(number), diameter=cast("Any", np.array(diameter)))


def test_a_log_is_measured_by_its_own_diameter(said):
    found = Sinking()
    add(found, logs_of([0.2, 0.8, 0.8]), [0.11, 0.11, 0.39])
    assert (found.slid, found.deep) == (3, 1)
    assert found.deepest == pytest.approx((0.11, 0.55))
    add(found, Start(np.zeros((1, 2), np.int64), np.zeros((1, 16)), np.full((1, 9), 0.5)), [4.5])  # a metre thick
    add(found, logs_of([]), [])
    found.say(5.0, said)
    (told,) = said.warnings
    assert "2 of 4 logs that slid sank deeper than 0.5 of their diameter" in told
    assert "the deepest 4.5 m (4.5 diameters), on cells of 5 m" in told


def test_of_logs_that_do_not_sink_nothing_is_reported(said):
    found = Sinking()
    add(found, logs_of([0.2, 0.8]), [0.1, 0.4])  # half of it is not deeper than half
    found.say(1.0, said)
    assert (found.slid, found.deep, said.warnings) == (2, 0, [])


def test_a_run_on_rough_ground_says_how_many_of_its_deposits_sank(tmp_path: Path, said):
    """Thin logs at draft on white noise of 0.4 m: the warning has the numbers that the deposits have."""
    case = Case(tmp_path / "case")
    rng = np.random.default_rng(3)
    with rasterio.open(case.dem, "r+") as dem:
        heights = dem.read(1)
        dem.write((heights + 0.4 * rng.standard_normal(heights.shape)).astype("float32"), 1)
    run = case.run(feedback=said, output=str(tmp_path / "run"), dbh_cm=20.0, friction="0.1", trajectories="none")
    part = layer(run, "deposits")["penetration_max_m"].to_numpy() / 0.2
    deep = int((part > TOO_DEEP).sum())
    assert deep > 0, "none sinks so deep: choose rougher ground"
    (told,) = [each for each in said.warnings if "sank deeper" in each]
    assert told.startswith(f"{deep} of {part.size} logs that slid sank deeper than 0.5 of their diameter")
    assert f"the deepest {0.2 * part.max():.2g} m ({part.max():.2g} diameters)" in told
