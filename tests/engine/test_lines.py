"""Lines in plan: their pieces, and what meets or crosses them, against shapely."""

import numpy as np
import pytest
import shapely

from deadwood_engine.lines import Lines, hull_meets_segment, segments_cross, segments_of, touch_segments


def lines(*each):
    sizes = [len(points) for points in each]
    return Lines(np.vstack([np.asarray(points, float) for points in each]), np.append(0, np.cumsum(sizes)))


def test_lines_are_cut_into_pieces_that_know_their_line():
    three = lines([(10, 20), (11, 20), (12, 25)], [(0, 0)], [(3, 4), (5, 6)])
    cut = segments_of(three, 10.0, 20.0)
    assert cut.owner.tolist() == [0, 0, 2]  # a line of one vertex has no piece
    assert cut.lines == 3
    assert cut.ends.tolist() == [[0, 0, 1, 0], [1, 0, 2, 5], [-7, -16, -5, -14]]
    assert segments_of(Lines.none()).ends.shape == (0, 4)


def test_further_lines_come_behind():
    both = lines([(0, 0), (1, 0)]).then(lines([(5, 5), (6, 6), (7, 5)]), Lines.none())
    assert both.starts.tolist() == [0, 2, 5]
    assert np.array_equal(both.vertices[2:], [[5, 5], [6, 6], [7, 5]])


@pytest.mark.parametrize("seed", range(10))
def test_a_hull_meets_what_it_meets(seed):
    """A random convex polygon and random segments, from within, through, beside; shapely says which."""
    rng = np.random.default_rng(seed)
    shape = shapely.convex_hull(shapely.MultiPoint(rng.uniform(-2, 2, (12, 2))))
    hull = np.array(shapely.normalize(shape).exterior.coords)[:-1]
    if shapely.Polygon(hull).exterior.is_ccw is False:
        hull = hull[::-1].copy()
    for a, b in rng.uniform(-4, 4, (200, 2, 2)):
        meets = shapely.intersects(shape, shapely.LineString([a, b]))
        assert hull_meets_segment(hull, len(hull), tuple(a), tuple(b)) == meets


@pytest.mark.parametrize("seed", range(10))
def test_a_path_crosses_what_it_crosses(seed):
    rng = np.random.default_rng(seed)
    for a, b, c, d in rng.uniform(-1, 1, (300, 4, 2)):
        assert segments_cross(*map(tuple, (a, b, c, d))) == shapely.crosses(
            shapely.LineString([a, b]), shapely.LineString([c, d])
        )


def test_a_way_along_vertices_is_crossed_once():
    """A path through the vertex that two pieces share crosses one of them, so a line is crossed once, not twice."""
    bend = [((-1, 0), (0, 0)), ((0, 0), (1, 0))]
    through = sum(segments_cross((0, -1), (0, 1), c, d) for c, d in bend)
    along = sum(segments_cross((-1, 1), (1, 1), c, d) for c, d in bend)
    assert through == 1
    assert along == 0


def test_touched_and_crossed_are_marked_by_line():
    cut = segments_of(lines([(0, 0), (10, 0)], [(0, 5), (10, 5)], [(4, -9), (4, 9)]))
    hull = np.array([(3.0, -1.0), (5.0, -1.0), (5.0, 2.0), (3.0, 2.0)])
    touched, crossed = np.zeros(3, bool), np.zeros(3, bool)
    touch_segments(cut, hull, 4, np.array([3.5, -1.0, 3.5, 2.0]), (0.0, 0.0), touched, crossed)
    assert touched.tolist() == [True, False, True]
    assert crossed.tolist() == [True, False, False]
    touched[:], crossed[:] = False, False
    touch_segments(cut, hull, 0, np.zeros(4), (0.0, 0.0), touched, crossed)
    assert not touched.any()
