"""Trees found twice at the seams of overlapping tiles: of those within a distance of each other, the tallest is kept.

For `import_trees`.
"""

from __future__ import annotations

import numpy as np
import shapely


def duplicates(
    places: np.ndarray, height: np.ndarray, dbh: np.ndarray, within: float, tile: np.ndarray | None
) -> np.ndarray:
    """Which trees are removed, bool (n,): each that stands within ``within`` [m] of a taller one that is kept.

    Of two with the same height the thicker is kept, then the one in the earlier row. With ``tile`` only trees of
    different tiles are merged. Processing by descending height makes the result independent of the order of the pairs:
    a tree that is removed does not remove others.
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
