"""A run's folder: the content that `slide-logs` writes, and how the evaluating tools read it."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from os.path import isdir
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pyogrio
import pyproj
from numpy.typing import NDArray
from pyproj.exceptions import CRSError

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.identity import CHANGED, where_now
from deadwood_algorithms.files.input_files import MANIFEST
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.manifest import moved_paths
from deadwood_algorithms.params.renamed import with_new_names
from deadwood_algorithms.params.tool import VERSION, Feedback, UserError
from deadwood_algorithms.results.checked import read_manifest_of, read_summary
from deadwood_algorithms.results.identity import refuse_damaged

GEOPACKAGE, POSES = "run.gpkg", "poses.parquet"
# float32 is sufficient for these; positions in world coordinates need float64
SINGLE = ("speed_ms", "spin_rad_s", "clearance_m", "height_m")
POSE_COLUMNS = ("log_id", "t_s", *"xyz", "xb", "yb", "zb", "xt", "yt", "zt", *SINGLE)


def pose_schema(crs: pyproj.CRS | None = None) -> pa.Schema:
    """The columns of ``poses.parquet``; the CRS is in the file's metadata."""
    kinds = {name: pa.float32() if name in SINGLE else pa.float64() for name in POSE_COLUMNS} | {"log_id": pa.int64()}
    facts = {"crs": crs.to_wkt()} if crs else None
    return pa.schema(list(kinds.items()), metadata=facts)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Readable JSON; null instead of values that are not numbers, because NaN is not JSON."""
    path.write_text(json.dumps(_plain(content), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def link_or_copy(source: str, target: str) -> None:
    """Link or copy a file; a link avoids storing results twice."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(each) for each in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value


def layers_in(folder: Path) -> set[str]:
    """The layers that a run wrote into its GeoPackage."""
    return {str(name) for name in pyogrio.list_layers(folder / GEOPACKAGE)[:, 0]}


