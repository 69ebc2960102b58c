"""The kinds of obstacles, each declared once: they are counted and drawn apart. Standard library only."""

from __future__ import annotations

from dataclasses import dataclass

from deadwood_algorithms.schemas.looks import BARRIER, STONE, STUMP, TREE, WOOD

STUMP_BELOW_M = 2.0  # a shorter row of a trees layer is a stump


@dataclass(frozen=True)
class Obstacle:
    """key : in a run's ``scenario`` and ``counted``, and of its layer on a map; word : of one, in a sentence

    sizes : what ``scenario`` tells of them
    """

    key: str
    word: str
    colour: str
    meaning: str
    sizes: tuple[str, ...] = ()


OBSTACLES = (
    Obstacle("trees", "tree", TREE, "standing trees", ("dbh_cm", "height_m")),
    Obstacle("stumps", "stump", STUMP, f"stumps: lower than {STUMP_BELOW_M:g} m", ("dbh_cm", "height_m")),
    Obstacle("barriers", "barrier", BARRIER, "barriers", ("height_m",)),
    Obstacle("lying_logs", "lying log", WOOD, "lying logs", ("capacity_kj",)),
    Obstacle("blocks", "boulder", STONE, "boulders"),
)
