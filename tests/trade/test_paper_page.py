"""The page of the paper's findings: counts, the panel, and what moves a verdict, from findings made by hand."""

from __future__ import annotations

from typing import Any

from benchmarks import paper_page


def part(what: str, ours: float, verdict: str) -> dict[str, Any]:
    return {"what": what, "ours": ours, "ci_low": ours - 1.0, "ci_high": ours + 1.0, "verdict": verdict}


def finding(name: str, verdict: str, *panel: dict[str, Any]) -> dict[str, Any]:
    told = {"id": name, "statement": f"What {name} says", "section": "5", "paper": "2", "why": "runs a | b"}
    return told | {"ours": 2.5, "ci_low": None, "ci_high": None, "verdict": verdict, "panel": list(panel)}


HERE = [
    finding(
        "klosters.more",
        "does not hold",
        part("nothing", -3.0, "does not hold"),
        part("wide strips", 9.0, "holds"),
        part("rougher", -2.0, "does not hold"),
        part("another draw", 0.1, "not decided"),
    ),
    finding("klosters.less", "holds", part("nothing", 5.0, "holds"), part("wide strips", 6.0, "holds")),
    finding("rothenbrunnen.built", "cannot be judged here"),
    finding("klosters.more.cloud", "holds"),
]


def test_verdicts_are_counted_of_the_cone_alone() -> None:
    said = "Of 3 findings 1 hold, 1 do not hold, 0 are not decided, 1 cannot be judged here."
    assert paper_page.counted(HERE) == said


def test_the_table_has_a_row_a_finding_and_the_cloud_beside_it() -> None:
    rows = paper_page.table(HERE).splitlines()
    assert len(rows) == 2 + 3
    assert all(row.count("|") == 7 for row in rows)
    assert "| 2.5: **does not hold** | 2.5: **holds** |" in rows[2]
    assert "runs a / b *Cloud:* runs a / b" in rows[2]


def test_a_turned_verdict_is_bold_and_named() -> None:
    rows = paper_page.panel(HERE, "klosters").splitlines()
    assert rows[0] == "| klosters: what is changed | `more` | `less` |"
    assert rows[3] == "| wide strips | 9 (8 to 10): **holds** | 6 (5 to 7): holds |"
    assert rows[4] == "| rougher | -2 (-3 to -1): does not hold |  |"
    told = paper_page.moves(HERE).splitlines()
    assert told == [
        "- `klosters.more` (does not hold): holds with wide strips; not decided with another draw",
        "- `klosters.less` (holds): with none of them",
    ]