@dataclass(frozen=True)
class Run:
    """A run that was read back: its deposits (one row for each log), its grid without values, and its poses' place."""

    path: Path
    deposits: geopandas.GeoDataFrame
    grid: Grid
    manifest: dict[str, Any]
    stored_log_ids: NDArray[np.int64]
    changed: tuple[tuple[str, str], ...] = ()  # parameter and file of each changed input

    def part(self, name: str) -> Path:
        """A file of the run, verified to be the one that was written with it."""
        refuse_damaged(self.path, self.manifest, name)
        return self.path / name

    def summary(self, *needed: str) -> dict[str, Any]:
        """The content of ``summary.json``, verified to be complete."""
        return read_summary(self.path, self.manifest, *needed)

    @property
    def fidelity(self) -> str:
        """Name of the fidelity that the logs slid at: with --fidelity auto the one that was chosen."""
        name = str(self.manifest.get("parameters", {}).get("fidelity", "standard"))
        if name != "auto":
            return name
        return str(self.summary("accuracy")["accuracy"]["fidelity"])

    def poses(self, wanted: NDArray[np.int64]) -> Iterator[dict[str, NDArray]]:
        """Poses of the wanted logs in pieces of bounded size; no log is split between two pieces.

        Each piece holds the columns as arrays, and ``log_row``: the row of the log in ``deposits``.
        """
        order = np.argsort(self.deposits["log_id"].to_numpy())
        ids = self.deposits["log_id"].to_numpy()[order]
        source = parquet.ParquetFile(self.path / POSES)
        held: dict[str, NDArray] = {}
        for group in range(source.num_row_groups):
            piece = _columns(source.read_row_group(group))
            if held:
                piece = {name: np.concatenate([held[name], piece[name]]) for name in piece}
            last = group == source.num_row_groups - 1
            cut = piece["log_id"].size if last else int(np.argmax(piece["log_id"] == piece["log_id"][-1]))
            held = {name: column[cut:] for name, column in piece.items()}
            chosen = np.isin(piece["log_id"][:cut], wanted)
            out = {name: column[:cut][chosen] for name, column in piece.items()}
            if out["log_id"].size:
                out["log_row"] = order[np.searchsorted(ids, out["log_id"])].astype(np.int64)
                yield out

    def extent(self) -> tuple[float, float, float, float]:
        """West, south, east and north [m] of everything that the stored logs covered, from the file's own
        statistics.
        """
        facts = parquet.ParquetFile(self.path / POSES)
        columns = {name: POSE_COLUMNS.index(name) for name in ("xb", "yb", "xt", "yt")}
        groups = [facts.metadata.row_group(k) for k in range(facts.num_row_groups)]
        low, high = (
            {name: [getattr(group.column(at).statistics, end) for group in groups] for name, at in columns.items()}
            for end in ("min", "max")
        )
        thick = float(self.radii()[0].max(initial=0.0))
        west, south = (min(low[axis + "b"] + low[axis + "t"]) - thick for axis in "xy")
        east, north = (max(high[axis + "b"] + high[axis + "t"]) + thick for axis in "xy")
        return west, south, east, north

    def radii(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Base and tip radius of every log of the deposits [m]; the tip has half the diameter.

        A body of another shape (``--shape``) is replaced by its enclosing cylinder.
        """
        radius = self.deposits["dbh_cm"].to_numpy(np.float64) / 200.0
        cone = str(self.manifest.get("parameters", {}).get("shape", "cone")) == "cone"
        return radius, 0.5 * radius if cone else radius


def _columns(table: pa.Table) -> dict[str, NDArray]:
    return {name: table.column(name).to_numpy() for name in POSE_COLUMNS}


def ends_of(piece: Mapping[str, NDArray]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres of base and tip at each pose [m], shape (m, 3) each."""
    base, tip = (np.stack([piece[f"{axis}{end}"] for axis in "xyz"], axis=1) for end in "bt")
    return base, tip


def run_folder_of(layer: str) -> Path | None:
    """The run's folder that is named, or whose GeoPackage contains the layer; None for any other layer."""
    package = Path(layer.partition("|")[0])
    folder = package if package.is_dir() else package.parent
    is_of_run = (folder / MANIFEST).is_file() and (package.is_dir() or package.name == GEOPACKAGE)
    return folder if is_of_run else None


def read_run(path: str, *, feedback: Feedback) -> Run:
    """Open a run's folder, or report what is missing, damaged or belongs to another run; also reports changed
    inputs.
    """
    folder = Path(path)
    if not isdir(folder):  # False also of names that no file can have
        raise UserError(f"{path}: the run's folder does not exist; slide-logs makes such a folder")
    for name in (MANIFEST, GEOPACKAGE, POSES):
        if not (folder / name).is_file():
            raise UserError(f"{path}: this is not a folder of slide-logs, it has no {name}")
    manifest, grid = read_manifest(folder)
    for name in (GEOPACKAGE, POSES):
        refuse_damaged(folder, manifest, name)
    layer = f"{folder / GEOPACKAGE}|layername=deposits"
    deposits = read_vector(layer, geometry=("point",), target_crs=grid.crs, what="deposits", feedback=feedback)
    try:
        stored = parquet.read_table(folder / POSES, columns=["log_id"]).column("log_id").unique().to_numpy()
    except (pa.ArrowException, OSError) as error:
        raise UserError(
            f"{folder / POSES}: the trajectories cannot be read, perhaps the file was copied in part; copy it again, "
            "or run slide-logs again"
        ) from error
    changed = changed_inputs(folder, manifest)
    for parameter, file in changed:
        feedback.warn(
            f"{file}: this file, the {parameter.replace('_', ' ')} of the run {folder}, has changed since the logs "
            "slid, so it is no longer the file that the run used. Restore that file, or run slide-logs again",
            code="input-changed",
        )
    return Run(folder, deposits, grid, manifest, np.sort(stored.astype(np.int64)), changed)


def input_paths(run: Path, manifest: Mapping[str, Any], parameter: str) -> list[Path]:
    """Possible places of an input of a run: first where it is unchanged, then as named in the manifest, relative to
    the run's folder, or beside that.
    """
    named = str(manifest.get("parameters", {}).get(parameter) or "")
    if not named:
        return []
    if "," in named and not os.path.exists(named):  # tiles of a DEM
        moved = [input_paths(run, {**manifest, "parameters": {"tile": each}}, "tile") for each in named.split(",")]
        others = [Path(",".join(map(str, each))) for each in zip(*moved, strict=False)]
    else:
        others = [Path(named), *moved_paths(named, run, manifest.get("folder")), run.parent / Path(named).name]
    record = input_record(manifest, parameter)
    same = [Path(where_now(record, run, manifest.get("folder"))[0])] if record else []
    return list(dict.fromkeys([*same, *others]))


def input_record(manifest: Mapping[str, Any], parameter: str) -> dict[str, Any] | None:
    """The record of an input in a run's manifest; None if it was not given, and in manifests from before version
    0.3.
    """
    named = manifest.get("parameters", {}).get(parameter)
    records = (each for each in manifest.get("inputs", ()) if each["parameter"] == parameter)
    return next((each for each in records if each["path"] == named), None)


def changed_inputs(run: Path, manifest: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    """Parameter and file of each input of a run that exists, but has changed."""
    found = [(each["parameter"], *where_now(each, run, manifest.get("folder"))) for each in manifest.get("inputs", ())]
    return tuple((parameter, file) for parameter, _, stands, file in found if stands == CHANGED)


def read_manifest(folder: Path) -> tuple[dict[str, Any], Grid]:
    """The manifest of a run, and its grid without values."""
    manifest = read_manifest_of(folder)
    try:
        manifest["parameters"] = with_new_names("slide-logs", manifest.get("parameters", {}))
        facts = manifest["grid"]
        shape, crs = (int(facts["ny"]), int(facts["nx"])), pyproj.CRS.from_user_input(facts["crs"])
        cell, x0, y0 = (float(facts[name]) for name in ("cell", "x0", "y0"))
        if min(shape) < 1 or cell <= 0.0:
            raise ValueError(f"a grid of {shape[1]} x {shape[0]} cells of {cell:g} m")
        return manifest, Grid.empty(shape, cell, x0, y0, crs, str(folder))
    except (ValueError, KeyError, CRSError) as error:
        raise UserError(f"{folder / MANIFEST}: not the manifest of a run of slide-logs {VERSION} ({error})") from error


def chosen_logs(run: Run, *, release_id: str | None, log_id: str | None, stop_reason: str | None) -> NDArray[np.int64]:
    """The log_ids of a subset: comma-separated values of each column that was given, joined by AND."""
    chosen = np.ones(len(run.deposits), bool)
    for column, wanted in (("release_id", release_id), ("log_id", log_id), ("stop_reason", stop_reason)):
        if wanted is None:
            continue
        have = run.deposits[column].astype(str).to_numpy()
        names = [name.strip() for name in str(wanted).split(",") if name.strip()]
        unknown = [name for name in names if name not in have]
        if unknown or not names:
            known = sorted(set(have))
            listed = ", ".join(known[:10]) + (" ..." if len(known) > 10 else "")
            raise UserError(
                f"--{column.replace('_', '-')}: the run has no {column} '{', '.join(unknown)}'; it has {listed}"
            )
        chosen &= np.isin(have, names)
    return run.deposits["log_id"].to_numpy(np.int64)[chosen]
