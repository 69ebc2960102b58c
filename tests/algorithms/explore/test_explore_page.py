"""The page of `explore` as a person uses it: the real tool and its engine, in a real Chromium."""

from __future__ import annotations

import io
import itertools
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from browser import Browser
from explore_case import write_case
from PIL import Image
from slope_case import layer

from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.files.pictures import colours_of
from deadwood_algorithms.schemas.looks import LOOKS

PATIENCE_S = 600.0  # the kernels are compiled where no test has done so yet
FOREST = 220  # trees of the case
TOP = (90.0, 190.0)  # where logs are released [m]
SECOND = "new Promise((done) => setTimeout(done, 1000))"


class Tool:
    """The command as it was started, and the address that it printed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        flags = [f"--{name.replace('_', '-')}={value}" for name, value in write_case(folder).items()]
        flags += ["--dbh-cm=45", "--length-m=10", "--threads=2", "--no-browser", "--time-limit-s=60", "--output=kept"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "deadwood_toolbox", "explore", *flags],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(each for each in sys.path if each)},
            stdout=subprocess.PIPE,
            stderr=(folder / "said.txt").open("w"),
            text=True,
        )
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        assert self.address, (folder / "said.txt").read_text()

    @property
    def engine(self) -> psutil.Process:
        return psutil.Process(self.process.pid).children()[0]

    def end(self) -> None:
        self.process.terminate()
        self.process.wait(30)


class Page:
    """The page in a browser, by places of its map [m]."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.browser, self.address = browser, address
        self.ask, self.wait, self.key = browser.ask, browser.wait, browser.key

    def open(self) -> None:
        self.browser.open(self.address)
        self.wait("window.deadwoodExplore && deadwoodExplore.state.scene !== null")
        self.ask("document.getElementById('map').focus()")

    def seen(self, x: float, y: float) -> tuple[float, float]:
        script = f"deadwoodExplore.map.seen({x}, {y}).map((v, k) => v + (k ? b.y : b.x))"
        return tuple(
            self.ask(
                f"(() => {{ const b = document.getElementById('map').getBoundingClientRect(); return {script}; }})()"
            )
        )

    def click(self, x: float, y: float, count: int = 1) -> None:
        self.browser.click(*self.seen(x, y), count=count)

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8, wait_s: float = 0.03) -> None:
        self.browser.drag(self.seen(*start), self.seen(*end), steps, wait_s)

    def settled(self) -> None:
        """Every request is answered, and the page shows for how many logs."""
        self.wait("!document.body.classList.contains('busy') && deadwoodExplore.state.base?.final === true")

    def release(self, x: float = TOP[0], y: float = TOP[1]) -> None:
        self.key("r")
        before = self.state("asked")
        self.click(x, y)
        self.wait(f"deadwoodExplore.state.asked > {before} && !document.body.classList.contains('busy')")
        told = {name: self.state(name) for name in ("asked", "full", "preview", "editing", "mode", "shape")}
        assert self.state("base.id") == told["full"], (self.words("#alert"), told, before)
        self.settled()

    def state(self, path: str) -> Any:
        return self.ask(f"JSON.parse(JSON.stringify(deadwoodExplore.state.{path} ?? null))")

    def words(self, selector: str) -> str:
        return self.ask(f"document.querySelector({json.dumps(selector)}).innerText")

    def enter(self, field: str, value: str) -> None:
        self.ask(
            f"(() => {{ const field = document.getElementById('{field}'); field.value = '{value}';"
            " field.dispatchEvent(new Event('change')); })()"
        )

    def picture(self) -> np.ndarray:
        self.ask(
            "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 150))))"
        )
        return np.asarray(Image.open(io.BytesIO(self.browser.picture())).convert("RGB"), float)


@pytest.fixture(scope="module")
def tool(tmp_path_factory) -> Iterator[Tool]:
    started = Tool(tmp_path_factory.mktemp("explored"))
    yield started
    started.end()


@pytest.fixture(scope="module")
def shared() -> Iterator[Browser]:
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture
def page(shared, tool) -> Page:
    shared.requests.clear()
    shared.complaints.clear()
    shared.dark(False)
    shared.size(1280, 900)
    found = Page(shared, tool.address)
    found.open()
    found.ask("sessionStorage.clear()")
    found.open()
    return found


