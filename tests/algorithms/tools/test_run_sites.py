"""run-sites: each site equals a separate run, all together equal one run, and a failure affects only its site."""

from __future__ import annotations

import json
import random
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from dask_processes import Site
from killed_run import met_run
from PIL import Image
from slope_case import RASTERS, Case, assert_same_run, bands, layer, points, raster, summary, write_dem, write_layer

from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.schemas.looks import ROAD, rgb
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.tools import run_sites, slide_logs

LEAST = {"danger_least": 3}
SHARED = {"friction": "0.25", "dbh_cm": 40.0, "length_m": 10.0, "fidelity": "draft", "time_limit_s": 60.0}


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def by(case) -> Path:
    """The releases of the case by their release_id, with everything on the slope."""
    return sites(case, "by", by="release_id", releases=case.releases, trajectories="all", **LEAST, **case.everything())


def sites(case: Case, name: str, feedback: Any = None, **values: Any) -> Path:
    output = case.folder / name
    given = {"dem": case.dem, **SHARED, **values, "output": str(output)}
    run_sites.TOOL(feedback=feedback, **{key: value for key, value in given.items() if value is not None})
    return output


def table(folder: Path, text: str, name: str = "sites.csv") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def overview(run: Path) -> pd.DataFrame:
    return pd.read_csv(run / "overview.csv", encoding="utf-8-sig", dtype={"site": str})


def failure(run: Path, site: str) -> str:
    return overview(run).set_index("site").at[site, "message"]


# --- the same as by hand, and as one run over all -------------------------------------------------------------------


def test_a_site_is_the_run_that_its_manifest_makes_by_hand(case, by, tmp_path):
    for site in ("a", "b"):
        run = by / "sites" / site
        made = json.loads((run / "manifest.json").read_text(encoding="utf-8"))["parameters"]
        assert made["output"] == str(run)
        assert made["releases"] == str(by / "releases" / f"{site}.gpkg")
        slide_logs.TOOL(**{**made, "output": str(tmp_path / site), "resume": False})
        assert_same_run(run, tmp_path / site)
        assert {each.name for each in run.iterdir()} == {each.name for each in (tmp_path / site).iterdir()}
        for file in ("run.gpkg", "poses.parquet", *(f"{each}.tif" for each in (*RASTERS, "danger"))):
            assert (run / file).read_bytes() == (tmp_path / site / file).read_bytes(), file


def test_all_sites_are_one_run_over_all(case, by, tmp_path):
    one = case.run(output=str(tmp_path / "one"), danger_counts=True, **LEAST, **case.everything())
    parts = pd.concat([layer(by / "sites" / site, "deposits") for site in ("a", "b")]).set_index("log_id")
    whole = layer(one, "deposits").set_index("log_id")
    assert parts.loc[whole.index].equals(whole)
    merged = by / "merged" / "dem"
    assert {each.name for each in merged.glob("*.tif")} == {f"{name}.tif" for name in (*RASTERS, "danger")}
    for name in (*RASTERS, "danger"):
        assert bands(merged / f"{name}.tif") == bands(one / f"{name}.tif"), name
        assert (merged / f"{name}.tif").read_bytes() == (one / f"{name}.tif").read_bytes(), name
    known = [np.isfinite(raster(place / "danger.tif")) for place in (merged, by / "sites" / "a", by / "sites" / "b")]
    assert (known[0] & ~known[1] & ~known[2]).any()  # cells of which neither site alone could tell
    facts = json.loads((by / "summary.json").read_text(encoding="utf-8"))
    wanted = {each["line_id"]: (each["n_reach"], each["p"], each["ci_low"]) for each in summary(one)["reach"]}
    assert {each["line_id"]: (each["n_reach"], each["p"], each["ci_low"]) for each in facts["reach"]} == wanted
    assert facts["merged"] == [
        {"folder": "dem", "sites": ["a", "b"], "logs": 24, "rasters": sorted(f"{n}.tif" for n in (*RASTERS, "danger"))}
    ]


