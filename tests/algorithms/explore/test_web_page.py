"""The page of `explore` as served: complete, with all its texts, and nothing from elsewhere."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib import resources

import numpy as np

from deadwood_algorithms.explore import web_page
from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.files.pictures import colours_of
from deadwood_algorithms.schemas.looks import ENDS, LOOKS, ROAD
from deadwood_engine import FIDELITIES, STOP_REASONS

PAGE = resources.files("deadwood_algorithms.explore") / "page"
SOURCES = {each.name: each.read_text(encoding="utf-8") for each in PAGE.iterdir() if each.is_file()}


def test_every_file_of_the_page_is_handed_out_with_its_type():
    served = web_page.files()
    assert set(served) == set(SOURCES) | {"view3d.js"}
    for name, (kind, content) in served.items():
        assert (
            kind
            == {"html": "text/html", "css": "text/css", "js": "text/javascript"}[name.rsplit(".", 1)[1]]
            + "; charset=utf-8"
        )
        assert content.decode("utf-8")


def test_every_script_that_is_imported_is_there():
    for source in SOURCES.values():
        for name in re.findall(r'from "\./([\w.]+)"', source) + re.findall(r'(?:src|href)="page/([\w.]+)"', source):
            assert name in web_page.files()


def test_the_page_receives_words_and_the_reports_colours():
    text = web_page.files()["index.html"][1].decode("utf-8")
    found = re.search(r'id="config">(.*?)</script>', text, re.S)
    assert found
    told = json.loads(found[1])
    assert told["words"] == PHRASES
    assert [each["reason"] for each in told["stops"]] == list(STOP_REASONS)
    assert [each["colour"] for each in told["stops"]] == [ENDS[each][1] for each in STOP_REASONS]
    assert told["colours"]["line"] == ROAD


def test_words_cannot_end_the_block_that_holds_them(monkeypatch):
    monkeypatch.setitem(PHRASES, "title", "</script><b>")
    web_page.files.cache_clear()
    try:
        assert b"</script><b>" not in web_page.files()["index.html"][1]
    finally:
        web_page.files.cache_clear()


def test_hits_have_the_colours_of_the_reports_map():
    """Each share has the colour that Matplotlib gives it there; the scale is complete."""
    ramp = web_page.facts()["ramp"]
    shades, scale = colours_of(LOOKS["shares"])
    for each in ramp:
        # half a step of 256, and half a step of Matplotlib's 512 colours of six stretches of up to 110
        assert np.abs(255.0 * np.array(shades(scale(each["share"]))[:3]) - rgb(each["colour"])).max() <= 1.5
    shares = [each["share"] for each in ramp]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (LOOKS["shares"].stops[0], 1.0)
    assert set(LOOKS["shares"].stops) <= set(shares)


def rgb(colour: str) -> list[int]:
    return [int(colour[c : c + 2], 16) for c in (1, 3, 5)]


def test_neither_the_engine_nor_matplotlib_is_loaded_for_it():
    script = "import sys; from deadwood_algorithms.explore import web_page; web_page.files(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numba", "matplotlib", "geopandas", "deadwood_engine"} & set(loaded)


def test_nothing_is_requested_from_another_host():
    for name, source in SOURCES.items():
        found = re.findall(r"""(?:https?:)?//[\w.-]+\.[a-z]{2,}""", source)
        assert set(found) <= {"http://www.w3.org"}, name


def said_names() -> tuple[set[str], set[str]]:
    """The names of phrases that the page uses, and the beginnings of those that it composes."""
    text = "".join(SOURCES.values())
    names = set(re.findall(r'data-(?:say|label)="([\w-]+)"', text))
    names |= {word for call in re.findall(r"(?:say|speakText\(say)\(([^`;]*?)[,)]", text) for word in quoted(call)}
    return names, set(re.findall(r"say\(`(\w+_)\$\{", text))


def quoted(text: str) -> list[str]:
    return re.findall(r'"([a-z0-9_-]+)"', text)


def test_every_word_that_the_page_says_is_there():
    names, beginnings = said_names()
    compared = {"lost", "more", "less", "open", "elsewhere"}  # by which names are chosen
    assert {each for each in names if each not in PHRASES} <= compared
    for each in beginnings:
        assert any(name.startswith(each) for name in PHRASES), each
    assert {f"fidelity_{each}" for each in FIDELITIES} <= set(PHRASES)
    tools = set(re.findall(r'\{ name: "(\w+)", key', SOURCES["tools.js"]))
    assert {f"{kind}_{each}" for each in tools for kind in ("tool", "hint")} <= set(PHRASES)


def test_no_word_is_left_over():
    text = "".join(SOURCES.values())
    beginnings = said_names()[1]
    spoken = set(quoted(text)) | set(re.findall(r'data-(?:say|label)="([\w-]+)"', text))

    def said(name: str) -> bool:
        alone = name.removesuffix("_one")
        return alone in spoken or any(alone.startswith(each) for each in beginnings)

    assert [name for name in PHRASES if not said(name)] == []


def test_gaps_of_one_are_those_of_many():
    for name, text in PHRASES.items():
        if name.endswith("_one"):
            gaps = set(re.findall(r"\{(\w+)\}", text))
            assert gaps | {"n"} == set(re.findall(r"\{(\w+)\}", PHRASES[name.removesuffix("_one")]))
