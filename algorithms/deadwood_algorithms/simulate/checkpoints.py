"""The hidden working folder ``.NAME.part`` beside a run's folder, in which a run stores its finished chunks of logs.

An interrupted run continues from it with ``--resume``. A checkpoint contains the rasters after the chunks finished by
then; later chunks are slid again, so the resumed run equals the interrupted one, bit for bit.

Nothing in it is trusted without its seal: a digest, at the end of each file, of its content, its name and the
run's identity. A flipped bit, a truncated file, a chunk copied over another or from another run is therefore detected,
and its logs are slid again. The two last checkpoints are kept, so that a damaged one costs little.
"""

from __future__ import annotations

import glob
import hashlib
import io
import json
import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.input_files import MANIFEST
from deadwood_algorithms.params.run_options import AUTO
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.simulate.columns import Columns
from deadwood_algorithms.simulate.totals import Totals

IDENTITY = "identity.json"
SEAL_BYTES = hashlib.sha256().digest_size


class Damaged(UserError):
    """A file of the working folder has changed since it was written."""


class WorkFolder:
    """The finished chunks of a run, and the rasters after the last of them.

    finished : chunks whose logs are on the rasters; lost : those of them whose results are damaged
    draws : whether the run has rasters; one without counts a chunk as finished as soon as it is saved
    """

    def __init__(
        self, output: str, identity: Mapping[str, Any], *, resume: bool, feedback: Feedback, draws: bool = True
    ) -> None:
        self.path, self.draws = working_folder(output), draws
        self.finished = 0
        self.lost: frozenset[int] = frozenset()
        self._identity = json.dumps(dict(identity), sort_keys=True).encode()
        if self.path.is_dir() and resume:
            self._refuse_another(dict(identity), feedback)
            self._take_over(feedback)
        else:
            if self.path.is_dir():  # with nothing that could be continued (`refuse_unfinished`)
                shutil.rmtree(self.path)
            elif resume:
                feedback.note(f"{self.path}: there is no unfinished work to resume; the run starts from its beginning")
            self.path.mkdir(parents=True)
        written = {**identity, "seal": self._seal(IDENTITY, self._identity).hex()}
        _write_whole(self.path / IDENTITY, json.dumps(written, indent=1).encode())

    def _refuse_another(self, identity: dict[str, Any], feedback: Feedback) -> None:
        """Reject work that was begun with other inputs, parameters or code.

        If the file that records them is damaged, the seals of the chunks decide: those of another run do not fit.
        """
        before = _read_identity(self.path / IDENTITY)
        if before is None:
            feedback.warn(f"{self.path / IDENTITY} is damaged; only what certainly belongs to this run is reused")
            return
        changed = [name for name in identity if before.get(name) != identity[name]]
        if "engine" in changed:
            raise UserError(
                f"--resume: the unfinished work in {self.path} was begun by another engine ({before.get('engine')}, "
                f"version {before.get('version')}; this is {identity['engine']}, version {identity['version']}), and "
                f"two must not be mixed in one result; continue with that one, or start again with --restart"
            )
        if changed:
            raise UserError(
                f"--resume: the unfinished work in {self.path} was begun with other {', '.join(changed)}; "
                "give the same inputs and parameters, or start again with --restart"
            )

    def _take_over(self, feedback: Feedback) -> None:
        if not self.draws:
            while self._is_sound(_logs_name(self.finished)):
                self.finished += 1
            feedback.note(f"{self.path}: {self.finished} finished chunks of logs are reused")
            return
        numbers = [each.stem.removeprefix("rasters_") for each in self.path.glob("rasters_*.npz")]
        states = sorted((int(each) for each in numbers if each.isdecimal()), reverse=True)
        sound = [state for state in states if self._is_sound(_rasters_name(state))]
        self.finished = max(sound, default=0)
        self.lost = frozenset(
            chunk
            for chunk in range(self.finished)
            if not all(self._is_sound(name) for name in (_logs_name(chunk), _poses_name(chunk)))
        )
        feedback.note(f"{self.path}: {self.finished - len(self.lost)} finished chunks of logs are reused")
        if self.lost:
            feedback.warn(f"{self.path}: {len(self.lost)} finished chunks of logs are damaged and are slid again")
        if len(sound) < len(states):
            feedback.warn(f"{self.path}: a checkpoint is damaged; the logs since the one before it are slid again")

    def save(self, chunk: int, by_log: Mapping[str, NDArray], poses: pa.Table | None = None) -> None:
        """Store the results of a finished chunk; with rasters it counts as finished from the next `checkpoint` on."""
        self._write(_logs_name(chunk), _packed(by_log))
        if not self.draws:
            self.finished = max(self.finished, chunk + 1)
        if poses is None:
            return
        table = io.BytesIO()
        parquet.write_table(poses, table, compression="zstd")
        self._write(_poses_name(chunk), table.getvalue())

    def checkpoint(self, finished: int, rasters: Totals, grid: Grid) -> None:
        """Store the rasters after ``finished`` chunks: the cells that any log has passed.

        The cells are numbered in the whole DEM, of which ``grid`` may be a window.
        """
        found: dict[str, list[NDArray]] = {name: [] for name in ("cells", *rasters.names)}
        for first, strip in rasters.strips():
            row, column = np.nonzero((strip["hit_count"] > 0) | (strip["deposit_count"] > 0))
            found["cells"].append((row + first + grid.first[1]) * grid.frame.shape[1] + column + grid.first[0])
            for name, values in strip.items():
                found[name].append(values[..., row, column])
        part = np.array(astuple(grid.part), np.int64)
        sparse = {"part": part} | {name: np.concatenate(parts, axis=-1) for name, parts in found.items()}
        self._write(_rasters_name(finished), _packed(sparse))
        kept = (_rasters_name(finished), _rasters_name(self.finished))
        for old in self.path.glob("rasters_*.npz"):
            if old.name not in kept:
                _remove(old)
        self.finished = finished

    @property
    def part(self) -> Part | None:
        """The part of the DEM covered by the rasters of the last checkpoint."""
        return Part(*self._arrays(_rasters_name(self.finished))["part"].tolist()) if self.finished else None

    def rasters(self, grid: Grid) -> dict[str, NDArray]:
        """The rasters at the last checkpoint, on a grid that contains them; empty cells are 0 in counts, NaN in
        maxima.
        """
        stored = self._arrays(_rasters_name(self.finished))
        row, column = np.divmod(stored.pop("cells"), grid.frame.shape[1])
        del stored["part"]
        out: dict[str, NDArray] = {}
        for name, values in stored.items():
            shape = (*values.shape[:-1], *grid.shape)  # with several bands, the bands come first
            out[name] = np.full(shape, np.nan if values.dtype.kind == "f" else 0, values.dtype)
            out[name][..., row - grid.first[1], column - grid.first[0]] = values
        return out

    def chunk(self, chunk: int) -> dict[str, NDArray]:
        """The results of a finished chunk's logs."""
        return self._arrays(_logs_name(chunk))

    def once(self, name: str, make: Callable[[], Mapping[str, NDArray]]) -> dict[str, NDArray]:
        """Arrays beside the chunks: made once, stored, and reused when the run is resumed."""
        file = f"{name}.npz"
        if not self._is_sound(file):
            self._write(file, _packed(make()))
        return self._arrays(file)

    def by_log(self, by_row: Collection[str], order: NDArray[np.intp]) -> Columns:
        """The results of all finished logs, of which ``by_row`` has one row for each log; in the ``order`` that is
        wanted.
        """
        return Columns(self.path, (self.chunk(chunk) for chunk in range(self.finished)), by_row, order)

    def poses(self) -> Iterator[pa.Table]:
        """The kept poses, chunk by chunk in the order of the logs."""
        for chunk in range(self.finished):
            yield parquet.read_table(io.BytesIO(self._read(_poses_name(chunk))))

    def remove(self) -> None:
        shutil.rmtree(self.path, ignore_errors=True)

    def _seal(self, name: str, content: bytes) -> bytes:
        digest = hashlib.sha256(self._identity)
        digest.update(name.encode())
        digest.update(content)
        return digest.digest()

    def _write(self, name: str, content: bytes) -> None:
        _write_whole(self.path / name, content + self._seal(name, content))

    def _read(self, name: str) -> bytes:
        """The content of a file with a valid seal."""
        try:
            raw = (self.path / name).read_bytes()
        except (FileNotFoundError, IsADirectoryError):
            raw = b""
        content, seal = raw[:-SEAL_BYTES], raw[-SEAL_BYTES:]
        if seal != self._seal(name, content):
            raise Damaged(
                f"{self.path / name}: damaged since this run wrote it; run again with --resume: its logs are slid again"
            )
        return content

    def _is_sound(self, name: str) -> bool:
        try:
            self._read(name)
        except Damaged:
            return False
        return True

    def _arrays(self, name: str) -> dict[str, NDArray]:
        with np.load(io.BytesIO(self._read(name))) as stored:
            return {name: stored[name] for name in stored.files}


