"""How quantities and objects look, wherever they are shown: in QGIS, on the report's page, in every tool's picture.

A quantity has one ramp and one scale, so that two pictures can be compared side by side; a kind of object has one
colour; a run has one by its place among the runs. Rasters name their look where they are declared (`RasterFile.look`).
`files/styles.py` makes QGIS styles from it, `files/pictures.py` those of Matplotlib. Kinds have the colours of Okabe
and Ito, ramps are those of magma, viridis and plasma: both are readable with colour blindness and in greyscale.
Standard library only.
"""

from __future__ import annotations

from dataclasses import dataclass

# Eight even steps of each of the ramps magma (without its palest end, which is invisible on grey relief), viridis,
# plasma.
HITS = ("#fec68a", "#fc8a62", "#e75263", "#b73779", "#832681", "#51127c", "#1d1147", "#000004")
SPEED = ("#fde725", "#a0da39", "#4ac16d", "#1fa187", "#277f8e", "#365c8d", "#46327e", "#440154")
ENERGY = ("#f7e425", "#fdac33", "#ef7c51", "#d5536f", "#b32c8e", "#8606a6", "#5002a2", "#0d0887")
GREENS = ("#a1d99b", "#74c476", "#41ab5d", "#238b45", "#00682a", "#00441b")
LESS_MORE = ("#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b")

# Objects on a map.
ROAD = "#d55e00"  # lines whose reach is counted
RELEASE = "#0072b2"
TREE = "#00682a"
BARRIER = "#aa3377"
WOOD = "#8c510a"  # lying logs
STUMP = "#bf812d"
STONE = "#5a5a5a"  # boulders
MOVING = "#e69f00"  # moving logs
PLAIN = "#666666"  # anything without a look of its own
CHOSEN, CANDIDATE = "#009e73", "#56b4e9"  # of barriers to be built
KEEPS, BRINGS = "#009e73", "#cc79a7"  # effect of an object on a line: fewer logs, more logs
LOW_END, HIGH_END = "#56b4e9", "#e69f00"  # of a varied range
# Runs that are compared, in their order; none has the colour of roads, beside which they are drawn.
RUNS = ("#0072b2", "#009e73", "#cc79a7", "#7a5195", "#56b4e9", "#e69f00")
# The ways in which a log's run ends: (label, colour, shape of the marker).
ENDS = {
    "tree": ("held by a tree", "#009e73", "circle"),
    "rest": ("at rest", "#56b4e9", "circle"),
    "barrier": ("held by a barrier", "#cc79a7", "circle"),
    "lying_log": ("held by a lying log", "#e69f00", "circle"),
    "block": ("held by a boulder", "#999999", "circle"),
    "left_dem": ("left the terrain model", "#f0e442", "triangle"),
    "time_limit": ("still moving", "#d55e00", "square"),
    "failed": ("failed", "#000000", "cross2"),
}


def rgb(colour: str) -> tuple[float, ...]:
    """Red, green and blue from 0 to 1 of ``#rrggbb``."""
    return tuple(int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))


# Colours of the solids in a 3-D view, as red, green and blue from 0 to 1
SOLIDS = {
    name: rgb(colour)
    for name, colour in (
        ("trees", TREE),
        ("stumps", STUMP),
        ("lying_logs", WOOD),
        ("blocks", STONE),
        ("deposits", WOOD),
        ("barriers", BARRIER),
        ("lines", ROAD),
        ("moving", MOVING),
    )
}


@dataclass(frozen=True, kw_only=True)
class Look:
    """The scale of a quantity: a colour at each stop, interpolated between two stops.

    stops : ascending, in the unit of the data
    shown : the unit on scales and legends; if it is %, shares are multiplied by 100
    clear : the value that is transparent, None if every value is drawn
    """

    stops: tuple[float, ...]
    colours: tuple[str, ...]
    shown: str
    clear: float | None = None

    @property
    def factor(self) -> float:
        return 100.0 if self.shown in ("%", "points") else 1.0

    def label(self, value: float) -> str:
        sign = "+" if self.shown == "points" and value > 0.0 else ""
        shown = self.factor * value
        number = f"{shown:.4g}" if abs(shown) < 10_000.0 else f"{shown:,.0f}".replace(",", " ")
        return f"{sign}{number} {self.shown}".strip()


LOOKS = {
    "shares": Look(stops=(0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0), colours=HITS[:7], shown="%", clear=0.0),
    "danger": Look(stops=(0.0, 0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0), colours=HITS, shown="%"),
    "speed": Look(stops=(0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0), colours=SPEED, shown="m/s"),
    "energy": Look(stops=(0.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10_000.0), colours=ENERGY, shown="kJ"),
    "jump": Look(stops=(0.0, 0.5, 1.0, 2.0, 4.0, 6.0, 10.0, 20.0), colours=SPEED, shown="m"),
    "difference of shares": Look(
        stops=(-0.3, -0.1, -0.03, -0.01, 0.0, 0.01, 0.03, 0.1, 0.3), colours=LESS_MORE, shown="points", clear=0.0
    ),
    "return period": Look(
        stops=(3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10_000.0), colours=HITS[::-1], shown="years"
    ),
}
# Quantities whose scale depends on the data: counts of a run's logs, in even steps of the logarithm; relief.
BY_DATA = ("counts", "terrain")
DBH_CM = (0.0, 20.0, 40.0, 60.0, 80.0, 100.0)  # bounds of the classes of trees, in GREENS
WORTHS = (0.0005, 0.001, 0.002, 0.005, 0.01, 1.0)  # shares of the logs that one object keeps from a line, in HITS
