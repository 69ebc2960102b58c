"""The effect of each obstacle of a run as a layer, and what a reader wants to see first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import geopandas
import numpy as np
import shapely

from deadwood_algorithms.evaluate.protection.baseline import Baseline, logs_to_slide
from deadwood_algorithms.evaluate.protection.changed_scenes import ChangedScenes, WithCandidates, tasks_of
from deadwood_algorithms.evaluate.protection.effect import Effect, effects_of, ranks
from deadwood_algorithms.evaluate.protection.near_candidates import logs_near
from deadwood_algorithms.evaluate.protection.obstacles import Candidates, Obstacle, with_candidates
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.evaluate.protection.scenes_at_once import changes_in_order
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.simulate.steps import Steps
from deadwood_algorithms.stats.statistics import points_with_interval

SHOWN = 5  # shown of each kind and line


def obstacle_effects(
    rerun: Rerun, layers: SceneLayers, baseline: Baseline, things: list[Obstacle], steps: Steps, feedback: Feedback
) -> list[Effect]:
    """For each object, slide the logs that it affected again without it."""
    tasks = tasks_of(things, [logs_to_slide(rerun, layers, baseline, each) for each in things])
    scenes = ChangedScenes(rerun, layers, baseline, None)
    changes = changes_in_order(scenes, tasks, steps, feedback, f"sliding without each of {len(things)}")
    return effects_of(rerun, layers, baseline, things, changes)


def candidate_effects(
    rerun: Rerun, layers: SceneLayers, baseline: Baseline, could: Candidates, steps: Steps, feedback: Feedback
) -> list[Effect]:
    """For each candidate, slide the logs that come near it again with it."""
    both, found = with_candidates(layers, could)
    near, layers = logs_near(rerun, layers, both, found, could.widest_radius, steps, feedback)
    scenes = WithCandidates(rerun, layers, baseline, lambda on: with_candidates(on, could))
    tasks, what = tasks_of(scenes.found, near), f"sliding with each of {len(scenes.found)}"
    changes = changes_in_order(scenes, tasks, steps, feedback, what)
    return effects_of(rerun, layers, baseline, scenes.found, changes, planted=True)


def frame_of(found: Sequence[Effect], layers: SceneLayers, changed: str, sign: int) -> geopandas.GeoDataFrame:
    """One row for each object and line, grouped by line and sorted by rank.

    sign : 1 if the change removes something, so that the additional reach is its effect; -1 if it adds something
    """
    gains = [tuple(sign * each for each in effect.gain()) for effect in found]
    columns = {
        "kind": [each.obstacle.kind for each in found],
        "id": [each.obstacle.id for each in found],
        "line_id": [each.line_id for each in found],
        "n_total": [each.n_total for each in found],
        "n_reach": [each.n_reach for each in found],
        changed: [each.n_changed for each in found],
        "gain_logs": [sign * (each.gained - each.lost) for each in found],
        "gain_p": [each[0] for each in gains],
        "ci_low": [min(each[1:]) for each in gains],
        "ci_high": [max(each[1:]) for each in gains],
        "gain_p_low_if_lost": [min(sign * end for end in each.gain_if_lost()) for each in found],
        "gain_p_high_if_lost": [max(sign * end for end in each.gain_if_lost()) for each in found],
        "stopped": [each.stopped for each in found],
        "energy_taken_kj": [each.energy_taken_kj for each in found],
        "rank": ranks([each[0] for each in gains], found),
    }
    points = shapely.points([[each.obstacle.x, each.obstacle.y] for each in found])
    frame = geopandas.GeoDataFrame(columns, geometry=points, crs=layers.dem.plan_crs)
    kinds, lines = (list(dict.fromkeys(columns[name])) for name in ("kind", "line_id"))
    place = np.lexsort(
        [columns["rank"], list(map(kinds.index, columns["kind"])), list(map(lines.index, columns["line_id"]))]
    )
    return frame.iloc[place].reset_index(drop=True)


def lines_of(frames: dict[str, Any]) -> tuple[str, ...]:
    """For each line and kind, how many objects have an effect, and the first few of them."""
    shown = []
    for name, frame in frames.items():
        for (line_id, kind), rows in frame.groupby(["line_id", "kind"], sort=False):
            keep, harm = int((rows["gain_logs"] > 0).sum()), int((rows["gain_logs"] < 0).sum())
            head = rows["n_reach"].iloc[0], rows["n_total"].iloc[0]
            what = f"{len(rows)} {'candidates: ' if name == 'planted' else ''}{PLURAL[kind]}"
            shown.append(
                f"{line_id}, reached by {head[0]} of {head[1]} logs; of {what} {counted(keep, 'keeps', 'keep')} logs "
                f"away, {counted(harm, 'brings', 'bring')} some"
            )
            for row in rows[rows["gain_logs"] > 0].head(SHOWN).itertuples():
                points = points_with_interval(row.gain_p, row.ci_low, row.ci_high)
                shown.append(
                    f"  {row.rank}. {kind} {row.id}: {counted(row.gain_logs, 'log')}, {points} points; holds "
                    f"{row.stopped}"
                )
    return tuple(shown)


PLURAL = {"tree": "trees", "lying_log": "lying logs", "barrier": "barriers", "stand": "stands"}
