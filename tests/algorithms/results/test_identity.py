"""What was slid stays known: the record of each result, its seal, and inputs that change."""

from __future__ import annotations

import hashlib
import itertools
import json
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from slope_case import Case, write_dem

from deadwood_algorithms.files.embedded import embed, record_in, state_of
from deadwood_algorithms.files.identity import CHANGED, GONE, SAME, compared, content_of, of_input
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.identity import Making
from deadwood_algorithms.tools import check, count_hits, make_report, reach_lines, run_sites, slide_logs
from deadwood_toolbox.cli import run as command


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("identity"))


@pytest.fixture(scope="module")
def run(case) -> Path:
    return case.run(**case.everything())


@pytest.fixture
def copied(case, tmp_path) -> Case:
    """The same files, to be changed."""
    shutil.copytree(case.folder, tmp_path / "case", ignore=shutil.ignore_patterns("run"))
    return Case(tmp_path / "case")


def manifest(folder: Path) -> dict:
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))


def fewer(path: str) -> None:
    """A layer with every second row less, written in place."""
    frame = gpd.read_file(path)
    Path(path).unlink()
    frame.iloc[::2].to_file(path, layer=Path(path).stem, driver="GPKG")


def sha256(path: str | Path) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


# --- the record -------------------------------------------------------------------------------------------------------


def test_a_manifest_has_every_input_by_what_it_is(case, run):
    told = manifest(run)
    inputs = {each["parameter"]: each for each in told["inputs"]}
    assert list(inputs) == ["dem", "releases", "trees", "barriers", "lines"]
    for name, rows in (("dem", None), ("releases", 24), ("trees", 60), ("barriers", 2), ("lines", 2)):
        path = getattr(case, name)
        assert inputs[name]["path"] == path
        assert inputs[name]["sha256"] == sha256(path)
        assert inputs[name]["bytes"] == Path(path).stat().st_size
        assert inputs[name]["rows"] == rows
        assert inputs[name]["crs"] == "EPSG:2056"
    assert told["made_utc"].endswith("Z")
    assert {"numpy", "numba", "gdal", "proj", "geos"} <= set(told["libraries"])
    assert told["effective"]["dbh_cm"] == {"min": 40.0, "median": 40.0, "max": 40.0}


def test_a_manifest_seals_every_file_of_the_folder(run):
    files = manifest(run)["files"]
    assert set(files) == {each.name for each in run.iterdir()} - {"manifest.json"}
    assert all(files[name]["sha256"] == sha256(run / name) for name in files)


def test_what_the_columns_of_the_releases_override_is_reported(copied):
    frame = gpd.read_file(copied.releases)
    frame["dbh_cm"] = np.linspace(20.0, 66.0, len(frame))
    frame["orientation"] = ["upright", "lying", "lying", "lying"] * 6
    frame.to_file(copied.releases, layer="releases", driver="GPKG")
    told = manifest(copied.run())
    assert told["parameters"]["dbh_cm"] == 40.0
    assert told["effective"]["dbh_cm"] == {"min": 20.0, "median": pytest.approx(43.0), "max": 66.0}
    assert told["parameters"]["orientation"] == "upright"
    assert told["effective"]["orientation"] == {"upright": 0.25, "lying": 0.75, "tilted": 0.0}


def run_id(case: Case, **changes) -> str:
    return Making(slide_logs.TOOL, slide_logs.TOOL.ask_from(case.values(**changes))).run_id


def test_the_run_id_is_of_what_decides_the_bits_and_of_nothing_else(copied, tmp_path):
    first = run_id(copied)
    for free in ({"threads": 3}, {"output": str(tmp_path / "b")}, {"overwrite": True}, {"resume": True}):
        assert run_id(copied, **free) == first
    assert run_id(copied, friction="0.250") == first
    moved = Case(tmp_path / "elsewhere")  # the same files in another place
    assert run_id(moved) == first
    for one in ({"friction": "0.26"}, {"seed": 1}, {"time_limit_s": 61.0}, {"trees": copied.trees}):
        assert run_id(copied, **one) != first
    fewer(copied.releases)
    assert run_id(copied) != first


