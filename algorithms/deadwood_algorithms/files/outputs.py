"""Results that appear whole or not at all: written under a hidden name beside the final one, then renamed.

Everything that can be known before the work starts (an existing output, a folder that cannot be written to, another
run that writes the same output) is reported before it starts.
"""

from __future__ import annotations

import errno
import glob
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import date
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.files.input_files import files_of, made_from, places_of
from deadwood_algorithms.files.sqlite_files import beside, is_held
from deadwood_algorithms.params.tool import UserError

if TYPE_CHECKING:
    from filelock import BaseFileLock

STAGED, LOCK = ".partial-", ".lock"  # suffixes of the hidden names beside an output
REPLACED, WHOLE = "-old", "-whole"  # suffixes of a result about to be replaced, and of one about to appear
ASIDE = "-aside"  # suffix of a folder that holds a file about to be replaced, with those beside it
READ_WITH = (".aux.xml", ".msk", ".ovr")  # suffixes of files beside a GeoTIFF that would be read with a new one

# Errors of file systems without locks; there two runs into one output are not detected.
LOCKLESS = tuple(getattr(errno, name) for name in ("ENOLCK", "ENOTSUP", "EOPNOTSUPP", "ENOSYS") if hasattr(errno, name))
FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
FULL_WORDS = ("disk is full", "disk full", "no space left", "quota exceeded", "disk quota")
# Below this number of free bytes, a failed write of GDAL (which often gives no reason) is attributed to the disk.
NEARLY_FULL_BYTES = 256 * 1024

_unfinished: set[Path] = set()  # the hidden folders that this process is writing into


@contextmanager
def output_path(
    path: str | Path,
    overwrite: bool = False,
    *,
    suffix: str | None = None,
    inputs: Iterable[str | Path | None] = (),
    tool: str = "",
) -> Iterator[Path]:
    """Give a temporary path of the same name; on success it is moved to the final place, on failure nothing remains.

    Parameters
    ----------
    suffix : str, optional
        The only file ending accepted, such as ``.gpkg``.
    inputs : iterable of path
        The tool's inputs, which are never replaced, even with ``overwrite`` (`refuse_input`).
    tool : str
        The tool's name.
    """
    final = _real(path)
    if suffix and final.suffix.lower() != suffix:
        raise UserError(f"{path}: the output must be a {suffix} file; name it {final.with_suffix(suffix)}")
    inputs = [str(each) for each in inputs if each]

    def check() -> None:
        if final.is_dir():
            raise UserError(f"{path}: the output is a folder that exists, but must be a file")
        if _exists(final, path) and not overwrite:
            raise UserError(f"{path}: the output exists; --overwrite replaces it")
        _refuse_held(final, path)
        refuse_input(final, path, inputs, tool)

    with _staged(final, path, check) as folder:
        if (left := _left_beside(final)) and not overwrite:
            raise UserError(
                f"{left[0]}: this was left beside an earlier {final.name} and would be read as part of the new one; "
                "--overwrite removes it"
            )
        temporary = folder / final.name
        yield temporary
        for made in folder.iterdir():
            _flush(made)
        _refuse_held(final, path)  # somebody may have opened it in the meantime
        with _set_aside(final, folder.with_name(folder.name + ASIDE)):
            for made in sorted(folder.iterdir(), key=lambda each: each == temporary):  # the sidecars first
                os.replace(made, final.with_name(made.name))


