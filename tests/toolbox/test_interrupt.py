"""Ctrl-C and SIGTERM: status 130 within two seconds, and nothing under a final name."""

from __future__ import annotations

import signal
import time

import pytest

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGTERM"), reason="signals of POSIX")


def wait_for(condition, seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "the program did not begin"
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("stuck", [False, True], ids=["in Python", "in native code"])
def test_a_signal_ends_a_run_in_two_seconds(start_toy, tmp_path, number, stuck):
    out = tmp_path / "result"
    wait = ["--stuck"] if stuck else ["--wait-s", "30"]
    program = start_toy("toy-walk", "--dem", "x", "--output", out, "--quiet", *wait)
    wait_for((tmp_path / "result.part" / "proj.txt").exists)
    time.sleep(0.1)
    sent = time.monotonic()
    program.send_signal(number)
    status = program.wait(20)
    assert time.monotonic() - sent < 2.0
    assert status == 130
    assert program.stderr.read() == "deadwood-tool: interrupted; nothing was left under a final name\n"
    assert not out.exists()
    if not stuck:  # native code that hears nothing cannot tidy up; what it leaves has no final name
        assert list(tmp_path.iterdir()) == []


def test_a_second_signal_does_not_disturb_the_tidying_up(start_toy, tmp_path):
    program = start_toy("toy-walk", "--dem", "x", "--output", tmp_path / "result", "--quiet", "--wait-s", "30")
    wait_for((tmp_path / "result.part" / "proj.txt").exists)
    for _ in range(3):
        program.send_signal(signal.SIGINT)
    assert program.wait(20) == 130
    assert not (tmp_path / "result").exists()


def test_handlers_are_given_back(toy, tmp_path):
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert toy("toy-walk", "--dem", "x", "--output", tmp_path / "result").status == 0
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
