"""What is known of a log on its way: where its slide stands, and the summary that is left of it, as records."""

from __future__ import annotations

import numpy as np

# A log's summary, a row a log
SUMMARY = np.dtype(
    [
        ("reason", "i8"), ("item_row", "i8"),  # as ``rest.holder``
        ("grip", "f8"),  # [rad] as ``rest.holder``
        ("duration", "f8"), ("path", "f8"), ("speed_max", "f8"),  # s, m, m/s
        ("energy_max", "f8"), ("jump_max", "f8"),  # per mass J/kg, m
        ("height_max", "f8"),  # m, of the centre of mass above the terrain below it
        ("energy_error", "f8"), ("energy_gain", "f8"),  # of the energy to spend; J/kg made by contacts
        ("penetration", "f8"), ("overlap", "f8"),  # m in the ground, in obstacles
        ("residual", "f8"), ("unconverged", "i8"),  # m/s of the worst solve; steps that hit the cap of sweeps
        ("steps", "i8"), ("airborne", "i8"), ("contacts", "i8"), ("sweeps", "i8"),
        ("tree_hits", "i8"), ("barrier_hits", "i8"), ("hits", "i8"),
        ("poses", "i8"),  # kept
        ("influences", "i8"),  # obstacles that mattered (``influence``)
        ("started_in_contact", "b1"),
    ]
)  # fmt: skip

# Where a log's slide stands
WAY = np.dtype(
    [
        ("time", "f8"),  # s, of the node
        ("dt", "f8"), ("before", "f8"),  # s, the step ahead and the one behind
        ("kick", "f8"), ("last_kick", "f8"),  # s, that gravity acts in this impulse, and did in the last
        ("fastest", "f8"), ("bend", "f8"),  # m/s, m/s2, as ``travel_bound``, gravity included
        ("travel", "f8"),  # m, that the obstacles allow
        ("path", "f8"),  # m, that the log can have moved since its release
        ("slip", "f8"),  # m, that friction depends on (``slip``)
        # m, how far below the surface the ground is hard (``scarring``), 0: not in it; now, and at the step's end
        ("scar", "f8"), ("scar_ahead", "f8"),
        ("dragged", "f8"),  # J/kg, work of the scar's drag in this step
        ("enters", "f8"),  # s, longest step of one in which the body comes into the ground
        ("work", "f8"),  # J/kg, of all contacts so far
        ("speed", "f8"), ("energy", "f8"), ("gap", "f8"),  # m/s, J/kg, m, of the log now
        ("height", "f8"),  # m, of its centre of mass above the terrain
        ("residual", "f8"), ("tolerance", "f8"),  # m/s, of this step's solve
        ("next_look", "f8"), ("next_rocking", "f8"),  # s, when to look whether it rests, and whether it rocks in place
        ("count", "i8"), ("old_count", "i8"),  # contacts of this step, and those loaded in the last
        ("kept", "i8"),  # poses
        ("whole", "b1"),  # whether there was terrain below all of the log so far
        ("pressed", "b1"),  # whether the ground pushes
        ("buried", "b1"),  # whether it was released deeper in the ground than its radius
        ("sunk", "f8"),  # s, since when the log is deeper in something than its radius; infinite: it is not
        ("lost", "b1"),  # whether it is deeper in an obstacle than a step can bring it, or stays so in the ground
        ("undermined", "b1"),  # whether it came into the ground from beyond the terrain's border (``limits.BURIED``)
    ]
)  # fmt: skip
