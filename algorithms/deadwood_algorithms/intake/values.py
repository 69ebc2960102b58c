"""What is doubted about the values of rasters beside the terrain: friction that is codes, a canopy without ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.intake.doubts import Check, Doubt

IMPLAUSIBLE = 2.0  # a coefficient of friction that no wood on soil, rock, snow or litter has
LARGE_SHARE = 0.001  # of the cells
NOWHERE_BELOW = 1.0  # the highest that a source of `params/presets` gives is 0.38

# Between crowns a canopy model shows the ground, or what its maker cuts off (up to 5 m). The lowest hundredth of one
# that does not stands this high, or FLOOR_M high and FLOOR_SHARE of the cells within FLOOR_WIDTH_M of it.
LOWEST_SHARE, GROUNDLESS_M = 0.01, 10.0
FLOOR_M, FLOOR_WIDTH_M, FLOOR_SHARE = 1.5, 0.5, 0.1
TALL_SHARE, TALL_M = 0.999, 65.0  # no forest of Europe is higher
FEWEST_CELLS = 400


def codes(friction: NDArray[np.float64]) -> Doubt | None:
    """Whole numbers in place of coefficients: classes of soil, or percent."""
    kinds = np.unique(friction[np.isfinite(friction)])
    if kinds.size < 2 or kinds[-1] < 1.0 or (kinds != np.rint(kinds)).any():
        return None
    shown = ", ".join(f"{each:g}" for each in kinds[:6]) + (", ..." if kinds.size > 6 else "")
    return Doubt(
        "friction-codes",
        f"its values are whole numbers ({shown}), like codes of classes, not coefficients such as 0.4; write the "
        "coefficient of each class in their place",
        {"kinds": kinds.size, "largest": float(kinds[-1])},
    )


def too_large(friction: NDArray[np.float64]) -> Doubt | None:
    """Coefficients that no wood has, also where most others are plausible."""
    known = friction[np.isfinite(friction)]
    share = float((known > IMPLAUSIBLE).mean()) if known.size else 0.0
    if share <= LARGE_SHARE or codes(friction) or float(np.median(known)) > IMPLAUSIBLE:  # reported by itself
        return None
    return Doubt(
        "friction-too-large",
        f"{100.0 * share:.2g} % of the cells have a coefficient above {IMPLAUSIBLE:g}, up to {known.max():g}, on which "
        "every log stops at once; is part of it in percent or degrees, or undeclared nodata?",
        {"share": share, "largest": float(known.max())},
    )


def groundless(heights: NDArray[np.float64]) -> Doubt | None:
    """A canopy that never comes down to the ground: surface and terrain have other zeros, or it is a surface."""
    known = heights[np.isfinite(heights)]
    if known.size < FEWEST_CELLS:
        return None
    low = float(np.quantile(known, LOWEST_SHARE))
    floor = abs(low) >= FLOOR_M and float((np.abs(known - low) < FLOOR_WIDTH_M).mean()) >= FLOOR_SHARE
    if abs(low) < GROUNDLESS_M and not floor:
        return None
    where = f"only 1 % of the cells are lower than {low:.3g} m"
    return Doubt(
        "canopy-without-ground",
        f"{where}, but between crowns a canopy comes down to 0 m: is it a surface model, or are surface and terrain "
        f"above different zeros (ellipsoid and sea level)? Then every tree is {abs(low):.2g} m too "
        f"{'high' if low > 0.0 else 'low'}",
        {"lowest_m": low},
    )


def too_tall(heights: NDArray[np.float64]) -> Doubt | None:
    """A canopy higher than any forest, but lower than ground above the sea: feet, decimetres, centimetres."""
    known = heights[np.isfinite(heights)]
    if known.size < FEWEST_CELLS or groundless(known):
        return None
    high = float(np.quantile(known, TALL_SHARE))
    if high <= TALL_M:
        return None
    return Doubt(
        "canopy-too-tall",
        f"its highest crowns stand {high:.0f} m above the ground; is it in feet, decimetres or centimetres?",
        {"highest_m": high},
    )


def frictionless(friction: NDArray[np.float64]) -> Doubt | None:
    """Cells without any friction beside others: an undeclared value for nodata, on which nothing ever stops."""
    known = friction[np.isfinite(friction)]
    share = float((known == 0.0).mean()) if known.size else 0.0
    if not LARGE_SHARE < share < 1.0 or codes(friction):
        return None
    return Doubt(
        "friction-zero",
        f"{100.0 * share:.2g} % of the cells have the coefficient 0, on which nothing stops; is it an undeclared value "
        "for nodata?",
        {"share": share},
    )


def nowhere_low(friction: NDArray[np.float64]) -> Doubt | None:
    """Coefficients of at least 1 everywhere: a mask, or weights of a calculation of costs."""
    known = friction[np.isfinite(friction)]
    if not known.size or known.min() < NOWHERE_BELOW or np.median(known) > IMPLAUSIBLE or codes(known):
        return None
    return Doubt(
        "friction-nowhere-low",
        f"no coefficient is below {known.min():g}, on which a log rests on every slope below "
        f"{np.degrees(np.arctan(known.min())):.0f} degrees; are these codes, a mask or weights? A log on soil has "
        "about 0.2 to 0.4",
        {"lowest": float(known.min())},
    )


FRICTION = (
    Check("friction-codes", "codes of classes in place of coefficients", codes),
    Check("friction-too-large", "coefficients above 2 on part of the ground", too_large),
    Check("friction-zero", "cells without friction beside others", frictionless),
    Check("friction-nowhere-low", "coefficients of 1 or more everywhere", nowhere_low),
)
CANOPY = (
    Check("canopy-without-ground", "a canopy that never comes down to the ground", groundless),
    Check("canopy-too-tall", "a canopy higher than any forest", too_tall),
)
