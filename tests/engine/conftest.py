"""The engine's kernels as plain Python, for tests of what takes long to compile, and tables of contacts at random."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

from deadwood_engine.contacts import CONTACT

sys.path.insert(0, str(Path(__file__).parent))  # importlib mode leaves the slope that tests share to us


@pytest.fixture(scope="session")
def plain() -> Callable[[str], ModuleType]:
    """``plain("step")`` is that file of a second engine, whose kernels are not compiled; it takes the same arrays."""
    settings: Any = vars(numba)["config"]
    before = settings.DISABLE_JIT
    kept = {name: module for name, module in sys.modules.items() if name.split(".")[0] == "deadwood_engine"}
    for name in kept:
        del sys.modules[name]
    settings.DISABLE_JIT = 1
    try:
        __import__("deadwood_engine")
        made = {name: module for name, module in sys.modules.items() if name.split(".")[0] == "deadwood_engine"}
    finally:
        settings.DISABLE_JIT = before
        for name in [name for name in sys.modules if name.split(".")[0] == "deadwood_engine"]:
            del sys.modules[name]
        sys.modules.update(kept)
    return lambda name: made["deadwood_engine." + name]


@pytest.fixture(scope="session")
def random_contacts() -> Callable[..., Any]:
    """Contacts with frames of three unit vectors square to each other, levers, and impulses within their cones."""

    def make(rng: np.random.Generator, number: int) -> Any:
        table = np.zeros(number, CONTACT).view(np.recarray)
        for c in table:
            frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            r = rng.normal(size=3)
            c.rx, c.ry, c.rz = r
            for k, name in enumerate("ntu"):
                for axis, value, lever in zip("xyz", frame[:, k], np.cross(r, frame[:, k]), strict=True):
                    c[name + axis], c["r" + name + axis] = value, lever
            c.mu, c.pn = rng.uniform(0.1, 1.0), rng.uniform(0.1, 3.0)
            turn, part = rng.uniform(0.0, 2 * np.pi), rng.uniform(0.0, 0.9)
            c.pt, c.pu = part * c.mu * c.pn * np.array([np.cos(turn), np.sin(turn)])
        return table

    return make
