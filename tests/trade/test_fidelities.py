"""The fidelities are as accurate as stated on the benchmark page: measured again, on fewer logs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks import measures, scenes, study, tables
from deadwood_engine import FIDELITIES, Rasters, Result, slide

pytestmark = pytest.mark.slow
LOGS = 400
RESULTS = study.read_results()


@cache
def slid(scene: str, fidelity: str) -> tuple[Result, np.ndarray]:
    built = scenes.build(scene)
    logs = scenes.logs_of_block(1000, LOGS)  # none that the study has used
    rasters = Rasters.allocate(built.scene, 2)
    slide(built.scene, scenes.logs_of_block(0, 2), FIDELITIES[fidelity], time_limit=0.1)  # compiled before it is timed
    options = {"time_limit": study.TIME_LIMIT, "threads": 2}
    result = slide(built.scene, logs, FIDELITIES[fidelity], rasters=rasters, **options)
    return result, rasters.totals()["hit_count"]


def stated(scene: str, fidelity: str) -> dict:
    """What the page states for a scene; skipped if the scene has changed, until it is measured again."""
    measured, case = RESULTS["scenes"].get(scene, {}), scenes.CASES[scene]
    if (measured.get("friction"), measured.get("line_y")) != (case.friction, case.line):
        pytest.skip(f"the page was measured before the scene {scene} was changed")
    return RESULTS["entries"][scene][fidelity]


@pytest.mark.parametrize("scene", ["forest", "cliff"])
@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_reach_is_what_the_page_states(scene, fidelity):
    result, _ = slid(scene, fidelity)
    record, share = stated(scene, fidelity)["reach"], result.reach[:, scenes.CASES[scene].line_row].mean()
    error = np.sqrt(record["p"] * (1 - record["p"]) * (1 / LOGS + 1 / stated(scene, fidelity)["logs"]))
    assert abs(share - record["p"]) < 3.5 * error


@pytest.mark.parametrize(("fidelity", "bound"), [("standard", 0.01), ("draft", 0.025)])
def test_difference_from_a_finer_fidelity_is_not_beyond_the_promise(fidelity, bound):
    """Against ``fine``, which the page compares with the reference: this many logs only exclude gross errors."""
    records = []
    for scene in ("forest", "cliff"):
        line = scenes.CASES[scene].line_row
        records.append(
            measures.reach_difference(slid(scene, fidelity)[0].reach[:, line], slid(scene, "fine")[0].reach[:, line])
        )
    pooled = measures.pooled_difference(records)
    assert abs(pooled["delta"]) < bound + 3.0 * pooled["se"]


@pytest.mark.parametrize("scene", ["forest", "cliff"])
def test_penetration_is_what_the_page_states(scene):
    for fidelity in ("draft", "standard"):
        depth = slid(scene, fidelity)[0].penetration_max
        record = stated(scene, fidelity)["penetration_m"]
        assert np.median(depth) == pytest.approx(record["median"], rel=0.2)
        assert np.quantile(depth, 0.99) < 1.5 * record["p99"]
    assert np.median(slid(scene, "standard")[0].penetration_max) < np.median(slid(scene, "draft")[0].penetration_max)


def test_draft_is_as_much_faster_as_the_page_states():
    spent = [slid(scene, name)[0].cost["cpu_s"] for name in ("standard", "draft") for scene in ("forest", "cliff")]
    ratio = np.sqrt(spent[0] / spent[2] * spent[1] / spent[3])
    assert ratio > 0.6 / tables.relative_cost(RESULTS, "draft")


@pytest.mark.parametrize("scene", ["forest", "cliff"])
def test_hit_rasters_of_standard_differ_from_fine_no_more_than_runs_of_other_logs_do(scene):
    ours, theirs = slid(scene, "standard")[1], slid(scene, "fine")[1]
    floor = stated(scene, "standard")["error"]["hits_jaccard_floor"]
    floor *= np.sqrt(stated(scene, "standard")["error"]["logs"] / LOGS)
    assert measures.jaccard_distance(ours, theirs) < 1.2 * floor


@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_no_log_fails_and_no_contact_makes_energy(fidelity):
    for scene in ("forest", "cliff"):
        result, _ = slid(scene, fidelity)
        assert not np.any(result.stop_reason == 5)
        assert result.energy_error.max() < 0.01
        assert result.unconverged.sum() / result.steps.sum() < 0.01


def test_logs_that_rock_in_place_stay():
    """In the gully most logs end by rolling to and fro: what they do afterwards moves reach by a log in 200 at most.

    Of those at rest, 1.6 % move more than a metre if they are calculated to the time limit, the farthest by
    4 m, and one missed one of 13 lines (800 logs at draft). Three times that share would be another rule.
    """
    scene, logs = scenes.build("gully").scene, scenes.logs_of_block(0, 200)
    row = FIDELITIES["draft"]
    watched, endless = (
        slide(scene, logs, row, time_limit=study.TIME_LIMIT, threads=2, rest_speed=speed) for speed in (0.1, 1e-9)
    )
    rested = watched.duration < endless.duration
    assert rested.mean() > 0.4
    moved = np.linalg.norm(watched.end_position - endless.end_position, axis=1)[rested]
    assert np.mean(moved > 1.0) < 0.05
    assert moved.max() < 10.0
    assert np.abs(watched.reach.mean(axis=0) - endless.reach.mean(axis=0)).max() <= 0.005
