"""Text in shapefiles: read right whatever the .cpg says, where the bytes tell, else refused with the way out."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import geopandas as gpd
import pytest
import shapely

from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import UserError

WORDS = ["Dürrständer", "épicéa", "grün", "felled"]


def shapefile(folder: Path, encoding: str, cpg: str | None, words: list[str] = WORDS, field: str = "Zustand") -> Path:
    frame = gpd.GeoDataFrame({field: words, "BHD": 30.5}, geometry=[shapely.Point(0, 0)] * len(words), crs=2056)
    frame.to_file(folder / "a.shp", encoding=encoding)
    (folder / "a.cpg").unlink()
    if cpg is not None:
        (folder / "a.cpg").write_text(cpg)
    return folder / "a.shp"


@pytest.mark.parametrize("field", ["Zustand", "Ständer"])
@pytest.mark.parametrize(
    ("encoding", "cpg"),
    [
        *(("utf-8", cpg) for cpg in (None, "UTF-8", "ISO-8859-1", "1252")),
        *(("cp1252", cpg) for cpg in (None, "ISO-8859-1", "CP1252")),
        *(("ascii", cpg) for cpg in (None, "UTF-8")),
    ],
)
def test_text_is_read_as_it_was_written(tmp_path, encoding, cpg, field):
    words, field = (["dead", "alive"], "Zustand") if encoding == "ascii" else (WORDS, field)
    frame = read_table(shapefile(tmp_path, encoding, cpg, words, field), what="trees")
    assert frame[field].tolist() == words
    assert frame["BHD"].tolist() == [30.5] * len(words)
    assert frame.crs is not None
    alone = read_table(tmp_path / "a.dbf", what="trees")
    assert alone[field].tolist() == words


def test_a_character_cut_in_two_by_the_width_of_its_field(tmp_path):
    """As programs write that cut a text by bytes: the first byte of the last ü is left, which is no character."""
    path = shapefile(tmp_path, "utf-8", None, ["Stück", "Föhre"])
    table = (tmp_path / "a.dbf").read_bytes()
    at, size = table.index("Stück".encode()), table[32 + 16]
    assert table[at : at + size].strip() == "Stück".encode()
    (tmp_path / "a.dbf").write_bytes(table[:at] + b"a" * (size - 1) + b"\xc3" + table[at + size :])
    assert read_table(path, what="trees")["Zustand"].tolist() == ["a" * (size - 1), "Föhre"]


def test_a_participle_of_another_encoding_is_no_character_cut_in_two(tmp_path):
    """The last byte of coupé in CP1252 begins a character in UTF-8; nothing else in the table is one."""
    path = shapefile(tmp_path, "cp1252", None, ["coupé", "mort"])
    assert read_table(path, what="trees")["Zustand"].tolist() == ["coupé", "mort"]
    (tmp_path / "a.cpg").write_text("UTF-8")
    with pytest.raises(UserError, match="but 'coupé' is not"):
        read_table(path, what="trees")


def test_a_cpg_that_cannot_be_true_is_refused_and_its_command_helps(tmp_path):
    path = shapefile(tmp_path, "cp1252", "UTF-8")
    with pytest.raises(UserError, match=r"a\.cpg says .* UTF-8, but 'Dürrständer' is not") as error:
        read_table(path, what="trees")
    command = str(error.value).partition("there: ")[2]
    assert shlex.split(command)[-1] == str(tmp_path / "a.cpg")
    subprocess.run(command, shell=True, check=True)
    assert read_table(path, what="trees")["Zustand"].tolist() == WORDS
