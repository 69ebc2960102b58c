"""From layers to the engine's arrays: a `Scene` from DEM, trees, barriers, lines and friction.

Here centimetres become metres, and inconsistent inputs are rejected with one line: lines off the DEM, friction
that does not cover it, trees in another country. What a scene lacks becomes an empty array, never None.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import account
from deadwood_algorithms.files.columns import field_names, note_unnamed, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.dem_blocks import WHOLE_CELLS
from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.units import ALSO, named
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import none_of
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.blocks import Boulders, read_blocks
from deadwood_algorithms.scene.friction import read_friction
from deadwood_algorithms.scene.items import (
    Items,
    count_of_items,
    digest_of,
    extent_words,
    ids_of,
    items_of,
    paths_of,
    plan_of,
    points_on,
    say_left_out,
    shared_words,
    warn_off_the_ground,
    why_left_out,
)
from deadwood_algorithms.scene.laws import Breaking
from deadwood_algorithms.scene.reach import watched_sides
from deadwood_algorithms.schemas import BARRIERS, TREES
from deadwood_algorithms.schemas.obstacles import STUMP_BELOW_M
from deadwood_engine import Barriers, Blocks, Lines, LyingLogs, Scene, Shape, Trees

if TYPE_CHECKING:
    import geopandas
    import pyproj

    from deadwood_engine.result import Result


@dataclass(frozen=True)
class SceneLayers:
    """A prepared scene, with the ids of its arrays' rows in the layers."""

    dem: Grid
    scene: Scene
    friction: float | NDArray[np.float64]
    trees: Trees
    tree_ids: list[str]
    tree_dbh_cm: NDArray[np.float64]  # as in the layer: 29 cm over 100, times 100, is not 29
    trees_left_out: Counter[str]  # by reason: they stand off the DEM; stumps apart
    engine_barriers: Barriers  # the barriers as the engine takes them
    barriers: Items
    lines: Items
    engine_lines: Lines  # the lines as the engine takes them, before those that watch the window's sides
    lying_logs: LyingLogs
    lying: Items
    blocks: Boulders
    digest: str  # of every array that went into the scene
    # Sides of the DEM's window, and the lines along them, which the engine watches after those of the layer.
    watched: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    threads: int = 1  # as many as requested, or as fit in memory
    shape: Shape | None = None  # the body that slides instead of the logs
    breaking: Breaking | None = None  # the energy at which trees break; None: they do not
    stumps_left_out: Counter[str] = field(default_factory=Counter)

    def escaped(self, result: Result) -> list[str]:
        """The sides of the window that some log came too close to; the logs must be slid again in a wider one."""
        count = result.reach.shape[1] - len(self.watched)
        return [side for k, side in enumerate(self.watched) if result.reach[:, count + k].any()]

    def without_watch(self, result: Result) -> Result:
        """The result restricted to the lines of the layer."""
        count = result.reach.shape[1] - len(self.watched)
        return replace(result, reach=result.reach[:, :count], reach_time=result.reach_time[:, :count])

    def danger_bands(self) -> NDArray[np.int64]:
        """The band of danger, from 1, of each line that the engine watches; 0 for those along the window's sides."""
        return np.concatenate([self.lines.item + 1, np.zeros(len(self.watched), np.int64)])

    def by_scene_line(self, by_item: NDArray[np.bool_], *, sides: bool = False) -> NDArray[np.bool_]:
        """From (n, items) of the lines to (n, lines that the engine watches); ``sides`` : those of the window."""
        return np.pad(by_item[:, self.lines.item], ((0, 0), (0, len(self.watched))), constant_values=sides)

    def with_lines_first(self, engine_lines: Lines, items: Items) -> SceneLayers:
        """The scene with further lines, which come before its own."""
        engine_lines, items = engine_lines.then(self.engine_lines), items.then(self.lines)
        scene = self.scene.with_lines(_watched_too(engine_lines, self.watched))
        return replace(self, scene=scene, engine_lines=engine_lines, lines=items)

    def varied(
        self,
        *,
        heights: NDArray[np.float64] | None = None,
        friction: float | NDArray[np.float64] | None = None,
        trees: Trees | None = None,
    ) -> SceneLayers:
        """The scene with other heights [m], another friction or other trees in the same places; everything else is
        unchanged.

        The digest remains that of the layers.
        """
        return replace(
            self,
            dem=self.dem if heights is None else replace(self.dem, values=heights),
            friction=self.friction if friction is None else friction,
            trees=self.trees if trees is None else trees,
        ).prepared_again()

    def prepared_again(self) -> SceneLayers:
        """The scene prepared again from these arrays, after some of them were changed."""
        watched = _watched(self.dem, self.lying_logs, self.blocks.solid)
        engine_lines = _watched_too(self.engine_lines, watched)
        trees = self.with_capacity(self.trees)
        scene = _prepared(
            self.dem, self.friction, trees, self.engine_barriers, engine_lines, self.lying_logs, self.blocks.solid
        )
        return replace(self, scene=scene, watched=watched)

    def with_capacity(self, trees: Trees) -> Trees:
        """Trees in the engine's form for this scene: with the energy that each absorbs before it breaks, if they
        break.
        """
        return self.breaking.of(trees) if self.breaking else trees


