"""Trees that were found twice, at the seams of overlapping tiles: of those within a distance the tallest stays.

For `import_trees`.
"""

from __future__ import annotations

import numpy as np
import shapely


def duplicates(
    places: np.ndarray, height: np.ndarray, dbh: np.ndarray, within: float, tile: np.ndarray | None
) -> np.ndarray:
    """Which trees go, bool (n,): each that stands within ``within`` [m] of a taller one that stays.

    Of two of one height the thicker stays, then the one of the earlier row. With ``tile`` only trees of different
    tiles are held to be one. Going down by height makes the result the same in any order of the pairs: a tree that
    goes takes none with it.
    """
    one, other = shapely.STRtree(places).query(places, predicate="dwithin", distance=within)
    apart = one != other
    if tile is not None:
        apart &= tile[one] != tile[other]
    one, other = one[apart], other[apart]
    goes = np.zeros(places.size, bool)
    if not one.size:
        return goes
    order = np.lexsort((np.arange(places.size), -np.nan_to_num(dbh), -np.nan_to_num(height)))
    rank = np.empty(places.size, np.int64)
    rank[order] = np.arange(places.size)
    lower = rank[other] > rank[one]
    one, other = one[lower], other[lower]
    by_rank = np.argsort(rank[one], kind="stable")
    for taller, smaller in zip(one[by_rank], other[by_rank], strict=True):
        if not goes[taller]:
            goes[smaller] = True
    return goes
