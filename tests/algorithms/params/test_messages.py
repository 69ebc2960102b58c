"""What is said of a result is kept as records, each once, and repeated by what is made from it."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np

from deadwood_algorithms.params import messages
from deadwood_algorithms.params.messages import NOTE, WARNING, Hearing, Message, messages_in, warnings_among
from deadwood_algorithms.params.tool import Quiet, Stage

ROOT = Path(messages.__file__).parents[1]
# Warnings about the work, which two equal results may differ in; all others have a code
ABOUT_THE_WORK = {"checkpoints.py", "crew.py", "workers.py", "look.py", "server.py", "sites_plan.py"}
ABOUT_THE_WORK |= {"site_barriers.py"}


def test_messages_with_a_code_are_kept_and_passed_on_once(said):
    hearing = Hearing(said)
    for _ in range(2):
        hearing.warn("few", code="few-logs", logs=np.int64(3), share=np.float32(np.nan))
    hearing.note("taken", code="crs-assumed")
    hearing.warn("resumed")
    assert said.warnings == ["few", "resumed"]
    assert said.notes == ["taken"]
    expected = [Message("few-logs", "few", {"logs": 3, "share": None}), Message("crs-assumed", "taken", {}, NOTE)]
    assert hearing.messages == expected
    assert type(hearing.messages[0].numbers["logs"]) is int


def test_records_are_read_again_and_older_results_have_none():
    found = [Message("few-logs", "few", {"logs": 3}), Message("crs-assumed", "taken", {}, NOTE)]
    assert messages_in({"warnings": [each.record() for each in found]}) == found
    assert warnings_among(found) == found[:1]
    assert messages_in({}) == []
    assert messages_in({"warnings": [{"code": "a", "text": "b"}]}) == [Message("a", "b", {}, WARNING)]


def test_a_stage_keeps_the_code():
    hearing = Hearing(Quiet())
    Stage(hearing, "site 1").warn("few", code="few-logs", logs=3)
    assert hearing.messages == [Message("few-logs", "site 1: few", {"logs": 3})]


def test_every_warning_about_a_result_has_a_code():
    """Found in the sources, so that a new warning is not forgotten."""
    without = []
    for place in sorted(ROOT.rglob("*.py")):
        for each in ast.walk(ast.parse(place.read_text(encoding="utf-8"))):
            if isinstance(each, ast.Call) and isinstance(each.func, ast.Attribute) and each.func.attr == "warn":
                has = any(one.arg == "code" for one in each.keywords) or len(each.args) > 1
                if not has and place.name not in ABOUT_THE_WORK and "feedback" in ast.unparse(each.func):
                    without.append(f"{place.name}:{each.lineno}")
    assert without == []