def test_merged_tile_by_tile_is_merged_at_once(case, by, tmp_path, monkeypatch, said):
    from deadwood_algorithms.evaluate.sites import mosaic

    monkeypatch.setattr(mosaic, "WHOLE_CELLS", 1)
    monkeypatch.setattr(mosaic, "TILE_CELLS", 16)
    (pieces,) = mosaic.pieces_by_grid([(by / "sites" / site, 12) for site in ("a", "b")])
    written = mosaic.merge(tmp_path / "tiles", pieces, LEAST["danger_least"], said)
    assert sorted(written) == sorted((*RASTERS, "danger"))
    for name in (*RASTERS, "danger"):
        assert bands(tmp_path / "tiles" / f"{name}.tif") == bands(by / "merged/dem" / f"{name}.tif"), name
        assert (tmp_path / "tiles" / f"{name}.qml").is_file()


def test_the_overview_says_what_the_runs_say(by):
    rows = overview(by)
    assert rows[["site", "line_id"]].to_numpy().tolist() == [[s, x] for s in "ab" for x in ("road", "house")]
    for _, row in rows.iterrows():
        run = by / "sites" / row["site"]
        facts, deposits = summary(run), layer(run, "deposits")
        line = next(each for each in facts["reach"] if each["line_id"] == row["line_id"])
        for name in ("n_reach", "p", "ci_low", "ci_high"):
            assert row[name] == pytest.approx(line[name], rel=1e-12)
        assert row["released"] == 12
        assert row["energy_max_kj"] == pytest.approx(deposits["energy_max_kj"].max(), rel=1e-12)
        assert row["speed_max_ms"] == pytest.approx(deposits["speed_max_ms"].max(), rel=1e-6)
        assert row["penetration_max_m"] == facts["accuracy"]["penetration_max_m"]
        assert row["wall_s"] == pytest.approx(facts["cost"]["wall_s"])
    places = gpd.read_file(by / "overview.gpkg", layer="sites").set_index("site")
    for site in "ab":
        released = layer(by / "sites" / site, "deposits")
        at = shapely.points(released["release_x"], released["release_y"])
        assert shapely.contains(places.loc[[site]].geometry.iloc[0], at).all()
    with Image.open(by / "overview.png") as picture:
        seen = np.asarray(picture.convert("RGB")).astype(int)
    inked = (seen < 250).any(axis=2)
    margins = [np.flatnonzero(each)[[0, -1]] for each in (inked.any(axis=0), inked.any(axis=1))]
    for (first, last), size in zip(margins, reversed(inked.shape), strict=True):
        assert max(first, size - 1 - last) < 0.03 * size  # no white bands
    assert (np.abs(seen - np.multiply(255, rgb(ROAD))).max(axis=2) < 10).sum() > 100  # the road that they reach


def test_scattered_groups_have_windows_of_their_own(case, monkeypatch, tmp_path):
    """A region that does not fit into memory is refused as one run, with the command of run-sites for it."""
    from deadwood_algorithms.evaluate.sites import mosaic
    from deadwood_algorithms.files.free_memory import SHARE
    from deadwood_algorithms.scene import memory, reach
    from deadwood_algorithms.simulate import windows

    dem = write_dem(tmp_path / "fine.tif", cell=0.05, flat=True)  # 1200 x 2000 cells
    for module in (windows, mosaic):
        monkeypatch.setattr(module, "WHOLE_CELLS", 100_000)
    monkeypatch.setattr(reach, "BLOCK_CELLS", 64)
    places = [(6.0, 12.0), (6.0, 14.0), (54.0, 95.0)]
    releases = write_layer(tmp_path / "far.gpkg", points(*places), area=["south", "south", "north"])
    given = {"releases": releases, "dem": dem, "friction": "5.0", "length_m": 3.0, "threads": 1, "rest_speed_ms": 0.5}
    most = 1_000_000 * (40 + 24) / SHARE
    monkeypatch.setattr(memory, "free_bytes", lambda: int(most))
    with pytest.raises(UserError, match=r"million cells need .* are free; .*run-sites --by FIELD"):
        case.run(output=str(tmp_path / "one"), **given)
    run = sites(case, "far", by="area", **given)
    assert overview(run)["released"].tolist() == [2, 1]
    monkeypatch.undo()
    assert (
        summary(run / "sites" / "south")["modelled"]["window"] != summary(run / "sites" / "north")["modelled"]["window"]
    )


