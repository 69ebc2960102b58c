"""Frames are decoded as they were encoded, and invalid messages are rejected."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deadwood_algorithms.explore.frames import ALIGNED, MOST_MESSAGE, Frame, message_of, refusal
from deadwood_algorithms.params.tool import UserError

KINDS = ("u1", "<u2", ">u2", "<f4", ">f8", "<i8")


@given(
    st.dictionaries(st.text(max_size=9).filter(lambda name: name != "arrays"), st.text(max_size=20), max_size=4),
    st.lists(st.tuples(st.sampled_from(KINDS), st.integers(0, 5), st.integers(0, 7)), max_size=4),
)
def test_a_frame_comes_back_as_it_went(facts: dict[str, str], shapes: list[tuple[str, int, int]]):
    rng = np.random.default_rng(0)
    arrays = {f"a{k}": rng.integers(0, 200, shape).astype(kind) for k, (kind, *shape) in enumerate(shapes)}
    block = Frame(facts, arrays).packed()
    again = Frame.unpacked(block)
    assert dict(again.facts) == facts
    assert list(again.arrays) == list(arrays)
    for name, each in arrays.items():
        assert again.arrays[name].shape == each.shape
        assert np.array_equal(again.arrays[name], each)
        assert again.arrays[name].dtype.byteorder in "<=|"
    assert len(block) % ALIGNED == 0


def test_every_array_begins_where_a_browser_can_look_at_it():
    block = Frame({"text": "ü"}, {"odd": np.arange(3, dtype=np.uint8), "wide": np.arange(5.0)}).packed()
    first = 4 + int.from_bytes(block[:4], "little")
    assert first % ALIGNED == 0
    assert np.array_equal(np.frombuffer(block, "<f8", 5, first + ALIGNED), np.arange(5.0))
    told = json.loads(block[4:first])
    assert told["arrays"] == [
        {"name": "odd", "dtype": "|u1", "shape": [3]},
        {"name": "wide", "dtype": "<f8", "shape": [5]},
    ]


def test_a_view_of_an_array_is_sent_as_it_looks():
    turned = np.arange(12, dtype=np.uint16).reshape(3, 4)[::-1]
    assert np.array_equal(Frame.unpacked(Frame({}, {"a": turned}).packed()).arrays["a"], turned)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not JSON"),
        ("5", "not a JSON object"),
        ('{"a": -Infinity}', "-Infinity is not a number"),
        ('{"a": -1e400}', "-1e400 is not a number"),
        ('{"a": "' + "x" * MOST_MESSAGE + '"}', "at most 1048576 are allowed"),
        ("[" * 50_000, "not JSON"),
        ('{"n": ' + "9" * 400 + "}", "not a number"),
        ('{"op": "release", "id": [1, 2]}', "neither a number nor text"),
        (b"\xff\xfe\xff", "not JSON"),
    ],
    ids=["empty", "number", "infinite", "too large", "long", "deep", "whole", "id", "bytes"],
)
def test_what_is_no_message_is_refused(text: str, words: str):
    with pytest.raises(UserError, match=words):
        message_of(text)


def test_a_refusal_names_the_request_if_possible():
    assert refusal("no", {"id": 4}).facts == {"op": "refused", "id": 4, "text": "no"}
    assert refusal("no", {"id": [4]}).facts["id"] is None
    assert refusal("no").facts["id"] is None
