"""The comparison of tree tops counts what is in the same cell, beside it, and in one of the two alone."""

from __future__ import annotations

import numpy as np

from benchmarks.tree_tops import MARKS, PAGE, compared


def test_tops_are_matched_by_place():
    one = np.array([[0.0, 0.0, 20.0], [10.0, 0.0, 15.0], [30.0, 0.0, 9.0], [50.0, 50.0, 8.0]])
    other = np.array([[0.0, 0.0, 20.0], [10.5, 0.5, 15.25], [31.5, 0.0, 9.0]])
    found = compared(one, other, 0.5)
    assert found == {"same": 1, "near": 2, "only_one": 2, "only_other": 1, "height_m": 0.25}
    back = compared(other, one, 0.5)
    assert (back["only_one"], back["only_other"]) == (1, 2)


def test_the_page_has_the_table():
    page = PAGE.read_text(encoding="utf-8")
    assert MARKS.search(page)
    rows = [[each.strip() for each in line.split("|")[1:-1]] for line in page.splitlines() if " cells of " in line]
    assert len(rows) == 8
    for row in rows:
        ours, theirs, same, near, only_ours, only_theirs = map(int, row[2:8])
        assert same <= near
        assert near + only_ours == ours
        assert theirs >= only_theirs