def complaints(browser: Browser) -> list[str]:
    return [each for each in browser.complaints if "GL Driver Message" not in each]  # of taking the picture


def test_a_cell_has_the_colour_of_its_share_in_every_map(page):
    """The drawing, pixel by pixel, compared with that of the same shares by Matplotlib; the legend names the scale."""
    page.release()
    told = page.ask(
        """(() => { const { box, picture: { picture } } = deadwoodExplore.state.base;
             const seen = picture.getContext('2d').getImageData(0, 0, box.columns, box.rows).data;
             return Array.from(box.values, (n, k) => [n, ...seen.slice(4 * k, 4 * k + 4)]); })()"""
    )
    cells = np.unique(np.array(told), axis=0)
    assert (cells[cells[:, 0] == 0, 4] == 0).all()
    hit = cells[cells[:, 0] > 0]
    assert hit[:, 0].max() > 30
    shades, scale = colours_of(LOOKS["shares"])
    wanted = 255.0 * shades(scale(hit[:, 0] / 300.0))[:, :3]
    # a quarter of a stretch of at most 110 lies between two colours of the ramp; plus rounding by the opacity
    assert np.abs(hit[:, 1:4] - wanted).max() <= 110 / 8 + 2
    assert page.words("#legend .scale").split() == ["0.1", "%", "1", "%", "10", "%", "100", "%"]


def test_a_click_slides_logs_and_tells_which_logs_reach_what(page, shared):
    before = page.picture()
    page.release()
    base = page.state("base")
    assert (base["done"], base["fidelity"]) == (300, "draft")
    assert sum(base["stopped"].values()) == 300
    assert [each["line_id"] for each in base["reach"]] == ["road", "house"]
    road = base["reach"][0]
    digits = 0 if road["ci_high"] - road["ci_low"] >= 0.1 else 1
    assert page.words("#reach .value") == f"{100 * road['p']:.{digits}f} %"
    assert f"{road['n_reach']} of 300 logs" in page.words("#reach .ci")
    assert page.words("#counted").startswith("300 logs, fidelity draft")
    assert page.words("#reach").count("Fidelity draft: over random slopes shares are off by") == 1
    changed = np.abs(page.picture() - before).max(axis=2) > 24.0
    assert changed[:, :880].mean() > 0.005
    assert complaints(shared) == []
    tiles = {each for each in shared.requests if "/tiles/" in each}
    assert tiles
    assert all(re.search(r"\?scene=.*_\d+$", each) for each in tiles)  # none cached from another scene
    origin = page.address.split("?")[0]
    assert {each.split("?")[0] for each in shared.requests if not each.startswith("data:")} >= {origin}
    assert all(each.startswith((origin, "data:")) for each in shared.requests)


def test_the_reach_over_the_plausible_friction_follows_the_answer(page, shared):
    """The current friction is marked; a change adds its curve and a verdict."""
    page.release()
    answered = page.state("base.reach")
    page.wait("deadwoodExplore.state.band?.final === true")
    road = page.state("band.lines")[0]
    assert [each["friction"] for each in road["before"]["points"]] == [0.2, 0.225, 0.25, 0.275, 0.3]
    assert road["before"]["points"][2]["p"] == answered[0]["p"]
    value = page.words("#reach .value")
    sentence = (
        f"Between {road['before']['low']} and {road['before']['high']} % over friction 0.2 to 0.3; at 0.25: {value}."
    )
    assert sentence in page.words("#band")
    posture = road["before"]["postures"][0]
    other = f" Lying, random direction: {100 * posture['p']:.0f} % (ring)."
    assert page.ask("document.querySelector('#band svg').getAttribute('aria-label')") == sentence + other
    marked = page.ask("[...document.querySelectorAll('#band svg')].map((e) => e.querySelector('text.own').textContent)")
    assert marked == ["0.25", "0.25"]
    # each point at the height of its share on the axis, whose ends are 0 and the common top
    numbers = "[...document.querySelector('#band svg').querySelectorAll('{}')].map((e) => Number(e.getAttribute('{}')))"
    drawn = page.ask(numbers.format("circle:not(.other)", "cy"))
    zero, _, top = page.ask(numbers.format("line.grid", "y1"))
    shares = [(zero - each) / (zero - top) for each in drawn]
    full = float(page.ask("document.querySelector('#band svg g:nth-of-type(3) text').textContent").split()[0]) / 100.0
    assert np.allclose(np.array(shares) * full, [each["p"] for each in road["before"]["points"]], atol=0.005)
    page.key("b")
    for x, y in ((70.0, 100.0), (120.0, 102.0)):
        page.click(x, y)
    page.browser.click(*page.seen(120.0, 102.0), count=2)
    page.wait("deadwoodExplore.state.after?.final === true && deadwoodExplore.state.band?.final === true")
    effect = page.state("band.lines")[0]["effect"]
    assert effect == {"less": [0.2, 0.225, 0.25, 0.275, 0.3], "more": [], "chance": []}
    assert PHRASES["effect_less"] in page.words("#band")
    assert page.words("#band").count("A: between") == 2
    page.browser.key("z", control=True)
    page.wait("deadwoodExplore.state.after === null && deadwoodExplore.state.band?.final === true")
    assert PHRASES["effect_less"] not in page.words("#band")
    assert page.browser.hard_to_use() == []
    assert complaints(shared) == []


