"""Laws that a scene has only where they are asked for: trees that break, and friction that grows with slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from deadwood_algorithms.params.tool import UserError

if TYPE_CHECKING:  # the tools' declarations bring this file along, and help is to answer at once
    import numpy as np
    from numpy.typing import NDArray

    from deadwood_engine import Trees

    Array = NDArray[np.float64]

DBH_CM = 40.0  # of the stem whose capacity is given


def capacity_of(at_40_cm: float | None, power: float, dbh_cm: Array) -> Array:
    """Energy [J] that stems take before they break, of that [kJ] of one of 40 cm DBH; infinite where that is None."""
    import numpy as np

    if at_40_cm is None:
        return np.full(dbh_cm.shape, np.inf)
    return 1000.0 * at_40_cm * (dbh_cm / DBH_CM) ** power


@dataclass(frozen=True)
class Breaking:
    """Trees that break: energy that one of 40 cm DBH takes in a hit [kJ], and the power of DBH with which it grows."""

    capacity_kj: float
    power: float

    @classmethod
    def asked(cls, breaks: bool, capacity_kj: float | None, power: float) -> Breaking | None:
        if not breaks:
            return None
        if capacity_kj is None:
            raise UserError("--break-trees needs --tree-capacity-kj: the energy that a tree of 40 cm DBH takes")
        return cls(capacity_kj, power)

    def of(self, trees: Trees) -> Trees:
        """The trees with what each takes."""
        return trees._replace(capacity=capacity_of(self.capacity_kj, self.power, 100.0 * trees.diameter))


def slip_laws(shape: str, most: float | None, kappa_per_m: float | None, beta_per_s: float | None) -> dict[str, float]:
    """The law of slip-dependent friction as the engine's ``slide`` takes it; empty where it is not asked for."""
    given = {"--friction-max": most, "--friction-kappa": kappa_per_m, "--friction-beta": beta_per_s}
    names = [name for name, value in given.items() if value is not None]
    if not names:
        return {}
    if shape.strip().lower() == "cone":
        raise UserError(f"{names[0]} is of bodies of points: give their --shape; logs have one friction coefficient")
    if most is None or kappa_per_m is None or beta_per_s is None:
        missing = next(name for name, value in given.items() if value is None)
        raise UserError(f"{names[0]} needs {missing}, too: friction that grows with slip has these three numbers")
    return {"friction_max": most, "friction_kappa": kappa_per_m, "friction_beta": beta_per_s}


def refuse_idle_capacity(breaks: bool, capacity_kj: float | None) -> None:
    """Of tools that count no hits: a capacity alone would do nothing."""
    if capacity_kj is not None and not breaks:
        raise UserError("--tree-capacity-kj alone changes nothing here: add --break-trees, or leave it out")


def refuse_idle_slip(most: float | None, friction: float | Array) -> None:
    """A greatest friction that is nowhere above the least would do nothing."""
    import numpy as np

    least = float(np.nanmin(friction))
    if most is not None and most <= least:
        raise UserError(
            f"--friction-max is {most:g}, but must be above --friction, {least:g}, from which friction grows with slip"
        )
