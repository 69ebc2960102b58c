"""Descriptions in a GeoPackage for other programs: a description of each layer, the meaning of each column and, for a
column with a unit, a title that shows it, the field's alias (Schema extension).

The texts are those of `schemas`; a user's columns that no schema knows have no description. GDAL reads comment and
alias from version 3.7 on, and so do programs built on it (QGIS).
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path

from deadwood_algorithms.schemas.words import Column
from deadwood_algorithms.schemas.written import column_named, layer_with

SPECIFICATION = "http://www.geopackage.org/spec120/#extension_schema"
TABLES = """
CREATE TABLE IF NOT EXISTS gpkg_extensions (table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL,
    definition TEXT NOT NULL, scope TEXT NOT NULL,
    CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name));
CREATE TABLE gpkg_data_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL, name TEXT, title TEXT,
    description TEXT, mime_type TEXT, constraint_name TEXT,
    CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name), CONSTRAINT gdc_tn UNIQUE (table_name, name));
CREATE TABLE gpkg_data_column_constraints (constraint_name TEXT NOT NULL, constraint_type TEXT NOT NULL, value TEXT,
    min NUMERIC, min_is_inclusive BOOLEAN, max NUMERIC, max_is_inclusive BOOLEAN, description TEXT,
    CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value));
"""
EXTENSION_TABLES = ("gpkg_data_columns", "gpkg_data_column_constraints")


def store_in(package: Path, layers: Mapping[str, Iterable[str]]) -> None:
    """Describe the layers of a GeoPackage that has just been written; each with the names of its columns."""
    with closing(sqlite3.connect(package)) as connection, connection:
        connection.executescript(TABLES)
        for table in EXTENSION_TABLES:
            connection.execute(
                "INSERT INTO gpkg_extensions VALUES (?, NULL, 'gpkg_schema', ?, 'read-write')", (table, SPECIFICATION)
            )
        for name, columns in layers.items():
            layer = layer_with(name, columns := list(columns))
            if layer is None:
                continue
            connection.execute("UPDATE gpkg_contents SET description = ? WHERE table_name = ?", (layer.meaning, name))
            known = {each: column for each in columns if (column := column_named(layer, each)) is not None}
            titles = {each: title_of(column, each) for each, column in known.items()}
            connection.executemany(
                "INSERT INTO gpkg_data_columns VALUES (?, ?, ?, ?, ?, NULL, NULL)",  # GDAL's alias is name, not title
                [(name, each, titles[each], titles[each], known[each].meaning) for each in known],
            )


def title_of(column: Column, name: str) -> str | None:
    """The column with its unit as a heading: ``runout_m`` is Runout [m]; None of one without a unit."""
    if not column.unit or column.unit == "1":
        return None
    words = name.removesuffix(f"_{column.unit_in_name}") if column.unit_in_name else name
    words = words.replace("_", " ").replace("dbh", "DBH")
    return f"{words[:1].upper()}{words[1:]} [{column.unit}]"