def test_a_drag_shows_few_logs_on_the_way_and_all_at_rest(page):
    page.ask(
        """(() => {
             window.told = [];
             let base = null;
             const set = (next) => { base = next; if (next) told.push([next.preview, next.done]); };
             Object.defineProperty(deadwoodExplore.state, 'base', { get: () => base, set });
           })()"""
    )
    page.browser.mouse("Pressed", *page.seen(70.0, 200.0))
    give_up = time.monotonic() + 60.0
    for k in itertools.count():  # it continues until a preview is there, however slow the machine
        page.browser.mouse("Moved", *page.seen(72.0 + k % 20, 195.0))
        if page.ask("told.some(([preview]) => preview)") or time.monotonic() > give_up:
            break
        time.sleep(0.05)
    page.browser.mouse("Moved", *page.seen(110.0, 180.0))
    page.browser.mouse("Released", *page.seen(110.0, 180.0))
    page.wait("told.some(([preview, done]) => !preview && done === 300)")
    page.settled()
    told = page.ask("told")
    assert [30, True] in [[done, preview] for preview, done in told]
    assert told[-1] == [False, 300]
    x, y, _ = page.state("shape.circle")
    assert np.hypot(x - 110.0, y - 180.0) < 1.0


def test_felled_trees_tell_the_paired_difference_and_are_undone(page):
    page.release()
    page.key("f")
    page.drag((60.0, 100.0), (120.0, 170.0))
    page.wait("deadwoodExplore.state.after?.final")
    page.settled()
    fell, after = page.state("edits.fell"), page.state("after")
    assert 5 < len(fell) < FOREST
    assert f"{len(fell)} trees felled" in page.words("#edits")
    assert after["done"] == 300
    road = after["lines"][0]
    assert road["after"] - road["before"] == road["gained"] - road["lost"]
    said = page.words("#difference")
    assert f"{road['lost']} log" in said
    assert "points" in said
    assert any(PHRASES[f"verdict_{each}"] in said for each in ("more", "less", "chance"))
    pictures = []
    for key in "12345":
        page.key(key)
        pictures.append(page.picture())
    assert page.state("mode") == "beside"
    assert all((np.abs(a - b).max(axis=2) > 24.0).any() for a, b in itertools.pairwise(pictures))
    page.key("z", control=True)
    page.wait("deadwoodExplore.state.edits.fell.length === 0 && deadwoodExplore.state.after === null")
    assert page.words("#difference") == ""
    page.key("y", control=True)
    page.wait("deadwoodExplore.state.after?.final")
    assert page.state("edits.fell") == fell
    again = page.state("after")
    assert (again["lines"], again["stopped"]) == (after["lines"], after["stopped"])


def test_a_tree_is_felled_and_stands_again_by_a_click(page):
    page.key("f")
    x, y = page.ask("(() => { const d = deadwoodExplore.state.scene.data; return [d.trees_x[7], d.trees_y[7]]; })()")
    page.ask(f"deadwoodExplore.map.moveTo({{ x: {x}, y: {y}, scale: 12 }})")
    page.click(x, y)
    assert page.state("edits.fell") == [7]
    time.sleep(0.6)  # otherwise the two are a double click
    page.click(x, y)
    assert page.state("edits.fell") == []
    page.click(x + 6.0, y + 0.5)
    assert len(page.state("edits.fell")) == 1 or PHRASES["no_tree_here"] in page.words("#alert")


