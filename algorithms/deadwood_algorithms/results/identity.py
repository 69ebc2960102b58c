"""Provenance of a result: its record, known before the work begins, and written into each output when that is complete.

All files of a tool are written through `writing`. It protects the inputs, which the tool's declaration names, hashes
them while the tool works, and puts the record into the folder's ``manifest.json``, which also seals every file
of the folder, or into a single file itself.

The ``run_id`` is a digest of what determines the bits: the tool, its version and the engine, the relevant parameters,
and the content of the inputs. Two results with the same one are identical, wherever they were made.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

from deadwood_algorithms.files import accounts, embedded, identity
from deadwood_algorithms.files.decoded import is_as_stored, rasters_in
from deadwood_algorithms.files.input_files import MANIFEST, files_of, made_from, places_of
from deadwood_algorithms.files.kept_inputs import is_temporary, save_input
from deadwood_algorithms.files.outputs import output_folder, output_path
from deadwood_algorithms.params import manifest as declared
from deadwood_algorithms.params.final_place import final_place, moving_to, saved_at, saved_place
from deadwood_algorithms.params.messages import Hearing, Message, messages_in, warnings_among
from deadwood_algorithms.params.tool import VERSION, Feedback, Tool, UserError

# Parameters that may change without changing any value of a result.
FREE = (
    "threads",
    "scheduler",
    "workers",
    "output",
    "overwrite",
    "resume",
    "restart",
    "plan",
    "plan_logs",
    "plan_workers",
    "report",
)
STYLES = (".qml", ".qgs", ".qgz")
# What GIS and desktops leave beside the files of a result, and make again.
LEFT_BY_PROGRAMS = (".aux.xml", "-wal", "-shm", "-journal", "~")
LEFT_BY_SYSTEMS = (".DS_Store", "Thumbs.db", "desktop.ini")
LIBRARIES = ("numpy", "numba", "rasterio", "pyogrio", "pyproj", "shapely", "geopandas", "pyarrow")
SAID_ANEW = ("left-dem",)  # warnings of a run that every tool makes of its own answer (`results/lost`)
RECORD = ("tool", "version", "engine", "run_id", "parameters", "inputs", "presets", "effective", "chosen", "warnings")


class Making:
    """One call of a tool, while its result is being made."""

    def __init__(self, tool: Tool, ask: Any) -> None:
        self.tool, self.ask = tool, ask
        self.began = datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
        self.given = declared.inputs_of(tool, ask)
        self.named = {name: value for name, value in self.given.items() if _may_be(tool, name, value)}
        self.facts: dict[str, Any] = {}  # what the tool adds to its record
        self.accounts: dict[str, dict[str, Any]] = {}  # what became of the rows of each layer, as the tool says it
        self.messages: list[Message] = []  # what the tool has said about its result so far
        self._saved: dict[str, str] = {}  # parameter -> where its input is saved with the result, until that is moved
        self._stamps = {name: _stamps(value) for name, value in self.named.items()}
        self._digests: dict[str, dict[str, Any]] = {}
        self._hashing = threading.Thread(target=self._hash, name="hash of the inputs", daemon=True)
        self._hashing.start()

    def _hash(self) -> None:
        for name, value in self.named.items():
            try:
                self._digests[name] = identity.of_input(value)
            except OSError:  # the tool itself reports what it cannot read
                self._digests[name] = {"layer": None, "sha256": None, "bytes": None}

    @cached_property
    def _described(self) -> dict[str, dict[str, Any]]:
        self._hashing.join()
        digests = {**self._digests, **{name: identity.of_input(value) for name, value in self._saved.items()}}
        return {name: {**digests[name], **identity.described(value)} for name, value in self.named.items()}

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """One entry an input: parameter, path, layer, SHA-256, bytes, rows, CRS, and what became of the rows."""
        counted = {name: {"counted": self.accounts[name]} for name in self.named if name in self.accounts}
        return [
            {"parameter": name, "path": _final(self.tool, name, self.named[name]), **said, **counted.get(name, {})}
            for name, said in self._described.items()
        ]

    @property
    def run_id(self) -> str:
        """Digest of everything that determines the bits; the fact ``chosen`` is what the tool itself decided while it
        worked.
        """
        self._hashing.join()
        values = {}
        for each in self.tool.parameters():
            value = getattr(self.ask, each.name)
            if each.is_output or each.name in FREE or value is None:
                continue
            digest = self._digests.get(each.name)
            if digest is not None:
                values[each.name] = digest.get("run_id") or digest.get("content") or digest["sha256"]
            else:
                values[each.name] = _as_number(value) if each.kind == "number_or_layer" else str(value)
        said = [self.tool.name, VERSION, declared.engine_digest(), values, self.facts.get("chosen")]
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]

    def changed(self) -> list[str]:
        """The inputs that were written to while the tool worked."""
        return [value for name, value in self.named.items() if _stamps(value) != self._stamps[name]]

    def manifest(self) -> dict[str, Any]:
        """The whole record, as in a folder's ``manifest.json``."""
        made = declared.manifest(self.tool, self.ask)
        said = {key: made.pop(key) for key in ("tool", "version", "engine")}
        where = {"run_id": self.run_id, "made_utc": self.began, "platform": _platform(), "libraries": _libraries()}
        dates = {name: when for name, stamps in self._stamps.items() if (when := _newest(stamps))}
        return {
            **said,
            **where,
            "modified_utc": dates,
            **made,
            "inputs": self.inputs,
            "warnings": self.warnings,
            **self.facts,
        }

    @property
    def warnings(self) -> list[dict[str, Any]]:
        """The notes and warnings about the result so far, as records."""
        return [each.record() for each in self.messages]

    def carried(self) -> dict[str, Any]:
        """The record within a file: without times, places of outputs and numbers of threads, so that two results that
        are equal have the same bytes."""
        whole = self.manifest()
        apart = {*FREE, *(each.name for each in self.tool.parameters() if each.is_output)}
        whole["parameters"] = {name: value for name, value in whole["parameters"].items() if name not in apart}
        return {key: whole[key] for key in RECORD if key in whole}


