"""Trunks that slid and reached something: what newspapers and broadcasters reported.

What a reader may take from them: whether logs go this far, and what did or did not hold them. They give no probability,
because nobody reports a log that stays where it is. Standard library only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Range = tuple[float, float]


@dataclass(frozen=True)
class Event:
    """One slide; ranges where the reports differ, None where they say nothing."""

    place: str
    country: str
    date: str
    log: str
    length_m: Range | None
    ground: str  # empty: not reported
    travel_m: Range | None
    cause: str
    outcome: str
    source: str
    uncertain: str = ""


WORK, NATURAL = "forest work", "natural"
EVENTS = (
    Event(
        "Thernberg",
        "AT",
        "2021-02",
        "trunk",
        (15.0, 15.0),
        "ice and snow",
        (400.0, 400.0),
        WORK,
        "broke a garden fence and a window",
        "noe.orf.at/stories/3090595",
    ),
    Event(
        "Feudingen",
        "DE",
        "winter 2020",
        "spruce, freshly debarked",
        (25.0, 30.0),
        "frost",
        (400.0, 500.0),
        WORK,
        "stopped by a basement wall",
        "siegener-zeitung.de a190249; WP 228040893",
        "the reports differ on how far it went",
    ),
    Event(
        "Reisseck",
        "AT",
        "",
        "spruce",
        (20.0, 20.0),
        "",
        (200.0, 200.0),
        WORK,
        "through an outer wall into a living room",
        "puls24.at 210964",
    ),
    Event(
        "Wörgl",
        "AT",
        "2014-01",
        "delimbed trunk of 1.5 t",
        (20.0, 30.0),
        "steep, icy",
        (150.0, 150.0),
        WORK,
        "took off from a ramp, through a door, stopped by an inner wall",
        "tirol.orf.at 2623436; heute.at; oe24.at",
        "20 or 30 m long; one report has 150 m of height",
    ),
    Event(
        "Zederhaus, motorway A10",
        "AT",
        "2011-01-31",
        "spruce",
        (20.0, 20.0),
        "snow",
        None,
        WORK,
        "two wire-rope fences and a game fence did not hold it; stopped on the road",
        "krone.at/243526",
    ),
    Event(
        "Finkenberg",
        "AT",
        "2018-06-07",
        "larch, whose branches broke off before it slid, top first",
        (10.0, 15.0),
        "",
        None,
        WORK,
        "through a timber fence, hit a car",
        "zillertalfoto.at; vol.at",
        "the distance: it came from about 120 m above the road",
    ),
    Event(
        "Schröcken",
        "AT",
        "",
        "spruce",
        (10.0, 10.0),
        "",
        None,
        WORK,
        "hit a car's bonnet and pierced a stone wall",
        "vol.at 2564933",
        "the distance: it came from 30 m above",
    ),
    Event(
        "Schönwies",
        "AT",
        "2017-10-28",
        "conifer",
        (12.0, 12.0),
        "",
        None,
        WORK,
        "reached a railway track",
        "meinbezirk.at 2299793",
    ),
    Event(
        "Bad Schandau",
        "DE",
        "2024-11",
        "oak of 90 cm and about 12 t",
        (30.0, 30.0),
        "steep",
        (50.0, 50.0),
        WORK,
        "through a roof and several walls",
        "freiepresse.de; tagesschau.de",
    ),
    Event(
        "Lauffen",
        "AT",
        "Whitsun",
        "beech with a stump of 50 cm",
        None,
        "rain",
        (80.0, 80.0),
        NATURAL,
        "fell another 30 m, broke a rockfall barrier, hit a car",
        "salzburg24.at 254195",
        "the year",
    ),
)


def range_words(span: Range | None) -> str:
    """``20 to 30``, ``15``, or nothing."""
    if span is None:
        return ""
    return f"{span[0]:g}" if span[0] == span[1] else f"{span[0]:g} to {span[1]:g}"


def event_lines(events: Sequence[Event] = EVENTS) -> list[str]:
    """Four lines an event, for a terminal."""
    lines = []
    for each in events:
        sizes = [each.log, f"{range_words(each.length_m)} m long" if each.length_m else ""]
        went = f"went {range_words(each.travel_m)} m" if each.travel_m else "distance not reported"
        unsure = f"; uncertain: {each.uncertain}" if each.uncertain else ""
        lines += [
            ", ".join(part for part in (f"{each.place} ({each.country})", each.date, each.cause) if part),
            "  " + ", ".join(part for part in (*sizes, each.ground) if part),
            f"  {went}; {each.outcome}",
            f"  source: {each.source}{unsure}",
        ]
    return lines
