"""Throw trees as a storm does, and write what stands and lies before, after, years later, and after clearing.

A share of the stems is thrown: of all (`--share`), of each class of DBH (`--dbh-classes 0:0.1,40:0.7`: a tenth from 0
cm, seven tenths from 40 cm), within polygons (`--windthrow-areas`, whose column `share` overrides these), and the trees
named by `--ids`. In each group the nearest whole number falls; which trees fall depends on the seed and each tree's id.

A thrown stem lies from its stump towards `--fall-deg`, the direction to which the wind blows, with a normal scatter. It
is the part of the tree's truncated cone above the stump, and as long on the slope as it was high. The stump remains as
a short tree (`--stump-m 0`: uprooted, no stump). A stem that would extend beyond the terrain model ends at its edge;
stems that fall off it completely are left out and counted. The folder holds layers for `slide-logs`:

- `trees_before.gpkg`: the forest before the storm;
- `trees_after.gpkg`, `lying_after.gpkg`: what stands, with stumps, and what lies right after the storm;
- `trees_later.gpkg`, `lying_later.gpkg`: the same `--years` later: some lying logs have disappeared, thin ones first
  (after 10 years 13 % of spruce below 23 cm DBH, 8 % from 35 cm: Holeksa et al. 2008; or `--lost`), the others are
  thinner (`--thinner`, an assumption; `--wood` computes it from a published rate of decay);
- `trees_cleared.gpkg`: all lying stems are removed, the stumps remain;
- `stems.gpkg`: every tree, and whether it stands, lies or is removed in each scenario.

    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool windthrow --trees trees.gpkg --dem sample_data/dem.tif --share 0.4 --fall-deg 180 --output storm

With `--tree-capacity-kj`, the energy that a fresh stem of 40 cm DBH absorbs in a hit before it breaks, lying logs have
a `capacity_kj` by DBH, age and wood, above which they break; `lying_later_rigid.gpkg` has the same logs without it.

`--height-m` is the height above ground of the lying stems right after the storm, where they rest on each other or on
stumps (2.1 m in the windthrow areas of 1990). The lying logs then have a column `height_m`, which falls by 4.8 % a year
(0.8 m after 20 years; Wohlgemuth et al. 2017). slide-logs does not use it: there lying logs rest on the ground.

The tool prints the commands that slide the same logs through all four scenarios and compare them. It does not predict
which trees a storm throws: that is your input. Stems are laid flat, not on one another or against standing trees;
regrowth is not modelled.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import presets, tool
from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.schemas import TREE_M

if TYPE_CHECKING:
    from collections.abc import Mapping

STEMS = "stems.gpkg"
YEARS, THINNER = 10.0, 0.2


@dataclass(frozen=True, kw_only=True)
class Ask(tool.TakesPresets):
    trees: str = tool.vector("Trees before the storm", "point")
    dem: str = tool.terrain("Terrain (DEM)")
    share: float | None = tool.number("Share of the stems that is thrown", default=None, minimum=0.0, maximum=1.0)
    dbh_classes: str | None = tool.text(
        "Share by class of DBH", default=None, help="Minimum DBH [cm]:share, separated by commas: 0:0.1,20:0.3,40:0.7."
    )
    windthrow_areas: str | None = tool.vector(
        "Areas of windthrow",
        "polygon",
        default=None,
        help="Nothing falls outside. A column share overrides --share and --dbh-classes.",
    )
    ids: str | None = tool.text(
        "Trees that fall in any case", default=None, help="Values of tree_id, separated by commas."
    )
    fall_deg: float = tool.number(
        "Azimuth towards which stems fall, where the wind blows to", unit="°", minimum=0.0, maximum=360.0
    )
    scatter_deg: float = tool.number(
        "Standard deviation of that azimuth", unit="°", default=20.0, minimum=0.0, maximum=180.0
    )
    stump_m: float = tool.number(
        "Height of the stumps", unit="m", default=0.5, minimum=0.0, help="0: none, the stems are uprooted."
    )
    lost: float | None = tool.number(
        "Share of the lying logs that has disappeared years later",
        default=None,
        minimum=0.0,
        maximum=1.0,
        help="Default: by --years, the DBH and --wood (else spruce).",
    )
    height_m: float | None = tool.number(
        "Height above ground of the lying stems right after the storm",
        unit="m",
        default=None,
        minimum=0.0,
        exclusive=True,
        maximum=20.0,
        help="For the column height_m, which falls with --years.",
    )
    thinner: float | None = tool.number(
        "Share by which the diameter of the others has decreased by then",
        default=None,
        minimum=0.0,
        maximum=0.95,
        help="Default: by --wood, else 0.2, an assumption.",
    )
    wood: str | None = tool.choice(
        "Wood whose rate of decay gives the decrease",
        *presets.DECAYS,
        default=None,
        help=presets.choices_help(presets.DECAYS),
    )
    tree_capacity_kj: float | None = tool.number(
        "Energy that a fresh stem of 40 cm DBH absorbs in a hit before it breaks",
        unit="kJ",
        default=None,
        minimum=0.0,
        exclusive=True,
        help="Lying logs then break above theirs, less by --weaker years later. Without it they are rigid.",
    )
    tree_capacity_power: float = tool.capacity_power()
    weaker: float | None = tool.number(
        "Share of that energy which lying logs have lost by then",
        default=None,
        minimum=0.0,
        maximum=0.999,
        help="Default: by --wood (else spruce) and --years, 0.89 for spruce after 9 years: the most that tests found.",
    )
    years: float | None = tool.number(
        "Years after the storm",
        default=None,
        minimum=0.0,
        maximum=100.0,
        help="Default: 10.",
    )
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    output: str = tool.output_folder("Folder of the scenarios' layers")
    overwrite: bool = tool.overwrite()

    def taken_presets(self) -> tuple[presets.Taken, ...]:
        if self.wood is None:
            return ()
        decayed = presets.decayed(presets.WOODS[self.wood], YEARS if self.years is None else self.years)
        return (presets.Taken.of(decayed, "--wood", vars(self)),)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.dem_blocks import open_ground
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.params.snag_dynamics import HOLEKSA, height_left, lost_share
    from deadwood_algorithms.prepare.trees import stems as layers
    from deadwood_algorithms.prepare.trees.throwing import (
        assumed_words,
        chosen_share,
        fall_directions,
        lying_stems,
        strength_words,
    )
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.scene.laws import capacity_of
    from deadwood_algorithms.stats import draws

    if 0.0 < ask.stump_m < TREE_M[0]:
        raise UserError(f"--stump-m is {ask.stump_m:g} m, but must be 0 (none) or at least {TREE_M[0]:g} m")
    if ask.weaker is not None and ask.tree_capacity_kj is None:
        raise UserError("--weaker needs --tree-capacity-kj: the energy that a fresh stem of 40 cm DBH absorbs")
    years = YEARS if ask.years is None else ask.years
    wood = presets.WOODS[ask.wood or "spruce"]
    left = presets.strength_left(wood, years) if ask.weaker is None else 1.0 - ask.weaker
    thinner = THINNER if ask.thinner is None else ask.thinner
    for taken in ask.taken_presets():
        feedback.note(taken.said, code="preset")
        thinner = float(taken.values["thinner"])
    final = Path(ask.output)
    with (
        result_folder(TOOL, ask, feedback) as folder,
        open_ground(ask.dem, crs=ask.crs, feedback=feedback) as ground,
    ):
        stems = layers.read_stems(ask.trees, ground, ask.crs, feedback)
        thrown = layers.thrown_stems(stems, tool.taken(ask, layers.Storm), ground, ask.crs, feedback)
        rows = np.flatnonzero(thrown)
        items = stems.item[rows]
        azimuth = fall_directions(items, ask.fall_deg, ask.scatter_deg, ask.seed)
        lying = lying_stems(stems.place[rows], stems.dbh_cm[rows], stems.height_m[rows], azimuth, ask.stump_m, ground)
        laid = ~lying.off
        if cut := int((lying.cut & laid).sum()):
            words = f"{counted(cut, 'stem')} would reach beyond the terrain: cut at its edge"
            feedback.note(words, code="stems-cut", stems=cut)
        if lying.off.any():
            feedback.note(
                f"{int(lying.off.sum())} of {counted(rows.size, 'thrown stem')} would fall off the terrain model at "
                "its edge: left out of the lying logs, counted as removed, the stump stays",
                code="stems-off-dem",
            )
        gone = np.zeros(rows.size, bool)
        share = np.array(
            [lost_share(years, each, wood) if ask.lost is None else ask.lost for each in stems.dbh_cm[rows]]
        )
        groups = np.unique(share[laid], return_inverse=True)[1]
        gone[laid] = chosen_share(items[laid], share[laid], groups, ask.seed, draws.STEM_LOST)
        lost, off = np.zeros((2, thrown.size), bool)
        lost[rows], off[rows] = gone, lying.off
        states = layers.states_of(thrown, lost, off)
        after = layers.trees_with_stumps(stems, thrown, ask.stump_m)
        before = layers.trees_with_stumps(stems, np.zeros_like(thrown), 1.0)
        standing = {"before": before, "after": after, "later": after, "cleared": after}
        fresh = None
        if ask.tree_capacity_kj is not None:
            fresh = capacity_of(ask.tree_capacity_kj, ask.tree_capacity_power, stems.dbh_cm) / 1000.0
        old, thickness = (stems, lying, rows, laid & ~gone), 1.0 - thinner
        logs = {
            "after": layers.lying_frame(stems, lying, rows, laid, 1.0, fresh),
            "later": layers.lying_frame(*old, thickness, None if fresh is None else left * fresh),
            **({} if fresh is None else {"later_rigid": layers.lying_frame(*old, thickness)}),
        }
        if ask.height_m is not None:
            for name, frame in logs.items():
                frame["height_m"] = ask.height_m * (1.0 if name == "after" else height_left(years))
        for kind, layer, frames in (("trees", "trees", standing), ("lying", "lying_logs", logs)):
            for name, frame in frames.items():
                if len(frame):
                    write_vector(folder / f"{kind}_{name}.gpkg", {layer: frame})
        write_vector(folder / STEMS, {"stems": layers.stems_frame(stems, thrown, lying.azimuth_deg, states)})
        made = {each.stem: final / each.name for each in sorted(folder.iterdir())}
    facts = {
        name: {state: int((values == state).sum()) for state in (layers.STANDING, layers.LYING, layers.REMOVED)}
        for name, values in states.items()
    }
    by_law = f"after {years:g} years, {HOLEKSA}" if ask.lost is None else "--lost"
    assumed = assumed_words(
        ask.fall_deg, ask.scatter_deg, ask.stump_m, (int(gone.sum()), int(laid.sum()), by_law), thinner
    )
    strength = strength_words(
        ask.tree_capacity_kj, ask.tree_capacity_power, left, years if ask.weaker is None else None
    )
    lines = lines_of(facts, made, ask.dem, (assumed, strength))
    return Outcome({"output": final} | made, facts | {"off_terrain": int(off.sum())}, lines)


def lines_of(facts: Mapping[str, Any], made: Mapping[str, Path], dem: str, assumed: tuple[str, ...]) -> tuple[str, ...]:
    """What each scenario has, and the commands that slide the same logs through all of them."""
    shown = []
    for name, counts in facts.items():
        shown.append(
            f"{name}: {counted(counts['standing'], 'tree stands', 'trees stand')}, "
            f"{counted(counts['lying'], 'stem lies', 'stems lie')}, "
            f"{counts['removed']} removed"
        )
    shown += assumed
    shown.append("now slide the same logs through each, with your releases, lines and friction:")
    scenarios = [*facts, *(["later_rigid"] if "lying_later_rigid" in made else [])]
    for name in scenarios:
        layers = ""
        for flag, stem in (("--trees", f"trees_{name.removesuffix('_rigid')}"), ("--lying-logs", f"lying_{name}")):
            layers += f" {flag} {quoted(made[stem])}" if stem in made else ""
        shown.append(
            f"  deadwood-tool slide-logs --dem {quoted(dem)} --releases releases.gpkg{layers} --lines road.gpkg "
            f"--friction 0.25 --trajectories all --output run_{name}"
        )
    runs = ",".join(f"run_{name}" for name in scenarios)
    return *shown, f"  deadwood-tool compare-scenarios --runs {runs} --output windthrow_effect"


TOOL = Tool(
    "windthrow",
    "Prepare",
    "Make the forests of a storm: before, after, years later, cleared",
    Ask,
    run,
)
