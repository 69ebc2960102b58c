"""reproduce-paper with tiny numbers: its folder, resuming, the layout of a user's data, bad input."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import rasterio
from rasterio.transform import from_origin

from deadwood_algorithms.paper.site import read_site, write_coarser, write_twin
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.tools.reproduce_paper import TOOL

KEYS = {"id", "statement", "section", "paper", "ours", "ci_low", "ci_high", "holds", "why", "verdict", "panel"}


class Breaks(Quiet):
    """A user who interrupts when a step of this name begins."""

    def __init__(self, at: str) -> None:
        self.at, self.seen = at, ""

    def progress(self, done: float, total: float, what: str) -> None:
        self.seen = what

    def cancelled(self) -> bool:
        return self.at in self.seen


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    """The Rothenbrunnen twin, written in the layout of --site-data."""
    folder = tmp_path_factory.mktemp("data")
    write_twin("rothenbrunnen", folder / "rothenbrunnen")
    return folder


def test_a_run_is_interrupted_resumed_and_leaves_its_folder(data, tmp_path):
    ask = {
        "site": "rothenbrunnen", "logs": 8, "quick": True, "site_data": str(data), "output": str(tmp_path / "out"),
    }  # fmt: skip
    with pytest.raises(Cancelled):
        TOOL(feedback=Breaks("none: sliding"), **ask)
    work = tmp_path / ".out.part"
    done = work / "rothenbrunnen" / "runs" / "als" / "summary.json"
    before = done.stat().st_mtime_ns
    assert not (tmp_path / "out").exists()
    with pytest.raises(UserError, match="begun with other seed"):
        TOOL(**ask, resume=True, seed=3)

    TOOL(**ask, resume=True)
    out = tmp_path / "out"
    assert (out / "rothenbrunnen" / "runs" / "als" / "summary.json").stat().st_mtime_ns == before
    assert not work.exists()
    found = json.loads((out / "findings.json").read_text(encoding="utf-8"))
    assert (out / "findings.csv").read_bytes().startswith(b"\xef\xbb\xbf")  # so that a spreadsheet reads its words
    assert len(found) > 8
    for each in found:
        assert set(each) == KEYS
        assert each["holds"] is None
        assert "Not judged" in each["why"]
    assert len({each["id"] for each in found}) == len(found)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/png") >= 3
    assert "http" not in page
    for manifest in out.rglob("manifest.json"):
        assert ".out.part" not in manifest.read_text(encoding="utf-8")


def test_tiles_are_joined_and_a_table_of_trees_is_taken(data, tmp_path):
    place = tmp_path / "rothenbrunnen"
    shutil.copytree(data / "rothenbrunnen", place)
    (place / "dem").mkdir()
    with rasterio.open(place / "dem.tif") as whole:
        heights = whole.read(1)
        for k, first in enumerate((0, 400)):
            corner = from_origin(whole.bounds.left, whole.bounds.top - 0.5 * first, 0.5, 0.5)
            profile = whole.profile | {"height": 400, "transform": corner}
            with rasterio.open(place / "dem" / f"tile_{k}.tif", "w", **profile) as tile:
                tile.write(heights[first : first + 400], 1)
    (place / "dem.tif").unlink()
    (place / "site.json").unlink()
    (place / "trees.gpkg").rename(place / "elsewhere.gpkg")
    (place / "trees.csv").write_text("tree_id,x,y,dbh_cm,height_m\n1,2752100,1181200,40,20\n", encoding="utf-8")
    site = read_site("rothenbrunnen", place, tmp_path / "prepared")
    with rasterio.open(site.dem) as joined:
        assert (joined.read(1) == heights).all()
    assert site.trees.endswith("trees.csv")
    assert site.facts["length_m"] == 15.0
    write_coarser(site.dem, 4, tmp_path / "coarse.tif")
    with rasterio.open(tmp_path / "coarse.tif") as coarse:
        assert coarse.res == (2.0, 2.0)
        assert coarse.bounds.left == 2_752_000.0
        assert coarse.read(1)[0, 0] == pytest.approx(heights[:4, :4].mean(), abs=1e-3)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda place: (place / "trees.gpkg").unlink(), "neither trees.gpkg nor trees.csv"),
        (lambda place: (place / "dem.tif").unlink(), "neither dem.tif nor a folder dem"),
        (lambda place: (place / "barriers.gpkg").unlink(), "barriers.gpkg: this layer of the site is missing"),
        (lambda place: (place / "site.json").write_text("{"), "site.json: not JSON"),
        (lambda place: (place / "site.json").write_text('{"length_m": -3}'), "'length_m' is -3"),
        (lambda place: (place / "site.json").write_text('{"lenght_m": 3}'), "'lenght_m' is unknown"),
        (lambda place: (place / "site.json").write_text('{"road": "B28"}'), "no line has line_id 'B28'"),
        (shutil.rmtree, "the folder of the site rothenbrunnen does not exist"),
    ],
)
def test_bad_site_data_is_reported_in_one_line(data, tmp_path, spoil, message):
    place = tmp_path / "rothenbrunnen"
    shutil.copytree(data / "rothenbrunnen", place)
    spoil(place)
    with pytest.raises(UserError, match=message) as said:
        read_site("rothenbrunnen", place, tmp_path / "prepared")
    assert "\n" not in str(said.value)
