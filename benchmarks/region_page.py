"""Write docs/region.md: the cost of sliding the logs of a canton, and of all protection forest in Switzerland.

python -m benchmarks.region_page --measure     the cost of a run besides sliding: measured on the sample, region.json
python -m benchmarks.region_page               the page from results.json and region.json
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import sample_releases, slide_logs

from . import engines, study

HERE = Path(__file__).parent
PAGE, MEASURED, SAMPLE = HERE.parent / "docs" / "region.md", HERE / "region.json", HERE.parent / "sample_data"
LOGS_A_HECTARE = (10, 100, 1000)
SHARE = 0.1  # share for which the interval of one hectare is reported
CORES = (16, 256)
# Ground with the most expensive and the cheapest logs of the study: bare and rough, and a forest that stops logs early.
SCENES = ("forest", "rough", "gully")
FIDELITIES = ("draft", "standard")
KM2_A_SITE, CELL_M = 1.0, 0.5
FEW, MANY = 400, 4000  # logs of the two runs from which the cost of each further log is measured


@dataclass(frozen=True)
class Region:
    """A region; ``source`` is the source of its area."""

    name: str
    hectares: float
    source: str


REGIONS = (
    Region(
        "the protection forest of Graubünden",
        209_800 * 0.61,
        "209 800 ha of forest ([LFI4](https://gr.ch/DE/institutionen/verwaltung/diem/awn/wald/multitalentwald/Seiten/"
        "waldflaeche.aspx)), of which [about 61 %](https://www.gr.ch/DE/institutionen/verwaltung/diem/awn/wald/"
        "multitalentwald/Seiten/default.aspx) is protection forest",
    ),
    Region(
        "the protection forest of Switzerland",
        600_000,
        "[6000 km²](https://www.foretsuisse.ch/fr/savoir/les-prestations-de-la-foret/la-foret-protectrice), about half "
        "of all forest ([SilvaProtect-CH](https://www.bafu.admin.ch/bafu/fr/home/themen/thema-naturgefahren/"
        "naturgefahren--fachinformationen/naturgefahrensituation-und-raumnutzung/gefahrengrundlagen/"
        "silvaprotect-ch.html))",
    ),
)


def measure() -> dict[str, Any]:
    """Disk, memory and time of a run besides sliding, per log and per run."""
    from deadwood_algorithms.results.forecast import most_held

    found: dict[int, tuple[float, float, float, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for logs in (FEW, FEW, MANY):  # the first is not counted, because it loads kernels and libraries
            releases, run = Path(folder) / f"{logs}.gpkg", Path(folder) / str(logs)
            areas, dem = f"{SAMPLE / 'sample.gpkg'}|layername=release_area", str(SAMPLE / "dem.tif")
            sample_releases.TOOL(areas=areas, dem=dem, count=logs, output=str(releases), overwrite=True)
            given: dict[str, Any] = {
                "dem": dem,
                "releases": str(releases),
                "trees": str(SAMPLE / "trees.csv"),
                "friction": "0.4",
            }
            given |= {"lines": f"{SAMPLE / 'sample.gpkg'}|layername=lines", "fidelity": "draft"}
            for trajectories in ("none", "all") if logs == MANY else ("none",):
                began, before = time.perf_counter(), time.process_time()
                slide_logs.TOOL(**given, trajectories=trajectories, output=str(run), overwrite=True)
                wall = time.perf_counter() - began
                facts = json.loads((run / "summary.json").read_text(encoding="utf-8"))["cost"]
                size = sum(each.stat().st_size for each in run.iterdir())
                cpu = time.process_time() - before - facts["cpu_s"]
                found[logs if trajectories == "none" else 0] = (size, cpu, wall - facts["wall_s"], most_held())
    more = MANY - FEW
    return {
        "logs": [FEW, MANY],
        "disk_bytes_per_log": (found[MANY][0] - found[FEW][0]) / more,
        "disk_bytes_per_kept_log": (found[0][0] - found[MANY][0]) / MANY,
        "disk_bytes_per_run": found[FEW][0] - FEW * (found[MANY][0] - found[FEW][0]) / more,
        "other_cpu_s_per_run": found[FEW][1],
        "other_cpu_s_per_log": max(0.0, (found[MANY][1] - found[FEW][1]) / more),
        "memory_bytes": found[MANY][3],
        "source": study.provenance(),
    }


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def round_number(value: float) -> str:
    """Two digits, no exponent: 1 300, 45, 0.45."""
    if value < 9.95:
        return f"{value:.2g}"
    step = 10 ** max(0, len(f"{value:.0f}") - 2)
    return f"{round(value / step) * step:,.0f}".replace(",", " ")


def span(low_h: float, high_h: float) -> str:
    """A range of hours, in the unit of the larger."""
    unit, hours = "days", 24.0
    if high_h < 36.0:
        unit, hours = ("h", 1.0) if high_h >= 1.5 else ("min", 1.0 / 60.0)
    return f"{round_number(low_h / hours)} to {round_number(high_h / hours)} {unit}"


def core_hours(
    results: dict[str, Any], beside: dict[str, Any], logs: float, sites: float, scene: str, fidelity: str
) -> float:
    """CPU time of a number of logs at a number of sites [h]."""
    a_log = results["entries"][scene][fidelity]["cpu_ms_per_log"] / 1000.0 + beside["other_cpu_s_per_log"]
    return (logs * a_log + sites * beside["other_cpu_s_per_run"]) / 3600.0


def page(results: dict[str, Any], beside: dict[str, Any]) -> str:
    """The page; all its costs are from the two files."""
    entries = {(s, f): results["entries"][s][f] for s in SCENES for f in FIDELITIES}
    costs = table(
        ("CPU time of a log [ms]", *(results["scenes"][scene]["title"] for scene in SCENES)),
        [(f"`{f}`", *(f"{entries[s, f]['cpu_ms_per_log']:.1f}" for s in SCENES)) for f in FIDELITIES],
    )
    grid = table(
        ("logs per hectare", f"interval of one hectare's reach, if it is {100 * SHARE:.0f} %"),
        [(str(n), interval(n)) for n in LOGS_A_HECTARE],
    )
    parts = [HEAD, costs, DENSITY, grid]
    for region in REGIONS:
        sites = region.hectares / 100.0 / KM2_A_SITE
        rows = []
        for n in LOGS_A_HECTARE:
            logs = region.hectares * n
            disk = (logs * beside["disk_bytes_per_log"] + sites * beside["disk_bytes_per_run"]) / 1e9
            for fidelity in FIDELITIES:
                hours = [core_hours(results, beside, logs, sites, scene, fidelity) for scene in SCENES]
                low, high = min(hours), max(hours)
                times = (span(low / cores, high / cores) for cores in CORES)
                cells = (str(n), f"{round_number(logs / 1e6)} million", f"`{fidelity}`")
                rows.append((*cells, f"{round_number(low)} to {round_number(high)}", *times, round_number(disk)))
        area = f"{round_number(region.hectares)} ha"
        cells = region.hectares * 1e4 / CELL_M**2
        about = (
            f"{area}: {region.source}. With {KM2_A_SITE:g} km² per site there are {round_number(sites)} sites. The "
            f"terrain model has {round_number(cells / 1e9)} billion cells of {CELL_M:g} m, "
            f"{round_number(4 * cells / 1e9)} GB of heights before compression, read in windows."
        )
        head = (
            "logs per hectare",
            "logs",
            "fidelity",
            "core-hours",
            *(f"time on {cores} cores" for cores in CORES),
            "disk [GB]",
        )
        parts += [f"## {region.name[0].upper()}{region.name[1:]}", about, table(head, rows)]
    parts += [
        AFTERWARDS.format(
            kept=round_number(beside["disk_bytes_per_kept_log"] / 1000.0),
            run=round_number(beside["other_cpu_s_per_run"]),
            log=round_number(1000.0 * beside["other_cpu_s_per_log"]),
            bytes=round_number(beside["disk_bytes_per_log"]),
            base=round_number(beside["disk_bytes_per_run"] / 1e6),
            memory=round_number(beside["memory_bytes"] / 1e6),
            many=MANY,
        ),
        provenance(results, beside),
    ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def interval(logs: int) -> str:
    low, high = wilson_interval(round(SHARE * logs), logs)
    return f"{100 * low:.1f} to {100 * high:.1f} %"


def provenance(results: dict[str, Any], beside: dict[str, Any]) -> str:
    """Machine class, versions and engines of both files."""
    lines = []
    of = [results["entries"][scene][fidelity]["source"] for scene in SCENES for fidelity in FIDELITIES]
    for what, sources in (("cost of a log", of), ("cost of a run", [beside["source"]])):
        for source_facts in sorted(
            {tuple(each[key] for key in ("machine", "versions", "engine", "date")) for each in sources}
        ):
            machine, versions, engine, date = source_facts
            lines.append(f"- {what}: {machine}; {versions}; engine {engine}; {date}")
    return "\n".join(["Measured, and written by `python -m benchmarks.region_page`:", "", *lines])


HEAD = """# What does a canton or a country take?

