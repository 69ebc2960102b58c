"""Whether layers of release areas or of mapped deadwood describe wood that lies on the ground.

For `sample_releases`, which releases logs upright unless an option specifies otherwise.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.params.tool import Feedback

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pandas

POSTURE = "orientation"  # a layer with this column itself defines how its logs start


def lying_wood(path: str, rows: pandas.DataFrame, words_of_it: re.Pattern[str]) -> str | None:
    """The indication of lying wood: the layer's name, a column's name or its content; None if there is none."""
    if POSTURE in [str(each).lower() for each in rows.columns]:
        return None
    place, _, layer = path.partition("|layername=")
    named = layer.partition("|")[0] or Path(place).stem
    plain = ((called, re.sub(r"[_\W\d]+", " ", text.lower())) for called, text in _told(named, rows))
    return next((called for called, text in plain if words_of_it.search(text)), None)


def _told(named: str, rows: pandas.DataFrame) -> Iterator[tuple[str, str]]:
    """Each text to search, and its name in a message."""
    yield f"'{named}'", named
    for column in rows.columns:
        if column == "geometry":
            continue
        yield f"the field '{column}'", str(column)
        if rows[column].dtype == object or str(rows[column].dtype).startswith(("str", "category")):
            for value in rows[column].dropna().astype(str).unique():
                yield f"'{value}' in the field '{column}'", value


def warn_of_posture(lies: str | None, feedback: Feedback) -> None:
    """Warn of lying wood that is released upright; ``lies`` is the result of `lying_wood`."""
    if lies:
        feedback.warn(
            f"logs are released upright, as dead trees that stand (--orientation), but {lies} suggests lying wood; "
            "--orientation random-lying releases it lying, which changes how far logs go",
            code="posture-doubtful",
        )
