"""Look at a file before it is used: what it is taken for and why, what becomes of each column, and what is doubted.

    deadwood-tool inspect sample_data/trees.csv
    deadwood-tool inspect sample_data/dem.tif --as dem

The file is read as the tools read it in that role, with the same checks, and nothing is written. Without ``--as`` the
role follows from the file: a raster is a terrain model, a canopy model or friction, lines are roads or barriers, points
and polygons are trees, releases or release areas, by their columns. The report ends with the commands that use it.

The exit status is 0 if the file can be used, 3 if something about it is doubted, and 2 if it cannot be used in that
role.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.messages import NOTE, warnings_among
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

DOUBTED = 3  # exit status; an input that cannot be used is the user's error, 2
SLIDE = "slide-logs --dem {} --releases {} --friction {} --output run"
# What each role is, and the command that uses a file in it; words in capitals stand for the user's other inputs.
ROLES: dict[str, tuple[str, str]] = {
    "dem": ("a terrain model", "explore --dem {file}{options}"),
    "chm": ("a canopy height model", "find-trees --chm {file}{options} --output trees.gpkg"),
    "friction": ("friction", SLIDE.format("DEM", "RELEASES", "{file}")),
    "trees": ("single trees", "import-trees --trees {file} --dem DEM{options} --output trees_imported.gpkg"),
    "releases": ("releases of logs", SLIDE.format("DEM", "{file}", "0.25")),
    "lines": ("roads, railways, houses", SLIDE.format("DEM", "RELEASES", "0.25") + " --lines {file}"),
    "areas": ("release areas", "sample-releases --areas {file} --dem DEM --output releases.gpkg"),
    "barriers": ("barriers", SLIDE.format("DEM", "RELEASES", "0.25") + " --barriers {file}"),
}
READY_TREES = "explore --dem DEM --trees {file}"  # of a layer as import-trees writes it


@dataclass(frozen=True, kw_only=True)
class Ask:
    path: str = tool.file("File to look at", positional=True)
    as_: str | None = tool.choice(
        "Role in which it is to be used", *ROLES, default=None, help="Without it: what it looks like."
    )


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.inspection.look import look, role_of

    facts: dict[str, Any] = {"role": ask.as_, "why": "--as", "columns": {}, "doubts": [], "notes": [], "commands": []}
    try:
        if ask.as_ is None:
            facts["role"], facts["why"] = role_of(ask.path)
        seen = look(ask.path, facts["role"], feedback)
    except UserError as error:
        taken = f"taken for {ROLES[facts['role']][0]} ({facts['why']}): " if facts["role"] else ""
        raise UserError(f"{taken}{error}") from error  # the text may end with a command
    options = "".join(f" {each}" for each in seen.options)
    ready = facts["role"] == "trees" and {"dbh_cm", "height_m"} <= set(seen.columns)
    known = READY_TREES if ready else ROLES[facts["role"]][1]
    doubts = [each.record() for each in warnings_among(seen.messages)]
    facts |= {"counted": seen.counted, "columns": seen.columns, "doubts": doubts}
    facts["notes"] = [each.text for each in seen.messages if each.level == NOTE]
    facts["commands"] = [f"deadwood-tool {known.format(file=quoted(ask.path), options=options)}"]
    return Outcome({}, facts, lines_of(ask.path, facts), DOUBTED if doubts else 0)


def lines_of(path: str, facts: dict[str, Any]) -> tuple[str, ...]:
    """The report, as lines of text."""
    lines = [f"{path}: taken for {ROLES[facts['role']][0]} ({facts['why']})", facts["counted"]]
    lines += [f"field {name}: {becomes}" for name, becomes in facts["columns"].items()]
    lines += [f"note: {each}" for each in facts["notes"]]
    lines += [f"doubted ({each['code']}): {each['text']}" for each in facts["doubts"]]
    lines += [f"use: {each}" for each in facts["commands"]]
    return tuple(lines)


TOOL = Tool("inspect", "Prepare", "Look at a file before it is used: what it is taken for, what is doubted", Ask, run)
