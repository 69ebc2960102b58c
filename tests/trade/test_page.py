"""The study's page agrees with its results file and has no number typed by hand."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import page, plan, scenes, study
from benchmarks.settings import SETTINGS
from deadwood_engine import FIDELITIES, place_logs

RESULTS = study.read_results()


def test_page_and_short_table_are_those_of_the_results_file():
    def told(text):
        """The page without its note on the present engine: its digest depends on the version of Python."""
        return [line for line in text.splitlines() if not line.startswith("- **the engine has changed since**")]

    assert told(page.PAGE.read_text(encoding="utf-8")) == told(page.page(RESULTS))
    short = page.SHORT.read_text(encoding="utf-8")
    assert page.MARKS.search(short)
    assert page.with_snippet(short, RESULTS) == short


def test_figures_of_the_page_are_there_and_small():
    named = re.findall(r"\(figures/([a-z_]+\.png)\)", page.PAGE.read_text(encoding="utf-8"))
    assert len(named) >= 5
    for name in named:
        assert 1_000 < (page.HERE / "figures" / name).stat().st_size < 400_000


def test_every_fidelity_is_measured_with_the_numbers_that_it_has_today():
    if page.stale(RESULTS):
        pytest.skip("the page says in its first line that it is of the engine before")
    for case in RESULTS["scenes"]:
        for name, row in FIDELITIES.items():
            assert RESULTS["entries"][case][name]["fidelity"] == study.rounded(row._asdict()), (case, name)


def test_the_tools_know_the_costs_and_errors_of_the_page():
    source = page.TRADE.read_text(encoding="utf-8")
    assert [found[2] for found in page.TABLES.finditer(source)] == ["COSTS", "REACH_ERRORS"]
    assert page.with_trade(source, RESULTS) == source


def test_every_number_says_where_it_comes_from():
    for entries in RESULTS["entries"].values():
        for entry in entries.values():
            assert entry["logs"] >= 200
            assert {"commit", "engine", "machine", "versions", "date"} <= entry["source"].keys()


def test_settings_have_names_of_their_own_and_something_to_be_compared_with():
    assert all(name == setting.name for name, setting in SETTINGS.items())
    assert {setting.against for setting in SETTINGS.values()} <= SETTINGS.keys()
    keys = [repr(replace(setting, name="", group="", value=0.0, against="")) for setting in SETTINGS.values()]
    doubled = {s.name for s, key in zip(SETTINGS.values(), keys, strict=True) if keys.count(key) > 1}
    assert not doubled


def test_plan_has_every_setting_and_what_it_is_compared_with():
    planned: dict[tuple[str, str], int] = {}
    for part in plan.PLAN:
        for scene in part.scenes:
            for name in part.settings:
                planned[scene, name] = max(part.logs, planned.get((scene, name), 0))
    assert {name for _, name in planned} == SETTINGS.keys()
    assert {scene for scene, _ in planned} == scenes.CASES.keys() == plan.PILOT_MS.keys()
    for (scene, name), logs in planned.items():
        assert planned[scene, SETTINGS[name].against] >= logs


def test_more_logs_continue_the_same_logs():
    first, again = scenes.logs_of_block(3, 50), scenes.logs_of_block(3, 50)
    assert np.array_equal(first.x, again.x)
    assert first.log_id[0] == 150
    assert not np.array_equal(first.x, scenes.logs_of_block(4, 50).x)


@pytest.mark.parametrize("name", list(scenes.CASES))
def test_scenes_are_what_they_are_called(name):
    built, case = scenes.build(name), scenes.CASES[name]
    assert case.line in scenes.LINES_Y
    assert built.scene.tree_count == round(case.stems * scenes.WIDTH * scenes.LENGTH / 1e4)
    assert built.scene.barrier_count == len(case.fences)
    start = place_logs(built.scene, scenes.logs_of_block(0, 50))
    assert np.isfinite(start.state).all()


def test_coarser_cells_are_means_of_the_same_ground():
    fine, coarse = scenes.ground("cliff", 0.5), scenes.ground("cliff", 2.0)
    assert coarse.shape == (200, 120)
    assert coarse[3, 5] == pytest.approx(fine[12:16, 20:24].mean())


def test_a_scene_with_other_friction_is_another_scene():
    digests = {scenes.build("rough", friction_change=d).digest for d in (0.0, 0.01)} | {scenes.build("cliff").digest}
    assert len(digests) == 3


def test_parts_of_the_plan_are_chosen_by_name():
    assert plan.chosen([]) == (list(plan.PLAN), list(plan.SECTIONS))
    parts, studies = plan.chosen(["posture", "noise"])
    assert ([part.what for part in parts], studies) == (["posture of the released logs"], ["noise"])
    with pytest.raises(SystemExit, match="no part of the plan"):
        plan.chosen(["postures"])


def test_postures_change_nothing_but_how_logs_stand():
    logs = scenes.logs_of_block(0, 20)
    upright, lying, any_way = (scenes.in_posture(logs, each) for each in scenes.POSTURES)
    assert (upright.orientation == 0).all()
    assert (lying.orientation == 1).all()
    assert (any_way.orientation == 1).all()
    assert np.array_equal(any_way.azimuth, logs.azimuth)
    start = place_logs(scenes.build("plane").scene, lying)
    assert (start.state[:, 14] < -0.9).all()  # the axis points down the slope, to the south
    assert np.array_equal(lying.diameter, logs.diameter)
