"""Reported slides of trunks: the same records at the terminal, as JSON and in Python, each with a source."""

from __future__ import annotations

import json

import deadwood_toolbox as dw
from deadwood_algorithms.params.events import EVENTS, NATURAL, Event, event_lines, range_words
from deadwood_toolbox import cli


def test_each_has_a_source_and_ranges_in_order():
    assert len(EVENTS) == 10
    assert len({(each.place, each.country) for each in EVENTS}) == 10
    for each in EVENTS:
        assert each.source
        assert each.outcome
        for span in (each.length_m, each.travel_m):
            assert span is None or 0.0 < span[0] <= span[1]
    assert [each.place for each in EVENTS if each.cause == NATURAL] == ["Lauffen"]


def test_the_three_faces_have_the_same_events(capsys):
    assert cli.run(["list", "--events"]) == 0
    text = capsys.readouterr().out
    assert cli.run(["list", "--events", "--json"]) == 0
    as_json = json.loads(capsys.readouterr().out)["events"]
    table = dw.events()
    assert [each["place"] for each in as_json] == table["place"].tolist() == [each.place for each in EVENTS]
    assert all(f"{each.place} ({each.country})" in text for each in EVENTS)
    far = table.loc[table["travel_m_high"] >= 400.0, "place"]
    assert far.tolist() == ["Thernberg", "Feudingen"]
    assert table["travel_m_low"].isna().sum() == sum(each.travel_m is None for each in EVENTS) == 4


def test_the_lines_of_one_event():
    one = Event(
        "Ort", "CH", "", "fir", (10.0, 12.5), "frost", None, NATURAL, "stopped by a wall", "a paper", "the year"
    )
    assert event_lines([one]) == [
        "Ort (CH), natural",
        "  fir, 10 to 12.5 m long, frost",
        "  distance not reported; stopped by a wall",
        "  source: a paper; uncertain: the year",
    ]
    assert range_words((15.0, 15.0)) == "15"


def test_one_list_at_a_time(capsys):
    assert cli.run(["list", "--events", "--presets"]) == 2
    assert "--presets and --events are two lists" in capsys.readouterr().err
