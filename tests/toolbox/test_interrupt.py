"""Ctrl-C and SIGTERM: status 130 within two seconds, and nothing under a final name."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import toy_tool

from deadwood_toolbox import cli

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGTERM"), reason="signals of POSIX")


def wait_for(condition, seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "the program did not begin"
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(("how", "within_s"), [("--asks", 0.5), ("--no-asks", 1.5), ("--drops", 1.5), ("--stuck", 2.0)])
def test_a_signal_ends_a_run_in_two_seconds(start_toy, tmp_path, number, how, within_s):
    out = tmp_path / "result"
    program = start_toy("toy-walk", "--dem", "x", "--output", out, "--quiet", "--wait-s", "30", how)
    wait_for((tmp_path / "result.part" / "proj.txt").exists)
    time.sleep(0.1)
    sent = time.monotonic()
    program.send_signal(number)
    _, said = program.communicate(timeout=20)
    assert time.monotonic() - sent < within_s
    assert program.returncode == 130
    assert said == "deadwood-tool: interrupted; nothing was left under a final name\n"
    assert not out.exists()
    if how != "--stuck":  # native code that ignores signals cannot clean up; what it leaves has no final name
        assert list(tmp_path.iterdir()) == []


STUCK = """
import hashlib, sys, threading
from deadwood_algorithms.files.outputs import output_folder
from deadwood_toolbox.interrupt import interruptible
with interruptible(threading.Event()), output_folder(sys.argv[1]) as folder:
    (folder / "half").write_bytes(bytes(2**20))
    print("ready", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"deadwood", b"toolbox", 150_000_000)
"""


def test_native_code_that_hears_nothing_leaves_no_temporary_files(checkout, tmp_path):
    """The watchdog removes them instead; a lock may stay, because it is freed when its owner ends."""
    program = subprocess.Popen(
        [sys.executable, "-c", STUCK, str(tmp_path / "result")], env=checkout, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    assert program.stdout is not None
    assert program.stdout.readline() == "ready\n"
    assert [each.name[:16] for each in tmp_path.iterdir() if each.is_dir()] == [".result.partial-"]
    program.send_signal(signal.SIGINT)
    _, said = program.communicate(timeout=20)
    assert (program.returncode, said) == (130, "deadwood-tool: interrupted; nothing was left under a final name\n")
    assert [each.name for each in tmp_path.iterdir() if not each.name.endswith(".lock")] == []


def test_a_second_signal_does_not_disturb_the_tidying_up(start_toy, tmp_path):
    program = start_toy("toy-walk", "--dem", "x", "--output", tmp_path / "result", "--quiet", "--wait-s", "30")
    wait_for((tmp_path / "result.part" / "proj.txt").exists)
    for _ in range(3):
        program.send_signal(signal.SIGINT)
    assert program.wait(20) == 130
    assert not (tmp_path / "result").exists()


def test_the_end_of_standard_input_ends_a_run_whose_starter_asks_for_that(checkout, tmp_path):
    words = [sys.executable, str(Path(__file__).parent / "toy_tool.py"), "toy-walk", "--dem", "x", "--asks"]
    words += ["--output", str(tmp_path / "result"), "--quiet", "--wait-s", "30"]
    for asked, status in (("1", 130), ("0", None)):
        program = subprocess.Popen(
            words, env={**checkout, "DEADWOOD_STOP_WITH_STDIN": asked}, stdin=subprocess.PIPE, stderr=subprocess.PIPE
        )
        wait_for((tmp_path / "result.part" / "proj.txt").exists)
        assert program.poll() is None  # an input that stays open does not end the program
        assert program.stdin is not None
        program.stdin.close()
        if status is None:
            time.sleep(1.0)
            assert program.poll() is None
            program.kill()
        assert program.wait(20) == (status or -signal.SIGKILL)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_python_ends_changes_nothing(start_toy, tmp_path, number):
    program = start_toy("toy-walk", "--dem", "x", "--output", tmp_path / "result", TOY_END_S="1.5")
    assert "output:" in program.stderr.readline() + program.stderr.readline()
    time.sleep(0.5)
    program.send_signal(number)
    _, said = program.communicate(timeout=20)
    assert (program.returncode, said) == (0, "")
    assert (tmp_path / "result" / "manifest.json").is_file()


def test_an_interrupt_when_the_results_stand_reports_it(toy, tmp_path, monkeypatch):
    """Not "nothing was left under a final name", which would be untrue of results that have just been renamed."""

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_report", interrupted)
    ran = toy("toy-walk", "--dem", "x", "--output", tmp_path / "result", "--quiet")
    assert (ran.status, ran.line) == (130, "deadwood-tool: interrupted after the work was done; the results are whole")
    monkeypatch.setattr(toy_tool, "_fail", interrupted)
    ran = toy("toy-walk", "--dem", "x", "--output", tmp_path / "other", "--quiet")
    assert (ran.status, ran.line) == (130, "deadwood-tool: interrupted; nothing was left under a final name")


def test_handlers_are_given_back(toy, tmp_path):
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert toy("toy-walk", "--dem", "x", "--output", tmp_path / "result").status == 0
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
