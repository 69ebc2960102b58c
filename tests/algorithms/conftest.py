"""What the tests of tools and layers share: a feedback that remembers, and a small slope to work on."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from scipy import stats

from deadwood_algorithms.params.tool import Outcome
from deadwood_algorithms.tools import import_trees, sample_releases

sys.path.insert(0, str(Path(__file__).parent))  # importlib mode leaves the cases that tests share to us


class Said:
    """A feedback that remembers what it was told."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.warnings: list[str] = []

    def progress(self, done: float, total: float, what: str) -> None:
        pass

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.notes.append(message)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        self.warnings.append(message)

    def cancelled(self) -> bool:
        return False


@pytest.fixture
def said() -> Said:
    return Said()


@pytest.fixture
def slope(tmp_path: Path) -> Callable[..., str]:
    """Writes a DEM of 100 x 80 cells of 2 m, south-west corner (2783000, 1190000), with any cells turned to nodata."""

    def write(name: str = "dem.tif", crs: str | None = "EPSG:2056", nodata_rows: int = 0) -> str:
        heights = np.repeat(1000.0 + np.arange(80.0)[::-1, None], 100, axis=1)
        heights[:nodata_rows] = -9999.0
        transform = from_origin(2_783_000.0, 1_190_160.0, 2.0, 2.0)
        profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 80, "width": 100, "nodata": -9999.0}
        with rasterio.open(tmp_path / name, "w", crs=crs, transform=transform, **profile) as made:
            made.write(heights.astype("float32"), 1)
        return str(tmp_path / name)

    return write


@pytest.fixture
def outcome() -> dict[str, Outcome]:
    """The outcome of the last run, under ``last``."""
    return {}


@pytest.fixture
def imported(tmp_path, said, outcome) -> Callable[..., gpd.GeoDataFrame]:
    """Runs import-trees on a layer, or on text that becomes a file, and gives the trees."""

    def run(content, name="trees.csv", encoding="utf-8", **values) -> gpd.GeoDataFrame:
        if isinstance(content, str):
            (tmp_path / name).write_bytes(content.encode(encoding))
        else:
            content.to_file(tmp_path / name)
        values = {"crs": "EPSG:2056", "overwrite": True} | values
        ask = {"trees": str(tmp_path / name), "output": str(tmp_path / "out.gpkg")} | values
        outcome["last"] = import_trees.TOOL(import_trees.TOOL.ask_from(ask), said)
        return gpd.read_file(tmp_path / "out.gpkg")

    return run


@pytest.fixture
def sample(tmp_path, slope, said, outcome) -> Callable[..., gpd.GeoDataFrame]:
    """Runs sample-releases on a layer of areas, or on none, and gives the releases."""

    def run(layer: str | None, **values) -> gpd.GeoDataFrame:
        values = {"dem": slope(), "output": str(tmp_path / "releases.gpkg"), "overwrite": True} | values
        outcome["last"] = sample_releases.TOOL(sample_releases.TOOL.ask_from({"areas": layer} | values), said)
        return gpd.read_file(tmp_path / "releases.gpkg", layer="releases")

    return run


@pytest.fixture
def chi_square_excess() -> Callable[[np.ndarray, np.ndarray], float]:
    """Chi-square over the value that right draws exceed once in 10 000 seeds; above 1 is a failure."""

    def excess(counts: np.ndarray, shares: np.ndarray) -> float:
        expected = counts.sum() * shares
        statistic = ((counts - expected) ** 2 / expected).sum()
        return float(statistic / stats.chi2.ppf(1 - 1e-4, counts.size - 1))

    return excess
