"""Capacity of trees and logs: hits above it are counted, as a measure of how much results depend on rigid stems.

If a capacity is given, each hit in which a standing tree absorbs more energy than that, or a log loses more than it
could in any hit, is counted by tree and by log; the motion is unchanged. Where trees break (--break-trees), the hits in
which one broke are counted: it has absorbed exactly its capacity. The capacity of a stem is that of one of 40 cm DBH
times a power of DBH over 40 cm. The power is 2 unless given: bent to fracture over a lever arm that does not depend on
its diameter, a stem stores energy in proportion to its cross-section. The numbers are the user's: there is no default.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.scene.laws import capacity_of
from deadwood_algorithms.stats.endings import ended
from deadwood_algorithms.stats.statistics import percent_with_interval, reach_record

if TYPE_CHECKING:
    from deadwood_algorithms.scene.items import Items
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases

Array = NDArray[np.float64]

TREES_ABOVE, LOGS_ABOVE = "tree_hits_above", "log_hits_above"  # columns, one row for each log


@dataclass(frozen=True, kw_only=True)
class Capacity:
    """Energy that a stem of 40 cm DBH absorbs before it breaks [kJ], None if not requested, and the power."""

    tree_capacity_kj: float | None = None
    tree_capacity_power: float = 2.0
    break_trees: bool = False
    log_capacity_kj: float | None = None
    log_capacity_power: float = 2.0

    def __bool__(self) -> bool:
        return self.tree_capacity_kj is not None or self.log_capacity_kj is not None

    def of_trees(self, dbh_cm: Array) -> Array:
        """Capacity of each tree [J]; infinite if not requested."""
        return capacity_of(self.tree_capacity_kj, self.tree_capacity_power, dbh_cm)

    def of_logs(self, dbh_cm: Array) -> Array:
        return capacity_of(self.log_capacity_kj, self.log_capacity_power, dbh_cm)


@dataclass(frozen=True)
class Overloads:
    """Determines which hits of a chunk are above capacity.

    log_id : sorted; log_capacity : [J] in that order
    """

    capacity: Capacity
    log_id: NDArray[np.int64]
    log_capacity: Array

    @classmethod
    def of(cls, capacity: Capacity, releases: Releases) -> Overloads:
        order = np.argsort(releases.logs.log_id)
        return cls(capacity, releases.logs.log_id[order], capacity.of_logs(releases.dbh_cm[order]))

    def hits_above(self, hits: Any, log_id: NDArray[np.int64], layers: SceneLayers) -> tuple[NDArray, NDArray]:
        """bool (m,) each: hits above the capacity of the standing tree that is hit (or that broke), and of the log."""
        standing = ~hits.by_barrier & (hits.item < len(layers.tree_ids))
        tree = np.full(hits.item.shape, np.inf)
        tree[standing] = self.capacity.of_trees(100.0 * layers.trees.diameter)[hits.item[standing]]
        log = self.log_capacity[np.searchsorted(self.log_id, log_id)][hits.log_row]
        # a tree that breaks absorbs its capacity to rounding, so breaks cannot be identified by energy
        return hits.broke & standing if self.capacity.break_trees else hits.energy_taken > tree, hits.energy_taken > log


def overload_record(
    capacity: Capacity, lines: Items, by_log: Mapping[str, NDArray], touched: NDArray[np.bool_]
) -> dict[str, Any] | None:
    """Shares of the logs held by standing trees, and of those that reach each line, with a hit above capacity."""
    if not capacity:
        return None
    held = ended(by_log, "tree")
    groups = {"all": np.ones(held.size, bool), "held_by_trees": held}
    record: dict[str, Any] = dict(vars(capacity))
    for name, column, asked in (
        ("of_trees", TREES_ABOVE, capacity.tree_capacity_kj),
        ("of_logs", LOGS_ABOVE, capacity.log_capacity_kj),
    ):
        if asked is None:
            record[name] = None
            continue
        above = by_log[column] > 0
        shares = {each: _share(above, group) for each, group in groups.items()}
        reach = [{"line_id": each, **_share(above, touched[:, k])} for k, each in enumerate(lines.ids)]
        record[name] = {"n_hits": int(by_log[column].sum()), **shares, "reach": reach}
    return record


def _share(above: NDArray[np.bool_], group: NDArray[np.bool_]) -> dict[str, Any]:
    """The share of a group of logs with a hit above capacity, as a record."""
    found = reach_record(int((above & group).sum()), int(group.sum()))
    names = {"n_total": "n_logs", "n_reach": "n_above"}
    return {names.get(name, name): value for name, value in found.items()}


def as_share(record: dict[str, Any]) -> dict[str, Any]:
    """The record with the keys of a `reach_record`, for the functions that print those."""
    return {**record, "n_total": record["n_logs"], "n_reach": record["n_above"]}


def overload_lines(record: dict[str, Any] | None) -> list[str]:
    """How many logs have a hit above the capacity of stems: of those held by trees, and of those that reach each
    line.
    """
    shown = []
    for name, whose in (("of_trees", "a tree"), ("of_logs", "the log itself")):
        share = record[name] if record else None
        if not share:
            continue
        groups = {"logs that trees hold": share["held_by_trees"]}
        groups |= {f"logs that reach {each['line_id']}": each for each in share["reach"]}
        words = "; ".join(
            f"{percent_with_interval(as_share(each))} of the {each['n_logs']} {group}"
            for group, each in groups.items()
            if each["n_logs"]
        )
        if record and name == "of_trees" and record.get("break_trees"):
            shown.append(
                f"{counted(share['n_hits'], 'tree')} broke (each log meets all trees); one was broken by "
                f"{words or 'none'}"
            )
        else:
            shown.append(f"logs with a hit above the capacity of {whose}: {words or 'none'}")
    return shown
