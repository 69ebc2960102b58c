"""Values that a user selects by name, each with its content, source and caveats.

The only table of them. A tool offers a part of it as a choice, reports what the choice set and which of the user's
options override it (`Taken`), and writes it to its manifest. Every number has its source; numbers computed from sources
are marked as such. Standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

PAPER = "the paper"
IPCC = "IPCC 2006 Guidelines 4, table 4.14 (density of sound wood, dry)"
RATES_OF = "Herrmann et al. 2015, Forest Ecosystems 2:27 (rate of decay, of downed wood)"
AMMANN = "Ammann 2006 in the paper, 6.1 (years)"
WOOD_HANDBOOK = "Wood Handbook, FPL-GTR-190, 2010, ch. 4 (fibre saturation, on average at 30 % of the dry mass)"
SATURATED = 0.3  # water that the cell walls hold, over the dry mass; wood keeps its fresh volume from there on
STEINLIN = "Steinlin and Zehntner 1953, Mitt. Schweiz. Anst. Forstl. Versuchswes. 29/2"
MEYERS = "Meyers Grosses Konversations-Lexikon 1905-1909, vol. 16, p. 925, 'Riesen'"
FRICTION_CELL_M = 0.5  # cell size of the terrain model on which the paper's friction was found


@dataclass(frozen=True)
class Preset:
    """The values that belong to one name, by the option that each sets."""

    name: str
    about: str
    values: Mapping[str, float]
    source: str
    mind: str = ""  # caveats
    law: str = ""  # of a wood: the law between DBH and height (`trees.allometry`)
    cell_m: float = 0.0  # for a friction: cell size of the terrain model on which it was found; 0: it was measured
    span: tuple[float, float] | None = None  # for a friction: the range that its source gives

    @property
    def values_shown(self) -> str:
        return ", ".join(f"{name} {value:.4g}" for name, value in self.values.items())


@dataclass(frozen=True)
class Taken:
    """A preset as used by a tool: the values that it set, and the options that override it."""

    preset: Preset
    option: str  # the flag that named it
    sets: Mapping[str, float]
    given: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, preset: Preset, option: str, given: Mapping[str, Any]) -> Taken:
        """Apply a preset; ``given``: the user's own value of each option, None if there is none."""
        own = {name: given[name] for name, value in preset.values.items() if _is_other(given.get(name), value)}
        return cls(preset, option, {name: value for name, value in preset.values.items() if name not in own}, own)

    @property
    def values(self) -> dict[str, Any]:
        return {**self.sets, **self.given}

    @property
    def said(self) -> str:
        """One line: what the preset set, its source, what overrides it, and its caveats."""
        sets = ", ".join(f"{name} {value:.4g}" for name, value in self.sets.items())
        text = f"sets {sets} ({self.preset.source})" if sets else "sets nothing"
        before = "".join(
            f"; {flag_of(name)} {value} is given and overrides its {self.preset.values[name]:.4g}"
            for name, value in self.given.items()
        )
        mind = f"; {self.preset.mind}" if self.preset.mind and sets else ""
        return f"{self.option} {self.preset.name} {text}{before}{mind}"

    @property
    def record(self) -> dict[str, Any]:
        """For a manifest."""
        return {
            "option": self.option,
            "name": self.preset.name,
            "sets": dict(self.sets),
            "given_instead": dict(self.given),
            "source": self.preset.source,
        }


def _is_other(given: Any, value: float) -> bool:
    """Whether the given value differs from the preset's: a manifest that repeats the preset's values still uses the
    preset.
    """
    if given is None:
        return False
    try:
        return float(given) != value
    except (TypeError, ValueError):  # a layer
        return True


def flag_of(name: str) -> str:
    return "--" + name.replace("_", "-")


