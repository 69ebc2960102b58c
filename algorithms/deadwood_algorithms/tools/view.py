"""Open a run's report in the browser; if there is none yet, it is made and kept in the run's folder.

    deadwood-tool view my_case

The page is `report.html` in the folder, as `slide-logs --report` and `make-report` write it. It opens from the file
system; nothing is sent anywhere. An existing report is opened unchanged: `make-report --overwrite` renews it.
"""

from __future__ import annotations

import webbrowser
from dataclasses import dataclass
from pathlib import Path

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool
from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.tools import make_report

REPORT = "report.html"


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run, or of a demo", positional=True)
    language: str = tool.choice("Language of a page that has to be made", *LANGUAGES, default="en")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    page = Path(ask.run) / REPORT
    if not page.is_file():
        make_report.run(make_report.Ask(runs=ask.run, language=ask.language, output=str(page)), feedback)
    address = page.resolve().as_uri()
    if not webbrowser.open(address):
        feedback.note(f"no browser could be started; open {address} yourself")
    return Outcome({"output": page}, {"address": address})


TOOL = Tool("view", "Evaluate", "Open a run's report in the browser, made if missing", Ask, run, in_qgis=False)