def read_scene(
    dem: str,
    friction: str | float,
    trees: str | None,
    barriers: str | None,
    lines: str | geopandas.GeoDataFrame | None,
    *,
    crs: str | None,
    feedback: Feedback,
    lying_logs: str | None = None,
    lying_diameter_cm: float = 40.0,
    blocks: str | None = None,
    friction_column: str | None = None,
    friction_elsewhere: float | None = None,
    height_field: str | None = None,
    grid: Grid | None = None,
    breaking: Breaking | None = None,
) -> SceneLayers:
    """Read and check every layer except the releases, and prepare the engine's scene.

    ``grid`` is the DEM, or a window of it, if already read; likewise ``lines``.
    """
    from deadwood_algorithms.scene.lying_logs import read_lying_logs

    grid = grid or read_dem(dem, crs=crs, feedback=feedback)
    mu = read_friction(friction, grid, feedback, column=friction_column, elsewhere=friction_elsewhere)
    standing = read_trees(trees, grid, feedback)
    engine_barriers, barrier_items = read_barriers(barriers, grid, feedback, height_field)
    drawn = lines_layer(lines, grid.crs, feedback) if isinstance(lines, str) else lines
    engine_lines, line_items = lines_of(drawn, grid, feedback)
    lying, lying_items = read_lying_logs(lying_logs, grid, lying_diameter_cm, feedback)
    boulders = read_blocks(blocks, grid, feedback)
    watched = _watched(grid, lying, boulders.solid)
    stems = breaking.of(standing.trees) if breaking else standing.trees
    scene = _prepared(grid, mu, stems, engine_barriers, _watched_too(engine_lines, watched), lying, boulders.solid)
    # absent layers do not change the digest of a scene without them
    there = (*((boulders.solid,) if boulders.ids else ()), *((stems.capacity,) if breaking else ()))
    there += () if lying.capacity is None else (lying.capacity,)
    digest = digest_of(
        grid.values, [grid.cell, grid.x0, grid.y0], mu, stems[:4], engine_barriers, engine_lines, lying[:4], *there
    )
    return SceneLayers(
        grid,
        scene,
        mu,
        standing.trees,
        standing.ids,
        standing.dbh_cm,
        standing.left_out - standing.stumps_left_out,
        engine_barriers,
        barrier_items,
        line_items,
        engine_lines,
        lying,
        lying_items,
        boulders,
        digest,
        watched,
        breaking=breaking,
        stumps_left_out=standing.stumps_left_out,
    )


def _watched(grid: Grid, lying: LyingLogs, blocks: Blocks) -> Mapping[str, NDArray[np.float64]]:
    """Lines along the sides of a window.

    A lying log rests on all the terrain below it, so no log may touch one that the window's side cuts, nor a boulder
    whose centre is beyond the side.
    """
    return watched_sides(grid, beyond_m=max(_longest(lying), 0.5 * float(blocks.diameter.max(initial=0.0))))


def _prepared(
    grid: Grid,
    mu: float | NDArray[np.float64],
    trees: Trees,
    engine_barriers: Barriers,
    lines: Lines,
    lying: LyingLogs,
    blocks: Blocks,
) -> Scene:
    """The engine's scene on a grid."""
    frame = grid.frame
    return Scene.prepare(
        grid.values,
        grid.cell,
        frame.x0,
        frame.y0,
        friction=mu,
        trees=trees,
        barriers=engine_barriers,
        lines=lines,
        lying_logs=lying,
        blocks=blocks,
        first=grid.first,
        reference=0.0 if frame.part.cells > WHOLE_CELLS else None,  # not searched for in a large DEM
    )


def _watched_too(engine_lines: Lines, watched: Mapping[str, NDArray[np.float64]]) -> Lines:
    """The lines of the layer, then those that watch the sides of the window."""
    return engine_lines.then(*(Lines(side, np.array([0, len(side)])) for side in watched.values()))


def _longest(lying: LyingLogs) -> float:
    """Upper bound of the distance [m] between the farthest two vertices of any lying log's line."""
    lines = zip(lying.starts[:-1], lying.starts[1:], strict=True)
    return max((float(np.ptp(lying.vertices[a:b], axis=0).sum()) for a, b in lines), default=0.0)