def test_what_is_made_of_several_runs_is_known_by_theirs(tmp_path):
    """The same commands in two folders, at other times: the same run_id; not with another run or another order."""
    made = {}
    for name in ("here", "there"):
        place = Case(tmp_path / name)
        runs = [str(place.run(output=str(place.folder / f"run_{k}"), friction=f"0.{k}")) for k in (3, 4)]
        for line in (
            ["compare-scenarios", "--runs", ",".join(runs), "--output", str(place.folder / "compared")],
            ["compare-scenarios", "--runs", ",".join(runs[::-1]), "--output", str(place.folder / "turned")],
            ["make-report", *runs, "--output", str(place.folder / "page.html")],
        ):
            assert command([*line, "--quiet"]) == 0
        page = record_in(place.folder / "page.html")
        assert page is not None
        found = {each: manifest(place.folder / each) for each in ("run_3", "compared", "turned")} | {"page": page}
        made[name] = {each: told["run_id"] for each, told in found.items()}
        assert compared(found["compared"]["inputs"][0])[0] == SAME
    assert made["here"] == made["there"]
    assert len(set(made["here"].values())) == 4
    changed = Case(tmp_path / "there")
    changed.run(output=str(tmp_path / "there" / "run_4"), friction="0.45", overwrite=True)
    assert compared(manifest(tmp_path / "there" / "compared")["inputs"][0])[0] == CHANGED


def test_a_file_carries_its_record_and_repeats_from_it(case, run, tmp_path):
    """Of a GeoPackage, a GeoTIFF, a CSV table and a page; the same record gives the same bytes."""
    lines = {
        "reached.gpkg": ["reach-lines", "--run", str(run), "--lines", case.lines],
        "hits.tif": ["count-hits", "--run", str(run)],
        "values.csv": ["design-values", "--run", str(run)],
        "page.html": ["make-report", str(run)],
    }
    for name, line in lines.items():
        assert command([*line, "--output", str(tmp_path / name), "--quiet"]) == 0
        record = record_in(tmp_path / name)
        assert record is not None
        assert record["tool"] == line[0]
        assert record["inputs"][0]["run_id"] == manifest(run)["run_id"] or name == "page.html"
        again = str(tmp_path / f"again_{name}")
        assert command([line[0], "--config", str(tmp_path / name), "--output", again, "--quiet"]) == 0
        if name != "page.html":
            assert (tmp_path / name).read_bytes() == Path(again).read_bytes()
        assert record_in(Path(again)) == record


def test_a_geopackage_with_a_record_is_a_geopackage(case, run, tmp_path):
    reach_lines.TOOL(run=str(run), lines=case.lines, output=str(tmp_path / "r.gpkg"))
    assert "gpkg_metadata" not in set(gpd.list_layers(tmp_path / "r.gpkg")["name"])
    with sqlite3.connect(tmp_path / "r.gpkg") as db:
        assert db.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert db.execute("PRAGMA foreign_key_check").fetchall() == []
        (extensions,) = db.execute(
            "SELECT COUNT(*) FROM gpkg_extensions WHERE extension_name = 'gpkg_metadata'"
        ).fetchone()
        scope, mime = db.execute("SELECT md_scope, mime_type FROM gpkg_metadata").fetchone()
    assert (extensions, scope, mime) == (2, "dataset", "application/json")
    db.close()


def test_a_second_record_takes_the_place_of_the_first(case, tmp_path):
    path = Path(shutil.copy(case.trees, tmp_path / "t.gpkg"))
    embed(path, {"tool": "one"})
    embed(path, {"tool": "two"})
    record = record_in(path)
    assert record is not None
    assert record["tool"] == "two"
    assert state_of(path, record) == SAME


def test_runs_in_a_folder_with_an_umlaut_name_their_final_place(copied, tmp_path):
    output = tmp_path / "Gelände öst"
    given = {key: value for key, value in copied.values().items() if key != "output"}
    run_sites.TOOL(**given, by="release_id", output=str(output))
    for each in output.rglob("manifest.json"):
        text = each.read_text(encoding="utf-8")
        assert ".part" not in text
        told = json.loads(text)
        assert Path(told["folder"]) == each.parent
        assert all(Path(one["path"]).exists() for one in told["inputs"])


# --- one identity of an input -----------------------------------------------------------------------------------------


def vrt_of(dem: str, place: Path) -> str:
    with rasterio.open(dem) as source:
        width, height, transform = source.width, source.height, source.transform.to_gdal()
    place.write_text(
        f'<VRTDataset rasterXSize="{width}" rasterYSize="{height}"><SRS>EPSG:2056</SRS>'
        f"<GeoTransform>{', '.join(map(str, transform))}</GeoTransform>"
        f'<VRTRasterBand dataType="Float32" band="1"><SimpleSource><SourceFilename relativeToVRT="1">'
        f"{Path(dem).name}</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"
    )
    return str(place)


