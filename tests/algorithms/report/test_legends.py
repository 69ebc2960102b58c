"""The legend of a map is within the figure, beside a tall map or below, in every language."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib.patches import Patch

from deadwood_algorithms.files.pictures import show_quantity, show_scale
from deadwood_algorithms.report.answer_figures import NARROW
from deadwood_algorithms.report.figures import STYLE, WIDTH
from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.report.plan import (
    covering,
    draw_reliefs,
    has_room_beside,
    legend_of_map,
    map_frame,
    show_layer,
    span_of_reliefs,
)
from deadwood_algorithms.report.space import drapes
from deadwood_algorithms.report.words import Words

WIDE, TALL = (0.0, 0.0, 300.0, 200.0), (0.0, 0.0, 200.0, 320.0)
EDGE_IN = 0.02
BOUNDS = (None, 0.1, 1.0, 10.0, None)  # of classes of shares [%]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("width", [NARROW, WIDTH])
@pytest.mark.parametrize("extent", [WIDE, TALL])
def test_all_entries_lie_within_the_figure(language, width, extent):
    """Before, "10 % of the logs and more" was cut off in a narrow figure."""
    words = Words(language)
    classes = [{"unit": "%", "low": low, "high": high} for low, high in itertools.pairwise(BOUNDS)]
    labels = [words.say("layer_lines"), *(words.of_class(each) for each in classes)]
    labels += [words.say("layer_deposits", stop=words.stop(each)) for each in ("tree", "rest", "lying_log")]
    with matplotlib.rc_context(STYLE):
        figure, axes = map_frame(extent, words, width)
        image = show_quantity(axes, np.full((2, 2), 0.1), "shares", (extent[0], extent[2], extent[1], extent[3]))
        show_scale(figure, image, "shares", words.say("hits_bar"), ax=axes)
        legend_of_map(figure, [Patch(label=each) for each in labels])
        figure.draw_without_rendering()
        box, (wide, tall) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(box.x0, box.y0) > -EDGE_IN
    assert box.x1 < wide + EDGE_IN
    assert box.y1 < tall + EDGE_IN


def test_beside_a_tall_map_and_its_legend_there_is_no_empty_strip():
    """Before, a quarter of the figure was empty, and on a phone nothing but that and half of the map was seen."""
    with matplotlib.rc_context(STYLE):
        figure, axes = map_frame(TALL, Words("en"))
        image = show_quantity(axes, np.full((2, 2), 0.1), "shares", (TALL[0], TALL[2], TALL[1], TALL[3]))
        show_scale(figure, image, "shares", "logs that pass [%]", ax=axes)
        legend_of_map(figure, [Patch(label="roads, railways, houses"), Patch(label="held by a barrier")])
        figure.draw_without_rendering()
        box, wide = figure.get_tightbbox(), figure.get_figwidth()
    assert box.x0 < 0.1 * wide
    assert box.x1 > 0.9 * wide


def test_windows_side_by_side_have_one_relief():
    """Where two windows overlap, they have the same grey, though one is much steeper on average."""
    heights = np.concatenate([np.zeros((30, 20)), np.cumsum(np.full((30, 20), 2.0), axis=1)], axis=1)
    heights += 0.3 * np.random.default_rng(2).standard_normal(heights.shape)

    def window(columns: slice) -> SimpleNamespace:
        ground = SimpleNamespace(values=heights[:, columns], cell=1.0, bounds=(columns.start, 0.0, columns.stop, 30.0))
        return SimpleNamespace(ground=ground, extent=ground.bounds, rasters={})

    sources = [window(slice(0, 30)), window(slice(15, 40))]
    for each in sources:
        each.relief_span = span_of_reliefs(sources)
    with matplotlib.rc_context(STYLE):
        axes = map_frame((0.0, 0.0, 40.0, 30.0), Words("en"))[1]
        draw_reliefs(axes, sources)
        west, east = (np.asarray(each.get_array()) for each in axes.images)
    assert np.allclose(west[:, 16:29], east[:, 1:14])  # without the columns at the sides, whose slope is one-sided
    assert west[:, 16:29].std() > 0.0
    draped = [np.asarray(drapes(each)["relief"], float) for each in sources]
    assert np.array_equal(draped[0][:, 16:29], draped[1][:, 1:14])


@pytest.mark.parametrize("metres", [37.0, 140.0, 260.0, 900.0])
@pytest.mark.parametrize("shape", [1.0, 1.8, 0.6])
def test_coordinates_along_a_map_do_not_overlap(metres, shape):
    """Of the places from which lines are reached they did, at their own scale."""
    south, west = 1_196_240.0, 2_786_150.0
    with matplotlib.rc_context(STYLE):
        figure, axes = map_frame((west, south, west + metres, south + shape * metres), Words("en"), NARROW)
        figure.draw_without_rendering()
        boxes = [
            sorted(((box.y0, box.y1) if k else (box.x0, box.x1)) for box in shown)
            for k, shown in enumerate(
                [each.get_window_extent() for each in axis.get_ticklabels() if inside(each, axes, k)]
                for k, axis in enumerate((axes.xaxis, axes.yaxis))
            )
        ]
    assert min(map(len, boxes)) >= 2
    for ends in boxes:
        assert all(low >= high for (_, high), (low, _) in itertools.pairwise(ends))


def inside(label, axes, k: int) -> bool:
    low, high = sorted(axes.get_ylim() if k else axes.get_xlim())
    return bool(label.get_text()) and low <= label.get_position()[k] <= high


def test_a_tall_map_has_its_legend_beside_it():
    assert has_room_beside(TALL, WIDTH)
    assert not has_room_beside(WIDE, WIDTH)
    assert not has_room_beside(TALL, NARROW)


def test_terrains_under_maps_side_by_side_leave_no_strip_white():
    """With the largest alone a strip stayed white where another run reached farther."""
    large, small, beside = (
        SimpleNamespace(extent=extent, ground=object())
        for extent in ((0.0, 0.0, 100.0, 100.0), (10.0, 10.0, 50.0, 50.0), (-10.0, 0.0, 60.0, 90.0))
    )
    assert covering([small, large, beside]) == [large, beside]  # type: ignore[list-item]


@pytest.mark.parametrize(("name", "drawn"), [("danger", [True, True, False]), ("hits", [False, True, False])])
def test_a_danger_of_zero_is_drawn_and_no_hit_is_not(name, drawn):
    """Where many logs passed and none of them reached the road, the map says so."""
    values = np.array([[0.0, 0.3, np.nan]])
    source = SimpleNamespace(rasters={name: (values, (0.0, 0.0, 3.0, 1.0))})
    _, axes = map_frame((0.0, 0.0, 3.0, 1.0), Words("en"))
    shown = show_layer(axes, source, name).get_array()
    assert (~np.ma.getmaskarray(shown)[0]).tolist() == drawn