class StandingTrees(NamedTuple):
    """Standing trees on the DEM, their ids as text, how many are left out (and how many of these are stumps), and
    their DBH as in the layer.
    """

    trees: Trees
    ids: list[str]
    left_out: Counter[str]
    dbh_cm: NDArray[np.float64]
    stumps_left_out: Counter[str] = Counter()  # noqa: RUF012  (never changed)


def read_trees(path: str | None, grid: Grid, feedback: Feedback) -> StandingTrees:
    if path is None:
        return StandingTrees(Trees.none(), [], Counter(), np.zeros(0))
    frame = read_vector(path, geometry=("point",), target_crs=grid.crs, what="trees", feedback=feedback)
    for name in ("dbh_cm", "height_m"):
        if name not in frame:
            raise UserError(
                f"{where_of(frame)}: the trees have no field '{name}'; "
                "deadwood-tool import-trees makes a trees layer of any table"
            )
    dbh_cm, height = (schema_column(frame, TREES.column(name)) for name in ("dbh_cm", "height_m"))
    for name, values in (("dbh_cm", dbh_cm), ("height_m", height)):
        warn_implausible(values, TREES.column(name), where_of(frame), feedback)
    x, y = plan_of(frame)
    on = points_on(grid, x, y)
    if not on.any():
        raise UserError(f"{path}: {none_of(len(frame), 'tree')} stands on the DEM{extent_words(x, y, grid)}")
    say_left_out(frame, ~on, "trees", feedback.note)
    ids = ids_of(frame, "tree_id")
    twins = shared_words(frame, "tree_id", ids.tolist())
    if twins:
        feedback.warn(
            f"{twins}; no result can distinguish them. deadwood-tool import-trees numbers them again", code="same-id"
        )
    trees = Trees(x[on], y[on], dbh_cm[on] / 100.0, height[on])
    low = ~on & (height < STUMP_BELOW_M)
    off = (why_left_out(grid, x[rows], y[rows]) for rows in (~on, low))
    return StandingTrees(trees, [str(each) for each in ids[on]], next(off), dbh_cm[on], next(off))


def read_barriers(
    path: str | None, grid: Grid, feedback: Feedback, height_field: str | None = None
) -> tuple[Barriers, Items]:
    """Barriers with their heights; rows of one barrier_id (without it: of one name) count as one, with a note.

    ``height_field`` names the field of the heights [m] if it has none of the usual names.
    """
    if path is None:
        return Barriers.none(), Items([], np.array([], object), np.array([], np.int64))
    frame = read_vector(path, geometry=("line",), target_crs=grid.crs, what="barriers", feedback=feedback)
    where, renamed = where_of(frame), height_field and named(height_field).plain in ALSO["height"]
    if height_field in frame:
        frame["height_m"] = frame[height_field]
    elif "height_m" not in frame or (height_field and not renamed):
        fix = (
            f"there is no field '{height_field}' (--height-field)"
            if height_field
            else "the field 'height_m' is missing"
        )
        raise UserError(
            f"{where}: {fix}; it has {field_names(frame)}; --height-field names the one with the barriers' heights in m"
        )
    height = schema_column(frame, BARRIERS.column("height_m"))
    warn_implausible(height, BARRIERS.column("height_m"), where_of(frame), feedback)
    paths = paths_of(frame, grid, "barrier", feedback)
    note_unnamed(frame, ("barrier_id", "name"), "barriers", "rename", feedback)
    items = items_of(frame, ("barrier_id", "name"), paths, feedback)
    return Barriers(paths.vertices, paths.starts, height[paths.item]), items


def read_lines(path: str | None, grid: Grid, feedback: Feedback, *, parameter: str = "lines") -> tuple[Lines, Items]:
    """The lines of a layer, which a parameter of the tool names."""
    found = lines_of(lines_layer(path, grid.crs, feedback) if path else None, grid, feedback)
    account(parameter, count_of_items(found[1]))
    return found


def lines_layer(path: str, crs: pyproj.CRS, feedback: Feedback) -> geopandas.GeoDataFrame:
    """A layer of lines and polygons, in the terrain model's CRS."""
    return read_vector(path, geometry=("line", "polygon"), target_crs=crs, what="lines", feedback=feedback)


def lines_of(frame: geopandas.GeoDataFrame | None, grid: Grid, feedback: Feedback) -> tuple[Lines, Items]:
    """Lines, or the outlines of polygons, whose reach is counted; rows of one line_id count as one.

    Without that field, rows with the same name do. Both are reported, as is the case that results identify lines by
    row.
    """
    if frame is None:
        return Lines.none(), Items([], np.array([], object), np.array([], np.int64))
    paths = paths_of(frame, grid, "line", feedback)
    warn_off_the_ground(frame, ("line_id", "name"), grid, feedback)
    note_unnamed(frame, ("line_id", "name"), "lines", "rename", feedback)
    return Lines(paths.vertices, paths.starts), items_of(frame, ("line_id", "name"), paths, feedback)
