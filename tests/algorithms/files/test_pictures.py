"""Pictures as pictures: the content of the exported file is checked, and colours contrast with their background."""

from __future__ import annotations

import itertools
import re
import subprocess
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from browser import program
from matplotlib.figure import Figure
from PIL import Image

from deadwood_algorithms.files.pictures import (
    colours_of,
    limits_of_ends,
    show_dots,
    show_quantity,
    show_scale,
    with_minus,
)
from deadwood_algorithms.schemas import looks
from deadwood_algorithms.schemas.words import RasterFile
from deadwood_algorithms.schemas.written import WRITTEN

DOT = "#d55e00"
DPI = 200
LIGHT, DARK, CARD = "#ffffff", "#15191d", "#f6f7f8"  # grounds of the report's page


def map_with_dots(number: int) -> tuple[Figure, np.ndarray]:
    """Dots in rows, far enough apart to be counted, at arbitrary positions within the pixels."""
    side = int(np.ceil(np.sqrt(number)))
    y, x = np.divmod(np.arange(number), side)
    x, y = 2_786_000.0 + 7.31 * x, 1_196_000.0 + 7.31 * y
    figure = Figure(figsize=(6.0, 6.0))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(x.min() - 5.0, x.min() + 7.31 * side), ylim=(y.min() - 5.0, y.min() + 7.31 * side))
    axes.set_axis_off()
    show_dots(axes, x, y, 2.4, DOT)
    return figure, axes.transData.transform(np.column_stack([x, y])) / figure.dpi  # inches


def counted(picture: np.ndarray, places: np.ndarray, dpi: float) -> int:
    """Number of places [inches from the lower left] at which a pixel has the colour of a dot."""
    rows = np.clip(picture.shape[0] - 1 - np.floor(places[:, 1] * dpi), 0, picture.shape[0] - 1).astype(int)
    columns = np.clip(np.floor(places[:, 0] * dpi), 0, picture.shape[1] - 1).astype(int)
    far = np.abs(picture[rows, columns].astype(float) - 255.0 * np.array(looks.rgb(DOT))).max(axis=1)
    return int((far < 60.0).sum())


@pytest.mark.parametrize("number", [1, 267, 512, 513, 3000])
def test_every_dot_is_in_the_raster(number, tmp_path):
    """Agg snaps the strokes of a path of few points to pixels, and does not draw those that then have no length."""
    figure, places = map_with_dots(number)
    figure.savefig(tmp_path / "dots.png", dpi=DPI)
    with Image.open(tmp_path / "dots.png") as image:
        assert counted(np.asarray(image.convert("RGB")), places, DPI) == number


def test_every_dot_is_in_the_vector_files(tmp_path):
    figure, places = map_with_dots(267)
    figure.savefig(tmp_path / "dots.svg")
    paths = re.findall(r' d="([^"]+)"', (tmp_path / "dots.svg").read_text(encoding="utf-8"))
    assert max(path.count("M") for path in paths) == 267
    pdftoppm = program("pdftoppm")
    figure.savefig(tmp_path / "dots.pdf")
    subprocess.run(
        [pdftoppm, "-r", str(DPI), "-png", "-singlefile", "dots.pdf", "pdf"], cwd=tmp_path, check=True, timeout=60
    )
    with Image.open(tmp_path / "pdf.png") as image:
        assert counted(np.asarray(image.convert("RGB")), places, DPI) == 267


@pytest.mark.parametrize("name", sorted(looks.LOOKS))
def test_a_quantity_has_its_colour_at_each_stop_and_linear_ones_between(name):
    look = looks.LOOKS[name]
    assert list(look.stops) == sorted(set(look.stops))
    ramp, scale = colours_of(look)
    for value, colour in zip(look.stops, look.colours, strict=True):
        assert ramp(scale(value))[:3] == pytest.approx(looks.rgb(colour), abs=0.02)
    for (low, one), (high, other) in itertools.pairwise(zip(look.stops, look.colours, strict=True)):
        middle = np.mean([looks.rgb(one), looks.rgb(other)], axis=0)
        assert ramp(scale(0.5 * (low + high)))[:3] == pytest.approx(middle, abs=0.02)
    beyond = ramp(scale(look.stops[-1] * 10.0))  # values off the scale have the colour of its end
    assert beyond[:3] == pytest.approx(looks.rgb(look.colours[-1]), abs=0.02)


def test_what_is_clear_is_not_drawn_and_the_scale_names_every_stop():
    figure = Figure()
    axes = figure.subplots()
    values = np.array([[0.0, 0.1], [0.3, np.nan]])
    image = show_quantity(axes, values, "shares", (0.0, 1.0, 0.0, 1.0))
    assert np.ma.getmaskarray(np.ma.asarray(image.get_array())).tolist() == [[True, False], [False, True]]
    bar = show_scale(figure, image, "shares", "logs that pass [%]", ax=axes)
    assert [each.get_text() for each in bar.ax.get_yticklabels()] == ["0.1", "0.3", "1", "3", "10", "30", "100"]


