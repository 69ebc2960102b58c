"""DBH and height of a tree from each other: power laws, the law with the crown, and a law fitted to measured trees.

Arrays only, NaN is missing. For `import_trees` (through `dbh_filling`).

Sources: DBH[cm] = a H[m]^b, FINT-CH and FINT (HAFL-WWI/pyFINT: ``FINT_CH_Process``, and the default of
``pyfintcontroller.py``, which was ``H^1.25`` until commit 342becb of 25 March 2021 and has been FINT-CH's since). The
rows of Chablais 3 (French Alps, 1350 m; the inventory in lidaRtRee) and of Oregon (the WEF inventory in spBayes) are
log-log fits made for this project, corrected by exp(s^2 / 2).
DBH[cm] = a (H CD)^b exp(g^2 / 2) with the crown's diameter CD [m]: Jucker et al. 2017, Global Change Biology 23:177, as
coded in itcSegment; its rows for biomes have g = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

FEWEST_TO_FIT = 3  # two trees determine a power law and leave no residual to judge it by
FEW_TO_FIT = 20  # below this number the exponent is a guess; warned of, not rejected


class Law(Protocol):
    """Gives DBH [cm] from height [m] (and crown diameter [m]), and height from DBH; NaN where that is impossible."""

    def dbh(self, height: np.ndarray, crown: np.ndarray) -> np.ndarray: ...

    def height(self, dbh: np.ndarray, crown: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class PowerLaw:
    """DBH[cm] = a H[m]^b, and its inverse; a and b are numbers, or arrays with one for each tree."""

    a: float | np.ndarray
    b: float | np.ndarray

    def dbh(self, height: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return self.a * height**self.b

    def height(self, dbh: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return (dbh / self.a) ** (1 / self.b)

    def __str__(self) -> str:
        return f"DBH[cm] = {self.a:.4g} * H[m]^{self.b:.4g}"


@dataclass(frozen=True)
class CrownLaw:
    """DBH[cm] = a (H CD)^b exp(g^2 / 2), and its inverse in H (Jucker et al. 2017)."""

    a: float
    b: float
    g: float = 0.0

    @property
    def factor(self) -> float:
        return self.a * float(np.exp(self.g**2 / 2))

    def dbh(self, height: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return self.factor * (height * _positive(crown)) ** self.b

    def height(self, dbh: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return (dbh / self.factor) ** (1 / self.b) / _positive(crown)

    def __str__(self) -> str:
        return f"DBH[cm] = {self.factor:.4g} * (H[m] * crown diameter[m])^{self.b:.4g}"


@dataclass(frozen=True)
class FittedLaw:
    """Two power laws of one sample, DBH from height and height from DBH: one is not the inverse of the other."""

    dbh_law: PowerLaw
    a_height: float
    b_height: float
    count: int
    spread: float  # s, the residual standard deviation of ln DBH
    r2: float  # of ln DBH on ln H
    heights: tuple[float, float]  # the range that the sample covers [m]

    def dbh(self, height: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return self.dbh_law.dbh(height, crown)

    def height(self, dbh: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return self.a_height * dbh**self.b_height

    def __str__(self) -> str:
        return f"{self.dbh_law} (fitted to {self.count} trees, s {self.spread:.2g}, r2 {self.r2:.2g})"


@dataclass(frozen=True)
class LawsByTree:
    """A law for each of several zones; ``zone`` is the zone of each tree."""

    laws: tuple[Law, ...]
    zone: np.ndarray

    def dbh(self, height: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return self._by_tree([law.dbh(height, crown) for law in self.laws])

    def height(self, dbh: np.ndarray, crown: np.ndarray) -> np.ndarray:
        return self._by_tree([law.height(dbh, crown) for law in self.laws])

    def _by_tree(self, sizes: list[np.ndarray]) -> np.ndarray:
        return np.stack(sizes)[self.zone, np.arange(self.zone.size)]


NAMED_LAWS: dict[str, PowerLaw | CrownLaw] = {
    "fint-ch": PowerLaw(2.52, 0.84),
    "fint": PowerLaw(1.0, 1.25),
    "chablais-spruce": PowerLaw(1.357, 1.071),
    "chablais-fir": PowerLaw(0.786, 1.256),
    "chablais-beech": PowerLaw(3.823, 0.551),
    "chablais-all": PowerLaw(1.527, 0.987),
    "oregon-silver-fir": PowerLaw(0.868, 1.111),
    "oregon-western-hemlock": PowerLaw(1.729, 0.972),
    "oregon-douglas-fir": PowerLaw(0.820, 1.244),
    "jucker-global": CrownLaw(0.557, 0.809, 0.056),
    "jucker-conifer-forest-gymnosperm": CrownLaw(0.974, 0.748),
    "jucker-conifer-forest-angiosperm": CrownLaw(0.273, 0.927),
    "jucker-mixed-forest-gymnosperm": CrownLaw(1.004, 0.730),
    "jucker-mixed-forest-angiosperm": CrownLaw(0.694, 0.730),
    "jucker-boreal-gymnosperm": CrownLaw(1.43, 0.649),
    "jucker-boreal-angiosperm": CrownLaw(0.467, 0.839),
}
POWER_LAWS = {name: law for name, law in NAMED_LAWS.items() if isinstance(law, PowerLaw)}
ABOUT = {
    "fint-ch": "FINT-CH, for all of Switzerland; the default",
    "fint": "pyFINT's default until March 2021; since then it is that of fint-ch (50 cm instead of 85 for 35 m)",
    "chablais-spruce": "made for this project, a fit to the inventory Chablais 3: spruce, 29 trees, rmse 6.4 cm",
    "chablais-fir": "the same, fir, 21 trees, 4.3 cm",
    "chablais-beech": "the same, beech, 47 trees, 3.8 cm",
    "chablais-all": "the same, all species, 110 trees, 6.5 cm",
    "oregon-silver-fir": "made for this project, a fit to the inventory WEF (Oregon): SF, 1.7 cm, heights modelled",
    "oregon-western-hemlock": "the same, WH, 7.0 cm",
    "oregon-douglas-fir": "the same, DF, 18.5 cm",
    "jucker-global": "Jucker et al. 2017, with the crown: global",
    "jucker-conifer-forest-gymnosperm": "Palearctic temperate coniferous forests",
    "jucker-conifer-forest-angiosperm": "the same",
    "jucker-mixed-forest-gymnosperm": "Palearctic temperate mixed forests",
    "jucker-mixed-forest-angiosperm": "the same",
    "jucker-boreal-gymnosperm": "Palearctic boreal forests",
    "jucker-boreal-angiosperm": "the same",
}


_FINT = "HAFL-WWI/pyFINT"
_CHABLAIS = "a fit to the inventory Chablais 3 (French Alps, 1350 m; lidaRtRee), made for this project"
_OREGON = "a fit to the inventory WEF (Oregon; spBayes), made for this project"
_JUCKER = "Jucker et al. 2017, Global Change Biology 23:177, as coded in itcSegment"
MADE_HERE = "fint* and jucker* are published; chablais* and oregon* were made for this project, as fits to inventories."
SOURCES_OF_LAWS = {
    name: {"fint": _FINT, "chablais": _CHABLAIS, "oregon": _OREGON, "jucker": _JUCKER}[name.split("-")[0]]
    for name in NAMED_LAWS
}


@dataclass(frozen=True)
class Region:
    """Where the trees grew from which a law was derived: a box of longitude and latitude [degrees]."""

    name: str
    west: float
    south: float
    east: float
    north: float

    def holds(self, longitude: float, latitude: float) -> bool:
        return self.west <= longitude <= self.east and self.south <= latitude <= self.north


_TEMPERATE = Region("the temperate Palearctic", -25.0, 25.0, 180.0, 62.0)
REGIONS = {
    "fint": Region("Switzerland", 5.9, 45.8, 10.5, 47.9),
    "chablais": Region("the French Alps", 5.5, 43.5, 7.8, 46.5),
    "oregon": Region("Oregon", -124.7, 41.9, -116.4, 46.3),
    "jucker-conifer": _TEMPERATE,
    "jucker-mixed": _TEMPERATE,
    "jucker-boreal": Region("the boreal Palearctic", -25.0, 50.0, 180.0, 75.0),
}


def name_of_law(law: Law) -> str:
    """The name of a law; empty if it is the user's own."""
    return next((name for name, known in NAMED_LAWS.items() if known == law), "")


