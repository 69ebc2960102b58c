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
    """Also where an area lies in several windows, and where it has just the least ground (or the least gully)."""
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
