"""Inputs of a simulation, as values: layers by their paths, laws of contact, defaults for missing columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.params.presets import Taken
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.laws import Breaking

# The contact laws, except the sliding friction of the ground, by the names that the engine's ``slide`` takes.
CONTACT_LAWS = (
    "restitution",
    "rolling_friction",
    "tree_friction",
    "tree_restitution",
    "barrier_friction",
    "barrier_restitution",
)


@dataclass(frozen=True, kw_only=True)
class SceneInputs:
    """Layers are paths, None if there is none; ``friction`` is a coefficient or the path of a layer.

    defaults : values for the columns of `DefaultLog`; laws : keyword arguments of the engine's ``slide``
    presets : those used; breaking : energy at which trees break, None: they do not
    """

    dem: str
    crs: str | None
    friction: float | str
    friction_column: str | None
    friction_elsewhere: float | None
    trees: str | None
    barriers: str | None
    height_field: str | None
    lying_logs: str | None
    lying_diameter_cm: float
    blocks: str | None
    lines: str | None
    shape: str
    releases: str
    defaults: Mapping[str, Any]
    laws: Mapping[str, Any]
    presets: tuple[Taken, ...] = ()
    breaking: Breaking | None = None

    def __post_init__(self) -> None:
        if self.friction is None:
            raise UserError("--friction is missing (Friction coefficient); give it, or name one with --friction-preset")


def say_presets(presets: tuple[Taken, ...], cell: float, feedback: Feedback) -> None:
    """Report what a friction by name is, and if it was found on cells of another size."""
    for each in presets:
        feedback.note(each.said, code="preset")
        found_on = each.preset.cell_m
        if each.sets and found_on and abs(cell - found_on) > 0.02 * found_on:
            feedback.warn(
                f"--friction-preset {each.preset.name} was found on cells of {found_on:g} m, and the terrain "
                f"model has cells of {cell:g} m: on coarser ones friction should be higher (the paper, 6.1)",
                code="preset-of-other-cells",
                cell_m=cell,
                found_on_m=found_on,
            )