class Outputs(Making):
    """The outputs of a tool while it works, each of which appears complete and with its record, or not at all."""

    def __init__(self, tool: Tool, ask: Any, stack: ExitStack, feedback: Feedback) -> None:
        super().__init__(tool, ask)
        self.stack, self.feedback = stack, feedback

    def file(self, name: str, suffix: str | None = None) -> Path:
        """The place to which the file of an output parameter is written."""
        return self.stack.enter_context(self._file(getattr(self.ask, name), suffix))

    def optional_file(self, name: str, suffix: str | None = None) -> Path | None:
        return self.file(name, suffix) if getattr(self.ask, name) else None

    def folder(self, name: str = "output", *, replaces: bool = False) -> Path:
        """The place to which the files of an output folder are written; ``replaces``: as with ``--overwrite``."""
        return self.stack.enter_context(self._folder(getattr(self.ask, name), replaces=replaces))

    def optional_folder(self, name: str) -> Path | None:
        return self.folder(name) if getattr(self.ask, name) else None

    @property
    def overwrite(self) -> bool:
        return bool(getattr(self.ask, "overwrite", False))

    def _begin(self, place: str) -> None:
        """Once no other run can write the output: unfinished work of an earlier one is continued, or given up."""
        if hasattr(self.ask, "restart") and place == self.ask.output:
            from deadwood_algorithms.simulate.checkpoints import refuse_unfinished

            refuse_unfinished(place, resume=self.ask.resume, restart=self.ask.restart, feedback=self.feedback)

    @contextmanager
    def _file(self, place: str, suffix: str | None) -> Iterator[Path]:
        guard = {"inputs": self.given.values(), "tool": self.tool.name}
        with output_path(place, self.overwrite, suffix=suffix, **guard) as path:
            self._begin(place)
            token = embedded.MAKING.set(self.carried)
            try:
                yield path
            finally:
                embedded.MAKING.reset(token)
            if path.exists():
                embedded.embed(path, self.carried())

    def _save_inputs(self, folder: Path, place: str) -> dict[str, str]:
        """Save in a folder what will not last of the inputs, unless it will not last itself; where that will stand."""
        if place != self.ask.output or is_temporary(place):
            return {}
        found = {}
        for name, value in self.named.items():
            file = Path(value.partition("|")[0])
            if file.is_file() and is_temporary(file) and not saved_place(value):
                self._saved[name] = save_input(value, name, folder)
                saved, bar, layer = self._saved[name].partition("|")
                found[value] = final_place(saved) + bar + layer
        return found

    @contextmanager
    def _folder(self, place: str, *, replaces: bool) -> Iterator[Path]:
        guard = {"inputs": self.given.values(), "tool": self.tool.name}
        guard |= {"foreign": foreign_files, "warn": self.feedback.warn}
        with (
            output_folder(place, self.overwrite or replaces, **guard) as folder,
            moving_to(folder, place),
            saved_at(self._save_inputs(folder, place)),
        ):
            self._begin(place)
            yield folder
            manifest = {**self.manifest(), "files": seal_of(folder)}
            write_manifest(folder, {**manifest, "seal": embedded.seal_of_record(manifest)})


