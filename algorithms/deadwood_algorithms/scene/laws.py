"""Optional laws of a scene: trees that break, friction that grows with slip, soft ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from deadwood_algorithms.params.tool import UserError

if TYPE_CHECKING:  # the tools' declarations import this file, and help must be fast
    import numpy as np
    from numpy.typing import NDArray

    from deadwood_engine import Trees

    Array = NDArray[np.float64]

DBH_CM = 40.0  # of the stem whose capacity is given


def capacity_of(at_40_cm: float | None, power: float, dbh_cm: Array) -> Array:
    """Energy [J] that stems absorb before they break, from that of a stem of 40 cm DBH [kJ]; infinite if that is
    None.
    """
    import numpy as np

    if at_40_cm is None:
        return np.full(dbh_cm.shape, np.inf)
    return 1000.0 * at_40_cm * (dbh_cm / DBH_CM) ** power


@dataclass(frozen=True)
class Breaking:
    """Trees that break: energy that one of 40 cm DBH absorbs in a hit [kJ], and the power of DBH by which it grows."""

    capacity_kj: float
    power: float

    @classmethod
    def from_options(cls, breaks: bool, capacity_kj: float | None, power: float) -> Breaking | None:
        if not breaks:
            return None
        if capacity_kj is None:
            raise UserError("--break-trees needs --tree-capacity-kj: the energy that a tree of 40 cm DBH absorbs")
        return cls(capacity_kj, power)

    def of(self, trees: Trees) -> Trees:
        """The trees with the energy that each absorbs before it breaks."""
        return trees._replace(capacity=capacity_of(self.capacity_kj, self.power, 100.0 * trees.diameter))


def slip_laws(shape: str, most: float | None, kappa_per_m: float | None, beta_per_s: float | None) -> dict[str, float]:
    """The law of slip-dependent friction as the engine's ``slide`` takes it; empty if it is not requested."""
    given = {"--friction-max": most, "--friction-kappa": kappa_per_m, "--friction-beta": beta_per_s}
    law = "friction that grows with slip has these three"
    found = _of_points(shape, given, "logs have one friction coefficient", law)
    return dict(zip(("friction_max", "friction_kappa", "friction_beta"), found, strict=True)) if found else {}


def scar_laws(shape: str, strength_mn_m2: float | None, drag: float | None) -> dict[str, float]:
    """The law of ground that a body scars, likewise."""
    given = {"--soil-strength-mn-m2": strength_mn_m2, "--scar-drag": drag}
    found = _of_points(shape, given, "to logs the ground is hard", "soft ground has these two")
    return dict(zip(("soil_strength", "scar_drag"), found, strict=True)) if found else {}


def _of_points(shape: str, given: dict[str, float | None], logs: str, law: str) -> list[float]:
    """The numbers of a law that only bodies of points have, all of them or none; ``logs``, ``law`` : words for the
    error.
    """
    named = {name: value for name, value in given.items() if value is not None}
    if not named:
        return []
    first = next(iter(named))
    if shape.strip().lower() == "cone":
        raise UserError(f"{first} applies to point clouds only: give --shape; {logs}")
    if len(named) < len(given):
        missing = next(name for name in given if name not in named)
        raise UserError(f"{first} needs {missing}, too: {law} numbers")
    return list(named.values())


def refuse_idle_capacity(breaks: bool, capacity_kj: float | None) -> None:
    """For tools that count no hits: reject a capacity that would have no effect."""
    if capacity_kj is not None and not breaks:
        raise UserError("--tree-capacity-kj alone changes nothing here: add --break-trees, or leave it out")


def refuse_idle_slip(most: float | None, friction: float | Array) -> None:
    """Reject a maximum friction that is nowhere above the minimum and would have no effect."""
    import numpy as np

    least = float(np.nanmin(friction))
    if most is not None and most <= least:
        raise UserError(
            f"--friction-max is {most:g}, but must be above --friction, {least:g}, from which friction grows with slip"
        )
