"""The report without a browser: its numbers are the summary's, names are text, missing data are reported."""

from __future__ import annotations

import json
import re
import shutil
import struct
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import rasterio
import shapely
from matplotlib.figure import Figure
from rasterio.transform import from_origin
from slope_case import Case, edit_manifest, layer, points, summary, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.report import rounded
from deadwood_algorithms.report.figures import Drawing
from deadwood_algorithms.report.markup import LONG, element, embedded_json, remarked, table
from deadwood_algorithms.report.sections import calculation_words, points_words
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.simulate import fidelity_trade
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_algorithms.tools import make_report
from deadwood_engine import STOP_REASONS

ROOT = Path(__file__).parents[3]
EDGE_IN = 0.02  # by which a hairline of a letter may exceed a figure
EVIL = "<script>alert('&amp;')</script>\"$x^2$"


class Reader(HTMLParser):
    """The elements of a page, and its visible text."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.said: list[str] = []
        self._open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._open.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href", "action")]

    def handle_endtag(self, tag):
        if tag in self._open:
            while self._open.pop() != tag:
                pass

    def handle_data(self, data):
        if not {"script", "style"} & set(self._open):
            self.said.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.said))


def page_of(*runs: Path, **more) -> tuple[str, dict]:
    output = runs[0].parent / "page.html"
    make_report.TOOL(runs=",".join(map(str, runs)), output=str(output), overwrite=True, **more)
    page = output.read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="report-data">(.*?)</script>', page, re.S)
    assert found
    return page, json.loads(found[1])


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def lying(case) -> str:
    logs = [shapely.LineString([(15.0, 50.0), (25.0, 51.0)])]
    return write_layer(case.folder / "lying.gpkg", logs, lying_id=["old"], diameter_cm=[60.0])


@pytest.fixture(scope="module")
def boulders(case) -> str:
    return write_layer(
        case.folder / "boulders.gpkg", points((30.0, 55.0), (5.0, 60.0)), block_id=["big", "small"],
        diameter_m=[3.0, 1.0], height_m=[2.0, np.nan],
    )  # fmt: skip


@pytest.fixture(scope="module")
def run(case, lying, boulders) -> Path:
    return case.run(output=str(case.folder / "full"), lying_logs=lying, blocks=boulders, **case.everything())


@pytest.fixture(scope="module")
def page(run) -> tuple[str, dict]:
    return page_of(run)


def test_the_numbers_of_the_page_are_those_of_the_summary(run, page):
    told = summary(run)
    assert page[1]["runs"][0]["summary"] == told
    text = Reader(page[0]).text
    for each in told["reach"]:
        assert f"{each['line_id']}: reached by {rounded.shown_share(each, Words('en'))}".replace("\xa0", " ") in text
    for each in told["barriers"]:
        row = " ".join(
            str(each[name]) for name in ("n_reached", "n_stopped", "n_overjumped", "n_passed_beside", "n_hits")
        )
        assert f"{each['barrier_id']} {row}" in text
    assert f"{told['trees']['n_total']} {told['trees']['n_hit']} {told['trees']['n_stopping']}" in text
    assert "no layer was given" not in text


def test_every_part_that_was_promised_is_there(page):
    text = Reader(page[0]).text
    parts = (
        "question",
        "modelled",
        "map",
        "reach",
        "arrivals",
        "spread",
        "ways",
        "profile",
        "ledgers",
        "three_d",
        "accuracy",
    )
    for part in (*parts, "provenance", "command", "hashes", "sampling", "calculation"):
        assert Words("en").say(part) in text, part
    assert "deadwood-tool slide-logs --dem" in text
    assert len(re.findall(r"\b[0-9a-f]{64}\b", text)) >= 7  # DEM, releases, trees, barriers, lying logs, blocks, lines


def test_no_id_stands_twice_and_every_address_within_the_page_leads_somewhere(page):
    ids = re.findall(r'[ "]id="([^"]+)"', page[0])
    assert sorted(ids) == sorted(set(ids))
    assert {each for each in re.findall(r'href="#([^"]+)"', page[0]) if not each.startswith("r0_")} <= set(ids)


def test_the_pages_that_are_signed_come_first_and_paths_and_flags_last(page):
    """Question, scenario, conclusion with what its interval excludes, numbers, map, judgement, signature; the annex."""
    order = ["question", "scenario", "conclusion", "numbers", "map", "judgement"]
    order += ["annex", "three_d", "r0-provenance"]
    places = [page[0].index(f'id="{each}"') for each in order]
    assert places == sorted(places)
    text = Reader(page[0][: places[-1]]).text
    assert "Place Date Name Signature" in text
    assert "They do not include the friction coefficient (" in text
    assert "/tmp/" not in text
    assert re.findall(r" --[a-z]", text) == []


def test_what_scrolls_can_be_scrolled_by_the_keyboard_and_has_a_name(page):
    for part in re.findall(r'<div [^>]*class="(?:scroll|frame|card)[^"]*"[^>]*>', page[0]):
        assert 'tabindex="0"' in part
        assert re.search(r'role="group" aria-label="[^"]+"', part), part


def test_the_page_asks_nothing_of_any_other_file(page):
    content = Reader(page[0])
    assert {each[:1] if each.startswith("#") else each.split(":")[0] for each in content.addresses} <= {"#", "data"}
    assert not re.search(r"(?:url\(|@import|fetch\(|XMLHttpRequest|import\s)\s*['\"]?(?!#)https?:", page[0])
    assert "default-src 'none'" in page[0]


def test_the_space_holds_solids_in_true_size(case, page):
    import base64

    space = page[1]["space"][0]

    def rows(text: str) -> np.ndarray:
        return np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 8)

    trees = rows(space["trees"])
    assert np.allclose(trees[:, 5] - trees[:, 2], 20.0, atol=1e-3)
    assert np.allclose(trees[:, 6:], [0.25, 0.125])
    deposits = rows(space["deposits"])
    assert np.allclose(np.linalg.norm(deposits[:, 3:6] - deposits[:, :3], axis=1), 10.0, atol=1e-2)
    assert [each["height"] for each in space["barriers"]] == [1.5, 4.0]
    assert np.allclose(rows(space["lying"])[:, 6].max(), 0.3)
    slices = rows(space["blocks"])
    big, small = slices[::2], slices[1::2]  # slice by slice, from the lowest up
    for each, diameter in ((big, 3.0), (small, 1.0)):
        assert each[-1, 5] - each[0, 2] == pytest.approx(diameter, abs=1e-4)
        assert each[:, 6:].max() == pytest.approx(0.5 * diameter, abs=1e-4)
    falls = 5.0 * np.tan(np.radians(35.0))  # the big one is lower by this; it sticks out by 2 m, the small one by 1 m
    assert big[-1, 5] - small[-1, 5] == pytest.approx(2.0 - 1.0 - falls, abs=1e-2)
    poses = np.frombuffer(base64.b64decode(space["poses"]), "<u2").reshape(-1, 2, 3) * np.array(space["scale"])
    assert np.allclose(np.linalg.norm(poses[:, 1] - poses[:, 0], axis=1), 10.0, atol=0.5)  # chords between two poses
    assert sum(each["n"] for each in space["logs"]) == len(poses)
    groups = {group for each in space["logs"] for group in each["groups"]}
    assert groups == {"fast", "far", "reach", "random"}


def test_a_run_with_next_to_nothing(case):
    bare = case.run(output=str(case.folder / "bare"), trajectories="none")
    page, data = page_of(bare)
    text = Reader(page).text
    assert "No roads, railways or houses were given" in text
    assert "No trajectory was stored" in text
    assert "Arrivals" not in text.replace("no arrivals", "")
    assert data["space"][0]["logs"] == []
    assert Words("en").say("ledgers_none") in text


def test_lost_inputs_are_reported_and_the_rest_continues(run, tmp_path):
    moved = shutil.copytree(run, tmp_path / "moved")
    names = ("dem", "trees", "barriers", "lying_logs", "blocks", "lines", "releases")
    edit_manifest(moved, **{name: f"/nowhere/{name}.gpkg" for name in names})
    page, data = page_of(moved)
    text = Reader(page).text
    for name, file in (("terrain model", "dem"), ("lying logs", "lying_logs"), ("boulders", "blocks")):
        assert f"The {name} of the run, {file}.gpkg, could no longer be read" in text  # its place: annex
    assert "Without the terrain model there is no 3-D view" in text
    assert data["space"] == []
    assert "Arrivals" in text  # they need only the run
    with pytest.raises(UserError, match="terrain model no longer exists"):
        make_report.TOOL(runs=str(moved), output=str(tmp_path / "x.html"), gltf=str(tmp_path / "x.glb"))
    assert not (tmp_path / "x.html").exists()


def test_names_never_become_markup(case, tmp_path):
    """Names of lines, barriers, trees, releases, folders and titles."""
    lines = write_layer(tmp_path / "l.gpkg", [shapely.LineString([(0.5, 25.0), (59.5, 25.0)])], line_id=[EVIL])
    walls = write_layer(
        tmp_path / "b.gpkg", [shapely.LineString([(5.0, 45.0), (55.0, 45.0)])], barrier_id=[EVIL], height_m=[3.0]
    )
    trees = write_layer(
        tmp_path / "t.gpkg",
        points((20.0, 60.0), (30.0, 60.0)),
        tree_id=[EVIL, "x"],
        dbh_cm=[90.0] * 2,
        height_m=[20.0] * 2,
    )
    logs = write_layer(
        tmp_path / "r.gpkg", points((20.0, 70.0), (30.0, 72.0)), log_id=[1, 2], release_id=[EVIL, "</title>"]
    )
    made = case.run(output=str(tmp_path / "<b>run"), releases=logs, lines=lines, barriers=walls, trees=trees)
    page, data = page_of(made, title=EVIL)
    content = Reader(page)
    assert content.tags.count("script") == 4  # the last has the page's record
    assert "b" not in content.tags
    assert content.tags.count("title") == 1
    assert "alert('&amp;')" not in re.sub(r"(?s)<script.*?</script>", "", page)
    assert data["runs"][0]["summary"]["reach"][0]["line_id"] == EVIL
    assert EVIL in content.text.replace("\\", "")


def test_logs_that_leave_the_terrain_are_warned_of(case, tmp_path):
    logs = write_layer(tmp_path / "r.gpkg", points((3.0, 70.0), (4.0, 80.0)), log_id=[1, 2])
    made = case.run(output=str(tmp_path / "off"), releases=logs, friction="0.02")
    left = summary(made)["logs"]["by_stop_reason"]["left_dem"]
    assert left > 0
    assert f"Logs that left the terrain model: {left}." in Reader(page_of(made)[0]).text


def test_two_runs_are_compared(case, run):
    none = case.run(output=str(case.folder / "none"), lines=case.lines)
    page, data = page_of(none, run)
    text = Reader(page).text
    assert [each["name"] for each in data["runs"]] == ["none", "full"]
    assert "The same logs in each run" in text
    assert "Share of the logs that pass, minus that of none" in text
    assert len(data["space"]) == 2


def test_three_runs_have_a_sentence_for_each_difference(case, run):
    """To the first run and to the one before; the last has the logs counted here, one by one."""
    none = case.run(output=str(case.folder / "none"), lines=case.lines, overwrite=True)
    trees = case.run(output=str(case.folder / "trees"), lines=case.lines, trees=case.trees)
    text = Reader(page_of(none, trees, run)[0]).text
    reached = {each: set(layer(each, "reached_by").query("line_id == 'road'")["log_id"]) for each in (trees, run)}
    n = summary(run)["logs"]["released"]
    lost, gained = len(reached[trees] - reached[run]), len(reached[run] - reached[trees])
    low, high = (100.0 * each for each in paired_interval(lost, gained, n))
    for name, other in (("trees", "none"), ("full", "none"), ("full", "trees")):
        assert text.count(f"{name} compared with {other}:") == 2, (name, other)  # two lines
    said = re.search(r"full compared with trees:[^()]*\(([^ ]+) to ([^ )]+)\) points(?: at road)?", text)
    assert said
    ends = [float(each.replace("\u2212", "-")) for each in said.groups()]
    assert ends == pytest.approx([low, high], abs=0.6)  # rounded to a point or finer


def test_a_baseline_that_is_named_is_the_one_of_every_number(case, run, tmp_path, said):
    """Also where it has more obstacles, which is warned about once, by its name."""
    none = case.run(output=str(tmp_path / "bare"), lines=case.lines)
    page, data = page_of(none, run, baseline="full", feedback=said)
    text = Reader(page).text
    assert [each["name"] for each in data["runs"]] == ["full", "bare"]
    assert "Share of the logs that pass, minus that of full" in text
    assert "Differences to full" in text
    assert sum("has more obstacles" in each for each in said.warnings) == 1
    assert any("the baseline full has more obstacles" in each for each in said.warnings)
    reach = re.search(r"reach road [^(]*\([^)]*\) [\d.]+ \([^)]*\) ([+\u2212][\d.]+) \(", text)
    assert reach, text[text.index("reach road") :][:200]
    assert reach[1].startswith("+")  # more logs reach the road without obstacles than with them


def test_runs_of_other_logs_stand_side_by_side_uncompared(case, run, tmp_path):
    logs = write_layer(tmp_path / "r.gpkg", points((20.0, 70.0), (30.0, 72.0)), log_id=[1, 2])
    other = case.run(output=str(tmp_path / "other"), releases=logs)
    text = Reader(page_of(run, other)[0]).text
    assert "The runs are not compared:" in text
    assert "Run other" in text


def test_the_scenario_box_says_what_was_slid(case, tmp_path):
    """Sizes and posture as the releases' columns gave them, and a command without the options that they override."""
    lying = write_layer(
        tmp_path / "lying.gpkg",
        points((30.0, 60.0), (32.0, 60.0)),
        dbh_cm=[45.0, 46.0],
        length_m=[12.0, 12.0],
        orientation=["lying", "lying"],
        azimuth_deg=[90.0, 45.0],
    )
    run = case.run(output=str(tmp_path / "run"), releases=lying, friction="0.3")
    text = Reader(page_of(run, author="A. Muster", project="Road 12")[0]).text
    assert "Scenario project Road 12 author A. Muster logs 2, length 12 m, DBH 45.5 cm (45.0 to 46.0)" in text
    assert "posture at the start lying friction 0.3 rolling friction 0.1 restitution 0" in text
    command = text[text.index("deadwood-tool slide-logs") :]
    for option in ("--orientation", "--dbh-cm", "--length-m"):
        assert option not in command
    assert "--density-kg-m3 300" in command


