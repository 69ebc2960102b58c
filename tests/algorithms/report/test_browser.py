"""The report as its reader sees it: in a real Chromium, from the file system, on a screen, a phone and paper."""

from __future__ import annotations

import base64
import io
import re
import subprocess
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, program
from PIL import Image
from slope_case import Case, answers, points, write_layer

from deadwood_algorithms.schemas.looks import SOLIDS
from deadwood_algorithms.tools import make_report

CANVAS = "document.querySelector('.space canvas')"


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    case = Case(tmp_path_factory.mktemp("seen"))
    none = case.run(output=str(case.folder / "none"), lines=case.lines)
    full = case.run(output=str(case.folder / "full"), **case.everything())
    figures = str(case.folder / "figures")
    make_report.TOOL(runs=f"{none},{full}", output=str(case.folder / "page.html"), figures=figures, annex=True)
    return case.folder / "page.html"


@pytest.fixture(scope="module")
def shared():
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture
def browser(shared, page):
    shared.requests.clear()
    shared.complaints.clear()
    shared.dark(False)
    shared.size(1280, 900)
    shared.open(page)
    shared.wait("window.deadwoodView && deadwoodView.scene().last > 0")
    return shared


def canvas_seen(browser: Browser) -> np.ndarray:
    """The pixels of the 3-D view once it is drawn, shape (height, width, 3)."""
    browser.ask(f"{CANVAS}.scrollIntoView({{block: 'start'}})")
    browser.ask(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 300))))"
    )
    left, top, width, height = box_of(browser, CANVAS)
    whole = Image.open(io.BytesIO(browser.picture())).convert("RGB")
    return np.asarray(whole.crop((round(left), round(top), round(left + width), round(top + height))), float)


def choose(browser: Browser, part: str, value: str) -> None:
    browser.ask(
        f"(() => {{ const s = document.querySelector('[data-part=\"{part}\"]');"
        f" s.value = '{value}'; s.dispatchEvent(new Event('change')); }})()"
    )


def box_of(browser: Browser, what: str) -> list[float]:
    """Left, top, width and height of an element on the screen."""
    return browser.ask(
        f"(() => {{ const b = {what}.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; }})()"
    )


def set_time(browser: Browser, share: float) -> None:
    browser.ask(
        "(() => { const s = document.querySelector('[data-part=\"time\"]');"
        f" s.value = s.max * {share}; s.dispatchEvent(new Event('input')); }})()"
    )


def seen_at(browser: Browser, log: int) -> tuple[float, float]:
    """Where the middle of a moving log stands in the canvas [pixels], found by asking where it can be picked."""
    return tuple(
        browser.ask(
            f"""(() => {{
              const v = deadwoodView, c = {CANVAS}, found = [];
              for (let y = 2; y < c.clientHeight; y += 3) for (let x = 2; x < c.clientWidth; x += 3)
                if (v.pick(x, y) === {log}) found.push([x, y]);
              const n = found.length || 1;
              return [found.reduce((s, p) => s + p[0], 0) / n, found.reduce((s, p) => s + p[1], 0) / n];
            }})()"""
        )
    )


def test_no_complaint_and_no_request_to_anywhere(browser, page):
    for share in (0.2, 0.7):
        set_time(browser, share)
        canvas_seen(browser)
    complaints = [each for each in browser.complaints if "GL Driver Message" not in each]  # of taking the picture
    assert complaints == []
    assert {each for each in browser.requests if not each.startswith("data:")} == {page.resolve().as_uri()}
    assert not browser.ask("document.querySelector('.space').classList.contains('nothing')")


def test_the_slider_moves_a_log(browser):
    """The picture changes where the log was and where it is now, and not far from all logs."""
    choose(browser, "group", "fast")
    set_time(browser, 0.0)
    before, was = canvas_seen(browser), seen_at(browser, 0)
    set_time(browser, 0.5)
    after, now = canvas_seen(browser), seen_at(browser, 0)
    assert np.hypot(now[0] - was[0], now[1] - was[1]) > 20.0
    changed = np.abs(after - before).max(axis=2) > 24.0
    for x, y in (was, now):
        around = changed[max(0, round(y) - 12) : round(y) + 12, max(0, round(x) - 12) : round(x) + 12]
        assert around.any()
    assert 0.0005 < changed.mean() < 0.2


def test_play_runs_and_stops(browser):
    choose(browser, "pace", "8")
    browser.ask("document.querySelector('[data-part=\"play\"]').click()")
    browser.wait("deadwoodView.state.time > 1")
    browser.wait("!deadwoodView.state.playing")
    assert browser.ask("deadwoodView.state.time === deadwoodView.scene().last")