def with_name(law: Law) -> str:
    """A law as a formula, and its name if it has one."""
    name = name_of_law(law)
    return f"{law} ({name})" if name else str(law)


def outside_region(law: Law, longitude: float, latitude: float) -> str:
    """A note that a named law was derived elsewhere; empty if it was not, or if the law is the user's own."""
    name = name_of_law(law)
    region = next((each for start, each in REGIONS.items() if name.startswith(start)), None)
    if region is None or region.holds(longitude, latitude):
        return ""
    east, north = "E" if longitude >= 0.0 else "W", "N" if latitude >= 0.0 else "S"
    return (
        f"the law {name} was made of trees of {region.name}, and these stand at {abs(latitude):.1f}° {north} "
        f"{abs(longitude):.1f}° {east}; --dbh-sample fits a law to measured trees of the place"
    )


def fit(dbh: np.ndarray, height: np.ndarray) -> FittedLaw:
    """Least squares of the logarithms, in either direction, corrected by exp(s^2 / 2): otherwise the mean would be
    biased low.

    ``dbh`` [cm] and ``height`` [m] of at least ``FEWEST_TO_FIT`` trees that do not all have the same height.
    """
    x, y = np.log(height), np.log(dbh)
    slope, offset, spread = _line(x, y)
    back, start, rest = _line(y, x)
    total = float(((y - y.mean()) ** 2).sum())
    r2 = 1.0 - spread**2 * (x.size - 2) / total if total else 1.0
    law = PowerLaw(float(np.exp(offset + spread**2 / 2)), slope)
    reach = (float(height.min()), float(height.max()))
    return FittedLaw(law, float(np.exp(start + rest**2 / 2)), back, x.size, spread, r2, reach)


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Slope and offset of the least-squares line, and the residual standard deviation with n - 2 in the divisor."""
    slope = float(((x - x.mean()) * (y - y.mean())).sum() / ((x - x.mean()) ** 2).sum())
    offset = float(y.mean() - slope * x.mean())
    return slope, offset, float(np.sqrt(((y - offset - slope * x) ** 2).sum() / (x.size - 2)))


def _positive(crown: np.ndarray) -> np.ndarray:
    return np.where(crown > 0, crown, np.nan)


def laws_described() -> str:
    """The named laws as lines of a list, for the tool's description."""
    return "\n".join(f"- ``{name}``: {law}; {ABOUT[name]}" for name, law in NAMED_LAWS.items())
