"""Which trees of a table live, which are dead but stand (snags: the releases), and which stand no more.

For `import_trees`. Codings differ (lidaRtRee ``e``, ``Live_dead``, NEON ``plantStatus``, SORTIE ``Type``); the words of
each are data of its `sources.Layout`.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees.columns import find
from deadwood_algorithms.prepare.trees.sources import Layout

if TYPE_CHECKING:
    import pandas

LIVE, DEAD, GONE = range(3)
NAMES = ("living", "dead, standing", "no longer standing")
WORDS_SHOWN = 8


def status_of(
    source: pandas.DataFrame, layout: Layout, asked: str | None, dead: str | None, gone: str | None, feedback: Feedback
) -> np.ndarray:
    """LIVE, DEAD or GONE for each row; ``dead`` and ``gone`` are the user's lists of codes, which replace the layout's.

    A word in neither list, and an empty cell, is a living tree; what was taken for what is noted.
    """
    name = find(source, asked, "--status-field", layout.status)
    if name is None:
        if dead or gone:
            raise UserError(f"{where_of(source)}: --dead-values and --gone-values need --status-field")
        return np.full(len(source), LIVE)
    words = [code_of(value) for value in source[name]]
    lists = {GONE: codes(gone) or layout.gone, DEAD: codes(dead) or layout.dead}
    if gone and not dead:
        lists = dict(reversed(lists.items()))  # what the user says goes before what the layout says
    status = np.full(len(words), LIVE)
    for kind, listed in lists.items():
        status[np.isin(np.array(words, object), np.array(listed, object))] = kind
    if asked or (status != LIVE).any():
        seen = Counter(zip(status.tolist(), words, strict=True))
        parts = []
        for kind, label in enumerate(NAMES):
            of_kind = [(word or "empty", count) for (its, word), count in seen.most_common() if its == kind]
            if of_kind:
                shown = ", ".join(f"{word}: {count}" for word, count in of_kind[:WORDS_SHOWN])
                parts.append(f"{label} ({shown}{', ...' if len(of_kind) > WORDS_SHOWN else ''})")
        feedback.note(f"{where_of(source)}, field '{name}': {'; '.join(parts)}")
    return status


def code_of(value: object) -> str:
    """A code as text in lower case; 3.0 is 3, an empty cell is empty."""
    if value is None or value != value:
        return ""
    if isinstance(value, (float, np.floating)) and float(value).is_integer():
        return str(int(value))
    return str(value).strip().lower()


def codes(text: str | None) -> tuple[str, ...]:
    """The codes of an option: separated by commas, or by semicolons where a code holds a comma."""
    parts = (text or "").split(";" if ";" in (text or "") else ",")
    return tuple(part.strip().lower() for part in parts if part.strip())
