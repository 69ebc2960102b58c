"""The plugin's source is one that Qt 6 understands as well as Qt 5, as far as a look at the source can tell.

QGIS 4 cannot be installed from Debian yet. Qt 6 has the members of an enum only in the enum (``Qt.CheckState.Checked``,
not ``Qt.Checked``), no ``exec_``, no compiled resources, and its classes come from ``qgis.PyQt``.
"""

from __future__ import annotations

import ast
import configparser
from collections.abc import Iterator

import pytest

from deadwood_toolbox import translations

SOURCES = {path.name: path.read_text(encoding="utf-8") for path in sorted(translations.PLUGIN.glob("*.py"))}
# What may be named of a class of Qt or QGIS: the enum, or a class, within it.
WITHIN = {
    *("SourceType", "Type", "ExitStatus", "ProcessError", "StandardButton", "DataType"),
    *("ColorRampItem", "SaveVectorOptions", "LayerDetails", "ProviderOptions", "QAction", "QGraphicsView"),
}


def faults(source: str) -> Iterator[str]:
    tree = ast.parse(source)
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    modules = [each.module or "" for each in imports]
    modules += [each.name for node in ast.walk(tree) if isinstance(node, ast.Import) for each in node.names]
    yield from (f"import of {each}" for each in modules if each.split(".")[0] in ("PyQt5", "PyQt6", "PySide6", "sip"))
    of_qt = {
        each.asname or each.name for node in imports if (node.module or "").startswith("qgis") for each in node.names
    }
    attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    whole = {id(node.value) for node in attributes}
    for node in attributes:
        if node.attr in ("exec_", "print_"):
            yield node.attr
        known = isinstance(node.value, ast.Name) and node.value.id in of_qt
        if known and node.attr[0].isupper() and id(node) not in whole and node.attr not in WITHIN:
            yield ast.unparse(node)


@pytest.mark.parametrize("name", SOURCES)
def test_a_source_has_nothing_that_qt_6_lacks(name):
    assert list(faults(SOURCES[name])) == []


def test_what_qt_6_lacks_would_be_found():
    source = (
        "from PyQt5.QtCore import QTimer\nfrom qgis.PyQt.QtCore import Qt\nx = Qt.Checked\ny = Qt.CheckState.Checked\n"
    )
    assert list(faults(source + "dialog.exec_()\n")) == ["import of PyQt5.QtCore", "Qt.Checked", "exec_"]


def test_the_metadata_say_what_was_tested():
    """With 3.22, 3.40 and 3.44; an upper bound beyond 3 and the word about Qt 6 let QGIS 4 offer the plugin."""
    parser = configparser.ConfigParser()
    parser.read(translations.PLUGIN / "metadata.txt", encoding="utf-8")
    told = parser["general"]
    assert (told["qgisMinimumVersion"], told["qgisMaximumVersion"], told["supportsQt6"]) == ("3.22", "4.99", "True")