def test_a_run_of_an_older_version_is_reported_in_its_own_words(run, tmp_path):
    """Its summary contains only sentences: they are shown unchanged, and in another language a line says so."""
    old = tmp_path / "old"
    shutil.copytree(run, old)
    told = summary(old)
    for name in ("modelled_facts", "scenario", "counted"):
        del told[name]
    (old / "summary.json").write_text(json.dumps(told), encoding="utf-8")
    edit_manifest(old)  # none of that time has a seal
    german = Reader(page_of(old, language="de")[0]).text
    assert "Reibung Coulomb, 0.25 everywhere" in german
    assert "Von einer älteren Version, die es nur auf Englisch sagt." in german
    assert "older version" not in Reader(page_of(old)[0]).text


@pytest.mark.parametrize(
    ("language", "asked", "friction"),
    [
        ("fr", "Combien atteignent", "frottement Coulomb, 0,25 partout"),
        ("it", "Quanti raggiungono", "attrito Coulomb, 0,25 ovunque"),
    ],
)
def test_in_french_and_italian(run, language, asked, friction):
    page = page_of(run, language=language)[0]
    text = Reader(page).text
    assert asked in text
    assert friction in text
    assert f'<html lang="{language}">' in page
    for english in ("What was modelled", "95th percentile", "held by a tree", "rigid truncated"):
        assert english not in text