def test_every_raster_that_is_written_says_how_it_looks():
    known = {*looks.LOOKS, *looks.BY_DATA}
    # legends of classes; bands of three kinds
    plain = {"intensity", "intensity_YEARS_years", "passage", "return_class", "matrix", "factors"}
    for each in {one.what.name: one.what for one in WRITTEN if isinstance(one.what, RasterFile)}.values():
        assert (each.look in known) == (each.name not in plain), each.name


def luminance(colour: str) -> float:
    parts = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in looks.rgb(colour)]
    return float(np.dot(parts, (0.2126, 0.7152, 0.0722)))


def contrast(one: str, other: str) -> float:
    """As WCAG 2 has it, from 1 to 21."""
    low, high = sorted([luminance(one), luminance(other)])
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("name", ["ROAD", "RELEASE", "TREE", "BARRIER", "WOOD", "STONE", "PLAIN", "CHOSEN", "KEEPS"])
def test_things_stand_out_from_the_card_that_maps_lie_on(name):
    """WCAG requires 3 to 1 for parts that are needed to read a figure; the card stays pale in the dark theme."""
    assert contrast(getattr(looks, name), CARD) >= 3.0


def test_text_is_read_in_both_modes():
    sheet = (Path(looks.__file__).parents[1] / "report" / "page.css").read_text(encoding="utf-8")
    modes = [dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", block)) for block in re.findall(r":root \{([^}]*)\}", sheet)]
    assert (modes[0]["ground"], modes[1]["ground"]) == (LIGHT, DARK)
    for mode in modes:
        for name in ("ink", "quiet", "mark"):
            assert contrast(mode[name], mode["ground"]) >= 4.5, (mode["ground"], name)
            assert contrast(mode[name], mode["soft"]) >= 4.5, (mode["soft"], name)


def test_runs_are_distinguished_on_both_grounds_and_by_colour_blind_eyes():
    """They are visible on both; seen without red or without green, no two of the first four are alike."""
    for colour in looks.RUNS[:4]:
        assert min(contrast(colour, LIGHT), contrast(colour, DARK)) >= 2.7, colour
    for one, other in itertools.combinations(looks.RUNS[:4], 2):
        for blind in (PROTANOPE, DEUTERANOPE):
            apart = np.linalg.norm(blind @ np.subtract(linear(one), linear(other)))
            assert apart > 0.1, (one, other)


# Viénot, Brettel and Mollon 1999, on linear light
PROTANOPE = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
DEUTERANOPE = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])


def linear(colour: str) -> np.ndarray:
    return np.array([((part + 0.055) / 1.055) ** 2.4 if part > 0.04045 else part / 12.92 for part in looks.rgb(colour)])


def test_no_tool_has_colours_of_its_own():
    """Except for grey grids and frames, the colours of pictures are declared in `looks`."""
    root = Path(looks.__file__).parents[1]
    named = set(re.findall(r"#[0-9a-f]{6}", Path(looks.__file__).read_text(encoding="utf-8")))
    found = []
    for path in root.rglob("*.py"):
        if path.parent.name == "schemas" or path.name in ("legend.py", "qml.py"):
            continue
        for colour in re.findall(r"\"(#[0-9a-fA-F]{6})\"", path.read_text(encoding="utf-8")):
            red, green, blue = looks.rgb(colour)
            if max(red, green, blue) - min(red, green, blue) > 0.06 and colour.lower() in named:
                found.append((path.name, colour))
    assert found == []


matplotlib.use("Agg")


def test_negative_numbers_in_words_have_the_sign_of_the_axes():
    text = "take-off at -26.4°, -25 points (-64 to +26), 0.2-0.3"
    assert with_minus(text) == "take-off at \u221226.4°, \u221225 points (\u221264 to +26), 0.2-0.3"


@pytest.mark.parametrize(
    ("values", "most", "limits"),
    [
        ((0.0, 0.0), 100.0, (0.0, 1.0)),  # before: -1 to 1 %
        ((100.0, 100.0), 100.0, (99.0, 100.0)),
        ((45.0, 45.0), float("inf"), (44.0, 46.0)),
        ((10.0, 20.0, 60.0), 100.0, (7.0, 63.0)),
        ((2.0, 99.0), 100.0, (0.0, 100.0)),
    ],
)
def test_a_tornado_stays_within_what_is_possible(values, most, limits):
    assert limits_of_ends(values, most) == pytest.approx(limits)
