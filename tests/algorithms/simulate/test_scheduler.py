"""`--scheduler` for every way of sliding logs, with workers that are threads of the test; and refusals."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from slope_case import Case, assert_same_bytes, assert_same_file, points, summary, write_layer
from thread_workers import STARTED, threads_for_workers

from deadwood_algorithms.evaluate.protection import changed_scenes
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.scene import layers, reach
from deadwood_algorithms.simulate import chunks, crew, scheduler, windows, workers
from deadwood_algorithms.tools import (
    break_trees,
    compare_fidelity,
    run_sites,
    site_barriers,
    value_trees,
)


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch):
    monkeypatch.setattr(scheduler, "_local_cluster", threads_for_workers)


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def both(case: Case, folder: Path, said=None, **changes) -> Path:
    """The run on workers, checked to equal the one without."""
    alone = case.run(output=str(folder / "alone"), **changes)
    spread = case.run(said, output=str(folder / "spread"), scheduler="local", workers=2, **changes)
    assert_same_bytes(alone, spread)
    return spread


def test_in_chunks_of_few_logs(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 5)
    monkeypatch.setattr(workers, "MOST_A_PIECE", 2)
    both(case, tmp_path, said, **case.everything())
    assert sum("joins" in each for each in said.notes) == 2
    assert sum("bytes per log to the workers" in each for each in said.notes) == 1
    assert scheduler._open == {}


@pytest.fixture
def names(monkeypatch) -> list[str]:
    """The names of all pieces that are sent in the test."""
    found: list[str] = []
    plain = workers.Workers._send

    def send(self, piece, ready) -> None:
        plain(self, piece, ready)
        found.append(piece.future.key)

    monkeypatch.setattr(workers.Workers, "_send", send)
    return found


def test_pieces_have_names_for_readers_of_the_dashboard(case, tmp_path, names):
    """The part before the logs, by which the scheduler adds up kinds of work."""
    from dask.utils import key_split

    case.run(output=str(tmp_path / "valley"), scheduler="local", workers=2, time_limit_s=1.0)
    found = [re.fullmatch(r"slide-logs-valley-logs (\d+) to (\d+) \([0-9a-f]{16}, \d+\)", each) for each in names]
    spans = sorted((int(each[1]), int(each[2])) for each in found if each)
    assert len(spans) == len(names) > 1
    assert [first for first, _ in spans] == [0, *(last + 1 for _, last in spans[:-1])]
    assert spans[-1][1] == 23
    assert {key_split(each) for each in names} == {"slide-logs-valley"}


def test_in_a_window_that_grows(case, said, tmp_path, monkeypatch):
    """Work started ahead on the smaller window is dropped, including its drawn cells."""
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(windows, "WHOLE_CELLS", 100)
    monkeypatch.setattr(layers, "WHOLE_CELLS", 100)
    monkeypatch.setattr(windows, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(windows, "SLOPE_MOST", 20.0)
    monkeypatch.setattr(chunks, "CHUNK", 3)
    both(case, tmp_path, said, **case.everything())
    assert any("is read wider" in each for each in said.notes)


def test_until_the_interval_is_narrow(case, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr("deadwood_algorithms.simulate.queue.FIRST_LOOK", 5)
    found = both(case, tmp_path, until_ci=0.4, lines=case.lines)
    assert 0 < summary(found)["logs"]["not_run"] < 24


def test_another_shape(case, tmp_path):
    corners = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 0.3) for z in (0.0, 2.0)])
    np.savetxt(tmp_path / "block.pts", corners)
    both(case, tmp_path, shape=str(tmp_path / "block.pts"), trees=case.trees)


def test_friction_by_cell_and_no_trajectories(case, tmp_path):
    both(case, tmp_path, friction=case.dem, friction_elsewhere=0.3, time_limit_s=3.0, trajectories="none")


def test_a_cancelled_run_continues(case, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    changes = {"scheduler": "local", "workers": 2, **case.everything()}
    alone = case.run(output=str(tmp_path / "alone"), **case.everything())

    class Stops(Quiet):
        done = False

        def progress(self, done: float, total: float, what: str) -> None:
            self.done = what == "sliding logs" and done > 8

        def cancelled(self) -> bool:
            return self.done

    with pytest.raises(Cancelled):
        case.run(Stops(), output=str(tmp_path / "run"), **changes)
    assert list(tmp_path.glob(".run.part/rasters_*.npz"))
    assert_same_bytes(alone, case.run(output=str(tmp_path / "run"), resume=True, **changes))


def table_of(tool, name: str, values: dict, folder: Path) -> list[str]:
    """The lines of a tool's table except times."""
    tool.TOOL(**values, output=str(folder))
    return [line for line in (folder / name).read_text().splitlines() if "cpu" not in line]


