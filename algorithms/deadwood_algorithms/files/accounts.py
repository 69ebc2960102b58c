"""What became of the rows of each input layer: read, used, and left out and why, for the record of a result.

A reader says it where it decides (`account`), under the name of the tool's parameter; what is said last counts, for a
scene may be read again in a wider window. `results/identity` collects it while a tool works. `used` is counted from
what the reader hands on, never as what remains, so that an account that does not add up shows a row lost in silence.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, SupportsInt

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# Why a row of a layer has no part in a result
OFF_DEM = "off_dem"  # it lies beyond the terrain model
NO_TERRAIN = "no_terrain"  # on its last half cell or on nodata, where the surface has no height
NO_TREE = "no_tree"  # an area in which no tree stands

_ACCOUNTS: ContextVar[dict[str, dict[str, Any]] | None] = ContextVar("_ACCOUNTS", default=None)


@contextmanager
def accounting() -> Iterator[dict[str, dict[str, Any]]]:
    """Within it, accounts are kept; gives them by parameter, as they are said."""
    accounts: dict[str, dict[str, Any]] = {}
    token = _ACCOUNTS.set(accounts)
    try:
        yield accounts
    finally:
        _ACCOUNTS.reset(token)


def account(parameter: str, count: dict[str, Any]) -> None:
    """Say what became of the rows of a layer, as of `count_of`; nothing outside the making of a result."""
    accounts = _ACCOUNTS.get()
    if accounts is not None:
        accounts[parameter] = count


def count_of(read: SupportsInt, used: SupportsInt, left_out: Mapping[str, SupportsInt]) -> dict[str, Any]:
    """The rows of a layer; reasons that hold for no row are not in it."""
    reasons = [{"why": why, "n": int(n)} for why, n in left_out.items() if int(n)]
    return {"read": int(read), "used": int(used), "left_out": reasons}


def account_on_dem(parameter: str, on: NDArray[np.bool_]) -> None:
    """Say that of the rows of a layer those are used that lie on the terrain model."""
    account(parameter, count_of(on.size, on.sum(), {OFF_DEM: (~on).sum()}))