def test_in_german(run):
    text = Reader(page_of(run, language="de")[0]).text
    assert "Wie viele erreichen" in text
    assert "Reibung Coulomb, überall 0,25" in text
    assert re.search(r"\d,\d", text)
    for english in ("What was modelled", "95th percentile", "held by a tree", "rigid"):
        assert english not in text


@pytest.mark.parametrize("language", ["en", "de"])
def test_all_that_a_figure_says_lies_within_it(run, tmp_path, monkeypatch, language):
    """Titles, legends, names of ticks: nothing drawn exceeds the edge of the figure."""
    over = []

    def look(drawing, folder):
        figure = drawing.made()
        figure.draw_without_rendering()
        box = figure.get_tightbbox()
        if min(box.x0, box.y0) < -EDGE_IN or (box.max > figure.get_size_inches() + EDGE_IN).any():
            over.append((drawing.name, box.extents, figure.get_size_inches()))
        return []

    monkeypatch.setattr(Drawing, "write", look)
    make_report.TOOL(
        runs=str(run), output=str(tmp_path / "p.html"), figures=str(tmp_path / "figures"), language=language
    )
    assert over == []


def test_figures_and_scene_as_files(run, tmp_path):
    figures = tmp_path / "figures"
    make_report.TOOL(runs=str(run), output=str(tmp_path / "p.html"), figures=str(figures), gltf=str(tmp_path / "s.glb"))
    stems = {each.stem for each in figures.glob("*.png")}
    profiles = {each for each in stems if each.startswith("r0_profile_")}  # the farthest log may be the fastest
    assert "r0_profile_fastest" in profiles <= {f"r0_profile_{name}" for name in ("farthest", "fastest", "median")}
    assert stems - profiles == {
        f"r0_{name}"
        for name in ("reach", "arrivals", "runout", "distributions", "map")  # too few logs for a spread
    }
    for stem in stems:
        assert (figures / f"{stem}.png").read_bytes()[:4] == b"\x89PNG"
        assert (figures / f"{stem}.pdf").read_bytes()[:5] == b"%PDF-"
        assert "<svg" in (figures / f"{stem}.svg").read_text()
    assert_sound_gltf((tmp_path / "s.glb").read_bytes())


