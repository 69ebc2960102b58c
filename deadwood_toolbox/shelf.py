"""The tools, one honest import each; a tool that is not named here does not exist for the command line.

``deadwood-tool TOOL --help`` imports every tool's file, so such a file imports at its top only what starts quickly:
the standard library, numpy, shapely, and siblings that keep the same rule. The engine (numba), geopandas, pandas,
pyarrow, rasterio, pyogrio, pyproj and matplotlib are imported where they are used: inside the functions of
``layers.py``, and inside a tool's ``run``. A test imports this file and looks at what came with it.
"""

from __future__ import annotations

from deadwood_algorithms.add_structures import TOOL as ADD_STRUCTURES
from deadwood_algorithms.assess_mobilisation import TOOL as ASSESS_MOBILISATION
from deadwood_algorithms.calibrate_friction import TOOL as CALIBRATE_FRICTION
from deadwood_algorithms.compare_fidelity import TOOL as COMPARE_FIDELITY
from deadwood_algorithms.compare_scenarios import TOOL as COMPARE_SCENARIOS
from deadwood_algorithms.count_hits import TOOL as COUNT_HITS
from deadwood_algorithms.demo import TOOL as DEMO
from deadwood_algorithms.fit_flight import TOOL as FIT_FLIGHT
from deadwood_algorithms.generate_forest import TOOL as GENERATE_FOREST
from deadwood_algorithms.import_trees import TOOL as IMPORT_TREES
from deadwood_algorithms.lateral_spread import TOOL as LATERAL_SPREAD
from deadwood_algorithms.make_log import TOOL as MAKE_LOG
from deadwood_algorithms.reach_lines import TOOL as REACH_LINES
from deadwood_algorithms.sample_releases import TOOL as SAMPLE_RELEASES
from deadwood_algorithms.slide_logs import TOOL as SLIDE_LOGS
from deadwood_algorithms.tool import Tool

# In the order of the work.
TOOLS: tuple[Tool, ...] = (
    ASSESS_MOBILISATION,
    SAMPLE_RELEASES,
    IMPORT_TREES,
    GENERATE_FOREST,
    ADD_STRUCTURES,
    MAKE_LOG,
    SLIDE_LOGS,
    COUNT_HITS,
    REACH_LINES,
    LATERAL_SPREAD,
    FIT_FLIGHT,
    COMPARE_SCENARIOS,
    CALIBRATE_FRICTION,
    COMPARE_FIDELITY,
    DEMO,
)


def find(name: str) -> Tool | None:
    """The tool of that name, or None."""
    return next((tool for tool in TOOLS if tool.name == name), None)
