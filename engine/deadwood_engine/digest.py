"""Which engine this is: a digest of its sources and of the compiler's version, so that results tell whose they are.

What a run computes follows from these to the bit. So the digest names the kernels' cache, belongs in the manifest of
every run, and a run is resumed only by the engine that began it.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path


@cache
def engine_digest() -> str:
    """Digest of the engine's sources, comments and all, and of Numba's version: 16 hexadecimal digits (5 ms, once)."""
    digest = hashlib.sha256(version("numba").encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