def test_a_barrier_a_log_and_a_tree_are_drawn(page):
    page.release()
    page.key("b")
    page.ask("document.getElementById('barrier-height').value = 4")
    page.click(60.0, 120.0)
    page.click(90.0, 118.0)
    page.click(120.0, 120.0)
    page.click(120.0, 120.0, count=2)
    page.wait("deadwoodExplore.state.after?.final")
    (barrier,) = page.state("edits.barriers")
    assert barrier["height_m"] == 4.0
    assert np.allclose(barrier["points"], [(60.0, 120.0), (90.0, 118.0), (120.0, 120.0)], atol=0.5)
    assert page.state("after.stopped.barrier") > 0
    page.key("l")
    page.drag((80.0, 150.0), (95.0, 148.0))
    page.key("t")
    page.click(92.0, 160.0)
    page.wait("deadwoodExplore.state.edits.plant.length === 1 && deadwoodExplore.state.edits.lying_logs.length === 1")
    page.wait("deadwoodExplore.state.after?.id === deadwoodExplore.state.asked && deadwoodExplore.state.after.final")
    rows = page.words("#edits")
    assert "Barrier of 60 m, 4.0 m high" in rows
    assert "Log of 15 m laid, 40 cm thick" in rows
    assert "Tree planted, DBH 40 cm, 25 m high" in rows


def test_an_area_is_drawn_and_slides(page):
    page.key("a")
    for place in ((70.0, 180.0), (110.0, 180.0), (90.0, 205.0)):
        page.click(*place)
    page.key("Enter", shift=True)
    page.settled()
    assert len(page.state("shape.polygon")) == 3
    assert page.state("base.done") == 300


def test_impossible_inputs_are_reported_in_words(page):
    page.enter("q-friction", "-3")
    assert "Give a number from 0 to" in page.words("#alert")
    assert page.state("settings.friction") == 0.25
    page.key("r")
    page.click(-8.0, 100.0)
    assert PHRASES["outside"] in page.words("#alert")
    page.click(1.0, 100.0)  # a circle that reaches over the side
    page.wait("document.getElementById('alert').innerText.includes('off the terrain model')")
    assert not page.ask("document.body.classList.contains('busy')")
    page.release()
    page.key("l")
    page.drag((14.0, 150.0), (172.0, 150.0))  # longer than the longest log allowed
    page.wait("document.getElementById('alert').innerText.includes('a lying log is 158 m long')")
    assert page.state("edits.lying_logs") == []
    page.release()
    assert page.ask("document.getElementById('alert').hidden")


def test_a_number_is_taken_with_either_decimal_mark_and_shown_as_understood(page):
    page.enter("q-friction", "0,3")
    assert (page.state("settings.friction"), page.ask("document.getElementById('q-friction').value")) == (0.3, "0.3")
    page.enter("q-friction", "3")
    assert page.state("settings.friction") == 0.3, "asked first"
    assert "Friction 3?" in page.words("#question .doubt:not(:empty)")
    page.ask("document.querySelector('#question .doubt button').click()")
    assert page.state("settings.friction") == 0.3
    page.enter("q-friction", "1,5")
    page.ask("[...document.querySelectorAll('#question .doubt button')].at(-1).click()")
    assert page.state("settings.friction") == 1.5
    assert page.ask("document.querySelector('#question .doubt:not(:empty)')") is None
    page.enter("q-n", "1,200")  # a thousand and two hundred
    assert page.state("settings.n") == 1200
    page.enter("q-n", "300,5")
    assert page.state("settings.n") == 1200
    page.enter("q-dbh_cm-0", "32,5")
    assert page.state("settings.dbh_cm") == [32.5, 45]
    page.enter("q-seed", "7,5")
    assert page.state("settings.seed") == 0
    page.enter("barrier-height", "2,5")
    assert page.ask("document.getElementById('barrier-height').value") == "2.5"
    page.enter("q-friction", "0.4")
    page.ask("document.getElementById('q-friction').focus()")
    page.key("ArrowDown")
    assert page.state("settings.friction") == 0.39
    read = "import('./page/numbers.js').then((m) => {}.map((each) => m.understood(each)))"
    texts = ["0,3", ",5", "1e-1", "1.2.3", "abc", ""]
    assert page.ask(read.format(json.dumps(texts))) == [0.3, 0.5, 0.1, None, None, None]


