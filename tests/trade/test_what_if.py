"""The error of a fidelity in the effect of a change: pages and the tools' record are those of the results file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks import what_if


def test_the_page_and_the_tools_record_are_those_of_the_results_file():
    found = json.loads(what_if.JSON.read_text(encoding="utf-8"))
    source, page = (each.read_text(encoding="utf-8") for each in (what_if.TRADE, what_if.PAGE))
    assert what_if.with_record(source, found["records"]) == source
    assert what_if.said(found) in page
    assert len(found["records"]) >= 20


def test_the_error_is_the_difference_of_the_two_effects():
    """Of ten logs one fewer is kept from the line at draft: the change seems to work less well by ten points."""
    reach = {
        "draft": ([1, 1, 1, 1, 0, 0, 0, 0, 0, 0], [0, 0, 1, 1, 0, 0, 0, 0, 0, 0]),
        "fine": ([1, 1, 1, 0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 0, 0, 0, 1]),
    }
    record = {
        "logs": 10,
        "reached": {name: [np.packbits(each).tobytes().hex() for each in both] for name, both in reach.items()},
    }
    assert what_if.effect(record, "draft").sum() == -2
    assert what_if.effect(record, "fine").sum() == -3
    value, variance = what_if.errors([record], "draft")
    assert value.tolist() == pytest.approx([10.0])
    # the third log alone differs: +1 in one of ten, of variance 0.09, and half a log more, which is never 0
    assert variance.tolist() == pytest.approx([(1e4 * 0.09 + 50.0) / 10])
