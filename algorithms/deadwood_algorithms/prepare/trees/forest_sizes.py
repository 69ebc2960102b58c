"""Density and sizes of the trees in each stand of a random forest, drawn, or dealt from given trees, tree by tree.

For `generate_forest`; where the trees stand is `planting`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from deadwood_algorithms import schemas
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import schema_column, warn_implausible, where_of
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.drawn_sizes import draw_pair
from deadwood_algorithms.prepare.trees.allometry import PowerLaw
from deadwood_algorithms.prepare.trees.planting import Ground
from deadwood_algorithms.prepare.trees.stands import Stand
from deadwood_algorithms.stats import draws

LEAST_DBH_CM = 1.0
LEAST_HEIGHT_M = 1.3  # there is no breast height below it
STANDS_SHOWN = 10


@dataclass(frozen=True)
class Sizes:
    """Normal distributions of DBH [cm] and height [m], and their correlation."""

    dbh_mean: float
    dbh_sd: float
    height_mean: float
    height_sd: float
    correlation: float


@dataclass(frozen=True)
class Source:
    """The trees of a layer that serve as a model: density [1/ha], DBH [cm] and height [m], shape (n,)."""

    stems_per_ha: float
    dbh: np.ndarray
    height: np.ndarray

    @property
    def numbers(self) -> dict[str, float]:
        """The parameters of normal distributions from it, by the names of the options."""
        alike = self.dbh.std() == 0 or self.height.std() == 0
        return {
            "stems_per_ha": self.stems_per_ha,
            "dbh_mean_cm": float(self.dbh.mean()),
            "dbh_sd_cm": float(self.dbh.std(ddof=1)),
            "height_mean_m": float(self.height.mean()),
            "height_sd_m": float(self.height.std(ddof=1)),
            "correlation": 0.0 if alike else float(np.corrcoef(self.dbh, self.height)[0, 1]),
        }


@dataclass(frozen=True)
class Kind:
    """Density [1/ha] and sizes of the trees of a stand; those of a source's trees, if there is one."""

    stems_per_ha: float
    sizes: Sizes
    source: Source | None = None

    @property
    def basal_area(self) -> float:
        """Basal area [m2/ha], from the requested sizes or from the source."""
        square = np.mean(self.source.dbh**2) if self.source else self.sizes.dbh_mean**2 + self.sizes.dbh_sd**2
        return basal_area(self.stems_per_ha * float(square))


def basal_area(squares: float) -> float:
    """Basal area [m2] of stems, from the sum of their squared DBH [cm]."""
    return np.pi / 4.0 * squares / 1e4


def read_source(path: str, grounds: list[Ground], crs: str | None, feedback: Feedback) -> Source:
    """The trees of a layer on these grounds, without those that are too small."""
    from deadwood_algorithms.files.vectors import read_vector

    frame = read_vector(
        path, geometry=("point",), target_crs=grounds[0].patches.dem.crs, crs=crs, what="trees", feedback=feedback
    )
    points = np.asarray(frame.geometry.array)
    x, y = shapely.get_x(points), shapely.get_y(points)
    here = np.any([ground.holds(x, y) for ground in grounds], axis=0)
    dbh = schema_column(frame, schemas.TREES.column("dbh_cm"))
    height = schema_column(frame, schemas.TREES.column("height_m"))
    small = here & ((dbh < LEAST_DBH_CM) | (height < LEAST_HEIGHT_M))
    if small.any():
        feedback.note(
            f"{where_of(frame)}: {small.sum()} of the {counted(here.sum(), 'tree')} there left out (DBH < "
            f"{LEAST_DBH_CM:g} cm or height < {LEAST_HEIGHT_M:g} m)",
            code="rows-left-out",
            rows=int(small.sum()),
        )
    away = int((~here).sum())
    here &= ~small
    account("like", count_of(len(frame), here.sum(), {"outside": away, "too_small": small.sum()}))
    if here.sum() < 2:
        number = int(here.sum() + small.sum())
        few = counted(number, "of its trees is", "of its trees are") + " standing on the DEM"
        if small.any():
            few += (
                f", of which {small.sum()} have a DBH below {LEAST_DBH_CM:g} cm or a height below {LEAST_HEIGHT_M:g} m"
            )
        raise UserError(f"{where_of(frame)}: {few}; a fit needs 2 (are DBH in cm and heights in m?)")
    dbh, height = dbh[here], height[here]
    warn_implausible(dbh, schemas.TREES.column("dbh_cm"), where_of(frame), feedback)
    warn_implausible(height, schemas.TREES.column("height_m"), where_of(frame), feedback)
    return Source(float(here.sum() / sum(ground.area for ground in grounds) * 1e4), dbh, height)