def test_undo_covers_settings_places_and_the_forest(page):
    page.release()
    former = {name: page.state(name) for name in ("settings", "shape", "edits")}
    page.enter("q-friction", "0.4")
    page.ask(
        "(() => { const each = document.getElementById('q-orientation'); each.value = 'upright';"
        " each.dispatchEvent(new Event('change')); })()"
    )
    page.enter("q-n", "60")
    page.key("f")
    page.drag((60.0, 100.0), (120.0, 170.0))
    page.release(60.0, 185.0)
    later = {name: page.state(name) for name in former}
    assert all(later[name] != former[name] for name in former)
    page.ask("document.getElementById('map').focus()")
    for _ in range(5):
        page.key("z", control=True)
    page.settled()
    assert {name: page.state(name) for name in former} == former
    assert page.ask("document.getElementById('q-friction').value") == "0.25"
    assert (page.state("base.n"), page.state("after")) == (300, None)
    for _ in range(5):
        page.key("y", control=True)
    page.settled()
    assert {name: page.state(name) for name in former} == later


def test_it_opens_with_logs_sliding_and_a_link_restores_the_state(page, shared):
    page.settled()
    _, y, _ = page.state("shape.circle")
    assert y > 70.0, "on the steep part, above the road"
    assert page.state("base.done") == 300
    page.enter("q-friction", "0.31")
    page.key("b")
    page.click(60.0, 120.0)
    page.click(100.0, 118.0)
    page.click(100.0, 118.0, count=2)
    page.wait("deadwoodExplore.state.after?.final")
    state = {name: page.state(name) for name in ("settings", "shape", "edits")}
    link = page.ask("location.href")
    other = Browser()
    try:
        second = Page(other, link)
        second.open()
        second.wait("deadwoodExplore.state.after?.final")
        assert {name: second.state(name) for name in state} == state
    finally:
        other.close()


def test_both_forests_have_one_scale_and_a_bar_each(page):
    page.release()
    page.key("b")
    page.click(60.0, 120.0)
    page.click(120.0, 120.0)
    page.click(120.0, 120.0, count=2)
    page.wait("deadwoodExplore.state.after?.final")
    base, after = page.state("base.reach")[0], page.state("after.reach")[0]
    assert base["p"] != after["p"]
    told = page.ask(
        "(() => { const line = document.querySelector('#reach .line'); return ["
        "[...line.querySelectorAll('.gauge i')].map((e) => parseFloat(e.style.width)),"
        "parseFloat([...line.querySelectorAll('.scale span')].at(-1).innerText),"
        "line.querySelectorAll('.scale').length]; })()"
    )
    assert told[0] == pytest.approx([1e4 * base["p"] / told[1], 1e4 * after["p"] / told[1]], abs=0.01)
    assert told[2] == 1
    assert page.ask("document.querySelectorAll('#stops .stacked').length") == 2
    assert page.words("#difference").count("such a difference is off by") == 1  # a bar has changed, once for all lines


def test_logs_that_stay_are_explained(page):
    page.enter("q-friction", "1")
    page.enter("q-rolling_friction", "0.5")
    page.release()
    said = page.words("#stops .stillness")
    assert "friction 1 holds logs on slopes below 45°" in said
    assert 30 <= int(re.findall(r"about (\d+)°", said)[0]) <= 40
    page.enter("q-friction", "0.1")
    page.settled()
    assert page.ask("document.querySelector('#stops .stillness')") is None


def test_the_map_is_saved_as_a_picture(page, shared, tmp_path):
    page.release()
    shared.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.ask("document.getElementById('save-picture').click()")
    give_up = time.monotonic() + 20.0
    while not (tmp_path / "explore.png").is_file():
        assert time.monotonic() < give_up, list(tmp_path.iterdir())
        time.sleep(0.1)
    time.sleep(0.3)
    wide, high = page.ask("[document.getElementById('map').width, document.getElementById('map').height]")
    with Image.open(tmp_path / "explore.png") as picture:
        assert picture.size[0] == wide
        assert picture.size[1] > high
        below = np.asarray(picture.convert("L"), float)[high:]
    assert below.std() > 5.0, "the answers"


