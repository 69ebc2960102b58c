"""Every layer, raster, table and JSON file of the toolbox: what each column, band and key means, its unit, its bounds.

`words` has the classes of declarations, `brought` the layers of users, `results` those of results, `files` the
rasters, tables and JSON files; `written` lists what each tool writes, and where: a test runs every tool and compares
that list with its output. The pages of the site about layers are rendered from here. Standard library only.
"""

from deadwood_algorithms.schemas.brought import (
    BARRIER_M,
    BARRIERS,
    BLOCKS,
    BROUGHT,
    DBH_CM,
    DEAD_TREES,
    DEADWOOD,
    DENSITY_KG_M3,
    DROP_M,
    LINES,
    LYING_LOGS,
    ORIENTATIONS,
    RELEASES,
    SPEED_MS,
    STRUCTURE_KINDS,
    STRUCTURES,
    TREE_M,
    TREES,
)
from deadwood_algorithms.schemas.results import DEPOSITS, POSES, RESULTS, STOP_REASONS, TRAJECTORIES, VERDICTS
from deadwood_algorithms.schemas.words import UNITS, Column, Layer, value_fault

__all__ = [
    "BARRIERS",
    "BARRIER_M",
    "BLOCKS",
    "DBH_CM",
    "DEADWOOD",
    "DEAD_TREES",
    "DENSITY_KG_M3",
    "DEPOSITS",
    "DROP_M",
    "LAYERS",
    "LINES",
    "LYING_LOGS",
    "ORIENTATIONS",
    "POSES",
    "RELEASES",
    "SPEED_MS",
    "STOP_REASONS",
    "STRUCTURES",
    "STRUCTURE_KINDS",
    "TRAJECTORIES",
    "TREES",
    "TREE_M",
    "UNITS",
    "VERDICTS",
    "Column",
    "Layer",
    "columns_of",
    "value_fault",
]

LAYERS = {layer.name: layer for layer in (*BROUGHT, *RESULTS)}


def columns_of(name: str) -> tuple[Column, ...]:
    """The columns of a layer, empty for a name that is not in the table."""
    return LAYERS[name].columns if name in LAYERS else ()
