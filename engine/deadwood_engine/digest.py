"""Which engine this is: a digest of what its sources say to the machine and of the compiler's version.

What a run computes follows from these to the bit. So the digest names the kernels' cache, belongs in the manifest of
every run, and a run is resumed only by the engine that began it; the benchmark page says of which engine it is. It is
of the syntax trees without docstrings: an engine whose comments, docstrings or line breaks were edited is the same one,
under any version of Python.

To parse all sources takes a fifth of a second, to read them 5 ms. So which trees belong to which bytes is remembered in
the user's cache folder, where nobody else can write; where there is none, they are parsed at every start. This file
imports nothing of the engine: others load it by itself, without the compiler.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import tempfile
from collections.abc import Collection
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

REMEMBERED = "engine-digests"  # file of the cache folder: a line each engine's bytes, its digest, a checksum of both
_MOST = 50  # lines of it


def _is_ours(folder: Path) -> bool:
    """Whether it is a folder of this user, no link, that nobody else can write to. Windows keeps profiles apart."""
    seen = folder.lstat()
    if not stat.S_ISDIR(seen.st_mode):
        return False
    return not hasattr(os, "getuid") or (seen.st_uid == os.getuid() and not seen.st_mode & 0o022)


def private_folder(folder: Path) -> bool:
    """Make a folder that only this user can read and write, or make sure that it is one; False where it cannot be.

    One of the user's own that others could write to (an umask of 002 made such) is emptied: its files may be theirs.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        if not _is_ours(folder):
            if folder.is_symlink() or folder.lstat().st_uid != os.getuid():
                return False
            shutil.rmtree(folder)
            folder.mkdir(mode=0o700)
        folder.chmod(0o700)
        with tempfile.TemporaryFile(dir=folder):
            return _is_ours(folder)
    except OSError:
        return False


def user_folder() -> Path | None:
    """The folder of this user, and nobody else, for what the engine keeps between runs; None where there is none."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "deadwood-toolbox"
    if private_folder(base):
        return base
    base = Path(tempfile.gettempdir()) / f"deadwood-toolbox-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    return base if private_folder(base) else None


def _tell(node: Any, said: list[str]) -> None:
    """What a syntax tree says, apart from bare strings (docstrings); what is empty or None in a field is left out.

    ``ast.dump`` writes out what one version of Python has in its trees and the next one has not.
    """
    import ast

    if isinstance(node, ast.Constant):
        said.append(f"{type(node.value).__name__} {node.value!r};")
    elif isinstance(node, ast.AST):
        said.append(f"{type(node).__name__}(")
        for name in node._fields:
            value = getattr(node, name, None)
            if value is not None and value != []:
                said.append(f"{name}=")
                _tell(value, said)
        said.append(")")
    elif isinstance(node, list):
        said.append("[")
        for each in node:
            if not (isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant)):
                _tell(each, said)
        said.append("]")
    else:
        said.append(f"{node!r};")


def digest_of(folder: Path, compiler: str = "", without: Collection[str] = ()) -> str:
    """Digest of the syntax trees of an engine's sources, and of the compiler's version: 16 hexadecimal digits.

    without : names of files that are left out, where another digest has what they say
    """
    import ast

    digest = hashlib.sha256(compiler.encode())
    for source in sorted(folder.glob("*.py")):
        if source.name not in without:
            said: list[str] = []
            _tell(ast.parse(source.read_bytes()), said)
            digest.update(f"\n{source.name}\n{''.join(said)}".encode())
    return digest.hexdigest()[:16]


def _line(read: str, found: str) -> str:
    return f"{read} {found} {hashlib.sha256(f'{read} {found}'.encode()).hexdigest()[:16]}"


def _remembered(file: Path) -> list[str]:
    """Lines that are whole, oldest first."""
    try:
        lines = [line.split() for line in file.read_text(encoding="ascii").splitlines()]
    except (OSError, ValueError):
        return []
    return [" ".join(line) for line in lines if len(line) == 3 and _line(*line[:2]) == " ".join(line)]


@cache
def engine_digest() -> str:
    """Digest of this engine and of Numba's version: 16 hexadecimal digits (5 ms, once a process)."""
    folder, compiler = Path(__file__).parent, version("numba")
    names = sorted(folder.glob("*.py"))
    contents = [(source.name, hashlib.sha256(source.read_bytes()).hexdigest()) for source in names]
    read = hashlib.sha256(repr((compiler, contents)).encode()).hexdigest()
    base = user_folder()
    lines = _remembered(base / REMEMBERED) if base else []
    known = next((line.split()[1] for line in lines if line.startswith(read)), None)
    if known is not None:
        return known
    found = digest_of(folder, compiler)
    if base:
        new = base / f"{REMEMBERED}.{os.getpid()}"
        try:  # whole or not at all
            new.write_text("\n".join([*lines[1 - _MOST :], _line(read, found)]) + "\n", encoding="ascii")
            new.replace(base / REMEMBERED)
        except OSError:  # a full disk: parsed again next time
            new.unlink(missing_ok=True)
    return found
