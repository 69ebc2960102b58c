"""The browser is a helper of this folder's tests; importlib mode leaves its place to us."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