def on_workers(tool, name: str, values: dict, folder: Path) -> None:
    alone = table_of(tool, name, values, folder / "alone")
    assert alone == table_of(tool, name, {**values, "scheduler": "local", "workers": 2}, folder / "spread")
    assert len(alone) > 2


def test_compare_fidelity_of_one_log(case, tmp_path, monkeypatch):
    """One of its halves is empty; the picture is not checked."""
    monkeypatch.setattr("deadwood_algorithms.evaluate.fidelity.trade_figure.draw", lambda *given: None)
    values = case.values(fidelities="draft,standard", time_limit_s=5.0, output=None, logs=1)
    values = {name: value for name, value in values.items() if name not in ("fidelity", "trajectories")}
    on_workers(compare_fidelity, "comparison.csv", values, tmp_path)


@pytest.mark.parametrize("chunk", [4096, 7])
def test_value_trees(case, tmp_path, monkeypatch, names, chunk):
    """All kinds of obstacles and candidates, wherever pieces, chunks and obstacles end."""
    monkeypatch.setattr(changed_scenes, "CHUNK", chunk)
    monkeypatch.setattr(workers, "MOST_A_PIECE", 5)
    lying = write_layer(tmp_path / "lying.gpkg", [shapely.LineString([(18, 50), (30, 51)])], diameter_cm=[60.0])
    run = case.run(output=str(tmp_path / "run"), lying_logs=lying, **case.everything())
    spots = points((20.0, 50.0), (30.0, 60.0), (33.0, 45.0))
    plant = write_layer(tmp_path / "plant.gpkg", spots, dbh_cm=[80.0, 60.0, 60.0], height_m=[25.0, 1.3, 2.0])
    for name, where in (("alone", {}), ("spread", {"scheduler": "local", "workers": 2})):
        value_trees.TOOL(run=str(run), plant=plant, output=str(tmp_path / f"{name}.gpkg"), **where)
    assert_same_file(tmp_path / "alone.gpkg", tmp_path / "spread.gpkg")
    assert (gpd.read_file(tmp_path / "spread.gpkg", layer="values")["gain_logs"] != 0).any()
    assert {each.partition(" ")[0] for each in names} == {"value-trees-spread-logs"}


@pytest.mark.parametrize("chunk", [4096, 7])
def test_break_trees(case, tmp_path, monkeypatch, names, chunk):
    """Logs that lack one tree beside others that lack several."""
    monkeypatch.setattr(changed_scenes, "CHUNK", chunk)
    monkeypatch.setattr(workers, "MOST_A_PIECE", 5)
    run = case.run(output=str(tmp_path / "run"), **case.everything())
    found = []
    for name, where in (("alone", {}), ("spread", {"scheduler": "local", "workers": 2})):
        break_trees.TOOL(run=str(run), tree_capacity_kj=0.2, output=str(tmp_path / f"{name}.gpkg"), **where)
        found.append((tmp_path / f"{name}.gpkg").read_bytes())
    assert found[0] == found[1]
    assert gpd.read_file(tmp_path / "spread.gpkg", layer="broken")["n_broken"].sum() > 5
    assert {each.partition(" ")[0] for each in names} == {"break-trees-spread-logs"}


