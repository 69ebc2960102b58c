"""Parts of the uprights' contacts by themselves."""

import numpy as np
import pytest

from deadwood_engine.tree_contacts import disc_nearest


@pytest.mark.parametrize("cosine", [1.0, 0.7, -0.3, 0.02, 0.0])
def test_point_of_a_tilted_disc_nearest_to_a_place(cosine):
    """Against a search over the rim, in plan an ellipse: nothing on it is nearer, and what is found is on it.

    The distance d along the rim has a second derivative of a^2 / d + a at most, so the search, 5e-5 rad beside the
    nearest point at most, finds up to (a^2 / d + a) (5e-5)^2 / 2 more.
    """
    rng = np.random.default_rng(5)
    angle = np.arange(0.0, 2 * np.pi, 1e-4)
    for _ in range(40):
        radius, away = rng.uniform(0.05, 1.0), rng.uniform(0.001, 30.0)
        toward = rng.uniform(0.0, 2 * np.pi)
        # from outside the circle, so from outside the ellipse
        place = (radius + away) * np.cos(toward), (radius + away) * np.sin(toward)
        u, w = disc_nearest(radius, cosine, *place)
        assert np.hypot(u, w) <= radius * (1.0 + 1e-9)
        rim = np.hypot(place[0] - radius * np.cos(angle), place[1] - cosine * radius * np.sin(angle))
        found = np.hypot(place[0] - u, place[1] - cosine * w)
        assert found >= rim.min() - (radius**2 / rim.min() + radius) * 5e-5**2 / 2
        assert found <= rim.min() + 1e-12
