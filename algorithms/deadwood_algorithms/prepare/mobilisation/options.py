"""Options of `assess_mobilisation`: its logs, where they start, and the fields of mapped deadwood."""

from __future__ import annotations

from dataclasses import dataclass

from deadwood_algorithms.params import tool
from deadwood_algorithms.scene.released_scene import OpenScene
from deadwood_algorithms.schemas import DBH_CM, DENSITY_KG_M3, TREE_M


@dataclass(frozen=True, kw_only=True)
class StartOptions(OpenScene):
    friction: str | float = tool.number_or_layer(
        "Friction coefficient",
        default=0.25,
        minimum=0.0,
        help="A number, a raster, or polygons with a field 'friction' or 'mu'.",
    )
    friction_range: str | None = tool.text(
        "Range of the friction",
        default=None,
        help="A-B: logs slide with both ends and with --friction. Default: 20 % below it to 20 % above.",
    )
    dbh_cm: float = tool.number(
        "DBH of the logs", unit="cm", default=75.0, minimum=0.0, maximum=DBH_CM[1], exclusive=True
    )
    length_m: float = tool.number(
        "Length of the logs", unit="m", default=30.0, minimum=0.0, maximum=TREE_M[1], exclusive=True
    )
    density_kg_m3: float = tool.number(
        "Density of the logs", unit="kg/m³", default=300.0, minimum=0.0, maximum=DENSITY_KG_M3, exclusive=True
    )
    cell_m: float = tool.number(
        "Cell size of the result",
        unit="m",
        default=10.0,
        minimum=0.0,
        exclusive=True,
        help="Rounded to whole cells of the terrain model.",
    )
    logs_per_cell: int = tool.integer("Logs released in each cell", default=5, minimum=1, maximum=10_000)
    logs: int | None = tool.integer(
        "Logs to slide in all, at most",
        default=None,
        minimum=1,
        help="A random subset; cells without a log have no value. Default: all.",
    )
    within: str | None = tool.vector("Ground on which logs start", "polygon", default=None, help="Default: all of it.")
    start_m: float = tool.number("Distance that a log moves which starts", unit="m", default=5.0, minimum=0.0)
    min_runout_m: float | None = tool.min_runout("Distance beyond which a log goes far")


@dataclass(frozen=True, kw_only=True)
class DecayFields:
    """The fields with the decay of mapped deadwood, and the years since death in which spruce is smooth and strong."""

    stage_field: str | None = tool.field_of(
        "deadwood", "Field of the stage of decay", default=None, help="Without it: decay_stage."
    )
    years_field: str | None = tool.field_of(
        "deadwood", "Field of the years since death", default=None, help="Without it: years_dead."
    )
    species_field: str | None = tool.field_of(
        "deadwood", "Field of the species", default=None, help="Without it: species."
    )
    standing_field: str | None = tool.field_of(
        "deadwood", "Field that is 1 if it stands, 0 if it lies", default=None, help="Without it: standing."
    )
    years_from: float = tool.number("Years since death from which spruce is smooth", default=2.0, minimum=0.0)
    years_to: float = tool.number("Years since death up to which spruce is strong", default=5.0, minimum=0.0)
