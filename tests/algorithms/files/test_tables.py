"""Text tables as people have them: separators, decimal commas, encodings, headers, gaps."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import UserError


def table(tmp_path, text: str | bytes, name="trees.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, what="trees")


@pytest.mark.parametrize("separator", [";", "\t", ",", " ", "|", "; "])
def test_any_separator_is_found(tmp_path, separator):
    text = "x,y,h\n1.5,2,3\n4.5,5,6\n".replace(",", separator)
    frame = table(tmp_path, text)
    assert list(frame) == ["x", "y", "h"]
    assert frame["x"].tolist() == [1.5, 4.5]
    assert frame["h"].tolist() == [3, 6]


def test_columns_aligned_with_blanks_are_read(tmp_path):
    frame = table(tmp_path, "   2600000.00   1200000.00  20.50\n   2600001.00   1200002.00   9.25\n", "treefile.txt")
    assert list(frame) == ["column_1", "column_2", "column_3"]
    assert frame["column_3"].tolist() == [20.5, 9.25]


def test_a_comma_may_be_decimal_or_a_separator(tmp_path):
    assert table(tmp_path, "x;dbh\n1,5;30,25\n2;40\n")["dbh"].tolist() == [30.25, 40]
    assert table(tmp_path, "x\tdbh\n1,5\t30,25\n2\t40\n")["x"].tolist() == [1.5, 2]
    assert table(tmp_path, "x,dbh\n1,30\n2,40\n")["dbh"].tolist() == [30, 40]
    assert table(tmp_path, 'x,dbh\n"1,5","30,25"\n2,40\n')["dbh"].tolist() == [30.25, 40]


@pytest.mark.parametrize("number", ["2'600'000.5", "2600000.5", "2’600’000,5", "2.6000005e6"])
def test_swiss_thousands_and_powers_are_numbers(tmp_path, number):
    assert table(tmp_path, f"x;y\n{number};1\n")["x"].tolist() == [2600000.5]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_any_common_encoding_and_line_end(tmp_path, encoding, newline):
    text = "höhe;art\n20,5;Föhre\n3;Arve\n".replace("\n", newline)
    frame = table(tmp_path, text.encode(encoding))
    assert list(frame) == ["höhe", "art"]
    assert frame["art"].tolist() == ["Föhre", "Arve"]
    assert frame["höhe"].tolist() == [20.5, 3]


def test_signs_that_only_windows_writes(tmp_path):
    assert table(tmp_path, "x;art\n1;Föhre – 5 €\n".encode("cp1252"))["art"].tolist() == ["Föhre – 5 €"]


def test_a_table_without_header_gets_numbered_columns(tmp_path):
    frame = table(tmp_path, "2600000; 1200000; 20.5; 19.9; 31.9; nan\n2600001; 1200000; 8; 8; 14; 1\n", "Ind_trees.csv")
    assert list(frame) == [f"column_{i}" for i in range(1, 7)]
    assert len(frame) == 2
    assert frame["column_6"].isna().tolist() == [True, False]


@pytest.mark.parametrize("gap", ["", "NA", "nan", "NULL", "n/a"])
def test_words_for_nothing_are_gaps(tmp_path, gap):
    frame = table(tmp_path, f"x;dbh\n1;{gap}\n2;40\n")
    assert np.array_equal(frame["dbh"], [np.nan, 40], equal_nan=True)


def test_one_word_among_numbers_keeps_the_column_as_text_so_that_its_row_can_be_named(tmp_path):
    assert table(tmp_path, "x;dbh\n1;40\n2;thick\n")["dbh"].tolist() == ["40", "thick"]


def test_empty_lines_and_trailing_separators_do_no_harm(tmp_path):
    frame = table(tmp_path, "x;y;\n\n1;2;\n;;\n3;4;\n\n")
    assert frame["x"].tolist() == [1, 3]
    assert frame["y"].tolist() == [2, 4]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x;y;h\n1;2;3\n4;5\n", "row 2 has 2 cells"),
        ("x;y;h\n1;2;3\n4;5;6;7\n", "row 2 has 4 cells"),
        ("x;y\n", "a header but no row"),
        ("\n\n", "no row"),
        ("", "empty"),
        ("x;y;x\n1;2;3\n", "two columns of the trees table are called 'x'"),
        (b"x;y\n1;\x00\n", "not a text"),
    ],
)
def test_what_cannot_be_right_is_refused_in_one_line(tmp_path, text, words):
    with pytest.raises(UserError, match=words) as raised:
        table(tmp_path, text)
    assert str(raised.value).startswith(f"{tmp_path / 'trees.csv'}: ")
    assert "\n" not in str(raised.value)