def test_a_log_is_picked_and_followed(browser):
    set_time(browser, 0.5)
    canvas_seen(browser)
    x, y = browser.ask(
        f"""(() => {{ const c = {CANVAS}, b = c.getBoundingClientRect();
          for (let y = 5; y < c.clientHeight; y += 4) for (let x = 5; x < c.clientWidth; x += 4)
            if (deadwoodView.pick(x, y) >= 0) return [b.x + x, b.y + y];
        }})()"""
    )
    browser.click(x, y)
    browser.wait("deadwoodView.state.followed >= 0")
    browser.ask("deadwoodView.paint()")  # the words are written with the next frame, which may not have come yet
    told = browser.ask("document.querySelector('[data-part=\"followed\"]').textContent")
    assert re.fullmatch(r"log \d+: \d+\.\d m/s", told)
    browser.ask("deadwoodView.paint()")
    at = browser.ask("deadwoodView.state.camera.at")
    ends = browser.ask("deadwoodView.poseAt(deadwoodView.state.followed, deadwoodView.state.time).ends")
    assert np.allclose(at, (np.array(ends[:3]) + ends[3:]) / 2.0, atol=1e-3)
    browser.ask("document.querySelector('[data-part=\"follow\"]').click()")
    assert browser.ask("deadwoodView.state.followed") == -1


def test_solids_drapes_groups_and_runs_can_be_chosen(browser):
    choose(browser, "run", "1")
    set_time(browser, 0.4)
    seen = [canvas_seen(browser)]
    for name in ("trees", "barriers", "lines", "moving", "deposits", "trails"):
        browser.ask(f"document.querySelector('[data-solid=\"{name}\"]').click()")
        seen.append(canvas_seen(browser))
    choose(browser, "drape", "relief")
    seen.append(canvas_seen(browser))
    for one, other in pairwise(seen):
        assert (np.abs(one - other).max(axis=2) > 16.0).any()


def test_layers_of_the_map_switch(browser):
    shown = browser.ask(
        """Array.from(document.querySelectorAll('.map')[1].querySelectorAll('input[data-layer]')).map((box) => {
             const layer = document.getElementById(box.dataset.layer);
             const before = layer && layer.style.display !== 'none';
             box.click();
             const after = layer && layer.style.display !== 'none';
             return [box.dataset.layer, Boolean(layer), before === box.defaultChecked, before !== after];
           })"""
    )
    assert len(shown) >= 10
    for name, there, as_said, switched in shown:
        assert (there, as_said, switched) == (True, True, True), name
    hidden = browser.ask(
        """Array.from(document.querySelectorAll('[id$=layer_trajectories_key], [id$=layer_trajectories_word]'))
             .map((each) => each.style.display)"""
    )
    assert hidden[:2] == ["none", "none"]  # of the first map, whose boxes are unchanged: no entry of hidden layers
    assert hidden[2:] == ["", ""]
    names = {name.split("layer_")[1] for name, *_ in shown}
    assert {"relief", "hits", "speed", "trees", "barriers", "lines", "releases", "trajectories"} <= names


def test_the_map_tells_coordinates_and_zooms(browser):
    browser.ask("document.querySelector('.map svg').scrollIntoView({block: 'center'})")
    x, y, width, height = box_of(browser, "document.querySelector('.map svg')")
    browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + 0.45 * width, y=y + 0.5 * height)
    told = browser.ask("document.querySelector('.map .where').textContent")
    east, north = map(float, told.split(", "))
    assert 2_786_000 <= east <= 2_786_060
    assert 1_196_000 <= north <= 1_196_100
    before = browser.ask("document.querySelector('.map svg').getAttribute('viewBox')")
    browser.ask("document.querySelector('.map [data-part=\"in\"]').click()")
    assert browser.ask("document.querySelector('.map svg').getAttribute('viewBox')") != before
    browser.ask("document.querySelector('.map [data-part=\"reset\"]').click()")
    after = browser.ask("document.querySelector('.map svg').getAttribute('viewBox')")
    assert [float(each) for each in after.split()] == pytest.approx([float(each) for each in before.split()], abs=0.01)