# --- wood -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wood:
    """The wood of a species whose density and decay are known here."""

    name: str
    binomial: str
    density_kg_m3: float  # dry mass by fresh volume, sound
    rate: float  # of decay of downed wood [1/a]: mass falls as exp(-rate t); of snags no rate is known here
    law: str = ""

    def kept(self, years: float) -> float:
        """The share of its mass that remains after these years since death."""
        return math.exp(-self.rate * years)


SPRUCE = Wood("spruce", "Picea abies", 400.0, 0.033, "chablais-spruce")
BEECH = Wood("beech", "Fagus sylvatica", 580.0, 0.054, "chablais-beech")
PINE = Wood("pine", "Pinus sylvestris", 420.0, 0.032)
WOODS = {each.name: each for each in (SPRUCE, BEECH, PINE)}
OF_SPECIES = {each.binomial: each for each in WOODS.values()}
CRITICAL_YEARS = (2.0, 5.0)  # after death, of spruce (Ammann 2006)


SNAGS = "; the rates are of downed wood, and most logs that slid far had stood dead, of which none is known"


def critical_years(wood: Wood) -> tuple[float, float]:
    """Years after death in which a wood has decayed as far as spruce in its critical years: smooth and still strong."""
    low, high = (each * SPRUCE.rate / wood.rate for each in CRITICAL_YEARS)
    return low, high


def _critical(wood: Wood) -> Iterator[Preset]:
    """The dry wood, and as wet as the friction of wet logs supposes at least."""
    low, high = critical_years(wood)
    dense, light = (wood.density_kg_m3 * wood.kept(each) for each in (low, high))
    years = f"{low:.2g} to {high:.2g} years after death"
    reckoned = "" if wood is SPRUCE else ", which the rates carry over from spruce"
    for suffix, moisture, source, mind in (
        ("", 0.0, "", f"it is the density of dry wood: beside the friction of wet logs take {wood.name}-critical-wet"),
        (
            "-wet",
            SATURATED,
            f"; {WOOD_HANDBOOK}",
            "free water in rotten or soaked wood adds to it, up to several times",
        ),
    ):
        yield Preset(
            f"{wood.name}-critical{suffix}",
            f"{wood.name} without bark and branches that does not break yet, {years}, moisture {100 * moisture:.0f} % "
            f"of the dry mass: {dense * (1 + moisture):.0f} to {light * (1 + moisture):.0f} kg/m³",
            {"density_kg_m3": float(round(0.5 * (dense + light) * (1 + moisture)))},
            f"reckoned, the middle of that range, from {IPCC}; {RATES_OF}; {AMMANN}{source}{reckoned}",
            f"{mind}{SNAGS if reckoned else ''}",
            wood.law,
        )


# --- the tables -----------------------------------------------------------------------------------------------------

