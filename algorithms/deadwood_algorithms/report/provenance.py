"""Where a report's numbers come from: the command that repeats the run, digests, versions, and the cost."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Mapping
from typing import Any

from deadwood_algorithms.files.versions import lines as versions
from deadwood_algorithms.params.commands import command_line
from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.report.markup import element, scrolled
from deadwood_algorithms.report.rounded import shown_number
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.results.scenario import overridden_options


def provenance(source: ReportedRun, words: Words) -> list[Any]:
    """The section: the command, the digests of inputs and engine, the versions, the cost."""
    manifest, cost = source.run.manifest, source.summary["cost"]
    digests = manifest.get("digests", {})
    rows = [(input_words(name, words), file, element("code", digest)) for name, file, digest in source.inputs]
    rows += [
        (words.say(f"hash_{name}"), "", element("code", digests[name]))
        for name in ("scene", "releases")
        if digests.get(name)
    ]
    if engine := manifest.get("engine") or digests.get("engine"):
        rows.append((words.say("engine_digest"), "", element("code", engine)))
    head = [words.say("input"), words.say("file"), "SHA-256 / BLAKE2b"]
    cost_text = words.say(
        "cost_words",
        cpu=shown_number(cost["cpu_s"], words),
        wall=shown_number(cost["wall_s"], words),
        steps=shown_number(cost["steps"], words),
        rate=shown_number(cost["logs_per_s"], words),
        machine=f"{platform.system()} {platform.machine()}",
        cores=os.cpu_count(),
    )
    body = [element("tr", *(element("td", cell) for cell in row)) for row in rows]
    table_of = element(
        "table",
        element("thead", element("tr", *(element("th", each) for each in head))),
        element("tbody", *body),
        class_="words",
    )
    return [
        element("h4", words.say("command")),
        element("pre", *unbroken(command_of(manifest, source.summary))),
        element("h4", words.say("hashes")),
        scrolled(table_of, words.say("hashes"), short=False),
        element("h4", words.say("versions")),
        element("p", words.say("versions_run", version=manifest.get("version", VERSION), versions=versions_text())),
        element("h4", words.say("cost")),
        element("p", cost_text),
    ]


def command_of(manifest: Mapping[str, Any], summary: Mapping[str, Any]) -> str:
    """The command line that repeats a run; defaults are included, so that none can change unnoticed. Options that
    columns of the releases override are omitted, because they had no effect.
    """
    overridden = overridden_options(manifest, summary)
    given = {name: value for name, value in manifest.get("parameters", {}).items() if name not in overridden}
    return command_line(str(manifest.get("tool", "slide-logs")), given)


def unbroken(command: str) -> list[Any]:
    """A command line whose flags are not torn at a hyphen at the end of a line."""
    parts = re.split(r"(?<= )(--[\w-]+)", command)
    return [element("span", each, class_="whole") if k % 2 else each for k, each in enumerate(parts)]


def input_words(parameter: str, words: Words) -> str:
    """What an input is called: of some the name of its layer."""
    return words.say_or(f"input_{parameter}", words.say_or(f"model_{parameter}", parameter.replace("_", " ")))


def versions_text() -> str:
    return "; ".join(each.split(" (/")[0] for each in versions())
