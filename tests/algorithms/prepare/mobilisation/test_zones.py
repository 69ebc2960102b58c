"""Release areas as polygons: cells that touch along a side, counted and measured one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio.transform import from_origin
from scipy.ndimage import label

from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.prepare.mobilisation import zones as module
from deadwood_algorithms.prepare.mobilisation.zones import zones

CELL, NY, NX = 2.0, 30, 41
WEST, NORTH = 2_600_000.0, 1_200_000.0
GULLY_M = 0.5


def write(path: Path, *bands: np.ndarray, dtype: str = "float32") -> Path:
    facts = {"driver": "GTiff", "height": NY, "width": NX, "count": len(bands), "dtype": dtype}
    place = from_origin(WEST, NORTH, CELL, CELL)
    with rasterio.open(path, "w", crs="EPSG:2056", transform=place, **facts) as made:
        made.write(np.stack(bands).astype(dtype))
    return path


@pytest.mark.parametrize("block", [1024, 16])
@pytest.mark.parametrize("least", [4.0, 24.0])
def test_each_area_has_what_its_cells_have(tmp_path, monkeypatch, least, block):
    """Also if an area lies in several windows, and if it has exactly the least area (or the least gully)."""
    monkeypatch.setattr(module, "BLOCK", block)
    rng = np.random.default_rng(3)
    mask = rng.random((NY, NX)) < 0.5
    value = rng.random((NY, NX)).astype(np.float32)
    slope, hollow = (rng.choice([0.0, 0.25, 0.5, 0.75], (NY, NX)) for _ in range(2))
    found = zones(
        write(tmp_path / "mask.tif", mask, dtype="uint8"),
        write(tmp_path / "s.tif", value),
        write(tmp_path / "f.tif", 40.0 * slope, np.zeros((NY, NX)), hollow),
        pyproj.CRS("EPSG:2056"),
        least,
        GULLY_M,
        Quiet(),
    )
    number, count = label(mask)  # along sides
    sizes = {k: int((number == k).sum()) for k in range(1, count + 1)}
    kept = {k for k, cells in sizes.items() if cells * CELL**2 >= least}
    assert any(sizes[k] * CELL**2 == least for k in kept)
    assert len(found) == len(kept)
    assert found["area_m2"].is_monotonic_decreasing
    assert found["release_id"].tolist() == list(range(1, len(kept) + 1))
    seen = set()
    for _, row in found.iterrows():
        inside = row["geometry"].representative_point()
        j, i = int((NORTH - inside.y) / CELL), int((inside.x - WEST) / CELL)
        mine = number == number[j, i]
        seen.add(int(number[j, i]))
        assert row["area_m2"] == mine.sum() * CELL**2
        assert row["susceptibility_mean"] == pytest.approx(value[mine].mean(dtype=float))
        assert row["susceptibility_max"] == value[mine].max()
        assert row["slope_mean_deg"] == pytest.approx(40.0 * slope[mine].mean())
        assert row["gully_share"] == pytest.approx((hollow[mine] >= GULLY_M).mean())
    assert seen == kept


@pytest.mark.parametrize("seed", range(4))
def test_blocks_change_no_area(tmp_path, monkeypatch, seed):
    """Snakes, rings and corners across the borders of blocks: the same area and the same number of corners."""
    rng = np.random.default_rng(seed)
    mask = rng.random((NY, NX)) < 0.62
    paths = (
        write(tmp_path / "mask.tif", mask, dtype="uint8"),
        write(tmp_path / "s.tif", rng.random((NY, NX))),
        write(tmp_path / "f.tif", *rng.random((3, NY, NX))),
    )
    found = {}
    for block in (1024, 7):
        monkeypatch.setattr(module, "BLOCK", block)
        found[block] = zones(*paths, pyproj.CRS("EPSG:2056"), 8.0, GULLY_M, Quiet())
    whole, parts = found[1024], found[7]
    assert len(whole) == len(parts) > 3
    assert parts.geometry.is_valid.all()
    assert whole.geometry.geom_equals(parts.geometry, align=False).all()
    assert parts.geometry.count_coordinates().sum() <= whole.geometry.count_coordinates().sum() + 2 * len(parts)
    for name in ("area_m2", "susceptibility_max"):
        assert whole[name].tolist() == parts[name].tolist()
    for name in ("susceptibility_mean", "slope_mean_deg", "gully_share"):
        assert whole[name].tolist() == pytest.approx(parts[name].tolist())
