"""The report's catalogues brought up to date: ``python -m deadwood_toolbox.translations`` in a checkout.

Brings the messages of `phrases` into each language's ``report.po``: what is new, or has changed in English, comes
untranslated and is said in English until somebody has translated it; what is gone goes. Translators take the file into
any editor for gettext (Poedit). Needs Babel (the extra ``test``).
"""

from __future__ import annotations

from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po

from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.report.phrases import MESSAGES

PLACE = Path(__file__).parents[1] / "algorithms/deadwood_algorithms/report/locale"


def file_of(language: str) -> Path:
    return PLACE / language / "LC_MESSAGES" / "report.po"


def template() -> Catalog:
    """Every message, with its name as the context."""
    made = Catalog(charset="utf-8")
    for name, english in MESSAGES.items():
        made.add(english, context=name)
    return made


def updated(language: str) -> Catalog:
    """The catalogue of a language with the messages of today."""
    with file_of(language).open("rb") as file:
        found = read_po(file, locale=language)
    found.update(template(), no_fuzzy_matching=True, update_header_comment=False)
    found.obsolete.clear()
    return found


def write(catalogue: Catalog, file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("wb") as out:
        write_po(out, catalogue, width=110, omit_header=False)


def main() -> None:
    for language in LANGUAGES[1:]:
        write(updated(language), file_of(language))
        print(file_of(language))


if __name__ == "__main__":
    main()