# --- tables and folders of sites ------------------------------------------------------------------------------------


def test_a_table_gives_each_site_its_own(case, tmp_path, monkeypatch):
    place = case.folder / "tables"
    place.mkdir()
    text = "site;dem;releases;friction;time-limit-s;report;owner\n"
    text += "steep;../dem.tif;../releases.gpkg;0,5;;;someone\nplain;;../releases.gpkg;;30;;\n"
    monkeypatch.chdir(tmp_path)  # paths are seen from the table
    run = sites(case, "table", sites=table(place, text), releases=None)
    steep, plain = (
        json.loads((run / "sites" / name / "manifest.json").read_text(encoding="utf-8"))["parameters"]
        for name in ("steep", "plain")
    )
    assert (steep["friction"], plain["friction"]) == (0.5, 0.25)
    assert (steep["time_limit_s"], plain["time_limit_s"]) == (60.0, 30.0)
    assert steep["releases"] == plain["releases"] == case.releases
    assert_same_run(
        run / "sites" / "steep", case.run(output=str(tmp_path / "one"), friction="0.5", trajectories="1000")
    )


def test_a_folder_of_configurations_gives_each_site_its_own(case, by, tmp_path):
    folder = tmp_path / "configs"
    folder.mkdir()
    (folder / "one.json").write_text(json.dumps({"friction": 0.4, "releases": case.releases}))
    (folder / "two.json").write_text((by / "sites" / "b" / "manifest.json").read_text(encoding="utf-8"))
    run = sites(case, "configs", configs=str(folder))
    assert overview(run)["site"].tolist() == ["one", "two", "two"]
    assert_same_run(run / "sites" / "two", by / "sites" / "b")


def test_scenarios_are_not_added_up(case, said, tmp_path):
    text = f"site,releases,friction\none,{case.releases},0.3\ntwo,{case.releases},0.4\n"
    run = sites(case, "scenarios", said, sites=table(tmp_path, text))
    assert not (run / "merged").exists()
    assert "dem: not merged, because two slid the same logs as another site" in said.notes


def test_sites_on_other_terrain_models_are_not_merged(case, tmp_path):
    other = write_dem(tmp_path / "coarse.tif", cell=2.0)
    text = f"site,dem,releases\nfine,{case.dem},{case.releases}\ncoarse,{other},{case.releases}\n"
    run = sites(case, "apart", sites=table(tmp_path, text), dem=None)
    assert not (run / "merged").exists()
    assert json.loads((run / "summary.json").read_text(encoding="utf-8"))["merged"] == []


# --- failures, interruptions ----------------------------------------------------------------------------------------


