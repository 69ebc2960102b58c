"""Join the results of pieces into one result, in the order of the pieces, and split them again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from deadwood_engine import Result


def joined_results(pieces: Sequence[Result]) -> Result:
    """The joined result; row numbers in its poses, hits and influences are shifted accordingly."""
    numbers = [len(each.stop_reason) for each in pieces]
    firsts = np.concatenate([[0], np.cumsum(numbers)[:-1]]).astype(np.int64)
    moved = [
        replace(
            each,
            poses=replace(each.poses, log_row=each.poses.log_row + first),
            hits=replace(each.hits, log_row=each.hits.log_row + first),
            influences=replace(each.influences, log_row=each.influences.log_row + first),
        )
        for each, first in zip(pieces, firsts, strict=True)
    ]
    one = moved[0]

    def together(get) -> dict:
        return {
            each.name: np.concatenate([getattr(get(piece), each.name) for piece in moved])
            for each in fields(get(one))
            if isinstance(getattr(get(one), each.name), np.ndarray)
        }

    return replace(
        one,
        **together(lambda piece: piece),
        poses=replace(one.poses, **together(lambda piece: piece.poses)),
        hits=replace(one.hits, **together(lambda piece: piece.hits)),
        influences=replace(one.influences, **together(lambda piece: piece.influences)),
        cost={name: sum(each.cost[name] for each in moved) for name in one.cost},
    )


def rows_of_result(result: Result, first: int, last: int) -> Result:
    """The result of the logs in rows first to last, the latter excluded; the cost is that of all logs."""

    def behind(table: Any) -> Any:
        mine = slice(*np.searchsorted(table.log_row, [first, last]))
        found = {each.name: getattr(table, each.name)[mine] for each in fields(table)}
        return replace(table, **{**found, "log_row": found["log_row"] - first})

    own = {each.name: getattr(result, each.name) for each in fields(result)}
    rows = {name: value[first:last] for name, value in own.items() if isinstance(value, np.ndarray)}
    tables = {name: behind(own[name]) for name in ("poses", "hits", "influences")}
    return replace(result, **rows, **tables)
