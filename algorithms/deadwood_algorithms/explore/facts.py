"""The messages for an answer and a scene: facts and arrays, in metres from the terrain model's south-west corner."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.explore.answer import Answer, Batch, Hits
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.explore.questions import (
    LIKELY_FRICTION,
    LONGEST_LYING_M,
    MOST_DRAWN,
    MOST_FRICTION,
    MOST_LOGS,
    MOST_POSED,
    MOST_RADIUS_M,
    MOST_ROLLING,
    PREVIEW,
    Defaults,
)
from deadwood_algorithms.explore.relief import TILE, Relief
from deadwood_algorithms.explore.suggested import SKETCH, suggested_place
from deadwood_algorithms.files.crs import crs_name
from deadwood_algorithms.params.messages import Message
from deadwood_algorithms.prepare.releases.logs import ORIENTATIONS
from deadwood_algorithms.results.lost import reach_records
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.simulate.fidelity_trade import DIFFERENCE_ERRORS, REACH_ERRORS, SLOPE_ERRORS
from deadwood_algorithms.stats.endings import left_dem
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_engine import FIDELITIES, STOP_REASONS, Barriers, LyingLogs

MOST_HOLDERS = 30  # trees that hold logs, sorted by how many they hold
COARSE = 400  # cells of the heights for the 3-D view, at most, along the longer side
VARIANTS = BEFORE, AFTER = "before", "after"  # which scene the poses are of
Corner = Sequence[float]  # world coordinates of the south-west corner [m]
Reach = NDArray[np.bool_]  # (logs, lines)


def scene_frame(layers: SceneLayers, relief: Relief, defaults: Defaults, warnings: Sequence[Message] = ()) -> Frame:
    dem = layers.dem
    west, south, east, north = dem.bounds
    corner = west, south
    step, heights = relief.coarse(COARSE)
    facts_of_lines = line_facts(layers.lines, corner)
    facts = {
        "op": "scene",
        "origin": corner,
        "extent": [0.0, 0.0, east - west, north - south],
        "cell": dem.cell,
        "rows": dem.shape[0],
        "columns": dem.shape[1],
        "crs": crs_name(dem.crs),
        "levels": relief.levels,
        "tile": TILE,
        "lines": facts_of_lines,
        "barriers": barrier_facts(layers, corner),
        "lying_logs": lying_log_facts(layers, corner),
        "blocks": block_facts(layers, corner),
        "defaults": {
            "friction": defaults.friction,
            "rolling_friction": defaults.rolling_friction,
            "restitution": defaults.restitution,
            "fidelity": defaults.fidelity,
            "seed": defaults.seed,
            "dbh_cm": defaults.sizes.dbh_cm,
            "length_m": defaults.sizes.length_m,
            "density_kg_m3": defaults.sizes.density_kg_m3,
            "orientation": defaults.sizes.orientation,
            "orientations": ORIENTATIONS,
        },
        "limits": {
            "n_max": MOST_LOGS,
            "preview": PREVIEW,
            "radius_max": MOST_RADIUS_M,
            "friction_max": MOST_FRICTION,
            "friction_likely": LIKELY_FRICTION,
            "rolling_friction_max": MOST_ROLLING,
            "drawn_max": MOST_DRAWN,
            "lying_length_max": LONGEST_LYING_M,
            "poses_max": MOST_POSED,
        },
        "fidelities": [fidelity_facts(name) for name in FIDELITIES],
        "reasons": STOP_REASONS,
        "heights_step": step,
        "warnings": [each.record() for each in warnings],
        "suggested": suggested_place(*relief.coarse(SKETCH), facts_of_lines),
    }
    trees = layers.trees
    arrays = {
        "trees_x": (trees.x - west).astype(np.float32),
        "trees_y": (trees.y - south).astype(np.float32),
        "trees_dbh_cm": (100.0 * trees.diameter).astype(np.float32),
        "trees_height_m": np.asarray(trees.height, np.float32),
        "heights": heights,
    }
    return Frame(facts, arrays)


def fidelity_facts(name: str) -> dict[str, Any]:
    """A fidelity, and what is known of its error [points]: over random slopes or else on the benchmark's, and in the
    effect of a change."""
    slopes, scenes = SLOPE_ERRORS.get(name), REACH_ERRORS.get(name)
    mean = slopes.mean if slopes else scenes.mean if scenes else None
    value, low, high = mean or (None, None, None)
    facts = {"name": name, "error_points": value, "ci_low": low, "ci_high": high, "sd": slopes.sd if slopes else None}
    return facts | {"difference": DIFFERENCE_ERRORS.get(name)}


def local(points: NDArray[np.float64], corner: Corner) -> list[list[float]]:
    return np.round(np.reshape(points, (-1, 2)) - corner, 3).tolist()


def line_facts(items: Items, corner: Corner) -> list[dict[str, Any]]:
    """One entry for each line or polygon; each of its parts or rings is a list of points."""
    found = []
    for name, shape in zip(items.ids, items.geometry, strict=True):
        whole = shapely.boundary(shape) if shapely.get_dimensions(shape) == 2 else shape
        parts = [local(shapely.get_coordinates(each), corner) for each in shapely.get_parts(whole)]
        found.append({"line_id": str(name), "name": str(name), "points": parts[0] if parts else [], "parts": parts})
    return found


def barrier_facts(layers: SceneLayers, corner: Corner) -> list[dict[str, Any]]:
    plates: Barriers = layers.engine_barriers
    return [
        {"barrier_id": str(layers.barriers.ids[item]), "height_m": float(height), "points": local(points, corner)}
        for points, item, height in zip(split(plates), layers.barriers.item, plates.height, strict=True)
    ]


def lying_log_facts(layers: SceneLayers, corner: Corner) -> list[dict[str, Any]]:
    lying: LyingLogs = layers.lying_logs
    return [
        {"lying_id": str(layers.lying.ids[item]), "diameter_cm": 100.0 * float(base), "points": local(points, corner)}
        for points, item, base in zip(split(lying), layers.lying.item, lying.diameter, strict=True)
    ]


def split(lines: Barriers | LyingLogs) -> list[NDArray[np.float64]]:
    return np.split(lines.vertices, lines.starts[1:-1]) if len(lines.starts) > 1 else []


def block_facts(layers: SceneLayers, corner: Corner) -> list[dict[str, Any]]:
    solid = layers.blocks.solid
    places = local(np.column_stack([solid.x, solid.y]), corner)
    return [
        {"block_id": str(name), "x": x, "y": y, "diameter_m": float(wide), "height_m": float(high)}
        for name, (x, y), wide, high in zip(layers.blocks.ids, places, solid.diameter, solid.height, strict=True)
    ]


def hits_frame(answer: Answer, began: float, corner: Corner) -> Frame:
    """The answer so far, in the scene as it was read."""
    facts = {"op": "hits", "id": answer.question.number, "reach": reach_facts(answer, answer.base)}
    return pictured(answer, facts, answer.base, "hits", answer.hits, began, corner)


def difference_frame(answer: Answer, asked: Any, began: float, corner: Corner) -> Frame:
    """The effect of the changes on the logs that have slid in both scenes: the same logs before and after."""
    changed = answer.changed
    base = answer.base[: len(changed)]
    facts = {
        "op": "difference",
        "id": asked,
        "concerned": sum(each.concerned for each in changed),
        "lines": paired_facts(answer.layers.lines.ids, reach_of(base), reach_of(changed)),
        "reach": reach_facts(answer, changed),
    }
    return pictured(answer, facts, changed, "hits_after", answer.hits_changed, began, corner)


def paired_facts(ids: Iterable[Any], before: Reach, after: Reach) -> list[dict[str, Any]]:
    """For each line, the difference in reach of the same logs."""
    found = []
    for k, name in enumerate(ids):
        lost, gained = int((before[:, k] & ~after[:, k]).sum()), int((after[:, k] & ~before[:, k]).sum())
        low, high = paired_interval(lost, gained, len(before))
        found.append(
            {
                "line_id": str(name),
                "before": int(before[:, k].sum()),
                "after": int(after[:, k].sum()),
                "lost": lost,
                "gained": gained,
                "difference": (gained - lost) / len(before),
                "ci_low": low,
                "ci_high": high,
            }
        )
    return found


def reach_of(batches: Sequence[Batch]) -> Reach:
    return np.concatenate([each.reach for each in batches])


def reach_facts(answer: Answer, batches: Sequence[Batch]) -> list[dict[str, Any]]:
    """As in a run's summary: includes the bounds of the shares for logs that left the terrain model."""
    left = left_dem(np.concatenate([each.reason for each in batches]))
    return reach_records(map(str, answer.layers.lines.ids), reach_of(batches), left)


