"""The working folder of an unfinished run: damaged data are not used, nor those of another run or engine."""

from __future__ import annotations

import json
import os
import random
import shutil
from pathlib import Path

import pytest
from slope_case import Case, StopAfter, assert_same_run

from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.simulate.checkpoints import Damaged, WorkFolder

FUZZED = 12  # damaged folders that are resumed


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture
def small_chunks(monkeypatch) -> None:
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)


@pytest.fixture
def full(case, small_chunks) -> Path:
    """The run in one go."""
    output = case.folder / "full"
    return output if output.exists() else case.run(output=str(output), **case.everything())


@pytest.fixture
def begun(case, small_chunks, tmp_path) -> Path:
    """The working folder ``.run.part`` of a run of 24 logs that was interrupted after more than 16."""
    kept = case.folder / ".begun.part"
    if not kept.exists():
        with pytest.raises(Cancelled):
            case.run(StopAfter(18), output=str(case.folder / "begun"), **case.everything())
    shutil.copytree(kept, tmp_path / ".run.part")
    return tmp_path / ".run.part"


def resumed(case: Case, begun: Path, feedback) -> Path:
    return case.run(feedback, output=str(begun.parent / "run"), resume=True, **case.everything())


def flip(path: Path, rng: random.Random) -> None:
    raw = bytearray(path.read_bytes())
    raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
    path.write_bytes(raw)


def damage(folder: Path, rng: random.Random) -> str:
    """One accident of a disk, a copying program or a user; returns its description."""
    files = sorted(each for each in folder.iterdir() if each.is_file() and each.stat().st_size)
    one, other = rng.sample(files, 2)
    kind = rng.choice(["flip", "cut", "empty", "remove", "copy", "swap", "grow", "folder"])
    if kind == "flip":
        flip(one, rng)
    elif kind == "cut":
        os.truncate(one, rng.randrange(one.stat().st_size))
    elif kind == "empty":
        one.write_bytes(b"")
    elif kind == "remove":
        one.unlink()
    elif kind == "copy":
        shutil.copyfile(other, one)
    elif kind == "swap":
        mine, theirs = one.read_bytes(), other.read_bytes()
        one.write_bytes(theirs)
        other.write_bytes(mine)
    elif kind == "grow":
        one.write_bytes(one.read_bytes() + rng.randbytes(100))
    else:
        one.unlink()
        one.mkdir()
    return f"{kind} {one.name} {other.name}"


@pytest.mark.parametrize("seed", range(FUZZED))
def test_a_damaged_folder_is_resumed_to_the_same_result(case, full, begun, said, seed):
    rng = random.Random(seed)
    done = [damage(begun, rng) for _ in range(rng.randint(1, 3))]
    output = resumed(case, begun, said)
    assert_same_run(full, output)
    assert (output / "poses.parquet").read_bytes() == (full / "poses.parquet").read_bytes(), done
    spare_gone = all(each.startswith("remove rasters_") for each in done)  # the older of two states: nothing is lost
    assert spare_gone or any("damaged" in each for each in said.warnings), done
    assert [each.name for each in begun.parent.iterdir()] == ["run"]


@pytest.mark.parametrize("name", ["poses_1.parquet", "logs_2.npz", "rasters_4.npz", "identity.json"])
def test_one_flipped_bit_is_found_said_and_redone(case, full, begun, said, name):
    flip(begun / name, random.Random(7))
    assert_same_run(full, resumed(case, begun, said))
    assert any("damaged" in each for each in said.warnings)


def test_a_chunk_copied_over_another_is_found(case, full, begun, said):
    for kind in ("logs_{}.npz", "poses_{}.parquet"):
        shutil.copyfile(begun / kind.format(0), begun / kind.format(3))
    assert_same_run(full, resumed(case, begun, said))
    assert any("1 finished chunks of logs are damaged and are slid again" in each for each in said.warnings)


def test_a_chunk_of_another_run_is_found(case, full, begun, said, tmp_path):
    with pytest.raises(Cancelled):
        case.run(StopAfter(18), output=str(tmp_path / "other"), **(case.everything() | {"friction": "0.4"}))
    shutil.copyfile(tmp_path / ".other.part" / "logs_1.npz", begun / "logs_1.npz")
    shutil.rmtree(tmp_path / ".other.part")
    assert_same_run(full, resumed(case, begun, said))
    assert any("damaged" in each for each in said.warnings)


def test_without_damage_nothing_is_warned_of(case, full, begun, said):
    assert_same_run(full, resumed(case, begun, said))
    assert not [each for each in said.warnings if "damaged" in each]
    assert any("finished chunks of logs are reused" in each for each in said.notes)


def test_damage_while_a_run_works_is_reported_with_its_fix(tmp_path, said):
    work = WorkFolder(str(tmp_path / "run"), {"version": "x"}, resume=False, feedback=said)
    work._write("logs_0.npz", b"content")
    flip(work.path / "logs_0.npz", random.Random(1))
    with pytest.raises(Damaged, match=r"logs_0.npz: damaged .* --resume"):
        work.chunk(0)


def test_a_run_is_resumed_only_by_the_engine_that_began_it(case, full, begun, monkeypatch):
    monkeypatch.setattr(chunks, "engine_digest", lambda: "0123456789abcdef")
    with pytest.raises(UserError, match="begun by another engine") as error:
        resumed(case, begun, Quiet())
    assert "0123456789abcdef" in str(error.value)
    assert "\n" not in str(error.value)
    assert begun.is_dir()  # the other engine can still continue it


def test_the_work_of_the_first_version_is_refused_not_dropped(case, begun):
    """It had no seals; its version was in its identity."""
    old = {"version": "0.1.0", "releases": "x"}
    (begun / "identity.json").write_text(json.dumps(old))
    with pytest.raises(UserError, match="begun by another engine"):
        resumed(case, begun, Quiet())
    assert (begun / "logs_0.npz").is_file()


@pytest.mark.parametrize("what", ["a link", "a broken link", "a file"])
def test_what_is_not_ours_in_the_place_of_the_working_folder_is_left_alone(tmp_path, said, what):
    """Before: an internal error (rmtree of a link, or a name that exists)."""
    place, elsewhere = tmp_path / ".run.part", tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "mine.txt").write_text("mine")
    if what == "a file":
        place.write_text("mine")
    else:
        place.symlink_to(elsewhere if what == "a link" else tmp_path / "nowhere")
    with pytest.raises(UserError, match=r"\.run\.part: this is .*where the unfinished work of a run is kept"):
        WorkFolder(str(tmp_path / "run"), {"version": "x"}, resume=False, feedback=said)
    assert (elsewhere / "mine.txt").read_text() == "mine"
    assert place.is_symlink() or place.read_text() == "mine"