def part_path(output: str) -> Path:
    """The working folder of a run whose final place is ``output``."""
    final = Path(output).absolute()
    return final.parent / f".{final.name}.part"


def working_folder(output: str) -> Path:
    """`part_path`, unless there is a link or a file in its place, which the toolbox must not remove."""
    path = part_path(output)
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        what = "a link" if path.is_symlink() else "a file"
        raise UserError(f"{path}: this is {what}, where the unfinished work of a run is kept; remove or rename it")
    return path


def refuse_unfinished(output: str, *, resume: bool, restart: bool, feedback: Feedback) -> None:
    """Refuse to start where an earlier run left finished logs, unless it is continued or given up."""
    if resume and restart:
        raise UserError("--resume continues an interrupted run and --restart gives it up; give one of them")
    hidden = working_folder(output)
    name = glob.escape(hidden.name.removesuffix(".part"))
    folders = [hidden, *(each for end in ("", "-*") for each in hidden.parent.glob(f"{name}.{AUTO}{end}.part"))]
    unfinished = [each for each in folders if each.is_dir() and _holds_work(each)]
    if unfinished and not (resume or restart):
        raise UserError(
            f"{unfinished[0]}: an earlier run with this output was interrupted, and its finished logs are kept there; "
            "--resume continues it, --restart gives it up"
        )
    for each in folders if restart else ():
        shutil.rmtree(each, ignore_errors=True)
        feedback.note(f"{each}: the unfinished work of an earlier run is given up")


