"""danger.tif of a run, and the same from its stored trajectories: where a moving log ends on the road."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from slope_case import EAST, NORTH, Case, assert_same_run, bands, layer, raster, write_layer

from deadwood_algorithms.files import styles
from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.results.danger import ANY, COUNT
from deadwood_algorithms.scene import memory
from deadwood_algorithms.scene.memory import threads_that_fit
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.tools import count_hits
from deadwood_toolbox import cli

SAMPLE = Path(__file__).parents[3] / "sample_data"


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    return case.run(output=str(case.folder / "full"), danger_least=3, **case.everything())


def counted(run: Path, folder: Path, **changes) -> dict[str, np.ndarray]:
    out = folder / "danger.tif"
    count_hits.TOOL(run=str(run), output=str(folder / "hits.tif"), danger=str(out), overwrite=True, **changes)
    return read(out)


def read(path: Path) -> dict[str, np.ndarray]:
    with rasterio.open(path) as source:
        return {str(source.descriptions[k]): source.read(k + 1) for k in range(source.count)}


def test_the_bands_and_where_they_are_transparent(full):
    found, hits = read(full / "danger.tif"), raster(full / "hit_count.tif")
    assert list(found) == [ANY, COUNT, "road", "house"]
    with rasterio.open(full / "danger.tif") as made:
        assert made.dtypes == ("float32",) * 4
        assert np.isnan(made.nodata)
        assert made.units == ("1", "logs", "1", "1")
        assert made.crs.to_epsg() == 2056
    told = hits >= 3
    assert 0 < told.sum() < (hits > 0).sum()
    for name, band in found.items():
        assert np.array_equal(np.isfinite(band), told), name
    assert np.array_equal(found[COUNT][told], hits[told])
    for name in (ANY, "road", "house"):
        assert ((found[name][told] >= 0.0) & (found[name][told] <= 1.0)).all()
        logs = found[name][told] * hits[told]
        assert logs == pytest.approx(np.round(logs), abs=1e-4)
    assert (found[ANY][told] >= np.fmax(found["road"], found["house"])[told]).all()
    assert styles.of_raster("danger").document() == (full / "danger.qml").read_text(encoding="utf-8")


def test_above_the_line_as_many_as_reach_it_below_it_fewer(full):
    """The reach of all logs is between the values of cells above the road; logs that reach it passed them before."""
    reached = set(layer(full, "reached_by").query("line_id == 'road'")["log_id"])
    found = read(full / "danger.tif")["road"]
    assert reached
    at_road = found[75]  # row of v 24 to 25, which the road bounds
    assert np.nanmax(at_road) == 1.0
    assert not np.nanmax(found[86:], initial=0.0) > 0.0  # 10 m below: no log reaches it after that


def test_stored_trajectories_give_the_runs_own_raster_to_the_bit(full, tmp_path):
    ours = counted(full, tmp_path, danger_least=3)
    assert {name: band.tobytes() for name, band in ours.items()} == bands(full / "danger.tif")


def test_other_lines_subsets_and_cells(full, tmp_path):
    lines = [shapely.LineString([(0.5, 30.0), (59.5, 30.0)]), shapely.LineString([(0.5, 2.0), (3.0, 2.0)])]
    other = write_layer(tmp_path / "other.gpkg", lines, line_id=["foot", "corner"])
    found = counted(full, tmp_path, reaching=other, danger_least=1, cell_m=2.0, release_id="a")
    assert list(found) == [ANY, COUNT, "foot", "corner"]
    assert found[ANY].shape == (50, 30)
    assert np.nanmax(found[COUNT]) <= 12
    assert not np.nanmax(found["corner"]) > 0.0
    assert np.array_equal(found[ANY], found["foot"], equal_nan=True)
    assert np.nanmax(found["foot"]) > 0.0


def test_threads_and_interruptions_change_no_byte(full, case, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "FIRST_CHUNKS", ())
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    values = {**case.everything(), "danger_least": 3, "output": str(tmp_path / "run")}

    class Impatient:
        def __init__(self) -> None:
            self.done = 0.0

        def progress(self, done, total, what):
            self.done = done if what == "sliding logs" else self.done

        def note(self, message, code="", **numbers): ...

        def warn(self, message, code="", **numbers): ...

        def cancelled(self):
            return self.done >= 9

    with pytest.raises(Cancelled):
        case.run(Impatient(), threads=1, **values)
    assert list((tmp_path / ".run.part").glob("rasters_*.npz"))
    resumed = case.run(threads=2, resume=True, **values)
    assert_same_run(full, resumed)
    assert (resumed / "danger.tif").read_bytes() == (full / "danger.tif").read_bytes()


def test_without_lines_there_is_none_and_nothing_else_changes(full, case, tmp_path):
    things = {name: path for name, path in case.everything().items() if name != "lines"}
    without = case.run(output=str(tmp_path / "run"), **things)
    assert not (without / "danger.tif").exists()
    for name in ("hit_count", "deposit_count", "speed_max", "energy_max", "jump_max"):
        assert (without / f"{name}.tif").read_bytes() == (full / f"{name}.tif").read_bytes(), name
    with pytest.raises(UserError, match="the run has no roads, railways or houses; name them with --reaching"):
        counted(without, tmp_path)
    assert np.nanmax(counted(without, tmp_path, reaching=case.lines, danger_least=1)[ANY]) > 0.0


def test_logs_that_start_in_a_house_reach_it_there_and_not_later(case, tmp_path):
    """The polygon around all releases: values only in the cells of their first outlines."""
    around = write_layer(
        tmp_path / "around.gpkg",
        [shapely.box(1.0, 50.0, 59.0, 95.0), shapely.LineString([(1.0, 1.0), (4.0, 1.0)])],
        line_id=[7, 8],
    )
    run = case.run(output=str(tmp_path / "run"), lines=around, danger_least=1)
    found = read(run / "danger.tif")
    assert list(found) == [ANY, COUNT, "7", "8"]
    began = gpd.GeoSeries(layer(run, "deposits").apply(lambda row: shapely.Point(row.release_x, row.release_y), axis=1))
    rows, columns = np.nonzero(found["7"] > 0.0)
    x, y = EAST + columns + 0.5, NORTH + 99.5 - rows
    assert rows.size > 24
    assert max(began.distance(shapely.Point(*place)).min() for place in zip(x, y, strict=True)) < 2.0
    assert not np.nanmax(found["8"]) > 0.0
    assert {name: band.tobytes() for name, band in counted(run, tmp_path, danger_least=1).items()} == bands(
        run / "danger.tif"
    )


def test_many_lines_and_lines_that_share_an_id(case, tmp_path):
    across = [shapely.LineString([(0.5, v), (59.5, v)]) for v in np.linspace(5.0, 60.0, 40)]
    many = write_layer(tmp_path / "many.gpkg", across, line_id=[f"v{k // 2}" for k in range(40)])
    run = case.run(output=str(tmp_path / "run"), lines=many, danger_least=5)
    found = read(run / "danger.tif")
    assert list(found) == [ANY, COUNT, *(f"v{k}" for k in range(20))]
    told = np.isfinite(found[ANY])
    assert (found[ANY][told] >= np.max([found[f"v{k}"] for k in range(20)], axis=0)[told]).all()
    for name, band in counted(run, tmp_path, danger_least=5).items():
        assert np.array_equal(band, found[name], equal_nan=True), name


def test_memory_is_reported_with_the_lines(monkeypatch, said):
    """28 bytes per cell and thread and 4 more for each line, the list, and any; 24 for the scene and the writing."""
    cells, lines = 10_000_000, 3
    need = 24 + 2 * (28 + 4 * (lines + 2))
    monkeypatch.setattr(memory, "free_bytes", lambda: int(cells * need / 0.9) + 10)
    facts = {"friction_by_cell": False, "what": str(SAMPLE / "dem.tif"), "feedback": said}
    assert threads_that_fit(8, cells, danger_lines=lines, **facts) == 2
    with pytest.raises(UserError, match="10 million cells need .* watch fewer than 60 lines, or use"):
        threads_that_fit(8, cells, danger_lines=60, **facts)


@pytest.mark.parametrize("value", ["0", "-3", "2.5", "few"])
def test_a_least_that_is_invalid_is_refused_in_a_line(case, tmp_path, capsys, value):
    words = [f"--{name.replace('_', '-')}={each}" for name, each in case.values().items() if name != "output"]
    output = tmp_path / "run"
    assert cli.run(["slide-logs", *words, f"--output={output}", f"--danger-least={value}"]) == 2
    (told,) = capsys.readouterr().err.strip().splitlines()
    assert "--danger-least" in told
    assert not output.exists()


def test_lines_to_reach_without_a_raster_to_write_are_refused(full, case, tmp_path):
    with pytest.raises(UserError, match=r"add --danger FILE\.tif"):
        count_hits.TOOL(run=str(full), output=str(tmp_path / "hits.tif"), reaching=case.lines)
