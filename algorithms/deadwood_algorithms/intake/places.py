"""What is doubted about the coordinates of points and lines: rounded by a spreadsheet, below or above the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.intake.doubts import Check, Doubt

# Coordinates that a spreadsheet shows as 2.70008E+06, or that were typed from a map, are multiples of 10 m or more. By
# chance all of ROUNDED_FROM would be so once in 10**ROUNDED_FROM tables.
ROUNDED_FROM = 6
STEPS_M, STEPS_DEG = (1000.0, 500.0, 200.0, 100.0, 50.0, 25.0, 20.0, 10.0), (0.01, 0.001, 0.0001)
ROUNDED_SHARE = 0.9  # of the points: a few may have been measured since
DEGREE_M = 111_000.0

# A road on the ground has a Z within some metres of a terrain model's; a tunnel or a bridge has not.
APART_M, APART_SHARE = 5.0, 0.05


def rounded(x: NDArray[np.float64], y: NDArray[np.float64], *, degrees: bool = False) -> Doubt | None:
    """Points whose easting or northing was rounded to 10 m or more."""
    if x.size < ROUNDED_FROM or len(np.unique(x)) < 2 or len(np.unique(y)) < 2:
        return None
    for step in STEPS_DEG if degrees else STEPS_M:
        within = 1e-6 * max(1.0, 1.0 / step)
        shares = [float(np.mean(np.abs(each / step - np.rint(each / step)) < within)) for each in (x, y)]
        at = [share >= ROUNDED_SHARE for share in shares]
        if any(at):
            few = min(share for share in shares if share >= ROUNDED_SHARE)
            many = "all" if few == 1.0 else f"{100.0 * few:.0f} % of the"
            metres = step * DEGREE_M if degrees else step
            which = "eastings and northings" if all(at) else "eastings" if at[0] else "northings"
            return Doubt(
                "rounded-places",
                f"{many} {which} are multiples of {f'{step:g} degrees' if degrees else f'{step:g} m'}, so that points "
                f"may stand {metres / np.sqrt(2.0):.0f} m from their true places; did a spreadsheet cut their digits "
                "(2.70008E+06)? Format the columns as numbers and export again",
                {"step_m": metres, "points": x.size},
            )
    return None


def off_the_ground(
    names: Sequence[str], item: NDArray[np.int64], above: NDArray[np.float64], weight: NDArray[np.float64]
) -> Doubt | None:
    """Lines whose own Z is far below or above the terrain: tunnels and bridges, which no log reaches on the ground.

    item : line of each part; above : its Z minus the ground's [m], NaN where unknown; weight : length of the part [m]
    """
    found = []
    for k, name in enumerate(names):
        these = (item == k) & np.isfinite(above)
        length, far = float(weight[these].sum()), these & (np.abs(above) > APART_M)
        if length and weight[far].sum() > APART_SHARE * length:
            at = np.flatnonzero(far)[np.argmax(np.abs(above[far]))]
            found.append((name, float(above[at]), float(weight[far].sum())))
    if not found:
        return None
    name, most, length = max(found, key=lambda each: abs(each[1]))
    side, what = ("below", "a tunnel") if most < 0.0 else ("above", "a bridge")
    more = f" ({len(found)} lines in all)" if len(found) > 1 else ""
    return Doubt(
        "off-the-ground",
        f"by its Z, '{name}' runs up to {abs(most):.3g} m {side} the terrain model, over {length:.3g} m{more}: {what}, "
        "or heights of another datum? The Z is not used: logs that pass there count as reaching it. Cut out what is "
        "not on the ground",
        {"metres": most, "length_m": length, "lines": len(found)},
    )


CHECKS = (
    Check("rounded-places", "coordinates rounded to 10 m or more", rounded),
    Check("off-the-ground", "a tunnel or a bridge, by the Z of its line", off_the_ground),
)
