"""The terrain as pictures to pan and zoom in: square tiles of hillshade, each level half as fine as the one below."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.pictures import lit, span_of, stretched
from deadwood_algorithms.params.tool import UserError

TILE = 256  # side of a tile [px]
SPAN_CELLS = 1024  # greatest side, in cells of the level, whose shading defines black and white on all levels
KEPT = 256  # tiles, some 40 kB each
Array = NDArray[np.float32]


class Relief:
    """Row 0 of every level is the northernmost; level k has cells of 2^k cells of the terrain model, means of these."""

    def __init__(self, grid: Grid) -> None:
        self.cell = grid.cell
        self.levels = 1 + max(0, math.ceil(math.log2(max(grid.shape) / TILE)))
        self._heights: list[NDArray[np.floating]] = [grid.values[::-1]]
        self._tiles: OrderedDict[tuple[int, int, int], bytes] = OrderedDict()
        self._lock = threading.Lock()
        level = next((k for k in range(self.levels) if max(self.at(k).shape) <= SPAN_CELLS), self.levels - 1)
        light = lit(self.at(level), self._cell(level))
        self.span = span_of(light) if np.isfinite(light).any() else (0.0, 1.0)

    def at(self, level: int) -> NDArray[np.floating]:
        """Heights of a level [m]; NaN outside."""
        while len(self._heights) <= level:
            self._heights.append(halved(self._heights[-1]))
        return self._heights[level]

    def coarse(self, most: int) -> tuple[float, Array]:
        """The finest level with at most ``most`` cells along a side: the size of its cells [m], its heights."""
        level = 0
        while max(self.at(level).shape) > most:
            level += 1
        return self._cell(level), np.ascontiguousarray(self.at(level), np.float32)

    def tile(self, level: int, column: int, row: int) -> bytes:
        """A picture (PNG, grey and alpha: transparent where the terrain model has no height)."""
        if not 0 <= level < self.levels:
            raise UserError(f"there is no level {level}")
        key = level, column, row
        with self._lock:
            if key not in self._tiles:
                self._tiles[key] = self._drawn(*key)
                while len(self._tiles) > KEPT:
                    self._tiles.popitem(last=False)
            self._tiles.move_to_end(key)
            return self._tiles[key]

    def _drawn(self, level: int, column: int, row: int) -> bytes:
        heights = self.at(level)
        top, left = row * TILE, column * TILE
        if not (0 <= top < heights.shape[0] and 0 <= left < heights.shape[1]):
            raise UserError(f"there is no tile {column}, {row} on level {level}")
        first = max(0, top - 1), max(0, left - 1)  # one more cell on all sides, so that tiles join without a seam
        part = heights[first[0] : top + TILE + 1, first[1] : left + TILE + 1]
        if min(part.shape) < 2:
            light = np.full(part.shape, np.nan)
        else:
            light = lit(part[::-1], self._cell(level))[::-1]
        inner = light[top - first[0] :, left - first[1] :][:TILE, :TILE]
        picture = np.zeros((TILE, TILE, 2), np.uint8)
        known = np.isfinite(inner)
        shade = np.where(known, stretched(np.nan_to_num(inner), *self.span), 0.0)
        picture[: inner.shape[0], : inner.shape[1], 0] = np.uint8(255.0 * shade)
        picture[: inner.shape[0], : inner.shape[1], 1] = np.where(known, 255, 0)
        out = BytesIO()
        Image.fromarray(picture, "LA").save(out, "PNG", compress_level=1)
        return out.getvalue()

    def _cell(self, level: int) -> float:
        return self.cell * 2.0**level


def halved(heights: NDArray[np.floating]) -> Array:
    """Means of two by two cells, over those that have a height; a last odd row or column is averaged alone."""
    rows, columns = (-(-size // 2) for size in heights.shape)
    total, number = np.zeros((rows, columns), np.float32), np.zeros((rows, columns), np.uint8)
    for i in (0, 1):
        for j in (0, 1):
            part = heights[i::2, j::2]
            known = np.isfinite(part)
            at = slice(0, part.shape[0]), slice(0, part.shape[1])
            total[at] += np.where(known, part, 0.0)
            number[at] += known
    return np.where(number > 0, total / np.maximum(number, 1), np.nan).astype(np.float32)
