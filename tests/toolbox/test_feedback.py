"""Progress as seen by a reader and by a program; the test sets the clock."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os

import numpy as np
import pytest

from deadwood_toolbox import feedback
from deadwood_toolbox.feedback import Speaker, clock, plain


@pytest.fixture
def at(monkeypatch: pytest.MonkeyPatch):
    """Set the time [s]."""

    def set_time(seconds: float) -> None:
        monkeypatch.setattr(feedback.time, "monotonic", lambda: seconds)

    set_time(1000.0)
    return set_time


def test_plain_lines_are_sparse_and_say_rate_and_time_left(at):
    stream = io.StringIO()
    speaker = Speaker("plain", stream=stream)
    for second in range(41):
        at(1000.0 + second)
        speaker.progress(50 * second, 2000, "sliding logs")
    assert stream.getvalue().splitlines() == [
        "sliding logs: 100 of 2,000 (5 %), 50/s, 38 s left",  # early, so that a short run is not silent
        "sliding logs: 600 of 2,000 (30 %), 50/s, 28 s left",
        "sliding logs: 1,100 of 2,000 (55 %), 50/s, 18 s left",
        "sliding logs: 1,600 of 2,000 (80 %), 50/s, 8 s left",
        "sliding logs: 2,000 of 2,000 (100 %), 50/s, 0 s left",
    ]


def test_of_a_quick_stage_no_plain_line_is_reported_and_each_stage_has_its_own_rate(at):
    stream = io.StringIO()
    speaker = Speaker("plain", stream=stream)
    for done in range(5):
        at(1000.0 + 0.4 * done)
        speaker.progress(done, 4, "reading")
    for second in range(11):
        at(2000.0 + second)
        speaker.progress(100 + second, 120, "resumed")
    assert stream.getvalue() == "resumed: 102 of 120 (85 %), 1/s, 18 s left\n"


def test_json_is_never_more_than_a_few_lines_a_second(at):
    stream = io.StringIO()
    speaker = Speaker("json", quiet=True, stream=stream)
    for step in range(1001):
        at(1000.0 + step / 1000)
        speaker.progress(step, 1000, "sliding logs")
    speaker.note("unsaid")
    events = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert [each["done"] for each in events] == [0, 250, 500, 750, 1000]
    assert (events[1]["rate_per_s"], events[1]["left_s"]) == (1000.0, 0.75)
    assert (events[0]["rate_per_s"], events[0]["left_s"]) == (None, None)


def test_a_bar_shows_what_is_done_the_rate_and_the_time_left():
    stream = io.StringIO()
    speaker = Speaker("bar", stream=stream)
    speaker.progress(0, 8, "sliding logs")
    speaker.progress(8, 8, "sliding logs")
    speaker.close()
    last = stream.getvalue().split("\r")[-1]
    assert last.startswith("sliding logs: 100 %|")
    assert "8 of 8, " in last
    assert "/s, 00:00 left" in last


def test_a_bar_says_nothing_of_a_pace_that_is_not_known():
    """Of a stage that ended before it was first shown: the line ended in "?/s, ? left"."""
    stream = io.StringIO()
    speaker = Speaker("bar", stream=stream)
    speaker.progress(1000, 1000, "reading the DEM")
    speaker.close()
    assert stream.getvalue().rstrip().endswith("| 1,000 of 1,000")
    assert "?" not in stream.getvalue()


def test_a_terminal_gets_a_bar_and_a_file_gets_lines():
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    assert Speaker(stream=Terminal()).mode == "bar"
    assert Speaker(stream=io.StringIO()).mode == "plain"
    assert Speaker(quiet=True, stream=Terminal()).mode == "none"


def test_only_a_terminal_that_wants_them_gets_colours(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for stream, variable, said in (
        (Terminal(), None, "\x1b[33mwarning:\x1b[0m steep\n"),
        (Terminal(), "NO_COLOR", "warning: steep\n"),
        (io.StringIO(), None, "warning: steep\n"),
    ):
        monkeypatch.delenv("NO_COLOR", raising=False)
        monkeypatch.setenv("TERM", "xterm")
        if variable:
            monkeypatch.setenv(variable, "1")
        Speaker(stream=stream).warn("steep")
        assert stream.getvalue() == said


def test_the_work_continues_without_a_reader_of_the_progress():
    """As with ``2>&1 | head``: a run does not end because nobody reads its messages."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as closed:
        speaker = Speaker("json", stream=closed)
        speaker.progress(1, 2, "sliding logs")
        speaker.warn("steep")
        with contextlib.suppress(BrokenPipeError):  # from what the closed file still has in its buffer
            closed.close()


def test_warnings_are_reported_even_when_quiet():
    stream = io.StringIO()
    Speaker(quiet=True, stream=stream).warn("a DBH of 0.6 cm")
    assert stream.getvalue() == "warning: a DBH of 0.6 cm\n"


@pytest.mark.parametrize(
    ("seconds", "read"), [(0.4, "0 s"), (59.4, "59 s"), (60, "1 min 00 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")]
)
def test_times_as_one_reads_them(seconds, read):
    assert clock(seconds) == read


def test_facts_become_json_that_every_reader_knows():
    facts = {"n": np.int64(3), "p": np.float64(0.5), "none": math.nan, "inf": np.inf, "row": np.arange(2), 1: (True,)}
    told = json.loads(json.dumps(plain(facts), allow_nan=False))
    assert told == {"n": 3, "p": 0.5, "none": None, "inf": None, "row": [0, 1], "1": [True]}
