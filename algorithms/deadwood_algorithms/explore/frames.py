"""The protocol between the session and its front ends: JSON messages in, binary frames of facts and arrays out."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import UserError

MOST_MESSAGE = 1 << 20  # bytes of a message: ten thousand trees by their numbers take 70 000
MOST_DIGITS = 20  # of a whole number: those of 2^63, and its sign
ALIGNED = 8  # bytes: where each array of a frame starts


@dataclass(frozen=True)
class Frame:
    """An answer: facts as JSON, and arrays by name."""

    facts: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def packed(self) -> bytes:
        """uint32 length of the header, the header, the arrays; header and arrays are padded to multiples of 8 bytes."""
        little = {name: _little(each) for name, each in self.arrays.items()}
        arrays = [{"name": name, "dtype": each.dtype.str, "shape": each.shape} for name, each in little.items()]
        header = json.dumps({**self.facts, "arrays": arrays}, allow_nan=False).encode()
        header += b" " * (-(4 + len(header)) % ALIGNED)
        body = b"".join(each.tobytes() + bytes(-each.nbytes % ALIGNED) for each in little.values())
        return len(header).to_bytes(4, "little") + header + body

    @staticmethod
    def unpacked(block: bytes) -> Frame:
        """The inverse of ``packed``; for tests, benchmarks and front ends in Python."""
        facts, first = header_of(block)
        arrays = {}
        for each in facts.pop("arrays"):
            dtype, shape = np.dtype(each["dtype"]), tuple(each["shape"])
            count = int(np.prod(shape, dtype=np.int64))
            arrays[each["name"]] = np.frombuffer(block, dtype, count, first).reshape(shape)
            first += count * dtype.itemsize
            first += -first % ALIGNED
        return Frame(facts, arrays)


def header_of(block: bytes) -> tuple[dict[str, Any], int]:
    """The facts of a packed frame, including the description of its arrays, and where the arrays begin."""
    first = 4 + int.from_bytes(block[:4], "little")
    return json.loads(block[4:first]), first


def _little(array: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<"))


def message_of(text: str | bytes) -> dict[str, Any]:
    """A received message; one that is not a JSON object, or contains an invalid number, is rejected with an
    explanation.
    """
    if len(text) > MOST_MESSAGE:
        raise UserError(
            f"the message has {len(text)} bytes, but at most {MOST_MESSAGE} are allowed; request less at once"
        )

    def refused(word: str) -> Any:
        raise UserError(f"{word} is not a number; give finite ones")

    def finite(word: str) -> float:
        return float(word) if math.isfinite(float(word)) else refused(word)

    def whole(word: str) -> int:
        return int(word) if len(word) <= MOST_DIGITS else refused(f"{word[:MOST_DIGITS]}...")

    try:
        message = json.loads(text, parse_constant=refused, parse_float=finite, parse_int=whole)
    except (ValueError, RecursionError) as error:
        raise UserError(f"the message is not JSON ({type(error).__name__})") from error
    if not isinstance(message, dict):
        raise UserError("the message is not a JSON object with an 'op'")
    if not isinstance(message.get("id"), int | str | None):
        raise UserError("the 'id' of the message is neither a number nor text")
    return message


def refusal(text: str, message: Mapping[str, Any] | None = None) -> Frame:
    number = (message or {}).get("id")
    return Frame({"op": "refused", "id": number if isinstance(number, int | str) else None, "text": text})
