"""The slope that tests share is in this folder; importlib mode leaves its place to us."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