LOGS = {
    each.name: each
    for each in (
        Preset(
            "klosters",
            "the logs of Klosters 2022",
            {"dbh_cm": 75.0, "length_m": 30.0, "density_kg_m3": 300.0},
            f"{PAPER}, 4: measured at the deposit, the density assumed",
        ),
        Preset(
            "rothenbrunnen",
            "the log of Rothenbrunnen 2022",
            {"dbh_cm": 30.0, "length_m": 15.0, "density_kg_m3": 300.0},
            f"{PAPER}, 4: estimated from photographs, the density assumed",
        ),
        *(each for wood in WOODS.values() for each in _critical(wood)),
    )
}
FORESTS = {
    each.name: each
    for each in (
        Preset(
            "klosters",
            "the forest of Gruobenwald, Klosters",
            {"stems_per_ha": 300.0, "dbh_mean_cm": 60.23, "dbh_sd_cm": 18.64},
            f"{PAPER}, 4: from airborne laser scanning",
            "it names no heights, which follow from the DBH",
        ),
        Preset(
            "rothenbrunnen",
            "the forest of Plattawald, Rothenbrunnen",
            {"stems_per_ha": 315.0, "dbh_mean_cm": 44.0, "dbh_sd_cm": 22.0},
            f"{PAPER}, 4: from airborne laser scanning",
            "it names no heights, which follow from the DBH",
        ),
    )
}
FRICTIONS = {
    each.name: each
    for each in (
        Preset(
            "wet-debarked",
            "a wet log without bark and branches on wet ground, 0.2 to 0.3",
            {"friction": 0.25},
            f"{PAPER}, 5.1 and 6.1: what reproduces its two events on cells of {FRICTION_CELL_M:g} m",
            "its range is 0.2 to 0.3: --friction-range slides both ends too; wet logs are heavier than dry ones, see "
            "the presets of logs with -wet",
            cell_m=FRICTION_CELL_M,
            span=(0.2, 0.3),
        ),
        Preset(
            "wet-bark",
            "a wet log with its bark on wet ground, 0.25 to 0.38",
            {"friction": 0.31},
            f"reckoned: wet-debarked ({PAPER}) over 0.8, for bark off lowers friction on wet ground by about 20 % "
            f"({STEINLIN}, its abstract)",
            "dragged stems, on hard ground; dry and hard ground has about three times the friction of frozen ground "
            "under thin snow there, whose numbers could not be read",
            cell_m=FRICTION_CELL_M,
            span=(0.25, 0.38),
        ),
        *(
            Preset(
                f"chute-{name}",
                f"a log in {what}, {range_words}",
                {"friction": friction},
                f"{MEYERS}: the grade that such chutes take",
                "of chutes lined with logs, not of ground: the grade at which logs slide steadily is their friction",
                span=span,
            )
            for name, what, range_words, friction, span in (
                ("dry", "a dry timber chute", "about 0.15", 0.15, None),
                ("watered", "a watered timber chute", "0.03 to 0.08", 0.055, (0.03, 0.08)),
                ("iced", "an iced timber chute", "0.03 to 0.12", 0.075, (0.03, 0.12)),
            )
        ),
    )
}
FRICTION_RANGE = FRICTIONS["wet-debarked"].span or (0.2, 0.3)  # where no range is given
AROUND = (0.8, 1.2)  # of a friction for which no source gives a range: a suggestion, nobody's measurement


def plausible_range(friction: float, preset: str | None) -> tuple[float, float]:
    """The range that a friction may have: of its preset, else of the first in the table that holds it."""
    named = FRICTIONS[preset].span if preset else None
    spans = [named] if named else [each.span for each in FRICTIONS.values() if each.span]
    found = next((each for each in spans if each and each[0] <= friction <= each[1]), None)
    return found or (round(AROUND[0] * friction, 4), round(AROUND[1] * friction, 4))


def decayed(wood: Wood, years: float) -> Preset:
    """What windthrow assumes for a lying log years later: how much thinner it is, as a share of its diameter."""
    kept = wood.kept(years)
    return Preset(
        wood.name,
        f"{years:g} years on",
        {"thinner": round(1.0 - math.sqrt(kept), 3)},
        f"{RATES_OF}: {100 * kept:.0f} % of the mass is left after {years:g} years",
        DECAY_MIND,
    )


WEAKEST, AFTER_YEARS = 0.11, 9.0  # of its fracture energy a log keeps, with rot, of the middle of 8 to 10 years
STRENGTH_OF = "Ammann 2006 in the paper, 6.4: up to 89 % less energy to fracture a log of 8 to 10 years with rot"


def strength_left(wood: Wood, years: float) -> float:
    """The share of its fracture energy that a lying log keeps: of spruce falling steadily to that of the source, of
    other wood as much faster as its mass decays.
    """
    return WEAKEST ** (years / AFTER_YEARS * wood.rate / SPRUCE.rate)


DECAY_MIND = "it assumes that decay removes wood from the outside, and does not give the number of logs gone by then"
DECAYS = {
    wood.name: Preset(
        wood.name,
        f"its mass falls by {100 * (1 - wood.kept(1.0)):.1f} % a year, taken off from outside",
        {"rate": wood.rate},
        RATES_OF,
        DECAY_MIND,
    )
    for wood in WOODS.values()
}


