"""Components of synthetic slopes: random relief, and trees with a minimum distance. Arrays only.

The slopes themselves, with their numbers, are in the packages that need them (the sample's, and the paper's twins).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def waves(
    rng: np.random.Generator, rows: int, columns: int, wavelength: float, cell: float, stretch: float = 1.0
) -> Array:
    """Random relief of one wavelength (+-30 %), mean 0 and standard deviation 1: white noise passed through a ring.

    Parameters
    ----------
    wavelength, cell : float
        Wavelength of the relief (geometric mean of both directions), and cell size [m].
    stretch : float
        Ratio of the relief's wavelengths across and along the rows.
    """
    noise = np.fft.rfft2(rng.standard_normal((rows, columns)))
    frequency = np.hypot(
        np.sqrt(stretch) * np.fft.fftfreq(rows, cell)[:, None], np.fft.rfftfreq(columns, cell) / np.sqrt(stretch)
    )
    with np.errstate(divide="ignore"):
        ring = np.exp(-0.5 * (np.log(frequency * wavelength) / 0.3) ** 2)
    relief = np.fft.irfft2(noise * ring, s=(rows, columns))
    return relief / relief.std()


def stems_apart(
    rng: np.random.Generator,
    count: int,
    box: tuple[float, float, float, float],
    distance: float,
    free: Callable[[float, float], bool],
) -> Array:
    """Random places of which no two are closer than ``distance`` [m], and none where ``free`` is true.

    Parameters
    ----------
    box : (u from, u to, v from, v to)
        [m]

    Returns
    -------
    array, shape (count, 2)
    """
    taken: dict[tuple[int, int], list[tuple[float, float]]] = {}
    places: list[tuple[float, float]] = []
    while len(places) < count:
        u, v = float(rng.uniform(box[0], box[1])), float(rng.uniform(box[2], box[3]))
        if free(u, v):
            continue
        i, j = int(u / distance), int(v / distance)
        near = (p for a in (i - 1, i, i + 1) for b in (j - 1, j, j + 1) for p in taken.get((a, b), ()))
        if any((u - p[0]) ** 2 + (v - p[1]) ** 2 < distance**2 for p in near):
            continue
        taken.setdefault((i, j), []).append((u, v))
        places.append((u, v))
    return np.array(places)


def fint_height(dbh: Array) -> Array:
    """H[m] of DBH[cm] = H[m]^1.25: the mean DBH of Klosters (60 cm) at a height of 26.5 m."""
    return dbh**0.8


def stem_sizes(
    rng: np.random.Generator,
    count: int,
    mean_cm: float,
    sd_cm: float,
    least_cm: float,
    height: Callable[[Array], Array] = fint_height,
) -> tuple[Array, Array]:
    """DBH [cm], normally distributed from ``least_cm`` up, and height [m], each of shape (count,).

    Heights scatter by 6 % about the curve of height over DBH.
    """
    dbh = rng.normal(mean_cm, sd_cm, 4 * count)
    dbh = np.round(dbh[dbh >= least_cm][:count], 1)
    return dbh, np.round(height(dbh) * rng.normal(1.0, 0.06, count), 1)
