"""Data included in the toolbox: a synthetic slope (`sample_data/README.md`), and reported slides of trunks."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.params.events import EVENTS

if TYPE_CHECKING:
    from pandas import DataFrame

# Places in an installed package, and in a checkout.
PLACES = (Path(__file__).parent / "sample_data", Path(__file__).parents[1] / "sample_data")


@dataclass(frozen=True)
class SampleData:
    """Paths of a synthetic slope and its layers; nothing of it is measured, and it is free to use (CC0)."""

    folder: Path
    dem: str = field(init=False)  # terrain model of 300 x 500 m, cells of 0.5 m, EPSG:2056
    trees: str = field(init=False)  # the forest, tree by tree
    release_area: str = field(init=False)  # a circle of 10 m
    lines: str = field(init=False)  # the road at the foot
    barriers: str = field(init=False)  # two, 3 and 5 m high
    forest: str = field(init=False)  # the outline of the forest
    dams: str = field(init=False)  # two embankments
    flights: str = field(init=False)  # a jump over the cliff band
    deadwood: str = field(init=False)  # twelve dead trees

    def __post_init__(self) -> None:
        files = {"dem": "dem.tif", "trees": "trees.csv"}
        layers = ("release_area", "lines", "barriers", "forest", "dams", "flights", "deadwood")
        places = {name: str(self.folder / file) for name, file in files.items()}
        places |= {name: f"{self.folder / 'sample.gpkg'}|layername={name}" for name in layers}
        for name, place in places.items():
            object.__setattr__(self, name, place)


def sample_data() -> SampleData:
    """The sample slope: a place to try every tool. Do not change the files; work on copies."""
    found = next((each for each in PLACES if (each / "dem.tif").is_file()), None)
    if found is None:
        raise FileNotFoundError(f"the sample data are missing in {PLACES[0]}; install the toolbox again")
    return SampleData(found)


def events() -> DataFrame:
    """The reported slides as a table, a row each; a range has two columns, ``_low`` and ``_high`` [m]."""
    from pandas import DataFrame

    rows = []
    for each in EVENTS:
        row = asdict(each)
        for name in ("length_m", "travel_m"):
            row |= dict(zip((f"{name}_low", f"{name}_high"), row.pop(name) or (None, None), strict=True))
        rows.append(row)
    return DataFrame(rows)