@dataclass(frozen=True)
class BarrierClasses:
    """Classes of rockfall nets by the energy that one hit may have [kJ], ascending; None: above the last."""

    name: str
    about: str
    rows: tuple[tuple[str, float], ...]  # class, maximum energy level [kJ]
    above: str  # the class of nets that hold more than the last of the rows
    source: str
    mind: str

    def class_of(self, energy_kj: float) -> tuple[str, float]:
        """The weakest class that holds an energy, and its limit [kJ] (infinite above the last; NaN for NaN)."""
        if math.isnan(energy_kj):
            return "", math.nan
        return next(((name, holds) for name, holds in self.rows if energy_kj <= holds), (self.above, math.inf))

    @property
    def said(self) -> str:
        """Source of the classes, and caveats."""
        return f"--barrier-classes {self.name}: {self.source}; {self.mind}"

    def record(self, energy_kj: float, high_kj: float) -> dict[str, str]:
        """Columns: the class that holds an energy, and the one that holds the upper end of its interval."""
        return {"barrier_class": self.class_of(energy_kj)[0], "barrier_class_high": self.class_of(high_kj)[0]}

    def words(self, record: Mapping[str, Any]) -> str:
        """``class 3 of etag-027 (1000 kJ), up to class 4 (1500 kJ)``; from the columns of `record`."""
        holds = dict(self.rows) | {self.above: math.inf}
        one, other = record["barrier_class"], record["barrier_class_high"]
        shown = {
            name: f"{holds[name]:g} kJ" if holds[name] < math.inf else f"over {self.rows[-1][1]:g} kJ" for name in holds
        }
        end = (
            "no upper end can be given"
            if not other
            else "its upper end too"
            if other == one
            else (f"its upper end class {other} ({shown[other]})")
        )
        return f"class {one} of {self.name} ({shown[one]}), {end}"

    @property
    def values_shown(self) -> str:
        return ", ".join(f"{name}: {holds:g} kJ" for name, holds in self.rows) + f", {self.above}: more"


TESTED = (
    "they are tested with compact blocks in the middle of a net: a slender log may pass through rings or load a net "
    "otherwise (the paper, 6.3): an expert must judge that"
)
BARRIERS = {
    each.name: each
    for each in (
        BarrierClasses(
            "etag-027",
            "classes of rockfall protection kits by maximum energy level (MEL)",
            (
                ("0", 100.0),
                ("1", 250.0),
                ("2", 500.0),
                ("3", 1000.0),
                ("4", 1500.0),
                ("5", 2000.0),
                ("6", 3000.0),
                ("7", 4500.0),
            ),
            "8",
            "ETAG 027 (EOTA 2008), now EAD 340059-00-0106",
            TESTED,
        ),
    )
}


@dataclass(frozen=True)
class Listed:
    """A row of the list of all presets."""

    tools: str
    option: str
    name: str
    values: str
    about: str
    source: str
    mind: str = ""


def listed() -> Iterator[Listed]:
    """Every preset, by the option that takes it."""
    sliding = "slide-logs, compare-fidelity, vary, run-sites, explore"
    tables = (
        ("sample-releases", "preset", LOGS),
        ("generate-forest", "preset", FORESTS),
        (sliding, "friction_preset", FRICTIONS),
        ("windthrow", "wood", DECAYS),
    )
    for tools, option, table in tables:
        for each in table.values():
            yield Listed(tools, flag_of(option), each.name, each.values_shown, each.about, each.source, each.mind)
    for each in BARRIERS.values():
        option = flag_of("barrier_classes")
        yield Listed(
            "design-values, site-barriers", option, each.name, each.values_shown, each.about, each.source, each.mind
        )


def choices_help(table: Mapping[str, Preset | BarrierClasses]) -> str:
    """The meaning of each name in a table, for the help of the option that takes it."""
    return "; ".join(f"{name}: {each.about} ({each.values_shown})" for name, each in table.items()) + "."