def test_it_reads_on_a_phone_and_in_the_dark(browser):
    browser.size(390, 844, phone=True)
    assert browser.ask("document.documentElement.scrollWidth") == 390
    light = Image.open(io.BytesIO(browser.picture())).convert("L")
    assert np.asarray(light).mean() > 170
    browser.dark()
    dark = Image.open(io.BytesIO(browser.picture())).convert("L")
    assert np.asarray(dark).mean() < 110
    ink = browser.ask("getComputedStyle(document.body).color")
    assert min(map(int, re.findall(r"\d+", ink)[:3])) > 180
    assert browser.ask("getComputedStyle(document.querySelector('.frame svg.figure text')).fill") == ink


@pytest.mark.parametrize("width", [375, 1440])
@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_nothing_serious(browser, width, dark):
    """Scrolling parts that the keyboard reaches, names of buttons, contrast, unique ids."""
    browser.size(width, 812, phone=width < 500)
    browser.dark(dark)
    assert browser.hard_to_use() == []


def test_axe_would_find_what_is_hard_to_use(browser):
    browser.ask("document.body.insertAdjacentHTML('beforeend', '<button></button><p style=color:#ccc>pale</p>')")
    assert {each.partition(":")[0] for each in browser.hard_to_use()} == {"button-name", "color-contrast"}


def test_it_prints(browser):
    printed = browser.printed()
    assert printed[:5] == b"%PDF-"
    boxes = {tuple(map(float, each.split())) for each in re.findall(rb"/MediaBox \[([\d. ]+)\]", printed)}
    assert boxes
    for box in boxes:
        assert box[2:] == pytest.approx((595.0, 842.0), abs=1.5)
    assert 4 <= len(re.findall(rb"/Type /Page\b", printed)) <= 40


def test_on_paper_every_page_has_its_number_and_none_ends_in_a_heading(browser, tmp_path):
    """Two or three pages are signed, the annex begins a new one; what lies low on a page is no heading, nor the head of
    a table without a row."""
    pdftotext = program("pdftotext")
    (tmp_path / "page.pdf").write_bytes(browser.printed())
    told = subprocess.run(
        [pdftotext, "-layout", "page.pdf", "-"], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=60
    )
    pages = [[line.strip() for line in page.splitlines() if line.strip()] for page in told.stdout.split("\f")[:-1]]
    assert [page[-1] for page in pages] == [f"{k} / {len(pages)}" for k in range(1, len(pages) + 1)]
    assert next(k for k, page in enumerate(pages) if page[0] == "Annex") in (2, 3)
    headings = set(browser.ask("[...document.querySelectorAll('h2, h3, h4')].map((each) => each.textContent)"))
    heads = browser.ask(
        "[...document.querySelectorAll('thead tr')].map((row) => [...row.cells].map((th) => th.textContent).join(' '))"
    )
    lowest = [" ".join(page[-2].split()) for page in pages]
    named = headings - {"3-D view"} | {" ".join(head.split()) for head in heads}  # its picture has no words
    assert [each for each in lowest if each in named] == []


@pytest.fixture(scope="module")
def long_page(page) -> Path:
    """Three runs, with everything that a report can show of them."""
    case = Case(page.parent)
    third = case.run(output=str(case.folder / "third"), seed=3, **case.everything())
    runs = ",".join(str(each) for each in (case.folder / "none", case.folder / "full", third))
    make_report.TOOL(runs=runs, output=str(case.folder / "long.html"), annex=True)
    return case.folder / "long.html"


@pytest.fixture(scope="module")
def answered_page(tmp_path_factory) -> Path:
    """One run, with the results of every other tool for it."""
    case = Case(tmp_path_factory.mktemp("answered"))
    run = case.run(output=str(case.folder / "run"), **(case.everything() | {"barriers": None}))
    results = ",".join(map(str, answers(case, run).values()))
    make_report.TOOL(runs=str(run), results=results, output=str(case.folder / "answered.html"), annex=True)
    return case.folder / "answered.html"


def used_of_pages(browser: Browser, folder: Path) -> list[float]:
    """The used share of the height of each page on paper, without its margins and its number."""
    top, bottom = 16.0 / 297.0, 1.0 - 18.0 / 297.0  # as `page.css` has them
    used = []
    for page in pictures_of(browser.printed(), folder, 40):
        inked = np.flatnonzero((np.asarray(page.convert("L")) < 200).any(axis=1)) / page.height
        used.append((inked[inked < bottom].max() - top) / (bottom - top))
    return used


def annex_begins(browser: Browser, folder: Path) -> int:
    """The number of signed pages."""
    (folder / "page.pdf").write_bytes(browser.printed())
    words = [program("pdftotext"), "-layout", "page.pdf", "-"]
    told = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True, timeout=60).stdout
    return next(k for k, each in enumerate(told.split("\f")) if each.strip().startswith("Annex"))