def test_value_trees_in_a_window_that_grows(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(layers, "WHOLE_CELLS", 100)  # heights are relative to zero in every window
    run = case.run(output=str(tmp_path / "run"), trees=case.trees, lines=case.lines)
    value_trees.TOOL(run=str(run), output=str(tmp_path / "alone.gpkg"))
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(windows, "WHOLE_CELLS", 100)
    monkeypatch.setattr(windows, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(windows, "SLOPE_MOST", 20.0)
    spread = {"output": str(tmp_path / "spread.gpkg"), "scheduler": "local", "workers": 2}
    value_trees.TOOL(feedback=said, run=str(run), **spread)
    assert any("is read wider" in each for each in said.notes)
    assert_same_file(tmp_path / "alone.gpkg", tmp_path / "spread.gpkg")


def test_site_barriers(case, tmp_path, monkeypatch, names):
    """Work begun ahead, or for a scene with another barrier, is never taken for the requested one."""
    monkeypatch.setattr(workers, "MOST_A_PIECE", 5)
    run = case.run(output=str(tmp_path / "run"), trees=case.trees, lines=case.lines, barriers=case.barriers)
    shapes = [shapely.LineString([(8.0 + x, 52.0), (24.0 + x, 51.0)]) for x in (0.0, 14.0, 28.0)]
    could = write_layer(tmp_path / "could.gpkg", shapes, barrier_id=["west", "middle", "east"])
    asked = {"run": str(run), "candidates": could, "height_m": "1,3", "count": 2}
    folders = [tmp_path / name for name in ("alone", "spread")]
    site_barriers.TOOL(**asked, output=str(folders[0]))
    site_barriers.TOOL(**asked, output=str(folders[1]), scheduler="local", workers=2)
    for name in ("pareto.csv", "barriers.gpkg", "barriers.png", "summary.json"):
        assert_same_file(folders[0] / name, folders[1] / name)
    assert (pd.read_csv(folders[0] / "pareto.csv")["gain_logs"] != 0).any()
    assert {each.partition(" ")[0] for each in names} == {"site-barriers-spread-logs"}


def test_site_barriers_at_contours_in_a_window_that_grows(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(layers, "WHOLE_CELLS", 100)  # heights are relative to zero in every window
    run = case.run(output=str(tmp_path / "run"), lines=case.lines)
    asked = {"run": str(run), "above_m": "8", "length_m": "15", "height_m": "4"}
    site_barriers.TOOL(**asked, output=str(tmp_path / "alone"))
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(windows, "WHOLE_CELLS", 100)
    monkeypatch.setattr(windows, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(windows, "SLOPE_MOST", 20.0)
    site_barriers.TOOL(feedback=said, **asked, output=str(tmp_path / "spread"), scheduler="local", workers=2)
    assert any("is read wider" in each for each in said.notes)
    for name in ("pareto.csv", "barriers.gpkg"):
        assert_same_file(tmp_path / "alone" / name, tmp_path / "spread" / name)


def sites(case: Case, folder: Path, feedback=None, **changes) -> Path:
    """run-sites on the two groups of the case's releases."""
    values = case.values(by="release_id", output=str(folder), **case.everything(), **changes)
    run_sites.TOOL(feedback=feedback, **values)
    return folder


def assert_same_sites(one: Path, other: Path) -> None:
    for site in "ab":
        assert_same_bytes(one / "sites" / site, other / "sites" / site)
        assert_same_file(one / "sites" / site / "run.gpkg", other / "sites" / site / "run.gpkg")
    rasters = sorted(each.name for each in (one / "merged" / "dem").glob("*.tif"))
    assert rasters == sorted(each.name for each in (other / "merged" / "dem").glob("*.tif")) != []
    for name in rasters:
        assert_same_file(one / "merged/dem" / name, other / "merged/dem" / name)


ON_TWO = {"scheduler": "local", "workers": 2}


def test_the_sites_of_run_sites_share_their_workers(case, said, tmp_path, monkeypatch):
    starts = []

    def once(distributed, number):
        starts.append(number)
        return threads_for_workers(distributed, number)

    monkeypatch.setattr(scheduler, "_local_cluster", once)
    alone = sites(case, tmp_path / "alone")
    spread = sites(case, tmp_path / "spread", said, **ON_TWO)
    assert starts == [2]
    assert sum("joins" in each for each in said.notes) == 2
    assert sum("bytes per log to the workers" in each for each in said.notes) == 1
    assert_same_sites(alone, spread)
    planned = case.values(by="release_id", output=str(tmp_path / "x"), plan=True, plan_logs=20, **ON_TWO)
    assert run_sites.TOOL(**planned).facts["logs"] == 24
    assert starts == [2, 2]


def test_sites_begun_on_workers_continue_without_them_and_the_other_way(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    alone = sites(case, tmp_path / "alone")

    class Stops(Quiet):
        done = False

        def progress(self, done: float, total: float, what: str) -> None:
            self.done = self.done or (what == "b (2 of 2): sliding logs" and done > 4)

        def cancelled(self) -> bool:
            return self.done

    for name, before, after in (("one", ON_TWO, {}), ("two", {}, ON_TWO)):
        with pytest.raises(Cancelled):
            sites(case, tmp_path / name, Stops(), **before)
        assert list(tmp_path.glob(f".{name}.part/sites/.b.part/rasters_*.npz"))
        slid = (tmp_path / f".{name}.part" / "sites" / "a" / "run.gpkg").stat().st_mtime_ns
        spread = sites(case, tmp_path / name, said, resume=True, **after)
        assert (spread / "sites" / "a" / "run.gpkg").stat().st_mtime_ns == slid
        assert not any("slid again" in each for each in said.notes)
        assert_same_sites(alone, spread)


def test_where_sites_slide_is_no_part_of_a_site(case, tmp_path):
    """A configuration may be the manifest of a run on workers that no longer exist; a table's column is refused."""
    folder = tmp_path / "configs"
    folder.mkdir()
    given = {"dem": case.dem, "releases": case.releases, "scheduler": "tcp://127.0.0.1:1", "workers": 3}
    (folder / "one.json").write_text(json.dumps(given))
    values = {"friction": "0.25", "fidelity": "draft", "dbh_cm": 40.0, "length_m": 10.0, "output": str(tmp_path / "x")}
    run_sites.TOOL(configs=str(folder), **values)
    table = tmp_path / "sites.csv"
    table.write_text(f"site,dem,releases,scheduler\none,{case.dem},{case.releases},local\n")
    with pytest.raises(UserError, match="'scheduler' is set by run-sites itself"):
        run_sites.TOOL(sites=str(table), **{**values, "output": str(tmp_path / "y")})


def test_lost_workers_are_no_fault_of_a_site(case, said, tmp_path, monkeypatch):
    """They end the run, keeping finished sites; they are not reported for every remaining site."""
    plain = workers.Workers.slide

    def lost_at_b(self, sliding, *words):
        if sliding.name.endswith("-b"):
            raise crew.NobodySlides("--scheduler local: the scheduler is lost; start it again")
        return plain(self, sliding, *words)

    monkeypatch.setattr(workers.Workers, "slide", lost_at_b)
    with pytest.raises(UserError, match="the scheduler is lost"):
        sites(case, tmp_path / "run", said, **ON_TWO)
    assert not (tmp_path / "run").exists()
    assert sum("1 finished site is kept" in each for each in said.notes) == 1
    alone = sites(case, tmp_path / "alone")
    assert_same_sites(alone, sites(case, tmp_path / "run", resume=True))


def test_tools_within_one_another_share_their_workers(said):
    with scheduler.workers_of("local", 1, 1, said) as one:
        with scheduler.workers_of("local", 1, 1, Quiet()) as other:
            assert one is other
        assert one is not None
        assert one.client.status == "running"
    assert one.client.status == "closed"
    with scheduler.workers_of(None, None, 1, said) as none:
        assert none is None


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"scheduler": "here"}, "--scheduler is 'here', but must be local or the address"),
        ({"scheduler": "http://127.0.0.1:8786"}, "must be local or the address of a Dask scheduler"),
        ({"scheduler": "tcp://127.0.0.1"}, "must be local or the address of a Dask scheduler"),
        ({"workers": 3}, "--workers needs --scheduler"),
        ({"scheduler": "tls://127.0.0.1:1"}, "Dask's configuration names no certificate for it"),
        ({"scheduler": "tcp://127.0.0.1:1"}, r"no scheduler answers there .*; start one with: dask scheduler"),
    ],
)
def test_what_is_no_scheduler_is_refused(case, tmp_path, monkeypatch, values, words):
    monkeypatch.setattr(scheduler, "CONNECT_S", 0.5)
    with pytest.raises(UserError, match=words):
        case.run(output=str(tmp_path / "run"), **values)
    assert list(tmp_path.iterdir()) == []


def test_without_dask_the_fix_is_reported(case, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"pip install 'deadwood-toolbox\[dask\]'"):
        case.run(output=str(tmp_path / "run"), scheduler="local")


def test_a_worker_that_computes_other_bits_is_not_used(case, tmp_path, monkeypatch):
    plain = crew.Crew.__init__

    def begin(self, *words, **named) -> None:
        plain(self, *words, **named)
        self._bits = "of another processor"

    monkeypatch.setattr(crew.Crew, "__init__", begin)
    with pytest.raises(UserError, match="no worker can be used: the same engine gives other bits"):
        case.run(output=str(tmp_path / "run"), scheduler="local", workers=1)


def test_workers_that_do_not_come_are_not_waited_for_long(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "WAIT_S", 0.5)
    case.run(said, output=str(tmp_path / "run"), scheduler="local", workers=STARTED + 1)
    assert sum(f"only {STARTED} have connected" in each for each in said.warnings) == 1
