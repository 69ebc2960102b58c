"""Identity of the engine: a digest of the syntax trees of its sources and of the compiler's version.

These determine the results of a run to the bit. The digest therefore names the cache of the kernels and is part of the
manifest of every run; a run is resumed only by the engine that started it, and the benchmark page states its
engine. It is made from the syntax trees without docstrings and without the messages of errors: editing comments,
docstrings, messages or line breaks does not change it, under any version of Python.

Parsing all sources takes a fifth of a second, reading them 5 ms. The digest that belongs to given bytes is therefore
stored in the user's cache folder, to which nobody else can write; without such a folder, the sources are parsed at
every start. This file imports nothing from the engine: others load it alone, without the compiler.
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
_MOST = 50  # file in the cache folder, a line per engine: hash, digest, checksum


def _is_ours(folder: Path) -> bool:
    """Whether it is a folder of this user, not a link, and private to it. Windows keeps profiles separate."""
    seen = folder.lstat()
    if not stat.S_ISDIR(seen.st_mode):
        return False
    return not hasattr(os, "getuid") or (seen.st_uid == os.getuid() and not seen.st_mode & 0o022)


def private_folder(folder: Path) -> bool:
    """Create a folder that only this user can read and write, or verify that it is one; False if that is impossible.

    A folder of the user's to which others could write (created with an umask of 002) is emptied: its files may be
    theirs.
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
    """This user's private folder for what the engine keeps between runs; None if there is none."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "deadwood-toolbox"
    if private_folder(base):
        return base
    base = Path(tempfile.gettempdir()) / f"deadwood-toolbox-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    return base if private_folder(base) else None


def _tell(node: Any, said: list[str]) -> None:
    """Serialise a syntax tree without bare strings (docstrings) and without what an error says; fields that are empty
    or None are omitted.

    ``ast.dump`` is not used because its output depends on the version of Python.
    """
    import ast

    if isinstance(node, ast.Constant):
        said.append(f"{type(node.value).__name__} {node.value!r};")
    elif isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
        said.append("Raise ")
        _tell(node.exc.func, said)
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
    """Digest of the syntax trees of an engine's sources and of the compiler's version: 16 hexadecimal digits.

    without : names of files to omit, if another digest covers them
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
    """The intact lines, oldest first."""
    try:
        lines = [line.split() for line in file.read_text(encoding="ascii").splitlines()]
    except (OSError, ValueError):
        return []
    return [" ".join(line) for line in lines if len(line) == 3 and _line(*line[:2]) == " ".join(line)]


@cache
def engine_digest() -> str:
    """Digest of this engine and of Numba's version: 16 hexadecimal digits (5 ms, once per process)."""
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
        try:  # all or nothing
            new.write_text("\n".join([*lines[1 - _MOST :], _line(read, found)]) + "\n", encoding="ascii")
            new.replace(base / REMEMBERED)
        except OSError:  # a full disk: parsed again next time
            new.unlink(missing_ok=True)
    return found
