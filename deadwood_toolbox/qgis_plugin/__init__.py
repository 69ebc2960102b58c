"""The QGIS plugin of the Deadwood Toolbox: its tools in the Processing toolbox.

A thin shell: nothing here but the standard library and ``qgis``. The tools run in their own environment as child
processes, because QGIS's GDAL and PROJ and those of the toolbox's wheels do not share one interpreter. The dialogs are
made from ``manifest.json``, which ``deadwood-tool qgis-plugin`` writes from the tools' declarations.
"""

from __future__ import annotations

from typing import Any


def classFactory(iface: Any) -> Any:
    """The plugin; ``iface`` is None if QGIS has no window."""
    from .plugin import Plugin

    return Plugin(iface)
