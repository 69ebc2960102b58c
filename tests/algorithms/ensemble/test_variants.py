"""Variants of a simulation, in chunks, compared with calls of the engine; and files that are opened once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from slope_case import Case

from deadwood_algorithms.ensemble.variants import Variant, hits_of, joined, open_ensemble
from deadwood_algorithms.files import dem_windows
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene import layers as scene_layers
from deadwood_algorithms.scene import reach
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.scene.releases import reached
from deadwood_algorithms.simulate import chunks, windows
from deadwood_algorithms.simulate.steps import Steps
from deadwood_engine import FIDELITIES, Rasters, slide

WANTED = ("reach", "x", "y", "runout", "steps", "stop_reason")


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def inputs_of(case: Case, **changes: Any) -> Any:
    values = case.values(**case.everything(), **changes)
    names = {each for each in ReleasedScene.__dataclass_fields__ if each in values}
    return ReleasedScene(**{name: values[name] for name in names}).inputs()


def test_variants_are_what_the_engine_slides(case, tmp_path, monkeypatch):
    """Another friction, another fidelity, other sizes: the same bits as one call each; and the cells that were hit."""
    monkeypatch.setattr(chunks, "CHUNK", 5)
    with open_ensemble(inputs_of(case), FIDELITIES["draft"], Where(2), 24, 0, Quiet()) as ensemble:
        simulation, layers, releases = ensemble.simulation, ensemble.layers, ensemble.logs
        thick = replace(releases.logs, diameter=1.2 * releases.logs.diameter)
        variants = [
            Variant("smooth", simulation, lambda on: replace(on, scene=on.scene.with_friction(0.15))),
            Variant("finer", replace(simulation, fidelity=FIDELITIES["standard"])),
            Variant("thick", simulation, None, lambda logs: replace(logs, diameter=1.2 * logs.diameter)),
        ]
        steps = Steps(str(tmp_path / "run"), {}, resume=False, feedback=Quiet())
        found = ensemble.slide(variants, WANTED, steps, borders=(12,), hits=True)
        asked = (
            (layers.scene.with_friction(0.15), releases.logs, "draft"),
            (layers.scene, releases.logs, "standard"),
            (layers.scene, thick, "draft"),
        )
        for parts, (scene, logs, fidelity) in zip(found, asked, strict=True):
            assert [part["x"].size for part in parts] == [5, 5, 2, 5, 5, 2]
            rasters = Rasters.allocate(scene, 1)
            alone = slide(scene, logs, FIDELITIES[fidelity], **simulation.laws, threads=1, rasters=rasters)
            assert np.array_equal(joined(parts, "x"), alone.end_position[:, 0])
            assert np.array_equal(joined(parts, "y"), alone.end_position[:, 1])
            assert np.array_equal(joined(parts, "steps"), alone.steps)
            assert np.array_equal(joined(parts, "stop_reason"), alone.stop_reason)
            assert np.array_equal(joined(parts, "reach"), reached(layers.lines, {"reach": alone.reach}, releases))
            count = rasters.totals()["hit_count"]
            cells, shares = hits_of(parts, 24)
            assert np.array_equal(cells, np.flatnonzero(count))
            assert np.array_equal(shares, count[count > 0] / 24)
        assert not np.array_equal(joined(found[0], "x"), joined(found[1], "x"))


def test_no_chunks_are_no_cells():
    cells, shares = hits_of([], 0)
    assert cells.size == shares.size == 0


def test_the_terrain_model_is_opened_once_and_the_lines_are_read_once(case, tmp_path, monkeypatch, said):
    """Although the window grows and the scene is read again each time."""
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(windows, "WHOLE_CELLS", 100)
    monkeypatch.setattr(windows, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(windows, "SLOPE_MOST", 20.0)
    opened: list[str] = []
    for module, name in ((dem_windows, "open_dem"), (scene_layers, "lines_layer")):
        plain = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *words, plain=plain, name=name: (opened.append(name), plain(*words))[1]
        )
    monkeypatch.setattr("deadwood_algorithms.simulate.simulation.lines_layer", scene_layers.lines_layer)
    case.run(said, output=str(tmp_path / "run"), trees=case.trees, lines=case.lines)
    assert any("is read wider" in note for note in said.notes)
    assert sorted(opened) == ["lines_layer", "open_dem"]