def test_it_is_used_by_keys_alone(page):
    page.ask("document.querySelector('.skip').focus()")
    page.key("Tab")
    assert page.ask("document.activeElement.id") == "map"
    view = page.ask("deadwoodExplore.map.view.y")
    page.key("ArrowUp")
    page.wait(f"deadwoodExplore.map.view.y > {view} + 10")
    page.ask(SECOND)
    page.key("r")
    page.key("Enter")
    page.settled()
    middle = page.ask("[deadwoodExplore.map.view.x, deadwoodExplore.map.view.y]")
    assert np.allclose(page.state("shape.circle")[:2], middle)
    assert "95 % interval" in page.words("#spoken")
    page.key("b")
    page.key("Enter")
    page.key("ArrowLeft")
    page.ask(SECOND)
    page.key("Enter")
    page.key("Enter", shift=True)
    page.wait("deadwoodExplore.state.edits.barriers.length === 1")
    page.key("b")
    page.key("Enter")
    page.key("Escape")
    assert page.ask("deadwoodExplore.hand.points.length") == 0


def test_every_control_has_a_name(page):
    nameless = page.ask(
        """Array.from(document.querySelectorAll('button, input, select, canvas, [role=img]'))
           .filter((each) => !each.hidden && each.getAttribute('aria-hidden') !== 'true')
           .filter((each) => !(each.getAttribute('aria-label') || each.innerText || each.labels?.length))
           .map((each) => each.outerHTML)"""
    )
    assert nameless == []
    assert "undefined" not in page.words("body")


def test_moving_logs_on_the_map_and_in_three_dimensions(page, shared):
    page.release()
    page.key("p")
    page.wait("deadwoodExplore.state.playing && deadwoodExplore.state.time > 1")
    page.key("p")
    first, one = page.ask("deadwoodExplore.map.content.moving.logs[0].ends"), page.picture()
    page.ask(
        "(() => { const t = document.getElementById('time'); t.value = t.max; t.dispatchEvent(new Event('input')); })()"
    )
    last = page.ask("deadwoodExplore.map.content.moving.logs[0].ends")
    assert np.hypot(last[0] - first[0], last[1] - first[1]) > 1.0
    assert (np.abs(page.picture() - one).max(axis=2) > 24.0).any()
    page.key("f")
    page.drag((60.0, 100.0), (120.0, 170.0))
    page.wait("deadwoodExplore.state.after?.final")
    page.key("p")
    page.wait("deadwoodExplore.state.motion?.edited === true && deadwoodExplore.state.playing")
    page.key("p")
    assert page.ask("document.getElementById('motion-said').hidden")
    page.ask("document.getElementById('open-space').click()")
    page.wait("window.deadwoodView && deadwoodView.scene().logs.length === 100")
    poses = page.ask("[deadwoodView.poseAt(0, 0).ends, deadwoodView.scene().spec.ground.nx]")
    assert np.isfinite(poses[0]).all()
    page.ask("document.querySelector('#space [data-part=play]').click()")
    page.wait("deadwoodView.state.time > 0.5")
    assert page.picture()[100:600, 100:700].std() > 10.0
    page.key("Escape")
    assert page.ask("document.getElementById('space').hidden")
    assert complaints(shared) == []


def test_what_is_saved_is_a_run_and_the_command_that_repeats_it_is_reported(page, tool):
    page.release()
    page.ask("document.getElementById('keep-name').value = 'left'")
    page.ask("document.querySelector('#keep button').click()")
    page.wait("document.querySelector('#kept pre') !== null")
    command = page.words("#kept pre")
    assert command.startswith("deadwood-tool slide-logs ")
    assert str(tool.folder) not in command
    kept = layer(tool.folder / "kept" / "left", "reach")
    seen = {each["line_id"]: (each["n_reach"], each["p"], each["ci_low"]) for each in page.state("base.reach")}
    columns = (kept[name].tolist() for name in ("n_reach", "p", "ci_low"))
    assert dict(zip(kept["line_id"], zip(*columns, strict=True), strict=True)) == seen
    assert layer(tool.folder / "kept" / "left", "deposits")["stop_reason"].value_counts().to_dict() == {
        reason: n for reason, n in page.state("base.stopped").items() if n
    }
    page.ask("document.querySelector('#keep button').click()")
    page.wait("document.getElementById('alert').innerText.includes('choose another name')")
    assert not page.ask("document.querySelector('#keep button').disabled")


