"""The page behind a dialog's Help button: the tool's description with its picture and every parameter.

Written as HTML on request, in QGIS's language, so that it needs no web address and no network.
"""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from qgis.core import QgsProcessingUtils
from qgis.PyQt.QtCore import QUrl

from .definitions import help_of, is_hidden
from .finding import HERE
from .help_text import labelled, paragraphs
from .language import _, signs

# Pictures of results, as on the toolbox's site; packed into the zip (`plugin_zip`).
PICTURES = {
    "slide-logs": "view_3d.webp",
    "make-report": "report_map.webp",
    "compare-scenarios": "comparison.webp",
    "calibrate-friction": "calibration.webp",
    "site-barriers": "siting.webp",
    "vary": "tornado.webp",
}
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 52rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1 { margin-bottom: 0; } .summary { color: #555; margin-top: 0.2rem; } img { max-width: 100%; height: auto; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; vertical-align: top; padding: 0.35rem 0.6rem; border-bottom: 1px solid #ddd; }
code { font-size: 0.9em; }
@media (prefers-color-scheme: dark) {
  body { background: #1c1c1a; color: #e6e6e0; } .summary { color: #aaa; }
  th, td { border-color: #444; } a { color: #9cc4ff; }
}
"""


def page_of(tool: dict[str, Any]) -> str:
    """The address of a tool's page, which is written if it does not exist yet."""
    path = Path(QgsProcessingUtils.tempFolder()) / "deadwood_help" / f"{tool['name']}.html"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page(tool), encoding="utf-8")
    return QUrl.fromLocalFile(str(path)).toString()


def page(tool: dict[str, Any]) -> str:
    name = html.escape(tool["label"])
    text = "".join(f"<p>{each}</p>" for each in paragraphs(tool))
    command = _("On the command line: {command}").format(command=f"<code>deadwood-tool {tool['name']}</code>")
    return (
        f'<!DOCTYPE html><html><head><meta charset="utf-8"><title>{name}</title><style>{STYLE}</style></head><body>'
        f'<h1>{name}</h1><p class="summary">{html.escape(tool["summary"])}</p>{_picture(tool["name"])}{text}'
        f"{_table(tool)}<p>{command}</p></body></html>\n"
    )


def _picture(tool: str) -> str:
    path = HERE / "pictures" / PICTURES.get(tool, "")
    return f'<p><img src="{QUrl.fromLocalFile(str(path)).toString()}" alt=""></p>' if path.is_file() else ""


def _table(tool: dict[str, Any]) -> str:
    rows = []
    for each in tool["parameters"]:
        if is_hidden(each, tool):
            continue
        label = each["label"] + (f" [{each['unit']}]" if each["unit"] else "")
        cells = (
            html.escape(label),
            f"<code>{each['name'].upper()}</code>",
            html.escape(labelled(help_of(each), tool)),
            html.escape(_default(each["default"])),
        )
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    heads = (_("Parameter"), _("In scripts"), _("Meaning"), _("Default"))
    head = "".join(f"<th>{html.escape(each)}</th>" for each in heads)
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def _default(value: Any) -> str:
    """A default as the dialog has it: a list of numbers is typed there, and keeps its points."""
    if value is None or value is False:
        return ""
    if value is True:
        return "\N{CHECK MARK}"
    if isinstance(value, (list, tuple)):
        return ",".join(f"{each:g}" if isinstance(each, float) else str(each) for each in value)
    return signs(f"{value:g}") if isinstance(value, float) else str(value)
