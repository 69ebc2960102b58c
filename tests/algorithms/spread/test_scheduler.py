"""`--scheduler` on every way that logs are slid, with workers that are threads of the test; and what is refused."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from slope_case import Case, assert_same_bytes, points, summary, write_layer

from deadwood_algorithms import calibrate_friction, compare_fidelity, slide_logs, value_trees, vary
from deadwood_algorithms.scene import reach, read, window
from deadwood_algorithms.spread import scheduler, workers
from deadwood_algorithms.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.values import worth

STARTED = 2  # workers


@contextmanager
def threads_for_workers(distributed, number: int) -> Iterator[tuple[str, None]]:
    with distributed.LocalCluster(
        n_workers=min(number, STARTED),
        threads_per_worker=2,
        processes=False,
        dashboard_address=None,
        worker_dashboard_address=None,
    ) as cluster:
        yield cluster.scheduler_address, None


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch):
    monkeypatch.setattr(scheduler, "_local_cluster", threads_for_workers)


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def both(case: Case, folder: Path, said=None, **changes) -> Path:
    """The run on workers, found to be that without."""
    alone = case.run(output=str(folder / "alone"), **changes)
    spread = case.run(said, output=str(folder / "spread"), scheduler="local", workers=2, **changes)
    assert_same_bytes(alone, spread)
    return spread


def test_in_chunks_of_few_logs(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(slide_logs, "CHUNK", 5)
    monkeypatch.setattr(workers, "MOST_A_PIECE", 2)
    both(case, tmp_path, said, **case.everything())
    assert sum("joins in" in each for each in said.notes) == 2
    assert sum("bytes a log to the workers" in each for each in said.notes) == 1
    assert scheduler._open == {}


def test_pieces_have_names_for_readers_of_the_dashboard(case, tmp_path, monkeypatch):
    """Which of them the scheduler adds up as one kind of work: what comes before the logs."""
    from dask.utils import key_split

    names: list[str] = []
    plain = workers.Workers._send

    def send(self, piece, ready) -> None:
        plain(self, piece, ready)
        names.append(piece.future.key)

    monkeypatch.setattr(workers.Workers, "_send", send)
    case.run(output=str(tmp_path / "valley"), scheduler="local", workers=2, time_limit=1.0)
    found = [re.fullmatch(r"slide-logs-valley-logs (\d+) to (\d+) \([0-9a-f]{16}\)", each) for each in names]
    spans = sorted((int(each[1]), int(each[2])) for each in found if each)
    assert len(spans) == len(names) > 1
    assert [first for first, _ in spans] == [0, *(last + 1 for _, last in spans[:-1])]
    assert spans[-1][1] == 23
    assert {key_split(each) for each in names} == {"slide-logs-valley"}


def test_in_a_window_that_grows(case, said, tmp_path, monkeypatch):
    """What was begun ahead on the smaller window is dropped, drawn cells and all."""
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(window, "WHOLE_CELLS", 100)
    monkeypatch.setattr(read, "WHOLE_CELLS", 100)
    monkeypatch.setattr(window, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(window, "SLOPE_MOST", 20.0)
    monkeypatch.setattr(slide_logs, "CHUNK", 3)
    both(case, tmp_path, said, **case.everything())
    assert any("is read wider" in each for each in said.notes)


def test_until_the_interval_is_narrow(case, tmp_path, monkeypatch):
    monkeypatch.setattr(slide_logs, "CHUNK", 4)
    monkeypatch.setattr("deadwood_algorithms.runs.queue.FIRST_LOOK", 5)
    found = both(case, tmp_path, until_ci=0.4, lines=case.lines)
    assert 0 < summary(found)["logs"]["not_run"] < 24


def test_another_shape(case, tmp_path):
    corners = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 0.3) for z in (0.0, 2.0)])
    np.savetxt(tmp_path / "block.pts", corners)
    both(case, tmp_path, shape=str(tmp_path / "block.pts"), trees=case.trees)


def test_friction_by_cell_and_no_trajectories(case, tmp_path):
    both(case, tmp_path, friction=case.dem, friction_elsewhere=0.3, time_limit=3.0, trajectories="none")


def test_a_cancelled_run_goes_on(case, tmp_path, monkeypatch):
    monkeypatch.setattr(slide_logs, "CHUNK", 4)
    monkeypatch.setattr(slide_logs, "CHECKPOINT_S", 0.0)
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
    """The lines of a tool's table that are no times."""
    tool.TOOL(**values, output=str(folder))
    return [line for line in (folder / name).read_text().splitlines() if "cpu" not in line]


def on_workers(tool, name: str, values: dict, folder: Path) -> None:
    alone = table_of(tool, name, values, folder / "alone")
    assert alone == table_of(tool, name, {**values, "scheduler": "local", "workers": 2}, folder / "spread")
    assert len(alone) > 2


