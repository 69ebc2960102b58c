"""The options of a run of released logs, by group, other than its scene and where it slides."""

from __future__ import annotations

from dataclasses import dataclass

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import UserError

AUTO = "auto"  # the fidelity that is chosen by --error or --budget


@dataclass(frozen=True, kw_only=True)
class FidelityOptions:
    """How accurately logs slide, or which error of the reach is permitted."""

    fidelity: str = tool.choice(
        "Speed against accuracy",
        "draft",
        "standard",
        "fine",
        "reference",
        AUTO,
        default="standard",
        help="auto: the cheapest that keeps --error, or the best within --budget.",
    )
    error: float | None = tool.number(
        "Permitted error of the reach of a line, with fidelity auto",
        advanced=True,
        default=None,
        minimum=0.0,
        maximum=0.5,
        exclusive=True,
        help="0.02 means ±2 points from what reference would give, at 95 %, by sampling and by calculation together. "
        "Needs --lines.",
    )
    budget: str | None = tool.text(
        "Time for the run in place of that error, with fidelity auto",
        advanced=True,
        default=None,
        help="60s, 5min or 1h: the most accurate fidelity and number of logs for that time on this machine, within "
        "about a tenth. --report and --qgis-project take additional time.",
    )
    assume: str = tool.choice(
        "Errors of calculation taken from the benchmark's slopes, with fidelity auto",
        "none",
        "standard",
        "draft",
        default="standard",
        advanced=True,
        help="none: nothing, so that reference is used. standard: the errors of standard and fine. draft: that of "
        "draft as well.",
    )
    time_step_s: float | None = tool.number(
        "Longest time step, instead of the fidelity's",
        unit="s",
        default=None,
        minimum=1e-5,
        maximum=1.0,
        advanced=True,
    )
    station_spacing_m: float | None = tool.number(
        "Spacing of the contact stations, instead of the fidelity's",
        unit="m",
        default=None,
        minimum=1e-3,
        maximum=100.0,
        advanced=True,
    )
    own_slope: str | None = tool.text(
        "Logs of the run that slide again at a finer fidelity: how many, or none",
        advanced=True,
        default=None,
        help="Shows how far the reach of each line is off on this slope. If no number is given, 200, or down to 100 so "
        "that they take at most a fifth of the run's time; with --budget none. Needs --lines.",
    )

    @property
    def own_slope_logs(self) -> int | None:
        """How many logs slide again; None if the run decides."""
        name = "" if self.own_slope is None else str(self.own_slope).strip().lower()
        if name == "none" or (not name and self.budget is not None):
            return 0
        if name.isdigit():
            return int(name)
        if name:
            raise UserError(f"--own-slope is '{self.own_slope}', but must be none or a whole number")
        return None


@dataclass(frozen=True, kw_only=True)
class KeptOptions:
    """How many logs slide, over which frictions their reach is given, and which of their results are stored."""

    friction_range: str | None = tool.text(
        "Friction over which the reach of lines is given, too: LOW-HIGH, or auto",
        advanced=True,
        default=None,
        help="0.2-0.3, for example; auto takes the range of the preset or, without one, of the table (list --presets). "
        "A part of the logs slides again at draft, at both ends and, if the posture at the start is assumed, in "
        "another one: about a third more time. Needs --lines and a friction that is a number.",
    )

    trajectories: str = tool.text(
        "Logs whose trajectory is kept: all, none, or how many",
        advanced=True,
        default="1000",
        help="Chosen by seed and log_id alone.",
    )
    until_ci: float | None = tool.number(
        "End when every line's reach interval is this narrow (half-width)",
        advanced=True,
        default=None,
        minimum=1e-4,
        maximum=0.5,
        help="0.005 means ±0.5 points. Logs run in a random order, at most all. Checks after 1000, 2000, 4000, ... "
        "logs use intervals widened for the repetition; the reported 95 % intervals are narrower. Needs --lines.",
    )
    danger_least: int = tool.integer(
        "Minimum number of passing logs for which a cell has a value",
        default=10,
        minimum=1,
        advanced=True,
        help="In danger.tif, which --lines brings, cells with fewer are transparent.",
    )
    danger_counts: bool = tool.flag(
        "Also keep the counts of danger.tif",
        advanced=True,
        help="danger_count.tif, from which those of several runs add up; run-sites asks for it.",
    )

    def refuse_without_lines(self, lines: str | None) -> None:
        for flag, given in (("--until-ci", self.until_ci), ("--friction-range", self.friction_range)):
            if given is not None and lines is None:
                raise UserError(f"{flag} needs --lines: it is about the reach of lines")

    @property
    def trajectories_kept(self) -> int | None:
        """How many logs keep their trajectory; None for all."""
        name = str(self.trajectories).strip().lower()
        if name == "all":
            return None
        if name == "none":
            return 0
        if name.isdigit():
            return int(name)
        raise UserError(f"--trajectories is '{self.trajectories}', but must be all, none or a whole number")


@dataclass(frozen=True, kw_only=True)
class CapacityOptions:
    """The capacity of logs, to count the hits that exceed it."""

    log_capacity_kj: float | None = tool.number(
        "Energy that a log of 40 cm DBH can lose in a hit before it breaks, to count the hits above",
        unit="kJ",
        default=None,
        minimum=0.0,
        exclusive=True,
        advanced=True,
    )
    log_capacity_power: float = tool.number(
        "Exponent of DBH / 40 cm with which that grows", default=2.0, minimum=0.0, maximum=6.0, advanced=True
    )


@dataclass(frozen=True, kw_only=True)
class AddedOptions:
    """What is written beside the results themselves."""

    qgis_project: bool = tool.flag(
        "Add a QGIS project to the run",
        advanced=True,
        help="With styled and grouped layers, animated logs and a 3-D view: project.qgz, and scene.gpkg beside it.",
    )
    outline_every_s: float = tool.number(
        "Time between two outlines of the animated logs",
        unit="s",
        default=0.25,
        minimum=0.02,
        advanced=True,
        help="In the QGIS project, for the logs that keep their trajectory.",
    )
    geoparquet: bool = tool.flag(
        "Write the run's layers as GeoParquet too",
        advanced=True,
        help="deposits.parquet, trajectories.parquet and so on, for programs that work on very many rows.",
    )
    report: bool = tool.flag(
        "Add a report to the run", help="One page with maps, figures, tables and a 3-D view: report.html (make-report)."
    )
