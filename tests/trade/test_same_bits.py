"""Two engines compared bit for bit, and the page's note on an engine that gives the same bits as the measured one."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks import page, same_bits, scenes, study
from benchmarks.settings import SETTINGS
from deadwood_engine import FIDELITIES, slide

MEASURED, OTHER = "a" * 16, "b" * 16


def test_combinations_are_all_there_is():
    every = list(same_bits.combinations())
    assert len(every) == len({same_bits.name_of(each) for each in every}) >= 40
    assert {row for _, row, _, _ in every} == FIDELITIES.keys()
    assert {name for name, _, _, _ in every} == {*scenes.CASES, "littered"}


def test_logs_of_the_littered_scene_meet_trees_lying_logs_and_boulders():
    scene = same_bits._scene("littered")
    result = slide(
        scene, scenes.logs_of_block(0, same_bits.LOGS), FIDELITIES["draft"], time_limit=60.0, influences=True
    )
    item = result.influences.item
    assert (item < scene.tree_count).any()
    assert ((item >= scene.tree_count) & (item < scene.tree_count + scene.lying_count)).any()
    assert (item >= scene.tree_count + scene.lying_count).any()


def test_the_same_engine_gives_the_same_fingerprint_in_another_process():
    first = next(same_bits.combinations())
    ours, told = same_bits.fingerprint(first), same_bits.ask(study.HERE.parent, most=1)
    assert told == {same_bits.name_of(first): ours}
    assert {"result.end_position", "result.poses.position", "result.hits.impulse", "rasters.speed_max"} <= ours.keys()
    assert not any(what.startswith("result.cost") for what in ours)


def test_one_bit_is_a_difference_and_a_new_array_is_none():
    array = np.linspace(0.0, 1.0, 5)
    other = array.copy()
    other[3] = np.nextafter(other[3], 2.0)
    mine, theirs = ({"x": same_bits._digest_of(a)} for a in (array, other))
    assert same_bits.different({"one": mine}, {"one": theirs}) == ["one: 1 of 1 arrays, x"]
    assert not same_bits.different({"one": mine}, {"one": mine | {"y": "new"}})
    assert same_bits.only_one_has({"one": mine}, {"one": mine | {"y": "new"}}) == ["y"]
    assert same_bits._digest_of(array) != same_bits._digest_of(array.astype(np.float32))
    assert same_bits._digest_of(array) != same_bits._digest_of(array.reshape(5, 1))


@pytest.fixture
def results(tmp_path, monkeypatch):
    """A separate results file, measured with another engine, whose digests are given here."""
    now = study.engine_digest()
    found = study.read_results()
    for mine in found["entries"].values():
        for entry in mine.values():
            entry["source"] = entry["source"] | {"engine": MEASURED}
    found.pop("same_bits", None)
    monkeypatch.setattr(study, "RESULTS", tmp_path / "results.json")
    study.write_results(found)
    digests = {("measured", True): MEASURED, ("measured", False): "c" * 16, ("other", True): OTHER}
    real = study._digest
    monkeypatch.setattr(study, "_digest", lambda folder, barriers=True: digests.get((folder, barriers)) or OTHER
                        if isinstance(folder, str) else real(folder, barriers))  # fmt: skip
    return now


def certify(folder: str) -> str:
    return study.certify(folder, combinations=44, logs=6)  # type: ignore[arg-type]


def test_an_engine_that_was_not_measured_certifies_nothing(results):
    assert "not the measured one" in certify("other")
    assert study.certificates() == []
    assert study.measured_as() == results
    assert f"(sources now {results})" in page.stale(study.read_results())


def test_an_engine_with_the_measured_bits_is_as_good_as_measured(results):
    before = study.folder_of("rough", SETTINGS["draft"]), study.folder_of("barriers", SETTINGS["draft"])
    assert f"sources {results} give the same bits" in certify("measured")
    assert "noted" in certify("measured")  # again
    assert [each["engine"] for each in study.certificates()] == [results]
    assert (study.measured_as(), study.measured_as(barriers=False)) == (MEASURED, "c" * 16)
    told = page.provenance(study.read_results())
    assert page.stale(study.read_results()) == ""
    assert f"**the engine of sources {results} gives the same bits** as the measured one ({MEASURED})" in told
    assert "44 combinations of scene, fidelity and law with 6 logs each" in told
    assert study.provenance()["engine"] == MEASURED  # later measurements count together with the rest
    after = study.folder_of("rough", SETTINGS["draft"]), study.folder_of("barriers", SETTINGS["draft"])
    assert before[0] != after[0]
    assert before[1] != after[1]


def test_a_certificate_of_a_certificate_leads_back_to_what_was_measured(results, monkeypatch):
    certify("measured")
    monkeypatch.setattr(study, "engine_digest", lambda barriers=True: "d" * 16)
    monkeypatch.setattr(study, "_digest", lambda folder, barriers=True: results)
    assert "noted" in certify("an engine that is certified")
    rows = {each["engine"]: each["as"] for each in study.certificates()}
    assert rows == {results: MEASURED, "d" * 16: MEASURED}


def test_certificates_go_with_the_entries_that_they_are_of(results, monkeypatch):
    certify("measured")
    assert json.loads(study.RESULTS.read_text())["same_bits"]
    study.summarise([], [])
    assert study.certificates()
    found = study.read_results()
    for mine in found["entries"].values():
        for entry in mine.values():
            entry["source"] |= {"engine": OTHER}
    study.write_results(found)
    study.summarise([], [])
    assert not study.certificates()