def test_compare_fidelity(case, tmp_path):
    values = case.values(fidelities="draft,standard", time_limit=5.0, output=None, **case.everything())
    values = {name: value for name, value in values.items() if name not in ("fidelity", "trajectories")}
    on_workers(compare_fidelity, "comparison.csv", values, tmp_path)


def test_compare_fidelity_of_one_log(case, tmp_path, monkeypatch):
    """Of which one half is empty; the picture of so little is not what is looked at."""
    monkeypatch.setattr("deadwood_algorithms.fidelity.picture.draw", lambda *given: None)
    values = case.values(fidelities="draft,standard", time_limit=5.0, output=None, logs=1)
    values = {name: value for name, value in values.items() if name not in ("fidelity", "trajectories")}
    on_workers(compare_fidelity, "comparison.csv", values, tmp_path)


def test_calibrate_friction(case, tmp_path):
    observed = write_layer(tmp_path / "observed.gpkg", points((30.0, 40.0), (28.0, 50.0)))
    values = case.values(friction="0.2,0.3,0.4", observed=observed, time_limit=10.0, error_m=5.0, output=None)
    on_workers(
        calibrate_friction, "calibration.csv", {k: v for k, v in values.items() if k != "trajectories"}, tmp_path
    )


def test_vary(case, tmp_path):
    values = case.values(vary="friction=0.15:0.3,rolling_friction", design="ends", time_limit=5.0, output=None)
    values |= case.everything()
    del values["trajectories"]
    on_workers(vary, "runs.csv", values, tmp_path)
    on_workers(vary, "tornado.csv", {**values, "overwrite": True}, tmp_path)


@pytest.mark.parametrize("chunk", [4096, 7])
def test_value_trees(case, tmp_path, monkeypatch, chunk):
    """All kinds of obstacles and candidates; where pieces, chunks and obstacles end has nothing to do with each other."""
    monkeypatch.setattr(worth, "CHUNK", chunk)
    monkeypatch.setattr(workers, "MOST_A_PIECE", 5)
    lying = write_layer(tmp_path / "lying.gpkg", [shapely.LineString([(18, 50), (30, 51)])], diameter_cm=[60.0])
    run = case.run(output=str(tmp_path / "run"), lying_logs=lying, **case.everything())
    spots = points((20.0, 50.0), (30.0, 60.0), (33.0, 45.0))
    plant = write_layer(tmp_path / "plant.gpkg", spots, dbh_cm=[80.0, 60.0, 60.0], height_m=[25.0, 1.3, 2.0])
    found = []
    for name, where in (("alone", {}), ("spread", {"scheduler": "local", "workers": 2})):
        value_trees.TOOL(run=str(run), plant=plant, output=str(tmp_path / f"{name}.gpkg"), **where)
        found.append((tmp_path / f"{name}.gpkg").read_bytes())
    assert found[0] == found[1]
    assert (gpd.read_file(tmp_path / "spread.gpkg", layer="values")["gain_logs"] != 0).any()


def test_value_trees_in_a_window_that_grows(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(read, "WHOLE_CELLS", 100)  # heights are counted from zero in every window
    run = case.run(output=str(tmp_path / "run"), trees=case.trees, lines=case.lines)
    value_trees.TOOL(run=str(run), output=str(tmp_path / "alone.gpkg"))
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(window, "WHOLE_CELLS", 100)
    monkeypatch.setattr(window, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(window, "SLOPE_MOST", 20.0)
    spread = {"output": str(tmp_path / "spread.gpkg"), "scheduler": "local", "workers": 2}
    value_trees.TOOL(feedback=said, run=str(run), **spread)
    assert any("is read wider" in each for each in said.notes)
    assert (tmp_path / "alone.gpkg").read_bytes() == (tmp_path / "spread.gpkg").read_bytes()


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


def test_without_dask_the_mend_is_said(case, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"pip install 'deadwood-toolbox\[dask\]'"):
        case.run(output=str(tmp_path / "run"), scheduler="local")


def test_a_worker_that_computes_other_bits_is_not_used(case, tmp_path, monkeypatch):
    plain = workers.Workers.__init__

    def begin(self, *words, **named) -> None:
        plain(self, *words, **named)
        self._bits = "of another processor"

    monkeypatch.setattr(workers.Workers, "__init__", begin)
    with pytest.raises(UserError, match="no worker can be used: the same engine gives other bits"):
        case.run(output=str(tmp_path / "run"), scheduler="local", workers=1)


def test_workers_that_do_not_come_are_not_waited_for_long(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "WAIT_S", 0.5)
    case.run(said, output=str(tmp_path / "run"), scheduler="local", workers=STARTED + 1)
    assert sum(f"only {STARTED} have come" in each for each in said.warnings) == 1