def pictured(
    answer: Answer,
    facts: Mapping[str, Any],
    batches: Sequence[Batch],
    name: str,
    box: Hits,
    began: float,
    corner: Corner,
) -> Frame:
    """Adds the cells that were hit, row 0 in the north, and where the logs ended."""
    column, south = box.first
    done, most = batches[-1].rows.stop, box.count.max(initial=0)
    count = np.minimum(box.count, 65535) if most > 65535 else box.count
    reason = np.concatenate([each.reason for each in batches])
    ends = np.concatenate([each.end for each in batches]) - corner
    logs = answer.releases.logs
    moved = np.hypot(ends[:, 0] + corner[0] - logs.x[:done], ends[:, 1] + corner[1] - logs.y[:done])
    total = len(answer.releases)
    counted = np.bincount(reason[reason >= 0], minlength=len(STOP_REASONS)).tolist()
    content = {
        **facts,
        "done": done,
        "n": total,
        "fidelity": answer.question.fidelity,
        "stopped": dict(zip(STOP_REASONS, counted, strict=True)),
        "stayed": int((moved < logs.length[:done]).sum()),
        "holders": holder_facts(answer, batches),
        "at": [column, answer.layers.dem.shape[0] - south - box.count.shape[0]],
        "ms": round(1e3 * (time.perf_counter() - began), 1),
        "final": done == total,
    }
    arrays = {
        name: count[::-1].astype(np.uint8 if most <= 255 else np.uint16),
        "deposits_x": ends[:, 0].astype(np.float32),
        "deposits_y": ends[:, 1].astype(np.float32),
        "deposits_reason": reason.astype(np.uint8),
    }
    return Frame(content, arrays)