@contextmanager
def output_folder(
    path: str | Path,
    overwrite: bool = False,
    *,
    inputs: Iterable[str | Path | None] = (),
    tool: str = "",
    foreign: Callable[[Path], list[str]] | None = None,
    warn: Callable[[str], None] = lambda _: None,
) -> Iterator[Path]:
    """Provide a temporary folder that takes the final place on success and disappears on failure.

    ``overwrite`` replaces only a folder whose ``manifest.json`` names this ``tool``, that is, an earlier result of it,
    without inputs in it: a mistake such as ``--output ~ --overwrite`` must not destroy anybody's files. If ``foreign``
    names files in it that are not the earlier result's own, it is kept under another name (`_kept_name`).
    """
    final = _real(path)
    inputs = [str(each) for each in inputs if each]

    def occupied() -> bool:
        if not _exists(final, path) or not final.is_dir():
            return _exists(final, path)
        inside = list(final.iterdir())
        half = any(_is_ours(each) and each.name.endswith(WHOLE) for each in inside)  # killed while it was filled
        return not half and any(not _is_ours(each) for each in inside)

    def check() -> None:
        if occupied() and not overwrite:
            raise UserError(f"{path}: the output exists; --overwrite replaces it")
        if occupied() and not (final / "manifest.json").is_file():
            raise UserError(
                f"{path}: the output exists and is not a result folder (no manifest.json); name another folder"
            )
        made_by = made_from(final).get("tool") if occupied() else None
        if tool and occupied() and made_by != tool:
            raise UserError(
                f"{path}: the output exists and is a result of {made_by or 'another program'}, which {tool} does not "
                "replace; name another folder"
            )
        if occupied():
            refuse_input(final, path, inputs, tool)
            for each in final.rglob("*.gpkg"):
                _refuse_held(each, path)
        if within and occupied():
            raise UserError(f"{path}: the result of a run that was killed has just been completed; run again")

    within = final.is_dir() and not occupied()
    with _staged(final / "x" if within else final, path, check) as folder:
        yield folder
        for made in folder.rglob("*"):
            if made.is_file():
                _flush(made)
        check()  # somebody may have put something there, or opened it, in the meantime
        if not final.is_dir():
            folder.chmod(0o777 & ~_umask())
            os.replace(folder, final)
        elif not occupied():  # created in advance, perhaps a mount point, which cannot be renamed: filled in place
            whole = folder.with_name(folder.name + WHOLE)
            os.replace(folder, whole)
            _fill(final, whole)
        else:
            others = foreign(final) if foreign else []
            old = _kept_name(final) if others else folder.with_name(folder.name + REPLACED)
            folder.chmod(0o777 & ~_umask())
            try:
                os.replace(final, old)
                os.replace(folder, final)
            finally:
                if not final.exists():  # interrupted between the two renamings
                    os.replace(old, final)
            if others:
                listed = ", ".join(others[:3]) + (f" and {len(others) - 3} more" if len(others) > 3 else "")
                warn(
                    f"{path}: the earlier result is kept as {old}, because it holds what {tool} did not write: {listed}"
                )
            else:
                shutil.rmtree(old, ignore_errors=True)


def _kept_name(final: Path) -> Path:
    """The name under which a folder is kept that cannot be replaced without loss."""
    dated = f"{final.name}.old-{date.today().isoformat()}"
    names = (final.with_name(dated if k == 1 else f"{dated}-{k}") for k in count(1))
    return next(each for each in names if not os.path.lexists(each))


def _real(path: str | Path) -> Path:
    """The place of an output: where a link of this name points to, so that the link stays one."""
    try:
        return Path(path).resolve() if Path(path).is_symlink() else Path(path)
    except RuntimeError as error:
        raise UserError(f"{path}: the output is a link that points to itself; name another") from error
    except (OSError, ValueError):  # a name too long, a NUL in it: reported when it is made
        return Path(path)


@contextmanager
def _staged(final: Path, named: str | Path, check: Callable[[], None]) -> Iterator[Path]:
    """A hidden folder beside ``final``, removed at the end; creating it verifies that the place is writable.

    ``check`` rejects an output that may not be replaced; it is called before anything is created, and again once no
    other run can write the same output.
    """
    check()
    made = [each for each in final.parents if not _exists(each, named)]
    lock = None
    try:
        final.parent.mkdir(parents=True, exist_ok=True)
        lock = _lock(final, named)
        if lock:  # nobody else owns the remains any more
            _tidy(final)
        check()
        folder = Path(tempfile.mkdtemp(prefix=_hidden(final, STAGED), dir=final.parent))
        _unfinished.add(folder)
    except BaseException as error:
        _unlock(lock)
        _remove_empty(made)
        if isinstance(error, OSError):
            raise _in_words(error, named, final.parent) from error
        raise
    try:
        (folder / "x").write_bytes(b"x")
        (folder / "x").unlink()
        yield folder
        made = []
    except UserError:
        raise
    except Exception as error:
        if _is_full(error, final.parent):
            raise UserError(
                f"{named}: the disk is full, nothing was written; free some space in {final.parent}"
            ) from error
        if isinstance(error, OSError) and error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise _in_words(error, named, final.parent) from error
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _unfinished.discard(folder)
        _unlock(lock)
        _remove_empty(made)


