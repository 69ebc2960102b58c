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

from . import study

PAGE = Path(__file__).parents[1] / "docs" / "paper.md"
FIGURES = {
    "fig_3.png": "as the paper's figure 3: where logs of the Klosters-like twin pass, with each forest and without",
    "fig_4a-b.png": "as figure 4: the Rothenbrunnen-like twin with and without barriers",
    "fig_a1.png": "as figure A1: the same without forest and with a random one",
    "fig_b1.png": "as figure B1: a jump from the terrace over the barrier",
}
WIDTH = 1100  # pixels
WORDS = {True: "yes", False: "**no**", None: "not decided"}
HEAD = """# The paper, statement by statement

What the paper found on two Swiss slopes, looked for on two synthetic twins of them. Judged is a finding (an order, a
direction, the size of a ratio), not another slope's number. The twins and the rules were fixed, in commits of their
own, before the first log slid ([their numbers, each with its
source](../algorithms/deadwood_algorithms/paper/README.md)), and nothing is tuned to please: where a finding does not
hold, the table says so, with the run that shows it. With the data of the real sites the same command judges those
(`--site-data`).

Each log slides twice: as the smooth cone, the toolbox's own geometry, and as the paper's body-fixed point cloud (rings
of `make-log`; column *cloud*). Intervals are 95 % and tell sampling alone.
"""


AFTERWARDS = """## What does not hold, and what is known of why

- **Slower on average than the paper's logs, and the road is reached at a friction at which the paper's is not.** The
  share that reaches falls slowly with friction: the twin's 35 degrees are a tangent of 0.70, far above any friction of
  the sweep, so what stops a log there is trees and roughness. The roughness of the twins was chosen (their table of
  numbers), the real one is not known to us. Whether a rougher ground gives both findings at once is not tested, for
  nothing is tuned here; nor was the sweep of friction slid with the cloud.
- **Rocks spread wider than logs, cubic ones as wide as platy ones.** The paper's rocks meet the ground parameters of
  RAMMS::Rockfall; ours have the same contact as the logs with a friction of 0.5. The finding is about that other model
  of the ground as much as about shape, and this toolbox does not have it.
- **Take-off at the terrace.** The largest friction at which a log is as fast as the parabola asks is the paper's bound
  itself, by one log in a thousand. Logs that pass the terrace and reach the road mostly do so slower than the event's
  did; the table has the slowest and the fastest.
- **What depends on the convention of the log:** of the findings that were run with both, none turns from yes to no. The
  cloud lets fewer logs jump the barrier, which decides that finding; reach with forest is a few points lower.
"""


def shown(finding: dict[str, Any] | None) -> str:
    """The figure with its interval, and whether it holds."""
    if finding is None:
        return ""
    number = "-" if finding["ours"] is None else f"{finding['ours']:.3g}"
    if finding["ci_low"] is not None or finding["ci_high"] is not None:
        ends = ("-" if finding[end] is None else f"{finding[end]:.3g}" for end in ("ci_low", "ci_high"))
        number += f" ({' to '.join(ends)})"
    return f"{number}: {WORDS[finding['holds']]}"


def table(findings: list[dict[str, Any]]) -> str:
    """Both conventions of the log side by side."""
    cloud = {each["id"].removesuffix(".cloud"): each for each in findings if each["id"].endswith(".cloud")}
    lines = [
        "| finding | section | the paper | cone: holds | cloud: holds | why |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for each in findings:
        if each["id"].endswith(".cloud"):
            continue
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


def counted(findings: list[dict[str, Any]], cloud: bool) -> str:
    of = [each["holds"] for each in findings if each["id"].endswith(".cloud") == cloud]
    return f"{of.count(True)} of {len(of)} hold, {of.count(False)} do not, {of.count(None)} are not decided"


def main() -> None:
    folder = Path(sys.argv[1])
    findings = json.loads((folder / "findings.json").read_text(encoding="utf-8"))
    made = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    asked = made["parameters"]
    if asked["quick"]:
        raise SystemExit("a --quick run judges nothing")
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
    told = (
        f"Made by `deadwood-tool reproduce-paper --logs {asked['logs']} --seed {asked['seed']} "
        f"--fidelity {asked['fidelity']}` and `python -m benchmarks.paper_page`; toolbox {made['version']}, engine "
        f"{made['engine']}; {where['machine']}; {where['versions']}; {where['date']}."
    )
    counts = f"As the cone, {counted(findings, False)}; as the cloud, {counted(findings, True)}."
    parts = [HEAD, counts, table(findings), AFTERWARDS, "\n".join(pictures), told]
    PAGE.write_text("\n\n".join(part.strip() for part in parts) + "\n", encoding="utf-8")
    print(f"wrote {PAGE.name}: {counts}")


if __name__ == "__main__":
    main()
