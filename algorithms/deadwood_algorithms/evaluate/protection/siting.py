"""Barriers chosen one after the other: for each candidate only the logs that come near it are slid again.

The lines of all candidates, and a zone around each, are watched while the logs slide. A log whose outline never touches
the zone keeps every bit of its trajectory when the barrier is built there, because the engine lists an obstacle, and
lets it shorten a step, only within ``NEAR_MARGIN`` of the log's surface in plan (``cores.near``; ``near_candidates``
argues the same from poses), unless it is the first obstacle, whose presence alone shortens steps
(``Rerun.rule_of_steps``). The other logs slide again in the scene with the barrier; meanwhile the zones record which
other candidates their new paths approach. It is therefore always known how each log moves with the barriers chosen so
far, and which candidates it comes near.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection import changed_scenes
from deadwood_algorithms.evaluate.protection.candidate_barriers import Candidate, with_barriers
from deadwood_algorithms.evaluate.protection.rerun import Rerun, without
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.barrier_arrivals import piece_of, states_at
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import reached, starts_inside
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.sliding import reporter, slide_batch, slide_once, until_none_escapes
from deadwood_algorithms.simulate.steps import Steps
from deadwood_algorithms.simulate.windows import wider_scene
from deadwood_algorithms.stats.endings import ended, left_dem
from deadwood_algorithms.stats.statistics import mcnemar_p, paired_interval
from deadwood_engine import Lines, Result, Start, place_logs
from deadwood_engine.fidelity import trace_step
from deadwood_engine.limits import NEAR_MARGIN
from deadwood_engine.log_body import BASE_RADIUS

Array = NDArray[np.float64]
ARCS = 16  # straight pieces for each quarter circle of a zone, which cut off 0.1 % of its width
AHEAD = 16  # candidates whose logs a scheduler's workers may start to slide while another one is evaluated
CHANCE = 0.05  # a gain that chance produces more often than this, among this number of candidates, counts as none
OVERLAP_M = 3.0  # length of a candidate that may lie within OVERLAP_WITHIN of a chosen one: it may adjoin, not overlap
OVERLAP_WITHIN = 1.0  # [m]
COMING = ("energy", "height")


@dataclass(frozen=True)
class LogOutcomes:
    """Outcomes of each log in a scene, shape (n, ...).

    left : (n,), left the terrain model
    reach : (n, lines); near, flux : (n, shapes), comes near a candidate's line; touches it and afterwards a line
    held, met, crossed : (n, candidates); energy [kJ], height [m] : of the largest hit of each candidate, NaN without
    one; of what comes to its place whether it hits or not, see `Coming`
    """

    left: NDArray[np.bool_]
    reach: NDArray[np.bool_]
    near: NDArray[np.bool_]
    flux: NDArray[np.bool_]
    held: NDArray[np.bool_]
    met: NDArray[np.bool_]
    crossed: NDArray[np.bool_]
    energy: Array
    height: Array

    def with_rows(self, rows: NDArray[np.int64], other: LogOutcomes) -> LogOutcomes:
        """These outcomes, with those of some logs replaced by those of another scene."""
        out = {}
        for each in fields(self):
            values = getattr(self, each.name).copy()
            values[rows] = getattr(other, each.name)
            out[each.name] = values
        return LogOutcomes(**out)

    @property
    def any_line(self) -> NDArray[np.bool_]:
        return np.atleast_1d(self.reach.any(axis=1))


@dataclass(frozen=True)
class Coming:
    """Energy [kJ] and height of the upper edge [m] of each log that comes to a place, taken without a plate there."""

    energy: Array
    height: Array


def as_lines(shapes: Sequence[Any]) -> tuple[Lines, Items]:
    """Lines and polygons (their outer rings) to be watched, numbered."""
    strings, item = shapely.get_parts(list(shapes), return_index=True)
    strings = np.array([each.exterior if each.geom_type == "Polygon" else each for each in strings], object)
    vertices, string = shapely.get_coordinates(strings, return_index=True)
    starts = np.concatenate([[0], np.cumsum(np.bincount(string, minlength=len(strings)))]).astype(np.int64)
    geometry = np.empty(len(shapes), object)
    geometry[:] = list(shapes)
    return Lines(vertices, starts), Items(list(range(len(shapes))), geometry, item.astype(np.int64))


def times_of(items: Items, result: Result, releases: Any) -> Array:
    """Time [s] at which each log first touches each object, -inf if it starts within, +inf if it never does."""
    times = items.first_time(result.reach_time)
    times[~reached(items, {"reach": result.reach}, releases)] = np.inf
    times[starts_inside(items, releases)] = -np.inf
    return times


def passed_to_lines(
    rerun: Rerun, layers: SceneLayers, shapes: Sequence[Any], steps: Steps, feedback: Feedback
) -> tuple[NDArray[np.bool_], SceneLayers]:
    """Which log touches which of the shapes, and then or later a line to be protected, shape (n, shapes)."""
    polylines, items = as_lines(shapes)
    n, chunk = len(rerun.releases), changed_scenes.CHUNK

    def slide_some(first: int) -> dict[str, NDArray[np.bool_]]:
        nonlocal layers
        some = rerun.releases.take(np.arange(first, min(first + chunk, n)))

        def slide_on(on: SceneLayers) -> tuple[NDArray[np.bool_], list[str]]:
            on = on.with_lines_first(polylines, items)
            report = reporter(feedback, n, "finding where logs pass", before=first)
            result, sides = slide_once(on, some.logs, rerun.simulation, report)
            times = times_of(on.lines, result, some)
            return flux_of(times[:, : len(shapes)], times[:, len(shapes) :]), sides

        passes, layers = until_none_escapes(layers, rerun.simulation, slide_on, feedback)
        return {"passes": passes}

    parts = [steps.take(min(chunk, n - first), lambda first=first: slide_some(first)) for first in range(0, n, chunk)]
    feedback.progress(n, n, "finding where logs pass")
    return np.concatenate([each["passes"] for each in parts]), layers


def flux_of(touched: Array, lines: Array) -> NDArray[np.bool_]:
    """Which log touches which object, and any line then or later; both times have shape (n, objects), inf: never."""
    last = np.where(lines < np.inf, lines, -np.inf).max(axis=1, initial=-np.inf)
    reached = np.atleast_1d((lines < np.inf).any(axis=1))
    return (touched < np.inf) & reached[:, None] & (last[:, None] >= touched)


@dataclass(frozen=True)
class Trial:
    """A candidate added to those chosen: the logs that were slid again, their outcomes, and the reduction of reach.

    kept : logs that no longer reach a line; brought : logs that reach one only now
    """

    number: int
    rows: NDArray[np.int64]
    outcomes: LogOutcomes
    kept: int
    brought: int

    @property
    def gain(self) -> int:
        return self.kept - self.brought

    def gain_record(self, n: int) -> dict[str, float]:
        """Share of the logs that no longer reach a line, and its 95 % interval (paired: the same logs)."""
        low, high = paired_interval(self.brought, self.kept, n)
        return {"gain_logs": self.gain, "gain_p": self.gain / n, "gain_ci_low": low, "gain_ci_high": high}


class Siting:
    """The run's logs, slid in its scene with any of the candidates."""

    def __init__(
        self,
        rerun: Rerun,
        layers: SceneLayers,
        candidates: Sequence[Candidate],
        steps: Steps,
        feedback: Feedback,
    ) -> None:
        self.rerun, self.candidates = rerun, list(candidates)
        self.steps, self.feedback = steps, feedback
        self.own = len(layers.barriers.ids)
        keys = [shapely.to_wkb(each.shape) for each in candidates]
        shapes = {key: each.shape for key, each in zip(keys, candidates, strict=True)}
        self.place = np.array([list(shapes).index(key) for key in keys], np.int64)  # of each candidate among the shapes
        self.shapes = list(shapes.values())
        self.slid = 0  # logs slid again
        self._coming: dict[tuple[int, ...], dict[int, Coming]] = {}  # by the barriers that stand, then by place
        self.on(layers)

    def on(self, layers: SceneLayers) -> None:
        rerun, cell = self.rerun, layers.dem.cell
        self.plain = layers
        both = with_barriers(layers, self.candidates)
        self.start = place_logs(both.scene, rerun.releases.logs, both.shape, both.threads)
        step = rerun.longest_step(cell)
        thick = float(self.start.body[:, BASE_RADIUS].max(initial=0.0))
        # as in ``logs_near``: outlines are drawn a ``trace_step`` apart, and the engine looks a step ahead
        width = NEAR_MARGIN + thick + trace_step(rerun.simulation.fidelity, cell) + 3.0 * step + 0.01
        width /= np.cos(np.pi / (4.0 * ARCS))
        zones = [shapely.buffer(each, width, quad_segs=ARCS) for each in self.shapes]
        polylines, items = as_lines([*self.shapes, *(shapely.Polygon(each.exterior) for each in zones)])
        self.watched = both.with_lines_first(polylines, items)
        self.rows = [np.flatnonzero(both.barriers.item == self.own + k) for k in range(len(self.candidates))]
        # two barriers do not determine more than one does: after the first choice, the next barrier is not the first
        # obstacle
        self.first_rules = rerun.rule_of_steps(self.watched) != rerun.rule_of_steps(self.with_only(()))

    def missing(self, chosen: Sequence[int]) -> NDArray[np.int64]:
        """The numbers of the barriers of all candidates except these."""
        gone = [rows for k, rows in enumerate(self.rows) if k not in chosen]
        return -1 - np.concatenate([*gone, np.zeros(0, np.int64)]).astype(np.int64)

    def with_only(self, chosen: Sequence[int]) -> SceneLayers:
        """The scene with its own barriers and these candidates."""
        return replace(without(self.watched, self.missing(chosen)), threads=self.watched.threads)

    def batch(self, rows: NDArray[np.int64], chosen: Sequence[int]) -> Batch:
        """Logs for a scheduler's workers, which hold the scene with all candidates."""
        start = Start(self.start.frame[rows], self.start.state[rows], self.start.body[rows])
        return Batch(start, missing=[(rows.size, self.missing(chosen))])

    def slide(
        self,
        rows: NDArray[np.int64],
        chosen: Sequence[int],
        what: str,
        later: Sequence[tuple[NDArray[np.int64], Sequence[int]]] = (),
    ) -> tuple[LogOutcomes, Array]:
        """Slide logs with these candidates: their outcomes, and where they end; results are stored.

        later : logs and candidates needed next, on which a scheduler's workers may start
        """
        found = self.steps.take(rows.size, lambda: self._slide(rows, chosen, what, later))
        self.slid += rows.size
        return LogOutcomes(**{each.name: found[each.name] for each in fields(LogOutcomes)}), found["end"]

    def _slide(
        self,
        rows: NDArray[np.int64],
        chosen: Sequence[int],
        what: str,
        later: Sequence[tuple[NDArray[np.int64], Sequence[int]]],
    ) -> dict[str, NDArray]:
        """Slide logs and keep what becomes of them."""
        result = self._result(rows, chosen, what, later)
        return {**vars(self.outcomes_of(result, rows)), "end": result.end_position}

    def _result(
        self,
        rows: NDArray[np.int64],
        chosen: Sequence[int],
        what: str,
        later: Sequence[tuple[NDArray[np.int64], Sequence[int]]] = (),
        *,
        poses: bool = False,
    ) -> Result:
        """Slide logs; if they come near the window's sides, again on a wider one."""
        simulation = self.rerun.simulation
        report = reporter(self.feedback, rows.size, what)
        keep = np.full(rows.size, poses)
        while True:
            batch = replace(self.batch(rows, chosen), keep=keep)
            if simulation.where.scheduler:
                ahead = (self.batch(*each) for each in later)
                result, sides = slide_batch(self.watched, batch, simulation, report, later=ahead)
            else:
                result, sides = slide_once(self.with_only(chosen), batch.logs, simulation, report, keep_poses=keep)
            if not sides:
                break
            self.on(wider_scene(simulation, self.plain, sides, self.feedback))
        self.feedback.progress(rows.size, rows.size, what)
        return result

    def coming(self, outcomes: LogOutcomes, standing: Sequence[int], number: int) -> Coming:
        """How logs come to the place of a candidate while others stand, but not itself nor any other of its place.

        outcomes : with those that stand; with the candidate too, the same logs come near its place, and no others
        """
        place, key = int(self.place[number]), tuple(sorted(standing))
        found = self._coming.setdefault(key, {})
        if place not in found:
            # without any the answers of all places are needed, and most logs come to several
            found |= self._states(outcomes, key, [place] if key else list(range(len(self.shapes))))
        return found[place]

    def _states(self, outcomes: LogOutcomes, standing: tuple[int, ...], places: list[int]) -> dict[int, Coming]:
        near = np.flatnonzero(outcomes.near[:, places].any(axis=1))
        polylines, items = as_lines([self.shapes[each] for each in places])
        parts: list[dict[str, NDArray]] = []
        for first in range(0, near.size, changed_scenes.CHUNK):
            rows = near[first : first + changed_scenes.CHUNK]
            parts.append(
                self.steps.take(rows.size, lambda rows=rows: self._states_of(rows, standing, polylines, items))
            )
            self.slid += rows.size
        of = {name: np.concatenate([np.zeros(0), *(each[name] for each in parts)]) for name in ("item", *COMING)}
        return {place: Coming(*(of[name][of["item"] == k] for name in COMING)) for k, place in enumerate(places)}

    def _states_of(
        self, rows: NDArray[np.int64], standing: tuple[int, ...], polylines: Lines, items: Items
    ) -> dict[str, NDArray]:
        result = self._result(rows, standing, "following logs to the places of barriers", poses=True)
        grid, ground = self.plain.dem.frame, self.plain.scene.terrain_height
        found = states_at(piece_of(result.poses), polylines, items, self.start.body[rows], ground, (grid.x0, grid.y0))
        return {"item": found["item"], "energy": found["translation"] + found["rotation"], "height": found["height"]}

    def outcomes_of(self, result: Result, rows: NDArray[np.int64]) -> LogOutcomes:
        layers, count, n = self.watched, len(self.shapes), rows.size
        times = times_of(layers.lines, result, self.rerun.releases.take(rows))
        touched, near, lines = times[:, :count], times[:, count : 2 * count], times[:, 2 * count :]
        barriers, number = layers.barriers, len(self.candidates)
        crossed = barriers.any_row(result.barrier_crossed)
        met = barriers.any_row(result.barrier_reached) | crossed
        held = np.zeros((n, len(barriers.ids)), bool)
        at = np.flatnonzero(ended(result.stop_reason, "barrier"))
        held[at, barriers.item[result.stop_item[at]]] = True
        energy, height = np.full((2, n, number), -np.inf)
        hits = result.hits
        mine = np.flatnonzero(hits.by_barrier)
        item = barriers.item[hits.item[mine]] - self.own
        mine, item = mine[item >= 0], item[item >= 0]
        np.maximum.at(energy, (hits.log_row[mine], item), hits.energy[mine] / 1000.0)
        np.maximum.at(height, (hits.log_row[mine], item), hits.height[mine])
        energy[energy == -np.inf], height[height == -np.inf] = np.nan, np.nan
        own = self.own
        return LogOutcomes(
            left_dem(result.stop_reason),
            lines < np.inf,
            near < np.inf,
            flux_of(touched, lines),
            held[:, own:],
            met[:, own:],
            crossed[:, own:],
            energy,
            height,
        )

    def rows_near(self, outcomes: LogOutcomes, chosen: Sequence[int], number: int) -> NDArray[np.int64]:
        """The logs that a candidate could affect: all, if the first barrier changes every step."""
        if not chosen and self.first_rules:
            return np.arange(len(outcomes.reach))
        return np.flatnonzero(outcomes.near[:, self.place[number]])

    def trial(self, outcomes: LogOutcomes, chosen: Sequence[int], number: int, following: Iterable[int] = ()) -> Trial:
        """Add a candidate and slide the logs that come near it again; ``following`` are tried next instead of it."""
        rows = self.rows_near(outcomes, chosen, number)
        if rows.size:
            what = f"sliding {counted(rows.size, 'log')} with a barrier at {self.candidates[number].id}"
            later = [(self.rows_near(outcomes, chosen, k), [*chosen, k]) for k in following]
            found, _ = self.slide(rows, [*chosen, number], what, [each for each in later if each[0].size])
        else:
            found = LogOutcomes(**{each.name: getattr(outcomes, each.name)[rows] for each in fields(outcomes)})
        before, after = outcomes.any_line[rows], found.any_line
        return Trial(number, rows, found, int((before & ~after).sum()), int((after & ~before).sum()))

    def free(self, chosen: Sequence[int]) -> list[int]:
        """Candidates that do not run along a chosen one."""
        built = shapely.union_all([self.candidates[k].shape for k in chosen]).buffer(OVERLAP_WITHIN)
        return [
            k
            for k, each in enumerate(self.candidates)
            if k not in chosen and each.shape.intersection(built).length <= OVERLAP_M
        ]

    def best(self, outcomes: LogOutcomes, chosen: Sequence[int], tried: Sequence[int]) -> tuple[Trial | None, int]:
        """The candidate with which fewest logs reach a line, and among how many it was the best.

        No candidate keeps away more logs than come near it and reach a line, so candidates that cannot be best are not
        tried. Of equal ones the one with the smaller area is taken, then the first.
        """
        most = {k: int(outcomes.any_line[self.rows_near(outcomes, chosen, k)].sum()) for k in tried}
        found: Trial | None = None
        for k in sorted(tried, key=lambda k: (-most[k], k)):
            if found is not None and most[k] < found.gain:
                break
            found = self.better(found, self.trial(outcomes, chosen, k))
        return found, len(tried)

    def better(self, one: Trial | None, other: Trial) -> Trial:
        def order(trial: Trial) -> tuple[float, ...]:
            each = self.candidates[trial.number]
            return -trial.gain, each.length * each.height, trial.number

        return other if one is None or order(other) < order(one) else one


