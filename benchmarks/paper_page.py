"""Write docs/paper.md from a run of `reproduce-paper`: what of the paper holds on the twins, and why.

deadwood-tool reproduce-paper --logs 5000 --output findings
python -m benchmarks.paper_page findings
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from PIL import Image

from deadwood_algorithms.params.manifest import engine_digest

from . import engines, study

PAGE = Path(__file__).parents[1] / "docs" / "paper.md"
FIGURES = {
    "fig_3.png": "as the paper's figure 3: where logs of the Klosters-like twin pass, with each forest and without",
    "fig_4a-b.png": "as figure 4: the Rothenbrunnen-like twin with and without barriers",
    "fig_a1.png": "as figure A1: the same without forest and with a random one",
    "fig_b1.png": "as figure B1: a jump from the terrace over the barrier",
}
WIDTH = 1100  # pixels
HEAD = """# The paper, statement by statement

The paper's findings on two Swiss slopes, tested on two synthetic twins of these slopes. What is tested is a finding (an
order, a direction, the size of a ratio), not a number that belongs to another slope. The twins (version 2) and the
rules of assessment were fixed, in separate commits, before the first log slid ([their numbers, each with its source,
and what was fixed when](../algorithms/deadwood_algorithms/paper/README.md)); nothing was tuned afterwards. With the
data of the real sites the same command tests the findings there (`--site-data`).

There are four verdicts. A finding **holds** if its whole 95 % interval satisfies the rule, **does not hold** if no part
of it does, and is **not decided** otherwise. It **cannot be judged here** if the twin was built so that it holds, or if
most of the bodies concerned hardly move. Intervals cover sampling only; the panels below show how far a finding depends
on a chosen number of the twin. *Cone* is the toolbox's log, *cloud* the paper's body-fixed points (rings of
`make-log`), with a tenth of the logs at `draft`.
"""
PANEL = """## With one choice changed

Each finding that the panel's runs can assess, with one chosen number of the twin changed at a time: {logs} logs per
run at `draft`, so compare with the first row of the panel. **Bold** marks a verdict that differs from that row. Relief
and forest are one random draw; two more draws are among the rows.
"""
MOVES = """## What changes a verdict

From the panels only; "with none of them" means that no tested choice changes the verdict.
"""


def number(each: dict[str, Any]) -> str:
    """The figure with its interval."""
    shown = "-" if each["ours"] is None else f"{each['ours']:.3g}"
    if each["ci_low"] is not None or each["ci_high"] is not None:
        ends = ("-" if each[end] is None else f"{each[end]:.3g}" for end in ("ci_low", "ci_high"))
        shown += f" ({' to '.join(ends)})"
    return shown


def shown(finding: dict[str, Any] | None) -> str:
    """The figure with its interval, and the verdict."""
    return f"{number(finding)}: **{finding['verdict']}**" if finding else ""


def table(findings: list[dict[str, Any]]) -> str:
    """Both conventions of the log side by side."""
    cloud = {each["id"].removesuffix(".cloud"): each for each in findings if each["id"].endswith(".cloud")}
    lines = ["| finding | section | the paper | cone | cloud | why |", "| --- | --- | --- | --- | --- | --- |"]
    for each in cones(findings):
        other = cloud.get(each["id"])
        why = each["why"] + (f" *Cloud:* {other['why']}" if other else "")
        site, name = each["id"].split(".", 1)
        cells = (
            f"**{site}** `{name}`: {each['statement']}",
            each["section"],
            each["paper"],
            shown(each),
            shown(other),
            why,
        )
        lines.append("| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |")
    return "\n".join(lines)


def cones(findings: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [each for each in findings if not each["id"].endswith(".cloud")]


def panel(findings: list[dict[str, Any]], site: str) -> str:
    """A row for each changed choice, a column for each finding."""
    mine = [each for each in cones(findings) if each["id"].startswith(f"{site}.") and each["panel"]]
    names = [each["id"].split(".", 1)[1] for each in mine]
    rows = list(dict.fromkeys(part["what"] for each in mine for part in each["panel"]))
    lines = [
        f"| {site}: what is changed | {' | '.join(f'`{name}`' for name in names)} |",
        "| --- |" + " --- |" * len(names),
    ]
    for what in rows:
        cells = []
        for each in mine:
            part = next((part for part in each["panel"] if part["what"] == what), None)
            turned = part is not None and part["verdict"] != each["panel"][0]["verdict"]
            mark = "**" if turned else ""
            cells.append(f"{number(part)}: {mark}{part['verdict']}{mark}" if part else "")
        lines.append(f"| {what} | {' | '.join(cells)} |")
    return "\n".join(lines)


def moves(findings: list[dict[str, Any]]) -> str:
    """Which choices change a finding's verdict in the panel."""
    lines = []
    for each in cones(findings):
        if not each["panel"]:
            continue
        base, *others = each["panel"]
        turned: dict[str, list[str]] = {}
        for part in others:
            if part["verdict"] != base["verdict"]:
                turned.setdefault(part["verdict"], []).append(part["what"])
        text = (
            "; ".join(f"{verdict} with {', '.join(parts)}" for verdict, parts in turned.items()) or "with none of them"
        )
        lines.append(f"- `{each['id']}` ({base['verdict']}): {text}")
    return "\n".join(lines)


def counted(findings: list[dict[str, Any]]) -> str:
    of = [each["verdict"] for each in cones(findings)]
    text = ", ".join(f"{of.count(verdict)} {words}" for verdict, words in (
        ("holds", "hold"), ("does not hold", "do not hold"), ("not decided", "are not decided"),
        ("cannot be judged here", "cannot be judged here"),
    ))  # fmt: skip
    return f"Of {len(of)} findings {text}."


def main() -> None:
    folder = Path(sys.argv[1])
    findings = json.loads((folder / "findings.json").read_text(encoding="utf-8"))
    made = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    asked = made["parameters"]
    if asked["quick"]:
        raise SystemExit("a --quick run judges nothing")
    if made["engine"] != engine_digest():
        raise SystemExit(f"the findings are of another engine ({made['engine']}): write the page with that one")
    (PAGE.parent / "figures").mkdir(exist_ok=True)
    pictures = []
    for name, title in FIGURES.items():
        for place in sorted(folder.glob(f"*/results/{name}")):
            with Image.open(place) as whole:
                small = whole.convert("RGB")
            small.thumbnail((WIDTH, 4 * WIDTH))
            target = PAGE.parent / "figures" / f"paper_{place.stem}.webp"
            small.save(target, quality=82)
            pictures.append(f"![{title}](figures/{target.name})\n\n*{title[0].upper()}{title[1:]}*\n")
    where = study.provenance()
    text = (
        f"Made by `deadwood-tool reproduce-paper --logs {asked['logs']} --seed {asked['seed']} --fidelity "
        f"{asked['fidelity']} --deciding-logs {asked['deciding_logs']}` and `python -m benchmarks.paper_page`; toolbox "
        f"{made['version']}, engine {where['engine']}; {where['machine']}; {where['versions']}; {where['date']}."
    )
    sites = list(dict.fromkeys(each["id"].split(".")[0] for each in findings if each["panel"]))
    parts = [HEAD, counted(findings), table(findings)]
    if sites:
        parts += [MOVES, moves(findings), PANEL.format(logs=asked["logs"] // 10)]
        parts += [panel(findings, site) for site in sites]
    parts += ["\n".join(pictures), text]
    page = "\n\n".join(part.strip() for part in parts) + "\n"
    engines.write(PAGE, page)
    print(f"wrote {PAGE.name}: {counted(findings)}")


if __name__ == "__main__":
    main()
