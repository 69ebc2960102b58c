"""Logs of release areas: their sizes by option, preset or law, and the lines of the outcome."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms import schemas
from deadwood_algorithms.files.columns import schema_column
from deadwood_algorithms.params import presets
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.releases.logs import Drawn

if TYPE_CHECKING:
    import pandas


class SizeLaw(Protocol):
    """A law between DBH [cm] and height [m] (`trees.allometry`)."""

    def dbh(self, height: Any, crown: Any) -> Any: ...
    def height(self, dbh: Any, crown: Any) -> Any: ...


def sizes_of(
    given: Mapping[str, float | None],
    taken: presets.Taken,
    areas: pandas.DataFrame,
    feedback: Feedback,
    *,
    law: SizeLaw | None,
    mapped: bool,
) -> dict[str, float]:
    """DBH, length and density if the areas name none: as given, from the preset, or one size from the other by its law.

    If an area names only one size, the other follows from it: ``areas`` gets a column of it.

    given : DBH [cm] and length [m] of the options
    law : that of the preset, if it has one
    mapped : the sizes are drawn from mapped deadwood
    """
    sizes: dict[str, float] = taken.values
    nowhere = np.array(np.nan)
    for name, other in (("length_m", "dbh_cm"), ("dbh_cm", "length_m")):
        own = given[name]
        if own is not None:
            sizes[name] = own
        elif law and name not in areas and (other in areas or given[other] is not None):
            derive = law.height if name == "length_m" else law.dbh
            known = schema_column(areas, schemas.RELEASES.column(other), given[other])
            derived = np.round(derive(known, nowhere), 2)
            areas[name] = derived
            low, high = derived.min(), derived.max()
            shown = f"{low:g}" + (f" to {high:g}" if high > low else "")
            feedback.note(f"{name} {shown} follows from {other} by {taken.preset.law}, {law}", code="size-from-law")
    missing = [name for name in ("dbh_cm", "length_m") if name not in sizes and name not in areas]
    if missing and not mapped:
        raise UserError(
            f"--preset {taken.preset.name} does not set {' and '.join(missing)}; give {presets.flag_of(missing[0])}"
            + (" or --length-m, from which the other follows" if law else "")
        )
    return dict.fromkeys(missing, 1.0) | sizes  # each row of the mapped deadwood has its own value of the missing ones


def lines_of_sample(
    counts: NDArray[np.int64], drawn: Drawn, weights: str | None, logs_per_ha: float | None
) -> tuple[str, ...]:
    """How many logs were drawn, where, and in which orientation.

    counts : by area, or by cell of the raster ``weights`` if there are no areas
    """
    each = f"{counts.min()}" if counts.min() == counts.max() else f"{counts.min()} to {counts.max()}"
    where = counted(counts.size, "release area") if weights is None else f"the cells of {weights} with a weight"
    first = f"{counted(counts.sum(), 'log')} in {where}" + (f", {each} each" if weights is None else "")
    first += f" ({logs_per_ha:g} a hectare)" if logs_per_ha else ""
    empty = int((counts == 0).sum())
    said = (
        [f"{counted(empty, 'area is', 'areas are')} too small for a log at {logs_per_ha:g} a hectare"] if empty else []
    )
    words, number = np.unique(drawn.columns["orientation"].astype(str), return_counts=True)
    posture = ", ".join(
        f"{count} {word}" if words.size > 1 else f"all {word}" for word, count in zip(words, number, strict=True)
    )
    return (first, *said, *drawn.said, f"posture at the start: {posture}")