def kind_of_stand(
    given: Mapping[str, float], usual: Mapping[str, float], law: PowerLaw, source: Source | None, stand: Stand
) -> Kind:
    """The numbers of a stand: its own, otherwise given, otherwise usual, otherwise (height only) from the DBH by the
    law.

    If all of its sizes are those of a source, its trees are drawn from that.
    """
    given = {**given, **stand.numbers}
    numbers = {**usual, **given}
    for name in ("stems_per_ha", "dbh_mean_cm", "dbh_sd_cm"):
        if name not in numbers:
            raise UserError(
                f"--{name.replace('_', '-')} is missing; give it, or a trees layer with --like, or a --preset"
            )
    by_law = float((numbers["dbh_mean_cm"] / float(law.a)) ** (1 / float(law.b)))
    height_mean = numbers.get("height_mean_m", by_law)
    derived = {"height_sd_m": 0.5 * height_mean * numbers["dbh_sd_cm"] / numbers["dbh_mean_cm"], "correlation": 0.8}
    numbers = derived | numbers
    sizes = Sizes(
        numbers["dbh_mean_cm"], numbers["dbh_sd_cm"], height_mean, numbers["height_sd_m"], numbers["correlation"]
    )
    return Kind(float(numbers["stems_per_ha"]), sizes, None if set(given) - {"stems_per_ha"} else source)


def take_sizes(source: Source, items: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, int]:
    """DBH [cm] and height [m] of each tree (`planting.numbers_of_trees`), to 0.01, from the trees of a source.

    They are dealt like cards: in a random order until all are used, then in another. So as many trees as the source has
    are exactly those of the source, and a tree keeps its sizes when there are more.
    """
    number = source.dbh.size
    times = -(-items.size // number)
    # the trees of a ground are numbered consecutively
    cards = items[:1] + np.arange(times * number if items.size else 0)
    drawn = draws.uniforms(seed, cards, draws.TREE_SOURCE)[0].reshape(-1, number)
    row = np.argsort(drawn, axis=1, kind="stable").ravel()[: items.size]
    return np.round(source.dbh[row], 2), np.round(source.height[row], 2), 0


def draw_sizes(sizes: Sizes, items: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, int]:
    """DBH [cm] and height [m] of each tree (`planting.numbers_of_trees`), to 0.01, and how many draws were impossible
    trees.
    """
    return draw_pair(
        (sizes.dbh_mean, sizes.height_mean),
        (sizes.dbh_sd, sizes.height_sd),
        sizes.correlation,
        (LEAST_DBH_CM, LEAST_HEIGHT_M),
        seed,
        items,
        draws.TREE_SIZE,
        f"DBH {sizes.dbh_mean:g} +- {sizes.dbh_sd:g} cm and height {sizes.height_mean:g} +- {sizes.height_sd:g} m "
        "hardly ever give a possible tree; check the numbers and their units",
    )


def size_lines(kind: Kind, dbh: np.ndarray, height: np.ndarray, planted: float) -> list[str]:
    sizes, whose = kind.sizes, "of the layer" if kind.source else "asked"
    alike = dbh.std() == 0 or height.std() == 0
    correlation = "" if alike else f" (planted {np.corrcoef(dbh, height)[0, 1]:.2f})"
    return [
        f"DBH {whose} {sizes.dbh_mean:.1f} +- {sizes.dbh_sd:.1f} cm, planted {dbh.mean():.1f} +- {dbh.std():.1f} cm",
        f"height {whose} {sizes.height_mean:.1f} +- {sizes.height_sd:.1f} m, "
        f"planted {height.mean():.1f} +- {height.std():.1f} m, correlation {sizes.correlation:.2f}{correlation}",
        f"basal area {whose} {significant(kind.basal_area, 3)} m2/ha, planted {significant(planted, 3)} m2/ha",
    ]


def stand_lines(stands: list[Stand], kinds: list[Kind], counts: list[int]) -> list[str]:
    """One line for each of the first stands, and the number of the others."""
    rows = [
        f"stand of {stand.name}: {counted(count, 'tree')} on {stand.ground.area / 1e4:.2f} ha "
        f"({significant(kind.stems_per_ha, 4)} stems/ha), "
        f"DBH {kind.sizes.dbh_mean:.1f} +- {kind.sizes.dbh_sd:.1f} cm, "
        f"height {kind.sizes.height_mean:.1f} +- {kind.sizes.height_sd:.1f} m"
        for stand, kind, count in zip(stands, kinds, counts, strict=True)
    ]
    more = [f"and {counted(len(rows) - STANDS_SHOWN, 'stand')} more"] if len(rows) > STANDS_SHOWN else []
    return rows[:STANDS_SHOWN] + more