def test_a_failure_is_reported_and_the_others_are_finished_and_kept(case, said, tmp_path):
    text = (
        f"site,releases,friction\ngood,{case.releases},\nmissing,{tmp_path / 'none.gpkg'},\nodd,{case.releases},steep\n"
    )
    named = table(tmp_path, text)
    with pytest.raises(UserError, match=r"2 of 3 sites failed \(missing, odd\).*overview.csv.*--resume"):
        sites(case, "failing", said, sites=named)
    run = case.folder / "failing"
    assert overview(run)["status"].tolist() == ["done", "failed", "failed"]
    assert "does not exist" in failure(run, "missing")
    assert "steep" in failure(run, "odd")
    told = [f"{site}: {failure(run, site)}" for site in ("missing", "odd")]
    assert [each for each in said.warnings if not each.startswith("good: ")] == told
    facts = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert facts["sites"] == {"asked": 3, "done": 1, "failed": 2}
    places = gpd.read_file(run / "overview.gpkg", layer="sites")
    assert places["site"].tolist() == ["good", "odd"]  # the place of the other is unknown
    slid = (run / "sites" / "good" / "run.gpkg").stat()
    style = run / "sites" / "good" / "energy_max.qml"
    style.write_text("<qgis>mine</qgis>", encoding="utf-8")  # restyled in QGIS: no damage
    table(tmp_path, text.replace(str(tmp_path / "none.gpkg"), case.releases).replace("steep", "0.3"))
    sites(case, "failing", sites=named, resume=True)
    assert overview(run)["status"].tolist() == ["done"] * 3
    again = (run / "sites" / "good" / "run.gpkg").stat()
    assert (slid.st_ino, slid.st_mtime_ns) == (again.st_ino, again.st_mtime_ns)  # it was not slid again
    kept = [*case.folder.glob("failing*/sites/good/energy_max.qml")]
    assert "<qgis>mine</qgis>" in {each.read_text(encoding="utf-8") for each in kept}
    assert not list(case.folder.glob(".failing*"))


def test_what_has_changed_is_slid_again(case, tmp_path, said):
    text = f"site,releases,friction\none,{case.releases},\ntwo,{case.releases},0.3\nbad,{case.releases},x\n"
    named = table(tmp_path, text)
    with pytest.raises(UserError):
        sites(case, "changed", sites=named)
    table(tmp_path, text.replace("0.3", "0.35").replace(",x", ",0.4"))
    sites(case, "changed", said, sites=named, resume=True)
    assert [each for each in said.notes if "slid again" in each] == [
        "two: its inputs or parameters, or the engine, have changed; it is slid again"
    ]
    made = json.loads((case.folder / "changed/sites/two/manifest.json").read_text(encoding="utf-8"))
    assert made["parameters"]["friction"] == 0.35


def test_another_result_is_not_replaced_by_going_on(case, tmp_path):
    run = case.run(output=str(case.folder / "other"))
    (case.folder / ".other.part").mkdir()
    with pytest.raises(UserError, match="the output exists; --overwrite replaces it"):
        sites(case, "other", by="release_id", releases=case.releases, resume=True)
    assert (run / "poses.parquet").is_file()


def test_a_fault_of_ours_in_one_site_does_not_cost_the_others(case, monkeypatch):
    from deadwood_algorithms.simulate import windows

    real = windows.read_released_scene

    def broken(simulation, feedback):
        if simulation.inputs.releases.endswith("a.gpkg"):
            raise ValueError("no such luck")
        return real(simulation, feedback)

    monkeypatch.setattr(windows, "read_released_scene", broken)
    with pytest.raises(UserError, match="1 of 2 sites failed"):
        sites(case, "fault", by="release_id", releases=case.releases)
    assert "ValueError: no such luck" in failure(case.folder / "fault", "a")


class StopsAt:
    """A feedback whose user presses Ctrl-C once so much has been done of a site."""

    def __init__(self, what: str, share: float) -> None:
        self.what, self.share, self.stop = what, share, False
        self.notes: list[str] = []

    def progress(self, done: float, total: float, what: str) -> None:
        self.stop = self.stop or (what == self.what and done >= self.share * total)

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.notes.append(message)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        pass

    def cancelled(self) -> bool:
        return self.stop