def half_empty(used: list[float], signed: int) -> list[int]:
    """Pages of which 45 % or more are empty, but the last of all, and the last signed one without maps of its own."""
    return [k + 1 for k, each in enumerate(used[:-1]) if each < 0.55 and (k != signed - 1 or signed == 3)]


@pytest.mark.parametrize("which", ["page", "long_page", "answered_page"])
def test_on_paper_no_page_is_half_empty(shared, tmp_path, request, which):
    """Unbreakable parts are small enough that the page before them stays well filled; the last signed page contains
    the points to be judged and the signatures."""
    shared.size(1280, 900)
    shared.open(request.getfixturevalue(which))
    shared.wait("window.deadwoodView && deadwoodView.scene().last > 0")
    used, signed = used_of_pages(shared, tmp_path), annex_begins(shared, tmp_path)
    assert signed in (2, 3)
    assert len(used) > 6
    assert half_empty(used, signed) == [], used


def test_a_half_empty_page_would_be_found(shared, tmp_path, long_page):
    """With figures as tall as a page can hold."""
    shared.open(long_page)
    shared.wait("window.deadwoodView && deadwoodView.scene().last > 0")
    shared.ask(
        "document.head.insertAdjacentHTML('beforeend',"
        " '<style>@media print { svg.figure { height: 190mm !important; max-height: none !important; } }</style>')"
    )
    assert half_empty(used_of_pages(shared, tmp_path), annex_begins(shared, tmp_path)) != []


def test_a_closed_annex_is_not_printed_and_shows_its_view_once_it_is_open(shared, page, tmp_path):
    runs = ",".join(str(page.parent / each) for each in ("none", "full"))
    make_report.TOOL(runs=runs, output=str(tmp_path / "closed.html"))
    shared.size(1280, 900)
    shared.open(tmp_path / "closed.html")
    assert len(pictures_of(shared.printed(), tmp_path, 40)) in (2, 3)
    shared.ask("document.querySelector('details.annex').open = true")
    shared.wait("window.deadwoodView && deadwoodView.scene().last > 0")
    seen = canvas_seen(shared)
    assert min(seen.shape[:2]) > 200
    assert seen.std() > 10.0  # a canvas without a picture has one colour
    assert len(pictures_of(shared.printed(), tmp_path, 40)) > 3


SMALLEST_PT = 6.5  # of letters on paper


def small_letters(browser: Browser) -> list[str]:
    """Text of figures on paper in letters that are too small, and their size [pt]; before, 4 pt on a tall map."""
    browser.size(680, 1000)  # 180 mm, as wide as A4 is between its margins
    browser.call("Emulation.setEmulatedMedia", media="print")
    told = browser.ask(
        """[...document.querySelectorAll('svg.figure text')].map((each) => {
             const m = each.getScreenCTM(), size = parseFloat(getComputedStyle(each).fontSize);
             return [each.textContent, each.closest('svg').getAttribute('aria-label'),
                     0.75 * size * Math.hypot(m.a, m.b)];
           })"""
    )
    browser.call("Emulation.setEmulatedMedia", media="")
    assert len(told) > 100
    return [f"{figure}: {text}: {size:.1f}" for text, figure, size in told if text.strip() and size < SMALLEST_PT]


@pytest.mark.parametrize("which", ["page", "long_page", "answered_page"])
def test_letters_of_figures_are_large_enough_on_paper(shared, request, which):
    shared.open(request.getfixturevalue(which))
    assert small_letters(shared) == []


def pictures_of(pdf: bytes, folder: Path, dpi: int) -> list[Image.Image]:
    """The pages of a PDF."""
    pdftoppm = program("pdftoppm")
    (folder / "told.pdf").write_bytes(pdf)
    subprocess.run([pdftoppm, "-r", str(dpi), "-png", "told.pdf", "told"], cwd=folder, check=True, timeout=60)
    found = sorted(folder.glob("told-*.png"), key=lambda each: int(each.stem.rpartition("-")[2]))
    return [Image.open(each).convert("RGB") for each in found]