def remove_unfinished() -> list[Path]:
    """Remove what this process has written under hidden names, as it is about to end without tidying up.

    Gives what could not be removed, which the next run into the same output does.
    """
    for each in list(_unfinished):
        shutil.rmtree(each, ignore_errors=True)
    return [each for each in _unfinished if each.exists()]


def _remove_empty(folders: Iterable[Path]) -> None:
    for each in folders:
        if each.is_dir() and not any(each.iterdir()):
            each.rmdir()


def _tidy(final: Path) -> None:
    """Remove the remains of a killed run into this output, and finish the last step that it had begun."""
    for left in sorted(final.parent.glob(f"{glob.escape(_hidden(final, STAGED))}*")):
        if left.name.endswith(REPLACED) and not final.exists():
            os.replace(left, final)
        elif left.name.endswith(ASIDE):
            _put_back(final, left)
        elif left.name.endswith(WHOLE):
            _fill(final.parent, left)
        else:
            shutil.rmtree(left, ignore_errors=True)


@contextmanager
def _set_aside(final: Path, aside: Path) -> Iterator[None]:
    """Move a file aside together with those beside it that would be read with the file that takes its name (SQLite's
    of a GeoPackage, GDAL's of a GeoTIFF); all are moved back if none takes it."""
    left = _left_beside(final)
    if left:
        aside.mkdir()
    try:
        for each in ([final] if left and final.exists() else []) + left:
            with suppress(FileNotFoundError):  # the previous owner has just ended
                os.replace(each, aside / each.name)
        yield
    finally:
        if left:
            _put_back(final, aside)


def _left_beside(final: Path) -> list[Path]:
    named = [final.with_name(final.name + ending) for ending in READ_WITH if final.suffix.lower() in (".tif", ".tiff")]
    return [*beside(final), *(each for each in named if each.exists())]


def _put_back(final: Path, aside: Path) -> None:
    """What was moved aside returns to its place, unless another file has taken it; then it is deleted."""
    for each in sorted(aside.iterdir(), key=lambda each: each.name == final.name):
        if not final.exists():
            os.replace(each, final.with_name(each.name))
    shutil.rmtree(aside, ignore_errors=True)


def _refuse_held(final: Path, named: str | Path) -> None:
    if is_held(final):
        raise UserError(
            f"{named}: another program holds {final.name} open (such as QGIS); close it there, or name another output"
        )


def _fill(final: Path, whole: Path) -> None:
    """Move a complete result into an existing folder, the manifest last."""
    for made in sorted(whole.iterdir(), key=lambda each: each.name == "manifest.json"):
        os.replace(made, final / made.name)
    whole.rmdir()


def _hidden(final: Path, ending: str) -> str:
    return f".{final.name[:80]}{ending}"


def _is_ours(place: Path) -> bool:
    """Whether a hidden name is that of a lock or of an unfinished result, with which a folder still counts as empty."""
    return place.name.startswith(".") and (place.name.endswith(LOCK) or STAGED in place.name)


def _lock(final: Path, named: str | Path) -> BaseFileLock | None:
    """A lock on the output that ends with this process, however it ends; rejected if another run holds it."""
    from filelock import FileLock, Timeout

    place = final.with_name(_hidden(final, LOCK))
    lock = FileLock(place, timeout=0)
    for _ in range(3):
        try:
            lock.acquire()
            return lock
        except Timeout:
            if place.exists():
                raise UserError(
                    f"{named}: another run is writing this output now; wait until it ends, or name another output"
                ) from None
            # The other run has just ended, or nothing can be created here, which is detected next.
        except (OSError, NotImplementedError) as error:
            if isinstance(error, OSError) and error.errno not in LOCKLESS:
                raise
            break
    return None


