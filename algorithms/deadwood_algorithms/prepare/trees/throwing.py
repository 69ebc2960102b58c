"""Which stems a storm throws, how they fall and lie, and what remains: the computations of `windthrow`, on arrays.

The draws of a tree depend on the seed and its id, so a tree falls in the same way whatever the others do, and a larger
share throws all trees of a smaller one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.presets import STRENGTH_OF
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats import draws

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks

Array = NDArray[np.float64]
TAPER = 0.5  # the top of a stem has half its DBH, as everywhere in the toolbox
LEAST_LOG_M = 0.5  # a stem with less than this above its stump does not fall
TURNS = 60  # steps of bisection for the plan length of a stem on a slope


def item_numbers(ids: Sequence[str]) -> NDArray[np.uint64]:
    """A number for each id, on which its draws depend."""
    return np.array([int.from_bytes(hashlib.blake2b(each.encode(), digest_size=8).digest()) for each in ids], np.uint64)


def chosen_share(
    items: NDArray[np.uint64], share: Array, group: NDArray[np.int64], seed: int, stream: int
) -> NDArray[np.bool_]:
    """Which items belong to a share of each group: the nearest whole number of them, those with the smallest draws."""
    order = draws.uniforms(seed, items, stream)[0]
    taken = np.zeros(items.size, bool)
    for each in np.unique(group):
        mine = np.flatnonzero(group == each)
        count = int(np.floor(share[mine[0]] * mine.size + 0.5))
        taken[mine[np.lexsort((items[mine], order[mine]))[:count]]] = True
    return taken


def fall_directions(items: NDArray[np.uint64], towards_deg: float, scatter_deg: float, seed: int) -> Array:
    """Azimuths towards which stems fall [deg]: normal about the wind's."""
    return (towards_deg + scatter_deg * draws.normals(seed, items, draws.STEM_FALL)[0]) % 360.0


@dataclass(frozen=True)
class Lying:
    """Lying stems: base and tip in plan [m], shape (n, 2) each; diameters [cm].

    azimuth_deg : direction in which they lie; cut : they end at the terrain's edge; off : cut so close to their stumps
        that no part lies on the terrain
    """

    base: Array
    tip: Array
    base_cm: Array
    tip_cm: Array
    azimuth_deg: Array
    cut: NDArray[np.bool_]
    off: NDArray[np.bool_]


def lying_stems(
    place: Array, dbh_cm: Array, height_m: Array, azimuth_deg: Array, stump_m: float, grid: Grid | DemBlocks
) -> Lying:
    """Stems above their stumps, fallen from the stump's edge; as long on the slope as they were when standing.

    A stem is the part of the tree's cone above the stump. Where it would reach beyond the terrain it ends there; one
    without any room there is off it. (An earlier version let such stems fall the other way, which is unphysical.)
    """
    length, edge = height_m - stump_m, 0.5 * dbh_cm / 100.0
    angle = np.radians(azimuth_deg)
    way = np.column_stack([np.sin(angle), np.cos(angle)])
    base = place + edge[:, None] * way
    outside = ~grid.contains(*base.T)
    base[outside] = place[outside]
    far, cut = plan_lengths(base, way, length, grid)
    at = np.clip(stump_m / height_m, 0.0, 1.0)
    base_cm = dbh_cm * (1.0 - (1.0 - TAPER) * at)
    return Lying(base, base + far[:, None] * way, base_cm, TAPER * dbh_cm, azimuth_deg, cut, far < LEAST_LOG_M)


def plan_lengths(base: Array, way: Array, length: Array, grid: Grid | DemBlocks) -> tuple[Array, NDArray[np.bool_]]:
    """How far in plan a straight stem of this length reaches when both its ends lie on the ground; and whether the
    terrain ends before."""
    ground = grid.height(*base.T)

    def beyond(far: Array) -> NDArray[np.bool_]:
        height = grid.height(*(base + far[:, None] * way).T)
        return ~(np.hypot(far, height - ground) <= length)  # NaN off the terrain counts as beyond

    low, high = np.zeros(length.size), length.copy()
    level = ~beyond(high)
    for _ in range(TURNS):
        middle = 0.5 * (low + high)
        out = beyond(middle)
        low, high = np.where(out, low, middle), np.where(out, middle, high)
    far = np.where(level, length, low)
    cut = ~np.isfinite(grid.height(*(base + 1.001 * far[:, None] * way + 1e-6 * way).T)) & ~level
    return far, cut


def class_shares(text: str, most_cm: float) -> tuple[Array, Array]:
    """``0:0.1,20:0.3``: minimum DBH [cm] of each class, ascending, and its share."""
    try:
        pairs = [tuple(float(each) for each in part.split(":")) for part in text.split(",") if part.strip()]
        bounds, shares = np.array(pairs, np.float64).reshape(-1, 2).T
    except ValueError:
        bounds, shares = np.zeros(0), np.zeros(0)
    rising = bool((np.diff(bounds) > 0.0).all())
    if not bounds.size or not rising or bounds[0] < 0.0 or bounds[-1] > most_cm or not _is_share(shares).all():
        raise UserError(
            f"--dbh-classes is '{text}', but must be the minimum DBH and share of each class, rising, separated by "
            "commas: 0:0.1,20:0.3,40:0.7"
        )
    return bounds, shares


def assumed_words(
    fall_deg: float, scatter_deg: float, stump_m: float, lost: tuple[int, int, str], thinner: float
) -> str:
    """What decides how the stems lie, and what is left of them years later; ``lost`` : how many, of how many, why."""
    stumps = f"stumps of {stump_m:g} m stay" if stump_m else "no stumps, the stems are uprooted"
    return (
        f"assumed: stems fall towards {fall_deg:g} degrees, with a standard deviation of {scatter_deg:g}; {stumps}; "
        f"later {lost[0]} of {lost[1]} lying logs have disappeared ({lost[2]}), and the others are "
        f"{100.0 * thinner:.3g} % thinner"
    )


def strength_words(at_40_cm: float | None, power: float, left: float, years: float | None) -> str:
    """What lying logs withstand, and on what that rests; ``years`` : None if the user gave what is left."""
    if at_40_cm is None:
        return "assumed: lying logs never break, however old; --tree-capacity-kj lets them"
    source = "--weaker"
    if years is not None:
        source = f"after {years:g} years; {STRENGTH_OF}; the course over the years and with the wood is assumed"
    return (
        f"assumed: a fresh lying log of 40 cm DBH absorbs {at_40_cm:g} kJ in a hit before it breaks, others (DBH / 40 "
        f"cm)^{power:g} times that; later {100.0 * left:.2g} % of it are left ({source}). That is the weakest that old "
        "wood may be, and later_rigid the strongest: the answer lies between them"
    )


def _is_share(values: Array) -> NDArray[np.bool_]:
    return (values >= 0.0) & (values <= 1.0)