def tiles_in(folder: Path) -> list[str]:
    folder.mkdir()
    return [write_dem(folder / "a.tif"), write_dem(folder / "b.tif")]


KINDS: dict[str, Callable[[Case], tuple[str, str]]] = {  # the input as named, and the file that will change
    "file": lambda case: (case.dem, case.dem),
    "folder of tiles": lambda case: (str(Path(tiles_in(case.folder / "t")[1]).parent), str(case.folder / "t/b.tif")),
    "tiles": lambda case: (",".join(tiles_in(case.folder / "t")), str(case.folder / "t/b.tif")),
    "VRT": lambda case: (vrt_of(case.dem, case.folder / "dem.vrt"), case.dem),
}


@pytest.mark.parametrize("kind", KINDS)
def test_an_input_is_all_that_its_path_stands_for(copied, kind):
    named, file = KINDS[kind](copied)
    record = {"path": named, **of_input(named)}
    assert compared(record)[0] == SAME
    write_dem(Path(file), flat=True)
    assert compared(record) == (CHANGED, file)
    Path(file).unlink()
    assert compared(record)[0] in (GONE, CHANGED)  # the content that a folder should have is unknown


def test_a_geopackage_is_known_by_its_rows_also_while_it_is_open(copied):
    """As used by QGIS: with a write-ahead log beside it (-wal), a style added, and finally a row changed."""
    named = copied.lines
    record = {"path": named, **of_input(named)}
    bytes_before = sha256(named)
    db = sqlite3.connect(named)
    db.execute("PRAGMA journal_mode = wal")
    db.execute("CREATE TABLE layer_styles (id INTEGER PRIMARY KEY, styleQML TEXT)")
    db.commit()
    assert sha256(named) != bytes_before
    assert Path(f"{named}-wal").stat().st_size
    assert compared(record)[0] == SAME
    before = content_of(Path(named))
    for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
        db.execute(f'DROP TRIGGER "{name}"')  # they call functions that only GDAL has
    db.execute("UPDATE lines SET line_id = 'lane' WHERE line_id = 'road'")
    db.commit()
    assert content_of(Path(named)) != before
    assert compared(record) == (CHANGED, named)
    db.close()


def test_another_layer_of_the_same_file_may_change(copied, tmp_path):
    both = tmp_path / "both.gpkg"
    gpd.read_file(copied.lines).to_file(both, layer="lines", driver="GPKG")
    gpd.read_file(copied.trees).to_file(both, layer="trees", driver="GPKG")
    named = f"{both}|layername=lines"
    record = {"path": named, **of_input(named)}
    gpd.read_file(copied.trees).iloc[:10].to_file(both, layer="trees", driver="GPKG")
    assert compared(record)[0] == SAME


# --- inputs that changed ----------------------------------------------------------------------------------------------


def test_changed_inputs_are_reported_refused_and_shown(copied, tmp_path, said, capsys):
    run = copied.run(**copied.everything())
    count_hits.TOOL(feedback=said, run=str(run), output=str(tmp_path / "a.tif"))
    assert not [each for each in said.warnings if "has changed" in each]
    make_report.TOOL(runs=str(run), output=str(tmp_path / "same.html"))
    assert "has changed since the logs slid" not in (tmp_path / "same.html").read_text(encoding="utf-8")
    then = sha256(copied.trees)
    fewer(copied.trees)
    count_hits.TOOL(feedback=said, run=str(run), output=str(tmp_path / "b.tif"))
    (told,) = [each for each in said.warnings if "has changed" in each]
    assert told.startswith(copied.trees)
    for language, box in (("en", "has changed since the logs slid"), ("de", "seit dem Rechenlauf geändert")):
        make_report.TOOL(runs=str(run), language=language, output=str(tmp_path / f"{language}.html"))
        page = (tmp_path / f"{language}.html").read_text(encoding="utf-8")
        assert box in page
        assert then in page  # with the trees of the run, not those that are in the file now
        assert sha256(copied.trees) not in page
    again = ["slide-logs", "--config", str(run / "manifest.json"), "--output", str(tmp_path / "again"), "--quiet"]
    assert command(again) == 2
    assert "--changed-inputs" in capsys.readouterr().err
    assert not (tmp_path / "again").exists()
    assert command([*again, "--trees", copied.trees]) == 0  # named explicitly: this is intended
    assert command([*again, "--changed-inputs", "--overwrite"]) == 0
    assert copied.trees in capsys.readouterr().err


