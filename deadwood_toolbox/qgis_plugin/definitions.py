"""Parameters of QGIS's dialogs from the declarations: one place for widgets, units, bounds, geometries and flags.

The toolbox determines the widget of a kind of parameter (``kinds.py``); `WIDGETS` has the available ones.

``log_radius`` of the declaration is LOG_RADIUS in QGIS. Enum members are spelt in full, which every QGIS from 3.22 to
4.x understands. Bounds only serve the dialog's spin boxes: values outside are rejected by the tool, with its message.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from qgis.core import (
    QgsApplication,
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

from .help_text import labelled, output_labels, output_names
from .language import _, signs, title_of
from .proposals import LAYERS

Source = QgsProcessing.SourceType
GEOMETRIES = {
    "point": Source.TypeVectorPoint,
    "line": Source.TypeVectorLine,
    "polygon": Source.TypeVectorPolygon,
}
# Declaration, name, label, whether it is optional -> the definition of a parameter, or a list of them.
Widget = Callable[[dict[str, Any], str, str, bool], Any]
LARGEST_SPIN = 2**31 - 1  # largest value of an integer spin box
DECIMALS = 4
OPEN = "OPEN_RESULTS"
LAYER = "_LAYER"  # suffix of the second parameter of a number that may be a layer


def definitions(tool: dict[str, Any]) -> Iterator[QgsProcessingParameterDefinition]:
    """The parameters of one tool: inputs and what can stand in their place first, the outputs last."""
    wanted = [each for each in tool["parameters"] if not is_hidden(each, tool)]
    instead = {each["unless"] for each in wanted}

    def place(declared: dict[str, Any]) -> tuple[int, bool]:
        first = 0 if declared["section"] == "Inputs" else 1 if declared["name"] in instead else 2
        return 3 if declared["section"] == "Outputs" else first, declared["direction"] == "output"

    for declared in sorted(wanted, key=place):
        made = _definition(declared)
        for each in made:
            each.setHelp(labelled(help_of(declared), tool))
            if declared["advanced"]:
                each.setFlags(each.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
            yield each
        if declared["widget"] == "output_folder" and declared["required"]:
            opened = QgsProcessingParameterBoolean(OPEN, _("Open the results in the map"), defaultValue=True)
            opened.setHelp(_("Adds the layers of the folder to the map, styled and in a group of their own."))
            yield opened


def is_hidden(declared: dict[str, Any], tool: dict[str, Any]) -> bool:
    """Whether QGIS itself asks the user for it: it asks before it replaces a file, but not a folder."""
    folders = (p["widget"] == "output_folder" and p["required"] for p in tool["parameters"])
    return declared["name"] == "overwrite" and not any(folders)


def part_outputs(tool: dict[str, Any]) -> Iterator[QgsProcessingOutputDefinition]:
    """Further outputs for models: the layers and rasters in a folder, the layers of a file."""
    labels = output_labels(tool, title_of)
    for part, name in output_names(tool).items():
        label = labels[part]
        if "|layername=" in part:
            yield QgsProcessingOutputVectorLayer(name, label)
        elif part.endswith(".tif"):
            yield QgsProcessingOutputRasterLayer(name, label)
        else:
            yield QgsProcessingOutputFile(name, label)


def help_of(declared: dict[str, Any]) -> str:
    """The tooltip: the declaration's help, and the bounds."""
    low, high, unit = declared["minimum"], declared["maximum"], declared["unit"]
    limits = []
    if low is not None:
        phrase = _("more than {low}") if declared["exclusive"] else _("at least {low}")
        limits.append(phrase.format(low=signs(f"{low:g}")))
    if high is not None and high < LARGEST_SPIN:
        limits.append(_("at most {high}").format(high=signs(f"{high:g}")))
    bounds = f"{', '.join(limits).capitalize()}{' ' + unit if unit else ''}." if limits else ""
    return " ".join(part for part in (declared["help"], bounds) if part)


def _definition(declared: dict[str, Any]) -> list[QgsProcessingParameterDefinition]:
    label = declared["label"] + (f" [{declared['unit']}]" if declared["unit"] else "")
    made = WIDGETS.get(declared["widget"], _text)(declared, declared["name"].upper(), label, declared["optional"])
    if declared["widget"] in LAYERS and not declared["optional"]:
        made.setMetadata({"widget_wrapper": likely(declared["name"])})
    return made if isinstance(made, list) else [made]


def likely(kind: str) -> dict[str, str]:
    """Metadata with which a dialog proposes the layer that is probably meant (`widgets.LikelyLayer`)."""
    return {"class": f"{__package__}.widgets.LikelyLayer", "kind": kind}


