"""Parameters that had other names in version 0.2: the old names still work in this version, without a message.

The table is the only place of an old name, and is removed with the next version. Flags, `--config` and manifests,
columns of a sites
table, keyword arguments from Python, ``describe --json`` and QGIS's models take it from here. Standard library only.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

# The former name, by the present one.
OF_ALL_TOOLS = {
    "min_runout_m": "min_runout",
    "time_limit_s": "time_limit",
    "rest_speed_ms": "rest_speed",
    "time_step_s": "time_step",
    "station_spacing_m": "station_spacing",
}
OF_ONE_TOOL = {
    "assess-mobilisation": {"release_areas": "areas"},
    "import-trees": {"snags": "releases"},
    "map-intensity": {
        "energy_classes_kj": "energy_classes",
        "energy_raster": "energy",
        "return_periods_years": "return_periods",
    },
    "windthrow": {"windthrow_areas": "areas"},
}
# Parameters without a successor, by tool, and the reason.
_FORMULA = (
    "window_m",
    "slope_none_deg",
    "slope_full_deg",
    "roughness_limit_m",
    "gully_window_m",
    "gully_depth_m",
    "factors",
)
REMOVED = {
    "assess-mobilisation": (_FORMULA, "it belonged to a formula of slope and roughness; now logs slide (see --help)"),
}


def why_removed(tool: str, name: str) -> str | None:
    """Why a tool no longer has a parameter; None if it never had it."""
    names, why = REMOVED.get(tool, ((), ""))
    return f"{tool}: --{name.replace('_', '-')} was removed: {why}" if name in names else None


def old_names_of(tool: str, name: str) -> tuple[str, ...]:
    """The former names of a tool's parameter."""
    found = OF_ONE_TOOL.get(tool, {}).get(name) or OF_ALL_TOOLS.get(name)
    return (found,) if found else ()


def with_new_names(tool: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values by their present names; if both names occur, the new one counts unless it is None."""
    now = {old: new for new, old in (OF_ALL_TOOLS | OF_ONE_TOOL.get(tool, {})).items()}
    out: dict[str, Any] = {}
    for name, value in values.items():
        new = now.get(name, name)
        if new == name or out.get(new) is None:
            out[new] = value if value is not None else out.get(new)
    return out
