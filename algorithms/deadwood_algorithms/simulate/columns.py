"""The results of all logs of a run, on the disk: columns are read on request, whole or some rows of them.

A million logs would otherwise occupy 260 MB from the first row written to the last.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray


class Columns(Mapping[str, NDArray]):
    """Arrays by name: those of logs in anonymous files, the others (hits, costs) in memory. To be closed after use.

    chunks : results in the order in which they were slid; by_row : names of arrays with one row for each log
    order : row k of a column is the log that was slid as number ``order[k]``
    """

    def __init__(
        self, folder: Path, chunks: Iterable[Mapping[str, NDArray]], by_row: Collection[str], order: NDArray[np.intp]
    ) -> None:
        self.by_row = by_row
        self._order = None if np.array_equal(order, np.arange(order.size)) else order
        self._rows, self._files = order.size, ExitStack()
        self._stored: dict[str, tuple[BinaryIO, NDArray]] = {}  # the file, and an empty array of its type and shape
        others: dict[str, list[NDArray]] = {}
        for chunk in chunks:
            for name, values in chunk.items():
                if name not in by_row:
                    others.setdefault(name, []).append(values)
                    continue
                if name not in self._stored:
                    file = TemporaryFile(dir=folder)  # noqa: SIM115 (closed with the columns)
                    self._stored[name] = self._files.enter_context(file), values[:0]
                self._stored[name][0].write(np.ascontiguousarray(values, self._stored[name][1].dtype).tobytes())
        self._others = {name: np.concatenate(parts) for name, parts in others.items()}

    def __getitem__(self, name: str) -> NDArray:
        return self._others[name] if name in self._others else self._read(name, slice(0, self._rows))

    def __iter__(self) -> Iterator[str]:
        return iter([*self._stored, *self._others])

    def __len__(self) -> int:
        return len(self._stored) + len(self._others)

    def rows(self, rows: slice | NDArray[np.int64]) -> dict[str, NDArray]:
        """The results of some logs."""
        return {name: self._read(name, rows) for name in self._stored}

    def _read(self, name: str, rows: slice | NDArray[np.int64]) -> NDArray:
        if isinstance(rows, slice) and self._order is None:
            start, stop, _ = rows.indices(self._rows)
            return self._stretch(name, start, stop)
        whole = self._stretch(name, 0, self._rows)
        return whole[rows] if self._order is None else whole[self._order[rows]]

    def _stretch(self, name: str, start: int, stop: int) -> NDArray:
        file, none = self._stored[name]
        out = np.empty((stop - start, *none.shape[1:]), none.dtype)
        if out.size:
            file.seek(start * (out.nbytes // len(out)))
            if file.readinto(out.data.cast("B")) != out.nbytes:  # type: ignore[attr-defined]
                raise OSError(f"{name}: results of logs cannot be read back")
        return out

    def close(self) -> None:
        self._files.close()
