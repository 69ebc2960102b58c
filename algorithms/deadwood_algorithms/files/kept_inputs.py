"""Inputs in a place that will not last, saved in the folder of the result, so that the result can be followed up.

Such are the layers that QGIS extracts from its map, its temporary outputs, what comes through a pipe, and data of a
Python program. Layers of GeoPackages become layers of one ``inputs.gpkg``, row by row, so that their digest
(`identity.content_of`) is the same; other files are copied. Of a virtual raster the recipe is copied, and only those
of its sources that will not last either.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from contextvars import ContextVar
from pathlib import Path
from xml.etree import ElementTree

from deadwood_algorithms.files.decoded import raster_files
from deadwood_algorithms.files.in_memory import FIXED_DAY
from deadwood_algorithms.files.input_files import files_of, source_elements
from deadwood_algorithms.files.sqlite_files import settled

VARIABLE = "DEADWOOD_TEMPORARY"  # a folder whose files vanish when the program that started the tool ends
PACKAGE = "inputs.gpkg"
REGISTERS = ("gpkg_contents", "gpkg_geometry_columns", "gpkg_spatial_ref_sys")

_folders: ContextVar[tuple[str, ...]] = ContextVar("_folders", default=())


@contextmanager
def lasting_no_longer_than_this(folder: str | Path) -> Iterator[None]:
    """In this context, inputs in ``folder`` are saved with the results that are made from them."""
    token = _folders.set((os.path.realpath(folder), *_folders.get()))
    try:
        yield
    finally:
        _folders.reset(token)


def is_temporary(place: str | Path) -> bool:
    """Whether a file or folder is in a place that will not last."""
    named = os.environ.get(VARIABLE)
    folders = [*_folders.get(), *([os.path.realpath(named)] if named else [])]
    return any(os.path.realpath(place).startswith(each + os.sep) for each in folders)


def save_input(named: str, parameter: str, folder: Path) -> str:
    """Save one input in the folder of a result; its path there, with its layer."""
    file, _bar, layer = named.partition("|")
    layer = layer.removeprefix("layername=")
    if file.lower().endswith(".gpkg") and (tables := _tables_of(Path(file), layer)):
        target = folder / PACKAGE
        if target.exists() and set(tables) & set(_tables_of(target)):  # another input has a layer of this name
            target = folder / f"inputs_{parameter}.gpkg"
        _add_layers(Path(file), tables, target)
        return f"{target}|layername={tables[0]}" if len(tables) == 1 else f"{target}"
    saved = _save_file(Path(file), f"inputs_{parameter}", folder)
    return f"{saved}|layername={layer}" if layer else f"{saved}"


def _tables_of(package: Path, layer: str = "") -> list[str]:
    """The layers of a GeoPackage, or the one that is named; none if it cannot be read."""
    try:
        with settled(package) as place, closing(sqlite3.connect(place)) as db:
            rows = db.execute("SELECT table_name FROM gpkg_contents WHERE data_type IN ('features', 'attributes')")
            return [name for (name,) in rows if layer in ("", name) and name != "layer_styles"]
    except sqlite3.Error:
        return []


def _add_layers(source: Path, tables: list[str], target: Path) -> None:
    """Add layers to a GeoPackage as they are, without the index of their extent."""
    with settled(source) as place, closing(sqlite3.connect(target, isolation_level=None)) as db:
        db.execute("ATTACH ? AS source", (str(place),))
        if not db.execute("SELECT 1 FROM sqlite_master").fetchone():
            for pragma in ("application_id", "user_version"):
                db.execute(f"PRAGMA {pragma} = {db.execute(f'PRAGMA source.{pragma}').fetchone()[0]}")
            for each in REGISTERS:
                _create(db, each)
        for table in tables:
            _create(db, table)
            quoted = '"' + table.replace('"', '""') + '"'
            db.execute(f"INSERT INTO main.{quoted} SELECT * FROM source.{quoted} ORDER BY rowid")
            _register(db, "gpkg_contents", "table_name = ?", table)
            _register(db, "gpkg_geometry_columns", "table_name = ?", table)
            _register(db, "gpkg_spatial_ref_sys", "? = ?", table, table)
        db.execute("UPDATE gpkg_contents SET last_change = ?", (FIXED_DAY,))


def _register(db: sqlite3.Connection, register: str, condition: str, *values: str) -> None:
    """Copy rows of a register, in the columns that both files have: of reference systems, some have more."""
    one, other = (
        [row[1] for row in db.execute(f"PRAGMA {schema}.table_info({register})")] for schema in ("main", "source")
    )
    columns = ", ".join(each for each in one if each in other)
    copied = f"SELECT {columns} FROM source.{register} WHERE {condition}"
    db.execute(f"INSERT OR IGNORE INTO main.{register} ({columns}) {copied}", values)


def _create(db: sqlite3.Connection, table: str) -> None:
    db.execute(db.execute("SELECT sql FROM source.sqlite_master WHERE name = ?", (table,)).fetchone()[0])


def _save_file(place: Path, name: str, folder: Path) -> Path:
    """Copy a file and those beside it from which it is read, under another name."""
    target = folder / f"{name}{place.suffix}"
    if place.suffix.lower() == ".vrt":
        _save_recipe(place, name, target)
        return target
    for each in dict.fromkeys([place, *raster_files(place), *files_of(place)]):
        if each.is_file():
            shutil.copyfile(each, folder / f"{name}{each.name.removeprefix(place.stem)}")
    return target


def _save_recipe(place: Path, name: str, target: Path) -> None:
    """Copy a virtual raster or layer; its sources are named in full, those that will not last are saved beside it."""
    tree = ElementTree.parse(place)
    for number, (element, source) in enumerate(source_elements(tree.getroot(), place.parent), 1):
        saved = _save_file(source, f"{name}_{number}", target.parent).name if is_temporary(source) else ""
        element.text = saved or os.path.abspath(source)
        element.set("relativeToVRT", "1" if saved else "0")
        element.attrib.pop("relativetoVRT", None)
    tree.write(target, encoding="utf-8")