def holder_facts(answer: Answer, batches: Sequence[Batch]) -> list[dict[str, int]]:
    """The trees that hold the most logs; planted ones are numbered after those of the layer."""
    sums: Counter[int] = Counter()
    for each in batches:
        sums.update(each.held)
    most = sorted(((n, tree) for tree, n in sums.items() if n > 0), key=lambda pair: (-pair[0], pair[1]))
    return [{"tree": tree, "n": n} for n, tree in most[:MOST_HOLDERS]]


def poses_frame(answer: Answer, most: int, variant: str, number: Any, corner: Corner) -> Frame:
    """The poses of the first logs in the original or the changed scene: log k has the rows offsets[k] to
    offsets[k + 1], its id from the releases."""
    logs = min(most, answer.base[-1].rows.stop)
    if variant == AFTER:
        poses = [answer.poses_after(logs)]
        row = poses[0].log_row
    else:
        poses = [each.poses for each in answer.base]
        row = np.concatenate([each.poses.log_row + each.rows.start for each in answer.base])
    count = int(np.searchsorted(row, logs))
    shift = np.array([*corner, 0.0])
    base, tip = (np.concatenate([getattr(each, name) for each in poses])[:count] - shift for name in ("base", "tip"))
    shown_logs = answer.releases.logs.take(slice(0, logs))
    arrays = {
        "t": np.concatenate([each.time for each in poses])[:count].astype(np.float32),
        "base": base.astype(np.float32),
        "tip": tip.astype(np.float32),
        "offsets": np.searchsorted(row[:count], np.arange(logs + 1)).astype(np.uint32),
        "diameter": np.asarray(shown_logs.diameter, np.float32),
    }
    return Frame({"op": "poses", "id": number, "logs": logs, "variant": variant}, arrays)
