"""The sensitivity panel: each chosen number of a twin changed over its range, one at a time.

Fixed, with the twins, before anything slid on them. It shows which findings depend on a choice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from deadwood_algorithms.paper import klosters, rothenbrunnen


@dataclass(frozen=True)
class Changed:
    """A twin with one choice changed.

    changes : numbers of the twin, by name
    options : of `slide-logs`, by name
    rocks : whether the rocks slide, too, if the site has them: a fifth of the panel's time
    """

    name: str
    words: str
    version: int = 2
    changes: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    rocks: bool = False


def _rougher(times: float) -> dict[str, Any]:
    """The roughness multiplied by a factor, except its long waves."""
    k = klosters.K
    pairs = zip(k["wavelength_m"], k["deviation_m"], strict=True)
    return {"deviation_m": tuple(each * times if wave <= k["short_m"] else each for wave, each in pairs)}


_EVERYWHERE = (
    Changed("smoother", "roughness times 0.65 (0.18 m at 1 m instead of 0.24)", changes=_rougher(0.65), rocks=True),
    Changed("rougher", "roughness times 1.4 (0.31 m at 1 m; version 1 has 0.34)", changes=_rougher(1.4)),
    Changed("rolling_low", "rolling friction 0.05 instead of 0.1", options={"rolling_friction": 0.05}, rocks=True),
    Changed("rolling_high", "rolling friction 0.2 instead of 0.1", options={"rolling_friction": 0.2}),
    Changed("drawn_2", "relief and mapped forest drawn a second time", changes={"seed": 3001}),
    Changed("drawn_3", "relief and mapped forest drawn a third time", changes={"seed": 3002}),
    Changed("version_1", "the twin of version 1", version=1),
)
AS_IT_IS = "nothing, at the panel's settings"
_HALF_SPACING = 0.5 * (klosters.K["gully_u_m"][1] - klosters.K["gully_u_m"][0])
VARIATIONS: Mapping[str, tuple[Changed, ...]] = {
    klosters.NAME: (
        Changed("as_it_is", AS_IT_IS, rocks=True),
        Changed("strip_1.5", "no tree closer than 1.5 m to a bed, instead of 2 m", changes={"gully_free_m": 1.5}),
        Changed("strip_3", "no tree closer than 3 m to a bed", changes={"gully_free_m": 3.0}),
        Changed(
            "track",
            "debris or avalanche track: no tree closer than 9 m to a bed",
            changes={"gully_free_m": 9.0, "gully_edge_m": 9.0},
        ),
        Changed("gully_2", "gullies 2 m deep, instead of 4 m", changes={"gully_depth_m": 2.0}),
        Changed("gully_8", "gullies 8 m deep", changes={"gully_depth_m": 8.0}),
        Changed("in_beds", "all releases in beds", changes={"release_off_gully_m": (0.0,) * 4}),
        Changed(
            "off_beds",
            "all releases midway between beds",
            changes={"release_off_gully_m": (-_HALF_SPACING, -_HALF_SPACING, _HALF_SPACING, _HALF_SPACING)},
        ),
        Changed(
            "cliffs",
            "cliff bands of 6 and 10 m across the forest",
            changes={"cliff_v_m": (215.0, 290.0), "cliff_height_m": (6.0, 10.0)},
        ),
        *_EVERYWHERE,
    ),
    rothenbrunnen.NAME: (
        Changed("as_it_is", AS_IT_IS, rocks=True),
        Changed("west", "release 30 m to the west", changes={"release_u_m": 110.0}),
        Changed("east", "release 30 m to the east", changes={"release_u_m": 170.0}),
        Changed(
            "rocks_constant",
            "friction of the rocks 0.5 regardless of slip, not 0.2 increasing to 1.3",
            changes={"rock_friction": 0.5, "rock_slip": None},
            rocks=True,
        ),
        Changed(
            "rocks_medium",
            "friction of the rocks 0.35 increasing to 2 (kappa 2/m, beta 150/s), not 0.2 to 1.3 (0.7, 20)",
            changes={"rock_friction": 0.35, "rock_slip": (2.0, 2.0, 150.0)},
            rocks=True,
        ),
        *_EVERYWHERE,
    ),
}
