"""The same logs in several variants of a simulation, paired: another friction, fidelity, size, or other obstacles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene.counts import NOT_RUN
from deadwood_algorithms.scene.inputs import SceneInputs
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, reached
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.look import look
from deadwood_algorithms.simulate.queue import parts_of
from deadwood_algorithms.simulate.simulation import Simulation, open_simulation
from deadwood_algorithms.simulate.sliding import reporter, slide_batch, until_none_escapes, workers_for
from deadwood_algorithms.simulate.steps import Unkept
from deadwood_algorithms.simulate.warm_up import load_kernels
from deadwood_algorithms.simulate.windows import read_released_scene
from deadwood_engine import Fidelity, Logs, Rasters, Result

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Variant:
    """One member of an ensemble.

    what : shown with its progress; scene, logs : make its own scene and logs from those that were read
    """

    what: str
    simulation: Simulation
    scene: Callable[[SceneLayers], SceneLayers] | None = None
    logs: Callable[[Logs], Logs] | None = None


@dataclass
class Ensemble:
    """The logs of a simulation, to be slid in several variants, in chunks that are kept.

    layers : the scene as it was read; its window grows if logs come near its sides, also for later variants
    released : all logs of the layer; logs : a random subset of them
    """

    simulation: Simulation
    layers: SceneLayers
    released: Releases
    logs: Releases
    feedback: Feedback
    _made: tuple[Variant, SceneLayers, SceneLayers] | None = field(default=None, init=False, repr=False)

    def slide(
        self,
        variants: Sequence[Variant],
        wanted: Sequence[str],
        steps: Unkept,
        *,
        borders: tuple[int, ...] = (),
        hits: bool = False,
    ) -> list[list[Arrays]]:
        """For each variant, the stored outcomes of each chunk of logs.

        wanted : names of `outcomes_of_logs`; hits : whether the cells that were hit are stored, too
        borders : numbers of logs after which a chunk ends
        """
        load_kernels(self.layers.shape, self.feedback)
        n, total = len(self.logs), len(variants) * len(self.logs)
        parts = parts_of(n, chunks.CHUNK, borders)
        kept = (*wanted, "cells", "hits") if hits else wanted

        def one(variant: Variant, first: int, before: int) -> Arrays:
            did = self._slide(variant, parts[first:], before, total, hits=hits)
            return {name: did[name] for name in kept}

        with workers_for(self.simulation.where, self.feedback):
            found = [
                [
                    steps.take(part.stop - part.start, lambda v=v, p=p, k=k: one(v, p, k * n))
                    for p, part in enumerate(parts)
                ]
                for k, v in enumerate(variants)
            ]
        self.feedback.progress(total, total, "sliding logs")
        return found

    def _slide(self, variant: Variant, parts: Sequence[slice], before: int, total: int, *, hits: bool) -> Arrays:
        """Slide the first of these chunks; the workers of a scheduler may already start on the others."""
        logs = variant.logs(self.logs.logs) if variant.logs else self.logs.logs
        some = self.logs.take(parts[0])

        def batch(part: slice) -> Batch:
            return Batch(logs.take(part), first=before + part.start, goal=before + parts[-1].stop)

        def slide_part(on: SceneLayers) -> tuple[Arrays, list[str]]:
            layers = self._scene_of(variant, on)
            rasters = Rasters.allocate(layers.scene, layers.threads, maxima=False) if hits else None
            report = reporter(self.feedback, total, variant.what, before=before + parts[0].start)
            later: Iterable[Batch] = (batch(part) for part in parts[1:])
            result, sides = slide_batch(
                layers, batch(parts[0]), variant.simulation, report, rasters=rasters, later=later
            )
            did = outcomes_of_logs(result, layers.lines, some)
            return did | (cells_hit(rasters, layers) if rasters and not sides else {}), sides

        did, self.layers = until_none_escapes(self.layers, variant.simulation, slide_part, self.feedback)
        return did

    def _scene_of(self, variant: Variant, on: SceneLayers) -> SceneLayers:
        """The variant's scene, made once for all its chunks, so that a scheduler's workers recognise it as the same
        one.
        """
        if variant.scene is None:
            return on
        if self._made is None or self._made[0] is not variant or self._made[1] is not on:
            self._made = variant, on, variant.scene(on)
        return self._made[2]


@contextmanager
def open_ensemble(
    inputs: SceneInputs, fidelity: Fidelity, where: Where, most: int, seed: int, feedback: Feedback
) -> Iterator[Ensemble]:
    """Read the scene and the logs, and draw at most ``most`` of them; the terrain model stays open."""
    with open_simulation(inputs, fidelity, where, feedback) as simulation:
        layers, released = read_released_scene(simulation, feedback)
        logs = released.take(hash_order(released.logs.log_id, seed)[:most])
        account("releases", count_of(len(released), len(logs), {NOT_RUN: len(released) - len(logs)}))
        look(simulation, layers, logs, seed, feedback)
        yield Ensemble(simulation, layers, released, logs, feedback)


def outcomes_of_logs(result: Result, lines: Items, releases: Releases) -> Arrays:
    """Outcomes of each log; ``cpu_s`` is the total."""
    end, start = result.end_position, result.release_position
    by_name = ("speed_max", "jump_max", "penetration_max", "energy_error", "steps", "unconverged")
    return {
        "reach": reached(lines, {"reach": result.reach}, releases),
        "x": end[:, 0],
        "y": end[:, 1],
        "runout": np.hypot(*(end - start)[:, :2].T),
        "stop_reason": np.asarray(result.stop_reason, np.int8),
        **{name: getattr(result, name) for name in by_name},
        "cpu_s": np.array([result.cost["cpu_s"]]),
    }


def cells_hit(rasters: Rasters, layers: SceneLayers) -> Arrays:
    """The cells that logs hit, numbered in the whole DEM because they are few in a large one, and how many logs hit
    each.
    """
    count, grid = rasters.totals(("hit_count",))["hit_count"], layers.dem
    row, column = np.nonzero(count)
    cells = (row + grid.first[1]) * grid.frame.shape[1] + column + grid.first[0]
    return {"cells": cells, "hits": count[row, column]}


def joined(parts: Sequence[Arrays], name: str) -> NDArray[Any]:
    """One array over all logs, joined from the arrays of the chunks."""
    return np.concatenate([part[name] for part in parts])


def hits_of(parts: Sequence[Arrays], n_logs: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The cells that the logs of these chunks hit, ascending, and the share of the logs that hit each."""
    nothing: Arrays = {"cells": np.zeros(0, np.int64), "hits": np.zeros(0, np.uint32)}
    cells, place = np.unique(joined([nothing, *parts], "cells"), return_inverse=True)
    count = np.bincount(place, weights=joined([nothing, *parts], "hits"), minlength=cells.size)
    return cells, count / max(1, n_logs)