@contextmanager
def writing(tool: Tool, ask: Any, feedback: Feedback) -> Iterator[Outputs]:
    """Write the outputs of a tool, protected and with their record."""
    hearing = feedback if isinstance(feedback, Hearing) else Hearing(feedback)
    with ExitStack() as stack:
        outputs = Outputs(tool, ask, stack, hearing)
        outputs.messages = hearing.messages
        outputs.accounts = stack.enter_context(accounts.accounting())
        verify_inputs(tool, ask, hearing)
        yield outputs
        for each in outputs.changed():
            hearing.warn(
                f"{each}: this input was written to while {tool.name} worked, so it is not known what was read; run "
                f"again when it no longer changes",
                code="input-written",
            )


def verify_inputs(tool: Tool, ask: Any, feedback: Feedback) -> None:
    """Verify the inputs of a tool that are results themselves, and repeat what their own records warn of.

    What is read as a result (a file of a run, a layer of results, a map) is refused if it is not as it was written;
    of a layer of the scene, which users edit, the change is reported.
    """
    kinds = {each.name: each for each in tool.parameters()}
    for name, value in declared.inputs_of(tool, ask).items():
        for place in places_of(value):
            manifest = made_from(place)
            is_part = place.name in manifest.get("files", {})
            if is_part:
                refuse_damaged(place.parent, manifest, place.name)
            record = manifest if is_part or place.is_dir() else embedded.record_in(place) or {}
            if record is not manifest and record and embedded.state_of(place, record) == identity.CHANGED:
                made_by, run_id = record["tool"], record.get("run_id", "unknown")
                said = f"{place}: not as {made_by} wrote it (run {run_id})"
                if kinds[name].kind == "results" or (kinds[name].kind == "raster" and not kinds[name].path_like):
                    raise UserError(f"{said}; restore it, run {made_by} again, or export your change to a new file")
                feedback.warn(f"{said}: it was edited or damaged since; it is used as it is now", code="input-edited")
            for each in warnings_among(messages_in(record)):
                if each.code not in SAID_ANEW:
                    feedback.warn(f"{place.name}: {each.text}", code=each.code, **each.numbers)


@contextmanager
def result_folder(tool: Tool, ask: Any, feedback: Feedback, *, replaces: bool = False) -> Iterator[Path]:
    """Write the only output folder of a tool."""
    with writing(tool, ask, feedback) as outputs:
        yield outputs.folder(replaces=replaces)


