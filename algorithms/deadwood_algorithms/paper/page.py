"""README.md of this room: the twins' numbers, one row each, made from the tables that the twins are computed from.

``python -m deadwood_algorithms.paper.page`` writes it; a test fails when it is stale.
"""

from __future__ import annotations

from pathlib import Path

from deadwood_algorithms.paper import klosters, rothenbrunnen
from deadwood_algorithms.paper.twin import ROUGHNESS, page_of

PLACE = Path(__file__).with_name("README.md")
HEAD = """# Two synthetic twins of the paper's sites

The paper's sites cannot be shipped: terrain, trees and releases are others' data. `reproduce-paper` judges the paper's
findings (an order, a direction, the size of a ratio) on two synthetic slopes instead. They were fixed, in a commit of
their own, before the first log slid on them, and are not tuned to please. Made by `python -m
deadwood_algorithms.paper.page` from the tables in `klosters.py` and `rothenbrunnen.py`, which are what the twins are
computed from. The tool's own docstring has the layout in which a user's data of the real sites take their place.

Chosen for both: EPSG:2056 at round coordinates; the slope falls to the south; heights rounded to a centimetre; the
roughness of the sample slope, random relief of the wavelengths {waves} m with standard deviations {deviations} m.
Tree heights follow DBH[cm] = H[m]^1.25 with a scatter of 6 %, pyFINT's default until March 2021: the mean DBH of
Klosters (60 cm) then belongs to trees of 26.5 m; by the default since, 2.52 H^0.84, it would take 44 m. The road is
watched at its edge towards the slope.
"""


def page() -> str:
    waves, deviations = (", ".join(f"{each[k]:g}" for each in ROUGHNESS) for k in (0, 1))
    head = HEAD.format(waves=waves, deviations=deviations)
    tables = (("Klosters-like", klosters.NUMBERS), ("Rothenbrunnen-like", rothenbrunnen.NUMBERS))
    return "\n".join([head, *(page_of(*each) for each in tables)])


if __name__ == "__main__":
    PLACE.write_text(page(), encoding="utf-8")
