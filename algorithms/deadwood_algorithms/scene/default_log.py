"""Defaults for logs whose layer lacks columns: one group of options of every tool that slides released logs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial

from deadwood_algorithms.params import tool
from deadwood_algorithms.schemas import DBH_CM, DENSITY_KG_M3, DROP_M, SPEED_MS, TREE_M

_GROUP = "Defaults for the logs"
_number = partial(tool.number, group=_GROUP, advanced=True)


@dataclass(frozen=True, kw_only=True)
class DefaultLog:
    """The columns of the releases layer, with the values to be used if they are missing."""

    dbh_cm: float = _number(
        "DBH, where the layer has none", unit="cm", default=75.0, minimum=0.0, maximum=DBH_CM[1], exclusive=True
    )
    length_m: float = _number(
        "Length, where the layer has none", unit="m", default=30.0, minimum=0.0, maximum=TREE_M[1], exclusive=True
    )
    density_kg_m3: float = _number(
        "Density, where the layer has none",
        unit="kg/m³",
        default=300.0,
        minimum=0.0,
        maximum=DENSITY_KG_M3,
        exclusive=True,
    )
    orientation: str = tool.choice(
        "Orientation, where the layer has none",
        "upright",
        "lying",
        "tilted",
        default="upright",
        group=_GROUP,
        advanced=True,
    )
    tilt_deg: float = _number("Tilt from the vertical, likewise", unit="°", default=0.0, minimum=0, maximum=180)
    azimuth_deg: float = _number("Azimuth of tip and speed, where the layer has none", unit="°", default=0.0)
    speed_ms: float = _number("Initial speed, likewise", unit="m/s", default=0.0, minimum=0.0, maximum=SPEED_MS)
    drop_m: float = _number(
        "Clearance at the start, where the layer has none", unit="m", default=0.0, minimum=0.0, maximum=DROP_M
    )


DEFAULTED = tuple(each.name for each in fields(DefaultLog))
