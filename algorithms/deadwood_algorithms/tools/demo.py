"""Make a complete case without any input: the paper's Klosters case in small, with three forests and a picture.

It writes a synthetic slope (nothing of it is measured) with a road at its foot, releases in a circle of 10 m, a forest,
as if mapped, that leaves a gully free, and a random forest of the same density. The same logs then slide through the
mapped forest, through the random one and without forest, and `report.html` shows the three side by side. Every step is
done by the tools themselves, and the folder holds their inputs and outputs: its manifests are enough to repeat each
step.

The paper found for its own slope that by far the most logs reach the road without forest, that a random forest lets no
more through than the mapped one, and that the deposits spread wider with a forest than without.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Stage, Tool
from deadwood_algorithms.tools import (
    generate_forest,
    lateral_spread,
    make_report,
    reach_lines,
    sample_releases,
    slide_logs,
)

FRICTION = 0.25  # the paper's, for a DEM of 0.5 m
FORESTS = ("mapped", "random", "none")
PAPER = "the paper's findings, one by one, on slopes made for them: deadwood-tool reproduce-paper --output paper"


@dataclass(frozen=True, kw_only=True)
class Ask:
    logs: int = tool.integer("Logs released in each forest", default=2000, minimum=1, maximum=1_000_000)
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="standard")
    seed: int = tool.seed()
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    output: str = tool.output_folder("Folder of the demo")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.prepare.demo_slope.demo_figure import draw
    from deadwood_algorithms.prepare.demo_slope.demo_layers import write_sample
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import write_json
    from deadwood_algorithms.simulate.warm_up import load_kernels

    final = Path(ask.output)
    with result_folder(TOOL, ask, feedback) as folder:
        load_kernels(None, feedback)  # here, because messages of the steps are not passed on
        write_sample(folder)
        sample_releases.TOOL(
            feedback=Stage(feedback, "releases"),
            areas=str(folder / "release_area.gpkg"),
            dem=str(folder / "dem.tif"),
            count=ask.logs,
            seed=ask.seed,
            output=str(folder / "releases.gpkg"),
        )
        generate_forest.TOOL(
            feedback=Stage(feedback, "random forest"),
            dem=str(folder / "dem.tif"),
            like=str(folder / "trees_mapped.gpkg"),
            stand=str(folder / "forest.gpkg"),
            seed=ask.seed,
            output=str(folder / "trees_random.gpkg"),
        )

        summaries = {forest: one_forest(ask, folder, forest, feedback) for forest in FORESTS}

        draw(folder, FORESTS, summaries, folder / "demo.png")
        make_report.TOOL(
            feedback=Stage(feedback, "report"),
            runs=",".join(str(folder / f"run_{forest}") for forest in reversed(FORESTS)),  # compared with none
            names=",".join(reversed(FORESTS)),
            output=str(folder / "report.html"),
        )
        write_json(folder / "demo.json", {"forests": summaries, "paper": PAPER})
    outputs = {"output": final, "picture": final / "demo.png", "report": final / "report.html"} | {
        name: final / f"run_{name}" for name in FORESTS
    }
    return Outcome(outputs, {"forests": summaries}, (*table(summaries), made_with(ask, summaries)))


def one_forest(ask: Ask, folder: Path, forest: str, feedback: Feedback) -> dict[str, Any]:
    """Slide the logs through one of the forests and evaluate the run; returns its summary."""
    place = folder / f"run_{forest}"
    slide_logs.TOOL(
        feedback=Stage(feedback, f"forest {FORESTS.index(forest) + 1} of {len(FORESTS)} ({forest})"),
        dem=str(folder / "dem.tif"),
        releases=str(folder / "releases.gpkg"),
        trees=None if forest == "none" else str(folder / f"trees_{forest}.gpkg"),
        lines=str(folder / "road.gpkg"),
        friction=FRICTION,
        fidelity=ask.fidelity,
        threads=ask.threads,
        seed=ask.seed,
        output=str(place),
    )
    lateral_spread.TOOL(deposits=str(place), output=str(folder / f"spread_{forest}.gpkg"))
    arrivals = folder / f"arrivals_{forest}.gpkg"
    reach_lines.TOOL(run=str(place), lines=str(folder / "road.gpkg"), output=str(arrivals))
    summary = json.loads((place / "summary.json").read_text(encoding="utf-8"))
    summary["speed"]["mean_to_road_ms"] = mean_speed_of(arrivals)
    return summary


def mean_speed_of(arrivals: Path) -> float | None:
    """Mean, over the logs that arrive, of their mean speed up to the road, beyond which they only roll to and fro
    [m/s].
    """
    from deadwood_algorithms.files.vectors import read_table

    rows = read_table(f"{arrivals}|layername=arrivals", what="arrivals")
    return float(np.mean(rows["path_m"].to_numpy() / rows["t_s"].to_numpy())) if len(rows) else None


def table(summaries: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """The three forests side by side, and where the paper's findings are."""
    from deadwood_algorithms.stats.statistics import percent_with_interval

    rows = [
        ("forest", "reach the road (95 % interval)", "spread", "5-95 %", "held by trees", "mean to road", "max speed")
    ]
    for forest, each in summaries.items():
        spread, speed, logs = each["spread"][0], each["speed"], each["logs"]
        held = logs["by_stop_reason"]["tree"] / logs["released"]
        rows.append(
            (
                forest,
                percent_with_interval(each["reach"][0]),
                _degrees(spread["spread_deg"]),
                _degrees(spread["p05_p95_deg"]),
                f"{100 * held:.0f} %",
                _speed(speed["mean_to_road_ms"]),
                _speed(speed["max_ms"]),
            )
        )
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return (*lines, PAPER)


def made_with(ask: Ask, summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """The scenario of the numbers: they depend on seed and version, the seconds on the machine."""
    from deadwood_algorithms.results.scenario import posture_words

    logs = summaries["none"]["scenario"]["logs"]
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "numba", "rasterio"))
    seconds = sum(each["cost"]["cpu_s"] for each in summaries.values())
    return (
        f"scenario: {counted(ask.logs, 'log')} per forest, {posture_words(logs)}, friction {FRICTION:g}, "
        f"{ask.fidelity}, seed {ask.seed}; deadwood-tool {tool.VERSION}, {versions}; "
        f"{seconds:.0f} CPU seconds of sliding on {os.cpu_count()} cores ({platform.machine()})"
    )


def _degrees(angle: float | None) -> str:
    return "-" if angle is None else f"{angle:.0f}°"


def _speed(speed: float | None) -> str:
    return "-" if speed is None else f"{speed:.1f} m/s"


TOOL = Tool(
    "demo",
    "Simulate",
    "Run a complete synthetic case: three forests, a table, a picture",
    Ask,
    run,
    in_qgis=False,
    then="deadwood-tool explore --dem {output}/dem.tif --trees {output}/trees_mapped.gpkg --lines {output}/road.gpkg",
)
