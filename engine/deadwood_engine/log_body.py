"""The log: a rigid truncated cone with exact mass and principal moments of inertia (paper, section 3).

symbol  in code       unit    meaning
R, r    base, tip     m       radii of the end faces (the paper: r = R/2, R = DBH/2)
L       length        m
zc      centre        m       centre of mass, from the base
A, C    transverse, axial  m2  principal moments of inertia, per unit of mass

All quantities are per unit of mass: mass cancels in hard contact with Coulomb friction, and in the engine to the bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Columns of the body table, one row per log
BASE_RADIUS, TIP_RADIUS, LENGTH, CENTRE, TRANSVERSE, AXIAL, MASS, SKEW, REACH = range(9)
BODY_WIDTH = 9


def cone_bodies(diameter: Array, length: Array, density: Array, *, taper: float = 0.5) -> Array:
    """Mass properties of truncated cones.

    Parameters
    ----------
    diameter, length : [m], shape (n,); base diameter (DBH) and length
    density : [kg/m3], shape (n,)
    taper : tip diameter over base diameter (paper, section 3: 0.5)

    Returns
    -------
    shape (n, 9): base radius [m], tip radius [m], length [m], centre of mass from the base [m],
    transverse and axial moment of inertia per mass [m2], mass [kg]; and two that are zero for a cone (``cloud``):
    1/A1 - 1/A2 of the transverse moments [1/m2], distance of the farthest point from the centre [m]

    Raises
    ------
    ValueError
        if a dimension or density is not positive and finite
    """
    diameter, length, density = (np.asarray(v, dtype=float) for v in (diameter, length, density))
    for name, values in (("diameter", diameter), ("length", length), ("density", density)):
        if not np.all(np.isfinite(values) & (values > 0)):
            raise ValueError(f"{name} of a log must be positive and finite")
    base = 0.5 * diameter
    tip = taper * base
    # Sums of powers instead of (R^n - r^n)/(R - r), which would be 0/0 for a cylinder.
    second = base**2 + base * tip + tip**2
    fourth = base**4 + base**3 * tip + base**2 * tip**2 + base * tip**3 + tip**4
    volume = np.pi * length * second / 3.0
    centre = 0.25 * length * (base**2 + 2.0 * base * tip + 3.0 * tip**2) / second
    axial = 0.3 * fourth / second
    about_base = 0.5 * axial + 3.0 * length**2 * (base**2 / 30 + base * tip / 10 + tip**2 / 5) / second
    bodies = np.zeros((len(diameter), BODY_WIDTH))
    bodies[:, BASE_RADIUS] = base
    bodies[:, TIP_RADIUS] = tip
    bodies[:, LENGTH] = length
    bodies[:, CENTRE] = centre
    bodies[:, TRANSVERSE] = about_base - centre**2
    bodies[:, AXIAL] = axial
    bodies[:, MASS] = density * volume
    return bodies