def test_the_same_map_is_in_png_svg_pdf_and_on_the_page(browser, page, tmp_path):
    """Picture by picture the same but for the edges of what is drawn; the map of another run is another picture."""
    figures = page.parent / "figures"
    shown = "document.querySelector('#r1 ~ * .map svg, #r1 .map svg, .chapter:last-of-type .map svg')"
    browser.ask(f"{shown}.scrollIntoView({{block: 'start'}})")
    browser.size(1280, 1400)
    left, top, width, height = box_of(browser, shown)
    clip = {"x": left + browser.ask("scrollX"), "y": top + browser.ask("scrollY"), "width": width, "height": height}
    told = browser.call("Page.captureScreenshot", captureBeyondViewport=True, clip={**clip, "scale": 1})
    on_page = Image.open(io.BytesIO(base64.b64decode(told["data"])))
    maps = {
        "png": Image.open(figures / "r1_map.png"),
        "pdf": pictures_of((figures / "r1_map.pdf").read_bytes(), tmp_path, 100)[0],
        "page": on_page,
    }
    browser.open(figures / "r1_map.svg")
    browser.wait("document.documentElement.getBoundingClientRect().width > 0")
    left, top, width, height = box_of(browser, "document.documentElement")
    told = browser.call(
        "Page.captureScreenshot",
        captureBeyondViewport=True,
        clip={"x": left, "y": top, "width": width, "height": height, "scale": 1},
    )
    maps["svg"] = Image.open(io.BytesIO(base64.b64decode(told["data"])))
    alike = {name: small(picture) for name, picture in maps.items()}
    other = small(Image.open(figures / "r0_map.png"))
    for one, two in combinations(alike, 2):
        assert apart(alike[one], alike[two]) < 0.25 * apart(alike[one], other), (one, two)


def small(picture: Image.Image) -> np.ndarray:
    """A picture so coarse that hairlines and letters no longer matter; the background, white or grey, as white."""
    ground = Image.new("RGB", picture.size, "#ffffff")
    whole = picture.convert("RGBA")
    ground.paste(whole, mask=whole.getchannel("A"))
    found = np.asarray(ground.resize((60, 64), Image.Resampling.BOX), float)
    return np.where((found > 238.0).all(axis=2, keepdims=True), 255.0, found)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """The mean difference of colours."""
    return float(np.abs(one - other).mean())


def test_without_webgl_all_else_is_there(shared, page, tmp_path):
    blind = tmp_path / "blind.html"
    text = page.read_text(encoding="utf-8").replace('getContext("webgl2"', 'getContext("no such thing"')
    blind.write_text(text, encoding="utf-8")
    shared.complaints.clear()
    shared.size(1280, 900)
    shared.open(blind)
    assert shared.ask("getComputedStyle(document.querySelector('.space .missing')).display") == "block"
    assert shared.ask("document.querySelectorAll('.map svg').length") == 2
    assert [each for each in shared.complaints if "GL Driver Message" not in each] == []


def test_stumps_have_their_own_colour_in_the_view(shared, tmp_path):
    """A cleared stand from above: the stumps' colour is seen, that of trees is not; of trees, the other way round."""
    case = Case(tmp_path / "case")
    places = [(12.0 + 6.0 * a, 40.0 + 6.0 * b) for a in range(7) for b in range(8)]
    seen = {}
    for name, height in (("trees", 15.0), ("stumps", 0.8)):
        stand = {"tree_id": range(56), "dbh_cm": [300.0] * 56, "height_m": [height] * 56}
        trees = write_layer(tmp_path / f"{name}.gpkg", points(*places), **stand)
        run = case.run(output=str(tmp_path / name), trees=trees)
        make_report.TOOL(runs=str(run), output=str(tmp_path / f"{name}.html"), annex=True, gltf=str(tmp_path / "s.glb"))
        assert f'"name":"{name}"'.encode() in (tmp_path / "s.glb").read_bytes()
        (tmp_path / "s.glb").unlink()
        shared.size(1280, 900)
        shared.open(tmp_path / f"{name}.html")
        shared.wait("window.deadwoodView && deadwoodView.scene().last > 0")
        choose(shared, "drape", "relief")
        shared.ask(
            "for (const each of ['moving', 'deposits']) deadwoodView.state.shown[each] = false; deadwoodView.draw()"
        )
        pixels = canvas_seen(shared).reshape(-1, 3)
        pixels /= np.maximum(np.linalg.norm(pixels, axis=1, keepdims=True), 1.0)  # light changes the size alone
        tints = {each: np.array(SOLIDS[each]) / np.linalg.norm(SOLIDS[each]) for each in ("trees", "stumps")}
        seen[name] = {each: int((pixels @ tint > 0.998).sum()) for each, tint in tints.items()}
    assert seen["stumps"]["stumps"] > 500 > 10 * seen["stumps"]["trees"]
    assert seen["trees"]["trees"] > 500