def _unlock(lock: BaseFileLock | None) -> None:
    if lock is None:
        return
    place = Path(lock.lock_file)
    with suppress(OSError):  # while it is locked, so that nobody locks a file that no longer has a name
        place.unlink()
    lock.release()
    if os.name == "nt":  # where an open file cannot be removed, nor one that another run has opened since
        with suppress(OSError):
            place.unlink()


def _in_words(error: OSError, named: str | Path, folder: Path) -> UserError:
    if error.errno in FULL:
        return UserError(f"{named}: the disk is full, nothing was written; free some space in {folder}")
    why = error.strerror or str(error)
    return UserError(f"{named}: the folder {folder} cannot be written to ({why}); name an output in another one")


def _is_full(error: BaseException | None, folder: Path) -> bool:
    """Whether a failure, or its cause, is a full disk; GDAL and SQLite report it in words, or not at all."""
    library = False
    while error is not None:
        if isinstance(error, OSError) and error.errno in FULL:
            return True
        if any(word in str(error).lower() for word in FULL_WORDS):
            return True
        library = library or type(error).__module__.split(".")[0] in ("rasterio", "pyogrio", "pyarrow", "sqlite3")
        library = library or "read back" in str(error)
        error = error.__cause__ or error.__context__
    return library and shutil.disk_usage(folder).free < NEARLY_FULL_BYTES


def refuse_input(final: Path, named: str | Path, inputs: Sequence[str], tool: str) -> None:
    """Refuse to replace what a tool reads, a part of it, a folder that holds it, or a file of an existing result.

    An input is everything that its path stands for (tiles, sources of a VRT, companions); for a run's folder also that
    run's own inputs, because the logs may slide again. In such a folder a file is replaced only by the tool that made
    it.
    """
    if not final.exists():
        return
    for each in inputs:
        for place in places_of(each):
            read = [place, *files_of(place), *(Path(one) for one in _sources_of(place))]
            if any(_same_file(one, final) for one in read):
                raise UserError(f"{named}: the output is also an input, which is never replaced; name another file")
            if final.is_dir() and any(_lies_in(one, final) for one in read):
                raise UserError(f"{named}: the output holds the input {place}, which is never replaced; name another")
            if place.is_dir() and final.is_file() and _lies_in(final, place) and _made_by(final) != tool:
                raise UserError(
                    f"{named}: the output is a file of the input {place}, which is never replaced; name another file"
                )
    if final.is_file() and final.name in made_from(final.parent).get("files", {}) and _made_by(final) != tool:
        raise UserError(
            f"{named}: the output is a part of the result in {final.parent}, which would be damaged; name another file"
        )


def _sources_of(place: Path) -> Iterator[str]:
    """Sources of the result that is the input, or to which the input belongs."""
    parameters = made_from(place).get("parameters", {})
    for name, value in parameters.items() if isinstance(parameters, dict) else ():
        if name != "output" and isinstance(value, str) and os.path.isabs(value):
            yield from (str(each) for each in places_of(value))


def _made_by(final: Path) -> str:
    return str((record_in(final) or {}).get("tool", ""))


def _lies_in(place: Path, folder: Path) -> bool:
    try:
        return place.exists() and place.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError):
        return False


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.exists() and other.exists() and one.samefile(other)
    except (OSError, ValueError):  # a name too long, a NUL in it: reported when it is opened
        return False


def _exists(place: Path, named: str | Path) -> bool:
    try:
        return place.exists()
    except OSError as error:
        raise _in_words(error, named, place.parent) from error


def _flush(made: Path) -> None:
    """Flush a file to the disk before it gets its name: some file systems only then notice that they are full."""
    with made.open("rb+") as handle:
        os.fsync(handle.fileno())


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