@dataclass(frozen=True)
class Step:
    """A barrier that was chosen: all chosen so far, the trial, and the outcomes of every log with them."""

    chosen: tuple[int, ...]
    trial: Trial
    outcomes: LogOutcomes


def chance_of(trial: Trial, among: int) -> float:
    """Upper bound of the probability that chance alone makes the best candidate this good (McNemar, Bonferroni)."""
    return min(1.0, mcnemar_p(trial.brought, trial.kept) * among)


def choose(
    siting: Siting, outcomes: LogOutcomes, first: Sequence[Trial], count: int, feedback: Feedback
) -> tuple[list[Step], str]:
    """Choose barriers one after the other, each the best in addition to the earlier ones; and why no more, in words.

    first : the trials of each candidate alone, from which the first is taken
    """
    steps: list[Step] = []
    while len(steps) < count:
        chosen = steps[-1].chosen if steps else ()
        if steps:
            free = siting.free(chosen)
            best, among = siting.best(outcomes, chosen, free)
        else:
            best, among = None, len(first)
            for trial in first:
                best = siting.better(best, trial)
        if best is None:
            return steps, "no candidate is left"
        if best.gain <= 0 or chance_of(best, among) >= CHANCE:
            return steps, why_none(best, among)
        outcomes = outcomes.with_rows(best.rows, best.outcomes)
        steps.append(Step((*chosen, best.number), best, outcomes))
    return steps, f"--count {count} is reached; a larger --count finds the next best"


def why_none(best: Trial, among: int) -> str:
    """Why the best of the remaining candidates is not chosen, in words."""
    if best.gain > 0:
        kept = counted(best.gain, "more log")
        return f"the best of the {counted(among, 'candidate')} left would keep {kept} away, which chance can explain"
    if best.gain == 0:
        return (
            f"none of the {counted(among, 'candidate')} left would keep away more logs than it lets through in addition"
        )
    return (
        f"each of the {counted(among, 'candidate')} left would let more logs reach a line, the best {-best.gain} more"
    )


def trials_alone(siting: Siting, outcomes: LogOutcomes) -> Iterator[Trial]:
    number = len(siting.candidates)
    for k in range(number):
        yield siting.trial(outcomes, (), k, range(k + 1, min(k + 1 + AHEAD, number)))