def test_a_reload_continues_where_it_was(page, shared):
    page.release()
    page.key("f")
    page.drag((70.0, 110.0), (110.0, 160.0))
    page.wait("deadwoodExplore.state.after?.final")
    before = {name: page.state(name) for name in ("shape", "edits", "settings")}
    lines = page.state("after.lines")
    page.open()
    page.wait("deadwoodExplore.state.after?.final")
    assert {name: page.state(name) for name in before} == before
    assert page.state("after.lines") == lines
    assert complaints(shared) == []


def test_a_lost_engine_is_reported_and_the_request_repeated(page, tool):
    page.release()
    before = page.state("base.reach")
    tool.engine.kill()
    page.wait("!document.getElementById('alert').hidden")
    assert "started again" in page.words("#alert")
    page.wait("deadwoodExplore.state.base.id === deadwoodExplore.state.full && deadwoodExplore.state.base.final")
    page.settled()
    assert page.state("base.reach") == before


def test_a_second_page_takes_over_and_the_first_reports_it(page, tool):
    other = Browser()
    try:
        second = Page(other, tool.address)
        second.open()
        page.wait("!document.getElementById('alert').hidden")
        assert PHRASES["connection_elsewhere"] in page.words("#alert")
        assert PHRASES["took_over"] in second.words("#alert")
        assert page.ask("document.title") == PHRASES["title_elsewhere"]
        second.release()
        page.ask(SECOND)
        assert other.ask("document.getElementById('alert').hidden")
        page.ask("document.getElementById('again').click()")
        second.wait("!document.getElementById('alert').hidden")
        page.wait("document.getElementById('alert').hidden")
    finally:
        other.close()


def test_a_phone_and_the_dark(page, shared):
    shared.size(390, 844, phone=True)
    page.ask("deadwoodExplore.map.whole()")
    assert page.ask("document.documentElement.scrollWidth") == 390
    small = page.ask(
        """Array.from(document.querySelectorAll('#tools button, #nearness button'))
           .map((each) => each.getBoundingClientRect())
           .filter((box) => box.width < 30 || box.height < 30 || box.right > 390 || box.left < 0).length"""
    )
    assert small == 0
    boxes = "['tools', 'strip', 'map'].map((each) => document.getElementById(each).getBoundingClientRect())"
    tops = page.ask(f"{boxes}.flatMap((each) => [each.top, each.bottom])")
    assert tops == sorted(tops), "nothing lies over the top of the map"
    assert tops[-1] - tops[-2] > 300
    light = page.picture()
    assert light.mean() > 170
    shared.dark()
    page.ask(SECOND)
    assert page.picture().mean() < 110
    ink = page.ask("getComputedStyle(document.body).color")
    assert min(map(int, re.findall(r"\d+", ink)[:3])) > 180


@pytest.mark.slow
def test_many_actions_leave_the_page_alive_and_its_memory_flat(page, shared):
    """Random clicks, drags, changes and modes: the heap does not grow with their number."""
    rng = np.random.default_rng(5)

    def act(many: int) -> float:
        for _ in range(many):
            tool, mode = rng.choice(list("rrrftbl")), rng.choice(list("12345"))
            page.key(str(tool))
            page.key("0")  # some of these drags move the map
            here = tuple(rng.uniform((30.0, 80.0), (150.0, 220.0)))
            page.drag(here, tuple(np.clip(rng.normal(here, 12.0), (25.0, 75.0), (155.0, 225.0))), steps=3, wait_s=0.0)
            page.key(str(mode))
            if rng.random() < 0.3:
                page.key(str(rng.choice(["z", "y"])), control=True)
        page.key("Escape")
        page.settled()
        shared.call("HeapProfiler.collectGarbage")
        return page.ask("performance.memory.usedJSHeapSize") / 1e6

    act(30)
    first, second = act(40), act(80)
    assert second - first < 15.0
    page.key("1")
    page.key("0")
    page.ask("document.getElementById('radius').value = 10")  # a drag of the rim may have made it larger than the slope
    page.release()
    assert complaints(shared) == []


def test_axe_finds_nothing_serious(page):
    """Before a request and with its answer, on a phone and a wide screen, light and dark."""
    found = page.browser.hard_to_use()
    page.release()
    for width in (375, 1440):
        page.browser.size(width, 812, phone=width < 500)
        for dark in (False, True):
            page.browser.dark(dark)
            found += page.browser.hard_to_use()
    assert found == []
