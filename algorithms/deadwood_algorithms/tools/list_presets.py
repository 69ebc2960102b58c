"""List all that can be picked by name: presets, and the laws between DBH and height.

What ``deadwood-tool list --presets`` shows; as a tool of its own it goes with the next version.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.presets import Listed, listed
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool
from deadwood_algorithms.prepare.trees.allometry import ABOUT, NAMED_LAWS, SOURCES_OF_LAWS


@dataclass(frozen=True, kw_only=True)
class Ask:
    output: str | None = tool.output_table("The list as a table", default=None, help="Without it, it is only shown.")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    rows = preset_rows()
    if ask.output:
        import pandas

        from deadwood_algorithms.files.tables import write_csv
        from deadwood_algorithms.results.identity import writing

        with writing(TOOL, ask, feedback) as outputs:
            write_csv(outputs.file("output", ".csv"), pandas.DataFrame([asdict(each) for each in rows]))
    made = {"output": Path(ask.output)} if ask.output else {}
    return Outcome(made, {"presets": [asdict(each) for each in rows]}, tuple(preset_lines(rows)))


def preset_rows() -> list[Listed]:
    tools = "import-trees, find-trees, generate-forest"
    laws = [
        Listed(tools, "--dbh-law", name, str(law), ABOUT[name], SOURCES_OF_LAWS[name])
        for name, law in NAMED_LAWS.items()
    ]
    return [*listed(), *laws]


def preset_lines(rows: Sequence[Listed]) -> list[str]:
    """By option, each name with its content and source."""
    shown, last = [], ""
    for each in rows:
        heading = f"{each.option} of {each.tools}"
        if heading != last:
            shown.append(heading)
            last = heading
        mind = f"; {each.mind}" if each.mind else ""
        shown += [f"  {each.name}: {each.about}", f"    {each.values}", f"    source: {each.source}{mind}"]
    return shown


TOOL = Tool("list-presets", "Prepare", "List the presets, with their values and sources", Ask, run, False)