The computing time, disk and memory for sliding logs from every hectare of a region, calculated from the cost of a log
in [the study of speed and accuracy](../benchmarks/README.md). These are estimates: the logs were not slid. For your
own region, `--plan` estimates the cost from a pilot of its logs:

    deadwood-tool run-sites --sites sites.csv --friction 0.35 --output region --plan --plan-workers 256

The cost of a log depends on how long it slides. In a forest it stops soon, on bare ground and in a gully later:"""
DENSITY = """How many logs per hectare you need depends on the question. For a line that logs from many hectares may
reach, the interval is that of all these logs together, and few per hectare are enough. A map that distinguishes one
hectare from the next needs many:"""
AFTERWARDS = """## What the tables hold, and what they do not

- Core-hours are processor time: from the cheapest to the most expensive of the three grounds above, plus reading and
  writing ({run} s per run, {log} ms per log), without the start of the program. Times are those hours divided by the
  number of cores, without losses by waiting: sites are independent, so several machines may share them, each with a
  part of the table.
- Disk: {bytes} bytes per log and {base} MB per run, without trajectories; each stored trajectory adds {kept} kB, so
  keep `--trajectories` small.
- Memory does not grow with the region: a site of {many} logs took {memory} MB, the libraries included.
- Trees and lines are read completely for each site: clip those of a region to the sites, and name the layers in the
  table.
- Where logs start, how many, and with which friction, is your input. Hectares on which none can start (flat ground)
  cost nothing (`assess-mobilisation`)."""


def main() -> None:
    if "--measure" in sys.argv[1:]:
        MEASURED.write_text(json.dumps(measure(), indent=1, sort_keys=True) + "\n", encoding="utf-8")
    text = page(study.read_results(), json.loads(MEASURED.read_text(encoding="utf-8")))
    engines.write(PAGE, text)
    print(f"wrote {PAGE.name}")


if __name__ == "__main__":
    main()