def test_check_tells_what_stands(copied, tmp_path, capsys):
    run = copied.run(**copied.everything())
    count_hits.TOOL(run=str(run), output=str(tmp_path / "hits.tif"))
    for place in (run, run / "run.gpkg", run / "energy_max.tif", tmp_path / "hits.tif"):
        assert command(["check", str(place), "--quiet"]) == 0
    for place in (copied.dem, copied.trees, copied.folder, tmp_path / "nowhere"):
        assert command(["check", str(place), "--quiet"]) == 2
    moved = tmp_path / "moved"
    shutil.move(copied.folder, moved)
    assert command(["check", str(moved / "run"), "--quiet"]) == 0  # all together
    capsys.readouterr()
    fewer(str(moved / "trees.gpkg"))
    (moved / "lines.gpkg").unlink()
    assert command(["check", str(moved / "run")]) == 3
    told = capsys.readouterr().out
    assert f"trees: changed  {moved / 'trees.gpkg'}" in told
    assert "lines: gone" in told
    assert "dem: same" in told
    facts = check.TOOL(path=str(moved / "run")).facts
    assert {each["parameter"]: each["stands"] for each in facts["inputs"]} == {
        "dem": SAME, "releases": SAME, "trees": CHANGED, "barriers": SAME, "lines": GONE,
    }  # fmt: skip


# --- sealed -----------------------------------------------------------------------------------------------------------

READERS = {
    "run.gpkg": ["lateral-spread", "--deposits", "RUN"],
    "poses.parquet": ["reach-lines", "--run", "RUN", "--lines", "LINES"],
    "energy_max.tif": ["map-intensity", "--run", "RUN", "--least-passage", "0"],
    "summary.json": ["design-values", "--run", "RUN"],
    "manifest.json": ["count-hits", "--run", "RUN"],
    "reach_probability.tif": ["make-report", "RUN"],
}
ENDINGS = {"lateral-spread": "gpkg", "reach-lines": "gpkg", "count-hits": "tif", "design-values": "csv",
           "make-report": "html", "map-intensity": "folder"}  # fmt: skip


def read(name: str, case: Case, run: Path, tmp_path: Path) -> int:
    words = [{"RUN": str(run), "LINES": case.lines}.get(word, word) for word in READERS[name]]
    return command([*words, "--output", str(tmp_path / f"out.{ENDINGS[words[0]]}"), "--overwrite", "--quiet"])