def _holds_work(folder: Path) -> bool:
    """Whether a working folder has anything that would be continued: a checkpoint, a step, or a whole run."""
    chunks = {each.stem.removeprefix("poses_") for each in folder.rglob("poses_*.parquet")}
    steps = (each for each in folder.rglob("logs_*.npz") if each.stem.removeprefix("logs_") not in chunks)
    return any(True for found in (folder.rglob("rasters_*.npz"), steps, folder.rglob(MANIFEST)) for _ in found)


def _logs_name(chunk: int) -> str:
    return f"logs_{chunk}.npz"


def _poses_name(chunk: int) -> str:
    return f"poses_{chunk}.parquet"


def _rasters_name(finished: int) -> str:
    return f"rasters_{finished}.npz"


def _read_identity(place: Path) -> dict[str, Any] | None:
    """The identity of a working folder's run; None if the file is missing or damaged.

    Up to version 0.1.0 nothing was sealed.
    """
    try:
        content = json.loads(place.read_bytes())
        seal = content.pop("seal", None)
        said = json.dumps(content, sort_keys=True).encode()
        if seal is None and content.get("version") == "0.1.0":
            return content
        sealed = hashlib.sha256(said + IDENTITY.encode() + said).hexdigest()
    except (OSError, ValueError, AttributeError, RecursionError):
        return None
    return content if seal == sealed else None


def _packed(arrays: Mapping[str, NDArray]) -> bytes:
    target = io.BytesIO()
    np.savez(target, **arrays)  # type: ignore[arg-type]
    return target.getvalue()


def _remove(place: Path) -> None:
    """Remove a file, or a folder that someone has put in its place."""
    if place.is_dir():
        shutil.rmtree(place)
    else:
        place.unlink()


def _write_whole(path: Path, content: bytes) -> None:
    """Write a file such that it has either its old content or the new one, even after a power failure."""
    beside = path.with_name(path.name + ".partial")
    with beside.open("wb") as target:
        target.write(content)
        target.flush()
        os.fsync(target.fileno())
    if path.is_dir():  # a file cannot replace a folder
        _remove(path)
    os.replace(beside, path)
    with suppress(OSError, AttributeError):  # Windows cannot open folders
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
