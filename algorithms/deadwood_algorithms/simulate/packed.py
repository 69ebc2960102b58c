"""Facts and arrays as bytes, and back: what goes over the network to the workers, and what comes from them.

No pickle, which can run arbitrary code: the facts are JSON, the arrays are raw bytes after a description
of their type, which must not contain objects. The engine's records (a scene, a result) are taken apart into facts and
arrays, and put together again by their names only; `RECORDS` is the complete list of these.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from deadwood_engine import Hits, Influences, Poses, Result, Scene, Segments
from deadwood_engine.cloud import Cloud
from deadwood_engine.cores import Cores
from deadwood_engine.grid_index import GridIndex
from deadwood_engine.scene import SceneArrays
from deadwood_engine.terrain import Terrain

RECORDS = {
    each.__name__: each
    for each in (Scene, SceneArrays, Terrain, Cores, GridIndex, Cloud, Segments, Result, Poses, Hits, Influences)
}
_ZSTD = pa.Codec("zstd", 1)
_SIZE = 8  # bytes of a length field


def block_of(facts: Mapping[str, Any], arrays: Sequence[NDArray]) -> bytes:
    """Facts (representable as JSON) and arrays as one block of bytes; equal ones give equal blocks."""
    descriptions, blocks = [], []
    for array in arrays:
        if array.dtype.hasobject:
            raise TypeError("an array of objects cannot be packed")
        is_record = isinstance(array, np.recarray)
        descriptions.append([np.lib.format.dtype_to_descr(array.dtype), list(array.shape), is_record])
        blocks.append(np.ascontiguousarray(array).tobytes())
    head = json.dumps([dict(facts), descriptions]).encode()
    whole = b"".join([len(head).to_bytes(_SIZE, "little"), head, *blocks])
    return len(whole).to_bytes(_SIZE, "little") + _ZSTD.compress(whole, asbytes=True)


def from_block(block: bytes) -> tuple[dict[str, Any], list[NDArray]]:
    """The facts and arrays of a block; the arrays are copies, aligned and writable."""
    whole = memoryview(_ZSTD.decompress(block[_SIZE:], int.from_bytes(block[:_SIZE], "little"), asbytes=True))
    at = _SIZE + int.from_bytes(whole[:_SIZE], "little")
    facts, descriptions = json.loads(bytes(whole[_SIZE:at]))
    arrays = []
    for said, shape, is_record in descriptions:
        array = np.empty(shape, _dtype_of(said))
        array.reshape(-1).view(np.uint8)[:] = np.frombuffer(whole, np.uint8, array.nbytes, at)
        at += array.nbytes
        arrays.append(array.view(np.recarray) if is_record else array)
    return facts, arrays


def _dtype_of(said: Any) -> np.dtype:
    """A data type from its description; JSON has lists instead of the tuples of fields."""
    if isinstance(said, str):
        return np.dtype(said)
    fields: Any = [tuple(tuple(each) if isinstance(each, list) else each for each in field) for field in said]
    return np.lib.format.descr_to_dtype(fields)


def taken_apart(record: Any, arrays: list[NDArray]) -> Any:
    """The JSON form of a record, whose arrays are appended to ``arrays``."""
    if isinstance(record, np.ndarray):
        arrays.append(record)
        return {"array": len(arrays) - 1}
    if record is None or isinstance(record, bool | str):
        return record
    if isinstance(record, int | np.integer):
        return int(record)
    if isinstance(record, float | np.floating):
        return float(record)
    if isinstance(record, dict):
        return {"words": {name: taken_apart(value, arrays) for name, value in record.items()}}
    name = type(record).__name__
    if RECORDS.get(name) is not type(record):
        raise TypeError(f"{type(record)} cannot be packed")
    return {"record": name, "fields": [taken_apart(getattr(record, each), arrays) for each in _fields(record)]}


def put_together(said: Any, arrays: Sequence[NDArray]) -> Any:
    """The record from its form made by `taken_apart`."""
    if not isinstance(said, dict):
        return said
    if "array" in said:
        return arrays[said["array"]]
    if "words" in said:
        return {name: put_together(value, arrays) for name, value in said["words"].items()}
    return RECORDS[said["record"]](*(put_together(each, arrays) for each in said["fields"]))


def _fields(record: Any) -> Sequence[str]:
    named = getattr(record, "_fields", None)
    return named if named is not None else [each.name for each in dataclasses.fields(record)]


def digest_of_array(array: NDArray) -> str:
    """Digest of an array's type, shape and bytes."""
    digest = hashlib.sha256(f"{np.lib.format.dtype_to_descr(array.dtype)} {array.shape}".encode())
    raw: Any = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    digest.update(raw)
    return digest.hexdigest()


def digest_of_block(block: bytes) -> str:
    return hashlib.sha256(block).hexdigest()
