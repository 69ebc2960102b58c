"""The life of a tree after its death: each process with its range, its source, and how well it was observed.

The only table of them. `age` and `decide` draw every number from its range; none is a value to rely on alone. What no
publication gives has no range here: the tool asks for it. Standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from deadwood_algorithms.params.presets import AMMANN, SPRUCE, STRENGTH_OF, WEAKEST, Wood
from deadwood_algorithms.params.tool import UserError

HOLEKSA = "Holeksa et al. 2008 (mean time until a lying log has disappeared, by number of logs)"
WOHLGEMUTH = "Wohlgemuth et al. 2017, EJFR 136:1029 (windthrow areas of 1990 in Switzerland: 2.1 m, 0.8 m 20 years on)"
SETTLING = 0.048  # of the height above ground of lying stems [1/a]: ln(2.1 / 0.8) / 20
# Mean time until a lying spruce log has disappeared [a], from this DBH [cm] on
RESIDENCE = ((0.0, 71.0), (23.0, 90.0), (35.0, 113.0))


@dataclass(frozen=True)
class Process:
    """One process; ``span`` None: no publication gives a number, so the tool asks for a range.

    unit : of the number; species, where : of the observations; known : how well the range was observed
    least, most : what a range of the user may reach
    """

    name: str
    about: str
    unit: str
    span: tuple[float, float] | None
    species: str
    source: str
    known: str
    most: float = math.inf
    least: float = 0.0

    @property
    def shown(self) -> str:
        return f"{self.span[0]:g} to {self.span[1]:g}" if self.span else "no published number: your input"


ASSUMED = "the range is assumed"
PROCESSES = {
    each.name: each
    for each in (
        Process(
            "lag_years",
            "Years after death before snags begin to fall",
            "a",
            (0.0, 3.0),
            "spruce",
            "Garber et al. 2005 (Maine): a lag",
            f"its length could not be read; {ASSUMED}",
            100.0,
        ),
        Process(
            "fall_per_year",
            "Rate at which snags break or fall without a storm, after the lag",
            "1/a",
            (0.03, 0.25),
            "spruce",
            "Storaunet and Rolstad 2004, CJFR 34:376 (0.03 to 0.04, Norway); Kupferschmid et al. 2003, For. Chron. "
            "79:247 (three quarters broken 4 to 8 years after bark beetles, Gandberg)",
            "two sites that differ tenfold; none of fir or beech in the Alps is known",
            10.0,
        ),
        Process(
            "storm_return_years",
            "Mean time between storms (or falls of wet snow) that break snags on this site",
            "a",
            None,
            "any",
            "Usbeck 2016 has one in 5.8 years for all of Switzerland, not for a site",
            "no published number of a site",
            10_000.0,
            0.1,
        ),
        Process(
            "storm_share",
            "Share of the snags that break or fall in such a storm",
            "1",
            (0.1, 0.4),
            "spruce",
            "Kupferschmid et al. 2003: 0.28 in December 1999 (Gandberg)",
            f"one storm; {ASSUMED} about it",
            1.0,
        ),
        Process(
            "broken_share",
            "Share of the falling snags that break above the ground, so that only the upper part falls",
            "1",
            (0.7, 1.0),
            "spruce",
            "Kupferschmid et al. 2003: none uprooted (Gandberg)",
            f"one site; {ASSUMED} below 1",
            1.0,
        ),
        Process(
            "bark_off_years",
            "Years after death until bark and branches are gone",
            "a",
            (2.0, 5.0),
            "spruce",
            AMMANN,
            "one site; of other wood by its rate of decay, which is reckoned",
            100.0,
        ),
        Process(
            "weak_years",
            f"Years after death until {WEAKEST:g} of the fracture energy is left; the course is exponential",
            "a",
            (8.0, 10.0),
            "spruce",
            STRENGTH_OF,
            "the weakest that was found; the course between is assumed",
            100.0,
            0.1,
        ),
        Process(
            "strength_needed",
            "Share of the fracture energy below which a falling or sliding stem breaks to pieces",
            "1",
            (0.15, 0.35),
            "any",
            f"the paper, 6.1: logs slide far until about 5 years after death, when {WEAKEST ** (5 / 9):.2f} is left",
            ASSUMED,
            1.0,
            0.001,
        ),
        Process(
            "residence_years",
            "Mean time until a lying stem has disappeared",
            "a",
            (RESIDENCE[0][1], RESIDENCE[-1][1]),
            "spruce",
            HOLEKSA,
            "2785 pieces over 10 years, Carpathians; of other wood by its rate of decay, which is reckoned",
            10_000.0,
            0.1,
        ),
        Process(
            "hold_loss_per_year",
            "Rate at which lying stems lose what they hold",
            "1/a",
            (SETTLING, round(-math.log(WEAKEST) / 9.0, 3)),
            "spruce",
            f"from the height of lying stems ({WOHLGEMUTH}) to their strength ({STRENGTH_OF})",
            "reckoned: which of both decides is not known",
            10.0,
        ),
        Process(
            "start_share",
            "Of the stems that break or fall while smooth and strong, the share that slides off in one piece",
            "1",
            None,
            "any",
            "the paper, 6.1: a snag that falls by decay alone probably breaks on impact",
            "no published number",
            1.0,
        ),
        Process(
            "anchored_share",
            "Of the stems that are felled across the slope, the share that stumps or trees hold in place",
            "1",
            None,
            "any",
            "Frey et al. 1995, SZF 146:863: stems may be left if they are stable and do not lie downslope",
            "no published number: it is a matter of the work",
            1.0,
        ),
        Process(
            "mobilised_per_year",
            "Rate at which smooth and strong lying stems that nothing holds begin to slide (rain, snow, rockfall)",
            "1/a",
            None,
            "any",
            "repeated measurements at Cavorgia exist (Bebi et al.), but their numbers could not be read",
            "no published number",
            10.0,
        ),
    )
}


def lost_share(years: float, dbh_cm: float, wood: Wood = SPRUCE) -> float:
    """The share of lying logs of this DBH that has disappeared (`RESIDENCE`); of other wood by its rate of decay."""
    residence = next(mean for least, mean in reversed(RESIDENCE) if dbh_cm >= least)
    return -math.expm1(-years * wood.rate / (SPRUCE.rate * residence))


def height_left(years: float) -> float:
    """The share of the height above ground of lying stems that is left: they settle faster than they rot."""
    return math.exp(-SETTLING * years)


Spans = dict[str, tuple[float, float]]


def spans_of(text: str | None, asked: Mapping[str, tuple[float, ...]]) -> Spans:
    """The range of each process: of the table, but for ``NAME=LOW:HIGH, ...`` of the user, and for those asked for.

    asked : one number or the two ends of a range, of the processes without a published number that the tool needs
    """
    found: Spans = {name: each.span for name, each in PROCESSES.items() if each.span}
    for part in filter(str.strip, (text or "").split(",")):
        name, _, ends = (each.strip() for each in part.partition("="))
        if name not in found:
            raise UserError(f"--ranges: '{name}' is not one of {', '.join(found)}")
        try:
            low, high = (float(each) for each in (ends.split(":") if ":" in ends else (ends, ends)))
        except ValueError:
            raise UserError(f"--ranges: '{part.strip()}' is not NAME=LOW:HIGH, such as storm_share=0.2:0.3") from None
        found[name] = (low, high)
    for name, ends in asked.items():
        found[name] = (ends[0], ends[-1])
    for name, (low, high) in found.items():
        process = PROCESSES[name]
        if not process.least <= low <= high <= process.most:
            raise UserError(
                f"{name}: {low:g} to {high:g} is not a range from a number to a larger or equal one, "
                f"within {process.least:g} to {process.most:g}"
            )
    return found
