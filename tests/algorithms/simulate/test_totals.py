"""Rasters assembled by rows equal those of the whole, bit for bit, and untouched rows need no memory."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.simulate import totals
from deadwood_algorithms.simulate.totals import Totals
from deadwood_engine import Rasters
from deadwood_engine.rasters import raster_arrays
from deadwood_engine.trace import HITS


def drawn(shape: tuple[int, int], workers: int, lines: int, seed: int) -> Rasters:
    """Possible results of workers: some rows touched by none of them, some by only one."""
    generator = np.random.default_rng(seed)
    made = []
    for worker in range(workers):
        each = raster_arrays(shape, np.arange(1, lines + 1))
        touched = generator.random(shape) < 0.3
        touched[: shape[0] // 3 + worker] = False
        each.hits[:, :, HITS] = np.where(touched, generator.integers(1, 9, shape), 0)
        each.maxima[...] = np.where(touched[:, :, None], generator.random((*shape, 4)), 0.0)
        each.deposits[...] = touched & (generator.random(shape) < 0.2)
        if lines:
            each.danger.reshape(-1, *shape)[...] = each.hits[:, :, HITS] // 2
        made.append(each)
    return Rasters(made)


@pytest.mark.parametrize(("workers", "lines"), [(1, 0), (1, 2), (3, 0), (3, 2)])
@pytest.mark.parametrize("whole_cells", [0, 2**22])
def test_rows_are_those_of_the_whole(monkeypatch, workers, lines, whole_cells):
    monkeypatch.setattr(totals, "WHOLE_CELLS", whole_cells)
    monkeypatch.setattr(totals, "STRIP_CELLS", 70)
    rasters = drawn((23, 17), workers, lines, seed=workers + lines)
    expected, found = rasters.totals(), Totals(rasters)
    assert found.names == tuple(expected)
    strips = list(found.strips())
    assert len(strips) > 3
    for name, values in expected.items():
        put_together = np.concatenate([strip[name] for _, strip in strips], axis=-2)
        assert put_together.dtype == values.dtype
        assert put_together.tobytes() == values.tobytes()
        assert found.rows(slice(5, 12))[name].tobytes() == values[..., 5:12, :].tobytes()


def test_rows_without_a_log_cost_no_memory(monkeypatch):
    monkeypatch.setattr(totals, "WHOLE_CELLS", 0)
    rows = Totals(drawn((30, 40), 2, 1, seed=1)).rows(slice(0, 10))
    assert all(values.strides[-2:] == (0, 0) for values in rows.values())
    assert np.isnan(rows["speed_max"]).all()
    assert not rows["hit_count"].any()
