"""The comparison with measured rockfalls: the bodies' mass, the scores, and the whole page on data of the same form."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest
import yaml

from benchmarks import tschamut
from benchmarks.tschamut import BLOCKS, BODIES, SOFT, Outcomes, corners_of, density_of
from deadwood_engine import Shape


@pytest.mark.parametrize("number", BLOCKS)
@pytest.mark.parametrize("body", BODIES)
def test_each_body_has_the_measured_mass_and_sides(body, number):
    _, sides, mass = BLOCKS[number]
    corners = corners_of(body, sides)
    assert np.ptp(corners, axis=0) == pytest.approx(sides)
    assert Shape.of(corners).volume * density_of(body, number) == pytest.approx(mass)
    share = 1.0 if body == "box" else 17.0 / 24.0
    assert density_of(body, number) == pytest.approx(mass / (share * np.prod(sides)))


def test_the_score_is_the_integral_of_the_squared_difference_of_the_distributions():
    runout, measured = np.array([20.0, 31.0, 31.0, 55.0]), np.array([28.0, 70.0])
    found = Outcomes(np.array(["a", "a", "b", "c"]), runout, np.zeros(4, bool))
    at = np.arange(0.0, 200.0, 1e-3) + 5e-4
    share = (runout[:, None] <= at).mean(axis=0)
    expected = np.mean([((share - (at >= each)) ** 2).sum() * 1e-3 for each in measured])
    assert found.score(measured) == pytest.approx(expected, rel=1e-3)
    assert found.of(["a"]).runout.tolist() == [20.0, 31.0]
    assert found.words() == "34 ± 13"


def test_a_band_has_no_upper_end_where_many_left():
    runout = np.arange(100.0)
    few, many = np.arange(100) > 95, np.arange(100) > 93
    assert Outcomes(np.full(100, "a"), runout, few).band() == pytest.approx((4.95, 94.05))
    assert Outcomes(np.full(100, "a"), runout, many).band() == pytest.approx((4.95, np.inf))


@pytest.fixture
def data(tmp_path):
    """A plane of 30 degrees that ends on the flat, and four rockfalls of each block."""
    rows, columns, cell = 30, 20, 5.0
    north = cell * (np.arange(rows)[::-1] + 0.5)  # of each row, the first in the north
    heights = np.tile(np.maximum(north - 60.0, 0.0)[:, None] * np.tan(np.radians(30.0)), (1, columns))
    head = f"ncols {columns}\nnrows {rows}\nxllcorner -35.0\nyllcorner 85.0\ncellsize {cell}\nNODATA_value -9999\n"
    body = "\n".join(" ".join(f"{z:.6f}" for z in row) for row in heights)
    (tmp_path / "terrain.asc").write_text(head + body + "\n")
    names = [f"v{k:03d}" for k in range(12)]
    block = np.repeat(list(BLOCKS), 4)
    base = {"trajectory_id": names, "block_id": block}
    released = base | {"x_m": 10.0, "y_m": 205.0, "vx_mps": 0.0, "vy_mps": -0.5 - 0.1 * np.arange(12)}
    pd.DataFrame(released).to_csv(tmp_path / "release_points.csv", index=False)
    observed = base | {"observed_runout_m": 50.0 + 3.0 * np.arange(12)}
    pd.DataFrame(observed).to_csv(tmp_path / "observed_deposition.csv", index=False)
    halves = {"calibration_ids": names[::4] + names[1::4], "holdout_ids": names[2::4]}
    (tmp_path / "split.yaml").write_text(yaml.safe_dump(halves))
    return tmp_path


def test_the_page_from_files_of_this_form(data, tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    laws = {SOFT: tschamut.LAWS[SOFT]}
    for name, value in {"TURNS": 2, "FITTED": (0.55,), "LAWS": laws, "PAGE": page}.items():
        monkeypatch.setattr(tschamut, name, value)
    monkeypatch.setattr(sys, "argv", ["tschamut", str(data)])
    tschamut.main()
    text = page.read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| ")]
    assert [len(row) for row in rows] == [4] * 4 + [6] * 5
    assert rows[1] == ["| **measured**", "54 ± 3", "66 ± 3", "78 ± 3 |"]
    assert [row[0].partition(":")[0] for row in rows[2:4]] == ["| box", "| norm body"]
    for body, mu in zip(("box", "box", "norm body", "norm body"), rows[5:], strict=True):
        assert mu[0] == f"| {body}"
        assert mu[5].endswith("of 3 |")
    assert "of a box 1350 to 1575, of a norm body 1906 to 2224 kg/m³" in " ".join(text.split())
