"""Mapped deadwood: its decay as experts rate it and, beside it, what logs do that start on its ground.

For `assess_mobilisation`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import geopandas
import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import account_on_dem
from deadwood_algorithms.files.columns import field_names, number_column, where_of
from deadwood_algorithms.files.dem_blocks import DemBlocks
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted, none_of
from deadwood_algorithms.params.presets import SPRUCE
from deadwood_algorithms.params.species import species_of
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.prepare.mobilisation import decay
from deadwood_algorithms.prepare.mobilisation.cells import Cells
from deadwood_algorithms.prepare.mobilisation.options import DecayFields
from deadwood_algorithms.prepare.mobilisation.slides import STARTS

FIELDS = {
    "stage_field": "decay_stage",
    "years_field": "years_dead",
    "species_field": "species",
    "standing_field": "standing",
}


@dataclass(frozen=True)
class Deadwood:
    """The mapped points, the number of the cell of each (-1: off the DEM or on its nodata), and their decay."""

    frame: geopandas.GeoDataFrame
    cell: NDArray[np.int64]
    decay: NDArray[np.str_]

    def split(
        self, chosen: NDArray[np.bool_], ground: Mapping[str, NDArray[np.float64]]
    ) -> dict[str, geopandas.GeoDataFrame]:
        """Two layers by the ground alone: ``candidates`` on the chosen cells, and ``others``, with the reason. The
        rating of the decay stands beside.

        ground : columns, by cell number; a point on a cell without a log is as off the DEM
        """
        frame = self.frame.copy()
        frame["decay"] = self.decay.astype(object)
        for name, values in ground.items():
            frame[name] = np.where(self.cell >= 0, values[self.cell], np.nan)
        on = np.isfinite(frame[STARTS].to_numpy())
        could = (self.cell >= 0) & chosen[self.cell]
        account_on_dem("deadwood", on)
        candidates, others = (geopandas.GeoDataFrame(frame[which].reset_index(drop=True)) for which in (could, ~could))
        others["reason"] = np.where(on, "ground", "off_dem")[~could].astype(object)
        return {"candidates": candidates, "others": others}


def read_deadwood(
    path: str | None, crs: str | None, fields: DecayFields, cells: Cells, feedback: Feedback
) -> Deadwood | None:
    """The mapped points with their decay; None if no layer is given."""
    if path is None:
        return None
    target = cells.dem.crs
    frame = read_vector(path, geometry=("point",), target_crs=target, crs=crs, what="deadwood", feedback=feedback)
    x, y = frame.geometry.x.to_numpy(), frame.geometry.y.to_numpy()
    cell = np.where(DemBlocks(cells.dem, Quiet()).contains(x, y), cells.of_places(x, y), -1)
    if (cell < 0).all():
        raise UserError(f"{where_of(frame)}: {none_of(len(frame), 'point')} lies on the DEM; check the CRS of both")
    return Deadwood(frame, cell, _decay_of(frame, fields, feedback))


def _decay_of(frame: geopandas.GeoDataFrame, named: DecayFields, feedback: Feedback) -> NDArray[np.str_]:
    """From the stage if it is mapped, otherwise from the years since death; unknown without either."""
    where = where_of(frame)
    fields = {}
    for option, usual in FIELDS.items():
        given = getattr(named, option)
        if given is not None and given not in frame:
            flag = "--" + option.replace("_", "-")
            raise UserError(f"{where}: there is no field '{given}' ({flag}); it has {field_names(frame)}")
        fields[option] = given or (usual if usual in frame else None)
    found = np.full(len(frame), decay.UNKNOWN, dtype="<U8")
    species = _words(frame, fields["species_field"])
    if name := fields["years_field"]:
        years = number_column(frame, name, minimum=0.0, gaps=True)
        window = (named.years_from, named.years_to)
        standing = _standing(frame, fields["standing_field"])
        dated = np.flatnonzero(np.isfinite(years))
        for row in dated:
            found[row] = decay.of_years(float(years[row]), species[row], window, standing=bool(standing[row] == 1.0))
        _say_what_is_known([species[row] for row in dated], standing[dated], where, feedback)
    if name := fields["stage_field"]:
        for row, word in enumerate(_words(frame, name)):
            if not word.strip():
                continue
            stage = decay.of_stage(word)
            if stage is None:
                raise UserError(
                    f"{where}, field '{name}', row {row + 1}: '{word}' is not a stage of decay; "
                    "write I to V or 1 to 5, with early or late before it where that is known"
                )
            found[row] = stage
    unknown = int((found == decay.UNKNOWN).sum())
    if unknown:
        feedback.note(
            f"{where}: the decay of {unknown} of {counted(len(frame), 'point')} is unknown and counts as suitable",
            code="decay-unknown",
        )
    return found


def _standing(frame: geopandas.GeoDataFrame, name: str | None) -> NDArray[np.float64]:
    """1 for a standing tree, 0 for a lying one, NaN if unknown."""
    if name is None:
        return np.full(len(frame), np.nan)
    return number_column(frame, name, minimum=0.0, maximum=1.0, gaps=True)


def _say_what_is_known(species: list[str], standing: NDArray[np.float64], where: str, feedback: Feedback) -> None:
    """Report species without a known rate of decay, unknown names, and that the rates are those of downed wood."""
    named = {each.strip() for each in species if each.strip()}
    strange = {each for each in named if species_of(each) is None}
    unrated = {each for each in named - strange if decay.rate_of(each) is None}
    if strange:
        feedback.note(
            f"{where}: {', '.join(sorted(strange))}: unknown species; the years of spruce are used",
            code="species-unknown",
        )
    if unrated:
        feedback.note(
            f"{where}: no rate of decay is known for {', '.join(sorted(unrated))}; that of spruce is used",
            code="species-unknown",
        )
    others = [decay.rate_of(each) not in (None, SPRUCE.rate) for each in species]
    snags = int((np.array(others, bool) & (standing == 1.0)).sum())
    unsaid = int((np.array(others, bool) & ~np.isfinite(standing)).sum())
    if snags:
        feedback.note(
            f"{where}: {counted(snags, 'snag is', 'snags are')} not of spruce; rates of decay are of downed wood, so "
            "the years of these are not used",
            code="decay-unknown",
            points=snags,
        )
    if unsaid:
        feedback.note(
            f"{where}: {counted(unsaid, 'point not of spruce is', 'points not of spruce are')} rated by rates of "
            "decay of downed wood; a field 'standing' (1 or 0) keeps snags apart, of which none is known",
            code="decay-unknown",
            points=unsaid,
        )


def _words(frame: geopandas.GeoDataFrame, name: str | None) -> list[str]:
    """A column as text, whole numbers without a point; empty for an empty cell or a missing column."""
    if name is None:
        return [""] * len(frame)
    values = frame[name]
    words = [
        str(int(each)) if isinstance(each, float) and each == int(each) else str(each) for each in values.fillna("")
    ]
    return [word.strip() for word in words]