def write_manifest(folder: Path, manifest: Mapping[str, Any]) -> None:
    text = json.dumps(manifest, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    (folder / MANIFEST).write_text(text, encoding="utf-8")


def seal_of(folder: Path) -> dict[str, dict[str, Any]]:
    """SHA-256 and size of every file of a result, by its path in the folder; of a GeoPackage also of its rows."""
    return {
        each.relative_to(folder).as_posix(): sealed(each)
        for each in sorted(folder.rglob("*"))
        if each.is_file() and each != folder / MANIFEST
    }


def sealed(path: Path) -> dict[str, Any]:
    facts: dict[str, Any] = {"sha256": identity.sha256_of(path), "bytes": path.stat().st_size}
    if path.suffix.lower() == ".gpkg":
        facts["content"] = identity.content_of(path)
    return facts


def is_whole(path: Path, seal: Mapping[str, Any]) -> bool:
    """Whether a file is the one that was sealed, and nothing beside it changes what is read from it.

    A GeoPackage may have been opened by QGIS meanwhile; how a layer is drawn (`STYLES`) is the user's to change.
    """
    try:
        if path.suffix.lower() in STYLES:
            return True
        wal = path.with_name(path.name + "-wal")
        held = wal.is_file() and wal.stat().st_size > 0
        if not held and path.stat().st_size == seal.get("bytes") and identity.sha256_of(path) == seal.get("sha256"):
            return path.suffix.lower() not in embedded.TIFFS or is_as_stored(path)
    except OSError:
        return False
    return seal.get("content") is not None and identity.content_of(path) == seal["content"]


def refuse_damaged(folder: Path, manifest: Mapping[str, Any], name: str) -> None:
    """Raise ``UserError`` if a file of a result is not the one that its manifest seals; older manifests have no
    seal.
    """
    files = manifest.get("files")
    if files is None:
        return
    place = folder / name
    if name not in files:
        raise UserError(f"{place}: this file is not of the result in {folder}, whose manifest does not name it")
    if not is_whole(place, files[name]):
        found = "is damaged, or of another run: it is not the one" if place.exists() else "is gone"
        raise UserError(
            f"{place}: the file {found} that {manifest.get('tool')} wrote (run {manifest.get('run_id', 'unknown')}); "
            f"restore it, or run {manifest.get('tool')} again"
        )


def damaged_files(folder: Path, manifest: Mapping[str, Any], names: Iterable[str] | None = None) -> list[str]:
    """The files of a result, or these of them, that have changed since they were sealed."""
    seals = manifest.get("files", {})
    return [name for name in (seals if names is None else names) if not is_whole(folder / name, seals[name])]


def foreign_files(folder: Path) -> list[str]:
    """The files in the folder of a result that the result did not write, or that somebody has changed since."""
    manifest = made_from(folder)
    seals = manifest.get("files", {})
    found = []
    for each in sorted(folder.rglob("*")):
        name = each.relative_to(folder).as_posix()
        made_again = each.name in LEFT_BY_SYSTEMS or any(
            name.endswith(ending) and name.removesuffix(ending) in seals for ending in LEFT_BY_PROGRAMS
        )
        if name == MANIFEST or made_again or (each.is_dir() and not each.is_symlink()):
            continue
        if name not in seals or each.is_symlink() or not _is_as_written(each, seals[name]):
            found.append(name)
    return found


def _is_as_written(path: Path, seal: Mapping[str, Any]) -> bool:
    if path.suffix.lower() in STYLES:
        return identity.sha256_of(path) == seal.get("sha256")
    return is_whole(path, seal)


def _stamps(named: str) -> list[Any]:
    return [
        (str(each), (identity.stamp_of(each) or (0,) * 5)[:4]) for place in places_of(named) for each in files_of(place)
    ]


def _may_be(tool: Tool, name: str, value: str) -> bool:
    """Whether the input can be what its path names: a folder in place of a file, which the tool refuses, is not walked
    through."""
    kind = next(each.kind for each in tool.parameters() if each.name == name)
    folders = [place for place in places_of(value) if place.is_dir() and place.suffix.lower() != ".gdb"]
    if kind in ("vector", "table", "file"):
        return not folders
    return kind not in ("raster", "number_or_layer") or all(rasters_in(each) for each in folders)


def _newest(stamps: list[Any]) -> str | None:
    """Time at which the newest of these files was last written."""
    times = [stamp[3] for _, stamp in stamps if stamp[3]]
    if not times:
        return None
    return datetime.fromtimestamp(max(times) // 10**9, UTC).isoformat().replace("+00:00", "Z")


def _final(tool: Tool, name: str, value: str) -> str:
    parameter = next(each for each in tool.parameters() if each.name == name)
    return str(declared.anywhere(parameter, value))


def _as_number(value: Any) -> Any:
    try:
        return float(value)
    except (TypeError, ValueError):
        return str(value)


def _platform() -> dict[str, Any]:
    return {
        "system": platform.system(),
        "release": platform.release(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


def _libraries() -> dict[str, str]:
    import pyproj
    import rasterio
    import shapely

    found = {name: metadata.version(name) for name in LIBRARIES}
    brought = {"gdal": rasterio.__gdal_version__, "proj": pyproj.proj_version_str, "geos": shapely.geos_version_string}
    return found | {name: str(value) for name, value in brought.items()}
