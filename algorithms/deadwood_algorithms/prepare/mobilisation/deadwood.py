"""Mapped deadwood rated by its decay and by the ground on which it stands or lies.

For `assess_mobilisation`.
"""

from __future__ import annotations

from dataclasses import dataclass

import geopandas
import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import OFF_DEM, account, count_of
from deadwood_algorithms.files.columns import field_names, number_column, where_of
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted, none_of
from deadwood_algorithms.params.presets import SPRUCE
from deadwood_algorithms.params.species import species_of
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.mobilisation import decay

FIELDS = {
    "stage_field": "decay_stage",
    "years_field": "years_dead",
    "species_field": "species",
    "standing_field": "standing",
}


@dataclass
class Deadwood:
    """The mapped points, the DEM cell of each (-1: off the DEM), their decay, and the rating of the ground."""

    frame: geopandas.GeoDataFrame
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    decay: NDArray[np.str_]
    ground: dict[str, NDArray[np.float64]]

    def look(self, rows: slice, columns: slice, **values: NDArray[np.floating]) -> None:
        """Store the values of a window's cells for the points in it."""
        here = (self.row >= rows.start) & (self.row < rows.stop)
        here &= (self.column >= columns.start) & (self.column < columns.stop)
        for name, cells in values.items():
            self.ground[name][here] = cells[self.row[here] - rows.start, self.column[here] - columns.start]

    def split(self, threshold: float) -> dict[str, geopandas.GeoDataFrame]:
        """Two layers: ``candidates``, which could start to slide, and ``others``, with the reason why they could
        not.
        """
        frame = self.frame.copy()
        on = np.isfinite(self.ground["susceptibility"])
        sound = self.decay != decay.OUTSIDE
        steep = np.nan_to_num(self.ground["susceptibility"]) >= threshold
        frame["decay"] = self.decay.astype(object)
        for name, values in self.ground.items():
            frame[name] = values
        reason = np.where(~on, "off_dem", np.where(sound, "ground", np.where(steep, "decay", "decay and ground")))
        could = on & sound & steep
        account("deadwood", count_of(len(frame), on.sum(), {OFF_DEM: (~on).sum()}))
        candidates, others = (geopandas.GeoDataFrame(frame[which].reset_index(drop=True)) for which in (could, ~could))
        others["reason"] = reason[~could].astype(object)
        return {"candidates": candidates, "others": others}


@dataclass(frozen=True, kw_only=True)
class DecayFields:
    """The fields with the decay of mapped deadwood, and the years since death in which spruce is smooth and strong."""

    stage_field: str | None
    years_field: str | None
    species_field: str | None
    standing_field: str | None
    years_from: float
    years_to: float


def read_deadwood(
    path: str | None, crs: str | None, fields: DecayFields, dem: DemWindows, feedback: Feedback
) -> Deadwood | None:
    """The mapped points with their decay; None if no layer is given."""
    if path is None:
        return None
    frame = read_vector(path, geometry=("point",), target_crs=dem.crs, crs=crs, what="deadwood", feedback=feedback)
    column = np.floor((frame.geometry.x.to_numpy() - dem.bounds[0]) / dem.cell).astype(np.int64)
    row = np.floor((frame.geometry.y.to_numpy() - dem.bounds[1]) / dem.cell).astype(np.int64)
    off = (row < 0) | (row >= dem.shape[0]) | (column < 0) | (column >= dem.shape[1])
    if off.all():
        raise UserError(f"{where_of(frame)}: {none_of(len(frame), 'point')} lies on the DEM; check the CRS of both")
    row[off] = -1
    names = ("susceptibility", "slope_deg", "roughness_m", "gully")
    ground = {name: np.full(len(frame), np.nan) for name in names}
    return Deadwood(frame, row, column, _decay_of(frame, fields, feedback), ground)


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