def _number_or_layer(
    declared: dict[str, Any], name: str, label: str, optional: bool
) -> list[QgsProcessingParameterDefinition]:
    layer = QgsProcessingParameterMapLayer(
        name + LAYER,
        _("{label}, from a raster or polygons instead").format(label=declared["label"]),
        optional=True,
        types=[Source.TypeRaster, Source.TypeVectorPolygon],
    )
    number = _number(declared, name, label, True)
    if declared["required"] or declared["unless"]:
        facts = {"class": f"{__package__}.widgets.NumberOrLayer", "decimals": DECIMALS}
        number.setMetadata({"widget_wrapper": facts})
    return [number, layer]


def _vector(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterDefinition:
    types = [GEOMETRIES[each] for each in declared["geometry"]]
    return QgsProcessingParameterFeatureSource(name, label, types=types, optional=optional)


def _choice(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterDefinition:
    return QgsProcessingParameterEnum(
        name,
        label,
        options=list(declared["choices"]),
        defaultValue=proposed(declared),
        optional=optional,
        usesStaticStrings=True,
    )


def proposed(declared: dict[str, Any]) -> Any:
    """The default of a choice: the tool's, except that pages are in QGIS's language if available."""
    language = QgsApplication.locale()[:2]
    return language if declared["name"] == "language" and language in declared["choices"] else declared["default"]


def _folder(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterDefinition:
    behaviour = QgsProcessingParameterFile.Behavior.Folder
    made = QgsProcessingParameterFile(name, label, behavior=behaviour, optional=optional)
    if declared["name"] == "run":
        made.setMetadata({"widget_wrapper": {"class": f"{__package__}.widgets.RunFolder"}})
    return made


def _results(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterString:
    """A text parameter for models and scripts; the dialog shows a list of folders, or of folders and files."""
    made = QgsProcessingParameterString(name, label, optional=optional)
    facts = {"class": f"{__package__}.widgets.FolderList", "files": declared["widget"] == "results"}
    made.setMetadata({"widget_wrapper": facts})
    return made


def _text(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterDefinition:
    return QgsProcessingParameterString(name, label, defaultValue=declared["default"], optional=optional)


def _number(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterNumber:
    whole = declared["widget"] == "integer"
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


def _numbers(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterString:
    """Numbers separated by commas, or from:to:step: a table without rows counts as missing, even as the default."""
    default = ",".join(f"{each:g}" for each in declared["default"] or ())
    return QgsProcessingParameterString(name, label, defaultValue=default or None, optional=optional or not default)


def _destination(make: Callable[..., QgsProcessingParameterDefinition], **facts: Any) -> Widget:
    """The widget of an output; an optional one is initially off."""

    def build(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterDefinition:
        made = make(name, label, optional=optional, **facts)
        made.setCreateByDefault(not optional)
        return made

    return build


def _file(declared: dict[str, Any], name: str, label: str, optional: bool) -> QgsProcessingParameterDefinition:
    """A file with the ending that the tool writes: temporary ones get it, too, and a page of HTML is shown by QGIS."""
    ending = declared["ending"]
    kind = _destination(QgsProcessingParameterFileDestination, fileFilter=f"{ending[1:].upper()} (*{ending})")
    return kind(declared, name, label, optional)


WIDGETS: dict[str, Widget] = {
    "raster": lambda tool, name, label, optional: QgsProcessingParameterRasterLayer(name, label, optional=optional),
    "vector": _vector,
    "table": lambda tool, name, label, optional: QgsProcessingParameterFeatureSource(
        name, label, types=[Source.TypeVector], optional=optional
    ),
    "folder": _folder,
    "file": lambda tool, name, label, optional: QgsProcessingParameterFile(name, label, optional=optional),
    "number_or_layer": _number_or_layer,
    "number": _number,
    "integer": _number,
    "numbers": _numbers,
    "choice": _choice,
    "flag": lambda tool, name, label, optional: QgsProcessingParameterBoolean(
        name, label, defaultValue=bool(tool["default"])
    ),
    "text": _text,
    "folders": _results,
    "results": _results,
    "field": lambda tool, name, label, optional: QgsProcessingParameterField(
        name, label, None, tool["parent"].upper(), optional=optional
    ),
    "crs": lambda tool, name, label, optional: QgsProcessingParameterCrs(name, label, optional=optional),
    "output_raster": _destination(QgsProcessingParameterRasterDestination),
    "output_vector": _destination(QgsProcessingParameterVectorDestination),
    "output_table": _file,
    "output_folder": _destination(QgsProcessingParameterFolderDestination),
    "output_file": _file,
}