def assert_sound_gltf(content: bytes) -> None:
    """The structure required by glTF 2.0: chunks, views within the buffer, accessors within views, their bounds."""
    magic, version, length, size, kind = struct.unpack("<4sIII4s", content[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON")
    told = json.loads(content[20 : 20 + size])
    rest, kind = struct.unpack("<I4s", content[20 + size : 28 + size])
    data = content[28 + size :]
    assert (kind, rest, told["buffers"]) == (b"BIN\0", len(data), [{"byteLength": len(data)}])
    for view in told["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(data)
    arrays = []
    for each in told["accessors"]:
        view, wide = (
            told["bufferViews"][each["bufferView"]],
            {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[each["type"]],
        )
        values = np.frombuffer(
            data, {5125: "<u4", 5126: "<f4"}[each["componentType"]], each["count"] * wide, view["byteOffset"]
        )
        arrays.append(values.reshape(-1, wide))
        assert np.isfinite(values.astype(float)).all()
        assert np.allclose(arrays[-1].min(axis=0), each["min"])
        assert np.allclose(arrays[-1].max(axis=0), each["max"])
    for mesh in told["meshes"]:
        for part in mesh["primitives"]:
            normal = arrays[part["attributes"]["NORMAL"]]
            assert np.allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-4)
            assert arrays[part["indices"]].max() < len(normal) == len(arrays[part["attributes"]["POSITION"]])
    assert {"terrain", "trees", "lying_logs", "blocks", "deposits", "barriers"} <= {
        each["name"] for each in told["nodes"]
    }
    assert told["animations"][0]["channels"]
    for sampler in told["animations"][0]["samplers"]:
        assert (np.diff(arrays[sampler["input"]][:, 0]) > 0.0).all()
        assert len(arrays[sampler["input"]]) == len(arrays[sampler["output"]])


def test_same_run_same_page(run, page):
    again, _ = page_of(run)
    assert again == page[0]


def test_a_large_terrain_is_thinned(tmp_path):
    """4000 x 4000 cells, all near enough to the logs to be shown."""
    from hand_run import Track, write_run

    with rasterio.open(
        tmp_path / "dem.tif", "w", driver="GTiff", width=4000, height=4000, count=1, dtype="float32", crs="EPSG:2056",
        transform=from_origin(2_786_000.0, 1_200_000.0, 1.0, 1.0), compress="deflate",
    ) as target:  # fmt: skip
        target.write(np.broadcast_to(np.linspace(2000.0, 1000.0, 4000, dtype="float32")[:, None], (4000, 4000)), 1)
    grid = {"nx": 4000, "ny": 4000, "cell": 1.0, "x0": 2_786_000.5, "y0": 1_196_000.5, "crs": "EPSG:2056"}
    facts = {"lines": 0, "speed": {"mean_ms": 1.0, "p95_ms": 1.0, "max_ms": 1.0}}
    tracks = [Track((200.0, 3800.0), (3800.0, 200.0)), Track((3800.0, 3800.0), (200.0, 200.0))]
    made = write_run(tmp_path / "big", tracks, dem=str(tmp_path / "dem.tif"), grid=grid)
    reasons = dict.fromkeys(STOP_REASONS, 0) | {"rest": 2}
    accuracy = {"fidelity": "fine", "time_step_s": 0.01, "station_spacing_m": 1.0, "penetration_max_m": 0.0}
    accuracy |= {"energy_error_rel_max": 0.0, "contact_residual_max": 0.0, "unconverged_steps": 0}
    told = {
        "logs": {"released": 2, "not_run": 0, "by_stop_reason": reasons, "started_in_contact": 0}, "reach": [],
        "spread": [], "barriers": [], "trees": None, "lying_logs": None, "modelled": {}, "accuracy": accuracy,
        "cost": {"cpu_s": 1.0, "wall_s": 1.0, "steps": 10, "logs_per_s": 2.0},
    } | facts  # fmt: skip
    (made / "summary.json").write_text(json.dumps(told))
    page, data = page_of(made)
    ground = data["space"][0]["ground"]
    assert max(ground["nx"], ground["ny"]) <= 260
    assert ground["nx"] * ground["cell"] > 3500.0
    assert len(page) < 6_000_000


def test_the_error_of_calculation_is_that_of_the_sites_table():
    page = (ROOT / "docs" / "explanation" / "two-errors.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(draft|standard|fine)` \|(.+)$", page, re.M)
    told = {name: tuple(cell.strip() for cell in row.split("|")[2:4]) for name, row in rows}
    signs = {name: tuple(cell.replace("-", "−") for cell in cells) for name, cells in told.items()}
    assert {name: (mean, worst.split(", ")[0]) for name, (mean, worst) in signs.items()} == {
        name: tuple(points_words(each, Words("en")) for each in row)
        for name, row in fidelity_trade.REACH_ERRORS.items()
    }


def test_numbers_are_rounded_as_far_as_their_interval_allows():
    english, german = Words("en"), Words("de")
    record = {"n_total": 1000, "n_reach": 206, "p": 0.206, "ci_low": 0.18208, "ci_high": 0.23217}
    assert rounded.shown_share(record, english) == "20.6\xa0% (18.2 to 23.2\xa0%)"
    many = {"n_total": 20000, "n_reach": 1820, "p": 0.091, "ci_low": 0.0871, "ci_high": 0.0951}
    assert rounded.shown_share(many, german) == "9,10\xa0% (8,71 bis 9,51\xa0%)"
    assert (
        rounded.shown_share({"n_total": 1000, "n_reach": 0, "ci_low": 0.0, "ci_high": 0.00383}, english)
        == "<\xa00.38\xa0%"
    )
    assert (
        rounded.shown_share({"n_total": 1000, "n_reach": 1000, "ci_low": 0.99617, "ci_high": 1.0}, english)
        == ">\xa099.62\xa0%"
    )
    lost = {"p_low_if_lost": 0.1, "p_high_if_lost": 0.5, "ci_low_if_lost": 0.08, "ci_high_if_lost": 0.54}
    assert rounded.percent_if_lost(lost, german) == "10 bis 50\xa0% (8 bis 54\xa0%)"
    assert rounded.shown_number(57936.59, english) == "57\u202f900"
    assert rounded.shown_number(0.04042, german, 2) == "0,040"
    assert rounded.shown_number(float("nan"), english) == "–"
    assert rounded.shown_number(-0.5, english, 2) == "−0.50"
    assert rounded.with_interval(-79.24, -81.6, -76.9, english, signed=True) == "−79.2 (−81.6 to −76.9)"
    nothing = float("nan"), float("nan")
    assert rounded.with_interval(1104.6, *nothing, english) == "1100"  # not 1.1e+03
    assert rounded.with_interval(2.999, *nothing, english, signed=True) == "+3.00"
    assert rounded.with_interval(-25.3, *nothing, german, signed=True) == "−25,3"
    assert rounded.with_interval(0.0, *nothing, english, signed=True) == "0"


@pytest.mark.parametrize(("language", "sign", "other"), [("en", ".", ","), ("de", ",", "."), ("fr", ",", ".")])
def test_axes_have_the_decimal_sign_of_the_language(language, sign, other):
    def draw() -> Figure:
        figure = Figure()
        left = figure.subplots()
        left.set(xlim=(0.0, 1.5), ylim=(0.0, 2.0))
        left.twinx().set(ylim=(0.0, 1.5))
        return figure

    figure = Drawing("ticks", "", draw, Words(language)).made()
    figure.draw_without_rendering()
    for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis, figure.axes[1].yaxis):
        shown = "".join(label.get_text() for label in axis.get_ticklabels())
        assert sign in shown
        assert other not in shown


def test_a_number_with_a_remark_is_no_sentence():
    """Its column is right-aligned and as narrow as the others; the markup of a cell is not read."""
    remark = remarked("721", "32 more logs for an interval")
    assert len(remark) > LONG
    assert 'class="text"' not in table(["quantity", "today"], [("energy", remark)])
    assert 'class="text"' in table(["line", "error"], [("road", "a sentence " * 5)])


def test_text_becomes_markup_in_one_place():
    assert element("p", "<b>", title='"') == '<p title="&quot;">&lt;b&gt;</p>'
    assert "&lt;i&gt;" in table(["<i>", "b"], [["a", "b"]])
    assert "</script>" not in embedded_json({"a": "</script><!--"})
    assert json.loads(embedded_json({"a": "</script>\u2028", "b": float("nan")})) == {"a": "</script>\u2028", "b": None}


def test_wrong_names_of_runs(run, tmp_path):
    with pytest.raises(UserError, match="--names is 'a,b'"):
        make_report.TOOL(runs=str(run), names="a,b", output=str(tmp_path / "x.html"))
    with pytest.raises(UserError, match="a folder twice"):
        make_report.TOOL(runs=f"{run},{run}", output=str(tmp_path / "x.html"))
    with pytest.raises(UserError, match="does not exist"):
        make_report.TOOL(runs=str(tmp_path / "no"), output=str(tmp_path / "x.html"))
    assert not (tmp_path / "x.html").exists()


def test_a_folder_with_a_comma(run, tmp_path):
    place = shutil.copytree(run, tmp_path / "a,b")
    assert page_of(place)[1]["runs"][0]["name"] == "a,b"


def test_the_error_of_draft_and_standard_is_that_of_random_slopes():
    said = {name: calculation_words({"fidelity": name}, {}, Words("en")) for name in ("draft", "standard", "fine")}
    for name, slopes in fidelity_trade.SLOPE_ERRORS.items():
        assert said[name].startswith(points_words(slopes.mean, Words("en")))
        assert (
            f"of {slopes.sd.value:.1f} ({slopes.sd.ci_low:.1f} to {slopes.sd.ci_high:.1f}), against fine" in said[name]
        )
    assert "five synthetic slopes" in said["fine"]
    assert "random" not in said["fine"]
