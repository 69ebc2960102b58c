"""Parameters that had other names in version 0.2: the old ones still work in this version, and nothing is said of it.

A row goes with the version after: the one place of an old name. Flags, `--config` and manifests, columns of a sites
table, keyword arguments from Python, ``describe --json`` and QGIS's models take it from here. Standard library only.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

# By the name now, the name before.
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


def old_names_of(tool: str, name: str) -> tuple[str, ...]:
    """The names under which a tool's parameter is known too."""
    found = OF_ONE_TOOL.get(tool, {}).get(name) or OF_ALL_TOOLS.get(name)
    return (found,) if found else ()


def with_new_names(tool: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values by their names now; where both names stand, the new one's counts unless it is None."""
    now = {old: new for new, old in (OF_ALL_TOOLS | OF_ONE_TOOL.get(tool, {})).items()}
    out: dict[str, Any] = {}
    for name, value in values.items():
        new = now.get(name, name)
        if new == name or out.get(new) is None:
            out[new] = value if value is not None else out.get(new)
    return out
