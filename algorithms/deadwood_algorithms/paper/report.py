"""The findings as a table of Markdown and of CSV, and as one page of HTML with the figures in it."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path

from deadwood_algorithms.paper.finding import Finding, Variation

STYLE = (
    "body{font:15px/1.45 system-ui,sans-serif;max-width:1150px;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;width:100%;font-size:13px}td,th{border:1px solid #ccc;padding:4px 7px;"
    "text-align:left;vertical-align:top}th{background:#eee}img{max-width:100%}.holds{background:#dbeef9}"
    ".does{background:#fbe0cf}.panel td{font-size:12px}@media print{body{margin:0}}"
)
COLUMNS = ("finding", "section", "the paper", "ours (95 %)", "verdict", "why")


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def ours(finding: Finding | Variation) -> str:
    if finding.ci_low is None and finding.ci_high is None:
        return _number(finding.ours)
    return f"{_number(finding.ours)} ({_number(finding.ci_low)} to {_number(finding.ci_high)})"


def cells(finding: Finding) -> tuple[str, ...]:
    return finding.statement, finding.section, finding.paper, ours(finding), finding.verdict, finding.why


def markdown(findings: Sequence[Finding]) -> str:
    rows = [("id", *COLUMNS), ("---",) * 7, *((f"`{each.id}`", *cells(each)) for each in findings)]
    table = "".join("| " + " | ".join(part.replace("|", "/") for part in row) + " |\n" for row in rows)
    return table + "".join(f"\n{panel_markdown(each)}" for each in findings if each.panel)


def panel_markdown(finding: Finding) -> str:
    """The findings with each chosen number changed, as a table of Markdown."""
    head = f"`{finding.id}` with one choice moved:\n\n| what is moved | ours (95 %) | verdict |\n| --- | --- | --- |\n"
    first = f"| nothing | {ours(finding)} | {finding.verdict} |\n"
    return head + first + "".join(f"| {each.what} | {ours(each)} | {each.verdict} |\n" for each in finding.panel)


def panels(findings: Sequence[Finding]) -> str:
    """The panel of sensitivity as a table of HTML: one row for each variation, the findings one after another."""
    shown = [each for each in findings if each.panel]
    if not shown:
        return ""
    rows = "".join(
        f'<tr class="{each.verdict.split()[0]}"><td>{escape(of.id)}</td><td>{escape(what)}</td>'
        f"<td>{escape(ours(each))}</td><td>{escape(each.verdict)}</td></tr>"
        for of in shown
        for what, each in (("nothing", of), *((part.what, part) for part in of.panel))
    )
    head = "".join(f"<th>{each}</th>" for each in ("finding", "what is moved", "ours (95 %)", "verdict"))
    title = "The same findings with one chosen number of the twin moved"
    return f'<h2>{title}</h2><table class="panel"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def write_report(folder: Path, findings: Sequence[Finding], head: str, figures: Sequence[tuple[str, Path]]) -> None:
    """``findings.json``, ``.csv``, ``.md``, ``sensitivity.csv``, and ``report.html``, which opens without a network."""
    import pandas

    from deadwood_algorithms.files.tables import write_csv

    plain = [asdict(each) for each in findings]
    (folder / "findings.json").write_text(json.dumps(plain, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    short = [{name: value for name, value in each.items() if name != "panel"} for each in plain]
    write_csv(folder / "findings.csv", pandas.DataFrame(short))
    moved = [{"id": each["id"], **part} for each in plain for part in each["panel"]]
    if moved:
        write_csv(folder / "sensitivity.csv", pandas.DataFrame(moved))
    (folder / "findings.md").write_text(markdown(findings), encoding="utf-8")
    rows = "".join(
        f'<tr class="{each.verdict.split()[0]}">'
        + "".join(f"<td>{escape(part)}</td>" for part in cells(each))
        + "</tr>"
        for each in findings
    )
    pictures = "".join(
        f'<h2>{escape(title)}</h2><img alt="{escape(title)}" src="data:image/png;base64,'
        f'{base64.b64encode(path.read_bytes()).decode()}">'
        for title, path in figures
    )
    columns = "".join(f"<th>{each}</th>" for each in COLUMNS)
    (folder / "report.html").write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>The paper, statement by statement</title><style>{STYLE}</style>"
        f"<h1>The paper, statement by statement</h1><p>{escape(head)}</p>"
        f"<table><thead><tr>{columns}</tr></thead><tbody>{rows}</tbody></table>{panels(findings)}{pictures}</html>\n",
        encoding="utf-8",
    )