@pytest.mark.parametrize("name", READERS)
def test_no_flipped_bit_no_half_file_and_no_file_of_another_run_is_read(case, run, tmp_path, name, capsys):
    mine = Path(shutil.copytree(run, tmp_path / "run"))
    assert read(name, case, mine, tmp_path) == 0
    whole = (mine / name).read_bytes()
    rng = np.random.default_rng(7)
    flipped = []
    for at in rng.integers(0, len(whole), 6):
        raw = bytearray(whole)
        raw[at] ^= 1 << int(rng.integers(8))
        flipped.append(bytes(raw))
    for content in (*flipped, whole[: len(whole) // 2], b""):
        (mine / name).write_bytes(content)
        status = read(name, case, mine, tmp_path)
        # a page of SQLite without rows (free space, an index) may change without changing any row
        same_rows = name.endswith(".gpkg") and content_of(mine / name) == content_of(run / name) is not None
        assert status == (0 if same_rows else 2)
        assert "bug in the toolbox" not in capsys.readouterr().err
    (mine / name).write_bytes(whole)
    if name.endswith(".tif"):
        beside = mine / f"{name}.aux.xml"
        beside.write_text('<PAMDataset><PAMRasterBand band="1"><Scale>10</Scale></PAMRasterBand></PAMDataset>')
        assert read(name, case, mine, tmp_path) == 2
        beside.unlink()
    assert read(name, case, mine, tmp_path) == 0
    (mine / name).unlink()
    assert read(name, case, mine, tmp_path) == 2


def test_files_of_another_run_are_refused(case, run, tmp_path, capsys):
    other = case.run(**case.everything() | {"friction": "0.4"}, output=str(tmp_path / "other"))
    for name in set(READERS) - {"manifest.json"}:
        mine = Path(shutil.copytree(run, tmp_path / f"mine_{name}"))
        shutil.copy(other / name, mine / name)
        assert read(name, case, mine, tmp_path) == 2
        assert "of another run" in capsys.readouterr().err


def places_in(value, at=()):
    yield at
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places_in(inner, (*at, key))


@pytest.mark.parametrize("key", ["files", "seal"])
def test_a_flipped_bit_in_what_seals_a_manifest_is_no_manifest_of_before_the_seal(case, run, tmp_path, key):
    """Before: with "filer" for "files" it was taken for one of an old version, which has no seal."""
    mine = Path(shutil.copytree(run, tmp_path / "run"))
    text = (mine / "manifest.json").read_text(encoding="utf-8")
    (mine / "manifest.json").write_text(text.replace(f'"{key}": ', f'"{key[:-1]}r": ', 1), encoding="utf-8")
    assert read("manifest.json", case, mine, tmp_path) == 2


@pytest.mark.parametrize("name", ["summary.json", "manifest.json"])
def test_wrong_types_are_refused_in_a_line(case, run, tmp_path, capsys, name):
    """In a result without a seal: each value is in turn a text, a list, null or a number that it cannot be."""
    mine = Path(shutil.copytree(run, tmp_path / "run"))
    old = {key: value for key, value in manifest(run).items() if key not in ("files", "seal", "run_id")}
    (mine / "manifest.json").write_text(json.dumps(old), encoding="utf-8")
    whole = json.loads((mine / name).read_text(encoding="utf-8"))
    tops = [at for at in places_in(whole) if 0 < len(at) <= 3 and at[0] not in ("effective", "platform", "libraries")]
    wrongs = itertools.cycle(("text", [], None, -1e308))
    for at, wrong in zip(tops[:: 1 if name == "summary.json" else 2], wrongs, strict=False):
        changed = json.loads(json.dumps(whole))
        place = changed
        for key in at[:-1]:
            place = place[key]
        place[at[-1]] = wrong
        (mine / name).write_text(json.dumps(changed), encoding="utf-8")
        words = ["design-values", "--run", str(mine), "--output", str(tmp_path / "v.csv"), "--overwrite", "--quiet"]
        assert command(words) in (0, 2), (at, wrong, capsys.readouterr().err)


# --- resumed ----------------------------------------------------------------------------------------------------------


def halted_sites(case: Case, output: Path) -> tuple[dict, Path]:
    """Sites of which one is missing: the other is slid, and kept in the hidden folder."""
    given = {key: value for key, value in case.values().items() if key not in ("output", "dem", "releases")}
    table = case.folder / "sites.csv"
    rows = [f"one,{case.dem},{case.releases}", f"two,{case.dem},{case.folder / 'missing.gpkg'}"]
    table.write_text("\n".join(["site,dem,releases", *rows]) + "\n", encoding="utf-8")
    asked = {**given, "sites": str(table), "output": str(output)}
    with pytest.raises(UserError, match="1 of 2 sites failed"):
        run_sites.TOOL(**asked)
    shutil.copy(case.releases, case.folder / "missing.gpkg")
    return asked, output.parent / f".{output.name}.part" / "sites" / "one"


@pytest.mark.parametrize("damage", ["a bit", "half", "another run", "nothing"])
def test_a_site_continues_only_as_it_was_written(copied, tmp_path, damage):
    asked, part = halted_sites(copied, tmp_path / "region")
    poses = part / "poses.parquet"
    whole = poses.read_bytes()
    if damage == "a bit":
        poses.write_bytes(whole[:500] + bytes([whole[500] ^ 1]) + whole[501:])
    elif damage == "half":
        poses.write_bytes(whole[: len(whole) // 2])
    elif damage == "another run":
        other = copied.run(friction="0.5", output=str(tmp_path / "other"))
        shutil.rmtree(part)
        shutil.copytree(other, part)
    run_sites.TOOL(**asked, resume=True)
    assert (tmp_path / "region/sites/one/poses.parquet").read_bytes() == whole
    assert check.TOOL(path=str(tmp_path / "region/sites/one")).status == 0


def test_a_site_is_slid_again_where_the_source_of_its_vrt_changed(copied, tmp_path):
    """The VRT itself keeps its bytes and its time."""
    dem = copied.dem
    copied.dem = vrt_of(dem, copied.folder / "dem.vrt")
    asked, part = halted_sites(copied, tmp_path / "region")
    before = manifest(part)
    write_dem(Path(dem), flat=True)
    run_sites.TOOL(**asked, resume=True)
    after = manifest(tmp_path / "region/sites/one")
    assert after["run_id"] != before["run_id"]
    assert after["digests"]["scene"] != before["digests"]["scene"]
