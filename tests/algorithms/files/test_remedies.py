"""Every command printed as the fix in a message is run as printed, and the tool accepts its result."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio.control import GroundControlPoint
from rasterio.crs import CRS
from rasterio.transform import Affine, from_origin
from remedied import carry_out

from deadwood_algorithms.files import remedies
from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.rasters import read_raster_on
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.ground import warn_of_ground
from deadwood_algorithms.scene.memory import threads_that_fit
from deadwood_algorithms.tools import add_structures

E, N = 2_783_000.0, 1_190_000.0
HEIGHTS = np.add.outer(np.arange(40.0), 0.5 * np.arange(50.0)).astype(np.float32) + 500.0
NORTH_UP = from_origin(E, N, 2, 2)


def tif(path: Path, transform: Affine = NORTH_UP, crs: Any = "EPSG:2056", **facts: Any) -> Path:
    change = facts.pop("change", None)
    profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 40, "width": 50} | facts
    values = facts.pop("values", HEIGHTS)
    profile.pop("values", None)
    with rasterio.open(path, "w", transform=transform, crs=crs, **profile) as made:
        made.write(values.astype(profile["dtype"]), 1)
        if change:
            change(made)
    return path


def gcps(made: Any) -> None:
    corners = [(0, 0), (39, 49), (0, 49), (39, 0)]
    places = [GroundControlPoint(row, column, E + 2 * column, N - 2 * row) for row, column in corners]
    made.gcps = (places, CRS.from_epsg(2056))


def asc(path: Path, dy: float) -> Path:
    head = f"ncols 50\nnrows 40\nxllcorner {E}\nyllcorner {N}\ndx 2\ndy {dy}\nNODATA_value -9999\n"
    path.write_text(head + "\n".join(" ".join(f"{v:.1f}" for v in row) for row in HEIGHTS))
    return path


def two_bands(path: Path) -> Path:
    """The second of two bands is the elevation, by its name."""
    with rasterio.open(
        path, "w", driver="GTiff", dtype="float32", count=2, height=40, width=50, crs="EPSG:2056", transform=TURNED
    ) as made:
        for number, (name, values) in enumerate((("slope", HEIGHTS * 0.0 + 26.0), ("elevation", HEIGHTS)), start=1):
            made.write(values, number)
            made.set_band_description(number, name)
    return path


TURNED = Affine.translation(E, N) @ Affine.rotation(20.0) @ Affine.scale(2.0, -2.0)


def packed(made: Any) -> None:
    made.scales, made.offsets = (0.1,), (400.0,)


def packed_feet(made: Any) -> None:
    packed(made)
    made.units = ("feet",)


def masked(made: Any) -> None:
    """Packed, with a mask that is no nodata value: the first five rows hold nothing."""
    packed(made)
    made.write_mask(np.where(np.arange(40)[:, None] < 5, 0, 255).astype("uint8") + np.zeros((40, 50), "uint8"))


PACKED = {"values": np.rint((HEIGHTS - 400.0) / 0.1), "dtype": "int16"}
REFUSED: dict[str, Any] = {
    "degrees": lambda f: tif(f / "my dem.tif", from_origin(9.0, 47.0, 2e-5, 2e-5), "EPSG:4326"),
    "feet": lambda f: tif(f / "d.tif", from_origin(6_000_000, 2_000_000, 3, 3), "EPSG:2225"),
    "Web Mercator": lambda f: tif(f / "d.tif", from_origin(1.1e6, 5.9e6, 2.0, 2.0), "EPSG:3857"),
    "rotated": lambda f: tif(f / "d.tif", TURNED),
    "rotated, nodata": lambda f: tif(f / "d.tif", TURNED, nodata=-32768),
    "rotated, without code": lambda f: tif(f / "d.tif", TURNED, CRS.from_string("+proj=tmerc +lon_0=9 +datum=WGS84")),
    "mirrored": lambda f: tif(f / "d.tif", Affine(-2, 0, E, 0, -2, N)),
    "rotated, south up": lambda f: tif(f / "d.tif", TURNED @ Affine.scale(1, -1)),
    "oblong": lambda f: tif(f / "d.tif", from_origin(E, N, 2, 3)),
    "oblong, no CRS": lambda f: asc(f / "d.asc", 3.0),
    "oblong, int16": lambda f: tif(f / "d.tif", from_origin(E, N, 2, 3), dtype="int16"),
    "oblong, uint16": lambda f: tif(f / "d.tif", from_origin(E, N, 2, 3), dtype="uint16"),
    "control points": lambda f: tif(f / "d.tif", Affine.identity(), None, change=gcps),
    "heights in feet by the CRS": lambda f: tif(f / "d.tif", from_origin(5e5, 4e6, 2, 2), "EPSG:32611+6360", nodata=0),
    "heights in feet by the band": lambda f: tif(f / "d.tif", change=lambda m: setattr(m, "units", ("feet",))),
    "centimetres": lambda f: tif(f / "d.tif", values=HEIGHTS * 100.0, dtype="int32"),
    "rotated, packed": lambda f: tif(f / "d.tif", TURNED, change=packed, **PACKED),
    "rotated, masked": lambda f: tif(f / "d.tif", TURNED, change=masked, **PACKED),
    "oblong, masked, no CRS": lambda f: tif(f / "d.tif", from_origin(E, N, 2, 3), None, change=masked, **PACKED),
    "heights in feet by the band, packed": lambda f: tif(f / "d.tif", change=packed_feet, **PACKED),
    "a quarry, masked": lambda f: tif(f / "d.tif", crs='LOCAL_CS["quarry",UNIT["metre",1]]', change=masked, **PACKED),
    "rotated, two bands": lambda f: two_bands(f / "d.tif"),
    "a quarry": lambda f: tif(f / "d.tif", crs='LOCAL_CS["quarry",UNIT["metre",1]]'),
}


@pytest.mark.parametrize("name", REFUSED)
def test_the_fix_of_a_refused_dem_fixes_it(tmp_path, name, said):
    path = REFUSED[name](tmp_path)
    crs = "EPSG:2056" if "no CRS" in name else None
    with pytest.raises(UserError) as refused:
        read_dem(path, crs=crs)
    fixed = read_dem(carry_out(str(refused.value).split("fix: ", 1)[1], tmp_path), feedback=said)
    doubts = [each for each in said.warnings if "int" not in name or "rounded to 1 m" not in each]
    assert not doubts, doubts  # such as heights of 0 m around it
    heights = fixed.values[np.isfinite(fixed.values)]
    feet = 0.3048 if "heights in feet" in name else 1.0
    assert heights.size > 1000
    lowest = HEIGHTS[5:].min() if "masked" in name else HEIGHTS.min()
    assert heights.min() == pytest.approx(lowest * feet, rel=0.01)
    assert heights.max() == pytest.approx(HEIGHTS.max() * feet, rel=0.01)


def test_a_dem_without_place_is_fixed_with_its_own_numbers(tmp_path):
    path = tif(tmp_path / "d.tif", Affine.identity())
    with pytest.raises(UserError) as refused:
        read_dem(path)
    message = str(refused.value)
    for word, number in (("CELL", "2"), ("WEST", str(E)), ("NORTH", str(N))):
        message = message.replace(word, number)
    grid = read_dem(carry_out(message.split("numbers: ")[1], tmp_path))
    assert (grid.cell, grid.x0, grid.y0) == (2.0, E + 1.0, N - 79.0)


def test_one_of_several_rasters_is_written_out(tmp_path):
    path = tmp_path / "two.gpkg"
    for table, more in (("a", {}), ("b", {"APPEND_SUBDATASET": "YES"})):
        tif(path, driver="GPKG", RASTER_TABLE=table, **more)
    with pytest.raises(UserError, match="several rasters") as refused:
        read_dem(path)
    assert np.isfinite(read_dem(carry_out(str(refused.value).split("out: ")[1], tmp_path)).values).all()


@pytest.mark.parametrize("dtype", ["float32", "int16"])
def test_a_dem_in_feet_of_a_metric_crs_is_suspected_and_fixed(tmp_path, said, dtype):
    """Whole feet become metres accurate to half a foot, not rounded to whole metres."""
    truth = 500.0 + 2.0 * np.tan(np.radians(35.0)) * np.arange(40.0)[::-1, None] + np.zeros(50)
    path = tif(tmp_path / "d.tif", values=np.rint(truth / 0.3048) if dtype == "int16" else truth / 0.3048, dtype=dtype)
    warn_of_ground(read_dem(path, feedback=said), np.array([E + 50.0]), np.array([N - 40.0]), said)
    told = [each for each in said.warnings if "degrees" in each]
    assert len(told) == 1
    assert "median slope over its cells is 6" in told[0]
    assert "then it is 3" in told[0]
    fixed = read_dem(carry_out(told[0].split("Fix: ")[1], tmp_path), feedback=said)
    assert np.abs(fixed.values[::-1] - truth).max() <= (0.5 * 0.3048 if dtype == "int16" else 0.0) + 1e-3
    warn_of_ground(fixed, np.array([E + 50.0]), np.array([N - 40.0]), said)
    assert len([each for each in said.warnings if "degrees" in each]) == 1


def test_a_dem_too_large_for_the_memory_is_made_coarser(tmp_path, monkeypatch, said):
    monkeypatch.setattr("deadwood_algorithms.scene.memory.free_bytes", lambda: 1)
    path = str(tif(tmp_path / "d.tif"))
    with pytest.raises(UserError) as refused:
        threads_that_fit(1, 2000, friction_by_cell=False, what=path, feedback=said, cell=2.0)
    message = str(refused.value)
    assert read_dem(carry_out(message[message.index("(") + 1 : -1], tmp_path)).cell == 4.0


def test_scaled_numbers_become_heights(tmp_path):
    def scaled(made: Any) -> None:
        made.scales, made.offsets = (0.5,), (100.0,)

    path = tif(tmp_path / "d.tif", values=(HEIGHTS - 100.0) * 2.0, dtype="int16", change=scaled)
    fixed = carry_out(remedies.unscaled(path), tmp_path)
    assert np.array_equal(read_dem(fixed).values, read_dem(path).values)


def scaled_by(scale: float, offset: float) -> Any:
    def change(made: Any) -> None:
        made.scales, made.offsets = (scale,), (offset,)

    return change


def test_tiles_of_different_scales_become_one_dem(tmp_path):
    folder, fixed = tmp_path / "tiles", tmp_path / "fixed"
    folder.mkdir()
    fixed.mkdir()
    for name, east, scale, offset in (("west", E, 0.5, 100.0), ("east", E + 100.0, 0.25, 400.0)):
        numbers = (HEIGHTS - offset) / scale
        place = from_origin(east, N, 2, 2)
        tif(folder / f"{name}.tif", place, values=numbers, dtype="int16", change=scaled_by(scale, offset))
    with pytest.raises(UserError, match="fix, for each: ") as refused:
        read_dem(folder)
    named = next(each for each in ("west.tif", "east.tif") if f"{each}: the tile's heights" in str(refused.value))
    carry_out(str(refused.value).split("for each: ")[1], fixed)
    other = ({"west.tif", "east.tif"} - {named}).pop()
    scale, offset = {"west.tif": (0.5, 100.0), "east.tif": (0.25, 400.0)}[other]
    carry_out(remedies.unscaled(folder / other), fixed)
    assert np.array_equal(read_dem(fixed).values[::-1], np.hstack([HEIGHTS, HEIGHTS]))


@pytest.mark.parametrize("height", [2.0, 40_000.0])
def test_a_dem_in_coarse_numbers_takes_the_structures_as_floats(tmp_path, said, height):
    """The steps are warned of, a height beyond the type is refused; with either command the crest is as intended."""
    path = tif(tmp_path / "d.tif", values=HEIGHTS * 2.0, dtype="int16", change=scaled_by(0.5, 0.0))
    lines = tmp_path / "s.geojson"
    crest = [[E + 20.0, N - 40.0], [E + 60.0, N - 40.0]]
    shape = {"type": "LineString", "coordinates": crest}
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::2056"}}
    feature = {"type": "Feature", "properties": {"structure_id": 1}, "geometry": shape}
    lines.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": [feature]}))
    asked = {"structures": str(lines), "height_m": height, "slope_deg": 90.0, "crest_width_m": 6.0}
    told = ""
    try:
        add_structures.TOOL(feedback=said, dem=str(path), output=str(tmp_path / "with.tif"), **asked)
        told = said.warnings[0].split("for finer steps: ")[1]
    except UserError as refused:
        told = str(refused).split("fix: ")[1]
    fixed = carry_out(told, tmp_path)
    said.warnings.clear()
    made = tmp_path / "fixed_with.tif"
    add_structures.TOOL(feedback=said, dem=str(fixed), output=str(made), **asked)
    assert not said.warnings
    with rasterio.open(made) as changed:
        heights = changed.read(1)
    under = HEIGHTS[19:21, 12:28].mean(axis=0)  # of the line, which runs between these rows
    assert np.allclose(heights[19:21, 12:28], under + height, atol=1e-3 + 4e-3 * (height > 100.0))


def test_a_raster_without_place_is_placed_with_its_own_numbers(tmp_path):
    path = tif(tmp_path / "mu.tif", Affine.identity(), None, values=HEIGHTS / 1000.0)
    grid = read_dem(tif(tmp_path / "d.tif"))
    with pytest.raises(UserError, match="no georeference") as refused:
        read_raster_on(path, grid, what="friction")
    message = str(refused.value)
    for word, number in (("CELL", "2"), ("WEST", str(E)), ("NORTH", str(N))):
        message = message.replace(word, number)
    placed = carry_out(message.split("numbers: ")[1], tmp_path)
    assert np.array_equal(read_raster_on(placed, grid, what="friction")[::-1], HEIGHTS / np.float32(1000.0))


def test_every_place_that_prints_a_command_is_tested_here():
    """A new one needs a test of its own, which runs what is printed; then its file is counted here."""
    tested = {"scene/memory.py": 1, "files/rasters.py": 2, "files/dem_header.py": 13, "files/heights.py": 2}
    tested |= {"files/tiles.py": 1, "prepare/structures/into_dem.py": 2}
    tested |= {"files/ways_out.py": 2}  # test_ways_out.py
    root = Path(remedies.__file__).parents[1]
    found = {str(each.relative_to(root)): each.read_text().count("{remedies.") for each in root.rglob("*.py")}
    found["files/dem_header.py"] += (root / "files/dem_header.py").read_text().count("= remedies.")
    assert {name: count for name, count in found.items() if count} == tested


def test_an_undeclared_margin_is_declared(tmp_path, said):
    low = HEIGHTS - 480.0
    low[:8] = 0.0
    read_dem(tif(tmp_path / "d.tif", values=low), feedback=said)
    told = next(each for each in said.warnings if "--nodata" in each)
    fixed = read_dem(carry_out(told.split("Fix: ")[1], tmp_path)).values[::-1]
    assert np.array_equal(np.isnan(fixed), low == 0.0)
    assert np.array_equal(fixed[8:], low[8:])


def test_another_band_is_written_out(tmp_path, said):
    path = two_bands(tmp_path / "d.tif")
    with rasterio.open(path, "r+") as made:
        made.transform = NORTH_UP
    assert np.array_equal(read_dem(path, feedback=said).values[::-1], HEIGHTS)
    told = next(each for each in said.notes if "NUMBER" in each).replace("NUMBER", "1").split("heights; ")[1]
    assert (read_dem(carry_out(told, tmp_path)).values == 26.0).all()


def test_rio_is_named_as_it_is_found(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    beside = tmp_path / "bin"
    beside.mkdir()
    (beside / "rio").write_text("#!/bin/sh\n")
    (beside / "rio").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(beside / "python"))
    assert remedies.rio() == str(beside / "rio")
    monkeypatch.setenv("PATH", str(beside))
    assert remedies.rio() == "rio"
