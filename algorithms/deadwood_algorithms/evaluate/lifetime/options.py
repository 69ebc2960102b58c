"""The parameters of the tools that let dead trees age, and the table of the numbers that they used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.snag_dynamics import PROCESSES
from deadwood_algorithms.params.tool import UserError

REPORT_YEARS = (0.0, 2.0, 5.0, 10.0, 20.0, 30.0)


@dataclass(frozen=True, kw_only=True)
class AgingOptions:
    """The dead trees and the numbers of their processes: part of the ``Ask`` of every tool that lets them age."""

    dead_trees: str = tool.vector(
        "Dead trees",
        "point",
        help="With dbh_cm and height_m; optional species, years_dead, and standing (1, or 0 for a lying one).",
    )
    years_dead: float = tool.number(
        "Years since their death, where the layer has none", default=0.0, minimum=0.0, maximum=200.0
    )
    storm_return_years: tuple[float, ...] = tool.ask(
        "numbers",
        "Mean time between storms that break snags on this site",
        minimum=0.0,
        exclusive=True,
        most_count=2,
        ascending=True,
        unit="years",
        help="One number, or the two ends of a range. No published number of a site is known.",
    )
    ranges: str | None = tool.text(
        "Other ranges of the processes",
        default=None,
        help="NAME=LOW:HIGH, separated by commas: fall_per_year=0.03:0.1,storm_share=0.2:0.3. processes.csv lists the "
        "names.",
    )
    draws: int = tool.integer("Draws of all numbers", default=1000, minimum=20, maximum=100_000)


def reported_years(asked: Sequence[float], years: int) -> list[int]:
    """The whole years of ``--report-years`` within ``--years``."""
    if reported := [int(each) for each in asked if each == int(each) and each <= years]:
        return reported
    raise UserError(f"--report-years names no whole year up to --years {years}")


def process_rows(spans: dict[str, tuple[float, float]]) -> list[dict[str, Any]]:
    """The processes that were used, with the ranges from which they were drawn."""
    rows = []
    for name, (low, high) in spans.items():
        row = asdict(PROCESSES[name])
        kept = {key: row[key] for key in ("name", "about", "unit")}
        told = {key: row[key] for key in ("species", "source", "known")}
        yours = PROCESSES[name].span != (low, high)
        rows.append(kept | {"low": low, "high": high, "given_by_user": int(yours)} | told)
    return rows
