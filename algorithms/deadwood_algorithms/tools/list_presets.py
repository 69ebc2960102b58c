"""List the numbers that can be picked by name: what each says, which option takes it, and where it is from.

    deadwood-tool list-presets
    deadwood-tool list-presets --output presets.csv

A preset sets only what is not given: an option that you give goes before it, and the tool says both. What it set
stands, with its source, in the `manifest.json` of the tools that write a folder. `import-trees --dbh-law` and
`generate-forest --dbh-law` take the laws between height and DBH, which are listed too.

No preset fits a place because it has a name. Those of the paper are two events in the Alps, those of woods are means
of their species, the classes of barriers are made for rocks. What is right here a person decides.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.presets import Listed, listed
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool
from deadwood_algorithms.prepare.trees.allometry import ABOUT, PUBLISHED, SOURCES_OF_LAWS


@dataclass(frozen=True, kw_only=True)
class Ask:
    output: str | None = tool.output_table("The list as a table", default=None, help="Without it, it is only shown.")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    rows = [*listed(), *laws()]
    if ask.output:
        import pandas

        from deadwood_algorithms.files.tables import write_csv
        from deadwood_algorithms.results.identity import writing

        with writing(TOOL, ask, feedback) as outputs:
            write_csv(outputs.file("output", ".csv"), pandas.DataFrame([asdict(each) for each in rows]))
    made = {"output": Path(ask.output)} if ask.output else {}
    return Outcome(made, {"presets": [asdict(each) for each in rows]}, tuple(lines_of(rows)))


def laws() -> list[Listed]:
    """The published laws between DBH and height, as rows of the list."""
    return [
        Listed("import-trees, generate-forest", "--dbh-law", name, str(law), ABOUT[name], SOURCES_OF_LAWS[name])
        for name, law in PUBLISHED.items()
    ]


def lines_of(rows: list[Listed]) -> list[str]:
    """By option, each name with what it says and where it is from."""
    shown, last = [], ""
    for each in rows:
        heading = f"{each.option} of {each.tools}"
        if heading != last:
            shown.append(heading)
            last = heading
        mind = f"; {each.mind}" if each.mind else ""
        shown += [f"  {each.name}: {each.about}", f"    {each.values}", f"    source: {each.source}{mind}"]
    return shown


TOOL = Tool("list-presets", "Prepare", "List what can be picked by name, with its values and source", Ask, run)
