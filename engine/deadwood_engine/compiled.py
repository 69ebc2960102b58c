"""Compilation: one decorator for every kernel, and a disk cache that notices edits in any file of the engine.

Numba's own cache checks only the file of the function itself, so a kernel that calls an edited kernel of another file
is served stale (measured: 3.0 instead of 300.0). Here the cache folder is named by a digest of the syntax trees of all
of the engine's sources (``digest``), so any change of code starts an empty one. It is in the user's cache folder, which
also works for read-only installations and leaves nothing behind in site-packages. Numba also names the files of a
kernel by its line number and drops them if their source is newer. For the engine's own kernels both are disabled
(``CheckedFiles.keep_by_name``), because the digest decides, and an edited comment leaves all kernels compiled.

The cache contains pickles and machine code, which are executed: the folder must therefore be private to the user
(``digest.private_folder``), and a file that differs from what was written (a full disk, a crash, a flipped bit) is
discarded and compiled again (``CheckedFiles``).
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

F = TypeVar("F", bound=Callable[..., Any])  # a kernel has the type of the function that it was made from


def _cache_folder() -> Path:
    """Folder of the kernels of this engine; those of engines older than the last few are removed."""
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
    """The folder named by the user, or the user's own; in both, the kernels of each engine are kept apart."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    return Path(named) / engine_digest() if named else _cache_folder()


CACHE_FOLDER = str(_chosen_folder())
_HERE = Path(__file__).parent


class CheckedFiles(IndexDataCacheFile):
    """Numba's files of one kernel, each with a checksum of its name and content; a file that does not match is treated
    as absent.
    """

    def keep_by_name(self, function: Callable[..., Any]) -> None:
        """Find the files of a kernel by its name and the version of Python, independent of its line number."""
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
    """Code of a kernel for its callers: linked into them unoptimised, and then optimised together with them."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _CalledCompiler(Compiler):
    """Compiles a kernel that only other kernels call: it is never called from Python, so no machine code is made for it
    alone.

    Numba compiles every called function to machine code, with wrappers, and then again into each of its callers. For
    these kernels, whose calls are nested twelve deep, that was half of the compile time (69 s, now 34 s; same bits).
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
        """Stands in for the executable, which Numba uses to tell overloads apart: a unique builtin."""
        library.finalize()
        return [].append


def kernel(function: F, inline: bool = False) -> F:
    """Compile for scalars and arrays: cached on disk, without the GIL, no fastmath (identical bits are guaranteed).

    Kernels allocate nothing, so Numba's reference counting is off: its atomic operations on every array passed to a
    kernel cost more than the kernels (measured: a step with contacts took 2 to 4 times as long).
    """
    previous = _settings.CACHE_DIR
    _settings.CACHE_DIR = CACHE_FOLDER  # read by Numba when it decorates; other users of Numba keep their own
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
    """A kernel that is inlined into its only caller, the time step.

    At every call Numba passes an array as seven to nine words, and a scene as some three hundred, on the stack. Without
    this, the same step, with the same bits, takes four fifths of the time (measured: 2.70 and 2.16 us).
    """
    return kernel(function, inline=True)
