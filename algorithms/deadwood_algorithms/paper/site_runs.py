"""The tools' calls for one site of the paper; existing complete results with the same inputs are reused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import geopandas
import numpy as np

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.vectors import read_table, read_vector, write_vector
from deadwood_algorithms.paper import klosters
from deadwood_algorithms.paper.site import ANY_SHAPE, Site, write_coarser
from deadwood_algorithms.paper.unfinished import read_note
from deadwood_algorithms.params.tool import Feedback, Stage, Tool
from deadwood_algorithms.results.checked import stands
from deadwood_algorithms.results.identity import Making, sealed

FRICTIONS = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
ROCKS = {"platy": (1.6, 1.25, 0.5), "cubic": (1.0, 1.0, 1.0)}  # sides of 1 m3 [m]


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Which runs of a site are wanted.

    logs : of each scenario; quick : a coarser set of frictions and cells
    needed : the results that are needed (``sensitivity.DECIDED_BY``), always with the mapped forest (empty: all);
        draws : number of random forests
    options : of `slide-logs`, by name; twin : whether the site is a twin
    """

    logs: int
    fidelity: str
    seed: int
    threads: int | None
    quick: bool
    twin: bool
    needed: frozenset[str] = frozenset()
    options: Mapping[str, Any] = field(default_factory=dict)
    draws: int = 3


