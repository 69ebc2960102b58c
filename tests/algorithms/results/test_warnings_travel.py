"""A warning of an input is in the run that uses it, and in what is made from the run: manifest, summary, tables."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from slope_case import Case, points, summary, write_dem, write_layer

from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.tools import import_trees, lateral_spread

CELL_M = 5.0


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """On cells of 5 m, with two trees at one place that import-trees has warned of."""
    found = Case(tmp_path_factory.mktemp("warned"))
    found.dem = write_dem(found.folder / "coarse.tif", cell=CELL_M)
    twice = write_layer(
        found.folder / "twice.gpkg",
        points((5.0, 40.0), (5.0, 40.0), (50.0, 60.0)),
        tree_id=[1, 2, 3],
        dbh_cm=[40.0, 41.0, 42.0],
        height_m=[20.0, 21.0, 22.0],
    )
    found.trees = str(found.folder / "stand.gpkg")
    import_trees.TOOL(trees=twice, output=found.trees)
    return found


@pytest.fixture(scope="module")
def run(case: Case) -> Path:
    return case.run(trees=case.trees, lines=case.lines, time_limit_s=20.0)


def warned(record: dict) -> dict[str, dict]:
    return {each["code"]: each["numbers"] for each in record["warnings"] if each["level"] == "warning"}


def test_a_run_on_coarse_cells_says_so_in_manifest_and_summary(run):
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    for record in (manifest, summary(run)):
        assert warned(record)["coarse-cells"]["cell_m"] == CELL_M


def test_the_warning_of_an_input_reaches_the_run(case, run):
    with closing(sqlite3.connect(case.trees)) as db:
        x, y, n = db.execute("SELECT min(tree_id), max(tree_id), count(*) FROM trees").fetchone()
    assert (x, y, n) == (1, 3, 3)
    record = record_in(Path(case.trees))
    assert record is not None
    assert warned(record)["same-position"] == {"trees": 1}
    assert warned(summary(run))["same-position"] == {"trees": 1}


def test_what_is_made_from_the_run_repeats_it(case, run, said):
    place = case.folder / "spread.gpkg"
    lateral_spread.TOOL(feedback=said, deposits=str(run), output=str(place))
    record = record_in(place)
    assert record is not None
    assert warned(record)["coarse-cells"]["cell_m"] == CELL_M
    assert sum("coarse" in each for each in said.warnings) == 1


def test_without_cause_nothing_is_warned_of(tmp_path):
    fine = Case(tmp_path)
    assert warned(summary(fine.run(friction="0.6", trajectories="none"))) == {}
