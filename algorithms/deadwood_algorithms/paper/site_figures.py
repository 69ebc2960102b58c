"""A site's figures beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.paper.evidence import jumps
from deadwood_algorithms.paper.finding import Evidence
from deadwood_algorithms.paper.pictures import draw_hits, draw_jump, draw_sweeps
from deadwood_algorithms.paper.site_runs import SiteRuns
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.results.run_folder import read_run
from deadwood_algorithms.stats.statistics import percent_with_interval


def figures_of(runs: SiteRuns, of: Evidence) -> list[tuple[str, Path]]:
    """The figures to be shown beside the paper's."""
    layers, made = runs.site.layers, []

    def panels(names: Sequence[str]) -> list[Any]:
        out = []
        for name in names:
            forest = "als" if name in ("protected", "barriers") else name
            over = {"trees": runs.trees[forest], "lines": layers["lines"], "releases": layers["releases"]}
            over |= {"barriers": layers["barriers"]} if name in ("protected", "barriers") else {}
            over |= {"dams": layers["dams"]} if name == "protected" else {}
            p = of.reach(name)
            record = {"p": p["value"], "ci_low": p["ci_low"], "ci_high": p["ci_high"]}
            share = percent_with_interval({**record, "n_reach": p["value"], "n_total": 1.0})  # none, all, or between
            out.append((f"{name}: {share} reach the road", runs.slide(name), runs.terrains[name], over))
        return out

    sets = (
        {"Fig. 3": ("als", "protected", "random", "none")}
        if runs.klosters
        else {
            "Fig. 4a-b": ("barriers", "als"),
            "Fig. A1": ("none", "random"),
        }
    )
    for title, names in sets.items():
        path = runs.results / f"{title.replace('. ', '_').replace(' ', '').lower()}.png"
        draw_hits(path, f"As the paper's {title}, {runs.site.name}", panels(names))
        made.append((f"{runs.site.name}: as the paper's {title}", path))
    if of.sweeps:
        path = runs.results / "friction.png"
        draw_sweeps(path, of.sweeps, runs.site.facts["road"])
        made.append((f"{runs.site.name}: friction and cells (5.1, 6.1)", path))
    for path in sorted((runs.results / "flight").glob("*.png")):
        made.append((f"{runs.site.name}: as the paper's Fig. 4c, the flight", path))
    jumped = jumps(runs, of) if of.jumped else []
    if jumped:
        row = jumped[len(jumped) // 2]
        poses = next(iter(read_run(str(runs.slide("barriers")), feedback=Quiet()).poses(np.array([row["log_id"]]))))
        path = runs.results / "fig_b1.png"
        said = f"log {row['log_id']}: {row['speed_ms']:.1f} m/s at the terrace, jump {row['jump_m']:.1f} m"
        draw_jump(path, poses, runs.site.dem, said, row["t_s"])
        made.append((f"{runs.site.name}: as the paper's Fig. B1", path))
    return made
