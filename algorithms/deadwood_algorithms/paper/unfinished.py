"""The hidden folder with the finished parts of a run of `reproduce-paper`, so that an interrupted run continues from
there.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import UserError


def open_work(work: Path, decided_by: Mapping[str, Any], *, resume: bool) -> Path:
    """The folder of finished scenarios; emptied unless resumed, rejected if begun with other inputs or options."""
    identity = {"version": tool.VERSION, "engine": engine_digest(), **decided_by}
    note = work / ".identity.json"
    if work.is_dir() and resume:
        before = read_note(note)
        changed = [name for name in identity if before.get(name) != identity[name]]
        if changed:
            raise UserError(
                f"--resume: the unfinished work in {work} was begun with other {', '.join(changed)}; give the same, "
                "or start again with --restart"
            )
        return work
    if work.is_dir():
        shutil.rmtree(work)
    work.mkdir(parents=True)
    note.write_text(json.dumps(identity), encoding="utf-8")
    return work


def read_note(note: Path) -> dict[str, Any]:
    """Content of a hidden note; empty if there is none, or it is damaged."""
    try:
        note_record = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return note_record if isinstance(note_record, dict) else {}
