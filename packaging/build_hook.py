"""Runs in every build and every editable install: writes ``deadwood_toolbox/functions.pyi`` from the declarations."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CustomBuildHook(BuildHookInterface):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        root = Path(self.root)
        sys.path[:0] = [str(root / each) for each in ("", "engine", "algorithms")]
        from deadwood_toolbox import functions_page

        functions_page.write()
        build_data["artifacts"].append("/deadwood_toolbox/functions.pyi")
