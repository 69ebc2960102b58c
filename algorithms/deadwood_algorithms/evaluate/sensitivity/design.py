"""Which points of the factors' ranges are run: the ends one at a time, and the rows of Saltelli's design.

Saltelli's design (Saltelli et al. 2010) has two independent samples A and B of the unit cube, and for every factor the
sample A with that factor's column taken from B. The samples are a Latin hypercube, drawn here, or Sobol's sequence,
scrambled, of SciPy.

The error of a terrain model is not a number but a surface: its factor is paired with the number of a random surface,
which belongs to the row. Where its column comes from B, so does the surface, and the index is that of the error, not
of its size on one surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.sensitivity.factors import Factor
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats.draws import LATIN_ORDER, LATIN_PLACE, uniforms

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """One run: the values of its factors (all others are those of the scene), and the number of the terrain error's
    surface.
    """

    label: str
    values: dict[str, float | str]
    surface: int = 0


def latin_hypercube(rows: int, columns: int, seed: int) -> Array:
    """Points of the unit cube, shape (rows, columns); each column has one point in each of its ``rows`` strips."""
    out = np.empty((rows, columns))
    for column in range(columns):
        order = np.argsort(uniforms(seed, np.arange(rows), LATIN_ORDER, column)[0], kind="stable")
        out[order, column] = (np.arange(rows) + uniforms(seed, np.arange(rows), LATIN_PLACE, column)[0]) / rows
    return out


def sobol_sequence(rows: int, columns: int, seed: int) -> Array:
    """The first points of Sobol's sequence, scrambled; ``rows`` must be a power of two, or they are not balanced."""
    if rows & (rows - 1):
        below = 1 << (rows.bit_length() - 1)
        raise UserError(
            f"--samples is {rows}, but Sobol's sequence is balanced only for powers of two: give {below} or {2 * below}"
        )
    try:
        from scipy.stats import qmc
    except ImportError:
        raise UserError(
            "--design sobol needs SciPy, which is not installed: python -m pip install 'deadwood-toolbox[sobol]', or "
            "use --design latin, which does not need it"
        ) from None
    return qmc.Sobol(columns, scramble=True, rng=np.random.default_rng(seed)).random(rows)


def cube(design: str, rows: int, factors: int, seed: int) -> tuple[Array, Array]:
    """The samples A and B of a design, each of shape (rows, factors)."""
    points = (sobol_sequence if design == "sobol" else latin_hypercube)(rows, 2 * factors, seed)
    return points[:, :factors], points[:, factors:]


def places_at_ends(factors: list[Factor]) -> list[Place]:
    """The unchanged scene, then each factor at the low and at the high end of its range, the others unchanged."""
    places = [Place("as it is", {})]
    for each in factors:
        places += [Place(f"{each.name} low", {each.name: each.low}), Place(f"{each.name} high", {each.name: each.high})]
    return places


def rows_of_design(factors: list[Factor], a: Array, b: Array) -> list[Place]:
    """The runs of Saltelli's design: those of A, those of B, and for each factor those of A with its column of B."""
    n = len(a)

    def placed(block: str, points: Array, surfaces: NDArray[np.int64]) -> list[Place]:
        found = []
        for row in range(n):
            values = {each.name: each.at(float(u)) for each, u in zip(factors, points[row], strict=True)}
            found.append(Place(f"{block} {row + 1}", values, int(surfaces[row])))
        return found

    of_a, of_b = 1 + np.arange(n), 1 + n + np.arange(n)
    places = placed("A", a, of_a) + placed("B", b, of_b)
    for k, each in enumerate(factors):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        places += placed(f"A, {each.name} of B", mixed, of_b if each.name == "dem_noise_m" else of_a)
    return places


def places_of_design(factors: list[Factor], design: str, samples: int, seed: int) -> list[Place]:
    """The runs of a design: the ends of each range, and unless these are all (``ends``) the rows of the cube."""
    places = places_at_ends(factors)
    if design != "ends":
        places += rows_of_design(factors, *cube(design, samples, len(factors), seed))
    return places
