"""Update the catalogues: ``python -m deadwood_toolbox.translations`` in a checkout.

``report.po`` has the messages of `phrases`, ``plugin.po`` the texts that QGIS shows: of the plugin, and of the tools'
declarations. New texts are untranslated and shown in English until somebody has translated them; obsolete ones are
removed. A text of the plugin whose English has changed slightly keeps its translation, marked as fuzzy: it is shown in
English until somebody has checked it and removed the mark. Translators open the files in any editor for gettext
(Poedit). Needs Babel (the extra ``test``).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_dir
from babel.messages.pofile import read_po, write_po

from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.files.styles import LABELS
from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.report.phrases import MESSAGES
from deadwood_algorithms.schemas import LAYERS
from deadwood_algorithms.schemas.looks import ENDS
from deadwood_toolbox import parameters
from deadwood_toolbox.qgis_plugin.help_text import pieces, short_name, title
from deadwood_toolbox.shelf import TOOLS

ROOT = Path(__file__).parents[1]
PLUGIN = ROOT / "deadwood_toolbox" / "qgis_plugin"


def report_messages() -> Catalog:
    """Every message of the report, with its name as the context."""
    made = Catalog(charset="utf-8")
    for name, english in MESSAGES.items():
        made.add(english, context=name)
    return made


def plugin_messages() -> Catalog:
    """Every text that QGIS shows; the comment names its first place."""
    made = Catalog(charset="utf-8")
    for file, _, english, _, _ in sorted(extract_from_dir(PLUGIN), key=lambda each: each[:2]):
        made.add(english, auto_comments=[file])
    for english in panel_phrases():
        made.add(english, auto_comments=["panel Explore"])
    for english in stages():
        made.add(english, auto_comments=["progress"])
    for english, where in declared_texts():
        if english and english not in made:
            made.add(english, auto_comments=[where], flags=["no-python-format", "no-python-brace-format"])
    return made


def stages() -> Iterator[str]:
    """The names of the stages of the tools' progress, from their sources."""
    for file in sorted((ROOT / "algorithms" / "deadwood_algorithms").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "progress":
                what = node.args[2] if len(node.args) == 3 else None
                if isinstance(what, ast.Constant) and isinstance(what.value, str):
                    yield what.value


def panel_phrases() -> Iterator[str]:
    """The phrases of the page of `explore` that the panel uses, by the names in its sources."""
    source = "".join(each.read_text(encoding="utf-8") for each in sorted(PLUGIN.glob("explore_*.py")))
    names = set(re.findall(r"[\"'](\w+)[\"']", source))
    beginnings = tuple(re.findall(r'f"(\w+_)\{', source)) + tuple(f"{name}_" for name in names)
    for name, english in PHRASES.items():
        if name in names or name.startswith(beginnings):
            yield english
    for label, *_ in ENDS.values():
        yield label


def declared_texts() -> Iterator[tuple[str, str]]:
    """The texts of each tool in QGIS (name, summary, paragraphs of the help, parameters), the titles of layers and the
    labels in their legends, each with its place.
    """
    for tool in TOOLS:
        if not tool.in_qgis:
            continue
        description = parameters.describe(tool)
        for name in ("group", "label", "summary"):
            yield description[name], f"{tool.name}: {name}"
        for parameter in description["parameters"]:
            for name in ("label", "help", "unit"):
                yield parameter[name], f"{tool.name} {parameter['flag']}: {name}"
            for part in parameter["parts"]:
                yield title(short_name(part, parameter["parts"])), "title of a layer or file"
        for piece in pieces(description["description"]):
            if not piece.startswith("    "):
                yield piece, f"{tool.name}: description"
    for name in LAYERS:
        yield title(name), "title of a layer or file"
    for label in LABELS:
        yield label, "legend"


@dataclass(frozen=True)
class Domain:
    """Messages that are translated together: ``FOLDER/LANGUAGE/LC_MESSAGES/NAME.po``."""

    name: str
    folder: Path
    template: Callable[[], Catalog]
    fuzzy: bool  # whether a slightly changed text keeps its translation, to be checked

    def file_of(self, language: str) -> Path:
        return self.folder / language / "LC_MESSAGES" / f"{self.name}.po"

    def updated(self, language: str) -> Catalog:
        """The catalogue of a language, updated with the present messages."""
        with self.file_of(language).open("rb") as file:
            found = read_po(file, locale=language)
        found.update(
            self.template(), no_fuzzy_matching=not self.fuzzy, update_header_comment=False, update_creation_date=False
        )
        found.obsolete.clear()
        return found


REPORT = Domain("report", ROOT / "algorithms/deadwood_algorithms/report/locale", report_messages, fuzzy=False)
PLUGIN_TEXTS = Domain("plugin", PLUGIN / "locale", plugin_messages, fuzzy=True)
DOMAINS = (REPORT, PLUGIN_TEXTS)


def write(catalogue: Catalog, file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("wb") as out:
        write_po(out, catalogue, width=110, omit_header=False)


def main() -> None:
    for domain in DOMAINS:
        for language in LANGUAGES[1:]:
            write(domain.updated(language), domain.file_of(language))
            print(domain.file_of(language))


if __name__ == "__main__":
    main()
