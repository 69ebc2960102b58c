"""Parameters of QGIS's dialogs from the declarations: one place for kinds, units, bounds, geometries and flags.

``log_radius`` of the declaration is LOG_RADIUS in QGIS. Enum members are spelt in full, which every QGIS from 3.22 to
4.x understands. Bounds only serve the dialog's spin boxes: what is out of them is refused by the tool, in its words.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputDefinition,
    QgsProcessingOutputFile,
    QgsProcessingOutputRasterLayer,
    QgsProcessingOutputVectorLayer,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterField,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterMapLayer,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
    QgsProcessingParameterVectorDestination,
)

Source = QgsProcessing.SourceType
GEOMETRIES = {
    "point": Source.TypeVectorPoint,
    "line": Source.TypeVectorLine,
    "polygon": Source.TypeVectorPolygon,
}
LARGEST_SPIN = 2**31 - 1  # of a spin box of whole numbers
DECIMALS = 4
OPEN = "OPEN_RESULTS"
LAYER = "_LAYER"  # ends the second parameter of a number that may be a layer


def definitions(told: dict[str, Any]) -> Iterator[QgsProcessingParameterDefinition]:
    """The parameters of one tool, in the order of its declaration; the outputs last, as QGIS shows them."""
    wanted = [each for each in told["parameters"] if not is_hidden(each, told)]
    for declared in sorted(wanted, key=lambda each: each["direction"] == "output"):
        made = _definition(declared)
        for each in made:
            each.setHelp(help_of(declared))
            if declared["advanced"]:
                each.setFlags(each.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
            yield each
        if declared["kind"] == "output_folder" and declared["required"]:
            opened = QgsProcessingParameterBoolean(OPEN, "Open the results in the map", defaultValue=True)
            opened.setHelp("Adds the layers of the folder to the map, styled and in a group of their own.")
            yield opened


def is_hidden(declared: dict[str, Any], told: dict[str, Any]) -> bool:
    """Whether QGIS asks for it itself: before it replaces a file, but not before it replaces a folder."""
    folders = (p["kind"] == "output_folder" and p["required"] for p in told["parameters"])
    return declared["name"] == "overwrite" and not any(folders)


def part_outputs(told: dict[str, Any]) -> Iterator[QgsProcessingOutputDefinition]:
    """What models chain on beside the output itself: the layers and rasters in a folder, the layers of a file."""
    for declared in told["parameters"]:
        for part in declared["parts"]:
            name, label = part_name(part).upper(), part_name(part).replace("_", " ").capitalize()
            if "|layername=" in part:
                yield QgsProcessingOutputVectorLayer(name, label)
            elif part.endswith(".tif"):
                yield QgsProcessingOutputRasterLayer(name, label)
            else:
                yield QgsProcessingOutputFile(name, label)


def part_name(part: str) -> str:
    return part.partition("|layername=")[2] or part.rpartition("/")[2].partition(".")[0]


def help_of(declared: dict[str, Any]) -> str:
    """The tooltip: the declaration's help, and the bounds."""
    low, high, unit = declared["minimum"], declared["maximum"], declared["unit"]
    limits = []
    if low is not None:
        limits.append(f"{'more than' if declared['exclusive'] else 'at least'} {low:g}")
    if high is not None and high < LARGEST_SPIN:
        limits.append(f"at most {high:g}")
    bounds = f"{', '.join(limits).capitalize()}{' ' + unit if unit else ''}." if limits else ""
    return " ".join(part for part in (declared["help"], bounds) if part)


def _definition(declared: dict[str, Any]) -> list[QgsProcessingParameterDefinition]:
    kind, name = declared["kind"], declared["name"].upper()
    label = declared["label"] + (f" [{declared['unit']}]" if declared["unit"] else "")
    optional, default = declared["optional"], declared["default"]
    if kind in ("number", "integer"):
        return [_number(declared, name, label, optional)]
    if kind == "number_or_layer":
        layer = QgsProcessingParameterMapLayer(
            name + LAYER,
            f"{declared['label']}, from a raster or polygons instead",
            optional=True,
            types=[Source.TypeRaster, Source.TypeVectorPolygon],
        )
        return [_number(declared, name, label, True), layer]
    if kind == "raster":
        return [QgsProcessingParameterRasterLayer(name, label, optional=optional)]
    if kind in ("vector", "table"):
        types = [GEOMETRIES[each] for each in declared["geometry"]] if kind == "vector" else [Source.TypeVector]
        return [QgsProcessingParameterFeatureSource(name, label, types=types, optional=optional)]
    if kind == "choice":
        choices = list(declared["choices"])
        made = QgsProcessingParameterEnum(
            name, label, options=choices, defaultValue=default, optional=optional, usesStaticStrings=True
        )
        return [made]
    if kind == "flag":
        return [QgsProcessingParameterBoolean(name, label, defaultValue=bool(default))]
    if kind == "field":
        return [QgsProcessingParameterField(name, label, None, declared["parent"].upper(), optional=optional)]
    if kind == "crs":
        return [QgsProcessingParameterCrs(name, label, optional=optional)]
    if kind == "folder":
        behaviour = QgsProcessingParameterFile.Behavior.Folder
        return [QgsProcessingParameterFile(name, label, behavior=behaviour, optional=optional)]
    if kind == "file":
        return [QgsProcessingParameterFile(name, label, optional=optional)]
    if kind.startswith("output_"):
        return [_output(declared, kind, name, label, optional)]
    return [QgsProcessingParameterString(name, label, defaultValue=default, optional=optional)]


def _number(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterNumber:
    whole = declared["kind"] == "integer"
    kinds = QgsProcessingParameterNumber.Type
    default = declared["default"]
    made = QgsProcessingParameterNumber(
        name,
        label,
        type=kinds.Integer if whole else kinds.Double,
        defaultValue=float(default) if isinstance(default, str) else default,
        optional=optional,
    )
    low, high = declared["minimum"], declared["maximum"]
    if low is not None:
        made.setMinimum(max(float(low), -LARGEST_SPIN) if whole else float(low))
    if high is not None or whole:
        made.setMaximum(min(math.inf if high is None else float(high), LARGEST_SPIN if whole else math.inf))
    if not whole:
        made.setMetadata({"widget_wrapper": {"decimals": DECIMALS}})
    return made


def _output(
    declared: dict[str, Any], kind: str, name: str, label: str, optional: bool
) -> QgsProcessingParameterDefinition:
    if kind == "output_raster":
        made = QgsProcessingParameterRasterDestination(name, label, optional=optional)
    elif kind == "output_vector":
        made = QgsProcessingParameterVectorDestination(name, label, optional=optional)
    elif kind == "output_folder":
        made = QgsProcessingParameterFolderDestination(name, label, optional=optional)
    else:
        made = QgsProcessingParameterFileDestination(name, label, fileFilter=_filter(declared), optional=optional)
    made.setCreateByDefault(not optional)
    return made


def _filter(declared: dict[str, Any]) -> str:
    return "CSV files (*.csv)" if declared["kind"] == "output_table" else "All files (*.*)"