def test_an_interrupted_run_continues_in_the_middle_of_a_site(case, by, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    given = {"by": "release_id", "releases": case.releases, "trajectories": "all", **case.everything()}
    undisturbed = sites(case, "undisturbed", **given)
    feedback = StopsAt("b (2 of 2): sliding logs", 0.4)
    with pytest.raises(Cancelled):
        sites(case, "halted", feedback, **given)
    assert not (case.folder / "halted").exists()
    assert "1 finished site is kept" in feedback.notes[-1]
    work = case.folder / ".halted.part" / "sites"
    assert list(work.glob(".b.part/rasters_*.npz")), "the second site was not begun: the test says nothing"
    slid = (work / "a" / "run.gpkg").stat().st_mtime_ns
    halted = sites(case, "halted", resume=True, **given)
    assert (halted / "sites" / "a" / "run.gpkg").stat().st_mtime_ns == slid
    assert_same_sites(undisturbed, halted)
    assert not list(case.folder.glob(".halted*"))


def assert_same_sites(one: Path, other: Path) -> None:
    """The same files, and the same in them, what it cost and where it stands apart."""
    names = [{str(each.relative_to(run)) for each in run.rglob("*")} for run in (one, other)]
    assert names[0] == names[1]
    for site in sorted(each.name for each in (one / "sites").iterdir()):
        assert_same_run(one / "sites" / site, other / "sites" / site)
    for name in sorted(names[0]):
        if name.endswith((".tif", ".parquet", ".gpkg", ".qml")) and name != "overview.gpkg":
            assert (one / name).read_bytes() == (other / name).read_bytes(), name
    rows = [overview(run).drop(columns="wall_s") for run in (one, other)]
    pd.testing.assert_frame_equal(*rows, check_exact=True)


@pytest.fixture(scope="module")
def start(case) -> Callable[..., subprocess.CompletedProcess[str]]:
    """run-sites as a program that gets a signal; see ``killed_run.py``."""
    given = {"dem": case.dem, **SHARED, "by": "release_id", "releases": case.releases, "lines": case.lines}
    (case.folder / "sites.json").write_text(json.dumps(given | {"trajectories": "all"}))

    def run(folder: Path, number: int = 0, moment: int = 0, delay_s: float = 0.0, *more: str):
        return met_run("run-sites", case.folder / "sites.json", folder, number, moment, delay_s, *more)

    return run


@pytest.fixture(scope="module")
def whole(case, start) -> tuple[Path, int]:
    """The undisturbed run, and its number of moments."""
    folder = case.folder / "killed"
    folder.mkdir()
    ran = start(folder)
    assert ran.returncode == 0, ran.stderr
    return folder / "run", int(ran.stdout.split("moments: ")[1].split()[0])


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[Site]:
    made = Site(tmp_path_factory.mktemp("site"))
    made.worker()
    yield made
    made.stop()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
@pytest.mark.parametrize("kill", range(4))
def test_a_killed_run_is_resumed_to_the_same_bytes(start, whole, tmp_path, kill):
    check_killed(start, whole, tmp_path, kill, [], [])


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
@pytest.mark.parametrize("kill", range(2))
def test_a_killed_run_on_workers_is_resumed_with_or_without_them(start, whole, site, tmp_path, kill):
    on_workers = ["--scheduler", site.address]
    check_killed(start, whole, tmp_path, 10 + kill, on_workers, on_workers if kill else [])


def check_killed(
    start: Callable[..., subprocess.CompletedProcess[str]],
    whole: tuple[Path, int],
    tmp_path: Path,
    kill: int,
    before: list[str],
    after: list[str],
) -> None:
    """before, after : more arguments of the run that is killed, and of the one that resumes it"""
    undisturbed, moments = whole
    rng = random.Random(kill)
    name = ("SIGKILL", "SIGTERM")[kill % 2]
    moment = rng.randint(1, moments)
    ran = start(tmp_path, getattr(signal, name), moment, rng.choice([0.0, 0.02, 0.2]), *before)
    what = f"{name} at moment {moment} of {moments}: {ran.returncode}, {ran.stderr}"
    assert ran.returncode in ((-signal.SIGKILL, 0) if name == "SIGKILL" else (130, 0)), what
    assert "Traceback" not in ran.stderr, what
    # the result may be there, with the work that it was made from not yet removed
    if ran.returncode != 0 and [each.name for each in tmp_path.iterdir()] != ["run"]:
        resume(start, tmp_path, what, *after)
    assert_same_sites(undisturbed, tmp_path / "run")
    assert [each.name for each in tmp_path.iterdir()] == ["run"], what


def resume(start: Callable[..., subprocess.CompletedProcess[str]], folder: Path, what: str, *more: str) -> None:
    again = start(folder, 0, 0, 0.0, "--resume", *more)
    assert again.returncode == 0, what + again.stderr


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
def test_a_run_killed_while_its_work_is_removed_is_resumed_to_the_same_bytes(start, whole, tmp_path):
    undisturbed, moments = whole
    ran = start(tmp_path, signal.SIGKILL, moments - 1)
    assert ran.returncode == -signal.SIGKILL, ran.stderr
    assert {each.name for each in tmp_path.iterdir()} == {"run", ".run.part"}
    assert_same_sites(undisturbed, tmp_path / "run")
    resume(start, tmp_path, ran.stderr)
    assert_same_sites(undisturbed, tmp_path / "run")
    assert [each.name for each in tmp_path.iterdir()] == ["run"]


# --- refusals -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,dem\na,x.tif\n", "the sites table has no column 'site'"),
        ("site,frction\na,0.3\n", "no parameter of slide-logs is called 'frction'; did you mean 'friction'"),
        ("site,output\na,x\n", "the column 'output' is set by run-sites itself; remove it"),
        ("site,friction\na,0.3\nA,0.4\n", "field 'site': 'A' occurs in rows 1 and 2"),
        ("site,friction\na/b,0.3\n", "field 'site', row 1: 'a/b' is not a name of a folder"),
        ("site,friction\n,0.3\n", "field 'site', row 1: the site has no name"),
        ("site,time-limit,time_limit_s\na,3,4\n", "the columns 'time-limit' and 'time_limit_s' mean the same"),
    ],
)
def test_a_table_that_is_wrong_is_refused_before_any_site(case, tmp_path, text, words):
    with pytest.raises(UserError) as refused:
        sites(case, "refused", sites=table(tmp_path, text))
    assert words in str(refused.value)
    assert not [*case.folder.glob("refused*"), *case.folder.glob(".refused*")]


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        ("fidelity\na,best", "row 1: --fidelity is 'best', but must be one of draft"),
        ("seed\na,1.5", "row 1: --seed is '1.5', but must be a whole number"),
        ("report\na,perhaps", "row 1: --report is 'perhaps', but must be true or false"),
        ("restitution\na,1.5", "row 1: --restitution is 1.5, but must be at most 1"),
    ],
)
def test_a_cell_that_is_wrong_is_the_failure_of_its_site(case, tmp_path, cells, words):
    with pytest.raises(UserError, match="1 of 1 sites failed"):
        sites(case, tmp_path.name, sites=table(tmp_path, f"site,{cells}\n"), releases=case.releases)
    assert words in failure(case.folder / tmp_path.name, "a")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "none is given"),
        ({"by": "release_id", "sites": "x.csv"}, "--sites and --by are given"),
        ({"by": "release_id"}, "--by release_id needs --releases"),
        ({"by": "release_id", "releases": "x.gpkg", "dem": None}, "--by release_id needs --dem"),
        ({"configs": "nowhere"}, "--configs nowhere: this is not a folder"),
    ],
)
def test_what_is_unclear_is_refused(case, values, words):
    with pytest.raises(UserError) as refused:
        sites(case, "unclear", **values)
    assert words in str(refused.value)


def test_a_field_that_is_not_there_is_refused(case):
    with pytest.raises(
        UserError, match=r"--by valley: there is no such field; the layer has the fields log_id, release_id"
    ):
        sites(case, "unclear", by="valley", releases=case.releases)
    assert not list(case.folder.glob(".unclear*"))  # no unfinished work that the next run would ask about


def test_an_empty_folder_of_configurations_is_refused(case, tmp_path):
    with pytest.raises(UserError, match="holds no JSON file"):
        sites(case, "unclear", configs=str(tmp_path))
