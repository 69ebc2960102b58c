"""Compilation: one decorator for every kernel, and a disk cache that sees edits in all of the engine's files.

Numba's own cache looks only at the file of the function itself, so a kernel that calls an edited kernel of another
file is served stale (measured: 3.0 instead of 300.0). Here the cache folder is named by a digest of all that the
engine's sources say (``digest``), so any edit of that starts an empty one. It lies in the user's cache folder, which
also serves read-only installs and leaves nothing behind in site-packages. Numba names a kernel's files by its line,
too, and drops them when their source is younger: those of the engine's own kernels are named without
(``CheckedFiles.keep_by_name``), for there the digest tells, and an edited comment leaves all kernels compiled.

What lies in the cache is pickles and machine code, which run: so it must be the user's alone
(``digest.private_folder``), and a file that is not what was written (a full disk, a crash, a flipped bit) is dropped
and compiled again (``CheckedFiles``).
"""

from __future__ import annotations

import atexit
import hashlib
import os
import pickle
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.caching import IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from .digest import engine_digest, user_folder

# Numba's settings have no type stubs
_settings: Any = vars(numba)["config"]
_KEPT_CACHES = 3

F = TypeVar("F", bound=Callable[..., Any])  # a kernel is called as what it was made of


def _cache_folder() -> Path:
    """The folder of this engine's kernels; those of engines before the last few are removed."""
    base = user_folder()
    if base is None:
        base = Path(tempfile.mkdtemp(prefix="deadwood-toolbox-"))
        atexit.register(shutil.rmtree, base, ignore_errors=True)
    current = base / engine_digest()
    current.mkdir(mode=0o700, exist_ok=True)
    os.utime(current)
    older = sorted((f for f in base.iterdir() if f.is_dir()), key=lambda f: f.stat().st_mtime, reverse=True)
    for stale in older[_KEPT_CACHES:]:
        shutil.rmtree(stale, ignore_errors=True)
    return current


def _chosen_folder() -> Path:
    """The one that the user names, or the user's own; in both, the kernels of each engine lie apart."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    return Path(named) / engine_digest() if named else _cache_folder()


CACHE_FOLDER = str(_chosen_folder())
_HERE = Path(__file__).parent


class CheckedFiles(IndexDataCacheFile):
    """Numba's files of one kernel, each behind a checksum of its name and what was written: what is not that is not
    there."""

    def keep_by_name(self, function: Callable[..., Any]) -> None:
        """Find the files of a kernel by what it is called and Python's version, whatever line it stands on."""
        name = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}".replace("<", "").replace(">", "")
        name = f"{name}.py{sys.version_info[0]}{sys.version_info[1]}"
        self._index_name, self._data_name_pattern = f"{name}.nbi", f"{name}.{{number:d}}.nbc"
        self._index_path, self._source_stamp = os.path.join(self._cache_path, self._index_name), None

    @staticmethod
    def _checksum(path: str, data: bytes) -> bytes:
        return hashlib.sha256(Path(path).name.encode() + b"/" + data).digest()

    def _keep(self, path: str, content: Any) -> None:
        data = self._dump(content)
        try:
            with self._open_for_write(path) as file:
                file.write(self._checksum(path, data) + data)
        except OSError:  # a full disk: the next run compiles again
            pass

    def _kept(self, path: str) -> Any:
        try:
            content = Path(path).read_bytes()
        except OSError:
            return None
        return pickle.loads(content[32:]) if self._checksum(path, content[32:]) == content[:32] else None

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._keep(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_index(self) -> dict[Any, str]:
        version, stamp, overloads = self._kept(self._index_path) or (None, None, {})
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_data(self, name: str, data: Any) -> None:
        self._keep(self._data_path(name), data)

    def _load_data(self, name: str) -> Any:
        return self._kept(self._data_path(name))


class _CalledLibrary(JITCodeLibrary):
    """Code of a kernel for those that call it: linked into theirs as it is, which is then optimised as a whole."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _CalledCompiler(Compiler):
    """Compiles a kernel that another one calls: nobody calls it from Python, so it is made no machine code of its own.

    Numba compiles every function that is called to machine code, with wrappers, and then once more into each that calls
    it. Of these kernels, which call each other twelve deep, that was half of the time (69 s, now 34; same bits).
    """

    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any, locals: Any
    ) -> None:
        library = _CalledLibrary(targetctx.codegen(), "called kernel")
        library.enable_object_caching()
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)
        self.state.targetctx.get_executable = self._get_executable

    @staticmethod
    def _get_executable(library: Any, fndesc: Any, env: Any) -> Any:
        """Stands for the executable, as what Numba tells overloads apart by: a builtin like no other."""
        library.finalize()
        return [].append


def kernel(function: F, inline: bool = False) -> F:
    """Compile for scalars and arrays: cached on disk, free of the GIL, no fastmath (the same bits are a promise).

    Kernels allocate nothing, so Numba's reference counting is off: its atomic operations on every array handed to a
    kernel cost more than the kernels (measured: a step with contacts took 2 to 4 times as long).
    """
    previous = _settings.CACHE_DIR
    _settings.CACHE_DIR = CACHE_FOLDER  # read by Numba when it decorates; other users of Numba keep theirs
    try:
        options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "forceinline": inline}
        compiled: Any = numba.njit(**options, cache=True)(function)
        files = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
        if files is not None:
            files.__class__ = CheckedFiles
            if Path(function.__code__.co_filename).parent == _HERE:
                files.keep_by_name(function)
            bare = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _CalledCompiler}
            called: Any = numba.njit(**options, **bare)(function)
            compiled.get_call_template, compiled.get_overload = called.get_call_template, called.get_overload
        return compiled
    finally:
        _settings.CACHE_DIR = previous


def inlined(function: F) -> F:
    """A kernel that is put into the one place of the step that calls it.

    Numba hands an array over as seven to nine words and a scene as some three hundred, on the stack, at every call;
    without that the same step, with the same bits, takes four fifths of the time (measured: 2.70 and 2.16 us).
    """
    return kernel(function, inline=True)