class SiteRuns:
    """Runs and results of one site, in a folder.

    tools : the tools that are called, by name
    """

    def __init__(self, site: Site, place: Path, wanted: Wanted, tools: Mapping[str, Tool], feedback: Feedback) -> None:
        self.site, self.place, self.wanted, self.tools, self.feedback = site, place, wanted, tools, feedback
        self._made: set[Path] = set()  # what this process made, or found complete
        self.prepared, self.runs, self.results = (place / name for name in ("prepared", "runs", "results"))
        for folder in (self.prepared, self.runs, self.results):
            folder.mkdir(parents=True, exist_ok=True)
        self.klosters = site.name == klosters.NAME
        self.trees: dict[str, str | None] = {"none": None, "als": self.mapped_trees()}
        for draw in range(wanted.draws):
            self.trees["random" + (f"_{draw + 1}" if draw else "")] = self.random_trees(draw)
        self.terrains: dict[str, str] = {}

    @cached_property
    def ground(self) -> Grid:
        """The site's terrain model."""
        return read_dem(self.site.dem)

    def step(self, path: Path, name: str, what: str, **values: Any) -> Path:
        """One call of a tool; an existing complete result with the same inputs, parameters and engine is reused."""
        if path in self._made:
            return path
        called = self.tools[name]
        note = path.with_name(f".{path.name}.json")
        if path.exists() and not stands(called, values, path, read_note(note)):
            self.feedback.note(f"{path}: damaged, or of other inputs; it is made again")
            for each in (
                path,
                *(Path(values[p.name]) for p in called.parameters() if p.is_output and p.name in values),
            ):
                shutil.rmtree(each) if each.is_dir() else each.unlink(missing_ok=True)
        if not path.exists():
            given = values | ({"resume": True} if "resume" in {each.name for each in called.parameters()} else {})
            called(feedback=Stage(self.feedback, f"{self.site.name}, {what}", warns=False), output=str(path), **given)
            if path.is_file():
                made = Making(called, called.ask_from({**values, "output": str(path)}))
                note.write_text(json.dumps({"run_id": made.run_id, **sealed(path)}), encoding="utf-8")
        self._made.add(path)
        return path

    def mapped_trees(self) -> str:
        if self.site.trees.endswith(".gpkg"):
            return self.site.trees
        path = self.prepared / "trees.gpkg"
        return str(self.step(path, "import-trees", "trees", trees=self.site.trees, dem=self.site.dem))

    def random_trees(self, draw: int) -> str:
        return str(
            self.step(
                self.prepared / f"trees_random_{draw + 1}.gpkg",
                "generate-forest",
                "random forest",
                dem=self.site.dem,
                like=self.mapped_trees(),
                stand=self.site.layers["forest"],
                seed=self.wanted.seed + draw,
            )
        )

    def releases(self, kind: str = "logs") -> str:
        facts, areas = self.site.facts, self.site.layers["releases"]
        places = read_vector(str(areas), geometry=ANY_SHAPE, target_crs=None, what="releases")
        count = -(-self.wanted.logs // len(places))
        rock = {"density_kg_m3": facts.get("rock_density_kg_m3", 2700.0), "orientation": "random"}
        log = {"density_kg_m3": facts["density_kg_m3"]}
        return str(
            self.step(
                self.prepared / f"releases_{kind}.gpkg",
                "sample-releases",
                "releases",
                areas=areas,
                dem=self.site.dem,
                count=count,
                radius_m=facts["release_radius_m"],
                dbh_cm=facts["dbh_cm"],
                length_m=facts["length_m"],
                seed=self.wanted.seed,
                **(log if kind == "logs" else rock),
            )
        )

    def protected_dem(self) -> str:
        if self.site.layers["dams"] is None:
            return self.site.dem
        path = self.prepared / "dem_with_dams.tif"
        return str(self.step(path, "add-structures", "dams", dem=self.site.dem, structures=self.site.layers["dams"]))

    def shape(self, kind: str) -> str:
        """The point cloud of the site's log, or of a rock."""
        if kind in ROCKS:
            path = self.prepared / f"{kind}.pts"
            corners = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * ROCKS[kind]
            np.savetxt(path, corners, fmt="%.6g")
            return str(path)
        facts = self.site.facts
        sizes = {name: facts[name] for name in ("dbh_cm", "length_m", "density_kg_m3")}
        return str(self.step(self.prepared / "log", "make-log", "point cloud", rings=31, **sizes) / "log.pts")

    def slide(self, scenario: str, convention: str = "", friction: float | None = None, logs: str = "logs") -> Path:
        """One run of `slide-logs`."""
        facts = self.site.facts
        protects = scenario in ("protected", "barriers")
        forest = "als" if protects or scenario in ROCKS else scenario
        mu = facts["friction"] if friction is None else friction
        self.terrains[scenario] = self.protected_dem() if scenario == "protected" else self.site.dem
        name = scenario + (f"_{convention}" if convention else "") + (f"_{friction:g}" if friction is not None else "")
        law: dict[str, float] = {}
        if scenario in ROCKS:
            mu, logs = facts.get("rock_friction", 0.5), "rocks"
            if facts.get("rock_slip"):
                law = dict(zip(("friction_max", "friction_kappa", "friction_beta"), facts["rock_slip"], strict=True))
        keeps = "all" if scenario == "barriers" or logs == "fewer" else "none"
        return self.step(
            self.runs / name,
            "slide-logs",
            name,
            dem=self.terrains[scenario],
            releases=self.releases(logs),
            trees=self.trees[forest],
            barriers=self.site.layers["barriers"] if protects else None,
            lines=self.site.layers["lines"],
            friction=float(mu),
            fidelity=self.wanted.fidelity,
            seed=self.wanted.seed,
            threads=self.wanted.threads,
            trajectories=keeps,
            own_slope="none",
            **self.wanted.options,
            **law,
            shape=self.shape(scenario if scenario in ROCKS else "log") if convention or scenario in ROCKS else "cone",
        )

    def scenarios(self) -> list[str]:
        """The scenarios whose logs are compared one by one; the first is the baseline."""
        randoms = [name for name in self.trees if name.startswith("random")]
        names = ["als", "protected" if self.klosters else "barriers", *randoms, "none"]
        kinds = {"protected": "barriers"} | dict.fromkeys(randoms, "random")
        return [name for name in names if name == "als" or self.wants(kinds.get(name, name))]

    def wants(self, what: str) -> bool:
        return not self.wanted.needed or what in self.wanted.needed

    def compared(self, convention: str) -> dict[tuple[str, str, str], Any]:
        """Rows of `compare-scenarios`, by scenario, quantity and item; of a single scenario those of its reach."""
        names = self.scenarios()
        runs = [str(self.slide(name, convention)) for name in names]
        if len(names) == 1:
            reach = summary_of(Path(runs[0]))["reach"]
            return {(names[0], "reach", str(row["line_id"])): row | {"value": row["p"]} for row in reach}
        place = self.step(
            self.results / ("comparison" + (f"_{convention}" if convention else "")),
            "compare-scenarios",
            "comparing",
            runs=",".join(runs),
            names=",".join(names),
            baseline="als",
            seed=self.wanted.seed,
        )
        rows = json.loads((place / "comparison.json").read_text(encoding="utf-8"))["rows"]
        plain = [{key: float("nan") if value is None else value for key, value in row.items()} for row in rows]
        return {(str(row["scenario"]), str(row["quantity"]), str(row["item"])): row for row in plain}

    def frictions(self) -> Sequence[float]:
        return (0.15, 0.25, 0.4) if self.wanted.quick else FRICTIONS

    def cells(self) -> Sequence[float]:
        """Cell sizes of the sweeps [m]: the terrain model's, and coarser ones."""
        finest = self.ground.cell
        return [finest * times for times in ((1, 4) if self.wanted.quick else (1, 2, 4))]

    def sweep(self, cell: float) -> list[dict[str, Any]]:
        """Rows of `calibrate-friction` on cells of this size, the event being a log that stops on the road."""
        times = round(cell / self.ground.cell)
        dem = Path(self.site.dem)
        if times > 1:
            dem = self.prepared / f"dem_{cell:g}m.tif"
            if dem not in self._made:
                self._made.add(dem)
                write_coarser(self.site.dem, times, dem)
        count = self.fifth()
        place = self.step(
            self.results / f"friction_{cell:g}m",
            "calibrate-friction",
            f"friction on {cell:g} m",
            dem=str(dem),
            releases=self.releases(),
            trees=self.trees["als"],
            lines=self.site.layers["lines"],
            reached=self.line("road"),
            not_reached=self.line("beyond"),
            seed=self.wanted.seed,
            logs=count,
            friction=",".join(f"{mu:g}" for mu in self.frictions()),
            fidelity=self.wanted.fidelity,
            threads=self.wanted.threads,
        )
        calibration = json.loads((place / "calibration.json").read_text(encoding="utf-8"))
        return [row | {"n": calibration["logs"]} for row in calibration["rows"]]

    def fifth(self) -> int:
        return max(self.wanted.logs // 5, min(self.wanted.logs, 200))

    def line(self, fact: str) -> str | None:
        """A file with only one of the site's lines."""
        name = self.site.facts[fact]
        if name is None:
            return None
        path = self.prepared / f"line_{fact}.gpkg"
        if path not in self._made:
            path.unlink(missing_ok=True)
            self._made.add(path)
            frame = read_vector(str(self.site.layers["lines"]), geometry=ANY_SHAPE, target_crs=None, what="lines")
            write_vector(path, {"lines": frame.loc[frame["line_id"] == name]})
        return str(path)

    def spread(self, scenario: str) -> dict[str, Any]:
        """`lateral-spread` of one run, with the same minimum run-out for logs and rocks."""
        path = self.step(
            self.results / f"spread_{scenario}.gpkg",
            "lateral-spread",
            "spread",
            deposits=str(self.slide(scenario)),
            min_runout_m=float(self.site.facts["length_m"]),
            seed=self.wanted.seed,
        )
        return rows_of(path, "spread")[0]

    def flight(self) -> dict[str, Any] | None:
        if self.site.layers["flight"] is None:
            return None
        path = self.step(
            self.results / "flight.gpkg",
            "fit-flight",
            "flight",
            dem=self.site.dem,
            flights=self.site.layers["flight"],
            barriers=self.site.layers["barriers"],
            plots=str(self.results / "flight"),
            dbh_cm=self.site.facts["dbh_cm"],
            length_m=self.site.facts["length_m"],
        )
        return rows_of(path, "flights")[0]

    def arrivals(self, run_folder: Path) -> Any:
        path = self.step(
            self.results / f"arrivals_{run_folder.name}.gpkg",
            "reach-lines",
            "arrivals",
            run=str(run_folder),
            lines=str(self.site.layers["lines"]),
        )
        return read_table(f"{path}|layername=arrivals", what="arrivals")

    def takeoffs(self, mu: float) -> tuple[np.ndarray, int]:
        """Speeds at the take-off line with this friction, in the mapped forest without barriers; and the number of
        logs slid.
        """
        fewer = self.prepared / "releases_fewer.gpkg"
        if fewer not in self._made:
            fewer.unlink(missing_ok=True)
            self._made.add(fewer)
            first = geopandas.read_file(self.releases(), layer="releases", rows=self.fifth())
            write_vector(fewer, {"releases": first})
        rows = self.arrivals(self.slide("als", friction=mu, logs="fewer"))
        return rows.loc[rows["line_id"] == self.site.facts["takeoff_line"], "speed_ms"].to_numpy(float), self.fifth()


def summary_of(run_folder: Path) -> dict[str, Any]:
    """The record ``summary.json`` of a run."""
    return json.loads((run_folder / "summary.json").read_text(encoding="utf-8"))


def rows_of(path: Path, layer: str) -> list[dict[str, Any]]:
    """The columns of a layer that a tool has just written; its shapes may be empty, such as a sector of one deposit."""
    return geopandas.read_file(path, layer=layer, ignore_geometry=True).to_dict("records")
