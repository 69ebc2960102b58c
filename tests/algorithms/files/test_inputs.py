"""Inputs that do not exist, or are several where one is read."""

from __future__ import annotations

import pytest

from deadwood_algorithms.files.inputs import refuse_missing
from deadwood_algorithms.params.tool import UserError


def test_several_files_where_one_is_read_are_refused_with_a_way_out(tmp_path):
    """Two lists of trees of one forest: "does not exist" was all that was said of a.gpkg,b.gpkg."""
    one, other = tmp_path / "a.gpkg", tmp_path / "b.gpkg"
    for each in (one, other):
        each.write_bytes(b"x")
    with pytest.raises(UserError, match=r"the trees input is one file, and these are 2; join them first \(in QGIS"):
        refuse_missing(f"{one},{other}", "trees")
    with pytest.raises(UserError, match="the trees file does not exist"):
        refuse_missing(f"{one},{tmp_path / 'c.gpkg'}", "trees")


def test_a_comma_in_a_name_is_part_of_it(tmp_path):
    place = tmp_path / "a,b.gpkg"
    place.write_bytes(b"x")
    refuse_missing(place, "trees")
